#include <flyball/systems/system.hpp>

#include <complex>
#include <string>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

/// What a matrix's shape has to do with A's.
std::string of_states(const char* shape, Eigen::Index states) {
  return detail::format("{}, A having {} state{}", shape, states, states == 1 ? "" : "s");
}

}  // namespace

Expected<void> check_system(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                            const MatrixRef& D, std::string_view where) {
  FLYBALL_CHECK(check_square(A, where, "A"));
  return check_system_or_gain(A, B, C, D, where);
}

Expected<void> check_system_or_gain(const MatrixRef& A, const MatrixRef& B, const MatrixRef& C,
                                    const MatrixRef& D, std::string_view where) {
  if (A.size() != 0) {
    FLYBALL_CHECK(check_square(A, where, "A"));
  }
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(check_shape(B, n, m, where, "B", of_states("states x inputs", n)));
  if (m == 0) {
    return refusal(ArgumentError::empty, where, "B")
        .got("without columns")
        .expected("states x inputs with at least one input");
  }
  FLYBALL_CHECK(Checks(where)
                    .shape(C, p, n, "C", of_states("outputs x states", n))
                    .shape(D, p, m, "D",
                           detail::format("outputs x inputs, as C has {} row{} and B {} column{}",
                                          p, p == 1 ? "" : "s", m, m == 1 ? "" : "s")));
  for (const auto& [matrix, name] :
       {std::pair<const MatrixRef&, const char*>{A, "A"}, {B, "B"}, {C, "C"}, {D, "D"}}) {
    FLYBALL_CHECK(check_finite(matrix, where, name));
  }
  return {};
}

Expected<void> check_system_or_gain(const ContinuousSystem<>& system, std::string_view where) {
  return check_system_or_gain(system.A, system.B, system.C, system.D, where);
}

Expected<void> check_system_or_gain(const DiscreteSystem<>& system, std::string_view where) {
  FLYBALL_CHECK(check_positive(system.period.si(), where, "period", "s"));
  return check_system_or_gain(system.A, system.B, system.C, system.D, where);
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
