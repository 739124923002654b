#include <algorithm>
#include <cmath>
#include <limits>

#include "core/constants.hpp"
#include "math/equations/wide_sylvester.hpp"
#include "math/extended/wide_matrix.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// log₂|M_ij|; NaN for what is no number.
MatrixXd logarithms_of(const WideMatrix& M) {
  return MatrixXd::NullaryExpr(M.rows(), M.cols(), [&](Index i, Index j) {
    const WideNumber& x = M(i, j);
    return x.hi == 0.0           ? -infinity
           : std::isfinite(x.hi) ? std::log2(std::abs(x.hi)) + static_cast<double>(x.exponent)
                                 : nan;
  });
}

/// The largest of |M_ij|/|S_ij| by their logarithms, where an S_ij below a thousandth of what its
/// row and its column have elsewhere counts as that.
double largest_share_of_logarithms(const MatrixXd& M, const MatrixXd& S) {
  const double least = std::log2(1e-3);
  const Eigen::RowVectorXd column = S.colwise().maxCoeff();
  double worst = -infinity;
  for (Index i = 0; i < S.rows(); ++i) {
    double row = -infinity;
    for (Index j = 0; j < S.cols(); ++j) {
      row = column(j) > -infinity ? std::max(row, S(i, j) - column(j)) : row;
    }
    for (Index j = 0; j < S.cols(); ++j) {
      if (std::isnan(M(i, j)) || std::isnan(S(i, j))) {
        return nan;
      }
      if (M(i, j) > -infinity) {
        worst = std::max(worst, M(i, j) - std::max(S(i, j), least + row + column(j)));
      }
    }
  }
  return std::exp2(worst);
}

WideMatrix terms_of(Domain domain, const WideMatrix& A, const WideMatrix& B, const WideMatrix& X,
                    const WideMatrix& F) {
  const WideMatrix size = X.magnitudes();
  const WideMatrix right = product(size, B.magnitudes());
  return domain == Domain::continuous
             ? sum(add_product(right, 1.0, A.magnitudes(), size), 1.0, F.magnitudes())
             : sum(add_product(size, 1.0, A.magnitudes(), right), 1.0, F.magnitudes());
}

WideMatrix residual_of(Domain domain, const WideMatrix& A, const WideMatrix& B, const WideMatrix& X,
                       const WideMatrix& F) {
  return domain == Domain::continuous ? add_product(add_product(F, -1.0, A, X), -1.0, X, B)
                                      : add_product(sum(F, 1.0, X), -1.0, A, product(X, B));
}

}  // namespace

bool is_wide(const MatrixXd& A, const MatrixXd& B, const MatrixXd& F) {
  constexpr int least = -480;
  constexpr int most = 480;
  const auto beyond = [](const MatrixXd& M) {
    return (M.array() != 0.0 &&
            (M.array().abs() < std::ldexp(1.0, least) || M.array().abs() > std::ldexp(1.0, most)))
        .any();
  };
  return beyond(A) || beyond(B) || beyond(F);
}

double wide_backward_error(Domain domain, const MatrixXd& A, const MatrixXd& B, const MatrixXd& X,
                           const MatrixXd& F) {
  const WideMatrix a(A);
  const WideMatrix b(B);
  const WideMatrix f(F);
  const WideMatrix x(X);
  // What the roundings of an X beyond the normal doubles leave counts as nothing.
  const WideMatrix smallest(
      MatrixXd::Constant(X.rows(), X.cols(), std::numeric_limits<double>::denorm_min()));
  const WideMatrix none(MatrixXd::Zero(X.rows(), X.cols()));
  const WideMatrix blur = terms_of(domain, a, b, smallest, none);
  const WideMatrix residual = residual_of(domain, a, b, x, f);
  const WideMatrix terms = terms_of(domain, a, b, x, f);
  const WideMatrix rest = sum(residual.magnitudes(), -1.0, blur);
  WideMatrix left = rest;
  for (Index j = 0; j < X.cols(); ++j) {
    for (Index i = 0; i < X.rows(); ++i) {
      if (rest(i, j).hi < 0.0) {
        left(i, j) = {};
      }
    }
  }
  // But the largest entries must be there.
  return std::max(share_of(residual, terms),
                  largest_share_of_logarithms(logarithms_of(left), logarithms_of(terms)));
}

std::optional<WideSylvesterSolution> solve_sylvester_wide(Domain domain, const MatrixXd& A,
                                                          const MatrixXd& B, const MatrixXd& F) {
  constexpr Index most_unknowns = 100;
  const Index n = F.rows();
  const Index m = F.cols();
  const Index size = n * m;
  if (size > most_unknowns) {
    return std::nullopt;
  }
  const bool continuous = domain == Domain::continuous;
  // vec(A X) = (I ⊗ A) vec X, vec(X B) = (Bᵀ ⊗ I) vec X, vec(A X B) = (Bᵀ ⊗ A) vec X.
  MatrixXd left = MatrixXd::Zero(size, size);
  MatrixXd right = MatrixXd::Zero(size, size);
  for (Index j = 0; j < m; ++j) {
    for (Index i = 0; i < n; ++i) {
      for (Index k = 0; k < n; ++k) {
        left(i + j * n, k + j * n) = A(i, k);
      }
      for (Index l = 0; l < m; ++l) {
        right(i + j * n, i + l * n) = B(l, j);
      }
    }
  }
  WideMatrix M = continuous ? sum(WideMatrix(left), 1.0, WideMatrix(right))
                            : shifted_diagonal(product(WideMatrix(left), WideMatrix(right)), -1.0);
  WideMatrix rhs = WideMatrix::zero(size, size + 1);
  const WideMatrix f{MatrixXd(F.reshaped())};
  for (Index i = 0; i < size; ++i) {
    rhs(i, 0) = f(i, 0);
    rhs(i, i + 1) = {1.0, 0.0, 0};
  }
  const auto solved = solve(std::move(M), std::move(rhs));
  if (!solved || !solved->all_finite()) {
    return std::nullopt;
  }
  const auto column_of = [&](const WideMatrix& matrix) {
    WideMatrix column = WideMatrix::zero(size, 1);
    for (Index k = 0; k < size; ++k) {
      column(k, 0) = matrix(k % n, k / n);
    }
    return column;
  };
  const auto matrix_of = [&](const WideMatrix& column) {
    WideMatrix matrix = WideMatrix::zero(n, m);
    for (Index k = 0; k < size; ++k) {
      matrix(k % n, k / n) = column(k, 0);
    }
    return matrix;
  };
  const WideMatrix inverse = solved->right(size);
  const WideMatrix a(A);
  const WideMatrix b(B);
  WideMatrix x = matrix_of(*solved);
  // Elimination is exact by rows of the large system; two corrections make it so by entries.
  for (int pass = 0; pass < 2; ++pass) {
    const WideMatrix rest = residual_of(domain, a, b, x, WideMatrix(F));
    x = sum(x, 1.0, matrix_of(product(inverse, column_of(rest))));
  }
  WideSylvesterSolution solution;
  solution.X = x.rounded();
  const WideMatrix growth =
      matrix_of(product(inverse.magnitudes(), column_of(terms_of(domain, a, b, x, WideMatrix(F)))));
  solution.condition = largest_share_of_logarithms(logarithms_of(growth), logarithms_of(x));
  return solution;
}

}  // namespace flyball::detail
