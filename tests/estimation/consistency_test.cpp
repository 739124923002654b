#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "field_drive.hpp"
#include "filter_cases.hpp"

// What filters say of their uncertainty is so: over 500 runs the mean of the normalised error
// squared (NEES) and of the normalised innovation squared (NIS) at ten times is within the bounds
// that hold jointly with 99 % (Bonferroni: each with 99.95 %). Source: Bar-Shalom, Li, Kirubarajan,
// "Estimation with Applications to Tracking and Navigation" (2001), section 5.4.
namespace flyball {
namespace {

constexpr int runs = 500;
constexpr int times = 10;

class Consistency {
 public:
  void add(int time, double nees, double nis) {
    nees_[static_cast<std::size_t>(time)] += nees;
    nis_[static_cast<std::size_t>(time)] += nis;
  }
  void expect(int states, int outputs) const {
    for (std::size_t k = 0; k < times; ++k) {
      expect_sum(nees_[k], runs * states, "NEES", k);
      expect_sum(nis_[k], runs * outputs, "NIS", k);
    }
  }

 private:
  static void expect_sum(double sum, double freedom, const char* what, std::size_t time) {
    const double tail = chi_squared_tail(sum, freedom);
    constexpr double each = 0.01 / (2.0 * times);
    EXPECT_GT(tail, 0.5 * each) << what << " at " << time << ": " << sum / freedom << " too large";
    EXPECT_LT(tail, 1.0 - 0.5 * each)
        << what << " at " << time << ": " << sum / freedom << " too small";
  }
  std::array<double, times> nees_{};
  std::array<double, times> nis_{};
};

template <class Matrix>
Eigen::VectorXd drawn(Random& random, const Matrix& P) {
  const Eigen::MatrixXd S = Eigen::MatrixXd(P).llt().matrixL();
  return S * test::normal(random, P.rows(), 1);
}

TEST(FilterConsistency, OfALinearFilter) {
  Random random(61);
  Consistency consistency;
  for (int run = 0; run < runs; ++run) {
    test::LinearCase c = test::linear_case(random);
    c.Q += 0.05 * Eigen::Matrix3d::Identity();
    const Eigen::Vector3d start = c.x0;
    Eigen::Vector3d x = start + drawn(random, c.P0);
    test::LinearFilter<JosephCovariance> filter(c);
    for (int k = 0; k < 5 * times; ++k) {
      const test::U u(random.normal());
      x = (c.plant.A * x + c.plant.B * u + drawn(random, c.Q)).eval();
      filter.predict(u);
      const Eigen::Vector2d y = c.plant.C * x + c.plant.D * u + drawn(random, c.R);
      const auto correction = filter.correct(y, u);
      if (k % 5 == 4) {
        const Eigen::Vector3d e = x - filter.x_hat();
        consistency.add(k / 5, e.dot(filter.P().llt().solve(e)), correction.nis);
      }
    }
  }
  consistency.expect(3, 2);
}

/// 4 s of driving; each 0.2 s a beacon is seen.
template <class Filter>
void drive_is_consistent() {
  Random random(62);
  Consistency consistency;
  const test::FieldDrive model;
  Eigen::Vector<double, 5> sigma_q;
  sigma_q << 2e-3, 2e-3, 2e-3, 0.03, 0.03;
  const Eigen::MatrixXd Q = sigma_q.cwiseAbs2().asDiagonal();
  Eigen::Vector<double, 5> sigma_0;
  sigma_0 << 0.1, 0.1, 0.05, 0.1, 0.1;
  const Eigen::MatrixXd P0 = sigma_0.cwiseAbs2().asDiagonal();
  const Eigen::MatrixXd R = standard_deviations({0.01, 0.02, 0.02}).value();
  const MeasurementNoise<2> seen = test::sighting_noise();
  for (int run = 0; run < runs; ++run) {
    Eigen::Vector<double, 5> x;
    x << random.normal(), random.normal(), random.uniform(-3.0, 3.0), 0.0, 0.0;
    auto filter = Filter::create(model, Q, R, {x + drawn(random, P0), P0}, Time(0.02)).value();
    for (int k = 0; k < 20 * times; ++k) {
      const Eigen::Vector2d u(4.0 + 2.0 * std::sin(0.05 * k), 4.0 + 2.0 * std::cos(0.08 * k));
      x = FilterModel<test::FieldDrive>::next(model, x, u, 0.02) + drawn(random, Q);
      filter.predict(u);
      const Eigen::Vector3d y = model.output(x, u) + drawn(random, R);
      filter.correct(y, u);
      if (k % 10 == 9) {
        const test::Sighting sighting{test::beacons[static_cast<std::size_t>(k / 10) % 4]};
        const Eigen::Vector2d z = sighting(x) + drawn(random, seen.R());
        const auto of_beacon = filter.correct(z, sighting, seen, {}, AngleDifference<1>{});
        if (k % 20 == 19) {
          const Eigen::Vector<double, 5> e = x - filter.x_hat();
          const Eigen::Matrix<double, 5, 5> P = filter.P();
          consistency.add(k / 20, e.dot(P.llt().solve(e)), of_beacon.nis);
        }
      }
    }
  }
  consistency.expect(5, 2);
}

TEST(FilterConsistency, OfTheExtendedFilter) {
  drive_is_consistent<ExtendedKalmanFilter<test::FieldDrive>>();
}
TEST(FilterConsistency, OfTheUnscentedFilter) {
  drive_is_consistent<UnscentedKalmanFilter<test::FieldDrive>>();
}
TEST(FilterConsistency, OfTheSquareRootUnscentedFilter) {
  drive_is_consistent<SquareRootUnscentedKalmanFilter<test::FieldDrive, SimplexPoints>>();
}

}  // namespace
}  // namespace flyball
