#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/estimation/localization/landmark_log.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

/// What the filter and the smoother of a drive share.
namespace flyball::localization {

inline Expected<void> check_wanted(const std::vector<double>& times, std::string_view where) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i]) || (i > 0 && times[i] < times[i - 1])) {
      return refusal(ArgumentError::out_of_range, where, flyball::detail::format("times[{}]", i))
          .got(flyball::detail::format("{}", times[i]))
          .expected("finite times that do not fall");
    }
  }
  return {};
}

/// The odometry as its integrals, between the samples too.
class Integrals {
 public:
  explicit Integrals(const std::vector<OdometrySample>& samples) : samples_(samples) {
    way_.resize(samples.size());
    turned_.resize(samples.size());
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const double dt = samples[i].time - samples[i - 1].time;
      way_[i] = way_[i - 1] + dt * samples[i - 1].velocity;
      turned_[i] = turned_[i - 1] + dt * samples[i - 1].turn_rate;
    }
  }

  struct At {
    double way = 0.0, turned = 0.0, velocity = 0.0, turn_rate = 0.0;
    double age = 0.0;  ///< Of the sample that holds, s.
  };
  [[nodiscard]] At operator()(double time) const {
    const auto after =
        std::upper_bound(samples_.begin(), samples_.end(), time,
                         [](double t, const OdometrySample& sample) { return t < sample.time; });
    if (after == samples_.begin()) {
      return {};
    }
    const auto i = static_cast<std::size_t>(after - samples_.begin() - 1);
    const double dt = time - samples_[i].time;
    return {way_[i] + dt * samples_[i].velocity, turned_[i] + dt * samples_[i].turn_rate,
            samples_[i].velocity, samples_[i].turn_rate, dt};
  }

 private:
  const std::vector<OdometrySample>& samples_;
  std::vector<double> way_;
  std::vector<double> turned_;
};

/// The first and the last time of a log.
inline std::pair<double, double> span_of(const LandmarkLog& log) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  if (!log.odometry.empty()) {
    first = std::min(first, log.odometry.front().time);
    last = std::max(last, log.odometry.back().time);
  }
  if (!log.sightings.empty()) {
    first = std::min(first, log.sightings.front().time);
    last = std::max(last, log.sightings.back().time);
  }
  return {first, last};
}

}  // namespace flyball::localization
