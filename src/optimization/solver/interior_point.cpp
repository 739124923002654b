#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/solver/interior_point.hpp"
#include "optimization/solver/restoration.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

}  // namespace

struct InteriorPoint::Restoration {
  explicit Restoration(Program& program) : restoring(program), solver(restoring) {
    solver.is_restoration_ = true;
  }
  RestorationProgram restoring;
  InteriorPoint solver;
};

double InteriorPoint::Errors::largest() const noexcept {
  const double most = std::max(dual, std::max(primal, complementarity));
  return std::isfinite(dual) && std::isfinite(primal) && std::isfinite(complementarity) ? most
                                                                                        : infinity;
}

InteriorPoint::InteriorPoint(Program& program) : program_(program) {
  const Index n = program.variables();
  const Index m = program.constraints();
  for (VectorXd* v :
       {&w_, &zl_, &zu_, &sl_, &su_, &gradient_, &rd_, &rw_, &dw_, &dzl_, &dzu_, &diagonal_,
        &residual_w_, &fix_w_, &fix_zl_, &fix_zu_, &trial_, &step_w_, &free_}) {
    v->setZero(n);
  }
  for (VectorXd* v :
       {&lambda_, &c_, &dl_, &D_, &residual_c_, &fix_c_, &trial_c_, &corrected_c_, &step_l_}) {
    v->setZero(m);
  }
  levels_.resize(most_levels);
  for (Level& level : levels_) {  // pages that no run writes to are none
    level.w.resize(n);
    level.zl.resize(n);
    level.zu.resize(n);
    level.lambda.resize(m);
  }
}

InteriorPoint::~InteriorPoint() = default;

void InteriorPoint::start(const VectorXd& w) {
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  for (Index i = 0; i < w.size(); ++i) {
    double x = w(i);
    if (lower(i) == upper(i)) {
      w_(i) = lower(i);
      free_(i) = 0.0;
      continue;
    }
    free_(i) = 1.0;
    const double range = upper(i) - lower(i);
    if (lower(i) > -infinity) {
      x = std::max(x, lower(i) + std::min(1e-2 * std::max(1.0, std::abs(lower(i))), 1e-2 * range));
    }
    if (upper(i) < infinity) {
      x = std::min(x, upper(i) - std::min(1e-2 * std::max(1.0, std::abs(upper(i))), 1e-2 * range));
    }
    w_(i) = x;
  }
  lambda_.setZero();
  mu_ = 0.0;
  is_warm_ = false;
}

void InteriorPoint::distances() {
  sl_ = (free_.array() > 0.0).select((w_ - program_.lower).array(), infinity).matrix();
  su_ = (free_.array() > 0.0).select((program_.upper - w_).array(), infinity).matrix();
}

double InteriorPoint::barrier(const VectorXd& w, double f) const {
  double sum = 0.0;
  double product = 1.0;
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  for (Index i = 0; i < w.size(); ++i) {
    if (free_(i) == 0.0) {
      continue;
    }
    const double low = w(i) - lower(i);
    const double high = upper(i) - w(i);
    if (low < infinity) {
      product *= low;
    }
    if (high < infinity) {
      product *= high;
    }
    if (!(product > 1e-120 && product < 1e120)) {
      sum += std::log(product);
      product = 1.0;
    }
  }
  return f - mu_ * (sum + std::log(product));
}

void InteriorPoint::dual_residual() {
  program_.transpose_multiply(lambda_, rd_);
  rd_ = ((rd_ + gradient_ - zl_ + zu_).array() * free_.array()).matrix();
}

InteriorPoint::Errors InteriorPoint::errors(double mu) const {
  Errors e;
  const auto n = static_cast<double>(w_.size() + 1);
  const auto m = static_cast<double>(lambda_.size() + 1);
  const double bound_sum = zl_.lpNorm<1>() + zu_.lpNorm<1>();
  const double dual_scale = std::max(100.0, (lambda_.lpNorm<1>() + bound_sum) / (m + n)) / 100.0;
  const double bound_scale = std::max(100.0, bound_sum / n) / 100.0;
  e.dual = rd_.lpNorm<Eigen::Infinity>() / dual_scale;
  e.primal = c_.size() > 0 ? c_.lpNorm<Eigen::Infinity>() : 0.0;
  double gap = 0.0;
  for (Index i = 0; i < w_.size(); ++i) {
    const double low = zl_(i) > 0.0 ? std::abs(sl_(i) * zl_(i) - mu) : 0.0;
    const double high = zu_(i) > 0.0 ? std::abs(su_(i) * zu_(i) - mu) : 0.0;
    gap = std::max(gap, std::max(low, high));
  }
  e.complementarity = gap / bound_scale;
  if (!std::isfinite(rd_.sum()) || !std::isfinite(c_.sum())) {
    e.dual = infinity;
  }
  return e;
}

/// Solves the factorised system for (-rw, -rc), and again for what is left.
void InteriorPoint::refine(VectorXd& dw, VectorXd& dl, const VectorXd& rw, const VectorXd& rc) {
  program_.solve(rw, rc, dw, dl);
  const double size =
      std::max(rw.lpNorm<Eigen::Infinity>(), rc.size() > 0 ? rc.lpNorm<Eigen::Infinity>() : 0.0);
  double before = infinity;
  for (int round = 0; round < 4; ++round) {
    program_.multiply(dw, dl, residual_w_, residual_c_);
    residual_w_ += (diagonal_.array() * dw.array()).matrix() + rw;
    residual_w_.array() *= free_.array();
    residual_c_ += rc - (D_.array() * dl.array()).matrix();
    const double left =
        std::max(residual_w_.lpNorm<Eigen::Infinity>(),
                 residual_c_.size() > 0 ? residual_c_.lpNorm<Eigen::Infinity>() : 0.0);
    if (!(left > 1e-10 * size) || !(left < 0.5 * before)) {
      break;
    }
    before = left;
    program_.solve(residual_w_, residual_c_, fix_w_, fix_c_);
    dw += fix_w_;
    dl += fix_c_;
  }
}

/// The Newton step, with as much added to the Hessian as it takes for a descent direction.
bool InteriorPoint::direction() {
  const auto sigma = (zl_.array() / sl_.array() + zu_.array() / su_.array()) * free_.array();
  diagonal_ = sigma.matrix();
  rw_ = ((rd_ + zl_ - zu_).array() - mu_ / sl_.array() + mu_ / su_.array()).matrix();
  rw_.array() *= free_.array();
  D_.setZero();
  diagonal_.array() += damping_;
  regularization_ = damping_;
  ++counts_.factorizations;
  bool good = program_.factor(diagonal_, D_, true);
  if (!good) {
    double added = last_regularization_ > 0.0 ? std::max(1e-20, last_regularization_ / 3.0) : 1e-4;
    added = std::max(added, 2.0 * damping_);
    while (!good) {
      if (added > 1e40) {
        return false;
      }
      diagonal_.array() += added - regularization_;
      regularization_ = added;
      ++counts_.factorizations;
      good = program_.factor(diagonal_, D_, true);
      if (!good) {
        added *= last_regularization_ > 0.0 ? regularization_growth_ : 100.0;
      }
    }
    last_regularization_ = regularization_;
  }
  refine(dw_, dl_, rw_, c_);
  dzl_ = ((mu_ - zl_.array() * dw_.array()) / sl_.array() - zl_.array()).matrix();
  dzu_ = ((mu_ + zu_.array() * dw_.array()) / su_.array() - zu_.array()).matrix();
  return std::isfinite(dw_.sum()) && std::isfinite(dl_.sum());
}

/// Where the line search cuts steps short time and again, the Hessian says little of the way that
/// they take: a larger one holds them where the linearised constraints hold. It is as large as it
/// takes for a whole step to leave a part of the violation that it found, as of a trust region,
/// and smaller again where the gradient is farther from zero than the constraints.
/// @param theta  The violation before the step.
void InteriorPoint::damp(double theta, const Errors& error) {
  constexpr int patience = 10;  // the first time
  constexpr double most = 1e-2;
  constexpr double first = 1e-6;
  cut_steps_ = is_cut_ ? cut_steps_ + 1 : 0;
  if (cut_steps_ >= (was_damped_ ? 1 : patience)) {
    damping_ = std::min(most, std::max(4.0 * damping_, first));
    was_damped_ = true;
  } else if (damping_ > 0.0 && !is_cut_) {
    const double left = c_.lpNorm<1>() / theta;
    if (error.dual > error.primal || left < 0.1) {
      damping_ = damping_ > 1e-3 * first ? 0.5 * damping_ : 0.0;
    } else if (left > 0.5) {
      damping_ = std::min(most, 2.0 * damping_);
    }
  }
}

/// @return solved where the filter's method can go on from the point that was found; infeasible
/// where the violation is at a minimum; otherwise why it ended.
SolveStatus InteriorPoint::restore(const SolverOptions& options, double seconds_left, Watch watch) {
  if (is_restoration_) {
    return SolveStatus::no_progress;
  }
  if (!restoration_) {
    restoration_ = std::make_unique<Restoration>(program_);
  }
  const double theta = c_.lpNorm<1>();
  if (!(theta > 0.1 * options.tolerance)) {
    return SolveStatus::no_progress;
  }
  ++counts_.restorations;
  // Where the filter's method leaves again and again what restorations reach, a violation cannot
  // fall to zero nearby, or only by going all the way: the next ones end at its minimum.
  constexpr int patience = 10;
  const bool to_the_end = counts_.restorations > patience;
  filter_.add((1.0 - 1e-5) * theta, barrier(w_, f_) - 1e-5 * theta);
  RestorationProgram& restoring = restoration_->restoring;
  InteriorPoint& solver = restoration_->solver;
  const double mu = std::max(mu_, c_.lpNorm<Eigen::Infinity>());
  restoring.set_reference(w_, mu);
  restoring.begin(w_, c_, mu, zl_, zu_, solver);
  bool enough = false;
  bool stopped = false;
  const int before = last_.number;
  const auto check = [&](const Iteration& iteration) {
    last_.number = before + iteration.number;
    Iteration shown = iteration;
    shown.number = last_.number;
    shown.restoration = true;
    stopped = watch(shown);
    if (stopped) {
      return true;
    }
    trial_ = solver.w().head(w_.size());
    if (!program_.values(trial_, trial_f_, trial_c_)) {
      return false;
    }
    const double t = trial_c_.lpNorm<1>();
    enough = t <= 0.9 * theta && filter_.accepts(t, barrier(trial_, trial_f_));
    return enough && !to_the_end;
  };
  SolverOptions inner = options;
  inner.first_barrier = mu;
  inner.max_iterations = std::max(0, options.max_iterations - before);
  inner.time_limit = seconds_left;
  const SolveStatus status = solver.run(inner, check);
  counts_.factorizations += solver.counts().factorizations;
  counts_.evaluations += solver.counts().evaluations;
  trial_ = solver.w().head(w_.size());
  if (!program_.values(trial_, trial_f_, trial_c_)) {
    return SolveStatus::not_finite;
  }
  if (to_the_end && status == SolveStatus::solved) {
    enough = !(trial_c_.lpNorm<Eigen::Infinity>() > 1e-6);
    reset_filter();
  } else if (!enough && trial_c_.lpNorm<1>() <= 0.5 * theta) {
    enough = true;  // much is won, though not by the filter's measure
    reset_filter();
  }
  w_ = trial_;
  c_ = trial_c_;
  f_ = trial_f_;
  distances();
  zl_ = (zl_.array() > 0.0).select((mu_ / sl_.array()).matrix(), 0.0);
  zu_ = (zu_.array() > 0.0).select((mu_ / su_.array()).matrix(), 0.0);
  lambda_.setZero();
  if (stopped || status == SolveStatus::iteration_limit || status == SolveStatus::time_limit) {
    return stopped ? SolveStatus::stopped : status;
  }
  return enough ? SolveStatus::solved : SolveStatus::infeasible;
}

SolveStatus InteriorPoint::run(const SolverOptions& options, Watch watch) {
  regularization_growth_ = std::max(1.5, options.regularization_growth);
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  counts_ = {};
  last_ = {};
  last_regularization_ = 0.0;
  damping_ = 0.0;
  cut_steps_ = 0;
  was_damped_ = false;
  derivatives_fresh_ = false;
  bool warm = is_warm_;
  if (is_warm_) {
    is_warm_ = false;
    if (!choose_level(options)) {
      return SolveStatus::no_progress;
    }
  } else {
    level_count_ = 0;
  }
  distances();
  if (mu_ == 0.0) {
    mu_ = options.first_barrier > 0.0 ? options.first_barrier : 0.1;
    for (Index i = 0; i < w_.size(); ++i) {
      zl_(i) = free_(i) > 0.0 && lower(i) > -infinity ? mu_ / sl_(i) : 0.0;
      zu_(i) = free_(i) > 0.0 && upper(i) < infinity ? mu_ / su_(i) : 0.0;
    }
  }
  if (!program_.values(w_, f_, c_)) {
    return SolveStatus::not_finite;
  }
  begin_filter();
  const double mu_min = options.tolerance / 11.0;
  int blocked = 0;  // steps in a row that were short
  double theta_before = -1.0;
  for (int k = 0, since = 0;; ++k, ++since) {
    blocked = k > 0 && last_.step < 0.1 ? blocked + 1 : 0;
    if (warm && ((since == 1 && blocked > 0) || blocked >= 3)) {
      warm = retreat();
      if (warm) {
        derivatives_fresh_ = true;
        begin_filter();
        blocked = 0;
        since = 0;
      }
    }
    if (!derivatives_fresh_ && !program_.derivatives(w_, lambda_, 1.0, gradient_)) {
      return SolveStatus::not_finite;
    }
    derivatives_fresh_ = false;
    dual_residual();
    const Errors error = errors(0.0);
    // Short steps are also how some motions find a good valley: those that have lasted are damped,
    // and those of problems without equations, where nothing is restored.
    constexpr double lasted = 0.6;
    if (theta_before >= 0.0 && (c_.size() == 0 || last_.number > lasted * options.max_iterations)) {
      damp(theta_before, error);
    }
    theta_before = -1.0;
    last_.cost = f_;
    last_.infeasibility = error.primal;
    last_.optimality = error.dual;
    last_.complementarity = error.complementarity;
    last_.barrier = mu_;
    last_.regularization = regularization_;
    counts_.iterations = last_.number;
    if (error.largest() <= options.tolerance) {
      keep_level();
      return SolveStatus::solved;
    }
    if (f_ < -1e20 && error.primal < 1e-4) {
      return SolveStatus::unbounded;
    }
    if (k > 0 && watch(last_)) {
      return SolveStatus::stopped;
    }
    if (last_.number >= options.max_iterations) {
      return SolveStatus::iteration_limit;
    }
    if (std::chrono::duration<double>(Clock::now() - begin).count() > options.time_limit) {
      return SolveStatus::time_limit;
    }
    // The barrier falls when its problem is solved well enough.
    for (bool lowered = true; lowered && mu_ > mu_min;) {
      const Errors now = errors(mu_);
      const bool small = now.largest() <= 10 * mu_;
      const bool feasible = now.primal <= std::max(0.1 * first_primal_ * std::sqrt(mu_ / first_mu_),
                                                   0.1 * options.tolerance);
      lowered = small && feasible;
      if (lowered) {
        keep_level();
        mu_ = std::max(mu_min, std::min(0.2 * mu_, std::pow(mu_, 1.4)));
        reset_filter();
      }
    }
    tau_ = std::max(0.99, 1.0 - mu_);
    ++last_.number;
    const bool has_direction = direction();
    const double theta = c_.lpNorm<1>();
    if (has_direction && search()) {
      theta_before = theta;
      continue;
    }
    damping_ = 0.0;
    cut_steps_ = 0;
    if (!std::isfinite(gradient_.sum())) {
      return SolveStatus::not_finite;
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    const SolveStatus restored =
        restore(options, std::max(0.0, options.time_limit - seconds), watch);
    if (restored == SolveStatus::solved) {
      continue;
    }
    counts_.iterations = last_.number;
    if (error.largest() <= 1e3 * options.tolerance) {
      return SolveStatus::acceptable;
    }
    return restored == SolveStatus::infeasible && !(error.primal > 1e-6) ? SolveStatus::no_progress
                                                                         : restored;
  }
}

}  // namespace flyball::optimization::detail
