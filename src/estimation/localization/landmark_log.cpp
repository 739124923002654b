#include <flyball/estimation/localization/landmark_log.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Eigen::Matrix<double, SensorCalibration::size, 1> SensorCalibration::vector() const {
  Eigen::Matrix<double, size, 1> v;
  v << velocity_scale, turn_scale, turn_per_velocity, delay, range_scale, range_offset,
      depth_exponent, bearing_scale, bearing_offset, gyro_bias;
  return v;
}

SensorCalibration SensorCalibration::from(const Eigen::Matrix<double, size, 1>& v) {
  return {v(0), v(1), v(2), v(3), v(4), v(5), v(6), v(7), v(8), v(9)};
}

const SensorCalibration::Name& SensorCalibration::name(int index) {
  static constexpr std::array<Name, size> names{{{"velocity scale", ""},
                                                 {"turn scale", ""},
                                                 {"turn per velocity", "rad/m"},
                                                 {"delay", "s"},
                                                 {"range scale", ""},
                                                 {"range offset", "m"},
                                                 {"depth exponent", ""},
                                                 {"bearing scale", ""},
                                                 {"bearing offset", "rad"},
                                                 {"gyro bias", "rad/s"}}};
  return names[static_cast<std::size_t>(index)];
}

namespace {

constexpr std::string_view in_landmark_log = "landmark log";

Refusal bad_row(ArgumentError code, std::string_view list, std::size_t row, std::string got,
                std::string expected) {
  return refusal(code, in_landmark_log, detail::format("{} {}", list, row + 1))
      .got(std::move(got))
      .expected(std::move(expected));
}

/// Of a robot's drive; a time that is farther off is another clock's.
constexpr double longest_pause = 3600.0;  // s

Refusal bad_clock(std::string_view list, std::size_t row, double time, double off,
                  std::string_view from) {
  return bad_row(ArgumentError::out_of_range, list, row,
                 detail::format("at {} s, {:.4g} s from {}", time, off, from),
                 "within an hour of it")
      .hint("look for a clock that was set, for two clocks, or for milliseconds");
}

Expected<void> check_times(double before, double time, std::string_view list, std::size_t row) {
  if (!std::isfinite(time)) {
    return bad_row(ArgumentError::not_finite, list, row, "a time that is not finite", "seconds");
  }
  if (time < before) {
    return bad_row(ArgumentError::out_of_range, list, row,
                   detail::format("{} s after {} s", time, before), "times that do not fall")
        .hint("sort the rows by time");
  }
  return {};
}

Expected<void> check_options(const LandmarkOptions& options) {
  const auto mean = options.calibration.vector();
  const auto std = options.calibration_std.vector();
  Checks checks("localization options");
  for (int i = 0; i < SensorCalibration::size; ++i) {
    const std::string_view name = SensorCalibration::name(i).name;
    checks.finite(mean(i), name).not_negative(std(i), name);
  }
  return checks.within(options.calibration.delay, 0.0, 1.5, "delay")
      .positive(options.range_std, "range_std")
      .positive(options.bearing_std, "bearing_std")
      .within(options.range_std, 1e-6, 1e3, "range_std", "m")
      .within(options.bearing_std, 1e-6, std::numbers::pi, "bearing_std", "rad")
      .within(options.freedom, 1.0, 1e6, "freedom")
      .not_negative(options.velocity_density, "velocity_density")
      .not_negative(options.slip_density, "slip_density")
      .not_negative(options.turn_density, "turn_density")
      .not_negative(options.relative_density, "relative_density")
      .not_negative(options.velocity_error, "velocity_error")
      .not_negative(options.turn_error, "turn_error")
      .positive(options.error_time, "error_time")
      .within(options.standstill, 0.0, 1.0, "standstill")
      .positive(options.longest_gap, "longest_gap")
      .not_negative(options.gap_velocity_error, "gap_velocity_error")
      .not_negative(options.gap_turn_error, "gap_turn_error")
      .positive(options.position_std, "position_std")
      .positive(options.heading_std, "heading_std");
}

}  // namespace

Expected<void> check_landmark_log(const LandmarkLog& log, const LandmarkOptions& options) {
  FLYBALL_CHECK(check_options(options));
  double before = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < log.odometry.size(); ++i) {
    const OdometrySample& sample = log.odometry[i];
    FLYBALL_CHECK(check_times(before, sample.time, "odometry row", i));
    if (i > 0 && sample.time - before > longest_pause) {
      return bad_clock("odometry row", i, sample.time, sample.time - before, "the row before");
    }
    if (!std::isfinite(sample.velocity) || !std::isfinite(sample.turn_rate)) {
      return bad_row(ArgumentError::not_finite, "odometry row", i, "a rate that is not finite",
                     "m/s and rad/s");
    }
    before = sample.time;
  }
  for (std::size_t i = 0; i < log.landmarks.size(); ++i) {
    if (!log.landmarks[i].position.allFinite()) {
      return bad_row(ArgumentError::not_finite, "landmark", i, "a place that is not finite", "m");
    }
  }
  before = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < log.sightings.size(); ++i) {
    const Sighting& sighting = log.sightings[i];
    FLYBALL_CHECK(check_times(before, sighting.time, "sighting", i));
    const bool alone = log.odometry.empty();
    const double first = alone ? (i > 0 ? before : sighting.time) : log.odometry.front().time;
    const double last = alone ? first : log.odometry.back().time;
    const double off = std::max(first - sighting.time, sighting.time - last);
    if (off > longest_pause) {
      return bad_clock("sighting", i, sighting.time, off,
                       alone ? "the one before" : "the odometry");
    }
    before = sighting.time;
    if (sighting.landmark >= log.landmarks.size()) {
      return bad_row(ArgumentError::out_of_range, "sighting", i,
                     detail::format("landmark {} of {}", sighting.landmark, log.landmarks.size()),
                     "one that is there");
    }
    if (!(sighting.range > 0.0) || !std::isfinite(sighting.range)) {
      return bad_row(ArgumentError::out_of_range, "sighting", i,
                     detail::format("a range of {} m", sighting.range), "a distance");
    }
    if (!(std::abs(sighting.bearing) <= 2.0 * std::numbers::pi)) {
      return bad_row(ArgumentError::out_of_range, "sighting", i,
                     detail::format("a bearing of {} rad", sighting.bearing), "radians")
          .hint("divide degrees by 57.3");
    }
  }
  return {};
}

}  // namespace flyball
