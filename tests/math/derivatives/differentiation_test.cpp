#include <flyball/math/derivatives/differentiation.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <flyball/core/random.hpp>

#include "support/allocation_count.hpp"

namespace flyball {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double inf = std::numeric_limits<double>::infinity();

template <class Function>
void check_function(const char* name, Function f, double at, double slope, double second) {
  using D = Dual<1, 2>;
  const D y = f(D::variable(at, 0));
  EXPECT_DOUBLE_EQ(y.value, f(at)) << name;
  EXPECT_NEAR(y.gradient(0), slope, 4e-15 * std::max(1.0, std::abs(slope))) << name;
  EXPECT_NEAR(y.hessian(0, 0), second, 1e-14 * std::max(1.0, std::abs(second))) << name;
  // The chain rule at order 2: (f∘g)' = f' g', (f∘g)'' = f'' g'² + f' g'', with g(s) = s² + at - 1
  // at s = 1: g' = g'' = 2.
  const D s = D::variable(1.0, 0);
  const D z = f(s * s + (at - 1.0));
  EXPECT_NEAR(z.gradient(0), 2.0 * slope, 1e-13 * std::max(1.0, std::abs(slope))) << name;
  EXPECT_NEAR(z.hessian(0, 0), 4.0 * second + 2.0 * slope,
              1e-12 * std::max({1.0, std::abs(slope), std::abs(second)}))
      << name;
  // First order and dynamic sizes agree.
  EXPECT_EQ(f(Dual<1>::variable(at, 0)).gradient, y.gradient) << name;
  EXPECT_EQ(f(Dual<Eigen::Dynamic>::variable(at, 0, 1)).gradient(0), y.gradient(0)) << name;
}

#define FLYBALL_CHECK(call, at, slope, second)                          \
  check_function(                                                       \
      #call,                                                            \
      [](auto x) {                                                      \
        using std::sqrt, std::cbrt, std::exp, std::exp2, std::expm1;    \
        using std::log, std::log2, std::log10, std::log1p;              \
        using std::sin, std::cos, std::tan, std::asin, std::acos;       \
        using std::atan, std::sinh, std::cosh, std::tanh, std::asinh;   \
        using std::acosh, std::atanh, std::erf, std::erfc, std::abs;    \
        using std::fabs, std::floor, std::ceil, std::round, std::trunc; \
        using std::pow, std::hypot, std::atan2, std::fmod;              \
        return call;                                                    \
      },                                                                \
      at, slope, second)

// Derivatives by hand at an interior point of each.
TEST(Dual, FunctionsOfOneVariable) {
  const double e = std::exp(0.7);
  FLYBALL_CHECK(sqrt(x), 4.0, 0.25, -1.0 / 32.0);
  FLYBALL_CHECK(cbrt(x), 8.0, 1.0 / 12.0, -1.0 / 144.0);
  FLYBALL_CHECK(exp(x), 0.7, e, e);
  FLYBALL_CHECK(exp2(x), 3.0, 8.0 * std::log(2.0), 8.0 * std::log(2.0) * std::log(2.0));
  FLYBALL_CHECK(expm1(x), 0.7, e, e);
  FLYBALL_CHECK(log(x), 4.0, 0.25, -1.0 / 16.0);
  FLYBALL_CHECK(log2(x), 4.0, 0.25 / std::log(2.0), -1.0 / 16.0 / std::log(2.0));
  FLYBALL_CHECK(log10(x), 4.0, 0.25 / std::log(10.0), -1.0 / 16.0 / std::log(10.0));
  FLYBALL_CHECK(log1p(x), 3.0, 0.25, -1.0 / 16.0);
  FLYBALL_CHECK(sin(x), 0.7, std::cos(0.7), -std::sin(0.7));
  FLYBALL_CHECK(cos(x), 0.7, -std::sin(0.7), -std::cos(0.7));
  const double t = std::tan(0.7);
  FLYBALL_CHECK(tan(x), 0.7, 1.0 + t * t, 2.0 * t * (1.0 + t * t));
  FLYBALL_CHECK(asin(x), 0.6, 1.25, 0.6 * 1.953125);
  FLYBALL_CHECK(acos(x), 0.6, -1.25, -0.6 * 1.953125);
  FLYBALL_CHECK(atan(x), 2.0, 0.2, -0.16);
  FLYBALL_CHECK(sinh(x), 0.7, std::cosh(0.7), std::sinh(0.7));
  FLYBALL_CHECK(cosh(x), 0.7, std::sinh(0.7), std::cosh(0.7));
  const double h = std::tanh(0.7);
  FLYBALL_CHECK(tanh(x), 0.7, 1.0 - h * h, -2.0 * h * (1.0 - h * h));
  FLYBALL_CHECK(asinh(x), 0.75, 0.8, -0.75 * 0.512);
  FLYBALL_CHECK(acosh(x), 1.25, 4.0 / 3.0, -1.25 * 64.0 / 27.0);
  FLYBALL_CHECK(atanh(x), 0.6, 1.0 / 0.64, 1.2 / 0.4096);
  const double g = 2.0 / std::sqrt(M_PI) * std::exp(-0.49);
  FLYBALL_CHECK(erf(x), 0.7, g, -1.4 * g);
  FLYBALL_CHECK(erfc(x), 0.7, -g, 1.4 * g);
  FLYBALL_CHECK(abs(x), -2.0, -1.0, 0.0);
  FLYBALL_CHECK(fabs(x), 2.0, 1.0, 0.0);
  FLYBALL_CHECK(floor(x), 2.3, 0.0, 0.0);
  FLYBALL_CHECK(ceil(x), 2.3, 0.0, 0.0);
  FLYBALL_CHECK(round(x), 2.3, 0.0, 0.0);
  FLYBALL_CHECK(trunc(x), 2.3, 0.0, 0.0);
  FLYBALL_CHECK(pow(x, 3), -2.0, 12.0, -12.0);
  FLYBALL_CHECK(pow(x, 2.5), 4.0, 20.0, 7.5);
  FLYBALL_CHECK(1.0 / x, 2.0, -0.25, 0.25);
  FLYBALL_CHECK((3.0 - x) * x / (x + 1.0) - x * 2.0, 1.0, -2.0, -1.0);
  FLYBALL_CHECK(+x - (-x) + 1.0 + 2.0 * x, 1.5, 4.0, 0.0);
}

// Both variables at once: f(a, b) with its five partial derivatives.
template <class Function>
void check_two(const char* name, Function f, const Vector2d& at, const Vector2d& slope,
               const Eigen::Matrix2d& second) {
  const auto result = hessian([&](const auto& x) { return f(x(0), x(1)); }, at);
  EXPECT_LT((result.gradient - slope).norm(), 1e-14 * (1.0 + slope.norm())) << name;
  EXPECT_LT((result.hessian - second).norm(), 1e-14 * (1.0 + second.norm())) << name << "\n"
                                                                             << result.hessian;
  EXPECT_EQ(result.hessian, result.hessian.transpose()) << name;
}

TEST(Dual, FunctionsOfTwoVariables) {
  check_two(
      "a*b", [](auto a, auto b) { return a * b; }, {2.0, 3.0}, {3.0, 2.0},
      Eigen::Matrix2d{{0.0, 1.0}, {1.0, 0.0}});
  check_two(
      "a/b", [](auto a, auto b) { return a / b; }, {2.0, 4.0}, {0.25, -0.125},
      Eigen::Matrix2d{{0.0, -1.0 / 16.0}, {-1.0 / 16.0, 1.0 / 16.0}});
  // atan2(y, x) with y = 3, x = 4: (x, -y)/25; second derivatives -2xy, y² - x², 2xy over 625.
  check_two(
      "atan2", [](auto y, auto x) { return atan2(y, x); }, {3.0, 4.0}, {0.16, -0.12},
      Eigen::Matrix2d{{-24.0, -7.0}, {-7.0, 24.0}} / 625.0);
  check_two(
      "hypot", [](auto a, auto b) { return hypot(a, b); }, {3.0, 4.0}, {0.6, 0.8},
      Eigen::Matrix2d{{16.0, -12.0}, {-12.0, 9.0}} / 125.0);
  // a^b at (2, 3): 12, 8 ln 2; 12, 4 + 12 ln 2, 8 ln² 2.
  const double l = std::log(2.0);
  check_two(
      "pow", [](auto a, auto b) { return pow(a, b); }, {2.0, 3.0}, {12.0, 8.0 * l},
      Eigen::Matrix2d{{12.0, 4.0 + 12.0 * l}, {4.0 + 12.0 * l, 8.0 * l * l}});
  check_two(
      "fmod", [](auto a, auto b) { return fmod(a, b); }, {7.5, 2.0}, {1.0, -3.0},
      Eigen::Matrix2d::Zero());
  check_two(
      "remainder", [](auto a, auto b) { return remainder(a, b); }, {7.5, 2.0}, {1.0, -4.0},
      Eigen::Matrix2d::Zero());
  check_two(
      "fma", [](auto a, auto b) { return fma(a, b, a); }, {2.0, 3.0}, {4.0, 2.0},
      Eigen::Matrix2d{{0.0, 1.0}, {1.0, 0.0}});
  check_two(
      "min", [](auto a, auto b) { return min(a, b) + 2.0 * max(a, b); }, {2.0, 3.0}, {1.0, 2.0},
      Eigen::Matrix2d::Zero());
  check_two(
      "fmin", [](auto a, auto b) { return fmin(a, b) + 2.0 * fmax(a, b); }, {3.0, 2.0}, {2.0, 1.0},
      Eigen::Matrix2d::Zero());
  check_two(
      "copysign", [](auto a, auto b) { return copysign(a, b); }, {3.0, -2.0}, {-1.0, 0.0},
      Eigen::Matrix2d::Zero());
}

TEST(Dual, EdgesOfPowersRootsAndAngles) {
  using D = Dual<2, 2>;
  const D zero = D::variable(0.0, 0);
  const D one = D::variable(1.0, 0);
  // x⁰, x¹ and x² at 0.
  EXPECT_EQ(pow(zero, 0).value, 1.0);
  EXPECT_EQ(pow(zero, 0).gradient(0), 0.0);
  EXPECT_EQ(pow(zero, 1).gradient(0), 1.0);
  EXPECT_EQ(pow(zero, 1).hessian(0, 0), 0.0);
  EXPECT_EQ(pow(zero, 2).gradient(0), 0.0);
  EXPECT_EQ(pow(zero, 2).hessian(0, 0), 2.0);
  // A variable power of zero, and a variable base with a constant (dual) power.
  const D three = D::variable(3.0, 1);
  EXPECT_EQ(pow(zero, three).gradient, Eigen::Vector2d(0.0, 0.0));
  EXPECT_TRUE(pow(zero, three).hessian.isZero(0.0));
  EXPECT_EQ(pow(D::variable(-2.0, 0), D(3.0)).gradient(0), 12.0);
  EXPECT_EQ(pow(D::variable(-2.0, 0), D(3.0)).hessian(0, 0), -12.0);
  EXPECT_NEAR(pow(2.0, three).gradient(1), 8.0 * std::log(2.0), 1e-14);
  // sqrt at 0: infinite in x, nothing in what it does not depend on.
  EXPECT_EQ(sqrt(zero).gradient, Eigen::Vector2d(inf, 0.0));
  EXPECT_EQ(sqrt(D(0.0)).gradient, Eigen::Vector2d(0.0, 0.0));
  EXPECT_TRUE(sqrt(D(0.0)).hessian.isZero(0.0));
  EXPECT_EQ(abs(zero).gradient(0), 1.0);
  EXPECT_TRUE(hypot(D(0.0), D(0.0)).gradient.isZero(0.0));
  EXPECT_EQ(atan2(one, D(0.0)).gradient, Eigen::Vector2d(0.0, 0.0));
  EXPECT_DOUBLE_EQ(atan2(D(0.0), D(-1.0)).value, M_PI);
  // No overflow on the way.
  EXPECT_DOUBLE_EQ(hypot(D::variable(3e200, 0), D(4e200)).gradient(0), 0.6);
  EXPECT_DOUBLE_EQ(atan2(D::variable(3e-200, 0), D(4e-200)).gradient(0), 0.16e200);
}

TEST(Dual, ComparesByValue) {
  const auto a = Dual<1>::variable(1.0, 0);
  const Dual<1> b = 2.0;
  EXPECT_TRUE(a < b && b > a && a <= 1.0 && 1.0 >= a && a == 1.0 && a != b && 2.0 > a);
  EXPECT_TRUE(isfinite(a) && !isnan(a) && !isinf(a) && !signbit(a));
  EXPECT_TRUE(isnan(Dual<1>(NAN)));
}

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
  rc::check("agrees with Richardson's differences", [&] {
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
  rc::check("sum, product and chain rule", [&] {
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
    RC_ASSERT(
        (product.hessian - (f.value * g.hessian + g.value * f.hessian + cross + cross.transpose()))
            .norm() < 1e-13 * scale * scale);
    const D undone = log(exp(tanh(f)));
    RC_ASSERT((undone.hessian - tanh(f).hessian).norm() < 1e-12 * scale * scale);
    const D quotient = product / (g + 1e3) * (g + 1e3);
    RC_ASSERT((quotient.hessian - product.hessian).norm() < 1e-9 * scale);
  });
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
}  // namespace flyball
