#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/planning/configuration/configuration_space.hpp>

namespace flyball {

/// How a path is looked for.
enum class PathMethod {
  automatic,      ///< The first of these that is sure, or fast, for the space.
  straight,       ///< The straight move.
  corners,        ///< Two axes without a mechanism: the shortest path, around corners.
  grid,           ///< Two or three axes: A* on a grid, then any angle.
  rrt_connect,    ///< Random trees from both ends.
  rrt_star,       ///< A random tree that improves its ways until its work is done.
  roadmap,        ///< A random graph.
  decomposition,  ///< Boxes proven free or blocked: finds a path, or that there is none.
};
/// Its name, as `parse_path_method` takes it: "rrt-connect".
[[nodiscard]] const char* to_string(PathMethod method) noexcept;
/// A method by its name. @errors ArgumentError::unknown_name with the names that there are.
[[nodiscard]] Expected<PathMethod> parse_path_method(std::string_view name);

/// What is asked of a search.
struct PathSearch {
  PathMethod method = PathMethod::automatic;
  /// The same seed and bounds give the same path, of planners that were asked the same before.
  std::uint64_t seed = 1;
  /// s, > 0: when to give up. A search that ends before it does not depend on the clock.
  double seconds = 10.0;
  /// How many moves may be judged, >= 1, and boxes made, whichever comes first.
  long work = 50'000'000;
  bool shorten = true;  ///< Whether detours of random paths are taken out.
  int cells = 256;      ///< Of a grid along each axis; 8 to 4096.
  double clearance =
      0.0;           ///< In shares of the axes' scale: how far a grid's path stays away, >= 0.
  int nodes = 1000;  ///< Of a roadmap, and of RRT*; 2 to 1 000 000.
  bool wide = true;  ///< Whether 256-bit vectors are used where the processor has them.
};

/// Whether a search can be asked for. @errors ArgumentError::not_positive (seconds), out_of_range
/// (a clearance below zero, counts beyond what `PathSearch` says).
[[nodiscard]] Expected<void> check(const PathSearch& search);

/// A path of straight moves that are valid along their whole length.
struct ConfigurationPath {
  /// From the start to the goal, an entry an axis. Angles that wrap go on: their values may leave
  /// the axis' turn.
  std::vector<std::vector<double>> waypoints{};
  double length = 0.0;  ///< Sum of the moves' lengths in shares of the axes' scale.
  PathMethod method = PathMethod::straight;  ///< What found it.
  long moves = 0;                            ///< Judged.
  long nodes = 0;                            ///< Of trees, graphs or boxes.
};

/// Finds paths of one space; keeps what it learns and its memory between queries.
///
/// Random trees judge moves eight configurations at a time, in floats with a tolerance on the safe
/// side, along their whole length. What they do not find within a part of the work is decided by
/// boxes that are proven free or blocked: they give a path, a channel in which the trees grow on,
/// or the proof that there is none. Boxes, proofs and the moves of paths that `automatic` found are
/// kept for later queries: where both ends reach known moves, no search is needed, and the answer
/// is told as a roadmap's. So a path may depend on what was asked before. Source: J.
/// Kuffner, S. LaValle, RRT-Connect, ICRA 2000; S. Karaman, E. Frazzoli, Sampling-based algorithms
/// for optimal motion planning, IJRR 30 (2011); L. Kavraki et al., Probabilistic roadmaps, IEEE
/// T-RA 12 (1996); D. Zhu, J.-C. Latombe, New heuristic algorithms for efficient hierarchical path
/// planning, IEEE T-RA 7 (1991).
class PathPlanner {
 public:
  /// @param space  Where to plan; shared, not copied.
  explicit PathPlanner(ConfigurationSpace space);
  /// Takes over what the other has learnt; that one must not be asked again.
  PathPlanner(PathPlanner&&) noexcept;
  PathPlanner& operator=(PathPlanner&&) noexcept;
  ~PathPlanner();

  /// A path from a valid configuration to another.
  /// @param start, goal  An entry an axis.
  /// @errors ArgumentError: sizes, numbers that are not finite, bounds that are not positive, a
  ///         method that is not for this space; ConfigurationError::in_collision with the
  ///         constraint, no_path if it is proven that none exists, undecided with what was tried.
  /// Cost: bounded by `work` and `seconds`; memory by 10⁷ boxes and nodes.
  [[nodiscard]] Expected<ConfigurationPath> plan(std::span<const double> start,
                                                 std::span<const double> goal,
                                                 const PathSearch& search = {});

  /// Where it plans.
  [[nodiscard]] const ConfigurationSpace& space() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The same for one query.
[[nodiscard]] Expected<ConfigurationPath> plan_path(const ConfigurationSpace& space,
                                                    std::span<const double> start,
                                                    std::span<const double> goal,
                                                    const PathSearch& search = {});

}  // namespace flyball
