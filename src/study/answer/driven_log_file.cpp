// A drive as a WPILOG, which AdvantageScope replays.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <flyball/io/wpilog.hpp>

#include "study/answer/driven_parts.hpp"

namespace flyball::study {

namespace {

/// Doubles as their bytes, least first: what structs are made of.
std::string bytes_of(std::initializer_list<double> values) {
  std::string bytes;
  for (const double value : values) {
    auto bits = std::bit_cast<std::uint64_t>(value);
    for (int i = 0; i < 8; ++i) {
      bytes += static_cast<char>(bits & 0xFFU);
      bits >>= 8U;
    }
  }
  return bytes;
}

class DriveLogText {
 public:
  explicit DriveLogText(const DriveResult& result) : result_(result), writer_("Flyball drive") {}

  std::string text() && {
    add_poses("/Flyball/Drive/Pose", "x", "y", "heading");
    add_poses("/Flyball/Drive/Reference", "reference_x", "reference_y", "reference_heading");
    add_structs();
    add_numbers();
    add_mechanism();
    return writer_.bytes();
  }

 private:
  [[nodiscard]] double at(const std::string& name, std::size_t row) const {
    const auto* values = result_.series.find(name);
    return values != nullptr ? (*values)[row] : 0.0;
  }
  [[nodiscard]] const std::vector<double>& time() const { return result_.series.time(); }

  void add_poses(const std::string& name, const char* x, const char* y, const char* heading) {
    const auto id = writer_.start_pose(name);
    for (std::size_t i = 0; i < time().size(); ++i) {
      const std::array<double, 3> pose{at(x, i), at(y, i), at(heading, i)};
      writer_.append(id, time()[i], std::span<const double>(pose));
    }
  }
  void schema(const std::string& name, const char* members) {
    const auto id = writer_.start("/.schema/struct:" + name, "structschema");
    writer_.append_raw(id, 0.0, members);
  }
  void add_structs() {
    schema("ChassisSpeeds", "double vx;double vy;double omega");
    for (const auto& [name, prefix] : {std::pair{"/Flyball/Drive/Speeds", ""},
                                       std::pair{"/Flyball/Drive/WantedSpeeds", "wanted_"}}) {
      const auto id = writer_.start(name, "struct:ChassisSpeeds");
      const std::string of(prefix);
      for (std::size_t i = 0; i < time().size(); ++i) {
        writer_.append_raw(id, time()[i],
                           bytes_of({at(of + "vx", i), at(of + "vy", i), at(of + "omega", i)}));
      }
    }
    const std::vector<std::string> names = shaft_names(result_.job.robot.kind);
    if (result_.job.robot.kind == DriveKind::swerve) {
      // Rotation2d's schema stands with the poses'.
      schema("SwerveModuleState", "double speed;Rotation2d angle");
      const auto id = writer_.start("/Flyball/Drive/ModuleStates", "struct:SwerveModuleState[]");
      for (std::size_t i = 0; i < time().size(); ++i) {
        std::string modules;
        for (const std::string& name : names) {
          modules += bytes_of({at(name + "_speed", i), at(name + "_angle", i)});
        }
        writer_.append_raw(id, time()[i], modules);
      }
    }
  }
  void add_numbers() {
    for (const TimeSeries::Column& column : result_.series.columns()) {
      const auto id = writer_.start("/Flyball/Drive/" + column.name, "double", column.unit);
      for (std::size_t i = 0; i < time().size(); ++i) {
        writer_.append(id, time()[i], column.values[i]);
      }
    }
  }
  /// The drivetrain from above as a Mechanism2d: each wheel a line from where it is, along its
  /// direction, as long as it is fast.
  void add_mechanism() {
    const DriveRobot& robot = result_.job.robot;
    const std::string root = "NT:/SmartDashboard/Drive/";
    const char* const nt = R"({"properties":{},"source":"NT"})";
    const auto text = [&](const std::string& name, const char* value) {
      writer_.append(writer_.start(root + name, "string", nt), 0.0, value);
    };
    const auto number = [&](const std::string& name, double value) {
      const auto id = writer_.start(root + name, "double", nt);
      writer_.append(id, 0.0, value);
      return id;
    };
    const double size = 2.0 * std::max(robot.length, robot.width);
    text(".type", "Mechanism2d");
    text("backgroundColor", "#000020");
    writer_.append(writer_.start(root + ".controllable", "boolean", nt), 0.0, false);
    const std::array<double, 2> dims{size, size};
    writer_.append(writer_.start(root + "dims", "double[]", nt), 0.0,
                   std::span<const double>(dims));
    const std::vector<std::string> names = shaft_names(robot.kind);
    const double longest = 0.4 * std::max(robot.length, robot.width);
    const double fastest = std::max(robot.free_speed(result_.job.max_voltage), 1e-9);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const Eigen::Vector2d place =
          robot.kind == DriveKind::differential
              ? Eigen::Vector2d(0.0, (k == 0 ? 0.5 : -0.5) * robot.trackwidth)
              : robot.modules[k];
      // Ahead is up.
      const std::string& name = names[k];
      number(name + "/x", 0.5 * size - place(1));
      number(name + "/y", 0.5 * size + place(0));
      text(name + "/wheel/.type", "line");
      text(name + "/wheel/color", "#00C0FF");
      number(name + "/wheel/weight", 6.0);
      const auto length = writer_.start(root + name + "/wheel/length", "double", nt);
      const auto angle = writer_.start(root + name + "/wheel/angle", "double", nt);
      constexpr double degree = std::numbers::pi / 180.0;
      for (std::size_t i = 0; i < time().size(); ++i) {
        writer_.append(length, time()[i], longest * at(name + "_speed", i) / fastest);
        writer_.append(angle, time()[i], 90.0 + at(name + "_angle", i) / degree);
      }
    }
  }

  const DriveResult& result_;
  WpilogWriter writer_;
};

}  // namespace

AnswerFile driven_log_file(const DriveResult& result) {
  return {"data/drive.wpilog", DriveLogText(result).text()};
}

}  // namespace flyball::study
