#include <flyball/systems/linearize.hpp>

#include <cmath>

namespace flyball::linearize_test {
namespace {

using Eigen::Vector2d;
using Input = Eigen::Vector<double, 1>;

/// The pendulum of section 8.5: θ'' = -g/l sin θ + u, with l = 0.5 m.
const auto pendulum = [](const auto& x, const auto& u) {
  using Scalar = typename std::decay_t<decltype(x)>::Scalar;
  return Eigen::Vector<Scalar, 2>{x(1), -9.81 / 0.5 * sin(x(0)) + u(0)};
};

// ∂f/∂x = [0 1; -g/l cos θ 0] (section 8.5); upright: +g/l.
TEST(Linearize, PendulumUpright) {
  const auto system = linearize(pendulum, Vector2d(M_PI, 0.0), Input(0.0)).value();
  EXPECT_TRUE(system.A.isApprox(Eigen::Matrix2d{{0.0, 1.0}, {19.62, 0.0}}, 1e-15));
  EXPECT_EQ(system.B, Vector2d(0.0, 1.0));
  EXPECT_EQ(system.C, Eigen::Matrix2d::Identity());
  EXPECT_EQ(system.D, Vector2d(0.0, 0.0));
  static_assert(std::is_same_v<std::decay_t<decltype(system)>, ContinuousSystem<2, 1, 2>>);
  EXPECT_FALSE(is_stable(system).value());
}

TEST(Linearize, WithOutputs) {
  // The height of the bob, and the input itself.
  const auto h = [](const auto& x, const auto& u) {
    using Scalar = typename std::decay_t<decltype(x)>::Scalar;
    return Eigen::Vector<Scalar, 2>{-0.5 * cos(x(0)), 3.0 * u(0)};
  };
  const auto system = linearize(pendulum, h, Vector2d(0.3, 0.1), Input(2.0)).value();
  EXPECT_TRUE(system.C.isApprox(Eigen::Matrix2d{{0.5 * std::sin(0.3), 0.0}, {0.0, 0.0}}, 1e-15));
  EXPECT_EQ(system.D, Vector2d(0.0, 3.0));
  static_assert(std::is_same_v<std::decay_t<decltype(system)>, ContinuousSystem<2, 1, 2>>);
}

TEST(Linearize, ALinearModelIsItself) {
  {
    const bool holds = rc::check("A x + B u", [] {
      const auto entries = *rc::gen::container<std::vector<double>>(
          12, rc::gen::map(rc::gen::inRange(-1000, 1000), [](int i) { return i / 7.0; }));
      const Eigen::MatrixXd A = Eigen::Map<const Eigen::Matrix2d>(entries.data());
      const Eigen::MatrixXd B = Eigen::Map<const Eigen::Matrix2d>(entries.data() + 4);
      const Eigen::VectorXd x = Vector2d::Map(entries.data() + 8);
      const Eigen::VectorXd u = Vector2d::Map(entries.data() + 10);
      const auto f = [&](const auto& at, const auto& in) { return (A * at + B * in).eval(); };
      const auto exact = linearize(f, x, u).value();
      RC_ASSERT(exact.A == A);
      RC_ASSERT(exact.B == B);
      const auto black_box = [&](const Eigen::Ref<const Eigen::VectorXd>& at,
                                 const Eigen::Ref<const Eigen::VectorXd>& in,
                                 Eigen::Ref<Eigen::VectorXd> dxdt) { dxdt = A * at + B * in; };
      const auto differenced = numerical_linearize(black_box, x, u).value();
      const double scale = 1.0 + A.norm() + B.norm();
      RC_ASSERT((differenced.A - A).norm() < 1e-9 * scale);
      RC_ASSERT((differenced.B - B).norm() < 1e-9 * scale);
      RC_ASSERT(differenced.C == Eigen::MatrixXd::Identity(2, 2));
    });
    EXPECT_TRUE(holds);
  }
}

TEST(Linearize, FixedDynamicAndDifferencesAgree) {
  const Vector2d x(0.8, -2.0);
  const Input u(1.5);
  const auto fixed = linearize(pendulum, x, u).value();
  const auto dynamic = linearize(pendulum, Eigen::VectorXd(x), Eigen::VectorXd(u)).value();
  EXPECT_EQ(Eigen::MatrixXd(fixed.A), Eigen::MatrixXd(dynamic.A));
  EXPECT_EQ(Eigen::MatrixXd(fixed.B), Eigen::MatrixXd(dynamic.B));
  const auto black_box =
      [](const Eigen::Ref<const Eigen::VectorXd>& at, const Eigen::Ref<const Eigen::VectorXd>& in,
         Eigen::Ref<Eigen::VectorXd> dxdt) { dxdt << at(1), -19.62 * std::sin(at(0)) + in(0); };
  const auto differenced = numerical_linearize(black_box, x, u).value();
  EXPECT_LT((differenced.A - fixed.A).norm(), 1e-11);
  EXPECT_LT((differenced.B - fixed.B).norm(), 1e-11);
}

TEST(Linearize, Refusals) {
  EXPECT_TRUE(
      linearize(pendulum, Vector2d(NAN, 0.0), Input(0.0)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(linearize(pendulum, Vector2d(0.0, 0.0), Input(INFINITY))
                  .error()
                  .is(ArgumentError::not_finite));
  const auto root = [](const auto& x, const auto& u) {
    using Scalar = typename std::decay_t<decltype(x)>::Scalar;
    return Eigen::Vector<Scalar, 1>{sqrt(x(0)) + u(0)};
  };
  EXPECT_TRUE(linearize(root, Input(0.0), Input(0.0)).error().is(ArgumentError::not_finite));
  const auto short_one = [](const auto& x, const auto&) { return x.head(1).eval(); };
  EXPECT_TRUE(linearize(short_one, Eigen::VectorXd(Vector2d(0.0, 0.0)), Eigen::VectorXd(Input(0.0)))
                  .error()
                  .is(ArgumentError::wrong_shape));
  const auto broken = [](const Eigen::Ref<const Eigen::VectorXd>&,
                         const Eigen::Ref<const Eigen::VectorXd>&,
                         Eigen::Ref<Eigen::VectorXd> dxdt) { dxdt.setConstant(NAN); };
  EXPECT_TRUE(numerical_linearize(broken, Vector2d(0.0, 0.0), Input(0.0))
                  .error()
                  .is(DifferentiationError::not_finite));
}

}  // namespace
}  // namespace flyball::linearize_test
