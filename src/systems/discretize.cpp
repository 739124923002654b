#include <flyball/systems/discretize.hpp>

#include <cmath>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

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
  // exp([A B; 0 0] T) depends on the scale of B only through its upper right block, which is linear
  // in B: with B scaled to A's size, B cannot force squarings that A does not need.
  const double T = period.si();
  const double size_A = A.cwiseAbs().maxCoeff();
  const double size_B = m == 0 ? 0.0 : B.cwiseAbs().maxCoeff();
  const double target = std::max(size_A, 1.0 / T);
  const double scale =
      size_B > 0.0 ? std::exp2(std::round(std::log2(target) - std::log2(size_B))) : 1.0;
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(n + m, n + m);
  block.topLeftCorner(n, n) = A * T;
  block.topRightCorner(n, m) = (B * scale) * T;
  FLYBALL_TRY(auto exponential, expm(block));
  return DiscretizedMatrices{exponential.topLeftCorner(n, n),
                             exponential.topRightCorner(n, m) / scale};
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
