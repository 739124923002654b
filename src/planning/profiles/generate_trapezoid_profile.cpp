#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>

#include <cmath>
#include <vector>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<TimeSeries> generate_trapezoid_profile(double max_velocity, Time time_to_max_velocity,
                                                Time period, double goal) {
  constexpr std::string_view where = "generate_trapezoid_profile";
  const double dt = period.si();
  double ramp = time_to_max_velocity.si();
  FLYBALL_CHECK(Checks(where)
                    .positive(max_velocity, "max_velocity")
                    .positive(ramp, "time_to_max_velocity", "s")
                    .positive(dt, "period", "s")
                    .not_negative(goal, "goal"));
  const double a = max_velocity / ramp;
  const bool reaches = max_velocity * ramp <= goal;
  ramp = reaches ? ramp : std::sqrt(goal / a);
  const double cruise_velocity = reaches ? max_velocity : a * ramp;
  const double brake = reaches ? goal / max_velocity : ramp;
  const double end = brake + ramp;
  constexpr double most_rows = 1e7;
  if (!(end / dt < most_rows)) {
    return refusal(ArgumentError::out_of_range, where, "the profile")
        .got(detail::format("{:.3g} periods long", end / dt))
        .expected("at most ten million periods long");
  }

  std::vector<double> time{0.0};
  std::vector<double> x{0.0};
  std::vector<double> v{0.0};
  std::vector<double> acceleration{0.0};
  while (time.back() < end) {
    // The clock is a running sum, as the book's is: its rounding decides the number of rows.
    const double t = time.back() + dt;
    time.push_back(t);
    acceleration.push_back(t < ramp ? a : t < brake || t >= end ? 0.0 : -a);
    v.push_back(t < ramp    ? a * t
                : t < brake ? cruise_velocity
                : t < end   ? cruise_velocity - a * (t - brake)
                            : 0.0);
    x.push_back(x.back() + v.back() * dt);
  }
  TimeSeries profile(std::move(time));
  return profile.add("position", "", std::move(x))
      .and_then([&] { return profile.add("velocity", "", std::move(v)); })
      .and_then([&] { return profile.add("acceleration", "", std::move(acceleration)); })
      .map([&] { return std::move(profile); });
}

}  // namespace flyball
