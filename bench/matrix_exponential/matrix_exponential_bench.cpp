// How long expm() takes beside Eigen's unsupported MatrixFunctions on the same matrices in the same
// process: `bench_matrix_exponential [repetitions]`. Minima per matrix, over repetitions that
// alternate between the two; `least` is the smallest ratio of one matrix.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include <flyball/core/random.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>

#include "timing.hpp"

namespace {

using bench::microseconds;
using Eigen::MatrixXd;

void compare(int n, double norm, int repetitions) {
  flyball::Random random(static_cast<std::uint64_t>(n));
  double time_ours = 0.0;
  double time_eigen = 0.0;
  double least = 1e300;
  double difference = 0.0;
  double sink = 0.0;
  const int count = 8;
  const int calls = std::max(1, 4000 / (n * n * n + 50));
  for (int k = 0; k < count; ++k) {
    MatrixXd A = MatrixXd::NullaryExpr(n, n, [&random] { return random.normal(); });
    A *= norm / A.cwiseAbs().colwise().sum().maxCoeff();
    const MatrixXd peer = A.exp();
    difference = std::max(difference, (flyball::expm(A).value() - peer).norm() / peer.norm());
    double ours = 1e300;
    double eigen = 1e300;
    for (int r = 0; r < repetitions; ++r) {
      ours = std::min(ours, microseconds(calls, [&] { sink += (*flyball::expm(A))(0, 0); }));
      eigen = std::min(eigen, microseconds(calls, [&] { sink += MatrixXd(A.exp())(0, 0); }));
    }
    time_ours += ours;
    time_eigen += eigen;
    least = std::min(least, eigen / ours);
  }
  std::printf("%5d %8g %12.2f %12.2f %9.2f %9.2f %14.1e%s\n", n, norm, time_ours / count,
              time_eigen / count, time_eigen / time_ours, least, difference,
              sink == 0.5 ? " " : "");
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 100;
  std::printf("expm, minima in microseconds\n%5s %8s %12s %12s %9s %9s %14s\n", "n", "norm",
              "flyball", "Eigen", "ratio", "least", "difference");
  for (const int n : {1, 2, 3, 4, 6, 10, 20, 50}) {
    for (const double norm : {0.01, 0.5, 5.0, 100.0}) {
      compare(n, norm, repetitions);
    }
  }
  return 0;
}
