#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>

namespace flyball::classical {

/// Closed-loop poles that meet: 1 + kL has a root of this multiplicity.
struct BranchPoint {
  std::complex<double> point;
  double gain = 0.0;
  int branches = 2;
};

/// Where branches cross, or touch, the border of stability: the imaginary axis, or the unit circle.
struct BorderCrossing {
  double frequency = 0.0;      ///< rad/s, not negative; its mirror image crosses, too.
  std::complex<double> point;  ///< jω, or e^{jωT}.
  double gain = 0.0;
};

/// The directions, in degrees from the positive real axis, in which branches leave a pole, or in
/// which they stand to a zero when they reach it.
struct LocusAngles {
  std::complex<double> root;
  std::vector<double> angles{};  ///< As many as the root has multiplicity; in (-180, 180].
};

/// The rays that branches follow to infinity.
struct Asymptotes {
  double center = 0.0;           ///< (Σ poles - Σ zeros)/(poles less zeros); NaN without rays.
  std::vector<double> angles{};  ///< deg, in (-180, 180].
};

/// Gains between which the closed loop is stable.
struct GainRange {
  double low = 0.0;
  double high = 0.0;  ///< ±∞ if all beyond are.
};

/// The closed loop's poles, the roots of 1 + kL, as k grows.
struct RootLocus {
  Eigen::VectorXcd zeros;  ///< Of L.
  Eigen::VectorXcd poles;  ///< With those at z = 0 of a discrete one's delay.
  /// k from 0 on, in steps in which no branch turns by more than is seen; each gain at which
  /// branches meet is one of them.
  Eigen::VectorXd gains;
  /// gains x poles: a branch a column, from its pole in the first row on. NaN where it is at
  /// infinity.
  Eigen::MatrixXcd branches;
  std::vector<BranchPoint> branch_points{};  ///< By |gain|; without the poles and zeros themselves.
  std::vector<BorderCrossing> crossings{};   ///< By |gain|.
  Asymptotes asymptotes{};
  std::vector<LocusAngles> departures{};  ///< One a pole, equal ones once.
  std::vector<LocusAngles> arrivals{};    ///< One a zero.
  std::vector<GainRange> stable_gains{};  ///< By |gain|; 0 itself counts if L is stable.
};

/// What of the locus is asked for.
struct RootLocusOptions {
  bool negative = false;  ///< k from 0 to -∞: positive feedback.
  /// |k| up to which it is followed; absent: until each branch is at its zero or far out on its
  /// asymptote.
  std::optional<double> largest_gain{};
};

/// The root locus of 1 + kL.
///
/// Branches are followed together: each step in k is as long as tangents tell surely which root
/// belongs to which branch, all roots are found anew from L's own factors by Aberth's method, and
/// at the gains where branches meet (roots of N'D - ND', found before) the expansion of ln L says
/// where they go on. Poles and zeros that a step of rounding of the coefficients makes one are
/// taken for one. Every point satisfies 1 + kL = 0 to the rounding of the point, mirrored exactly
/// at the real axis.
/// @param loop  L; without continuous dead time, whose locus has no end.
/// @errors TransferError::delay_in_loop; ArgumentError::not_positive (largest_gain), out_of_range
/// (more than 100 poles, or L = 0); SystemError::no_convergence.
/// Cost: O(n²) a step, some hundred steps: 20 ms for 30 poles; allocates.
/// Source: Evans, "Graphical analysis of control systems", Trans. AIEE 67 (1948); Aberth,
/// "Iteration methods for finding all zeros of a polynomial simultaneously", Mathematics of
/// Computation 27 (1973).
[[nodiscard]] Expected<RootLocus> root_locus(const TransferFunction& loop,
                                             const RootLocusOptions& options = {});
/// The same of a system with one input and one output. @errors As above, and ArgumentError for the
/// system's shapes and entries.
[[nodiscard]] Expected<RootLocus> root_locus(const ContinuousSystem<>& loop,
                                             const RootLocusOptions& options = {});
[[nodiscard]] Expected<RootLocus> root_locus(const DiscreteSystem<>& loop,
                                             const RootLocusOptions& options = {});

/// A point and its gain.
struct LocusPoint {
  std::complex<double> point;
  double gain = 0.0;
};

/// Where the locus of positive gains meets the curve of a damping ratio, s = ω(-ζ + j√(1 - ζ²)),
/// of a discrete one z = e^{sT} up to Nyquist's frequency: every one, by gain.
/// @param ratio  ζ, from 0 to below 1. @errors As `root_locus`; ArgumentError::out_of_range.
[[nodiscard]] Expected<std::vector<LocusPoint>> locus_at_damping(const TransferFunction& loop,
                                                                 double ratio);

/// The gain that puts a closed-loop pole at a point, as near as a real one does.
struct GainAtPoint {
  double gain = 0.0;   ///< 1/|L|, of positive feedback negative.
  double angle = 0.0;  ///< deg: how far the point is off the locus, arg(-kL).
};
/// @errors TransferError::at_a_pole; ArgumentError::not_finite, out_of_range at a zero.
[[nodiscard]] Expected<GainAtPoint> gain_at_point(const TransferFunction& loop,
                                                  std::complex<double> point);

}  // namespace flyball::classical
