#include <flyball/planning/profiles/generate_s_curve_profile.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

/// Position, velocity and acceleration over time.
FigureResult profile_figure(std::string id, std::string title, const TimeSeries& profile) {
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  const auto column = [&](const char* name, const char* unit) {
    const auto values_of = profile.find(name);
    figure.columns.push_back({name, unit, *values_of});
  };
  figure.columns.push_back({"time", "s", profile.time()});
  column("position", "m");
  column("velocity", "m/s");
  column("acceleration", "m/s²");
  figure.picture = response_plot(figure, {{"Position (m)", "position", "Position"},
                                          {"Velocity (m/s)", "velocity", "Velocity"},
                                          {"Acceleration (m/s²)", "acceleration", "Acceleration"}});
  return figure;
}

}  // namespace

/// Figure 15.1: a trapezoid profile over 50 m, at 7 m/s after 2 s (section 15.1).
FigureResult figure_15_1() {
  const TimeSeries profile = generate_trapezoid_profile(7.0, 2_s, 50_ms, 50.0).value();
  return profile_figure("15.1", "Trapezoid profile", profile);
}

/// Figure 15.2: the same way at 7 m/s with 3.5 m/s² after 1 s: one second longer, and no jump of
/// the acceleration (section 15.1).
FigureResult figure_15_2() {
  const TimeSeries profile = generate_s_curve_profile(7.0, 3.5, 1_s, 50_ms, 50.0).value();
  return profile_figure("15.2", "S-curve profile", profile);
}

}  // namespace flyball::book
