#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/control/feedforward.tpp>
#include <flyball/control/lqg.hpp>
#include <flyball/control/state_feedback.tpp>
#include <flyball/estimation/observer.tpp>

namespace flyball {

namespace detail {

struct LqgDefinitions {};

/// What Lqg::create asks of its arguments.
[[nodiscard]] Expected<void> check_lqg(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                       const MatrixRef& D, Time period, const MatrixRef& K,
                                       const MatrixRef& K_e, const MatrixRef& u_min,
                                       const MatrixRef& u_max);

}  // namespace detail

template <int States, int Inputs, int Outputs>
Lqg<States, Inputs, Outputs>::Lqg(const Plant& plant, const FeedbackGain& K,
                                  const EstimatorGain& K_e,
                                  const LinearPlantInversion<States, Inputs>& inversion,
                                  const InputVector& u_min, const InputVector& u_max)
    : observer_(plant, K_e),
      feedback_(K, u_min, u_max),
      inversion_(inversion),
      u_model_(InputVector::Zero(plant.B.cols())) {}

template <int States, int Inputs, int Outputs>
auto Lqg<States, Inputs, Outputs>::create(const Plant& plant, const FeedbackGain& K,
                                          const EstimatorGain& K_e, const InputVector& u_min,
                                          const InputVector& u_max) -> Expected<Lqg> {
  if (auto checked =
          detail::check_lqg(plant.A, plant.B, plant.C, plant.D, plant.period, K, K_e, u_min, u_max);
      !checked) {
    return tl::unexpected(checked.error());
  }
  return pseudoinverse(plant.B).map([&](const Pseudoinverse& B_pinv) {
    return Lqg(plant, K, K_e, LinearPlantInversion<States, Inputs>(plant.A, B_pinv.X), u_min,
               u_max);
  });
}

template <int States, int Inputs, int Outputs>
auto Lqg<States, Inputs, Outputs>::step(const StateVector& r, const StateVector& r_next,
                                        const OutputVector& y, const InputVector& extra) noexcept
    -> InputVector {
  return step(r, r_next, y, extra, std::numeric_limits<double>::infinity());
}

template <int States, int Inputs, int Outputs>
auto Lqg<States, Inputs, Outputs>::step(const StateVector& r, const StateVector& r_next,
                                        const OutputVector& y) noexcept -> InputVector {
  return step(r, r_next, y, InputVector::Zero(u_model_.size()));
}

template <int States, int Inputs, int Outputs>
auto Lqg<States, Inputs, Outputs>::step(const StateVector& r, const StateVector& r_next,
                                        const OutputVector& y, const InputVector& extra,
                                        double rail_voltage) noexcept -> InputVector {
  observer_.predict(u_model_);
  measured_ = observer_.update(y, u_model_);
  u_model_ = extra;
  detail::keep_signals(u_model_);
  const InputVector u_ff = inversion_.calculate(r, r_next) + u_model_;
  InputVector u = feedback_.calculate(observer_.x_hat(), r, u_ff);
  if (rail_voltage > 0.0) {
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      u(i) = std::clamp(u(i), -rail_voltage, rail_voltage);
    }
  }
  u_model_ = u - u_model_;
  return u;
}

}  // namespace flyball
