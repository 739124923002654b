#include <cstddef>
#include <memory>

#include "math/equations/sylvester_kernel.hpp"

namespace flyball::detail {

bool solve_sylvester_quickly(const SylvesterData& data, SylvesterAnswer& answer) {
  if (data.rows <= sylvester_stack_size && data.columns <= sylvester_stack_size) {
    alignas(32) double memory[sylvester_workspace(sylvester_stack_size, sylvester_stack_size)];
    return FLYBALL_RUN_KERNEL(solve_sylvester, data, answer, memory);
  }
  // The two sides may change places.
  const int n = data.rows > data.columns ? data.rows : data.columns;
  const int m = data.rows > data.columns ? data.columns : data.rows;
  const auto count = static_cast<std::size_t>(sylvester_workspace(n, m));
  const std::unique_ptr<double[]> memory(new double[count]);
  return FLYBALL_RUN_KERNEL(solve_sylvester, data, answer, memory.get());
}

}  // namespace flyball::detail
