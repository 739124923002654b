#include <flyball/estimation/kalman_gain.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/controllability.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "estimation/steady_filter.hpp"
#include "math/extended/extended_eigenvalues.hpp"

namespace flyball {

namespace {

Error with_mode(Error error, std::complex<double> mode) {
  return std::move(error)
      .with("eigenvalue", {mode.real(), mode.imag()})
      .with("magnitude", std::abs(mode));
}

Error no_inverse(std::string_view where) {
  return Error(RiccatiError::singular)
      .in(std::string(where))
      .about("C P Cᵀ + R")
      .got("singular")
      .hint("give each output a noise of its own in R");
}

Error no_digits(std::string_view where) {
  return Error(RiccatiError::no_convergence)
      .in(std::string(where))
      .about("P")
      .hint(
          "measure states and outputs in units in which the entries of A, C, Q and R are near one");
}

/// What the dual's Riccati equation refuses, in words of the filter; the reason is looked for in
/// (A, C) itself, whose verdict does not depend on units.
Error filter_error(const Error& dual, const MatrixRef& A, const MatrixRef& C,
                   std::string_view where) {
  const std::string name(where);
  const auto sight = analyze_observability(A, C, TimeDomain::discrete);
  if (sight && !sight->detectable) {
    for (const ModeReach& mode : sight->modes) {
      if (!mode.reached && mode.stability != Stability::stable) {
        return with_mode(
            Error(KalmanGainError::not_detectable)
                .in(name)
                .about("(A, C)")
                .hint("nothing corrects this mode; measure a state that it moves, or take it out "
                      "of the model"),
            mode.eigenvalue);
      }
    }
  }
  if (dual.is(RiccatiError::singular)) {
    return no_inverse(where);
  }
  if (dual.is(RiccatiError::no_stabilizing_solution)) {
    Error error = Error(KalmanGainError::undriven_mode)
                      .in(name)
                      .about("Q")
                      .hint(
                          "give this mode some process noise, so that its measurements go on to "
                          "count, or take it out of the model");
    for (const Evidence& evidence : dual.evidence()) {
      error = Error(std::move(error).with(evidence.name, evidence.values));
    }
    return error;
  }
  if (dual.is(RiccatiError::no_convergence) || dual.is(RiccatiError::not_stabilizable)) {
    return no_digits(where);
  }
  return Error(dual).in(name);
}

}  // namespace

ErrorInfo error_info(KalmanGainError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_detectable", "a mode that is not stable is shown by no output", ErrorKind::no_answer},
      {"undriven_mode", "no noise drives a mode on the unit circle", ErrorKind::no_answer},
  };
  return detail::info_of(code, "kalman_gain", rows);
}

Expected<KalmanGain<>> kalman_gain(const MatrixRef& A, const MatrixRef& C, const Covariance& Q,
                                   const Covariance& R) {
  constexpr std::string_view where = "kalman_gain";
  constexpr double largest_residual = 1e-11;
  if (!Q.get() || !R.get()) {
    return tl::unexpected((Q.get() ? R : Q).get().error());
  }
  const Eigen::MatrixXd& noise_Q = *Q.get();
  const Eigen::MatrixXd& noise_R = *R.get();
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(noise_Q, n, n, "Q", "states x states")
                    .shape(noise_R, p, p, "R", "outputs x outputs"));

  FLYBALL_CHECK(Checks(where)
                    .finite(A, "A")
                    .finite(C, "C")
                    .also([&] { return check_covariance(noise_Q, where, "Q"); })
                    .also([&] { return check_covariance(noise_R, where, "R"); }));

  auto dual = dare(A.transpose(), C.transpose(), noise_Q, noise_R);
  if (!dual) {
    return tl::unexpected(filter_error(dual.error(), A, C, where));
  }
  const RiccatiSolution& solution = *dual;
  const detail::FilterProblem problem{A, C, noise_Q, noise_R};
  auto filter = detail::filter_at(problem, solution.X);
  double residual = std::numeric_limits<double>::infinity();
  std::optional<Eigen::VectorXcd> poles;
  const auto judge = [&] {
    residual = filter ? detail::residual_of(*filter) : residual;
    poles = filter ? detail::poles_of(*filter) : std::nullopt;
    return residual <= largest_residual && poles;
  };
  if (filter) {
    filter = detail::corrected(std::move(*filter));
  }
  if (!judge()) {
    const bool inverse = filter.has_value();
    filter = detail::iterated(problem, solution.X, solution.K.transpose());
    if (!filter && !inverse) {
      return tl::unexpected(no_inverse(where));
    }
    if (!judge()) {
      return tl::unexpected(
          no_digits(where)
              .got(poles ? "lost to rounding: it leaves more of its equations than rounding may"
                         : "of a filter that is stable or not by the last digits of K")
              .with("residual", residual));
    }
  }
  KalmanGain<> gain;
  gain.K = filter->gain(filter->update.K);
  gain.L = detail::product(A, gain.K);
  if (!gain.L.allFinite()) {
    gain.L = filter->gain(product(filter->A, filter->update.K));
  }
  gain.P_prior = filter->covariance(filter->P);
  gain.P_posterior = filter->covariance(filter->update.P);
  // Where measurements leave no variance, the sign of what is left is rounding beside the prior's.
  for (Eigen::Index i = 0; i < n; ++i) {
    if (gain.P_posterior(i, i) < 0.0 &&
        gain.P_posterior(i, i) >= -largest_residual * gain.P_prior(i, i)) {
      gain.P_posterior(i, i) = 0.0;
    }
  }
  gain.poles = *poles;
  if (constexpr double nearly_nothing = 1e-150;
      gain.K.allFinite() && gain.poles.cwiseAbs().maxCoeff() < nearly_nothing) {
    // In the filter's units what such poles come from may have vanished: A - AKC as it is answered.
    using detail::WideMatrix;
    const WideMatrix wide_A(A);
    gain.poles = detail::wide_eigenvalues_of(detail::add_product(
        wide_A, -1.0, detail::product(wide_A, WideMatrix(gain.K)), WideMatrix(C)));
  }
  if (!gain.K.allFinite() || !gain.L.allFinite() || !gain.P_prior.allFinite()) {
    return refusal(RiccatiError::overflow, where, "K")
        .hint("measure states and outputs in other units");
  }
  gain.residual = std::max(solution.residual, residual);
  gain.condition = solution.condition;
  return gain;
}

}  // namespace flyball
