#include <flyball/export/motion_table.hpp>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

namespace flyball::exports::motion_table_test {
namespace {

namespace fs = std::filesystem;

/// x = sin t with its rates, and what has none.
TimeSeries sines(int rows) {
  std::vector<double> t;
  std::vector<double> x;
  std::vector<double> v;
  std::vector<double> a;
  std::vector<double> other;
  for (int i = 0; i < rows; ++i) {
    const double at = 0.1 * i;
    t.push_back(at);
    x.push_back(std::sin(at));
    v.push_back(std::cos(at));
    a.push_back(-std::sin(at));
    other.push_back(i % 2);
  }
  TimeSeries table(t);
  EXPECT_TRUE(table.add("x", "m", x));
  EXPECT_TRUE(table.add("v", "m/s", v));
  EXPECT_TRUE(table.add("a", "m/s^2", a));
  EXPECT_TRUE(table.add("other", "", other));
  return table;
}

/// What the header says every millisecond, compiled with warnings as errors.
std::string run(const std::string& header, const std::string& print) {
  const fs::path folder =
      fs::temp_directory_path() / ("flyball_motion_table_test_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "table.hpp") << header;
  std::ofstream(folder / "main.cpp") << "#include \"table.hpp\"\n#include <cstdio>\nint main() {\n"
                                     << print << "}\n";
  const std::string line = "cd '" + folder.string() + "' && (" + FLYBALL_CXX +
                           " -std=c++20 -O0 -fno-exceptions -Wall -Wextra -Wpedantic -Wconversion "
                           "-Wshadow -Werror main.cpp -o main && ./main > out) > log 2>&1";
  if (std::system(line.c_str()) != 0) {
    std::ifstream log(folder / "log");
    ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(log), {});
  }
  std::ifstream out(folder / "out");
  std::string answer(std::istreambuf_iterator<char>(out), {});
  fs::remove_all(folder);
  return answer;
}

// h⁴/384 = 2.6e-7 of the cubics of sin and cos; h²/8 = 1.25e-3 of what is in proportion.
TEST(MotionTable, ValuesGoAlongTheirRates) {
  constexpr MotionRate rates[] = {{"x", "v"}, {"v", "a"}};
  const std::string header = motion_table(sines(33), "motion", "a sine", rates).value();
  EXPECT_NE(header.find("x with v, v with a"), std::string::npos);
  std::istringstream out(run(header, R"(
  for (int i = -5; i < 3210; ++i) {
    const motion::Row row = motion::at(1e-3 * i);
    std::printf("%.17g %.17g %.17g %.17g\n", row.x, row.v, row.a, row.other);
  }
)"));
  double off[3] = {};
  double least = 1.0;
  int count = 0;
  for (int i = -5; i < 3210; ++i) {
    double x = 0.0;
    double v = 0.0;
    double a = 0.0;
    double other = 0.0;
    if (!(out >> x >> v >> a >> other)) {
      break;
    }
    ++count;
    const double t = std::min(std::max(1e-3 * i, 0.0), 3.2);
    off[0] = std::max(off[0], std::abs(x - std::sin(t)));
    off[1] = std::max(off[1], std::abs(v - std::cos(t)));
    off[2] = std::max(off[2], std::abs(a + std::sin(t)));
    least = std::min(least, std::min(other, 1.0 - other));
  }
  EXPECT_EQ(count, 3215);
  EXPECT_LE(off[0], 2.7e-7);
  EXPECT_LE(off[1], 2.7e-7);
  EXPECT_GT(off[2], 1e-3);
  EXPECT_LE(off[2], 1.3e-3);
  EXPECT_GE(least, -1e-12);
}

TEST(MotionTable, WithoutRatesAllIsInProportion) {
  const std::string header = motion_table(sines(3), "motion", "a sine").value();
  EXPECT_EQ(header.find("cubic"), std::string::npos);
  EXPECT_NE(header.find("a.x + s * (b.x - a.x)"), std::string::npos);
}

TEST(MotionTable, TellsWhatIsWrong) {
  constexpr MotionRate unknown[] = {{"x", "vx"}};
  const auto error = motion_table(sines(3), "motion", "a sine", unknown).error();
  EXPECT_TRUE(error.is(ArgumentError::unknown_name));
  EXPECT_NE(to_string(error).find("\"vx\""), std::string::npos);
  EXPECT_TRUE(motion_table(sines(1), "motion", "").error().is(ArgumentError::empty));
  EXPECT_TRUE(motion_table(sines(3), "my motion", "").error().is(ArgumentError::malformed));
}

}  // namespace
}  // namespace flyball::exports::motion_table_test
