#include <algorithm>
#include <array>

#include <fmt/format.h>

#include <flyball/core/version.hpp>
#include <flyball/export/generated_loop.hpp>

#include "core/try.hpp"
#include "export/loop_language.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

/// x_hat_ of delayed_ and of what was sent.
std::string prediction_lines(const LoopProgram& program, const LoopLanguage& in) {
  const auto assigned = [&](const std::vector<std::string>& rows) {
    std::string text;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      text += in.set(fmt::format("x[{}]", i), in.call("cut", rows[i]));
    }
    return text + in.copy("x_hat_", "x");
  };
  return "\n" +
         in.comment("From the measured state to that of now, with the voltages on their way.") +
         in.copy("x_hat_", "delayed_") + in.variable("newer", "sent_[next_]") +
         in.for_each_on_the_way("j", in.constant("older", "newer") +
                                         in.set("newer", "sent_[(next_ + j) % on_the_way]") +
                                         assigned(program.one_period)) +
         assigned(program.rest);
}

/// What the model saw of the answer is remembered.
std::string memory_lines(const LoopProgram& program, const LoopLanguage& in) {
  const std::string note = in.comment("Friction and gravity are not in the model.");
  if (program.on_the_way == 0) {
    return note + in.set("u_model_", "u - extra");
  }
  return note + in.set("arriving_[1]", "sent_[next_]") +
         in.set("sent_[next_]", in.call("usable_or_zero", "u - extra")) +
         in.set("next_", "(next_ + 1) % on_the_way") + in.set("arriving_[0]", "sent_[next_]");
}

/// What is not in the linear model: friction and gravity.
std::string extra_lines(const LoopProgram& program, const LoopLanguage& in) {
  std::string text;
  if (program.friction) {
    const std::string now = "r" + program.speed;
    text += in.constant("direction", in.choose(now + " != 0.0", now, "r_next" + program.speed));
    text += in.constant(
        "friction", in.choose("direction > 0.0", "kS", in.choose("direction < 0.0", "-kS", "0.0")));
  }
  const std::string gravity =
      !program.gravity ? ""
      : program.arm()
          ? in.call("usable_or_zero", "kG * " + in.call("cosine", "r[0] + angle_offset"))
          : "kG";
  return text + in.constant("extra", gravity.empty()    ? (program.friction ? "friction" : "0.0")
                                     : program.friction ? gravity + " + friction"
                                                        : gravity);
}

}  // namespace

std::string BracesLanguage::comment(std::string_view text) const {
  return fmt::format("    // {}\n", text);
}
std::string BracesLanguage::answer(std::string_view name) const {
  return fmt::format("    return {};\n", name);
}
std::string BracesLanguage::choose(const std::string& condition, const std::string& yes,
                                   const std::string& no) const {
  return fmt::format("{} ? {} : {}", condition, yes, no);
}
std::string BracesLanguage::both(const std::string& a, const std::string& b) const {
  return a + " && " + b;
}

std::string update_lines(const LoopProgram& program, const LoopLanguage& in) {
  std::string text;
  if (program.moves_measurement) {
    text += in.comment("A late measurement is moved along the reference to now.");
    text += in.constant("y", "measurement + measurement_delay * " + program.rate);
  } else {
    text += in.constant("y", "measurement");
  }
  text += in.state("x");
  for (std::size_t i = 0; i < program.prediction.size(); ++i) {
    text += in.set(fmt::format("x[{}]", i), program.prediction[i]);
  }
  const std::string_view estimate = program.on_the_way > 0 ? "delayed_" : "x_hat_";
  text += in.copy_if(in.call("usable_state", "x"), estimate, "x");
  text += in.copy("x", estimate);
  text += in.constant("innovation", "y - x[0]");
  for (Eigen::Index i = 0; i < program.states; ++i) {
    text +=
        in.set(fmt::format("x[{}]", i), fmt::format("x[{0}] + kalman_gain[{0}] * innovation", i));
  }
  text += in.set("measured_", in.both(in.call("usable", "y"), in.call("usable_state", "x")));
  text += in.copy_if("measured_", estimate, "x");
  text += program.on_the_way > 0 ? prediction_lines(program, in) : "";
  text += "\n";
  text +=
      in.comment("The reference one period on, less where the plant would drift from this one.");
  text += in.state("demand") + in.state("error");
  for (std::size_t i = 0; i < program.demand.size(); ++i) {
    text += in.set(fmt::format("demand[{}]", i), program.demand[i]);
    text += in.set(fmt::format("error[{}]", i), program.error[i]);
  }
  text += extra_lines(program, in);
  text += in.constant("feedforward", in.call("usable_or_zero", program.inversion) + " + extra");
  text += in.variable("u", program.feedback + " + feedforward");
  text += in.set("u", in.choose(in.call("is_nan", "u"), "0.0", "u"));
  if (program.compensates) {
    text += in.constant("rail", in.call("believable", "battery_voltage"));
  }
  const std::string_view bound = program.compensates ? "rail" : "nominal_voltage";
  text += in.set(
      "u", in.call("limited", in.call("limited", "u, max_voltage") + ", " + std::string(bound)));
  text += memory_lines(program, in);
  text +=
      in.set("command_", program.compensates
                             ? in.call("limited", "u * (nominal_voltage / rail), nominal_voltage")
                             : "u");
  return text + in.answer("u");
}

std::string reset_lines(const LoopProgram& program, const LoopLanguage& in) {
  std::string text = in.state("x");
  text += in.set("x[0]", program.measured);
  text += program.states == 2 ? in.set("x[1]", "velocity") : "";
  const bool predicts = program.on_the_way > 0;
  const std::string_view estimate = predicts ? "delayed_" : "x_hat_";
  text += in.copy_if(in.call("usable_state", "x"), estimate, "x");
  text += predicts ? in.copy("x_hat_", "delayed_") + in.clear("sent_") + in.clear("arriving_")
                   : in.set("u_model_", "0.0");
  return text + in.set("command_", "0.0");
}

std::vector<std::string> description(const LoopProgram& program) {
  const std::string& u = program.unit;
  const mechanisms::FeedforwardGains& gains = program.gains;
  std::string known =
      fmt::format("kS = {} V, kV = {} V·s/{}", literal(gains.kS), literal(gains.kV), u);
  known += gains.kA > 0.0 ? fmt::format(", kA = {} V·s²/{}", literal(gains.kA), u)
                          : ", kA not determined";
  if (!program.flywheel()) {
    known += fmt::format(", kG = {} V", literal(gains.kG));
  }
  if (program.arm()) {
    known += fmt::format(", angle offset = {} rad", literal(gains.angle_offset));
  }
  const std::string_view fed = program.friction && program.gravity
                                   ? " and the feedforward of friction and gravity"
                               : program.friction ? " and the feedforward of friction"
                               : program.gravity  ? " and the feedforward of gravity"
                                                  : "";
  std::vector<std::string> lines{
      fmt::format(
          "{} loop, generated by Flyball {}; changes here are lost when it is generated again.",
          capitalized(program.kind), version),
      "", fmt::format("Model: {}.", known)};
  const auto K = std::find_if(program.constants.begin(), program.constants.end(),
                              [](const LoopConstant& constant) { return constant.name == "K"; });
  if (K != program.constants.end() && K->value.isZero(0.0)) {
    lines.emplace_back("There is no feedback, K = 0: feedforward alone drives it.");
  }
  lines.push_back(fmt::format(
      "Every {} s: a steady-state Kalman filter estimates the state, {}u = K (r - x_hat) plus",
      literal(program.period()),
      program.on_the_way > 0 ? "which is late; the voltages on their way carry it to now; " : ""));
  lines.push_back(fmt::format("plant inversion{}, limited to the voltage there is.", fed));
  return lines;
}

std::string literals(const Eigen::MatrixXd& row) {
  std::string text;
  for (const double value : row.reshaped()) {
    text += (text.empty() ? "" : ", ") + literal(value);
  }
  return text;
}

std::string indented(const std::string& lines) {
  std::string text;
  bool begins = true;
  for (const char c : lines) {
    text += begins && c != '\n' ? "  " : "";
    text += c;
    begins = c == '\n';
  }
  return text;
}

std::string identifier(std::string_view wanted) {
  std::string name;
  for (const char c : wanted) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    const bool digit = c >= '0' && c <= '9';
    if (digit && name.empty()) {
      name = "_";
    }
    name += letter || digit || c == '_' ? c : '_';
  }
  constexpr std::array<std::string_view, 44> taken{
      "auto",   "bool",    "break",  "case",   "catch",  "char",     "class",    "const",
      "delete", "do",      "double", "else",   "enum",   "explicit", "float",    "for",
      "friend", "if",      "int",    "long",   "new",    "private",  "public",   "return",
      "short",  "signed",  "static", "struct", "switch", "this",     "abstract", "boolean",
      "byte",   "extends", "final",  "import", "lambda", "None",     "package",  "pass",
      "super",  "throws",  "with",   "yield"};
  if (name.empty()) {
    name = "Loop";
  } else if (std::find(taken.begin(), taken.end(), name) != taken.end()) {
    name += '_';
  }
  return name;
}

std::string loop_class_name(mechanisms::MechanismKind kind) {
  return capitalized(kind) + "Loop";
}

std::string loop_file_name(Language language, std::string_view class_name) {
  const std::string name = identifier(class_name);
  if (language != Language::python) {
    return name + (language == Language::cpp ? ".hpp" : ".java");
  }
  std::string module;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool after_lower = !module.empty() && module.back() >= 'a' && module.back() <= 'z';
    module += upper && after_lower ? "_" : "";
    module += upper ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return module + ".py";
}

Expected<std::string> generate_loop(const MechanismControllerDesign& design, Language language,
                                    std::string_view class_name, std::string_view unit) {
  FLYBALL_TRY(const auto program, loop_program(design, unit));
  const std::string name = identifier(class_name);
  return language == Language::cpp    ? cpp_loop(program, name)
         : language == Language::java ? java_loop(program, name)
                                      : python_loop(program, name);
}

}  // namespace flyball::exports
