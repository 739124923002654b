#include <flyball/estimation/localization/wheel_log.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_wheel_odometry = "wheel_odometry";

template <class Sample, class Value>
Expected<void> check_rows(const std::vector<Sample>& rows, std::string_view list,
                          const Value& value) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto refused = [&](ArgumentError code) {
      return refusal(code, in_wheel_odometry, detail::format("{} row {}", list, i + 1));
    };
    if (!std::isfinite(rows[i].time) || !std::isfinite(value(rows[i]))) {
      return refused(ArgumentError::not_finite).got("what is no number").expected("numbers");
    }
    if (i > 0 && rows[i].time < rows[i - 1].time) {
      return refused(ArgumentError::out_of_range)
          .got(detail::format("{} s after {} s", rows[i].time, rows[i - 1].time))
          .expected("times that do not fall")
          .hint("sort the rows by time");
    }
  }
  return {};
}

/// ∫ turn rate dt of readings that hold until the next, from the first of them on.
class Turned {
 public:
  explicit Turned(const std::vector<TurnRateSample>& gyro) : gyro_(gyro), sum_(gyro.size(), 0.0) {
    for (std::size_t i = 1; i < gyro.size(); ++i) {
      sum_[i] = sum_[i - 1] + (gyro[i].time - gyro[i - 1].time) * gyro[i - 1].turn_rate;
    }
  }
  [[nodiscard]] double operator()(double time) const {
    const auto after =
        std::upper_bound(gyro_.begin(), gyro_.end(), time,
                         [](double t, const TurnRateSample& sample) { return t < sample.time; });
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - gyro_.begin() - 1, 0));
    return sum_[i] + (time - gyro_[i].time) * gyro_[i].turn_rate;
  }

 private:
  const std::vector<TurnRateSample>& gyro_;
  std::vector<double> sum_;
};

/// right - left at a time, between the readings by a straight line.
double difference_at(const std::vector<WheelSample>& wheels, double time) {
  const auto after =
      std::upper_bound(wheels.begin(), wheels.end(), time,
                       [](double t, const WheelSample& sample) { return t < sample.time; });
  if (after == wheels.begin() || after == wheels.end()) {
    const WheelSample& end = after == wheels.end() ? wheels.back() : wheels.front();
    return end.right - end.left;
  }
  const WheelSample& a = *(after - 1);
  const WheelSample& b = *after;
  const double share = (time - a.time) / (b.time - a.time);
  return (1.0 - share) * (a.right - a.left) + share * (b.right - b.left);
}

}  // namespace

Expected<std::vector<OdometrySample>> wheel_odometry(const WheelLog& log, double track_width) {
  FLYBALL_CHECK(
      check_rows(log.wheels, "wheels", [](const WheelSample& s) { return s.left + s.right; }));
  FLYBALL_CHECK(check_rows(log.gyro, "gyro", [](const TurnRateSample& s) { return s.turn_rate; }));
  if (log.wheels.size() < 2 || !(log.wheels.back().time > log.wheels.front().time)) {
    return refusal(ArgumentError::empty, in_wheel_odometry, "the wheels")
        .got(detail::format("{} readings", log.wheels.size()))
        .expected("readings of two times or more");
  }
  if (log.gyro.empty()) {
    FLYBALL_CHECK(Checks(in_wheel_odometry).positive(track_width, "track_width", "m"));
  }
  const Turned turned(log.gyro);
  std::vector<OdometrySample> odometry;
  const WheelSample* last = &log.wheels.front();
  for (const WheelSample& sample : log.wheels) {
    const double dt = sample.time - last->time;
    if (!(dt > 0.0)) {
      last = &sample;
      continue;
    }
    const double left = sample.left - last->left;
    const double right = sample.right - last->right;
    const double angle =
        log.gyro.empty() ? (right - left) / track_width : turned(sample.time) - turned(last->time);
    odometry.push_back({last->time, 0.5 * (left + right) / dt, angle / dt});
    last = &sample;
  }
  odometry.push_back({last->time, odometry.back().velocity, odometry.back().turn_rate});
  return odometry;
}

std::optional<TrackWidth> track_width(const WheelLog& log, double assumed,
                                      const SmoothedLandmarks& fit) {
  constexpr int velocity = 0;
  constexpr int turn = 1;
  const auto& P = fit.calibration_covariance;
  const double scale = fit.calibration.velocity_scale;
  if (log.gyro.empty()) {
    // log b = log velocity_scale - log turn_scale + a constant.
    const double by_turn = 1.0 / fit.calibration.turn_scale;
    const double value = assumed * scale * by_turn;
    const double relative = P(velocity, velocity) / (scale * scale) +
                            P(turn, turn) * by_turn * by_turn -
                            2.0 * P(velocity, turn) * by_turn / scale;
    return TrackWidth{value, std::abs(value) * std::sqrt(std::max(relative, 0.0))};
  }
  // Windows so long that the path's own uncertainty in each is small against its angle.
  constexpr double window = 1.0;       // s
  constexpr double least_angle = 0.5;  // rad, root of the sum of squares
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  double count = 0.0;
  double angle = 0.0;
  const auto& path = fit.path;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < path.time.size(); ++i) {
    angle += path.pose[i - 1].between(path.pose[i]).angle();
    if (path.time[i] - path.time[begin] < window) {
      continue;
    }
    const double delay = fit.calibration.delay;
    const double wheels = difference_at(log.wheels, path.time[i] - delay) -
                          difference_at(log.wheels, path.time[begin] - delay);
    xx += angle * angle;
    xy += angle * wheels;
    yy += wheels * wheels;
    count += 1.0;
    angle = 0.0;
    begin = i;
  }
  if (!(xx > least_angle * least_angle) || count < 3.0) {
    return std::nullopt;
  }
  const double slope = xy / xx;
  const double variance = std::max(yy - slope * xy, 0.0) / (count - 1.0) / xx;
  return TrackWidth{scale * slope,
                    std::sqrt(scale * scale * variance + slope * slope * P(velocity, velocity))};
}

}  // namespace flyball
