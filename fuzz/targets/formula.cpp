#include <flyball/math/expression/formula.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include <flyball/math/expression/source_text.hpp>

#include "targets/require.hpp"

namespace {

using namespace flyball;
using namespace flyball::expression;

std::vector<double> values_of(const CompiledFormulas& compiled, std::size_t variables, double at) {
  const Tape& tape = compiled.tape;
  std::vector<double> scratch(tape.size());
  std::vector<double> inputs;
  for (std::size_t k = 0; k < variables; ++k) {
    inputs.push_back(at * static_cast<double>(k + 1));
  }
  std::vector<double> outputs(compiled.outputs.size());
  tape.prepare<double>(compiled.parameters, scratch);
  tape.evaluate<double>(inputs, outputs, scratch);
  return outputs;
}

bool same(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}

}  // namespace

/// Each line is a formula: those with a name in front are definitions, the others outputs.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FormulaSet set;
  set.variables = {{"x", "m"}, {"v", "m/s"}, {"theta", "rad"}, {"u", ""}};
  set.parameters = {{"m", "kg", 2.0}, {"l", "cm", 30.0}, {"g", "m/s^2", 9.8}, {"k", "", 0.5}};
  std::string_view rest = fuzz::text_of(data, size);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    const std::size_t colon = line.find(": ");
    if (colon != line.npos) {
      set.definitions.push_back(
          {std::string(line.substr(0, colon)), std::string(line.substr(colon + 2)), ""});
    } else {
      set.outputs.push_back({"f" + std::to_string(set.outputs.size()), std::string(line), ""});
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  const auto compiled = compile(set);
  if (!compiled) {
    for (const Error& error : compiled.error()) {
      (void)caret_lines(fuzz::text_of(data, size), error);
    }
    return 0;
  }
  // The tape written as formulas computes the same numbers.
  const std::vector<std::string> names{"x", "v", "theta", "u"};
  const std::vector<std::string> parameters{"m", "l", "g", "k"};
  const auto text = source_text(compiled->tape, names, parameters, Language::formula);
  if (!text) {
    return 0;
  }
  FormulaSet again;
  for (const std::string& name : names) {
    again.variables.push_back({name, ""});
  }
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    again.parameters.push_back({parameters[k], "", compiled->parameters[k]});
  }
  for (const SourceText::Definition& definition : text->definitions) {
    if (definition.truth) {
      return 0;  // the language has no names for truths
    }
    again.definitions.push_back({definition.name, definition.text, ""});
  }
  for (const std::string& output : text->outputs) {
    again.outputs.push_back({"f" + std::to_string(again.outputs.size()), output, ""});
  }
  const auto read = compile(again);
  fuzz::require(read.has_value(), "a tape written as formulas can be read");
  for (const double at : {0.0, 0.7, -1e3}) {
    const std::vector<double> one = values_of(*compiled, names.size(), at);
    const std::vector<double> other = values_of(*read, names.size(), at);
    fuzz::require(std::equal(one.begin(), one.end(), other.begin(), other.end(), same),
                  "a tape written as formulas computes the same numbers");
  }
  return 0;
}
