#pragma once

#include <optional>
#include <variant>
#include <vector>

#include <flyball/control/margins.hpp>

namespace flyball {

/// A continuous plant E(p) dx/dt = A(p) x + B(p) u whose matrices are linear in the parameters p:
/// E(p) = E + Σ p_i E_p[i], and so on. A mechanism's are diag(1, kA), [0 1; 0 -kV] and [0; 1].
struct LinearPlantFamily {
  Eigen::MatrixXd A;                 ///< n x n
  Eigen::MatrixXd B;                 ///< n x 1
  std::vector<Eigen::MatrixXd> A_p;  ///< n x n, one a parameter; or none at all.
  std::vector<Eigen::MatrixXd> B_p;  ///< n x 1, likewise.
  Eigen::MatrixXd E;                 ///< n x n; empty for the identity.
  std::vector<Eigen::MatrixXd> E_p;  ///< n x n; or none.
};

/// kA dv/dt = u - kV v with the parameters p = [kV, kA], where kA may be zero: then the velocity
/// follows its voltage at once. The states are [position, velocity] or [velocity].
struct MechanismFamily {
  bool position = true;
  /// p[1] is ln kA in place of kA, for a set that is symmetric in it.
  bool logarithmic = false;
};

/// The parameters [p; gain; delay]: centre + axes z with |z_i| <= 1 for every i, or with the first
/// `round` of the coordinates z in the unit ball: a confidence ellipsoid is centre + R z, where R
/// Rᵀ is the covariance times the quantile of χ².
struct ParameterSet {
  Eigen::VectorXd centre;  ///< k + 2
  Eigen::MatrixXd axes;    ///< (k + 2) x d, d <= 6
  Eigen::Index round = 0;  ///< Coordinates that share the ball; 0 for a box.
};

/// The box of intervals. @param low, high  k + 2, [p; gain; delay].
/// @errors ArgumentError for lengths, entries, and a low above its high.
[[nodiscard]] Expected<ParameterSet> parameter_box(const std::vector<double>& low,
                                                   const std::vector<double>& high);

/// A sampled loop of one of many plants: that of `PlantInputLoop`, whose plant, gain and delay are
/// of a set. Of the set's delays those below zero do not count.
struct UncertainLoop {
  std::variant<LinearPlantFamily, MechanismFamily> plant;
  Eigen::MatrixXd C;    ///< p x n, what the controller sees.
  Time period;          ///< s
  Eigen::MatrixXd A_c;  ///< q x q, as in PlantInputLoop.
  Eigen::MatrixXd B_c;  ///< q x p
  Eigen::MatrixXd C_c;  ///< 1 x q
  Eigen::MatrixXd D_c;  ///< 1 x p
  /// Of the plant's parameters, a factor on the plant's input, and the loop's whole delay, s.
  ParameterSet set;
};

/// One plant of the set.
struct LoopMember {
  Eigen::VectorXd parameters;  ///< [p; gain; delay]
  double spectral_radius = 0.0;
  double disk_margin = 0.0;  ///< α, 0 where it is not stable.
};

/// The loop of one member. @param parameters  [p; gain; delay].
/// @errors ArgumentError as `certify_loop`, for parameters that are not finite, and for a kA or an
/// E that leaves no equation: SystemError, those of `expm`.
[[nodiscard]] Expected<PlantInputLoop> loop_of(const UncertainLoop& loop,
                                               const Eigen::VectorXd& parameters);

/// What is shown of a set of loops.
enum class LoopVerdict {
  stable,     ///< Every member is; this is a proof.
  unstable,   ///< A member is not; it is named, and that too is a proof.
  undecided,  ///< Neither was shown within the work that was allowed.
};
[[nodiscard]] std::string_view to_string(LoopVerdict verdict);

/// A part of the set on which one quadratic form shrinks, V(x) = ‖T x‖² with the states
/// [plant; inputs on their way, newest first, times the gain; controller].
struct CertifiedPiece {
  Eigen::VectorXd middle, half;  ///< Of the coordinates z: |z - middle| <= half.
  int whole_periods = 0;         ///< The loop as of a delay from this many periods to one more.
  bool exact_periods = false;    ///< The delay is that many, and no input more is stored.
  double decay = 1.0;            ///< ‖T M x‖ <= decay ‖T x‖ for each member's M,
  double disk_margin = 0.0;      ///< or, if positive, the bounded real lemma for this α.
  Eigen::MatrixXd T;             ///< Square; with the channel's row and column for a disk margin.
};

/// The answer for all members of a set.
struct LoopCertificate {
  LoopVerdict verdict = LoopVerdict::undecided;
  /// Every member's spectral radius is below this: any error falls by it each period in the end. 1
  /// where only that much is shown.
  double decay = 1.0;
  /// Every member's disk margin α is at least this; 0 where none is shown. So every member bears a
  /// gain factor from gain_down to gain_up and a phase of up to phase_margin.
  double disk_margin = 0.0;
  double gain_up = 1.0;       ///< (2 + α)/(2 - α)
  double gain_down = 1.0;     ///< (2 - α)/(2 + α)
  double phase_margin = 0.0;  ///< deg, 2 atan(α/2)
  /// The worst that a search found: an unstable one, or that with the smallest disk margin. The
  /// true minimum lies between `disk_margin` and its.
  LoopMember worst;
  LoopMember slowest;                 ///< With the largest spectral radius found.
  double undecided_share = 0.0;       ///< Of the set's volume, of the stability proof.
  int pieces = 0;                     ///< Parts of the set that were looked at.
  std::vector<CertifiedPiece> proof;  ///< Where asked for: covers the set once for each claim.
};

/// How much work, and what to show.
struct CertificateOptions {
  int most_pieces = 20000;  ///< Of each claim.
  /// Floating-point operations of each claim, about.
  double most_work = 3e9;
  bool margins = true;      ///< Disk margin and decay beside stability.
  double closeness = 0.95;  ///< Of the margin that is shown to the smallest that was found.
  bool keep_proof = false;
};

/// Proves a sampled loop stable for every plant of a set, or finds one for which it is not.
///
/// Branch and bound. On a piece of the set the loop's matrix is M = M_0 + Σ ε_i M_i + G, from
/// Taylor models of first order of the plant's exact discretisation with the remainders of the
/// exponential's series and all rounding in |G| <= R. A common T with ‖T M_v T⁻¹‖ < 1 at the
/// vertices, found by linear matrix inequalities, is then verified: a Cholesky factor of
/// I - WᵀW in floating point, less what it can have rounded, proves V(x) = ‖T x‖² to fall for every
/// member of the piece. Where it does not, the piece is halved along the parameter that matters
/// most. Disk margins are shown by the bounded real lemma in the same way, at the α that is
/// `closeness` of the smallest that a search over corners, faces and from the worst on downhill has
/// found, or less where the work does not suffice. A member is called unstable where a Lyapunov
/// function that is not definite proves it.
///
/// A delay within 1e-12 periods of whole ones is whole, as in `discretize_delayed_input`.
/// @errors ArgumentError for shapes, entries, period, more than `most_delay_periods` of delay, more
/// than 6 axes, a set without members. Cost: from a millisecond to some tenths of a second; grows
/// with the sixth power of the states. Deterministic.
/// Source: Rump, "Verification methods", Acta Numerica 19 (2010); Boyd et al., "Linear Matrix
/// Inequalities in System and Control Theory" (1994); Seiler, Packard and Gahinet (2020) for the
/// disk.
[[nodiscard]] Expected<LoopCertificate> certify_loop(const UncertainLoop& loop,
                                                     const CertificateOptions& options = {});

}  // namespace flyball
