#include <fmt/format.h>
#include <fmt/ranges.h>

#include "export/loop_language.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

/// "x_hat_" is m_xHat, "r_next" is rNext: as robot code in Java is written.
std::string java_name(std::string_view name) {
  const bool member = name.size() > 1 && name.back() == '_';
  std::string text = member ? "m_" : "";
  bool upper = false;
  for (const char c : name.substr(0, name.size() - (member ? 1 : 0))) {
    if (c == '_') {
      upper = true;
      continue;
    }
    text += upper && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    upper = false;
  }
  return text;
}

/// Every name of an expression as Java has it.
std::string java(std::string_view expression) {
  std::string text;
  for (std::size_t at = 0; at < expression.size();) {
    std::size_t end = at;
    while (end < expression.size() && is_word(expression[end])) {
      ++end;
    }
    const bool number = expression[at] >= '0' && expression[at] <= '9';
    if (end == at || number) {
      // A number's exponent is no name: 1.0e-5.
      text += expression[at];
      const std::size_t next = number ? std::max(end, at + 1) : at + 1;
      text += expression.substr(at + 1, next - at - 1);
      at = next;
      continue;
    }
    text += java_name(expression.substr(at, end - at));
    at = end;
  }
  return text;
}

class Java final : public BracesLanguage {
 public:
  [[nodiscard]] std::string constant(std::string_view name,
                                     const std::string& value) const override {
    return fmt::format("    final double {} = {};\n", java(name), java(value));
  }
  [[nodiscard]] std::string variable(std::string_view name,
                                     const std::string& value) const override {
    return fmt::format("    double {} = {};\n", java(name), java(value));
  }
  [[nodiscard]] std::string set(std::string_view target, const std::string& value) const override {
    return fmt::format("    {} = {};\n", java(target), java(value));
  }
  // Members, so that a period leaves nothing for the garbage collector.
  [[nodiscard]] std::string state(std::string_view name) const override {
    return fmt::format("    final double[] {0} = m_{0};\n", name);
  }
  [[nodiscard]] std::string copy(std::string_view target, std::string_view source) const override {
    return fmt::format("    System.arraycopy({}, 0, {}, 0, states);\n", java(source), java(target));
  }
  [[nodiscard]] std::string copy_if(const std::string& condition, std::string_view target,
                                    std::string_view source) const override {
    return fmt::format("    if ({}) {{\n  {}    }}\n", java(condition), copy(target, source));
  }
  [[nodiscard]] std::string clear(std::string_view member) const override {
    return fmt::format("    Arrays.fill({}, 0.0);\n", java(member));
  }
  [[nodiscard]] std::string for_each_on_the_way(std::string_view index,
                                                const std::string& lines) const override {
    return fmt::format("    for (int {0} = 1; {0} < onTheWay; ++{0}) {{\n{1}    }}\n", index,
                       indented(lines));
  }
  [[nodiscard]] std::string call(std::string_view function,
                                 const std::string& arguments) const override {
    const std::string_view name = function == "is_nan"         ? "Double.isNaN"
                                  : function == "cosine"       ? "Math.cos"
                                  : function == "usable_state" ? "usable"
                                                               : function;
    return fmt::format("{}({})", name, arguments);
  }
};

std::string java_declarations(const LoopProgram& program) {
  std::string text;
  for (const LoopConstant& constant : program.constants) {
    std::string value;
    std::string_view type = "double[]";
    if (constant.shape == LoopConstant::Shape::number) {
      type = "double";
      value = literal(constant.value(0, 0));
    } else if (constant.shape == LoopConstant::Shape::vector) {
      value = "{" + literals(constant.value) + "}";
    } else {
      type = "double[][]";
      for (Eigen::Index i = 0; i < constant.value.rows(); ++i) {
        value += fmt::format("{}{{{}}}", i == 0 ? "" : ", ", literals(constant.value.row(i)));
      }
      value = "{" + value + "}";
    }
    text += fmt::format("  private static final {} {} = {};  // {}\n", type, java(constant.name),
                        value, constant.comment);
  }
  if (program.on_the_way > 0) {
    text +=
        fmt::format("  private static final int onTheWay = {};  // voltages\n", program.on_the_way);
  }
  return text;
}

std::string members(const LoopProgram& program) {
  std::string text;
  for (const char* name : {"x", "demand", "error", "xHat"}) {
    text += fmt::format("  private final double[] m_{} = new double[states];\n", name);
  }
  text += program.on_the_way > 0
              ? "  // The state that is measured now; V, what the model saw, oldest at m_next; V, "
                "within this\n"
                "  // period and until then.\n"
                "  private final double[] m_delayed = new double[states];\n"
                "  private final double[] m_sent = new double[onTheWay];\n"
                "  private int m_next = 0;\n"
                "  private final double[] m_arriving = new double[2];\n"
              : "  private double m_uModel = 0.0;  // V, what the model saw of the last answer\n";
  return text +
         "  private double m_command = 0.0;  // V\n"
         "  private boolean m_measured = false;\n\n";
}

std::string java_helpers(const LoopProgram& program) {
  std::string usable;
  for (Eigen::Index i = 0; i < program.states; ++i) {
    usable += fmt::format("{}usable(x[{}])", i == 0 ? "" : " && ", i);
  }
  std::string text =
      "\n  private static double limited(double value, double limit) {\n"
      "    return value < -limit ? -limit : value > limit ? limit : value;\n"
      "  }\n\n"
      "  // What is beyond no robot's numbers counts as not finite.\n"
      "  private static boolean usable(double value) {\n"
      "    return Math.abs(value) <= 1e100;\n"
      "  }\n\n"
      "  private static boolean usable(double[] x) {\n"
      "    return " +
      usable +
      ";\n"
      "  }\n\n"
      "  private static double usableOrZero(double value) {\n"
      "    return usable(value) ? value : 0.0;\n"
      "  }\n";
  if (program.compensates) {
    text +=
        "\n  private static double believable(double measured) {\n"
        "    final boolean usable = measured > 0.0 && measured < 10.0 * nominalVoltage;\n"
        "    final double lowest = nominalVoltage / 3.0;\n"
        "    return !usable ? nominalVoltage : measured < lowest ? lowest : measured;\n"
        "  }\n";
  }
  if (program.on_the_way > 0) {
    text +=
        "\n  private static double cut(double value) {\n"
        "    return Double.isNaN(value) ? 0.0 : limited(value, 1e100);\n"
        "  }\n";
  }
  return text;
}

}  // namespace

std::string java_loop(const LoopProgram& program, const std::string& name) {
  const bool two = program.states == 2;
  std::string text;
  for (const std::string& line : description(program)) {
    text += line.empty() ? "//\n" : "// " + line + "\n";
  }
  text += fmt::format(
      "// Java 11, no dependency but the standard library; `update` allocates nothing.\n"
      "package frc.robot;\n\n"
      "{}"
      "/** The loop of one mechanism; states: {}. */\n"
      "public final class {} {{\n"
      "  public static final int states = {};\n\n",
      program.on_the_way > 0 ? "import java.util.Arrays;\n\n" : "",
      fmt::join(program.state_names, " and "), name, program.states);
  text += java_declarations(program) + "\n" + members(program);
  text += fmt::format(
      "  /**\n"
      "   * Starts at a known state. Call it with the first measurement before the first update, "
      "and\n"
      "   * again after a time without control; the next update predicts from here with no "
      "voltage.\n"
      "   *\n"
      "   * @param {} {}\n{}"
      "   */\n"
      "  public void reset({}) {{\n{}  }}\n\n",
      program.measured, program.measured_unit,
      two ? fmt::format("   * @param velocity {}/s\n", program.unit) : "",
      two ? "double position, double velocity" : "double " + program.measured,
      reset_lines(program, Java()));
  text += fmt::format(
      "  /**\n"
      "   * One period.\n"
      "   *\n"
      "   * @param measurement {}, {}; one that is not finite is left out, see measured()\n"
      "   * @param r the reference now: {}\n"
      "   * @param rNext the reference one period later\n"
      "   * @param batteryVoltage V, measured; {}\n"
      "   * @return the voltage for the motor, V, within ±maxVoltage and {}\n"
      "   */\n"
      "  public double update(double measurement, double[] r, double[] rNext, double "
      "batteryVoltage) {{\n{}  }}\n\n",
      program.measured, program.measured_unit,
      program.flywheel() ? fmt::format("velocity ({}/s)", program.unit)
                         : fmt::format("position ({0}), velocity ({0}/s)", program.unit),
      program.compensates ? "an unbelievable one counts as nominal"
                          : "not used: this design does not compensate it",
      program.compensates ? "the battery" : "±nominalVoltage", update_lines(program, Java()));
  text += fmt::format(
      "  /**\n"
      "   * What to send to a controller that scales by the battery's voltage, V of "
      "nominalVoltage: "
      "the\n"
      "   * last answer{}. Not for an interface that compensates by itself.\n"
      "   *\n"
      "   * @return V\n"
      "   */\n"
      "  public double command() {{\n    return m_command;\n  }}\n\n"
      "  /**\n   * Whether the last measurement is in the estimate.\n   *\n"
      "   * @return whether it is\n   */\n"
      "  public boolean measured() {{\n    return m_measured;\n  }}\n\n"
      "  /**\n   * The estimate after the last update.\n   *\n"
      "   * @param state from 0 to states - 1\n   * @return its value\n   */\n"
      "  public double xHat(int state) {{\n    return m_xHat[state];\n  }}\n",
      program.compensates ? " with the battery's sag compensated" : "");
  return text + java_helpers(program) + "}\n";
}

}  // namespace flyball::exports
