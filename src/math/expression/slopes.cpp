#include <numbers>

#include "math/expression/slopes.hpp"

namespace flyball::expression {

namespace {

using enum Operation;

/// Derivatives of functions of one variable, in the form that `Dual` computes them.
std::optional<Slot> slope_of_unary(TapeBuilder& t, Operation operation, Slot x, Slot y) {
  const auto number = [&](double value) { return t.constant(value); };
  const auto plus = [&](Slot a, Slot b) { return t.binary(add, a, b); };
  const auto minus = [&](Slot a, Slot b) { return t.binary(subtract, a, b); };
  const auto times = [&](Slot a, Slot b) { return t.binary(multiply, a, b); };
  const auto over = [&](Slot a, Slot b) { return t.binary(divide, a, b); };
  const auto one = [&] { return t.constant(1.0); };
  const auto one_minus_square = [&] { return times(minus(one(), x), plus(one(), x)); };
  switch (operation) {
    case negate:
      return number(-1.0);
    case Operation::sin:
      return t.unary(Operation::cos, x);
    case Operation::cos:
      return t.unary(negate, t.unary(Operation::sin, x));
    case Operation::tan:
      return plus(one(), times(y, y));
    case Operation::asin:
      return over(one(), t.unary(Operation::sqrt, one_minus_square()));
    case Operation::acos:
      return over(number(-1.0), t.unary(Operation::sqrt, one_minus_square()));
    case Operation::atan:
      return over(one(), plus(one(), times(x, x)));
    case Operation::sinh:
      return t.unary(Operation::cosh, x);
    case Operation::cosh:
      return t.unary(Operation::sinh, x);
    case Operation::tanh: {
      const Slot c = t.unary(Operation::cosh, x);  // 1 - y² would cancel
      return over(one(), times(c, c));
    }
    case Operation::asinh:
      return over(one(), t.binary(Operation::hypot, one(), x));
    case Operation::acosh:
      return over(one(), t.unary(Operation::sqrt, times(minus(x, one()), plus(x, one()))));
    case Operation::atanh:
      return over(one(), one_minus_square());
    case Operation::exp:
      return y;
    case Operation::expm1:
      return t.unary(Operation::exp, x);
    case Operation::log:
      return over(one(), x);
    case Operation::log2:
      return times(number(std::numbers::log2e), over(one(), x));
    case Operation::log10:
      return times(number(std::numbers::log10e), over(one(), x));
    case Operation::log1p:
      return over(one(), plus(one(), x));
    case Operation::sqrt:
      return over(number(0.5), y);
    case Operation::cbrt:
      return over(one(), times(times(number(3.0), y), y));
    case Operation::erf:  // 2/√π e^(-x²)
      return times(number(2.0 * std::numbers::inv_sqrtpi),
                   t.unary(Operation::exp, times(t.unary(negate, x), x)));
    case Operation::abs:
      return t.select(t.binary(less, x, number(0.0)), number(-1.0), one());
    default:
      return std::nullopt;  // steps and truths
  }
}

}  // namespace

Slopes slopes(TapeBuilder& t, Slot y, bool by_a, bool by_b) {
  const Node node = t[y];  // a copy: writing moves the nodes
  const Slot a{node.a};
  const Slot b{node.b};
  const auto number = [&](double value) { return t.constant(value); };
  const auto over = [&](Slot p, Slot q) { return t.binary(divide, p, q); };
  const auto minus = [&](Slot p) { return t.unary(negate, p); };
  Slopes result;
  switch (node.operation) {
    case add:
      return {number(1.0), number(1.0)};
    case subtract:
      return {number(1.0), number(-1.0)};
    case multiply:
    case chain:
      return {b, a};
    case divide:
      if (by_a) {
        result.by_a = over(number(1.0), b);
      }
      if (by_b) {
        result.by_b = minus(over(y, b));
      }
      return result;
    case power:
      if (by_a) {  // b a^(b-1), 0 where b is
        result.by_a = t.binary(chain, b, t.binary(power, a, t.binary(subtract, b, number(1.0))));
      }
      if (by_b) {  // a^b ln a, whose limit at a = 0 is 0
        result.by_b = t.binary(chain, y, t.unary(Operation::log, a));
      }
      return result;
    case Operation::atan2: {
      const Slot r = t.binary(Operation::hypot, a, b);
      return {over(over(b, r), r), minus(over(over(a, r), r))};
    }
    case Operation::hypot:
      return {over(a, y), over(b, y)};
    case modulo:
      return {number(1.0), minus(t.unary(Operation::floor, over(a, b)))};
    case Operation::remainder:
      return {number(1.0), minus(t.unary(Operation::round, over(t.binary(subtract, a, y), b)))};
    default:
      if (operand_count(node.operation) == 1) {
        result.by_a = slope_of_unary(t, node.operation, a, y);
      }
      return result;
  }
}

bool has_finite_slopes(Operation operation) noexcept {
  switch (operation) {
    case add:
    case subtract:
    case multiply:
    case negate:
    case Operation::sin:
    case Operation::cos:
    case Operation::atan:
    case Operation::tanh:
    case Operation::asinh:
    case Operation::erf:
    case Operation::abs:
      return true;
    default:
      return false;
  }
}

std::optional<Branch> branch_of(TapeBuilder& t, Slot y) {
  const Node node = t[y];
  switch (node.operation) {
    case minimum:
      return Branch{t.binary(less, {node.b}, {node.a}), {node.b}, {node.a}};
    case maximum:
      return Branch{t.binary(less, {node.a}, {node.b}), {node.b}, {node.a}};
    case Operation::select:
      return Branch{{node.a}, {node.b}, {node.c}};
    default:
      return std::nullopt;
  }
}

}  // namespace flyball::expression
