#include <flyball/systems/model.hpp>

#include <cmath>
#include <limits>

#include <flyball/math/integration/adaptive.hpp>
#include <flyball/systems/any_model.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::model_test {
namespace {

using Eigen::Vector2d;
using Vector1 = Eigen::Vector<double, 1>;

/// Twenty lines of a user: θ'' = -g/l sin θ - c θ' + u, measured by the bob's sideways deflection.
struct Swing {
  double g = 9.81;
  double l = 0.5;
  double c = 0.1;

  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  [[nodiscard]] Eigen::Vector3d parameters() const { return {g, l, c}; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    return Eigen::Vector<ScalarOf<X, U, P>, 2>{x(1), -p(0) / p(1) * sin(x(0)) - p(2) * x(1) + u(0)};
  }
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U& u) const {
    return output(x, u, parameters());
  }
  template <class X, class U, class P>
  [[nodiscard]] auto output(const X& x, const U&, const P& p) const {
    return Eigen::Vector<ScalarOf<X, U, P>, 1>{p(1) * sin(x(0))};
  }
  [[nodiscard]] ModelDescription description() const {
    return {.name = "swing",
            .states = {{"angle", "rad", true}, {"rate", "rad/s"}},
            .outputs = {{"deflection", "m"}},
            .parameters = {{"g", "m/s^2"}, {"l", "m"}, {"c", "1/s"}}};
  }
};

/// A chain of n integrators, whose size is known at run time.
struct Chain {
  Eigen::Index n = 3;
  [[nodiscard]] Eigen::Index states() const { return n; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    Eigen::Matrix<ScalarOf<X, U>, Eigen::Dynamic, 1> dxdt(n);
    dxdt.head(n - 1) = x.tail(n - 1);
    dxdt(n - 1) = ScalarOf<X, U>(u(0));
    return dxdt;
  }
};

static_assert(Model<Swing> && ModelWithOutput<Swing> && ParametricModel<Swing>);
static_assert(Model<Chain> && !ModelWithOutput<Chain> && !ParametricModel<Chain>);
static_assert(Model<AnyModel> && ModelWithOutput<AnyModel> && !ParametricModel<AnyModel>);
static_assert(Model<ContinuousSystem<>> && Model<ContinuousSystem<2, 1, 1>>);
static_assert(!Model<double> && !Model<DiscreteSystem<2, 1, 1>>);
static_assert(StateOf<ContinuousSystem<3, 1, 2>>::RowsAtCompileTime == 3);
static_assert(StateOf<Chain>::RowsAtCompileTime == Eigen::Dynamic);
static_assert(output_count(Swing{}) == 1);

const Vector2d x0(0.7, -0.3);
const Vector1 u0(0.4);

/// By hand at (x0, u0): ∂f/∂x = [0 1; -g/l cos θ, -c], ∂h/∂x = [l cos θ, 0].
TEST(Model, LinearizesExactly) {
  const auto system = linearize(Swing{}, x0, u0).value();
  static_assert(std::is_same_v<std::decay_t<decltype(system)>, ContinuousSystem<2, 1, 1>>);
  const Eigen::Matrix2d A{{0.0, 1.0}, {-9.81 / 0.5 * std::cos(0.7), -0.1}};
  EXPECT_TRUE(system.A.isApprox(A, 1e-15));
  EXPECT_EQ(system.B, Vector2d(0.0, 1.0));
  EXPECT_TRUE(system.C.isApprox(Eigen::RowVector2d(0.5 * std::cos(0.7), 0.0), 1e-15));
  EXPECT_EQ(system.D(0), 0.0);
  // Dynamic vectors, and the model behind AnyModel, give the same bits.
  const auto erased =
      linearize(AnyModel(Swing{}), Eigen::VectorXd(x0), Eigen::VectorXd(u0)).value();
  EXPECT_EQ(erased.A, Eigen::MatrixXd(system.A));
  EXPECT_EQ(erased.B, Eigen::MatrixXd(system.B));
  EXPECT_EQ(erased.C, Eigen::MatrixXd(system.C));
  EXPECT_EQ(erased.D, Eigen::MatrixXd(system.D));
}

TEST(Model, AnyModelIsTheModel) {
  const Swing swing;
  const AnyModel model = swing;
  EXPECT_EQ(model.states(), 2);
  EXPECT_EQ(model.inputs(), 1);
  EXPECT_EQ(model.outputs(), 1);
  EXPECT_EQ(model.derivative(x0, u0), Eigen::VectorXd(swing.derivative(x0, u0)));
  EXPECT_EQ(model.output(x0, u0), Eigen::VectorXd(swing.output(x0, u0)));
  EXPECT_EQ(model.parameters(), Eigen::VectorXd(swing.parameters()));

  // ∂f/∂p = [0 0 0; -sin θ/l, g sin θ/l², -θ'], ∂h/∂p = [0, sin θ, 0].
  Eigen::MatrixXd F(2, 3);
  Eigen::MatrixXd H(1, 3);
  model.parameter_jacobians(x0, u0, F, H);
  const double s = std::sin(0.7);
  EXPECT_TRUE(
      F.isApprox(Eigen::MatrixXd{{0.0, 0.0, 0.0}, {-s / 0.5, 9.81 * s / 0.25, 0.3}}, 1e-15));
  EXPECT_TRUE(H.isApprox(Eigen::MatrixXd{{0.0, s, 0.0}}, 1e-15));

  // A copy with another value leaves the first one as it was.
  const AnyModel longer = model.with_parameter("l", 2.0).value();
  EXPECT_EQ(longer.derivative(x0, u0), Eigen::VectorXd(Swing{.l = 2.0}.derivative(x0, u0)));
  EXPECT_EQ(longer.description().parameters[1].value, 2.0);
  EXPECT_EQ(model.description().parameters[1].value, 0.5);
  EXPECT_EQ(model.with_parameters(Eigen::Vector3d(9.81, 2.0, 0.1)).value().parameters(),
            longer.parameters());
}

// Its own Jacobians are asked for the parameters that the copy has: dx/dt = k x, A = k.
struct Growth {
  double k = 1.0;
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  [[nodiscard]] Eigen::Vector<double, 1> parameters() const { return Eigen::Vector<double, 1>(k); }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return derivative(x, u, parameters());
  }
  template <class X, class U, class P>
  auto derivative(const X& x, const U&, const P& p) const {
    return Eigen::Vector<ScalarOf<X, U, P>, 1>(p(0) * x(0));
  }
  template <class X, class U, class A, class B>
  void jacobians(const X&, const U&, A&& by_x, B&& by_u) const {
    by_x(0, 0) = k;
    by_u(0, 0) = 0.0;
  }
};

TEST(Model, JacobiansFollowTheParameters) {
  const AnyModel model = AnyModel(Growth{}).with_parameter("p1", 5.0).value();
  const Eigen::VectorXd x = Eigen::VectorXd::Constant(1, 2.0);
  Eigen::MatrixXd A(1, 1);
  Eigen::MatrixXd B(1, 1);
  model.jacobians(x, Eigen::VectorXd::Zero(1), A, B);
  EXPECT_EQ(model.derivative(x, Eigen::VectorXd::Zero(1))(0), 10.0);
  EXPECT_EQ(A(0, 0), 5.0);
}

TEST(Model, ALinearSystemIsOne) {
  const ContinuousSystem<2, 1, 1> system{Eigen::Matrix2d{{0.0, 1.0}, {-2.0, -3.0}},
                                         Vector2d(0.5, 1.0), Eigen::RowVector2d(1.0, 4.0),
                                         Vector1(0.25)};
  // A x + B u = [-0.3 + 0.2, -1.4 + 0.9 + 0.4], C x + D u = 0.7 - 1.2 + 0.1.
  EXPECT_TRUE(system.derivative(x0, u0).isApprox(Vector2d(-0.1, -0.1), 1e-15));
  EXPECT_NEAR(system.output(x0, u0)(0), -0.4, 1e-15);
  const AnyModel model = system;
  EXPECT_TRUE(model.derivative(x0, u0).isApprox(system.derivative(x0, u0), 1e-15));
  EXPECT_TRUE(model.output(x0, u0).isApprox(system.output(x0, u0), 1e-15));
  for (const auto& same :
       {linearize(model, x0, u0).value(),
        linearize(ContinuousSystem<>{system.A, system.B, system.C, system.D}, x0, u0).value()}) {
    EXPECT_EQ(same.A, Eigen::MatrixXd(system.A));
    EXPECT_EQ(same.B, Eigen::MatrixXd(system.B));
    EXPECT_EQ(same.C, Eigen::MatrixXd(system.C));
    EXPECT_EQ(same.D, Eigen::MatrixXd(system.D));
  }
}

TEST(Model, SizesKnownAtRunTime) {
  const AnyModel model = Chain{4};
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(4, 1.0, 4.0);
  EXPECT_EQ(model.states(), 4);
  EXPECT_EQ(model.outputs(), 4);
  EXPECT_EQ(model.derivative(x, u0), Eigen::VectorXd(Eigen::Vector4d(2.0, 3.0, 4.0, 0.4)));
  EXPECT_EQ(model.output(x, u0), x);
  const auto system = linearize(Chain{4}, x, u0).value();
  Eigen::Matrix4d shift = Eigen::Matrix4d::Zero();
  shift.topRightCorner<3, 3>().setIdentity();
  EXPECT_EQ(system.A, Eigen::MatrixXd(shift));
  EXPECT_EQ(system.B, Eigen::MatrixXd(Eigen::Vector4d::Unit(3)));
  EXPECT_EQ(system.C, Eigen::MatrixXd::Identity(4, 4));
}

TEST(Model, DescriptionsAreComplete) {
  const ModelDescription swing = describe(Swing{.l = 0.8});
  EXPECT_EQ(swing.name, "swing");
  EXPECT_EQ(label(swing.states[0]), "angle (rad)");
  EXPECT_TRUE(swing.states[0].is_angle);
  EXPECT_EQ(label(swing.inputs[0]), "u1");
  EXPECT_EQ(label(swing.outputs[0]), "deflection (m)");
  EXPECT_EQ(swing.parameters[1].unit, "m");
  EXPECT_EQ(swing.parameters[1].value, 0.8);
  const ModelDescription chain = describe(Chain{});
  EXPECT_EQ(chain.states[2].name, "x3");
  EXPECT_EQ(chain.outputs[2].name, "x3");  // the output is the state
  const ModelDescription linear = describe(ContinuousSystem<2, 1, 1>{});
  EXPECT_EQ(linear.states[1].name, "x2");
  EXPECT_EQ(linear.outputs[0].name, "y1");
  const ModelDescription again = describe(AnyModel(Swing{.l = 0.8}));
  EXPECT_EQ(again.parameters[1].value, 0.8);
  EXPECT_EQ(again.outputs[0].name, "deflection");
}

/// dx/dt = √x, which has no value for a negative state.
struct Root {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{sqrt(x(0)) + u(0)};
  }
};

/// Promises three states and answers with two.
struct Short {
  static Eigen::Index states() { return 3; }
  static Eigen::Index inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U&) const {
    return x.head(2).eval();
  }
};

TEST(Model, WhatIsNoModelIsRefusedWhereItEnters) {
  const auto check = [](const auto& model, const auto& x, const auto& u) {
    return check_model(model, x, u, "simulate", 1.5).error();
  };
  for (const Error& error :
       {check(Root{}, Vector1(-1.0), u0), check(AnyModel(Root{}), Vector1(-1.0), u0)}) {
    EXPECT_TRUE(error.is(ArgumentError::not_finite));
    EXPECT_EQ(to_string(error),
              "simulate: the derivative of x1 of the model is nan at t = 1.5 s; it must be finite "
              "(t = 1.5, x = -1, u = 0.4)");
  }
  for (const Error& error : {check(Short{}, Eigen::Vector3d::Zero(), u0),
                             check(AnyModel(Short{}), Eigen::Vector3d::Zero(), u0)}) {
    EXPECT_TRUE(error.is(ArgumentError::wrong_shape));
    EXPECT_EQ(
        to_string(error),
        "simulate: the derivative of the model is 2x1 at t = 1.5 s; it must be of the size of "
        "the state (3x1) (t = 1.5, x = [0, 0, 0], u = 0.4)");
  }
  const Eigen::VectorXd three = Eigen::Vector3d::Zero();
  const Eigen::VectorXd two = x0;
  EXPECT_TRUE(check(Swing{}, three, u0).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(check(Swing{}, two, two).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(check(Swing{}, Vector2d(NAN, 0.0), u0).is(ArgumentError::not_finite));
  EXPECT_TRUE(check(AnyModel(Swing{}), x0, Vector1(INFINITY)).is(ArgumentError::not_finite));
  EXPECT_TRUE(linearize(Root{}, Vector1(-1.0), u0).error().is(ArgumentError::not_finite));
  // The value is finite, the derivative is not: named by its matrix.
  EXPECT_EQ(linearize(Root{}, Vector1(0.0), u0).error().subject(), "A(0, 0)");
  EXPECT_TRUE(linearize(AnyModel(Short{}), Eigen::Vector3d::Zero(), u0)
                  .error()
                  .is(ArgumentError::wrong_shape));
  // What skips the check reads nothing beyond the short answer.
  EXPECT_TRUE(AnyModel(Short{}).derivative(Eigen::Vector3d::Zero(), u0).array().isNaN().all());
  const AnyModel swing = Swing{};
  EXPECT_TRUE(swing.with_parameter("mass", 1.0).error().is(ArgumentError::unknown_name));
  EXPECT_TRUE(swing.with_parameter("l", NAN).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(swing.with_parameters(x0).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(AnyModel(Chain{}).with_parameter("l", 1.0).error().is(ArgumentError::unknown_name));
}

// Energy per mass and length², θ'²/2 - g/l cos θ, is constant without damping and input; the
// steppers and the adaptive integrator agree to their tolerances.
TEST(Model, IsIntegrated) {
  const Swing swing{.c = 0.0};
  const Vector1 none(0.0);
  const auto energy = [&](const auto& x) {
    return 0.5 * x(1) * x(1) - swing.g / swing.l * std::cos(x(0));
  };
  Vector2d x = x0;
  Eigen::VectorXd x_any = x0;
  ModelStepper stepper(swing);
  for (int i = 0; i < 2000; ++i) {
    x = rk4(swing, x, none, 1e-3);
    stepper.step(x_any, none, 1e-3);
  }
  EXPECT_NEAR(energy(x), energy(x0), 1e-9);
  EXPECT_TRUE(x.isApprox(Vector2d(x_any), 1e-14));
  IntegrationOptions options{.relative_tolerance = 1e-12, .absolute_tolerance = 1e-13};
  for (const auto method : {IntegrationMethod::dormand_prince, IntegrationMethod::radau}) {
    options.method = method;
    const auto solution = integrate(with_input(swing, none), 0.0, x0, 2.0, options).value();
    EXPECT_TRUE(x.isApprox(Vector2d(solution.final_state()), 1e-9));
    const auto erased = integrate(with_input(AnyModel(swing), none), 0.0, x0, 2.0, options).value();
    EXPECT_TRUE(solution.final_state().isApprox(erased.final_state(), 1e-9));
    EXPECT_EQ(erased.statistics().jacobians > 0, method == IntegrationMethod::radau);
  }
  // An input that changes: θ' of a free rate under u = t is θ'(0) + t²/2.
  const auto ramp = [](double t) { return Vector1(t); };
  const auto pushed = integrate(with_input(Swing{.g = 0.0, .c = 0.0}, ramp), 0.0, x0, 1.0).value();
  EXPECT_NEAR(pushed.final_state()(1), -0.3 + 0.5, 1e-6);
}

TEST(Model, AllocatesNothingInTheLoop) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "the sanitizers bring their own allocator";
  }
  const ContinuousSystem<2, 1, 1> linear{Eigen::Matrix2d::Identity(), x0, x0.transpose(), u0};
  for (const AnyModel& model : {AnyModel(Swing{}), AnyModel(linear)}) {
    Eigen::VectorXd x = x0;
    const Eigen::VectorXd u = u0;
    Eigen::VectorXd dxdt(2);
    Eigen::VectorXd y(1);
    Eigen::MatrixXd A(2, 2);
    Eigen::MatrixXd B(2, 1);
    Eigen::MatrixXd C(1, 2);
    Eigen::MatrixXd D(1, 1);
    Eigen::MatrixXd F(2, model.parameters().size());
    Eigen::MatrixXd H(1, model.parameters().size());
    ModelStepper stepper(model);
    const test::AllocationCounter counter;
    model.derivative(x, u, dxdt);
    model.output(x, u, y);
    model.jacobians(x, u, A, B);
    model.output_jacobians(x, u, C, D);
    model.parameter_jacobians(x, u, F, H);
    stepper.step(x, u, 1e-3);
    EXPECT_EQ(counter.count(), 0u);
  }
}

TEST(Model, AnglesGoTheShorterWayRound) {
  EXPECT_NEAR(angle_difference(3.0, -3.0), 6.0 - 2.0 * M_PI, 1e-15);
  EXPECT_EQ(angle_difference(0.25, 0.5), -0.25);
  const Dual<1> angle = angle_difference(Dual<1>::variable(3.0, 0), Dual<1>(-3.0));
  EXPECT_NEAR(angle.value, 6.0 - 2.0 * M_PI, 1e-15);
  EXPECT_EQ(angle.gradient(0), 1.0);
  Vector2d difference(6.0, 6.0);
  wrap_angles(difference, describe(Swing{}).states);
  EXPECT_NEAR(difference(0), 6.0 - 2.0 * M_PI, 1e-15);
  EXPECT_EQ(difference(1), 6.0);
}

}  // namespace
}  // namespace flyball::model_test
