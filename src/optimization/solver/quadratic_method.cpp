#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/solver/quadratic_method.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using flyball::detail::has_wide_vectors;

/// How far the complementarity falls before a run keeps where the next one may begin.
constexpr double middle = 1e-2;

double largest(const VectorXd& v) {
  return v.size() > 0 ? v.lpNorm<Eigen::Infinity>() : 0.0;
}

}  // namespace

QuadraticMethod::QuadraticMethod(Program& program) : program_(program) {
  const Index n = program.variables();
  const Index m = program.constraints();
  for (VectorXd* v :
       {&w_,          &zl_,       &zu_,      &sl_,      &su_,  &free_,       &g_,
        &rd_,         &diagonal_, &rw_,      &dw_,      &dzl_, &dzu_,        &affine_w_,
        &residual_w_, &fix_w_,    &hw_,      &il_,      &iu_,  &low_target_, &high_target_,
        &low_,        &high_,     &has_low_, &has_high_}) {
    v->setZero(n);
  }
  for (VectorXd* v : {&lambda_, &c0_, &c_, &D_, &dl_, &affine_l_, &residual_c_, &fix_c_, &hc_}) {
    v->setZero(m);
  }
  certificate_.setZero(std::max(n, m));
  for (VectorXd* v : {&middle_w_, &middle_zl_, &middle_zu_}) {
    v->resize(n);
  }
  middle_lambda_.resize(m);
}

BoundArrays QuadraticMethod::bound_arrays() {
  return {.count = static_cast<std::size_t>(w_.size()),
          .low = low_.data(),
          .high = high_.data(),
          .has_low = has_low_.data(),
          .has_high = has_high_.data(),
          .free = free_.data(),
          .hw = hw_.data(),
          .g = g_.data(),
          .affine = affine_w_.data(),
          .dw = dw_.data(),
          .w = w_.data(),
          .zl = zl_.data(),
          .zu = zu_.data(),
          .sl = sl_.data(),
          .su = su_.data(),
          .il = il_.data(),
          .iu = iu_.data(),
          .diagonal = diagonal_.data(),
          .rw = rw_.data(),
          .rd = rd_.data(),
          .dzl = dzl_.data(),
          .dzu = dzu_.data(),
          .low_target = low_target_.data(),
          .high_target = high_target_.data()};
}

void QuadraticMethod::distances() {
  FLYBALL_RUN_KERNEL(measure_bounds, bound_arrays());
}

void QuadraticMethod::residuals() {
  program_.multiply(w_, lambda_, hw_, hc_);  // H w + Aᵀ λ, A w
  errors_ = FLYBALL_RUN_KERNEL(judge_bounds, bound_arrays());
  c_ = hc_ + c0_;
}

void QuadraticMethod::solve(VectorXd& dw, VectorXd& dl, bool refined) {
  program_.solve(rw_, c_, dw, dl);
  if (!refined) {
    return;
  }
  const double size = std::max(largest(rw_), largest(c_));
  double before = infinity;
  for (int round = 0; round < 3; ++round) {
    program_.multiply(dw, dl, residual_w_, residual_c_);
    residual_w_ = ((residual_w_ + rw_).array() + diagonal_.array() * dw.array()) * free_.array();
    residual_c_ += c_;
    const double left = std::max(largest(residual_w_), largest(residual_c_));
    if (!(left > 1e-10 * size) || !(left < 0.5 * before)) {
      return;
    }
    before = left;
    program_.solve(residual_w_, residual_c_, fix_w_, fix_c_);
    dw += fix_w_;
    dl += fix_c_;
  }
}

/// Where pivots cancel, as at a vertex that more bounds meet at than it takes, steps are held to
/// where they begin, the shorter the less is left to solve.
/// @param is_convex  Whether it is known that nothing else spoils a factorisation.
bool QuadraticMethod::factor(bool is_convex) {
  double added = 0.0;
  for (const double held : {0.0, 1e-10, 1e-8, 1e-6}) {
    if (held > 0.0 && !is_convex) {
      return false;
    }
    diagonal_.array() += held * size_ - added;
    added = held * size_;
    ++counts_.factorizations;
    if (program_.factor(diagonal_, D_, true)) {
      return true;
    }
  }
  return false;
}

/// What does not change from step to step.
bool QuadraticMethod::take_constants() {
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  pairs_ = 0;
  for (Index i = 0; i < w_.size(); ++i) {
    free_(i) = lower(i) == upper(i) ? 0.0 : 1.0;
    constexpr double none = 1e300;
    const bool low = free_(i) > 0.0 && lower(i) > -infinity;
    const bool high = free_(i) > 0.0 && upper(i) < infinity;
    has_low_(i) = low ? 1.0 : 0.0;
    has_high_(i) = high ? 1.0 : 0.0;
    low_(i) = low ? lower(i) : -none;
    high_(i) = high ? upper(i) : none;
    pairs_ += (low ? 1 : 0) + (high ? 1 : 0);
  }
  // The constant parts, where all variables are zero but for those that are fixed.
  fix_w_.setZero();
  if (!program_.values(fix_w_, f0_, c0_) ||
      !program_.derivatives(fix_w_, fix_c_.setZero(), 1.0, g_)) {
    return false;
  }
  size_ = std::max(1.0, largest(g_));
  fix_w_.setOnes();
  program_.multiply(fix_w_, fix_c_, residual_w_, residual_c_);
  has_curvature_ = largest(residual_w_) > 0.0;
  return true;
}

/// Mehrotra's start: the point of least norm on the equalities, moved into the bounds.
bool QuadraticMethod::begin(bool warm) {
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  VectorXd& w = rw_;
  for (Index i = 0; i < w_.size(); ++i) {
    w(i) = free_(i) == 0.0 ? lower(i) : 0.0;
  }
  if (warm) {
    w_ = middle_w_;
    lambda_ = middle_lambda_;
    zl_ = middle_zl_;
    zu_ = middle_zu_;
    for (Index i = 0; i < w_.size(); ++i) {
      w_(i) = free_(i) == 0.0 ? lower(i) : w_(i);
    }
  } else {
    w_ = w;
    lambda_.setZero();
    zl_.setZero();
    zu_.setZero();
    // A point inside the bounds to begin with, then the nearest to it on the equalities.
    for (Index i = 0; i < w_.size(); ++i) {
      const bool low = lower(i) > -infinity;
      const bool high = upper(i) < infinity;
      diagonal_(i) = free_(i) > 0.0 ? (low || high ? 1.0 : 1e-8) : 1.0;
      if (free_(i) > 0.0) {
        w_(i) = low && high ? 0.5 * (lower(i) + upper(i))
                : low       ? std::max(0.0, lower(i))
                : high      ? std::min(0.0, upper(i))
                            : 0.0;
      }
    }
    residuals();
    D_.setZero();
    ++counts_.factorizations;
    if (!program_.factor(diagonal_, D_, true)) {
      return false;
    }
    rw_ = ((hw_ + g_).array() * free_.array()).matrix();
    solve(dw_, dl_, true);
    w_ += dw_;
    lambda_ += dl_;
  }
  residuals();
  const double least = warm ? 1e-3 : 1.0;
  double largest_multiplier = 0.0;
  for (Index i = 0; i < w_.size(); ++i) {
    largest_multiplier = std::max(largest_multiplier, std::abs(rd_(i)));
  }
  const double multiplier =
      warm ? 1e-8 * size_ : std::max(1.0, std::min(largest_multiplier, 1e3 * size_));
  for (Index i = 0; i < w_.size(); ++i) {
    if (free_(i) == 0.0) {
      continue;
    }
    const bool low = lower(i) > -infinity;
    const bool high = upper(i) < infinity;
    const double margin = std::min(least, 0.25 * (upper(i) - lower(i)));
    if (low) {
      w_(i) = std::max(w_(i), lower(i) + margin);
      zl_(i) = std::max(zl_(i), multiplier);
    }
    if (high) {
      w_(i) = std::min(w_(i), upper(i) - margin);
      zu_(i) = std::max(zu_(i), multiplier);
    }
  }
  distances();
  return true;
}

bool QuadraticMethod::converged(double tolerance) {
  residuals();
  mu_ = pairs_ > 0 ? errors_.gap / pairs_ : 0.0;
  const auto n = static_cast<double>(w_.size() + 1);
  const auto m = static_cast<double>(lambda_.size() + 1);
  const double bounds = errors_.multipliers;
  const double dual_scale = std::max(100.0, (lambda_.lpNorm<1>() + bounds) / (m + n)) / 100.0;
  last_.infeasibility = largest(c_);
  last_.optimality = errors_.dual / dual_scale;
  last_.complementarity = errors_.most / (std::max(100.0, bounds / n) / 100.0);
  last_.barrier = mu_;
  // f = f₀ + gᵀw + ½ wᵀHw, of hw = Hw + Aᵀλ and hc = Aw.
  f_ = f0_ + errors_.slope + 0.5 * (errors_.moment - lambda_.dot(hc_));
  last_.cost = f_;
  // The last digits of inputs that the cost hardly feels are worth a step more.
  const double worst =
      std::max(std::max(last_.infeasibility, last_.optimality), 10.0 * last_.complementarity);
  return worst <= tolerance && std::isfinite(f_ + errors_.dual_sum + c_.sum());
}

SolveStatus QuadraticMethod::run(const SolverOptions& options, Watch watch, bool warm) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  counts_ = {};
  last_ = {};
  refined_ = false;
  if (!take_constants()) {
    return SolveStatus::no_progress;
  }
  if (warm && settle(options)) {
    (void)watch(last_);
    return SolveStatus::solved;
  }
  warm = warm && has_middle_;
  if (!begin(warm)) {
    return SolveStatus::no_progress;
  }
  double best = infinity;
  double expected_primal = infinity;
  double expected_dual = infinity;
  int since_best = 0;
  D_.setZero();
  double first_mu = 0.0;
  has_middle_ = false;
  const int before = last_.number;
  for (;; ++last_.number) {
    counts_.iterations = last_.number;
    if (converged(options.tolerance)) {
      return SolveStatus::solved;
    }
    first_mu = last_.number == before ? mu_ : first_mu;
    if (!has_middle_ && (mu_ <= middle * first_mu || warm)) {
      has_middle_ = true;
      middle_w_ = w_;
      middle_lambda_ = lambda_;
      middle_zl_ = zl_;
      middle_zu_ = zu_;
    }
    // A step along a line takes its share off the residuals; where it did not, the system was not
    // solved well, and is solved again for what it leaves from now on.
    refined_ = refined_ || largest(c_) > expected_primal + 0.05 * options.tolerance ||
               errors_.dual > expected_dual + 0.05 * options.tolerance;
    if (last_.number > 0 && watch(last_)) {
      return SolveStatus::stopped;
    }
    if (proves_infeasible()) {
      return SolveStatus::infeasible;
    }
    if (proves_unbounded()) {
      return SolveStatus::unbounded;
    }
    if (last_.number >= options.max_iterations) {
      return SolveStatus::iteration_limit;
    }
    if (std::chrono::duration<double>(Clock::now() - start).count() > options.time_limit) {
      return SolveStatus::time_limit;
    }
    const double worst =
        std::max(last_.infeasibility, std::max(last_.optimality, last_.complementarity));
    since_best = worst < 0.9 * best ? 0 : since_best + 1;
    best = std::min(best, worst);
    const bool is_good = worst <= std::max(1e3 * options.tolerance, 1e-8);
    if (since_best > 25 || !std::isfinite(worst)) {
      return is_good ? SolveStatus::acceptable : SolveStatus::no_progress;
    }

    const BoundArrays bounds = bound_arrays();
    FLYBALL_RUN_KERNEL(weigh_bounds, bounds, 1e-12 * size_);
    if (!factor(is_good || !has_curvature_)) {
      return is_good ? SolveStatus::acceptable : SolveStatus::no_progress;
    }
    // Predictor: straight for complementarity zero. Steps end where the first distance or
    // multiplier would vanish.
    solve(affine_w_, affine_l_, false);
    const BoundSteps straight = FLYBALL_RUN_KERNEL(predict_bounds, bounds);
    double primal = 1.0 / straight.primal;
    double dual = 1.0 / straight.dual;
    const double reached =
        pairs_ > 0 ? std::max(0.0, (1.0 - dual) * mu_ + ((primal - dual) * straight.along +
                                                         primal * dual * straight.across) /
                                                            pairs_)
                   : 0.0;
    const double ratio = mu_ > 0.0 ? reached / mu_ : 0.0;
    double centering = std::min(1.0, ratio * ratio * ratio);
    // After a short step: to the middle first.
    if (last_.number > 0 && last_.step < 0.1) {
      centering = std::max(centering, 0.5);
    }
    // Corrector: for the products of the predictor, and to the center.
    FLYBALL_RUN_KERNEL(aim_bounds, bounds, centering * mu_);
    solve(dw_, dl_, refined_);
    const double keep = std::max(0.995, 1.0 - mu_);
    const BoundSteps longest = FLYBALL_RUN_KERNEL(correct_bounds, bounds, keep);
    primal = keep / longest.primal;
    dual = keep / longest.dual;
    if (pairs_ == 0) {
      primal = dual = 1.0;
    }
    if (has_curvature_) {
      primal = dual = std::min(primal, dual);
    }
    expected_primal = (1.0 - primal) * largest(c_);
    expected_dual = has_curvature_ ? (1.0 - dual) * errors_.dual : infinity;
    FLYBALL_RUN_KERNEL(advance_bounds, bounds, primal, dual);
    lambda_ += dual * dl_;
    last_.step = primal;
    last_.dual_step = dual;
    last_.trials = 1;
  }
}

}  // namespace flyball::optimization::detail
