// Swing-up and balance from many random starts: usage bench_swing_up [STARTS [SEED
// [pendulum|cart-pole| acrobot]]]. Angles uniform in ±π, rates in ±2 rad/s, the cart at rest in the
// middle of its track; a start succeeds if it stands within 30 s, by the proof of its balance for
// good.
#include <flyball/control/swing_up/campaign.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <vector>

#include <flyball/control/swing_up/energy_shaping.hpp>

namespace {

using namespace flyball;
using namespace flyball::literals;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

template <class M>
void campaign(const char* name, const M& model, const SwingUpOptions& options, int starts,
              unsigned long long seed, const SwingUpTrial& trial) {
  const auto begin = Clock::now();
  const auto design = design_swing_up(model, options);
  if (!design) {
    std::printf("%s: %s\n", name, to_string(design.error()).c_str());
    return;
  }
  const CertifiedRegion& region = design->region;
  constexpr int N = M::states();
  std::printf("%s: certified V <= %.4g in %.3f s, %d cells (found to fail at %.4g); reaches", name,
              region.level, seconds_since(begin), region.cells, region.refuted);
  for (int i = 0; i < N; ++i) {
    std::printf(" %.3g", region.extent(i));
  }
  std::printf("\n");
  const bool cart = std::isfinite(options.track);
  const auto sims = Clock::now();
  int stands = 0;
  int left = 0;
  int given_up = 0;
  int later = 0;
  int caught = 0;
  double farthest = 0.0;
  double largest = 0.0;
  std::vector<double> times;
  for (int k = 0; k < starts; ++k) {
    Random random(seed + static_cast<unsigned long long>(k));
    const auto x = random_start<N>(random, cart);
    const SwingUpRun run = try_swing_up(model, design->controller, x, trial);
    stands += run.stands ? 1 : 0;
    left += run.left_track ? 1 : 0;
    given_up += run.given_up;
    farthest = std::max(farthest, run.farthest);
    largest = std::max(largest, run.largest_input);
    if (run.stands) {
      times.push_back(run.time);
      continue;
    }
    SwingUpTrial longer = trial;
    longer.duration = 2.0 * trial.duration;
    later += try_swing_up(model, design->controller, x, longer).stands ? 1 : 0;
    caught += std::isfinite(run.taken) ? 1 : 0;
    if (k - stands < 8) {
      std::printf("  fails from");
      for (int i = 0; i < N; ++i) {
        std::printf(" %.4f", x(i));
      }
      std::printf(": nearest V %.3g of the level, taken at %.2f s, given up %d times\n",
                  run.nearest, run.taken, run.given_up);
    }
  }
  if (stands < starts) {
    std::printf(
        "  of the %d that fail %d were taken over too late to have settled, %d stand in twice the "
        "time\n",
        starts - stands, caught, later);
  }
  std::sort(times.begin(), times.end());
  const auto quantile = [&](double share) {
    return times.empty()
               ? 0.0
               : times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  std::printf(
      "  %d of %d stand (%.2f %%), %d left the track, balance given up %d times; time to stand "
      "median "
      "%.1f s, 95 %% %.1f s, 99 %% %.1f s; cart to %.3f m; input to %.3g; %.2f ms a start\n",
      stands, starts, 100.0 * stands / starts, left, given_up, quantile(0.5), quantile(0.95),
      quantile(0.99), cart ? farthest : 0.0, largest, 1e3 * seconds_since(sims) / starts);
}

}  // namespace

int main(int count, char** arguments) {
  const int starts = count > 1 ? std::atoi(arguments[1]) : 10'000;
  const auto seed = count > 2 ? std::strtoull(arguments[2], nullptr, 10) : 1ULL;
  const std::string_view only = count > 3 ? arguments[3] : "";
  if (only.empty() || only == "pendulum") {
    const auto model = mechanisms::pendulum({.mass = 1_kg, .length = 1_m}).value();
    campaign("pendulum, 0.4 m g l", model, {.limit = 0.4 * model.gravity}, starts, seed, {});
  }
  if (only.empty() || only == "cart-pole") {
    const auto model =
        mechanisms::cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm})
            .value();
    campaign("cart-pole, 20 N, 2 m", model, {.limit = 20.0, .track = 2.0}, starts, seed,
             {.track = 2.0});
  }
  if (only.empty() || only == "acrobot") {
    const auto model = mechanisms::acrobot({.first = mechanisms::uniform_rod(1_m, 1_kg),
                                            .second = mechanisms::uniform_rod(1_m, 1_kg)})
                           .value();
    campaign("acrobot, 10 N m", model, {.limit = 10.0}, starts, seed, {});
  }
  return 0;
}
