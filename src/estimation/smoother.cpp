#include <flyball/estimation/smoother.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <flyball/core/function_ref.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/probability/conditioning.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view in_smooth = "smooth";

/// What the backward pass needs of a step, with the factors of P⁺ of before and of Q.
struct Backward {
  const MatrixXd& F;
  const MatrixXd& S;        ///< P⁺ = S Sᵀ
  const MatrixXd& S_noise;  ///< Q = S_noise S_noiseᵀ
};

MatrixXd square_of(const MatrixXd& S) {
  return detail::symmetrized(detail::product_transposed(S, S));
}

/// x and P of before the step, from those after it. @param S  The factor of P, from after the step
/// to before it: what a contracting step has made small is divided by it again, which P itself
/// would have lost.
void step_back(const Backward& step, const VectorXd& x_filtered, const VectorXd& x_prior,
               const VectorXd& x_after, MatrixXd& S, Eigen::Ref<VectorXd> x, MatrixXd& P,
               MatrixXd& P_cross) {
  // x_k given x_{k+1} (9.41), whatever else is known of that.
  const auto given = detail::measure(step.S, step.F, step.S_noise);
  x = x_filtered + detail::product(given.K, x_after - x_prior);  // (9.42)
  // (9.43): (I - KF)P⁺(I - KF)ᵀ + KQKᵀ is the covariance of that condition.
  const MatrixXd KS = detail::product(given.K, S);
  P_cross = detail::product_transposed(KS, S);
  MatrixXd both(x.size(), given.factor.cols() + KS.cols());
  both << given.factor, KS;
  S = detail::compressed(both);
  P = square_of(S);
}

std::string entry_of_step(Index step, std::string_view name) {
  return detail::format("{} of step {}", name, step);
}

/// A covariance as it is handed from step to step: its factor is made once.
class FactorOfMatrix {
 public:
  Expected<const MatrixXd*> of(const MatrixXd& M, Index step, std::string_view name) {
    if (M.rows() != matrix_.rows() || M.cols() != matrix_.cols() || M != matrix_ || !known_) {
      FLYBALL_TRY(factor_, detail::covariance_factor(M, in_smooth, entry_of_step(step, name)));
      matrix_ = M;
      known_ = true;
    }
    return &factor_;
  }

 private:
  MatrixXd matrix_;
  MatrixXd factor_;
  bool known_ = false;
};

Expected<void> check_start(const VectorXd& x0, const MatrixRef& P0) {
  if (x0.size() == 0) {
    return refusal(ArgumentError::empty, in_smooth, "x0").got("empty");
  }
  return Checks(in_smooth).finite(x0, "x0").shape(P0, x0.size(), x0.size(), "P0",
                                                  "states x states");
}

Expected<void> check_model(const MatrixXd& A, const MatrixXd& Q, Index n, Index k) {
  const std::string of_A = entry_of_step(k, "A");
  return Checks(in_smooth)
      .shape(A, n, n, of_A, "states x states")
      .finite(A, of_A)
      .shape(Q, n, n, entry_of_step(k, "Q"), "states x states");
}

Expected<void> check_step(const LinearStep& step, Index n, Index k) {
  FLYBALL_CHECK(check_model(step.A, step.Q, n, k));
  const Index p = step.y.size();
  const std::string input = entry_of_step(k, "input");
  const std::string of_C = entry_of_step(k, "C");
  return Checks(in_smooth)
      .shape(step.input, step.input.size() == 0 ? 0 : n, 1, input, "states x 1")
      .finite(step.input, input)
      .shape(step.C, p, n, of_C, "outputs x states")
      .finite(step.C, of_C)
      .shape(step.R, p, p, entry_of_step(k, "R"), "outputs x outputs")
      .also([&]() -> Expected<void> {
        for (Index i = 0; i < p; ++i) {
          if (std::isinf(step.y(i))) {
            return check_finite(step.y(i), in_smooth, detail::format("y({}) of step {}", i, k));
          }
        }
        return {};
      });
}

/// What is needed of a forward step to go back over it.
struct PassedStep {
  MatrixXd S;        ///< Factor of P⁺ before the step.
  MatrixXd S_noise;  ///< Of Q.
  VectorXd x_prior;
};

/// The Kalman filter in factors, one step after the other.
class Forward {
 public:
  Forward(LinearSmoothing& result, VectorXd x, MatrixXd S)
      : result_(result), x_(std::move(x)), S_(std::move(S)) {
    keep(0);
  }

  Expected<PassedStep> take(const LinearStep& step, Index k) {
    FLYBALL_CHECK(check_step(step, x_.size(), k));
    FLYBALL_TRY(const MatrixXd* S_noise, noise_.of(step.Q, k, "Q"));
    PassedStep passed{S_, *S_noise, {}};
    // (9.36), (9.37)
    x_ = detail::product(step.A, x_);
    if (step.input.size() > 0) {
      x_ += step.input;
    }
    MatrixXd predicted(x_.size(), S_.cols() + S_noise->cols());
    predicted << detail::product(step.A, S_), *S_noise;
    S_ = detail::compressed(predicted);
    passed.x_prior = x_;
    FLYBALL_CHECK(measure(step, k));
    keep(k + 1);
    if (!x_.allFinite() || !result_.P_filtered[static_cast<std::size_t>(k + 1)].allFinite()) {
      return beyond_doubles(k);
    }
    return passed;
  }

  [[nodiscard]] const MatrixXd& factor() const noexcept { return S_; }

 private:
  static Refusal beyond_doubles(Index k) {
    return refusal(ArgumentError::out_of_range, in_smooth, entry_of_step(k, "the estimate"))
        .got("beyond the largest double");
  }

  void keep(Index k) {
    result_.x_filtered.col(k) = x_;
    result_.P_filtered[static_cast<std::size_t>(k)] = square_of(S_);
  }

  /// (9.38) to (9.40) with the entries that are there.
  Expected<void> measure(const LinearStep& step, Index k) {
    std::vector<Index> there;
    for (Index i = 0; i < step.y.size(); ++i) {
      if (!std::isnan(step.y(i))) {
        there.push_back(i);
      }
    }
    result_.measured(k) = 0;
    result_.nis(k) = 0.0;
    if (there.empty()) {
      return {};
    }
    const MatrixXd C = step.C(there, Eigen::all);
    const VectorXd y = step.y(there);
    FLYBALL_TRY(const MatrixXd* R, measurement_noise_.of(MatrixXd(step.R(there, there)), k, "R"));
    const auto of = detail::measure(S_, C, *R);
    const VectorXd innovation = y - detail::product(C, x_);
    if (!innovation.allFinite() || !of.K.allFinite()) {
      return beyond_doubles(k);
    }
    Index contradicted = -1;
    result_.nis(k) =
        of.squared_distance(innovation, y.cwiseAbs() + C.cwiseAbs() * x_.cwiseAbs(), contradicted);
    if (contradicted >= 0) {
      return refusal(GaussianError::contradiction, in_smooth,
                     detail::format("y({}) of step {}",
                                    there[static_cast<std::size_t>(contradicted)], k))
          .got(format_number(y(contradicted)))
          .expected("what the model is certain of")
          .hint("give the measurement noise in R, or the model in Q")
          .with("innovation", innovation(contradicted));
    }
    result_.measured(k) = static_cast<int>(of.rank);
    result_.log_likelihood -=
        0.5 * (result_.nis(k) + of.log_determinant +
               static_cast<double>(of.rank) * std::log(2.0 * std::numbers::pi));
    x_ += detail::product(of.K, innovation);
    S_ = of.factor;
    return {};
  }

  LinearSmoothing& result_;
  FactorOfMatrix noise_;
  FactorOfMatrix measurement_noise_;
  VectorXd x_;
  MatrixXd S_;
};

Expected<LinearSmoothing> smooth_steps(const VectorXd& x0, const MatrixRef& P0, Index N,
                                       FunctionRef<const LinearStep&(Index)> step_at) {
  FLYBALL_CHECK(check_start(x0, P0));
  FLYBALL_TRY(auto S0, detail::covariance_factor(P0, in_smooth, "P0"));
  const Index n = x0.size();
  const auto count = static_cast<std::size_t>(N);
  LinearSmoothing result;
  result.x_filtered.resize(n, N + 1);
  result.P_filtered.resize(count + 1);
  result.nis.resize(N);
  result.measured.resize(N);
  Forward forward(result, x0, std::move(S0));
  std::vector<PassedStep> passed;
  passed.reserve(count);
  for (Index k = 0; k < N; ++k) {
    FLYBALL_TRY(auto step, forward.take(step_at(k), k));
    passed.push_back(std::move(step));
  }
  SmoothedPath& path = result.smoothed;
  path.x = result.x_filtered;  // (9.44), (9.45)
  path.P = result.P_filtered;
  path.P_cross.resize(count);
  MatrixXd S = forward.factor();
  for (std::size_t k = count; k-- > 0;) {
    const auto column = static_cast<Index>(k);
    const LinearStep& step = step_at(column);
    step_back({step.A, passed[k].S, passed[k].S_noise}, result.x_filtered.col(column),
              passed[k].x_prior, path.x.col(column + 1), S, path.x.col(column), path.P[k],
              path.P_cross[k]);
  }
  return result;
}

}  // namespace

Expected<FilterStep<>> statistical_linearization(const MatrixRef& cross, const MatrixRef& P,
                                                 const MatrixRef& P_prior) {
  constexpr std::string_view name = "statistical_linearization";
  const Index n = P.rows();
  FLYBALL_CHECK(Checks(name)
                    .shape(cross, n, n, "the cross covariance", "states x states")
                    .finite(cross, "the cross covariance")
                    .shape(P_prior, n, n, "P_prior", "states x states"));
  MatrixXd joint(2 * n, 2 * n);
  joint << P, cross, cross.transpose(), P_prior;
  FLYBALL_TRY(const auto S, detail::covariance_factor(joint, name, "the joint covariance"));
  // x⁻ given the state of before: what it explains, and the rest.
  const MatrixXd state = S.topRows(n);
  const auto given =
      detail::condition(S.bottomRows(n), state, MatrixXd(n, 0), state.rowwise().norm());
  FilterStep<> step;
  step.F = given.K;
  step.Q = square_of(given.factor);
  return step;
}

Expected<SmoothedPath> smooth(const VectorXd& x0, const MatrixRef& P0,
                              std::span<const FilterStep<>> steps) {
  FLYBALL_CHECK(check_start(x0, P0));
  const Index n = x0.size();
  const auto N = static_cast<Index>(steps.size());
  for (Index k = 0; k < N; ++k) {
    const FilterStep<>& step = steps[static_cast<std::size_t>(k)];
    FLYBALL_CHECK(check_model(step.F, step.Q, n, k));
    const std::string prior = entry_of_step(k, "x_prior");
    const std::string posterior = entry_of_step(k, "x");
    FLYBALL_CHECK(Checks(in_smooth)
                      .shape(step.x_prior, n, 1, prior, "states x 1")
                      .finite(step.x_prior, prior)
                      .shape(step.x, n, 1, posterior, "states x 1")
                      .finite(step.x, posterior)
                      .shape(step.P, n, n, entry_of_step(k, "P"), "states x states"));
  }
  SmoothedPath path;
  path.x.resize(n, N + 1);
  path.P.resize(steps.size() + 1);
  path.P_cross.resize(steps.size());
  const auto filtered = [&](Index k) -> const VectorXd& {
    return k == 0 ? x0 : steps[static_cast<std::size_t>(k - 1)].x;
  };
  const auto factor = [&](Index k) {
    return k == 0 ? detail::covariance_factor(P0, in_smooth, "P0")
                  : detail::covariance_factor(steps[static_cast<std::size_t>(k - 1)].P, in_smooth,
                                              entry_of_step(k - 1, "P"));
  };
  FLYBALL_TRY(auto S_smoothed, factor(N));
  path.x.col(N) = filtered(N);
  path.P.back() = square_of(S_smoothed);
  FactorOfMatrix noise;
  for (Index k = N; k-- > 0;) {
    const FilterStep<>& step = steps[static_cast<std::size_t>(k)];
    FLYBALL_TRY(const auto S, factor(k));
    FLYBALL_TRY(const MatrixXd* S_noise, noise.of(step.Q, k, "Q"));
    const auto at = static_cast<std::size_t>(k);
    step_back({step.F, S, *S_noise}, filtered(k), step.x_prior, path.x.col(k + 1), S_smoothed,
              path.x.col(k), path.P[at], path.P_cross[at]);
  }
  return path;
}

Expected<LinearSmoothing> smooth(const VectorXd& x0, const MatrixRef& P0,
                                 std::span<const LinearStep> steps) {
  return smooth_steps(x0, P0, static_cast<Index>(steps.size()), [&](Index k) -> const LinearStep& {
    return steps[static_cast<std::size_t>(k)];
  });
}

Expected<LinearSmoothing> smooth(const DiscreteSystem<>& plant, const Covariance& Q,
                                 const Covariance& R, const VectorXd& x0, const Covariance& P0,
                                 const MatrixRef& inputs, const MatrixRef& outputs) {
  for (const Covariance* covariance : {&Q, &R, &P0}) {
    FLYBALL_CHECK(covariance->get());
  }
  FLYBALL_CHECK(check_system(plant, in_smooth));
  const Index n = plant.A.rows();
  const Index p = plant.C.rows();
  FLYBALL_CHECK(Checks(in_smooth)
                    .shape(x0, n, 1, "x0", "states x 1")
                    .shape(*Q.get(), n, n, "Q", "states x states")
                    .shape(*R.get(), p, p, "R", "outputs x outputs")
                    .shape(outputs, p, outputs.cols(), "the outputs", "outputs x samples")
                    .shape(inputs, plant.B.cols(), outputs.cols(), "the inputs",
                           "inputs x samples of the outputs")
                    .finite(inputs, "the inputs"));
  LinearStep step{plant.A, {}, *Q.get(), plant.C, *R.get(), {}};
  return smooth_steps(x0, *P0.get(), outputs.cols(), [&](Index k) -> const LinearStep& {
    step.input = plant.B * inputs.col(k);
    step.y = outputs.col(k) - plant.D * inputs.col(k);
    return step;
  });
}

}  // namespace flyball
