#include <flyball/planning/profiles/generate_s_curve_profile.hpp>

#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/profiles/s_curve_problem.hpp"

namespace flyball {

Expected<TimeSeries> generate_s_curve_profile(double max_velocity, double max_acceleration,
                                              Time time_to_max_acceleration, Time period,
                                              double goal) {
  constexpr std::string_view where = "generate_s_curve_profile";
  const double dt = period.si();
  const double ramp = time_to_max_acceleration.si();
  FLYBALL_CHECK(Checks(where)
                    .positive(max_velocity, "max_velocity")
                    .positive(max_acceleration, "max_acceleration")
                    .positive(ramp, "time_to_max_acceleration", "s")
                    .positive(dt, "period", "s")
                    .not_negative(goal, "goal"));
  const MotionLimits limits{
      .velocity = max_velocity, .acceleration = max_acceleration, .jerk = max_acceleration / ramp};
  const MotionState end{.position = goal};
  if (!detail::is_usable(limits, {}, end) || limits.jerk > detail::largest_motion) {
    return refusal(ArgumentError::out_of_range, where, "the limits and the goal")
        .got(detail::format("{:.3g}, {:.3g}, {:.3g} and {:.3g}", max_velocity, max_acceleration,
                            limits.jerk, goal))
        .expected("from 1e-30 to 1e30");
  }
  const SCurveProfile profile(limits, {}, end);
  constexpr double most_rows = 1e7;
  if (!(profile.total_time() / dt < most_rows)) {
    return refusal(ArgumentError::out_of_range, where, "the profile")
        .got(detail::format("{:.3g} periods long", profile.total_time() / dt))
        .expected("at most ten million periods long");
  }
  std::vector<double> time{0.0};
  std::vector<double> x{0.0};
  std::vector<double> v{0.0};
  std::vector<double> a{0.0};
  while (time.back() < profile.total_time()) {
    // The clock is a running sum, as the book's is: its rounding decides the number of rows.
    const double t = time.back() + dt;
    const MotionState at = profile.sample(t);
    time.push_back(t);
    a.push_back(at.acceleration);
    v.push_back(at.velocity);
    x.push_back(x.back() + v.back() * dt);
  }
  TimeSeries table(std::move(time));
  return table.add("position", "", std::move(x))
      .and_then([&] { return table.add("velocity", "", std::move(v)); })
      .and_then([&] { return table.add("acceleration", "", std::move(a)); })
      .map([&] { return std::move(table); });
}

}  // namespace flyball
