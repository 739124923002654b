#include <cmath>
#include <complex>
#include <limits>
#include <type_traits>
#include <utility>

#include "control/placement.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// The columns of X that belong to one pole, (A - p) x - B f = base: solved by corrections in
/// doubles to a residual formed in twice their precision, which converges as long as the pole is
/// further from an unreachable mode than rounding.
class ColumnSolver {
 public:
  ColumnSolver(const PlacementProblem& problem, const MatrixRef& Q, const MatrixRef& A,
               const MatrixRef& B)
      : problem_(problem), Q_(Q), B_double_(B), A_(A), B_(B), inputs_(B.cols()) {
    // B_1⁺. With as many inputs as directions each in its own unit; else the smallest gains.
    const Index r = problem.rank;
    const Eigen::MatrixXd B_1 = transposed_product(Q.leftCols(r), B);
    Eigen::VectorXd unit = Eigen::VectorXd::Ones(inputs_);
    if (inputs_ == r) {
      unit = B.colwise().norm().cwiseInverse();
    }
    to_inputs_ = unit.asDiagonal() *
                 solve_least_squares(B_1 * unit.asDiagonal(), Eigen::MatrixXd::Identity(r, r));
  }

  /// Columns j (and j + 1 of a pair) of X, X T's part of the columns before them in `before`.
  template <class Scalar>
  void solve(Index j, const Eigen::MatrixXd& T, const DoubleDoubleMatrix& before,
             DoubleDoubleMatrix& X, DoubleDoubleMatrix& F) const {
    constexpr int most = 40;
    constexpr double exact = 1e-30;
    constexpr bool pair = !std::is_same_v<Scalar, double>;
    constexpr Index width = pair ? 2 : 1;
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
    const Index n = problem_.A.rows();
    const Index r = problem_.rank;
    const Eigen::MatrixXd block = T.block(j, j, width, width);
    const UnreachedRows<Scalar> rows(problem_, pole_of<Scalar>(j));
    DoubleDoubleMatrix x = X.block(0, j, n, width);
    DoubleDoubleMatrix f = F.block(0, j, inputs_, width);
    double last = std::numeric_limits<double>::infinity();
    for (int i = 0; i < most; ++i) {
      DoubleDoubleMatrix rest = add_product(before, -1.0, x, DoubleDoubleMatrix(block));
      rest = add_product(std::move(rest), 1.0, A_, x);
      rest = add_product(std::move(rest), -1.0, B_, f);
      const double size = rest.norm();
      if (!(size < 0.5 * last) || size <= exact * problem_.A.norm() * x.norm()) {
        break;
      }
      last = size;
      // x_1 + i x_2/s turns by the pole p as one complex vector.
      const Eigen::MatrixXd turned = transposed_product(Q_, rest.hi);
      Vector right(n);
      double s = 1.0;
      if constexpr (pair) {
        s = std::sqrt(std::abs(block(0, 1) / block(1, 0)));
        right.real() = turned.col(0);
        right.imag() = turned.col(1) / s;
      } else {
        right = turned.col(0);
      }
      const Vector dx = -rows.solve(right.tail(n - r));
      const Vector driven =
          right.head(r) + problem_.A.topRows(r) * dx - pole_of<Scalar>(j) * dx.head(r);
      if constexpr (pair) {
        Eigen::MatrixXd step(n, 2);
        step << dx.real(), s * dx.imag();
        Eigen::MatrixXd push(r, 2);
        push << driven.real(), s * driven.imag();
        x = sum(std::move(x), 1.0, DoubleDoubleMatrix(detail::product(Q_, step)));
        f = sum(std::move(f), 1.0, DoubleDoubleMatrix(detail::product(to_inputs_, push)));
      } else {
        x = sum(std::move(x), 1.0, DoubleDoubleMatrix(Q_ * dx));
        f = sum(std::move(f), 1.0, DoubleDoubleMatrix(to_inputs_ * driven));
      }
    }
    X.hi.middleCols(j, width) = x.hi;
    X.lo.middleCols(j, width) = x.lo;
    F.hi.middleCols(j, width) = f.hi;
    F.lo.middleCols(j, width) = f.lo;
  }

 private:
  template <class Scalar>
  [[nodiscard]] Scalar pole_of(Index j) const {
    if constexpr (std::is_same_v<Scalar, double>) {
      return problem_.poles(j).real();
    } else {
      return problem_.poles(j);
    }
  }

  const PlacementProblem& problem_;
  Eigen::MatrixXd Q_;
  Eigen::MatrixXd B_double_;
  DoubleDoubleMatrix A_;
  DoubleDoubleMatrix B_;
  Index inputs_;
  Eigen::MatrixXd to_inputs_;
};

}  // namespace

std::optional<ExactGain> exact_gain(const PlacementProblem& problem, const PlacedLoop& loop,
                                    const MatrixRef& Q, const MatrixRef& A, const MatrixRef& B) {
  const Index n = A.rows();
  const ColumnSolver solver(problem, Q, A, B);
  DoubleDoubleMatrix X(product(Q, loop.X));
  DoubleDoubleMatrix F = DoubleDoubleMatrix::zero(B.cols(), n);
  for (Index j = 0; j < n;) {
    const bool pair = problem.poles(j).imag() != 0.0;
    const Index width = pair ? 2 : 1;
    DoubleDoubleMatrix before = DoubleDoubleMatrix::zero(n, width);
    const Eigen::MatrixXd above = loop.T.block(0, j, j, width);
    if (!above.isZero(0.0)) {
      before = add_product(std::move(before), -1.0, X.left(j), DoubleDoubleMatrix(above));
    }
    if (pair) {
      solver.solve<Complex>(j, loop.T, before, X, F);
    } else {
      solver.solve<double>(j, loop.T, before, X, F);
    }
    j += width;
  }
  auto inverse = detail::solve(X, DoubleDoubleMatrix::identity(n));
  if (!inverse || !inverse->all_finite()) {
    return std::nullopt;
  }
  ExactGain gain{product(F, *inverse), std::move(X), std::move(*inverse)};
  if (!gain.K.all_finite()) {
    return std::nullopt;
  }
  return gain;
}

}  // namespace flyball::detail
