#include <flyball/optimization/problem/expression.hpp>

#include <algorithm>

#include <flyball/math/expression/tape_builder.hpp>

namespace flyball::optimization {

using expression::Node;
using expression::Operation;
using expression::Slot;
using expression::TapeBuilder;

std::string_view to_string(Degree degree) {
  switch (degree) {
    case Degree::constant:
      return "constant";
    case Degree::linear:
      return "linear";
    case Degree::quadratic:
      return "quadratic";
    case Degree::nonlinear:
      return "nonlinear";
  }
  return "";
}

namespace detail {

std::uint32_t ExpressionGraph::input() {
  nodes_.push_back({Operation::input, static_cast<std::uint32_t>(values.size()), 0, 0});
  degrees_.push_back(Degree::linear);
  values.push_back(0.0);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t ExpressionGraph::parameter(double value) {
  nodes_.push_back(
      {Operation::parameter, static_cast<std::uint32_t>(parameter_values.size()), 0, 0});
  degrees_.push_back(Degree::constant);
  parameter_values.push_back(value);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t ExpressionGraph::unary(Operation operation, std::uint32_t a) {
  const Degree degree = degrees_[a];
  has_kinks_ = has_kinks_ || operation == Operation::abs || operation == Operation::sqrt;
  nodes_.push_back({operation, a, 0, 0});
  degrees_.push_back(
      operation == Operation::negate || degree == Degree::constant ? degree : Degree::nonlinear);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t ExpressionGraph::binary(Operation operation, std::uint32_t a, std::uint32_t b) {
  const Degree of_a = degrees_[a];
  const Degree of_b = degrees_[b];
  has_kinks_ = has_kinks_ || operation == Operation::minimum || operation == Operation::maximum;
  Degree degree = Degree::nonlinear;
  if (of_a == Degree::constant && of_b == Degree::constant) {
    degree = Degree::constant;
  } else if (operation == Operation::add || operation == Operation::subtract) {
    degree = std::max(of_a, of_b);
  } else if (operation == Operation::multiply) {
    const int sum = static_cast<int>(of_a) + static_cast<int>(of_b);
    degree = static_cast<Degree>(std::min(sum, 3));
  } else if (operation == Operation::divide && of_b == Degree::constant) {
    degree = of_a;
  } else if (operation == Operation::power && of_b == Degree::constant &&
             nodes_[b].operation == Operation::constant) {
    const double exponent = nodes_[b].value();
    degree = exponent == 0.0                             ? Degree::constant
             : exponent == 1.0                           ? of_a
             : exponent == 2.0 && of_a == Degree::linear ? Degree::quadratic
                                                         : Degree::nonlinear;
  }
  nodes_.push_back({operation, a, b, 0});
  degrees_.push_back(degree);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

std::uint32_t ExpressionGraph::select(std::uint32_t condition, std::uint32_t then,
                                      std::uint32_t otherwise) {
  nodes_.push_back({Operation::select, condition, then, otherwise});
  const bool is_constant = degrees_[condition] == Degree::constant;
  degrees_.push_back(is_constant ? std::max(degrees_[then], degrees_[otherwise])
                                 : Degree::nonlinear);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

expression::Tape ExpressionGraph::tape(std::span<const std::uint32_t> outputs) const {
  // Only what the outputs need, found from the last needed node down.
  std::uint32_t last = 0;
  for (const std::uint32_t output : outputs) {
    last = std::max(last, output);
  }
  std::vector<bool> needed(std::size_t{last} + 1, false);
  for (const std::uint32_t output : outputs) {
    needed[output] = true;
  }
  for (std::size_t i = needed.size(); i-- > 0;) {
    const int operands = needed[i] ? expression::operand_count(nodes_[i].operation) : 0;
    for (int k = 0; k < operands; ++k) {
      needed[k == 0 ? nodes_[i].a : k == 1 ? nodes_[i].b : nodes_[i].c] = true;
    }
  }
  TapeBuilder builder(inputs(), parameters());
  std::vector<Slot> slots(needed.size());
  for (std::size_t i = 0; i < needed.size(); ++i) {
    if (!needed[i]) {
      continue;
    }
    Node node = nodes_[i];
    const int operands = expression::operand_count(node.operation);
    node.a = operands > 0 ? slots[node.a].index : node.a;
    node.b = operands > 1 ? slots[node.b].index : node.b;
    node.c = operands > 2 ? slots[node.c].index : node.c;
    slots[i] = builder.node(node);
  }
  std::vector<Slot> out;
  out.reserve(outputs.size());
  for (const std::uint32_t output : outputs) {
    out.push_back(slots[output]);
  }
  return builder.finish(out);
}

double ExpressionGraph::value(std::uint32_t node) const {
  if (nodes_[node].operation == Operation::input) {
    return values[nodes_[node].a];
  }
  if (nodes_[node].operation == Operation::parameter) {
    return parameter_values[nodes_[node].a];
  }
  const std::uint32_t outputs[] = {node};
  const expression::Tape made = tape(outputs);
  std::vector<double> work(made.size());
  made.prepare<double>(parameter_values, work);
  double result = 0.0;
  made.evaluate<double>(values, std::span(&result, 1), work);
  return result;
}

}  // namespace detail

namespace {

std::uint32_t node_in(detail::ExpressionGraph& graph, const Expression& a) {
  return a.is_constant() ? graph.constant(a.constant()) : a.node();
}

Expression unary(Operation operation, const Expression& a) {
  if (a.is_constant()) {
    return expression::apply<double>(operation, a.constant(), 0.0, 0.0);
  }
  return {a.graph(), a.graph()->unary(operation, a.node())};
}

Expression binary(Operation operation, const Expression& a, const Expression& b) {
  if (a.is_constant() && b.is_constant()) {
    return expression::apply<double>(operation, a.constant(), b.constant(), 0.0);
  }
  detail::ExpressionGraph& graph = a.is_constant() ? *b.graph() : *a.graph();
  const std::uint32_t left = node_in(graph, a);
  return {&graph, graph.binary(operation, left, node_in(graph, b))};
}

bool is(const Expression& a, double value) {
  return a.is_constant() && a.constant() == value;
}

}  // namespace

void Expression::set_value(double value) noexcept {
  if (graph_ == nullptr) {
    return;
  }
  const Node& node = graph_->nodes()[node_];
  if (node.operation == Operation::input) {
    graph_->values[node.a] = value;
  } else if (node.operation == Operation::parameter) {
    graph_->parameter_values[node.a] = value;
  }
}

Expression operator+(const Expression& a, const Expression& b) {
  return is(a, 0.0) ? b : is(b, 0.0) ? a : binary(Operation::add, a, b);
}
Expression operator-(const Expression& a, const Expression& b) {
  return is(b, 0.0) ? a : is(a, 0.0) ? -b : binary(Operation::subtract, a, b);
}
Expression operator*(const Expression& a, const Expression& b) {
  if (is(a, 0.0) || is(b, 0.0)) {
    return 0.0;
  }
  return is(a, 1.0) ? b : is(b, 1.0) ? a : binary(Operation::multiply, a, b);
}
Expression operator/(const Expression& a, const Expression& b) {
  return is(b, 1.0) || (is(a, 0.0) && !b.is_constant()) ? a : binary(Operation::divide, a, b);
}
Expression operator-(const Expression& a) {
  return unary(Operation::negate, a);
}
Expression& Expression::operator+=(const Expression& other) {
  return *this = *this + other;
}
Expression& Expression::operator-=(const Expression& other) {
  return *this = *this - other;
}
Expression& Expression::operator*=(const Expression& other) {
  return *this = *this * other;
}
Expression& Expression::operator/=(const Expression& other) {
  return *this = *this / other;
}

Expression pow(const Expression& a, const Expression& b) {
  return binary(Operation::power, a, b);
}
Expression atan2(const Expression& y, const Expression& x) {
  return binary(Operation::atan2, y, x);
}
Expression hypot(const Expression& a, const Expression& b) {
  return binary(Operation::hypot, a, b);
}
Expression min(const Expression& a, const Expression& b) {
  return binary(Operation::minimum, a, b);
}
Expression max(const Expression& a, const Expression& b) {
  return binary(Operation::maximum, a, b);
}
Expression sin(const Expression& a) {
  return unary(Operation::sin, a);
}
Expression cos(const Expression& a) {
  return unary(Operation::cos, a);
}
Expression tan(const Expression& a) {
  return unary(Operation::tan, a);
}
Expression asin(const Expression& a) {
  return unary(Operation::asin, a);
}
Expression acos(const Expression& a) {
  return unary(Operation::acos, a);
}
Expression atan(const Expression& a) {
  return unary(Operation::atan, a);
}
Expression sinh(const Expression& a) {
  return unary(Operation::sinh, a);
}
Expression cosh(const Expression& a) {
  return unary(Operation::cosh, a);
}
Expression tanh(const Expression& a) {
  return unary(Operation::tanh, a);
}
Expression exp(const Expression& a) {
  return unary(Operation::exp, a);
}
Expression log(const Expression& a) {
  return unary(Operation::log, a);
}
Expression sqrt(const Expression& a) {
  return unary(Operation::sqrt, a);
}
Expression abs(const Expression& a) {
  return unary(Operation::abs, a);
}
Expression sign(const Expression& a) {
  return unary(Operation::sign, a);
}

}  // namespace flyball::optimization
