#include <flyball/control/nonlinear/trajectory_lqr.hpp>

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include <flyball/control/nonlinear/operating_point.hpp>
#include <flyball/core/random.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::trajectory_lqr_test {
namespace {

/// A pendulum with a torque at its pivot: θ from hanging, 1 kg at 0.5 m.
struct Driven {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    return Eigen::Vector<Scalar, 2>{x(1), 4.0 * u(0) - 19.62 * sin(x(0)) - 0.1 * x(1)};
  }
};

/// An input that does not enter linearly.
struct Cubic {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    return Eigen::Vector<Scalar, 1>{u(0) * u(0) * u(0) + u(0) - x(0)};
  }
};

using One = Eigen::Vector<double, 1>;
constexpr double T = 0.02;

QuadraticCost cost() {
  return {Eigen::Vector2d(100.0, 4.0).asDiagonal(), Eigen::MatrixXd::Constant(1, 1, 0.5), {}};
}

/// From hanging over the top, by a torque that swings.
struct Swing {
  Eigen::MatrixXd x{2, 151};
  Eigen::MatrixXd u{1, 150};
  Swing() {
    x.col(0).setZero();
    for (Eigen::Index k = 0; k < 150; ++k) {
      u(0, k) = 3.0 * std::cos(1.5 * T * static_cast<double>(k));
      x.col(k + 1) = rk4(Driven{}, Eigen::Vector2d(x.col(k)), One(u.col(k)), T);
    }
  }
};

// (8.2): u₀ = -B⁺ f(x₀); at 30° the torque 19.62 sin 30°/4, found in one step.
TEST(OperatingPoint, HoldsAState) {
  const Eigen::Vector2d x(std::acos(-1.0) / 6.0, 0.0);
  const auto point = operating_point(Driven{}, x, One(0.0)).value();
  EXPECT_NEAR(point.model.u(0), 19.62 * 0.5 / 4.0, 1e-14);
  EXPECT_EQ(point.iterations, 1);
  EXPECT_TRUE(point.holds);
  EXPECT_NEAR(point.model.A(1, 0), -19.62 * std::cos(x(0)), 1e-13);
  EXPECT_EQ(point.model.B(1, 0), 4.0);
  // A velocity is no equilibrium: the torque can only stop the acceleration.
  const auto moving = operating_point(Driven{}, Eigen::Vector2d(0.0, 2.0), One(0.0)).value();
  EXPECT_FALSE(moving.holds);
  EXPECT_NEAR(moving.model.u(0), 0.05, 1e-14);
  EXPECT_NEAR(moving.model.c(0), 2.0, 1e-14);
  // u³ + u = 10 at u = 2.
  const auto cubic = operating_point(Cubic{}, One(10.0), One(0.0)).value();
  EXPECT_NEAR(cubic.model.u(0), 2.0, 1e-12);
  EXPECT_GT(cubic.iterations, 1);
}

// dx/dt is the affine model's to first order, exactly there.
TEST(OperatingPoint, AffineModel) {
  const Eigen::Vector2d x(0.7, -1.0);
  const auto model = affine_model(Driven{}, x, One(0.3)).value();
  EXPECT_LE((model.c - Driven{}.derivative(x, One(0.3))).norm(), 1e-15);
  const Eigen::Vector2d dx(1e-5, 2e-5);
  const Eigen::Vector2d f = Driven{}.derivative(Eigen::Vector2d(x + dx), One(0.3 + 1e-5));
  EXPECT_LE((f - (model.c + model.A * dx + model.B * One(1e-5))).norm(), 1e-8);
}

// Section 8.4's three steps hold the pendulum at 120°, where it would fall.
TEST(OperatingPoint, Regulator) {
  const Eigen::Vector2d up(2.1, 0.0);
  const auto regulator =
      regulate_about(Driven{}, up, One(0.0), bryson({0.1, 1.0}), bryson({5.0}), Time(T)).value();
  Eigen::Vector2d x(1.9, 0.3);
  for (int k = 0; k < 200; ++k) {
    const One u = regulator.point.model.u + regulator.design.K * (up - x);
    x = rk4(Driven{}, x, u, T);
  }
  EXPECT_LE((x - up).norm(), 1e-6);
  const auto refused = regulate_about(Driven{}, Eigen::Vector2d(0.0, 2.0), One(0.0),
                                      bryson({0.1, 1.0}), bryson({5.0}), Time(T));
  ASSERT_FALSE(refused);
  EXPECT_NE(to_string(refused.error()).find("no input holds"), std::string::npos);
  EXPECT_FALSE(operating_point(Driven{}, Eigen::Vector3d::Zero(), One(0.0)));
  EXPECT_FALSE(operating_point(Driven{}, Eigen::Vector2d(std::nan(""), 0.0), One(0.0)));
}

// A_k and B_k are the derivatives of the RK4 step itself, by dual numbers; the trajectory is the
// model's, so nothing is left.
TEST(TrajectoryLqr, LinearizationIsExact) {
  const Swing swing;
  const auto along = linearize_along(Driven{}, swing.x, swing.u, Time(T)).value();
  ASSERT_EQ(along.steps.size(), 150u);
  EXPECT_LE(along.defects.norm(), 1e-12);
  for (Eigen::Index k = 0; k < 150; k += 7) {
    const auto exact = jacobians(
        [](const auto& x, const auto& u) {
          using Scalar = ScalarOf<decltype(x), decltype(u)>;
          using State = Eigen::Vector<Scalar, 2>;
          return rk4([&](const State& at) { return State(Driven{}.derivative(at, u)); },
                     State(x.template cast<Scalar>()), T);
        },
        Eigen::Vector2d(swing.x.col(k)), One(swing.u.col(k)));
    const auto& step = along.steps[static_cast<std::size_t>(k)];
    EXPECT_LE((step.A - exact.by_x).norm(), 1e-13 * exact.by_x.norm());
    EXPECT_LE((step.B - exact.by_u).norm(), 1e-13 * exact.by_u.norm());
  }
}

// δx₀ᵀS₀δx₀ is what the regulator costs on the linear steps, and no other input costs less.
TEST(TrajectoryLqr, CostIsTheQuadraticForm) {
  const Swing swing;
  const auto design = trajectory_lqr(Driven{}, swing.x, swing.u, Time(T), cost(), cost().Q).value();
  const auto spent = [&](double other) {
    Eigen::Vector2d dx(0.1, -0.2);
    double sum = 0.0;
    for (std::size_t k = 0; k < 150; ++k) {
      const One du = -design.regulator.K[k] * dx + One(k == 20 ? other : 0.0);
      sum += dx.dot(cost().Q * dx) + du.dot(cost().R * du);
      dx = (design.model.steps[k].A * dx + design.model.steps[k].B * du).eval();
    }
    return sum + dx.dot(cost().Q * dx);
  };
  const Eigen::Vector2d dx(0.1, -0.2);
  const double form = dx.dot(design.regulator.S[0] * dx);
  EXPECT_NEAR(spent(0.0), form, 1e-12 * form);
  EXPECT_GT(spent(0.01), form);
  EXPECT_GT(spent(-0.01), form);
}

// About an equilibrium that is held it is the regulator of the sampled linear plant.
TEST(TrajectoryLqr, OfAPointIsTheRegulator) {
  const Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2, 201);
  const Eigen::MatrixXd u = Eigen::MatrixXd::Zero(1, 200);
  const auto design = trajectory_lqr(Driven{}, x, u, Time(T), cost(), cost().Q).value();
  const auto model = affine_model(Driven{}, Eigen::Vector2d::Zero(), One(0.0)).value();
  const auto plant = discretize_zoh(model.A, model.B, Time(T)).value();
  const auto stationary = lqr(plant.A, plant.B, cost().Q, cost().R).value();
  EXPECT_LE((design.regulator.K[0] - stationary.K).norm(), 1e-6 * stationary.K.norm());
}

// The nonlinear pendulum, started elsewhere, comes back to the swing; without feedback it does not.
TEST(TrajectoryRegulator, FollowsTheSwing) {
  const Swing swing;
  const auto design = trajectory_lqr(Driven{}, swing.x, swing.u, Time(T), cost(), cost().Q).value();
  const auto regulator =
      TrajectoryRegulator<2, 1>::create(design, One(-12.0), One(12.0), {true, false}).value();
  Eigen::Vector2d x(0.4, 0.5);
  Eigen::Vector2d open = x;
  for (std::size_t k = 0; k < 150; ++k) {
    const One u = regulator.calculate(k, x);
    EXPECT_LE(std::abs(u(0)), 12.0);
    // A turn more is the same angle.
    EXPECT_NEAR(regulator.calculate(k, x + Eigen::Vector2d(2.0 * std::acos(-1.0), 0.0))(0), u(0),
                1e-9);
    x = rk4(Driven{}, x, u, T);
    open = rk4(Driven{}, open, One(swing.u.col(static_cast<Eigen::Index>(k))), T);
  }
  EXPECT_LE((x - swing.x.col(150)).norm(), 1e-3);
  EXPECT_GE((open - swing.x.col(150)).norm(), 0.1);
  EXPECT_EQ(regulator.step_at(0.06), 3u);
  EXPECT_EQ(regulator.step_at(-1.0), 0u);
  EXPECT_EQ(regulator.step_at(std::nan("")), 0u);
  EXPECT_EQ(regulator.step_at(1e300), 150u);
  EXPECT_EQ(regulator.reference(150), Eigen::Vector2d(swing.x.col(150)));
  const One lost = regulator.calculate(3, Eigen::Vector2d::Constant(std::nan("")));
  EXPECT_EQ(lost(0), swing.u(0, 3));
  if (test::counts_allocations()) {
    const test::AllocationCounter counter;
    EXPECT_TRUE(std::isfinite(regulator.calculate(7, x)(0)));
    EXPECT_EQ(counter.count(), 0u);
  }
}

TEST(TrajectoryLqr, Errors) {
  const Swing swing;
  const auto refused = [&](const Eigen::MatrixXd& x, const Eigen::MatrixXd& u, double period) {
    const auto design = trajectory_lqr(Driven{}, x, u, Time(period), cost(), cost().Q);
    return design ? std::string() : to_string(design.error());
  };
  EXPECT_EQ(refused(swing.x, swing.u, T), "");
  EXPECT_NE(refused(swing.x.leftCols(150), swing.u, T), "");
  EXPECT_NE(refused(swing.x, swing.u.leftCols(0), T), "");
  EXPECT_NE(refused(swing.x, swing.u, 0.0), "");
  Eigen::MatrixXd x = swing.x;
  x(1, 30) = std::nan("");
  EXPECT_NE(refused(x, swing.u, T), "");
  const auto design = trajectory_lqr(Driven{}, swing.x, swing.u, Time(T), cost(), cost().Q).value();
  EXPECT_FALSE((TrajectoryRegulator<2, 1>::create(design, One(1.0), One(-1.0))));
  EXPECT_FALSE((TrajectoryRegulator<1, 1>::create(design, One(-1.0), One(1.0))));
}

}  // namespace
}  // namespace flyball::trajectory_lqr_test
