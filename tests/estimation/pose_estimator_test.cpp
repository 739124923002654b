#include <flyball/estimation/pose_estimator.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "support/allocation_count.hpp"
#include "support/oracle.hpp"

namespace flyball::pose_estimator_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double dt = 0.02;
const Vector3d seen_sigmas(0.05, 0.05, 0.03);

Matrix3d diagonal(const Vector3d& sigmas) {
  return sigmas.cwiseAbs2().asDiagonal();
}

Vector3d drawn(Random& random, const Vector3d& sigmas) {
  return {sigmas(0) * random.normal(), sigmas(1) * random.normal(), sigmas(2) * random.normal()};
}

PoseEstimator made(const Pose2d& pose = {}, const Vector3d& sigmas = {0.1, 0.1, 0.05},
                   const PoseEstimatorOptions& options = {}) {
  return PoseEstimator::create(0.0, pose, Eigen::MatrixXd(diagonal(sigmas)), options).value();
}

/// A robot that drives as it is told but for the noise that the estimator's options tell.
struct Robot {
  Random random;
  Pose2d pose;
  OdometryNoise noise{};
  double time = 0.0;

  /// @return  What the odometry tells.
  Vector3d drive() {
    const Vector3d twist =
        dt * Vector3d(1.5 + std::sin(0.7 * time), 0.3 * std::cos(time), 1.2 * std::sin(0.5 * time));
    const Vector3d variance = noise.per_metre.cwiseAbs2() * twist.head<2>().norm() +
                              noise.per_radian.cwiseAbs2() * std::abs(twist(2)) +
                              noise.per_second.cwiseAbs2() * dt;
    pose = pose * Pose2d::exp(twist + drawn(random, variance.cwiseSqrt()));
    time += dt;
    return twist;
  }
  Pose2d seen(const Vector3d& sigmas = seen_sigmas) {
    return pose * Pose2d::exp(drawn(random, sigmas));
  }
};

bool same(const PoseEstimator& a, const PoseEstimator& b, double tolerance) {
  return a.pose().minus(b.pose()).norm() <= tolerance &&
         (a.covariance() - b.covariance()).norm() <= tolerance * b.covariance().norm();
}

// In closed form: from N(0, 0.1²) along each axis and a pose seen with the same noise, the mean is
// half way and the variance half. In the frame of the corrected pose, Jr(δ) with δ = (0.04, -0.02,
// 0), an error of heading is also one of the way by δ_y/2: 0.005 (1 + 0.01²).
TEST(PoseEstimator, WeighsByTheVariances) {
  PoseEstimator estimator = made({}, {0.1, 0.1, 0.1});
  const auto outcome = estimator.correct(0.0, Pose2d(0.08, -0.04, 0.0), Vector3d(0.1, 0.1, 0.1));
  EXPECT_EQ(outcome.status, PoseStatus::taken);
  EXPECT_EQ(outcome.candidate, -1);
  EXPECT_NEAR(outcome.nis, (0.08 * 0.08 + 0.04 * 0.04) / 0.02, 1e-12);
  EXPECT_NEAR(estimator.pose().x(), 0.04, 1e-12);
  EXPECT_NEAR(estimator.pose().y(), -0.02, 1e-12);
  EXPECT_NEAR(estimator.covariance()(0, 0), 0.005 * (1.0 + 1e-4), 1e-12);
  EXPECT_EQ(estimator.correct_heading(0.0, 2.0 * std::numbers::pi + 0.1, std::sqrt(0.005)).status,
            PoseStatus::taken);
  EXPECT_NEAR(estimator.pose().angle(), 0.05, 1e-8);
  EXPECT_NEAR(estimator.pose().x(), 0.04, 1e-3);
}

// The motion is the pose exponential of what the wheels told (Theorem 10.2.1), and the variance of
// the way grows with it: 0.03² after a metre, and 0.002² a second.
TEST(PoseEstimator, DrivesByOdometry) {
  PoseEstimator estimator = made(Pose2d(1.0, 2.0, 0.5), {0.0, 0.0, 0.0});
  const Vector3d twist(0.02, 0.005, 0.03);
  Pose2d expected(1.0, 2.0, 0.5);
  for (int k = 1; k <= 50; ++k) {
    EXPECT_EQ(estimator.predict(dt * k, twist), PoseStatus::taken);
    expected = expected * Pose2d::exp(twist);
  }
  EXPECT_LT(estimator.pose().minus(expected).norm(), 1e-12);
  PoseEstimator straight = made({}, {0.0, 0.0, 0.0});
  for (int k = 1; k <= 50; ++k) {
    straight.predict(dt * k, {0.02, 0.0, 0.0});
  }
  EXPECT_NEAR(straight.covariance()(0, 0), 0.03 * 0.03 + 0.002 * 0.002, 1e-9);
  // A motion in no time joins the next one: the same as one motion of both.
  PoseEstimator twice = made();
  twice.predict(0.0, {0.01, 0.0, 0.02});
  EXPECT_EQ(twice.pose().x(), 0.0);
  twice.predict(0.02, {0.02, 0.0, 0.01});
  const Pose2d both = Pose2d::exp({0.01, 0.0, 0.02}) * Pose2d::exp({0.02, 0.0, 0.01});
  EXPECT_LT(twice.pose().minus(both).norm(), 1e-12);
}

// H against differences: seen from a pose that is off by δ, the landmark is off by H δ. A
// correction with a small R and a large P solves H δ = ν, so that what is seen is explained.
TEST(PoseEstimator, ExplainsWhatItSees) {
  const Vector2d landmark(4.0, 3.0);
  const Pose2d truth(0.02, -0.03, 0.52);
  const Vector2d at = truth.inverse() * landmark;
  PoseEstimator estimator = made(Pose2d(0.0, 0.0, 0.5), {0.1, 0.1, 0.1});
  const auto outcome =
      estimator.correct_sighting(0.0, landmark, at.norm(), std::atan2(at(1), at(0)), {1e-4, 1e-4});
  EXPECT_EQ(outcome.status, PoseStatus::taken);
  const Vector2d then = estimator.pose().inverse() * landmark;
  EXPECT_NEAR(then.norm(), at.norm(), 1e-3);
  EXPECT_NEAR(std::atan2(then(1), then(0)), std::atan2(at(1), at(0)), 1e-3);
  // Three landmarks tell the whole pose.
  for (int k = 0; k < 5; ++k) {
    for (const Vector2d& other : {Vector2d(-3.0, 2.0), Vector2d(1.0, -4.0), landmark}) {
      const Vector2d seen = truth.inverse() * other;
      estimator.correct_sighting(0.0, other, seen.norm(), std::atan2(seen(1), seen(0)),
                                 {1e-3, 1e-3});
    }
  }
  EXPECT_LT(estimator.pose().minus(truth).norm(), 1e-3);
}

struct Event {
  double time;
  int kind;
  Pose2d pose;
  Pose2d other;
  Vector2d landmark, seen;

  PoseStatus give(PoseEstimator& estimator) const {
    switch (kind) {
      case 0:
        return estimator.correct(time, pose, seen_sigmas).status;
      case 1:
        return estimator.correct(time, {other, pose}, MeasurementNoise<3>(diagonal(seen_sigmas)))
            .status;
      case 2:
        return estimator.correct_heading(time, pose.angle(), 0.02).status;
      default:
        return estimator.correct_sighting(time, landmark, seen(0), seen(1), {0.1, 0.03}).status;
    }
  }
};

// Late and shuffled measurements of every kind, outliers and ambiguous ones among them, even across
// a relocation: what they give is what they give in their order, but for rounding.
TEST(PoseEstimator, TheOrderOfArrivalDoesNotMatter) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Robot robot{Random(seed), Pose2d()};
    std::vector<Vector3d> twists;
    std::vector<Event> events;
    for (int k = 1; k <= 45; ++k) {
      if (k == 15) {
        robot.pose = Pose2d(3.0, 1.0, 2.0);
      }
      twists.push_back(robot.drive());
      Event event{dt * (k - robot.random.uniform()), k % 4, robot.seen(), {}, {5.0, -1.0}, {}};
      event.other = event.pose * Pose2d(0.0, 0.0, 1.0);
      const Vector2d at = robot.pose.inverse() * event.landmark;
      event.seen = {at.norm() + 0.1 * robot.random.normal(),
                    std::atan2(at(1), at(0)) + 0.03 * robot.random.normal()};
      if (k % 11 == 0) {
        event.pose = event.pose * Pose2d(2.0, 0.0, 0.0);
      }
      events.push_back(event);
      if (k % 10 == 0) {  // another one of the same time
        event.kind = 0;
        events.push_back(event);
      }
    }
    PoseEstimator in_order = made();
    PoseEstimator late = made();
    std::size_t next = 0;
    for (std::size_t k = 0; k < twists.size(); ++k) {
      const double now = dt * static_cast<double>(k + 1);
      in_order.predict(now, twists[k]);
      late.predict(now, twists[k]);
      for (; next < events.size() && events[next].time <= now; ++next) {
        events[next].give(in_order);
      }
    }
    std::vector<std::size_t> order(events.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = k;
    }
    for (std::size_t k = order.size() - 1; k > 0; --k) {
      const auto j = static_cast<std::size_t>(robot.random.uniform() * static_cast<double>(k + 1));
      // Those of one time stay in their order.
      if (events[order[k]].time != events[order[j]].time) {
        std::swap(order[k], order[j]);
      }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return events[a].time == events[b].time && a < b;
    });
    for (const std::size_t k : order) {
      events[k].give(late);
    }
    EXPECT_TRUE(same(late, in_order, 1e-9)) << seed;
    EXPECT_EQ(late.relocations(), in_order.relocations()) << seed;
    EXPECT_GE(in_order.relocations(), 1) << seed;
  }
}

// The mean of eᵀ P⁻¹ e over 500 runs at ten times is within the bounds that hold jointly with 99 %
// (Bonferroni). Source: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and
// Navigation" (2001), section 5.4.
TEST(PoseEstimator, IsConsistent) {
  constexpr int runs = 500;
  constexpr int times = 10;
  std::array<double, times> nees{};
  const Vector3d start(0.2, 0.2, 0.1);
  const MeasurementNoise<3> noise(diagonal(seen_sigmas));
  for (int run = 0; run < runs; ++run) {
    Robot robot{Random(1000 + static_cast<std::uint64_t>(run)), Pose2d(1.0, 2.0, 0.3)};
    PoseEstimator estimator = made(Pose2d(1.0, 2.0, 0.3), start, {.probability = 1.0 - 1e-9});
    robot.pose = robot.seen(start);
    std::array<Pose2d, 3> late{};  // 60 ms
    for (int k = 1; k <= 200; ++k) {
      estimator.predict(dt * k, robot.drive());
      std::rotate(late.begin(), late.begin() + 1, late.end());
      late.back() = robot.seen();
      if (k % 10 == 5) {
        EXPECT_EQ(estimator.correct(dt * (k - 2), late.front(), noise).status, PoseStatus::taken);
      }
      if (k % 10 == 0) {
        const Vector2d landmark(8.0, k % 20 == 0 ? 5.0 : -5.0);
        const Vector2d at = robot.pose.inverse() * landmark;
        estimator.correct_sighting(dt * k, landmark, at.norm() + 0.1 * robot.random.normal(),
                                   std::atan2(at(1), at(0)) + 0.02 * robot.random.normal(),
                                   {0.1, 0.02});
      }
      if (k % 20 == 0) {
        const Vector3d e = robot.pose.minus(estimator.pose());
        nees[static_cast<std::size_t>(k / 20 - 1)] +=
            test::squared_distance(estimator.covariance(), e);
      }
    }
  }
  for (const double sum : nees) {
    const double tail = chi_squared_tail(sum, 3.0 * runs);
    constexpr double each = 0.01 / times;
    EXPECT_GT(tail, 0.5 * each) << sum / (3.0 * runs) << " too large";
    EXPECT_LT(tail, 1.0 - 0.5 * each) << sum / (3.0 * runs) << " too small";
  }
}

/// Drives on with a camera of 20 Hz, 60 ms late, 20 % of whose pictures are lost and 10 % wrong, a
/// second of four being ambiguous. @return  Whether the last second was right throughout.
bool finds_its_way(Robot& robot, PoseEstimator& estimator, double seconds) {
  const MeasurementNoise<3> noise(diagonal(seen_sigmas));
  std::array<Pose2d, 3> late{robot.pose, robot.pose, robot.pose};
  const double end = robot.time + seconds;
  bool right = true;
  const int steps = static_cast<int>(std::lround(seconds / dt));
  for (int k = 1; k <= steps; ++k) {
    const Vector3d twist = robot.drive();
    estimator.predict(robot.time, twist);
    std::rotate(late.begin(), late.begin() + 1, late.end());
    late.back() = robot.seen();
    if (k > 3 && k % 5 < 2 && k % 5 == (k / 5) % 2 && robot.random.uniform() > 0.2) {
      Pose2d seen = late.front();
      if (robot.random.uniform() < 0.1) {
        seen = Pose2d(robot.random.uniform(0.0, 16.0), robot.random.uniform(0.0, 8.0),
                      robot.random.uniform(-3.0, 3.0));
      }
      const double time = robot.time - 2.0 * dt;
      if (robot.random.uniform() < 0.25) {
        const Pose2d mirrored = seen * Pose2d(robot.random.normal(), robot.random.normal(), 0.8);
        estimator.correct(time, {mirrored, seen}, noise);
      } else {
        estimator.correct(time, seen, noise);
      }
    }
    if (robot.time > end - 1.0) {
      const Vector3d e = robot.pose.minus(estimator.pose());
      right = right && e.head<2>().norm() < 0.3 && std::abs(e(2)) < 0.15;
    }
  }
  return right;
}

// 2 m and 90° off, whether it knows of its ignorance or is sure of itself.
TEST(PoseEstimator, FindsItsWayFromAWrongStart) {
  constexpr int runs = 500;
  int sure = 0;
  int unsure = 0;
  for (int run = 0; run < runs; ++run) {
    for (const bool is_sure : {false, true}) {
      Robot robot{Random(2000 + static_cast<std::uint64_t>(run)), Pose2d(8.0, 4.0, 0.4)};
      const double way = robot.random.uniform(-3.1, 3.1);
      const Pose2d wrong(8.0 + 2.0 * std::cos(way), 4.0 + 2.0 * std::sin(way),
                         0.4 + (run % 2 == 0 ? 0.5 : -0.5) * std::numbers::pi);
      PoseEstimator estimator =
          made(wrong, is_sure ? Vector3d(0.1, 0.1, 0.05) : Vector3d(2.0, 2.0, 1.6));
      (is_sure ? sure : unsure) += finds_its_way(robot, estimator, 4.0) ? 1 : 0;
    }
  }
  EXPECT_GE(sure, 495);
  EXPECT_GE(unsure, 495);
}

// It is right from 2 s after the robot was carried away, for the second that follows.
TEST(PoseEstimator, FindsATeleportedRobot) {
  constexpr int runs = 500;
  int found = 0;
  for (int run = 0; run < runs; ++run) {
    Robot robot{Random(3000 + static_cast<std::uint64_t>(run)), Pose2d(8.0, 4.0, 0.4)};
    PoseEstimator estimator = made(robot.pose);
    const bool before = finds_its_way(robot, estimator, 4.0);
    robot.pose = Pose2d(robot.random.uniform(0.0, 16.0), robot.random.uniform(0.0, 8.0),
                        robot.random.uniform(-3.1, 3.1));
    found += finds_its_way(robot, estimator, 3.0) && before ? 1 : 0;
  }
  EXPECT_GE(found, 495);
}

TEST(PoseEstimator, TakesTheLikeliestCandidate) {
  const MeasurementNoise<3> noise(diagonal(seen_sigmas));
  const Pose2d good(0.05, 0.0, 0.02);
  const Pose2d bad(0.6, 0.4, -0.7);
  PoseEstimator one = made();
  PoseEstimator chosen = made();
  one.correct(0.0, good, noise);
  const auto outcome = chosen.correct(0.0, {bad, good}, noise);
  EXPECT_EQ(outcome.status, PoseStatus::taken);
  EXPECT_EQ(outcome.candidate, 1);
  EXPECT_TRUE(same(chosen, one, 0.0));
  // As far to the left as to the right.
  PoseEstimator unsure = made();
  const PoseEstimator before = unsure;
  EXPECT_EQ(unsure.correct(0.0, {Pose2d(0.0, 0.15, 0.0), Pose2d(0.0, -0.15, 0.0)}, noise).status,
            PoseStatus::ambiguous);
  EXPECT_TRUE(same(unsure, before, 0.0));
  // The same pose twice is no question.
  EXPECT_EQ(unsure.correct(0.0, {good, good * Pose2d(0.001, 0.0, 0.0)}, noise).status,
            PoseStatus::taken);
  EXPECT_EQ(unsure.correct(0.0, {}, noise).status, PoseStatus::invalid_candidates);
  EXPECT_EQ(unsure.correct(0.0, {good, good, good, good, good}, noise).status,
            PoseStatus::invalid_candidates);
}

// What it does not take it says, and it is as before, to the bit.
TEST(PoseEstimator, SaysWhatItCannotTake) {
  const double nan = std::nan("");
  const Pose2d pose(0.1, 0.0, 0.0);
  PoseEstimator estimator =
      PoseEstimator::create(5.0, Pose2d(), Eigen::MatrixXd(diagonal({0.1, 0.1, 0.1}))).value();
  // Before the first prediction.
  EXPECT_EQ(estimator.correct(4.9, pose, seen_sigmas).status, PoseStatus::too_old);
  EXPECT_EQ(estimator.correct(5.1, pose, seen_sigmas).status, PoseStatus::in_the_future);
  EXPECT_EQ(estimator.correct(5.0, pose, seen_sigmas).status, PoseStatus::taken);
  for (int k = 1; k <= 300; ++k) {
    EXPECT_EQ(estimator.predict(5.0 + dt * k, {0.01, 0.0, 0.001}), PoseStatus::taken);
  }
  const PoseEstimator before = estimator;
  const double now = estimator.now();
  const auto unchanged = [&] {
    return same(estimator, before, 0.0) && estimator.now() == now &&
           estimator.oldest() == before.oldest();
  };
  EXPECT_EQ(estimator.predict(now - 0.01, Vector3d::Zero()), PoseStatus::in_the_past);
  EXPECT_EQ(estimator.predict(nan, Vector3d::Zero()), PoseStatus::not_finite);
  EXPECT_EQ(estimator.predict(HUGE_VAL, Vector3d::Zero()), PoseStatus::not_finite);
  EXPECT_EQ(estimator.predict(now + 1.0, {nan, 0.0, 0.0}), PoseStatus::not_finite);
  EXPECT_EQ(estimator.predict(std::nextafter(now, 1e9), {1e99, 0.0, 0.0}), PoseStatus::not_finite);
  EXPECT_TRUE(unchanged());
  const MeasurementNoise<3> noise(diagonal(seen_sigmas));
  for (const Pose2d& bad :
       {Pose2d(nan, 0.0, 0.0), Pose2d(0.0, HUGE_VAL, 0.0), Pose2d(0.0, 0.0, nan),
        Pose2d({0.0, 0.0}, Rotation2d::from_unit(0.0, 0.0))}) {
    EXPECT_EQ(estimator.correct(now, bad, noise).status, PoseStatus::not_finite);
    EXPECT_EQ(estimator.correct(now, {pose, bad}, noise).status, PoseStatus::not_finite);
    EXPECT_FALSE(estimator.reset(bad, Matrix3d::Identity()));
  }
  EXPECT_EQ(estimator.correct(nan, pose, noise).status, PoseStatus::not_finite);
  EXPECT_EQ(estimator.correct(now + 1e-9, pose, noise).status, PoseStatus::in_the_future);
  EXPECT_EQ(estimator.correct(estimator.oldest() - 1e-9, pose, noise).status, PoseStatus::too_old);
  EXPECT_EQ(estimator.correct(now, pose, Vector3d(0.1, nan, 0.1)).status,
            PoseStatus::invalid_noise);
  EXPECT_EQ(estimator.correct(now, pose, Vector3d(0.1, -0.1, 0.1)).status,
            PoseStatus::invalid_noise);
  EXPECT_EQ(estimator.correct_heading(now, nan, 0.1).status, PoseStatus::not_finite);
  EXPECT_EQ(estimator.correct_heading(now, 0.0, -0.1).status, PoseStatus::invalid_noise);
  EXPECT_EQ(estimator.correct_sighting(now, {1.0, nan}, 1.0, 0.0, {0.1, 0.1}).status,
            PoseStatus::not_finite);
  EXPECT_EQ(estimator.correct_sighting(now, {1.0, 0.0}, nan, 0.0, {0.1, 0.1}).status,
            PoseStatus::not_finite);
  EXPECT_EQ(estimator.correct_sighting(now, {1.0, 0.0}, 1.0, nan, {0.1, 0.1}).status,
            PoseStatus::not_finite);
  EXPECT_FALSE(estimator.reset(nan, pose, Matrix3d::Identity()));
  EXPECT_FALSE(estimator.reset(pose, -Matrix3d::Identity()));
  EXPECT_TRUE(unchanged());
  // These two are judged again at each replay, and are kept.
  EXPECT_EQ(estimator.correct(now, Pose2d(50.0, 0.0, 0.0), noise).status, PoseStatus::rejected);
  EXPECT_EQ(
      estimator.correct_sighting(now, estimator.pose().translation(), 0.0, 0.0, {0.1, 0.1}).status,
      PoseStatus::not_finite);
  EXPECT_TRUE(same(estimator, before, 0.0));
}

TEST(PoseEstimator, AReproducibleStartAtAnyTime) {
  PoseEstimator estimator = made();
  for (int k = 1; k <= 50; ++k) {
    estimator.predict(dt * k, {0.02, 0.0, 0.0});
    estimator.correct(dt * k, Pose2d(0.02 * k, 0.0, 0.0), seen_sigmas);
  }
  const Pose2d pose(3.0, 1.0, -2.0);
  const Matrix3d P = diagonal({0.1, 0.1, 0.05});
  EXPECT_TRUE(estimator.reset(pose, P));
  EXPECT_EQ(estimator.now(), 1.0);
  EXPECT_EQ(estimator.oldest(), 1.0);
  // What was seen before is not of this start.
  EXPECT_EQ(estimator.correct(0.98, pose, seen_sigmas).status, PoseStatus::too_old);
  // Back in time, as after a clock that began again: as a new one.
  EXPECT_TRUE(estimator.reset(0.0, pose, P));
  PoseEstimator fresh = made(pose);
  for (PoseEstimator* each : {&estimator, &fresh}) {
    each->predict(0.02, {0.02, 0.0, 0.01});
    each->correct(0.01, pose * Pose2d(0.05, 0.0, 0.0), seen_sigmas);
  }
  EXPECT_TRUE(same(estimator, fresh, 0.0));
}

TEST(PoseEstimator, TellsWhereItWas) {
  PoseEstimator estimator = made();
  const Vector3d twist(0.02, 0.0, 0.04);
  for (int k = 1; k <= 20; ++k) {
    estimator.predict(dt * k, twist);
  }
  ASSERT_TRUE(estimator.sample(0.15));
  EXPECT_LT(estimator.sample(0.15)->minus(Pose2d::exp(7.5 * twist)).norm(), 1e-12);
  EXPECT_LT(estimator.sample(0.0)->minus(Pose2d()).norm(), 1e-15);
  EXPECT_LT(estimator.sample(estimator.now())->minus(estimator.pose()).norm(), 1e-15);
  EXPECT_FALSE(estimator.sample(0.41));
  EXPECT_FALSE(estimator.sample(-0.01));
  EXPECT_FALSE(estimator.sample(std::nan("")));
  // What is seen late changes what was.
  estimator.correct(0.1, Pose2d::exp(5.0 * twist) * Pose2d(0.0, 0.05, 0.0), seen_sigmas);
  EXPECT_GT(estimator.sample(0.15)->minus(Pose2d::exp(7.5 * twist)).norm(), 0.01);
  EXPECT_LT(estimator.sample(0.09)->minus(Pose2d::exp(4.5 * twist)).norm(), 1e-12);
}

// One wrong pose among good ones does not begin anything, five in a row that disagree neither.
TEST(PoseEstimator, IsNotCarriedAwayByOutliers) {
  Robot robot{Random(7), Pose2d()};
  PoseEstimator estimator = made();
  for (int k = 1; k <= 500; ++k) {
    const Vector3d twist = robot.drive();
    estimator.predict(robot.time, twist);
    const bool wrong = k > 50 && k % 100 < 60;
    const Pose2d elsewhere(robot.random.uniform(-20.0, 20.0), robot.random.uniform(-20.0, 20.0),
                           robot.random.uniform(-3.0, 3.0));
    estimator.correct(robot.time, wrong ? elsewhere : robot.seen(), seen_sigmas);
  }
  EXPECT_EQ(estimator.relocations(), 0);
  EXPECT_LT(robot.pose.minus(estimator.pose()).norm(), 0.2);
  // Without recovery it stays with what it knows.
  PoseEstimator stubborn = made({}, {0.1, 0.1, 0.05}, {.recover_after = 0});
  for (int k = 1; k <= 100; ++k) {
    stubborn.predict(dt * k, Vector3d::Zero());
    EXPECT_EQ(stubborn.correct(dt * k, Pose2d(5.0, 0.0, 0.0), seen_sigmas).status,
              PoseStatus::rejected);
  }
}

TEST(PoseEstimator, RefusesOptions) {
  const Eigen::MatrixXd P = Eigen::MatrixXd(Matrix3d::Identity());
  const auto error = [&](const PoseEstimatorOptions& options) {
    return PoseEstimator::create(0.0, Pose2d(), P, options).error();
  };
  EXPECT_TRUE(error({.recover_after = -1}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error({.least_ratio = 0.5}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error({.probability = 1.5}).is(ArgumentError::out_of_range));
  EXPECT_TRUE(error({.recover_time = Time(-1.0)}).is(ArgumentError::out_of_range));
  PoseEstimatorOptions options;
  options.odometry.per_metre(1) = -1.0;
  EXPECT_TRUE(error(options).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      PoseEstimator::create(std::nan(""), Pose2d(), P).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(PoseEstimator::create(0.0, Pose2d(), Eigen::MatrixXd(-P))
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(PoseEstimator::create(0.0, Pose2d(), Eigen::MatrixXd(P.topRows(2)))
                  .error()
                  .is(ArgumentError::wrong_shape));
}

// The closed forms of odometry and of a whole pose are the estimate's own steps, for independent
// and correlated noises, ones so small that they are left to it, and outliers.
TEST(PoseEstimator, ClosedFormsAreTheEstimatesSteps) {
  Random random(131);
  const PoseEstimatorOptions options;
  for (int run = 0; run < 200; ++run) {
    const Matrix3d A = Matrix3d::NullaryExpr([&] { return 0.2 * random.normal(); });
    const Matrix3d P0 = A * A.transpose() + 1e-4 * Matrix3d::Identity();
    const Pose2d start(random.normal(), random.normal(), random.uniform(-3.1, 3.1));
    const auto estimate = Estimate<Pose2d>::create(start, Eigen::MatrixXd(P0)).value();
    auto guard = OutlierGuard::create({.probability = 0.999}).value();
    detail::PoseFilter filter({estimate, estimate}, options, guard);
    auto expected = estimate;
    for (int k = 0; k < 5; ++k) {
      const Vector3d twist(random.normal(), random.normal(), random.uniform(-2.0, 2.0));
      const Vector3d rate = twist / dt;
      filter.predict(rate, dt);
      const Vector3d half = 0.5 * (options.odometry.per_metre.cwiseAbs2() * twist.head<2>().norm() +
                                   options.odometry.per_radian.cwiseAbs2() * std::abs(twist(2)) +
                                   options.odometry.per_second.cwiseAbs2() * dt);
      const Pose2d step = Pose2d::exp(twist);
      const Matrix3d F = step.inverse().adjoint();
      const Matrix3d W = half.asDiagonal();
      ASSERT_TRUE(expected.predict(expected.x_hat() * step, F,
                                   PlainNoise<3>(Matrix3d(F * W * F.transpose() + W))));

      Matrix3d R = drawn(random, {0.3, 0.3, 0.2}).cwiseAbs2().asDiagonal();
      R += 1e-4 * Matrix3d::Identity();
      if (run % 4 == 1) {
        R(0, 1) = R(1, 0) = 0.9 * std::sqrt(R(0, 0) * R(1, 1));
      } else if (run % 4 == 2) {
        R(1, 1) = 1e-12;
      }
      const Vector3d off =
          drawn(random, run % 4 == 3 ? Vector3d(5.0, 5.0, 1.0) : Vector3d(0.1, 0.1, 0.1));
      const detail::SeenPose seen{{expected.x_hat() * Pose2d::exp(off)}, 1, MeasurementNoise<3>(R)};
      const auto outcome = filter.take(seen);
      const auto correction =
          expected.correct<3>(seen.candidates[0].minus(expected.x_hat()), Matrix3d::Identity(),
                              seen.noise, {.guard = &guard});
      ASSERT_EQ(outcome.status == PoseStatus::taken, correction.accepted());
      ASSERT_NEAR(outcome.nis, correction.nis, 1e-9 * correction.nis);
      const auto& got = filter.estimate().estimate;
      ASSERT_LT(got.x_hat().minus(expected.x_hat()).norm(), 1e-11);
      ASSERT_LT((got.P() - expected.P()).norm(), 1e-11 * expected.P().norm());
      ASSERT_EQ(got.P(), Matrix3d(got.P().transpose()));
    }
  }
}

TEST(PoseEstimator, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  Robot robot{Random(9), Pose2d()};
  PoseEstimator estimator = made();
  const MeasurementNoise<3> noise(diagonal(seen_sigmas));
  double sum = 0.0;
  const test::AllocationCounter counter;
  for (int k = 1; k < 500; ++k) {
    if (k == 250) {
      robot.pose = Pose2d(5.0, 5.0, 1.0);
    }
    const Vector3d twist = robot.drive();
    estimator.predict(robot.time, twist);
    const Pose2d seen = robot.seen();
    estimator.correct(robot.time - 0.06, {seen, seen * Pose2d(0.0, 0.0, 1.0)}, noise);
    estimator.correct(robot.time, seen, noise);
    estimator.correct_heading(robot.time, seen.angle(), 0.05);
    estimator.correct_sighting(robot.time, {9.0, 0.0}, 3.0, 0.1, {0.1, 0.1});
    sum += estimator.sample(robot.time - 0.05)->x();
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_GT(estimator.relocations(), 0);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace flyball::pose_estimator_test
