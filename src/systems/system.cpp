#include <flyball/systems/system.hpp>

#include <complex>
#include <string>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

Expected<void> check_system(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                            const MatrixRef& D, std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(check_shape(B, n, m, where, "B", "states x inputs"));
  if (m == 0) {
    return refusal(ArgumentError::empty, where, "B")
        .got("without columns")
        .expected("states x inputs with at least one input");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(D, p, m, "D", "outputs x inputs"));
  for (const auto& [matrix, name] :
       {std::pair<const MatrixRef&, const char*>{A, "A"}, {B, "B"}, {C, "C"}, {D, "D"}}) {
    FLYBALL_CHECK(check_finite(matrix, where, name));
  }
  return {};
}

Expected<Eigen::VectorXcd> poles(const MatrixRef& A) {
  FLYBALL_CHECK(Checks("poles").square(A, "A").finite(A, "A"));
  Eigen::VectorXcd eigenvalues = detail::eigenvalues_of(A);
  if (!eigenvalues.allFinite()) {
    return refusal(ArgumentError::malformed, "poles", "A")
        .got("a matrix on which the QR iteration did not converge")
        .hint("scale its rows and columns to like magnitudes");
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
