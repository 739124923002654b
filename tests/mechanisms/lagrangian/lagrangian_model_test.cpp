#include <flyball/mechanisms/lagrangian/lagrangian_model.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/mechanisms/lagrangian/planar_linkage.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/systems/any_model.hpp>
#include <flyball/systems/linearize.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::lagrangian_model_test {
namespace {

using namespace flyball::literals;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Input = Eigen::Vector<double, 1>;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The single-jointed arm of 13.1, its energies written down: a damped pendulum with parameters.
struct Bob {
  double m = 2.0, l = 0.5, c = 0.1, g = 9.81;
  static constexpr int coordinates() { return 1; }
  [[nodiscard]] Vector4d parameters() const { return {m, l, c, g}; }
  template <class Q, class V, class P>
  auto kinetic_energy(const Q&, const V& v, const P& p) const {
    return 0.5 * p(0) * p(1) * p(1) * v(0) * v(0);
  }
  template <class Q, class P>
  auto potential_energy(const Q& q, const P& p) const {
    return -p(0) * p(3) * p(1) * cos(q(0));
  }
  template <class Q, class V, class P>
  auto dissipation(const Q&, const V& v, const P& p) const {
    return 0.5 * p(2) * v(0) * v(0);
  }
  [[nodiscard]] ModelDescription description() const {
    return {.name = "bob", .states = {{"angle", "rad", true}, {"rate", "rad/s"}}};
  }
};

/// The cart-pole of 13.3 as places of masses.
struct Cart {
  double m_c = 5.0, m_p = 0.5, l = 0.5;
  static constexpr int coordinates() { return 2; }
  [[nodiscard]] std::array<PlanarBody, 2> bodies() const { return {{{m_c, 0.0}, {m_p, 0.0}}}; }
  template <class Q>
  auto poses(const Q& q) const {
    using S = typename Q::Scalar;
    using std::cos, std::sin;
    return std::array<PlanarPose<S>, 2>{
        {{q(0), S(0.0), S(0.0)}, {q(0) + l * sin(q(1)), -l * cos(q(1)), q(1)}}};
  }
  [[nodiscard]] Vector2d input_matrix() const { return {1.0, 0.0}; }
};

TEST(LagrangianModel, SingleJointedArm) {
  const auto model = lagrangian_model(Bob{}).value();
  const Pendulum by_hand{2.0, 0.5, 0.1, 9.81};
  Random random(131);
  for (int trial = 0; trial < 50; ++trial) {
    const Vector2d x(random.uniform(-pi, pi), random.normal(0.0, 5.0));
    const Input u(random.normal(0.0, 3.0));
    EXPECT_TRUE(model.derivative(x, u).isApprox(by_hand.derivative(x, u), 1e-14));
    const Input q(x(0));
    EXPECT_NEAR(model.mass_matrix(q)(0, 0), 0.5, 1e-15);
    EXPECT_EQ(model.coriolis_matrix(q, Input(x(1)))(0, 0), 0.0);
    EXPECT_NEAR(model.gravity_vector(q)(0), 9.81 * std::sin(x(0)), 1e-13);
  }
}

// As texts have it: M = [m_c + m_p, m_p l cos θ; ., m_p l²], C = [0, -m_p l θ̇ sin θ; 0, 0],
// G = [0; m_p g l sin θ].
TEST(LagrangianModel, CartPoleFromPlaces) {
  const auto model = planar_model(Cart{}).value();
  const auto by_hand =
      cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm}).value();
  Random random(133);
  for (int trial = 0; trial < 100; ++trial) {
    const Vector4d x(random.normal(), random.uniform(-pi, pi), random.normal(0.0, 3.0),
                     random.normal(0.0, 8.0));
    const Vector2d q = x.head<2>();
    const Vector2d v = x.tail<2>();
    const double s = std::sin(q(1));
    const double c = std::cos(q(1));
    EXPECT_LT((model.mass_matrix(q) - Matrix2d{{5.5, 0.25 * c}, {0.25 * c, 0.125}}).norm(), 1e-14);
    EXPECT_LT((model.coriolis_matrix(q, v) - Matrix2d{{0.0, -0.25 * v(1) * s}, {0.0, 0.0}}).norm(),
              1e-13);
    EXPECT_LT((model.gravity_vector(q) - Vector2d(0.0, 0.25 * standard_gravity * s)).norm(), 1e-14);
    const Input F(random.normal(0.0, 20.0));
    const Vector4d expected = by_hand.derivative(x, F);
    EXPECT_LT((model.derivative(x, F) - expected).norm(), 1e-12 * (1.0 + expected.norm()));
  }
  static_assert(decltype(model)::inputs() == 1 && decltype(model)::states() == 4);
}

// Its exact Jacobians, through duals below the duals, are those of the closed form.
TEST(LagrangianModel, LinearisesExactly) {
  const auto model = planar_model(Cart{}).value();
  const auto by_hand =
      cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm}).value();
  Random random(82);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector4d x(random.normal(), random.uniform(-pi, pi), random.normal(), random.normal());
    const Input F(random.normal(0.0, 20.0));
    const auto tool = linearize(model, x, F).value();
    const auto closed = linearize(by_hand, x, F).value();
    EXPECT_LT((tool.A - closed.A).norm(), 1e-12 * (1.0 + closed.A.norm()));
    EXPECT_LT((tool.B - closed.B).norm(), 1e-13);
  }
}

// Parameters are differentiated as in any model: ∂ω̇/∂m, ∂l, ∂c, ∂g of the pendulum.
TEST(LagrangianModel, ParametersAreTheEnergies) {
  const AnyModel model = lagrangian_model(Bob{}).value();
  const AnyModel by_hand = Pendulum{2.0, 0.5, 0.1, 9.81};
  EXPECT_EQ(model.names().name, "bob");
  EXPECT_TRUE(model.names().states[0].is_angle);
  Eigen::MatrixXd F(2, 4), H(2, 4), F_hand(2, 4), H_hand(1, 4);
  model.parameter_jacobians(Vector2d(0.7, 2.0), Input(1.5), F, H);
  by_hand.parameter_jacobians(Vector2d(0.7, 2.0), Input(1.5), F_hand, H_hand);
  EXPECT_LT((F - F_hand).norm(), 1e-13);
}

// dM/dt - 2 C is skew, C v is the bias of the equations of motion, the energy's rate is the power.
TEST(LagrangianModel, ChristoffelSymbols) {
  const auto model = planar_model(PlanarChain<3>{{uniform_rod(0.4, 1.0), uniform_rod(0.3, 0.7),
                                                  point_mass_link(0.2, 0.5)},
                                                 -pi / 2.0})
                         .value();
  using Vector3 = Eigen::Vector3d;
  Random random(13);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Vector<double, 6> x;
    for (double& entry : x) {
      entry = random.normal(0.0, 2.0);
    }
    const Vector3 q = x.head<3>();
    const Vector3 v = x.tail<3>();
    const Eigen::Matrix3d C = model.coriolis_matrix(q, v);
    const Eigen::Matrix3d M = model.mass_matrix(q);
    using D = Dual<1>;
    Eigen::Vector<D, 3> along;
    for (int i = 0; i < 3; ++i) {
      along(i) = q(i) + v(i) * D::variable(0.0, 0);
    }
    const auto moving = model.mass_matrix(along);
    Eigen::Matrix3d rate;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        rate(i, j) = moving(i, j).gradient(0);
      }
    }
    const Eigen::Matrix3d skew = rate - 2.0 * C;
    EXPECT_LT((skew + skew.transpose()).norm(), 1e-12);
    const Vector3 a(random.normal(), random.normal(), random.normal());
    EXPECT_LT((model.forces(q, v, a) - (M * a + C * v + model.gravity_vector(q))).norm(), 1e-12);
    const Vector3 u(random.normal(), random.normal(), random.normal());
    const auto slope = gradient([&](const auto& at) { return model.energy(at); }, x);
    EXPECT_NEAR(slope.dot(model.derivative(x, u)), u.dot(v), 1e-11 * (1.0 + x.squaredNorm()));
  }
}

TEST(LagrangianModel, DoesNotAllocate) {
  const auto model = planar_model(Cart{}).value();
  const Vector4d x(0.1, 2.0, 0.3, 0.4);
  const test::AllocationCounter allocations;
  const Vector4d dxdt = model.derivative(x, Input(1.0));
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  EXPECT_TRUE(dxdt.allFinite());
}

/// Energies that are wrong in one way or another.
struct Odd {
  double linear = 0.0, offset = 0.0, potential = 1.0;
  static constexpr int coordinates() { return 1; }
  template <class Q, class V>
  auto kinetic_energy(const Q&, const V& v) const {
    return 0.5 * v(0) * v(0) * (1.0 + offset * v(0) * v(0)) + linear * v(0);
  }
  template <class Q>
  auto potential_energy(const Q& q) const {
    return potential * q(0);
  }
};

TEST(LagrangianModel, Errors) {
  EXPECT_TRUE(lagrangian_model(Odd{}).has_value());
  EXPECT_TRUE(lagrangian_model(Odd{.linear = 0.3}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(lagrangian_model(Odd{.offset = 0.3}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(lagrangian_model(Odd{.offset = nan}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(lagrangian_model(Odd{.potential = nan}).error().is(ArgumentError::not_finite));
  // A link without mass has no equation of its own.
  const auto chain = [](double first, double second) {
    return planar_model(
        PlanarChain<2>{{point_mass_link(1.0, first), point_mass_link(1.0, second)}});
  };
  EXPECT_TRUE(chain(1.0, 1.0).has_value());
  const Error massless = chain(1.0, 0.0).error();
  EXPECT_TRUE(massless.is(ArgumentError::not_positive));
  EXPECT_NE(to_string(massless).find("lagrangian_model: the mass matrix is not positive definite: "
                                     "coordinate 2 moves nothing"),
            std::string::npos)
      << to_string(massless);
  EXPECT_NE(to_string(chain(0.0, 0.0).error()).find("coordinate 1 moves no mass"),
            std::string::npos);
  // Folded or straight, a massless first link under a point mass is singular.
  EXPECT_TRUE(chain(0.0, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(chain(1.0, -1.0).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::mechanisms::lagrangian_model_test
