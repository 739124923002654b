#include <cstddef>
#include <memory>

#include "math/equations/lyapunov_kernel.hpp"

namespace flyball::detail {

namespace {

bool solve(const LyapunovData& data, LyapunovAnswer& answer, double* memory, int* pivots) {
#ifdef FLYBALL_WIDE_VECTORS
  if (has_wide_vectors()) {
    return wide::solve_stable_lyapunov(data, answer, memory, pivots);
  }
#endif
  return baseline::solve_stable_lyapunov(data, answer, memory, pivots);
}

}  // namespace

bool solve_stable_lyapunov(const LyapunovData& data, LyapunovAnswer& answer) {
  if (data.states <= lyapunov_stack_states) {
    alignas(32) double memory[lyapunov_workspace(lyapunov_stack_states)];
    int pivots[lyapunov_stack_states];
    return solve(data, answer, memory, pivots);
  }
  const auto n = static_cast<std::size_t>(data.states);
  const auto count = static_cast<std::size_t>(lyapunov_workspace(data.states));
  return solve(data, answer, std::unique_ptr<double[]>(new double[count]).get(),
               std::unique_ptr<int[]>(new int[n]).get());
}

}  // namespace flyball::detail
