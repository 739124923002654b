// Closed-form Jacobians against dual numbers, and exponentials against the series of matrices in
// extended precision.

#include <flyball/math/derivatives/differentiation.hpp>

#include "geometry/groups.hpp"
#include "support/laws.hpp"
#include "support/property.hpp"

namespace flyball::test {
namespace {

template <class G>
class JacobianLaws : public testing::Test {};
TYPED_TEST_SUITE(JacobianLaws, DoubleGroups);

template <class G>
using OverDuals = decltype(std::declval<G>().template cast<Dual<G::tangent_size>>());

/// ∂ Log(reference⁻¹ f(δ)) at δ = 0 for a function of a dual tangent.
template <class G, class F>
typename G::Jacobian derivative(F&& f, const G& at) {
  using D = OverDuals<G>;
  return jacobian(
      [&](const auto& delta) {
        return D(f(typename D::Tangent(delta)))
            .minus(at.template cast<typename D::Scalar>())
            .eval();
      },
      G::Tangent::Zero());
}

/// Angles from nothing to beyond a half turn; the inverse Jacobian has its pole at a whole one.
std::vector<double> angles() {
  std::vector<double> all(std::begin(small_sizes), std::end(small_sizes));
  for (const double angle :
       {0.0, 0.3, 0.499, 0.501, 1.0, 1.9, 1.999, 2.001, 3.0, 3.1, 3.14, std::numbers::pi - 1e-6,
        std::numbers::pi - 1e-12, std::numbers::pi, 3.2, 4.0, 5.0}) {
    all.push_back(angle);
  }
  return all;
}

TYPED_TEST(JacobianLaws, OfTheExponential) {
  using G = TypeParam;
  using D = OverDuals<G>;
  Random random(1);
  for (const double angle : angles()) {
    for (int trial = 0; trial < 10; ++trial) {
      const auto tau = random_tangent<G>(random, 3.0, angle);
      const G x = G::exp(tau);
      const auto exp = [&](const auto& delta) {
        return D::exp(tau.template cast<typename D::Scalar>() + delta);
      };
      // Exp(τ + δ) = Exp(τ) Exp(Jr δ) = Exp(Jl δ) Exp(τ)
      const auto Jr = derivative<G>(exp, x);
      EXPECT_LE((G::right_jacobian(tau) - Jr).norm(), 300 * epsilon) << angle;
      const auto x_dual = x.template cast<typename D::Scalar>();
      const auto Jl = derivative<G>(
          [&](const auto& delta) { return exp(delta) * x_dual.inverse(); }, G::identity());
      EXPECT_LE((G::left_jacobian(tau) - Jl).norm(), 300 * epsilon) << angle;
      EXPECT_LE((G::left_jacobian(tau) - x.adjoint() * G::right_jacobian(tau)).norm(),
                300 * epsilon);

      const double pole = 1.0 / std::abs(2.0 * std::numbers::pi - angle);
      const double bound = 1000 * epsilon * (1.0 + pole * pole * pole * pole);
      const auto I = G::Jacobian::Identity();
      EXPECT_LE((G::left_jacobian(tau) * G::left_jacobian_inverse(tau) - I).norm(), bound) << angle;
      EXPECT_LE((G::right_jacobian_inverse(tau) * G::right_jacobian(tau) - I).norm(), bound);
    }
  }
}

// ∂(x ⊕ δ)/∂δ = Jr(δ), ∂(a ⊖ b)/∂a = Jr⁻¹(a ⊖ b), ∂(a ⊖ b)/∂b = -Jl⁻¹(a ⊖ b).
TYPED_TEST(JacobianLaws, OfPlusAndMinus) {
  using G = TypeParam;
  using D = OverDuals<G>;
  using S = typename D::Scalar;
  {
    const bool holds = holds_for_random("of a ⊖ b", [](Random& random) {
      const G b = random_element<G>(random);
      const G a = b.plus(random_tangent<G>(random, 3.0, random.uniform(0.0, 3.0)));
      const auto difference = a.minus(b);
      const auto by_a = jacobian(
          [&](const auto& delta) {
            return a.template cast<S>().plus(delta).minus(b.template cast<S>());
          },
          G::Tangent::Zero());
      require((by_a - right_jacobian_inverse<G>(difference)).norm() <= 1e4 * epsilon);
      const auto by_b = jacobian(
          [&](const auto& delta) {
            return a.template cast<S>().minus(b.template cast<S>().plus(delta));
          },
          G::Tangent::Zero());
      require((by_b + G::left_jacobian_inverse(difference)).norm() <= 1e4 * epsilon);
    });
    EXPECT_TRUE(holds);
  }
  EXPECT_EQ(right_jacobian<Eigen::Vector3d>(Eigen::Vector3d::Ones()), Eigen::Matrix3d::Identity());
}

// Of the product by its factors, and of the inverse: what covariances propagate by.
TYPED_TEST(JacobianLaws, OfProductAndInverse) {
  using G = TypeParam;
  using S = typename OverDuals<G>::Scalar;
  {
    const bool holds = holds_for_random("Ad", [](Random& random) {
      const G x = random_element<G>(random);
      const G y = random_element<G>(random);
      const auto X = x.template cast<S>();
      const auto Y = y.template cast<S>();
      using Matrix = typename G::Jacobian;
      const Matrix by_x =
          derivative<G>([&](const auto& delta) { return X.plus(delta) * Y; }, x * y);
      const Matrix by_y =
          derivative<G>([&](const auto& delta) { return X * Y.plus(delta); }, x * y);
      const Matrix of_inverse =
          derivative<G>([&](const auto& delta) { return X.plus(delta).inverse(); }, x.inverse());
      const Matrix root = Matrix::NullaryExpr([&] { return random.normal(); });
      const Matrix P = root * root.transpose();
      const Matrix Q = Matrix::Identity();
      const double bound = 1e4 * epsilon * (1.0 + P.norm());
      const auto product = compose(Uncertain<G>{x, P}, Uncertain<G>{y, Q});
      require(
          (product.covariance - by_x * P * by_x.transpose() - by_y * Q * by_y.transpose()).norm() <=
          bound * 10);
      require(distance(product.mean, x * y) <= 10 * epsilon);
      const auto back = inverse(Uncertain<G>{x, P});
      require((back.covariance - of_inverse * P * of_inverse.transpose()).norm() <= bound * 10);
      require((inverse(back).covariance - P).norm() <= bound * 100);
      const auto seen = between(Uncertain<G>{x, P}, Uncertain<G>{y, Q});
      require(distance(seen.mean, x.between(y)) <= 100 * epsilon);
    });
    EXPECT_TRUE(holds);
  }
}

template <class G>
class SecondDerivativeLaws : public testing::Test {};
// A bundle of two stands for all: second derivatives by ten directions compile for half a minute.
using SecondDerivativeGroups = testing::Types<Rotation2d, Pose2d, Rotation3d, Pose3d, PoseAndBias>;
TYPED_TEST_SUITE(SecondDerivativeLaws, SecondDerivativeGroups);

// Of the exponential and its logarithm at once: second derivatives too, from nothing on.
TYPED_TEST(SecondDerivativeLaws, OfExponentialAndLogarithm) {
  using G = TypeParam;
  using D = decltype(std::declval<G>().template cast<Dual<G::tangent_size, 2>>());
  Random random(2);
  for (const double angle :
       {0.0, 1e-300, 1e-8, 1e-4, 0.1, 0.19, 0.21, 0.49, 0.51, 1.99, 2.01, 3.0}) {
    const auto tau = random_tangent<G>(random, 3.0, angle);
    const auto weights = random_tangent<G>(random, 1.0, 1.0);
    const auto second = hessian(
        [&](const auto& delta) {
          const typename D::Tangent log = D::exp(delta).log();
          typename D::Scalar sum(0.0);
          for (int i = 0; i < G::tangent_size; ++i) {
            sum += log(i) * weights(i);
          }
          return sum;
        },
        tau);
    EXPECT_LE((second.gradient - weights).norm(), 2000 * epsilon) << angle;
    EXPECT_LE(second.hessian.norm(), 2e4 * epsilon) << angle;
  }
}

/// The matrix [a, ·] of the Lie bracket.
template <class G>
LongMatrix bracket(const typename G::Tangent& a) {
  LongMatrix ad(G::tangent_size, G::tangent_size);
  const auto A = G::hat(a);
  for (int i = 0; i < G::tangent_size; ++i) {
    const auto B = G::hat(G::Tangent::Unit(i));
    ad.col(i) = G::vee(A * B - B * A).template cast<long double>();
  }
  return ad;
}

TYPED_TEST(JacobianLaws, AgainstSeriesOfMatrices) {
  using G = TypeParam;
  if constexpr (requires { G::hat(typename G::Tangent{}); }) {
    Random random(3);
    for (const double angle : angles()) {
      const auto tau = random_tangent<G>(random, 3.0, angle);
      const G x = G::exp(tau);
      EXPECT_LE((wide(x.matrix()) - exponential(wide(G::hat(tau)))).norm(), 20 * epsilon) << angle;
      // Ad(Exp τ) = exp(ad τ), Jl = Σ ad^k/(k + 1)!
      const LongMatrix ad = bracket<G>(tau);
      EXPECT_LE((wide(x.adjoint()) - exponential(ad)).norm(), 60 * epsilon) << angle;
      LongMatrix term = LongMatrix::Identity(ad.rows(), ad.cols());
      LongMatrix sum = term;
      for (int k = 1; k < 60; ++k) {
        term = (term * ad / (k + 1)).eval();
        sum += term;
      }
      EXPECT_LE((wide(G::left_jacobian(tau)) - sum).norm(), 40 * epsilon) << angle;
    }
  }
}

}  // namespace
}  // namespace flyball::test
