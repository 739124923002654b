#pragma once

#include <array>
#include <cmath>
#include <compare>
#include <concepts>
#include <cstddef>
#include <limits>

#include <Eigen/Core>

/// Forward-mode differentiation over any scalar: derivatives of what carries derivatives already.
namespace flyball {

/// A number over a scalar S with its derivatives with respect to N variables. S may be double, a
/// `Dual`, or another NestedDual: nested twice it has second derivatives, and a function that is
/// made of derivatives (a mass matrix from an energy) can be differentiated once more by whoever
/// calls it. Where S is double and nothing else is nested, `Dual` is faster.
///
/// Numbers, and values of S, convert to it as constants. Comparisons compare values. Kinks are as
/// in `Dual`; where a function has no derivative it is infinite or NaN.
/// Cost: N products of S an operation; no allocation where S makes none.
template <class S, int N>
class NestedDual {
 public:
  S value{0.0};
  std::array<S, static_cast<std::size_t>(N)> gradient{};  ///< ∂/∂x_i.

  NestedDual() = default;
  /// A constant.
  ///@{
  // NOLINTNEXTLINE(google-explicit-constructor): numbers mix with duals as they do with doubles.
  NestedDual(double constant) : NestedDual(S(constant), 0) {}
  // NOLINTNEXTLINE(google-explicit-constructor): and so do those below in the nest.
  template <class T>
    requires(!std::same_as<T, NestedDual> && std::convertible_to<const T&, S>)
  NestedDual(const T& constant) : NestedDual(S(constant), 0) {}
  ///@}
  /// The variable with a number.
  [[nodiscard]] static NestedDual variable(const S& value, int number) {
    NestedDual x(value, 0);
    x.gradient[static_cast<std::size_t>(number)] = S(1.0);
    return x;
  }

  /// φ(x) with the value and the slope at x.value.
  [[nodiscard]] static NestedDual chain(const NestedDual& x, const S& phi, const S& slope) {
    NestedDual y;
    y.value = phi;
    for (std::size_t i = 0; i < x.gradient.size(); ++i) {
      y.gradient[i] = x.gradient[i] * slope;
    }
    return y;
  }
  /// φ(a, b) with its partial derivatives.
  [[nodiscard]] static NestedDual chain(const NestedDual& a, const NestedDual& b, const S& phi,
                                        const S& by_a, const S& by_b) {
    NestedDual y;
    y.value = phi;
    for (std::size_t i = 0; i < a.gradient.size(); ++i) {
      y.gradient[i] = a.gradient[i] * by_a + b.gradient[i] * by_b;
    }
    return y;
  }

  /// Arithmetic with duals and numbers; comparisons are those of the values.
  ///@{
  NestedDual& operator+=(const NestedDual& other) { return *this = *this + other; }
  NestedDual& operator-=(const NestedDual& other) { return *this = *this - other; }
  NestedDual& operator*=(const NestedDual& other) { return *this = *this * other; }
  NestedDual& operator/=(const NestedDual& other) { return *this = *this / other; }

  friend NestedDual operator+(const NestedDual& a) { return a; }
  friend NestedDual operator-(const NestedDual& a) {
    NestedDual y;
    y.value = -a.value;
    for (std::size_t i = 0; i < a.gradient.size(); ++i) {
      y.gradient[i] = -a.gradient[i];
    }
    return y;
  }
  friend NestedDual operator+(const NestedDual& a, const NestedDual& b) {
    NestedDual y;
    y.value = a.value + b.value;
    for (std::size_t i = 0; i < a.gradient.size(); ++i) {
      y.gradient[i] = a.gradient[i] + b.gradient[i];
    }
    return y;
  }
  friend NestedDual operator-(const NestedDual& a, const NestedDual& b) { return a + -b; }
  friend NestedDual operator*(const NestedDual& a, const NestedDual& b) {
    return chain(a, b, S(a.value * b.value), b.value, a.value);
  }
  friend NestedDual operator/(const NestedDual& a, const NestedDual& b) {
    const S quotient = a.value / b.value;
    const S inverse = S(1.0) / b.value;
    return chain(a, b, quotient, inverse, S(-quotient * inverse));
  }
  // With a number: no derivatives to combine.
  friend NestedDual operator+(const NestedDual& a, double b) { return shifted(a, b); }
  friend NestedDual operator+(double a, const NestedDual& b) { return shifted(b, a); }
  friend NestedDual operator-(const NestedDual& a, double b) { return shifted(a, -b); }
  friend NestedDual operator-(double a, const NestedDual& b) { return shifted(-b, a); }
  friend NestedDual operator*(const NestedDual& a, double b) {
    return chain(a, S(a.value * b), S(b));
  }
  friend NestedDual operator*(double a, const NestedDual& b) { return b * a; }
  friend NestedDual operator/(const NestedDual& a, double b) {
    return chain(a, S(a.value / b), S(1.0 / b));
  }
  friend NestedDual operator/(double a, const NestedDual& b) { return NestedDual(a) / b; }

  friend bool operator==(const NestedDual& a, const NestedDual& b) { return a.value == b.value; }
  friend bool operator==(const NestedDual& a, double b) { return a.value == b; }
  friend std::partial_ordering operator<=>(const NestedDual& a, const NestedDual& b) {
    return a.value <=> b.value;
  }
  friend std::partial_ordering operator<=>(const NestedDual& a, double b) { return a.value <=> b; }
  ///@}

  /// The functions of the cmath header that energies are made of, found by argument-dependent
  /// lookup.
  ///@{
  friend NestedDual sqrt(const NestedDual& x) {
    using std::sqrt;
    const S root = sqrt(x.value);
    return chain(x, root, S(0.5 / root));
  }
  friend NestedDual exp(const NestedDual& x) {
    using std::exp;
    const S e = exp(x.value);
    return chain(x, e, e);
  }
  friend NestedDual log(const NestedDual& x) {
    using std::log;
    return chain(x, S(log(x.value)), S(1.0 / x.value));
  }
  friend NestedDual sin(const NestedDual& x) {
    using std::cos, std::sin;
    return chain(x, S(sin(x.value)), S(cos(x.value)));
  }
  friend NestedDual cos(const NestedDual& x) {
    using std::cos, std::sin;
    return chain(x, S(cos(x.value)), S(-sin(x.value)));
  }
  friend NestedDual tan(const NestedDual& x) {
    using std::tan;
    const S t = tan(x.value);
    return chain(x, t, S(1.0 + t * t));
  }
  friend NestedDual asin(const NestedDual& x) {
    using std::asin, std::sqrt;
    return chain(x, S(asin(x.value)), S(1.0 / sqrt((1.0 - x.value) * (1.0 + x.value))));
  }
  friend NestedDual acos(const NestedDual& x) {
    using std::acos, std::sqrt;
    return chain(x, S(acos(x.value)), S(-1.0 / sqrt((1.0 - x.value) * (1.0 + x.value))));
  }
  friend NestedDual atan(const NestedDual& x) {
    using std::atan;
    return chain(x, S(atan(x.value)), S(1.0 / (1.0 + x.value * x.value)));
  }
  friend NestedDual tanh(const NestedDual& x) {
    using std::cosh, std::tanh;
    const S c = cosh(x.value);
    return chain(x, S(tanh(x.value)), S(1.0 / (c * c)));
  }
  friend NestedDual sinh(const NestedDual& x) {
    using std::cosh, std::sinh;
    return chain(x, S(sinh(x.value)), S(cosh(x.value)));
  }
  friend NestedDual cosh(const NestedDual& x) {
    using std::cosh, std::sinh;
    return chain(x, S(cosh(x.value)), S(sinh(x.value)));
  }
  /// |x|; at 0 the derivative is that of x.
  friend NestedDual abs(const NestedDual& x) { return x.value < 0.0 ? -x : x; }
  friend NestedDual atan2(const NestedDual& y, const NestedDual& x) {
    using std::atan2;
    const S square = x.value * x.value + y.value * y.value;
    return chain(y, x, S(atan2(y.value, x.value)), S(x.value / square), S(-y.value / square));
  }
  friend NestedDual hypot(const NestedDual& a, const NestedDual& b) {
    using std::hypot;
    const S r = hypot(a.value, b.value);
    return chain(a, b, r, S(a.value / r), S(b.value / r));
  }
  /// x^p for a constant p; x may be negative where p is whole, and x⁰ is 1 with derivative 0.
  friend NestedDual pow(const NestedDual& x, double p) {
    using std::pow;
    const S slope = p == 0.0 ? S(0.0) : S(p * pow(x.value, p - 1.0));
    return chain(x, S(pow(x.value, p)), slope);
  }
  friend NestedDual pow(const NestedDual& x, int p) { return pow(x, static_cast<double>(p)); }

  friend bool isfinite(const NestedDual& x) {
    using std::isfinite;
    return isfinite(x.value);
  }
  friend bool isnan(const NestedDual& x) {
    using std::isnan;
    return isnan(x.value);
  }
  friend bool isinf(const NestedDual& x) {
    using std::isinf;
    return isinf(x.value);
  }
  ///@}

 private:
  NestedDual(const S& constant, int) : value(constant) { gradient.fill(S(0.0)); }

  static NestedDual shifted(NestedDual x, double by) {
    x.value = S(x.value + by);
    return x;
  }
};

}  // namespace flyball

/// @cond What Eigen asks of a scalar.
namespace Eigen {

/// So that vectors and matrices of them are like any others.
template <class S, int N>
struct NumTraits<flyball::NestedDual<S, N>> : GenericNumTraits<double> {
  using Real = flyball::NestedDual<S, N>;
  using NonInteger = flyball::NestedDual<S, N>;
  using Nested = const flyball::NestedDual<S, N>&;
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

template <class S, int N, class Operation>
struct ScalarBinaryOpTraits<flyball::NestedDual<S, N>, double, Operation> {
  using ReturnType = flyball::NestedDual<S, N>;
};
template <class S, int N, class Operation>
struct ScalarBinaryOpTraits<double, flyball::NestedDual<S, N>, Operation> {
  using ReturnType = flyball::NestedDual<S, N>;
};

}  // namespace Eigen
/// @endcond
