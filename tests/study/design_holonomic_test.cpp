// The follower of a swerve or a mecanum drive, designed from a project file.
#include <flyball/study/design_holonomic.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/study/project.hpp>

#include "compiled.hpp"
#include "study/drive_law.hpp"
#include "study/drive_wheel.hpp"

namespace flyball::study::design_holonomic_test {
namespace {

std::string robot(const std::string& type) {
  return "[drive]\ntype = \"" + type +
         "\"\nmotor = \"Kraken X60\"\ngearing = 6.75\nwheel_radius = \"2 in\"\nmass = \"60 kg\"\n"
         "moment_of_inertia = \"6.5 kg m^2\"\ntrackwidth = \"0.55 m\"\nsteer_motor = \"NEO\"\n";
}

DriveJob job_of(const std::string& text) {
  const std::string path = testing::TempDir() + "design_holonomic_test.toml";
  std::ofstream(path) << text;
  const auto job = drive_design_job(path);
  EXPECT_TRUE(job) << (job ? "" : to_string(job.error()));
  return job ? *job : DriveJob{};
}

HolonomicDesign designed(const std::string& text) {
  auto design = design_holonomic(job_of(text));
  EXPECT_TRUE(design) << (design ? "" : to_string(design.error()));
  return design ? *design : HolonomicDesign{};
}

std::string text_of(const Answer& answer, const std::string& name) {
  const auto file = std::find_if(answer.files.begin(), answer.files.end(),
                                 [&](const AnswerFile& each) { return each.name == name; });
  return file == answer.files.end() ? std::string() : file->contents;
}

// A wheel that spins freely is wheel_inertia/r² kilograms at its surface, by Newton and the motor:
// kA' = R I/(r G Kt), and its loop at most halves an error that alternates.
TEST(DesignHolonomic, ASpinningWheelStaysCalm) {
  const HolonomicDesign design = designed(robot("swerve"));
  const DriveRobot& of = design.job.robot;
  const double kA = of.motor.R * of.wheel_inertia / (of.wheel_radius * of.gearing * of.motor.Kt);
  EXPECT_NEAR(design.spinning_A, std::exp(-0.02 * design.kV / kA), 1e-12);
  EXPECT_GE(design.spinning_pole, -0.5);
  EXPECT_GT(design.job.velocity_tolerance, 0.95);
  EXPECT_TRUE(std::any_of(design.diagnostics.begin(), design.diagnostics.end(),
                          [](const Diagnostic& d) { return d.code == "assumed"; }));
  // What a person asks for is done, and said to oscillate.
  const HolonomicDesign asked = designed(robot("swerve") + "velocity_tolerance = \"0.5 m/s\"\n");
  EXPECT_EQ(asked.job.velocity_tolerance, 0.5);
  EXPECT_LT(asked.spinning_pole, -1.0);
  EXPECT_TRUE(std::any_of(asked.diagnostics.begin(), asked.diagnostics.end(),
                          [](const Diagnostic& d) { return d.code == "spinning_wheels"; }));
}

TEST(DesignHolonomic, AnswerHasConstantsAndHeader) {
  const HolonomicDesign design = designed(robot("swerve"));
  const Answer answer = answer_of(design);
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json.at("schema"), "flyball.design_holonomic/1");
  EXPECT_EQ(json.at("modules").size(), 4u);
  EXPECT_EQ(json.at("wheel").at("kP"), design.kP);
  EXPECT_EQ(answer.figures.size(), 1u);
  const std::string cpp = text_of(answer, "constants/wpilib_cpp.txt");
  for (const char* part : {"frc::SwerveDriveKinematics<4> kinematics{", "frontLeftX = 0.275",
                           "steer.EnableContinuousInput", "frc::PIDController heading{"}) {
    EXPECT_NE(cpp.find(part), std::string::npos) << part << "\n" << cpp;
  }
  EXPECT_NE(text_of(answer, "constants/wpilib_java.txt").find("new SwerveDriveKinematics("),
            std::string::npos);
  EXPECT_NE(text_of(answer, "constants/wpilib_python.txt").find("SwerveDrive4Kinematics("),
            std::string::npos);
  EXPECT_NE(text_of(answer, "constants/steer_phoenix6_java.txt").find("Slot0Configs"),
            std::string::npos);
  EXPECT_NE(text_of(answer, "constants/revlib_java.txt"), "");
  EXPECT_EQ(text_of(answer, "follower.hpp"), design.header);
  const Answer mecanum = answer_of(designed(robot("mecanum")));
  EXPECT_NE(text_of(mecanum, "constants/wpilib_cpp.txt").find("frc::MecanumDriveKinematics"),
            std::string::npos);
  EXPECT_EQ(text_of(mecanum, "constants/steer_phoenix6_java.txt"), "");
}

TEST(DesignHolonomic, Errors) {
  DriveJob job = job_of(robot("swerve") + "follower = \"pure pursuit\"\n");
  EXPECT_NE(to_string(design_holonomic(job).error()).find("drive.follower"), std::string::npos);
  job = job_of(robot("differential"));
  EXPECT_NE(to_string(design_holonomic(job).error()).find("\"swerve\" or \"mecanum\""),
            std::string::npos);
}

struct Row {
  DriveReading reading{};
  MotionSample now{}, next{};
  double heading = 0.0, heading_r = 0.0;
};

/// Near its reference and far from it, slow, fast and at rest.
std::vector<Row> rows() {
  std::vector<Row> all;
  Random random(11);
  for (int i = 0; i < 600; ++i) {
    Row row;
    const double off = i % 4 == 0 ? 3.0 : 0.1;
    const double fast = i % 5 == 0 ? 0.01 : i % 5 == 1 ? 6.0 : 1.5;
    row.heading_r = random.uniform(-3.0, 3.0);
    row.heading = row.heading_r + random.uniform(-0.1, 0.1) * off;
    row.now.pose = Pose2d(random.normal(), random.normal(), row.heading_r);
    row.reading.pose = Pose2d(row.now.pose.x() + off * random.normal(),
                              row.now.pose.y() + off * random.normal(), row.heading);
    row.now.velocity = fast * Eigen::Vector2d(random.normal(), random.normal());
    row.now.omega = fast * random.normal();
    row.next.velocity = row.now.velocity + 0.05 * Eigen::Vector2d(random.normal(), random.normal());
    row.next.omega = row.now.omega + 0.05 * random.normal();
    row.reading.wheels = Eigen::VectorXd(4);
    row.reading.module_angles = Eigen::VectorXd(4);
    row.reading.module_rates = Eigen::VectorXd(4);
    for (int k = 0; k < 4; ++k) {
      row.reading.wheels(k) = fast * random.normal();
      row.reading.module_angles(k) = random.uniform(-10.0, 10.0);
      row.reading.module_rates(k) = random.normal();
    }
    all.push_back(row);
  }
  return all;
}

// The header, compiled, answers the voltages that `flyball drive` simulates, to rounding; and
// finite ones within the limit whatever it is given.
TEST(DesignHolonomic, TheHeaderIsTheLawThatIsSimulated) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const bool swerve : {true, false}) {
    const HolonomicDesign design = designed(robot(swerve ? "swerve" : "mecanum"));
    const std::vector<Row> all = rows();
    std::string input;
    const auto line = [&](const Row& row) {
      std::vector<double> n{row.reading.pose.x(), row.reading.pose.y(), row.heading};
      n.insert(n.end(), row.reading.wheels.begin(), row.reading.wheels.end());
      n.insert(n.end(), row.reading.module_angles.begin(), row.reading.module_angles.end());
      n.insert(n.end(), row.reading.module_rates.begin(), row.reading.module_rates.end());
      n.insert(n.end(), {row.now.pose.x(), row.now.pose.y(), row.heading_r, row.now.velocity(0),
                         row.now.velocity(1), row.now.omega, row.next.velocity(0),
                         row.next.velocity(1), row.next.omega});
      return n;
    };
    for (const Row& row : all) {
      input += test::bits(line(row));
    }
    constexpr int columns = 24;
    const std::vector<double> good = line(all.front());
    for (int k = 0; k < columns; ++k) {
      for (const double bad : {nan, std::numeric_limits<double>::infinity(), 1e200}) {
        std::vector<double> n = good;
        n[static_cast<std::size_t>(k)] = bad;
        input += test::bits(n);
      }
    }
    const std::string measured =
        swerve
            ? "{{n[3], n[4], n[5], n[6]}, {n[7], n[8], n[9], n[10]}, {n[11], n[12], n[13], n[14]}}"
            : "{{n[3], n[4], n[5], n[6]}}";
    const std::string body =
        "    const auto c = follower::calculate({n[0], n[1], n[2]}, " + measured +
        ",\n        {n[15], n[16], n[17]}, {n[18], n[19], n[20]}, {n[21], n[22], n[23]});\n"
        "    std::printf(\"%a %a %a %a %d\\n\", c.drive[0], c.drive[1], c.drive[2], c.drive[3],\n"
        "                static_cast<int>(c.status));\n" +
        (swerve ? "    std::printf(\"%a %a %a %a\\n\", c.steer[0], c.steer[1], c.steer[2], "
                  "c.steer[3]);\n"
                : "");
    const std::vector<double> out =
        test::run_compiled("follower.hpp", design.header, columns, body, input);
    const std::size_t width = swerve ? 9 : 5;
    ASSERT_EQ(out.size(), width * (all.size() + 3 * columns));
    auto law = make_drive_law(design.job);
    ASSERT_TRUE(law) << to_string(law.error());
    int saturated = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const DriveOrder order = (*law)->step(all[i].reading, all[i].now, all[i].next);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        EXPECT_NEAR(out[width * i + k], order.volts(at), 1e-9) << i << " " << k;
        if (swerve) {
          EXPECT_NEAR(out[width * i + 5 + k], order.volts(4 + at), 1e-8) << i << " " << k;
        }
      }
      EXPECT_EQ(out[width * i + 4] == 2.0, order.saturated) << i;
      saturated += order.saturated ? 1 : 0;
    }
    EXPECT_GT(saturated, 50);
    EXPECT_LT(saturated, 550);
    for (std::size_t i = width * all.size(); i < out.size(); ++i) {
      EXPECT_LE(std::abs(out[i]), 12.0) << i;  // false for NaN
    }
  }
}

}  // namespace
}  // namespace flyball::study::design_holonomic_test
