#pragma once

#include <optional>

#include <Eigen/Core>

#include "math/equations/sylvester_operator.hpp"

/// A X + X B = F and A X B - X = F of numbers that no unit brings together: in 31 digits whose
/// exponents have no bounds.
namespace flyball::detail {

/// Whether sums of products of these numbers can leave the range in which doubles keep their
/// digits.
[[nodiscard]] bool is_wide(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B,
                           const Eigen::MatrixXd& F);

struct WideSylvesterSolution {
  Eigen::MatrixXd X;       ///< Infinite where an entry is beyond the doubles.
  double condition = 0.0;  ///< The largest growth of an entry's relative error.
};

/// Solved as n m linear equations, of at most 100 unknowns. Nothing where they are more, or
/// singular. Cost: O(n³m³).
[[nodiscard]] std::optional<WideSylvesterSolution> solve_sylvester_wide(Domain domain,
                                                                        const Eigen::MatrixXd& A,
                                                                        const Eigen::MatrixXd& B,
                                                                        const Eigen::MatrixXd& F);

/// What is left of an entry of the equation beside the sum of the magnitudes of its terms, the
/// largest over the entries. An entry whose terms are less than a thousandth of what its row and
/// its column have elsewhere counts as that, and what the rounding of X beyond the normal doubles
/// leaves of one counts as nothing, but for the largest entry.
[[nodiscard]] double wide_backward_error(Domain domain, const Eigen::MatrixXd& A,
                                         const Eigen::MatrixXd& B, const Eigen::MatrixXd& X,
                                         const Eigen::MatrixXd& F);

}  // namespace flyball::detail
