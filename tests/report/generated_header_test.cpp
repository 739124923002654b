#include <flyball/report/generated_header.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/study/simulate.hpp>

#include "fixtures.hpp"

namespace flyball::report {
namespace {

namespace fs = std::filesystem;

/// What goes into the loop in one period: a position mechanism's reference has a velocity too.
struct Input {
  double measurement = 0.0;
  std::array<double, 2> r{};
  std::array<double, 2> r_next{};
  double battery = 12.0;
};

struct Output {
  double voltage = 0.0;
  double command = 0.0;
};

/// A folder that vanishes with the test.
class Scratch {
 public:
  Scratch() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = fs::temp_directory_path() /
            (std::string("flyball_header_") + test->name() + "_" + std::to_string(::getpid()));
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Scratch() { fs::remove_all(path_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Reads rows of hexadecimal doubles and answers each with the loop's two voltages.
std::string driver(const std::string& class_name, bool flywheel) {
  const std::string size = flywheel ? "1" : "2";
  return "#include \"loop.hpp\"\n"
         "#include \"loop.hpp\"\n"
         "#include <cstdio>\n#include <cstdlib>\n#include <new>\n#include <type_traits>\n"
         "static bool armed = false;\n"
         "void* operator new(std::size_t n) { if (armed) { std::abort(); } return std::malloc(n); "
         "}\n"
         "void operator delete(void* p) noexcept { std::free(p); }\n"
         "void operator delete(void* p, std::size_t) noexcept { std::free(p); }\n"
         "using Loop = " +
         class_name +
         ";\n"
         "static_assert(std::is_same<Loop::Reference, std::array<double, " +
         size +
         ">>::value, \"\");\n"
         "static_assert(noexcept(std::declval<Loop&>().update(0.0, {}, {}, 0.0)), \"\");\n"
         "static_assert(noexcept(std::declval<Loop&>().reset(0.0)), \"\");\n"
         "static_assert(std::is_nothrow_default_constructible<Loop>::value, \"\");\n"
         "int main() {\n"
         "  Loop loop;\n"
         "  double start = 0.0, y = 0.0, a = 0.0, b = 0.0, c = 0.0, d = 0.0, battery = 0.0;\n"
         "  if (std::scanf(\"%lf\", &start) != 1) { return 1; }\n"
         "  loop.reset(start);\n"
         "  while (std::scanf(\"%lf %lf %lf %lf %lf %lf\", &y, &a, &b, &c, &d, &battery) == 6) {\n"
         "    armed = true;\n" +
         std::string(flywheel ? "    const double u = loop.update(y, {b}, {d}, battery);\n"
                              : "    const double u = loop.update(y, {a, b}, {c, d}, battery);\n") +
         "    armed = false;\n"
         "    std::printf(\"%a %a\\n\", u, loop.command());\n"
         "  }\n"
         "}\n";
}

/// Compiles the design's header with the strictest flags and runs it over the inputs.
std::vector<Output> run_generated(const study::DesignResult& design, double start,
                                  const std::vector<Input>& inputs,
                                  const std::string& compiler = FLYBALL_CXX) {
  const Scratch scratch;
  const std::string name = header_class_name(design);
  write(scratch / "loop.hpp", generate_header(design, name));
  write(scratch / "main.cpp", driver(name, design.job.plant.kind == MechanismKind::flywheel));
  const std::string program = (scratch / "main").string();
  const std::string build = compiler +
                            " -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wconversion -Wshadow "
                            "-Werror " +
                            (scratch / "main.cpp").string() + " -o " + program + " 2> " +
                            (scratch / "log").string();
  if (std::system(build.c_str()) != 0) {
    ADD_FAILURE() << compiler << " refuses it:\n" << read(scratch / "log");
    return {};
  }
  std::string rows;
  char line[256];
  std::snprintf(line, sizeof line, "%a\n", start);
  rows += line;
  for (const Input& in : inputs) {
    std::snprintf(line, sizeof line, "%a %a %a %a %a %a\n", in.measurement, in.r[0], in.r[1],
                  in.r_next[0], in.r_next[1], in.battery);
    rows += line;
  }
  write(scratch / "in", rows);
  const std::string run =
      program + " < " + (scratch / "in").string() + " > " + (scratch / "out").string();
  EXPECT_EQ(std::system(run.c_str()), 0);
  std::vector<Output> outputs;
  std::istringstream answers(read(scratch / "out"));
  std::string u;
  std::string command;
  while (answers >> u >> command) {
    outputs.push_back({std::strtod(u.c_str(), nullptr), std::strtod(command.c_str(), nullptr)});
  }
  return outputs;
}

/// The same bits where the compiler does not contract to fused operations (x86-64 without -march).
void expect_same(double generated, double library, std::size_t step) {
#if defined(__x86_64__) && !defined(__FMA__)
  EXPECT_EQ(generated, library) << "step " << step;
#else
  EXPECT_NEAR(generated, library, 1e-12 * std::max(1.0, std::abs(library))) << "step " << step;
#endif
}

/// The inputs that the library's own closed loop saw, and what it answered.
void expect_library_voltages(const study::DesignResult& design, const std::string& compiler) {
  const auto simulated = study::simulate(
      design, {.measurement_noise = *design.job.estimator.measurement_std, .seed = 7});
  ASSERT_TRUE(simulated) << to_string(simulated.error());
  const TimeSeries& series = simulated->series;
  const std::vector<MotionState> reference = study::reference_of(design);
  ASSERT_EQ(series.rows(), reference.size());
  std::vector<Input> inputs(series.rows());
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const MotionState& r = reference[k];
    const MotionState& next = reference[std::min(k + 1, reference.size() - 1)];
    inputs[k] = {(*series.find("measurement"))[k],
                 {r.position, r.velocity},
                 {next.position, next.velocity},
                 (*series.find("rail_voltage"))[k]};
  }
  const std::vector<Output> outputs = run_generated(design, 0.0, inputs, compiler);
  ASSERT_EQ(outputs.size(), inputs.size());
  double largest = 0.0;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    expect_same(outputs[k].voltage, (*series.find("voltage"))[k], k);
    expect_same(outputs[k].command, (*series.find("command"))[k], k);
    largest = std::max(largest, std::abs(outputs[k].voltage));
  }
  EXPECT_GT(largest, 1.0) << "a loop that does nothing proves nothing";
}

class GeneratedHeader : public ::testing::TestWithParam<std::tuple<MechanismKind, bool>> {};

TEST_P(GeneratedHeader, GivesTheVoltagesOfTheLibrarysClosedLoop) {
  const auto [kind, kA_determined] = GetParam();
  expect_library_voltages(design_result(kind, kA_determined), FLYBALL_CXX);
}

TEST_P(GeneratedHeader, DoesSoUnderClangToo) {
  if (std::string(FLYBALL_CLANG).empty()) {
    GTEST_SKIP() << "no clang here";
  }
  const auto [kind, kA_determined] = GetParam();
  expect_library_voltages(design_result(kind, kA_determined), FLYBALL_CLANG);
}

TEST_P(GeneratedHeader, IsFiniteAndWithinItsLimitsForWhateverItIsGiven) {
  const auto [kind, kA_determined] = GetParam();
  const study::DesignResult design = design_result(kind, kA_determined);
  constexpr double inf = std::numeric_limits<double>::infinity();
  const std::array<double, 9> odd{0.0, -1.0, 1e300, -1e300, inf, -inf, std::nan(""), 5e-324, 11.0};
  std::vector<Input> inputs;
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const auto pick = [&](double usual) {
      return random.uniform() < 0.1 ? odd[random.bits() % odd.size()] : usual;
    };
    // References are finite numbers; measurements and batteries are what sensors say.
    inputs.push_back({pick(random.normal()),
                      {random.normal(), random.normal()},
                      {random.normal(), random.normal()},
                      pick(12.0)});
  }
  const std::vector<Output> outputs = run_generated(design, 0.0, inputs);
  ASSERT_EQ(outputs.size(), inputs.size());
  for (const Output& out : outputs) {
    EXPECT_TRUE(std::isfinite(out.voltage));
    EXPECT_LE(std::abs(out.voltage), design.job.controller.max_voltage);
    EXPECT_LE(std::abs(out.command), design.job.plant.nominal_voltage);
  }
}

INSTANTIATE_TEST_SUITE_P(Loops, GeneratedHeader,
                         ::testing::Values(std::tuple(MechanismKind::flywheel, true),
                                           std::tuple(MechanismKind::elevator, true),
                                           std::tuple(MechanismKind::arm, true),
                                           std::tuple(MechanismKind::flywheel, false),
                                           std::tuple(MechanismKind::elevator, false),
                                           std::tuple(MechanismKind::arm, false)),
                         [](const auto& loop) {
                           return std::string(to_string(std::get<0>(loop.param))) +
                                  (std::get<1>(loop.param) ? "" : "_without_kA");
                         });

TEST(GeneratedHeaderText, ClassNamesAreMadeIdentifiers) {
  const study::DesignResult design = design_result(MechanismKind::elevator);
  EXPECT_NE(generate_header(design, "4 bar").find("class _4_bar {"), std::string::npos);
  EXPECT_NE(generate_header(design, "").find("class Loop {"), std::string::npos);
  EXPECT_NE(generate_header(design, "double").find("class double_ {"), std::string::npos);
  EXPECT_NE(generate_header(design, "A; int x").find("class A__int_x {"), std::string::npos);
  EXPECT_EQ(header_class_name(design), "ElevatorLoop");
}

TEST(GeneratedHeaderText, IsDeterministicAndNamesItsOrigin) {
  const study::DesignResult design = design_result(MechanismKind::arm);
  const std::string text = generate_header(design, "ArmLoop");
  EXPECT_EQ(text, generate_header(design, "ArmLoop"));
  EXPECT_NE(text.find("generated by Flyball"), std::string::npos);
  EXPECT_NE(text.find("kV = 1.2 V·s/rad"), std::string::npos);
}

}  // namespace
}  // namespace flyball::report
