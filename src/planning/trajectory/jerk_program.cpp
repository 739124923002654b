#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/trajectory/jerk_program.hpp"

namespace flyball::detail {

namespace {

constexpr int most_iterations = 80;
/// Rows are broken by no more than this, of what they allow, and their rounding.
constexpr double kept = 3e-11;
constexpr double rounding = 1e-15;
/// How much of the way to where a row ends a step goes.
constexpr double share_of_way = 0.99;

/// Gauss and Legendre's rule of five points on [0, 1].
constexpr double nodes[5] = {0.046910077030668004, 0.23076534494715845, 0.5, 0.76923465505284155,
                             0.953089922969332};
constexpr double weights[5] = {0.11846344252809454, 0.23931433524968324, 0.28444444444444444,
                               0.23931433524968324, 0.11846344252809454};

}  // namespace

void JerkProgram::clear_rows() noexcept {
  begins_.clear();
  alpha_.clear();
  beta_.clear();
  gamma_.clear();
  right_.clear();
}

void JerkProgram::add(double alpha, double beta, double gamma, double right) {
  alpha_.push_back(alpha);
  beta_.push_back(beta);
  gamma_.push_back(gamma);
  right_.push_back(right);
}

Bezier2 JerkProgram::points(std::size_t i) const noexcept {
  const Cell& c = cells[i];
  const double before = c.l != 0.0 ? m[i - 1] : 0.0;
  const double after = c.h != 0.0 ? m[i + 1] : 0.0;
  return {c.z_0 + c.l * before + c.f * m[i], m[i], c.z_2 + c.g * m[i] + c.h * after};
}

/// The time and, in b, its slope -½ ∫ B x^{-3/2} and its curvature ¾ ∫ B Bᵀ x^{-5/2}.
double JerkProgram::differentiate() {
  double time = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Bezier2 b = points(i);
    Bezier2 slope{};
    Symmetric curvature{};
    for (std::size_t q = 0; q < 5; ++q) {
      const double t = nodes[q];
      const double s = 1.0 - t;
      const double B[3] = {s * s, 2.0 * s * t, t * t};
      const double x = std::max(B[0] * b[0] + B[1] * b[1] + B[2] * b[2], 1e-300);
      const double part = weights[q] * cells[i].width / std::sqrt(x);
      time += part;
      const double first = -0.5 * part / x;
      const double second = 0.75 * part / (x * x);
      for (std::size_t k = 0; k < 3; ++k) {
        slope[k] += first * B[k];
      }
      curvature[0] += second * B[0] * B[0];
      curvature[1] += second * B[0] * B[1];
      curvature[2] += second * B[0] * B[2];
      curvature[3] += second * B[1] * B[1];
      curvature[4] += second * B[1] * B[2];
      curvature[5] += second * B[2] * B[2];
    }
    slope_[i] = slope;
    curvature_[i] = curvature;
    const double rest = cells[i].rest / std::sqrt(m[i]);
    time += rest;
    rest_slope_[i] = -0.5 * rest / m[i];
    rest_curvature_[i] = 0.75 * rest / (m[i] * m[i]);
  }
  return time;
}

/// The normal matrix: the time's curvature + Σ λ/s a aᵀ.
void JerkProgram::assemble() {
  const std::size_t n = cells.size();
  diagonal_.assign(n, 0.0);
  next_.assign(n, 0.0);
  after_.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    Symmetric H = curvature_[i];
    for (std::size_t r = begins_[i]; r < end_of(i); ++r) {
      const double weight = dual_[r] / slack_[r];
      const double a = weight * alpha_[r];
      const double b = weight * beta_[r];
      H[0] += a * alpha_[r];
      H[1] += a * beta_[r];
      H[2] += a * gamma_[r];
      H[3] += b * beta_[r];
      H[4] += b * gamma_[r];
      H[5] += weight * gamma_[r] * gamma_[r];
    }
    // In (m_{i-1}, m_i, m_{i+1}): columns (l, 0, 0), (f, 1, g), (0, 0, h).
    const Cell& c = cells[i];
    const double h0 = H[0] * c.f + H[1] + H[2] * c.g;
    const double h1 = H[1] * c.f + H[3] + H[4] * c.g;
    const double h2 = H[2] * c.f + H[4] + H[5] * c.g;
    diagonal_[i] += c.f * h0 + h1 + c.g * h2 + rest_curvature_[i];
    if (c.l != 0.0) {
      diagonal_[i - 1] += c.l * c.l * H[0];
      next_[i - 1] += c.l * h0;
    }
    if (c.h != 0.0) {
      diagonal_[i + 1] += c.h * c.h * H[5];
      next_[i] += c.h * h2;
    }
    if (c.l != 0.0 && c.h != 0.0) {
      after_[i - 1] += c.l * c.h * H[2];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (cells[i].fixed) {
      diagonal_[i] = 1.0;
      next_[i] = after_[i] = 0.0;
      if (i > 0) {
        next_[i - 1] = 0.0;
      }
      if (i > 1) {
        after_[i - 2] = 0.0;
      }
    }
  }
}

/// L D Lᵀ in place.
bool JerkProgram::factor() {
  const std::size_t n = cells.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double d = diagonal_[i];
    if (!(d > 0.0) || !std::isfinite(d)) {
      return false;
    }
    const double first = next_[i] / d;
    const double second = after_[i] / d;
    if (i + 1 < n) {
      diagonal_[i + 1] -= first * next_[i];
      next_[i + 1] -= first * after_[i];
    }
    if (i + 2 < n) {
      diagonal_[i + 2] -= second * after_[i];
    }
    next_[i] = first;
    after_[i] = second;
  }
  return true;
}

void JerkProgram::direct() {
  const std::size_t n = cells.size();
  step_.assign(n, 0.0);
  // -∇ - Aᵀ (target/s + λ/s · off), target being what s λ is to be.
  for (std::size_t i = 0; i < n; ++i) {
    const Cell& c = cells[i];
    Bezier2 g = slope_[i];
    for (std::size_t r = begins_[i]; r < end_of(i); ++r) {
      const double weight = (target_[r] + dual_[r] * off_[r]) / slack_[r];
      g[0] += weight * alpha_[r];
      g[1] += weight * beta_[r];
      g[2] += weight * gamma_[r];
    }
    step_[i] -= c.f * g[0] + g[1] + c.g * g[2] + rest_slope_[i];
    if (c.l != 0.0) {
      step_[i - 1] -= c.l * g[0];
    }
    if (c.h != 0.0) {
      step_[i + 1] -= c.h * g[2];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (cells[i].fixed) {
      step_[i] = 0.0;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (i + 1 < n) {
      step_[i + 1] -= next_[i] * step_[i];
    }
    if (i + 2 < n) {
      step_[i + 2] -= after_[i] * step_[i];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    step_[i] /= diagonal_[i];
    step_[i] -=
        (i + 1 < n ? next_[i] * step_[i + 1] : 0.0) + (i + 2 < n ? after_[i] * step_[i + 2] : 0.0);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Cell& c = cells[i];
    const double b0 = (c.l != 0.0 ? c.l * step_[i - 1] : 0.0) + c.f * step_[i];
    const double b1 = step_[i];
    const double b2 = c.g * step_[i] + (c.h != 0.0 ? c.h * step_[i + 1] : 0.0);
    for (std::size_t r = begins_[i]; r < end_of(i); ++r) {
      const double moved = alpha_[r] * b0 + beta_[r] * b1 + gamma_[r] * b2;
      slack_step_[r] = -off_[r] - moved;
      dual_step_[r] = (target_[r] - dual_[r] * slack_step_[r]) / slack_[r] - dual_[r];
    }
  }
}

double JerkProgram::largest_share(const std::vector<double>& of,
                                  const std::vector<double>& by) const noexcept {
  double share = 1.0 / share_of_way;
  for (std::size_t r = 0; r < of.size(); ++r) {
    if (by[r] < 0.0) {
      share = std::min(share, -of[r] / by[r]);
    }
  }
  return share;
}

bool JerkProgram::solve(double gap, double& work) {
  const std::size_t n = cells.size();
  const std::size_t rows = alpha_.size();
  slack_.resize(rows);
  dual_.resize(rows);
  off_.resize(rows);
  target_.resize(rows);
  slack_step_.resize(rows);
  dual_step_.resize(rows);
  slope_.resize(n);
  curvature_.resize(n);
  rest_slope_.resize(n);
  rest_curvature_.resize(n);
  double time = differentiate();
  const auto left = [&](const Bezier2& b, std::size_t r) {
    return right_[r] - alpha_[r] * b[0] - beta_[r] * b[1] - gamma_[r] * b[2];
  };
  // Slacks of at least a part of what the rows allow, and one complementarity for all.
  constexpr double least_slack = 0.01;
  const double begin = 0.05 * time / static_cast<double>(rows);
  for (std::size_t i = 0; i < n; ++i) {
    const Bezier2 b = points(i);
    for (std::size_t r = begins_[i]; r < end_of(i); ++r) {
      slack_[r] = std::max(left(b, r), least_slack);
      dual_[r] = begin / slack_[r];
    }
  }
  double change = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    double worst = 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Bezier2 b = points(i);
      for (std::size_t r = begins_[i]; r < end_of(i); ++r) {
        off_[r] = slack_[r] - left(b, r);
        const double size =
            std::abs(alpha_[r]) * b[0] + std::abs(beta_[r]) * b[1] + std::abs(gamma_[r]) * b[2];
        worst = std::max(worst, std::abs(off_[r]) - rounding * size);
        sum += slack_[r] * dual_[r];
      }
    }
    if (worst <= kept && sum <= gap * time && change <= gap * time) {
      return true;
    }
    work -= static_cast<double>(rows);
    if (work < 0.0) {
      return false;
    }
    assemble();
    if (!factor()) {
      return false;
    }
    // Where it would go if no row were to be kept away from.
    std::fill(target_.begin(), target_.end(), 0.0);
    direct();
    double primal = std::min(1.0, largest_share(slack_, slack_step_));
    double dual = std::min(1.0, largest_share(dual_, dual_step_));
    double ahead = 0.0;
    for (std::size_t r = 0; r < rows; ++r) {
      ahead += (slack_[r] + primal * slack_step_[r]) * (dual_[r] + dual * dual_step_[r]);
    }
    const double mean = sum / static_cast<double>(rows);
    const double ratio = ahead / sum;
    const double centre = std::max(ratio * ratio * ratio, 1e-4) * mean;
    for (std::size_t r = 0; r < rows; ++r) {
      target_[r] = centre - slack_step_[r] * dual_step_[r];
    }
    direct();
    primal = std::min(1.0, share_of_way * largest_share(slack_, slack_step_));
    dual = std::min(1.0, share_of_way * largest_share(dual_, dual_step_));
    for (std::size_t i = 0; i < n; ++i) {  // the time is far from its parabola where x falls
      if (step_[i] < 0.0) {
        primal = std::min(primal, -0.8 * m[i] / step_[i]);
      }
    }
    if (!(primal > 0.0) || !std::isfinite(primal)) {
      return false;
    }
    for (std::size_t i = 0; i < n; ++i) {
      m[i] += primal * step_[i];
    }
    for (std::size_t r = 0; r < rows; ++r) {
      slack_[r] += primal * slack_step_[r];
      dual_[r] += dual * dual_step_[r];
    }
    const double before = time;
    time = differentiate();
    change = std::abs(time - before) / primal;
  }
  return false;
}

}  // namespace flyball::detail
