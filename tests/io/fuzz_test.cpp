#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <flyball/core/random.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/log.hpp>
#include <flyball/io/wpilog.hpp>

#include "io/examples.hpp"
#include "support/sanitizer.hpp"

/// Mutants of well-formed files: each must be read or refused; what is read keeps the promises of
/// Log. The address-sanitized build of the same test looks at every access.
namespace flyball::fuzz_test {
namespace {

std::size_t below(Random& random, std::size_t bound) {
  return bound == 0 ? 0 : static_cast<std::size_t>(random.bits() % bound);
}

/// Inserts up to `length` bytes of `from` into `bytes`.
void splice(std::string& bytes, std::size_t at, std::string_view from, std::size_t begin,
            std::size_t length) {
  const std::vector<char> piece(
      from.begin() + static_cast<std::ptrdiff_t>(begin),
      from.begin() + static_cast<std::ptrdiff_t>(std::min(from.size(), begin + length)));
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), piece.begin(), piece.end());
}

/// Changes a file in one to four ways that disks, cables and editors do.
std::string mutate(std::string bytes, const std::string& other, Random& random) {
  const std::size_t changes = 1 + below(random, 4);
  for (std::size_t change = 0; change < changes && !bytes.empty(); ++change) {
    const std::size_t at = below(random, bytes.size());
    const std::size_t length = 1 + below(random, 40);
    switch (below(random, 8)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(random, 8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(random.bits());
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.erase(at, std::min(length, bytes.size() - at));
        break;
      case 4:
        splice(bytes, at, bytes, below(random, bytes.size()), length);
        break;
      case 5:
        splice(bytes, at, other, below(random, other.size()), length);
        break;
      case 6:  // lengths that promise gigabytes
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    std::min<std::size_t>(4, bytes.size() - at), '\xFF');
        break;
      default:
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    std::min(length, bytes.size() - at), '\0');
        break;
    }
  }
  return bytes;
}

void expect_tidy(const Log& log) {
  const auto ascends = [](const std::vector<double>& time) {
    return std::is_sorted(time.begin(), time.end()) &&
           std::all_of(time.begin(), time.end(), [](double t) { return std::isfinite(t); });
  };
  for (const Signal& signal : log.signals) {
    ASSERT_EQ(signal.time.size(), signal.value.size());
    ASSERT_TRUE(ascends(signal.time));
    for (const double value : signal.value) {
      ASSERT_TRUE(std::isfinite(value));
    }
  }
  for (const TextSignal& text : log.texts) {
    ASSERT_EQ(text.time.size(), text.value.size());
    ASSERT_TRUE(ascends(text.time));
  }
  if (log.sysid) {
    for (const SysIdJson::Run& run : log.sysid->runs) {
      ASSERT_FALSE(run.time.empty());
      ASSERT_TRUE(ascends(run.time));
      ASSERT_EQ(run.time.size(), run.velocity.size());
    }
  }
}

void fuzz(const std::string& seed_file, const std::string& other, std::uint64_t seed, int mutants) {
  rusage before{};
  ::getrusage(RUSAGE_SELF, &before);
  Random random(seed);
  int read = 0;
  for (int i = 0; i < mutants; ++i) {
    const Expected<Log> log = parse_log(mutate(seed_file, other, random), "mutant");
    if (log) {
      ++read;
      ASSERT_NO_FATAL_FAILURE(expect_tidy(*log));
    } else {
      ASSERT_FALSE(to_string(log.error()).empty());
    }
  }
  // Both ends of the range would mean that the mutations are too tame or too wild to test anything.
  EXPECT_GT(read, mutants / 50);
  EXPECT_LT(read, mutants);
  rusage after{};
  ::getrusage(RUSAGE_SELF, &after);
  if (!FLYBALL_SANITIZED) {
    EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 256 * 1024) << "KiB";
  }
}

std::string example_csv() {
  TimeSeries series({0.0, 0.1, 0.2, 0.3});
  (void)series.add("velocity", "m/s", {1.5, -2.25, 1e-3, 4});
  (void)series.add("a \"quoted\", one", "V", {12, 11.5, -11.5, 0});
  return to_csv(series);
}

std::string example_wpilog() {
  WpilogWriter writer;
  const auto array = writer.start("array", "double[]", "Meter");
  const auto pose = writer.start("pose", "struct:Pose2d", R"({"unit":"meters"})");
  for (int i = 0; i < 5; ++i) {
    writer.append(array, i, std::vector<double>(3, i));
    writer.append_raw(pose, i, std::string(24, 'x'));
  }
  writer.finish(array, 9.0);
  const std::string more = to_wpilog(example_log(6)).value();
  const std::size_t header = 12 + std::string_view("Flyball").size();
  std::string bytes = writer.bytes();
  splice(bytes, bytes.size(), more, header, more.size() - header);
  return bytes;
}

TEST(Fuzz, Wpilog) {
  fuzz(example_wpilog(), to_wpilog(example_log(2)).value(), 1, 20'000);
}

TEST(Fuzz, SysIdJson) {
  fuzz(to_sysid_json(example_sysid(3)).value(), R"({"a":[NaN,null,[-Infinity],"]]}},,1e999)", 2,
       10'000);
  fuzz(to_sysid_json(example_sysid(3, true)).value(), to_sysid_json(example_sysid(1)).value(), 3,
       10'000);
}

TEST(Fuzz, Csv) {
  fuzz(example_csv(), "\"\",;;\t\t\n\r\n\"\"\"(m/s)[V]-.e1,nan,inf", 4, 10'000);
  fuzz("Timestamp,Key,Value\n0.1,/v,1.5\n0.2,/state,none\n0.3,/v,2.5\n", example_csv(), 5, 10'000);
}

TEST(Fuzz, ManyChannelsAreBounded) {
  // Every record opens a channel and fills an array as wide as is decoded: the most that a hostile
  // file can make of its bytes.
  WpilogWriter writer;
  for (int i = 0; i < 3000; ++i) {
    const auto id = writer.start(std::to_string(i), "boolean[]");
    writer.append_raw(id, 1.0, std::string(64, '\1'));
  }
  const Expected<Log> log = parse_log(writer.bytes(), "wide.wpilog");
  ASSERT_TRUE(log);
  EXPECT_LE(log->signals.size(), 50'000U);
  EXPECT_FALSE(log->skipped.empty());
}

}  // namespace
}  // namespace flyball::fuzz_test
