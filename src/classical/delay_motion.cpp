#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_motion.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/balance.hpp"

namespace flyball::classical::detail {

using flyball::detail::product;

namespace {

constexpr int points = 12;
constexpr double tolerance = 1e-12;
/// Of a system without states and delays: a delay counts as half a step more, ten states as two. Of
/// n > 10 states (n/10)³ times as many; four more for each sample.
constexpr double most_steps = 375'000.0;
/// Instants nearer than this share of the whole time are one.
constexpr double shortest_share = 1e-9;
constexpr std::size_t most_breaks = 200'000;

}  // namespace

Motion::Motion(const DelaySystem& system, Drive drive, double step, Index samples,
               OutputPieces* pieces)
    : form_(system.form()),
      drive_(drive),
      pieces_(pieces),
      step_(step),
      end_(step * static_cast<double>(samples - 1)),
      samples_(samples),
      collocation_(radau_collocation(points)) {
  const MatrixXd B = beside(form_.B1, form_.B2);
  MatrixXd C(form_.C1.rows() + form_.C2.rows(), form_.A.rows());
  C << form_.C1, form_.C2;
  scaling_ = flyball::detail::scaling_of(form_.A, B, C).states;
  const VectorXd inverse = scaling_.cwiseInverse();
  form_.A = inverse.asDiagonal() * form_.A * scaling_.asDiagonal();
  form_.B1 = inverse.asDiagonal() * form_.B1;
  form_.B2 = inverse.asDiagonal() * form_.B2;
  form_.C1 = form_.C1 * scaling_.asDiagonal();
  form_.C2 = form_.C2 * scaling_.asDiagonal();
  shortest_ =
      form_.delays.size() > 0 ? form_.delays.minCoeff() : std::numeric_limits<double>::infinity();
}

Expected<DelayResponse> Motion::run(const VectorXd& x0) {
  constexpr double least_step = 1e-280;  // of which `same` is a small part
  if (samples_ > 1 && !(step_ >= least_step)) {
    return refusal(ArgumentError::out_of_range, "response", "the time between two samples")
        .got(flyball::detail::format("{} s", step_))
        .expected("at least 1e-280 s");
  }
  x_ = scaling_.cwiseInverse().asDiagonal() * x0;
  response_.time = VectorXd::LinSpaced(samples_, 0.0, end_);
  response_.x.resize(samples_, x_.size());
  response_.y.resize(samples_, form_.C1.rows());
  largest_x_ = x_.cwiseAbs();
  largest_z_.setZero(form_.delays.size());
  schedule_inputs();
  const double rate = form_.A.size() > 0 ? form_.A.cwiseAbs().rowwise().sum().maxCoeff() : 0.0;
  wanted_ = std::min({shortest_, std::max(end_, step_), rate > 0.0 ? 1.0 / rate : HUGE_VAL});
  const double size = 0.1 * static_cast<double>(x_.size());
  work_ = most_steps * std::max(1.0, size * size * size) + 4.0 * static_cast<double>(samples_);
  if (end_ * shortest_share > shortest_) {
    return refusal(ArgumentError::out_of_range, "response", "the shortest delay")
        .got(flyball::detail::format("{} s", shortest_))
        .expected(flyball::detail::format("at least a billionth of the time, {} s", end_))
        .hint("ask for a shorter time, or leave the delay out");
  }
  while (next_sample_ < samples_) {
    pass_breaks();
    // The last sample has no step behind it.
    if (next_sample_ + 1 == samples_ && sample_time(next_sample_) <= t_ + same()) {
      take_sample(t_, t_, x_);
      break;
    }
    const double until =
        std::min(breaks_.empty() ? HUGE_VAL : breaks_.begin()->first, std::max(end_, t_ + step_));
    FLYBALL_CHECK(cross(until));
  }
  if (!response_.y.allFinite() || !response_.x.allFinite()) {
    return refusal(ArgumentError::not_finite, "response", "the response")
        .got("beyond the largest double")
        .hint("ask for a shorter time");
  }
  return std::move(response_);
}

MatrixXd Motion::beside(const MatrixXd& left, const MatrixXd& right) {
  MatrixXd both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

Break& Motion::break_at(double time) {
  const auto found = breaks_.lower_bound(time - same());
  if (found != breaks_.end() && found->first <= time + same()) {
    return found->second;
  }
  Break& made = breaks_[time];
  made.delayed = Eigen::VectorXi::Constant(form_.delays.size(), smooth);
  return made;
}

void Motion::schedule_inputs() {
  const Index m = drive_.u.cols();
  if (drive_.impulse >= 0) {
    Break& start = break_at(0.0);
    x_ += form_.B1.col(drive_.impulse);
    start.input = -1;
    start_impulse_ = form_.D21.col(drive_.impulse);
    return;
  }
  (void)break_at(0.0);
  for (Index k = 0; k < samples_; ++k) {
    for (Index j = 0; j < m; ++j) {
      const double before = k > 0 ? drive_.u(k - 1, j) : 0.0;
      const double now = drive_.u(k, j);
      if (drive_.shape == InputShape::held ? now != before
          : k == 0                         ? now != 0.0 || slope(k, j) != 0.0
                                           : slope(k, j) != slope(k - 1, j)) {
        Break& at = break_at(sample_time(k));
        at.input = std::min(at.input, drive_.shape == InputShape::held || k == 0 ? 0 : 1);
      }
    }
  }
  // What is at rest jumps at the start.
  if (x_.size() > 0 && !x_.isZero(0.0)) {
    break_at(0.0).input = 0;
  }
}

double Motion::slope(Index k, Index j) const {
  return k + 1 < samples_ ? (drive_.u(k + 1, j) - drive_.u(k, j)) / step_ : 0.0;
}

VectorXd Motion::input(double begin, double t) const {
  if (drive_.impulse >= 0) {
    return VectorXd::Zero(form_.B1.cols());
  }
  const auto k =
      std::clamp<Index>(static_cast<Index>(std::floor((begin + same()) / step_)), 0, samples_ - 1);
  VectorXd u = drive_.u.row(k).transpose();
  if (drive_.shape == InputShape::linear) {
    for (Index j = 0; j < u.size(); ++j) {
      u(j) += slope(k, j) * (t - sample_time(k));
    }
  }
  return u;
}

void Motion::pass_breaks() {
  while (!breaks_.empty() && breaks_.begin()->first <= t_ + same()) {
    const Break now = std::move(breaks_.begin()->second);
    breaks_.erase(breaks_.begin());
    const Index k = form_.delays.size();
    VectorXd z_impulse = VectorXd::Zero(k);
    int x_order = now.input < smooth && !form_.B1.isZero(0.0) ? now.input + 1 : smooth;
    if (now.input == -1) {
      z_impulse = start_impulse_;
      add_output_impulse(form_.D11.col(drive_.impulse));
      x_order = 0;
    }
    for (Index i = 0; i < k; ++i) {
      if (now.delayed(i) < smooth && !form_.B2.col(i).isZero(0.0)) {
        x_order = std::min(x_order, now.delayed(i) + 1);
      }
    }
    if (now.impulse.size() > 0) {
      x_ += form_.B2 * now.impulse;
      z_impulse += form_.D22 * now.impulse;
      add_output_impulse(form_.D12 * now.impulse);
      x_order = 0;
    }
    if (t_ == 0.0 && x_.size() > 0 && !x_.isZero(0.0)) {
      x_order = 0;
    }
    for (Index j = 0; j < k; ++j) {
      int order = form_.C2.row(j).isZero(0.0) ? smooth : x_order;
      if (!form_.D21.row(j).isZero(0.0)) {
        order = std::min(order, std::max(now.input, 0));
      }
      for (Index i = 0; i < k; ++i) {
        if (form_.D22(j, i) != 0.0) {
          order = std::min(order, now.delayed(i));
        }
      }
      const double at = t_ + form_.delays(j);
      if (at > end_ + same() || (order >= smooth && z_impulse(j) == 0.0) ||
          (breaks_.size() > most_breaks && order > 1)) {
        continue;
      }
      Break& later = break_at(at);
      later.delayed(j) = std::min(later.delayed(j), order);
      if (z_impulse(j) != 0.0) {
        if (later.impulse.size() == 0) {
          later.impulse = VectorXd::Zero(k);
        }
        later.impulse(j) += z_impulse(j);
      }
    }
  }
}

void Motion::add_output_impulse(const VectorXd& strength) {
  if (!strength.isZero(0.0)) {
    response_.impulses.push_back({t_, strength});
  }
}

double Motion::delayed(Index i, double begin, double t) const {
  const double from = begin - form_.delays(i);
  const double at = t - form_.delays(i);
  if (segments_.empty() || at < 0.0) {
    return 0.0;
  }
  // The one in which the step's piece up to t lies: its end, if t is between two.
  const double probe = t > begin ? at - same() : from + same();
  auto next =
      std::upper_bound(segments_.begin(), segments_.end(), std::max(probe, from + same()),
                       [](double time, const Segment& segment) { return time < segment.begin; });
  if (next == segments_.begin()) {
    return 0.0;
  }
  const Segment& segment = *std::prev(next);
  const double x = std::clamp(2.0 * (at - segment.begin) / segment.length - 1.0, -1.0, 1.0);
  return legendre_sum(segment.z.col(i), x);
}

bool Motion::reaches_into(Index i, Index d, double length) const {
  return 0.5 * (1.0 + collocation_.nodes(i)) * length > form_.delays(d) * (1.0 + 1e-12);
}

const Propagator& Motion::propagator(double length) {
  const auto key = std::llround(std::ldexp(std::log2(length), 43));
  if (const auto found = propagators_.find(key); found != propagators_.end()) {
    return found->second;
  }
  if (propagators_.size() > 256) {
    propagators_.clear();
  }
  // (I - h/2 a ⊗ A) X - h/2 a ⊗ B₂ W = 1 ⊗ x(0) + h/2 a ⊗ B₁ U, and, where a step is longer than a
  // delay, W = W₀ + E (C₂ X + D₂₁ U + D₂₂ W): E takes the step's own polynomials a delay earlier,
  // W₀ is what came before the step.
  const Index n = x_.size();
  const Index m = form_.B1.cols();
  const Index k = form_.delays.size();
  const Index q = m + k;
  const bool overlaps = length > shortest_;
  const Index w = points * n;
  const Index unknowns = w + (overlaps ? points * k : 0);
  MatrixXd M = MatrixXd::Identity(unknowns, unknowns);
  MatrixXd right = MatrixXd::Zero(unknowns, n + points * q);
  for (Index i = 0; i < points; ++i) {
    right.block(i * n, 0, n, n).setIdentity();
    for (Index j = 0; j < points; ++j) {
      const double a = 0.5 * length * collocation_.integrals(i, j);
      M.block(i * n, j * n, n, n) -= a * form_.A;
      right.block(i * n, n + j * q, n, m) = a * form_.B1;
      if (overlaps) {
        M.block(i * n, w + j * k, n, k) -= a * form_.B2;
      } else {
        right.block(i * n, n + j * q + m, n, k) = a * form_.B2;
      }
    }
  }
  for (Index i = 0; overlaps && i < points; ++i) {
    for (Index d = 0; d < k; ++d) {
      const Index row = w + i * k + d;
      right(row, n + i * q + m + d) = 1.0;
      if (!reaches_into(i, d, length)) {
        continue;
      }
      const double place = collocation_.nodes(i) - 2.0 * form_.delays(d) / length;
      const VectorXd E = collocation_.modes.transpose() * legendre(points, place);
      for (Index j = 0; j < points; ++j) {
        M.block(row, j * n, 1, n) -= E(j) * form_.C2.row(d);
        M.block(row, w + j * k, 1, k) -= E(j) * form_.D22.row(d);
        right.block(row, n + j * q, 1, m) += E(j) * form_.D21.row(d);
      }
    }
  }
  // Of ten states one length costs as much as 200 steps.
  const auto size = static_cast<double>(unknowns);
  work_ -= 5e-3 * size * size * (1.0 + 0.01 * (size + static_cast<double>(right.cols())));
  const MatrixXd X = flyball::detail::solve_linear(M, right);
  return propagators_.emplace(key, Propagator{X.leftCols(n), X.rightCols(points * q)})
      .first->second;
}

Expected<void> Motion::cross(double until) {
  while (until - t_ > same() && next_sample_ < samples_) {
    const double distance = until - t_;
    const double parts = std::ceil(distance / wanted_ * (1.0 - 1e-9));
    const double length = distance / std::max(parts, 1.0);
    const auto delays = static_cast<double>(form_.delays.size());
    work_ -= 1.0 + 0.5 * delays +
             3e-3 * static_cast<double>(x_.size() *
                                        (x_.size() + points * (form_.B1.cols() + form_.B2.cols())));
    if (!(work_ >= 0.0)) {
      return refusal(SystemError::no_convergence, "response", "the motion")
          .got(flyball::detail::format("not followed beyond {} s by as many steps as it may take",
                                       t_))
          .hint("ask for a shorter time, or leave out what is fast");
    }
    if (!take_step(length, parts <= 1.0 ? until : t_ + length)) {
      wanted_ = 0.5 * length;
      patience_ = std::min(2 * patience_, 64);
      accepted_ = 0;
      if (!(wanted_ > 1e-14 * (end_ + step_))) {
        if (x_.allFinite() && (x_.size() == 0 || x_.cwiseAbs().maxCoeff() < 1e150)) {
          return refusal(SystemError::no_convergence, "response", "the motion")
              .got(flyball::detail::format("not resolved beyond {} s", t_))
              .hint("ask for a shorter time");
        }
        return refusal(ArgumentError::not_finite, "response", "the response")
            .got("beyond the largest double")
            .hint("ask for a shorter time");
      }
      continue;
    }
    if (++accepted_ >= patience_ && length > 0.6 * wanted_) {
      wanted_ *= 2.0;
      accepted_ = 0;
    }
  }
  return {};
}

bool Motion::take_step(double length, double end) {
  const Index n = x_.size();
  const Index m = form_.B1.cols();
  const Index k = form_.delays.size();
  const Index q = m + k;
  VectorXd inputs(points * q);
  for (Index i = 0; i < points; ++i) {
    const double t = t_ + 0.5 * (1.0 + collocation_.nodes(i)) * length;
    inputs.segment(i * q, m) = input(t_, t);
    for (Index j = 0; j < k; ++j) {
      inputs(i * q + m + j) = reaches_into(i, j, length) ? 0.0 : delayed(j, t_, t);
    }
  }
  VectorXd X = VectorXd::Zero(0);
  if (n > 0 || length > shortest_) {
    const Propagator& by = propagator(length);
    X = by.P * x_ + by.Q * inputs;
  }
  for (Index i = 0; length > shortest_ && i < points; ++i) {
    inputs.segment(i * q + m, k) = X.segment(points * n + i * k, k);
  }
  const Eigen::Map<const MatrixXd> states(X.data(), n, points);
  const Eigen::Map<const MatrixXd> drive(inputs.data(), q, points);
  const MatrixXd x_modes = product(collocation_.modes, MatrixXd(states.transpose()));  // p x n
  MatrixXd z(points, k);
  z = product(MatrixXd(states.transpose()), form_.C2.transpose()) +
      product(MatrixXd(drive.topRows(m).transpose()), form_.D21.transpose()) +
      product(MatrixXd(drive.bottomRows(k).transpose()), form_.D22.transpose());
  const MatrixXd z_modes = product(collocation_.modes, z);
  // What rounding leaves of larger terms is no coefficient, and what jumps round a loop without a
  // state is rounded anew each time.
  const bool jumps = k > 0 && !form_.D22.isZero(0.0);
  const double bound = tolerance * (jumps ? 1.0 + t_ / shortest_ : 1.0);
  const auto resolved = [bound](const MatrixXd& modes, const MatrixXd& values,
                                const VectorXd& largest, const VectorXd& terms) {
    for (Index j = 0; j < modes.cols(); ++j) {
      const double size = std::max(largest(j), values.col(j).cwiseAbs().maxCoeff());
      if (!(modes.col(j).tail(2).cwiseAbs().maxCoeff() <= bound * size + 1e-14 * terms(j))) {
        return false;
      }
    }
    return true;
  };
  const MatrixXd at_nodes = states.transpose();
  const VectorXd all = VectorXd::Constant(n, n > 0 ? largest_x_.maxCoeff() : 0.0);
  const VectorXd terms = form_.C2.cwiseAbs() * largest_x_;
  if (!resolved(x_modes, at_nodes, largest_x_, all) || !resolved(z_modes, z, largest_z_, terms)) {
    return false;
  }
  // What arrives is of two pieces then, of before the step and of the step.
  if (length > shortest_) {
    const MatrixXd w = drive.bottomRows(k).transpose();
    if (!resolved(product(collocation_.modes, w), w, largest_z_, terms)) {
      return false;
    }
  }
  for (Index j = 0; j < n; ++j) {
    largest_x_(j) = std::max(largest_x_(j), at_nodes.col(j).cwiseAbs().maxCoeff());
  }
  for (Index j = 0; j < k; ++j) {
    largest_z_(j) = std::max(largest_z_(j), z.col(j).cwiseAbs().maxCoeff());
  }
  if (pieces_ != nullptr) {
    const MatrixXd y = product(at_nodes, form_.C1.transpose()) +
                       product(MatrixXd(drive.topRows(m).transpose()), form_.D11.transpose()) +
                       product(MatrixXd(drive.bottomRows(k).transpose()), form_.D12.transpose());
    pieces_->add(t_, length, product(collocation_.modes, y));
  }
  segments_.push_back({t_, length, z_modes});
  while (next_sample_ < samples_ && sample_time(next_sample_) < end - same()) {
    const double t = sample_time(next_sample_);
    const double place = 2.0 * (t - t_) / length - 1.0;
    const VectorXd x =
        t <= t_ + same() ? x_ : VectorXd(x_modes.transpose() * legendre(points, place));
    take_sample(t_, t, x);
  }
  if (n > 0) {
    x_ = states.col(points - 1);
  }
  t_ = end;
  const double oldest = t_ - (k > 0 ? form_.delays.maxCoeff() : 0.0) - same();
  while (!segments_.empty() && segments_.front().begin + segments_.front().length < oldest) {
    segments_.pop_front();
  }
  return true;
}

void Motion::take_sample(double begin, double t, const VectorXd& x) {
  VectorXd y = form_.C1 * x + form_.D11 * input(begin, t);
  for (Index j = 0; j < form_.delays.size(); ++j) {
    y += form_.D12.col(j) * delayed(j, begin, t);
  }
  response_.y.row(next_sample_) = y.transpose();
  response_.x.row(next_sample_) = (scaling_.asDiagonal() * x).transpose();
  ++next_sample_;
}

}  // namespace flyball::classical::detail
