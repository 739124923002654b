#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/math/expression/formula.hpp>

namespace flyball::expression {

/// The value of one formula, of variables by name.
inline double value_of(const std::string& text,
                       const std::vector<std::pair<std::string, double>>& variables = {}) {
  FormulaSet set{.outputs = {{.name = "y", .text = text}}};
  std::vector<double> inputs;
  for (const auto& [name, value] : variables) {
    set.variables.push_back({.name = name});
    inputs.push_back(value);
  }
  const auto compiled = compile(set);
  if (!compiled) {
    ADD_FAILURE() << text << ": " << to_string(compiled.error().front());
    return 0.0;
  }
  std::vector<double> values(compiled->tape.size());
  double y = 0.0;
  compiled->tape.prepare<double>({}, values);
  compiled->tape.evaluate<double>(inputs, {&y, 1}, values);
  return y;
}

/// The errors of one formula of the variables x, y, theta (rad), m (kg), l (m), t (s) and u.
inline std::vector<Error> errors_of(const std::string& text, const std::string& unit = "") {
  const auto compiled = compile({.variables = {{"x", ""},
                                               {"y", ""},
                                               {"theta", "rad"},
                                               {"m", "kg"},
                                               {"l", "m"},
                                               {"t", "s"},
                                               {"u", "N m"}},
                                 .outputs = {{"f", text, unit}}});
  return compiled ? std::vector<Error>{} : compiled.error();
}

/// The codes of errors, in order, with their offsets: "unknown_name@3 wrong_arity@7".
inline std::string codes(const std::vector<Error>& errors) {
  std::string text;
  for (const Error& error : errors) {
    text += (text.empty() ? "" : " ") + std::string(error.code());
    for (const Evidence& evidence : error.evidence()) {
      if (evidence.name == "offset") {
        text += "@" + std::to_string(static_cast<int>(evidence.values.at(0)));
      }
    }
  }
  return text;
}

}  // namespace flyball::expression
