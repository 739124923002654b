#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include <flyball/math/expression/tape.hpp>

/// Formulas of decision variables, written as mathematics.
namespace flyball::optimization {

/// How an expression depends on the decision variables (section 17.1.2).
enum class Degree : std::uint8_t { constant, linear, quadratic, nonlinear };
[[nodiscard]] std::string_view to_string(Degree degree);

namespace detail {

/// The nodes of all expressions of one problem, in the order in which they were written, and the
/// values of its variables and parameters.
class ExpressionGraph {
 public:
  using Operation = expression::Operation;
  using Node = expression::Node;

  /// A new variable's node.
  std::uint32_t input();
  /// A new parameter's node.
  std::uint32_t parameter(double value);
  std::uint32_t constant(double value) {
    nodes_.push_back(Node::constant(value));
    degrees_.push_back(Degree::constant);
    return static_cast<std::uint32_t>(nodes_.size() - 1);
  }
  /// f(a), or the node that is that already.
  std::uint32_t unary(Operation operation, std::uint32_t a);
  /// f(a, b), or the node that is that already.
  std::uint32_t binary(Operation operation, std::uint32_t a, std::uint32_t b);
  /// The one or the other, by whether the condition is not zero.
  std::uint32_t select(std::uint32_t condition, std::uint32_t then, std::uint32_t otherwise);

  [[nodiscard]] const std::vector<Node>& nodes() const noexcept { return nodes_; }
  [[nodiscard]] Degree degree(std::uint32_t node) const noexcept { return degrees_[node]; }
  [[nodiscard]] std::size_t inputs() const noexcept { return values.size(); }
  /// Whether there are absolute values, roots, minima or maxima.
  [[nodiscard]] bool has_kinks() const noexcept { return has_kinks_; }
  [[nodiscard]] std::size_t parameters() const noexcept { return parameter_values.size(); }
  /// The value of a node at `values` and `parameter_values`.
  [[nodiscard]] double value(std::uint32_t node) const;
  /// The tape of some nodes: inputs and parameters keep their numbers.
  [[nodiscard]] expression::Tape tape(std::span<const std::uint32_t> outputs) const;

  std::vector<double> values{};            ///< Of the variables.
  std::vector<double> parameter_values{};  ///< Of the parameters.

 private:
  std::vector<Node> nodes_;
  std::vector<Degree> degrees_;
  bool has_kinks_ = false;
};

}  // namespace detail

/// A number, or a formula of variables and parameters of a problem: a scalar for any code that is
/// generic in its scalar, which then writes down what it computes. What a constant makes trivial
/// (0 x, x + 0, 1 x) is not written. It refers to its problem and must not outlive it.
class Expression {
 public:
  /// A constant.
  // NOLINTNEXTLINE(google-explicit-constructor): a number is an expression.
  Expression(double value = 0.0) noexcept : value_(value) {}
  /// A node of a graph. @private
  Expression(detail::ExpressionGraph* graph, std::uint32_t node) noexcept
      : graph_(graph), node_(node) {}

  [[nodiscard]] bool is_constant() const noexcept { return graph_ == nullptr; }
  /// How it depends on variables; products and powers are judged by their factors' degrees.
  [[nodiscard]] Degree degree() const noexcept {
    return graph_ == nullptr ? Degree::constant : graph_->degree(node_);
  }
  /// Its value at what the variables and parameters are now: the start, or the solution.
  [[nodiscard]] double value() const { return graph_ == nullptr ? value_ : graph_->value(node_); }
  /// Gives a variable its start, or a parameter its value; of other expressions nothing happens.
  void set_value(double value) noexcept;

  [[nodiscard]] detail::ExpressionGraph* graph() const noexcept { return graph_; }
  [[nodiscard]] std::uint32_t node() const noexcept { return node_; }
  /// Of a constant.
  [[nodiscard]] double constant() const noexcept { return value_; }

  Expression& operator+=(const Expression& other);
  Expression& operator-=(const Expression& other);
  Expression& operator*=(const Expression& other);
  Expression& operator/=(const Expression& other);

 private:
  detail::ExpressionGraph* graph_ = nullptr;
  union {
    double value_;
    std::uint32_t node_;
  };
};

/// The arithmetic of expressions.
///@{
[[nodiscard]] Expression operator+(const Expression& a, const Expression& b);
[[nodiscard]] Expression operator-(const Expression& a, const Expression& b);
[[nodiscard]] Expression operator*(const Expression& a, const Expression& b);
[[nodiscard]] Expression operator/(const Expression& a, const Expression& b);
[[nodiscard]] Expression operator-(const Expression& a);
[[nodiscard]] inline Expression operator+(const Expression& a) {
  return a;
}
[[nodiscard]] Expression pow(const Expression& a, const Expression& b);
[[nodiscard]] Expression atan2(const Expression& y, const Expression& x);
[[nodiscard]] Expression hypot(const Expression& a, const Expression& b);
[[nodiscard]] Expression min(const Expression& a, const Expression& b);
[[nodiscard]] Expression max(const Expression& a, const Expression& b);
[[nodiscard]] Expression sin(const Expression& a);
[[nodiscard]] Expression cos(const Expression& a);
[[nodiscard]] Expression tan(const Expression& a);
[[nodiscard]] Expression asin(const Expression& a);
[[nodiscard]] Expression acos(const Expression& a);
[[nodiscard]] Expression atan(const Expression& a);
[[nodiscard]] Expression sinh(const Expression& a);
[[nodiscard]] Expression cosh(const Expression& a);
[[nodiscard]] Expression tanh(const Expression& a);
[[nodiscard]] Expression exp(const Expression& a);
[[nodiscard]] Expression log(const Expression& a);
[[nodiscard]] Expression sqrt(const Expression& a);
[[nodiscard]] Expression abs(const Expression& a);
[[nodiscard]] Expression sign(const Expression& a);
///@}

/// a ≥ 0, or a = 0.
struct Constraint {
  Expression value{};
  bool equality = false;
};

/// Several constraints, those of matrices entry by entry.
using Constraints = std::vector<Constraint>;

/// a = b, a ≤ b, a ≥ b; at least one side an expression.
///@{
[[nodiscard]] inline Constraints operator==(const Expression& a, const Expression& b) {
  return {{a - b, true}};
}
[[nodiscard]] inline Constraints operator<=(const Expression& a, const Expression& b) {
  return {{b - a, false}};
}
[[nodiscard]] inline Constraints operator>=(const Expression& a, const Expression& b) {
  return {{a - b, false}};
}
///@}

}  // namespace flyball::optimization

/// @cond What Eigen asks of a scalar.
template <>
struct Eigen::NumTraits<flyball::optimization::Expression> : Eigen::GenericNumTraits<double> {
  using Real = flyball::optimization::Expression;
  using NonInteger = flyball::optimization::Expression;
  using Nested = flyball::optimization::Expression;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 3,
    MulCost = 3
  };
};

template <class BinaryOp>
struct Eigen::ScalarBinaryOpTraits<flyball::optimization::Expression, double, BinaryOp> {
  using ReturnType = flyball::optimization::Expression;
};
template <class BinaryOp>
struct Eigen::ScalarBinaryOpTraits<double, flyball::optimization::Expression, BinaryOp> {
  using ReturnType = flyball::optimization::Expression;
};

template <>
struct std::common_type<flyball::optimization::Expression, double> {
  using type = flyball::optimization::Expression;
};
template <>
struct std::common_type<double, flyball::optimization::Expression> {
  using type = flyball::optimization::Expression;
};
/// @endcond
