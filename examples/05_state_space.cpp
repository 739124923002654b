// A double integrator (section 6.8) as a system: its poles, what its input reaches, and the closed
// loop that a placed gain makes of it (6.3); then an input that carries an unknown push, seen by an
// augmented model (6.7.2).
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/control/observer_placement.hpp>
#include <flyball/control/pole_placement.hpp>
#include <flyball/control/response_metrics.hpp>
#include <flyball/estimation/observer.hpp>
#include <flyball/systems/augment.hpp>
#include <flyball/systems/controllability.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/response.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;

  //! [system]
  ContinuousSystem<> cart;
  cart.A = Eigen::Matrix2d{{0.0, 1.0}, {0.0, 0.0}};  // dx/dt = v
  cart.B = Eigen::Vector2d(0.0, 1.0);                // dv/dt = a
  cart.C = Eigen::RowVector2d(1.0, 0.0);             // y = x
  cart.D = Eigen::MatrixXd::Zero(1, 1);
  const auto reach = analyze_controllability(cart.A, cart.B, TimeDomain::continuous).value();
  //! [system]
  std::printf("%s: its input reaches %d of 2 states\n",
              is_stable(cart).value() ? "stable" : "not stable", static_cast<int>(reach.rank));

  //! [closed_loop]
  const auto placed = place(cart.A, cart.B, {{-3.0, 2.0}, {-3.0, -2.0}}).value();
  const auto loop = closed_loop(cart, placed.K).value();  // A - BK, BK, C - DK, DK
  const auto step = step_response(loop, 0, ResponseTimes{Time(0.001), 3000}).value();
  //! [closed_loop]
  const Eigen::VectorXd y = step.y.col(0);
  const auto metrics = response_metrics({step.time.data(), 3000}, {y.data(), 3000}, 1.0).value();
  std::printf("K = [%.0f, %.0f]: rises in %.2f s, overshoots by %.2f %%\n", placed.K(0),
              placed.K(1), metrics.rise_time.value(), 100.0 * metrics.overshoot);

  //! [augment]
  const auto augmented = discretize(augment_input_error(cart).value(), 10_ms).value();
  const auto gain = place_observer(augmented, Eigen::Vector3cd(0.8, 0.81, 0.82)).value();
  LuenbergerObserver<> observer(augmented, gain.L);
  const auto plant = discretize(cart, 10_ms).value();
  Eigen::VectorXd x = Eigen::Vector2d::Zero();
  const double push = 0.7;  // m/s², which nobody told the model
  for (int k = 0; k < 200; ++k) {
    const Eigen::VectorXd u = Eigen::VectorXd::Constant(1, std::sin(0.05 * k));
    observer.step(u, plant.C * x);
    x = (plant.A * x + plant.B * (u.array() + push).matrix()).eval();
  }
  //! [augment]
  std::printf("u_error is estimated as %.4f m/s^2, it is %.1f\n", observer.x_hat()(2), push);
  return reach.rank == 2 &&
                 std::abs(metrics.overshoot - std::exp(-3.0 * std::numbers::pi / 2.0)) < 1e-3 &&
                 std::abs(observer.x_hat()(2) - push) < 1e-6
             ? 0
             : 1;
}
