// The line search of the interior-point method.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/constants.hpp"
#include "optimization/solver/interior_point.hpp"

namespace flyball::optimization::detail {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

}  // namespace

double InteriorPoint::primal_step(const VectorXd& dw, double tau) const {
  double alpha = 1.0;
  for (Index i = 0; i < dw.size(); ++i) {
    if (dw(i) < 0.0) {
      if (-dw(i) * alpha > tau * sl_(i)) {
        alpha = -tau * sl_(i) / dw(i);
      }
    } else if (dw(i) * alpha > tau * su_(i)) {
      alpha = tau * su_(i) / dw(i);
    }
  }
  return alpha;
}

double InteriorPoint::dual_step(double tau) const {
  double alpha = 1.0;
  for (Index i = 0; i < w_.size(); ++i) {
    if (-dzl_(i) * alpha > tau * zl_(i) && zl_(i) > 0.0) {
      alpha = -tau * zl_(i) / dzl_(i);
    }
    if (-dzu_(i) * alpha > tau * zu_(i) && zu_(i) > 0.0) {
      alpha = -tau * zu_(i) / dzu_(i);
    }
  }
  return alpha;
}

/// Of the point at hand, where a run begins.
void InteriorPoint::begin_filter() {
  const double theta = c_.lpNorm<1>();
  theta_max_ = 1e4 * std::max(1.0, theta);
  theta_min_ = 1e-4 * std::max(1.0, theta);
  first_primal_ = c_.size() > 0 ? c_.lpNorm<Eigen::Infinity>() : 0.0;
  first_mu_ = mu_;
  reset_filter();
}

void InteriorPoint::reset_filter() {
  filter_.clear();
  filter_.add(theta_max_, -infinity);
}

void InteriorPoint::bound_multipliers() {
  for (Index i = 0; i < w_.size(); ++i) {
    if (zl_(i) > 0.0) {
      zl_(i) = std::clamp(zl_(i), mu_ / sl_(i) / 1e10, mu_ / sl_(i) * 1e10);
    }
    if (zu_(i) > 0.0) {
      zu_(i) = std::clamp(zu_(i), mu_ / su_(i) / 1e10, mu_ / su_(i) * 1e10);
    }
  }
}

/// Takes trial_ as the next point.
void InteriorPoint::accept(double alpha, double alpha_dual) {
  w_.swap(trial_);
  c_.swap(trial_c_);
  f_ = trial_f_;
  lambda_ += alpha * dl_;
  zl_ += alpha_dual * dzl_;
  zu_ += alpha_dual * dzu_;
  zl_ = (program_.lower.array() > -infinity).select(zl_, 0.0);
  zu_ = (program_.upper.array() < infinity).select(zu_, 0.0);
  distances();
  bound_multipliers();
  last_.step = alpha;
  last_.dual_step = alpha_dual;
}

bool InteriorPoint::search() {
  const double theta = c_.lpNorm<1>();
  const double phi = barrier(w_, f_);
  const double slope = rw_.dot(dw_) - [&] {
    // ∇φ = rw - Aᵀλ
    program_.transpose_multiply(lambda_, residual_w_);
    return (residual_w_.array() * free_.array()).matrix().dot(dw_);
  }();
  const double alpha_max = primal_step(dw_, tau_);
  const double alpha_dual = dual_step(tau_);
  double alpha_min = 1e-5;
  if (slope < 0.0) {
    alpha_min = std::min(alpha_min, 1e-5 * theta / -slope);
    if (theta <= theta_min_) {
      alpha_min = std::min(alpha_min, std::pow(theta, 1.1) / std::pow(-slope, 2.3));
    }
  }
  alpha_min = std::max(0.05 * alpha_min, 1e-12);
  last_.trials = 0;
  const auto try_point = [&](const VectorXd& dw, double alpha, double& t, double& p) {
    trial_ = w_ + alpha * dw;
    ++counts_.evaluations;
    ++last_.trials;
    if (!program_.values(trial_, trial_f_, trial_c_)) {
      return false;
    }
    t = trial_c_.lpNorm<1>();
    p = barrier(trial_, trial_f_);
    return std::isfinite(t) && std::isfinite(p);
  };
  const auto acceptable = [&](double t, double p, double alpha) {
    if (!filter_.accepts(t, p)) {
      return false;
    }
    const bool switching = slope < 0.0 && alpha * std::pow(-slope, 2.3) > std::pow(theta, 1.1);
    const double rounding = 10.0 * std::numeric_limits<double>::epsilon() * std::abs(phi);
    if (theta <= theta_min_ && switching) {
      if (p - phi - rounding <= 1e-8 * alpha * slope) {
        return true;
      }
      return false;
    }
    return t <= (1.0 - 1e-5) * theta || p - rounding <= phi - 1e-5 * theta;
  };
  const auto keep_out = [&](double p, double alpha) {
    const bool switching = slope < 0.0 && alpha * std::pow(-slope, 2.3) > std::pow(theta, 1.1);
    if (!switching || !(p - phi <= 1e-8 * alpha * slope)) {
      filter_.add((1.0 - 1e-5) * theta, phi - 1e-5 * theta);
    }
  };
  double alpha = alpha_max;
  is_cut_ = false;
  for (int round = 0; alpha > alpha_min; ++round, alpha *= 0.5) {
    double t = 0.0;
    double p = 0.0;
    const bool defined = try_point(dw_, alpha, t, p);
    if (defined && acceptable(t, p, alpha)) {
      keep_out(p, alpha);
      accept(alpha, alpha_dual);
      is_cut_ = round > 1;
      return true;
    }
    if (round > 0) {
      continue;
    }
    // A full step that lowers the error of the first-order conditions is as good.
    if (defined && t < theta_max_) {
      const double before = errors(mu_).largest();
      step_l_ = lambda_;
      fix_w_ = w_;
      fix_zl_ = zl_;
      fix_zu_ = zu_;
      const double old_f = f_;
      fix_c_ = c_;
      accept(alpha, alpha_dual);
      if (program_.derivatives(w_, lambda_, 1.0, gradient_)) {
        dual_residual();
        if (errors(mu_).largest() <= 0.9999 * before) {
          derivatives_fresh_ = true;
          reset_filter();
          return true;
        }
      }
      w_ = fix_w_;
      c_ = fix_c_;
      f_ = old_f;
      lambda_ = step_l_;
      zl_ = fix_zl_;
      zu_ = fix_zu_;
      distances();
      (void)program_.derivatives(w_, lambda_, 1.0, gradient_);
      dual_residual();
      // The factorisation's matrix stands; its blocks are those of the point again.
    }
    if (!(t >= theta) || !defined) {
      continue;
    }
    // Second-order corrections.
    corrected_c_ = c_;
    double before = theta;
    double t_soc = t;
    double alpha_soc = alpha;
    for (int correction = 0; correction < 4; ++correction) {
      corrected_c_ = alpha_soc * corrected_c_ + trial_c_;
      refine(step_w_, step_l_, rw_, corrected_c_);
      alpha_soc = primal_step(step_w_, tau_);
      double p_soc = 0.0;
      if (!try_point(step_w_, alpha_soc, t_soc, p_soc)) {
        break;
      }
      if (acceptable(t_soc, p_soc, alpha)) {
        keep_out(p_soc, alpha);
        ++counts_.corrections;
        dw_ = step_w_;
        dl_ = step_l_;
        dzl_ = ((mu_ - zl_.array() * dw_.array()) / sl_.array() - zl_.array()).matrix();
        dzu_ = ((mu_ + zu_.array() * dw_.array()) / su_.array() - zu_.array()).matrix();
        accept(alpha_soc, dual_step(tau_));
        return true;
      }
      if (t_soc > 0.99 * before) {
        break;
      }
      before = t_soc;
    }
  }
  return false;
}

}  // namespace flyball::optimization::detail
