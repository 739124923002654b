#include <flyball/math/derivatives/dual.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/math/derivatives/differentiation.hpp>

namespace flyball::dual_test {
namespace {

using Eigen::Vector2d;

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

}  // namespace
}  // namespace flyball::dual_test
