// What the identification says of logs whose mechanism or sensors have what the gains' model lacks.
//
//   bench_diagnoses [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME]
//                   [--show silent|wrong|missed|alarms]
//
// Of each family with a diagnosis: how many logs carry it, as a warning or as what the log leaves
// open (`term_in_doubt`); how many are given another; how many of the intervals of those without
// the right one hold the truth. Logs in which the defect does not act (no test could tell them
// from a plain one's, from the simulator's truth: distinguishable.hpp) are counted apart. Of each
// family without: how many logs are given any diagnosis of this kind.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>

#include <flyball/identification/feedforward_fit.hpp>

#include "distinguishable.hpp"
#include "scenarios.hpp"

namespace {

using flyball::Diagnostic;
using flyball::identification::FeedforwardFit;
using flyball::identification::FitReport;
using flyball::identification::GainEstimate;

/// What says that the mechanism or its sensors are not as the gains' model supposes.
constexpr std::array<std::string_view, 14> kinds{"spring",
                                                 "drag",
                                                 "asymmetric_friction",
                                                 "friction_along_travel",
                                                 "current_limit",
                                                 "sag",
                                                 "backlash",
                                                 "elastic",
                                                 "slip",
                                                 "position_jumps",
                                                 "saturated",
                                                 "outliers",
                                                 "poor_fit",
                                                 "channels_disagree"};

bool is_right(const scenarios::Family& family, const Diagnostic& found) {
  return std::any_of(family.diagnoses.begin(), family.diagnoses.end(), [&](std::string_view right) {
    return !right.empty() &&
           (found.code == right ||
            (found.code == "term_in_doubt" && found.message.find(right) != std::string::npos));
  });
}

struct Share {
  std::size_t all = 0;
  std::size_t those = 0;
  void add(bool is) {
    ++all;
    those += is ? 1U : 0U;
  }
  void add(const Share& other) {
    all += other.all;
    those += other.those;
  }
  [[nodiscard]] double percent() const {
    return all == 0 ? 100.0 : 100.0 * static_cast<double>(those) / static_cast<double>(all);
  }
};

struct Count {
  std::size_t logs = 0;
  std::size_t sure = 0;
  std::size_t doubted = 0;
  std::size_t wrong = 0;
  Share silent;       ///< Intervals of logs without the right diagnosis.
  Share all;          ///< Intervals of all.
  Share undiagnosed;  ///< Intervals of logs with no diagnosis whatever.
  void add(const Count& other) {
    logs += other.logs;
    sure += other.sure;
    doubted += other.doubted;
    wrong += other.wrong;
    silent.add(other.silent);
    all.add(other.all);
    undiagnosed.add(other.undiagnosed);
  }
  void print(const char* name) const {
    if (logs == 0) {
      return;
    }
    const auto of_logs = [this](std::size_t n) {
      return 100.0 * static_cast<double>(n) / static_cast<double>(logs);
    };
    std::printf(
        "  %-12s %5zu logs: told %5.1f %% (sure %5.1f %%), another %4.1f %%; intervals true: "
        "without the right one %5.1f %% of %zu, without any %5.1f %% of %zu, all %5.1f %%\n",
        name, logs, of_logs(sure + doubted), of_logs(sure), of_logs(wrong), silent.percent(),
        silent.all, undiagnosed.percent(), undiagnosed.all, all.percent());
  }
};

struct Counts {
  Count acting;
  Count idle;
  std::map<std::string, std::size_t> alarms;
  void add(const Counts& other) {
    acting.add(other.acting);
    idle.add(other.idle);
    for (const auto& [name, count] : other.alarms) {
      alarms[name] += count;
    }
  }
};

std::string_view show;

void print_log(std::uint64_t seed, double distance, const FitReport& report) {
  std::printf("    seed %llu, distance %.1f:\n", static_cast<unsigned long long>(seed), distance);
  for (const Diagnostic& found : report.diagnostics) {
    if (found.code != "repeated_rows") {
      std::printf("      %s: %s\n", found.code.c_str(), found.message.c_str());
    }
  }
}

Counts run(const scenarios::Family& family, const scenarios::Truth& truth, std::uint64_t first,
           std::uint64_t seeds) {
  Counts counts;
  const bool clean = family.diagnoses[0].empty();
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    auto options = scenarios::session(truth, seed);
    flyball::Random random(seed * 104729 + 5);
    family.spoil(truth, random, options);
    const FitReport report = flyball::identification::identify_feedforward(
        flyball::record_characterization(options).value());
    const double distance = clean ? 0.0 : scenarios::distance_to_plain(options);
    Count& count = clean || distance >= scenarios::acts_from ? counts.acting : counts.idle;
    ++count.logs;
    bool sure = false;
    bool doubted = false;
    bool any = false;
    for (const Diagnostic& found : report.diagnostics) {
      const bool doubt = found.code == "term_in_doubt";
      const bool of_kind = std::find(kinds.begin(), kinds.end(), found.code) != kinds.end();
      const bool right = is_right(family, found);
      sure = sure || (right && !doubt);
      doubted = doubted || (right && doubt);
      any = any || of_kind || doubt;
      if (of_kind || doubt) {
        ++counts.alarms[found.code];
      }
    }
    const bool right = sure || doubted;
    count.sure += sure ? 1 : 0;
    count.doubted += doubted && !sure ? 1 : 0;
    count.wrong += any && !right ? 1 : 0;
    if ((show == "silent" && !right && !any) || (show == "wrong" && !right && any) ||
        (show == "alarms" && any) || (show == "missed" && !right)) {
      print_log(seed, distance, report);
    }
    if (!report.fit) {
      std::printf("    seed %llu: %s\n", static_cast<unsigned long long>(seed),
                  to_string(report.fit.error()).c_str());
      continue;
    }
    const FeedforwardFit& fit = *report.fit;
    const auto add = [&](const GainEstimate& gain, double value) {
      const bool holds = gain.interval[0] <= value && value <= gain.interval[1];
      count.all.add(holds);
      if (!right) {
        count.silent.add(holds);
      }
      if (!any) {
        count.undiagnosed.add(holds);
      }
    };
    add(fit.kS, truth.kS);
    add(fit.kV, truth.kV);
    add(fit.kA, truth.kA);
    if (fit.kG) {
      add(*fit.kG, truth.kG);
    }
    if (fit.angle_offset) {
      add(*fit.angle_offset, truth.offset);
    }
  }
  return counts;
}

void print(const Counts& counts, bool clean) {
  counts.acting.print(clean ? "" : "acts");
  counts.idle.print("does not act");
  std::printf("   ");
  for (const auto& [name, count] : counts.alarms) {
    std::printf(" %s %zu,", name.c_str(), count);
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t seeds = 200;
  std::uint64_t first = 1;
  std::string_view only;
  std::string_view of_family = "all";
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
    } else if (option == "--show") {
      show = argv[i + 1];
    } else {
      std::fprintf(stderr,
                   "usage: %s [--seeds N] [--seed FIRST] [--only MECHANISM] [--family NAME|all] "
                   "[--show silent|wrong|missed|alarms]\n",
                   argv[0]);
      return 2;
    }
  }
  for (const scenarios::Family& family : scenarios::families) {
    if (of_family != "all" && family.name != of_family) {
      continue;
    }
    const bool clean = family.diagnoses[0].empty();
    Counts whole;
    for (const scenarios::Truth& truth : scenarios::mechanisms) {
      if (family.has(truth.kind) &&
          (only.empty() || truth.name.find(only) != std::string_view::npos)) {
        std::printf("%s, %s\n", std::string(family.name).c_str(), std::string(truth.name).c_str());
        const Counts counts = run(family, truth, first, seeds);
        print(counts, clean);
        whole.add(counts);
      }
    }
    std::printf("%s, all\n", std::string(family.name).c_str());
    print(whole, clean);
  }
  return 0;
}
