// Where a robot is on its field: two minutes of simulated driving, its wheels' odometry (which
// slips when it is pushed) and cameras, before and behind, that see the field's tags: 60 ms late,
// seldom when the robot turns fast, blind for some seconds, with two solutions where a tag is far
// off, and sometimes with the wrong tag. Prints how far off odometry alone is, and the estimator.
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/estimation/pose_estimator.hpp>

namespace {

using namespace flyball;
using Eigen::Vector3d;

constexpr double dt = 0.02;
constexpr int delay = 3;  // of dt: 60 ms
constexpr int steps = 6000;

/// Along a figure of eight on a field of 16 m x 8 m, m/s and rad/s in the robot's frame.
Vector3d velocity(const Pose2d& robot, double time) {
  const double w = 0.35;
  const Eigen::Vector2d on_field(6.0 * w * std::cos(w * time), 6.0 * w * std::cos(2.0 * w * time));
  const Eigen::Vector2d in_robot = robot.rotation().inverse() * on_field;
  return {in_robot(0), in_robot(1), 1.5 * std::sin(0.6 * time)};
}

/// A tag on the field's edge.
struct Tag {
  Eigen::Vector2d place;
  double normal;  ///< rad, where it faces.
};
constexpr double pi = std::numbers::pi;
const std::array<Tag, 8> tags{{{{0.0, 2.0}, 0.0},
                               {{0.0, 6.0}, 0.0},
                               {{16.0, 2.0}, pi},
                               {{16.0, 6.0}, pi},
                               {{4.0, 0.0}, pi / 2.0},
                               {{12.0, 0.0}, pi / 2.0},
                               {{4.0, 8.0}, -pi / 2.0},
                               {{12.0, 8.0}, -pi / 2.0}}};

struct RootMeanSquare {
  double sum = 0.0;
  int count = 0;
  void add(double error) {
    sum += error * error;
    ++count;
  }
  [[nodiscard]] double value() const { return std::sqrt(sum / count); }
};

}  // namespace

int main() {
  Random random(2026);
  const Pose2d start(8.0, 4.0, 0.0);
  const Vector3d start_sigmas(0.1, 0.1, 0.05);
  //! [create]
  PoseEstimatorOptions options;
  options.odometry.per_metre = {0.1, 0.1, 0.02};
  options.odometry.per_radian = {0.03, 0.03, 0.05};
  auto created = PoseEstimator::create(0.0, start, standard_deviations({0.1, 0.1, 0.05}), options);
  if (!created) {
    std::fprintf(stderr, "%s\n", to_string(created.error()).c_str());
    return 1;
  }
  PoseEstimator& estimator = *created;
  //! [create]

  Pose2d truth = start;
  Pose2d odometry = start;
  std::array<Pose2d, steps + 1> path{};
  path[0] = truth;
  RootMeanSquare of_odometry, of_estimator, heading_of_odometry, heading_of_estimator;
  int taken = 0;
  int ambiguous = 0;
  int rejected = 0;
  for (int k = 1; k <= steps; ++k) {
    const double time = dt * k;
    // The robot drives; its wheels slip by 2 % and turn by 1 % too little. Twice it is pushed, and
    // they do not turn.
    const Vector3d twist = dt * velocity(truth, time);
    Vector3d told(1.02 * twist(0), 1.02 * twist(1), 0.99 * twist(2));
    for (int i = 0; i < 3; ++i) {
      told(i) += 0.05 * std::abs(twist(i)) * random.normal();
    }
    truth = truth * Pose2d::exp(twist);
    const double since_push = std::fmod(time, 50.0) - 30.0;
    if (since_push > 0.0 && since_push < 0.3) {
      truth = truth * Pose2d::exp(dt * Vector3d(2.0, 1.5, 1.0));
    }
    path[static_cast<std::size_t>(k)] = truth;
    odometry = odometry * Pose2d::exp(told);
    estimator.predict(time, told);

    // A picture of 60 ms ago; none at all for 4 s of every 20.
    if (k % 2 == 0 && k > delay && std::fmod(time, 20.0) > 4.0) {
      const Pose2d& then = path[static_cast<std::size_t>(k - delay)];
      for (const Tag& tag : tags) {
        const Eigen::Vector2d at = then.inverse() * tag.place;
        const double range = at.norm();
        const Eigen::Vector2d to_robot = (then.translation() - tag.place) / range;
        const bool faces = to_robot.dot(Rotation2d(tag.normal) * Eigen::Vector2d(1.0, 0.0)) > 0.4;
        const bool in_view = range < 6.0 && std::abs(at(1)) < 0.7 * std::abs(at(0));
        if (!faces || !in_view || random.uniform() < 0.15 + 0.3 * std::abs(twist(2)) / dt) {
          continue;
        }
        // The farther the tag, the less it tells.
        const Vector3d sigmas(0.01 + 0.01 * range * range, 0.01 + 0.01 * range * range,
                              0.01 + 0.01 * range);
        Vector3d error;
        for (int i = 0; i < 3; ++i) {
          error(i) = sigmas(i) * random.normal();
        }
        Pose2d seen = then * Pose2d::exp(error);
        if (random.uniform() < 0.02) {  // another tag's number was read
          seen = Pose2d(seen.x() + 4.0, seen.y(), seen.angle() + pi / 2.0);
        }
        const MeasurementNoise<3> noise(Eigen::Matrix3d(sigmas.cwiseAbs2().asDiagonal()));
        const double stamp = dt * (k - delay);
        //! [correct]
        PoseOutcome outcome;
        if (range > 3.0) {
          // Far off a flat tag looks the same tilted either way: the robot's place mirrored at the
          // line from it to the tag's normal.
          const double tilt = 2.0 * (std::atan2(to_robot(1), to_robot(0)) - tag.normal);
          const Pose2d around(tag.place, Rotation2d());
          const Pose2d mirrored = around * Pose2d(0.0, 0.0, -tilt) * around.inverse() * seen;
          outcome = random.uniform() < 0.5 ? estimator.correct(stamp, {mirrored, seen}, noise)
                                           : estimator.correct(stamp, {seen, mirrored}, noise);
        } else {
          outcome = estimator.correct(stamp, seen, noise);
        }
        //! [correct]
        taken += outcome.status == PoseStatus::taken ? 1 : 0;
        ambiguous += outcome.status == PoseStatus::ambiguous ? 1 : 0;
        rejected += outcome.status == PoseStatus::rejected ? 1 : 0;
      }
    }
    const Vector3d off = truth.minus(estimator.pose());
    const Vector3d off_alone = truth.minus(odometry);
    of_estimator.add((truth.translation() - estimator.pose().translation()).norm());
    of_odometry.add((truth.translation() - odometry.translation()).norm());
    heading_of_estimator.add(off(2));
    heading_of_odometry.add(off_alone(2));
  }

  const double degrees = 180.0 / pi;
  std::printf("120 s of driving; tags: %d taken, %d rejected, %d ambiguous; %d relocations\n",
              taken, rejected, ambiguous, estimator.relocations());
  std::printf("  odometry alone  %6.3f m rms  %6.2f deg rms\n", of_odometry.value(),
              degrees * heading_of_odometry.value());
  std::printf("  PoseEstimator   %6.3f m rms  %6.2f deg rms\n", of_estimator.value(),
              degrees * heading_of_estimator.value());
  // What is told by the covariance: three standard deviations along the robot.
  std::printf("  at the end (%.2f, %.2f) m +- %.3f m, true (%.2f, %.2f) m\n", estimator.pose().x(),
              estimator.pose().y(), 3.0 * std::sqrt(estimator.covariance()(0, 0)), truth.x(),
              truth.y());
  return of_estimator.value() < 0.2 * of_odometry.value() ? 0 : 1;
}
