#pragma once

#include <limits>
#include <vector>

#include "math/dense/instruction_set.hpp"

// What the constraints of a space are made of, as flat arrays of one type of number: doubles for
// what is told and proven, floats for what planners ask eight configurations at a time.
namespace flyball::detail {

constexpr int most_joints = 16;
constexpr int most_axes = 16;

template <class E>
struct JointStep {
  int parent;
  int coordinate;
  int slides;
  int turned;  ///< Whether the mount is turned.
  E x, y;
  E cosine, sine;
};

/// A capsule, and the ranges of what it must not touch.
template <class E>
struct BodyStep {
  int joint;
  int shifted;  ///< Whether it begins elsewhere than in the joint's origin, or in another
                ///< direction.
  E x, y;
  E ux, uy;
  E length;
  int first_run, last_run;
  int first_plane, last_plane;
  int first_piece, last_piece;
};

/// Discs of one radius.
template <class E>
struct DiscRun {
  int first, last;
  E reach;  ///< Of disc and body together.
};

/// n·p >= d for every point of the body, less its radius.
template <class E>
struct PlaneStep {
  E nx, ny, d;
};

/// A convex piece of a polygon: its edges, counter-clockwise.
template <class E>
struct PieceStep {
  int first, last;
  E reach;
};
template <class E>
struct EdgeStep {
  E x, y;    ///< Where it begins.
  E tx, ty;  ///< Its direction, of length 1.
  E length;
  E nx, ny, d;  ///< n·p - d > 0 outside.
};

/// Two bodies that must not touch.
template <class E>
struct PairStep {
  int a, b;
  E reach;
};

/// |Σ weight · arm| <= limit.
template <class E>
struct HoldStep {
  int joint;
  int slides;
  int first, last;  ///< Of the masses.
  E limit;
};
template <class E>
struct MassStep {
  int joint;
  E x, y;
  E weight;
};

/// A step of the regions, on a stack.
enum class RegionCode : int {
  everything,
  half_space,  ///< offset - Σ a_k q_k
  interval,    ///< min(q - low, high - q)
  turn,        ///< half - |q - middle| on a circle
  polygon,
  least,
  most,
  negate,
  demand  ///< What is on the stack must be >= 0.
};
template <class E>
struct RegionStep {
  RegionCode code;
  int coordinate;
  int up;
  int first, last;  ///< Of normals or edges.
  int leaf;         ///< Which rate.
  int wraps;        ///< 1: across, 2: up, 3: both are on a circle.
  E a, b;           ///< low, high; middle, half; offset; the middles of a polygon.
  E shift_x, shift_y;
  E slack;  ///< Taken from the margin: the tolerance of the lanes.
};

constexpr int deepest_region = 32;

/// Raw pointers, so that kernels call nothing that another instruction set compiled.
template <class E>
struct SpaceView {
  int dimension;
  int joint_count, body_count, pair_count, hold_count, region_count;
  const JointStep<E>* joints;
  const BodyStep<E>* bodies;
  const DiscRun<E>* runs;
  const E* disc_x;
  const E* disc_y;
  const PlaneStep<E>* planes;
  const PieceStep<E>* pieces;
  const EdgeStep<E>* edges;
  const PairStep<E>* pairs;
  const HoldStep<E>* holds;
  const MassStep<E>* masses;
  const RegionStep<E>* regions;
  const E* normals;
  const EdgeStep<E>* sides;  ///< Of polygons that are regions.
};

/// 1/rate of everything that has a margin: how much of a move a margin of 1 lasts for.
template <class E>
struct InverseRates {
  E* body;
  E* pair;
  E* hold;
  E* leaf;
};

/// What is needed to bound how fast things move, in doubles.
struct RateStep {
  struct Joint {
    int parent;
    int coordinate;
    bool slides;
    double mount;   ///< Distance of the mount from the parent's origin.
    double extent;  ///< Largest |q| of a slide.
  };
  struct Body {
    int joint;
    double far;  ///< Of its farthest point from the joint's origin.
  };
  struct Leaf {
    RegionCode code;
    int coordinate;
    int up;
    int first, last;
  };
  std::vector<Joint> joints{};
  std::vector<Body> bodies{};
  std::vector<double> pairs{};  ///< dimension a pair.
  std::vector<double> holds{};  ///< dimension a limit.
  std::vector<Leaf> leaves{};
  std::vector<double> normals{};
};

/// The arrays behind a view.
template <class E>
struct SpaceProgram {
  int dimension = 0;
  std::vector<JointStep<E>> joints{};
  std::vector<BodyStep<E>> bodies{};
  std::vector<DiscRun<E>> runs{};
  std::vector<E> disc_x{};
  std::vector<E> disc_y{};
  std::vector<PlaneStep<E>> planes{};
  std::vector<PieceStep<E>> pieces{};
  std::vector<EdgeStep<E>> edges{};
  std::vector<PairStep<E>> pairs{};
  std::vector<HoldStep<E>> holds{};
  std::vector<MassStep<E>> masses{};
  std::vector<RegionStep<E>> regions{};
  std::vector<E> normals{};
  std::vector<EdgeStep<E>> sides{};
  RateStep rates{};
  double slack = 0.0;  ///< Taken from distances, of floats.

  [[nodiscard]] SpaceView<E> view() const noexcept {
    return {dimension,
            static_cast<int>(joints.size()),
            static_cast<int>(bodies.size()),
            static_cast<int>(pairs.size()),
            static_cast<int>(holds.size()),
            static_cast<int>(regions.size()),
            joints.data(),
            bodies.data(),
            runs.data(),
            disc_x.data(),
            disc_y.data(),
            planes.data(),
            pieces.data(),
            edges.data(),
            pairs.data(),
            holds.data(),
            masses.data(),
            regions.data(),
            normals.data(),
            sides.data()};
  }
  [[nodiscard]] std::size_t rate_count() const noexcept {
    return bodies.size() + pairs.size() + holds.size() + rates.leaves.size();
  }
};

/// Fills 1/rate of everything for a move. @param by  The change of each coordinate, with its sign
/// where all go along one line; as sizes it bounds every move within them.
/// @param to  `rate_count` numbers: bodies, pairs, limits, leaves.
template <class E>
InverseRates<E> inverse_rates(const SpaceProgram<E>& program, const double* by, E* to) noexcept;

constexpr int lanes = 8;

/// What becomes of an edge.
enum class EdgeState : int { free, blocked, unproven };

/// The smallest margin of everything in shares of a move, for eight configurations.
/// @param q  dimension x 8, coordinate by coordinate.
FLYBALL_KERNEL(void reaches(const SpaceView<float>& space, const float* q,
                            const InverseRates<float>& rates, float* to) noexcept)
/// What is known of a box of configurations.
enum class BoxState : unsigned char { mixed, free, blocked, split };

/// What a box is judged by beside the space, in floats.
struct BoxRates {
  const float* pairs;       ///< dimension numbers a pair: how fast its distance changes.
  const float* holds;       ///< The same of limits.
  const float* hold_slack;  ///< What rounding may be of each limit.
  const float* weights;     ///< Of each coordinate, where regions are to be cut.
  float slack;              ///< What rounding may be of distances.
};
/// Which boxes are free, or blocked as a whole, and where to cut them if they are neither: along
/// the coordinate that matters most to what is nearest to deciding the box; -1 if nothing does.
/// Of bodies the bounds follow their pose: joints move one after the other, and of what is touched
/// the direction counts to first order, with a bound of the second.
/// @param middles, halves  dimension x 8.
FLYBALL_KERNEL(void judge_boxes(const SpaceView<float>& space, const float* middles,
                                const float* halves, const BoxRates& rates, BoxState* states,
                                int* axes) noexcept)
/// Whether a straight move is free along its whole length.
/// @param most  Batches of eight configurations at most.
FLYBALL_KERNEL(EdgeState check_edge(const SpaceView<float>& space, const float* from,
                                    const float* by, const InverseRates<float>& rates,
                                    int most) noexcept)
/// Index of the nearest of many points. @param points  dimension arrays of `stride` numbers, room
/// for a multiple of eight; @param turn  2π of a coordinate that wraps, else 0.
FLYBALL_KERNEL(int nearest(const float* points, int stride, int count, int dimension,
                           const float* inverse_scale, const float* turn, const float* to) noexcept)

/// The same for one configuration, in doubles.
double reach_of(const SpaceView<double>& space, const double* q,
                const InverseRates<double>& rates) noexcept;

}  // namespace flyball::detail
