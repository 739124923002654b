#pragma once

#include <algorithm>
#include <limits>

#include <flyball/math/riccati/riccati.hpp>

namespace flyball::detail {

/// What a design that solves many equations gives for those of them that the kernels do not vouch
/// for, in multiplications of doubles' twice precision: a product of n x n counts n³ of them, and
/// `four_times` as many in four times the precision of doubles. The same problem spends the same.
struct CarefulWork {
  double left = std::numeric_limits<double>::infinity();

  /// Whether there was so much left.
  bool spend(double work) noexcept {
    left -= work;
    return left >= 0.0;
  }
  [[nodiscard]] bool is_done() const noexcept { return left < 0.0; }

  /// About a second's; of more than 90 states 500 products.
  [[nodiscard]] static CarefulWork of_a_second(Eigen::Index states) noexcept {
    const auto n = static_cast<double>(states);
    return {std::max(4e8, 500.0 * n * n * n)};
  }
};

/// `dare` and `care` within what is left; RiccatiError::no_convergence once that is done.
[[nodiscard]] Expected<RiccatiSolution> dare_within(const MatrixRef& A, const MatrixRef& B,
                                                    const MatrixRef& Q, const MatrixRef& R,
                                                    const MatrixRef& N, CarefulWork& work);
[[nodiscard]] Expected<RiccatiSolution> care_within(const MatrixRef& A, const MatrixRef& B,
                                                    const MatrixRef& Q, const MatrixRef& R,
                                                    const MatrixRef& N, CarefulWork& work);

}  // namespace flyball::detail
