#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/control/followers/ramsete.hpp>
#include <flyball/core/random.hpp>

#include "book_drive.hpp"
#include "support/allocation_count.hpp"

// The laws of every follower: finite and within the limits whatever comes; no error, no feedback;
// the same wherever the field's origin is; angles are of whole turns; no allocation.
namespace flyball::follower_laws_test {
namespace {

static_assert(PoseFollower<RamseteFollower>);
static_assert(PoseFollower<LtvUnicycleFollower>);
static_assert(PoseFollower<HolonomicFollower>);

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;
constexpr SpeedLimits limits{
    .velocity = 3.0, .angular_velocity = 6.0, .wheel_velocity = 4.0, .trackwidth = 0.6};

/// What all followers can be asked; those of poses do not look at the sides' velocities.
struct Question {
  double x = 0.0, y = 0.0, heading = 0.0, left = 0.0, right = 0.0;
  double x_r = 0.0, y_r = 0.0, heading_r = 0.0, v_r = 0.0, omega_r = 0.0;

  [[nodiscard]] Pose2d pose() const { return {x, y, heading}; }
  [[nodiscard]] TrackingPoint r() const { return {{x_r, y_r, heading_r}, {v_r, 0.0, omega_r}}; }
  [[nodiscard]] std::vector<double*> numbers() {
    return {&x, &y, &heading, &left, &right, &x_r, &y_r, &heading_r, &v_r, &omega_r};
  }
};

struct Reply {
  Eigen::VectorXd command;
  bool within = false;  ///< Its limits.
  FollowerStatus status = FollowerStatus::tracking;
};

struct Subject {
  std::string name;
  std::function<Reply(const Question&)> ask;
  double tolerance;  ///< Of a command beside another, relative.
};

template <class Follower>
Reply ask_for_speeds(Follower& follower, const Question& question, bool on_arc) {
  const FollowerCommand command = follower.calculate(question.pose(), question.r());
  const auto& s = command.speeds;
  const bool within = std::hypot(s.vx, s.vy) <= limits.velocity &&
                      std::abs(s.omega) <= limits.angular_velocity &&
                      (!on_arc || std::abs(s.vx) + 0.5 * limits.trackwidth * std::abs(s.omega) <=
                                      limits.wheel_velocity);
  return {s.vector(), within, command.status};
}

std::vector<Subject> subjects() {
  std::vector<Subject> all;
  all.push_back({"Ramsete",
                 [f = RamseteFollower::create({.limits = limits}).value()](const Question& q) {
                   return ask_for_speeds(f, q, true);
                 },
                 1e-12});
  all.push_back({"LTV unicycle",
                 [f = LtvUnicycleFollower::create({.limits = limits}).value()](const Question& q) {
                   return ask_for_speeds(f, q, true);
                 },
                 1e-12});
  all.push_back({"holonomic",
                 [f = HolonomicFollower::create({.limits = limits}).value()](
                     const Question& q) mutable { return ask_for_speeds(f, q, false); },
                 1e-12});
  for (const GainSource source : {GainSource::each_period, GainSource::schedule}) {
    LtvDriveSettings settings;
    settings.source = source;
    const auto follower =
        LtvDriveFollower::create(test::book_drive(), test::book_trackwidth, settings).value();
    all.push_back({source == GainSource::schedule ? "scheduled LTV drive" : "LTV drive",
                   [follower](const Question& q) {
                     const DriveState r = drive_state(q.r(), follower.trackwidth());
                     const DriveCommand command =
                         follower.calculate({q.pose(), q.left, q.right}, r, r);
                     return Reply{command.voltage, command.voltage.cwiseAbs().maxCoeff() <= 12.0,
                                  command.status};
                   },
                   1e-9});
  }
  return all;
}

Question random_question(Random& random, double size) {
  Question q;
  for (double* number : q.numbers()) {
    *number = random.uniform(-size, size);
  }
  return q;
}

TEST(FollowerLaws, FiniteAndWithinLimitsWhateverComes) {
  const double bad[] = {std::nan(""), infinity, -infinity, 1e308,  -1e308,
                        1e101,        1e100,    -1e100,    1e-308, 0.0};
  for (Subject& subject : subjects()) {
    Random random(1);
    for (int k = 0; k < 3000; ++k) {
      Question q = random_question(random, std::exp(random.uniform(-5.0, 8.0)));
      const auto numbers = q.numbers();
      const int faults = static_cast<int>(random.uniform(0.0, 4.0));
      for (int i = 0; i < faults; ++i) {
        *numbers[static_cast<std::size_t>(random.uniform(0.0, 10.0))] =
            bad[static_cast<std::size_t>(random.uniform(0.0, 10.0))];
      }
      const Reply reply = subject.ask(q);
      ASSERT_TRUE(reply.command.allFinite() && reply.within)
          << subject.name << " case " << k << ": " << reply.command.transpose();
    }
  }
}

// The gravest reason is told; without a reference the robot stands, without a pose it goes on as
// the reference does.
TEST(FollowerLaws, SaysWhatIsMissing) {
  const Question ordinary{.x = 0.1, .x_r = 0.2, .v_r = 1.0, .omega_r = 0.5};
  Question alone = ordinary;
  alone.x = alone.x_r;
  alone.left = 1.0 - 0.25 * 0.59055;
  alone.right = 1.0 + 0.25 * 0.59055;
  for (Subject& subject : subjects()) {
    Question q = ordinary;
    q.heading_r = std::nan("");
    q.x = std::nan("");
    EXPECT_EQ(subject.ask(q).status, FollowerStatus::no_reference) << subject.name;
    EXPECT_EQ(subject.ask(q).command.norm(), 0.0) << subject.name;
    q = alone;
    const Reply reference = subject.ask(q);
    EXPECT_EQ(reference.status, FollowerStatus::tracking) << subject.name;
    q.x = infinity;
    EXPECT_EQ(subject.ask(q).status, FollowerStatus::no_pose) << subject.name;
    EXPECT_NEAR((subject.ask(q).command - reference.command).norm(), 0.0, 1e-12) << subject.name;
    q = ordinary;
    q.x_r = 50.0;
    EXPECT_EQ(subject.ask(q).status, FollowerStatus::saturated) << subject.name;
  }
}

// Without an error the speeds are the reference's own.
TEST(FollowerLaws, NoErrorNoFeedback) {
  Random random(2);
  for (Subject& subject : subjects()) {
    for (int k = 0; k < 200; ++k) {
      Question q = random_question(random, 1.0);
      q.x_r = q.x;
      q.y_r = q.y;
      q.heading_r = q.heading;
      const Reply reply = subject.ask(q);
      if (reply.command.size() == 3) {
        EXPECT_NEAR((reply.command - Eigen::Vector3d(q.v_r, 0.0, q.omega_r)).norm(), 0.0, 1e-14)
            << subject.name;
      }
    }
  }
}

// g x and g r for a rigid motion g give what x and r give; and so do headings of more turns.
TEST(FollowerLaws, TheOriginDoesNotMatter) {
  Random random(3);
  for (Subject& subject : subjects()) {
    for (int k = 0; k < 300; ++k) {
      const Question q = random_question(random, 1.5);
      const Pose2d g(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-pi, pi));
      const Pose2d x = g * q.pose();
      const Pose2d r = g * q.r().pose;
      Question moved = q;
      moved.x = x.x();
      moved.y = x.y();
      moved.heading = q.heading + g.angle() + 2.0 * pi;
      moved.x_r = r.x();
      moved.y_r = r.y();
      moved.heading_r = q.heading_r + g.angle() - 4.0 * pi;
      const Reply here = subject.ask(q);
      const Reply there = subject.ask(moved);
      ASSERT_LE((here.command - there.command).norm(),
                10.0 * subject.tolerance * (1.0 + here.command.norm()))
          << subject.name;
      ASSERT_EQ(here.status, there.status) << subject.name;
    }
  }
}

// What is left for the one is right for the other.
TEST(FollowerLaws, LeftAndRightAreAlike) {
  Random random(4);
  for (Subject& subject : subjects()) {
    for (int k = 0; k < 300; ++k) {
      const Question q = random_question(random, 1.5);
      Question mirrored = q;
      for (double* number : {&mirrored.y, &mirrored.heading, &mirrored.y_r, &mirrored.heading_r,
                             &mirrored.omega_r}) {
        *number = -*number;
      }
      std::swap(mirrored.left, mirrored.right);
      Eigen::VectorXd expected = subject.ask(q).command;
      if (expected.size() == 2) {
        std::swap(expected(0), expected(1));
      } else {
        expected.tail<2>() *= -1.0;
      }
      ASSERT_LE((subject.ask(mirrored).command - expected).norm(),
                subject.tolerance * (1.0 + expected.norm()))
          << subject.name;
    }
  }
}

TEST(FollowerLaws, NoAllocation) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "this build does not count allocations";
  }
  const auto ramsete = RamseteFollower::create().value();
  const auto unicycle = LtvUnicycleFollower::create().value();
  auto holonomic = HolonomicFollower::create({.heading_profile = MotionLimits{2.0, 4.0}}).value();
  const auto drive = LtvDriveFollower::create(test::book_drive(), test::book_trackwidth).value();
  LtvDriveSettings settings;
  settings.source = GainSource::schedule;
  const auto scheduled =
      LtvDriveFollower::create(test::book_drive(), test::book_trackwidth, settings).value();
  const std::vector<PathPoint> path{{{0.0, 0.0, 0.0}}, {{1.0, 0.1, 0.1}}, {{2.0, 0.3, 0.2}}};
  auto pursuit = PurePursuitFollower::create(path, {.velocity = 1.0}).value();
  Random random(5);
  std::vector<Question> questions;
  for (int k = 0; k < 3000; ++k) {
    questions.push_back(random_question(random, std::exp(random.uniform(-6.0, 3.0))));
  }
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (const Question& q : questions) {
    const DriveState r = drive_state(q.r(), 0.6);
    sum += ramsete.calculate(q.pose(), q.r()).speeds.vx +
           unicycle.calculate(q.pose(), q.r()).speeds.vx +
           holonomic.calculate(q.pose(), q.r()).speeds.vx + pursuit.calculate(q.pose()).speeds.vx +
           drive.calculate({q.pose(), q.left, q.right}, r, r).voltage(0) +
           scheduled.calculate({q.pose(), q.left, q.right}, r, r).voltage(0);
  }
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(TrackingMonitor, SettlesAndIsLost) {
  auto monitor = TrackingMonitor::create({.hold_time = 0.05}).value();
  using State = TrackingMonitor::State;
  const Eigen::Vector3d near(0.01, 0.01, 0.01);
  EXPECT_EQ(monitor.update({0.3, 0.0, 0.0}, 0.02), State::following);
  EXPECT_EQ(monitor.update(near, 0.02), State::following);
  EXPECT_EQ(monitor.update(near, 0.02), State::following);
  EXPECT_EQ(monitor.update(near, 0.02), State::following);  // for 0.04 s
  EXPECT_EQ(monitor.update(near, 0.02), State::settled);
  EXPECT_EQ(monitor.update({0.01, 0.06, 0.0}, 0.02), State::following);
  EXPECT_EQ(monitor.update({0.8, 0.7, 0.0}, 0.02), State::lost);
  EXPECT_EQ(monitor.update({0.0, 0.0, 1.6}, 0.02), State::lost);
  EXPECT_EQ(monitor.update({0.0, std::nan(""), 0.0}, 0.02), State::lost);
  monitor.reset();
  EXPECT_EQ(monitor.state(), State::following);
  EXPECT_EQ(to_string(TrackingMonitor::create({.distance = -1.0}).error()),
            "TrackingMonitor: distance is -1 m; it must be greater than zero");
  EXPECT_TRUE(at_reference({1.0, 2.0, pi}, {1.01, 2.01, -pi}, {}));
  EXPECT_FALSE(at_reference({1.0, 2.0, pi}, {1.01, 2.01, 0.0}, {}));
}

// Half a second at 2 m/s and 1 rad/s is an arc of 1 m and 0.5 rad; numbers that are none stand.
TEST(PoseAfter, MovesAlongTheArc) {
  const Pose2d after = pose_after({1.0, 2.0, 0.0}, {2.0, 0.0, 1.0}, 0.5);
  EXPECT_NEAR(after.x(), 1.0 + 2.0 * std::sin(0.5), 1e-15);
  EXPECT_NEAR(after.y(), 2.0 + 2.0 * (1.0 - std::cos(0.5)), 1e-15);
  EXPECT_NEAR(after.angle(), 0.5, 1e-15);
  EXPECT_EQ(pose_after({1.0, 2.0, 0.3}, {std::nan(""), 0.0, 1.0}, 0.5).x(), 1.0);
  EXPECT_EQ(pose_after({1.0, 2.0, 0.3}, {1.0, 0.0, 1.0}, infinity).x(), 1.0);
}

// Far away the pull of a position is that of the farthest error, its direction kept.
TEST(NoFarther, KeepsTheDirection) {
  EXPECT_LE((no_farther({3.0, -4.0, 2.0}, 0.5) - Eigen::Vector3d(0.3, -0.4, 2.0)).norm(), 1e-15);
  EXPECT_EQ(no_farther({0.3, -0.4, 2.0}, 0.6), Eigen::Vector3d(0.3, -0.4, 2.0));
  const auto far = LtvUnicycleFollower::create().value();
  const auto at = [&](double distance) {
    return far.calculate({}, {{distance, 0.0, 0.0}, {1.0, 0.0, 0.0}}).speeds.vx;
  };
  EXPECT_LT(at(0.3), at(0.4));
  EXPECT_DOUBLE_EQ(at(0.4), at(40.0));
}

// Scaling keeps the arc: v and ω by one factor, to the nearest limit.
TEST(SpeedLimits, KeepTheArc) {
  bool saturated = false;
  const auto speeds = limits.on_arc(6.0, 6.0, saturated);
  EXPECT_TRUE(saturated);
  // v asks for 1/2, a wheel for 4/(6 + 0.3·6) = 0.5128.
  EXPECT_NEAR(speeds.vx, 3.0, 1e-14);
  EXPECT_NEAR(speeds.omega, 3.0, 1e-14);
  saturated = false;
  EXPECT_EQ(limits.on_arc(1.0, -2.0, saturated).omega, -2.0);
  EXPECT_FALSE(saturated);
  const auto any = limits.in_any_direction({3.0, 4.0, -9.0}, saturated);
  EXPECT_TRUE(saturated);
  EXPECT_NEAR(any.vx, 1.8, 1e-14);
  EXPECT_NEAR(any.vy, 2.4, 1e-14);
  EXPECT_EQ(any.omega, -6.0);
}

}  // namespace
}  // namespace flyball::follower_laws_test
