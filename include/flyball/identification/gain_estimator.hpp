#pragma once

#include <array>
#include <limits>

#include <flyball/core/expected.hpp>
#include <flyball/math/regression/recursive_least_squares.hpp>
#include <flyball/mechanisms/mechanism.hpp>

namespace flyball::identification {

/// What a `GainEstimator` is told of the mechanism and its sensor.
struct GainEstimatorSettings {
  mechanisms::MechanismKind mechanism{};
  double period = 0.02;         ///< s, between two samples.
  double top_speed = 0.0;       ///< m/s or rad/s, roughly: it says what a large velocity is.
  double max_voltage = 12.0;    ///< V, roughly.
  double filter_time = 0.1;     ///< s, τ: longer for noisy velocities, at most the motion's.
  double velocity_delay = 0.0;  ///< s, age of the velocity (and position), at most 60 periods.
  double memory = std::numeric_limits<double>::infinity();  ///< s of motion, after which a sample
                                                            ///< counts 1/e.
  double rest_share = 0.02;          ///< Of the top speed: what is slower sticks, and is not used.
  double relative_tolerance = 0.05;  ///< Of a gain's half-width, when it counts as found.
  double voltage_tolerance = 0.1;    ///< V; for kS and kG this is enough, too.
};

/// Estimates kS, kV, kA and kG while the robot runs, from voltage, velocity and (arms) angle.
///
/// V = kS sgn v + kV v + kA dv/dt + gravity (14.2) holds as well for signals that have all passed
/// the filter F = 1/(τs + 1)², which makes a regression without a differentiated velocity:
///
///   F V = kS F sgn v + kV F v + kA (F₁ - F)(v - v₀)/τ + kG F g,   F₁ = 1/(τs + 1),
///
/// with filters that start at zero where the motion does (v₀ there), so that nothing of what came
/// before is left in them. The voltage is held between samples, velocity and gravity are lines: F
/// is exact. Solved by square-root least squares with forgetting; the errors count samples only as
/// often as the filter lets them be independent.
///
/// Noise of the velocity biases kA towards zero by its variance over that of the acceleration, both
/// filtered; the noise in `FeedforwardFit` does not. For a log take `identify_feedforward`.
///
/// Run-time object: noexcept, allocation-free, finite whatever comes.
/// Source: book, section 14.2; Young, "Recursive Estimation and Time-Series Analysis" (2011),
/// chapter 8 (state-variable filters).
class GainEstimator {
 public:
  /// @errors ArgumentError for what is not positive or out of range.
  [[nodiscard]] static Expected<GainEstimator> create(const GainEstimatorSettings& settings);

  /// One sample.
  /// @param voltage  V, applied from now to the next sample. @param velocity  As measured now.
  /// @param position  rad; only arms need it.
  /// @return  Whether it told something: not at rest, nor right after rest or a number that is
  /// none.
  bool update(double voltage, double velocity, double position = 0.0) noexcept;

  /// What is known so far; gains that the mechanism does not have are zero.
  [[nodiscard]] mechanisms::FeedforwardGains gains() const noexcept;
  /// Half-widths of 95 % intervals, in the gains' units; angle_offset is that of an arm.
  [[nodiscard]] mechanisms::FeedforwardGains half_widths() const noexcept;

  /// Which gains are within their tolerance.
  struct Found {
    bool kS = false;
    bool kV = false;
    bool kA = false;
    bool kG = false;  ///< Also of a mechanism without gravity.
    [[nodiscard]] bool all() const noexcept { return kS && kV && kA && kG; }
  };
  [[nodiscard]] Found found() const noexcept;
  /// How far the estimate is: the largest half-width over its tolerance, 1 or less when all are
  /// found; at most largest_signal.
  [[nodiscard]] double progress() const noexcept;

  [[nodiscard]] double samples() const noexcept { return regression_.samples(); }
  /// V, standard deviation of the filtered equation's error.
  [[nodiscard]] double residual_deviation() const noexcept;

 private:
  using Regression = RecursiveLeastSquares<5>;  ///< kS, kV, kA, kG cos(offset), -kG sin(offset).

  /// F₁ and F of one signal.
  struct Filtered {
    double once = 0.0;
    double twice = 0.0;
  };
  GainEstimator(const GainEstimatorSettings& settings, const Regression& regression) noexcept;
  void hold(Filtered& filtered, double value) const noexcept;
  void line(Filtered& filtered, double from, double to) const noexcept;
  void restart() noexcept;
  [[nodiscard]] double delayed_voltage() const noexcept;
  [[nodiscard]] std::array<double, 4> shares() const noexcept;

  GainEstimatorSettings settings_;
  Regression regression_;
  double decay_;                       ///< e^(-T/τ).
  double ratio_;                       ///< T/τ.
  std::array<double, 64> voltages_{};  ///< A ring; the last one at `newest_`.
  std::size_t newest_ = 0;
  std::size_t moving_ = 0;  ///< Samples since the motion began.
  double start_velocity_ = 0.0;
  double velocity_ = 0.0;
  double position_ = 0.0;
  Filtered voltage_filter_, sign_filter_, velocity_filter_, one_filter_, cosine_filter_,
      sine_filter_;
};

}  // namespace flyball::identification
