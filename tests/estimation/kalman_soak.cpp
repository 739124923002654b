#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include <flyball/estimation/kalman_filter.hpp>

// kalman_soak STEPS [FROM TO]: so many steps of a Kalman filter for each of P0/R = 10^FROM … 10^TO
// (0 … 30) and Q from 0 to 1, on a plant of two states and on one of three with two sensors whose
// noises are correlated. After each step P must be symmetric and positive semidefinite, and no
// measurement may be refused. ctest runs a short one; docs/benchmarks.md says what the long one
// did.
namespace {

using namespace flyball;

std::uint64_t state = 1;

/// In -1 … 1; a multiplicative generator is enough, and cheaper than a filter's step.
double noise() {
  state = state * 6364136223846793005U + 1442695040888963407U;
  return static_cast<double>(static_cast<std::int64_t>(state)) * 0x1p-63;
}

/// Of each pair of states the determinant is not negative: for two states that is all there is.
template <int States>
bool is_covariance(const Eigen::Matrix<double, States, States>& P) {
  bool good = true;
  for (int i = 0; i < States; ++i) {
    good = good && P(i, i) >= 0.0 && P(i, i) <= 1e200;
    for (int j = 0; j < i; ++j) {
      good = good && P(i, j) == P(j, i) && P(i, j) * P(i, j) <= P(i, i) * P(j, j);
    }
  }
  return good;
}

template <int States, int Outputs>
bool soak(const DiscreteSystem<States, 1, Outputs>& plant,
          const Eigen::Matrix<double, Outputs, Outputs>& R, double ratio, double Q, long steps) {
  using StateMatrix = Eigen::Matrix<double, States, States>;
  auto filter = kalman_filter(plant, StateMatrix(StateMatrix::Identity() * Q), R,
                              StateMatrix(StateMatrix::Identity() * ratio * R(0, 0)))
                    .value();
  long refused = 0;
  long wrong = 0;
  for (long k = 0; k < steps; ++k) {
    const Eigen::Matrix<double, 1, 1> u(noise());
    filter.predict(u);
    wrong += is_covariance<States>(filter.P()) ? 0 : 1;
    Eigen::Matrix<double, Outputs, 1> y;
    for (int i = 0; i < Outputs; ++i) {
      y(i) = 0.5 + noise();
    }
    refused += filter.update(y, u) == UpdateStatus::updated ? 0 : 1;
    wrong += is_covariance<States>(filter.P()) ? 0 : 1;
  }
  const bool finite = filter.x_hat().allFinite();
  if (refused + wrong > 0 || !finite) {
    std::printf("%d states, P0/R = %g, Q = %g: of %ld steps %ld refused, %ld not a covariance\n",
                States, ratio, Q, steps, refused, wrong);
  }
  return refused + wrong == 0 && finite;
}

}  // namespace

int main(int count, char** arguments) {
  const long steps = count > 1 ? std::strtol(arguments[1], nullptr, 10) : 1000;
  const int from = count > 2 ? std::atoi(arguments[2]) : 0;
  const int to = count > 3 ? std::atoi(arguments[3]) : 30;
  DiscreteSystem<2, 1, 1> cart;
  cart.A << 1.0, 0.02, 0.0, 0.95;
  cart.B << 0.001, 0.02;
  cart.C << 1.0, 0.0;
  cart.D << 0.0;
  cart.period = Time(0.02);
  DiscreteSystem<3, 1, 2> chain;
  chain.A << 1.0, 0.02, 2e-4, 0.0, 1.0, 0.02, 0.0, 0.0, 0.9;
  chain.B << 0.0, 0.001, 0.02;
  chain.C << 1.0, 0.0, 0.0, 0.3, 1.0, 0.0;
  chain.D.setZero();
  chain.period = Time(0.02);
  Eigen::Matrix2d correlated;
  correlated << 1.0, 0.6, 0.6, 0.5;
  bool good = true;
  for (int exponent = from; exponent <= to; ++exponent) {
    const double ratio = std::pow(10.0, exponent);
    for (const double Q : {0.0, 1e-30, 1e-16, 1e-12, 1e-8, 1e-4, 1.0}) {
      good = soak<2, 1>(cart, Eigen::Matrix<double, 1, 1>(1.0), ratio, Q, steps) && good;
      good = soak<2, 1>(cart, Eigen::Matrix<double, 1, 1>(1e-10), ratio, Q, steps) && good;
      good = soak<3, 2>(chain, correlated, ratio, Q, steps) && good;
    }
    std::printf("P0/R = %g: %s\n", ratio, good ? "good" : "BAD");
    std::fflush(stdout);
  }
  return good ? 0 : 1;
}
