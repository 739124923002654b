#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "study/localize_doubts.hpp"

namespace flyball::study {

namespace {

constexpr double most_nees = 3.0;  // Of neighbouring poses, whose errors are alike.

/// A log as it would be in another convention.
struct Reading {
  const char* what;
  const char* expected;
  double turn_rate, bearing;
};
constexpr std::array readings{
    Reading{"bearings of the other sign",
            "bearings are measured counter-clockwise from the robot's forward axis", 1.0, -1.0},
    Reading{"turn rates of the other sign", "turn rates are positive counter-clockwise", -1.0, 1.0},
    Reading{"turn rates in degrees", "turn rates are in rad/s", one_degree, 1.0},
    Reading{"turn rates in clockwise degrees",
            "turn rates are in rad/s and positive counter-clockwise", -one_degree, 1.0}};

LandmarkLog read_as(const Reading& reading, LandmarkLog log) {
  for (OdometrySample& sample : log.odometry) {
    sample.turn_rate *= reading.turn_rate;
  }
  for (Sighting& sighting : log.sightings) {
    sighting.bearing *= reading.bearing;
  }
  return log;
}

std::ptrdiff_t left_out(const FilteredLandmarks& filtered) {
  return std::count(filtered.weight.begin(), filtered.weight.end(), 0.0);
}

/// A pose that is found anew speaks against a log as this many sightings do.
std::ptrdiff_t misfit(const FilteredLandmarks& filtered) {
  constexpr int sightings = 10;
  return left_out(filtered) + static_cast<std::ptrdiff_t>(sightings) * filtered.relocalizations;
}

bool told(const LocalizeResult& result, std::string_view code) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(),
                     [&](const Diagnostic& diagnostic) { return diagnostic.code == code; });
}

/// A truth that the path agrees with takes the doubt from it.
bool agrees_with_truth(const LocalizeResult& result) {
  const auto& error = result.smoother_error ? result.smoother_error : result.filter_error;
  return error && error->nees <= most_nees;
}

void add(std::string code, std::string message, LocalizeResult& result) {
  const Severity severity = agrees_with_truth(result) ? Severity::warning : Severity::error;
  result.diagnostics.push_back({std::move(code), severity, std::move(message)});
}

/// Half the misfit and less is no chance.
void notice_other_readings(const LandmarkOptions& options, const std::optional<Pose2d>& start,
                           LocalizeResult& result) {
  std::ptrdiff_t least = misfit(result.filter) / 2;
  std::string message;
  for (const Reading& reading : readings) {
    const auto filtered =
        filter_landmarks(read_as(reading, result.log), options, result.filter.path.time, start);
    if (filtered && misfit(*filtered) < least) {
      least = misfit(*filtered);
      message = fmt::format(
          "read as {}, the log leaves out {} of {} sightings and finds the pose {} times, in place "
          "of {} and {}: {}",
          reading.what, left_out(*filtered), filtered->weight.size(), filtered->relocalizations,
          left_out(result.filter), result.filter.relocalizations, reading.expected);
    }
  }
  if (!message.empty()) {
    add("other_convention", std::move(message), result);
  }
}

}  // namespace

void notice_doubts(const LandmarkOptions& options, const std::optional<Pose2d>& start,
                   LocalizeResult& result) {
  const bool implausible = told(result, "implausible_calibration");
  const bool lost = told(result, "carried_away");
  if (implausible || lost || told(result, "many_outliers")) {
    notice_other_readings(options, start, result);
  }
  if (implausible && lost) {
    add("contradiction",
        "constants that no sensor has and a pose that was found anew: the odometry contradicts the "
        "sightings",
        result);
  }
  const auto& error = result.smoother_error ? result.smoother_error : result.filter_error;
  if (error && !agrees_with_truth(result)) {
    add("inconsistent",
        fmt::format("the truth is {:.3g} m away (rms), which the path's own covariance denies: "
                    "NEES {:.3g}, where 1 is expected and {:.2g} is the most that passes",
                    error->rms, error->nees, most_nees),
        result);
  }
}

}  // namespace flyball::study
