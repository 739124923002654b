#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/diagnose.hpp"
#include "identification/channels.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

constexpr std::size_t beside = 4;     // new positions on each side that tell the usual speed
constexpr double clear = 8.0;         // standard deviations of what is usual
constexpr double alone = 5.0;         // times what the new positions beside it are off by
constexpr double of_top_speed = 0.3;  // from here on one jump tells that it is one
constexpr double least_share = 0.03;  // of top speed: smaller jumps spoil nothing
constexpr std::size_t fewest = 2;     // one jump may be anything
constexpr std::size_t fewest_small = 4;
constexpr double alike_jumps = 0.25;  // of their median, that small jumps of a slip differ by
constexpr double other_speeds = 1.5;  // that they are alike at
constexpr double look_back = 0.05;    // s, before a jump, where the velocity may show it
constexpr double look_on = 0.15;      // s, after it: sensors are late and average
constexpr double trend = 0.1;         // s, of the velocity's trend on both sides of that

/// By how much each new position is beyond where the speed before and after would have put it.
std::vector<double> excesses(const TestRun& run, const std::vector<std::size_t>& fresh) {
  std::vector<double> rates(fresh.size(), 0.0);
  for (std::size_t k = 1; k < fresh.size(); ++k) {
    rates[k] = (run.position[fresh[k]] - run.position[fresh[k - 1]]) /
               (run.time[fresh[k]] - run.time[fresh[k - 1]]);
  }
  std::vector<double> excess(fresh.size(), 0.0);
  for (std::size_t k = beside + 1; k + beside < fresh.size(); ++k) {
    const auto at = rates.begin() + static_cast<std::ptrdiff_t>(k);
    const double before = median({at - beside, at});
    const double after = median({at + 1, at + 1 + beside});
    excess[k] = (rates[k] - 0.5 * (before + after)) * (run.time[fresh[k]] - run.time[fresh[k - 1]]);
  }
  return excess;
}

/// What the velocity column moves about that instant beyond its trend: all of a jump that is true.
double shown_by_velocity(const TestRun& run, double at) {
  const double begin = at - look_back;
  const double end = at + look_on;
  const auto median_of = [&](double from, double to) {
    const auto first = run.velocity.begin();
    return median({first + static_cast<std::ptrdiff_t>(lower_index(run.time, from)),
                   first + static_cast<std::ptrdiff_t>(lower_index(run.time, to))});
  };
  const double before = median_of(begin - trend, begin);
  const double after = median_of(end, end + trend);
  double sum = 0.0;
  for (std::size_t i = std::max<std::size_t>(1, lower_index(run.time, begin));
       i < run.time.size() && run.time[i] < end; ++i) {
    // The trend's points are the middles of their stretches.
    const double place = (run.time[i] - begin + 0.5 * trend) / (end - begin + trend);
    sum += (run.velocity[i] - before - place * (after - before)) * (run.time[i] - run.time[i - 1]);
  }
  return sum;
}

struct Jump {
  PreparedRun* run;
  std::size_t row;
  double distance;
  double speed;  ///< Usual there.
  double shown;  ///< Of it by the velocity.
  bool large;    ///< Enough to be told by itself.
  bool by_time;  ///< May be a row that lost or gained a refresh of its sensor instead.
};

void find_jumps(PreparedRun& prepared, const PreparedRecording& recording,
                std::vector<Jump>& jumps) {
  const TestRun& run = prepared.run;
  const std::vector<std::size_t>& fresh = prepared.fresh_position;
  const std::vector<double> excess = excesses(run, fresh);
  for (std::size_t k = 2 * beside + 1; k + 2 * beside < fresh.size(); ++k) {
    const double jump = excess[k];
    const double period = run.time[fresh[k]] - run.time[fresh[k - 1]];
    if (std::abs(jump) < 4.0 * recording.position_quantum ||
        std::abs(jump) < least_share * recording.top_speed * period) {
      continue;
    }
    double largest_beside = 0.0;
    double sum_beside = 0.0;
    for (std::size_t i = k - beside; i <= k + beside; ++i) {
      largest_beside = std::max(largest_beside, i == k ? 0.0 : std::abs(excess[i]));
      sum_beside += i == k ? 0.0 : excess[i];
    }
    constexpr std::size_t far = 25;
    const std::size_t first = k - std::min(k, far);
    const std::size_t last = std::min(excess.size(), k + far);
    const double usual = mad_scale(std::span(excess).subspan(first, last - first));
    // A sensor that was late makes up for it: what it misses beside is what it then has too much.
    if (std::abs(jump) > clear * usual && std::abs(jump) > alone * largest_beside &&
        std::abs(sum_beside) < 0.3 * std::abs(jump)) {
      const double moved = run.position[fresh[k]] - run.position[fresh[k - 1]];
      const double usual_move = (moved - jump) / period * recording.position_refresh_period;
      const double refreshes = moved / usual_move;
      jumps.push_back({&prepared, fresh[k], jump, std::abs(moved - jump) / period,
                       shown_by_velocity(run, run.time[fresh[k]]),
                       std::abs(jump) >= of_top_speed * recording.top_speed * period,
                       std::abs(refreshes - std::round(refreshes)) < 0.15 && refreshes > -0.15 &&
                           refreshes < 3.15});
    }
  }
}

/// Whether small jumps are those of a slip: of one way at different speeds. A clock's or a sensor's
/// are of one time, and their way is as large as the speed.
bool slips_alike(const std::vector<Jump>& jumps) {
  if (jumps.size() < fewest_small) {
    return false;
  }
  std::vector<double> ways;
  double shown = 0.0;
  double slowest = jumps.front().speed;
  double fastest = 0.0;
  for (const Jump& jump : jumps) {
    ways.push_back(std::abs(jump.distance));
    shown += std::copysign(1.0, jump.distance) * jump.shown;
    slowest = std::min(slowest, jump.speed);
    fastest = std::max(fastest, jump.speed);
  }
  const double way = median(ways);
  return std::all_of(ways.begin(), ways.end(),
                     [way](double one) { return std::abs(one - way) < alike_jumps * way; }) &&
         fastest > other_speeds * slowest &&
         std::abs(shown) < 0.5 * way * static_cast<double>(jumps.size());
}

/// The jumps that are a slip's.
std::vector<Jump> slips_among(const std::vector<Jump>& jumps) {
  std::vector<Jump> large;
  std::vector<Jump> small;
  std::size_t sure = 0;
  for (const Jump& jump : jumps) {
    if (!jump.large) {
      small.push_back(jump);
    } else if (std::abs(jump.shown) < 0.5 * std::abs(jump.distance)) {
      large.push_back(jump);
      sure += jump.by_time ? 0U : 1U;
    }
  }
  if (sure < fewest) {
    large.clear();
  }
  if (slips_alike(small)) {
    large.insert(large.end(), small.begin(), small.end());
  }
  return large;
}

}  // namespace

void mend_slips(PreparedRecording& prepared) {
  if (!prepared.has_position || !prepared.has_velocity) {
    return;
  }
  std::vector<Jump> jumps;
  for (PreparedRun& run : prepared.runs) {
    if (run.moved) {
      find_jumps(run, prepared, jumps);
    }
  }
  jumps = slips_among(jumps);
  if (jumps.empty()) {
    return;
  }
  double largest = 0.0;
  for (const Jump& jump : jumps) {
    std::vector<double>& position = jump.run->run.position;
    for (std::size_t i = jump.row; i < position.size(); ++i) {
      position[i] -= jump.distance;
    }
    largest = std::max(largest, std::abs(jump.distance));
  }
  warn(prepared.diagnostics, "slip",
       "the position jumps {} times within its tests, by up to {:.3g} {}, while the velocity goes "
       "on: "
       "the encoder's coupling or belt slips, or counts are lost. The positions were put back by "
       "the jumps; find the slip before anything relies on the position{}",
       jumps.size(), largest, prepared.unit,
       prepared.mechanism == mechanisms::MechanismKind::arm
           ? ", the zero of gravity's angle among it"
           : "");
  refresh_derived_columns(prepared);
}

}  // namespace flyball::identification
