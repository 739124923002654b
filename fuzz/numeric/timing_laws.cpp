#include <algorithm>
#include <cmath>
#include <string>

#include "numeric/timing_laws.hpp"

namespace flyball::fuzz {

using nlohmann::json;

namespace {

/// A motion's samples: what changes between two of them is no more than its rate allows, so that
/// limits are seen to hold between samples, too.
struct Samples {
  const json& values;
  const json& times;

  /// The largest share of a limit, beyond one, that a coordinate's value takes.
  [[nodiscard]] double beyond(const json& limits) const {
    double most = 0.0;
    for (const json& row : values) {
      for (std::size_t j = 0; j < row.size(); ++j) {
        most = std::max(most, std::abs(row[j].get<double>()) / limits[j].get<double>() - 1.0);
      }
    }
    return most;
  }
  /// The same of its mean rate from sample to sample, less what rounding makes of a difference.
  [[nodiscard]] double faster_than(const json& limits) const {
    double most = 0.0;
    for (std::size_t i = 1; i < values.size(); ++i) {
      const double t = times[i].get<double>();
      const double span = t - times[i - 1].get<double>();
      for (std::size_t j = 0; j < values[i].size(); ++j) {
        const double from = values[i - 1][j].get<double>();
        const double to = values[i][j].get<double>();
        const double limit = limits[j].get<double>();
        constexpr double rounding = 1e-14;
        const double sure =
            std::abs(to - from) - rounding * (std::abs(from) + std::abs(to) + limit * t);
        if (sure > 0.0) {
          most = std::max(most, sure / (limit * span) - 1.0);
        }
      }
    }
    return most;
  }
  /// √(x² + y²) of the first two coordinates.
  [[nodiscard]] double length_beyond(double limit) const {
    double most = 0.0;
    for (const json& row : values) {
      most = std::max(most, std::hypot(row[0].get<double>(), row[1].get<double>()) / limit - 1.0);
    }
    return most;
  }
};

bool ascends(const json& values) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i - 1].get<double>() > values[i].get<double>()) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<Verdict> timing_verdicts(const json& problem, const json& answer) {
  constexpr double allowed = 1e-9;
  std::vector<Verdict> verdicts;
  const auto holds = [&](const char* law, double most) {
    verdicts.push_back({law, tolerance * most / allowed});
  };
  const json& times = answer.at("time");
  const Samples position{answer.at("position"), times};
  const Samples velocity{answer.at("velocity"), times};
  const Samples acceleration{answer.at("acceleration"), times};
  if (problem.contains("velocity")) {
    const json& limits = problem.at("velocity");
    holds("velocity limits", velocity.beyond(limits));
    holds("velocity limits between samples", position.faster_than(limits));
  }
  if (problem.contains("acceleration")) {
    const json& limits = problem.at("acceleration");
    holds("acceleration limits", acceleration.beyond(limits));
    holds("acceleration limits between samples", velocity.faster_than(limits));
  }
  if (problem.contains("travel_velocity")) {
    holds("speed of travel", velocity.length_beyond(problem.at("travel_velocity")));
  }
  if (problem.contains("total_acceleration")) {
    holds("total acceleration", acceleration.length_beyond(problem.at("total_acceleration")));
  }
  const bool goes_on = ascends(times) && ascends(answer.at("parameter"));
  verdicts.push_back({"goes on", goes_on ? 0.0 : 1.0});
  return verdicts;
}

}  // namespace flyball::fuzz
