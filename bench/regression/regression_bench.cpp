// Least squares of rows that are not kept, and on the robot: time a row and the memory of the whole
// process, beside Eigen's QR of all rows at once. `bench_regression [rows]`, 10⁷ if left out.

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <Eigen/QR>
#include <sys/resource.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/gain_estimator.hpp>
#include <flyball/math/regression/recursive_least_squares.hpp>
#include <flyball/math/regression/streamed_least_squares.hpp>

#include "timing.hpp"

namespace {

double megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// Of 100 times a thousand calls, the shortest time of a call.
template <class Work>
double least(Work&& work) {
  double best = 1e18;
  for (int k = 0; k < 100; ++k) {
    best = std::min(best, bench::microseconds(1000, work));
  }
  return best;
}

}  // namespace

int main(int argc, char** argv) {
  using bench::microseconds;
  const long rows = argc > 1 ? std::atol(argv[1]) : 10'000'000;
  constexpr int p = 5;
  flyball::Random random(1);
  auto stream = flyball::StreamedLeastSquares::create(p).value();
  double x[p] = {1.0};
  const double before = megabytes();
  const auto row = [&](long k) {
    for (int j = 1; j < p; ++j) {
      x[j] = random.uniform(-1.0, 1.0);
    }
    return 1.0 + x[1] - x[2] + 0.5 * x[4] + 1e-3 * static_cast<double>(k % 7 - 3);
  };
  const double making = microseconds(1, [&] {
    double sum = 0.0;
    for (long k = 0; k < rows; ++k) {
      sum += row(k);
    }
    std::printf("%s", sum == 0.0 ? " " : "");
  });
  const double total = microseconds(1, [&] {
    for (long k = 0; k < rows; ++k) {
      const double y = row(k);
      stream.add(x, y);
    }
  });
  const auto fit = stream.solve().value();
  std::printf(
      "streamed: %ld rows of %d, %.2f s (%.0f ns a row, %.0f of them to make it), "
      "memory %.1f MB, %.1f before; coefficient 4: %.9f\n",
      rows, p, 1e-6 * total, 1e3 * total / static_cast<double>(rows),
      1e3 * making / static_cast<double>(rows), megabytes(), before, fit.coefficients(4));

  const long some = std::min(rows, 1'000'000L);
  Eigen::MatrixXd X(some, p);
  Eigen::VectorXd y(some);
  for (long k = 0; k < some; ++k) {
    y(k) = row(k);
    X.row(k) = Eigen::Map<const Eigen::RowVectorXd>(x, p);
  }
  double whole = 1e18;
  double streamed = 1e18;
  for (int k = 0; k < 5; ++k) {
    whole = std::min(whole, microseconds(1, [&] {
                       const Eigen::VectorXd beta = X.colPivHouseholderQr().solve(y);
                       std::printf("%s", beta(0) == 0.0 ? " " : "");
                     }));
    streamed = std::min(streamed, microseconds(1, [&] {
                          auto again = flyball::StreamedLeastSquares::create(p).value();
                          if (!again.add(X, y)) {
                            std::abort();
                          }
                        }));
  }
  std::printf(
      "%ld rows at hand: Eigen's ColPivHouseholderQR %.1f ms, streamed %.1f ms, ratio %.2f\n", some,
      1e-3 * whole, 1e-3 * streamed, whole / streamed);

  using Estimator = flyball::RecursiveLeastSquares<4>;
  for (const double forgetting : {1.0, 0.99}) {
    auto estimator =
        Estimator::create(Estimator::Vector::Zero(), Estimator::Vector::Ones(), forgetting).value();
    const double time = least([&] {
      Estimator::Vector regressor(1.0, random.uniform(), random.uniform(), random.uniform());
      estimator.update(regressor, regressor.sum());
    });
    std::printf("recursive, 4 coefficients, forgetting %.2f: %.0f ns\n", forgetting, 1e3 * time);
  }
  flyball::identification::GainEstimatorSettings settings;
  settings.mechanism = flyball::mechanisms::MechanismKind::arm;
  settings.top_speed = 8.0;
  settings.memory = 10.0;
  auto gains = flyball::identification::GainEstimator::create(settings).value();
  double angle = 0.0;
  const double time = least([&] {
    const double velocity = random.uniform(1.0, 8.0);
    angle += 0.02 * velocity;
    gains.update(random.uniform(-12.0, 12.0), velocity, angle);
  });
  std::printf("GainEstimator, an arm: %.0f ns a sample, %zu bytes\n", 1e3 * time, sizeof(gains));
}
