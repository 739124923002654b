#include <flyball/estimation/kalman_gain.hpp>

#include <optional>
#include <string>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/controllability.hpp>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/equations/lyapunov_correction.hpp"
#include "math/extended/double_double.hpp"

namespace flyball {

namespace {

using detail::DoubleDoubleMatrix;

/// What a measurement makes of the covariance P: K = P Cᵀ(C P Cᵀ + R)⁻¹, P⁺ = P - K C P.
struct Update {
  DoubleDoubleMatrix K;
  DoubleDoubleMatrix P;
};

std::optional<Update> update_of(const DoubleDoubleMatrix& P, const DoubleDoubleMatrix& C,
                                const DoubleDoubleMatrix& R) {
  const DoubleDoubleMatrix CP = product(C, P);
  const auto K = solve(symmetrized(add_product(R, 1.0, CP, C.transpose())), CP);
  if (!K || !K->all_finite()) {
    return std::nullopt;
  }
  DoubleDoubleMatrix gain = K->transpose();
  DoubleDoubleMatrix posterior = symmetrized(add_product(P, -1.0, gain, CP));
  return Update{std::move(gain), std::move(posterior)};
}

/// P to more digits than a double has, and its update. Where the outputs hardly show a growing
/// mode, P is large along it, and what its rounding does elsewhere is more than K and P⁺ there:
/// Newton's method with the residual in twice the working precision gives the missing digits.
struct Filter {
  DoubleDoubleMatrix P;
  Update update;
};

std::optional<Filter> corrected(const MatrixRef& A, const MatrixRef& C, const Eigen::MatrixXd& Q,
                                const Eigen::MatrixXd& R, const Eigen::MatrixXd& P) {
  constexpr int most_steps = 5;
  constexpr double small = 1e-3;
  constexpr double last = 1e-12;
  const DoubleDoubleMatrix a(A);
  const DoubleDoubleMatrix c(C);
  const DoubleDoubleMatrix q(detail::symmetrized(Q));
  const DoubleDoubleMatrix r(detail::symmetrized(R));
  DoubleDoubleMatrix p(P);
  auto update = update_of(p, c, r);
  for (int step = 0; step < most_steps && update; ++step) {
    const DoubleDoubleMatrix predicted = add_product(q, 1.0, product(a, update->P), a.transpose());
    const DoubleDoubleMatrix loop = add_product(a, -1.0, product(a, update->K), c);
    const auto missing =
        detail::discrete_lyapunov_correction(loop.rounded(), sum(predicted, -1.0, p).rounded());
    if (!missing || !(missing->X.norm() <= small * P.norm())) {
      break;
    }
    p = symmetrized(sum(std::move(p), 1.0, DoubleDoubleMatrix(missing->X)));
    update = update_of(p, c, r);
    if (missing->X.norm() <= last * P.norm()) {
      break;
    }
  }
  if (!update) {
    return std::nullopt;
  }
  return Filter{std::move(p), std::move(*update)};
}

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
    return Error(RiccatiError::no_convergence)
        .in(name)
        .about("P")
        .hint(
            "measure states and outputs in units in which the entries of A, C, Q and R are near "
            "one");
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
  const auto filter = corrected(A, C, noise_Q, noise_R, solution.X);
  if (!filter) {
    return tl::unexpected(no_inverse(where));
  }
  KalmanGain<> gain;
  gain.K = filter->update.K.rounded();
  gain.L = product(DoubleDoubleMatrix(A), filter->update.K).rounded();
  gain.P_prior = detail::symmetrized(filter->P.rounded());
  gain.P_posterior = detail::symmetrized(filter->update.P.rounded());
  // Of this K: where the outputs say the same thing without noise, K is not the only one.
  gain.poles = detail::eigenvalues_of(
      add_product(DoubleDoubleMatrix(A), -1.0, DoubleDoubleMatrix(gain.L), DoubleDoubleMatrix(C))
          .rounded());
  if (!(gain.poles.cwiseAbs().maxCoeff() < 1.0)) {
    gain.poles = solution.poles;
  }
  gain.residual = solution.residual;
  gain.condition = solution.condition;
  return gain;
}

}  // namespace flyball
