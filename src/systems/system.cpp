#include <flyball/systems/system.hpp>

#include <complex>
#include <string>

#include "math/dense/dense.hpp"

namespace flyball {

Expected<void> check_system(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                            const MatrixRef& D, std::string_view where) {
  if (auto square = check_square(A, where, "A"); !square) {
    return square;
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  if (auto shape = check_shape(B, n, m, where, "B", "states x inputs"); !shape) {
    return shape;
  }
  if (m == 0) {
    return tl::unexpected(Error(ArgumentError::empty)
                              .in(std::string(where))
                              .about("B")
                              .got("without columns")
                              .expected("states x inputs with at least one input"));
  }
  if (auto shape = check_shape(C, p, n, where, "C", "outputs x states"); !shape) {
    return shape;
  }
  if (auto shape = check_shape(D, p, m, where, "D", "outputs x inputs"); !shape) {
    return shape;
  }
  for (const auto& [matrix, name] :
       {std::pair<const MatrixRef&, const char*>{A, "A"}, {B, "B"}, {C, "C"}, {D, "D"}}) {
    if (auto finite = check_finite(matrix, where, name); !finite) {
      return finite;
    }
  }
  return {};
}

Expected<Eigen::VectorXcd> poles(const MatrixRef& A) {
  if (auto square = check_square(A, "poles", "A"); !square) {
    return tl::unexpected(square.error());
  }
  if (auto finite = check_finite(A, "poles", "A"); !finite) {
    return tl::unexpected(finite.error());
  }
  Eigen::VectorXcd eigenvalues = detail::eigenvalues_of(A);
  if (!eigenvalues.allFinite()) {
    return tl::unexpected(Error(ArgumentError::malformed)
                              .in("poles")
                              .about("A")
                              .got("a matrix on which the QR iteration did not converge")
                              .hint("scale its rows and columns to like magnitudes"));
  }
  return eigenvalues;
}

bool is_stable_continuous(const Eigen::VectorXcd& poles) noexcept {
  return (poles.real().array() < 0.0).all();
}

bool is_stable_discrete(const Eigen::VectorXcd& poles) noexcept {
  return (poles.array().abs() < 1.0).all();
}

}  // namespace flyball
