#include <flyball/classical/delay_response.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/collocation.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/balance.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::detail::product;

namespace {

constexpr int points = 12;
constexpr double tolerance = 1e-12;
constexpr Index most_states = 200;
constexpr long most_steps = 2'000'000;
constexpr Index most_samples = 10'000'000;
constexpr double most_delays = 1e6;
/// Kinks of a higher derivative are left to the choice of the step.
constexpr int smooth = 7;
constexpr std::size_t most_breaks = 200'000;

/// What moves a system: samples, or an impulse at t = 0.
struct Drive {
  const MatrixXd& u;  ///< samples x inputs
  InputShape shape = InputShape::held;
  Index impulse = -1;
};

/// The orders of the derivatives that jump at an instant, and impulses among the delayed signals.
struct Break {
  int input = smooth;
  Eigen::VectorXi delayed;
  VectorXd impulse;  ///< Empty without one.
};

/// Polynomials of the delayed signals' sources over a step.
struct Segment {
  double begin = 0.0;
  double length = 0.0;
  MatrixXd z;  ///< p x delays, Legendre coefficients.
};

/// Values at the nodes of a step: x = P x(0) + Q [u; w], the inputs' values at the nodes below each
/// other.
struct Propagator {
  MatrixXd P;
  MatrixXd Q;
};

class Motion {
 public:
  Motion(const DelaySystem& system, Drive drive, double step, Index samples)
      : form_(system.form()),
        drive_(drive),
        step_(step),
        end_(step * static_cast<double>(samples - 1)),
        samples_(samples),
        collocation_(detail::radau_collocation(points)) {
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
    B_ = beside(form_.B1, form_.B2);
    shortest_ =
        form_.delays.size() > 0 ? form_.delays.minCoeff() : std::numeric_limits<double>::infinity();
  }

  Expected<DelayResponse> run(const VectorXd& x0) {
    x_ = scaling_.cwiseInverse().asDiagonal() * x0;
    response_.time = VectorXd::LinSpaced(samples_, 0.0, end_);
    response_.x.resize(samples_, x_.size());
    response_.y.resize(samples_, form_.C1.rows());
    largest_x_ = x_.cwiseAbs();
    largest_z_.setZero(form_.delays.size());
    schedule_inputs();
    const double rate = form_.A.size() > 0 ? form_.A.cwiseAbs().rowwise().sum().maxCoeff() : 0.0;
    wanted_ = std::min({shortest_, std::max(end_, step_), rate > 0.0 ? 1.0 / rate : HUGE_VAL});
    long steps = 0;
    while (next_sample_ < samples_) {
      pass_breaks();
      // The last sample has no step behind it.
      if (next_sample_ + 1 == samples_ && sample_time(next_sample_) <= t_ + same()) {
        take_sample(t_, t_, x_);
        break;
      }
      const double until =
          std::min(breaks_.empty() ? HUGE_VAL : breaks_.begin()->first, std::max(end_, t_ + step_));
      FLYBALL_CHECK(cross(until, steps));
    }
    if (!response_.y.allFinite() || !response_.x.allFinite()) {
      return refusal(ArgumentError::not_finite, "response", "the response")
          .got("beyond the largest double")
          .hint("ask for a shorter time");
    }
    return std::move(response_);
  }

 private:
  static MatrixXd beside(const MatrixXd& left, const MatrixXd& right) {
    MatrixXd both(left.rows(), left.cols() + right.cols());
    both << left, right;
    return both;
  }

  [[nodiscard]] double sample_time(Index k) const { return step_ * static_cast<double>(k); }
  /// Instants that are the same but for the rounding of sums of delays.
  [[nodiscard]] double same() const { return 1e-13 * (end_ + step_) + 1e-300; }

  Break& break_at(double time) {
    const auto found = breaks_.lower_bound(time - same());
    if (found != breaks_.end() && found->first <= time + same()) {
      return found->second;
    }
    Break& made = breaks_[time];
    made.delayed = Eigen::VectorXi::Constant(form_.delays.size(), smooth);
    return made;
  }

  void schedule_inputs() {
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

  [[nodiscard]] double slope(Index k, Index j) const {
    return k + 1 < samples_ ? (drive_.u(k + 1, j) - drive_.u(k, j)) / step_ : 0.0;
  }

  /// u(t) on the step that begins at t₀.
  [[nodiscard]] VectorXd input(double begin, double t) const {
    if (drive_.impulse >= 0) {
      return VectorXd::Zero(form_.B1.cols());
    }
    const auto k = std::clamp<Index>(static_cast<Index>(std::floor((begin + same()) / step_)), 0,
                                     samples_ - 1);
    VectorXd u = drive_.u.row(k).transpose();
    if (drive_.shape == InputShape::linear) {
      for (Index j = 0; j < u.size(); ++j) {
        u(j) += slope(k, j) * (t - sample_time(k));
      }
    }
    return u;
  }

  /// Jumps that arrive now, and where they arrive next.
  void pass_breaks() {
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

  void add_output_impulse(const VectorXd& strength) {
    if (!strength.isZero(0.0)) {
      response_.impulses.push_back({t_, strength});
    }
  }

  /// wᵢ on the step that begins at t₀, at t: zᵢ(t - τᵢ) from the segment that holds the step.
  [[nodiscard]] double delayed(Index i, double begin, double t) const {
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
    return detail::legendre(points, x).dot(segment.z.col(i));
  }

  const Propagator& propagator(double length) {
    const auto key = std::llround(std::ldexp(std::log2(length), 43));
    if (const auto found = propagators_.find(key); found != propagators_.end()) {
      return found->second;
    }
    if (propagators_.size() > 256) {
      propagators_.clear();
    }
    // (I - h/2 a ⊗ A) X = 1 ⊗ x(0) + h/2 a ⊗ B [u; w].
    const Index n = x_.size();
    const Index q = B_.cols();
    MatrixXd M = MatrixXd::Identity(points * n, points * n);
    MatrixXd right = MatrixXd::Zero(points * n, n + points * q);
    for (Index i = 0; i < points; ++i) {
      right.block(i * n, 0, n, n).setIdentity();
      for (Index j = 0; j < points; ++j) {
        const double a = 0.5 * length * collocation_.integrals(i, j);
        M.block(i * n, j * n, n, n) -= a * form_.A;
        right.block(i * n, n + j * q, n, q) = a * B_;
      }
    }
    const MatrixXd X = flyball::detail::solve_linear(M, right);
    return propagators_.emplace(key, Propagator{X.leftCols(n), X.rightCols(points * q)})
        .first->second;
  }

  /// From here to a place, in equal steps of at most the wanted length.
  Expected<void> cross(double until, long& steps) {
    while (until - t_ > same() && next_sample_ < samples_) {
      const double distance = until - t_;
      const double parts = std::ceil(distance / std::min(wanted_, shortest_) * (1.0 - 1e-9));
      const double length = distance / std::max(parts, 1.0);
      if (++steps > most_steps) {
        return refusal(SystemError::no_convergence, "response", "the motion")
            .got(flyball::detail::format("not followed beyond {} s by {} steps", t_, most_steps))
            .hint("ask for a shorter time, or leave out what is fast");
      }
      if (!take_step(length, parts <= 1.0 ? until : t_ + length)) {
        wanted_ = 0.5 * length;
        patience_ = std::min(2 * patience_, 64);
        accepted_ = 0;
        if (!(wanted_ > 1e-14 * (end_ + step_))) {
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

  /// False where the step is too long.
  bool take_step(double length, double end) {
    const Index n = x_.size();
    const Index m = form_.B1.cols();
    const Index k = form_.delays.size();
    const Index q = m + k;
    VectorXd inputs(points * q);
    for (Index i = 0; i < points; ++i) {
      const double t = t_ + 0.5 * (1.0 + collocation_.nodes(i)) * length;
      inputs.segment(i * q, m) = input(t_, t);
      for (Index j = 0; j < k; ++j) {
        inputs(i * q + m + j) = delayed(j, t_, t);
      }
    }
    VectorXd X = VectorXd::Zero(0);
    if (n > 0) {
      const Propagator& by = propagator(length);
      X = by.P * x_ + by.Q * inputs;
    }
    const Eigen::Map<const MatrixXd> states(X.data(), n, points);
    const Eigen::Map<const MatrixXd> drive(inputs.data(), q, points);
    const MatrixXd x_modes = product(collocation_.modes, MatrixXd(states.transpose()));  // p x n
    MatrixXd z(points, k);
    z = product(MatrixXd(states.transpose()), form_.C2.transpose()) +
        product(MatrixXd(drive.topRows(m).transpose()), form_.D21.transpose()) +
        product(MatrixXd(drive.bottomRows(k).transpose()), form_.D22.transpose());
    const MatrixXd z_modes = product(collocation_.modes, z);
    // What rounding leaves of larger terms is no coefficient.
    const auto resolved = [](const MatrixXd& modes, const MatrixXd& values, const VectorXd& largest,
                             const VectorXd& terms) {
      for (Index j = 0; j < modes.cols(); ++j) {
        const double size = std::max(largest(j), values.col(j).cwiseAbs().maxCoeff());
        if (!(modes.col(j).tail(2).cwiseAbs().maxCoeff() <= tolerance * size + 1e-14 * terms(j))) {
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
    for (Index j = 0; j < n; ++j) {
      largest_x_(j) = std::max(largest_x_(j), at_nodes.col(j).cwiseAbs().maxCoeff());
    }
    for (Index j = 0; j < k; ++j) {
      largest_z_(j) = std::max(largest_z_(j), z.col(j).cwiseAbs().maxCoeff());
    }
    segments_.push_back({t_, length, z_modes});
    while (next_sample_ < samples_ && sample_time(next_sample_) < end - same()) {
      const double t = sample_time(next_sample_);
      const double place = 2.0 * (t - t_) / length - 1.0;
      const VectorXd x =
          t <= t_ + same() ? x_ : VectorXd(x_modes.transpose() * detail::legendre(points, place));
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

  void take_sample(double begin, double t, const VectorXd& x) {
    VectorXd y = form_.C1 * x + form_.D11 * input(begin, t);
    for (Index j = 0; j < form_.delays.size(); ++j) {
      y += form_.D12.col(j) * delayed(j, begin, t);
    }
    response_.y.row(next_sample_) = y.transpose();
    response_.x.row(next_sample_) = (scaling_.asDiagonal() * x).transpose();
    ++next_sample_;
  }

  DelayForm form_;
  Drive drive_;
  double step_;
  double end_;
  Index samples_;
  detail::Collocation collocation_;
  VectorXd scaling_{};
  MatrixXd B_{};
  double shortest_ = 0.0;
  double wanted_ = 0.0;  ///< Length of a step.
  int patience_ = 3;
  int accepted_ = 0;
  double t_ = 0.0;
  VectorXd x_{};
  VectorXd start_impulse_{};
  VectorXd largest_x_{};
  VectorXd largest_z_{};
  std::map<double, Break> breaks_{};
  std::deque<Segment> segments_{};
  std::map<long long, Propagator> propagators_{};
  Index next_sample_ = 0;
  DelayResponse response_{};
};

/// A discrete system is stepped.
Expected<DelayResponse> stepped(const DelaySystem& system, const Drive& drive, const VectorXd& x0) {
  const DelayForm& f = system.form();
  const double period = system.period()->si();
  const Index samples = drive.u.rows();
  const Index k = f.delays.size();
  std::vector<Index> lengths;
  for (Index i = 0; i < k; ++i) {
    lengths.push_back(static_cast<Index>(
        std::min(std::round(f.delays(i) / period), static_cast<double>(samples))));
  }
  DelayResponse response;
  response.time = VectorXd::LinSpaced(samples, 0.0, period * static_cast<double>(samples - 1));
  response.x.resize(samples, x0.size());
  response.y.resize(samples, f.C1.rows());
  MatrixXd z(samples, k);
  VectorXd x = x0;
  VectorXd w(k);
  for (Index t = 0; t < samples; ++t) {
    for (Index i = 0; i < k; ++i) {
      const Index then = t - lengths[static_cast<std::size_t>(i)];
      w(i) = then < 0 ? 0.0 : z(then, i);
    }
    const VectorXd u = drive.u.row(t).transpose();
    response.x.row(t) = x.transpose();
    response.y.row(t) = (f.C1 * x + f.D11 * u + f.D12 * w).transpose();
    z.row(t) = (f.C2 * x + f.D21 * u + f.D22 * w).transpose();
    x = (f.A * x + f.B1 * u + f.B2 * w).eval();
  }
  FLYBALL_CHECK(Checks("response").finite(response.x, "x").finite(response.y, "y"));
  return response;
}

Expected<DelayResponse> respond(const DelaySystem& system, const Drive& drive, const MatrixRef& x0,
                                double step) {
  constexpr std::string_view where = "response";
  FLYBALL_CHECK(Checks(where)
                    .positive(step, "step", "s")
                    .within(static_cast<double>(drive.u.rows()), 1.0,
                            static_cast<double>(most_samples), "samples")
                    .shape(drive.u, drive.u.rows(), system.inputs(), "u", "samples x inputs")
                    .shape(x0, system.states(), 1, "x0", "states x 1")
                    .finite(drive.u, "u")
                    .finite(x0, "x0"));
  if (system.period()) {
    if (std::abs(step - system.period()->si()) > 1e-12 * step) {
      return refusal(ArgumentError::out_of_range, where, "step")
          .got(flyball::detail::format("{} s", step))
          .expected(flyball::detail::format("the system's period, {} s", system.period()->si()));
    }
    return stepped(system, drive, x0);
  }
  if (system.states() > most_states) {
    return refusal(ArgumentError::out_of_range, where, "the number of states")
        .got(std::to_string(system.states()))
        .expected(flyball::detail::format("at most {}", most_states));
  }
  const double end = step * static_cast<double>(drive.u.rows());
  if (system.has_delay() && system.delays().minCoeff() * most_delays < end) {
    return refusal(ArgumentError::out_of_range, where, "the shortest delay")
        .got(flyball::detail::format("{} s", system.delays().minCoeff()))
        .expected(flyball::detail::format("at least a millionth of the time, {} s", end))
        .hint("ask for a shorter time, or leave the delay out");
  }
  return Motion(system, drive, step, drive.u.rows()).run(x0);
}

/// The instants that were asked for, or those that the poles of the Padé approximation ask for.
Expected<ResponseTimes> chosen(const DelaySystem& system,
                               const std::optional<ResponseTimes>& times) {
  if (times) {
    FLYBALL_CHECK(check_within(static_cast<double>(times->samples), 1.0,
                               static_cast<double>(most_samples), "response", "samples"));
    return *times;
  }
  if (system.period()) {
    FLYBALL_TRY(const auto states, system.to_discrete());
    if (states.A.size() == 0) {
      return response_times({}, states.period);
    }
    return analyze_modes(states).map(
        [&](const ModalAnalysis& modes) { return response_times(modes, states.period); });
  }
  const double late = system.has_delay() ? system.delays().sum() : 0.0;
  FLYBALL_TRY(const auto rational,
              system.has_delay_in_loop()
                  ? system.pade(5)
                  : Expected<ContinuousSystem<>>(ContinuousSystem<>{
                        system.form().A, system.form().B1, system.form().C1, system.form().D11}));
  ResponseTimes found{Time(0.0), 601};
  double end = late > 0.0 ? late : 1.0;
  if (rational.A.size() > 0) {
    FLYBALL_TRY(const auto modes, analyze_modes(rational));
    const ResponseTimes own = response_times(modes);
    end = own.step.si() * static_cast<double>(own.samples - 1) + late;
    found.samples = own.samples;
  }
  found.step = Time(end / static_cast<double>(found.samples - 1));
  return found;
}

Expected<void> check_input(const DelaySystem& system, Index input) {
  return check_within(static_cast<double>(input), 0.0, static_cast<double>(system.inputs() - 1),
                      "response", "input");
}

}  // namespace

Expected<DelayResponse> forced_response(const DelaySystem& system, const MatrixRef& u,
                                        const MatrixRef& x0, Time step, InputShape shape) {
  const MatrixXd samples = u;
  return respond(system, Drive{samples, shape}, x0, step.si());
}

Expected<DelayResponse> initial_response(const DelaySystem& system, const MatrixRef& x0,
                                         const std::optional<ResponseTimes>& times) {
  FLYBALL_TRY(const auto at, chosen(system, times));
  const MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  return respond(system, Drive{u}, x0, at.step.si());
}

Expected<DelayResponse> step_response(const DelaySystem& system, Index input,
                                      const std::optional<ResponseTimes>& times) {
  FLYBALL_CHECK(check_input(system, input));
  FLYBALL_TRY(const auto at, chosen(system, times));
  MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  u.col(input).setOnes();
  return respond(system, Drive{u}, VectorXd::Zero(system.states()), at.step.si());
}

Expected<DelayResponse> impulse_response(const DelaySystem& system, Index input,
                                         const std::optional<ResponseTimes>& times) {
  FLYBALL_CHECK(check_input(system, input));
  FLYBALL_TRY(const auto at, chosen(system, times));
  MatrixXd u = MatrixXd::Zero(at.samples, system.inputs());
  u(0, input) = system.period() ? 1.0 : 0.0;
  return respond(system, Drive{u, InputShape::held, system.period() ? -1 : input},
                 VectorXd::Zero(system.states()), at.step.si());
}

}  // namespace flyball::classical
