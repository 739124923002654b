#include <flyball/simulation/plant.hpp>

#include <cmath>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/systems/model_step.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view model_plant = "ModelPlant";

}  // namespace

Error explained(Error error, const AnyModel& model, FunctionRef<Eigen::VectorXd(double)> input,
                std::string_view where) {
  double t = 0.0;
  Eigen::VectorXd x;
  for (const Evidence& evidence : error.evidence()) {
    if (evidence.name == "t" && evidence.values.size() == 1) {
      t = evidence.values.front();
    } else if (evidence.name == "x") {
      x = Eigen::VectorXd::Map(evidence.values.data(),
                               static_cast<Eigen::Index>(evidence.values.size()));
    }
  }
  if (x.size() != model.states()) {
    return std::move(error).in(std::string(where));
  }
  const Eigen::VectorXd slope = model.derivative(x, input(t));
  if (error.is(IntegrationError::not_finite)) {
    // Where it stopped the model still has numbers; a little ahead it has not.
    double h = 0.0;
    for (int i = 0; i < 10; ++i, h = std::max(10.0 * h, 1e-9)) {
      if (auto checked = model.check(x + h * slope, input(t + h), where, t + h); !checked) {
        return std::move(checked).error();
      }
    }
  }
  if (error.is(IntegrationError::step_underflow) || error.is(IntegrationError::not_finite)) {
    Eigen::Index i = 0;
    (slope.array().abs() / (1.0 + x.array().abs())).maxCoeff(&i);
    const Coordinate& state = model.names().states[static_cast<std::size_t>(i)];
    error =
        std::move(error)
            .about("the state " + state.name)
            .got(detail::format("{}{}{} at t = {} s, where it changes faster than steps can follow",
                                format_number(x(i)), state.unit.empty() ? "" : " ", state.unit,
                                format_number(t)))
            .hint("it runs away, or its derivative jumps there: end before, or change the model");
  }
  return std::move(error).in(std::string(where));
}

ModelPlant::ModelPlant(const AnyModel& model, const MatrixRef& x0,
                       const ModelIntegration& integration)
    : stepper_(model), integration_(integration), x_(x0) {}

Expected<ModelPlant> ModelPlant::create(const AnyModel& model, const MatrixRef& x0,
                                        const ModelIntegration& integration) {
  return Checks(model_plant)
      .positive(integration.max_step.si(), "max_step", "s")
      .not_negative(integration.accuracy, "accuracy")
      .shape(x0, model.states(), 1, "x0", "states x 1")
      .also([&] {
        return model.check(Eigen::VectorXd(x0), Eigen::VectorXd::Zero(model.inputs()), model_plant);
      })
      .map([&] { return ModelPlant(model, x0, integration); });
}

Expected<void> ModelPlant::advance(double time, const VectorIn& u, double duration) {
  if (!(duration > 0.0)) {
    return {};
  }
  if (integration_.accuracy > 0.0) {
    const IntegrationOptions options{.relative_tolerance = integration_.accuracy,
                                     .absolute_tolerance = integration_.accuracy};
    const Eigen::VectorXd held = u;
    const auto solution =
        integrate(with_input(stepper_.model(), held), time, x_, time + duration, options);
    if (!solution) {
      return tl::unexpected(
          explained(solution.error(), stepper_.model(), [&](double) { return held; }, model_plant));
    }
    x_ = solution->final_state();
    return {};
  }
  const double steps = std::ceil(duration / integration_.max_step.si());
  for (double i = 0.0; i < steps; ++i) {
    before_ = x_;
    stepper_.step(x_, u, duration / steps);
    if (!x_.allFinite()) {
      return not_finite(time + i * duration / steps, u);
    }
  }
  return {};
}

/// What is not finite in the step that began at `before_`: the model there, or what came of it.
Expected<void> ModelPlant::not_finite(double time, const VectorIn& u) const {
  FLYBALL_CHECK(stepper_.model().check(before_, u, model_plant, time));
  Eigen::Index i = 0;
  while (std::isfinite(x_(i))) {
    ++i;
  }
  return refusal(ArgumentError::not_finite, model_plant,
                 "the state " + description().states[static_cast<std::size_t>(i)].name)
      .got(detail::format("{} after t = {} s", format_number(x_(i)), format_number(time)))
      .expected("a finite number")
      .hint("is the loop unstable, or max_step too long for the model?")
      .with("t", time)
      .with("x", std::vector<double>(before_.begin(), before_.end()));
}

}  // namespace flyball
