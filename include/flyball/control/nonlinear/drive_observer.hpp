#pragma once

#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/estimation/model_filter.hpp>
#include <flyball/mechanisms/drivetrain/encoder_drive.hpp>

namespace flyball {

/// How well a differential drive's model and its sensors are known; standard deviations. Those of
/// states are spectral: what a second adds, per √s.
struct DriveObserverSettings {
  double position = 0.01;        ///< m/√s, slip and bumps.
  double heading = 0.01;         ///< rad/√s
  double velocity = 0.3;         ///< m/s/√s, of each side.
  double voltage_error = 1.0;    ///< V/√s: how much the voltages can be expected to drop.
  double encoder_error = 0.05;   ///< m/s/√s: the encoders' uncertainty when turning.
  double gyroscope = 1e-3;       ///< rad, a sample.
  double encoder = 1e-3;         ///< m, a sample.
  double start_position = 0.05;  ///< m, of the pose it starts from.
  double start_heading = 0.05;   ///< rad
  double voltage_limit = 12.0;   ///< V, of `compensated`.
  Time period{0.02};
};

/// The nonlinear observer of section 8.7.6: the pose, the sides' velocities and ways, and what the
/// voltages and the gyroscope seem to be off by (u_error), from a gyroscope and encoder positions.
///
/// @tparam Filter  `ExtendedKalmanFilter<mechanisms::EncoderDrive>` (Theorem 9.8.1), or an
/// unscented one of that model. Run-time object: noexcept, allocation-free, finite whatever comes,
/// as its filter is. Source: book, section 8.7.6, equations (8.17) to (8.22).
template <class Filter = ExtendedKalmanFilter<mechanisms::EncoderDrive>>
class DriveObserver {
 public:
  using State = mechanisms::EncoderDrive;

  /// @param start  Where the robot stands; the encoders count from there.
  /// @errors ArgumentError of the filter's creation, and for settings that are not positive.
  [[nodiscard]] static Expected<DriveObserver> create(const mechanisms::EncoderDrive& model,
                                                      const DriveObserverSettings& settings,
                                                      const Pose2d& start) {
    if (auto checked = Checks("DriveObserver")
                           .positive(settings.gyroscope, "gyroscope", "rad")
                           .positive(settings.encoder, "encoder", "m")
                           .positive(settings.voltage_error, "voltage_error", "V/√s")
                           .positive(settings.voltage_limit, "voltage_limit", "V");
        !checked) {
      return tl::unexpected(checked.error());
    }
    const auto& s = settings;
    Eigen::Vector<double, 10> density;
    density << s.position, s.position, s.heading, s.velocity, s.velocity, 0.0, 0.0, s.voltage_error,
        s.voltage_error, s.encoder_error;
    Eigen::Vector<double, 10> spread;
    spread << s.start_position, s.start_position, s.start_heading, 0.1, 0.1, s.encoder, s.encoder,
        s.voltage_error, s.voltage_error, s.encoder_error;
    Eigen::Vector<double, 10> x = Eigen::Vector<double, 10>::Zero();
    x.template head<3>() << start.x(), start.y(), start.angle();
    return Filter::create(
               model, ProcessDensity{density.cwiseAbs2().asDiagonal()},
               Eigen::MatrixXd(
                   Eigen::Vector3d(s.gyroscope, s.encoder, s.encoder).cwiseAbs2().asDiagonal()),
               {x, Eigen::MatrixXd(spread.cwiseAbs2().asDiagonal())}, s.period)
        .map([&](const Filter& filter) { return DriveObserver(filter, s.voltage_limit); });
  }

  /// One period: what was applied over it, and what is measured at its end.
  /// @param voltage  V, left and right. @param heading  rad. @param left, right  m, the encoders.
  void step(const Eigen::Vector2d& voltage, double heading, double left, double right) noexcept {
    filter_.predict(voltage);
    filter_.correct({heading, left, right}, voltage);
  }

  [[nodiscard]] DriveState state() const noexcept {
    const auto& x = filter_.x_hat();
    return {{x(0), x(1), x(2)}, x(State::vl_at), x(State::vr_at)};
  }
  /// [e_l, e_r], V: added to what is applied, they are what the sides seem to get.
  [[nodiscard]] Eigen::Vector2d voltage_error() const noexcept {
    return filter_.x_hat().template segment<2>(State::e_l_at);
  }
  /// e_θ, m/s: what the left encoder counts more, and the right one less, than the turn it makes.
  [[nodiscard]] double encoder_error() const noexcept {
    return filter_.x_hat()(State::e_heading_at);
  }
  /// A voltage that has its effect in spite of the errors: u - K_error x_error (8.22), limited.
  [[nodiscard]] Eigen::Vector2d compensated(const Eigen::Vector2d& voltage) const noexcept {
    bool saturated = false;
    return within_voltage(voltage - State::error_gain() * filter_.x_hat().template tail<3>(),
                          limit_, saturated);
  }
  [[nodiscard]] const Filter& filter() const noexcept { return filter_; }

 private:
  DriveObserver(const Filter& filter, double limit) : filter_(filter), limit_(limit) {}

  Filter filter_;
  double limit_;
};

}  // namespace flyball
