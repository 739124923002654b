#include <flyball/mechanisms/drivetrain/pose_drive.hpp>

#include <flyball/mechanisms/drivetrain/encoder_drive.hpp>

#include "core/try.hpp"

namespace flyball::mechanisms {

namespace {

Expected<void> check(const DifferentialDrive& drive, Length trackwidth, std::string_view where) {
  return Checks(where)
      .also([&] { return check_system(drive, where); })
      .not_negative(drive.kS_left, "kS_left", "V")
      .not_negative(drive.kS_right, "kS_right", "V")
      .positive(trackwidth.si(), "trackwidth", "m")
      .finite(1.0 / trackwidth.si(), "1/trackwidth");
}

template <class Drive>
Expected<Drive> with_pose(const DifferentialDrive& drive, Length trackwidth,
                          std::string_view where) {
  return check(drive, trackwidth, where).map([&] { return Drive(drive, trackwidth.si()); });
}

std::vector<Coordinate> pose_states() {
  return {{"x", "m"},
          {"y", "m"},
          {"heading", "rad", true},
          {"left velocity", "m/s"},
          {"right velocity", "m/s"}};
}

std::vector<Coordinate> side_voltages() {
  return {{"left voltage", "V"}, {"right voltage", "V"}};
}

}  // namespace

detail::DriveParameters detail::drive_parameters_of(const DifferentialDrive& drive,
                                                    double trackwidth) noexcept {
  DriveParameters p;
  p << trackwidth, drive.kS_left, drive.kS_right, drive.A(0, 0), drive.A(0, 1), drive.A(1, 0),
      drive.A(1, 1), drive.B(0, 0), drive.B(0, 1), drive.B(1, 0), drive.B(1, 1);
  return p;
}

std::vector<Parameter> detail::describe_drive_parameters(const DriveParameters& values) {
  constexpr const char* names[drive_parameters][2] = {
      {"trackwidth", "m"}, {"kS_left", "V"},  {"kS_right", "V"}, {"A11", "1/s"},
      {"A12", "1/s"},      {"A21", "1/s"},    {"A22", "1/s"},    {"B11", "m/s²/V"},
      {"B12", "m/s²/V"},   {"B21", "m/s²/V"}, {"B22", "m/s²/V"},
  };
  std::vector<Parameter> parameters;
  for (int i = 0; i < drive_parameters; ++i) {
    parameters.push_back({names[i][0], names[i][1], values(i)});
  }
  return parameters;
}

ModelDescription PoseDrive::description() const {
  return {.name = "differential drive with its pose",
          .states = pose_states(),
          .inputs = side_voltages(),
          .outputs = pose_states(),
          .parameters = detail::describe_drive_parameters(p_)};
}

ModelDescription EncoderDrive::description() const {
  ModelDescription description{
      .name = "differential drive with its pose and encoders",
      .states = pose_states(),
      .inputs = side_voltages(),
      .outputs = {{"heading", "rad", true}, {"left position", "m"}, {"right position", "m"}},
      .parameters = detail::describe_drive_parameters(p_)};
  for (const Coordinate& further :
       {Coordinate{"left position", "m"}, Coordinate{"right position", "m"},
        Coordinate{"left voltage error", "V"}, Coordinate{"right voltage error", "V"},
        Coordinate{"heading error", "m/s"}}) {
    description.states.push_back(further);
  }
  return description;
}

Expected<PoseDrive> pose_drive(const DifferentialDrive& drive, Length trackwidth) {
  return with_pose<PoseDrive>(drive, trackwidth, "pose_drive");
}

Expected<PoseDrive> pose_drive(const DifferentialDriveParameters& parameters) {
  return differential_drive(parameters).and_then([&](const DifferentialDrive& drive) {
    return pose_drive(drive, parameters.trackwidth);
  });
}

Expected<PoseDrive> pose_drive(const DriveGains& gains, Length trackwidth) {
  return differential_drive(gains).and_then(
      [&](const DifferentialDrive& drive) { return pose_drive(drive, trackwidth); });
}

Expected<EncoderDrive> encoder_drive(const DifferentialDrive& drive, Length trackwidth) {
  return with_pose<EncoderDrive>(drive, trackwidth, "encoder_drive");
}

Expected<EncoderDrive> encoder_drive(const DifferentialDriveParameters& parameters) {
  return differential_drive(parameters).and_then([&](const DifferentialDrive& drive) {
    return encoder_drive(drive, parameters.trackwidth);
  });
}

Expected<EncoderDrive> encoder_drive(const DriveGains& gains, Length trackwidth) {
  return differential_drive(gains).and_then(
      [&](const DifferentialDrive& drive) { return encoder_drive(drive, trackwidth); });
}

Expected<ContinuousSystem<4, 2, 2>> encoder_positions_drive(const DifferentialDrive& drive) {
  FLYBALL_CHECK(check_system(drive, "encoder_positions_drive"));
  ContinuousSystem<4, 2, 2> system;
  system.A.setZero();
  system.A.topLeftCorner<2, 2>() = drive.A;  // (8.17)
  system.A.bottomLeftCorner<2, 2>().setIdentity();
  system.B.setZero();
  system.B.topRows<2>() = drive.B;  // (8.18)
  system.C.setZero();
  system.C.rightCols<2>().setIdentity();
  system.D.setZero();
  return system;
}

}  // namespace flyball::mechanisms
