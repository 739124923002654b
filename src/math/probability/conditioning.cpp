#include <cmath>

#include <Eigen/QR>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/probability/conditioning.hpp"

namespace flyball::detail {

namespace {

/// What is rounding of sums of so many terms.
double rounding_of(Eigen::Index terms) {
  return 8.0 * static_cast<double>(terms) * epsilon;
}

/// Sizes of the terms of C F and G: Σⱼ |C_ij| ‖F_j‖ + ‖G_i‖.
Eigen::VectorXd term_sizes(const MatrixRef& C, const Eigen::MatrixXd& F, const Eigen::MatrixXd& G) {
  Eigen::VectorXd sizes(C.rows());
  Eigen::VectorXd deviations(F.rows());
  for (Eigen::Index i = 0; i < F.rows(); ++i) {
    deviations(i) = F.row(i).stableNorm();
  }
  for (Eigen::Index i = 0; i < C.rows(); ++i) {
    sizes(i) = C.row(i).cwiseAbs().dot(deviations) + G.row(i).stableNorm();
  }
  return sizes;
}

}  // namespace

Expected<Eigen::MatrixXd> covariance_factor(const MatrixRef& P, std::string_view where,
                                            std::string_view name) {
  FLYBALL_CHECK(Checks(where).square(P, name).finite(P, name).symmetric(P, name));
  const Eigen::Index n = P.rows();
  const double rounding = 1e-13 * static_cast<double>(n);
  Eigen::VectorXd units = Eigen::VectorXd::Ones(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (P(i, i) < 0.0) {
      return refusal(ArgumentError::not_positive, where, format("{}({}, {})", name, i, i))
          .got(format_number(P(i, i)))
          .expected("a variance, not negative");
    }
    units(i) = P(i, i) > 0.0 ? std::sqrt(P(i, i)) : 1.0;
  }
  Eigen::MatrixXd scaled = symmetrized(P);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      scaled(i, j) = i == j ? (P(i, i) > 0.0 ? 1.0 : 0.0) : scaled(i, j) / units(i) / units(j);
      if (i != j && scaled(i, j) != 0.0 && (P(i, i) == 0.0 || P(j, j) == 0.0)) {
        return refusal(ArgumentError::not_positive, where, format("{}({}, {})", name, i, j))
            .got(format_number(P(i, j)))
            .expected("zero, as one of the two variances is");
      }
    }
  }
  const SymmetricEigensystem system = symmetric_eigensystem_of(scaled);
  if (system.values(0) < -1e-10 * static_cast<double>(n)) {
    Eigen::VectorXd direction = units.cwiseProduct(system.vectors.col(0));
    direction.normalize();
    return refusal(ArgumentError::not_positive, where, name)
        .got("no covariance: along some direction its variance is negative")
        .expected("positive semidefinite")
        .with("that variance, of variances scaled to one", system.values(0))
        .with("direction", std::vector<double>(direction.begin(), direction.end()));
  }
  Eigen::Index rank = 0;
  while (rank < n && system.values(n - 1 - rank) > rounding) {
    ++rank;
  }
  return Eigen::MatrixXd(units.asDiagonal() * system.vectors.rightCols(rank) *
                         system.values.tail(rank).cwiseSqrt().asDiagonal());
}

Eigen::MatrixXd compressed(const Eigen::MatrixXd& F) {
  return F.cols() > F.rows() ? Eigen::MatrixXd(triangle_of(F.transpose()).transpose()) : F;
}

Conditioning condition(const Eigen::MatrixXd& F, const Eigen::MatrixXd& M, const Eigen::MatrixXd& G,
                       const Eigen::VectorXd& reference) {
  const Eigen::Index n = F.rows();
  const Eigen::Index r = F.cols();
  const Eigen::Index p = M.rows();
  const Eigen::Index q = G.cols();
  const double rounding = rounding_of(r + q + p);
  Conditioning result;
  result.K = Eigen::MatrixXd::Zero(n, p);
  result.units = Eigen::VectorXd::Ones(p);
  result.order = Eigen::VectorXi::LinSpaced(p, 0, static_cast<int>(p) - 1);
  result.triangle = Eigen::MatrixXd::Zero(0, p);
  if (r + q == 0 || p == 0) {
    result.factor = F;
    return result;
  }
  Eigen::MatrixXd W(r + q, p);
  W << M.transpose(), G.transpose();
  for (Eigen::Index i = 0; i < p; ++i) {
    const double size = W.col(i).stableNorm();
    if (size > rounding * reference(i)) {
      result.units(i) = size;
      W.col(i) /= size;
    } else {
      W.col(i).setZero();
    }
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(W);
  qr.setThreshold(rounding);
  const Eigen::Index rank = qr.rank();
  result.rank = rank;
  result.order = qr.colsPermutation().indices();
  result.triangle = qr.matrixQR().topRows(rank).triangularView<Eigen::Upper>();
  result.factor = Eigen::MatrixXd::Zero(0, 0);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index entry = result.order(i);
    result.log_determinant +=
        2.0 * (std::log(std::abs(result.triangle(i, i))) + std::log(result.units(entry)));
  }
  if (n == 0) {
    return result;
  }
  // Qᵀ [F 0]ᵀ: the upper rows give K, the lower ones are what z says nothing of.
  Eigen::MatrixXd turned = Eigen::MatrixXd::Zero(r + q, n);
  turned.topRows(r) = F.transpose();
  turned.applyOnTheLeft(qr.householderQ().adjoint());
  const Eigen::MatrixXd gains =
      result.triangle.leftCols(rank).triangularView<Eigen::Upper>().solve(turned.topRows(rank));
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index entry = result.order(i);
    result.K.col(entry) = gains.row(i) / result.units(entry);
  }
  result.factor = turned.bottomRows(r + q - rank).transpose();
  result.factor = compressed(result.factor);
  return result;
}

Conditioning measure(const Eigen::MatrixXd& F, const MatrixRef& C, const Eigen::MatrixXd& G) {
  Conditioning result = condition(F, product(C, F), G, term_sizes(C, F, G));
  const Eigen::Index certain = C.rows() - G.cols();
  if (certain <= 0 || result.factor.cols() == 0) {
    return result;
  }
  // Combinations N of the measurement without noise are known now: NᵀCK = Nᵀ, and what rounding has
  // left of NᵀC factor is taken off again, down to rounding of the factor itself.
  const Eigen::MatrixXd N = G.cols() == 0
                                ? Eigen::MatrixXd(Eigen::MatrixXd::Identity(C.rows(), C.rows()))
                                : Eigen::MatrixXd(full_qr(G).Q.rightCols(certain));
  result.factor -= product(product(result.K, N), transposed_product(N, product(C, result.factor)));
  const double rounding = rounding_of(F.cols() + C.rows());
  for (Eigen::Index i = 0; i < F.rows(); ++i) {
    if (result.factor.row(i).stableNorm() <= rounding * F.row(i).stableNorm()) {
      result.factor.row(i).setZero();
    }
  }
  return result;
}

double Conditioning::squared_distance(const Eigen::VectorXd& e, const Eigen::VectorXd& sizes,
                                      Eigen::Index& contradicted) const {
  constexpr double tolerance = 1e-9;
  contradicted = -1;
  const Eigen::Index p = e.size();
  Eigen::VectorXd ordered(p);
  for (Eigen::Index i = 0; i < p; ++i) {
    ordered(i) = e(order(i)) / units(order(i));
  }
  const Eigen::VectorXd whitened =
      triangle.leftCols(rank).triangularView<Eigen::Upper>().transpose().solve(ordered.head(rank));
  for (Eigen::Index i = rank; i < p; ++i) {
    const double determined = triangle.col(i).dot(whitened);
    const double size =
        sizes(order(i)) / units(order(i)) + triangle.col(i).cwiseAbs().dot(whitened.cwiseAbs());
    if (!(std::abs(ordered(i) - determined) <= tolerance * size)) {
      contradicted = order(i);
    }
  }
  return whitened.squaredNorm();
}

}  // namespace flyball::detail
