#include <flyball/math/dense/linear_algebra.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/extended/double_double.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

Expected<void> check_symmetric_matrix(const MatrixRef& S, std::string_view where) {
  FLYBALL_CHECK(check_square(S, where, "S"));
  return Checks(where).finite(S, "S").symmetric(S, "S");
}

/// A⁺ of the rank that the leading right singular vectors V span, with what doubles lose where
/// small singular values stand beside large ones: F = A V, A⁺ = (F⁺A)⁺F⁺, in twice the precision.
std::optional<MatrixXd> extended_pseudoinverse(const MatrixXd& A, const MatrixXd& V) {
  using detail::DoubleDoubleMatrix;
  const DoubleDoubleMatrix a(A);
  const DoubleDoubleMatrix F = product(a, DoubleDoubleMatrix(V));
  const auto left = solve(product(F.transpose(), F), F.transpose());
  if (!left) {
    return std::nullopt;
  }
  const DoubleDoubleMatrix G = product(*left, a);
  const auto inner = solve(product(G, G.transpose()), *left);
  if (!inner || !inner->all_finite()) {
    return std::nullopt;
  }
  return product(G.transpose(), *inner).rounded();
}

}  // namespace

Expected<Pseudoinverse> pseudoinverse(const MatrixRef& A, double tolerance) {
  constexpr std::string_view where = "pseudoinverse";
  if (A.size() == 0) {
    return refusal(ArgumentError::empty, where, "A").got("empty");
  }
  FLYBALL_CHECK(Checks(where).finite(A, "A").not_negative(tolerance, "tolerance"));
  if (tolerance >= 1.0) {
    return refusal(ArgumentError::out_of_range, where, "tolerance")
        .got(format_number(tolerance))
        .expected("below 1");
  }
  const int unit = detail::unit_of(A);
  const MatrixXd scaled = detail::times_power(A, -unit);
  const detail::SingularValues svd = detail::svd_of(scaled);
  const double relative =
      tolerance > 0.0 ? tolerance : epsilon * static_cast<double>(std::max(A.rows(), A.cols()));
  const double least = relative * svd.values(0);
  Pseudoinverse result;
  result.singular_values = detail::times_power(svd.values, unit);
  result.rank = (svd.values.array() > least).count();
  const Eigen::VectorXd inverse = svd.values.head(result.rank).cwiseInverse();
  result.X = detail::product_transposed(svd.V.leftCols(result.rank) * inverse.asDiagonal(),
                                        svd.U.leftCols(result.rank));
  constexpr double alike = 1e-3;
  if (result.rank > 0 && svd.values(result.rank - 1) < alike * svd.values(0)) {
    if (auto X = extended_pseudoinverse(scaled, svd.V.leftCols(result.rank))) {
      result.X = std::move(*X);
    }
  }
  result.X = detail::times_power(result.X, -unit);
  if (!result.X.allFinite()) {
    return refusal(ArgumentError::out_of_range, where, "A")
        .got("so small that its inverse is beyond the largest double")
        .expected("entries nearer to 1, in other units");
  }
  return result;
}

std::string_view to_string(Definiteness definiteness) {
  switch (definiteness) {
    case Definiteness::positive_definite:
      return "positive definite";
    case Definiteness::positive_semidefinite:
      return "positive semidefinite";
    case Definiteness::negative_definite:
      return "negative definite";
    case Definiteness::negative_semidefinite:
      return "negative semidefinite";
    case Definiteness::zero:
      return "zero";
    case Definiteness::indefinite:
      return "indefinite";
  }
  return "unknown";
}

Expected<DefinitenessTest> test_definiteness(const MatrixRef& S) {
  FLYBALL_CHECK(check_symmetric_matrix(S, "test_definiteness"));
  DefinitenessTest test;
  test.eigenvalues = detail::symmetric_eigensystem_of(detail::symmetrized(S)).values;
  const double least = test.eigenvalues(0);
  const double most = test.eigenvalues(test.eigenvalues.size() - 1);
  test.tolerance =
      epsilon * static_cast<double>(S.rows()) * std::max(std::abs(least), std::abs(most));
  if (least > test.tolerance) {
    test.definiteness = Definiteness::positive_definite;
  } else if (most < -test.tolerance) {
    test.definiteness = Definiteness::negative_definite;
  } else if (least < -test.tolerance) {
    test.definiteness =
        most > test.tolerance ? Definiteness::indefinite : Definiteness::negative_semidefinite;
  } else {
    test.definiteness =
        most > test.tolerance ? Definiteness::positive_semidefinite : Definiteness::zero;
  }
  return test;
}

Expected<bool> is_positive_definite(const MatrixRef& S) {
  FLYBALL_CHECK(check_symmetric_matrix(S, "is_positive_definite"));
  if (!(S.diagonal().array() > 0.0).all()) {
    return false;
  }
  const Eigen::VectorXd scale = S.diagonal().cwiseSqrt().cwiseInverse();
  return detail::cholesky_of(scale.asDiagonal() * detail::symmetrized(S) * scale.asDiagonal())
      .has_value();
}

MatrixXd block_diagonal(const std::vector<MatrixXd>& blocks) {
  Index rows = 0;
  Index columns = 0;
  for (const MatrixXd& block : blocks) {
    rows += block.rows();
    columns += block.cols();
  }
  MatrixXd whole = MatrixXd::Zero(rows, columns);
  rows = 0;
  columns = 0;
  for (const MatrixXd& block : blocks) {
    whole.block(rows, columns, block.rows(), block.cols()) = block;
    rows += block.rows();
    columns += block.cols();
  }
  return whole;
}

}  // namespace flyball
