#include <flyball/control/saturation.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_limits(const Eigen::VectorXd& u_min, const Eigen::VectorXd& u_max,
                            Eigen::Index m, std::string_view where) {
  FLYBALL_CHECK(Checks(where)
                    .shape(u_min, m, 1, "u_min", "inputs x 1")
                    .shape(u_max, m, 1, "u_max", "inputs x 1"));
  for (Eigen::Index i = 0; i < m; ++i) {
    if (!(u_min(i) < u_max(i))) {
      return refusal(ArgumentError::out_of_range, where, detail::format("u_min({})", i))
          .got(format_number(u_min(i)))
          .expected(detail::format("below u_max({}), which is {}", i, format_number(u_max(i))));
    }
  }
  return {};
}

/// The time from which on all later samples are in place; nothing if the last one is not.
class Settling {
 public:
  void add(double time, bool in_place) {
    if (!in_place) {
      since_.reset();
    } else if (!since_) {
      since_ = time;
    }
  }
  [[nodiscard]] std::optional<double> time() const { return since_; }

 private:
  std::optional<double> since_;
};

}  // namespace

Expected<SaturationAnalysis> analyze_saturation(const MatrixRef& K, const Eigen::VectorXd& error,
                                                const Eigen::VectorXd& u_min,
                                                const Eigen::VectorXd& u_max,
                                                const Eigen::VectorXd& u_ff) {
  constexpr std::string_view where = "analyze_saturation";
  const Eigen::Index m = K.rows();
  const Eigen::Index n = K.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(error, n, 1, "error", "states x 1")
                    .shape(u_ff, m, 1, "u_ff", "inputs x 1")
                    .finite(K, "K")
                    .finite(error, "error")
                    .finite(u_ff, "u_ff")
                    .also([&] { return check_limits(u_min, u_max, m, where); }));
  SaturationAnalysis analysis;
  const Eigen::VectorXd feedback = K * error;
  analysis.u = feedback + u_ff;
  analysis.u_limited = analysis.u.cwiseMax(u_min).cwiseMin(u_max);
  analysis.gain_fraction = Eigen::VectorXd::Ones(m);
  analysis.largest_error = Eigen::VectorXd::Constant(n, infinity);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (analysis.u_limited(i) != analysis.u(i) && feedback(i) != 0.0) {
      analysis.gain_fraction(i) = (analysis.u_limited(i) - u_ff(i)) / feedback(i);
    }
    const double room = std::max(0.0, std::min(u_max(i) - u_ff(i), u_ff(i) - u_min(i)));
    for (Eigen::Index j = 0; j < n; ++j) {
      if (K(i, j) != 0.0) {
        analysis.largest_error(j) = std::min(analysis.largest_error(j), room / std::abs(K(i, j)));
      }
    }
  }
  analysis.effective_K = analysis.gain_fraction.asDiagonal() * K;
  return analysis;
}

Expected<SaturatedStep> saturation_of_step(const DiscreteSystem<>& plant, const MatrixRef& K,
                                           const Eigen::VectorXd& r, const Eigen::VectorXd& u_min,
                                           const Eigen::VectorXd& u_max, int steps) {
  constexpr std::string_view where = "saturation_of_step";
  constexpr double near = 0.02;
  FLYBALL_CHECK(check_system(plant, where));
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index m = plant.B.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(K, m, n, "K", "inputs x states")
                    .finite(K, "K")
                    .shape(r, n, 1, "r", "states x 1")
                    .finite(r, "r")
                    .also([&] { return check_limits(u_min, u_max, m, where); }));
  if (steps < 1 || steps > 10'000'000) {
    return refusal(ArgumentError::out_of_range, where, "steps")
        .got(detail::format("{}", steps))
        .expected("from 1 to 10000000");
  }
  SaturatedStep step;
  const Eigen::VectorXd demand = r - plant.A * r;
  step.holding_input = detail::solve_least_squares(plant.B, demand);
  const bool held =
      (plant.B * step.holding_input - demand).norm() <= 1e-9 * (r.norm() + demand.norm());
  step.reference_can_be_held = held && (step.holding_input.array() >= u_min.array()).all() &&
                               (step.holding_input.array() <= u_max.array()).all();
  const Eigen::VectorXd band = near * r.cwiseAbs();
  const double largest_band = band.maxCoeff();
  const auto in_place = [&](const Eigen::VectorXd& x) {
    for (Eigen::Index i = 0; i < n; ++i) {
      // A state whose reference is zero does not decide.
      if (band(i) > 0.0 && std::abs(x(i) - r(i)) > band(i)) {
        return false;
      }
    }
    return largest_band > 0.0;
  };
  const double T = plant.period.si();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd linear = x;
  Settling settling;
  Settling linear_settling;
  for (int k = 0; k <= steps; ++k) {
    const double time = k * T;
    settling.add(time, in_place(x));
    linear_settling.add(time, in_place(linear));
    const Eigen::VectorXd u = K * (r - x) + step.holding_input;
    const Eigen::VectorXd limited = u.cwiseMax(u_min).cwiseMin(u_max);
    if ((u.array() != limited.array()).any() && k < steps) {
      step.saturated_time += T;
      step.last_saturated = time + T;
    }
    x = (plant.A * x + plant.B * limited).eval();
    linear = (plant.A * linear + plant.B * (K * (r - linear) + step.holding_input)).eval();
  }
  step.settling_time = settling.time();
  step.linear_settling_time = linear_settling.time();
  return step;
}

}  // namespace flyball
