#include <flyball/math/riccati/riccati.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "math/dense/dense.hpp"
#include "math/riccati/riccati_kernel.hpp"
#include "math/riccati/riccati_robust.hpp"

namespace flyball {

namespace {

Expected<void> check_shapes(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                            const MatrixRef& R, const MatrixRef* N, std::string_view where) {
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const bool right = n > 0 && m > 0 && A.cols() == n && B.rows() == n && Q.rows() == n &&
                     Q.cols() == n && R.rows() == m && R.cols() == m &&
                     (N == nullptr || (N->rows() == n && N->cols() == m));
  if (right) {
    return {};
  }
  if (auto check = check_square(A, where, "A"); !check) {
    return check;
  }
  if (m == 0) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in(std::string(where))
                              .about("B")
                              .got("without columns")
                              .expected("states x inputs with at least one input"));
  }
  auto shapes = check_all(check_shape(B, n, m, where, "B", "states x inputs"),
                          check_shape(Q, n, n, where, "Q", "states x states"),
                          check_shape(R, m, m, where, "R", "inputs x inputs"));
  return shapes && N != nullptr ? check_shape(*N, n, m, where, "N", "states x inputs") : shapes;
}

Expected<void> check_values(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                            const MatrixRef& R, const MatrixRef& N, std::string_view where) {
  if (auto finite = check_all(check_finite(A, where, "A"), check_finite(B, where, "B"),
                              check_finite(Q, where, "Q"), check_finite(R, where, "R"),
                              check_finite(N, where, "N"));
      !finite) {
    return finite;
  }
  return check_all(check_symmetric(Q, where, "Q"), check_symmetric(R, where, "R"));
}

/// The same answers as check_finite and check_symmetric without their messages.
bool finite(const double* values, int count) {
  double sum = 0.0;
  for (int k = 0; k < count; ++k) {
    sum += 0.0 * values[k];
  }
  return sum == 0.0;
}

bool symmetric(const double* S, int n) {
  double largest = 0.0;
  double difference = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i) {
      largest = std::max({largest, std::abs(S[i + j * n]), std::abs(S[j + i * n])});
      difference = std::max(difference, std::abs(S[i + j * n] - S[j + i * n]));
    }
  }
  return finite(S, n * n) && difference <= 1e-10 * largest;
}

}  // namespace

ErrorInfo error_info(RiccatiError code) {
  constexpr std::string_view family = "riccati";
  switch (code) {
    case RiccatiError::not_stabilizable:
      return {family, "not_stabilizable", "a mode that is not stable is reached by no input",
              ErrorKind::no_answer};
    case RiccatiError::no_stabilizing_solution:
      return {family, "no_stabilizing_solution", "no stabilising solution exists",
              ErrorKind::no_answer};
    case RiccatiError::singular:
      return {family, "singular", "R + B'XB has no inverse", ErrorKind::no_answer};
    case RiccatiError::no_convergence:
      return {family, "no_convergence", "no solution was found that could be verified",
              ErrorKind::no_answer};
  }
  return {family, "unknown", "unknown error", ErrorKind::defect};
}

namespace detail {

Expected<void> solve_riccati(const RiccatiData& data, RiccatiAnswer& answer) {
  using ConstMap = Eigen::Map<const Eigen::MatrixXd>;
  const int n = data.states;
  const int m = data.inputs;
  const bool acceptable = finite(data.A, n * n) && finite(data.B, n * m) && symmetric(data.Q, n) &&
                          symmetric(data.R, m) && (data.N == nullptr || finite(data.N, n * m));
  if (acceptable && solve_riccati_quickly(data, answer)) {
    return {};
  }
  const ConstMap A(data.A, n, n);
  const ConstMap B(data.B, n, m);
  const ConstMap Q(data.Q, n, n);
  const ConstMap R(data.R, m, m);
  const Eigen::MatrixXd N = data.N == nullptr ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, m))
                                              : Eigen::MatrixXd(ConstMap(data.N, n, m));
  if (auto check = check_values(A, B, Q, R, N, data.continuous ? "care" : "dare"); !check) {
    return check;
  }
  auto solution =
      solve_riccati_robustly({A, B, symmetrized(Q), symmetrized(R), N, data.continuous});
  if (!solution) {
    return tl::unexpected(std::move(solution).error());
  }
  Eigen::Map<Eigen::MatrixXd>(answer.X, n, n) = solution->X;
  Eigen::Map<Eigen::MatrixXd>(answer.K, m, n) = solution->K;
  Eigen::Map<Eigen::VectorXcd>(answer.poles, n) = solution->poles;
  answer.residual = solution->residual;
  answer.condition = solution->condition;
  answer.iterations = solution->iterations;
  return {};
}

}  // namespace detail

namespace {

Expected<RiccatiSolution> solve(bool continuous, const MatrixRef& A, const MatrixRef& B,
                                const MatrixRef& Q, const MatrixRef& R, const MatrixRef* N) {
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  if (auto check = check_shapes(A, B, Q, R, N, continuous ? "care" : "dare"); !check) {
    return tl::unexpected(std::move(check).error());
  }
  if (A.outerStride() != n || B.outerStride() != n || Q.outerStride() != n ||
      R.outerStride() != m || (N != nullptr && N->outerStride() != n)) {
    // Blocks of larger matrices: copied, because the kernels take columns without gaps.
    const Eigen::MatrixXd cross = N == nullptr ? Eigen::MatrixXd::Zero(n, m) : Eigen::MatrixXd(*N);
    using Solver = Expected<RiccatiSolution>(const MatrixRef&, const MatrixRef&, const MatrixRef&,
                                             const MatrixRef&, const MatrixRef&);
    Solver& solver = continuous ? static_cast<Solver&>(care) : static_cast<Solver&>(dare);
    return solver(Eigen::MatrixXd(A), Eigen::MatrixXd(B), Eigen::MatrixXd(Q), Eigen::MatrixXd(R),
                  cross);
  }
  Expected<RiccatiSolution> solution;
  solution->X.resize(n, n);
  solution->K.resize(m, n);
  solution->poles.resize(n);
  detail::RiccatiAnswer answer{solution->X.data(), solution->K.data(), solution->poles.data()};
  auto solved =
      detail::solve_riccati({static_cast<int>(n), static_cast<int>(m), A.data(), B.data(), Q.data(),
                             R.data(), N == nullptr ? nullptr : N->data(), continuous},
                            answer);
  if (!solved) {
    return tl::unexpected(std::move(solved).error());
  }
  solution->residual = answer.residual;
  solution->condition = answer.condition;
  solution->iterations = answer.iterations;
  return solution;
}

}  // namespace

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  return solve(false, A, B, Q, R, &N);
}

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R) {
  return solve(false, A, B, Q, R, nullptr);
}

Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  return solve(true, A, B, Q, R, &N);
}

Expected<RiccatiSolution> care(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R) {
  return solve(true, A, B, Q, R, nullptr);
}

}  // namespace flyball
