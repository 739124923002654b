#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <map>
#include <string>
#include <string_view>

#include <malloc.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <flyball/solve/solver.hpp>

#include "numeric/laws.hpp"
#include "numeric/problem_maker.hpp"

/// Made-up problems for every kind of `flyball solve`: each is answered with finite numbers that
/// satisfy the kind's equations, or refused, within bounded time and memory.
namespace flyball::fuzz {
namespace {

#if defined(__has_feature)
#define FLYBALL_FUZZ_SANITIZED __has_feature(address_sanitizer)
#elif defined(__SANITIZE_ADDRESS__)
#define FLYBALL_FUZZ_SANITIZED 1
#else
#define FLYBALL_FUZZ_SANITIZED 0
#endif

/// The address sanitizer takes five times as long, and keeps what is freed.
constexpr double longest_answer = FLYBALL_FUZZ_SANITIZED ? 10.0 : 2.0;                      ///< s
constexpr long most_memory = FLYBALL_FUZZ_SANITIZED ? 4L * 1024 * 1024 : 1L * 1024 * 1024;  ///< KiB

/// Kinds of which some answers miss an equation by more than 1e-10; see docs/fuzzing.md.
constexpr std::string_view open_kinds[] = {"dare", "care", "logm", "powm"};

bool is_open(const solve::Kind& kind) {
  return std::find(std::begin(open_kinds), std::end(open_kinds), kind.name) != std::end(open_kinds);
}

struct Options {
  std::uint64_t problems = 20000;
  std::uint64_t first = 0;
  std::uint64_t seed = 1;
  std::string kind{};  ///< Empty: all.
  bool strict = false;
  double longest = longest_answer;  ///< s
  std::size_t shown = 3;
  bool verbose = false;
};

constexpr const char* usage =
    "usage: numeric_fuzzer [--problems N] [--first N] [--seed N] [--kind NAME] [--shown N] "
    "[--longest SECONDS] [--strict] [--verbose]\n"
    "Equations of kinds that are still open fail the run only if it is --strict.\n"
    "Problem N of a seed is the same in every run: --first N --problems 1 makes it again.\n";

bool read(int argc, char** argv, Options& options) {
  for (int k = 1; k < argc; ++k) {
    const std::string_view name = argv[k];
    if (name == "--verbose") {
      options.verbose = true;
      continue;
    }
    if (name == "--strict") {
      options.strict = true;
      continue;
    }
    if (k + 1 == argc) {
      return false;
    }
    const char* value = argv[++k];
    if (name == "--problems") {
      options.problems = std::strtoull(value, nullptr, 10);
    } else if (name == "--first") {
      options.first = std::strtoull(value, nullptr, 10);
    } else if (name == "--seed") {
      options.seed = std::strtoull(value, nullptr, 10);
    } else if (name == "--shown") {
      options.shown = std::strtoull(value, nullptr, 10);
    } else if (name == "--longest") {
      options.longest = std::strtod(value, nullptr);
    } else if (name == "--kind") {
      options.kind = value;
    } else {
      return false;
    }
  }
  return true;
}

/// What is being solved, for whoever comes after a crash or a hang.
std::string current;  // NOLINT: read by the signal handler alone

void tell_current(int signal) {
  static constexpr char crash[] = "\ncrash or hang (over 20 s) at: ";
  (void)!::write(STDERR_FILENO, crash, sizeof crash - 1);
  (void)!::write(STDERR_FILENO, current.data(), current.size());
  (void)!::write(STDERR_FILENO, "\n", 1);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void watch() {
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGVTALRM}) {
    std::signal(signal, tell_current);
  }
}

/// Processor time; others' work does not count.
double seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void allow(int cpu_seconds) {
  const itimerval timer{.it_interval = {}, .it_value = {.tv_sec = cpu_seconds, .tv_usec = 0}};
  setitimer(ITIMER_VIRTUAL, &timer, nullptr);
}

struct Worst {
  double defect = 0.0;
  std::size_t violations = 0;
};

struct Tally {
  std::uint64_t problems = 0;
  std::uint64_t answers = 0;
  double slowest = 0.0;
  std::map<std::string, Worst> laws{};
};

class Run {
 public:
  explicit Run(const Options& options) : options_(options) {}

  void one(const solve::Kind& kind, std::uint64_t index) {
    Choices choices(options_.seed * 0x9e3779b97f4a7c15ULL + index);
    const nlohmann::json problem = make_problem(kind, choices);
    current = std::string(kind.name) + ' ' + problem.dump();
    if (options_.verbose) {
      std::printf("%s\n", current.c_str());
    }
    const solve::Solver solver = solve::Solver::create(kind.name).value();
    const std::string text = problem.dump();
    allow(20);
    const double begin = seconds();
    const solve::Answer answer = solver.solve(text);
    const double took = seconds() - begin;
    allow(0);
    Tally& tally = tallies_[std::string(kind.name)];
    ++tally.problems;
    tally.slowest = std::max(tally.slowest, took);
    if (took > options_.longest) {
      violation(kind, index, "answered in time", took);
    }
    const nlohmann::json read = nlohmann::json::parse(answer.json);
    if (options_.verbose) {
      std::printf("  %s\n", answer.json.c_str());
    }
    if (!answer.solved) {
      if (read.at("error").at("message").get_ref<const std::string&>().empty()) {
        violation(kind, index, "a refusal says why", 0.0);
      }
      return;
    }
    ++tally.answers;
    for (const Verdict& verdict : check_answer(kind, problem, read)) {
      Worst& worst = tally.laws[verdict.law];
      worst.defect = std::max(worst.defect, verdict.defect);
      if (verdict.defect <= tolerance) {
        continue;
      }
      const bool open = !options_.strict && is_open(kind) && !verdict.law.starts_with("finite") &&
                        !verdict.law.starts_with("has");
      if (open) {
        ++worst.violations;
      } else {
        violation(kind, index, verdict.law, verdict.defect);
      }
    }
  }

  [[nodiscard]] std::size_t violations() const { return violations_; }

  void report() const {
    std::printf("%-24s %10s %10s %10s  worst defects\n", "kind", "problems", "answered",
                "slowest, s");
    std::uint64_t problems = 0;
    for (const auto& [name, tally] : tallies_) {
      problems += tally.problems;
      std::printf("%-24s %10llu %10llu %10.4f ", name.c_str(),
                  static_cast<unsigned long long>(tally.problems),
                  static_cast<unsigned long long>(tally.answers), tally.slowest);
      for (const auto& [law, worst] : tally.laws) {
        std::printf(" %s %.1e", law.c_str(), worst.defect);
        if (worst.violations > 0) {
          std::printf(" (%zu violations)", worst.violations);
        }
        std::printf(";");
      }
      std::printf("\n");
    }
    std::printf("%llu problems, %zu violations\n", static_cast<unsigned long long>(problems),
                violations_);
  }

 private:
  void violation(const solve::Kind& kind, std::uint64_t index, const std::string& law,
                 double defect) {
    ++violations_;
    Worst& worst = tallies_[std::string(kind.name)].laws[law];
    if (++worst.violations <= options_.shown) {
      std::printf("violation: %s, %s: %.3g (--seed %llu --first %llu --problems 1)\n  %s\n",
                  std::string(kind.name).c_str(), law.c_str(), defect,
                  static_cast<unsigned long long>(options_.seed),
                  static_cast<unsigned long long>(index), current.c_str());
      std::fflush(stdout);
    }
  }

  const Options& options_;
  std::map<std::string, Tally> tallies_;
  std::size_t violations_ = 0;
};

int run(const Options& options) {
  const std::span<const solve::Kind> kinds = solve::kinds();
  watch();
  Run made(options);
  std::size_t held_before = 0;
  for (std::uint64_t k = options.first; k < options.first + options.problems; ++k) {
    const solve::Kind& kind = kinds[k % kinds.size()];
    if (options.kind.empty() || options.kind == kind.name) {
      made.one(kind, k);
    }
    if (k - options.first == options.problems / 2) {
      held_before = mallinfo2().uordblks;  // tables and tallies are there by now
    }
  }
  made.report();
  const std::size_t held = mallinfo2().uordblks;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  std::printf("memory: %ld MiB at most\n", used.ru_maxrss / 1024);
  bool good = made.violations() == 0;
  if (held > held_before + (std::size_t{1} << 20) && held_before > 0) {
    std::printf("memory grows: %zu bytes held half way, %zu at the end\n", held_before, held);
    good = false;
  }
  if (used.ru_maxrss > most_memory) {
    std::printf("more memory than %ld MiB\n", most_memory / 1024);
    good = false;
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace flyball::fuzz

int main(int argc, char** argv) {
  flyball::fuzz::Options options;
  if (!flyball::fuzz::read(argc, argv, options)) {
    std::fputs(flyball::fuzz::usage, stderr);
    return 2;
  }
  return flyball::fuzz::run(options);
}
