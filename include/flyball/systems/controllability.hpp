#pragma once

#include <complex>
#include <span>
#include <string>
#include <vector>

#include <flyball/systems/analysis.hpp>

namespace flyball {

/// One mode, and how strongly the inputs reach it or the outputs see it.
struct ModeReach {
  std::complex<double> eigenvalue;
  bool reached = false;  ///< Whether any input moves it; whether any output shows it.
  /// The Popov-Belevitch-Hautus test as a number: the smallest singular value of [A - λI, B] (or
  /// [A - λI; C]) over the size of [A B], in balanced units. A relative change of the matrices of
  /// this size can cut the mode off: 1e-2 is ordinary, 1e-8 all but unreachable.
  double distance = 0.0;
  Stability stability = Stability::stable;
  Eigen::VectorXd participation;  ///< n: each state's share in the mode, |vᵢwᵢ|, adding up to 1.
};

/// What of a system can be reached from one side, its inputs or its outputs, by every test there
/// is.
struct ReachAnalysis {
  Eigen::Index order = 0;            ///< n
  Eigen::Index rank = 0;             ///< Dimension of what is reached; n if everything is.
  std::vector<Eigen::Index> stairs;  ///< How many states are reached after no, one, two, …
                                     ///< integrations: the orthogonal staircase.
  std::vector<ModeReach> modes;      ///< n, the hidden ones first, then by increasing distance.
  /// n x (n - rank). Controllability: columns w whose combinations wᵀx no input moves;
  /// observability: initial states x that no output shows. In the states' units, of norm 1.
  Eigen::MatrixXd hidden;
  Eigen::Index matrix_rank = 0;  ///< Of (6.37) or (6.41), balanced, by singular values.
  /// σ_max/σ_min of that matrix in the units as given (6.12.1). With tens of states it is beyond
  /// 1e16, where σ_min is rounding and only this much is known.
  double matrix_condition = 0.0;
  /// n, increasing: the Gramian's eigenvalues in balanced units, larger is easier; negative ones
  /// belong to unstable modes. Empty where the Gramian does not exist, or has no doubles there.
  Eigen::VectorXd gramian_eigenvalues;
  double tolerance = 0.0;  ///< Below it a distance counts as zero.
};

/// What the inputs reach.
struct ControllabilityAnalysis : ReachAnalysis {
  bool controllable = false;
  bool stabilizable = false;  ///< Every mode that no input moves decays by itself (6.12.4).
};

/// What the outputs show.
struct ObservabilityAnalysis : ReachAnalysis {
  bool observable = false;
  bool detectable = false;  ///< Every mode that no output shows decays by itself (6.12.8).
};

/// [B AB … Aⁿ⁻¹B] (6.37).
/// @param A  n x n. @param B  n x m. @return n x n m. @errors ArgumentError for shapes and entries.
/// Cost: O(n³m), allocates. Source: book, Theorem 6.12.1.
[[nodiscard]] Expected<Eigen::MatrixXd> controllability_matrix(const MatrixRef& A,
                                                               const MatrixRef& B);
/// [C; CA; …; CAⁿ⁻¹] (6.41).
/// @param A  n x n. @param C  p x n. @return n p x n. @errors ArgumentError for shapes and entries.
/// Cost: O(n³p), allocates. Source: book, Theorem 6.12.2.
[[nodiscard]] Expected<Eigen::MatrixXd> observability_matrix(const MatrixRef& A,
                                                             const MatrixRef& C);

/// Which modes and states the inputs move, and how strongly.
///
/// Time, states and inputs are measured in units first in which the entries of A and B are near
/// one (powers of two), so that units do not decide, whatever the entries' sizes. The verdict is
/// that of the orthogonal staircase, completed by the test of each mode: the rank of (6.37) alone
/// fails at a dozen states. Where which entries are zero already forces every mode to be reached,
/// as in a chain or a companion matrix, no rounding is held against it, though a mode's distance
/// may be as small.
///
/// @param A  n x n. @param B  n x m. @param domain  Decides which modes decay by themselves.
/// @errors ArgumentError for shapes and entries; SystemError::no_convergence.
/// Cost: O(n³) for the verdict, O(n²m) a mode for the distances; allocates.
/// Source: book, 6.12.1 to 6.12.4; Van Dooren, IEEE Trans. Automatic Control 26 (1981); Paige, same
/// volume; Mayeda and Yamada, SIAM J. Control Optim. 17 (1979).
[[nodiscard]] Expected<ControllabilityAnalysis> analyze_controllability(const MatrixRef& A,
                                                                        const MatrixRef& B,
                                                                        TimeDomain domain);

/// Which modes and states the outputs show, and how well. As above, for Aᵀ and Cᵀ.
/// @param C  p x n. Source: book, 6.12.5 to 6.12.8.
[[nodiscard]] Expected<ObservabilityAnalysis> analyze_observability(const MatrixRef& A,
                                                                    const MatrixRef& C,
                                                                    TimeDomain domain);

/// The answer in words: what is out of reach, which states it is, whether that matters, and what is
/// reached only weakly.
/// @param states  n names; x1, x2, … where there are fewer.
[[nodiscard]] std::string describe(const ControllabilityAnalysis& analysis,
                                   std::span<const std::string> states = {});
[[nodiscard]] std::string describe(const ObservabilityAnalysis& analysis,
                                   std::span<const std::string> states = {});

}  // namespace flyball
