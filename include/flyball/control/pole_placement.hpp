#pragma once

#include <complex>
#include <initializer_list>
#include <vector>

#include <Eigen/Core>

#include <flyball/systems/system.hpp>

namespace flyball {

/// Why poles cannot be placed.
enum class PolePlacementError {
  not_conjugate,     ///< A complex pole without its conjugate: no real gain has such poles.
  not_controllable,  ///< A mode that no input reaches is not among the poles that were asked for.
  not_reached,       ///< No gain of doubles was found that places the poles: the best one leaves
                     ///< one a tenth of its size off, or further than its condition explains.
  not_observable,    ///< A mode that no output shows is not among an observer's poles.
};
[[nodiscard]] ErrorInfo error_info(PolePlacementError code);

/// What a pole placement gives.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic>
struct PolePlacement {
  Eigen::Matrix<double, Inputs, States> K;  ///< Inputs x states, gain of u = K (r - x).
  /// Eigenvalues of A - B K for the K above, in the order of the poles that were asked for. Twice
  /// the working precision goes into A - B K, and into its eigenvalues where doubles do not tell
  /// them to 1e-10: in doubles a large K would hide them.
  Eigen::Matrix<std::complex<double>, States, 1> poles;
  /// ‖V‖ ‖V⁻¹‖ of the closed loop's unit eigenvectors: how much a relative error of A - B K moves
  /// a pole. Infinite (or above 1e8) where the closed loop cannot be diagonalised.
  double condition = 0.0;
  /// The largest distance of a reached pole from the p that was asked for, relative to |p|, with
  /// what may be wrong with the reached one: an upper bound, however small p is beside the plant
  /// and the other poles. A p = 0 has no size: its distance is relative to the largest of the
  /// poles, or to A (balanced) where all are zero. At most 0.1. It grows with `condition`, and is
  /// the n-th root of the rounding error for a pole repeated n times in one chain.
  double pole_error = 0.0;
  /// Modes of A that no input reaches and which therefore stay: all were among the poles.
  std::vector<std::complex<double>> uncontrollable;
};

/// The K whose closed loop A - B K has the given poles, for one or several inputs.
///
/// With one input K is unique. With several, the freedom that remains is spent on eigenvectors that
/// are as independent as they can be, so that the poles move least when the plant is not quite its
/// model: each eigenvector in turn is chosen from its allowed space such that the volume spanned by
/// all grows most, until the conditioning no longer improves. A pole may be repeated: up to rank B
/// times each copy gets its own eigenvector; beyond that (deadbeat, or one input) the closed loop
/// is built as an orthogonal triangular form column by column, which needs no eigenvectors.
///
/// Either way a basis X and a triangular T with the poles to the last bit are found, and then
///
///   A X - B F = X T,  K = F X⁻¹
///
/// is solved in twice the working precision, so that K is right to its last digit even where modes
/// are coupled by 1e-10 and K is as large as 1e10. If rounding K entry by entry still moved the
/// poles, the entries are rounded together such that their errors cancel; such a K has to be passed
/// on with all its digits.
///
/// The same function serves continuous and discrete plants; `place_observer`
/// (observer_placement.hpp) is its dual.
///
/// @param A  n x n. @param B  n x m; its columns may depend on each other.
/// @param poles  n, complex ones in conjugate pairs (1e-10 of each other), in any order.
/// @errors ArgumentError for shapes and entries that are not finite; PolePlacementError::
///         not_conjugate naming the pole; not_controllable with the mode that no input reaches, or
///         by rounding of A and B only, and the states that it lives in, if `poles` does not
///         contain it; not_reached if a pole of A - B K is further than 1e-8 max(1, |p|) times its
///         own condition (in given units or balanced ones) from its place, if `pole_error`
///         would be above 0.1 (as it is where rounding K moves a small pole by more than a tenth
///         of itself: the error names the pole, and where it ends), if a pole is no longer stable,
///         or if K is beyond the range of doubles.
/// Cost: with several inputs O(n³) a sweep over the eigenvectors, at most 60, and O(n³ rank B)
/// once; O(n⁴) for a triangular form (one input, poles repeated more often than rank B). Allocates.
///
/// Source: book, section 7.6. Kautsky, Nichols and Van Dooren, Int. J. Control 41 (1985), method 0;
/// complex pairs: Tits and Yang, IEEE Trans. Automatic Control 41 (1996); triangular form: Chu,
/// Systems & Control Letters 56 (2007); modes that stay: Varga, IEEE Trans. Automatic Control 26
/// (1981); staircase form: Van Dooren, IEEE Trans. Automatic Control 26 (1981); rounding together:
/// Lenstra, Lenstra and Lovász, Mathematische Annalen 261 (1982), and Babai, Combinatorica 6
/// (1986).
[[nodiscard]] Expected<PolePlacement<>> place(const MatrixRef& A, const MatrixRef& B,
                                              const Eigen::VectorXcd& poles);
[[nodiscard]] Expected<PolePlacement<>> place(const MatrixRef& A, const MatrixRef& B,
                                              std::initializer_list<std::complex<double>> poles);

namespace detail {

template <int States, int Inputs, class System>
[[nodiscard]] Expected<PolePlacement<States, Inputs>> place_system(const System& plant,
                                                                   const Eigen::VectorXcd& poles) {
  if (auto checked = check_system(plant, "place"); !checked) {
    return tl::unexpected(checked.error());
  }
  return place(plant.A, plant.B, poles).map([](const PolePlacement<>& placed) {
    return PolePlacement<States, Inputs>{placed.K, placed.poles, placed.condition,
                                         placed.pole_error, placed.uncontrollable};
  });
}

}  // namespace detail

/// The same for a plant, with its sizes; poles in the s-plane.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<PolePlacement<States, Inputs>> place(
    const ContinuousSystem<States, Inputs, Outputs>& plant, const Eigen::VectorXcd& poles) {
  return detail::place_system<States, Inputs>(plant, poles);
}
/// Poles in the z-plane.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<PolePlacement<States, Inputs>> place(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Eigen::VectorXcd& poles) {
  return detail::place_system<States, Inputs>(plant, poles);
}

/// The fastest discrete regulator: all poles at zero, so that any state is at the reference after
/// as many steps as the plant has states (or fewer, with several inputs), whatever voltage that
/// takes. @errors As `place`.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<PolePlacement<States, Inputs>> deadbeat(
    const DiscreteSystem<States, Inputs, Outputs>& plant) {
  return detail::place_system<States, Inputs>(plant, Eigen::VectorXcd::Zero(plant.A.rows()));
}
template <int States, int Inputs, int Outputs>
void deadbeat(const ContinuousSystem<States, Inputs, Outputs>& plant) = delete;

}  // namespace flyball
