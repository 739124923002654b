#pragma once

#include <limits>

#include <flyball/core/expected.hpp>

namespace flyball {

/// Gains in parallel form: u = kp e + ki ∫e dτ + kd de/dt (2.4). A controller without a term has
/// that gain zero: P (2.1), PD (2.2), PI (2.3).
struct PidGains {
  double kp = 0.0;  ///< Input unit / output unit, such as V/m.
  double ki = 0.0;  ///< Input unit / (output unit s), such as V/(m s).
  double kd = 0.0;  ///< Input unit s / output unit, such as V s/m.

  friend bool operator==(const PidGains&, const PidGains&) = default;
};

/// How a controller keeps its integral from growing while the actuator is at its limit.
enum class AntiWindup {
  none,              ///< It grows; only integral_min and integral_max hold it.
  clamping,          ///< It does not move further into a limit that the output is at.
  back_calculation,  ///< It is driven back by (u - u_unlimited) / tracking_time.
};

/// Everything that a PID controller can be told besides its gains. The defaults are the plain
/// controller of Definition 2.4.1.
struct PidSettings {
  PidGains gains{};
  double period = 0.02;  ///< s, between two calls of `calculate`.
  /// The derivative of the measurement alone, -dy/dt, instead of the error's: a step of the
  /// reference then does not kick. A moving reference loses its velocity term.
  bool derivative_on_measurement = false;
  /// s, of the first-order low pass kd s/(τ s + 1); zero for none. A tenth to a fifth of kd/kp is
  /// usual.
  double derivative_time_constant = 0.0;
  double output_min = -std::numeric_limits<double>::infinity();
  double output_max = std::numeric_limits<double>::infinity();
  /// Limits of the integral term ki ∫e, in the output's unit.
  double integral_min = -std::numeric_limits<double>::infinity();
  double integral_max = std::numeric_limits<double>::infinity();
  AntiWindup anti_windup = AntiWindup::clamping;
  /// s, of back-calculation; zero for √(Ti Td), or Ti where there is no derivative.
  double tracking_time = 0.0;
  /// The integral is zero while |error| is above this.
  double integral_zone = std::numeric_limits<double>::infinity();
  /// The measurement is an angle that wraps after this much, usually 2π rad: the shorter way is the
  /// error. Zero for a measurement that does not wrap.
  double turn = 0.0;
};

/// A sampled PID controller.
///
/// With e_k = r_k - y_k:
///   I_k = I_{k-1} + ki T e_k                                  (backward rectangle)
///   D_k = (τ D_{k-1} + kd (e_k - e_{k-1})) / (τ + T)          (backward Euler of the filter)
///   u_k = clamp(kp e_k + I_k + D_k + feedforward)
/// The first call after `create` or `reset` has no derivative: there is no sample before it.
///
/// Run-time object: no allocation, noexcept, about ten nanoseconds a call. The output is finite
/// and within its limits whatever the input and the gains. A measurement, reference or feedforward
/// that is not finite, or beyond `largest_signal`, counts as not there: without a measurement or
/// reference the proportional and derivative terms are zero and the integral holds, so that a
/// sensor's drop-out neither winds the controller up nor kicks when it ends; a feedforward that is
/// not finite counts as zero.
///
/// Source: book, chapter 2. Åström and Hägglund, "Advanced PID Control" (2006), chapter 3.
class Pid {
 public:
  /// @errors ArgumentError: period not positive; a gain, time or limit that is NaN, or a limit
  /// above its opposite; a time, zone or turn that is negative.
  [[nodiscard]] static Expected<Pid> create(const PidSettings& settings);

  /// One period. @param measurement  y. @param reference  r.
  /// @param feedforward  Added before the limits, so that anti-windup knows of it.
  /// @return u.
  double calculate(double measurement, double reference, double feedforward = 0.0) noexcept;

  /// New gains without a bump: where the controller has an integral, it takes over what the other
  /// terms change at this moment, so that the next output continues from the last one. With ki = 0
  /// there is no integral to do so (and what was in it is dropped).
  /// Gains that are not finite are refused: the old ones stay. @return Whether they were taken.
  bool set_gains(const PidGains& gains) noexcept;

  /// Forgets the integral, the derivative and the last sample.
  void reset() noexcept;
  /// The same with a given integral term, as when a controller takes over from a manual output.
  void reset(double integral) noexcept;

  [[nodiscard]] const PidGains& gains() const noexcept { return settings_.gains; }
  [[nodiscard]] const PidSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] double error() const noexcept { return error_; }            ///< Of the last call.
  [[nodiscard]] double integral() const noexcept { return integral_; }      ///< ki ∫e.
  [[nodiscard]] double derivative() const noexcept { return derivative_; }  ///< kd de/dt, filtered.
  [[nodiscard]] double output() const noexcept { return output_; }          ///< u of the last call.
  [[nodiscard]] bool saturated() const noexcept { return saturated_; }

 private:
  explicit Pid(const PidSettings& settings) noexcept;

  [[nodiscard]] double wrapped(double difference) const noexcept;
  [[nodiscard]] double limited_integral(double value) const noexcept;
  void update_tracking() noexcept;

  PidSettings settings_;
  double tracking_gain_ = 0.0;  ///< T / T_t, at most 1.
  double error_ = 0.0;
  double before_ = 0.0;  ///< What the derivative is taken of, one sample ago.
  double rate_ = 0.0;    ///< Its filtered derivative, without kd.
  double integral_ = 0.0;
  double derivative_ = 0.0;
  double output_ = 0.0;
  bool has_before_ = false;
  bool saturated_ = false;
};

}  // namespace flyball
