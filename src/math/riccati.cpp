#include <flyball/math/riccati.hpp>

#include <utility>

#include "math/riccati_robust.hpp"

namespace flyball {

namespace {

Expected<void> check_arguments(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  constexpr std::string_view where = "dare";
  if (auto check = check_square(A, where, "A"); !check) {
    return check;
  }
  if (B.cols() == 0) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in("dare")
                              .about("B")
                              .got("without columns")
                              .expected("states x inputs with at least one input"));
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  if (auto shapes = check_all(check_shape(B, n, m, where, "B", "states x inputs"),
                              check_shape(Q, n, n, where, "Q", "states x states"),
                              check_shape(R, m, m, where, "R", "inputs x inputs"),
                              check_shape(N, n, m, where, "N", "states x inputs"));
      !shapes) {
    return shapes;
  }
  if (auto finite = check_all(check_finite(A, where, "A"), check_finite(B, where, "B"),
                              check_finite(Q, where, "Q"), check_finite(R, where, "R"),
                              check_finite(N, where, "N"));
      !finite) {
    return finite;
  }
  return check_all(check_symmetric(Q, where, "Q"), check_symmetric(R, where, "R"));
}

}  // namespace

ErrorInfo error_info(RiccatiError code) {
  constexpr std::string_view family = "riccati";
  switch (code) {
    case RiccatiError::not_stabilizable:
      return {family, "not_stabilizable",
              "a mode on or outside the unit circle is reached by no input", ErrorKind::no_answer};
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

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R, const MatrixRef& N) {
  if (auto check = check_arguments(A, B, Q, R, N); !check) {
    return tl::unexpected(std::move(check).error());
  }
  return detail::solve_riccati_robustly(
      {A, B, 0.5 * (Q + Q.transpose()), 0.5 * (R + R.transpose()), N});
}

Expected<RiccatiSolution> dare(const MatrixRef& A, const MatrixRef& B, const MatrixRef& Q,
                               const MatrixRef& R) {
  return dare(A, B, Q, R, Eigen::MatrixXd::Zero(B.rows(), B.cols()));
}

}  // namespace flyball
