// Monte Carlo of the identification: recordings of known mechanisms, what is recovered of them.
//
//   bench_identification [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME] [--kind
//   open]
//
// Per family of sessions (clean, and with what real logs have), mechanism and gain: median and 90th
// percentile of the relative error, share of the 95 % intervals that hold the truth, median
// relative half-width; and the time of a fit. With --kind open the recordings do not say what they
// are of: how often that is found, asked for, or found wrong.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/identification/mechanism_choice.hpp>

#include "scenarios.hpp"

namespace {

using flyball::identification::FeedforwardFit;
using flyball::identification::GainEstimate;

struct Tally {
  std::string_view name;
  double truth;
  std::vector<double> errors;
  std::vector<double> widths;
  std::size_t covered = 0;
  std::size_t undetermined = 0;

  void add(const GainEstimate& gain) {
    const double scale = std::abs(truth) > 0.0 ? std::abs(truth) : 1.0;
    errors.push_back((gain.value - truth) / scale);
    widths.push_back(0.5 * (gain.interval[1] - gain.interval[0]) / scale);
    covered += gain.interval[0] <= truth && truth <= gain.interval[1] ? 1U : 0U;
    undetermined += gain.determined ? 0U : 1U;
  }
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) {
    return 0.0;
  }
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void print(const Tally& tally) {
  std::vector<double> magnitudes;
  for (const double error : tally.errors) {
    magnitudes.push_back(std::abs(error));
  }
  std::printf(
      "  %-6s median error %6.2f %%   p90 %6.2f %%   bias %+6.2f %%   covered %5.1f %%   "
      "half-width %6.2f %%   undetermined %zu\n",
      std::string(tally.name).c_str(), 100.0 * quantile(magnitudes, 0.5),
      100.0 * quantile(magnitudes, 0.9), 100.0 * quantile(tally.errors, 0.5),
      100.0 * static_cast<double>(tally.covered) /
          std::max(1.0, static_cast<double>(tally.errors.size())),
      100.0 * quantile(tally.widths, 0.5), tally.undetermined);
}

bool is_diagnosis(const scenarios::Family& family, std::string_view code) {
  return !code.empty() && (code == family.diagnoses[0] || code == family.diagnoses[1]);
}

void run(const scenarios::Family& family, const scenarios::Truth& truth, std::uint64_t first,
         std::uint64_t seeds) {
  std::vector<Tally> tallies{{"kS", truth.kS, {}, {}},
                             {"kV", truth.kV, {}, {}},
                             {"kA", truth.kA, {}, {}},
                             {"kG", truth.kG, {}, {}},
                             {"offset", truth.offset, {}, {}}};
  std::vector<double> seconds;
  std::size_t refused = 0;
  std::size_t diagnosed = 0;
  std::map<std::string, std::size_t> warnings;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    auto options = scenarios::session(truth, seed);
    flyball::Random random(seed * 104729 + 5);
    family.spoil(truth, random, options);
    const auto recording = flyball::record_characterization(options);
    if (!recording) {
      std::printf("%s\n", to_string(recording.error()).c_str());
      std::exit(1);
    }
    const auto start = std::chrono::steady_clock::now();
    const auto report = flyball::identification::identify_feedforward(*recording);
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    bool right = false;
    for (const flyball::Diagnostic& found : report.diagnostics) {
      right = right || is_diagnosis(family, found.code);
      warnings[found.code] += found.severity == flyball::Severity::info ? 0 : 1;
    }
    diagnosed += right ? 1 : 0;
    if (!report.fit) {
      ++refused;
      std::printf("  seed %llu: %s\n", static_cast<unsigned long long>(seed),
                  to_string(report.fit.error()).c_str());
      continue;
    }
    const FeedforwardFit& fit = *report.fit;
    tallies[0].add(fit.kS);
    tallies[1].add(fit.kV);
    tallies[2].add(fit.kA);
    if (fit.kG) {
      tallies[3].add(*fit.kG);
    }
    if (fit.angle_offset) {
      tallies[4].add(*fit.angle_offset);
    }
  }
  const auto slowest = std::max_element(seconds.begin(), seconds.end()) - seconds.begin();
  std::printf("%s, %s: %llu seeds, %zu refused, %.0f ms a fit (worst %.0f, seed %llu)",
              std::string(family.name).c_str(), std::string(truth.name).c_str(),
              static_cast<unsigned long long>(seeds), refused, 1e3 * quantile(seconds, 0.5),
              1e3 * quantile(seconds, 1.0),
              static_cast<unsigned long long>(first) + static_cast<unsigned long long>(slowest));
  if (!family.diagnoses[0].empty()) {
    std::printf(", diagnosed %.1f %%", 100.0 * static_cast<double>(diagnosed) /
                                           static_cast<double>(std::max<std::uint64_t>(1, seeds)));
  }
  for (const auto& [code, count] : warnings) {
    if (count > 0) {
      std::printf(", %s %zu", code.c_str(), count);
    }
  }
  std::printf("\n");
  for (const Tally& tally : tallies) {
    if (!tally.errors.empty()) {
      print(tally);
    }
  }
  std::fflush(stdout);
}

/// Recordings that do not say what they are of.
void run_open(const scenarios::Family& family, const scenarios::Truth& truth, std::uint64_t first,
              std::uint64_t seeds) {
  std::size_t right = 0;
  std::size_t asked = 0;
  std::size_t wrong = 0;
  std::vector<double> seconds;
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    auto options = scenarios::session(truth, seed);
    flyball::Random random(seed * 104729 + 5);
    family.spoil(truth, random, options);
    auto recording = flyball::record_characterization(options).value();
    recording.mechanism.reset();
    const auto prepared = flyball::identification::prepare(recording).value();
    const auto start = std::chrono::steady_clock::now();
    const auto choice = flyball::identification::choose_mechanism(prepared);
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!choice || choice->fitting.size() > 1) {
      ++asked;
      std::printf("  seed %llu: %s\n", static_cast<unsigned long long>(seed),
                  choice ? choice->evidence.c_str() : to_string(choice.error()).c_str());
    } else if (choice->fitting.front() == truth.kind) {
      ++right;
    } else {
      ++wrong;
      std::printf("  seed %llu WRONG: %s: %s\n", static_cast<unsigned long long>(seed),
                  std::string(to_string(choice->fitting.front())).c_str(),
                  choice->evidence.c_str());
    }
  }
  std::printf("%s, %s: %zu right, %zu asked, %zu wrong, %.0f ms\n",
              std::string(family.name).c_str(), std::string(truth.name).c_str(), right, asked,
              wrong, 1e3 * quantile(seconds, 0.5));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t seeds = 1000;
  std::uint64_t first = 1;
  std::string_view only;
  std::string_view of_family = "clean";
  bool open = false;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view option = i + 1 < argc ? argv[i] : "";
    if (option == "--seeds") {
      seeds = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (option == "--seed") {
      first = std::strtoull(argv[i + 1], nullptr, 10);
    } else if (option == "--only") {
      only = argv[i + 1];
    } else if (option == "--family") {
      of_family = argv[i + 1];
    } else if (option == "--kind" && std::string_view(argv[i + 1]) == "open") {
      open = true;
    } else {
      std::fprintf(stderr,
                   "usage: %s [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME|all] "
                   "[--kind open]\n",
                   argv[0]);
      return 2;
    }
  }
  for (const scenarios::Family& family : scenarios::families) {
    for (const scenarios::Truth& truth : scenarios::mechanisms) {
      if ((of_family == "all" || family.name == of_family) &&
          (only.empty() || truth.name.find(only) != std::string_view::npos)) {
        (open ? run_open : run)(family, truth, first, seeds);
      }
    }
  }
  return 0;
}
