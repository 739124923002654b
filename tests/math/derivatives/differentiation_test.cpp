#include <flyball/math/derivatives/differentiation.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball::differentiation_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A random expression over x(0), x(1), x(2), and the same on any scalar.
template <class Scalar>
Scalar evaluate(const std::vector<int>& program, const Eigen::Matrix<Scalar, 3, 1>& x) {
  using std::sin, std::cos, std::exp, std::tanh, std::sqrt, std::atan, std::hypot, std::atan2;
  std::vector<Scalar> stack{x(0), x(1), x(2)};
  for (const int step : program) {
    const Scalar a = stack[stack.size() - 1];
    const Scalar b = stack[stack.size() - 2 - static_cast<std::size_t>(step / 12) % 2];
    switch (step % 12) {
      case 0:
        stack.push_back(Scalar(a + b));
        break;
      case 1:
        stack.push_back(Scalar(a - 2.0 * b));
        break;
      case 2:
        stack.push_back(Scalar(a * b));
        break;
      case 3:
        stack.push_back(Scalar(a / (1.5 + b * b)));
        break;
      case 4:
        stack.push_back(Scalar(sin(a)));
        break;
      case 5:
        stack.push_back(Scalar(cos(a) * b));
        break;
      case 6:
        stack.push_back(Scalar(tanh(a + b)));
        break;
      case 7:
        stack.push_back(Scalar(exp(-(a * a))));
        break;
      case 8:
        stack.push_back(Scalar(sqrt(1.0 + a * a + b * b)));
        break;
      case 9:
        stack.push_back(Scalar(atan(a) + b));
        break;
      case 10:
        stack.push_back(Scalar(hypot(a, 1.0 + b * b)));
        break;
      default:
        stack.push_back(Scalar(atan2(a, 1.0 + b * b)));
        break;
    }
  }
  return stack.back();
}

Vector3d random_point() {
  return Vector3d(*rc::gen::inRange(-1500, 1500), *rc::gen::inRange(-1500, 1500),
                  *rc::gen::inRange(-1500, 1500)) /
         1000.0;
}

TEST(Differentiation, LawsOverRandomExpressions) {
  const auto programs = rc::gen::resize(
      9, rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 24))));
  {
    const bool holds = rc::check("agrees with Richardson's differences", [&] {
      const auto program = *programs;
      const Vector3d x = random_point();
      const auto f = [&](const auto& at) {
        using Scalar = typename std::decay_t<decltype(at)>::Scalar;
        return evaluate<Scalar>(program, at);
      };
      const auto exact = hessian(f, x);
      RC_ASSERT(exact.value == f(x));
      RC_ASSERT((gradient(f, x) - exact.gradient).norm() <= 1e-14 * (1.0 + exact.gradient.norm()));
      RC_ASSERT((gradient(f, VectorXd(x)) - exact.gradient).norm() <=
                1e-14 * (1.0 + exact.gradient.norm()));
      const auto black_box = [&](const Eigen::Ref<const VectorXd>& at) { return f(Vector3d(at)); };
      const VectorXd differences =
          numerical_gradient(black_box, x, {.scheme = DifferenceScheme::richardson, .step = 0.02})
              .value();
      const double scale = 1.0 + exact.gradient.norm() + exact.hessian.norm();
      RC_ASSERT((differences - exact.gradient).norm() < 1e-7 * scale);
      // The Hessian is the Jacobian of the gradient.
      const auto slope = [&](const Eigen::Ref<const VectorXd>& at, Eigen::Ref<VectorXd> g) {
        g = gradient(f, Vector3d(at));
      };
      const Eigen::MatrixXd H =
          numerical_jacobian(slope, x, 3, {.scheme = DifferenceScheme::richardson, .step = 0.02})
              .value();
      RC_ASSERT((H - exact.hessian).norm() < 1e-5 * scale);
    });
    EXPECT_TRUE(holds);
  }
  {
    const bool holds = rc::check("sum, product and chain rule", [&] {
      const auto p = *programs;
      const auto q = *programs;
      const Vector3d x = random_point();
      using D = Dual<3, 2>;
      const auto at = detail::as_variables<3, 2>(x, 0, 3);
      const D f = evaluate<D>(p, at);
      const D g = evaluate<D>(q, at);
      const D product = f * g;
      const double scale = 1.0 + product.hessian.norm() + f.hessian.norm() + g.hessian.norm();
      RC_ASSERT((product.gradient - (f.value * g.gradient + g.value * f.gradient)).norm() <
                1e-13 * scale);
      const Eigen::Matrix3d cross = f.gradient * g.gradient.transpose();
      RC_ASSERT((product.hessian -
                 (f.value * g.hessian + g.value * f.hessian + cross + cross.transpose()))
                    .norm() < 1e-13 * scale * scale);
      const D undone = log(exp(tanh(f)));
      RC_ASSERT((undone.hessian - tanh(f).hessian).norm() < 1e-12 * scale * scale);
      const D quotient = product / (g + 1e3) * (g + 1e3);
      RC_ASSERT((quotient.hessian - product.hessian).norm() < 1e-9 * scale);
    });
    EXPECT_TRUE(holds);
  }
}

/// The pendulum of section 8.5 with an input.
const auto pendulum = [](const auto& x, const auto& u) {
  using Scalar = typename std::decay_t<decltype(x)>::Scalar;
  return Eigen::Vector<Scalar, 2>{x(1), -9.81 * sin(x(0)) + 2.0 * u(0) * cos(x(0))};
};

TEST(Differentiation, JacobiansInClosedForm) {
  const Vector2d x(0.4, -1.0);
  const Eigen::Vector<double, 1> u(3.0);
  const auto both = jacobians(pendulum, x, u);
  EXPECT_TRUE(both.by_x.isApprox(
      Eigen::Matrix2d{{0.0, 1.0}, {-9.81 * std::cos(0.4) - 6.0 * std::sin(0.4), 0.0}}, 1e-15));
  EXPECT_TRUE(both.by_u.isApprox(Vector2d(0.0, 2.0 * std::cos(0.4)), 1e-15));
  static_assert(decltype(both.by_x)::RowsAtCompileTime == 2);
  // Dynamic sizes, and a row that does not depend on x.
  const auto f = [](const auto& at) {
    using Scalar = typename std::decay_t<decltype(at)>::Scalar;
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1> y(3);
    y << Scalar(7.0), at(0) * at(1), at.dot(at);
    return y;
  };
  const Eigen::MatrixXd J = jacobian(f, VectorXd(x));
  EXPECT_TRUE(
      J.isApprox((Eigen::MatrixXd(3, 2) << 0.0, 0.0, -1.0, 0.4, 0.8, -2.0).finished(), 1e-15));
  EXPECT_TRUE(jacobian(f, x).isApprox(J, 0.0));
}

TEST(Differentiation, EigenExpressionsOfDuals) {
  const Eigen::Matrix3d Q{{2.0, 1.0, 0.0}, {1.0, 3.0, 0.5}, {0.0, 0.5, 1.0}};
  const Vector3d x(1.0, -2.0, 0.5);
  const auto quadratic = [&](const auto& at) {
    using Scalar = typename std::decay_t<decltype(at)>::Scalar;
    return Scalar(at.dot(Q * at));
  };
  const auto result = hessian(quadratic, x);  // ∇ = (Q + Qᵀ)x, H = Q + Qᵀ (Theorem 5.12.1)
  EXPECT_TRUE(result.gradient.isApprox(2.0 * Q * x, 1e-15));
  EXPECT_TRUE(result.hessian.isApprox(2.0 * Q, 1e-15));
  EXPECT_TRUE(gradient([](const auto& at) { return at.norm(); }, x).isApprox(x / x.norm(), 1e-15));
  EXPECT_TRUE(
      gradient([](const auto&) { return Dual<Eigen::Dynamic>(3.0); }, VectorXd(x)).isZero(0.0));
  EXPECT_TRUE(hessian([](const auto&) { return Dual<Eigen::Dynamic, 2>(3.0); }, VectorXd(x))
                  .hessian.isZero(0.0));
}

// Theorems 5.12.1, 5.12.2 and Corollary 5.12.3 of the book, and 9.6.1 and 9.6.2 of the entries of a
// matrix, over random ones.
TEST(Differentiation, TheBooksMatrixIdentities) {
  Random random(5);
  const auto any = [&] { return Eigen::Matrix3d::NullaryExpr([&] { return random.normal(); }); };
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3d A = any();
    const Eigen::Matrix3d C = any();
    const Eigen::Matrix3d D = any();
    const Eigen::Matrix3d S = C + C.transpose();
    const Vector3d b = any().col(0);
    const Vector3d e = any().col(0);
    const Vector3d x = any().col(0);
    // (A x + b)ᵀ W (F x + g)
    const auto form = [](const auto& A_, const auto& b_, const auto& W, const auto& F,
                         const auto& g) {
      return [&](const auto& at) {
        using Scalar = typename std::decay_t<decltype(at)>::Scalar;
        const Eigen::Vector<Scalar, 3> left = A_ * at + b_.template cast<Scalar>();
        const Eigen::Vector<Scalar, 3> right = F * at + g.template cast<Scalar>();
        return Scalar(left.dot(W * right));
      };
    };
    const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
    const Vector3d zero = Vector3d::Zero();
    EXPECT_TRUE(gradient(form(I, zero, S, I, zero), x).isApprox(2.0 * S * x, 1e-14));
    EXPECT_TRUE(
        gradient(form(A, b, C, D, e), x)
            .isApprox(A.transpose() * C * (D * x + e) + D.transpose() * C.transpose() * (A * x + b),
                      1e-14));
    EXPECT_TRUE(
        gradient(form(A, b, S, A, b), x).isApprox(2.0 * A.transpose() * S * (A * x + b), 1e-14));

    const auto trace_of_square = [&](const auto& at) {
      using Scalar = typename std::decay_t<decltype(at)>::Scalar;
      const Eigen::Matrix<Scalar, 3, 3> M = at.reshaped(3, 3);
      return Scalar((M * S.cast<Scalar>() * M.transpose()).trace());
    };
    const auto trace_of_product = [&](const auto& at) {
      using Scalar = typename std::decay_t<decltype(at)>::Scalar;
      const Eigen::Matrix<Scalar, 3, 3> M = at.reshaped(3, 3);
      return Scalar((M * C.cast<Scalar>()).trace());
    };
    const Eigen::Vector<double, 9> entries = A.reshaped();
    EXPECT_TRUE(gradient(trace_of_square, entries).reshaped(3, 3).isApprox(2.0 * A * S, 1e-14));
    EXPECT_TRUE(gradient(trace_of_product, entries).reshaped(3, 3).isApprox(C.transpose(), 1e-15));
  }
}

// The book's rules of 4.1: power, product, chain, with its own examples (3x + 2)⁵ and 3xy + 2x; and
// of a change of variables (4.3), by which ∫cos ωt dt = sin(ωt)/ω.
TEST(Differentiation, TheBooksRules) {
  const auto slope = [](auto f, double x) {
    return gradient([&](const auto& at) { return f(at(0)); }, Eigen::Vector<double, 1>(x))(0);
  };
  const auto f = [](const auto& x) { return sin(x) / (1.0 + x * x); };
  const auto g = [](const auto& x) { return exp(-0.5 * x); };
  Random random(41);
  for (int trial = 0; trial < 100; ++trial) {
    const double x = random.uniform(-2.0, 2.0);
    const double y = random.uniform(-2.0, 2.0);
    const double w = random.uniform(0.1, 5.0);
    for (const int n : {1, 2, 3, 7}) {
      EXPECT_NEAR(slope([&](const auto& v) { return pow(v, double(n)); }, x),
                  n * std::pow(x, n - 1), 1e-14 * n * std::pow(2.0, n - 1));
    }
    const double product = slope([&](const auto& v) { return f(v) * g(v); }, x);
    const double fx = std::sin(x) / (1.0 + x * x);
    const double gx = std::exp(-0.5 * x);
    EXPECT_NEAR(product, slope(f, x) * gx + fx * slope(g, x), 1e-14);
    EXPECT_NEAR(slope([&](const auto& v) { return f(g(v)); }, x), slope(f, gx) * slope(g, x),
                1e-14);
    EXPECT_NEAR(slope([](const auto& v) { return pow(3.0 * v + 2.0, 5.0); }, x),
                15.0 * std::pow(3.0 * x + 2.0, 4), 1e-14 * 15.0 * 4096.0);
    const Vector2d partial =
        gradient([](const auto& at) { return 3.0 * at(0) * at(1) + 2.0 * at(0); }, Vector2d(x, y));
    EXPECT_DOUBLE_EQ(partial(0), 3.0 * y + 2.0);
    EXPECT_DOUBLE_EQ(partial(1), 3.0 * x);
    EXPECT_NEAR(slope([&](const auto& t) { return sin(w * t) / w; }, x), std::cos(w * x), 1e-15);
  }
}

// Each row of the book's Table 4.2, at points on both sides of 1: the integral's derivative is f,
// and that of f is f'.
TEST(Differentiation, TheBooksTableOfDerivatives) {
  using D = Dual<1>;
  const auto row = [](auto integral, auto f, auto slope) {
    for (const double x : {0.3, 1.7}) {
      EXPECT_NEAR(integral(D::variable(x, 0)).gradient(0), f(x), 1e-15 * std::abs(f(x)));
      EXPECT_NEAR(f(D::variable(x, 0)).gradient(0), slope(x), 1e-15 * std::abs(slope(x)));
    }
  };
  using std::cos, std::exp, std::pow, std::sin;
  constexpr double a = 2.5;
  row([](auto x) { return a * x; }, [](auto x) { return 0.0 * x + a; }, [](double) { return 0.0; });
  row([](auto x) { return 0.5 * a * x * x; }, [](auto x) { return a * x; },
      [](double) { return a; });
  row([](auto x) { return pow(x, a + 1.0) / (a + 1.0); }, [](auto x) { return pow(x, a); },
      [](double x) { return a * pow(x, a - 1.0); });
  row([](auto x) { return exp(a * x) / a; }, [](auto x) { return exp(a * x); },
      [](double x) { return a * exp(a * x); });
  row([](auto x) { return -cos(x); }, [](auto x) { return sin(x); },
      [](double x) { return cos(x); });
  row([](auto x) { return sin(x); }, [](auto x) { return cos(x); },
      [](double x) { return -sin(x); });
  row([](auto x) { return cos(x); }, [](auto x) { return -sin(x); },
      [](double x) { return -cos(x); });
  row([](auto x) { return -sin(x); }, [](auto x) { return -cos(x); },
      [](double x) { return sin(x); });
}

TEST(Differentiation, FixedSizesDoNotAllocate) {
  Vector2d x(0.4, -1.0);
  const Eigen::Vector<double, 1> u(3.0);
  const test::AllocationCounter allocations;
  for (int k = 0; k < 10; ++k) {
    x += 1e-3 * jacobians(pendulum, x, u).by_x * x;
    x += 1e-3 * hessian([](const auto& at) { return at(0) * at(1) * at(1); }, x).hessian * x;
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(allocations.count(), 0u);
  }
  EXPECT_TRUE(x.allFinite());
}

// d/dx (sin x e^y), and its accuracy: about 1e-10 by central differences, near rounding by
// Richardson's.
TEST(Differentiation, DifferencesOfABlackBox) {
  const auto f = [](const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> y) {
    y << std::sin(x(0)) * std::exp(x(1)), x(0) * x(1);
  };
  const VectorXd x = Vector2d(0.7, 0.3);
  const Eigen::Matrix2d expected{{std::cos(0.7) * std::exp(0.3), std::sin(0.7) * std::exp(0.3)},
                                 {0.3, 0.7}};
  EXPECT_LT((numerical_jacobian(f, x, 2).value() - expected).norm(), 1e-9);
  EXPECT_LT(
      (numerical_jacobian(f, x, 2, {.scheme = DifferenceScheme::richardson}).value() - expected)
          .norm(),
      1e-12);
  // An explicit step: the central difference of sin is cos · sin(h)/h exactly.
  EXPECT_NEAR(numerical_jacobian(f, x, 2, {.step = 0.1}).value()(0, 0),
              expected(0, 0) * std::sin(0.1) / 0.1, 1e-14);
  const auto g = [](const Eigen::Ref<const VectorXd>& at) {
    return std::sin(at(0)) * std::exp(at(1));
  };
  EXPECT_LT((numerical_gradient(g, x).value() - expected.row(0).transpose()).norm(), 1e-9);
  const double s = std::sin(0.7) * std::exp(0.3);
  const double c = std::cos(0.7) * std::exp(0.3);
  EXPECT_LT((numerical_hessian(g, x).value() - Eigen::Matrix2d{{-s, c}, {c, s}}).norm(), 1e-6);
}

TEST(Differentiation, Refusals) {
  const auto root = [](const Eigen::Ref<const VectorXd>& x) { return std::sqrt(x(1)) + x(0); };
  const VectorXd edge = Vector2d(1.0, 0.0);
  const auto refused = numerical_gradient(root, edge);
  ASSERT_FALSE(refused.has_value());
  EXPECT_TRUE(refused.error().is(DifferentiationError::not_finite));
  EXPECT_EQ(refused.error().evidence()[0].values[0], 1.0);
  EXPECT_TRUE(numerical_gradient(root, edge, {.scheme = DifferenceScheme::richardson})
                  .error()
                  .is(DifferentiationError::not_finite));
  EXPECT_TRUE(numerical_hessian(root, edge).error().is(DifferentiationError::not_finite));
  EXPECT_TRUE(numerical_hessian(root, edge, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(numerical_gradient(root, VectorXd(edge * NAN)).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::differentiation_test
