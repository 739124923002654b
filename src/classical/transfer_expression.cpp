#include <flyball/classical/transfer_expression.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <flyball/math/expression/formula.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/locus_loop.hpp"
#include "classical/polynomial.hpp"
#include "classical/quotient.hpp"
#include "classical/transfer_syntax.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using detail::at_place;
using detail::clear_shifts;
using detail::common;
using detail::constant;
using detail::degree;
using detail::expanded;
using detail::Factor;
using detail::Factors;
using detail::multiply;
using detail::number;
using detail::of_polynomial;
using detail::Polynomial;
using detail::quote;
using detail::Quotient;
using detail::TextPlace;
using detail::together;
using detail::TransferNode;
using detail::without;
using Eigen::Index;
using Eigen::VectorXd;
using expression::ExpressionError;
using flyball::detail::format;

constexpr std::string_view where = "transfer function";
constexpr Index highest_degree = 100;

class Evaluator {
 public:
  Evaluator(std::string_view text, const detail::TransferSyntax& syntax)
      : text_(text), syntax_(syntax) {}

  Expected<Quotient> run() {
    std::vector<Quotient> values;
    values.reserve(syntax_.nodes.size());
    for (const TransferNode& node : syntax_.nodes) {
      auto value = evaluate(node, values);
      if (!value) {
        return tl::unexpected(
            at_place(std::move(value).error().in(std::string(where)), node.place));
      }
      clear_shifts(*value, syntax_.variable);
      if (const Index most = std::max(degree(value->num), degree(value->den));
          most > highest_degree) {
        return tl::unexpected(
            at_place(Error(TransferTextError::degree_too_high)
                         .in(std::string(where))
                         .about(words(node))
                         .got(format("of degree {}", most))
                         .expected(format("of degree {} at most", highest_degree)),
                     node.place));
      }
      if (!value->gain.all_finite()) {
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
        .in(std::string(where))
        .about(words(node))
        .got(std::move(got))
        .expected("a finite number");
  }
  [[nodiscard]] char variable() const { return syntax_.variable == 0 ? 's' : syntax_.variable; }

  Expected<Quotient> evaluate(const TransferNode& node, std::vector<Quotient>& values) {
    using Kind = TransferNode::Kind;
    switch (node.kind) {
      case Kind::number:
      case Kind::euler:
        return number(node.number);
      case Kind::variable:
        return Quotient{.num = {{detail::polynomial(Eigen::Vector2d(1.0, 0.0)), 1}}};
      case Kind::coefficients:
        return of_polynomial(detail::polynomial(
            Eigen::Map<const VectorXd>(node.list.data(), static_cast<Index>(node.list.size()))));
      case Kind::negate:
        values[node.a].gain = flyball::detail::scaled(values[node.a].gain, -1.0);
        return std::move(values[node.a]);
      case Kind::add:
      case Kind::subtract:
        return sum(node, values[node.a], node.kind == Kind::add ? 1.0 : -1.0, values[node.b]);
      case Kind::multiply:
        return detail::product(values[node.a], values[node.b]);
      case Kind::divide:
        return divided(syntax_.nodes[node.b], values[node.a], values[node.b]);
      case Kind::power:
        return power(node, values[node.a], values[node.b]);
      case Kind::exponential:
        return exponential(node, values[node.a]);
      case Kind::square_root:
        break;
    }
    return square_root(node, values[node.a]);
  }

  Expected<Quotient> sum(const TransferNode& node, const Quotient& a, double sign,
                         const Quotient& b) const {
    if (a.is_zero() || b.is_zero()) {
      Quotient one = a.is_zero() ? b : a;
      one.gain = flyball::detail::scaled(one.gain, a.is_zero() ? sign : 1.0);
      return one;
    }
    if (a.delay != b.delay) {
      return tl::unexpected(delays_differ(node, a.delay, b.delay));
    }
    return detail::sum(a, sign, b);
  }

  [[nodiscard]] Error delays_differ(const TransferNode& node, double a, double b) const {
    return Error(TransferError::delay_in_loop)
        .about(words(node))
        .got(format("a sum of parts with {} s and {} s of dead time", a, b))
        .expected("of one dead time: the sum of others is no rational function")
        .hint("approximate one of them by (1 - T*s/2)/(1 + T*s/2)");
  }

  /// @param below  The divisor, for messages.
  Expected<Quotient> divided(const TransferNode& below, const Quotient& a,
                             const Quotient& b) const {
    if (b.is_zero()) {
      return refusal(TransferError::zero_denominator, {}, words(below))
          .got("zero")
          .hint("nothing can be divided by it");
    }
    if (b.delay > 0.0) {
      return refusal(TransferTextError::negative_delay, {}, words(below))
          .got(format("a dead time of {} s below a fraction", b.delay))
          .expected("above it: divided by exp(-T*s) the output would come before the input");
    }
    const auto gain = flyball::detail::solve(b.gain, a.gain);
    if (!gain) {
      return tl::unexpected(not_a_number(below, "too small to divide by"));
    }
    if (a.is_zero()) {
      return number(0.0);
    }
    const Factors cleared = common(a.den, b.den);
    return Quotient{.gain = *gain,
                    .num = together(a.num, without(b.den, cleared)),
                    .den = together(without(a.den, cleared), b.num),
                    .delay = a.delay};
  }

  Expected<Quotient> power(const TransferNode& node, const Quotient& base,
                           const Quotient& exponent) const {
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
      return number(value);
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
    Quotient whole = number(1.0);
    for (int i = 0; i < static_cast<int>(std::abs(k)); ++i) {
      whole.gain = detail::times(whole.gain, base.gain);
    }
    const auto times = static_cast<Index>(std::abs(k));
    for (const Factor& factor : base.num) {
      multiply(whole.num, factor.p, factor.times * times);
    }
    for (const Factor& factor : base.den) {
      multiply(whole.den, factor.p, factor.times * times);
    }
    whole.delay = base.delay * std::abs(k);
    return k < 0.0 ? divided(syntax_.nodes[node.a], number(1.0), whole) : whole;
  }

  /// e^{c - T s}.
  Expected<Quotient> exponential(const TransferNode& node, const Quotient& argument) const {
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
      if (!argument.den.empty() || argument.delay > 0.0 || degree(argument.num) != 1) {
        return refuse("the exponential of what is not proportional to s");
      }
      const VectorXd p = expanded(argument.num, argument.gain).rounded();
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
    Quotient late = number(gain);
    late.delay = -slope;
    return late;
  }

  Expected<Quotient> square_root(const TransferNode& node, const Quotient& argument) const {
    if (!argument.is_constant()) {
      return refusal(TransferTextError::power_not_whole, {}, words(node))
          .got("the square root of a function")
          .expected("of a number: there is no rational function otherwise");
    }
    if (argument.value() < 0.0) {
      return tl::unexpected(not_a_number(node, "the square root of a negative number"));
    }
    return number(std::sqrt(argument.value()));
  }

  std::string_view text_;
  const detail::TransferSyntax& syntax_;
};

struct Parsed {
  detail::TransferSyntax syntax;
  Quotient value;
};

Expected<Parsed> parse(std::string_view text) {
  FLYBALL_TRY(auto syntax, detail::parse_transfer_syntax(text));
  FLYBALL_TRY(auto value, Evaluator(text, syntax).run());
  return Parsed{std::move(syntax), std::move(value)};
}

/// What the sample period says to the variable.
Expected<void> check_period(const detail::TransferSyntax& syntax,
                            const std::optional<Time>& period) {
  if (syntax.variable == 'z' && !period) {
    return tl::unexpected(at_place(Error(TransferTextError::period_missing)
                                       .in(std::string(where))
                                       .about("the sample period")
                                       .got("not given")
                                       .expected("that of z")
                                       .hint("give it, such as --period 20ms (dt)"),
                                   syntax.first_use));
  }
  if (syntax.variable == 's' && period) {
    return tl::unexpected(at_place(Error(TransferTextError::period_without_z)
                                       .in(std::string(where))
                                       .about("the expression")
                                       .got("of s, which has no sample period")
                                       .expected("of z with a period, or of s without")
                                       .hint("leave the period out"),
                                   syntax.first_use));
  }
  return {};
}

Expected<TransferFunction> finished(const Quotient& q, const std::optional<Time>& period,
                                    std::string_view text) {
  const TextPlace whole{0, text.size()};
  const Index above = degree(q.num);
  const Index below = degree(q.den);
  if (above > below) {
    return tl::unexpected(
        at_place(Error(TransferError::improper)
                     .in(std::string(where))
                     .about(quote(text, whole))
                     .got(format("of degree {} above and {} below", above, below))
                     .expected("of a numerator whose degree is not above the denominator's")
                     .hint("add a fast pole, such as /(0.001*s + 1)"),
                 whole));
  }
  const VectorXd num = expanded(q.num, q.gain).rounded();
  const VectorXd den = expanded(q.den, constant(1.0)).rounded();
  auto made = TransferFunction::create(num, den, period, Time(q.delay));
  if (!made) {
    return tl::unexpected(at_place(std::move(made).error(), whole));
  }
  return made;
}

}  // namespace

ErrorInfo error_info(TransferTextError code) {
  static constexpr flyball::detail::ErrorRow rows[] = {
      {"both_variables", "s and z do not go together", ErrorKind::misuse},
      {"period_missing", "the sample period of z is not known", ErrorKind::misuse},
      {"period_without_z", "s has no sample period", ErrorKind::misuse},
      {"negative_delay", "this would be ahead of its input", ErrorKind::misuse},
      {"not_a_delay", "this is no dead time", ErrorKind::misuse},
      {"power_not_whole", "this power is not a whole number", ErrorKind::misuse},
      {"not_a_number", "this is no finite number", ErrorKind::misuse},
      {"ambiguous_division", "this can be read in two ways", ErrorKind::misuse},
      {"degree_too_high", "the degree is too high", ErrorKind::misuse},
  };
  return flyball::detail::info_of(code, "transfer_text", rows);
}

Expected<TransferFunction> parse_transfer_function(std::string_view text,
                                                   std::optional<Time> period) {
  FLYBALL_TRY(const auto parsed, parse(text));
  FLYBALL_CHECK(check_period(parsed.syntax, period));
  return finished(parsed.value, period, text);
}

namespace {

/// The product of several texts, whose errors say which of them they are about.
Expected<Quotient> product_of(std::span<const std::string> texts,
                              const std::optional<Time>& period) {
  if (texts.empty()) {
    return refusal(ArgumentError::empty, where, "the factors");
  }
  Quotient whole = number(1.0);
  char variable = 0;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const auto tell = [&](Error error) {
      return tl::unexpected(std::move(error).with("text", static_cast<double>(i)));
    };
    auto parsed = parse(texts[i]);
    if (!parsed) {
      return tell(std::move(parsed).error());
    }
    if (auto fits = check_period(parsed->syntax, period); !fits) {
      return tell(std::move(fits).error());
    }
    const char own = parsed->syntax.variable;
    if (own != 0 && variable != 0 && own != variable) {
      return tell(at_place(Error(TransferTextError::both_variables)
                               .in(std::string(where))
                               .about(quote(texts[i], parsed->syntax.first_use))
                               .got(format("in a product with an expression of {}", variable))
                               .expected("of one variable"),
                           parsed->syntax.first_use));
    }
    variable = own != 0 ? own : variable;
    whole = detail::product(whole, parsed->value);
    clear_shifts(whole, variable);
  }
  if (std::max(degree(whole.num), degree(whole.den)) > highest_degree) {
    return refusal(TransferTextError::degree_too_high, where, "the product")
        .got(format("of degree {}", std::max(degree(whole.num), degree(whole.den))))
        .expected(format("of degree {} at most", highest_degree));
  }
  return whole;
}

/// The roots of factors, each on its own.
Expected<Eigen::VectorXcd> roots_of(const Factors& factors, std::string_view name) {
  std::vector<std::complex<double>> all;
  for (const Factor& factor : factors) {
    const auto found = detail::roots(factor.p);
    if (!found) {
      return refusal(SystemError::no_convergence, where, name).got("not found");
    }
    for (const detail::MultipleRoot& root : detail::grouped(*found, factor.p)) {
      all.insert(all.end(), static_cast<std::size_t>(root.times * factor.times), root.at);
    }
  }
  return Eigen::VectorXcd(
      Eigen::Map<const Eigen::VectorXcd>(all.data(), static_cast<Index>(all.size())));
}

}  // namespace

Expected<TransferFunction> parse_transfer_product(std::span<const std::string> texts,
                                                  std::optional<Time> period) {
  FLYBALL_TRY(const Quotient whole, product_of(texts, period));
  std::string product;
  for (const std::string& text : texts) {
    product += (product.empty() ? "(" : "*(") + text + ")";
  }
  return finished(whole, period, texts.size() == 1 ? texts.front() : product);
}

Expected<ZeroPoleGain> parse_zero_pole_gain(std::span<const std::string> texts,
                                            std::optional<Time> period) {
  FLYBALL_TRY(const Quotient whole, product_of(texts, period));
  FLYBALL_TRY(const auto zeros, roots_of(whole.num, "the zeros"));
  FLYBALL_TRY(const auto poles, roots_of(whole.den, "the poles"));
  double gain = whole.value();
  for (const Factor& factor : whole.num) {
    gain *= std::pow(factor.p.hi(0, 0), static_cast<double>(factor.times));
  }
  for (const Factor& factor : whole.den) {
    gain /= std::pow(factor.p.hi(0, 0), static_cast<double>(factor.times));
  }
  return ZeroPoleGain::create(zeros, poles, gain, period, Time(whole.delay));
}

}  // namespace flyball::classical
