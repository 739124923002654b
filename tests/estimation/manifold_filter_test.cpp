#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/invariant.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/geometry/bundle.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/geometry/so3.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

// Filters whose state is a rotation or a pose.
namespace flyball::manifold_filter_test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Pose = SE2<double>;

Matrix3d spread(double x, double y, double theta) {
  return Vector3d(x * x, y * y, theta * theta).asDiagonal();
}

template <class X, class Form = JosephCovariance<3>>
auto pose_filter(const Pose& start, const Matrix3d& P) {
  if constexpr (std::is_same_v<X, Pose>) {
    return Estimate<X, Form>::create(start, MatrixXd(P)).value();
  } else {
    return Estimate<X, Form>::create(X{start}, MatrixXd(P)).value();
  }
}

const Pose& value(const Pose& x) {
  return x;
}
const Pose& value(const RightInvariant<Pose>& x) {
  return x.value;
}

/// What odometry does, over a generic scalar: the filters' own Jacobians against the closed ones.
struct Move {
  Vector3d twist;
  template <class X>
  X operator()(const X& x) const {
    using T = typename X::Scalar;
    using Group = SE2<T>;
    const Group step = Group::exp(twist.template cast<T>());
    if constexpr (requires { x.value; }) {
      return X{x.value * step};
    } else {
      return x * step;
    }
  }
};

// F = Ad(Exp(-τ)) in the body's frame and I in the fixed one; the closed forms, the duals and (to
// their order) the points agree.
TEST(ManifoldFilter, OdometryMovesBothKindsOfError) {
  const Pose start(1.0, -2.0, 2.8);
  const Vector3d twist(0.3, 0.05, 0.6);
  const Matrix3d W = spread(0.01, 0.005, 0.02);
  const Matrix3d P = spread(0.02, 0.03, 0.01);
  const auto check = [&]<class X>(X) {
    auto closed = pose_filter<X>(start, P);
    auto dual = closed;
    auto points = closed;
    EXPECT_TRUE(predict_by_odometry(closed, twist, W));
    const PlainNoise<3> none{Matrix3d(Matrix3d::Zero())};
    Matrix3d F;
    EXPECT_TRUE(Extended{}.predict(dual, Move{twist}, none, &F));
    EXPECT_LT((value(closed.x_hat()).matrix() - (start * Pose::exp(twist)).matrix()).norm(), 1e-14);
    EXPECT_LT((value(dual.x_hat()).matrix() - value(closed.x_hat()).matrix()).norm(), 1e-14);
    const Matrix3d exact =
        std::is_same_v<X, Pose> ? Pose::exp(-twist).adjoint() : Matrix3d(Matrix3d::Identity());
    EXPECT_LT((F - exact).norm(), 1e-13);
    Matrix3d by_points;
    Unscented<> unscented;
    EXPECT_TRUE(unscented.predict(points, Move{twist}, none, &by_points));
    EXPECT_LT((value(points.x_hat()).matrix() - value(closed.x_hat()).matrix()).norm(), 1e-4);
    EXPECT_LT((by_points - exact).norm(), 1e-3);
    EXPECT_LT((points.P() - dual.P()).norm(), 1e-5);
    // The twist's noise, by differences of the end's pose.
    Matrix3d G;
    const X from = pose_filter<X>(start, P).x_hat();
    for (int j = 0; j < 3; ++j) {
      const Vector3d h = 1e-6 * Vector3d::Unit(j);
      G.col(j) = minus(Move{twist + h}(from), Move{twist - h}(from)) / 2e-6;
    }
    EXPECT_LT((closed.P() - (exact * P * exact.transpose() + G * W * G.transpose())).norm(), 1e-9);
  };
  check(Pose());
  check(RightInvariant<Pose>{});
}

const std::array<Vector2d, 3> marks{Vector2d(4.0, 3.0), Vector2d(-3.0, 4.0), Vector2d(-1.0, -5.0)};

/// A mark in the robot's frame.
struct Seen {
  Vector2d mark;
  template <class X>
  auto operator()(const X& x) const {
    using T = typename X::Scalar;
    const Eigen::Matrix<T, 2, 1> there = mark.template cast<T>();
    if constexpr (requires { x.value; }) {
      return Eigen::Matrix<T, 2, 1>(x.value.inverse() * there);
    } else {
      return Eigen::Matrix<T, 2, 1>(x.inverse() * there);
    }
  }
};

/// NEES and NIS at five times over 500 runs of five seconds, within jointly 99 % bounds (each of
/// the ten two-sided with 0.1 %).
template <class X, class Form, class Method>
void expect_consistent() {
  constexpr int runs = 500;
  Random random(101);
  const Matrix3d P0 = spread(0.2, 0.2, 0.1);
  const Matrix3d W = spread(0.01, 0.004, 0.01);
  const MeasurementNoise<2> R = MeasurementNoise<2>::independent(Vector2d(0.01, 0.01));
  std::array<double, 5> nees{};
  std::array<double, 5> nis{};
  for (int run = 0; run < runs; ++run) {
    const auto draw = [&](const Matrix3d& S) {
      return Vector3d(S.diagonal().cwiseSqrt().cwiseProduct(
          Vector3d(random.normal(), random.normal(), random.normal())));
    };
    const Pose start(random.normal(), random.normal(), random.uniform(-3.1, 3.1));
    auto filter = pose_filter<X, Form>(start, P0);
    Method method{};
    Pose x = value(plus(filter.x_hat(), Vector3d(draw(P0))));
    for (int k = 0; k < 50; ++k) {
      const Vector3d twist(0.1, 0.0, 0.08 * std::sin(0.2 * k));
      x = x * Pose::exp(twist + draw(W));
      predict_by_odometry(filter, twist, W);
      const Seen seen{marks[static_cast<std::size_t>(k) % 3]};
      const Vector2d y = seen(x) + 0.1 * Vector2d(random.normal(), random.normal());
      const auto correction = method.correct(filter, y, seen, R);
      ASSERT_TRUE(correction.accepted());
      if (k % 10 == 9) {
        X truth = filter.x_hat();
        if constexpr (std::is_same_v<X, Pose>) {
          truth = x;
        } else {
          truth.value = x;
        }
        const Vector3d e = minus(truth, filter.x_hat());
        const Matrix3d P = filter.P();
        nees[static_cast<std::size_t>(k / 10)] += test::squared_distance(P, e);
        nis[static_cast<std::size_t>(k / 10)] += correction.nis;
      }
    }
  }
  constexpr double each = 0.01 / 10.0;
  for (std::size_t k = 0; k < 5; ++k) {
    for (const auto& [sum, freedom] : {std::pair{nees[k], 3.0}, std::pair{nis[k], 2.0}}) {
      const double tail = chi_squared_tail(sum, runs * freedom);
      EXPECT_GT(tail, 0.5 * each) << k << ": " << sum / (runs * freedom);
      EXPECT_LT(tail, 1.0 - 0.5 * each) << k << ": " << sum / (runs * freedom);
    }
  }
}

TEST(ManifoldFilter, LeftInvariantIsConsistent) {
  expect_consistent<Pose, JosephCovariance<3>, Extended>();
}
TEST(ManifoldFilter, RightInvariantIsConsistent) {
  expect_consistent<RightInvariant<Pose>, JosephCovariance<3>, Extended>();
}
TEST(ManifoldFilter, UnscentedIsConsistent) {
  expect_consistent<Pose, SquareRootCovariance<3>, Unscented<>>();
}

// A mark seen in the robot's frame says of the right invariant error what does not depend on the
// estimate: R (H ξ) = -[I, J p] ξ with the mark p, whatever the pose.
TEST(ManifoldFilter, RightInvariantSlopeDoesNotKnowTheEstimate) {
  const Vector2d p = marks[0];
  Eigen::Matrix<double, 2, 3> expected;
  expected << -1.0, 0.0, p(1), 0.0, -1.0, -p(0);
  Random random(102);
  for (int run = 0; run < 20; ++run) {
    const Pose pose(random.normal(), random.normal(), random.uniform(-3.0, 3.0));
    const RightInvariant<Pose> x{pose};
    Eigen::Matrix<double, 2, 3> H;
    for (int j = 0; j < 3; ++j) {
      const Vector3d h = 1e-6 * Vector3d::Unit(j);
      H.col(j) = (Seen{p}(x.plus(h)) - Seen{p}(x.plus(-h))) / 2e-6;
    }
    EXPECT_LT((pose.rotation().matrix() * H - expected).norm(), 1e-8);
  }
}

// With P transported to the corrected pose, Exp(ξ) x and x Exp(δ) are one filter, ξ = Ad(x) δ.
TEST(ManifoldFilter, BothFramesOfTheErrorAreOneFilter) {
  Random random(105);
  const Pose start(1.0, -0.5, 2.0);
  const Matrix3d P0 = spread(0.3, 0.2, 0.3);
  auto body = pose_filter<Pose>(start, P0);
  auto fixed =
      pose_filter<RightInvariant<Pose>>(start, start.adjoint() * P0 * start.adjoint().transpose());
  const MeasurementNoise<2> R = MeasurementNoise<2>::independent(Vector2d(0.02, 0.05));
  for (int k = 0; k < 30; ++k) {
    const Vector3d twist(0.2, 0.02, 0.3);
    predict_by_odometry(body, twist, spread(0.02, 0.01, 0.03));
    predict_by_odometry(fixed, twist, spread(0.02, 0.01, 0.03));
    const Seen seen{marks[static_cast<std::size_t>(k) % 3]};
    const Vector2d y = seen(body.x_hat()) + 0.2 * Vector2d(random.normal(), random.normal());
    ASSERT_TRUE(Extended{}.correct(body, y, seen, R).accepted());
    ASSERT_TRUE(Extended{}.correct(fixed, y, seen, R).accepted());
    ASSERT_LT(minus(body.x_hat(), value(fixed.x_hat())).norm(), 1e-12);
    const Matrix3d Ad = body.x_hat().adjoint();
    ASSERT_LT((Ad * body.P() * Ad.transpose() - fixed.P()).norm(), 1e-12);
  }
}

/// Heading error after `steps` sightings from a start that is off by 2 m and 90°.
template <class X>
double error_from_far_off(Random& random) {
  const Pose truth(random.normal(), random.normal(), random.uniform(-3.1, 3.1));
  const double away = random.uniform(-3.1, 3.1);
  const Pose start(truth.x() + 2.0 * std::cos(away), truth.y() + 2.0 * std::sin(away),
                   truth.angle() + (random.uniform() < 0.5 ? 1.57 : -1.57));
  auto filter = pose_filter<X>(start, spread(2.0, 2.0, 1.5));
  Pose x = truth;
  const MeasurementNoise<2> R = MeasurementNoise<2>::independent(Vector2d(0.01, 0.01));
  for (int k = 0; k < 60; ++k) {
    const Vector3d twist(0.1, 0.0, 0.05);
    x = x * Pose::exp(twist);
    predict_by_odometry(filter, twist, spread(0.01, 0.01, 0.01));
    const Seen seen{marks[static_cast<std::size_t>(k) % 3]};
    const Vector2d y = seen(x) + 0.1 * Vector2d(random.normal(), random.normal());
    Extended{}.correct(filter, y, seen, R, {.iterations = 5});
  }
  return minus(x, value(filter.x_hat())).norm();
}

// 2 m and 90° off: at least 99 % of the runs end within 0.3 of the truth.
TEST(ManifoldFilter, RecoversFromAWrongStart) {
  Random random(103);
  int left = 0;
  int right = 0;
  for (int run = 0; run < 500; ++run) {
    left += error_from_far_off<Pose>(random) < 0.3 ? 1 : 0;
    right += error_from_far_off<RightInvariant<Pose>>(random) < 0.3 ? 1 : 0;
  }
  EXPECT_GE(left, 495);
  EXPECT_GE(right, 495);
}

// The robot is picked up and turned: the gate refuses what it sees, until it is the estimate that
// is doubted. Within two seconds of sightings nine of ten are found by that alone; the rest settle
// at a wrong heading, from which it takes a search (`relocalizer.hpp`).
TEST(ManifoldFilter, ATeleportedRobotIsFoundAgain) {
  Random random(104);
  int found = 0;
  for (int run = 0; run < 200; ++run) {
    auto guard = OutlierGuard::create({.recover_after = 5}).value();
    const Pose start(random.normal(), random.normal(), random.uniform(-3.1, 3.1));
    auto filter = pose_filter<Pose>(start, spread(0.01, 0.01, 0.01));
    const Pose x(random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0),
                 start.angle() + random.uniform(-1.5, 1.5));
    const MeasurementNoise<2> R = MeasurementNoise<2>::independent(Vector2d(0.01, 0.01));
    // Two seconds of sightings at 20 Hz.
    for (int k = 0; k < 40; ++k) {
      predict_by_odometry(filter, Vector3d(0.0, 0.0, 0.0), spread(0.01, 0.01, 0.01));
      const Seen seen{marks[static_cast<std::size_t>(k) % 3]};
      const Vector2d y = seen(x) + 0.1 * Vector2d(random.normal(), random.normal());
      Extended{}.correct(filter, y, seen, R, {.guard = &guard, .iterations = 5});
    }
    found += minus(x, filter.x_hat()).norm() < 0.3 ? 1 : 0;
  }
  EXPECT_GE(found, 180);
}

// A whole pose is measured, as by a camera: y ⊖ x is the innovation.
TEST(ManifoldFilter, MeasuresPoses) {
  const Pose x(1.0, 2.0, 3.1);
  const Pose y(1.1, 2.1, -3.1);
  auto filter = pose_filter<Pose>(x, spread(0.1, 0.1, 0.1));
  auto points = filter;
  const MeasurementNoise<3> R(Matrix3d(spread(0.1, 0.1, 0.1)));
  const auto identity = [](const auto& pose) { return pose; };
  const auto correction = Extended{}.correct(filter, y, identity, R);
  EXPECT_LT((correction.innovation - y.minus(x)).norm(), 1e-14);
  // Half of the way, since both are as good, to the order of the Jacobian of the difference; the
  // points, which see how it bends, are nearer.
  EXPECT_LT(minus(filter.x_hat(), x.interpolate(y, 0.5)).norm(), 2e-3);
  Unscented<> unscented;
  EXPECT_TRUE(unscented.correct(points, y, identity, R).accepted());
  EXPECT_LT(minus(points.x_hat(), x.interpolate(y, 0.5)).norm(), 1e-4);
}

// A pose with the bias of its gyro, and a rotation of space: other states need no other filter.
TEST(ManifoldFilter, TakesBundlesAndRotations) {
  using Vector1 = Eigen::Matrix<double, 1, 1>;
  using State = Bundle<Pose, Vector1>;
  auto filter = Estimate<State>::create(State(Pose(), Vector1(0.0)),
                                        MatrixXd(0.1 * Eigen::Matrix4d::Identity()))
                    .value();
  const PlainNoise<4> Q(Eigen::Matrix4d(1e-6 * Eigen::Matrix4d::Identity()));
  const MeasurementNoise<3> R(Matrix3d(spread(0.01, 0.01, 0.01)));
  const double bias = 0.2;
  Pose truth;
  for (int k = 0; k < 100; ++k) {
    truth = truth * Pose::exp(Vector3d(0.05, 0.0, 0.01));
    const double gyro = 0.01 + 0.02 * bias;
    const auto step = [&](const auto& x) {
      using T = typename std::decay_t<decltype(x)>::Scalar;
      const auto& pose = x.template get<0>();
      const auto& b = x.template get<1>();
      const Eigen::Matrix<T, 3, 1> twist(T(0.05), T(0.0), gyro - 0.02 * b(0));
      return std::decay_t<decltype(x)>(pose * SE2<T>::exp(twist), b);
    };
    ASSERT_TRUE(Extended{}.predict(filter, step, Q));
    const auto pose_of = [](const auto& x) { return x.template get<0>(); };
    ASSERT_TRUE(Extended{}.correct(filter, truth, pose_of, R).accepted());
  }
  EXPECT_NEAR(filter.x_hat().get<1>()(0), bias, 0.02);

  using Rotation = SO3<double>;
  auto attitude = Estimate<Rotation, SquareRootCovariance<3>>::create(
                      Rotation(), MatrixXd(Matrix3d::Identity()))
                      .value();
  const Rotation turned = Rotation::exp(Vector3d(0.5, -0.7, 0.9));
  const MeasurementNoise<3> seen(Matrix3d(spread(0.01, 0.01, 0.01)));
  for (const Vector3d& direction : {Vector3d(Vector3d::UnitX()), Vector3d(Vector3d::UnitZ())}) {
    for (int k = 0; k < 20; ++k) {
      const auto in_body = [&](const auto& x) {
        using T = typename std::decay_t<decltype(x)>::Scalar;
        return (x.inverse() * Eigen::Matrix<T, 3, 1>(direction.template cast<T>())).eval();
      };
      const Vector3d y = turned.inverse() * direction;
      ASSERT_TRUE(Extended{}.correct(attitude, y, in_body, seen, {.iterations = 5}).accepted());
    }
  }
  EXPECT_LT(minus(attitude.x_hat(), turned).norm(), 0.02);
}

TEST(ManifoldFilter, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto filter = pose_filter<Pose>(Pose(), spread(0.1, 0.1, 0.1));
  auto points = pose_filter<Pose, SquareRootCovariance<3>>(Pose(), spread(0.1, 0.1, 0.1));
  Unscented<> unscented;
  const MeasurementNoise<2> R = MeasurementNoise<2>::independent(Vector2d(0.01, 0.01));
  const FactoredNoise<3> Q(spread(0.1, 0.1, 0.1));
  const test::AllocationCounter counter;
  for (int k = 0; k < 50; ++k) {
    predict_by_odometry(filter, Vector3d(0.1, 0.0, 0.1), spread(0.01, 0.01, 0.01));
    Extended{}.correct(filter, Vector2d(1.0, 1.0), Seen{marks[0]}, R);
    unscented.predict(points, Move{Vector3d(0.1, 0.0, 0.1)}, Q);
    unscented.correct(points, Vector2d(1.0, 1.0), Seen{marks[0]}, R);
  }
  EXPECT_EQ(counter.count(), 0u);
}

}  // namespace
}  // namespace flyball::manifold_filter_test
