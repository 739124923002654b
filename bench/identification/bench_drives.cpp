// Monte Carlo of the identification of drivetrains: recordings of a known one, what is recovered.
//
//   bench_drives [SEEDS] [FIRST]
//
// Per gain: median relative error, share of the 95 % intervals that hold the truth, median relative
// half-width; and the time of a fit.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "drive_sessions.hpp"

namespace {

using flyball::identification::GainEstimate;

struct Tally {
  const char* name;
  double truth;
  std::vector<double> errors{};
  std::vector<double> widths{};
  int covered = 0;

  void add(const GainEstimate& gain) {
    errors.push_back(std::abs(gain.value / truth - 1.0));
    widths.push_back(0.5 * (gain.interval[1] - gain.interval[0]) / truth);
    covered += gain.interval[0] <= truth && truth <= gain.interval[1] ? 1 : 0;
  }
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 50;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  const auto& truth = drives::truth;
  const double mean = 0.5 * (truth.kS_left + truth.kS_right);
  std::vector<Tally> tallies{{"kS linear", mean},
                             {"kV linear", truth.kV_linear},
                             {"kA linear", truth.kA_linear},
                             {"kS angular", mean + drives::scrub},
                             {"kV angular", truth.kV_angular},
                             {"kA angular", truth.kA_angular},
                             {"kS left", truth.kS_left},
                             {"kS right", truth.kS_right},
                             {"trackwidth", drives::trackwidth}};
  double seconds = 0.0;
  int refused = 0;
  for (int seed = first; seed < first + seeds; ++seed) {
    const auto recording =
        drives::record({.staggered = seed % 2 == 0, .seed = static_cast<std::uint64_t>(seed)});
    const auto begin = std::chrono::steady_clock::now();
    const auto report = flyball::identification::identify_drive(recording);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (!report.fit || !report.fit->linear || !report.fit->angular || !report.fit->kS_left ||
        !report.fit->trackwidth) {
      ++refused;
      continue;
    }
    const auto& fit = *report.fit;
    std::size_t at = 0;
    for (const GainEstimate* gain :
         {&fit.linear->kS, &fit.linear->kV, &fit.linear->kA, &fit.angular->kS, &fit.angular->kV,
          &fit.angular->kA, &*fit.kS_left, &*fit.kS_right, &*fit.trackwidth}) {
      tallies[at++].add(*gain);
    }
  }
  for (const Tally& tally : tallies) {
    std::printf("%-11s median error %6.3f %%   covered %5.1f %%   half-width %6.3f %%\n",
                tally.name, 100.0 * median(tally.errors),
                100.0 * tally.covered / std::max(1.0, static_cast<double>(tally.errors.size())),
                100.0 * median(tally.widths));
  }
  std::printf("%d sessions, %d refused, %.2f s a fit\n", seeds, refused,
              seconds / std::max(1, seeds));
  return 0;
}
