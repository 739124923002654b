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
    E = units->back(detail::exponential_of(units->M));
  } else {
    E = detail::exponential_of(A);
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
