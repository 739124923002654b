#include <flyball/estimation/outlier_guard.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

/// The χ² quantile by its cube root's normal approximation.
/// Source: Wilson and Hilferty, "The distribution of chi-square", PNAS 17 (1931).
double wilson_hilferty(double normal, double freedom) noexcept {
  const double variance = 2.0 / (9.0 * freedom);
  const double root = 1.0 - variance + normal * std::sqrt(variance);
  return freedom * std::max(root, 0.0) * root * root;
}

}  // namespace

Expected<OutlierGuard> OutlierGuard::create(const OutlierOptions& options) {
  constexpr std::string_view where = "OutlierGuard";
  FLYBALL_CHECK(Checks(where)
                    .within(options.probability, 0.5, 1.0 - 1e-12, "probability")
                    .within(options.freedom, 1.0, 1e6, "freedom")
                    .within(options.iterations, 1.0, 1000.0, "iterations")
                    .within(options.recover_after, 0.0, 1e9, "recover_after")
                    .not_negative(options.recover_time.si(), "recover_time", "s")
                    .within(options.inflation, 1.0, 1e12, "inflation"));
  OutlierGuard guard;
  guard.options_ = options;
  guard.normal_quantile_ = normal_quantile(options.probability);
  for (std::size_t i = 0; i < known; ++i) {
    guard.thresholds_[i] = chi_squared_quantile(options.probability, static_cast<double>(i + 1));
  }
  return guard;
}

double OutlierGuard::threshold(int freedom) const noexcept {
  const auto index = static_cast<std::size_t>(std::max(freedom, 1) - 1);
  return index < known ? thresholds_[index] : wilson_hilferty(normal_quantile_, freedom);
}

double OutlierGuard::weight(double distance, int freedom) const noexcept {
  switch (options_.treatment) {
    case OutlierTreatment::gate:
      return distance <= threshold(freedom) ? 1.0 : 0.0;
    case OutlierTreatment::huber: {
      const double limit = threshold(freedom);
      return distance <= limit ? 1.0 : std::sqrt(limit / distance);
    }
    case OutlierTreatment::student:
      // (ν + m)/(ν + d), at most 1 so that a good measurement is not taken for a better one.
      return std::min(1.0, (options_.freedom + freedom) / (options_.freedom + distance));
  }
  return 1.0;
}

double OutlierGuard::judged(double weight) noexcept {
  constexpr double hardly = 0.1;
  constexpr int convincing = 3;
  auto& [rejected, fitting, doubting, since_fit] = memory_;
  if (weight >= hardly) {
    rejected = 0;
    since_fit = 0.0;
    fitting = std::min(fitting + 1, convincing);
    doubting = doubting && fitting < convincing;
    return 1.0;
  }
  fitting = 0;
  rejected += rejected < 1'000'000'000 ? 1 : 0;
  doubting = doubting || (options_.recover_after > 0 && rejected >= options_.recover_after) ||
             (options_.recover_time.si() > 0.0 && since_fit >= options_.recover_time.si());
  return doubting ? options_.inflation : 1.0;
}

}  // namespace flyball
