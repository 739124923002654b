#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

/// What a node of a tape computes.
namespace flyball::expression {

/// The operations of a tape. Logical values are 1 and 0.
enum class Operation : std::uint32_t {
  constant,   ///< A number.
  parameter,  ///< A number that changes seldom: a mass.
  input,      ///< A number that changes at each evaluation: a state.
  add,
  subtract,
  multiply,
  divide,
  negate,
  power,
  chain,  ///< a·b, and 0 where one is 0 and the other not finite: a derivative times a slope.
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  sinh,
  cosh,
  tanh,
  asinh,
  acosh,
  atanh,
  exp,
  expm1,
  log,
  log1p,
  log2,
  log10,
  sqrt,
  cbrt,
  erf,
  abs,
  sign,  ///< -1, 0, 1, or NaN.
  floor,
  ceil,
  round,  ///< Halves away from zero.
  atan2,
  hypot,
  minimum,    ///< b < a ? b : a.
  maximum,    ///< a < b ? b : a.
  modulo,     ///< a - b⌊a/b⌋: in [0, b) for positive b.
  remainder,  ///< a - b round(a/b), halves to even: in [-b/2, b/2].
  less,
  less_equal,
  equal,
  not_equal,
  logical_and,
  logical_or,
  logical_not,
  select,  ///< a ≠ 0 ? b : c.
};

/// How many operands an operation has, 0 to 3.
[[nodiscard]] constexpr int operand_count(Operation operation) noexcept {
  using enum Operation;
  switch (operation) {
    case constant:
    case parameter:
    case input:
      return 0;
    case add:
    case subtract:
    case multiply:
    case divide:
    case power:
    case chain:
    case atan2:
    case hypot:
    case minimum:
    case maximum:
    case modulo:
    case remainder:
    case less:
    case less_equal:
    case equal:
    case not_equal:
    case logical_and:
    case logical_or:
      return 2;
    case select:
      return 3;
    default:
      return 1;
  }
}

/// The result of an operation over a generic scalar: double, or a number that carries derivatives.
/// Operands that the operation does not have are not looked at; at constants, parameters and
/// inputs, whose value is not computed, the answer is `a`.
template <class T>
[[nodiscard]] inline T apply(Operation operation, const T& a, const T& b, const T& c) {
  using std::sin, std::cos, std::tan, std::asin, std::acos, std::atan, std::sinh, std::cosh,
      std::tanh, std::asinh, std::acosh, std::atanh, std::exp, std::expm1, std::log, std::log1p,
      std::log2, std::log10, std::sqrt, std::cbrt, std::erf, std::abs, std::floor, std::ceil,
      std::round, std::atan2, std::hypot, std::fmod, std::remainder, std::pow, std::isfinite;
  const auto truth = [](bool value) { return value ? T(1.0) : T(0.0); };
  switch (operation) {
    case Operation::constant:
    case Operation::parameter:
    case Operation::input:
      return a;
    case Operation::add:
      return a + b;
    case Operation::subtract:
      return a - b;
    case Operation::multiply:
      return a * b;
    case Operation::divide:
      return a / b;
    case Operation::negate:
      return -a;
    case Operation::power:
      return pow(a, b);
    case Operation::chain:
      return (a == 0.0 && !isfinite(b)) || (b == 0.0 && !isfinite(a)) ? T(0.0) : T(a * b);
    case Operation::sin:
      return sin(a);
    case Operation::cos:
      return cos(a);
    case Operation::tan:
      return tan(a);
    case Operation::asin:
      return asin(a);
    case Operation::acos:
      return acos(a);
    case Operation::atan:
      return atan(a);
    case Operation::sinh:
      return sinh(a);
    case Operation::cosh:
      return cosh(a);
    case Operation::tanh:
      return tanh(a);
    case Operation::asinh:
      return asinh(a);
    case Operation::acosh:
      return acosh(a);
    case Operation::atanh:
      return atanh(a);
    case Operation::exp:
      return exp(a);
    case Operation::expm1:
      return expm1(a);
    case Operation::log:
      return log(a);
    case Operation::log1p:
      return log1p(a);
    case Operation::log2:
      return log2(a);
    case Operation::log10:
      return log10(a);
    case Operation::sqrt:
      return sqrt(a);
    case Operation::cbrt:
      return cbrt(a);
    case Operation::erf:
      return erf(a);
    case Operation::abs:
      return abs(a);
    case Operation::sign:
      return a > 0.0 ? T(1.0) : a < 0.0 ? T(-1.0) : a == 0.0 ? T(0.0) : a;
    case Operation::floor:
      return floor(a);
    case Operation::ceil:
      return ceil(a);
    case Operation::round:
      return round(a);
    case Operation::atan2:
      return atan2(a, b);
    case Operation::hypot:
      return hypot(a, b);
    case Operation::minimum:
      return b < a ? b : a;
    case Operation::maximum:
      return a < b ? b : a;
    case Operation::modulo: {
      const T rest = fmod(a, b);
      return rest != 0.0 && (rest < 0.0) != (b < 0.0) ? T(rest + b) : rest;
    }
    case Operation::remainder:
      return remainder(a, b);
    case Operation::less:
      return truth(a < b);
    case Operation::less_equal:
      return truth(a <= b);
    case Operation::equal:
      return truth(a == b);
    case Operation::not_equal:
      return truth(!(a == b));
    case Operation::logical_and:
      return truth(!(a == 0.0) && !(b == 0.0));
    case Operation::logical_or:
      return truth(!(a == 0.0) || !(b == 0.0));
    case Operation::logical_not:
      return truth(a == 0.0);
    case Operation::select:
      return a == 0.0 ? c : b;
  }
  return a;
}

}  // namespace flyball::expression
