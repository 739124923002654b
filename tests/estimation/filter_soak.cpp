#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include <flyball/estimation/forms/information_form.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>

#include "field_drive.hpp"

// filter_soak STEPS [FROM TO]: so many steps of each form of covariance for each of P0/R = 10^FROM
// … 10^TO (0 … 30) and Q from 0 to 1, on a chain of three states with two sensors of correlated
// noise of which one hardly shows the third state; and of the extended and unscented filters of a
// drivetrain. There are gaps without measurements and bursts of NaN. After each step P must be
// symmetric, its exact (long double) pivots must not be negative, and the estimate must be finite.
// ctest runs a short one; docs/benchmarks.md says what the long one did.
namespace {

using namespace flyball;

std::uint64_t state = 1;

double noise() {
  state = state * 6364136223846793005U + 1442695040888963407U;
  return static_cast<double>(static_cast<std::int64_t>(state)) * 0x1p-63;
}

/// The pivots of the rounded matrix, in long double, whose own rounding is 1e-19 of P's entries.
template <int N>
bool is_covariance(const Eigen::Matrix<double, N, N>& P) {
  Eigen::Matrix<long double, N, N> M = P.template cast<long double>();
  for (int j = 0; j < N; ++j) {
    const long double rounding = 1e-18L * static_cast<long double>(P(j, j));
    if (!(P(j, j) >= 0.0 && P(j, j) <= 1e200) || !(M(j, j) >= -rounding)) {
      return false;
    }
    for (int i = j + 1; i < N; ++i) {
      if (P(i, j) != P(j, i)) {
        return false;
      }
      for (int k = j + 1; k <= i && M(j, j) > rounding; ++k) {
        M(i, k) -= M(i, j) * M(k, j) / M(j, j);
      }
    }
  }
  return true;
}

bool told(const char* name, double ratio, double Q, long steps, long refused, long wrong) {
  if (refused + wrong > 0) {
    std::printf("%s, P0/R = %g, Q = %g: of %ld steps %ld refused, %ld not a covariance\n", name,
                ratio, Q, steps, refused, wrong);
  }
  return refused + wrong == 0;
}

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class Form>
bool soak_form(const char* name, double ratio, double Q, long steps) {
  Eigen::Matrix3d A;
  A << 1.0, 0.02, 2e-4, 0.0, 1.0, 0.02, 0.0, 0.0, 0.9;
  const Eigen::Vector3d B(0.0, 0.001, 0.02);
  Eigen::Matrix<double, 2, 3> C;
  C << 1.0, 0.0, 0.0, 0.3, 1.0, 1e-9;
  Eigen::Matrix2d R;
  R << 1.0, 0.6, 0.6, 0.5;
  R *= 1e-8;
  const MeasurementNoise<2> noises(R);
  Form form;
  form.set(Eigen::Matrix3d(ratio * 1e-8 * Eigen::Matrix3d::Identity()));
  Estimate<Eigen::Vector3d, Form> estimate(Eigen::Vector3d::Zero(), form);
  const typename Form::Noise of_states(Eigen::Matrix3d(Q * 1e-8 * Eigen::Matrix3d::Identity()));
  long refused = 0;
  long wrong = 0;
  const auto check = [&] {
    wrong += is_covariance<3>(estimate.P()) && estimate.x_hat().allFinite() ? 0 : 1;
  };
  for (long k = 0; k < steps; ++k) {
    refused += predict(estimate, A, B, Eigen::Matrix<double, 1, 1>(noise()), of_states) ? 0 : 1;
    check();
    if (k % 1000 >= 900) {
      continue;  // A gap.
    }
    const bool burst = k % 37 < 3;
    const Eigen::Vector2d y(0.5 + noise(), burst ? nan : noise());
    const auto correction = correct(estimate, y, C, noises, {.missing_entries = k % 2 == 0});
    const bool wanted = !burst || k % 2 == 0;
    refused += correction.accepted() == wanted ? 0 : 1;
    check();
  }
  return told(name, ratio, Q, steps, refused, wrong);
}

template <class Filter>
bool soak_drive(const char* name, double spread, double R, long steps) {
  using Vector5 = Eigen::Vector<double, 5>;
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  auto filter =
      Filter::create(test::FieldDrive{}, Eigen::MatrixXd(1e-8 * Matrix5::Identity()),
                     Eigen::MatrixXd(R * Eigen::Matrix3d::Identity()),
                     {Vector5::Zero(), Eigen::MatrixXd(spread * Matrix5::Identity())}, Time(0.02))
          .value();
  const auto noises = MeasurementNoise<2>::independent(Eigen::Vector2d(R, R));
  long wrong = 0;
  for (long k = 0; k < steps; ++k) {
    const Eigen::Vector2d u(12.0 * noise(), 12.0 * noise());
    filter.predict(u);
    wrong += is_covariance<5>(filter.P()) && filter.x_hat().allFinite() ? 0 : 1;
    if (k % 1000 < 900) {
      filter.correct(Eigen::Vector3d(noise(), noise(), k % 41 < 3 ? nan : noise()), u);
      wrong += is_covariance<5>(filter.P()) && filter.x_hat().allFinite() ? 0 : 1;
      filter.correct(Eigen::Vector2d(10.0 + noise(), 3.1 * noise()),
                     test::Sighting{test::beacons[static_cast<std::size_t>(k) % 4]}, noises, {},
                     AngleDifference<1>{});
      wrong += is_covariance<5>(filter.P()) && filter.x_hat().allFinite() ? 0 : 1;
    }
  }
  return told(name, spread / R, 1e-8, steps, 0, wrong);
}

}  // namespace

int main(int count, char** arguments) {
  const long steps = count > 1 ? std::strtol(arguments[1], nullptr, 10) : 1000;
  const int from = count > 2 ? std::atoi(arguments[2]) : 0;
  const int to = count > 3 ? std::atoi(arguments[3]) : 30;
  bool good = true;
  for (int exponent = from; exponent <= to; ++exponent) {
    const double ratio = std::pow(10.0, exponent);
    for (const double Q : {0.0, 1e-30, 1e-16, 1e-12, 1e-8, 1e-4, 1.0}) {
      good = soak_form<JosephCovariance<3>>("JosephCovariance", ratio, Q, steps) && good;
      good = soak_form<UdCovariance<3>>("UdCovariance", ratio, Q, steps) && good;
      good = soak_form<SquareRootCovariance<3>>("SquareRootCovariance", ratio, Q, steps) && good;
      good = soak_form<InformationForm<3>>("InformationForm", ratio, Q, steps) && good;
    }
    std::printf("P0/R = %g: %s\n", ratio, good ? "good" : "BAD");
    std::fflush(stdout);
  }
  using test::FieldDrive;
  for (const double spread : {1e-4, 1.0, 1e8}) {
    for (const double R : {1e-16, 1e-6, 1.0}) {
      good =
          soak_drive<ExtendedKalmanFilter<FieldDrive>>("ExtendedKalmanFilter", spread, R, steps) &&
          good;
      good = soak_drive<SquareRootUnscentedKalmanFilter<FieldDrive>>(
                 "SquareRootUnscentedKalmanFilter", spread, R, steps) &&
             good;
      good = soak_drive<UnscentedKalmanFilter<FieldDrive, SimplexPoints>>("UnscentedKalmanFilter",
                                                                          spread, R, steps) &&
             good;
    }
  }
  std::printf("drivetrain: %s\n", good ? "good" : "BAD");
  return good ? 0 : 1;
}
