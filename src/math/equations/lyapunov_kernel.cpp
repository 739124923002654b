#include <cstddef>
#include <memory>

#include "math/equations/lyapunov_kernel.hpp"

namespace flyball::detail {

bool solve_stable_lyapunov(const LyapunovData& data, LyapunovAnswer& answer) {
  if (data.states <= lyapunov_stack_states) {
    alignas(32) double memory[lyapunov_workspace(lyapunov_stack_states)];
    int pivots[lyapunov_stack_states];
    return FLYBALL_RUN_KERNEL(solve_stable_lyapunov, data, answer, memory, pivots);
  }
  const auto n = static_cast<std::size_t>(data.states);
  const auto count = static_cast<std::size_t>(lyapunov_workspace(data.states));
  const std::unique_ptr<double[]> memory(new double[count]);
  const std::unique_ptr<int[]> pivots(new int[n]);
  return FLYBALL_RUN_KERNEL(solve_stable_lyapunov, data, answer, memory.get(), pivots.get());
}

}  // namespace flyball::detail
