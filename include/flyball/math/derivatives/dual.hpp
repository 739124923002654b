#pragma once

#include <cmath>
#include <compare>
#include <concepts>
#include <limits>
#include <type_traits>

#include <Eigen/Core>

/// Forward-mode differentiation: numbers that carry their derivatives along.
namespace flyball {

namespace detail {

struct Nothing {};

/// v · slope, where a zero entry stays zero whatever the slope: a constant's derivative is zero
/// also where the function has none, as sqrt at 0.
template <class Derived>
[[nodiscard]] auto scaled(const Eigen::MatrixBase<Derived>& v, double slope) {
  typename Derived::PlainObject result = v * slope;
  if (!std::isfinite(slope)) {
    for (Eigen::Index i = 0; i < result.size(); ++i) {
      if (v(i) == 0.0) {
        result(i) = 0.0;
      }
    }
  }
  return result;
}

}  // namespace detail

/// A number with its derivatives with respect to N variables: the gradient, and for Order 2 the
/// Hessian (a hyper-dual number, truncated after the second order). Every operation is exact but
/// for rounding, so a function written over a generic scalar yields exact derivatives.
///
/// A number without derivatives converts to one whose derivatives are zero; where N is
/// Eigen::Dynamic such a constant carries vectors of size 0. Comparisons compare values.
/// Where a function has a kink (abs, min, max, floor) the derivative is that of the branch taken;
/// where it has no derivative at all (sqrt at 0, atan2 at the origin) it is infinite or NaN, except
/// with respect to variables on which the argument does not depend.
///
/// Cost: N (Order 2: N²) products an operation; no allocation for a fixed N.
/// Source: Fike and Alonso, "The development of hyper-dual numbers for exact second-derivative
/// calculations", AIAA 2011-886.
template <int N, int Order = 1>
class Dual {
  static_assert(Order == 1 || Order == 2);

 public:
  using Gradient = Eigen::Matrix<double, N, 1>;
  using Hessian = std::conditional_t<Order == 2, Eigen::Matrix<double, N, N>, detail::Nothing>;

  double value = 0.0;
  Gradient gradient{};                      ///< ∂/∂x_i, N x 1.
  [[no_unique_address]] Hessian hessian{};  ///< ∂²/∂x_i∂x_j, N x N, of Order 2.

  Dual() : Dual(0.0) {}
  /// A constant.
  // NOLINTNEXTLINE(google-explicit-constructor): numbers mix with duals as they do with doubles.
  Dual(double constant) : value(constant) {
    gradient.setZero();
    if constexpr (Order == 2) {
      hessian.setZero();
    }
  }
  /// The variable with a number, out of `variables`.
  [[nodiscard]] static Dual variable(double value, Eigen::Index number,
                                     Eigen::Index variables = N) {
    Dual x(value);
    x.gradient = Gradient::Unit(variables, number);
    if constexpr (Order == 2) {
      x.hessian.setZero(variables, variables);
    }
    return x;
  }

  /// φ(x) for a function with the value, the slope and the second derivative given at x.value.
  [[nodiscard]] static Dual chain(const Dual& x, double phi, double slope, double second) {
    Dual y;
    y.value = phi;
    y.gradient = detail::scaled(x.gradient, slope);
    if constexpr (Order == 2) {
      const Hessian outer = x.gradient * x.gradient.transpose();
      y.hessian = detail::scaled(x.hessian, slope) + detail::scaled(outer, second);
    }
    return y;
  }

  /// φ(a, b) with its partial derivatives.
  [[nodiscard]] static Dual chain(const Dual& a, const Dual& b, double phi, double by_a,
                                  double by_b, double by_aa, double by_ab, double by_bb) {
    if (N == Eigen::Dynamic && b.gradient.size() == 0) {
      return chain(a, phi, by_a, by_aa);
    }
    if (N == Eigen::Dynamic && a.gradient.size() == 0) {
      return chain(b, phi, by_b, by_bb);
    }
    Dual y;
    y.value = phi;
    y.gradient = detail::scaled(a.gradient, by_a) + detail::scaled(b.gradient, by_b);
    if constexpr (Order == 2) {
      const Hessian aa = a.gradient * a.gradient.transpose();
      const Hessian bb = b.gradient * b.gradient.transpose();
      Hessian ab = a.gradient * b.gradient.transpose();
      ab += ab.transpose().eval();
      y.hessian = detail::scaled(a.hessian, by_a) + detail::scaled(b.hessian, by_b) +
                  detail::scaled(aa, by_aa) + detail::scaled(ab, by_ab) + detail::scaled(bb, by_bb);
    }
    return y;
  }

  /// Arithmetic with duals and numbers; comparisons are those of the values.
  ///@{
  Dual& operator+=(const Dual& other) { return *this = *this + other; }
  Dual& operator-=(const Dual& other) { return *this = *this - other; }
  Dual& operator*=(const Dual& other) { return *this = *this * other; }
  Dual& operator/=(const Dual& other) { return *this = *this / other; }

  friend Dual operator+(const Dual& a) { return a; }
  friend Dual operator-(const Dual& a) { return chain(a, -a.value, -1.0, 0.0); }
  friend Dual operator+(const Dual& a, const Dual& b) {
    return chain(a, b, a.value + b.value, 1.0, 1.0, 0.0, 0.0, 0.0);
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return chain(a, b, a.value - b.value, 1.0, -1.0, 0.0, 0.0, 0.0);
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return chain(a, b, a.value * b.value, b.value, a.value, 0.0, 1.0, 0.0);
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double quotient = a.value / b.value;
    const double inverse = 1.0 / b.value;
    return chain(a, b, quotient, inverse, -quotient * inverse, 0.0, -inverse * inverse,
                 2.0 * quotient * inverse * inverse);
  }
  // With a number: no derivatives to combine.
  friend Dual operator+(const Dual& a, double b) { return shifted(a, a.value + b); }
  friend Dual operator+(double a, const Dual& b) { return shifted(b, a + b.value); }
  friend Dual operator-(const Dual& a, double b) { return shifted(a, a.value - b); }
  friend Dual operator-(double a, const Dual& b) { return chain(b, a - b.value, -1.0, 0.0); }
  friend Dual operator*(const Dual& a, double b) { return chain(a, a.value * b, b, 0.0); }
  friend Dual operator*(double a, const Dual& b) { return chain(b, a * b.value, a, 0.0); }
  friend Dual operator/(const Dual& a, double b) { return chain(a, a.value / b, 1.0 / b, 0.0); }
  friend Dual operator/(double a, const Dual& b) {
    const double quotient = a / b.value;
    return chain(b, quotient, -quotient / b.value, 2.0 * quotient / (b.value * b.value));
  }

  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend bool operator==(const Dual& a, double b) { return a.value == b; }
  friend std::partial_ordering operator<=>(const Dual& a, const Dual& b) {
    return a.value <=> b.value;
  }
  friend std::partial_ordering operator<=>(const Dual& a, double b) { return a.value <=> b; }

  ///@}

  /// The functions of the cmath header, found by argument-dependent lookup: write `using std::sin;
  /// sin(x)`, or `sin(x)` in a function over a generic scalar.
  ///@{
  friend Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return chain(x, root, 0.5 / root, -0.25 / (root * x.value));
  }
  friend Dual cbrt(const Dual& x) {
    const double root = std::cbrt(x.value);
    return chain(x, root, 1.0 / (3.0 * root * root), -2.0 / (9.0 * root * root * x.value));
  }
  friend Dual exp(const Dual& x) {
    const double e = std::exp(x.value);
    return chain(x, e, e, e);
  }
  friend Dual exp2(const Dual& x) {
    const double e = std::exp2(x.value);
    return chain(x, e, ln2 * e, ln2 * ln2 * e);
  }
  friend Dual expm1(const Dual& x) {
    const double e = std::exp(x.value);
    return chain(x, std::expm1(x.value), e, e);
  }
  friend Dual log(const Dual& x) { return logarithm(x, std::log(x.value), 1.0); }
  friend Dual log2(const Dual& x) { return logarithm(x, std::log2(x.value), 1.0 / ln2); }
  friend Dual log10(const Dual& x) {
    return logarithm(x, std::log10(x.value), 0.43429448190325182765);
  }
  friend Dual log1p(const Dual& x) {
    const double inverse = 1.0 / (1.0 + x.value);
    return chain(x, std::log1p(x.value), inverse, -inverse * inverse);
  }
  friend Dual sin(const Dual& x) {
    const double s = std::sin(x.value);
    return chain(x, s, std::cos(x.value), -s);
  }
  friend Dual cos(const Dual& x) {
    const double c = std::cos(x.value);
    return chain(x, c, -std::sin(x.value), -c);
  }
  friend Dual tan(const Dual& x) {
    const double t = std::tan(x.value);
    const double slope = 1.0 + t * t;
    return chain(x, t, slope, 2.0 * t * slope);
  }
  friend Dual asin(const Dual& x) {
    const double slope = 1.0 / std::sqrt((1.0 - x.value) * (1.0 + x.value));
    return chain(x, std::asin(x.value), slope, x.value * slope * slope * slope);
  }
  friend Dual acos(const Dual& x) {
    const double slope = -1.0 / std::sqrt((1.0 - x.value) * (1.0 + x.value));
    return chain(x, std::acos(x.value), slope, x.value * slope * slope * slope);
  }
  friend Dual atan(const Dual& x) {
    const double slope = 1.0 / (1.0 + x.value * x.value);
    return chain(x, std::atan(x.value), slope, -2.0 * x.value * slope * slope);
  }
  friend Dual sinh(const Dual& x) {
    const double s = std::sinh(x.value);
    return chain(x, s, std::cosh(x.value), s);
  }
  friend Dual cosh(const Dual& x) {
    const double c = std::cosh(x.value);
    return chain(x, c, std::sinh(x.value), c);
  }
  friend Dual tanh(const Dual& x) {
    const double t = std::tanh(x.value);
    const double c = std::cosh(x.value);  // 1 - t² would cancel
    const double slope = 1.0 / (c * c);
    return chain(x, t, slope, -2.0 * t * slope);
  }
  friend Dual asinh(const Dual& x) {
    const double slope = 1.0 / std::hypot(1.0, x.value);
    return chain(x, std::asinh(x.value), slope, -x.value * slope * slope * slope);
  }
  friend Dual acosh(const Dual& x) {
    const double slope = 1.0 / std::sqrt((x.value - 1.0) * (x.value + 1.0));
    return chain(x, std::acosh(x.value), slope, -x.value * slope * slope * slope);
  }
  friend Dual atanh(const Dual& x) {
    const double slope = 1.0 / ((1.0 - x.value) * (1.0 + x.value));
    return chain(x, std::atanh(x.value), slope, 2.0 * x.value * slope * slope);
  }
  friend Dual erf(const Dual& x) { return error_function(x, std::erf(x.value), 1.0); }
  friend Dual erfc(const Dual& x) { return error_function(x, std::erfc(x.value), -1.0); }

  /// |x|; at 0 the derivative is that of x.
  friend Dual abs(const Dual& x) { return x.value < 0.0 ? -x : x; }
  friend Dual fabs(const Dual& x) { return abs(x); }
  friend Dual floor(const Dual& x) { return step(x, std::floor(x.value)); }
  friend Dual ceil(const Dual& x) { return step(x, std::ceil(x.value)); }
  friend Dual round(const Dual& x) { return step(x, std::round(x.value)); }
  friend Dual trunc(const Dual& x) { return step(x, std::trunc(x.value)); }
  /// |a| with the sign of b.
  friend Dual copysign(const Dual& a, const Dual& b) {
    return std::signbit(a.value) == std::signbit(b.value) ? a : -a;
  }
  /// a - b trunc(a/b).
  friend Dual fmod(const Dual& a, const Dual& b) {
    const double whole = std::trunc(a.value / b.value);
    return chain(a, b, std::fmod(a.value, b.value), 1.0, -whole, 0.0, 0.0, 0.0);
  }
  /// a - b round(a/b), halves to even.
  friend Dual remainder(const Dual& a, const Dual& b) {
    const double rest = std::remainder(a.value, b.value);
    return chain(a, b, rest, 1.0, -std::nearbyint((a.value - rest) / b.value), 0.0, 0.0, 0.0);
  }
  friend Dual min(const Dual& a, const Dual& b) { return b.value < a.value ? b : a; }
  friend Dual max(const Dual& a, const Dual& b) { return a.value < b.value ? b : a; }
  /// As std::fmin, std::fmax: of a NaN and a number, the number.
  friend Dual fmin(const Dual& a, const Dual& b) {
    return std::isnan(a.value) || b.value < a.value ? b : a;
  }
  friend Dual fmax(const Dual& a, const Dual& b) {
    return std::isnan(a.value) || a.value < b.value ? b : a;
  }
  friend Dual fma(const Dual& a, const Dual& b, const Dual& c) {
    Dual result = a * b + c;
    result.value = std::fma(a.value, b.value, c.value);
    return result;
  }
  /// The angle of (x, y).
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double r = std::hypot(x.value, y.value);
    const double c = x.value / r;
    const double s = y.value / r;
    return chain(y, x, std::atan2(y.value, x.value), c / r, -s / r, -2.0 * c * s / r / r,
                 (s * s - c * c) / r / r, 2.0 * c * s / r / r);
  }
  friend Dual hypot(const Dual& a, const Dual& b) {
    const double r = std::hypot(a.value, b.value);
    const double c = a.value / r;
    const double s = b.value / r;
    return chain(a, b, r, c, s, s * s / r, -c * s / r, c * c / r);
  }
  friend Dual hypot(const Dual& a, const Dual& b, const Dual& c) { return hypot(hypot(a, b), c); }

  /// x^p for a constant p; x may be negative where p is whole, and x⁰ is 1 with derivative 0.
  friend Dual pow(const Dual& x, double p) {
    const double slope = p == 0.0 ? 0.0 : p * std::pow(x.value, p - 1.0);
    const double second = p == 0.0 || p == 1.0 ? 0.0 : p * (p - 1.0) * std::pow(x.value, p - 2.0);
    return chain(x, std::pow(x.value, p), slope, second);
  }
  friend Dual pow(const Dual& x, int p) { return pow(x, static_cast<double>(p)); }
  friend Dual pow(double base, const Dual& p) { return pow(Dual(base), p); }
  /// x^p: at x = 0 with p > 0 the derivatives with respect to p are zero, their limit.
  friend Dual pow(const Dual& x, const Dual& p) {
    const double a = x.value;
    const double b = p.value;
    const double power = std::pow(a, b);
    const double by_a = b == 0.0 ? 0.0 : b * std::pow(a, b - 1.0);
    const double by_aa = b == 0.0 || b == 1.0 ? 0.0 : b * (b - 1.0) * std::pow(a, b - 2.0);
    if (a == 0.0 && b > 0.0) {
      const double by_ab = b > 1.0 ? 0.0 : -std::numeric_limits<double>::infinity();
      return chain(x, p, power, by_a, 0.0, by_aa, by_ab, 0.0);
    }
    const double log_a = std::log(a);
    return chain(x, p, power, by_a, power * log_a, by_aa, std::pow(a, b - 1.0) * (1.0 + b * log_a),
                 power * log_a * log_a);
  }

  friend bool isfinite(const Dual& x) { return std::isfinite(x.value); }
  friend bool isnan(const Dual& x) { return std::isnan(x.value); }
  friend bool isinf(const Dual& x) { return std::isinf(x.value); }
  friend bool signbit(const Dual& x) { return std::signbit(x.value); }
  ///@}

 private:
  static constexpr double ln2 = 0.69314718055994530942;

  static Dual shifted(const Dual& x, double value) {
    Dual y = x;
    y.value = value;
    return y;
  }
  static Dual step(const Dual& x, double value) { return chain(x, value, 0.0, 0.0); }
  static Dual logarithm(const Dual& x, double value, double factor) {
    const double inverse = 1.0 / x.value;
    return chain(x, value, factor * inverse, -factor * inverse * inverse);
  }
  static Dual error_function(const Dual& x, double value, double sign) {
    const double slope = sign * 1.1283791670955125739 * std::exp(-x.value * x.value);  // 2/√π
    return chain(x, value, slope, -2.0 * x.value * slope);
  }
};

}  // namespace flyball

/// @cond What Eigen asks of a scalar.
namespace Eigen {

/// So that vectors and matrices of duals are like any others.
template <int N, int Order>
struct NumTraits<flyball::Dual<N, Order>> : GenericNumTraits<double> {
  using Real = flyball::Dual<N, Order>;
  using NonInteger = flyball::Dual<N, Order>;
  using Nested = const flyball::Dual<N, Order>&;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 8,
    MulCost = 16
  };
  static Real epsilon() { return std::numeric_limits<double>::epsilon(); }
  static Real dummy_precision() { return 1e-12; }
  static Real highest() { return std::numeric_limits<double>::max(); }
  static Real lowest() { return std::numeric_limits<double>::lowest(); }
  static Real infinity() { return std::numeric_limits<double>::infinity(); }
  static Real quiet_NaN() { return std::numeric_limits<double>::quiet_NaN(); }
};

template <int N, int Order, class Operation>
struct ScalarBinaryOpTraits<flyball::Dual<N, Order>, double, Operation> {
  using ReturnType = flyball::Dual<N, Order>;
};
template <int N, int Order, class Operation>
struct ScalarBinaryOpTraits<double, flyball::Dual<N, Order>, Operation> {
  using ReturnType = flyball::Dual<N, Order>;
};

}  // namespace Eigen
/// @endcond
