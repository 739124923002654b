#include <flyball/systems/discretize.hpp>

#include <cmath>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/ordinary_units.hpp"
#include "systems/hold_units.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// exp([A B; 0 0] T), B of A's size: its upper right block is linear in B, and a B that is scaled
/// cannot force squarings that A does not need.
Expected<DiscretizedMatrices> hold(const MatrixRef& A, const MatrixRef& B, double T) {
  const Index n = A.rows();
  const Index m = B.cols();
  const double size_A = A.cwiseAbs().maxCoeff();
  const double size_B = m == 0 ? 0.0 : B.cwiseAbs().maxCoeff();
  const double target = std::max(size_A, 1.0 / T);
  const double scale =
      size_B > 0.0 ? std::exp2(std::round(std::log2(target) - std::log2(size_B))) : 1.0;
  MatrixXd block = MatrixXd::Zero(n + m, n + m);
  block.topLeftCorner(n, n) = A * T;
  block.topRightCorner(n, m) = (B * scale) * T;
  FLYBALL_TRY(auto exponential, expm(block));
  return DiscretizedMatrices{exponential.topLeftCorner(n, n),
                             exponential.topRightCorner(n, m) / scale};
}

/// The same in units in which doubles do.
Expected<DiscretizedMatrices> hold_in_other_units(const MatrixRef& A, const MatrixRef& B, double T,
                                                  std::string_view where) {
  const detail::HoldUnits units = detail::hold_units_of(A, B, T);
  const auto too_large = [&](std::string_view what) {
    return refusal(MatrixExponentialError::overflow, where, std::string(what))
        .got("beyond the largest double")
        .hint("shorten the period, or choose units in which the numbers are nearer to 1");
  };
  if (!units.A.allFinite()) {
    return too_large("A T");
  }
  FLYBALL_TRY(const auto there, hold(units.A, units.B, 1.0));
  const Eigen::VectorXi& d = units.states;
  DiscretizedMatrices held{detail::times_powers(there.A, d, -d, 0),
                           detail::times_powers(there.B, d, -units.inputs, 0)};
  if (!held.A.allFinite() || !held.B.allFinite()) {
    return too_large(held.A.allFinite() ? "the discrete B" : "the discrete A");
  }
  return held;
}

}  // namespace

Expected<DiscretizedMatrices> discretize_zoh(const MatrixRef& A, const MatrixRef& B, Time period) {
  constexpr std::string_view where = "discretize";
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(B, n, m, "B", "states x inputs")
                    .finite(A, "A")
                    .finite(B, "B")
                    .positive(period.si(), "period", "s"));
  const double T = period.si();
  if (n > 0 && detail::needs_hold_units(A, B, T)) {
    return hold_in_other_units(A, B, T, where);
  }
  return hold(A, B, T);
}

Expected<Eigen::MatrixXd> discretize(const MatrixRef& A, const ProcessDensity& density,
                                     Time period) {
  constexpr std::string_view where = "discretize";
  const Eigen::MatrixXd& Q = density.Q;
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(Q, n, n, "Q", "states x states")
                    .finite(A, "A")
                    .finite(Q, "Q")
                    .symmetric(Q, "Q")
                    .positive(period.si(), "period", "s"));

  const double T = period.si();
  FLYBALL_TRY(auto Q_d, detail::quadratic_integral(A, Q, T));
  if (!Q_d.allFinite()) {
    return refusal(ArgumentError::not_finite, where, "the discretised Q")
        .got(detail::format(
            "too large for a double: A T is, or A grows by more than 1e150 within {} s", T))
        .hint("shorten the period");
  }
  return Q_d;
}

Expected<Eigen::MatrixXd> discretize(const MeasurementDensity& density, Time period) {
  constexpr std::string_view where = "discretize";
  FLYBALL_CHECK(Checks(where)
                    .symmetric(density.R, "R")
                    .finite(density.R, "R")
                    .positive(period.si(), "period", "s"));
  return density.R / period.si();
}

template Expected<DiscreteSystem<1, 1, 1>> discretize(const ContinuousSystem<1, 1, 1>&, Time);
template Expected<DiscreteSystem<2, 1, 1>> discretize(const ContinuousSystem<2, 1, 1>&, Time);

}  // namespace flyball
