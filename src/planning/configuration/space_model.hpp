#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/planning/configuration/configuration_space.hpp>

#include "planning/configuration/region_node.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail {

/// A constraint by itself.
struct SpaceConstraint {
  std::string name{};
  std::string unit{};
  SpaceProgram<double> program{};
  std::vector<double> unit_rates{};  ///< 1/rate for all axes moving by their scale.
  /// Of a region: what is demanded, with the buffer.
  std::shared_ptr<const RegionNode> region{};
  bool forbidden = false;
};

/// All that is known of a space; never changed once it is made.
struct SpaceModel {
  std::vector<SpaceAxis> axes{};  ///< Stops with the buffer taken off.
  std::vector<double> buffer{};   ///< An entry an axis.
  std::vector<ConfigurationSpace::NamedRegion> regions{};
  std::optional<PlanarMechanism> mechanism{};

  std::vector<SpaceConstraint> constraints{};
  SpaceProgram<double> exact{};     ///< Everything but the stops.
  SpaceProgram<double> contacts{};  ///< Of it what the mechanism demands.
  SpaceProgram<float> quick{};      ///< Everything but the stops, with a tolerance.
  std::vector<double> unit_rates{};
  bool has_regions = false;

  [[nodiscard]] int dimension() const noexcept { return static_cast<int>(axes.size()); }
};

/// Makes what follows from axes, buffer, regions and mechanism, which have been checked.
void complete(SpaceModel& model);

/// A program in floats, each margin less by what their rounding may be. @param signs  Of each leaf
/// of the regions: 1, or -1 where what is outside of it is allowed.
[[nodiscard]] SpaceProgram<float> in_floats(const SpaceModel& model,
                                            const SpaceProgram<double>& exact,
                                            const std::vector<int>& signs);

/// The first place of a move that a region does not allow; > 1 if it allows all of it. Exact but
/// for rounding; along the boundary is allowed.
[[nodiscard]] double first_exit(const SpaceModel& model, const SpaceConstraint& constraint,
                                const double* from, const double* by);

/// A region that goes on beyond the stops of the axes where it reaches them: no way leads along a
/// stop through what is forbidden up to it.
[[nodiscard]] std::shared_ptr<const RegionNode> beyond_stops(
    const SpaceModel& model, const std::shared_ptr<const RegionNode>& node);

/// A region shrunk (`grow` false) or grown by what may be off in each coordinate.
[[nodiscard]] std::shared_ptr<const RegionNode> offset_region(
    const std::shared_ptr<const RegionNode>& node, const std::vector<double>& error, bool grow);

}  // namespace flyball::detail
