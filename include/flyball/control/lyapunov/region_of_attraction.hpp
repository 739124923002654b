#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/systems/model_tape.hpp>

/// From where a nonlinear loop comes to its equilibrium: proven by a quadratic Lyapunov function,
/// and looked at by simulation.
namespace flyball {

/// Why no region of attraction is certified.
enum class RegionError {
  not_an_equilibrium,  ///< The loop does not rest at the point.
  not_stable,          ///< Its linearisation is not stable, or P no Lyapunov function of it.
  not_enclosed,        ///< Near the point the model cannot be bounded: a kink, a pole, a limit.
};
[[nodiscard]] ErrorInfo error_info(RegionError code);

/// A model under linear state feedback with limits: u = clamp(u* + K (x* - x), u_min, u_max).
struct SaturatedLoop {
  ModelTape model;
  Eigen::VectorXd x;        ///< x*, n: where it is held.
  Eigen::VectorXd u;        ///< u*, m: the input there.
  Eigen::MatrixXd K;        ///< m x n
  Eigen::VectorXd u_min{};  ///< m; empty: none.
  Eigen::VectorXd u_max{};  ///< m; empty: none.
  /// States that are angles: a turn more is the same, and K sees the shorter way round.
  std::vector<Eigen::Index> angles{};
};

/// Which level sets are looked at, and how hard.
struct RegionOptions {
  /// P, n x n: V = (x - x*)ᵀ P (x - x*). Empty: from (A - B K)ᵀP + P (A - B K) = -Q.
  Eigen::MatrixXd P{};
  Eigen::MatrixXd Q{};  ///< n x n; empty: I. Unused where P is given.
  /// n, how far the region may reach from x* in each state, such as to the end of a track; infinite
  /// for as far as it goes. Empty: none.
  Eigen::VectorXd reach{};
  double closeness = 0.97;  ///< Of the level that is proven to the smallest that is found to fail.
  int most_cells = 400'000;
};

/// What ends a region.
enum class AttractionLimit {
  rate,   ///< V does not fall at `limiting_state`.
  reach,  ///< It touches the reach that was given.
  work,   ///< The cells that were allowed.
};

/// Where V = (x - x*)ᵀP(x - x*) proves the loop to come to its equilibrium.
struct CertifiedRegion {
  Eigen::VectorXd x;   ///< x*, n.
  Eigen::MatrixXd P;   ///< n x n, symmetric, positive definite.
  double level = 0.0;  ///< From every x with V(x) <= level the loop goes to the equilibrium.
  double core = 0.0;   ///< Of V: up to here it contracts, in the norm of P, at `core_rate`, 1/s.
  double core_rate = 0.0;
  double refuted = std::numeric_limits<double>::infinity();  ///< V of `limiting_state`.
  Eigen::VectorXd limiting_state{};  ///< n, where V does not fall; empty if none was found.
  AttractionLimit limit = AttractionLimit::rate;
  int cells = 0;                       ///< That were looked at.
  std::vector<Eigen::Index> angles{};  ///< Of the loop.

  /// V(x). @param state  n x 1; angles as near to x* as they go.
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& state) const;
  /// How far the region reaches in a state: √(level (P⁻¹)_ii).
  [[nodiscard]] double extent(Eigen::Index state) const;
  /// The volume of the region, in the states' units.
  [[nodiscard]] double volume() const;
};

/// The largest level set of a quadratic Lyapunov function that is proven to be a region of
/// attraction of a loop whose inputs are limited; this is a proof.
///
/// Over a cell of the coordinates z in which V = |z|², V̇ = 2 zᵀf_z(z) is enclosed by a Taylor model
/// of second order with outward rounding, from the model's tape. Where f is affine in the inputs V̇
/// is at most the larger of its values with an input's line and with its limit, each smooth; else a
/// clamp in doubt is an interval. Cells are taken in the order of V, those with V̇ < 0 are done,
/// others halved where that helps most: when the nearest that is left has V = ρ, everything below ρ
/// is proven. About x* itself, where V̇ has a zero, an interval enclosure of the loop's generalised
/// Jacobian F, F + Fᵀ < 0, shows the loop to contract. So whatever starts in V <= level stays there
/// and ends in the core, and there in one equilibrium, within rounding of x*.
///
/// What is proven is true of the loop as the model says and the input acts at all times; a sampled
/// controller needs a period that is short beside the loop's time constants. Functions other than
/// arithmetic, roots, exp, sin and cos are believed to err by less than eight units in the last
/// place.
///
/// @errors ArgumentError for shapes, entries and a P or Q that is not positive definite;
/// RegionError. Cost: some milliseconds for two states, a second for four; the cells grow as
/// (1/h)ⁿ. At most 8 states. Deterministic. Source: book, section 8.3; Khalil, "Nonlinear Systems",
/// section 8.2; Moore, Kearfott and Cloud, "Introduction to Interval Analysis", chapter 6;
/// Lohmiller and Slotine, "On contraction analysis for non-linear systems", Automatica 34 (1998).
[[nodiscard]] Expected<CertifiedRegion> certify_region(const SaturatedLoop& loop,
                                                       const RegionOptions& options = {});

/// What simulation says of a box of starts.
struct SampledRegion {
  Eigen::MatrixXd starts;     ///< n x count.
  std::vector<bool> comes{};  ///< Whether each comes to the equilibrium.
  double attracted = 0.0;     ///< Share of the starts that do.
  double certified = 0.0;     ///< Share of the starts that are in the certified region.
  /// Of what comes, the share that the certificate does not have.
  [[nodiscard]] double missed() const {
    return attracted > 0.0 ? 1.0 - certified / attracted : 0.0;
  }
};

/// How to sample.
struct SampleOptions {
  double duration = 10.0;  ///< s, within which a start has to come into the certified region.
  double step = 2e-3;      ///< s, of a fixed Runge-Kutta step.
  int count = 1000;
  unsigned long long seed = 1;
  /// The two states that are varied over a grid of √count by √count, the others at x*; empty: all,
  /// at random.
  std::vector<Eigen::Index> plane{};
};

/// Starts in a box about x*, simulated until they are in the certified region, whence they come to
/// the equilibrium, or the time is over: how much of the region of attraction the certificate
/// misses.
/// @param half  n, of the box. @errors ArgumentError for shapes, entries, options.
/// Cost: count duration/step times four calls of the model; allocates.
[[nodiscard]] Expected<SampledRegion> sample_region(const SaturatedLoop& loop,
                                                    const CertifiedRegion& region,
                                                    const Eigen::VectorXd& half,
                                                    const SampleOptions& options = {});

/// The border of the certified region in the plane of two states, and where it comes from: its
/// points followed backward in time. Each ring is the border of a set from which the loop comes
/// into the region within that time, of starts that are in the plane for a loop of two states.
/// @param first, second  States. @param times  s, not negative. @param points  Of a ring.
/// @return For each time 2 x points, x of both states; a point that leaves every bound ends as NaN.
/// @errors ArgumentError for states, times and points that are none.
[[nodiscard]] Expected<std::vector<Eigen::MatrixXd>> backward_rings(
    const SaturatedLoop& loop, const CertifiedRegion& region, Eigen::Index first,
    Eigen::Index second, const std::vector<double>& times, int points = 200);

}  // namespace flyball
