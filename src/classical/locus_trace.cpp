#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/locus_trace.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;

/// A closed-loop pole on the real axis, or one above it that speaks for its mirror image, too.
struct Point {
  Complex s;
  Index branch = 0;
  Index mirror = -1;  ///< The branch of the mirror image; -1: real.

  [[nodiscard]] bool real() const { return mirror < 0; }
};
using Points = std::vector<Point>;

bool finite(Complex s) {
  return std::isfinite(s.real()) && std::isfinite(s.imag());
}

/// 1/s, without the tests of the operator.
Complex inverse(Complex s) {
  const double share = 1.0 / std::norm(s);
  return {share * s.real(), -share * s.imag()};
}

/// Newton's step p/p' of p = D + kN at s, by factors, and what it is with 1 + kL of rounding alone.
struct Newton {
  Complex step;
  double noise = 0.0;
};
Newton newton(const LocusLoop& loop, double gain, Complex s) {
  const Complex kL = gain * loop.at(s);
  const auto [zeros, poles] = loop.slopes(s);
  const double rounding =
      2.0 * epsilon * static_cast<double>(loop.zeros.size() + loop.poles.size());
  if (std::norm(kL) <= 1.0) {
    const Complex slope = poles + kL * zeros;
    return {(1.0 + kL) / slope, rounding / std::abs(slope)};
  }
  const Complex slope = poles / kL + zeros;
  return {(1.0 / kL + 1.0) / slope, rounding / std::abs(slope)};
}

/// Aberth's iteration on all points at once. @return Whether it ended, points of their kind.
bool converge(const LocusLoop& loop, double gain, Points& points) {
  constexpr int most_sweeps = 40;
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    bool moved = false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      Point& point = points[i];
      auto [step, noise] = newton(loop, gain, point.s);
      if (!finite(step)) {  // on a pole or a zero
        point.s *= 1.0 + 4.0 * epsilon;
        point.s += 1e-30 * loop.size();
        step = newton(loop, gain, point.s).step;
        if (!finite(step)) {
          continue;
        }
      }
      Complex others = 0.0;
      for (std::size_t j = 0; j < points.size(); ++j) {
        if (j != i) {
          others += inverse(point.s - points[j].s);
        }
        if (!points[j].real()) {
          others += inverse(point.s - std::conj(points[j].s));
        }
      }
      const Complex corrected = step / (1.0 - step * others);
      step = finite(corrected) ? corrected : step;
      point.s -= point.real() ? Complex(step.real()) : step;
      if (!finite(point.s) || (!point.real() && point.s.imag() <= 0.0)) {
        return false;
      }
      moved = moved || std::abs(step) > noise + 4.0 * epsilon * std::abs(point.s);
    }
    if (!moved) {
      return true;
    }
  }
  return false;
}

/// The distance of each point from the nearest other one, mirror images included.
std::vector<double> separations(const Points& points) {
  std::vector<double> nearest(points.size(), infinity);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].real()) {
      nearest[i] = std::min(nearest[i], 4.0 * points[i].s.imag() * points[i].s.imag());
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double distance = std::min(std::norm(points[i].s - points[j].s),
                                       std::norm(points[i].s - std::conj(points[j].s)));
      nearest[i] = std::min(nearest[i], distance);
      nearest[j] = std::min(nearest[j], distance);
    }
  }
  for (double& distance : nearest) {
    distance = std::sqrt(distance);
  }
  return nearest;
}

/// Where m branches go: center + w with wᵐ = c, as m places and whose they are.
struct Fan {
  Complex center;
  bool infinite = false;  ///< Then 1/w, about 0.
  int branches = 1;
  Complex power;  ///< c
};

/// The angles of a fan's m roots, on the real axis exactly where they are on it.
std::vector<double> fan_angles(const Fan& fan) {
  std::vector<double> angles;
  const int m = fan.branches;
  const bool is_real = fan.power.imag() == 0.0;
  for (int l = 0; l < m; ++l) {
    double angle = (std::arg(fan.power) + 2.0 * pi * l) / m;
    if (is_real) {
      const int half_turns = (fan.power.real() > 0.0 ? 0 : 1) + 2 * l;  // m angle = half_turns pi
      angle = half_turns % m == 0 ? pi * (half_turns / m) : pi * half_turns / m;
    }
    angles.push_back(std::remainder(angle, 2.0 * pi));
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

/// Puts a fan's points to the others. @param branches  The branch of each angle.
void spread(const Fan& fan, const std::vector<double>& angles, const std::vector<Index>& branches,
            const std::vector<Index>& mirrors, Points& points) {
  const double radius = std::pow(std::abs(fan.power), 1.0 / fan.branches);
  const auto place = [&](double angle) {
    const Complex w = std::polar(radius, angle);
    return fan.infinite ? 1.0 / w : fan.center + w;
  };
  if (fan.center.imag() > 0.0) {
    for (std::size_t l = 0; l < angles.size(); ++l) {
      points.push_back({place(angles[l]), branches[l], mirrors[l]});
    }
    return;
  }
  // About the real axis: those on it, and those above with their images.
  for (std::size_t l = 0; l < angles.size(); ++l) {
    const double angle = angles[l];
    if (std::abs(angle) < 1e-9 || pi - std::abs(angle) < 1e-9) {
      points.push_back({Complex(place(angle).real()), branches[l], -1});
      continue;
    }
    if ((place(angle) - fan.center).imag() < 0.0) {
      continue;
    }
    std::size_t image = 0;
    for (std::size_t other = 0; other < angles.size(); ++other) {
      image = std::abs(angles[other] + angle) < 1e-9 ? other : image;
    }
    points.push_back({place(angle), branches[l], branches[image]});
  }
}

class Tracer {
 public:
  Tracer(const LocusLoop& loop, double size)
      : loop_(loop), size_(size), count_(loop.pole_count()) {}

  Expected<Trace> run(const std::vector<Meeting>& meetings, double last) {
    begin();
    const double start = last < infinity ? std::min(first_gain(), 1e-3 * last) : first_gain();
    leave_poles(start);
    if (!converge(loop_, start, points_)) {
      return lost(start);
    }
    gain_ = start;
    keep();
    std::size_t next = 0;
    while (next < meetings.size() && meetings[next].gain < last) {
      std::size_t end = next + 1;
      while (end < meetings.size() && meetings[end].gain <= meetings[next].gain * (1.0 + 1e-9)) {
        ++end;
      }
      const double at = meetings[next].gain;
      // Those that begin where it begins to be followed are as good as poles.
      if (at > gain_) {
        // At infinity the first power of 1/s may count but very far out.
        close_ = std::any_of(meetings.begin() + static_cast<std::ptrdiff_t>(next),
                             meetings.begin() + static_cast<std::ptrdiff_t>(end),
                             [](const Meeting& meeting) { return meeting.infinite; })
                     ? 1e-10
                     : 1e-7;
        FLYBALL_CHECK(follow(at, true));
        const double after = end < meetings.size() ? std::min(meetings[end].gain, last) : last;
        FLYBALL_CHECK(
            meet({meetings.data() + next, end - next}, at, std::min(after / at, 2.0) - 1.0));
      }
      next = end;
    }
    FLYBALL_CHECK(follow(last, false));
    return std::move(trace_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> lost(double gain) const {
    return refusal(SystemError::no_convergence, "root_locus", "the closed loop's poles")
        .got("not found")
        .with("gain", gain);
  }

  /// The poles, at k = 0.
  void begin() {
    VectorXcd row(count_);
    Index at = 0;
    for (const MultipleRoot& pole : loop_.poles) {
      for (int i = 0; i < pole.times; ++i) {
        row(at++) = pole.at;
      }
    }
    trace_.gains.push_back(0.0);
    trace_.rows.push_back(std::move(row));
  }

  /// A gain so small that each branch is still beside its pole.
  [[nodiscard]] double first_gain() const {
    constexpr double near = 1e-3;
    double least = infinity;
    for (const MultipleRoot& pole : loop_.poles) {
      const double rest = std::abs(loop_.rest(pole, true));
      least = std::min(least, std::pow(near * loop_.room(pole), pole.times) / rest);
    }
    return std::clamp(least, 1e-290, 1e290);
  }

  void leave_poles(double gain) {
    points_.clear();
    Index at = 0;
    std::vector<Index> first(loop_.poles.size());
    for (std::size_t i = 0; i < loop_.poles.size(); ++i) {
      first[i] = at;
      at += loop_.poles[i].times;
    }
    for (std::size_t i = 0; i < loop_.poles.size(); ++i) {
      const MultipleRoot& pole = loop_.poles[i];
      if (pole.at.imag() < 0.0) {
        continue;
      }
      Complex power = -gain * loop_.rest(pole, true);
      power = pole.at.imag() == 0.0 ? Complex(power.real()) : power;
      const Fan fan{.center = pole.at, .branches = pole.times, .power = power};
      std::vector<Index> branches;
      std::vector<Index> mirrors;
      std::size_t image = i;
      for (std::size_t j = 0; j < loop_.poles.size(); ++j) {
        image = loop_.poles[j].at == std::conj(pole.at) ? j : image;
      }
      for (int l = 0; l < pole.times; ++l) {
        branches.push_back(first[i] + l);
        mirrors.push_back(first[image] + l);
      }
      spread(fan, fan_angles(fan), branches, mirrors, points_);
    }
  }

  void keep() {
    VectorXcd row = VectorXcd::Constant(count_, Complex(nan, nan));
    for (const Point& point : points_) {
      row(point.branch) = point.s;
      if (!point.real()) {
        row(point.mirror) = std::conj(point.s);
      }
    }
    trace_.gains.push_back(gain_);
    trace_.rows.push_back(std::move(row));
  }

  /// Whether each branch is beside its zero, or far out.
  [[nodiscard]] bool arrived() const {
    constexpr double near = 1e-3;
    for (const Point& point : points_) {
      bool there = std::abs(point.s) > 20.0 * size_;
      for (const MultipleRoot& zero : loop_.zeros) {
        there = there || std::abs(point.s - zero.at) < near * loop_.room(zero);
      }
      if (!there) {
        return false;
      }
    }
    return true;
  }

  /// Steps until a gain: just before it, if branches meet there.
  Expected<void> follow(double until, bool meeting) {
    constexpr double shortest = 1e-13;
    constexpr std::size_t most_rows = 6000;
    const double close = meeting ? close_ : 0.0;
    double step = 0.1;
    while (true) {
      const double left = std::log(until / gain_);
      if (left <= std::max(close, 1e-12) || (!meeting && arrived()) ||
          trace_.gains.size() > most_rows) {
        return {};
      }
      step = std::min(step, meeting ? std::max(0.75 * left, close) : left);
      if (meeting && step >= left) {
        step = 0.5 * left;
      }
      const Points before = points_;
      const double start = gain_;
      const double taken = step;
      double off = 0.0;
      if (advance(start * std::exp(taken), taken, off)) {
        gain_ = left - taken < 1e-12 ? until : start * std::exp(taken);
        keep();
        step = off < 0.4 ? 2.0 * taken : off < 0.7 ? 1.2 * taken : taken;
        step = std::min(step, 3.0);
        continue;
      }
      points_ = before;
      step = 0.4 * taken;
      if (step < shortest) {
        return lost(start);
      }
    }
  }

  /// To a gain along the tangents. @param off  By how much of what is allowed the tangents missed.
  bool advance(double gain, double step, double& off) {
    Points ahead = points_;
    for (Point& point : ahead) {
      // d ln L = -d ln k, so ds/d ln k = -1/(ln L)'.
      const auto [zeros, poles] = loop_.slopes(point.s);
      const Complex move = -step / (zeros - poles);
      if (!finite(move)) {
        continue;
      }
      point.s += point.real() ? Complex(move.real()) : move;
      if (!point.real() && point.s.imag() <= 0.0) {
        return false;
      }
    }
    const Points tangent = ahead;
    if (!converge(loop_, gain, ahead)) {
      return false;
    }
    const auto separate = separations(ahead);
    for (std::size_t i = 0; i < ahead.size(); ++i) {
      constexpr double share = 0.2;
      constexpr double bend = 4e-3;
      constexpr double longest = 0.15;
      const double reach = std::max(size_, std::abs(ahead[i].s));
      const double missed = std::abs(ahead[i].s - tangent[i].s);
      const double moved = std::abs(ahead[i].s - points_[i].s);
      off = std::max({off, missed / (share * separate[i]), missed / (bend * reach),
                      moved / (longest * reach)});
    }
    if (off > 1.0) {
      return false;
    }
    points_ = std::move(ahead);
    return true;
  }

  /// Over the gain at which some branches meet. @param room  To the next such gain, as a share.
  Expected<void> meet(std::span<const Meeting> meetings, double at, double room) {
    const double late = std::clamp(1e-2 * room, 1e-12, close_);
    struct Slots {
      Fan fan;
      std::vector<std::pair<double, std::pair<Index, Index>>> arriving;  // angle, branch, mirror
    };
    std::vector<Slots> all;
    std::vector<bool> taken(points_.size(), false);
    for (const Meeting& meeting : meetings) {
      Slots slots{.fan = {.center = meeting.infinite ? Complex(0.0) : meeting.point,
                          .infinite = meeting.infinite,
                          .branches = meeting.branches,
                          .power = {}},
                  .arriving = {}};
      // a wᵐ = -Δ ln k.
      slots.fan.power = -late / meeting.coefficient;
      collect(meeting, taken, slots.arriving);
      if (static_cast<int>(slots.arriving.size()) != meeting.branches) {
        return lost(at);
      }
      std::sort(slots.arriving.begin(), slots.arriving.end());
      all.push_back(std::move(slots));
    }
    // The row of the meeting itself.
    Points rest;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!taken[i]) {
        rest.push_back(points_[i]);
      }
    }
    gain_ = at;
    for (Point& point : rest) {
      settle(point, at);
    }
    points_ = rest;
    keep();
    for (const Slots& slots : all) {
      for (const auto& [angle, branches] : slots.arriving) {
        const bool infinite = slots.fan.infinite;
        trace_.rows.back()(branches.first) = infinite ? Complex(nan, nan) : slots.fan.center;
        if (branches.second >= 0) {
          trace_.rows.back()(branches.second) = std::conj(trace_.rows.back()(branches.first));
        }
      }
    }
    // On from there.
    for (const Slots& slots : all) {
      depart(slots.fan, slots.arriving);
    }
    gain_ = at * (1.0 + late);
    if (!converge(loop_, gain_, points_)) {
      return lost(at);
    }
    keep();
    return {};
  }

  /// Newton's method on one point, apart from all others.
  void settle(Point& point, double gain) const {
    for (int i = 0; i < 8; ++i) {
      const Complex step = newton(loop_, gain, point.s).step;
      if (!finite(step) || std::abs(step) > 1e-3 * std::max(size_, std::abs(point.s))) {
        return;
      }
      point.s -= point.real() ? Complex(step.real()) : step;
    }
  }

  /// The branches that are about to meet: those nearest.
  void collect(const Meeting& meeting, std::vector<bool>& taken,
               std::vector<std::pair<double, std::pair<Index, Index>>>& arriving) const {
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!taken[i]) {
        near.emplace_back(
            meeting.infinite ? -std::abs(points_[i].s) : std::abs(points_[i].s - meeting.point), i);
      }
    }
    std::sort(near.begin(), near.end());
    const bool on_axis = meeting.point.imag() == 0.0;
    for (const auto& [distance, i] : near) {
      if (static_cast<int>(arriving.size()) >= meeting.branches) {
        break;
      }
      const Point& point = points_[i];
      const Complex w = meeting.infinite ? 1.0 / point.s : point.s - meeting.point;
      taken[i] = true;
      if (!on_axis) {
        arriving.push_back({std::arg(w), {point.branch, point.mirror}});
      } else if (point.real()) {
        arriving.push_back({w.real() < 0.0 ? pi : 0.0, {point.branch, -1}});
      } else {
        arriving.push_back({std::arg(w), {point.branch, -1}});
        arriving.push_back({-std::arg(w), {point.mirror, -1}});
      }
    }
  }

  /// Each arriving branch leaves in the direction that is next to its own, all turned alike.
  void depart(const Fan& fan,
              const std::vector<std::pair<double, std::pair<Index, Index>>>& arriving) {
    const std::vector<double> angles = fan_angles(fan);
    std::vector<Index> branches(angles.size());
    std::vector<Index> mirrors(angles.size());
    std::size_t best = 0;
    double least = infinity;
    for (std::size_t shift = 0; shift < angles.size(); ++shift) {
      double sum = 0.0;
      for (std::size_t l = 0; l < angles.size(); ++l) {
        sum += std::abs(std::remainder(
            angles[l] - arriving[(l + shift) % angles.size()].first - 1e-3, 2.0 * pi));
      }
      if (sum < least) {
        least = sum;
        best = shift;
      }
    }
    for (std::size_t l = 0; l < angles.size(); ++l) {
      branches[l] = arriving[(l + best) % angles.size()].second.first;
      mirrors[l] = arriving[(l + best) % angles.size()].second.second;
    }
    spread(fan, angles, branches, mirrors, points_);
  }

  const LocusLoop& loop_;
  double size_;
  Index count_;
  double gain_ = 0.0;
  double close_ = 1e-7;  ///< To a meeting, in ln k: a branch is at the square root of it.
  Points points_;
  Trace trace_;
};

}  // namespace

Expected<Trace> trace_locus(const LocusLoop& loop, const std::vector<Meeting>& meetings,
                            double last, double size) {
  return Tracer(loop, size).run(meetings, last);
}

std::optional<VectorXcd> roots_at(const LocusLoop& loop, double gain, const VectorXcd& estimates) {
  Points points;
  Index at = 0;
  for (const Complex& s : estimates) {
    if (s.imag() >= 0.0) {
      points.push_back({s, at, s.imag() == 0.0 ? -1 : at + 1});
      at += s.imag() == 0.0 ? 1 : 2;
    }
  }
  if (at != loop.pole_count() || !converge(loop, gain, points)) {
    return std::nullopt;
  }
  VectorXcd found(at);
  for (const Point& point : points) {
    found(point.branch) = point.s;
    if (!point.real()) {
      found(point.mirror) = std::conj(point.s);
    }
  }
  return found;
}

}  // namespace flyball::classical::detail
