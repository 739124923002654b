#pragma once

#include <limits>

#include <Eigen/Core>

#include <flyball/math/expression/tape_builder.hpp>

namespace flyball::expression {

/// A number that writes down what is done with it: a function over a generic scalar, called with
/// these, becomes a tape.
///
/// A constant needs no builder. There are no comparisons: a function that branches on a value
/// cannot be traced, and does not compile; abs, min, max, floor and their like are operations of
/// the tape. Cost: O(1) an operation; allocates.
class Traced {
 public:
  Traced() = default;
  /// A constant.
  // NOLINTNEXTLINE(google-explicit-constructor): numbers mix with traced ones as with any scalar.
  Traced(double constant) : constant_(constant) {}
  /// A slot of a builder, which outlives this.
  Traced(TapeBuilder& builder, Slot slot) : builder_(&builder), slot_(slot) {}

  /// Where it stands on a builder's tape.
  [[nodiscard]] Slot slot_on(TapeBuilder& builder) const {
    return builder_ != nullptr ? slot_ : builder.constant(constant_);
  }

  /// Arithmetic, written down.
  ///@{
  friend Traced operator+(const Traced& a) { return a; }
  friend Traced operator-(const Traced& a) { return unary(Operation::negate, a); }
  friend Traced operator+(const Traced& a, const Traced& b) { return binary(Operation::add, a, b); }
  friend Traced operator-(const Traced& a, const Traced& b) {
    return binary(Operation::subtract, a, b);
  }
  friend Traced operator*(const Traced& a, const Traced& b) {
    return binary(Operation::multiply, a, b);
  }
  friend Traced operator/(const Traced& a, const Traced& b) {
    return binary(Operation::divide, a, b);
  }
  Traced& operator+=(const Traced& b) { return *this = *this + b; }
  Traced& operator-=(const Traced& b) { return *this = *this - b; }
  Traced& operator*=(const Traced& b) { return *this = *this * b; }
  Traced& operator/=(const Traced& b) { return *this = *this / b; }
  ///@}

  /// The functions of the cmath header that a tape has.
  ///@{
  friend Traced sin(const Traced& x) { return unary(Operation::sin, x); }
  friend Traced cos(const Traced& x) { return unary(Operation::cos, x); }
  friend Traced tan(const Traced& x) { return unary(Operation::tan, x); }
  friend Traced asin(const Traced& x) { return unary(Operation::asin, x); }
  friend Traced acos(const Traced& x) { return unary(Operation::acos, x); }
  friend Traced atan(const Traced& x) { return unary(Operation::atan, x); }
  friend Traced sinh(const Traced& x) { return unary(Operation::sinh, x); }
  friend Traced cosh(const Traced& x) { return unary(Operation::cosh, x); }
  friend Traced tanh(const Traced& x) { return unary(Operation::tanh, x); }
  friend Traced exp(const Traced& x) { return unary(Operation::exp, x); }
  friend Traced log(const Traced& x) { return unary(Operation::log, x); }
  friend Traced sqrt(const Traced& x) { return unary(Operation::sqrt, x); }
  friend Traced abs(const Traced& x) { return unary(Operation::abs, x); }
  friend Traced fabs(const Traced& x) { return unary(Operation::abs, x); }
  friend Traced floor(const Traced& x) { return unary(Operation::floor, x); }
  friend Traced atan2(const Traced& y, const Traced& x) { return binary(Operation::atan2, y, x); }
  friend Traced hypot(const Traced& a, const Traced& b) { return binary(Operation::hypot, a, b); }
  friend Traced pow(const Traced& a, const Traced& b) { return binary(Operation::power, a, b); }
  friend Traced min(const Traced& a, const Traced& b) { return binary(Operation::minimum, a, b); }
  friend Traced max(const Traced& a, const Traced& b) { return binary(Operation::maximum, a, b); }
  ///@}

 private:
  static TapeBuilder* builder_of(const Traced& a, const Traced& b) {
    return a.builder_ != nullptr ? a.builder_ : b.builder_;
  }
  static Traced unary(Operation operation, const Traced& a) {
    if (a.builder_ == nullptr) {
      return apply<double>(operation, a.constant_, 0.0, 0.0);
    }
    return {*a.builder_, a.builder_->unary(operation, a.slot_)};
  }
  static Traced binary(Operation operation, const Traced& a, const Traced& b) {
    TapeBuilder* const builder = builder_of(a, b);
    if (builder == nullptr) {
      return apply<double>(operation, a.constant_, b.constant_, 0.0);
    }
    return {*builder, builder->binary(operation, a.slot_on(*builder), b.slot_on(*builder))};
  }

  TapeBuilder* builder_ = nullptr;
  Slot slot_{};
  double constant_ = 0.0;
};

}  // namespace flyball::expression

/// @cond What Eigen asks of a scalar.
namespace Eigen {

template <>
struct NumTraits<flyball::expression::Traced> : GenericNumTraits<double> {
  using Real = flyball::expression::Traced;
  using NonInteger = flyball::expression::Traced;
  using Nested = const flyball::expression::Traced&;
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
};

template <class Op>
struct ScalarBinaryOpTraits<flyball::expression::Traced, double, Op> {
  using ReturnType = flyball::expression::Traced;
};
template <class Op>
struct ScalarBinaryOpTraits<double, flyball::expression::Traced, Op> {
  using ReturnType = flyball::expression::Traced;
};

}  // namespace Eigen
/// @endcond
