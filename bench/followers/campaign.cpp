// `campaign_followers [runs] [seed] [threads]`: random starts of every follower, see
// follower_campaign.hpp; a table of how they ended, and the seeds of some that did not converge.

#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <thread>
#include <vector>

#include "follower_campaign.hpp"

using namespace flyball::follower_campaign;

namespace {

void table(const char* title, const Conditions& conditions, int runs, std::uint64_t seed,
           unsigned threads) {
  std::printf("%s\n%-22s %9s %9s %6s %9s %6s %11s %11s\n", title, "", "converged", "saturated",
              "lost", "near", "bad", "median, cm", "99 %, cm");
  const Followers designed;
  std::printf("  (identified trackwidth %.3f m)\n", designed.trackwidth);
  for (const Kind kind : kinds) {
    std::vector<Outcome> outcomes(static_cast<std::size_t>(runs));
    std::vector<std::thread> pool;
    for (unsigned t = 0; t < threads; ++t) {
      pool.emplace_back([&, t] {
        for (std::size_t k = t; k < outcomes.size(); k += threads) {
          outcomes[k] = run(designed, kind, seed + k, conditions);
        }
      });
    }
    for (auto& thread : pool) {
      thread.join();
    }
    std::array<int, endings> count{};
    std::vector<double> errors;
    for (const Outcome& outcome : outcomes) {
      ++count[static_cast<std::size_t>(outcome.ending)];
      errors.push_back(100.0 * outcome.error);
    }
    std::ranges::sort(errors);
    std::printf("%-22s %9d %9d %6d %9d %6d %11.2f %11.2f\n", name_of(kind), count[0], count[1],
                count[2], count[3], count[4], errors[errors.size() / 2],
                errors[errors.size() * 99 / 100]);
    int shown = 0;
    for (std::size_t k = 0; k < outcomes.size() && shown < 8; ++k) {
      if (outcomes[k].ending != Ending::converged) {
        const Outcome& o = outcomes[k];
        std::printf(
            "    seed %llu: ending %d, %.2f m, %.2f rad, at most %.2f m; from (%.2f, %.2f), %.2f "
            "rad,"
            " %.2f and %.2f m/s; mass %.2f, inertia %.2f, R %.2f, track %.2f, grip %.2f\n",
            static_cast<unsigned long long>(seed + k), static_cast<int>(o.ending), o.error,
            o.heading, o.largest, o.start.pose.x(), o.start.pose.y(), o.start.pose.angle(),
            o.start.left, o.start.right, o.factors.mass, o.factors.inertia, o.factors.resistance,
            o.factors.trackwidth, o.factors.grip);
        ++shown;
      }
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 10000;
  const auto seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const unsigned threads = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 1;
  table("±20 % parameters, 40 ms latency predicted, slipping wheels", {}, runs, seed, threads);
  Conditions unpredicted;
  unpredicted.predicts = false;
  table("the same, latency not predicted", unpredicted, std::max(1, runs / 10), seed, threads);
  Conditions exact;
  exact.parameters = 0.0;
  exact.latency = 0.0;
  table("the parameters exact, no latency, slipping wheels", exact, std::max(1, runs / 10), seed,
        threads);
  return 0;
}
