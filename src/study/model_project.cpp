#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/systems/formula_model.hpp>

#include "core/constants.hpp"
#include "study/estimate_project.hpp"
#include "study/fit_project.hpp"
#include "study/model_project.hpp"
#include "study/named_values.hpp"

namespace flyball::study {

namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

using Coordinates = std::vector<Coordinate>;
using Index = Eigen::Index;

/// Whether it is the unit of a mass or of a moment of inertia.
bool is_never_negative(const SiUnit& unit) {
  static const SiUnit mass = parse_si_unit("kg").value();
  static const SiUnit inertia = parse_si_unit("kg m^2").value();
  return unit.dimension.exponents == mass.dimension.exponents ||
         unit.dimension.exponents == inertia.dimension.exponents;
}

/// Reads a document's model, section by section; every error goes to the document.
class ModelReader : private NamedValues {
 public:
  ModelReader(TomlDocument& document, const Project& project)
      : NamedValues(document, project), said_(project.model) {}

  std::optional<ModelJob> job() {
    states_ = coordinates("states", said_.states);
    inputs_ = coordinates("inputs", said_.inputs);
    mark_angles();
    if (states_.empty()) {  // Then nothing else can be told.
      refuse_no_states();
      return std::nullopt;
    }
    const std::optional<AnyModel> model = compile_model();
    ModelSwingUp swing_up = swing_up_of();
    const ModelSizes sizes{static_cast<Index>(states_.size()), static_cast<Index>(inputs_.size())};
    VectorPair point{Eigen::VectorXd::Zero(sizes.states), Eigen::VectorXd::Zero(sizes.inputs)};
    read_values("point.at", project_.point.at, Range::any, &point.x, &point.u);
    const NamedControl& control = project_.job.controller.named;
    VectorPair tolerance{Eigen::VectorXd::Constant(sizes.states, nothing),
                         Eigen::VectorXd::Constant(sizes.inputs, nothing)};
    read_values("controller.tolerance", control.tolerance, Range::positive, &tolerance.x,
                &tolerance.u);
    Eigen::VectorXd limit = Eigen::VectorXd::Constant(sizes.inputs, infinity);
    read_values("controller.limit", control.limit, Range::positive, nullptr, &limit);
    Eigen::VectorXd reference = Eigen::VectorXd::Constant(sizes.states, nothing);
    read_values("controller.reference", control.reference, Range::any, &reference, nullptr);
    const std::vector<double> state_tolerance = all_or_none(tolerance.x, states_);
    const std::vector<double> input_tolerance = all_or_none(tolerance.u, inputs_);
    ModelRun simulation = run(point.u, model ? &model->names().outputs : nullptr, false);
    if (!model) {
      return std::nullopt;
    }
    ModelFit fit = model_fit(document_, project_, *model, point.x);
    ModelEstimate estimate = model_estimate(document_, project_, *model, point.x);
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
                    .run = std::move(simulation),
                    .fit = std::move(fit),
                    .estimate = std::move(estimate),
                    .equations = std::move(equations_),
                    .swing_up = std::move(swing_up)};
  }

 private:
  struct ModelSizes {
    Index states;
    Index inputs;
  };
  struct VectorPair {
    Eigen::VectorXd x, u;
  };

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
        document_.refuse(section, name,
                         std::move(unit).error().about(document_.name(section, name)));
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

  std::optional<AnyModel> compile_model() {
    ModelFormulas formulas{
        .name = said_.name.empty() ? "model" : said_.name, .states = states_, .inputs = inputs_};
    Coordinates known;
    for (const NamedText& one : said_.parameters) {
      if (!document_.is_new("model.parameters", one.name)) {
        known.push_back({.name = one.name});
      }
    }
    for (const auto& [name, text] : said_.parameters) {
      const std::string called = document_.name("model.parameters", name);
      auto parts = split_quantity(text, called);
      auto unit = parts ? parse_si_unit(parts->unit) : Expected<SiUnit>();
      if (!parts || !unit) {
        document_.refuse(
            "model.parameters", name,
            (parts ? std::move(unit).error() : std::move(parts).error()).about(called));
      } else if (document_.is_new("model.parameters", name)) {
        document_.refuse("model.parameters", name,
                         unknown(name, {&known}, "a parameter of the model"));
      }
      if (parts && unit && parts->number < 0.0 && is_never_negative(*unit)) {
        document_.refuse("model.parameters", name,
                         Error(ArgumentError::out_of_range)
                             .about(called)
                             .got(fmt::format("\"{}\"", text))
                             .expected("zero or more: a mass and a moment of inertia are never "
                                       "negative"));
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
    if (said_.derivative.empty()) {
      refuse_no_derivative();
      return std::nullopt;
    }
    auto model = formula_model(formulas);
    if (model) {
      read_equations(formulas);
      return *std::move(model);
    }
    for (Error& error : model.error()) {
      refuse(std::move(error));
    }
    return std::nullopt;
  }

  /// The equations and the energy, of a model whose own formulas are right.
  void read_equations(const ModelFormulas& formulas) {
    std::vector<expression::Formula> further;
    if (!project_.swing_up.energy.empty()) {
      further.push_back({"energy", project_.swing_up.energy, ""});
    }
    auto made = model_equations(formulas, further);
    if (made) {
      equations_ = *std::move(made);
      return;
    }
    for (Error& error : made.error()) {
      document_.refuse_part("swing_up", "energy", std::move(error));
    }
  }

  ModelSwingUp swing_up_of() {
    const auto n = static_cast<Index>(states_.size());
    const SwingUpSection& said = project_.swing_up;
    ModelSwingUp result{.has_energy = !said.energy.empty(),
                        .hold = Eigen::VectorXd::Zero(n),
                        .reach = Eigen::VectorXd::Constant(n, infinity),
                        .sharpness = said.sharpness.value_or(10.0)};
    read_values("swing_up.reach", said.reach, Range::positive, &result.reach, nullptr);
    for (const NamedText& one : said.hold) {
      const std::size_t place = place_of(states_, one.name);
      if (place == states_.size()) {
        document_.refuse("swing_up.hold", one.name, unknown(one.name, {&states_}, "a state"));
        continue;
      }
      const std::string unit =
          inputs_.size() == 1 ? fmt::format("({})/({})", inputs_[0].unit, states_[place].unit) : "";
      if (const auto gain = value("swing_up.hold", one, unit, Range::any)) {
        result.hold(static_cast<Index>(place)) = *gain;
      }
    }
    if (result.has_energy && inputs_.size() != 1) {
      document_.refuse("swing_up", "energy",
                       Error(ArgumentError::out_of_range)
                           .about("swing_up.energy")
                           .got(fmt::format("for a model of {} inputs", inputs_.size()))
                           .expected("for a model of one input"));
    }
    return result;
  }

  void refuse_no_states() {
    if (!document_.has("model", "states")) {
      document_.miss("model", "states", "for example states = { theta = \"rad\" }");
    } else if (!document_.errors()) {
      document_.refuse("model", "states",
                       Error(ArgumentError::empty)
                           .about("model.states")
                           .got("empty")
                           .expected("the name and the unit of at least one"));
    }
    if (said_.derivative.empty()) {
      refuse_no_derivative();
    }
  }

  void refuse_no_derivative() {
    if (!document_.has("model", "derivative") || !document_.errors()) {
      document_.miss("model", "derivative",
                     "write [model.derivative] and in it a formula for each state");
    }
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
          document_.refuse(name_of("model", key), name, std::move(error), TomlDocument::Fault::key);
          return;
        }
      }
      document_.refuse("model", "states", std::move(error));
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

  const FormulaSection& said_;
  expression::CompiledFormulas equations_{};
};

}  // namespace

std::optional<ModelJob> model_job(TomlDocument& document, const Project& project) {
  return ModelReader(document, project).job();
}

ModelRun mechanism_run(TomlDocument& document, const Project& project) {
  const std::string& unit = project.job.plant.unit;
  NamedValues values(document, project, {{"position", unit}, {"velocity", unit + "/s"}},
                     {{"voltage", "V"}});
  return values.run(Eigen::VectorXd::Zero(1), nullptr, project.simulation.input.empty());
}

}  // namespace flyball::study
