#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/invariant.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "field_drive.hpp"
#include "linear_filter.hpp"
#include "support/oracle.hpp"

// What filters say of their uncertainty is so: over 500 runs the mean of the normalised error
// squared (NEES) and of the normalised innovation squared (NIS) at ten times is within the bounds
// that hold jointly with 99 % (Bonferroni: each with 99.95 %). Source: Bar-Shalom, Li, Kirubarajan,
// "Estimation with Applications to Tracking and Navigation" (2001), section 5.4.
namespace flyball::consistency_test {
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
  const Eigen::MatrixXd S = test::cholesky_factor(P);
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
        consistency.add(k / 5, test::squared_distance(filter.P(), e), correction.nis);
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
          consistency.add(k / 20, test::squared_distance(P, e), of_beacon.nis);
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
/// A reading of range and bearing as a place in the robot's frame.
struct SeenAt {
  template <class Reading>
  auto operator()(const Reading& r) const {
    using Scalar = typename Reading::Scalar;
    using std::cos, std::sin;
    return Eigen::Matrix<Scalar, 2, 1>(r(0) * cos(r(1)), r(0) * sin(r(1)));
  }
};

// The drivetrain by the distances of its wheels, the beacons by their place on the field: an error
// in the fixed frame, x seen = beacon, with the reading's noise brought there.
TEST(FilterConsistency, OfTheInvariantFilter) {
  Random random(63);
  Consistency consistency;
  const Eigen::Matrix3d P0 = Eigen::Vector3d(0.1, 0.1, 0.05).cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d W = Eigen::Vector3d(4e-3, 2e-3, 6e-3).cwiseAbs2().asDiagonal();
  const MeasurementNoise<2> noise = test::sighting_noise();
  using State = RightInvariant<Pose2d>;
  for (int run = 0; run < runs; ++run) {
    const Pose2d start(random.normal(), random.normal(), random.uniform(-3.0, 3.0));
    auto filter = Estimate<State>::create({start}, Eigen::MatrixXd(P0)).value();
    Pose2d x = Pose2d::exp(drawn(random, P0)) * start;
    for (int k = 0; k < 20 * times; ++k) {
      const double left = 0.02 * (1.5 + 0.8 * std::sin(0.05 * k));
      const double right = 0.02 * (1.5 + 0.8 * std::cos(0.08 * k));
      const Eigen::Vector3d twist(0.5 * (left + right), 0.0,
                                  (right - left) / test::FieldDrive::trackwidth);
      x = x * Pose2d::exp(twist + drawn(random, W));
      predict_by_odometry(filter, twist, W);
      if (k % 10 == 9) {
        const Eigen::Vector2d beacon = test::beacons[static_cast<std::size_t>(k / 10) % 4];
        const Eigen::Vector2d seen = x.inverse() * beacon;
        const Eigen::Vector2d reading =
            Eigen::Vector2d(seen.norm(), std::atan2(seen(1), seen(0))) + drawn(random, noise.R());
        const Pose2d& at = filter.x_hat().value;
        const Eigen::Matrix2d slope = at.rotation().matrix() * jacobian(SeenAt{}, reading);
        const MeasurementNoise<2> there(Eigen::Matrix2d(slope * noise.R() * slope.transpose()));
        const auto place = [&](const auto& state) {
          using Scalar = typename std::decay_t<decltype(state)>::Scalar;
          return Eigen::Matrix<Scalar, 2, 1>(state.value *
                                             SeenAt{}(reading).template cast<Scalar>());
        };
        const auto correction = Extended{}.correct(filter, beacon, place, there);
        if (k % 20 == 19) {
          const Eigen::Vector3d e = minus(State{x}, filter.x_hat());
          consistency.add(k / 20, test::squared_distance(filter.P(), e), correction.nis);
        }
      }
    }
  }
  consistency.expect(3, 2);
}
TEST(FilterConsistency, OfTheSquareRootUnscentedFilter) {
  drive_is_consistent<SquareRootUnscentedKalmanFilter<test::FieldDrive, SimplexPoints>>();
}

}  // namespace
}  // namespace flyball::consistency_test
