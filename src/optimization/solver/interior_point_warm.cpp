// Where the interior-point method begins after a change of the program's numbers.
#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "optimization/solver/interior_point.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;

}  // namespace

bool InteriorPoint::warm_start(double mu) {
  is_warm_ = level_count_ > 0;
  least_level_ = mu;
  return is_warm_;
}

/// Keeps the point that solves μ's barrier problem. Points of smaller barriers are of a run before.
void InteriorPoint::keep_level() {
  if (is_restoration_) {
    return;
  }
  while (level_count_ > 0 && levels_[static_cast<std::size_t>(level_count_ - 1)].mu <= mu_) {
    --level_count_;
  }
  if (level_count_ == most_levels) {  // the largest barrier's goes
    std::rotate(levels_.begin(), levels_.begin() + 1, levels_.end());
    --level_count_;
  }
  Level& level = levels_[static_cast<std::size_t>(level_count_++)];
  level.mu = mu_;
  level.w = w_;
  level.lambda = lambda_;
  level.zl = zl_;
  level.zu = zu_;
}

/// Goes to a level's point, moved within the bounds where these are others now.
void InteriorPoint::load_level(const Level& level) {
  w_ = level.w;
  lambda_ = level.lambda;
  zl_ = level.zl;
  zu_ = level.zu;
  mu_ = level.mu;
  const auto push = [&](double& distance, double& multiplier, double range) {
    const double centered = std::min(0.1 * range, std::min(1e-2, mu_ / multiplier));
    distance = distance > 1e-3 * centered ? distance : centered;
    multiplier = std::clamp(multiplier, 0.1 * mu_ / distance, 10.0 * mu_ / distance);
  };
  for (Index i = 0; i < w_.size(); ++i) {
    const double lower = program_.lower(i);
    const double upper = program_.upper(i);
    if (lower == upper) {
      w_(i) = lower;
      continue;
    }
    const double range = upper - lower;
    if (lower > -infinity) {
      double low = w_(i) - lower;
      push(low, zl_(i), range);
      w_(i) = low > w_(i) - lower ? lower + low : w_(i);
    }
    if (upper < infinity) {
      double high = upper - w_(i);
      push(high, zu_(i), range);
      w_(i) = high > upper - w_(i) ? upper - high : w_(i);
    }
  }
  distances();
}

bool InteriorPoint::evaluate() {
  if (!program_.values(w_, f_, c_) || !program_.derivatives(w_, lambda_, 1.0, gradient_)) {
    return false;
  }
  dual_residual();
  return true;
}

/// The last end where it holds still; else the smallest barrier that is not less than the change's
/// violation there: what the bounds take of a step is then little.
bool InteriorPoint::choose_level(const SolverOptions& options) {
  int at = level_count_ - 1;
  load_level(levels_[static_cast<std::size_t>(at)]);
  bool is_finite = evaluate();
  const Errors error = errors(0.0);
  if (!is_finite || error.largest() > options.tolerance) {
    const double least = std::max(least_level_, 0.3 * error.primal);
    while (at > 0 && levels_[static_cast<std::size_t>(at)].mu < least) {
      --at;
    }
    load_level(levels_[static_cast<std::size_t>(at)]);
    is_finite = evaluate();
  }
  level_at_ = at;
  derivatives_fresh_ = is_finite;
  return is_finite;
}

/// Where bounds block the way from a point of the last run's path, it is farther from the changed
/// problem's path than its barrier allows: the point of one 25 times as large is nearer to that.
/// @return false where there is none.
bool InteriorPoint::retreat() {
  level_at_ = std::min(level_at_, level_count_) - 2;
  if (level_at_ < 0) {
    return false;
  }
  load_level(levels_[static_cast<std::size_t>(level_at_)]);
  return evaluate();
}

}  // namespace flyball::optimization::detail
