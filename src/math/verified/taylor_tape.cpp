#include "math/verified/interval_functions.hpp"
#include "math/verified/taylor_tape.hpp"

namespace flyball::detail {

using expression::Node;
using expression::Operation;

namespace {

TaylorForm form_between(const Interval& range) noexcept {
  if (is_bounded(range)) {
    return TaylorForm::between(range);
  }
  TaylorForm x;
  x.radius = std::numeric_limits<double>::infinity();
  return x;
}

bool is_bounded_form(const TaylorForm& x) noexcept {
  return std::isfinite(x.deviation()) && std::isfinite(x.centre);
}

/// sin, or with a quarter of a turn cos.
TaylorForm wave(const TaylorForm& x, int quarters) noexcept {
  const Interval centre(x.centre);
  const Interval value = sine(centre, quarters);
  const Interval other = sine(centre, 1 - quarters);
  const Interval slope = quarters == 0 ? other : -other;
  constexpr double sixth = 0.1666666666666667;  // no less
  return applied(x, value, slope, Interval(-0.5) * value, sixth);
}

TaylorForm square_root(const TaylorForm& x) noexcept {
  const Interval range = x.range();
  if (!(range.low > 0.0)) {
    return form_between(root(range));
  }
  const Interval at = root(Interval(x.centre));
  const Interval slope = Interval(0.5) / at;
  const Interval half_second = -(slope / (Interval(4.0) * Interval(x.centre)));
  // f'''/6 = 1/16 x^(-5/2)
  const Interval least = root(Interval(range.low));
  const Interval third = Interval(1.0) / (Interval(16.0) * least * square(Interval(range.low)));
  return applied(x, at, slope, half_second, third.high);
}

TaylorForm tangent_hyperbolic(const TaylorForm& x) noexcept {
  const Interval t = apply_interval(Operation::tanh, Interval(x.centre), {}, {});
  const Interval slope = Interval(1.0) - square(t);
  // tanh''/2 = -t (1 - t²); |tanh'''| <= 2
  return applied(x, t, slope, -(t * slope), 0.3333333333333334);
}

TaylorForm arc_tangent(const TaylorForm& x) noexcept {
  const Interval centre(x.centre);
  const Interval value = apply_interval(Operation::atan, centre, {}, {});
  const Interval slope = Interval(1.0) / (Interval(1.0) + square(centre));
  // atan''/2 = -x/(1 + x²)²; |atan'''| <= 2
  return applied(x, value, slope, -(centre * square(slope)), 0.3333333333333334);
}

TaylorForm apply_taylor(Operation operation, const TaylorForm& a, const TaylorForm& b,
                        const TaylorForm& c) noexcept {
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
    case Operation::chain:
      return a * b;
    case Operation::negate:
      return -a;
    case Operation::divide:
      if (is_bounded_form(b) && separated_from_zero(b)) {
        return a * reciprocal(b);
      }
      break;
    case Operation::power:
      if (b.centre == 2.0 && b.deviation() == 0.0) {
        return a * a;
      }
      break;
    case Operation::sin:
      return is_bounded_form(a) ? wave(a, 0) : form_between({-1.0, 1.0});
    case Operation::cos:
      return is_bounded_form(a) ? wave(a, 1) : form_between({-1.0, 1.0});
    case Operation::tan:
      if (is_bounded_form(a)) {
        const TaylorForm c_a = wave(a, 1);
        if (separated_from_zero(c_a)) {
          return wave(a, 0) * reciprocal(c_a);
        }
      }
      break;
    case Operation::sqrt:
      if (is_bounded_form(a)) {
        return square_root(a);
      }
      break;
    case Operation::exp:
      if (is_bounded_form(a)) {
        return exp(a);
      }
      break;
    case Operation::tanh:
      return is_bounded_form(a) ? tangent_hyperbolic(a) : form_between({-1.0, 1.0});
    case Operation::atan:
      if (is_bounded_form(a)) {
        return arc_tangent(a);
      }
      break;
    case Operation::abs:
      if (is_bounded_form(a) && separated_from_zero(a)) {
        return a.range().low > 0.0 ? a : -a;
      }
      break;
    case Operation::minimum:
    case Operation::maximum:
      if (is_bounded_form(a) && is_bounded_form(b)) {
        const bool first_less = a.range().high < b.range().low;
        if (first_less || b.range().high < a.range().low) {
          return (operation == Operation::minimum) == first_less ? a : b;
        }
      }
      break;
    default:
      break;
  }
  const auto range_of = [](const TaylorForm& x) {
    return is_bounded_form(x) ? x.range() : anything;
  };
  const Interval condition = range_of(a);
  if (operation == Operation::select && !condition.contains(0.0)) {
    return b;
  }
  return form_between(apply_interval(operation, condition, range_of(b), range_of(c)));
}

}  // namespace

TaylorTape::TaylorTape(expression::Tape tape, std::span<const double> parameters)
    : tape_(std::move(tape)), values_(tape_.size()), outputs_(tape_.outputs()) {
  first_input_ = tape_.inputs() > 0 ? tape_.input_slot(0).index : tape_.size();
  for (std::size_t i = 0; i < first_input_; ++i) {
    const Node& node = tape_.nodes()[i];
    if (node.operation == Operation::constant) {
      values_[i] = node.value();
    } else if (node.operation == Operation::parameter) {
      values_[i] =
          node.a < parameters.size() ? TaylorForm(parameters[node.a]) : form_between(anything);
    } else {
      compute(i, i + 1);
    }
  }
}

std::span<const TaylorForm> TaylorTape::evaluate(std::span<const TaylorForm> inputs) noexcept {
  for (std::size_t k = 0; k < tape_.inputs(); ++k) {
    values_[first_input_ + k] = inputs[k];
  }
  compute(first_input_ + tape_.inputs(), tape_.size());
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    outputs_[k] = values_[tape_.output_slots()[k].index];
  }
  return outputs_;
}

void TaylorTape::compute(std::size_t first, std::size_t last) noexcept {
  static constexpr TaylorForm none(0.0);
  const Node* const nodes = tape_.nodes().data();
  for (std::size_t i = first; i < last; ++i) {
    const Node& node = nodes[i];
    const int operands = operand_count(node.operation);
    values_[i] =
        apply_taylor(node.operation, values_[node.a], operands > 1 ? values_[node.b] : none,
                     operands > 2 ? values_[node.c] : none);
  }
}

double upper_bound(const TaylorForm& x) noexcept {
  double reach = 0.0;
  for (std::size_t i = 0; i < x.slope.size(); ++i) {
    const double slope = std::abs(x.slope[i]);
    const double bend = x.square[square_index(i, i)];
    if (bend >= 0.0) {
      reach += slope + bend;
    } else if (slope < -2.0 * bend) {
      reach += slope * slope / (-4.0 * bend);
    } else {
      reach += slope + bend + 4.0 * unit_roundoff * slope;
    }
    for (std::size_t j = i + 1; j < x.slope.size(); ++j) {
      reach += std::abs(x.square[square_index(i, j)]);
    }
  }
  return rounded_up(x.centre + (reach + x.radius) * inflation);
}

}  // namespace flyball::detail
