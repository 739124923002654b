#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/configuration/planar_mechanism.hpp>
#include <flyball/planning/configuration/region.hpp>

namespace flyball {

namespace detail {
struct SpaceModel;
}

/// Why a configuration, a move or a path is refused.
enum class ConfigurationError {
  in_collision,  ///< A configuration breaks a constraint.
  blocked_move,  ///< A straight move between valid configurations breaks a constraint.
  no_path,       ///< It is proven that the goal cannot be reached from the start.
  undecided,     ///< No path was found within the bounds, nor a proof that there is none.
};
[[nodiscard]] ErrorInfo error_info(ConfigurationError code);

/// A coordinate of a configuration space: a height, an angle, the state of a solenoid.
struct SpaceAxis {
  std::string name{};
  std::string unit{};  ///< "m", "rad", or empty.
  double low = 0.0;    ///< Hard stops; of an angle that wraps a turn that is to be shown.
  double high = 0.0;
  /// An angle without stops: values that differ by 2π are the same.
  bool wraps = false;
  /// What counts as far as 1 of another axis when lengths of paths are compared; > 0.
  double scale = 1.0;
};

/// A constraint at a configuration.
struct ConstraintState {
  std::string name{};
  /// How far inside (> 0) or outside (< 0) of what it allows: m of the mechanism's parts, N·m or N
  /// of a holding limit, and of a region the distance in its coordinates.
  double margin = 0.0;
  std::string unit{};
};

/// What becomes of a straight move between two configurations.
struct MoveCheck {
  bool free = false;
  double at = 1.0;  ///< In [0, 1]: where it is stopped, if it is not free.
  /// The constraint that stops it; of contacts also one that is touched to within 1e-9 of what the
  /// numbers can tell.
  std::string constraint{};
};

/// The configurations that a mechanism may take: axes with their stops, and constraints by name.
///
/// A configuration is valid if no constraint is broken; being on the boundary is valid. Moves are
/// judged along their whole length, never by samples: of regions the crossings are computed, of
/// contacts and holding limits conservative advancement goes as far as the margin allows at the
/// speed at which the bodies can move. Copies are cheap and share what is in them; all queries are
/// const and may be made from several threads.
/// Source: book, chapter 16; conservative advancement: B. Mirtich, Impulse-based dynamic simulation
/// of rigid body systems, 1996.
class ConfigurationSpace {
 public:
  /// @param axes  1 to 16, with different names, low < high, within 1e9 of zero.
  /// @errors ArgumentError::empty, not_finite, out_of_range, ambiguous_name.
  [[nodiscard]] static Expected<ConfigurationSpace> create(std::vector<SpaceAxis> axes);

  /// A constraint that is a region.
  struct NamedRegion {
    std::string name{};
    Region region{};
    bool forbidden = false;
  };

  /// Only configurations in the region are valid. @param name  What errors say.
  /// @errors ArgumentError: a number that is not finite, a coordinate that is not there, a polygon
  ///         of fewer than three vertices, without an area or with crossing edges, low > high.
  [[nodiscard]] Expected<void> require(std::string name, const Region& region);

  /// No configuration inside of the region is valid. @errors As `require`.
  [[nodiscard]] Expected<void> forbid(std::string name, const Region& region);

  /// Whether a region is one of this space. @errors As `require`.
  [[nodiscard]] Expected<void> takes(const NamedRegion& region) const;

  /// `require` and `forbid` of all regions at once, or of none; one by one each makes the space
  /// anew. @errors As `require`.
  [[nodiscard]] Expected<void> constrain(std::vector<NamedRegion> regions);

  /// The mechanism that the coordinates move; one a space.
  /// @errors ArgumentError: numbers that are not within 1e9, names and joints not there, a
  ///         coordinate that two kinds of joint share wrongly, limits that are not positive.
  [[nodiscard]] Expected<void> attach(const PlanarMechanism& mechanism);

  /// The same space for a mechanism that may be off its reference by so much in each coordinate:
  /// what is valid in it is valid for all configurations that near. @param error  An entry an axis,
  /// in its unit, >= 0. @errors ArgumentError::wrong_shape, not_finite, out_of_range (stops that
  /// leave no room).
  [[nodiscard]] Expected<ConfigurationSpace> with_buffer(std::span<const double> error) const;

  /// How many axes there are.
  [[nodiscard]] int dimension() const noexcept;
  /// The axes; with a buffer their stops are nearer by it.
  [[nodiscard]] const std::vector<SpaceAxis>& axes() const noexcept;
  /// Names of all constraints, the stops of the axes first.
  [[nodiscard]] std::vector<std::string> constraints() const;
  /// The mechanism, if there is one.
  [[nodiscard]] const PlanarMechanism* mechanism() const noexcept;
  /// All of them, as they were given; for pictures.
  [[nodiscard]] const std::vector<NamedRegion>& regions() const noexcept;

  /// Whether no constraint is broken. @param q  An entry an axis; others are not valid, nor is what
  /// is not finite. Cost: O(bodies x obstacles); no allocation.
  [[nodiscard]] bool valid(std::span<const double> q) const;

  /// How far every coordinate may move at once, in units of its `scale`, without breaking a
  /// constraint (> 0: at least so far), or without mending one (< 0). Never more than is true;
  /// where links are near each other in a bent pose it may be less.
  [[nodiscard]] double clearance(std::span<const double> q) const;

  /// The constraints that are broken, worst first by what share of its axes' scale mends them.
  [[nodiscard]] std::vector<ConstraintState> broken(std::span<const double> q) const;

  /// Every constraint with its margin, in the order of `constraints`.
  [[nodiscard]] std::vector<ConstraintState> margins(std::span<const double> q) const;

  /// That q is of the space and valid. @param where, name  What the error says: "plan", "the goal".
  /// @errors ArgumentError::wrong_shape, not_finite; ConfigurationError::in_collision with the
  ///         constraints and their margins.
  [[nodiscard]] Expected<void> check(std::span<const double> q, std::string_view where,
                                     std::string_view name) const;

  /// How q goes to another configuration: angles that wrap take the short way.
  [[nodiscard]] std::vector<double> difference(std::span<const double> from,
                                               std::span<const double> to) const;

  /// The straight move from a configuration by a difference, judged along its whole length.
  /// @param from, by  An entry an axis; others are not free.
  [[nodiscard]] MoveCheck check_move(std::span<const double> from,
                                     std::span<const double> by) const;

  /// The length of a difference: √Σ(d_i / scale_i)².
  [[nodiscard]] double length(std::span<const double> difference) const;

  /// What planners work on; for the library's own use.
  [[nodiscard]] const detail::SpaceModel& model() const noexcept { return *model_; }

 private:
  explicit ConfigurationSpace(std::shared_ptr<const detail::SpaceModel> model);

  std::shared_ptr<const detail::SpaceModel> model_;
};

}  // namespace flyball
