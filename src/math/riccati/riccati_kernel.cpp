#include <memory>

#include "math/riccati/riccati_kernel.hpp"

namespace flyball::detail {

bool solve_riccati_quickly(const RiccatiData& data, RiccatiAnswer& answer) {
  double* memory = nullptr;
  int* pivots = nullptr;
  std::unique_ptr<double[]> doubles;
  std::unique_ptr<int[]> integers;
  if (data.states > kernel_stack_states || data.inputs > data.states) {
    doubles.reset(new double[static_cast<std::size_t>(kernel_workspace(data.states, data.inputs))]);
    integers.reset(new int[static_cast<std::size_t>(data.states)]);
    memory = doubles.get();
    pivots = integers.get();
  }
  return FLYBALL_RUN_KERNEL(solve_riccati, data, answer, memory, pivots);
}

}  // namespace flyball::detail
