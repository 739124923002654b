#include <algorithm>
#include <cmath>

#include <flyball/identification/prediction_error.hpp>
#include <flyball/math/probability/distributions.hpp>

namespace flyball::identification {

namespace {

/// Σ r²/σ² with the larger model's σ, so that both are measured alike.
double squares_of(const PredictionErrorFit& fit, const std::vector<double>& output_std) {
  double sum = 0.0;
  for (const RunFit& run : fit.runs) {
    for (Eigen::Index k = 0; k < run.residuals.cols(); ++k) {
      for (Eigen::Index p = 0; p < run.residuals.rows(); ++p) {
        if (const double error = run.residuals(p, k); std::isfinite(error)) {
          const double z = error / output_std[static_cast<std::size_t>(p)];
          sum += z * z;
        }
      }
    }
  }
  return sum;
}

}  // namespace

ModelComparison compare(const PredictionErrorFit& smaller, const PredictionErrorFit& larger) {
  ModelComparison made{.aic_gain = smaller.aic - larger.aic, .bic_gain = smaller.bic - larger.bic};
  const auto added = static_cast<double>(larger.estimated - smaller.estimated);
  const auto rest = static_cast<double>(larger.measurements - larger.estimated);
  if (added > 0.0 && rest > 0.0) {
    const double least = squares_of(larger, larger.output_std);
    const double gained = squares_of(smaller, larger.output_std) - least;
    made.f = std::max(0.0, gained) / added / (least / rest);
    made.p_value = f_tail(made.f, added, rest);
  }
  return made;
}

}  // namespace flyball::identification
