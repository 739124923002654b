#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include <flyball/identification/feedforward_fit.hpp>
#include <flyball/mechanisms/friction.hpp>
#include <flyball/mechanisms/gravity.hpp>

#include "recordings.hpp"

// Other people's SysId recordings: the truth is not known, but physics and repeats are.
namespace real_logs_test {
namespace {

using namespace flyball::identification;
using flyball::mechanisms::MechanismKind;

const std::filesystem::path data = FLYBALL_TEST_DATA;

/// Rows [t, V, position, velocity] in rotations; of nine columns the left side.
Recording read(const std::filesystem::path& path) {
  std::ifstream file(path);
  const nlohmann::json json = nlohmann::json::parse(file);
  const std::string test = json.value("test", "");
  const std::string units = json.value("units", "Radians");
  double scale = json.value("unitsPerRotation", 1.0);
  scale *= units == "Degrees" ? std::numbers::pi / 180.0 : 1.0;
  Recording recording;
  recording.mechanism = test == "Elevator" ? MechanismKind::elevator
                        : test == "Arm"    ? MechanismKind::arm
                                           : MechanismKind::flywheel;
  recording.unit = units == "Meters" ? "m" : "rad";
  for (const char* key : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    TestRun run;
    run.kind = parse_test_kind(key).value();
    for (const auto& row : json.at(key)) {
      const bool drive = row.size() == 9;
      run.time.push_back(row[0]);
      run.voltage.push_back(row[1]);
      run.position.push_back(scale * row[drive ? 3 : 2].get<double>());
      run.velocity.push_back(scale * row[drive ? 5 : 3].get<double>());
    }
    recording.runs.push_back(std::move(run));
  }
  return recording;
}

const FeedforwardFit& fit(const std::string& name) {
  static std::map<std::string, FeedforwardFit> fits;
  const auto [found, is_new] = fits.try_emplace(name);
  if (is_new) {
    auto result = fit_feedforward(read(data / "sysid-json" / name));
    EXPECT_TRUE(result) << name << ": " << (result ? "" : to_string(result.error()));
    found->second = std::move(result).value_or(FeedforwardFit{});
  }
  return found->second;
}

TEST(RealLogs, EachMechanismGivesPhysicalGains) {
  for (const char* name :
       {"calcmogul_flywheel_simple.json", "frc2423_simple_meters_20220307-193058.json",
        "frc4392_arm_20230218-170836.json", "mrt3216_arm_20230302-130355.json",
        "sciborgs_elbow_20230222-162953.json", "sciborgs_elevator_20230227-154527.json"}) {
    const FeedforwardFit& gains = fit(name);
    EXPECT_GT(gains.kV.value, 0.0) << name;
    EXPECT_GE(gains.kS.value, 0.0) << name;
    EXPECT_GT(gains.r_squared, 0.95) << name;
    if (gains.kA.determined) {
      EXPECT_GT(gains.kA.interval[0], 0.0) << name;
    } else {
      EXPECT_GT(gains.kA.upper_bound, 0.0) << name;
      EXPECT_FALSE(gains.kA.reason.empty()) << name;
    }
  }
}

/// The free run of the one-step regression's gains over the velocity of the runs, as a share of its
/// spread: at the delay of the sensors with which it does best.
double one_step_nrmse(const FeedforwardFit& fit) {
  const OneStepFit& gains = *fit.one_step;
  const flyball::mechanisms::FrictionMotion motion(
      gains.kV, gains.kA, flyball::mechanisms::Friction{std::max(0.0, gains.kS)});
  double least = 1e300;
  for (int rows = 0; rows <= 30; ++rows) {
    const double delay = 0.005 * rows;
    double squared = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    double count = 0.0;
    for (const FittedRun& run : fit.runs) {
      if (!run.used) {
        continue;
      }
      flyball::mechanisms::MechanismState state{
          run.position.empty() ? 0.0 : run.position.front(),
          is_quasistatic(run.kind) ? run.velocity.front() : 0.0};
      std::vector<double> velocity;
      for (std::size_t i = 0; i < run.time.size(); ++i) {
        velocity.push_back(state.velocity);
        if (i + 1 < run.time.size()) {
          const double gravity = flyball::mechanisms::gravity_voltage(
              fit.mechanism, gains.kG, state.position, gains.angle_offset);
          state = motion.step(state, run.voltage[i] - gravity, run.time[i + 1] - run.time[i]);
        }
      }
      std::size_t at = 0;
      for (const std::size_t row : run.fresh) {
        while (at + 1 < run.time.size() && run.time[at + 1] <= run.time[row] - delay) {
          ++at;
        }
        const double shown = run.time[row] - delay < run.time.front() ? velocity[0] : velocity[at];
        squared += (run.velocity[row] - shown) * (run.velocity[row] - shown);
        sum += run.velocity[row];
        squares += run.velocity[row] * run.velocity[row];
        count += 1.0;
      }
    }
    least = std::min(least, std::sqrt(squared / (squares - sum * sum / count)));
  }
  return least;
}

TEST(RealLogs, NoFreeRunIsWorseThanTheOneStepFits) {
  for (const auto& entry : std::filesystem::directory_iterator(data / "sysid-json")) {
    const std::string name = entry.path().filename().string();
    const FeedforwardFit& gains = fit(name);
    if (gains.one_step && gains.one_step->kV > 0.0 && gains.one_step->kA > 0.0) {
      EXPECT_LE(gains.velocity_nrmse, one_step_nrmse(gains)) << name;
    }
  }
}

// The same elbow twice within ten minutes.
TEST(RealLogs, RepeatsAgreeWithinTheirIntervals) {
  const FeedforwardFit& first = fit("sciborgs_elbow_20230222-162953.json");
  const FeedforwardFit& second = fit("sciborgs_elbow_20230222-163221.json");
  EXPECT_NEAR(second.kV.value / first.kV.value, 1.0, 0.02);
  EXPECT_NEAR(second.kA.value / first.kA.value, 1.0, 0.15);
  EXPECT_NEAR(second.kG->value / first.kG->value, 1.0, 0.03);
  EXPECT_NEAR(second.kS.value, first.kS.value, 0.04);
}

TEST(RealLogs, AnArmThatDoesNotMoveIsRefused) {
  const auto refused =
      fit_feedforward(read(data / "sysid-json-bad" / "mrt3216_arm_nomotion_20230301-172022.json"));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(IdentificationError::no_motion));
}

TEST(RealLogs, AnIdleLogIsRefused) {
  const auto refused = fit_feedforward(
      read(data / "sysid-json-bad" / "frc_characterization_2019_nine_column_idle.json"));
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(IdentificationError::no_motion));
}

TEST(RealLogs, AnInvertedEncoderIsNamed) {
  const auto report = identify_feedforward(
      read(data / "sysid-json-bad" / "frc1672_drive_inverted_encoder_20230427-151436.json"));
  const auto* diagnostic = recordings::find(report.diagnostics, "sign_mismatch");
  ASSERT_NE(diagnostic, nullptr);
  EXPECT_NE(diagnostic->message.find("inverted encoder"), std::string::npos);
}

}  // namespace
}  // namespace real_logs_test
