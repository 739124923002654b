#pragma once

#include <cstddef>
#include <span>
#include <vector>

/// Whether residuals are what is left when everything that can be predicted is.
namespace flyball::identification {

/// The autocorrelation of residuals, and whether chance explains it.
struct Whiteness {
  std::vector<double> autocorrelation{};  ///< At lags 1, 2, …
  double statistic = 0.0;                 ///< Ljung and Box's Q.
  double p_value = 1.0;                   ///< Of white residuals, the share with a larger Q.
  std::size_t samples = 0;
  /// Lags until the autocorrelation is first within two standard errors of zero; 0: at once.
  std::size_t correlated_lags = 0;

  /// Whether the residuals can be white.
  [[nodiscard]] bool is_white() const noexcept { return p_value >= 0.01; }
};

/// @param runs  Residuals at equal distances; NaN: missing. Their mean is not subtracted.
/// @param lags  The most that are looked at; fewer where runs are short.
/// Source: Ljung, Box, "On a measure of lack of fit in time series models", Biometrika 65 (1978).
[[nodiscard]] Whiteness whiteness_of(std::span<const std::vector<double>> runs,
                                     std::size_t lags = 25);

}  // namespace flyball::identification
