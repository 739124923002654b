#pragma once

#include <optional>
#include <vector>

#include <flyball/systems/system.hpp>

#include "classical/modal_kernel.hpp"

namespace flyball::classical::detail {

/// A point z = (re + re_lo) + j (im + im_lo).
struct FinePoint {
  double re = 0.0;
  double re_lo = 0.0;
  double im = 0.0;
  double im_lo = 0.0;
};
/// jω, or e^{jωT} in more digits than doubles have.
[[nodiscard]] FinePoint point_on_axis(double frequency, const std::optional<Time>& period);

/// C(zI - A)⁻¹B + D as the sum of its modes. Poles and residues are refined in 31 digits, so that
/// what is left is the rounding of the sum, which is bounded at each point.
class ModalResponse {
 public:
  /// Nothing for a matrix without a basis of eigenvectors, or nearly so.
  /// Cost: O(n³) in 31 digits.
  [[nodiscard]] static std::optional<ModalResponse> create(const ContinuousSystem<>& system);

  /// @param values  outputs·inputs numbers a point, column by column.
  /// @return  The points where the error may be above 1e-12 of the largest entry.
  [[nodiscard]] std::vector<Eigen::Index> evaluate(const std::vector<FinePoint>& points,
                                                   std::complex<double>* values) const;

 private:
  ModalTerms terms_;
};

}  // namespace flyball::classical::detail
