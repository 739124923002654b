#include <flyball/estimation/continuous_kalman_gain.hpp>

#include <utility>

#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/controllability.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_continuous_kalman_gain = "continuous_kalman_gain";

/// What the dual's Riccati equation refuses, in words of the filter.
Error filter_error(const Error& dual, const MatrixRef& A, const MatrixRef& C) {
  const auto sight = analyze_observability(A, C, TimeDomain::continuous);
  if (sight && !sight->detectable) {
    for (const ModeReach& mode : sight->modes) {
      if (!mode.reached && mode.stability != Stability::stable) {
        return refusal(KalmanGainError::not_detectable, in_continuous_kalman_gain, "(A, C)")
            .hint(
                "nothing corrects this mode; measure a state that it moves, or take it out of the "
                "model")
            .with("eigenvalue", {mode.eigenvalue.real(), mode.eigenvalue.imag()});
      }
    }
  }
  if (dual.is(RiccatiError::no_stabilizing_solution)) {
    Error error = refusal(KalmanGainError::undriven_mode, in_continuous_kalman_gain, "Q")
                      .hint("give this mode some process noise, or take it out of the model");
    for (const Evidence& evidence : dual.evidence()) {
      error = Error(std::move(error).with(evidence.name, evidence.values));
    }
    return error;
  }
  return Error(dual).in(std::string(in_continuous_kalman_gain));
}

}  // namespace

Expected<ContinuousKalmanGain> continuous_kalman_gain(const MatrixRef& A, const MatrixRef& C,
                                                      const ProcessDensity& Q,
                                                      const MeasurementDensity& R) {
  FLYBALL_CHECK(check_square(A, in_continuous_kalman_gain, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(Checks(in_continuous_kalman_gain)
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(Q.Q, n, n, "Q", "states x states")
                    .shape(R.R, p, p, "R", "outputs x outputs")
                    .finite(A, "A")
                    .finite(C, "C")
                    .also([&] { return check_covariance(Q.Q, in_continuous_kalman_gain, "Q"); })
                    .also([&] { return check_covariance(R.R, in_continuous_kalman_gain, "R"); }));
  auto dual = care(A.transpose(), C.transpose(), Q.Q, R.R);
  if (!dual) {
    return tl::unexpected(filter_error(dual.error(), A, C));
  }
  return ContinuousKalmanGain{dual->K.transpose(), dual->X, dual->poles, dual->residual,
                              dual->condition};
}

}  // namespace flyball
