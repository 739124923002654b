// Motions that are best, of mechanisms as they are (chapter 17): a lift in least time within its
// voltage, a double-jointed arm around an obstacle, and the same arm swung up.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include <flyball/mechanisms/double_jointed_arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/optimization/ocp/continuous_solution.hpp>

namespace {

using namespace flyball;
using namespace flyball::literals;
using namespace flyball::optimization;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Eigen::VectorXd;

constexpr double pi = std::numbers::pi;
constexpr double inf = std::numeric_limits<double>::infinity();

bool show(const char* what, const Expected<ContinuousSolution>& solution) {
  if (!solution || !solution->solved()) {
    std::fprintf(stderr, "%s: %s\n", what,
                 solution ? solution->message.c_str() : to_string(solution.error()).c_str());
    return false;
  }
  std::printf("%-28s %.4f s, %d iterations, each interval within %.1e of an integrator\n", what,
              solution->duration, solution->counts.iterations, solution->largest_error);
  return true;
}

}  // namespace

int main() {
  //! [lift]
  // 25 kg up by 1.5 m in least time, within 12 V: kA dv/dt = u - kV v - kG, the elevator's own
  // gains.
  const auto elevator = mechanisms::elevator({.motor = mechanisms::motor("NEO", 2).value(),
                                              .gearing = 6.0,
                                              .mass = 25_kg,
                                              .drum_radius = 1_in})
                            .value();
  const mechanisms::FeedforwardGains gains = elevator.gains;
  ContinuousProblem lift(2, 1);
  lift.set_derivative([&](const auto& x, const auto& u) {
    return std::array<Expression, 2>{x(1), (u(0) - gains.kV * x(1) - gains.kG) / gains.kA};
  });
  lift.bound_inputs(VectorXd::Constant(1, -12.0), VectorXd::Constant(1, 12.0));
  lift.fix_start(Vector2d(0.0, 0.0));
  lift.fix_end(Vector2d(1.5, 0.0));
  lift.free_duration(0.1, 10.0, 1.0);
  lift.minimize_time();
  const auto up = solve(lift, {.method = Transcription::multiple_shooting, .intervals = 40});
  //! [lift]
  lift.fix_end(Vector2d(-1.5, 0.0));
  const auto down = solve(lift, {.method = Transcription::multiple_shooting, .intervals = 40});
  if (!show("lift, up", up) || !show("lift, down", down)) {
    return 1;
  }

  //! [arm]
  // Two links of half a metre; from straight ahead to straight up, the hand around a post.
  const mechanisms::JointParameters joint{.motor = mechanisms::motor("NEO").value(),
                                          .gearing = 60.0,
                                          .length = 0.5_m,
                                          .mass = 4_kg,
                                          .center_of_mass = 0.25_m,
                                          .moment_of_inertia = MomentOfInertia(0.083)};
  const auto arm = mechanisms::double_jointed_arm({.first = joint, .second = joint}).value();
  const Vector2d post(0.75, 0.6);
  const double clear = 0.15;
  const double spare = 0.01;  // between two points of the mesh
  ContinuousProblem around(4, 2);
  around.set_derivative(arm);
  around.bound_inputs(Vector2d(-12.0, -12.0), Vector2d(12.0, 12.0));
  around.fix_start(Vector4d(0.0, 0.0, 0.0, 0.0));
  around.fix_end(Vector4d(0.5 * pi, 0.0, 0.0, 0.0));
  around.add_path_constraint(
      [&](const auto& x) {
        const auto hand_x = 0.5 * cos(x(0)) + 0.5 * cos(x(0) + x(1)) - post(0);
        const auto hand_y = 0.5 * sin(x(0)) + 0.5 * sin(x(0) + x(1)) - post(1);
        return hand_x * hand_x + hand_y * hand_y;
      },
      VectorXd::Constant(1, (clear + spare) * (clear + spare)), VectorXd::Constant(1, inf),
      "the post");
  // It looks first where the elbow bends: there is another way, around the far side.
  Eigen::MatrixXd bent(4, 3);
  bent << 0.0, 0.25 * pi, 0.5 * pi, 0.0, 1.5, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0;
  around.set_guess(Eigen::Vector3d(0.0, 0.5, 1.0), bent, Eigen::MatrixXd(2, 0));
  around.free_duration(0.1, 10.0, 1.0);
  around.minimize_time();
  around.set_running_cost([](const auto&, const auto& u) {
    return 1e-5 * (u(0) * u(0) + u(1) * u(1));  // of what is equally fast the gentlest
  });
  const auto hand = solve(around, {.method = Transcription::multiple_shooting, .intervals = 40});
  //! [arm]
  if (!show("arm, around a post", hand)) {
    return 1;
  }
  double nearest = inf;
  const PhaseTrajectory& way = hand->phases[0];
  for (int i = 0; i <= 400; ++i) {
    const VectorXd x = way.state(hand->duration * i / 400.0);
    const Vector2d at(0.5 * std::cos(x(0)) + 0.5 * std::cos(x(0) + x(1)),
                      0.5 * std::sin(x(0)) + 0.5 * std::sin(x(0) + x(1)));
    nearest = std::min(nearest, (at - post).norm());
  }
  std::printf("%-28s the hand comes within %.4f m of the post, whose radius is %.2f m\n", "",
              nearest, clear);

  //! [swing]
  // With a tenth of the torque it cannot lift itself: it swings.
  mechanisms::DoubleJointedArm weak = arm;
  weak.first.gain *= 0.1;
  weak.second.gain *= 0.1;
  weak.first.damping *= 0.1 * 0.1;
  weak.second.damping *= 0.1 * 0.1;
  ContinuousProblem swing(4, 2);
  swing.set_derivative(weak);
  swing.bound_inputs(Vector2d(-12.0, -12.0), Vector2d(12.0, 12.0));
  swing.fix_start(Vector4d(-0.5 * pi, 0.0, 0.0, 0.0));
  swing.fix_end(Vector4d(0.5 * pi, 0.0, 0.0, 0.0));
  swing.set_running_cost(
      [](const auto&, const auto& u) { return (u(0) * u(0) + u(1) * u(1)) / 144.0; });
  swing.set_duration(3.0);
  TranscriptionOptions options{.method = Transcription::multiple_shooting, .intervals = 30};
  options.error_tolerance = 1e-5;  // the mesh is divided where it has to be
  const auto stands = solve(swing, options);
  //! [swing]
  if (!show("arm, swung up", stands)) {
    return 1;
  }
  std::printf("%-28s on %d intervals after %d refinements\n", "",
              static_cast<int>(stands->phases[0].times.size()) - 1, stands->refinements);
  const double holds = weak.gravity_vector(Vector2d(0.0, 0.0))(0) / weak.first.gain;
  const bool is_weak = holds > 12.0;
  return down->duration < up->duration && nearest > clear && is_weak && stands->accurate ? 0 : 1;
}
