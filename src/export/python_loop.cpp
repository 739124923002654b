#include <fmt/format.h>
#include <fmt/ranges.h>

#include "export/loop_language.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

/// Members with their object: "x_hat_" is self._x_hat.
std::string python(std::string_view expression) {
  std::string text;
  for (std::size_t at = 0; at < expression.size();) {
    std::size_t end = at;
    while (end < expression.size() && is_word(expression[end])) {
      ++end;
    }
    if (end == at) {
      text += expression[at++];
      continue;
    }
    const std::string_view word = expression.substr(at, end - at);
    text += word.size() > 1 && word.back() == '_'
                ? fmt::format("self._{}", word.substr(0, word.size() - 1))
                : std::string(word);
    at = end;
  }
  return text;
}

class Python final : public LoopLanguage {
 public:
  [[nodiscard]] std::string comment(std::string_view text) const override {
    return fmt::format("        # {}\n", text);
  }
  [[nodiscard]] std::string constant(std::string_view name,
                                     const std::string& value) const override {
    return set(name, value);
  }
  [[nodiscard]] std::string variable(std::string_view name,
                                     const std::string& value) const override {
    return set(name, value);
  }
  [[nodiscard]] std::string set(std::string_view target, const std::string& value) const override {
    return fmt::format("        {} = {}\n", python(target), python(value));
  }
  [[nodiscard]] std::string state(std::string_view name) const override {
    return fmt::format("        {} = [0.0] * states\n", name);
  }
  [[nodiscard]] std::string copy(std::string_view target, std::string_view source) const override {
    return fmt::format("        {} = {}[:]\n", python(target), python(source));
  }
  [[nodiscard]] std::string copy_if(const std::string& condition, std::string_view target,
                                    std::string_view source) const override {
    return fmt::format("        if {}:\n    {}", python(condition), copy(target, source));
  }
  [[nodiscard]] std::string clear(std::string_view member) const override {
    return fmt::format("        {0} = [0.0] * len({0})\n", python(member));
  }
  [[nodiscard]] std::string for_each_on_the_way(std::string_view index,
                                                const std::string& lines) const override {
    return fmt::format("        for {} in range(1, on_the_way):\n{}", index,
                       indented(indented(lines)));
  }
  [[nodiscard]] std::string answer(std::string_view name) const override {
    return fmt::format("        return {}\n", name);
  }
  [[nodiscard]] std::string choose(const std::string& condition, const std::string& yes,
                                   const std::string& no) const override {
    return fmt::format("({} if {} else {})", yes, condition, no);
  }
  [[nodiscard]] std::string both(const std::string& a, const std::string& b) const override {
    return a + " and " + b;
  }
  [[nodiscard]] std::string call(std::string_view function,
                                 const std::string& arguments) const override {
    return function == "is_nan" ? fmt::format("math.isnan({})", arguments)
                                : fmt::format("_{}({})", function, arguments);
  }
};

/// A tuple's text; of one number "(1.0,)".
std::string tuple(const Eigen::MatrixXd& row) {
  return fmt::format("({}{})", literals(row), row.size() == 1 ? "," : "");
}

std::string python_declarations(const LoopProgram& program) {
  std::string text =
      fmt::format("states = {}  # {}\n", program.states, fmt::join(program.state_names, " and "));
  for (const LoopConstant& constant : program.constants) {
    std::string value;
    if (constant.shape == LoopConstant::Shape::number) {
      value = literal(constant.value(0, 0));
    } else if (constant.shape == LoopConstant::Shape::vector) {
      value = tuple(constant.value);
    } else {
      for (Eigen::Index i = 0; i < constant.value.rows(); ++i) {
        value += tuple(constant.value.row(i)) + (constant.value.rows() == 1 ? "," : "");
        value += i + 1 < constant.value.rows() ? ", " : "";
      }
      value = "(" + value + ")";
    }
    text += fmt::format("{} = {}  # {}\n", constant.name, value, constant.comment);
  }
  if (program.on_the_way > 0) {
    text += fmt::format("on_the_way = {}  # voltages\n", program.on_the_way);
  }
  return text;
}

std::string python_helpers(const LoopProgram& program) {
  std::string text =
      "\n\ndef _limited(value, limit):\n"
      "    return -limit if value < -limit else limit if value > limit else value\n"
      "\n\ndef _usable(value):\n"
      "    # What is beyond no robot's numbers counts as not finite.\n"
      "    return abs(value) <= 1e100\n"
      "\n\ndef _usable_state(x):\n"
      "    return all(_usable(value) for value in x)\n"
      "\n\ndef _usable_or_zero(value):\n"
      "    return value if _usable(value) else 0.0\n";
  if (program.gravity && program.arm()) {
    text +=
        "\n\ndef _cosine(angle):\n"
        "    return math.cos(angle) if math.isfinite(angle) else math.nan\n";
  }
  if (program.compensates) {
    text +=
        "\n\ndef _believable(measured):\n"
        "    if not (measured > 0.0 and measured < 10.0 * nominal_voltage):\n"
        "        return nominal_voltage\n"
        "    lowest = nominal_voltage / 3.0\n"
        "    return lowest if measured < lowest else measured\n";
  }
  if (program.on_the_way > 0) {
    text +=
        "\n\ndef _cut(value):\n"
        "    return 0.0 if math.isnan(value) else _limited(value, 1e100)\n";
  }
  return text;
}

}  // namespace

std::string python_loop(const LoopProgram& program, const std::string& name) {
  const bool two = program.states == 2;
  std::string text;
  for (const std::string& line : description(program)) {
    text += line.empty() ? "#\n" : "# " + line + "\n";
  }
  text += "# Python 3.8, no dependency but the standard library.\nimport math\n\n";
  text += python_declarations(program) + python_helpers(program);
  text += fmt::format(
      "\n\nclass {}:\n"
      "    \"\"\"The loop of one mechanism.\"\"\"\n\n"
      "    def __init__(self):\n"
      "        self._x_hat = [0.0] * states\n"
      "{}"
      "        self._command = 0.0  # V\n"
      "        self._measured = False\n\n",
      name,
      program.on_the_way > 0
          ? "        self._delayed = [0.0] * states  # the state that is measured now\n"
            "        self._sent = [0.0] * on_the_way  # V, what the model saw; oldest at _next\n"
            "        self._next = 0\n"
            "        self._arriving = [0.0, 0.0]  # V, within this period and until then\n"
          : "        self._u_model = 0.0  # V, what the model saw of the last answer\n");
  text += fmt::format(
      "    def reset(self, {}):\n"
      "        \"\"\"Starts at a known state: {} ({}){}.\n\n"
      "        Call it with the first measurement before the first update, and again after a time\n"
      "        without control; the next update predicts from here with no voltage.\n"
      "        \"\"\"\n{}\n",
      two ? "position, velocity=0.0" : program.measured, program.measured, program.measured_unit,
      two ? fmt::format(" and velocity ({}/s)", program.unit) : "", reset_lines(program, Python()));
  text += fmt::format(
      "    def update(self, measurement, r, r_next, battery_voltage):\n"
      "        \"\"\"One period; answers the voltage for the motor, V, within max_voltage and "
      "{}.\n\n"
      "        measurement: {}, {}; one that is not finite is left out, see measured\n"
      "        r, r_next: the reference now and one period later, each a list of\n"
      "            {}\n"
      "        battery_voltage: V, measured; {}\n"
      "        \"\"\"\n{}\n",
      program.compensates ? "the battery" : "nominal_voltage", program.measured,
      program.measured_unit,
      program.flywheel() ? fmt::format("velocity ({}/s)", program.unit)
                         : fmt::format("position ({0}) and velocity ({0}/s)", program.unit),
      program.compensates ? "an unbelievable one counts as nominal"
                          : "not used: this design does not compensate it",
      update_lines(program, Python()));
  text += fmt::format(
      "    @property\n"
      "    def command(self):\n"
      "        \"\"\"What to send to a controller that scales by the battery's voltage, V of\n"
      "        nominal_voltage: the last answer{}.\n"
      "        Not for an interface that compensates by itself.\n"
      "        \"\"\"\n"
      "        return self._command\n\n"
      "    @property\n"
      "    def measured(self):\n"
      "        \"\"\"Whether the last measurement is in the estimate.\"\"\"\n"
      "        return self._measured\n\n"
      "    @property\n"
      "    def x_hat(self):\n"
      "        \"\"\"The estimate after the last update.\"\"\"\n"
      "        return tuple(self._x_hat)\n",
      program.compensates ? " with the battery's sag compensated" : "");
  return text;
}

}  // namespace flyball::exports
