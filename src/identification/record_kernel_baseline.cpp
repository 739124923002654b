#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/record_kernel.hpp"
#include "math/dense/gemm_kernel.hpp"

#define FLYBALL_VARIANT baseline
#define FLYBALL_HOLD(lanes) static_cast<void>(lanes)
#include "identification/record_kernel_body.hpp"

namespace flyball::detail {

void lag_products(RecordView record, int count, int lags, double* products) {
  FLYBALL_RUN_KERNEL(lag_products, record, count, lags, products);
}

void sum_filtered(RecordView record, const RecordFilter& filter, double* sums, int sums_step,
                  double* memory) {
  FLYBALL_RUN_KERNEL(sum_filtered, record, filter, sums, sums_step, memory);
}

}  // namespace flyball::detail
