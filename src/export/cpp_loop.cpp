#include <fmt/format.h>
#include <fmt/ranges.h>

#include "export/loop_language.hpp"
#include "export/text.hpp"

namespace flyball::exports {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

std::string matrix_literal(const MatrixXd& M) {
  std::string text = "{{";
  for (Index i = 0; i < M.rows(); ++i) {
    text += fmt::format("{}{{{{{}}}}}", i == 0 ? "" : ", ", literals(M.row(i)));
  }
  return text + "}}";
}

class Cpp final : public BracesLanguage {
 public:
  [[nodiscard]] std::string constant(std::string_view name,
                                     const std::string& value) const override {
    return fmt::format("    const double {} = {};\n", name, value);
  }
  [[nodiscard]] std::string variable(std::string_view name,
                                     const std::string& value) const override {
    return fmt::format("    double {} = {};\n", name, value);
  }
  [[nodiscard]] std::string set(std::string_view target, const std::string& value) const override {
    return fmt::format("    {} = {};\n", target, value);
  }
  [[nodiscard]] std::string state(std::string_view name) const override {
    return fmt::format("    State {}{{}};\n", name);
  }
  [[nodiscard]] std::string copy(std::string_view target, std::string_view source) const override {
    return set(target, std::string(source));
  }
  [[nodiscard]] std::string copy_if(const std::string& condition, std::string_view target,
                                    std::string_view source) const override {
    return set(target, choose(condition, std::string(source), std::string(target)));
  }
  [[nodiscard]] std::string clear(std::string_view member) const override {
    return set(member, "{}");
  }
  [[nodiscard]] std::string for_each_on_the_way(std::string_view index,
                                                const std::string& lines) const override {
    return fmt::format("    for (std::size_t {0} = 1; {0} < on_the_way; ++{0}) {{\n{1}    }}\n",
                       index, indented(lines));
  }
  [[nodiscard]] std::string call(std::string_view function,
                                 const std::string& arguments) const override {
    const std::string_view name = function == "is_nan"         ? "std::isnan"
                                  : function == "cosine"       ? "std::cos"
                                  : function == "usable_state" ? "usable"
                                                               : function;
    return fmt::format("{}({})", name, arguments);
  }
};

std::string preamble(const LoopProgram& program) {
  std::string text;
  for (const std::string& line : description(program)) {
    text += line.empty() ? "//\n" : "// " + line + "\n";
  }
  return text +
         "// C++17, no dependency but the standard library, no allocation, no exception.\n"
         "#pragma once\n\n"
         "#include <array>\n#include <cmath>\n#include <cstddef>\n\n";
}

/// The type of a constant and its initialiser.
std::pair<std::string_view, std::string> declaration(const LoopConstant& constant) {
  switch (constant.shape) {
    case LoopConstant::Shape::number:
      return {"double", " = " + literal(constant.value(0, 0))};
    case LoopConstant::Shape::vector:
      return {"std::array<double, states>", "{{" + literals(constant.value) + "}}"};
    case LoopConstant::Shape::matrix:
      return {"std::array<std::array<double, states>, states>", matrix_literal(constant.value)};
  }
  return {};
}

std::string declarations(const LoopProgram& program) {
  std::string text;
  for (const LoopConstant& constant : program.constants) {
    const auto [type, value] = declaration(constant);
    text += fmt::format("  static constexpr {} {}{};  // {}\n", type, constant.name, value,
                        constant.comment);
  }
  return text;
}

std::string reset_function(const LoopProgram& program) {
  const bool two = program.states == 2;
  return fmt::format(
      "  /// Starts at a known state. Call it with the first measurement before the first "
      "`update`,\n"
      "  /// and again after a time without control; the next `update` predicts from here with no\n"
      "  /// voltage. @param {} {}{}\n"
      "  void reset({}) noexcept {{\n{}  }}\n\n",
      program.measured, program.measured_unit,
      two ? fmt::format(" @param velocity {}/s", program.unit) : "",
      two ? "double position, double velocity = 0.0" : "double " + program.measured,
      reset_lines(program, Cpp()));
}

std::string update_function(const LoopProgram& program) {
  return fmt::format(
      "  /// One period.\n"
      "  /// @param measurement  {}, {}; one that is not finite is left out, see measured().\n"
      "  /// @param r, r_next  The reference now and one period later.\n"
      "  /// @param battery_voltage  V, measured; {}.\n"
      "  /// @return The voltage for the motor, V, within ±max_voltage and {}.\n"
      "  double update(double measurement, const Reference& r, const Reference& r_next,\n"
      "                double {}) noexcept {{\n{}  }}\n\n",
      program.measured, program.measured_unit,
      program.compensates ? "an unbelievable one counts as nominal"
                          : "not used: this design does not compensate it",
      program.compensates ? "the battery" : "±nominal_voltage",
      program.compensates ? "battery_voltage" : "/*battery_voltage*/",
      update_lines(program, Cpp()));
}

std::string command_function(const LoopProgram& program) {
  if (!program.compensates) {
    return "  /// What to send, V of nominal_voltage: the last answer of `update`.\n"
           "  double command() const noexcept { return command_; }\n\n";
  }
  return "  /// What to send to a controller that scales by the battery's voltage, V of "
         "nominal_voltage:\n"
         "  /// the last answer of `update` with the battery's sag compensated. As a duty cycle it "
         "is\n"
         "  /// command() / nominal_voltage. Not for an interface that compensates by itself.\n"
         "  double command() const noexcept { return command_; }\n\n";
}

}  // namespace

std::string cpp_loop(const LoopProgram& program, const std::string& name) {
  const std::string& u = program.unit;
  std::string text = preamble(program);
  text += fmt::format("class {} {{\n public:\n", name);
  text += fmt::format("  static constexpr std::size_t states = {};\n", program.states);
  text += fmt::format("  using State = std::array<double, states>;  // {}\n",
                      fmt::join(program.state_names, " and "));
  text += program.flywheel()
              ? fmt::format("  using Reference = std::array<double, 1>;  // velocity ({}/s)\n\n", u)
              : fmt::format(
                    "  using Reference = std::array<double, 2>;  // position ({0}), velocity "
                    "({0}/s)\n\n",
                    u);
  text += declarations(program);
  if (program.on_the_way > 0) {
    text += fmt::format("  static constexpr std::size_t on_the_way = {};  // voltages\n",
                        program.on_the_way);
  }
  text += "\n";
  text += reset_function(program);
  text += update_function(program);
  text += command_function(program);
  text +=
      "  /// Whether the last measurement is in the estimate.\n"
      "  bool measured() const noexcept { return measured_; }\n"
      "  /// The estimate after the last `update`.\n"
      "  const State& x_hat() const noexcept { return x_hat_; }\n\n"
      " private:\n"
      "  static double limited(double value, double limit) noexcept {\n"
      "    return value < -limit ? -limit : value > limit ? limit : value;\n"
      "  }\n"
      "  // What is beyond no robot's numbers counts as not finite.\n"
      "  static bool usable(double value) noexcept { return std::abs(value) <= 1e100; }\n"
      "  static bool usable(const State& x) noexcept {\n"
      "    return ";
  for (Index i = 0; i < program.states; ++i) {
    text += fmt::format("{}usable(x[{}])", i == 0 ? "" : " && ", i);
  }
  text +=
      ";\n"
      "  }\n"
      "  static double usable_or_zero(double value) noexcept { return usable(value) ? value : 0.0; "
      "}\n"
      "\n";
  if (program.compensates) {
    text +=
        "  static double believable(double measured) noexcept {\n"
        "    const bool usable = measured > 0.0 && measured < 10.0 * nominal_voltage;\n"
        "    const double lowest = nominal_voltage / 3.0;\n"
        "    return !usable ? nominal_voltage : measured < lowest ? lowest : measured;\n"
        "  }\n\n";
  }
  const bool predicts = program.on_the_way > 0;
  if (predicts) {
    text +=
        "  static double cut(double value) noexcept {\n"
        "    return std::isnan(value) ? 0.0 : limited(value, 1e100);\n"
        "  }\n\n";
  }
  text += "  State x_hat_{};\n";
  text +=
      predicts
          ? "  State delayed_{};  // the state that is measured now\n"
            "  std::array<double, on_the_way> sent_{};  // V, what the model saw; oldest at next_\n"
            "  std::size_t next_ = 0;\n"
            "  std::array<double, 2> arriving_{};  // V, within this period and until then\n"
          : "  double u_model_ = 0.0;  // V, what the model saw of the last answer\n";
  text +=
      "  double command_ = 0.0;  // V\n"
      "  bool measured_ = false;\n"
      "};\n";
  return text;
}

}  // namespace flyball::exports
