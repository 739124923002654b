#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>

#include <algorithm>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<void> detail::check_module_positions(std::span<const Eigen::Vector2d> positions,
                                              std::string_view where) {
  double size = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    FLYBALL_CHECK(check_finite(positions[i], where,
                               flyball::detail::format("the place of module {}", i + 1)));
    size = std::max(size, positions[i].cwiseAbs().maxCoeff());
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double apart = (positions[i] - positions[j]).cwiseAbs().maxCoeff();
      if (!(apart > 1e-9 * size)) {
        return refusal(ArgumentError::out_of_range, where, "positions")
            .got(flyball::detail::format("({:.4g} m, {:.4g} m) of modules {} and {} both",
                                         positions[i](0), positions[i](1), j + 1, i + 1))
            .expected("modules in different places")
            .hint("give each module its own place in the robot's frame, x forward and y left");
      }
    }
  }
  return {};
}

}  // namespace flyball::mechanisms
