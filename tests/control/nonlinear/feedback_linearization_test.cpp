#include <flyball/control/nonlinear/feedback_linearization.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::feedback_linearization_test {
namespace {

/// A mass on a telescope: x = [r, φ, dr/dt, dφ/dt], u = [force along r, torque about the pivot].
struct Telescope {
  double mass = 2.0;
  static constexpr int states() { return 4; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    return Eigen::Vector<Scalar, 4>{
        x(2), x(3), u(0) / mass + x(0) * x(3) * x(3) - 9.81 * sin(x(1)),
        (u(1) / (mass * x(0)) - 2.0 * x(2) * x(3) - 9.81 * cos(x(1))) / x(0)};
  }
};

/// A thruster whose force is the square of its input.
struct Squared {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    using Scalar = ScalarOf<X, U>;
    return Eigen::Vector<Scalar, 1>{u(0) * u(0) - x(0)};
  }
};

using Linearization = FeedbackLinearization<Telescope>;
constexpr double infinity = std::numeric_limits<double>::infinity();

Linearization::ErrorGain second_order(double k_p, double k_d) {
  Linearization::ErrorGain gain = Linearization::ErrorGain::Zero();
  gain.bottomLeftCorner<2, 2>().diagonal().setConstant(k_p);
  gain.bottomRightCorner<2, 2>().diagonal().setConstant(k_d);
  return gain;
}

Linearization telescope(double k_p = 25.0, double k_d = 10.0, double limit = infinity) {
  return Linearization::create({}, second_order(k_p, k_d), Eigen::Vector2d::Constant(-limit),
                               Eigen::Vector2d::Constant(limit), {1.0, 0.3, 0.0, 0.0})
      .value();
}

// u = B⁺(ṙ + Λ(r - x) - f): by hand for the telescope, F = m(v_r - r φ'² + g sin φ),
// τ = m r (r v_φ + 2 r' φ' + g cos φ).
TEST(FeedbackLinearization, IsComputedTorque) {
  Random random(1);
  const auto law = telescope();
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector4d x(random.uniform(0.5, 2.0), random.uniform(-3.0, 3.0),
                            random.uniform(-1.0, 1.0), random.uniform(-2.0, 2.0));
    const Eigen::Vector4d r = Eigen::Vector4d::NullaryExpr([&] { return random.normal(); });
    const Eigen::Vector4d rate = Eigen::Vector4d::NullaryExpr([&] { return random.normal(); });
    const Eigen::Vector2d v = rate.tail<2>() + 25.0 * (r - x).head<2>() + 10.0 * (r - x).tail<2>();
    const Eigen::Vector2d expected(
        2.0 * (v(0) - x(0) * x(3) * x(3) + 9.81 * std::sin(x(1))),
        2.0 * x(0) * (x(0) * v(1) + 2.0 * x(2) * x(3) + 9.81 * std::cos(x(1))));
    ASSERT_LE((law.calculate(x, r, rate) - expected).norm(), 1e-12 * expected.norm());
    // And the model then accelerates as it was told.
    const Eigen::Vector4d moves = Telescope{}.derivative(x, law.calculate(x, r, rate));
    ASSERT_LE((moves.tail<2>() - v).norm(), 1e-12 * (1.0 + v.norm() + x.norm()));
  }
}

// The error is that of ë + 10 ė + 25 e = 0: e(t) = e₀ (1 + 5t) e^{-5t} from rest, whatever the
// reference does. Held over 0.1 ms, the input leaves an error of that order.
TEST(FeedbackLinearization, ErrorsAreLinear) {
  const auto law = telescope();
  constexpr double dt = 1e-4;
  const auto reference = [](double t) -> Eigen::Vector4d {
    return {1.2 + 0.3 * std::sin(t), std::cos(2.0 * t), 0.3 * std::cos(t),
            -2.0 * std::sin(2.0 * t)};
  };
  const auto rate = [](double t) -> Eigen::Vector4d {
    return {0.3 * std::cos(t), -2.0 * std::sin(2.0 * t), -0.3 * std::sin(t),
            -4.0 * std::cos(2.0 * t)};
  };
  Eigen::Vector4d x = reference(0.0) + Eigen::Vector4d(0.2, -0.4, 0.0, 0.0);
  for (int k = 0; k < 10000; ++k) {
    const double t = k * dt;
    if (k % 1000 == 0) {
      const Eigen::Vector4d e = x - reference(t);
      const double decay = (1.0 + 5.0 * t) * std::exp(-5.0 * t);
      EXPECT_NEAR(e(0), 0.2 * decay, 2e-4) << t;
      EXPECT_NEAR(e(1), -0.4 * decay, 4e-4) << t;
    }
    x = rk4(Telescope{}, x, law.calculate(x, reference(t), rate(t)), dt);
  }
}

TEST(FeedbackLinearization, WithinLimitsAndFiniteWhateverComes) {
  const auto law = telescope(25.0, 10.0, 30.0);
  const double bad[] = {std::nan(""), infinity, 1e300, -1e100};
  Random random(2);
  for (int k = 0; k < 1000; ++k) {
    Eigen::Vector<double, 12> all =
        Eigen::Vector<double, 12>::NullaryExpr([&] { return random.uniform(-3.0, 3.0); });
    all(k % 12) = bad[k % 4];
    const Eigen::Vector2d u = law.calculate(all.head<4>(), all.segment<4>(4), all.tail<4>());
    ASSERT_TRUE(u.allFinite());
    ASSERT_LE(u.cwiseAbs().maxCoeff(), 30.0);
  }
  if (test::counts_allocations()) {
    const Eigen::Vector4d x(1.0, 0.2, 0.1, 0.3);
    const test::AllocationCounter counter;
    EXPECT_TRUE(law.calculate(x, x, x).allFinite());
    EXPECT_EQ(counter.count(), 0u);
  }
}

// More inputs than one need, and inputs that act alike: the least-squares input exists.
TEST(FeedbackLinearization, LeastSquaresInput) {
  Eigen::Matrix<double, 3, 2> B;
  B << 1.0, 2.0, 0.0, 1.0, 0.0, 0.0;
  const Eigen::Vector2d u = detail::least_squares_input<3, 2>(B, {3.0, 1.0, 7.0});
  EXPECT_LE((u - Eigen::Vector2d(1.0, 1.0)).norm(), 1e-15);
  B.col(1) = 2.0 * B.col(0);
  const Eigen::Vector2d one = detail::least_squares_input<3, 2>(B, {3.0, 1.0, 7.0});
  EXPECT_LE((B * one - Eigen::Vector3d(3.0, 0.0, 0.0)).norm(), 1e-15);
}

TEST(FeedbackLinearization, Errors) {
  using One = Eigen::Vector<double, 1>;
  const auto squared = FeedbackLinearization<Squared>::create({}, Eigen::Matrix<double, 1, 1>(1.0),
                                                              One(-1.0), One(1.0), One(0.5));
  ASSERT_FALSE(squared);
  EXPECT_NE(to_string(squared.error()).find("the model is not affine in its input"),
            std::string::npos)
      << to_string(squared.error());
  const auto with = [](const Linearization::ErrorGain& gain, double low, double high,
                       const Eigen::Vector4d& x) {
    return Linearization::create({}, gain, Eigen::Vector2d::Constant(low),
                                 Eigen::Vector2d::Constant(high), x);
  };
  const Eigen::Vector4d x(1.0, 0.0, 0.0, 0.0);
  EXPECT_FALSE(with(second_order(std::nan(""), 1.0), -1.0, 1.0, x));
  EXPECT_FALSE(with(second_order(1.0, 1.0), 1.0, -1.0, x));
  EXPECT_FALSE(with(second_order(1.0, 1.0), std::nan(""), 1.0, x));
  EXPECT_FALSE(with(second_order(1.0, 1.0), -1.0, 1.0, {std::nan(""), 0.0, 0.0, 0.0}));
  EXPECT_TRUE(with(second_order(1.0, 1.0), -1.0, 1.0, x));
}

}  // namespace
}  // namespace flyball::feedback_linearization_test
