#pragma once

#include <complex>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

#include "math/dense/dense.hpp"
#include "math/extended/double_double.hpp"

/// The steps of pole placement, on a plant whose arguments have been checked.
namespace flyball::detail {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// A = Q [A_c *; 0 A_u] Qᵀ, B = Q [B_c; 0]: (A_c, B_c) is controllable, the modes of A_u stay.
struct ControllableStaircase {
  Eigen::MatrixXd Q;
  Eigen::MatrixXd A;      ///< Qᵀ A Q
  Eigen::MatrixXd B;      ///< Qᵀ B, its rows below `rank` zero.
  Eigen::Index rank = 0;  ///< Of B.
  Eigen::Index controllable = 0;
  /// The first column of each row of A that is not zero.
  std::vector<Eigen::Index> first;
};
[[nodiscard]] ControllableStaircase controllable_staircase(const MatrixRef& A, const MatrixRef& B);

/// A controllable pair in staircase coordinates: B = [B_1; 0], B_1 of full row rank.
struct PlacementProblem {
  Eigen::MatrixXd A;
  Eigen::Index rank = 0;
  std::vector<Eigen::Index> first;  ///< As in ControllableStaircase.
  Eigen::VectorXcd poles;           ///< Real ones first, then pairs (p, conj p) side by side.
};

/// A X - X T is in the range of B: u = -K x with K X = F makes T of the loop. T is block upper
/// triangular and has the wanted poles to the last bit: α on the diagonal, or [α βs; -β/s α] with
/// a power of two s. `condition` is that of the unit eigenvectors where the method knows it.
struct PlacedLoop {
  Eigen::MatrixXd X;
  Eigen::MatrixXd T;
  double condition = 0.0;
};

/// Eigenvectors made as independent as they can be. Nothing where none are independent.
[[nodiscard]] std::optional<PlacedLoop> place_eigenvectors(const PlacementProblem& problem);

/// The loop as an orthogonal triangular form, whatever the multiplicities.
[[nodiscard]] std::optional<PlacedLoop> place_triangular(const PlacementProblem& problem);

/// A gain and the basis in which its loop is nearly T.
struct ExactGain {
  DoubleDoubleMatrix K;
  DoubleDoubleMatrix X;
  DoubleDoubleMatrix inverse;  ///< X⁻¹
};

/// The gain of a loop for the plant A, B itself, to the last digit: T is kept, X is solved column
/// by column in twice the working precision. `problem` is the plant's staircase form, A = Q
/// problem.A Qᵀ to rounding. Nothing where X is singular.
[[nodiscard]] std::optional<ExactGain> exact_gain(const PlacementProblem& problem,
                                                  const PlacedLoop& loop, const MatrixRef& Q,
                                                  const MatrixRef& A, const MatrixRef& B);

/// The rows of N = [0 I] (A - p I), those that no input reaches, as N Z = [0 R], Z unitary. The
/// staircase leaves few entries to annihilate in each: O(n² rank).
template <class Scalar>
class UnreachedRows {
 public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  UnreachedRows(const PlacementProblem& problem, Scalar pole);

  /// An orthonormal basis of {x : N x = 0}.
  [[nodiscard]] Matrix null_space() const;

  /// The smallest x with N x = right.
  [[nodiscard]] Vector solve(const Vector& right) const;

 private:
  [[nodiscard]] Matrix turned(Matrix M) const;

  Eigen::Index rank_;
  Matrix N_;
  Matrix reflections_;
  const std::vector<Eigen::Index>& first_;
};

extern template class UnreachedRows<double>;
extern template class UnreachedRows<std::complex<double>>;

/// The units of the states in the coordinates x that are used.
struct StateUnits {
  Eigen::VectorXd given;     ///< x_given = diag(given) x.
  Eigen::VectorXd balanced;  ///< diag(balanced) x are those in which A is balanced.
};

/// Where a gain puts the poles, in the order of those that were asked for.
struct Reached {
  Eigen::VectorXcd wanted;
  Eigen::VectorXcd poles;
  double condition = infinite;  ///< Of the unit eigenvectors, in the units that were given.
  /// The largest distance from the pole p that was asked for, with what may be wrong with it,
  /// relative to |p|; where p = 0 to the largest of the poles, or of A where all are zero.
  double pole_error = infinite;
  Eigen::Index worst = 0;  ///< Which pole that is.
  /// The largest of these in units of max(1, |p|) times the pole's own condition, 1/|yᴴx| for unit
  /// left and right eigenvectors: in the plant's units or in balanced ones, where it is smaller.
  double misplaced = infinite;
  Eigen::MatrixXcd left;   ///< Rows yᴴ, in the order of the poles, and
  Eigen::MatrixXcd right;  ///< columns x: yᴴx = 1.

  /// No condition excuses a pole that is a tenth off.
  [[nodiscard]] bool accepted() const { return misplaced <= 1e-8 && pole_error <= 0.1; }
};

/// The poles of A - B K, which is exact: with a basis X in which it is nearly triangular (or with
/// its own eigenvectors).
[[nodiscard]] Reached reached_by(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                                 const DoubleDoubleMatrix& X, const DoubleDoubleMatrix& inverse,
                                 const StateUnits& units, const Eigen::VectorXcd& wanted);
[[nodiscard]] Reached reached_by(const MatrixRef& A, const MatrixRef& B, const MatrixRef& K,
                                 const StateUnits& units, const Eigen::VectorXcd& wanted);

/// K rounded to doubles such that its entries' errors cancel in the poles. Where several inputs
/// together move a weakly coupled mode, each entry is large and each rounded for itself would move
/// the other modes: of the gains next to K, as far as they matter all as good, few do not.
/// `reached` are the poles of K with each entry rounded for itself. Nothing for many entries.
[[nodiscard]] std::optional<Eigen::MatrixXd> rounded_together(const MatrixRef& B,
                                                              const DoubleDoubleMatrix& K,
                                                              const Reached& reached);

/// Which of `got` matches each of `wanted`; nearest pairs are matched first.
[[nodiscard]] std::vector<std::size_t> matched(const Eigen::VectorXcd& wanted,
                                               const Eigen::VectorXcd& got);

/// Units of the plant as it is for messages: the states', and time's as a power of two.
struct GivenUnits {
  Eigen::VectorXd states;
  int time = 0;
};

/// The poles that are left for the controllable part once each mode that stays has taken its own;
/// the error if one finds none, or if a real mode would take one of a pair.
[[nodiscard]] Expected<Eigen::VectorXcd> poles_to_move(const ControllableStaircase& form,
                                                       const GivenUnits& units,
                                                       const Eigen::VectorXcd& wanted,
                                                       std::vector<std::complex<double>>& staying);

/// The answer for a pair that is uncontrollable to rounding, though no step of its staircase shows
/// it: the product of several couplings can be smaller than any. It names the mode that is reached
/// least among those that are not wanted.
[[nodiscard]] Error weakest_mode(const MatrixRef& A, const MatrixRef& B, const GivenUnits& units,
                                 const Eigen::VectorXcd& wanted);

/// An orthonormal basis of {v : M v = 0} for an M of full row rank, rows < columns.
[[nodiscard]] Eigen::MatrixXcd null_space_of(const ComplexMatrixRef& M);

/// Orthonormal right singular vectors of M for its `count` largest singular values, M with few
/// columns.
[[nodiscard]] Eigen::MatrixXcd leading_directions(const ComplexMatrixRef& M, Eigen::Index count);

/// The largest singular value of M; infinite where M is not finite.
[[nodiscard]] double norm2(const ComplexMatrixRef& M);

}  // namespace flyball::detail
