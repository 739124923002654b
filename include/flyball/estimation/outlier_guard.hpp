#pragma once

#include <array>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball {

/// What becomes of a measurement that does not fit the estimate.
enum class OutlierTreatment {
  gate,  ///< It is left out whole: where νᵀ S⁻¹ ν exceeds its χ² quantile.
  /// Its noise is taken for larger, so that its pull stays what it is at the quantile (Huber).
  huber,
  /// Its noise is Student's: the more it is off the less it pulls, and one far off hardly at all.
  student,
};

/// Options of an OutlierGuard.
struct OutlierOptions {
  OutlierTreatment treatment = OutlierTreatment::gate;
  /// Of good measurements, the share that is taken as it is (gate, huber).
  double probability = 0.997;
  double freedom = 4.0;  ///< ν of Student's distribution, at least 1 (student).
  int iterations = 10;   ///< Of re-weighting, at most (huber, student).
  /// After so many measurements in a row that counted for less than a tenth, the estimate is
  /// doubted instead, by `inflation` at each one that does not fit, until three in a row do; 0:
  /// never.
  int recover_after = 0;
  /// The same after this time without one that fits, as `advance` is told; 0: never.
  Time recover_time{0.0};
  double inflation = 10.0;  ///< By which P is multiplied, more than 1.
};

/// One sensor's judge: which of its measurements are outliers, and when it is the estimate that is
/// wrong. Each sensor has its own, so that one that fits cannot hide that another does not.
///
/// Run-time object: noexcept, bounded, allocation-free.
/// Source: Huber, "Robust estimation of a location parameter", Ann. Math. Statist. 35 (1964); Roth,
/// Ozkan, Gustafsson, "A Student's t filter for heavy tailed process and measurement noise", ICASSP
/// (2013).
class OutlierGuard {
 public:
  /// @errors ArgumentError::out_of_range, not_positive, not_finite for an option.
  [[nodiscard]] static Expected<OutlierGuard> create(const OutlierOptions& options = {});

  [[nodiscard]] const OutlierOptions& options() const noexcept { return options_; }
  /// The χ² quantile of the options' probability. @param freedom  Degrees of freedom, at least 1.
  [[nodiscard]] double threshold(int freedom) const noexcept;
  /// What a measurement counts for, in 0 … 1; of a gate 0 or 1.
  /// @param distance  Its squared distance from what was expected, such as νᵀ S⁻¹ ν.
  /// @param freedom   The number of its entries.
  [[nodiscard]] double weight(double distance, int freedom) const noexcept;

  /// Tells the time that goes by, for `recover_time`. @param dt  s.
  void advance(double dt) noexcept { memory_.since_fit += dt > 0.0 ? dt : 0.0; }
  /// Tells what the last measurement counted for. @return  By what to multiply P: 1, or
  /// `inflation`.
  double judged(double weight) noexcept;
  /// How many in a row did not fit.
  [[nodiscard]] int rejected_in_a_row() const noexcept { return memory_.rejected; }
  /// Starts again, as after a reset of the filter.
  void reset() noexcept { memory_ = {}; }

  /// What it remembers of the measurements that it has judged.
  struct Memory {
    int rejected = 0;        ///< In a row that did not fit,
    int fitting = 0;         ///< that did, three at most.
    bool doubting = false;   ///< Whether the estimate is.
    double since_fit = 0.0;  ///< s
    bool operator==(const Memory&) const = default;
  };
  [[nodiscard]] const Memory& memory() const noexcept { return memory_; }
  /// Goes on from what was remembered, as where a filter goes back in time.
  void restore(const Memory& memory) noexcept { memory_ = memory; }

 private:
  OutlierGuard() = default;

  static constexpr std::size_t known = 12;
  OutlierOptions options_;
  std::array<double, known> thresholds_{};
  double normal_quantile_ = 0.0;
  Memory memory_;
};

}  // namespace flyball
