#include <flyball/systems/discretize.hpp>

#include <cmath>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/format.hpp"
#include "systems/quadratic_integral.hpp"

namespace flyball {

Expected<DiscretizedMatrices> discretize_zoh(const MatrixRef& A, const MatrixRef& B, Time period) {
  constexpr std::string_view where = "discretize";
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(square.error());
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  if (auto checked = check_all(check_shape(B, n, m, where, "B", "states x inputs"),
                               check_finite(A, where, "A"), check_finite(B, where, "B"),
                               check_positive(period.si(), where, "period", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  // exp([A B; 0 0] T) depends on the scale of B only through its upper right block, which is linear
  // in B: with B scaled to A's size, B cannot force squarings that A does not need.
  const double T = period.si();
  const double size_A = A.cwiseAbs().rowwise().sum().maxCoeff();
  const double size_B = m == 0 ? 0.0 : B.cwiseAbs().rowwise().sum().maxCoeff();
  const double target = std::max(size_A, 1.0 / T);
  const double scale =
      size_B > 0.0 ? std::exp2(std::round(std::log2(target) - std::log2(size_B))) : 1.0;
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(n + m, n + m);
  block.topLeftCorner(n, n) = A * T;
  block.topRightCorner(n, m) = (B * scale) * T;
  auto exponential = expm(block);
  if (!exponential) {
    return tl::unexpected(exponential.error());
  }
  return DiscretizedMatrices{exponential->topLeftCorner(n, n),
                             exponential->topRightCorner(n, m) / scale};
}

Expected<Eigen::MatrixXd> discretize(const MatrixRef& A, const ProcessDensity& density,
                                     Time period) {
  constexpr std::string_view where = "discretize";
  const Eigen::MatrixXd& Q = density.Q;
  if (auto square = check_square(A, where, "A"); !square) {
    return tl::unexpected(square.error());
  }
  const Eigen::Index n = A.rows();
  if (auto shape = check_shape(Q, n, n, where, "Q", "states x states"); !shape) {
    return tl::unexpected(shape.error());
  }
  if (auto checked = check_all(check_finite(A, where, "A"), check_finite(Q, where, "Q"),
                               check_symmetric(Q, where, "Q"),
                               check_positive(period.si(), where, "period", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }

  const double T = period.si();
  auto Q_d = detail::quadratic_integral(A, Q, T);
  if (!Q_d) {
    return tl::unexpected(std::move(Q_d).error());
  }
  if (!Q_d->allFinite()) {
    return tl::unexpected(
        Error(ArgumentError::not_finite)
            .in(std::string(where))
            .about("the discretised Q")
            .got(
                detail::format("too large for a double: A grows by more than 1e150 within {} s", T))
            .hint("shorten the period"));
  }
  return Q_d;
}

Expected<Eigen::MatrixXd> discretize(const MeasurementDensity& density, Time period) {
  constexpr std::string_view where = "discretize";
  if (auto symmetric = check_symmetric(density.R, where, "R"); !symmetric) {
    return tl::unexpected(symmetric.error());
  }
  if (auto checked = check_all(check_finite(density.R, where, "R"),
                               check_positive(period.si(), where, "period", "s"));
      !checked) {
    return tl::unexpected(checked.error());
  }
  return density.R / period.si();
}

template Expected<DiscreteSystem<1, 1, 1>> discretize(const ContinuousSystem<1, 1, 1>&, Time);
template Expected<DiscreteSystem<2, 1, 1>> discretize(const ContinuousSystem<2, 1, 1>&, Time);

}  // namespace flyball
