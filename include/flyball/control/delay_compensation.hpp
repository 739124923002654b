#pragma once

#include <algorithm>
#include <vector>

#include <flyball/control/latency.hpp>
#include <flyball/control/state_feedback.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/input_delay.hpp>

namespace flyball {

/// The gains for a state that is `latency` L old, from the start on (B.12): at step k < L/T, while
/// inputs from before the start (zeros) are still on their way, K (A - BK)^k A^(L/T - k); from then
/// on K (A - BK)^(L/T), which `compensate_latency` gives alone.
///
/// @param K  m x n, designed for no latency. @param A, B  Discrete. @param period  T, s.
/// @param latency  L, s, at most 10 000 periods; it need not be a multiple of T.
/// @return ⌈L/T⌉ + 1 gains; the last one is for all later steps.
/// @errors ArgumentError; MatrixFunctionError::no_real_power for a fraction of a period where a
/// pole
///         of the plant or the closed loop is real and negative: round the latency to whole
///         periods.
/// Source: book, section B.4.2, (B.10)-(B.12).
[[nodiscard]] Expected<std::vector<Eigen::MatrixXd>> latency_gains(const MatrixRef& K,
                                                                   const MatrixRef& A,
                                                                   const MatrixRef& B, Time period,
                                                                   Time latency);

/// The gain of a continuous controller at the time t after its start (B.9):
/// K e^{(A - BK)t} e^{A(L - t)} for t < L, and K e^{(A - BK)L} from then on.
/// @param A, B  Continuous. @param latency  L, s. @param elapsed  t, s, not negative.
/// @errors ArgumentError; those of `expm`. Source: book, section B.4.1, (B.7)-(B.9).
[[nodiscard]] Expected<Eigen::MatrixXd> continuous_latency_gain(const MatrixRef& K,
                                                                const MatrixRef& A,
                                                                const MatrixRef& B, Time latency,
                                                                Time elapsed);

/// State feedback on a delayed state with the gains of (B.12), through the start and after it.
///
/// Run-time object: noexcept, finite and within the limits whatever comes; for sizes known at
/// compile time, `calculate` does not allocate.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class DelayCompensatedFeedback {
 public:
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using Gain = Eigen::Matrix<double, Inputs, States>;

  /// @param u_min, u_max  Limits of each input; infinite for none. @errors As `latency_gains`.
  template <int Outputs>
  [[nodiscard]] static Expected<DelayCompensatedFeedback> create(
      const DiscreteSystem<States, Inputs, Outputs>& plant, const Gain& K, Time latency,
      const InputVector& u_min, const InputVector& u_max) {
    return latency_gains(K, plant.A, plant.B, plant.period, latency)
        .map([&](const std::vector<Eigen::MatrixXd>& gains) {
          return DelayCompensatedFeedback(gains, u_min, u_max);
        });
  }

  /// One period. @param x  The state that is L old. @param r  Its reference. @param u_ff  Added
  /// before the limits. @return u.
  [[nodiscard]] InputVector calculate(const StateVector& x, const StateVector& r,
                                      const InputVector& u_ff) noexcept {
    const StateVector error = r - x;
    InputVector u = u_ff;
    u.noalias() += gains_[step_] * error;
    step_ += step_ + 1 < gains_.size() ? 1 : 0;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      u(i) = detail::limited(u(i), u_min_(i), u_max_(i));
    }
    return u;
  }

  /// Starts again: no input is on its way.
  void reset() noexcept { step_ = 0; }

  /// The gain of the next step.
  [[nodiscard]] const Gain& K() const noexcept { return gains_[step_]; }
  /// The gain when the delay has passed.
  [[nodiscard]] const Gain& steady_K() const noexcept { return gains_.back(); }

 private:
  DelayCompensatedFeedback(const std::vector<Eigen::MatrixXd>& gains, const InputVector& u_min,
                           const InputVector& u_max)
      : gains_(gains.begin(), gains.end()), u_min_(u_min), u_max_(u_max) {}

  std::vector<Gain> gains_;
  InputVector u_min_;
  InputVector u_max_;
  std::size_t step_ = 0;
};

/// Where a plant will be when the input that is computed now begins to act: the measured state,
/// carried through the delay by the inputs that were really applied.
///
/// (B.10) assumes that those were -Kx; this remembers them, so that limits, feedforwards and the
/// start need no special case, and a loop with u = K (r - predict(x)) has exactly the poles of the
/// loop without delay, whole periods or not. Run-time object: noexcept, finite whatever comes; for
/// sizes known at compile time nothing allocates after `create`. Cost of a prediction: two products
/// an input that is on its way.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
class DelayPredictor {
 public:
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using StateMatrix = Eigen::Matrix<double, States, States>;
  using InputMatrix = Eigen::Matrix<double, States, Inputs>;

  /// @param plant  Continuous. @param period  T, s. @param latency  s, of sensor and actuator
  /// together, at most 10 000 periods.
  /// @errors As `discretize_delayed_input`.
  template <int Outputs>
  [[nodiscard]] static Expected<DelayPredictor> create(
      const ContinuousSystem<States, Inputs, Outputs>& plant, Time period, Time latency) {
    auto delayed = discretize_delayed_input(plant.A, plant.B, period, latency);
    if (!delayed) {
      return tl::unexpected(delayed.error());
    }
    const double fraction = std::max(0.0, latency.si() - delayed->whole_periods * period.si());
    DiscretizedMatrices rest{StateMatrix::Identity(plant.A.rows(), plant.A.cols()),
                             InputMatrix::Zero(plant.B.rows(), plant.B.cols())};
    if (fraction > 0.0 && delayed->B_1.norm() > 0.0) {
      auto part = discretize_zoh(plant.A, plant.B, Time(fraction));
      if (!part) {
        return tl::unexpected(part.error());
      }
      rest = std::move(*part);
    }
    return DelayPredictor(*delayed, rest);
  }

  /// @param x  The state as measured (or estimated): `latency` before the input that is computed
  /// now acts. @return The state at that time. Entries of x that are NaN count as zero: leave out a
  /// measurement that is not there before this, as an observer does; what is beyond
  /// `largest_signal` is cut to it.
  [[nodiscard]] StateVector predict(const StateVector& x) const noexcept {
    const StateVector from = within(x);
    const StateVector ahead = moved(from, [](const StateVector& state) { return state; });
    return is_signal(ahead) ? ahead : within(moved(from, &DelayPredictor::within));
  }

  /// The input that was sent now. @return  Whether it can be one: what is not finite is remembered
  /// as zero.
  bool sent(const InputVector& u) noexcept {
    applied_[next_] = u;
    detail::keep_signals(applied_[next_]);
    next_ = (next_ + 1) % applied_.size();
    return is_signal(u);
  }

  /// Of the inputs that are on their way the one that was sent first. Over the period after a
  /// sample the measured state moves by A x + B_0 u_0 + B_1 u_1, where u_1 is the one that is
  /// oldest before this sample's input is `sent`, and u_0 the one that is after it.
  [[nodiscard]] const InputVector& oldest() const noexcept { return applied_[next_]; }

  [[nodiscard]] const StateMatrix& A() const noexcept { return A_; }      ///< Over a period.
  [[nodiscard]] const InputMatrix& B_0() const noexcept { return B_0_; }  ///< Of the newer input.
  [[nodiscard]] const InputMatrix& B_1() const noexcept { return B_1_; }  ///< Of the older one.
  /// Over what the delay is longer than whole periods; the identity if it is not.
  [[nodiscard]] const StateMatrix& A_rest() const noexcept { return A_rest_; }
  [[nodiscard]] const InputMatrix& B_rest() const noexcept { return B_rest_; }
  /// How many inputs are on their way.
  [[nodiscard]] std::size_t on_the_way() const noexcept { return applied_.size(); }

  /// Nothing is on its way.
  void reset() noexcept {
    for (InputVector& u : applied_) {
      u.setZero();
    }
  }

 private:
  /// x_{j+1} = A x_j + B_0 u_{j-d} + B_1 u_{j-d-1} over the whole periods, each `kept`, then the
  /// fraction.
  template <class Kept>
  [[nodiscard]] StateVector moved(const StateVector& x, const Kept& kept) const noexcept {
    StateVector state = x;
    const std::size_t count = applied_.size();
    std::size_t older = next_;
    for (std::size_t j = 1; j < count; ++j) {
      const std::size_t newer = older + 1 < count ? older + 1 : 0;
      state = kept((A_ * state + B_0_ * applied_[newer] + B_1_ * applied_[older]).eval());
      older = newer;
    }
    return A_rest_ * state + B_rest_ * applied_[older];
  }

  [[nodiscard]] static StateVector within(const StateVector& x) noexcept {
    StateVector state = x;
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      state(i) = detail::cut(x(i));
    }
    return state;
  }

  DelayPredictor(const DelayedInputMatrices& delayed, const DiscretizedMatrices& rest)
      : A_(delayed.A),
        B_0_(delayed.B_0),
        B_1_(delayed.B_1),
        A_rest_(rest.A),
        B_rest_(rest.B),
        applied_(static_cast<std::size_t>(delayed.whole_periods) + 1,
                 InputVector::Zero(delayed.B_0.cols())) {}

  StateMatrix A_;
  InputMatrix B_0_;
  InputMatrix B_1_;
  StateMatrix A_rest_;
  InputMatrix B_rest_;
  std::vector<InputVector> applied_;  ///< A ring, oldest at `next_`.
  std::size_t next_ = 0;
};

}  // namespace flyball
