#include <cmath>

#include "math/exponential/extended_function.hpp"

namespace flyball::detail {

namespace {

using Matrix = DoubleDoubleMatrix;

/// The principal square root by the product form of Denman and Beavers' iteration (Cheng, Higham,
/// Kenney and Laub, SIAM J. Matrix Anal. Appl. 22 (2001), eq. (2.1)): X → A^½ as M → I,
///   X ← X (I + M⁻¹)/2,  M ← (I + (M + M⁻¹)/2)/2.
std::optional<Matrix> square_root(const Matrix& A) {
  constexpr int most_steps = 100;
  constexpr double converged = 1e-28;
  const Matrix I = Matrix::identity(A.rows());
  Matrix X = A;
  Matrix M = A;
  for (int step = 0; step < most_steps; ++step) {
    const auto inverse = solve(M, I);
    if (!inverse || !inverse->all_finite()) {
      return std::nullopt;
    }
    X = scaled(add_product(X, 1.0, X, *inverse), 0.5);
    M = scaled(shifted_diagonal(scaled(sum(M, 1.0, *inverse), 0.5), 1.0), 0.5);
    if (!X.all_finite() || !M.all_finite()) {
      return std::nullopt;
    }
    const double apart = shifted_diagonal(M, -1.0).norm();
    if (apart <= converged) {
      return X;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Matrix> extended_logarithm(const Matrix& A) {
  constexpr int most_roots = 100;
  constexpr double near = 0x1p-6;
  constexpr int most_terms = 40;
  constexpr double nothing = 1e-33;
  Matrix R = A;
  int roots = 0;
  while (!(shifted_diagonal(R, -1.0).norm() <= near)) {
    auto root = roots < most_roots ? square_root(R) : std::nullopt;
    if (!root) {
      return std::nullopt;
    }
    R = std::move(*root);
    ++roots;
  }
  // log R = 2 atanh Z = 2 (Z + Z³/3 + Z⁵/5 + …) with Z = (R + I)⁻¹(R - I).
  const auto Z = solve(shifted_diagonal(R, 1.0), shifted_diagonal(R, -1.0));
  if (!Z) {
    return std::nullopt;
  }
  const Matrix square = product(*Z, *Z);
  Matrix power = *Z;
  Matrix L = *Z;
  for (int k = 3; k < most_terms; k += 2) {
    power = product(power, square);
    const auto term = solve(Matrix(k * Eigen::MatrixXd::Identity(A.rows(), A.cols())), power);
    L = sum(std::move(L), 1.0, *term);
    if (power.norm() <= nothing * L.norm()) {
      break;
    }
  }
  return scaled(std::move(L), std::ldexp(1.0, roots + 1));
}

Matrix extended_exponential(const Matrix& X) {
  constexpr int terms = 24;
  const double norm = X.norm();
  const int squarings = norm > 0.25 && std::isfinite(norm) ? std::ilogb(norm) + 3 : 0;
  const Matrix small = scaled(X, std::ldexp(1.0, -squarings));
  const Matrix I = Matrix::identity(X.rows());
  Matrix E = I;
  for (int k = terms; k > 0; --k) {
    const auto part = solve(Matrix(k * Eigen::MatrixXd::Identity(X.rows(), X.cols())), small);
    E = add_product(I, 1.0, *part, E);
  }
  for (int k = 0; k < squarings; ++k) {
    E = product(E, E);
  }
  return E;
}

}  // namespace flyball::detail
