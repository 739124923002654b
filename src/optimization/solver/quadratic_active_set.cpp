// Quadratic programs from the active bounds of their last solution.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "optimization/solver/quadratic_method.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

double largest_magnitude(const VectorXd& v) {
  return v.size() > 0 ? v.lpNorm<Eigen::Infinity>() : 0.0;
}

}  // namespace

/// From the active bounds of the last solution: equality-constrained programs, each of one
/// factorisation, until no bound is crossed and no multiplier has the wrong sign.
/// Source: Bergounioux, Ito, Kunisch (1999).
bool QuadraticMethod::settle(const SolverOptions& options) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  // Farther away an interior point goes faster: where many bounds change, or one after the other,
  // unless what variables are kept at their bounds along the stages shows which. What halves from
  // round to round ends soon.
  constexpr int most_rounds = 4;
  constexpr int most_rolls = 4;
  constexpr int most_changes = 8;
  int rolls = 0;
  int before = static_cast<int>(w_.size());  // changes of the last round
  bool halved = false;
  const VectorXd& lower = program_.lower;
  const VectorXd& upper = program_.upper;
  if (!has_curvature_) {
    return false;
  }
  VectorXd& side = low_target_;  // -1: at its lower bound, 1: at its upper, 0: inactive
  for (Index i = 0; i < w_.size(); ++i) {
    const double low = w_(i) - lower(i);
    const double high = upper(i) - w_(i);
    side(i) = free_(i) == 0.0 ? 0.0 : zl_(i) > low ? -1.0 : zu_(i) > high ? 1.0 : 0.0;
    w_(i) = free_(i) == 0.0 || side(i) < 0.0 ? lower(i) : side(i) > 0.0 ? upper(i) : w_(i);
  }
  zl_.setZero();
  zu_.setZero();
  D_.setZero();
  const double held = 1e12 * size_;
  for (int round = 0; (round < most_rounds + rolls || halved) && round < options.max_iterations;
       ++round) {
    for (Index i = 0; i < w_.size(); ++i) {
      diagonal_(i) = side(i) != 0.0 ? held : 1e-12 * size_;
    }
    if (std::chrono::duration<double>(Clock::now() - start).count() > options.time_limit) {
      return false;
    }
    ++counts_.factorizations;
    ++last_.number;
    counts_.iterations = last_.number;
    if (!program_.factor(diagonal_, D_, true)) {
      return false;
    }
    bool rolled = false;
    for (int correction = 0; correction < 4 && !rolled; ++correction) {
      residuals();
      for (Index i = 0; i < w_.size(); ++i) {
        rw_(i) = side(i) != 0.0 ? 0.0 : rd_(i);
      }
      if (std::max(largest_magnitude(rw_), largest_magnitude(c_)) <= 1e-2 * options.tolerance) {
        break;
      }
      program_.solve(rw_, c_, dw_, dl_);
      if (correction == 0 && rolls < most_rolls && program_.roll(w_, side, affine_w_)) {
        rolled = true;
        ++rolls;
        w_ += affine_w_;
        break;
      }
      w_ += dw_;
      lambda_ += dl_;
    }
    if (rolled) {  // the multipliers of the bounds that are new are found with them
      for (Index i = 0; i < w_.size(); ++i) {
        w_(i) = side(i) < 0.0 ? lower(i) : side(i) > 0.0 ? upper(i) : w_(i);
      }
      continue;
    }
    residuals();
    if (rolls > 0 && largest_magnitude(rd_) > 1e4 * size_) {
      return false;  // no point keeps all that was kept, as where a last state is given
    }
    int changes = 0;
    for (Index i = 0; i < w_.size(); ++i) {
      if (free_(i) == 0.0) {
        continue;
      }
      double wanted = side(i);
      if (wanted == 0.0) {
        wanted = w_(i) < lower(i) - 1e-2 * options.tolerance   ? -1.0
                 : w_(i) > upper(i) + 1e-2 * options.tolerance ? 1.0
                                                               : 0.0;
      } else if (wanted * rd_(i) > 1e-2 * options.tolerance) {
        wanted = 0.0;
      }
      if (wanted != side(i)) {
        side(i) = wanted;
        ++changes;
      }
      w_(i) = wanted < 0.0 ? lower(i) : wanted > 0.0 ? upper(i) : w_(i);
    }
    if (changes > most_changes && (rolls == 0 || 2 * changes > before)) {
      return false;
    }
    halved = 2 * changes <= before;
    before = changes;
    if (changes == 0) {
      for (Index i = 0; i < w_.size(); ++i) {
        zl_(i) = side(i) < 0.0 ? std::max(0.0, rd_(i)) : 0.0;
        zu_(i) = side(i) > 0.0 ? std::max(0.0, -rd_(i)) : 0.0;
      }
      distances();
      return converged(options.tolerance);
    }
  }
  return false;
}

}  // namespace flyball::optimization::detail
