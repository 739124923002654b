// A model behind the concept against the same step written by hand over plain doubles: one RK4 step
// of the cart-pole, its Jacobians, and what AnyModel adds; and the same model by formula, whose
// budget is 3 times the compiled one a step.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/simulation/mechanism_plant.hpp>
#include <flyball/systems/formula_model.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "timing.hpp"

namespace {

using bench::microseconds;
using namespace flyball;
using Eigen::Vector4d;
using Input = Eigen::Vector<double, 1>;

// By hand: four doubles, no library.
struct HandWritten {
  double m_c, m_p, l, g;
  using State = std::array<double, 4>;

  [[nodiscard]] State derivative(const State& x, double u) const {
    const double s = std::sin(x[1]);
    const double c = std::cos(x[1]);
    const double push = u + m_p * l * x[3] * x[3] * s;
    const double inertia = m_c + m_p * s * s;
    return {x[2], x[3], (push + m_p * g * s * c) / inertia,
            -(push * c + (m_c + m_p) * g * s) / (l * inertia)};
  }
  [[nodiscard]] State step(const State& x, double u, double dt) const {
    const auto ahead = [&](const State& k, double h) {
      State at;
      for (std::size_t i = 0; i < 4; ++i) {
        at[i] = x[i] + h * k[i];
      }
      return at;
    };
    const State k1 = derivative(x, u);
    const State k2 = derivative(ahead(k1, 0.5 * dt), u);
    const State k3 = derivative(ahead(k2, 0.5 * dt), u);
    const State k4 = derivative(ahead(k3, dt), u);
    State next;
    for (std::size_t i = 0; i < 4; ++i) {
      next[i] = x[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
    return next;
  }
  /// ∂f/∂x and ∂f/∂u by hand, the lower two rows; the upper ones are [0 I], 0.
  void jacobian(const State& x, double u, Eigen::Matrix4d& A, Vector4d& B) const {
    const double s = std::sin(x[1]);
    const double c = std::cos(x[1]);
    const double rate = x[3];
    const double push = u + m_p * l * rate * rate * s;
    const double inertia = m_c + m_p * s * s;
    const double push_angle = m_p * l * rate * rate * c;
    const double push_rate = 2.0 * m_p * l * rate * s;
    const double inertia_angle = 2.0 * m_p * s * c;
    const double cart = (push + m_p * g * s * c) / inertia;
    const double pole = -(push * c + (m_c + m_p) * g * s) / (l * inertia);
    A.setZero();
    A(0, 2) = A(1, 3) = 1.0;
    A(2, 1) = (push_angle + m_p * g * (c * c - s * s) - cart * inertia_angle) / inertia;
    A(2, 3) = push_rate / inertia;
    A(3, 1) = -(push_angle * c - push * s + (m_c + m_p) * g * c) / (l * inertia) -
              pole * inertia_angle / inertia;
    A(3, 3) = -push_rate * c / (l * inertia);
    B = {0.0, 0.0, 1.0 / inertia, -c / (l * inertia)};
  }
};

const ModelFormulas formulas{
    .name = "cart-pole",
    .states = {{"x", "m"}, {"theta", "rad", true}, {"v", "m/s"}, {"omega", "rad/s"}},
    .inputs = {{"F", "N"}},
    .parameters = {{"m_c", "kg", 5.0},
                   {"m_p", "kg", 0.5},
                   {"l", "m", 0.5},
                   {"g", "m/s^2", 9.80665}},
    .definitions = {{"s", "sin(theta)"},
                    {"c", "cos(theta)"},
                    {"push", "F + m_p*l*omega^2*s"},
                    {"inertia", "m_c + m_p*s^2"}},
    .derivatives = {{"x", "v"},
                    {"theta", "omega"},
                    {"v", "(push + m_p*g*s*c)/inertia"},
                    {"omega", "-(push*c + (m_c + m_p)*g*s)/(l*inertia)"}}};

constexpr int calls = 20000;

template <class Work>
void least(double& time, Work&& work) {
  time = std::min(time, microseconds(calls, work));
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 200;
  const mechanisms::CartPole model{5.0, 0.5, 0.5, 9.80665};
  const HandWritten hand{5.0, 0.5, 0.5, 9.80665};
  const double dt = 1e-3;
  const Input u(0.1);
  const Vector4d x0(0.0, 0.3, 0.0, 0.0);

  HandWritten::State x_hand{0.0, 0.3, 0.0, 0.0};
  Vector4d x = x0;
  Eigen::VectorXd x_any = x0;
  const Eigen::VectorXd u_any = u;
  Eigen::VectorXd x_formula = x0;
  ModelStepper stepper(model);
  ModelStepper by_formula(formula_model(formulas).value());
  Eigen::Matrix4d A_hand;
  Vector4d B_hand;
  Eigen::MatrixXd A(4, 4);
  Eigen::MatrixXd B(4, 1);
  mechanisms::MechanismState arm_state{0.1, 0.0};
  mechanisms::MechanismState lift_state{0.1, 0.0};
  const mechanisms::FeedforwardGains gains{.kS = 0.2, .kV = 1.5, .kA = 0.3, .kG = 0.6};
  const auto arm = MechanismPlant::create(mechanisms::MechanismKind::arm, gains).value();
  const auto lift = MechanismPlant::create(mechanisms::MechanismKind::elevator, gains).value();

  double by_hand = 1e300, concept_step = 1e300, erased_step = 1e300, formula_step = 1e300,
         jacobian_formula = 1e300, jacobian_hand = 1e300, jacobian_dual = 1e300, arm_step = 1e300,
         lift_step = 1e300;
  double sink = 0.0;
  for (int r = 0; r < repetitions; ++r) {
    least(by_hand, [&] { x_hand = hand.step(x_hand, u(0), dt); });
    least(concept_step, [&] { x = rk4(model, x, u, dt); });
    least(erased_step, [&] { stepper.step(x_any, u_any, dt); });
    least(formula_step, [&] { by_formula.step(x_formula, u_any, dt); });
    least(jacobian_hand, [&] {
      x_hand[1] += 1e-9;
      hand.jacobian(x_hand, u(0), A_hand, B_hand);
      sink += A_hand(3, 1);
    });
    least(jacobian_dual, [&] {
      x_any(1) += 1e-9;
      stepper.model().jacobians(x_any, u_any, A, B);
      sink += A(3, 1);
    });
    least(jacobian_formula, [&] {
      x_any(1) += 1e-9;
      by_formula.model().jacobians(x_any, u_any, A, B);
      sink += A(3, 1);
    });
    // Back and forth, so that nothing comes to rest.
    int k = 0;
    least(arm_step, [&] { arm_state = arm.step(arm_state, ++k % 500 < 250 ? 4.0 : -3.0, 1e-3); });
    least(lift_step,
          [&] { lift_state = lift.step(lift_state, ++k % 500 < 250 ? 4.0 : -3.0, 1e-3); });
  }
  x_hand = {0.0, 0.3, 0.0, 0.0};
  x = x0;
  x_any = x_formula = x0;
  for (int i = 0; i < 1000; ++i) {
    x_hand = hand.step(x_hand, u(0), dt);
    x = rk4(model, x, u, dt);
    stepper.step(x_any, u_any, dt);
    by_formula.step(x_formula, u_any, dt);
  }
  double difference = 0.0;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double exact = x_hand[static_cast<std::size_t>(i)];
    difference = std::max({difference, std::abs(x(i) - exact), std::abs(x_any(i) - exact),
                           std::abs(x_formula(i) - exact)});
  }
  hand.jacobian({x_any(0), x_any(1), x_any(2), x_any(3)}, u(0), A_hand, B_hand);
  stepper.model().jacobians(x_any, u_any, A, B);

  std::printf("cart-pole, minima in nanoseconds, ratio to the same by hand\n");
  const auto row = [](const char* what, double time, double peer) {
    std::printf("%-42s %9.1f %9.2f\n", what, 1e3 * time, time / peer);
  };
  row("RK4 step, by hand", by_hand, by_hand);
  row("RK4 step, the model", concept_step, by_hand);
  row("RK4 step, AnyModel", erased_step, by_hand);
  row("RK4 step, by formula behind AnyModel", formula_step, by_hand);
  row("A and B, by hand", jacobian_hand, jacobian_hand);
  row("A and B, dual numbers behind AnyModel", jacobian_dual, jacobian_hand);
  row("A and B, by formula behind AnyModel", jacobian_formula, jacobian_hand);
  std::printf(
      "a step by formula costs %.2f of the compiled one behind AnyModel, %.2f of it alone\n",
      formula_step / erased_step, formula_step / concept_step);
  std::printf("states differ by %.1e, A by %.1e\n\n", difference, (A - A_hand).norm());
  std::printf("1 ms of an arm %.1f ns, of an elevator %.1f ns%s\n", 1e3 * arm_step, 1e3 * lift_step,
              sink == 0.5 ? " " : "");
  return 0;
}
