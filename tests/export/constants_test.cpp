#include <flyball/export/constants.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <regex>
#include <sstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <flyball/export/drive_constants.hpp>

namespace flyball::exports::constants_test {
namespace {

using mechanisms::MechanismKind;

/// A mechanism's gains, per its unit, rotation and RPM.
/// @param turn  Units a rotation; 0 if they cannot be turned into rotations.
MechanismConstants constants(MechanismKind kind, double turn = 2.0 * std::numbers::pi) {
  MechanismConstants of;
  of.kind = kind;
  of.unit = position_unit(kind);
  of.gearing = 10.0;
  of.angle_offset = kind == MechanismKind::arm ? 0.2 : 0.0;
  const UnitGains own{
      .per = of.unit, .kP = 61.2345678, .kD = 3.21, .kS = 0.1, .kV = 4.0, .kA = 0.3, .kG = 0.65};
  of.gains = {own};
  for (const auto& [per, size] : {std::pair("rotation", turn), std::pair("RPM", turn / 60.0)}) {
    if (turn > 0.0) {
      of.gains.push_back({.per = per,
                          .kP = own.kP * turn,
                          .kD = own.kD * size,
                          .kS = own.kS,
                          .kV = own.kV * size,
                          .kA = own.kA * size,
                          .kG = own.kG});
    }
  }
  return of;
}

/// The number that a line assigns to `name`: "kV = 4.0", ".withKV(4.0)" or ".with_k_v(4.0)".
double value_of(const std::string& text, const std::string& name) {
  std::smatch match;
  const std::regex assignment("\\b" + name + " = ([-0-9.e+]+)[; ]");
  if (std::regex_search(text, match, assignment)) {
    return std::stod(match[1]);
  }
  const std::regex call("([wW]ithK" + name.substr(1) + "|with_k_" +
                        static_cast<char>(name[1] - 'A' + 'a') + ")\\(([-0-9.e+]+)\\)");
  if (std::regex_search(text, match, call)) {
    return std::stod(match[2]);
  }
  ADD_FAILURE() << name << " is not in:\n" << text;
  return std::nan("");
}

const UnitGains& gains_per(const MechanismConstants& of, const std::string& per) {
  return *std::find_if(of.gains.begin(), of.gains.end(),
                       [&](const auto& gains) { return gains.per == per; });
}

void expect_gains(const std::string& text, const UnitGains& gains, bool gravity) {
  const auto expect = [&](const char* name, double value) {
    EXPECT_NEAR(value_of(text, name), value, 1e-5 * std::abs(value)) << text;
  };
  expect("kS", gains.kS);
  expect("kV", gains.kV);
  expect("kA", gains.kA);
  expect("kP", gains.kP);
  expect("kD", gains.kD);
  if (gravity) {
    expect("kG", gains.kG);
  } else {
    EXPECT_EQ(text.find("kG ="), std::string::npos);
    EXPECT_EQ(text.find("ithKG("), std::string::npos);
    EXPECT_EQ(text.find("with_k_g("), std::string::npos);
  }
}

TEST(Constants, CarryTheDesignsGainsInEveryUnitAndLanguage) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm, MechanismKind::turret,
        MechanismKind::swerve_steer, MechanismKind::swerve_drive}) {
    const MechanismConstants of = constants(kind);
    const bool gravity = kind == MechanismKind::elevator || kind == MechanismKind::arm;
    for (const Language language : languages) {
      expect_gains(wpilib_constants(of, language), gains_per(of, of.unit), gravity);
      expect_gains(phoenix_constants(of, language), gains_per(of, "rotation"), gravity);
      expect_gains(rev_constants(of, language), gains_per(of, "RPM"), gravity);
    }
  }
}

TEST(Constants, EachNumberHasItsUnitBesideIt) {
  const MechanismConstants of = constants(MechanismKind::elevator);
  const std::string wpilib = wpilib_constants(of, Language::java);
  for (const char* unit :
       {"// V, static friction", "// V, gravity", "// V·s/m\n", "// V·s²/m", "// V/m\n"}) {
    EXPECT_NE(wpilib.find(unit), std::string::npos) << unit << "\n" << wpilib;
  }
  EXPECT_NE(phoenix_constants(of, Language::cpp).find("// V·s/rotation"), std::string::npos);
  EXPECT_NE(rev_constants(of, Language::cpp).find("// V/RPM"), std::string::npos);
}

TEST(Constants, NameTheClassesThatTakeThem) {
  const auto has = [](const std::string& text, const char* name) {
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
  };
  const MechanismConstants arm = constants(MechanismKind::arm);
  has(wpilib_constants(arm, Language::cpp), "frc::ArmFeedforward");
  has(wpilib_constants(arm, Language::java), "new ArmFeedforward(kS, kG, kV, kA");
  has(wpilib_constants(arm, Language::java), "new PIDController(kP, 0.0, kD");
  has(phoenix_constants(arm, Language::java), "GravityTypeValue.Arm_Cosine");
  has(rev_constants(arm, Language::java), ".kCos(kG)");
  has(wpilib_constants(arm, Language::java), "0.2 rad");
  const MechanismConstants elevator = constants(MechanismKind::elevator);
  has(wpilib_constants(elevator, Language::cpp), "frc::ElevatorFeedforward");
  has(phoenix_constants(elevator, Language::cpp), "GravityTypeValue::Elevator_Static");
  const MechanismConstants flywheel = constants(MechanismKind::flywheel);
  has(wpilib_constants(flywheel, Language::java), "new SimpleMotorFeedforward(kS, kV, kA");
  has(rev_constants(flywheel, Language::java), "velocityFF(kV / 12.0)");
}

// What turns endlessly takes the shorter way; a wheel on the floor has metres and a velocity.
TEST(Constants, OfTurretsAndSwerveModules) {
  const auto has = [](const std::string& text, const char* name) {
    EXPECT_NE(text.find(name), std::string::npos) << name << " is not in\n" << text;
  };
  const MechanismConstants steer = constants(MechanismKind::swerve_steer);
  has(wpilib_constants(steer, Language::java), "public final class SwerveSteerConstants");
  has(wpilib_constants(steer, Language::java), "enableContinuousInput(-Math.PI, Math.PI)");
  has(wpilib_constants(steer, Language::cpp), "frc::SimpleMotorFeedforward<units::radians> ");
  has(phoenix_constants(steer, Language::cpp), "ClosedLoopGeneral.ContinuousWrap = true");
  has(phoenix_constants(steer, Language::cpp), "PositionVoltage");
  has(rev_constants(steer, Language::java), "positionWrappingInputRange(0, 1)");
  has(rev_constants(steer, Language::java), "closedLoop.d(kD");
  EXPECT_EQ(wpilib_constants(steer, Language::cpp).find("cable"), std::string::npos);
  has(wpilib_constants(constants(MechanismKind::turret), Language::cpp), "unless a cable");
  const MechanismConstants drive = constants(MechanismKind::swerve_drive, 0.3);
  has(wpilib_constants(drive, Language::cpp), "frc::SimpleMotorFeedforward<units::meters> ");
  has(phoenix_constants(drive, Language::java), "VelocityVoltage");
  has(phoenix_constants(drive, Language::java), "one rotation is one of the wheel");
  EXPECT_EQ(wpilib_constants(drive, Language::java).find("ontinuousInput"), std::string::npos);
  EXPECT_EQ(rev_constants(drive, Language::java).find("closedLoop.d("), std::string::npos);
}

/// The lines of Python that a comment offers, taken out of it, below those that stand.
std::string taken_out(const std::string& text) {
  std::string program;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    static const std::regex code(
        "#( {1,3})((from|import) .*|[\\w.]+ = .*|(feedback|config)\\..*|    c\\..*)");
    std::smatch match;
    program += std::regex_match(line, match, code) ? match[2].str() + "\n" : line + "\n";
  }
  return program;
}

// What stands for the libraries takes every call and says which; the gains that it is given are
// those of the constants.
TEST(Constants, InPythonRunAndAreGivenToTheLibraries) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("flyball_constants_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  std::string main =
      "import math, sys, types\n"
      "class Any:\n"
      "    def __init__(self, name='', *given): self.name, self.given = name, given\n"
      "    def __getattr__(self, name): return Any(self.name + '.' + name)\n"
      "    def __call__(self, *given):\n"
      "        calls.append((self.name, given))\n"
      "        return Any(self.name.split('.')[0])\n"
      "    __path__ = []\n"
      "for name in ('wpimath', 'wpimath.controller', 'wpimath.kinematics', 'wpimath.system',\n"
      "             'wpimath.system.plant', 'phoenix6'):\n"
      "    sys.modules[name] = Any()\n"
      "def run(file):\n"
      "    global calls\n"
      "    calls = []\n"
      "    names = {'config': Any('config'), 'math': math}\n"
      "    exec(compile(open(file, encoding='utf-8').read(), file, 'exec'), names)\n"
      "    return names, calls\n"
      "def expect(calls, name, *given):\n"
      "    found = [g for n, g in calls if n == name]\n"
      "    assert len(found) == 1, (name, calls)\n"
      "    assert len(found[0]) == len(given), (name, found, given)\n"
      "    for a, b in zip(found[0], given):\n"
      "        assert a == b or abs(a - b) <= 1e-5 * abs(b), (name, found, given)\n";
  const auto number = [](double value) { return fmt::format("{}", value); };
  int files = 0;
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm, MechanismKind::turret,
        MechanismKind::roller, MechanismKind::swerve_steer, MechanismKind::swerve_drive}) {
    const MechanismConstants of = constants(kind);
    const bool velocity = controls_velocity(kind);
    const std::string gravity = has_gravity(kind) ? number(gains_per(of, of.unit).kG) + ", " : "";
    const auto begin = [&](const std::string& text) {
      const std::string name = fmt::format("paste_{}.py", files++);
      write(name, taken_out(text));
      main += "names, calls = run('" + name + "')\n";
    };
    const UnitGains& own = gains_per(of, of.unit);
    begin(wpilib_constants(of, Language::python));
    const std::string type = kind == MechanismKind::elevator ? "ElevatorFeedforward"
                             : kind == MechanismKind::arm    ? "ArmFeedforward"
                             : of.unit == "m"                ? "SimpleMotorFeedforwardMeters"
                                                             : "SimpleMotorFeedforwardRadians";
    main += fmt::format("expect(calls, '.{}', {}, {}{}, {}{})\n", type, own.kS, gravity, own.kV,
                        own.kA, kind == MechanismKind::arm ? "" : ", 0.02");
    main += fmt::format("expect(calls, '.PIDController', {}, 0.0, {}, 0.02)\n", own.kP, own.kD);
    begin(phoenix_constants(of, Language::python));
    const UnitGains& turn = gains_per(of, "rotation");
    for (const auto& [name, value] :
         {std::pair("s", turn.kS), std::pair("v", turn.kV), std::pair("a", turn.kA),
          std::pair("p", turn.kP), std::pair("d", turn.kD)}) {
      main += fmt::format("expect(calls, '.with_k_{}', {})\n", name, value);
    }
    begin(rev_constants(of, Language::python));
    const UnitGains& rpm = gains_per(of, "RPM");
    main += fmt::format("expect(calls, 'config.closedLoop.P', {})\n", rpm.kP / 12.0);
    main += velocity ? "assert not any(n.endswith('.D') for n, g in calls)\n"
                     : fmt::format("expect(calls, 'config.closedLoop.D', {})\n",
                                   60000.0 * rpm.kD / 12.0);
    main += fmt::format("expect(calls, 'config.closedLoop.velocityFF', {})\n", rpm.kV / 12.0);
  }
  DriveConstants drive{.linear = DriveModeGains{0.1, 2.0, 0.3},
                       .angular = DriveModeGains{0.2, 2.5, 0.4},
                       .trackwidth = 0.6,
                       .kP = 3.0};
  write("drive.py", taken_out(wpilib_drive_constants(drive, Language::python)));
  main +=
      "names, calls = run('drive.py')\n"
      "expect(calls, '.DifferentialDriveFeedforward', 2.0, 0.3, 0.75, 0.12, 0.6)\n"
      "expect(calls, '.LinearSystemId.identifyDrivetrainSystem', 2.0, 0.3, 0.75, 0.12, 0.6)\n"
      "expect(calls, '.DifferentialDriveKinematics', 0.6)\n"
      "assert [g for n, g in calls if n == '.PIDController'] == [(3.0, 0.0, 0.0, 0.02)] * 2\n";
  write("main.py", main);
  const std::string command = fmt::format("cd '{}' && '{}' -W error -B main.py 2> said.txt",
                                          folder.string(), FLYBALL_PYTHON);
  const int ended = std::system(command.c_str());
  std::ifstream said(folder / "said.txt");
  EXPECT_EQ(ended, 0) << std::string(std::istreambuf_iterator<char>(said), {});
  EXPECT_EQ(files, 21);
  std::filesystem::remove_all(folder);
}

// A motor controller's own loop has its own gains; the robot's loop keeps those of its period.
TEST(Constants, OfLoopsOnMotorControllers) {
  MechanismConstants of = constants(MechanismKind::arm);
  of.delay = 0.0425;
  of.on_board = of.gains;
  for (UnitGains& gains : of.on_board) {
    gains.kP *= 2.0;
    gains.kD *= 3.0;
  }
  for (const Language language : languages) {
    expect_gains(wpilib_constants(of, language), gains_per(of, "rad"), true);
    const auto own = [&](std::string_view per) {
      return *std::find_if(of.on_board.begin(), of.on_board.end(),
                           [&](const auto& gains) { return gains.per == per; });
    };
    expect_gains(phoenix_constants(of, language), own("rotation"), true);
    expect_gains(rev_constants(of, language), own("RPM"), true);
  }
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  };
  has(rev_constants(of, Language::java),
      "Loop period 1 ms, on the controller, and a measurement that is 42.5 ms old");
  has(wpilib_constants(of, Language::java),
      "Loop period 20 ms and a measurement that is 42.5 ms old");
  of.delay = 0.0;
  has(rev_constants(of, Language::java), "Loop period 1 ms, on the controller; volts are");
  has(wpilib_constants(of, Language::java), "Loop period 20 ms; volts are");
  // 2 · 61.2345678 · 2π V a rotation of 12 V; 60 · 3 · 3.21 · 2π/60 V s a rotation over 1 ms and 12
  // V.
  has(rev_constants(of, Language::java), "closedLoop.p(kP / 12.0);  // 64.1247 of the voltage per");
  has(rev_constants(of, Language::java), "// 5042.26 per change of rotations");
}

// kD e' with e' = (e_k - e_(k-1))/1 ms: WPILib's SysId divides a position loop's kD by 12 V and by
// the 1 ms of a controller that is not time-normalised; 60 makes V/RPM a V s/rotation.
TEST(Constants, ASparkDifferentiatesOverItsMillisecond) {
  const MechanismConstants of = constants(MechanismKind::arm);
  EXPECT_NE(rev_constants(of, Language::cpp).find("closedLoop.D(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  EXPECT_NE(rev_constants(of, Language::java).find("closedLoop.d(kD * 60.0 / 0.001 / 12.0);"),
            std::string::npos);
  const UnitGains& rotation = gains_per(of, "rotation");
  EXPECT_NEAR(60.0 * gains_per(of, "RPM").kD, rotation.kD, 1e-9 * rotation.kD);
}

TEST(Constants, AnUndeterminedKAIsZeroWithItsReason) {
  MechanismConstants of = constants(MechanismKind::elevator, 0.1596);  // of a 2 r π = 0.1596 m drum
  for (UnitGains& gains : of.gains) {
    gains.kA = 0.0;
  }
  of.kA_determined = false;
  of.kA_upper_bound = 0.6;
  of.kA_reason = "the speed-up\nis\x1B over \\";
  const std::string text = wpilib_constants(of, Language::java);
  EXPECT_EQ(value_of(text, "kA"), 0.0);
  EXPECT_NE(text.find("not determined, below 0.6: the speed-up is? over /\n"), std::string::npos)
      << text;
  EXPECT_NE(phoenix_constants(of, Language::java).find("not determined, below 0.0958"),
            std::string::npos);
}

TEST(Constants, LeaveOutWhatThereAreNoGainsFor) {
  const MechanismConstants of = constants(MechanismKind::elevator, 0.0);
  EXPECT_EQ(phoenix_constants(of, Language::cpp), "");
  EXPECT_EQ(rev_constants(of, Language::java), "");
  EXPECT_EQ(paste_constants(of).size(), 3u);
  EXPECT_EQ(paste_constants(constants(MechanismKind::arm)).size(), 9u);
}

}  // namespace
}  // namespace flyball::exports::constants_test
