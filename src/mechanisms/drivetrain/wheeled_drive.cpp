#include <flyball/mechanisms/drivetrain/wheeled_drive.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<std::vector<double>> detail::check_wheeled_drive(const RobotBody& body,
                                                          std::span<const SlippingWheel> wheels,
                                                          std::span<const DriveShaft> shafts,
                                                          const Tire& tire,
                                                          std::string_view where) {
  using flyball::detail::format;
  FLYBALL_CHECK(check_body(body, where));
  FLYBALL_CHECK(check_tire(tire, where));
  for (std::size_t s = 0; s < shafts.size(); ++s) {
    const auto checked = checked_shaft(shafts[s], where, format("shaft {}", s + 1));
    if (!checked) {
      return tl::unexpected(checked.error());
    }
    if (std::none_of(wheels.begin(), wheels.end(),
                     [s](const SlippingWheel& wheel) { return wheel.shaft == s; })) {
      return refusal(ArgumentError::out_of_range, where, format("shaft {}", s + 1))
          .got("one without wheels")
          .expected("the shaft of one wheel at least");
    }
  }
  std::vector<Eigen::Vector2d> places;
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const SlippingWheel& wheel = wheels[i];
    const std::string name = format("wheel {}", i + 1);
    FLYBALL_CHECK(Checks(where)
                      .positive(wheel.radius.si(), format("the radius of {}", name), "m")
                      .finite(wheel.mount.direction, format("the direction of {}", name))
                      .finite(wheel.mount.roller_angle, format("the roller_angle of {}", name)));
    if (wheel.shaft >= shafts.size()) {
      return refusal(ArgumentError::out_of_range, where, format("the shaft of {}", name))
          .got(std::to_string(wheel.shaft))
          .expected(format("below {}, the number of shafts", shafts.size()));
    }
    if (wheel.has_rollers && !(std::abs(std::cos(wheel.mount.roller_angle)) > 1e-3)) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(format("with rollers {:.4g} rad from its rolling direction",
                      wheel.mount.roller_angle))
          .expected("one whose rollers' axis is not across that direction");
    }
    places.push_back(wheel.mount.position);
  }
  return load_shares(places, body.center_of_mass, where);
}

Expected<WheeledDrive<4, 4>> slipping_mecanum_drive(const SlippingMecanumParameters& parameters) {
  WheeledDriveParameters<4, 4> made{.body = parameters.body, .tire = parameters.tire};
  for (std::size_t i = 0; i < 4; ++i) {
    const double roller = (i == 0 || i == 3 ? -0.25 : 0.25) * std::numbers::pi;
    made.shafts[i] = parameters.wheel;
    made.wheels[i] = {.mount = {parameters.positions[i], 0.0, roller},
                      .has_rollers = true,
                      .radius = parameters.wheel_radius,
                      .shaft = i};
  }
  return wheeled_drive(made, "slipping_mecanum_drive");
}

}  // namespace flyball::mechanisms
