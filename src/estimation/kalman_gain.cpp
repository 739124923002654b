#include <flyball/estimation/kalman_gain.hpp>

#include <optional>
#include <string>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/riccati/riccati.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/equations/sylvester_operator.hpp"
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

}  // namespace

Expected<KalmanGain<>> kalman_gain(const MatrixRef& A, const MatrixRef& C, const Covariance& Q,
                                   const Covariance& R) {
  constexpr std::string_view where = "kalman_gain";
  FLYBALL_TRY(const auto noise_Q, Q.get());
  FLYBALL_TRY(const auto noise_R, R.get());
  FLYBALL_CHECK(check_square(A, where, "A"));
  const Eigen::Index n = A.rows();
  const Eigen::Index p = C.rows();
  FLYBALL_CHECK(Checks(where)
                    .shape(C, p, n, "C", "outputs x states")
                    .shape(noise_Q, n, n, "Q", "states x states")
                    .shape(noise_R, p, p, "R", "outputs x outputs"));

  auto dual = dare(A.transpose(), C.transpose(), noise_Q, noise_R);
  if (!dual && dual.error().is(RiccatiError::not_stabilizable)) {
    return tl::unexpected(
        std::move(dual)
            .error()
            .in(std::string(where))
            .about("the dual (Aᵀ, Cᵀ)")
            .hint("no output shows this mode, so nothing corrects it; measure a state that it "
                  "moves"));
  }
  FLYBALL_TRY_IN(where, const auto solution, std::move(dual));
  const auto filter = corrected(A, C, noise_Q, noise_R, solution.X);
  if (!filter) {
    return refusal(RiccatiError::singular, where, "C P Cᵀ + R")
        .got("singular")
        .hint("give each output a noise of its own in R");
  }
  KalmanGain<> gain;
  gain.K = filter->update.K.rounded();
  gain.L = product(DoubleDoubleMatrix(A), filter->update.K).rounded();
  gain.P_prior = detail::symmetrized(filter->P.rounded());
  gain.P_posterior = detail::symmetrized(filter->update.P.rounded());
  gain.poles = solution.poles;
  gain.residual = solution.residual;
  gain.condition = solution.condition;
  return gain;
}

}  // namespace flyball
