#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/expression/formula.hpp>

#include "core/try.hpp"
#include "study/named_values.hpp"
#include "study/read_value.hpp"

namespace flyball::study {

namespace {

using Coordinates = std::vector<Coordinate>;
using Index = Eigen::Index;

/// A value with its unit, in SI; zero needs no unit.
/// @param called  The key, for messages. @param unit  What it must fit; "1" is a plain number,
/// empty is not known.
Expected<double> named_value(const std::string& text, const std::string& called,
                             const std::string& unit, Range range) {
  std::optional<SiDimension> wanted;
  if (!unit.empty()) {
    FLYBALL_TRY(const SiUnit known, parse_si_unit(unit));
    wanted = known.dimension;
  }
  FLYBALL_TRY(const QuantityText parts, split_quantity(text, called));
  FLYBALL_TRY(const SiUnit given, parse_si_unit(parts.unit));
  const bool plain = parts.unit.empty();
  const bool takes_plain = wanted && wanted->exponents == SiDimension{}.exponents;
  if (wanted && parts.number != 0.0 &&
      (!wanted->fits(given.dimension) || (plain && !takes_plain))) {
    return refusal(ArgumentError::wrong_unit, {}, called)
        .got(plain ? fmt::format("{}, without a unit", text)
                   : fmt::format("\"{}\", in {}", text, to_text(given.dimension)))
        .expected(fmt::format("in {}, such as \"1 {}\"", to_text(*wanted), unit));
  }
  const double si = parts.number * given.factor;
  const bool positive = range == Range::positive;
  if (!std::isfinite(si)) {
    return refusal(ArgumentError::not_finite, {}, called)
        .got(fmt::format("\"{}\"", text))
        .expected("a finite number in SI");
  }
  if ((positive && !(si > 0.0)) || (range == Range::not_negative && !(si >= 0.0))) {
    return tl::unexpected(
        Error(positive ? ArgumentError::not_positive : ArgumentError::out_of_range)
            .about(called)
            .got(text)
            .expected(positive ? "greater than zero" : "zero or greater"));
  }
  FLYBALL_CHECK(check_size(si, called));
  return si;
}

}  // namespace

std::size_t NamedValues::place_of(const Coordinates& list, const std::string& name) {
  return static_cast<std::size_t>(
      std::find_if(list.begin(), list.end(),
                   [&](const Coordinate& one) { return one.name == name; }) -
      list.begin());
}

Error NamedValues::unknown(const std::string& name, std::initializer_list<const Coordinates*> lists,
                           std::string_view what) {
  std::vector<std::string_view> names;
  for (const Coordinates* list : lists) {
    for (const Coordinate& one : *list) {
      names.push_back(one.name);
    }
  }
  const std::string nearest = nearest_name(name, names);
  return Error(ArgumentError::unknown_name)
      .about(fmt::format("\"{}\"", name))
      .got(fmt::format("not {}", what))
      .hint(!nearest.empty() ? fmt::format("did you mean \"{}\"?", nearest)
            : names.empty()  ? "the model has none"
                             : fmt::format("there are {}", fmt::join(names, ", ")));
}

std::optional<double> NamedValues::value(const std::string& section, const NamedText& said,
                                         const std::string& unit, Range range) {
  auto read = named_value(said.text, document_.name(section, said.name), unit, range);
  if (read) {
    return *read;
  }
  document_.refuse(section, said.name, std::move(read).error());
  return std::nullopt;
}

void NamedValues::read_values(const std::string& section, const NamedTexts& said, Range range,
                              Eigen::VectorXd* x, Eigen::VectorXd* u) {
  for (const NamedText& one : said) {
    const std::size_t state = x != nullptr ? place_of(states_, one.name) : states_.size();
    const std::size_t input = u != nullptr ? place_of(inputs_, one.name) : inputs_.size();
    if (state == states_.size() && input == inputs_.size()) {
      static const Coordinates none;
      document_.refuse(
          section, one.name,
          unknown(one.name, {x != nullptr ? &states_ : &none, u != nullptr ? &inputs_ : &none},
                  x == nullptr   ? "an input"
                  : u == nullptr ? "a state"
                                 : "a state or an input"),
          TomlDocument::Fault::key);
      continue;
    }
    const bool is_state = state < states_.size();
    if (const auto si =
            value(section, one, (is_state ? states_[state] : inputs_[input]).unit, range)) {
      (is_state ? (*x)(static_cast<Index>(state)) : (*u)(static_cast<Index>(input))) = *si;
    }
  }
}

std::vector<double> NamedValues::of_outputs(const std::string& section, const NamedTexts& said,
                                            const Coordinates* outputs) {
  std::vector<double> values(outputs != nullptr ? outputs->size() : 0, 0.0);
  for (const NamedText& one : outputs != nullptr ? said : NamedTexts()) {
    const std::size_t output = place_of(*outputs, one.name);
    if (output == values.size()) {
      document_.refuse(section, one.name, unknown(one.name, {outputs}, "an output"),
                       TomlDocument::Fault::key);
    } else if (const auto si = value(
                   section, one, (*outputs)[output].unit.empty() ? "1" : (*outputs)[output].unit,
                   Range::not_negative)) {
      values[output] = *si;
    }
  }
  return values;
}

/// The open loop's inputs: those of the point, where no other is said.
InputSignals NamedValues::read_input(const Eigen::VectorXd& u) {
  constexpr const char* section = "simulation.input";
  expression::FormulaSet set{.variables = {{"t", ""}}};
  for (const Parameter& parameter : parameters_) {
    if (parameter.name != "t") {
      set.parameters.push_back({parameter.name, parameter.unit, parameter.value});
    }
  }
  for (Index i = 0; i < u.size(); ++i) {
    set.outputs.push_back({inputs_[static_cast<std::size_t>(i)].name, fmt::format("{}", u(i)), ""});
  }
  for (const NamedText& one : project_.simulation.input) {
    const std::size_t input = place_of(inputs_, one.name);
    if (input == inputs_.size()) {
      document_.refuse(section, one.name, unknown(one.name, {&inputs_}, "an input"),
                       TomlDocument::Fault::key);
      continue;
    }
    if (const auto text = input_formula(section, one, inputs_[input].unit, set)) {
      set.outputs[input].text = *text;
    }
  }
  auto made = compile(set);
  return made ? InputSignals(std::move(made->tape), std::move(made->parameters))
              : InputSignals();  // the parameters' names are refused already
}

/// A formula of t for an input: as it is, or the number that a quantity is.
std::optional<std::string> NamedValues::input_formula(const std::string& section,
                                                      const NamedText& said,
                                                      const std::string& unit,
                                                      expression::FormulaSet set) {
  set.outputs = {{said.name, said.text, ""}};
  const auto parts = split_quantity(said.text, said.name);
  const auto formula = compile(set);
  const bool number = parts && parts->unit.empty();
  if (formula && !number) {
    const auto& dimension = formula->outputs.front();
    const auto wanted = parse_si_unit(unit);
    if (dimension && !dimension->dimensionless() && wanted && !dimension->fits(wanted->dimension)) {
      document_.refuse(section, said.name,
                       Error(ArgumentError::wrong_unit)
                           .about(document_.name(section, said.name))
                           .got("in " + to_text(*dimension))
                           .expected("in " + unit));
      return std::nullopt;
    }
    return said.text;
  }
  const bool written_as_formula = said.text.find_first_of("(*+=?") != std::string::npos;
  if ((!parts || written_as_formula) && !formula) {
    for (const Error& error : formula.error()) {
      if (error.where() == said.name) {
        document_.refuse_part(section, said.name, error);
      }
    }
    return std::nullopt;
  }
  const auto si = value(section, said, unit, Range::any);
  return si ? std::optional(fmt::format("{}", *si)) : std::nullopt;
}

ModelRun NamedValues::run(const Eigen::VectorXd& u, const Coordinates* outputs, bool closed_loop) {
  const SimulationSection& said = project_.simulation;
  constexpr double most = 0.1;
  constexpr double least = 1e-13;
  if (said.accuracy && !(*said.accuracy >= least && *said.accuracy <= most)) {
    document_.refuse("simulation", "accuracy",
                     Error(ArgumentError::out_of_range)
                         .about(document_.name("simulation", "accuracy"))
                         .got(fmt::format("{}", *said.accuracy))
                         .expected(fmt::format("between {} and {}", least, most)));
  }
  ModelRun run{.duration = said.duration.value_or(ModelRun{}.duration),
               .duration_is_given = said.duration.has_value(),
               .step = said.step,
               .accuracy = said.accuracy.value_or(ModelRun{}.accuracy),
               .closed_loop = said.closed_loop.value_or(closed_loop),
               .initial = Eigen::VectorXd::Constant(static_cast<Index>(states_.size()),
                                                    std::numeric_limits<double>::quiet_NaN()),
               .input = read_input(u),
               .noise = of_outputs("simulation.noise", said.noise, outputs),
               .resolution = of_outputs("simulation.resolution", said.resolution, outputs),
               .seed = project_.job.seed};
  read_values("simulation.initial", said.initial, Range::any, &run.initial, nullptr);
  return run;
}

}  // namespace flyball::study
