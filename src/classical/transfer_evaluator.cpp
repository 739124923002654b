#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <flyball/classical/transfer_expression.hpp>

#include "classical/transfer_evaluator.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::VectorXd;
using flyball::detail::format;

namespace {

constexpr std::size_t most_delays = 64;

class Evaluator {
 public:
  Evaluator(std::string_view text, const detail::TransferSyntax& syntax)
      : text_(text), syntax_(syntax) {}

  Expected<LateQuotient> run() {
    std::vector<LateQuotient> values;
    values.reserve(syntax_.nodes.size());
    for (const TransferNode& node : syntax_.nodes) {
      auto value = evaluate(node, values);
      if (!value) {
        return tl::unexpected(
            at_place(std::move(value).error().in(std::string(in_transfer_function)), node.place));
      }
      clear_shifts(value->q, syntax_.variable);
      const Index most = degree(*value);
      if (const std::size_t parts = terms(*value); most > highest_degree || parts > most_delays) {
        return tl::unexpected(at_place(
            Error(TransferTextError::degree_too_high)
                .in(std::string(in_transfer_function))
                .about(words(node))
                .got(most > highest_degree ? format("of degree {}", most)
                                           : format("a sum of {} dead times", parts))
                .expected(most > highest_degree ? format("of degree {} at most", highest_degree)
                                                : format("of {} at most", most_delays)),
            node.place));
      }
      if (!value->q.gain.all_finite()) {
        return tl::unexpected(
            at_place(not_a_number(node, "beyond the range of a double"), node.place));
      }
      // What an operand holds is not needed again: each has one parent.
      values.push_back(*std::move(value));
    }
    return std::move(values.back());
  }

 private:
  [[nodiscard]] std::string words(const TransferNode& node) const {
    return quote(text_, node.place);
  }
  [[nodiscard]] Error not_a_number(const TransferNode& node, std::string got) const {
    return Error(TransferTextError::not_a_number)
        .in(std::string(in_transfer_function))
        .about(words(node))
        .got(std::move(got))
        .expected("a finite number");
  }
  [[nodiscard]] char variable() const { return syntax_.variable == 0 ? 's' : syntax_.variable; }

  Expected<LateQuotient> evaluate(const TransferNode& node, std::vector<LateQuotient>& values) {
    using Kind = TransferNode::Kind;
    switch (node.kind) {
      case Kind::number:
      case Kind::euler:
        return constant_of(node.number);
      case Kind::variable:
        return LateQuotient{{.num = {{polynomial(Eigen::Vector2d(1.0, 0.0)), 1}}}};
      case Kind::coefficients:
        return LateQuotient{of_polynomial(polynomial(
            Eigen::Map<const VectorXd>(node.list.data(), static_cast<Index>(node.list.size()))))};
      case Kind::negate:
        values[node.a].q.gain = flyball::detail::scaled(values[node.a].q.gain, -1.0);
        return std::move(values[node.a]);
      case Kind::add:
      case Kind::subtract:
        return added(values[node.a], node.kind == Kind::add ? 1.0 : -1.0, values[node.b]);
      case Kind::multiply:
        return product(values[node.a], values[node.b]);
      case Kind::divide:
        return divided(syntax_.nodes[node.b], values[node.a], values[node.b]);
      case Kind::power:
        return power(node, values[node.a], values[node.b]);
      case Kind::exponential:
        return exponential(node, values[node.a]);
      case Kind::feedback:
        return closed(node, values[node.a], values[node.b]);
      case Kind::square_root:
        break;
    }
    return square_root(node, values[node.a]);
  }

  static LateQuotient constant_of(double value) { return {number(value)}; }

  static LateQuotient added(const LateQuotient& a, double sign, const LateQuotient& b) {
    if (a.is_zero() || b.is_zero()) {
      LateQuotient one = a.is_zero() ? b : a;
      one.q.gain = flyball::detail::scaled(one.q.gain, a.is_zero() ? sign : 1.0);
      return one;
    }
    return sum(a, sign, b);
  }

  /// G/(1 + G H)
  [[nodiscard]] Expected<LateQuotient> closed(const TransferNode& node, const LateQuotient& G,
                                              const LateQuotient& H) const {
    return divided(node, G, added(constant_of(1.0), 1.0, product(G, H)));
  }

  /// @param below  The divisor, for messages.
  [[nodiscard]] Expected<LateQuotient> divided(const TransferNode& below, const LateQuotient& a,
                                               const LateQuotient& b) const {
    if (b.is_zero()) {
      return refusal(TransferError::zero_denominator, {}, words(below))
          .got("zero")
          .hint("nothing can be divided by it");
    }
    const double ahead = b.q.delay - a.q.delay;
    if (!a.is_zero() && ahead > 1e-12 * b.q.delay) {
      return refusal(TransferTextError::negative_delay, {}, words(below))
          .got(format("a dead time of {} s below a fraction", ahead))
          .expected("above it: divided by exp(-T*s) the output would come before the input");
    }
    const auto gain = flyball::detail::solve(b.q.gain, a.q.gain);
    if (!gain) {
      return tl::unexpected(not_a_number(below, "too small to divide by"));
    }
    if (a.is_zero()) {
      return constant_of(0.0);
    }
    LateQuotient whole = product(a, turned_over(b));
    const RatioFactors cleared = common(a.q.den, b.q.den);
    whole.q = Quotient{.gain = *gain,
                       .num = together(a.q.num, without(b.q.den, cleared)),
                       .den = together(without(a.q.den, cleared), b.q.num),
                       .delay = std::max(0.0, -ahead)};
    return whole;
  }

  Expected<LateQuotient> power(const TransferNode& node, const LateQuotient& base,
                               const LateQuotient& exponent) const {
    if (!exponent.is_constant()) {
      if (syntax_.nodes[node.a].kind == TransferNode::Kind::euler) {
        return exponential(node, exponent);
      }
      return refusal(TransferTextError::power_not_whole, {},
                     "the exponent " + words(syntax_.nodes[node.b]))
          .got("not a number")
          .expected("a whole number")
          .hint("write exp(-T*s) for dead time");
    }
    const double k = exponent.value();
    if (base.is_constant()) {
      const double value = std::pow(base.value(), k);
      if (!std::isfinite(value)) {
        return tl::unexpected(not_a_number(node, "not finite"));
      }
      return constant_of(value);
    }
    if (k != std::round(k)) {
      return refusal(TransferTextError::power_not_whole, {},
                     "the exponent " + words(syntax_.nodes[node.b]))
          .got(format("{}", k))
          .expected("a whole number: of others there is no rational function");
    }
    if (std::abs(k) > static_cast<double>(highest_degree)) {
      return refusal(TransferTextError::degree_too_high, {},
                     "the exponent " + words(syntax_.nodes[node.b]))
          .got(format("{}", k))
          .expected(format("at most {}", highest_degree));
    }
    LateQuotient whole = constant_of(1.0);
    for (int i = 0; i < static_cast<int>(std::abs(k)); ++i) {
      whole = product(whole, base);
      if (terms(whole) > most_delays) {
        break;  // refused as a whole
      }
    }
    return k < 0.0 ? divided(syntax_.nodes[node.a], constant_of(1.0), whole) : whole;
  }

  /// e^{c - T s}.
  Expected<LateQuotient> exponential(const TransferNode& node, const LateQuotient& argument) const {
    const auto refuse = [&](std::string got) {
      return refusal(TransferTextError::not_a_delay, {}, words(node))
          .got(std::move(got))
          .expected("exp(-T*s), a dead time of T seconds");
    };
    double offset = argument.is_constant() ? argument.value() : 0.0;
    double slope = 0.0;
    if (!argument.is_constant()) {
      if (variable() == 'z') {
        return refuse("an exponential of z").hint("write z^-5 for five samples of dead time");
      }
      const Quotient& q = argument.q;
      if (!argument.is_rational() || !q.den.empty() || q.delay > 0.0 || degree(q.num) != 1) {
        return refuse("the exponential of what is not proportional to s");
      }
      const VectorXd p = expanded(q.num, q.gain).rounded();
      slope = p(0);
      offset = p(1);
    }
    if (slope > 0.0) {
      return refusal(TransferTextError::negative_delay, {}, words(node))
          .got(format("{} s ahead of its input", slope))
          .expected("a dead time, exp(-T*s)")
          .hint("write the minus sign");
    }
    const double gain = std::exp(offset);
    if (!std::isfinite(gain) || !std::isfinite(slope)) {
      return tl::unexpected(not_a_number(node, "not finite"));
    }
    LateQuotient late = constant_of(gain);
    late.q.delay = -slope;
    return late;
  }

  Expected<LateQuotient> square_root(const TransferNode& node, const LateQuotient& argument) const {
    if (!argument.is_constant()) {
      return refusal(TransferTextError::power_not_whole, {}, words(node))
          .got("the square root of a function")
          .expected("of a number: there is no rational function otherwise");
    }
    if (argument.value() < 0.0) {
      return tl::unexpected(not_a_number(node, "the square root of a negative number"));
    }
    return constant_of(std::sqrt(argument.value()));
  }

  std::string_view text_;
  const detail::TransferSyntax& syntax_;
};

}  // namespace

Expected<LateQuotient> evaluate(std::string_view text, const TransferSyntax& syntax) {
  return Evaluator(text, syntax).run();
}

}  // namespace flyball::classical::detail
