#include <flyball/control/lqr.hpp>

#include <cmath>

#include <flyball/math/riccati/riccati.hpp>

#include "control/weights.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace detail {

Expected<LqrDesign<>> solve_lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                                const Weight& R, const Eigen::MatrixXd* N, TimeDomain domain,
                                CarefulWork* work) {
  const bool continuous = domain == TimeDomain::continuous;
  const std::string_view where = continuous ? "continuous_lqr" : "lqr";
  if (!Q.get() || !R.get()) {
    return tl::unexpected((Q.get() ? R : Q).get().error());
  }
  const Eigen::MatrixXd& weight_Q = *Q.get();  // Not copied: a gain may be designed in a loop.
  const Eigen::MatrixXd& weight_R = *R.get();
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index m = B.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(B, n, m, "B", "states x inputs")
                    .shape(weight_Q, n, n, "Q", "states x states")
                    .shape(weight_R, m, m, "R", "inputs x inputs")
                    .also([&] {
                      return N == nullptr ? Expected<void>{}
                                          : check_shape(*N, n, m, where, "N", "states x inputs");
                    }));
  const auto solve = [&](const auto&... cross) {
    if (work != nullptr) {
      const Eigen::MatrixXd given =
          N == nullptr ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, m)) : *N;
      return continuous ? care_within(A, B, weight_Q, weight_R, given, *work)
                        : dare_within(A, B, weight_Q, weight_R, given, *work);
    }
    return continuous ? care(A, B, weight_Q, weight_R, cross...)
                      : dare(A, B, weight_Q, weight_R, cross...);
  };
  auto solution = N == nullptr ? solve() : solve(*N);
  if (!solution) {
    return tl::unexpected(regulator_error(std::move(solution).error(), A, B, domain, where));
  }
  return LqrDesign<>{std::move(solution->K), std::move(solution->X), std::move(solution->poles),
                     solution->residual, solution->condition};
}

}  // namespace detail

Expected<Eigen::MatrixXd> bryson(std::span<const double> tolerances, double rho) {
  constexpr std::string_view name = "bryson";
  if (tolerances.empty()) {
    return refusal(ArgumentError::empty, name, "tolerances")
        .got("empty")
        .expected("one tolerance a state or input");
  }
  FLYBALL_CHECK(check_positive(rho, name, "rho"));
  const auto n = static_cast<Eigen::Index>(tolerances.size());
  Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double tolerance = tolerances[static_cast<std::size_t>(i)];
    if (std::isinf(tolerance) && tolerance > 0.0) {
      continue;
    }
    const std::string entry = detail::format("tolerance {}", i);
    if (auto checked = check_positive(tolerance, name, entry); !checked) {
      return tl::unexpected(
          Error(std::move(checked.error()))
              .hint("give the largest acceptable excursion, or infinity if it does not matter"));
    }
    const double value = rho / (tolerance * tolerance);
    if (!std::isfinite(value) || value == 0.0) {
      return refusal(ArgumentError::out_of_range, name, entry)
          .got(format_number(tolerance))
          .expected("such that rho / tolerance^2 is a normal number");
    }
    weight(i, i) = value;
  }
  return weight;
}

Expected<Eigen::MatrixXd> bryson(std::initializer_list<double> tolerances, double rho) {
  return bryson(std::span<const double>(tolerances.begin(), tolerances.size()), rho);
}

Expected<LqrDesign<>> lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q,
                          const Weight& R) {
  return detail::solve_lqr(A, B, Q, R, nullptr, TimeDomain::discrete);
}

Expected<LqrDesign<>> lqr(const MatrixRef& A, const MatrixRef& B, const Weight& Q, const Weight& R,
                          const MatrixRef& N) {
  const Eigen::MatrixXd cross = N;
  return detail::solve_lqr(A, B, Q, R, &cross, TimeDomain::discrete);
}

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs)                                     \
  template Expected<LqrDesign<States, Inputs>> lqr(const DiscreteSystem<States, Inputs, Outputs>&, \
                                                   const Weight&, const Weight&);                  \
  template Expected<LqrDesign<States, Inputs>> lqr(const DiscreteSystem<States, Inputs, Outputs>&, \
                                                   const Weight&, const Weight&,                   \
                                                   const MatrixRef&);
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
