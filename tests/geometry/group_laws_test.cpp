// The laws of a Lie group, of its exponential and logarithm, and of what follows from them; one
// suite for every group and for bundles, in doubles and floats.

#include "geometry/groups.hpp"
#include "support/allocation_count.hpp"
#include "support/property.hpp"

namespace flyball::test {
namespace {

template <class G>
class GroupLaws : public testing::Test {
 protected:
  /// A law for random elements.
  static void holds(const char* name, const std::function<void(Random&)>& law) {
    EXPECT_TRUE(holds_for_random(name, law));
  }
};
TYPED_TEST_SUITE(GroupLaws, Groups);

TYPED_TEST(GroupLaws, ProductIdentityInverse) {
  using G = TypeParam;
  this->holds("group axioms", [](Random& random) {
    const G a = random_element<G>(random);
    const G b = random_element<G>(random);
    const G c = random_element<G>(random);
    require(distance((a * b) * c, a * (b * c)) <= roundings<G>(100));
    require(distance(a * G::identity(), a) <= roundings<G>(40));
    require(distance(G::identity() * a, a) <= roundings<G>(40));
    require(distance(a * a.inverse(), G::identity()) <= roundings<G>(40));
    require(distance(a.inverse() * a, G::identity()) <= roundings<G>(40));
    require(distance((a * b).inverse(), b.inverse() * a.inverse()) <= roundings<G>(100));
    require(distance(a * a.between(b), b) <= roundings<G>(100));
  });
}

// A product of a hundred thousand rotations is one still.
TYPED_TEST(GroupLaws, Closure) {
  using G = TypeParam;
  if constexpr (requires(G x) { x.matrix(); }) {
    Random random(1);
    const G step = G::exp(random_tangent<G>(random, 0.0, 0.7));
    G product;
    for (int k = 0; k < 100'000; ++k) {
      product = product * step;
    }
    constexpr int n = G::Point::RowsAtCompileTime;
    const auto R = product.matrix().template topLeftCorner<n, n>().eval();
    const double defect = static_cast<double>((R.transpose() * R - R.Identity()).norm());
    EXPECT_LE(defect, roundings<G>(8));
  }
}

// Down to the least angles: Log(Exp(τ)) is τ, to a few roundings of each part of it.
TYPED_TEST(GroupLaws, LogOfExp) {
  using G = TypeParam;
  this->holds("in the ball of π", [](Random& random) {
    const auto tau = random_tangent<G>(random);
    require((G::exp(tau).log() - tau).norm() <= roundings<G>(60));
  });
  Random random(2);
  for (const double size : small_sizes) {
    if (size < std::numeric_limits<typename G::Scalar>::min()) {
      continue;
    }
    for (int trial = 0; trial < 20; ++trial) {
      const auto tau = random_tangent<G>(random, size, size);
      const auto back = G::exp(tau).log();
      // Without squares, which would vanish.
      EXPECT_LE((back - tau).cwiseAbs().maxCoeff(), roundings<G>(20) * size) << size;
      // A large translation with a small rotation loses neither.
      const auto mixed = random_tangent<G>(random, 5.0, size);
      const auto mixed_back = G::exp(mixed).log();
      EXPECT_LE((mixed_back - mixed).norm(), roundings<G>(40)) << size;
      for (const auto& [offset, length] : Rotations<G>::blocks()) {
        EXPECT_LE((mixed_back - mixed).segment(offset, length).cwiseAbs().maxCoeff(),
                  roundings<G>(30) * size);
      }
    }
  }
}

// Close to a half turn the logarithm may give the other way round, which is the same element.
TYPED_TEST(GroupLaws, NearHalfTurns) {
  using G = TypeParam;
  Random random(3);
  for (const double gap : {0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2}) {
    for (const double side : {-1.0, 1.0}) {
      for (int trial = 0; trial < 20; ++trial) {
        const auto tau = random_tangent<G>(random, 2.0, std::numbers::pi + side * gap);
        const G x = G::exp(tau);
        const auto log = x.log();
        ASSERT_TRUE(log.allFinite());
        EXPECT_LE(distance(G::exp(log), x), roundings<G>(40)) << gap;
        for (const auto& [offset, size] : Rotations<G>::blocks()) {
          const double angle = static_cast<double>(log.segment(offset, size).norm());
          EXPECT_LE(angle, std::numbers::pi + roundings<G>(8));
          EXPECT_NEAR(angle, std::numbers::pi - gap, roundings<G>(8));
        }
      }
    }
  }
}

TYPED_TEST(GroupLaws, ExpOfLog) {
  using G = TypeParam;
  this->holds("for whole turns too", [](Random& random) {
    const G x = G::exp(random_tangent<G>(random, 5.0, random.uniform(0.0, 20.0)));
    require(distance(G::exp(x.log()), x) <= roundings<G>(100));
  });
}

// Along one direction the exponential is a motion: Exp(sτ) Exp(tτ) = Exp((s + t)τ).
TYPED_TEST(GroupLaws, OneParameterSubgroups) {
  using G = TypeParam;
  using Scalar = typename G::Scalar;
  this->holds("sum of multiples", [](Random& random) {
    const auto tau = random_tangent<G>(random, 5.0, 1.0);
    const auto s = static_cast<Scalar>(random.uniform(-2.0, 2.0));
    const auto t = static_cast<Scalar>(random.uniform(-2.0, 2.0));
    require(distance(G::exp(s * tau) * G::exp(t * tau), G::exp((s + t) * tau)) <=
            roundings<G>(200));
    require(distance(G::exp(-tau), G::exp(tau).inverse()) <= roundings<G>(60));
  });
}

TYPED_TEST(GroupLaws, PlusAndMinus) {
  using G = TypeParam;
  static_assert(Manifold<G> && tangent_size<G> == G::tangent_size);
  this->holds("x ⊕ δ and y ⊖ x", [](Random& random) {
    const G x = random_element<G>(random);
    const G y = x.plus(random_tangent<G>(random));
    const auto delta = random_tangent<G>(random);
    require(distance(x.plus(G::Tangent::Zero()), x) <= roundings<G>(40));
    require(x.minus(x).norm() <= roundings<G>(40));
    require(distance(x.plus(y.minus(x)), y) <= roundings<G>(200));
    require((x.plus(delta).minus(x) - delta).norm() <= roundings<G>(200));
    // In the frame of x: what x is seen from does not matter.
    const G frame = random_element<G>(random);
    require(((frame * y).minus(frame * x) - y.minus(x)).norm() <= roundings<G>(400));
    require(distance(plus(x, delta), x.plus(delta)) == 0.0);
    require(minus(y, x) == y.minus(x));
  });
}

TYPED_TEST(GroupLaws, Adjoint) {
  using G = TypeParam;
  this->holds("x Exp(τ) x⁻¹ = Exp(Ad τ)", [](Random& random) {
    const G x = random_element<G>(random);
    const G y = random_element<G>(random);
    const auto tau = random_tangent<G>(random);
    require(distance(x * G::exp(tau) * x.inverse(), G::exp(x.adjoint() * tau)) <=
            roundings<G>(1000));
    require(((x * y).adjoint() - x.adjoint() * y.adjoint()).norm() <= roundings<G>(400));
    require((x.inverse().adjoint() * x.adjoint() - G::Jacobian::Identity()).norm() <=
            roundings<G>(400));
  });
}

TYPED_TEST(GroupLaws, Action) {
  using G = TypeParam;
  if constexpr (requires { typename G::Point; }) {
    using Point = typename G::Point;
    this->holds("of a product, of the inverse, and by the matrix", [](Random& random) {
      const G x = random_element<G>(random);
      const G y = random_element<G>(random);
      Point p;
      for (auto& entry : p.reshaped()) {
        entry = static_cast<typename G::Scalar>(random.normal());
      }
      require(((x * y) * p - x * (y * p)).norm() <= roundings<G>(100));
      require((x.inverse() * (x * p) - p).norm() <= roundings<G>(60));
      constexpr int n = Point::RowsAtCompileTime;
      constexpr int m = G::Matrix::RowsAtCompileTime;
      Eigen::Matrix<typename G::Scalar, m, 1> homogeneous;
      homogeneous.setOnes();
      homogeneous.template head<n>() = p;
      require(((x.matrix() * homogeneous).template head<n>() - x * p).norm() <= roundings<G>(40));
      require((x.matrix() * y.matrix() - (x * y).matrix()).norm() <= roundings<G>(100));
    });
  }
}

TYPED_TEST(GroupLaws, Interpolation) {
  using G = TypeParam;
  using Scalar = typename G::Scalar;
  this->holds("from one end to the other", [](Random& random) {
    const G a = random_element<G>(random);
    const G b = a.plus(random_tangent<G>(random, 5.0, random.uniform(0.0, 3.0)));
    const auto t = static_cast<Scalar>(random.uniform());
    const double bound = roundings<G>(400);
    require(distance(a.interpolate(b, Scalar(0)), a) <= bound);
    require(distance(a.interpolate(b, Scalar(1)), b) <= bound);
    require(distance(a.interpolate(b, t), b.interpolate(a, 1 - t)) <= bound);
    // Half way of half way is a quarter.
    const Scalar half(0.5);
    require(distance(a.interpolate(a.interpolate(b, half), half), a.interpolate(b, half / 2)) <=
            bound);
    // Equal steps are equal motions.
    require((a.interpolate(b, t).minus(a) - t * b.minus(a)).norm() <= bound);
    const G frame = random_element<G>(random);
    require(distance((frame * a).interpolate(frame * b, t), frame * a.interpolate(b, t)) <=
            3 * bound);
  });
}

TYPED_TEST(GroupLaws, HatAndVee) {
  using G = TypeParam;
  if constexpr (requires { G::hat(typename G::Tangent{}); }) {
    Random random(4);
    const auto tau = random_tangent<G>(random);
    EXPECT_EQ(G::vee(G::hat(tau)), tau);
  }
}

TYPED_TEST(GroupLaws, CastsThereAndBack) {
  using G = TypeParam;
  Random random(5);
  const G x = random_element<G>(random);
  const auto wide = x.template cast<double>();
  static_assert(std::is_same_v<typename std::decay_t<decltype(wide)>::Scalar, double>);
  EXPECT_EQ(distance(wide.template cast<typename G::Scalar>(), x), distance(x, x));
}

TYPED_TEST(GroupLaws, AllocatesNothing) {
  using G = TypeParam;
  Random random(6);
  const G a = random_element<G>(random);
  const auto tau = random_tangent<G>(random, 1.0, 1.0);
  G x = a;
  typename G::Jacobian sum = G::Jacobian::Zero();
  Uncertain<G> u{a, G::Jacobian::Identity()};
  const AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    x = x.plus(tau).interpolate(a, typename G::Scalar(0.25)) * a.inverse();
    sum += x.adjoint() + G::left_jacobian(tau) + G::right_jacobian_inverse(x.minus(a));
    u = compose(u, inverse(u));
  }
  EXPECT_TRUE(sum.allFinite());
  if (counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
}

}  // namespace
}  // namespace flyball::test
