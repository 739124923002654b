// Problems along stages and starts that are disturbed.

#include <algorithm>
#include <cstdint>
#include <cstdio>

#include "problems.hpp"

namespace {

using namespace problems;
using namespace flyball::optimization;

void print(const char* name, int N, const Row& row) {
  std::printf("| %s | %d | %.2f | %d | %.2f | %.9g |%s\n", name, N, row.milliseconds,
              row.iterations, row.again, row.cost, row.solved ? "" : " not solved");
}

/// Starts with noise in every entry: how many of 96 are solved.
void disturbed(int N, double amplitude) {
  std::uint32_t seed = 12345;
  const auto noise = [&] {
    seed = seed * 1664525U + 1013904223U;
    return (static_cast<double>(seed >> 8U) / 8388608.0 - 1.0) * amplitude;
  };
  auto solver = OptimalControlSolver::make(cart_pole::problem(N)).value();
  int solved = 0;
  int most = 0;
  for (int run = 0; run < 96; ++run) {
    Eigen::MatrixXd x = cart_pole::start(N);
    Eigen::MatrixXd u = Eigen::MatrixXd::Zero(1, N);
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      x.data()[k] += noise();
    }
    for (Eigen::Index k = 0; k < u.size(); ++k) {
      u.data()[k] += noise();
    }
    if (solver.set_start(x, u)) {
      const OptimalControlSolution solution = solver.solve();
      solved += solution.status == SolveStatus::solved ? 1 : 0;
      most = std::max(most, solution.counts.iterations);
    }
  }
  std::printf("disturbed by %.1f, N = %d: %d of 96 solved, %d iterations at most\n", amplitude, N,
              solved, most);
}

}  // namespace

int main() {
  std::printf("| problem | N | ms | iterations | again, ms | cost |\n|---|---|---|---|---|---|\n");
  for (const int N : {100, 300, 1000, 3000}) {
    print("cart-pole", N, swing_up(N));
  }
  for (const int N : {100, 300, 1000, 3000}) {
    print("flywheel", N, flywheel(N));
  }
  print("double integrator", 700, double_integrator(700));
  int most = 0;
  int unsolved = 0;
  for (int N = 30; N <= 5000; N += N < 400 ? 10 : N == 400 ? 100 : 250) {
    OptimalControlProblem problem = cart_pole::problem(N);
    problem.set_start(cart_pole::start(N), Eigen::MatrixXd::Zero(1, N));
    const OptimalControlSolution solution = solve(problem).value();
    most = std::max(most, solution.counts.iterations);
    unsolved += solution.status == SolveStatus::solved ? 0 : 1;
  }
  std::printf("N = 30 to 400 and 500 to 5000: %d iterations at most, %d not solved\n", most,
              unsolved);
  for (const double amplitude : {0.1, 0.3}) {
    for (const int N : {100, 300, 1000}) {
      disturbed(N, amplitude);
    }
  }
  return 0;
}
