#include <flyball/identification/streamed_one_step.hpp>

#include <array>
#include <cmath>

#include <flyball/identification/identification_error.hpp>

#include "core/try.hpp"
#include "identification/one_step_gains.hpp"

namespace flyball::identification {

using mechanisms::MechanismKind;

StreamedOneStep::StreamedOneStep(MechanismKind kind, bool with_angle)
    : elevator_(kind == MechanismKind::elevator),
      arm_(kind == MechanismKind::arm && with_angle),
      // From 3 to 5 coefficients are always in range.
      regression_(*StreamedLeastSquares::create(3 + (elevator_ ? 1 : 0) + (arm_ ? 2 : 0))) {}

bool StreamedOneStep::add(double x, double u, double angle, double next) noexcept {
  if (x == 0.0) {
    return false;
  }
  std::array<double, 5> row{x, u, std::copysign(1.0, x), 1.0, 0.0};
  if (arm_) {
    row[3] = std::cos(angle);
    row[4] = std::sin(angle);
  }
  if (!regression_.add(row.data(), next)) {
    return false;
  }
  const double change = next - mean_;
  mean_ += change / static_cast<double>(regression_.rows());
  square_ += change * (next - mean_);
  return true;
}

Expected<OneStepFit> StreamedOneStep::fit(double period) const {
  const Eigen::Index terms = 3 + (elevator_ ? 1 : 0) + (arm_ ? 2 : 0);
  if (regression_.rows() < 10 * terms) {
    return refusal(IdentificationError::too_short, "fit_one_step")
        .hint("record longer tests")
        .with("rows in motion", static_cast<double>(regression_.rows()));
  }
  FLYBALL_TRY(const Regression found, regression_.solve());
  if (found.rank < terms) {
    return refusal(IdentificationError::singular, "fit_one_step")
        .hint("record ramps and steps in both directions")
        .with("rank", static_cast<double>(found.rank))
        .with("gains", static_cast<double>(terms));
  }
  OneStepFit fit = one_step_gains(found.coefficients, period, elevator_, arm_);
  fit.r_squared = square_ > 0.0 ? 1.0 - found.residual_squares / square_ : 0.0;
  return fit;
}

}  // namespace flyball::identification
