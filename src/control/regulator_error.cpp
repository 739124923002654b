#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/controllability.hpp>

#include "control/weights.hpp"

namespace flyball::detail {

namespace {

/// The values that an error gives under a name that begins so; none.
std::vector<double> evidence_of(const Error& error, std::string_view name) {
  for (const Evidence& evidence : error.evidence()) {
    if (evidence.name.starts_with(name)) {
      return evidence.values;
    }
  }
  return {};
}

bool holds(const Error& error, const MatrixRef& A, const MatrixRef& B, TimeDomain domain) {
  if (error.is(RiccatiError::not_stabilizable)) {
    const auto reach = analyze_controllability(A, B, domain);
    return !reach || !reach->stabilizable;
  }
  if (error.is(RiccatiError::singular)) {
    constexpr double regular = 1e-8;
    const std::vector<double> rcond = evidence_of(error, "reciprocal condition");
    return rcond.empty() || rcond.front() < regular;
  }
  if (error.is(RiccatiError::no_stabilizing_solution) && domain == TimeDomain::continuous) {
    constexpr double near = 1e-6;
    const std::vector<double> distance = evidence_of(error, "distance from the imaginary axis");
    const std::vector<double> mode = evidence_of(error, "eigenvalue");
    const double size = std::max(mode.size() == 2 ? std::hypot(mode[0], mode[1]) : 0.0, A.norm());
    return distance.empty() || distance.front() <= near * size || distance.front() == 0.0;
  }
  return true;
}

}  // namespace

Error regulator_error(Error error, const MatrixRef& A, const MatrixRef& B, TimeDomain domain,
                      std::string_view where) {
  if (holds(error, A, B, domain)) {
    return Error(std::move(error).in(std::string(where)));
  }
  return Error(RiccatiError::no_convergence)
      .in(std::string(where))
      .about("X")
      .hint(
          "measure time, states and inputs in units in which the entries of A, B, Q and R are "
          "near one, and check that Q and R are the weights of a minimum");
}

}  // namespace flyball::detail
