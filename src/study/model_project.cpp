#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/systems/formula_model.hpp>

#include "study/model_project.hpp"
#include "study/named_value.hpp"

namespace flyball::study {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

using Coordinates = std::vector<Coordinate>;
using Index = Eigen::Index;

/// Reads a document's model, section by section; every error goes to the document.
class ModelReader {
 public:
  ModelReader(TomlDocument& document, const Project& project)
      : document_(document), project_(project), said_(project.model) {}

  std::optional<ModelJob> run() {
    refuse_mechanism();
    states_ = coordinates("states", said_.states);
    inputs_ = coordinates("inputs", said_.inputs);
    mark_angles();
    const std::optional<AnyModel> model = compile_model();
    const ModelSizes sizes{static_cast<Index>(states_.size()), static_cast<Index>(inputs_.size())};
    VectorPair point{Eigen::VectorXd::Zero(sizes.states), Eigen::VectorXd::Zero(sizes.inputs)};
    read_values("point.at", project_.point.at, Sign::any, &point.x, &point.u);
    const NamedControl& control = project_.job.controller.named;
    VectorPair tolerance{Eigen::VectorXd::Constant(sizes.states, nothing),
                         Eigen::VectorXd::Constant(sizes.inputs, nothing)};
    read_values("controller.tolerance", control.tolerance, Sign::positive, &tolerance.x,
                &tolerance.u);
    Eigen::VectorXd limit = Eigen::VectorXd::Constant(sizes.inputs, infinity);
    read_values("controller.limit", control.limit, Sign::positive, nullptr, &limit);
    Eigen::VectorXd reference = Eigen::VectorXd::Constant(sizes.states, nothing);
    read_values("controller.reference", control.reference, Sign::any, &reference, nullptr);
    Eigen::VectorXd initial = point.x;
    read_values("simulation.initial", project_.simulation.initial, Sign::any, &initial, nullptr);
    const std::vector<double> state_tolerance = all_or_none(tolerance.x, states_);
    const std::vector<double> input_tolerance = all_or_none(tolerance.u, inputs_);
    InputSignals input = read_input(point.u);
    if (!model) {
      return std::nullopt;
    }
    ModelRun run{.duration = project_.simulation.duration.value_or(ModelRun{}.duration),
                 .duration_is_given = project_.simulation.duration.has_value(),
                 .step = project_.simulation.step,
                 .accuracy = project_.simulation.accuracy.value_or(ModelRun{}.accuracy),
                 .closed_loop = project_.simulation.closed_loop,
                 .initial = std::move(initial),
                 .initial_is_given = !project_.simulation.initial.empty(),
                 .input = std::move(input),
                 .noise = of_outputs("noise", project_.simulation.noise, model->names().outputs),
                 .resolution = of_outputs("resolution", project_.simulation.resolution,
                                          model->names().outputs),
                 .seed = project_.job.seed};
    return ModelJob{.path = project_.path,
                    .model = *model,
                    .outputs_are_states = said_.outputs.empty(),
                    .x = std::move(point.x),
                    .u = std::move(point.u),
                    .find_equilibrium = project_.point.find_equilibrium,
                    .period = project_.job.controller.period,
                    .delay = project_.job.controller.delay.value_or(0.0),
                    .state_tolerance = state_tolerance,
                    .input_tolerance = input_tolerance,
                    .limit = std::move(limit),
                    .reference = std::move(reference),
                    .run = std::move(run)};
  }

 private:
  struct ModelSizes {
    Index states;
    Index inputs;
  };
  struct VectorPair {
    Eigen::VectorXd x, u;
  };

  /// What a mechanism's project says cannot stand beside a model.
  void refuse_mechanism() {
    const auto refuse_key = [&](std::string_view section, std::string_view key, std::string hint) {
      document_.refuse(section, key,
                       Error(ProjectError::wrong_value)
                           .about(document_.name(section, key))
                           .got("for a mechanism")
                           .hint(std::move(hint)));
    };
    for (const std::string_view name :
         {"mechanism", "gains", "log", "estimator", "sensor", "battery", "profile"}) {
      if (document_.writes(name)) {
        refuse_key("", name, "a file has [model] or [mechanism], not both");
      }
    }
    if (document_.has("controller", "input_tolerance")) {
      refuse_key("controller", "input_tolerance", "[model] has tolerance, by name");
    }
    if (document_.has("controller", "max_voltage")) {
      refuse_key("controller", "max_voltage", "[model] has limit, by name");
    }
  }

  Coordinates coordinates(std::string_view key, const NamedTexts& said) {
    const std::string section = name_of("model", key);
    Coordinates all;
    for (const auto& [name, text] : said) {
      all.push_back({.name = name, .unit = text});
      if (text.find_first_not_of(' ') == std::string::npos) {
        document_.refuse(section, name,
                         Error(ArgumentError::wrong_unit)
                             .about(document_.name(section, name))
                             .got("without a unit")
                             .hint("write its unit, such as \"rad/s\", or \"1\" for a plain "
                                   "number"));
      } else if (auto unit = parse_si_unit(text); !unit) {
        document_.refuse(section, name, std::move(unit).error());
        all.back().unit.clear();
      } else {
        SiDimension angle;
        angle.exponents[SiDimension::radian] = 1.0;
        all.back().is_angle = unit->dimension.exponents == angle.exponents;
      }
    }
    return all;
  }

  void mark_angles() {
    if (!document_.has("model", "angles")) {
      return;
    }
    for (Coordinate& state : states_) {
      state.is_angle =
          std::find(said_.angles.begin(), said_.angles.end(), state.name) != said_.angles.end();
    }
    for (const std::string& name : said_.angles) {
      if (place_of(states_, name) == states_.size()) {
        document_.refuse("model", "angles", unknown(name, {&states_}, "a state"));
      }
    }
  }

  static std::size_t place_of(const Coordinates& list, const std::string& name) {
    return static_cast<std::size_t>(
        std::find_if(list.begin(), list.end(),
                     [&](const Coordinate& one) { return one.name == name; }) -
        list.begin());
  }

  static Error unknown(const std::string& name, std::initializer_list<const Coordinates*> lists,
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

  std::optional<AnyModel> compile_model() {
    ModelFormulas formulas{
        .name = said_.name.empty() ? "model" : said_.name, .states = states_, .inputs = inputs_};
    for (const auto& [name, text] : said_.parameters) {
      const std::string called = document_.name("model.parameters", name);
      auto parts = split_quantity(text, called);
      auto unit = parts ? parse_si_unit(parts->unit) : Expected<SiUnit>();
      if (!parts || !unit) {
        document_.refuse("model.parameters", name,
                         parts ? std::move(unit).error() : std::move(parts).error());
      }
      formulas.parameters.push_back({name,
                                     !parts || !unit       ? ""
                                     : parts->unit.empty() ? "1"
                                                           : std::string(parts->unit),
                                     parts ? parts->number : 0.0});
    }
    parameters_ = formulas.parameters;
    const auto take = [](const NamedTexts& said, std::vector<expression::Formula>& list) {
      for (const auto& [name, text] : said) {
        list.push_back({name, text, ""});
      }
    };
    take(said_.definitions, formulas.definitions);
    take(said_.derivative, formulas.derivatives);
    take(said_.outputs, formulas.outputs);
    if (!document_.has("model", "states")) {
      document_.miss("model", "states", "for example states = { theta = \"rad\" }");
      return std::nullopt;
    }
    if (!document_.has("model", "derivative")) {
      document_.miss("model", "derivative",
                     "write [model.derivative] and in it a formula for each state");
      return std::nullopt;
    }
    auto model = formula_model(formulas);
    if (model) {
      return *std::move(model);
    }
    for (Error& error : model.error()) {
      refuse(std::move(error));
    }
    return std::nullopt;
  }

  /// An error of the model's formulas, where it belongs.
  void refuse(Error error) {
    const std::string where = error.where();
    const auto of = [&](std::string_view prefix, const std::string& section) {
      const std::string name = where.substr(prefix.size());
      if (!document_.has(section, name)) {
        document_.miss(section, name, fmt::format("each state needs one: {} = \"…\"", name));
      } else {
        document_.refuse_part(section, name, std::move(error));
      }
    };
    constexpr std::string_view derivative = "derivative of ";
    constexpr std::string_view output = "output ";
    if (where.starts_with(derivative)) {
      of(derivative, "model.derivative");
    } else if (where.starts_with(output)) {
      of(output, "model.outputs");
    } else if (!where.empty()) {
      of("", "model.definitions");
    } else {
      std::string name = error.subject();
      std::erase(name, '"');
      // Of two things of one name, the later.
      for (const std::string_view key : {"definitions", "parameters", "inputs", "states"}) {
        if (document_.has(name_of("model", key), name)) {
          document_.refuse(name_of("model", key), name, std::move(error));
          return;
        }
      }
      document_.refuse("model", "states", std::move(error));
    }
  }

  /// A value with the unit of a coordinate, in SI; nothing where it is refused.
  std::optional<double> value(const std::string& section, const NamedText& said,
                              const std::string& unit, Sign sign) {
    auto read = named_value(said.text, document_.name(section, said.name), unit, sign);
    if (read) {
      return *read;
    }
    document_.refuse(section, said.name, std::move(read).error());
    return std::nullopt;
  }

  /// Values by the names of states and inputs. @param x, u  Where they go; null: not allowed.
  void read_values(const std::string& section, const NamedTexts& said, Sign sign,
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
                                   : "a state or an input"));
        continue;
      }
      const bool is_state = state < states_.size();
      if (const auto si =
              value(section, one, (is_state ? states_[state] : inputs_[input]).unit, sign)) {
        (is_state ? (*x)(static_cast<Index>(state)) : (*u)(static_cast<Index>(input))) = *si;
      }
    }
  }

  std::vector<double> all_or_none(const Eigen::VectorXd& values, const Coordinates& list) {
    const auto given = (values.array() == values.array()).count();
    for (Index i = 0; given > 0 && i < values.size(); ++i) {
      const std::string& name = list[static_cast<std::size_t>(i)].name;
      if (!(values(i) == values(i)) && !document_.has("controller.tolerance", name)) {
        document_.miss("controller.tolerance", name, "say it for all, or for none");
      }
    }
    return given == values.size() ? std::vector<double>(values.begin(), values.end())
                                  : std::vector<double>();
  }

  std::vector<double> of_outputs(std::string_view key, const NamedTexts& said,
                                 const Coordinates& outputs) {
    const std::string section = name_of("simulation", key);
    std::vector<double> values(outputs.size(), 0.0);
    for (const NamedText& one : said) {
      const std::size_t output = place_of(outputs, one.name);
      if (output == outputs.size()) {
        document_.refuse(section, one.name, unknown(one.name, {&outputs}, "an output"));
      } else if (const auto si =
                     value(section, one, outputs[output].unit.empty() ? "1" : outputs[output].unit,
                           Sign::not_negative)) {
        values[output] = *si;
      }
    }
    return values;
  }

  /// The open loop's inputs: those of the point, where no other is said.
  InputSignals read_input(const Eigen::VectorXd& u) {
    constexpr const char* section = "simulation.input";
    expression::FormulaSet set{.variables = {{"t", ""}}};
    for (const Parameter& parameter : parameters_) {
      if (parameter.name != "t") {
        set.parameters.push_back({parameter.name, parameter.unit, parameter.value});
      }
    }
    for (Index i = 0; i < u.size(); ++i) {
      set.outputs.push_back(
          {inputs_[static_cast<std::size_t>(i)].name, fmt::format("{}", u(i)), ""});
    }
    for (const NamedText& one : project_.simulation.input) {
      const std::size_t input = place_of(inputs_, one.name);
      if (input == inputs_.size()) {
        document_.refuse(section, one.name, unknown(one.name, {&inputs_}, "an input"));
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
  std::optional<std::string> input_formula(const std::string& section, const NamedText& said,
                                           const std::string& unit, expression::FormulaSet set) {
    set.outputs = {{said.name, said.text, ""}};
    const auto parts = split_quantity(said.text, said.name);
    const auto formula = compile(set);
    const bool number = parts && parts->unit.empty();
    if (formula && !number) {
      const auto& dimension = formula->outputs.front();
      const auto wanted = parse_si_unit(unit);
      if (dimension && !dimension->dimensionless() && wanted &&
          !dimension->fits(wanted->dimension)) {
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
    const auto si = value(section, said, unit, Sign::any);
    return si ? std::optional(fmt::format("{}", *si)) : std::nullopt;
  }

  TomlDocument& document_;
  const Project& project_;
  const FormulaSection& said_;
  Coordinates states_;
  Coordinates inputs_;
  std::vector<Parameter> parameters_;
};

}  // namespace

std::optional<ModelJob> model_job(TomlDocument& document, const Project& project) {
  return ModelReader(document, project).run();
}

}  // namespace flyball::study
