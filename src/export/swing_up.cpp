#include <flyball/export/swing_up.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/math/expression/source_text.hpp>

#include "core/try.hpp"
#include "export/text.hpp"

namespace flyball::exports {

namespace {

template <class Vector>
std::string list(const Vector& values) {
  std::vector<std::string> words;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    words.push_back(literal(values(i)));
  }
  return fmt::format("{{{}}}", fmt::join(words, ", "));
}

}  // namespace

Expected<std::string> swing_up_header(const SwingUpProgram& program) {
  const auto n = static_cast<std::size_t>(program.x.size());
  std::vector<std::string> inputs;
  for (std::size_t i = 0; i < n; ++i) {
    inputs.push_back(fmt::format("x[{}]", i));
  }
  inputs.emplace_back("input_at_point");
  std::vector<std::string> parameters;
  for (const double value : program.parameters) {
    parameters.push_back(value < 0.0 ? fmt::format("({})", literal(value)) : literal(value));
  }
  FLYBALL_TRY(const auto source,
              expression::source_text(program.law, inputs, parameters, expression::Language::cpp));
  std::string body;
  for (const auto& [name, text, truth] : source.definitions) {
    body += fmt::format("  const {} {} = {};\n", truth ? "bool" : "double", name, text);
  }
  std::vector<std::string> angles;
  for (const bool angle : program.angles) {
    angles.emplace_back(angle ? "true" : "false");
  }
  std::string names;
  for (std::size_t i = 0; i < program.states.size(); ++i) {
    names += fmt::format("// x[{}]: {}\n", i, comment_text(program.states[i]));
  }
  return fmt::format(
      R"(// Swing-up and balance of {origin}.
// As `flyball simulate` runs it: the energy is brought to that of the point, and from where
// the regulator is proven to hold it, the regulator takes over. SI units.
{names}#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace swing_up {{

inline constexpr int states = {n};
inline constexpr double point[states] = {point};
inline constexpr bool is_angle[states] = {{{angles}}};
inline constexpr double input_at_point = {u};
inline constexpr double limit = {limit};
inline constexpr double K[states] = {K};
inline constexpr double P[states][states] = {P};
inline constexpr double take = {level};   // V = e'Pe at most: the regulator takes over,
inline constexpr double leave = {leave};  // and gives up above.
inline constexpr double energy_at_point = {energy};
inline constexpr double energy_scale = {scale};
inline constexpr double sharpness = {sharpness};
inline constexpr double hold[states] = {hold};

struct Energy {{
  double value;
  double power;  // what a unit of the input adds to it a second
}};

inline Energy energy_of(const double (&x)[states]) noexcept {{
{body}  return {{{value}, {power}}};
}}

class Controller {{
 public:
  double calculate(const double (&x)[states]) noexcept {{
    double e[states];  // from the state to the point, angles the shorter way round
    for (int i = 0; i < states; ++i) {{
      e[i] = point[i] - x[i];
      if (is_angle[i]) {{
        e[i] = std::remainder(e[i], 6.283185307179586);
      }}
    }}
    double V = 0.0;
    for (int i = 0; i < states; ++i) {{
      for (int j = 0; j < states; ++j) {{
        V += e[i] * P[i][j] * e[j];
      }}
    }}
    balances_ = V <= (balances_ ? leave : take);
    double u = input_at_point;
    if (!balances_) {{
      const Energy now = energy_of(x);
      const double missing =
          std::max(-1.0, std::min(1.0, sharpness * (energy_at_point - now.value) / energy_scale));
      u += limit * missing * (now.power < 0.0 ? -1.0 : 1.0);
    }}
    for (int i = 0; i < states; ++i) {{
      u += (balances_ ? K[i] : hold[i]) * e[i];
    }}
    if (!(u == u)) {{
      return input_at_point;
    }}
    return std::max(-limit, std::min(limit, u));
  }}
  bool balances() const noexcept {{ return balances_; }}

 private:
  bool balances_ = false;
}};

}}  // namespace swing_up
)",
      fmt::arg("origin", comment_text(program.origin)), fmt::arg("names", names), fmt::arg("n", n),
      fmt::arg("point", list(program.x)), fmt::arg("angles", fmt::join(angles, ", ")),
      fmt::arg("u", literal(program.u)), fmt::arg("limit", literal(program.limit)),
      fmt::arg("K", list(program.K)), fmt::arg("P", rows_of(program.P)),
      fmt::arg("level", literal(program.level)), fmt::arg("leave", literal(program.leave)),
      fmt::arg("energy", literal(program.energy)), fmt::arg("scale", literal(program.scale)),
      fmt::arg("sharpness", literal(program.sharpness)), fmt::arg("hold", list(program.hold)),
      fmt::arg("body", body), fmt::arg("value", source.outputs[0]),
      fmt::arg("power", source.outputs[1]));
}

}  // namespace flyball::exports
