#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace flyball::expression {

/// A random formula as a tree that evaluates itself by recursion, knowing nothing of tapes: what
/// the parser and the tape are compared with.
struct RandomTree {
  enum class Kind { number, variable, unary, binary, choice };

  Kind kind = Kind::number;
  double number = 0.0;
  std::size_t which = 0;
  std::vector<RandomTree> parts{};

  static constexpr const char* unary_names[] = {
      "-",     "sin",  "cos",  "tan",   "atan",  "tanh",  "exp",   "asinh", "abs",
      "sqrt",  "log",  "cbrt", "erf",   "sign",  "floor", "asin",  "acos",  "acosh",
      "atanh", "sinh", "cosh", "expm1", "log1p", "log2",  "log10", "round", "ceil"};
  static constexpr const char* binary_names[] = {"+",     "-",   "*",   "/",   "pow",      "atan2",
                                                 "hypot", "min", "max", "mod", "remainder"};

  static RandomTree make(std::mt19937_64& random, std::size_t variables, int depth) {
    RandomTree tree;
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    const std::size_t dice = below(10);
    if (depth == 0 || dice == 0) {
      tree.kind = below(4) == 0 ? Kind::number : Kind::variable;
      tree.number = static_cast<double>(1 + below(40)) / 8.0;
      tree.which = below(variables);
      return tree;
    }
    tree.kind = dice < 4 ? Kind::unary : dice < 9 ? Kind::binary : Kind::choice;
    tree.which = below(tree.kind == Kind::unary    ? std::size(unary_names)
                       : tree.kind == Kind::binary ? (below(3) > 0 ? 4 : std::size(binary_names))
                                                   : 4);
    const std::size_t count = tree.kind == Kind::unary ? 1 : tree.kind == Kind::binary ? 2 : 4;
    for (std::size_t k = 0; k < count; ++k) {
      tree.parts.push_back(make(random, variables, depth - 1));
    }
    return tree;
  }

  [[nodiscard]] std::string text(std::span<const std::string> names) const {
    const auto part = [&](std::size_t k) { return parts[k].text(names); };
    switch (kind) {
      case Kind::number: {
        return std::to_string(number);
      }
      case Kind::variable:
        return names[which];
      case Kind::unary:
        return which == 0 ? "(-" + part(0) + ")" : unary_names[which] + ("(" + part(0) + ")");
      case Kind::binary:
        return which < 4 ? "(" + part(0) + " " + binary_names[which] + " " + part(1) + ")"
                         : binary_names[which] + ("(" + part(0) + ", " + part(1) + ")");
      case Kind::choice: {
        constexpr const char* comparisons[] = {" < ", " <= ", " > ", " != "};
        return "if(" + part(0) + comparisons[which] + part(1) + ", " + part(2) + ", " + part(3) +
               ")";
      }
    }
    return "";
  }

  template <class T>
  [[nodiscard]] T evaluate(std::span<const T> x) const {
    using std::sin, std::cos, std::tan, std::atan, std::tanh, std::exp, std::asinh, std::abs,
        std::sqrt, std::log, std::cbrt, std::erf, std::floor, std::pow, std::atan2, std::hypot,
        std::remainder, std::asin, std::acos, std::acosh, std::atanh, std::sinh, std::cosh,
        std::expm1, std::log1p, std::log2, std::log10, std::round, std::ceil;
    if (kind == Kind::number) {
      return T(number);
    }
    if (kind == Kind::variable) {
      return x[which];
    }
    const T a = parts[0].evaluate(x);
    if (kind == Kind::unary) {
      switch (which) {
        case 0:
          return -a;
        case 1:
          return sin(a);
        case 2:
          return cos(a);
        case 3:
          return tan(a);
        case 4:
          return atan(a);
        case 5:
          return tanh(a);
        case 6:
          return exp(a);
        case 7:
          return asinh(a);
        case 8:
          return abs(a);
        case 9:
          return sqrt(a);
        case 10:
          return log(a);
        case 11:
          return cbrt(a);
        case 12:
          return erf(a);
        case 13:
          return a > 0.0 ? T(1.0) : a < 0.0 ? T(-1.0) : a == 0.0 ? T(0.0) : a;
        case 14:
          return floor(a);
        case 15:
          return asin(a);
        case 16:
          return acos(a);
        case 17:
          return acosh(a);
        case 18:
          return atanh(a);
        case 19:
          return sinh(a);
        case 20:
          return cosh(a);
        case 21:
          return expm1(a);
        case 22:
          return log1p(a);
        case 23:
          return log2(a);
        case 24:
          return log10(a);
        case 25:
          return round(a);
        default:
          return ceil(a);
      }
    }
    const T b = parts[1].evaluate(x);
    if (kind == Kind::choice) {
      const bool truth = which == 0 ? a < b : which == 1 ? a <= b : which == 2 ? a > b : !(a == b);
      return parts[truth ? 2 : 3].evaluate(x);
    }
    switch (which) {
      case 0:
        return a + b;
      case 1:
        return a - b;
      case 2:
        return a * b;
      case 3:
        return a / b;
      case 4:
        return pow(a, b);
      case 5:
        return atan2(a, b);
      case 6:
        return hypot(a, b);
      case 7:
        return b < a ? b : a;
      case 8:
        return a < b ? b : a;
      case 9: {  // a - b floor(a/b), exactly
        const T rest = remainder(a, b);
        return rest != 0.0 && (rest < 0.0) != (b < 0.0) ? T(rest + b) : rest;
      }
      default:
        return remainder(a, b);
    }
  }
};

}  // namespace flyball::expression
