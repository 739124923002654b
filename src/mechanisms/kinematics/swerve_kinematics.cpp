#include <flyball/mechanisms/kinematics/swerve_kinematics.hpp>

#include <algorithm>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::mechanisms {

Expected<void> detail::check_module_positions(std::span<const Eigen::Vector2d> positions) {
  constexpr std::string_view where = "swerve_kinematics";
  double size = 0.0;
  double spread = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    FLYBALL_CHECK(check_finite(positions[i], where,
                               flyball::detail::format("the place of module {}", i + 1)));
    size = std::max(size, positions[i].cwiseAbs().maxCoeff());
    spread = std::max(spread, (positions[i] - positions[0]).cwiseAbs().maxCoeff());
  }
  if (!(spread > 1e-9 * size)) {
    return refusal(ArgumentError::out_of_range, where, "positions")
        .got(flyball::detail::format("all within {:.3g} m", spread))
        .expected("modules in different places, to tell turning from moving");
  }
  return {};
}

}  // namespace flyball::mechanisms
