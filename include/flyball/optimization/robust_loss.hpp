#pragma once

#include <string_view>

namespace flyball::optimization {

/// What a residual costs beside its square; the larger the residual, the less it pulls.
enum class Loss {
  squared,  ///< z²
  soft_l1,  ///< 2(√(1 + z²) - 1)
  huber,    ///< z² where |z| ≤ 1, else 2|z| - 1
  cauchy,   ///< log(1 + z²); not convex
  tukey,    ///< (1 - (1 - z²)³)/3 where |z| ≤ 1, else 1/3: outliers do not pull at all; not convex
};
/// "squared", "soft_l1", …
[[nodiscard]] std::string_view to_string(Loss loss);

/// ρ and its derivatives by the square s of a residual.
struct LossValue {
  double value = 0.0;  ///< ρ(s)
  double slope = 1.0;  ///< ρ'(s), 1 at 0
  double bend = 0.0;   ///< ρ''(s), ≤ 0
};

/// A loss and the size of a residual from which it differs from the square: with k = `scale`,
/// the cost is k² ρ((r/k)²).
struct RobustLoss {
  Loss kind = Loss::squared;
  double scale = 1.0;  ///< In the residuals' unit, positive.

  /// The cost of a residual whose square is `square`, and its derivatives.
  [[nodiscard]] LossValue operator()(double square) const noexcept;
};

}  // namespace flyball::optimization
