#include <flyball/simulation/plant.hpp>

#include <cmath>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/systems/model_step.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view where = "ModelPlant";

}  // namespace

ModelPlant::ModelPlant(const AnyModel& model, const MatrixRef& x0,
                       const ModelIntegration& integration)
    : stepper_(model), integration_(integration), x_(x0) {}

Expected<ModelPlant> ModelPlant::create(const AnyModel& model, const MatrixRef& x0,
                                        const ModelIntegration& integration) {
  return Checks(where)
      .positive(integration.max_step.si(), "max_step", "s")
      .not_negative(integration.accuracy, "accuracy")
      .shape(x0, model.states(), 1, "x0", "states x 1")
      .also([&] {
        return model.check(Eigen::VectorXd(x0), Eigen::VectorXd::Zero(model.inputs()), where);
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
    FLYBALL_TRY(const auto solution, integrate(with_input(stepper_.model(), Eigen::VectorXd(u)),
                                               time, x_, time + duration, options));
    x_ = solution.final_state();
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

/// The model's own error where the integration found no way on, so that it names the coordinate.
Expected<void> ModelPlant::failed(const Error& error, const VectorIn& u) const {
  double time = 0.0;
  for (const Evidence& evidence : error.evidence()) {
    if (evidence.name == "t" && evidence.values.size() == 1) {
      time = evidence.values.front();
    } else if (evidence.name == "x" &&
               static_cast<Eigen::Index>(evidence.values.size()) == x_.size()) {
      const auto x = Eigen::VectorXd::Map(evidence.values.data(), x_.size());
      FLYBALL_CHECK(stepper_.model().check(x, u, where, time));
    }
  }
  return tl::unexpected(error);
}

/// What is not finite in the step that began at `before_`: the model there, or what came of it.
Expected<void> ModelPlant::not_finite(double time, const VectorIn& u) const {
  FLYBALL_CHECK(stepper_.model().check(before_, u, where, time));
  Eigen::Index i = 0;
  while (std::isfinite(x_(i))) {
    ++i;
  }
  return refusal(ArgumentError::not_finite, where,
                 "the state " + description().states[static_cast<std::size_t>(i)].name)
      .got(detail::format("{} after t = {} s", format_number(x_(i)), format_number(time)))
      .expected("a finite number")
      .hint("is the loop unstable, or max_step too long for the model?")
      .with("t", time)
      .with("x", std::vector<double>(before_.begin(), before_.end()));
}

}  // namespace flyball
