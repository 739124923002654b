// Monte Carlo of the identification: recordings of known mechanisms, what is recovered of them.
//
//   bench_identification [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME]
//                        [--kind open|pairs] [--show silent]
//
// Per family of sessions (clean, and with what real logs have), mechanism and gain: median and 90th
// percentile of the relative error, share of the 95 % intervals that hold the truth, median
// relative half-width, root mean square of the errors in standard errors; and the time of a fit.
// Of a family with a diagnosis: how many logs carry it, and how many of the intervals of those that
// do not hold the truth. With --kind open the recordings do not say what they are of: how often
// that is found, asked for, or found wrong. With --kind pairs each mechanism is tested twice, with
// steps of 3 V and of 4 V: the differences in joint standard errors.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
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
  double z_squared = 0.0;

  [[nodiscard]] bool holds(const GainEstimate& gain) const {
    return gain.interval[0] <= truth && truth <= gain.interval[1];
  }
  void add(const GainEstimate& gain) {
    const double scale = std::abs(truth) > 0.0 ? std::abs(truth) : 1.0;
    errors.push_back((gain.value - truth) / scale);
    widths.push_back(0.5 * (gain.interval[1] - gain.interval[0]) / scale);
    covered += holds(gain) ? 1U : 0U;
    undetermined += gain.determined ? 0U : 1U;
    z_squared += std::pow((gain.value - truth) / gain.standard_error, 2);
  }
};

/// How many intervals there are, and how many of them hold the truth.
struct Share {
  std::size_t all = 0;
  std::size_t true_ones = 0;
  void add(bool is_true) {
    ++all;
    true_ones += is_true ? 1U : 0U;
  }
  [[nodiscard]] double percent() const {
    return all == 0 ? 100.0 : 100.0 * static_cast<double>(true_ones) / static_cast<double>(all);
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
      "half-width %6.2f %%   rms z %4.2f   undetermined %zu\n",
      std::string(tally.name).c_str(), 100.0 * quantile(magnitudes, 0.5),
      100.0 * quantile(magnitudes, 0.9), 100.0 * quantile(tally.errors, 0.5),
      100.0 * static_cast<double>(tally.covered) /
          std::max(1.0, static_cast<double>(tally.errors.size())),
      100.0 * quantile(tally.widths, 0.5),
      std::sqrt(tally.z_squared / std::max(1.0, static_cast<double>(tally.errors.size()))),
      tally.undetermined);
}

bool is_diagnosis(const scenarios::Family& family, const flyball::Diagnostic& found) {
  return std::any_of(family.diagnoses.begin(), family.diagnoses.end(), [&](std::string_view right) {
    return !right.empty() &&
           (found.code == right ||
            (found.code == "term_in_doubt" && found.message.find(right) != std::string::npos));
  });
}

/// Whether the warnings of each log without the family's diagnosis are printed.
bool shows_silent = false;

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
  Share silent;
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
      right = right || is_diagnosis(family, found);
      warnings[found.code] += found.severity == flyball::Severity::info ? 0 : 1;
    }
    diagnosed += right ? 1 : 0;
    for (const flyball::Diagnostic& found : report.diagnostics) {
      if (shows_silent && !right && found.code != "repeated_rows") {
        std::printf("  seed %llu: %s: %s\n", static_cast<unsigned long long>(seed),
                    found.code.c_str(), found.message.c_str());
      }
    }
    if (!report.fit) {
      ++refused;
      std::printf("  seed %llu: %s\n", static_cast<unsigned long long>(seed),
                  to_string(report.fit.error()).c_str());
      continue;
    }
    const FeedforwardFit& fit = *report.fit;
    const std::array<const GainEstimate*, 5> gains{&fit.kS, &fit.kV, &fit.kA,
                                                   fit.kG ? &*fit.kG : nullptr,
                                                   fit.angle_offset ? &*fit.angle_offset : nullptr};
    for (std::size_t i = 0; i < gains.size(); ++i) {
      if (gains[i] != nullptr) {
        tallies[i].add(*gains[i]);
        if (!right) {
          silent.add(tallies[i].holds(*gains[i]));
        }
      }
    }
  }
  const auto slowest = std::max_element(seconds.begin(), seconds.end()) - seconds.begin();
  std::printf("%s, %s: %llu seeds, %zu refused, %.0f ms a fit (worst %.0f, seed %llu)",
              std::string(family.name).c_str(), std::string(truth.name).c_str(),
              static_cast<unsigned long long>(seeds), refused, 1e3 * quantile(seconds, 0.5),
              1e3 * quantile(seconds, 1.0),
              static_cast<unsigned long long>(first) + static_cast<unsigned long long>(slowest));
  if (!family.diagnoses[0].empty()) {
    std::printf(", diagnosed %.1f %%, silent intervals %.1f %% of %zu true",
                100.0 * static_cast<double>(diagnosed) /
                    static_cast<double>(std::max<std::uint64_t>(1, seeds)),
                silent.percent(), silent.all);
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

/// Each mechanism tested twice, by steps of 3 V and of 4 V, by other sensors on another day.
void run_pairs(const scenarios::Family& family, const scenarios::Truth& truth, std::uint64_t first,
               std::uint64_t seeds) {
  struct Gain {
    const char* name;
    double z_squared = 0.0;
    double largest = 0.0;
    std::size_t count = 0;
  };
  std::array<Gain, 4> gains{{{"kS"}, {"kV"}, {"kA"}, {"kG"}}};
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    std::array<std::array<const GainEstimate*, 4>, 2> found{};
    std::array<std::optional<FeedforwardFit>, 2> fits;
    for (std::size_t which = 0; which < 2; ++which) {
      auto options = scenarios::session(truth, 2 * seed + which);
      if (const auto place = scenarios::session(truth, seed);
          truth.kind != flyball::mechanisms::MechanismKind::flywheel) {
        options.travel_low = place.travel_low;
        options.travel_high = place.travel_high;
        options.travel_margin = place.travel_margin;
      }
      options.step_voltage = which == 0 ? 3.0 : 4.0;
      flyball::Random random(seed * 104729 + 5);  // One mechanism has one defect.
      family.spoil(truth, random, options);
      auto report =
          flyball::identification::identify_feedforward(*flyball::record_characterization(options));
      if (report.fit) {
        fits[which] = *std::move(report.fit);
        found[which] = {&fits[which]->kS, &fits[which]->kV, &fits[which]->kA,
                        fits[which]->kG ? &*fits[which]->kG : nullptr};
      }
    }
    for (std::size_t i = 0; fits[0] && fits[1] && i < gains.size(); ++i) {
      const GainEstimate* a = found[0][i];
      const GainEstimate* b = found[1][i];
      if (a != nullptr && b != nullptr && a->determined && b->determined) {
        const double z = (a->value - b->value) / std::hypot(a->standard_error, b->standard_error);
        gains[i].z_squared += z * z;
        gains[i].largest = std::max(gains[i].largest, std::abs(z));
        ++gains[i].count;
      }
    }
  }
  std::printf("%s, %s: %llu pairs", std::string(family.name).c_str(),
              std::string(truth.name).c_str(), static_cast<unsigned long long>(seeds));
  for (const Gain& gain : gains) {
    if (gain.count > 0) {
      std::printf(", %s rms z %.2f (largest %.1f, %zu)", gain.name,
                  std::sqrt(gain.z_squared / static_cast<double>(gain.count)), gain.largest,
                  gain.count);
    }
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t seeds = 1000;
  std::uint64_t first = 1;
  std::string_view only;
  std::string_view of_family = "clean";
  std::string_view kind;
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
    } else if (option == "--show" && std::string_view(argv[i + 1]) == "silent") {
      shows_silent = true;
    } else if (option == "--kind" && (std::string_view(argv[i + 1]) == "open" ||
                                      std::string_view(argv[i + 1]) == "pairs")) {
      kind = argv[i + 1];
    } else {
      std::fprintf(stderr,
                   "usage: %s [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME|all] "
                   "[--kind open|pairs] [--show silent]\n",
                   argv[0]);
      return 2;
    }
  }
  for (const scenarios::Family& family : scenarios::families) {
    for (const scenarios::Truth& truth : scenarios::mechanisms) {
      if ((of_family == "all" || family.name == of_family) && family.has(truth.kind) &&
          (only.empty() || truth.name.find(only) != std::string_view::npos)) {
        (kind == "open"    ? run_open
         : kind == "pairs" ? run_pairs
                           : run)(family, truth, first, seeds);
      }
    }
  }
  return 0;
}
