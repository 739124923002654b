#pragma once

#include "math/dense/panel_kernel.hpp"

/// What takes a record's every sample: sums of products, and filters of a handful of states.
namespace flyball::detail {

/// A record's signals, one a column of `step` doubles of which the last `record_margin` are zero.
struct RecordView {
  const double* at;
  int step;
  int signals;
  int samples;
};
inline constexpr int record_margin = 4;

/// products[(j signals + i) lag_step + b] = Σ wᵢ(t) wⱼ(t + b), t < count, for b < lags; lag_step is
/// lags rounded up to fours.
FLYBALL_KERNEL(void lag_products(RecordView record, int count, int lags, double* products))

/// Two filters whose outputs' products are summed over a record: of each of the first `inputs`
/// signals, and of an impulse before the record, the states h⁺ = F h + g u; and one of all others,
/// the outputs y: x⁺ = Φ x + K y, e = W (y - C x).
struct RecordFilter {
  int states = 0;
  int inputs = 0;
  bool impulse = false;
  /// F beside g, rows beneath up to a multiple of four of zeros.
  const double* F = nullptr;
  /// [Φ K; -W C W], with rows of zeros beneath alike.
  const double* both = nullptr;
  const double* x0 = nullptr;  ///< Where x begins; zero if not given.
  bool squares = true;         ///< Whether Σ h hᵀ is asked for; it follows from the other sums.
};
/// Of [inputs; e; h of each input; h of the impulse, where there is one]: the number of rows.
inline constexpr int filter_rows(const RecordFilter& filter, int signals) {
  return filter.states * (filter.inputs + (filter.impulse ? 1 : 0)) + signals;
}
inline constexpr int filter_block = 64;
inline constexpr int filter_workspace(int states, int signals) {
  return (states * (signals + 1) + signals + 8) * (filter_block + 1) + 2 * (states + signals) + 64;
}
/// sums += Σ r rᵀ, its lower triangle at least; rows x rows, `sums_step` apart. `memory` begins
/// with the rows after the last sample, of which the h are filled in.
FLYBALL_KERNEL(void sum_filtered(RecordView record, const RecordFilter& filter, double* sums,
                                 int sums_step, double* memory))

/// The same by the variant for this processor.
void lag_products(RecordView record, int count, int lags, double* products);
void sum_filtered(RecordView record, const RecordFilter& filter, double* sums, int sums_step,
                  double* memory);

}  // namespace flyball::detail
