#include <flyball/export/generated_header.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include <flyball/core/random.hpp>
#include <flyball/simulation/mechanism_loop.hpp>

#include "control/mechanism_designs.hpp"

namespace flyball::exports {
namespace {

namespace fs = std::filesystem;
using test::MechanismKind;

/// What goes into a loop in one period.
struct Input {
  double measurement = 0.0;
  MotionState r{};
  MotionState r_next{};
  double battery = 12.0;
};

struct Output {
  double voltage = 0.0;
  double command = 0.0;
  double estimate = 0.0;  ///< Sum of x_hat.
  bool measured = false;
};

/// A loop of the tests: one of all mechanisms with every choice that a design has.
struct Loop {
  std::string name;
  MechanismControllerDesign design;
};

std::vector<Loop> all_loops() {
  std::vector<Loop> loops;
  for (const auto& [kind, kA_determined] : test::cases) {
    for (unsigned choice = 0; choice < 16; ++choice) {
      MechanismControllerDesign design = test::design_of(kind, kA_determined);
      design.feed_forward_gravity = (choice & 1U) == 0;
      design.feed_forward_friction = (choice & 2U) == 0;
      design.compensate_voltage = (choice & 4U) == 0;
      design.measurement_delay = Time((choice & 8U) == 0 ? 0.015 : 0.0);
      design.max_voltage = choice % 3 == 0 ? 12.0 : 5.0;
      design.nominal_voltage = choice % 5 == 0 ? 10.0 : 12.0;
      loops.push_back({"Loop" + std::to_string(loops.size()), design});
    }
    // A part of a period, whole ones, more than whole ones.
    for (const double delay : {0.015, 0.04, 0.05, 0.2}) {
      MechanismControllerDesign design =
          test::predicting(test::design_of(kind, kA_determined), Time(delay));
      design.compensate_voltage = delay != 0.05;
      design.max_voltage = delay == 0.04 ? 5.0 : 12.0;
      loops.push_back({"Loop" + std::to_string(loops.size()), design});
    }
  }
  return loops;
}

/// There and back, so that the velocity is zero, positive and negative.
std::vector<MotionState> reference_of(MechanismKind kind) {
  std::vector<MotionState> reference;
  const bool flywheel = kind == MechanismKind::flywheel;
  const TrapezoidProfile there({flywheel ? 200.0 : 1.5, flywheel ? 500.0 : 6.0}, {},
                               {flywheel ? 250.0 : 0.8, 0.0});
  for (int k = 0; k < 220; ++k) {
    const MotionState now = there.sample(0.02 * (k < 110 ? k : 220 - k));
    const double sign = k < 110 ? 1.0 : -1.0;
    reference.push_back(flywheel ? MotionState{0.0, now.position, 0.0}
                                 : MotionState{now.position, sign * now.velocity, 0.0});
  }
  return reference;
}

/// The loop on a mechanism that differs from its model, with everything that is between them.
MechanismResponse simulated(const MechanismControllerDesign& design) {
  MechanismLoop loop;
  loop.controller = design;
  loop.truth.gains = design.gains;
  loop.truth.gains.kV *= 1.1;
  loop.truth.gains.kA *= 1.3;
  loop.truth.breakaway = 1.2;
  loop.truth.battery = {.open_circuit_voltage = 12.4, .resistance = 0.03};
  loop.truth.motor_resistance = 0.1;
  const double unit = design.kind == MechanismKind::flywheel ? 1.0 : 1e-3;
  loop.truth.sensor = {.resolution = 0.5 * unit, .noise = unit, .delay = design.measurement_delay};
  loop.truth.actuation_delay = Time(0.004);
  loop.truth.voltage_noise = 0.05;
  loop.reference = reference_of(design.kind);
  return simulate_mechanism(loop).value();
}

/// What the simulation's controller was given.
std::vector<Input> inputs_of(const MechanismResponse& response, MechanismKind kind) {
  const std::vector<MotionState> reference = reference_of(kind);
  std::vector<Input> inputs;
  for (std::size_t k = 0; k < reference.size(); ++k) {
    inputs.push_back({(*response.series.find("measurement"))[k], reference[k],
                      reference[std::min(k + 1, reference.size() - 1)],
                      (*response.series.find("rail_voltage"))[k]});
  }
  return inputs;
}

/// Sensors that fail, batteries that cannot be, references that jump.
std::vector<Input> odd_inputs() {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const std::array odd{0.0,  -1.0,  1e9,    -1e9,    inf,      -inf,   std::nan(""), 5e-324,
                       1e99, 1e154, -1e154, 1.7e308, -1.7e308, -1e300, 3.0,          121.0};
  Random random(3);
  const auto pick = [&](double usual) {
    return random.uniform() < 0.2 ? odd[random.bits() % odd.size()] : usual;
  };
  std::vector<Input> inputs;
  for (int k = 0; k < 150; ++k) {
    const double velocity = random.uniform() < 0.2 ? 0.0 : random.normal();
    inputs.push_back({pick(random.normal()),
                      {k % 7 == 3 ? pick(random.normal()) : random.normal(), velocity},
                      {random.normal(), k % 5 == 2 ? pick(random.normal()) : random.normal()},
                      pick(11.0)});
  }
  return inputs;
}

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

/// A program that runs the loop of a number over rows of hexadecimal doubles and answers each.
std::string driver(const std::vector<Loop>& loops) {
  std::string text;
  std::string choice;
  for (const Loop& loop : loops) {
    text += "#include \"" + loop.name + ".hpp\"\n#include \"" + loop.name + ".hpp\"\n";
    choice += "  if (name == \"" + loop.name + "\") { return run<" + loop.name + ">(); }\n";
  }
  return text + R"(
#include <cstdio>
#include <cstdlib>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

static bool armed = false;
void* operator new(std::size_t n) { if (armed) { std::abort(); } return std::malloc(n); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

template <class Reference>
static Reference reference(double position, double velocity) {
  if constexpr (std::tuple_size<Reference>::value == 1) {
    static_cast<void>(position);
    return {velocity};
  } else {
    return {position, velocity};
  }
}

template <class Loop>
static int run() {
  static_assert(noexcept(std::declval<Loop&>().update(0.0, {}, {}, 0.0)), "");
  static_assert(noexcept(std::declval<Loop&>().reset(0.0)), "");
  static_assert(std::is_nothrow_default_constructible<Loop>::value, "");
  using Reference = typename Loop::Reference;
  Loop loop;
  loop.reset(0.0);
  double y = 0.0, a = 0.0, b = 0.0, c = 0.0, d = 0.0, battery = 0.0;
  while (std::scanf("%lf %lf %lf %lf %lf %lf", &y, &a, &b, &c, &d, &battery) == 6) {
    armed = true;
    const double u = loop.update(y, reference<Reference>(a, b), reference<Reference>(c, d), battery);
    double sum = 0.0;
    for (const double x : loop.x_hat()) { sum += x; }
    armed = false;
    std::printf("%a %a %a %d\n", u, loop.command(), sum, loop.measured() ? 1 : 0);
  }
  return 0;
}

int main(int, char** arguments) {
  const std::string name = arguments[1];
)" + choice +
         "  return 1;\n}\n";
}

/// Compiles the loops' headers with the strictest flags into one program.
bool build(const Scratch& scratch, const std::vector<Loop>& loops, const std::string& compiler) {
  for (const Loop& loop : loops) {
    write(scratch / (loop.name + ".hpp"), generate_header(loop.design, loop.name).value());
  }
  write(scratch / "main.cpp", driver(loops));
  const std::string command = compiler +
                              " -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wconversion -Wshadow "
                              "-Werror " +
                              (scratch / "main.cpp").string() + " -o " +
                              (scratch / "main").string() + " 2> " + (scratch / "log").string();
  if (std::system(command.c_str()) == 0) {
    return true;
  }
  ADD_FAILURE() << compiler << " refuses it:\n" << read(scratch / "log");
  return false;
}

std::vector<Output> run(const Scratch& scratch, const std::string& name,
                        const std::vector<Input>& inputs) {
  std::string rows;
  for (const Input& in : inputs) {
    char line[256];
    std::snprintf(line, sizeof line, "%a %a %a %a %a %a\n", in.measurement, in.r.position,
                  in.r.velocity, in.r_next.position, in.r_next.velocity, in.battery);
    rows += line;
  }
  write(scratch / "in", rows);
  const std::string program = (scratch / "main").string() + " " + name + " < " +
                              (scratch / "in").string() + " > " + (scratch / "out").string();
  EXPECT_EQ(std::system(program.c_str()), 0);
  std::vector<Output> outputs;
  std::istringstream answers(read(scratch / "out"));
  std::string u;
  std::string command;
  std::string estimate;
  bool measured = false;
  while (answers >> u >> command >> estimate >> measured) {
    outputs.push_back({std::strtod(u.c_str(), nullptr), std::strtod(command.c_str(), nullptr),
                       std::strtod(estimate.c_str(), nullptr), measured});
  }
  return outputs;
}

/// The same bits where the compiler does not contract to fused operations (x86-64 without -march).
void expect_same(double a, double b, const char* what, const std::string& loop, std::size_t step) {
#if defined(__x86_64__) && !defined(__FMA__)
  ASSERT_EQ(a, b) << what << " of " << loop << " at step " << step;
#else
  ASSERT_NEAR(a, b, 1e-12 * std::max(1.0, std::abs(b))) << what << " of " << loop << " at " << step;
#endif
}

/// The simulator's columns, the run-time class and the generated header, over the same inputs.
void expect_one_loop(const std::vector<Loop>& loops, const std::string& compiler) {
  const Scratch scratch;
  ASSERT_TRUE(build(scratch, loops, compiler));
  std::size_t saturated = 0;
  for (const auto& [name, design] : loops) {
    const MechanismResponse response = simulated(design);
    std::vector<Input> inputs = inputs_of(response, design.kind);
    const std::size_t recorded = inputs.size();
    const std::vector<Input> odd = odd_inputs();
    inputs.insert(inputs.end(), odd.begin(), odd.end());
    const std::vector<Output> outputs = run(scratch, name, inputs);
    ASSERT_EQ(outputs.size(), inputs.size());

    auto controller = MechanismController<>::create(design).value();
    double largest = 0.0;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const Input& in = inputs[k];
      const double u = controller.update(in.measurement, in.r, in.r_next, in.battery);
      ASSERT_NO_FATAL_FAILURE(expect_same(outputs[k].voltage, u, "voltage", name, k));
      ASSERT_NO_FATAL_FAILURE(
          expect_same(outputs[k].command, controller.command(), "command", name, k));
      ASSERT_NO_FATAL_FAILURE(
          expect_same(outputs[k].estimate, controller.x_hat().sum(), "estimate", name, k));
      ASSERT_EQ(outputs[k].measured, controller.measured()) << name << " at " << k;
      if (k < recorded) {
        ASSERT_EQ(u, (*response.series.find("voltage"))[k]) << name << " at " << k;
        ASSERT_EQ(controller.command(), (*response.series.find("command"))[k]) << name;
      }
      EXPECT_LE(std::abs(u), design.max_voltage);
      EXPECT_LE(std::abs(controller.command()), design.nominal_voltage);
      largest = std::max(largest, std::abs(u));
    }
    EXPECT_GT(largest, 1.0) << "a loop that does nothing proves nothing";
    saturated += response.saturated_fraction > 0.0 ? 1 : 0;
  }
  EXPECT_GT(saturated, loops.size() / 8);
  EXPECT_LT(saturated, loops.size());
}

TEST(GeneratedHeader, IsTheLoopOfTheLibraryAndOfTheSimulator) {
  expect_one_loop(all_loops(), FLYBALL_CXX);
}

TEST(GeneratedHeader, IsSoUnderClangToo) {
  if (std::string(FLYBALL_CLANG).empty()) {
    GTEST_SKIP() << "no clang here";
  }
  expect_one_loop(all_loops(), FLYBALL_CLANG);
}

TEST(GeneratedHeader, ClassNamesAreMadeIdentifiers) {
  const MechanismControllerDesign design = test::design_of(MechanismKind::elevator);
  const auto has = [&](const char* wanted, const char* line) {
    return generate_header(design, wanted).value().find(line) != std::string::npos;
  };
  EXPECT_TRUE(has("4 bar", "class _4_bar {"));
  EXPECT_TRUE(has("", "class Loop {"));
  EXPECT_TRUE(has("double", "class double_ {"));
  EXPECT_TRUE(has("A; int x", "class A__int_x {"));
  EXPECT_EQ(header_class_name(MechanismKind::elevator), "ElevatorLoop");
}

TEST(GeneratedHeader, IsDeterministicAndNamesItsOrigin) {
  const MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  const std::string text = generate_header(design, "ArmLoop").value();
  EXPECT_EQ(text, generate_header(design, "ArmLoop").value());
  EXPECT_NE(text.find("generated by Flyball"), std::string::npos);
  EXPECT_NE(text.find("kV = 4.0 V·s/rad, kA = 0.3 V·s²/rad"), std::string::npos);
  EXPECT_NE(generate_header(design, "ArmLoop", "m").value().find("kV = 4.0 V·s/m"),
            std::string::npos);
  EXPECT_NE(generate_header(test::design_of(MechanismKind::elevator, false), "L")
                .value()
                .find("kA not determined"),
            std::string::npos);
}

TEST(GeneratedHeader, HasOnlyWhatTheDesignHas) {
  MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  design.feed_forward_gravity = false;
  design.feed_forward_friction = false;
  design.compensate_voltage = false;
  design.measurement_delay = Time(0.0);
  const std::string text = generate_header(design, "ArmLoop").value();
  for (const char* absent : {"double kS", "double kG", "std::cos", "believable", "delay"}) {
    EXPECT_EQ(text.find(absent), std::string::npos) << absent;
  }
}

TEST(GeneratedHeader, RefusesWhatTheControllerRefuses) {
  MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  design.K(0) = std::nan("");
  EXPECT_TRUE(generate_header(design, "ArmLoop").error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::exports
