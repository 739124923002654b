#include <flyball/export/generated_loop.hpp>

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
#include <flyball/planning/profiles/trapezoid_profile.hpp>
#include <flyball/simulation/mechanism_loop.hpp>

#include "control/mechanism_designs.hpp"

namespace flyball::exports::generated_loop_test {
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

/// There and back, so that the velocity is zero, positive and negative, again and again.
std::vector<MotionState> reference_of(MechanismKind kind, int steps) {
  std::vector<MotionState> reference;
  const bool flywheel = kind == MechanismKind::flywheel;
  const TrapezoidProfile there({flywheel ? 200.0 : 1.5, flywheel ? 500.0 : 6.0}, {},
                               {flywheel ? 250.0 : 0.8, 0.0});
  for (int step = 0; step < steps; ++step) {
    const int k = step % 220;
    const MotionState now = there.sample(0.02 * (k < 110 ? k : 220 - k));
    const double sign = k < 110 ? 1.0 : -1.0;
    reference.push_back(flywheel ? MotionState{0.0, now.position, 0.0}
                                 : MotionState{now.position, sign * now.velocity, 0.0});
  }
  return reference;
}

/// The loop on a mechanism that differs from its model, with everything that is between them.
MechanismResponse simulated(const MechanismControllerDesign& design, int steps) {
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
  loop.reference = reference_of(design.kind, steps);
  return simulate_mechanism(loop).value();
}

/// What the simulation's controller was given.
std::vector<Input> inputs_of(const MechanismResponse& response, MechanismKind kind, int steps) {
  const std::vector<MotionState> reference = reference_of(kind, steps);
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

/// The loops and what goes into each.
struct Case {
  Loop loop;
  std::vector<Input> inputs;
};

/// A program that runs each loop over rows of hexadecimal doubles in NAME.in, and answers in
/// NAME.out.
std::string cpp_driver(const std::vector<Case>& cases) {
  std::string text;
  std::string choice;
  for (const Case& one : cases) {
    const std::string& name = one.loop.name;
    text += "#include \"" + name + ".hpp\"\n#include \"" + name + ".hpp\"\n";
    choice += "  run<" + name + ">(\"" + name + "\");\n";
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
static void run(const std::string& name) {
  static_assert(noexcept(std::declval<Loop&>().update(0.0, {}, {}, 0.0)), "");
  static_assert(noexcept(std::declval<Loop&>().reset(0.0)), "");
  static_assert(std::is_nothrow_default_constructible<Loop>::value, "");
  using Reference = typename Loop::Reference;
  std::FILE* in = std::fopen((name + ".in").c_str(), "r");
  std::FILE* out = std::fopen((name + ".out").c_str(), "w");
  Loop loop;
  loop.reset(0.0);
  double y = 0.0, a = 0.0, b = 0.0, c = 0.0, d = 0.0, battery = 0.0;
  while (std::fscanf(in, "%lf %lf %lf %lf %lf %lf", &y, &a, &b, &c, &d, &battery) == 6) {
    armed = true;
    const double u = loop.update(y, reference<Reference>(a, b), reference<Reference>(c, d), battery);
    double sum = 0.0;
    for (const double x : loop.x_hat()) { sum += x; }
    armed = false;
    std::fprintf(out, "%a %a %a %d\n", u, loop.command(), sum, loop.measured() ? 1 : 0);
  }
  std::fclose(in);
  std::fclose(out);
}

int main() {
)" + choice +
         "}\n";
}

std::string java_driver(const std::vector<Case>& cases) {
  std::string text = R"(package frc.robot;

import java.io.*;

public class Main {
  interface Step { double update(double y, double[] r, double[] rNext, double battery); }
  interface State { double at(int i); }
  interface Number { double value(); }
  interface Flag { boolean value(); }

  static double parse(String s) {
    if (s.contains("nan")) { return Double.NaN; }
    if (s.contains("inf")) {
      return s.startsWith("-") ? Double.NEGATIVE_INFINITY : Double.POSITIVE_INFINITY;
    }
    return Double.parseDouble(s);
  }

  static void run(String name, int states, boolean flywheel, Step step, Number command,
                  State xHat, Flag measured) throws IOException {
    final BufferedReader in = new BufferedReader(new FileReader(name + ".in"));
    final PrintWriter out = new PrintWriter(new BufferedWriter(new FileWriter(name + ".out")));
    for (String line = in.readLine(); line != null; line = in.readLine()) {
      final String[] w = line.split(" ");
      final double[] v = new double[6];
      for (int i = 0; i < 6; ++i) { v[i] = parse(w[i]); }
      final double[] r = flywheel ? new double[] {v[2]} : new double[] {v[1], v[2]};
      final double[] rNext = flywheel ? new double[] {v[4]} : new double[] {v[3], v[4]};
      final double u = step.update(v[0], r, rNext, v[5]);
      double sum = 0.0;
      for (int i = 0; i < states; ++i) { sum += xHat.at(i); }
      out.println(Double.toHexString(u) + " " + Double.toHexString(command.value()) + " "
                  + Double.toHexString(sum) + " " + (measured.value() ? 1 : 0));
    }
    out.close();
  }

  public static void main(String[] arguments) throws IOException {
)";
  for (const Case& one : cases) {
    const std::string& name = one.loop.name;
    const bool flywheel = one.loop.design.kind == MechanismKind::flywheel;
    const bool two = one.loop.design.plant.A.rows() == 2;
    text += "    { final " + name + " loop = new " + name + "(); loop.reset(0.0" +
            (two ? ", 0.0" : "") + "); run(\"" + name + "\", " + name + ".states, " +
            (flywheel ? "true" : "false") +
            ", loop::update, loop::command, loop::xHat, loop::measured); }\n";
  }
  return text + "  }\n}\n";
}

std::string python_driver(const std::vector<Case>& cases) {
  std::string text = R"(import importlib

def number(text):
    return float(text) if 'n' in text else float.fromhex(text)

def run(name, module, flywheel):
    loop = getattr(importlib.import_module(module), name)()
    loop.reset(0.0)
    with open(name + '.in') as rows, open(name + '.out', 'w') as out:
        for row in rows:
            y, a, b, c, d, battery = [number(word) for word in row.split()]
            u = loop.update(y, [b] if flywheel else [a, b], [d] if flywheel else [c, d], battery)
            total = 0.0
            for x in loop.x_hat:
                total += x
            out.write('%s %s %s %d\n' % (float.hex(u), float.hex(loop.command), float.hex(total),
                                        loop.measured))

)";
  for (const Case& one : cases) {
    const std::string& name = one.loop.name;
    std::string module = loop_file_name(Language::python, name);
    module.resize(module.size() - 3);
    text += "run('" + name + "', '" + module + "', " +
            (one.loop.design.kind == MechanismKind::flywheel ? "True" : "False") + ")\n";
  }
  return text;
}

/// Writes the loops in a language with a driver and their inputs, and runs them.
/// @param command  Of a shell, in the folder.
bool run_all(const Scratch& scratch, const std::vector<Case>& cases, Language language,
             const std::string& command) {
  for (const auto& [loop, inputs] : cases) {
    write(scratch / loop_file_name(language, loop.name),
          generate_loop(loop.design, language, loop.name).value());
    std::string rows;
    for (const Input& in : inputs) {
      char line[256];
      std::snprintf(line, sizeof line, "%a %a %a %a %a %a\n", in.measurement, in.r.position,
                    in.r.velocity, in.r_next.position, in.r_next.velocity, in.battery);
      rows += line;
    }
    write(scratch / (loop.name + ".in"), rows);
  }
  write(scratch / (language == Language::cpp    ? "main.cpp"
                   : language == Language::java ? "Main.java"
                                                : "main.py"),
        language == Language::cpp    ? cpp_driver(cases)
        : language == Language::java ? java_driver(cases)
                                     : python_driver(cases));
  const std::string line = "cd '" + (scratch / "").string() + "' && (" + command + ") > log 2>&1";
  if (std::system(line.c_str()) == 0) {
    return true;
  }
  ADD_FAILURE() << command << " fails:\n" << read(scratch / "log");
  return false;
}

std::vector<Output> outputs_of(const Scratch& scratch, const std::string& name) {
  std::vector<Output> outputs;
  std::istringstream answers(read(scratch / (name + ".out")));
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

/// Equal, or within a few units in the last place of `size`.
void expect_same(double a, double b, double size, const char* what, const std::string& loop,
                 std::size_t step) {
  ASSERT_TRUE(a == b || std::abs(a - b) <= size)
      << what << " of " << loop << " at step " << step << ": " << a << ", " << b;
}

/// The run-time class over the inputs of each loop, against what the generated one answered.
void expect_outputs(const Scratch& scratch, const std::vector<Case>& cases, Language language) {
  for (const auto& [loop, inputs] : cases) {
    const auto& [name, design] = loop;
    const std::vector<Output> outputs = outputs_of(scratch, name);
    ASSERT_EQ(outputs.size(), inputs.size());
    auto controller = MechanismController<>::create(design).value();
    double size = 0.0;
#if !defined(__x86_64__) || defined(__FMA__)
    size = 1e-12;  // A compiler may contract to fused operations there.
#endif
    if (language == Language::java && design.kind == MechanismKind::arm) {
      // Its cosine may be another by a unit in the last place, and so kG cos θ; K and the filter
      // hand that on.
      size = 1e-14 * (1.0 + std::abs(design.gains.kG));
    }
    double largest = 0.0;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const Input& in = inputs[k];
      const double u = controller.update(in.measurement, in.r, in.r_next, in.battery);
      const Output& out = outputs[k];
      ASSERT_NO_FATAL_FAILURE(expect_same(out.voltage, u, size, "voltage", name, k));
      ASSERT_NO_FATAL_FAILURE(
          expect_same(out.command, controller.command(), size, "command", name, k));
      ASSERT_NO_FATAL_FAILURE(
          expect_same(out.estimate, controller.x_hat().sum(), size, "estimate", name, k));
      ASSERT_EQ(out.measured, controller.measured()) << name << " at " << k;
      EXPECT_LE(std::abs(u), design.max_voltage);
      EXPECT_LE(std::abs(controller.command()), design.nominal_voltage);
      largest = std::max(largest, std::abs(u));
    }
    EXPECT_GT(largest, 1.0) << "a loop that does nothing proves nothing";
  }
}

/// Every choice of a design, over what its simulation gave it and then over odd inputs.
std::vector<Case> all_cases() {
  std::vector<Case> cases;
  std::size_t saturated = 0;
  const std::vector<Input> odd = odd_inputs();
  for (const Loop& loop : all_loops()) {
    const MechanismResponse response = simulated(loop.design, 220);
    Case one{loop, inputs_of(response, loop.design.kind, 220)};
    auto controller = MechanismController<>::create(loop.design).value();
    for (std::size_t k = 0; k < one.inputs.size(); ++k) {
      const Input& in = one.inputs[k];
      EXPECT_EQ(controller.update(in.measurement, in.r, in.r_next, in.battery),
                (*response.series.find("voltage"))[k])
          << loop.name << " at " << k;
      EXPECT_EQ(controller.command(), (*response.series.find("command"))[k]) << loop.name;
    }
    saturated += response.saturated_fraction > 0.0 ? 1 : 0;
    one.inputs.insert(one.inputs.end(), odd.begin(), odd.end());
    cases.push_back(std::move(one));
  }
  EXPECT_GT(saturated, cases.size() / 8);
  EXPECT_LT(saturated, cases.size());
  return cases;
}

/// 100 000 periods of each mechanism, with a sensor that is late, limits, sag and noise: the delay
/// compensated along the reference, and predicted.
std::vector<Case> long_cases() {
  std::vector<Case> cases;
  for (const auto& [kind, kA_determined] : test::cases) {
    for (const bool predicts : {false, true}) {
      MechanismControllerDesign design = test::design_of(kind, kA_determined);
      design.measurement_delay = Time(0.015);
      if (predicts) {
        design = test::predicting(design, Time(0.05));
      }
      design.max_voltage = 6.0;
      const int steps = 100'000;
      cases.push_back({{"Long" + std::to_string(cases.size()), design},
                       inputs_of(simulated(design, steps), kind, steps)});
    }
  }
  return cases;
}

constexpr const char* cpp_flags =
    " -std=c++17 -O2 -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror main.cpp -o main && "
    "./main";

void expect_one_loop(const std::vector<Case>& cases, Language language,
                     const std::string& command) {
  const Scratch scratch;
  ASSERT_TRUE(run_all(scratch, cases, language, command));
  expect_outputs(scratch, cases, language);
}

TEST(GeneratedLoop, IsTheLoopOfTheLibraryAndOfTheSimulator) {
  expect_one_loop(all_cases(), Language::cpp, FLYBALL_CXX + std::string(cpp_flags));
}

TEST(GeneratedLoop, IsSoUnderClangToo) {
  if (std::string(FLYBALL_CLANG).empty()) {
    GTEST_SKIP() << "no clang here";
  }
  expect_one_loop(all_cases(), Language::cpp, FLYBALL_CLANG + std::string(cpp_flags));
}

TEST(GeneratedLoop, IsSoInJava) {
  if (std::string(FLYBALL_JAVAC).empty()) {
    GTEST_SKIP() << "no Java here";
  }
  const std::string command = std::string("'") + FLYBALL_JAVAC +
                              "' --release 11 -Xlint:all -Werror -d . *.java && '" + FLYBALL_JAVA +
                              "' -cp . frc.robot.Main";
  expect_one_loop(all_cases(), Language::java, command);
  expect_one_loop(long_cases(), Language::java, command);
}

TEST(GeneratedLoop, IsSoInPython) {
  const std::string command = std::string("'") + FLYBALL_PYTHON + "' -W error -B main.py";
  expect_one_loop(all_cases(), Language::python, command);
  expect_one_loop(long_cases(), Language::python, command);
}

TEST(GeneratedLoop, OfEachMechanismForLong) {
  expect_one_loop(long_cases(), Language::cpp, FLYBALL_CXX + std::string(cpp_flags));
}

TEST(GeneratedLoop, ClassNamesAreMadeIdentifiers) {
  const MechanismControllerDesign design = test::design_of(MechanismKind::elevator);
  const auto has = [&](const char* wanted, const char* line) {
    return generate_loop(design, Language::cpp, wanted).value().find(line) != std::string::npos;
  };
  EXPECT_TRUE(has("4 bar", "class _4_bar {"));
  EXPECT_TRUE(has("", "class Loop {"));
  EXPECT_TRUE(has("double", "class double_ {"));
  EXPECT_TRUE(has("A; int x", "class A__int_x {"));
  EXPECT_EQ(loop_class_name(MechanismKind::elevator), "ElevatorLoop");
}

TEST(GeneratedLoop, FilesAreCalledAsTheirLanguagesWantThem) {
  EXPECT_EQ(loop_file_name(Language::cpp, "ElevatorLoop"), "ElevatorLoop.hpp");
  EXPECT_EQ(loop_file_name(Language::java, "ElevatorLoop"), "ElevatorLoop.java");
  EXPECT_EQ(loop_file_name(Language::python, "ElevatorLoop"), "elevator_loop.py");
  EXPECT_EQ(loop_file_name(Language::python, "4 Bar"), "_4_bar.py");
}

TEST(GeneratedLoop, IsDeterministicAndNamesItsOrigin) {
  const MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  const std::string text = generate_loop(design, Language::cpp, "ArmLoop").value();
  EXPECT_EQ(text, generate_loop(design, Language::cpp, "ArmLoop").value());
  EXPECT_NE(text.find("generated by Flyball"), std::string::npos);
  EXPECT_NE(text.find("kV = 4.0 V·s/rad, kA = 0.3 V·s²/rad"), std::string::npos);
  EXPECT_NE(generate_loop(design, Language::cpp, "ArmLoop", "m").value().find("kV = 4.0 V·s/m"),
            std::string::npos);
  EXPECT_NE(generate_loop(test::design_of(MechanismKind::elevator, false), Language::cpp, "L")
                .value()
                .find("kA not determined"),
            std::string::npos);
}

TEST(GeneratedLoop, HasOnlyWhatTheDesignHas) {
  MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  design.feed_forward_gravity = false;
  design.feed_forward_friction = false;
  design.compensate_voltage = false;
  design.measurement_delay = Time(0.0);
  const std::string text = generate_loop(design, Language::cpp, "ArmLoop").value();
  for (const char* absent : {"double kS", "double kG", "std::cos", "believable", "delay"}) {
    EXPECT_EQ(text.find(absent), std::string::npos) << absent;
  }
}

TEST(GeneratedLoop, RefusesWhatTheControllerRefuses) {
  MechanismControllerDesign design = test::design_of(MechanismKind::arm);
  design.K(0) = std::nan("");
  EXPECT_TRUE(
      generate_loop(design, Language::cpp, "ArmLoop").error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::exports::generated_loop_test
