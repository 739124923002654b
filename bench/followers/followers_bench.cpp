// One period of each path follower, `bench_followers [repetitions]`: budgets are 100 ns for Ramsete
// and the unicycle regulator, 8 µs for the drive regulator whose Riccati equation of five states is
// solved each period. Beside them the same gains the way a design is made: matrices, exponential,
// `lqr`. Minima over repetitions that alternate, because another process may hold the machine in
// any of them; the last column is the slowest of single calls at velocities over the whole range.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <flyball/control/followers/holonomic.hpp>
#include <flyball/control/followers/ltv_drive.hpp>
#include <flyball/control/followers/ltv_unicycle.hpp>
#include <flyball/control/followers/pure_pursuit.hpp>
#include <flyball/control/followers/ramsete.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>

#include "timing.hpp"

namespace {

using namespace flyball;

constexpr Length trackwidth{0.59055};

mechanisms::DifferentialDrive drive() {
  return mechanisms::differential_drive({.motor = mechanisms::cim(3),
                                         .left_gearing = 60.0 / 11.0,
                                         .right_gearing = 60.0 / 11.0,
                                         .mass = Mass(52.0),
                                         .wheel_radius = Length(0.041275),
                                         .trackwidth = trackwidth,
                                         .moment_of_inertia = MomentOfInertia(6.0)})
      .value();
}

struct Question {
  DriveState x;
  TrackingPoint r;
};

std::vector<Question> questions() {
  Random random(1);
  std::vector<Question> all;
  for (int k = 0; k < 64; ++k) {
    const auto any = [&](double size) { return random.uniform(-size, size); };
    all.push_back({{{any(0.3), any(0.3), any(1.0)}, any(3.0), any(3.0)},
                   {{any(0.3), any(0.3), any(1.0)}, {any(3.0), 0.0, any(2.0)}}});
  }
  return all;
}

double sink = 0.0;

/// Nanoseconds of one call: the mean over the questions, of the fastest repetition.
template <class Ask>
double nanoseconds(const std::vector<Question>& all, int repetitions, int calls, const Ask& ask) {
  double best = 1e300;
  for (int r = 0; r < repetitions; ++r) {
    best = std::min(best, bench::microseconds(calls, [&] {
                      for (const Question& q : all) {
                        sink += ask(q);
                      }
                    }));
  }
  return 1000.0 * best / static_cast<double>(all.size());
}

template <class Ask>
double row(const char* name, const std::vector<Question>& all, int repetitions, const Ask& ask) {
  const double mean = nanoseconds(all, repetitions, 20, ask);
  double slowest = 0.0;
  for (const Question& q : all) {
    slowest = std::max(slowest, nanoseconds({q}, repetitions, 20, ask));
  }
  std::printf("%-42s %9.1f %9.1f\n", name, mean, slowest);
  return mean;
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 100;
  const auto all = questions();
  const auto ramsete =
      RamseteFollower::create({.limits = {.velocity = 4.0, .angular_velocity = 8.0}}).value();
  const auto unicycle =
      LtvUnicycleFollower::create({.limits = {.velocity = 4.0, .angular_velocity = 8.0}}).value();
  auto holonomic = HolonomicFollower::create({.limits = {.velocity = 4.0}}).value();
  LtvDriveSettings settings;
  const auto solving = LtvDriveFollower::create(drive(), trackwidth, settings).value();
  settings.source = GainSource::schedule;
  const auto scheduled = LtvDriveFollower::create(drive(), trackwidth, settings).value();
  std::vector<PathPoint> path;
  for (int i = 0; i <= 200; ++i) {
    path.push_back({{0.05 * i, 0.0, 0.0}, 0.0});
  }
  auto pursuit = PurePursuitFollower::create(path, {.velocity = 2.0}).value();

  std::printf("one period, ns                                  mean   slowest\n");
  row("Ramsete", all, repetitions,
      [&](const Question& q) { return ramsete.calculate(q.x.pose, q.r).speeds.omega; });
  const double fast = row("LTV unicycle, closed form", all, repetitions, [&](const Question& q) {
    return unicycle.calculate(q.x.pose, q.r).speeds.omega;
  });
  row("holonomic", all, repetitions,
      [&](const Question& q) { return holonomic.calculate(q.x.pose, q.r).speeds.omega; });
  row("pure pursuit, 60 points within its search", all, repetitions,
      [&](const Question& q) { return pursuit.calculate(q.x.pose).speeds.omega; });
  const auto follow = [](const LtvDriveFollower& follower, const Question& q) {
    const DriveState r = drive_state(q.r, trackwidth.si());
    return follower.calculate(q.x, r, r).voltage(0);
  };
  const double solved = row("LTV drive, Riccati equation each period", all, repetitions,
                            [&](const Question& q) { return follow(solving, q); });
  const double table = row("LTV drive, scheduled", all, repetitions,
                           [&](const Question& q) { return follow(scheduled, q); });

  const Eigen::MatrixXd Q = bryson({0.0625, 0.125, 2.5, 0.95, 0.95}).value();
  const Eigen::MatrixXd R = bryson({12.0, 12.0}).value();
  const auto model = drive();
  const double designed = row("drive's gain by discretize and lqr", all,
                              std::max(1, repetitions / 10), [&](const Question& q) {
                                const double v = 0.5 * (q.x.left + q.x.right);
                                const auto system = drive_error_dynamics(model, trackwidth, v);
                                const auto plant =
                                    discretize_zoh(system->A, system->B, Time(0.02)).value();
                                return lqr(plant.A, plant.B, Q, R).value().K(0, 0);
                              });
  const Eigen::MatrixXd Q_3 = bryson({0.0625, 0.125, 2.5}).value();
  const Eigen::MatrixXd R_2 = bryson({1.0, 2.0}).value();
  const double unicycle_designed =
      row("unicycle's gain by discretize and lqr", all, std::max(1, repetitions / 10),
          [&](const Question& q) {
            Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
            A(1, 2) = q.r.speeds.vx;
            Eigen::Matrix<double, 3, 2> B = Eigen::Matrix<double, 3, 2>::Zero();
            B(0, 0) = B(2, 1) = 1.0;
            const auto plant = discretize_zoh(A, B, Time(0.02)).value();
            return lqr(plant.A, plant.B, Q_3, R_2).value().K(0, 0);
          });
  std::printf("ratios to the design: unicycle %.0f, drive %.1f, scheduled drive %.0f\n",
              unicycle_designed / fast, designed / solved, designed / table);
  std::printf("the schedule is within %.1e of the solution%s\n", scheduled.schedule_error(),
              sink == 0.5 ? " " : "");
  return 0;
}
