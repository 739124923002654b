#pragma once

#include <array>
#include <limits>
#include <optional>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/mechanisms/power/winding.hpp>
#include <flyball/mechanisms/powertrain.hpp>

/// How fast a mechanism can get somewhere: its whole nonlinear motion under the strongest push and
/// the strongest brake that its motors, their limits and its battery allow.
namespace flyball {

/// Why a mechanism does not get there.
enum class TravelError {
  cannot_hold,   ///< Its motors cannot carry it against gravity within their limits.
  cannot_start,  ///< What the motors can push is below friction and gravity where it starts.
  never_there,   ///< It comes to rest, or to its top speed, before its goal.
  cannot_stop,   ///< Once it moves, the strongest brake does not stop it before its goal.
  too_long,      ///< It is not there within the time that was allowed.
};
[[nodiscard]] ErrorInfo error_info(TravelError code);

using mechanisms::Winding;

/// A motion that has to be as fast as possible.
struct TravelJob {
  mechanisms::GearedLoad load{};
  mechanisms::PowerLimits limits{};
  Winding winding{};
  double start = 0.0;      ///< m or rad; of a speed to be reached m/s or rad/s.
  double end = 1.0;        ///< The same.
  bool speed = false;      ///< Whether start and end are speeds.
  bool stops = true;       ///< Of a position: whether it is at rest at its end.
  double longest = 60.0;   ///< s, after which it is given up.
  double accuracy = 1e-9;  ///< Relative, of a step of the integration.
};

/// What a motion took.
struct Travel {
  double time = 0.0;            ///< s
  double switching_time = 0.0;  ///< s, at which it begins to brake; the end's where it does not.
  double top_speed = 0.0;       ///< m/s or rad/s, in size.
  double peak_current = 0.0;    ///< A, of the windings, all motors together.
  double peak_supply = 0.0;     ///< A, drawn from the battery by this drive.
  double least_rail = 0.0;      ///< V, of the battery under its load.
  double energy = 0.0;          ///< J, taken from the rail.
  double returned = 0.0;        ///< J, given back to it.
  double heat = 0.0;            ///< J, in the windings; the rest is work, at e I = (ω/K_v) I.
  double temperature = 0.0;     ///< °C, of the windings at the end, where they are known.
  /// s, for which each bound was what limited the push or the brake.
  std::array<double, mechanisms::power_bounds> bound_time{};
};

/// The fastest motion of a mechanism: full push until an instant, full brake from there; of one
/// degree of freedom whose force has bounds that depend on position and speed that is the optimum.
/// The instant is found so that it stops at its end, by integrating the whole motion (Dormand and
/// Prince, with step control) for each that is tried: back-EMF, current limits, the battery's sag,
/// friction, gravity along the way, the gears' losses, the rotors and the warming windings are all
/// in it. A speed, and a distance without a stop, are reached under full push.
///
/// @errors ArgumentError (as check_load and check_limits; not_positive, not_finite,
///         out_of_range: an end that is the start); TravelError with the numbers that decide.
/// Cost: about fifteen integrations of some hundred steps, well below a millisecond each;
/// allocates. Source: Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic manipulators along
/// specified paths", Int. J. Robotics Research 4 (1985); book, sections 12.1 and 12.1.3.
[[nodiscard]] Expected<Travel> fastest_travel(const TravelJob& job);

/// The same motion, row by row: position, velocity, voltage, current, supply_current, rail,
/// temperature (where the winding is known), energy. @param rows  Two or more, evenly in time.
/// @errors As `fastest_travel`.
[[nodiscard]] Expected<TimeSeries> record_travel(const TravelJob& job, int rows = 400);

}  // namespace flyball
