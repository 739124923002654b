#include <flyball/math/exponential/matrix_exponential.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/instruction_set.hpp"
#include "math/exponential/extended_function.hpp"
#include "math/exponential/matrix_exponential_kernel.hpp"

namespace flyball {

using Eigen::MatrixXd;

namespace detail {

void exponential(int n, const double* A, double* E, double* memory) {
  FLYBALL_RUN_KERNEL(exponential, n, A, E, memory);
}

namespace {

/// Of an A without gaps between its columns.
MatrixXd exponential_of(const MatrixRef& A) {
  const int n = static_cast<int>(A.rows());
  MatrixXd E(n, n);
  if (n <= detail::exponential_stack_states) {
    alignas(32) double memory[detail::exponential_workspace(detail::exponential_stack_states)];
    detail::exponential(n, A.data(), E.data(), memory);
  } else {
    const auto count = static_cast<std::size_t>(detail::exponential_workspace(n));
    detail::exponential(n, A.data(), E.data(), std::unique_ptr<double[]>(new double[count]).get());
  }
  return E;
}

/// A slow mode beside fast ones loses as many digits as there are squarings, 2^-52 each time
/// doubled: from 2^10 on in twice the precision, which leaves none to lose; larger matrices by
/// doubles alone, since its cost is some hundred times theirs.
void sharpen(const MatrixRef& A, MatrixXd& E) {
  constexpr Eigen::Index most_states = 20;
  constexpr double reach = 4.25 * 1024.0;
  if (A.rows() < 3 || A.rows() > most_states || !(norm1(A) > reach) || !E.allFinite()) {
    return;
  }
  const Eigen::VectorXd d = balance_of(A);
  const Eigen::VectorXd inverse = d.cwiseInverse();
  const MatrixXd M = inverse.asDiagonal() * A * d.asDiagonal();
  if (!(norm1(M) > reach)) {
    return;
  }
  const MatrixXd better =
      d.asDiagonal() * extended_exponential(DoubleDoubleMatrix(M)).rounded() * inverse.asDiagonal();
  if (better.allFinite()) {
    E = better;
  }
}

}  // namespace

}  // namespace detail

ErrorInfo error_info(MatrixExponentialError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"overflow", "exp(A) exceeds the largest double", ErrorKind::no_answer},
  };
  return detail::info_of(code, "matrix_exponential", rows);
}

Expected<MatrixXd> expm(const MatrixRef& A) {
  FLYBALL_CHECK(Checks("expm").square(A, "A").finite(A, "A"));
  if (A.outerStride() != A.rows()) {
    return expm(MatrixXd(A));
  }
  MatrixXd E;
  if (const auto units = A.rows() > 1 ? detail::far_units_of(A, 0.0) : std::nullopt) {
    MatrixXd there = detail::exponential_of(units->M);
    detail::sharpen(units->M, there);
    E = units->back(there);
  } else {
    E = detail::exponential_of(A);
    detail::sharpen(A, E);
  }
  if (!E.allFinite()) {
    const double scale = std::max(1.0, A.cwiseAbs().maxCoeff());
    const double abscissa = detail::eigenvalues_of(A / scale).real().maxCoeff() * scale;
    return refusal(MatrixExponentialError::overflow, "expm", "exp(A)")
        .hint("exponents above 709.78 have no double; shorten the time step")
        .with("spectral abscissa of A", abscissa);
  }
  return E;
}

}  // namespace flyball
