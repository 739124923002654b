#include <flyball/planning/trajectory/path_trajectory.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/motion_limit.hpp"

namespace flyball {

namespace {

/// sinh(√c t)/√c and (cosh(√c t) - 1)/c, for any sign of c.
struct Growth {
  double S;
  double C;
};

Growth growth(double c, double t) noexcept {
  const double z = c * t * t;
  if (std::abs(z) < 0.25) {  // z⁷/15! < 1e-16
    // Σ zᵏ/(2k + 1)! and Σ zᵏ/(2k + 2)!
    constexpr double s[] = {1.0 / 6.0,      1.0 / 120.0,      1.0 / 5040.0,
                            1.0 / 362880.0, 1.0 / 39916800.0, 1.0 / 6227020800.0};
    constexpr double e[] = {0.5,
                            1.0 / 24.0,
                            1.0 / 720.0,
                            1.0 / 40320.0,
                            1.0 / 3628800.0,
                            1.0 / 479001600.0,
                            1.0 / 87178291200.0};
    const double S =
        1.0 + z * (s[0] + z * (s[1] + z * (s[2] + z * (s[3] + z * (s[4] + z * s[5])))));
    const double C =
        e[0] + z * (e[1] + z * (e[2] + z * (e[3] + z * (e[4] + z * (e[5] + z * e[6])))));
    return {t * S, t * t * C};
  }
  const double root = std::sqrt(std::abs(c));
  const double half = 0.5 * root * t;
  if (c > 0.0) {
    const double s = std::sinh(half);
    return {2.0 * s * std::cosh(half) / root, 2.0 * s * s / c};
  }
  const double s = std::sin(half);
  return {2.0 * s * std::cos(half) / root, -2.0 * s * s / c};
}

}  // namespace

PathTrajectory::PathTrajectory(Path path, std::vector<Span> spans,
                               std::vector<PathConstraint> constraints)
    : path_(std::move(path)), spans_(std::move(spans)), constraints_(std::move(constraints)) {
  total_time_ = spans_.back().start + spans_.back().duration;
  const std::size_t count = 2 * spans_.size();
  buckets_per_second_ = total_time_ > 0.0 ? static_cast<double>(count) / total_time_ : 0.0;
  buckets_.resize(count + 1);
  std::size_t i = 0;
  for (std::size_t k = 0; k <= count; ++k) {
    const double t = static_cast<double>(k) / static_cast<double>(count) * total_time_;
    while (i + 1 < spans_.size() && spans_[i + 1].start <= t) {
      ++i;
    }
    buckets_[k] = i;
  }
}

std::size_t PathTrajectory::span_at(double t) const noexcept {
  const auto bucket =
      std::min(static_cast<std::size_t>(t * buckets_per_second_), buckets_.size() - 2);
  // By halves between two buckets' spans: many spans may lie in one bucket.
  std::size_t low = buckets_[bucket];
  std::size_t high = buckets_[bucket + 1];
  while (low < high) {
    const std::size_t middle = low + (high - low + 1) / 2;
    if (spans_[middle].start <= t) {
      low = middle;
    } else {
      high = middle - 1;
    }
  }
  return low;
}

/// s from the beginning of a span, and its derivatives by the time.
struct PathTrajectory::Progress {
  double s;
  double rate;
  double u;
};

PathTrajectory::Progress PathTrajectory::progress(const Span& span, double t) const noexcept {
  const double dt = std::min(t - span.start, span.duration);
  if (span.jerk != 0.0) {
    const double s = dt * (span.rate + dt * (0.5 * span.u + dt * span.jerk / 6.0));
    const double rate = span.rate + dt * (span.u + 0.5 * dt * span.jerk);
    return {std::clamp(s, 0.0, span.width), std::max(0.0, rate), span.u + dt * span.jerk};
  }
  const auto [S, C] = growth(span.c, dt);
  // s'' = u + c s, s(0) = 0, s'(0) = rate
  const double s = std::clamp(span.rate * S + span.u * C, 0.0, span.width);
  return {s, std::max(0.0, span.rate * (1.0 + span.c * C) + span.u * S), span.u + span.c * s};
}

PathVector PathTrajectory::jerk(double t) const noexcept {
  t = t > 0.0 ? std::min(t, total_time_) : 0.0;
  const Span& span = spans_[span_at(t)];
  const auto [s, rate, u] = progress(span, t);
  const double third = span.jerk != 0.0 ? span.jerk : span.c * rate;
  const PathState state = path_.at(span.piece, std::min(1.0, (span.parameter + s) * span.scale));
  return state.third * (rate * rate * rate) + state.second * (3.0 * rate * u) + state.first * third;
}

PathSample PathTrajectory::sample(double t) const noexcept {
  t = t > 0.0 ? std::min(t, total_time_) : 0.0;
  const Span& span = spans_[span_at(t)];
  const auto [s, rate, u] = progress(span, t);

  const PathPiece& piece = path_.pieces()[span.piece];
  const Eigen::Index n = path_.coordinates();
  const Eigen::Index columns = piece.coefficients.cols();
  const double* c = piece.coefficients.data();
  const double per_span = span.scale;
  const double at = std::min(1.0, (span.parameter + s) * per_span);
  PathSample sample;
  sample.time = t;
  sample.parameter = path_.breaks()[span.piece] + span.parameter + s;
  sample.rate = rate;
  sample.position.resize(n);
  sample.velocity.resize(n);
  sample.acceleration.resize(n);
  const double per_time = rate * per_span;
  for (Eigen::Index j = 0; j < n; ++j) {
    double q = c[(columns - 1) * n + j];
    double first = 0.0;
    double second = 0.0;
    for (Eigen::Index k = columns - 2; k >= 0; --k) {
      second = second * at + first;
      first = first * at + q;
      q = q * at + c[k * n + j];
    }
    sample.position(j) = q;
    sample.velocity(j) = first * per_time;
    sample.acceleration(j) = 2.0 * second * per_time * per_time + first * per_span * u;
  }
  return sample;
}

std::vector<BindingLimit> PathTrajectory::binding() const {
  const auto limits = detail::motion_limits(path_, constraints_, "binding");
  std::vector<BindingLimit> all;
  if (!limits) {
    return all;
  }
  std::vector<std::string> names;
  std::size_t caps = 0;
  for (const auto& limit : *limits) {
    names.insert(names.end(), limit->cap_names.begin(), limit->cap_names.end());
  }
  caps = names.size();
  for (const auto& limit : *limits) {
    names.insert(names.end(), limit->row_names.begin(), limit->row_names.end());
  }
  std::vector<detail::MotionRow> rows(names.size() - caps);
  for (const auto& limit : *limits) {
    names.insert(names.end(), limit->jerk_names.begin(), limit->jerk_names.end());
  }
  std::vector<detail::JerkRow> jerks(names.size() - caps - rows.size());
  std::vector<double> cap(caps);
  std::vector<double> use(names.size());
  std::size_t before = names.size();
  for (const Span& span : spans_) {
    std::fill(use.begin(), use.end(), 0.0);
    for (const double share : {0.1, 0.5, 0.9}) {
      double s = share * span.width;
      double u = span.u + span.c * s;
      double x = std::max(0.0, span.rate * span.rate + 2.0 * span.u * s + span.c * s * s);
      double third = span.c * std::sqrt(x);
      if (span.jerk != 0.0) {
        const Progress at = progress(span, span.start + share * span.duration);
        s = at.s;
        u = at.u;
        x = at.rate * at.rate;
        third = span.jerk;
      }
      const PathState state = path_.at(span.piece, (span.parameter + s) * span.scale);
      detail::MotionRow* row = rows.data();
      double* w = cap.data();
      detail::JerkRow* jerk = jerks.data();
      for (const auto& limit : *limits) {
        const double at = path_.breaks()[span.piece] + span.parameter + s;
        limit->evaluate(state, at, row, w);
        limit->evaluate_jerk(state, at, jerk);
        jerk += limit->jerk_names.size();
        row += limit->row_names.size();
        w += limit->cap_names.size();
      }
      for (std::size_t i = 0; i < caps; ++i) {
        use[i] += cap[i] * x / 3.0;
      }
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const detail::MotionRow& r = rows[i];
        use[caps + i] += std::abs(r.a * u + r.b * x + r.k * std::sqrt(x) + r.c) / 3.0;
      }
      for (std::size_t i = 0; i < jerks.size(); ++i) {
        const detail::JerkRow& r = jerks[i];
        use[caps + rows.size() + i] +=
            std::abs((r.e * x + r.b * u) * std::sqrt(x) + r.a * third) / 3.0;
      }
    }
    const auto most = std::max_element(use.begin(), use.end());
    const auto which = static_cast<std::size_t>(most - use.begin());
    const double from = path_.breaks()[span.piece] + span.parameter;
    if (before == names.size() || names[which] != names[before]) {
      all.push_back({from, from, span.start, span.start, names[which], 0.0});
    }
    before = which;
    all.back().to = from + span.width;
    all.back().end = span.start + span.duration;
    all.back().use += span.duration * *most;
  }
  for (BindingLimit& limit : all) {
    limit.use /= limit.end - limit.start;
  }
  return all;
}

std::vector<double> PathTrajectory::parameters() const {
  std::vector<double> all;
  all.reserve(spans_.size() + 1);
  for (const Span& span : spans_) {
    all.push_back(path_.breaks()[span.piece] + span.parameter);
  }
  all.push_back(path_.parameter_end());
  return all;
}

std::vector<double> PathTrajectory::times() const {
  std::vector<double> all;
  all.reserve(spans_.size() + 1);
  for (const Span& span : spans_) {
    all.push_back(span.start);
  }
  all.push_back(total_time_);
  return all;
}

Expected<Trajectory> planar_trajectory(const PathTrajectory& trajectory, double step) {
  constexpr std::string_view where = "planar_trajectory";
  constexpr double most_points = 1e6;
  const Path& path = trajectory.path();
  if (path.coordinates() != 2 && path.coordinates() != 3) {
    return refusal(ArgumentError::wrong_shape, where, "trajectory")
        .got(detail::format("of {} coordinates", path.coordinates()))
        .expected("of two (x, y) or three (x, y, θ)");
  }
  FLYBALL_CHECK(check_positive(step, where, "step", "s"));
  if (trajectory.total_time() / step > most_points) {
    return refusal(ArgumentError::out_of_range, where, "step")
        .got(format_number(step) + " s")
        .expected("one that gives a million points or less");
  }
  std::vector<double> times;
  for (const double t : trajectory.times()) {
    if (!times.empty()) {
      const double from = times.back();
      const auto parts = static_cast<int>(std::ceil((t - from) / step));
      for (int k = 1; k < parts; ++k) {
        times.push_back(from + (t - from) * k / parts);
      }
      if (!(t > from)) {
        continue;
      }
    }
    times.push_back(t);
  }
  std::vector<TrajectoryPoint> points;
  points.reserve(times.size());
  for (const double t : times) {
    const PathSample sample = trajectory.sample(t);
    const PathState state = path.at(sample.parameter);
    const double travel = travel_heading(state);
    const double heading = path.coordinates() == 3 ? state.position(2) : travel;
    const double v = sample.velocity.head<2>().norm();
    const double along =
        sample.acceleration(0) * std::cos(travel) + sample.acceleration(1) * std::sin(travel);
    const double bend = planar_curvature(state);
    points.push_back({t, v, along, Pose2d(state.position(0), state.position(1), heading),
                      std::isfinite(bend) ? bend : 0.0});
  }
  return Trajectory(std::move(points));
}

}  // namespace flyball
