#pragma once

#include <string_view>
#include <vector>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// What is known of one uncertain part of a system.
enum class UncertaintyKind {
  real,     ///< δ I, one real number on every diagonal place: a parameter.
  complex,  ///< δ I, one complex number: a gain and phase, or dynamics that act alike.
  full,     ///< Any complex matrix: dynamics that were left out, or a performance.
};

/// One block of Δ = diag(Δ₁, Δ₂, …). M's inputs w = Δ z and outputs z are shared out to the blocks
/// in their order.
struct UncertaintyBlock {
  UncertaintyKind kind = UncertaintyKind::complex;
  Eigen::Index rows = 1;     ///< Inputs of M that it drives.
  Eigen::Index columns = 1;  ///< Outputs of M that it sees; `rows` unless it is full.
};

/// "real", "real 3" (δ I₃), "complex", "complex 3", "full 2x3" (rows x columns).
/// @errors ArgumentError::malformed.
[[nodiscard]] Expected<UncertaintyBlock> parse_uncertainty_block(std::string_view text);

/// The scalings that prove an upper bound β of µ(M): block for block D₁ is a positive number times
/// the identity, of δ I any positive definite matrix, G a Hermitian matrix of real blocks and zero
/// of the others; D_out is diag(D₁, …) in the sizes of M's outputs, D_in in those of its inputs;
///
///   β² D_in - Mᴴ D_out M - j (G M - Mᴴ Gᴴ) > 0.
///
/// Proof: w = Δ z, z = M w make wᴴ(·)w <= 0 for every Δ with σ(Δ) <= 1/β.
struct StructuredScaling {
  Eigen::MatrixXcd D_out;  ///< p x p, Hermitian, positive definite.
  Eigen::MatrixXcd D_in;   ///< m x m
  Eigen::MatrixXcd G;      ///< m x p, zero without real blocks.
};

/// Bounds of µ(M) = 1/min{σ(Δ) : det(I - M Δ) = 0}, zero where no Δ makes it singular.
struct StructuredSingularValue {
  double lower = 0.0;      ///< 1/σ(delta), within its rounding; 0 where no Δ was found.
  double upper = 0.0;      ///< Proven by `scaling`, every rounding accounted for.
  Eigen::MatrixXcd delta;  ///< m x p, the smallest Δ found with det(I - M Δ) = 0; zero if none.
  /// ‖(I - M Δ) z‖/((1 + ‖M‖ ‖Δ‖)‖z‖) of its z, in the scaling's coordinates.
  double residual = 0.0;
  StructuredScaling scaling;
};

/// The structured singular value µ of a matrix: how large an uncertainty of a known structure a
/// loop bears. Feedback of Δ around M is well posed, or stable where M is a stable system's
/// frequency response, for every σ(Δ) < 1/µ.
///
/// The upper bound is the least of the convex problem of StructuredScaling, by the method of
/// centers from balanced coordinates (with diagonal D and G where all of them have more than 220
/// numbers), then verified: a Cholesky factor of its matrix less all that
/// rounding can have done. With complex blocks it is µ itself where 2 S + F <= 3 (S repeated, F
/// full blocks); with real ones it may be above. The lower bound is the best of searches that climb
/// to the largest real eigenvalue of Q M over Δ's with σ(Q) <= 1: power iteration for complex
/// blocks, corners (all of them up to ten single real ones, which is µ itself of a real M with
/// nothing else) and sequential linear programming in the parameters for real ones.
///
/// @param M  p x m, outputs x inputs; at most `most_structured_size` of either.
/// @param blocks  Their rows sum to m, their columns to p.
/// @errors ArgumentError for shapes and entries. Cost: a millisecond for three channels, 20 ms for
/// ten single blocks; grows with the sixth power of a repeated block's size. Deterministic.
/// Source: Packard and Doyle, "The complex structured singular value", Automatica 29 (1993); Fan,
/// Tits and Doyle, IEEE Trans. Automatic Control 36 (1991); Boyd and El Ghaoui, Linear Algebra and
/// its Applications 188 (1993).
[[nodiscard]] Expected<StructuredSingularValue> structured_singular_value(
    const Eigen::MatrixXcd& M, const std::vector<UncertaintyBlock>& blocks);
inline constexpr Eigen::Index most_structured_size = 24;

/// A stretch of frequencies over which one scaling proves the bound.
struct ScaledStretch {
  double low = 0.0;   ///< rad/s
  double high = 0.0;  ///< rad/s, may be infinite.
  StructuredScaling scaling;
};

/// Bounds of the largest µ(M(jω)) over all frequencies.
struct StructuredPeak {
  double lower = 0.0;      ///< 1/σ(delta)
  double upper = 0.0;      ///< Of every frequency, those between the ones that were looked at too.
  double frequency = 0.0;  ///< rad/s, where det(I - M(jω) delta) = 0; ∞ if at infinity.
  Eigen::MatrixXcd delta;  ///< The worst member that was found. Real blocks are real.
  double residual = 0.0;   ///< As in StructuredSingularValue.
  StructuredScaling scaling;             ///< Where the bound was largest,
  double scaling_frequency = 0.0;        ///< rad/s, there.
  std::vector<ScaledStretch> stretches;  ///< They cover [0, ∞], or [0, π/T], with `upper`.
};

/// The largest µ over frequency of a stable system M: the loop with Δ is stable for every Δ of the
/// structure, dynamic ones too, with ‖Δ‖∞ < 1/upper, and delta is one of norm 1/lower that brings a
/// pole onto the border of stability.
///
/// No grid: a scaling found at one frequency holds up to where the Hamiltonian matrix of its form
/// has an eigenvalue on the imaginary axis, computed about that frequency by s = jω₀ + 1/ζ, where
/// the nearest crossings are the largest eigenvalues; an eigenvalue within its rounding of the axis
/// counts as one. Stretches are laid until no frequency is left. Members are sought with the
/// frequency as a further unknown, so that real ones, which are singular only at some frequencies,
/// are found.
///
/// Robust performance is the same question with one more full block, from the errors to the
/// disturbances: ‖F_u(M, Δ)‖∞ < β for every ‖Δ‖∞ <= 1/β exactly if the peak is below β (main loop
/// theorem).
/// @param system  M, of at most `most_structured_size` inputs or outputs.
/// @param blocks  As above.
/// @errors ArgumentError for the system and the blocks; SystemError::not_stable with the pole.
/// Cost: some ten to thirty structured singular values and Hamiltonian eigenvalues: milliseconds,
/// and seconds of a number that is repeated ten times. Deterministic.
/// Source: Lawrence, Tits and Van Dooren, Automatica 36 (2000); Roos and Biannic, ASME Advances in
/// Robust Control (2010).
[[nodiscard]] Expected<StructuredPeak> structured_peak(const ContinuousSystem<>& system,
                                                       const std::vector<UncertaintyBlock>& blocks);
[[nodiscard]] Expected<StructuredPeak> structured_peak(const DiscreteSystem<>& system,
                                                       const std::vector<UncertaintyBlock>& blocks);

}  // namespace flyball
