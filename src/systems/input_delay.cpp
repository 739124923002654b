#include <flyball/systems/input_delay.hpp>

#include <cmath>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"

namespace flyball {

Expected<DelayedInputMatrices> discretize_delayed_input(const MatrixRef& A, const MatrixRef& B,
                                                        Time period, Time delay) {
  constexpr std::string_view where = "discretize_delayed_input";
  FLYBALL_CHECK(
      Checks(where).positive(period.si(), "period", "s").not_negative(delay.si(), "delay", "s"));
  const double T = period.si();
  const double periods = delay.si() / T;
  constexpr double most_periods = 1e4;
  if (periods > most_periods) {
    return refusal(ArgumentError::out_of_range, where, "delay")
        .got(format_number(periods) + " periods")
        .expected("at most 10000 periods");
  }
  // A delay of decimal fractions is seldom whole periods to the last bit.
  double whole = std::floor(periods);
  double f = delay.si() - whole * T;
  constexpr double rounding = 1e-12;
  if (std::abs(periods - std::round(periods)) <= rounding * std::max(1.0, periods)) {
    whole = std::round(periods);
    f = 0.0;
  }
  if (f <= 0.0) {
    return discretize_zoh(A, B, period).map([&](const DiscretizedMatrices& discrete) {
      return DelayedInputMatrices{discrete.A, discrete.B, Eigen::MatrixXd::Zero(B.rows(), B.cols()),
                                  static_cast<int>(whole)};
    });
  }
  FLYBALL_TRY(auto newer, discretize_zoh(A, B, Time(T - f)));
  FLYBALL_TRY(auto older, discretize_zoh(A, B, Time(f)));
  return DelayedInputMatrices{newer.A * older.A, newer.B, newer.A * older.B,
                              static_cast<int>(whole)};
}

Expected<DiscreteSystem<>> discretize_with_input_delay(const ContinuousSystem<>& system,
                                                       Time period, Time delay) {
  FLYBALL_CHECK(check_system(system, "discretize_with_input_delay"));
  FLYBALL_TRY(const auto discrete, discretize_delayed_input(system.A, system.B, period, delay));
  const Eigen::Index n = system.A.rows();
  const Eigen::Index m = system.B.cols();
  const Eigen::Index d = discrete.whole_periods;
  const bool fraction = !discrete.B_1.isZero(0.0);
  const Eigen::Index stored = d + (fraction ? 1 : 0);

  DiscreteSystem<> delayed;
  delayed.period = period;
  delayed.A.setZero(n + m * stored, n + m * stored);
  delayed.B.setZero(n + m * stored, m);
  delayed.C.setZero(system.C.rows(), n + m * stored);
  delayed.C.leftCols(n) = system.C;
  delayed.A.topLeftCorner(n, n) = discrete.A;
  // The states after the plant's are u_{k-1}, u_{k-2}, …
  const auto past = [&](Eigen::Index steps) {
    return delayed.A.block(0, n + m * (steps - 1), n, m);
  };
  if (d == 0) {
    delayed.B.topRows(n) = discrete.B_0;
  } else {
    past(d) = discrete.B_0;
  }
  if (fraction) {
    past(d + 1) = discrete.B_1;
  }
  if (stored > 0) {
    delayed.B.middleRows(n, m).setIdentity();
    delayed.A.block(n + m, n, m * (stored - 1), m * (stored - 1)).setIdentity();
  }
  delayed.D.setZero(system.C.rows(), m);
  if (stored == 0) {
    delayed.D = system.D;
  } else if (d > 0 || fraction) {
    // At a sample the input that acts is u_{k-d}, or the one before it until the fraction is over.
    delayed.C.block(0, n + m * (stored - 1), system.C.rows(), m) = system.D;
  }
  return delayed;
}

}  // namespace flyball
