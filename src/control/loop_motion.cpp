#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/systems/interconnection.hpp>

#include "control/loop_motion.hpp"
#include "math/dense/dense.hpp"

namespace flyball::detail {

namespace {

using classical::TransferFunction;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t most_points = 150'000;

/// Whether the second half of a motion is already at its end.
bool has_settled(const LoopMotion& motion) {
  double largest = 1e-300;
  for (const double value : motion.values) {
    largest = std::max(largest, std::abs(value - motion.final_value));
  }
  for (std::size_t i = motion.values.size() / 2; i < motion.values.size(); ++i) {
    if (std::abs(motion.values[i] - motion.final_value) > 1e-4 * largest) {
      return false;
    }
  }
  return true;
}

/// Doubled until it has settled. @param run  A motion of so many steps.
template <class Run>
LoopMotion settled(std::size_t steps, Run&& run) {
  for (;; steps *= 2) {
    LoopMotion motion = run(std::min(steps, most_points));
    if (has_settled(motion)) {
      return motion;
    }
    if (steps >= most_points) {
      motion.settled = false;
      return motion;
    }
  }
}

/// P C closed, from the reference or the load to the output, without delay.
std::optional<ContinuousSystem<>> closed(const ContinuousSystem<>& P, const ContinuousSystem<>& C,
                                         LoopStep step) {
  if (step == LoopStep::load) {
    auto loop = feedback(P, C);
    return loop ? std::optional(*std::move(loop)) : std::nullopt;
  }
  auto forward = series(C, P);
  auto loop = forward ? feedback(*forward) : std::move(forward);
  return loop ? std::optional(*std::move(loop)) : std::nullopt;
}

/// P(0) C(0)/(1 + P(0) C(0)) or P(0)/(1 + P(0) C(0)), of integrators the limit.
double final_value(const TransferFunction& P, const TransferFunction& C, LoopStep step) {
  const double p = P.dc_gain();
  const double c = C.dc_gain();
  if (std::isinf(c)) {
    // An integral: the output follows, and no load is left, unless the plant has a zero there.
    return step == LoopStep::reference && p != 0.0 ? 1.0 : 0.0;
  }
  if (std::isinf(p)) {
    return step == LoopStep::reference ? (c != 0.0 ? 1.0 : 0.0) : 1.0 / c;
  }
  return (step == LoopStep::reference ? p * c : p) / (1.0 + p * c);
}

std::optional<LoopMotion> sampled(const TransferFunction& plant, const TransferFunction& controller,
                                  LoopStep step, double last) {
  const double T = plant.period()->si();
  ContinuousSystem<> P = plant.to_state_space();
  const auto periods = static_cast<Index>(std::lround(plant.delay() / T));
  if (periods > 0) {
    // Inputs on their way are states.
    ContinuousSystem<> late{MatrixXd::Zero(periods, periods), MatrixXd::Zero(periods, 1),
                            MatrixXd::Zero(1, periods), MatrixXd::Zero(1, 1)};
    late.A.diagonal(-1).setOnes();
    late.B(0, 0) = 1.0;
    late.C(0, periods - 1) = 1.0;
    auto both = series(late, P);
    if (!both) {
      return std::nullopt;
    }
    P = *std::move(both);
  }
  const auto loop = closed(P, controller.to_state_space(), step);
  if (!loop) {
    return std::nullopt;
  }
  return settled(64, [&](std::size_t steps) {
    LoopMotion motion;
    motion.final_value = last;
    VectorXd x = VectorXd::Zero(loop->A.rows());
    for (std::size_t k = 0; k <= steps; ++k) {
      motion.times.push_back(static_cast<double>(k) * T);
      motion.values.push_back(loop->C.row(0).dot(x) + loop->D(0, 0));
      x = (loop->A * x + loop->B).eval();
    }
    return motion;
  });
}

std::optional<LoopMotion> undelayed(const TransferFunction& plant,
                                    const TransferFunction& controller, LoopStep step,
                                    double last) {
  const auto loop = closed(plant.to_state_space(), controller.to_state_space(), step);
  if (!loop) {
    return std::nullopt;
  }
  const Index n = loop->A.rows();
  const Eigen::VectorXcd poles = eigenvalues_of(loop->A);
  double slowest = std::numeric_limits<double>::infinity();
  double fastest = 0.0;
  for (const auto& pole : poles) {
    slowest = std::min(slowest, -pole.real());
    fastest = std::max(fastest, std::abs(pole));
  }
  if (n == 0 || !(slowest > 0.0)) {
    return std::nullopt;
  }
  const double end = 36.0 / slowest;
  const double count = std::clamp(end * fastest / 0.1, 2000.0, 100'000.0);
  const auto steps = static_cast<std::size_t>(count);
  const double h = end / count;
  MatrixXd M = MatrixXd::Zero(n + 1, n + 1);
  M.topLeftCorner(n, n) = h * loop->A;
  M.topRightCorner(n, 1) = h * loop->B;
  const auto E = expm(M);
  if (!E) {
    return std::nullopt;
  }
  LoopMotion motion;
  motion.final_value = last;
  VectorXd x = VectorXd::Zero(n + 1);
  x(n) = 1.0;
  VectorXd next(n + 1);
  for (std::size_t k = 0; k <= steps; ++k) {
    motion.times.push_back(static_cast<double>(k) * h);
    motion.values.push_back(loop->C.row(0).dot(x.head(n)) + loop->D(0, 0));
    motion.slopes.push_back(loop->C.row(0).dot(loop->A * x.head(n) + loop->B.col(0)));
    next.noalias() = *E * x;
    x.swap(next);
  }
  return motion;
}

/// x' = A x + b v(t - θ) + r of [plant; controller], v = C x + d what enters the delay.
class DelayedLoop {
 public:
  DelayedLoop(const TransferFunction& plant, const TransferFunction& controller, LoopStep step)
      : delay_(plant.delay()) {
    const ContinuousSystem<> P = plant.to_state_space();
    const ContinuousSystem<> K = controller.to_state_space();
    const Index n = P.A.rows();
    const Index q = K.A.rows();
    A_ = MatrixXd::Zero(n + q, n + q);
    A_.topLeftCorner(n, n) = P.A;
    A_.bottomRightCorner(q, q) = K.A;
    A_.bottomLeftCorner(q, n) = -product(K.B, P.C);
    b_ = VectorXd::Zero(n + q);
    b_.head(n) = P.B.col(0);
    r_ = VectorXd::Zero(n + q);
    v_ = VectorXd::Zero(n + q);
    v_.head(n) = -K.D(0, 0) * P.C.row(0).transpose();
    v_.tail(q) = K.C.row(0).transpose();
    y_ = VectorXd::Zero(n + q);
    y_.head(n) = P.C.row(0).transpose();
    if (step == LoopStep::reference) {
      r_.tail(q) = K.B.col(0);
      d_ = K.D(0, 0);
    } else {
      d_ = 1.0;
    }
    v_A_ = A_.transpose() * v_;
    y_A_ = A_.transpose() * y_;
    double fastest = 0.0;
    for (const auto& pole : eigenvalues_of(A_)) {
      fastest = std::max(fastest, std::abs(pole));
    }
    parts_ = static_cast<std::size_t>(std::clamp(std::ceil(delay_ * fastest / 0.05), 8.0, 4000.0));
    h_ = delay_ / static_cast<double>(parts_);
    // [x; p₀ … p₃; 1], p₀ the delayed input and pⱼ its derivatives by t/h.
    const Index size = n + q;
    MatrixXd M = MatrixXd::Zero(size + 5, size + 5);
    M.topLeftCorner(size, size) = h_ * A_;
    M.block(0, size, size, 1) = h_ * b_;
    M.block(size, size + 1, 3, 3).setIdentity();
    M.topRightCorner(size, 1) = h_ * r_;
    auto E = expm(M);
    ready_ = E.has_value();
    if (ready_) {
      E_ = E->topRows(size);
    }
  }

  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] std::size_t parts() const { return parts_; }

  [[nodiscard]] LoopMotion run(std::size_t steps, double last) const {
    LoopMotion motion;
    motion.final_value = last;
    const Index size = A_.rows();
    VectorXd z = VectorXd::Zero(size + 5);
    z(size + 4) = 1.0;
    VectorXd next(size);
    std::vector<std::array<double, 4>> pieces;  // v and h dv/dt at both ends of each step.
    pieces.reserve(steps);
    for (std::size_t k = 0; k <= steps; ++k) {
      // The cubic of the step one delay ago; before the start nothing.
      std::array<double, 4> c{};
      if (k >= parts_) {
        const auto& [v0, s0, v1, s1] = pieces[k - parts_];
        c = {v0, s0, 3.0 * (v1 - v0) - 2.0 * s0 - s1, 2.0 * (v0 - v1) + s0 + s1};
      }
      motion.times.push_back(static_cast<double>(k) * h_);
      motion.values.push_back(y_.dot(z.head(size)));
      motion.slopes.push_back(slope(y_A_, y_, z, c[0]));
      if (k == steps) {
        break;
      }
      const double v_begin = v_.dot(z.head(size)) + d_;
      const double s_begin = h_ * slope(v_A_, v_, z, c[0]);
      z.segment(size, 4) << c[0], c[1], 2.0 * c[2], 6.0 * c[3];
      next.noalias() = E_ * z;
      z.head(size) = next;
      const double s_end = h_ * slope(v_A_, v_, z, c[0] + c[1] + c[2] + c[3]);
      pieces.push_back({v_begin, s_begin, v_.dot(next) + d_, s_end});
    }
    return motion;
  }

 private:
  /// d(w'x)/dt of [x; …]. @param w_A  Aᵀw.
  [[nodiscard]] double slope(const VectorXd& w_A, const VectorXd& w, const VectorXd& z,
                             double delayed) const {
    return w_A.dot(z.head(w.size())) + delayed * w.dot(b_) + w.dot(r_);
  }

  double delay_;
  MatrixXd A_, E_;
  VectorXd b_, r_, v_, y_;
  VectorXd v_A_, y_A_;
  double d_ = 0.0;
  double h_ = 0.0;
  std::size_t parts_ = 0;
  bool ready_ = false;
};

/// Pieces of a motion between its samples, as cubics by values and slopes; straight without these.
struct Piece {
  double begin, length, y0, s0, y1, s1;

  [[nodiscard]] double at(double x) const {
    const double c2 = 3.0 * (y1 - y0) - 2.0 * s0 - s1;
    const double c3 = 2.0 * (y0 - y1) + s0 + s1;
    return y0 + x * (s0 + x * (c2 + x * c3));
  }
  /// Where the slope vanishes within, if once.
  [[nodiscard]] std::optional<double> top() const {
    if ((s0 > 0.0) == (s1 > 0.0)) {
      return std::nullopt;
    }
    const double c2 = 3.0 * (y1 - y0) - 2.0 * s0 - s1;
    const double c3 = 2.0 * (y0 - y1) + s0 + s1;
    double low = 0.0;
    double high = 1.0;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      const double slope = s0 + middle * (2.0 * c2 + 3.0 * middle * c3);
      ((slope > 0.0) == (s0 > 0.0) ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  /// Where it passes a level that its ends are on either side of.
  [[nodiscard]] double crossing(double level) const {
    double low = 0.0;
    double high = 1.0;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      ((at(middle) > level) == (y0 > level) ? low : high) = middle;
    }
    return begin + 0.5 * (low + high) * length;
  }
};

Piece piece(const LoopMotion& motion, std::size_t i) {
  const double length = motion.times[i + 1] - motion.times[i];
  const double y0 = motion.values[i];
  const double y1 = motion.values[i + 1];
  if (motion.slopes.empty()) {
    return {motion.times[i], length, y0, y1 - y0, y1, y1 - y0};
  }
  return {motion.times[i],           length, y0,
          length * motion.slopes[i], y1,     length * motion.slopes[i + 1]};
}

/// From where on |y - centre| stays within the band.
double settling_time(const LoopMotion& motion, double centre, double band) {
  const bool discrete = motion.slopes.empty();
  for (std::size_t i = motion.values.size(); i-- > 0;) {
    if (std::abs(motion.values[i] - centre) > band) {
      if (i + 1 == motion.values.size() || discrete) {
        return i + 1 < motion.times.size() ? motion.times[i + 1] : motion.times[i];
      }
      const double level = motion.values[i] > centre ? centre + band : centre - band;
      return piece(motion, i).crossing(level);
    }
  }
  return 0.0;
}

}  // namespace

std::optional<LoopMotion> loop_motion(const TransferFunction& plant,
                                      const TransferFunction& controller, LoopStep step) {
  const double last = final_value(plant, controller, step);
  if (!std::isfinite(last)) {
    return std::nullopt;
  }
  if (plant.period()) {
    return sampled(plant, controller, step, last);
  }
  if (plant.delay() == 0.0) {
    return undelayed(plant, controller, step, last);
  }
  if (plant.relative_degree() == 0) {
    return std::nullopt;
  }
  const DelayedLoop loop(plant, controller, step);
  if (!loop.ready()) {
    return std::nullopt;
  }
  return settled(16 * loop.parts(), [&](std::size_t steps) { return loop.run(steps, last); });
}

classical::StepMetrics reference_metrics(const LoopMotion& motion) {
  classical::StepMetrics metrics;
  metrics.final_value = motion.final_value;
  if (motion.final_value == 0.0) {
    return metrics;
  }
  const double end = motion.final_value;
  std::optional<double> ten;
  std::optional<double> ninety;
  double peak = motion.values.front() / end;
  double peak_time = 0.0;
  double least = std::min(0.0, peak);
  for (std::size_t i = 0; i + 1 < motion.values.size(); ++i) {
    Piece p = piece(motion, i);
    p.y0 /= end;
    p.y1 /= end;
    p.s0 /= end;
    p.s1 /= end;
    const auto reaches = [&](std::optional<double>& first, double level) {
      if (!first && p.y0 >= level) {
        first = p.begin;
      } else if (!first && p.y1 >= level) {
        first = motion.slopes.empty() ? p.begin + p.length : p.crossing(level);
      }
    };
    reaches(ten, 0.1);
    reaches(ninety, 0.9);
    const auto take = [&](double value, double time) {
      if (value > peak) {
        peak = value;
        peak_time = time;
      }
      least = std::min(least, value);
    };
    if (const auto top = motion.slopes.empty() ? std::nullopt : p.top()) {
      take(p.at(*top), p.begin + *top * p.length);
    }
    take(p.y1, p.begin + p.length);
  }
  if (ten && ninety) {
    metrics.rise_time = *ninety - *ten;
  }
  if (motion.settled) {
    metrics.settling_time = settling_time(motion, end, 0.02 * std::abs(end));
  }
  const bool beyond = peak > 1.0 + 1e-9;
  metrics.overshoot = beyond ? peak - 1.0 : 0.0;
  metrics.undershoot = least < -1e-9 ? -least : 0.0;
  metrics.peak = beyond ? peak * end : end;
  if (beyond) {
    metrics.peak_time = peak_time;
  }
  return metrics;
}

LoadResponse load_metrics(const LoopMotion& motion) {
  LoadResponse response;
  response.final_value = motion.final_value;
  const double end = motion.final_value;
  const auto take = [&](double value, double time) {
    if (std::abs(value) > std::abs(response.peak)) {
      response.peak = value;
      response.peak_time = time;
    }
  };
  take(motion.values.front(), 0.0);
  for (std::size_t i = 0; i + 1 < motion.values.size(); ++i) {
    Piece p = piece(motion, i);
    if (motion.slopes.empty()) {
      // Samples are held.
      const double area = (p.y0 - end) * p.length;
      response.integral += area;
      response.absolute_integral += std::abs(area);
      take(p.y1, p.begin + p.length);
      continue;
    }
    if (const auto top = p.top()) {
      take(p.at(*top), p.begin + *top * p.length);
    }
    take(p.y1, p.begin + p.length);
    p.y0 -= end;
    p.y1 -= end;
    const auto area = [&](double a, double b) {
      // Exact for cubics.
      return (b - a) * p.length * (p.at(a) + 4.0 * p.at(0.5 * (a + b)) + p.at(b)) / 6.0;
    };
    response.integral += area(0.0, 1.0);
    if ((p.y0 > 0.0) != (p.y1 > 0.0)) {
      const double middle = (p.crossing(0.0) - p.begin) / p.length;
      response.absolute_integral += std::abs(area(0.0, middle)) + std::abs(area(middle, 1.0));
    } else {
      response.absolute_integral += std::abs(area(0.0, 1.0));
    }
  }
  if (motion.settled) {
    response.recovery_time = settling_time(motion, end, 0.02 * std::abs(response.peak));
  }
  return response;
}

}  // namespace flyball::detail
