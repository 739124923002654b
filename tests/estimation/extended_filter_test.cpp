#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/forms/square_root_covariance.hpp>
#include <flyball/estimation/model_filter.hpp>
#include <flyball/systems/any_model.hpp>
#include <flyball/systems/linearize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::extended_filter_test {
namespace {

using Vector1 = Eigen::Matrix<double, 1, 1>;

/// dx/dt = [x2, -9.81 sin(x1) + u], its angle measured.
struct Pendulum {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(1), -9.81 * sin(x(0)) + u(0)};
  }
  template <class X, class U>
  auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{x(0)};
  }
  ModelDescription description() const {
    return {.states = {{"angle", "rad", true}, {"velocity", "rad/s"}},
            .outputs = {{"angle", "rad", true}}};
  }
};

/// The same with Jacobians of its own.
struct PendulumWithJacobians : Pendulum {
  template <class X, class U, class A, class B>
  void jacobians(const X& x, const U&, A& of_x, B& of_u) const {
    of_x(0, 0) = 0.0;
    of_x(0, 1) = 1.0;
    of_x(1, 0) = -9.81 * std::cos(x(0));
    of_x(1, 1) = 0.0;
    of_u(0, 0) = 0.0;
    of_u(1, 0) = 1.0;
  }
};

const Eigen::Matrix2d Q = Eigen::Vector2d(1e-6, 1e-4).asDiagonal();
const Eigen::Matrix2d P0 = Eigen::Vector2d(0.5, 0.2).asDiagonal();
const Eigen::Vector2d x0(0.9, -0.4);

template <class M>
auto filter_of(const M& model, const ProcessNoise& noise = Eigen::MatrixXd(Q)) {
  return ExtendedKalmanFilter<M>::create(model, noise, Vector1(1e-3), {x0, P0}, Time(0.05)).value();
}

// F is the derivative of the RK4 step, here by central differences of it (error h² = 1e-10).
TEST(ExtendedKalmanFilter, LinearisesTheStep) {
  auto filter = filter_of(Pendulum{});
  auto own = filter_of(PendulumWithJacobians{});
  const Vector1 u(0.7);
  ASSERT_TRUE(filter.predict(u));
  ASSERT_TRUE(own.predict(u));
  const auto step = [&](const Eigen::Vector2d& x) {
    return rk4(
        [&](const Eigen::Vector2d& at) { return Eigen::Vector2d(Pendulum{}.derivative(at, u)); }, x,
        0.05);
  };
  EXPECT_LT((filter.x_hat() - step(x0)).norm(), 1e-15);
  Eigen::Matrix2d F;
  for (int j = 0; j < 2; ++j) {
    const Eigen::Vector2d h = 1e-5 * Eigen::Vector2d::Unit(j);
    F.col(j) = (step(x0 + h) - step(x0 - h)) / 2e-5;
  }
  EXPECT_LT((filter.F() - F).norm(), 1e-9);
  EXPECT_LT((own.F() - filter.F()).norm(), 1e-15);
  EXPECT_LT((own.x_hat() - filter.x_hat()).norm(), 1e-15);
  EXPECT_LT((filter.P() - (F * P0 * F.transpose() + Q)).norm(), 1e-9);
}

// A density over a step is (7.8): of the double integrator q [T³/3, T²/2; T²/2, T], to Simpson's
// order for the pendulum.
TEST(ExtendedKalmanFilter, IntegratesADensity) {
  ContinuousSystem<2, 1, 1> cart;
  cart.A << 0.0, 1.0, 0.0, 0.0;
  cart.B << 0.0, 1.0;
  cart.C << 1.0, 0.0;
  cart.D << 0.0;
  const Eigen::Matrix2d density = Eigen::Vector2d(0.0, 3.0).asDiagonal();
  auto filter = ExtendedKalmanFilter<ContinuousSystem<2, 1, 1>>::create(
                    cart, ProcessDensity{density}, Vector1(1.0),
                    {x0, Eigen::MatrixXd(Eigen::Matrix2d::Zero())}, Time(0.1))
                    .value();
  filter.predict(Vector1(0.0), 0.3);
  const double T = 0.3;
  Eigen::Matrix2d exact;
  exact << T * T * T / 3.0, T * T / 2.0, T * T / 2.0, T;
  EXPECT_LT((filter.P() - 3.0 * exact).norm(), 1e-14);

  auto swing = ExtendedKalmanFilter<Pendulum>::create(
                   Pendulum{}, ProcessDensity{density}, Vector1(1.0),
                   {x0, Eigen::MatrixXd(Eigen::Matrix2d::Zero())}, Time(0.05))
                   .value();
  const auto linear = linearize(Pendulum{}, x0, Vector1(0.0)).value();
  swing.predict(Vector1(0.0));
  const Eigen::Matrix2d of_linear =
      discretize(linear.A, ProcessDensity{density}, Time(0.05)).value();
  EXPECT_LT((swing.P() - of_linear).norm(), 2e-3 * of_linear.norm());
}

// A covariance per sample is that of one period: half a period brings half of it.
TEST(ExtendedKalmanFilter, StepsOfAnyLength) {
  auto whole = filter_of(Pendulum{});
  auto halves = filter_of(Pendulum{});
  whole.predict(Vector1(0.2));
  halves.predict(Vector1(0.2), 0.025);
  halves.predict(Vector1(0.2), 0.025);
  // RK4's error of one step of 50 ms, and where the noise enters.
  EXPECT_LT((whole.x_hat() - halves.x_hat()).norm(), 1e-5);
  EXPECT_LT((whole.P() - halves.P()).norm(), 1e-5);
  const Eigen::Vector2d before = whole.x_hat();
  EXPECT_TRUE(whole.predict(Vector1(0.2), 0.0));
  EXPECT_EQ(whole.x_hat(), before);
  for (const double bad : {-0.1, std::nan(""), 1e300}) {
    EXPECT_FALSE(whole.predict(Vector1(0.2), bad));
    EXPECT_EQ(whole.x_hat(), before);
  }
}

// The input's error reaches the states by ∂φ/∂u, of the double integrator (T²/2, T).
TEST(ExtendedKalmanFilter, TakesNoiseOfTheInput) {
  ContinuousSystem<2, 1, 1> cart;
  cart.A << 0.0, 1.0, 0.0, 0.0;
  cart.B << 0.0, 1.0;
  cart.C << 1.0, 0.0;
  cart.D << 0.0;
  auto filter = ExtendedKalmanFilter<ContinuousSystem<2, 1, 1>>::create(
                    cart, Eigen::MatrixXd(Eigen::Matrix2d::Zero()), Vector1(1.0),
                    {x0, Eigen::MatrixXd(Eigen::Matrix2d::Zero())}, Time(0.1), Vector1(4.0))
                    .value();
  filter.predict(Vector1(1.0));
  const Eigen::Vector2d G(0.005, 0.1);
  EXPECT_LT((filter.P() - 4.0 * G * G.transpose()).norm(), 1e-15);
}

// y = 3.1, the state -3.1: the innovation is 6.2 - 2 pi, not 6.2.
TEST(ExtendedKalmanFilter, AnglesGoTheShorterWayRound) {
  auto filter = filter_of(Pendulum{});
  ASSERT_TRUE(filter.reset(Eigen::Vector2d(-3.1, 0.0)));
  auto other = filter;
  EXPECT_NEAR(filter.correct(Vector1(3.1), Vector1(0.0)).innovation(0),
              6.2 - 2.0 * std::numbers::pi, 1e-14);
  const auto by_hand = other.correct(
      Vector1(3.1), [](const auto& x) { return x.template head<1>().eval(); },
      MeasurementNoise<1>(Vector1(1e-3)), {}, AngleDifference<0>{});
  EXPECT_NEAR(by_hand.innovation(0), 6.2 - 2.0 * std::numbers::pi, 1e-14);
  EXPECT_EQ(filter.x_hat(), other.x_hat());
}

/// Distance to a beacon at the origin.
const auto range = [](const auto& x) {
  using Scalar = typename std::decay_t<decltype(x)>::Scalar;
  return Eigen::Matrix<Scalar, 1, 1>(sqrt(x(0) * x(0) + x(1) * x(1)));
};

// The iterated update ends at the minimum of (x - x0)ᵀ P⁻¹ (x - x0) + (y - h(x))²/R: there its
// gradient is zero. One update alone is off by a lot.
TEST(ExtendedKalmanFilter, IteratesToTheMostProbableState) {
  const double y = 3.0;
  const double R = 1e-4;
  const auto slope = [&](const Eigen::Vector2d& x) {
    const Eigen::Vector2d h = x.normalized();
    return Eigen::Vector2d(P0.inverse() * (x - x0) - h * (y - x.norm()) / R);
  };
  auto once = filter_of(Pendulum{});
  auto iterated = filter_of(Pendulum{});
  const MeasurementNoise<1> noise{Vector1(R)};
  EXPECT_TRUE(once.correct(Vector1(y), range, noise).accepted());
  EXPECT_TRUE(iterated.correct(Vector1(y), range, noise, {.iterations = 50}).accepted());
  EXPECT_GT(slope(once.x_hat()).norm(), 1.0);
  EXPECT_LT(slope(iterated.x_hat()).norm(), 1e-4);
  // P is that of the last linearisation: h P hᵀ ≈ R there.
  const Eigen::Vector2d h = iterated.x_hat().normalized();
  EXPECT_NEAR(h.dot(iterated.P() * h), R, 1e-3 * R);
}

// A model whose size is known at run time only, and one in a square root, are the same filter.
TEST(ExtendedKalmanFilter, AnyModelInAnyForm) {
  auto filter = filter_of(Pendulum{});
  auto root = ExtendedKalmanFilter<Pendulum, SquareRootCovariance<2>>::create(
                  Pendulum{}, Eigen::MatrixXd(Q), Vector1(1e-3), {x0, P0}, Time(0.05))
                  .value();
  auto any = ExtendedKalmanFilter<AnyModel>::create(AnyModel(Pendulum{}), Eigen::MatrixXd(Q),
                                                    Vector1(1e-3), {x0, P0}, Time(0.05))
                 .value();
  Random random(3);
  for (int k = 0; k < 100; ++k) {
    const Vector1 u(random.normal());
    const Vector1 y(0.5 * random.normal());
    filter.predict(u);
    root.predict(u);
    any.predict(u);
    filter.correct(y, u);
    root.correct(y, u);
    any.correct(Eigen::VectorXd(y), Eigen::VectorXd(u));
    ASSERT_LT((root.x_hat() - filter.x_hat()).norm(), 1e-10);
    ASSERT_LT((Eigen::Vector2d(any.x_hat()) - filter.x_hat()).norm(), 1e-10);
    ASSERT_LT((root.P() - filter.P()).norm(), 1e-10);
    ASSERT_LT((Eigen::Matrix2d(any.P()) - filter.P()).norm(), 1e-10);
  }
}

TEST(ExtendedKalmanFilter, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  auto filter = filter_of(Pendulum{}, ProcessDensity{Q});
  const MeasurementNoise<1> noise{Vector1(1e-2)};
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    filter.predict(Vector1(0.1));
    filter.correct(Vector1(0.2), Vector1(0.1));
    filter.correct(Vector1(1.0), range, noise, {.iterations = 3});
  }
  EXPECT_EQ(counter.count(), 0u);
}

TEST(ExtendedKalmanFilter, Errors) {
  const auto created = [](const Eigen::MatrixXd& noise, const Eigen::MatrixXd& R,
                          const Eigen::Vector2d& x, const Eigen::MatrixXd& P, double period) {
    return ExtendedKalmanFilter<Pendulum>::create(Pendulum{}, noise, R, {x, P}, Time(period));
  };
  EXPECT_TRUE(created(Q, Vector1(1.0), x0, P0, 0.05));
  EXPECT_TRUE(created(Q, Q, x0, P0, 0.05).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      created(Vector1(1.0), Vector1(1.0), x0, P0, 0.05).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      created(Q, Vector1(1.0), x0, Vector1(1.0), 0.05).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(created(-Q, Vector1(1.0), x0, P0, 0.05).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(created(Q, Vector1(-1.0), x0, P0, 0.05).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(created(Q, Vector1(1.0), x0, -P0, 0.05).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(created(Q, Vector1(1.0), {std::nan(""), 0.0}, P0, 0.05)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(created(Q, Vector1(1.0), x0, P0, 0.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(
      created(Q, Vector1(1.0), x0, 1e201 * P0, 0.05).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(ExtendedKalmanFilter<Pendulum>::create(Pendulum{}, standard_deviations({-1.0}),
                                                     Vector1(1.0), {x0, P0}, Time(0.05))
                  .error()
                  .is(ArgumentError::out_of_range));
}

}  // namespace
}  // namespace flyball::extended_filter_test
