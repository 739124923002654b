#include <flyball/classical/transfer_expression.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <flyball/math/expression/formula.hpp>

#include "classical/polynomial.hpp"
#include "classical/transfer_syntax.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using detail::at_place;
using detail::Polynomial;
using detail::quote;
using detail::TextPlace;
using detail::TransferNode;
using Eigen::Index;
using Eigen::VectorXd;
using expression::ExpressionError;
using flyball::detail::format;

constexpr std::string_view where = "transfer function";
constexpr Index highest_degree = 100;

/// A polynomial that is not a constant, and how often it stands there.
struct Factor {
  Polynomial p;
  Index times = 1;
};
using Factors = std::vector<Factor>;

Polynomial constant(double value) {
  return detail::polynomial(VectorXd::Constant(1, value));
}

bool is_zero(const Polynomial& p) {
  return p.hi.isZero(0.0) && p.lo.isZero(0.0);
}

bool same(const Polynomial& a, const Polynomial& b) {
  return a.rows() == b.rows() && a.hi == b.hi && a.lo == b.lo;
}

/// s or z itself.
bool is_variable(const Polynomial& p) {
  return p.rows() == 2 && p.hi(0, 0) == 1.0 && p.lo(0, 0) == 0.0 && p.hi(1, 0) == 0.0 &&
         p.lo(1, 0) == 0.0;
}

Index degree(const Factors& factors) {
  Index sum = 0;
  for (const Factor& factor : factors) {
    sum += (factor.p.rows() - 1) * factor.times;
  }
  return sum;
}

Index count_of(const Factors& factors, const Polynomial& p) {
  for (const Factor& factor : factors) {
    if (same(factor.p, p)) {
      return factor.times;
    }
  }
  return 0;
}

void multiply(Factors& factors, const Polynomial& p, Index times) {
  for (Factor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times += times;
      return;
    }
  }
  factors.push_back({p, times});
}

void remove(Factors& factors, const Polynomial& p, Index times) {
  for (Factor& factor : factors) {
    if (same(factor.p, p)) {
      factor.times -= times;
    }
  }
  std::erase_if(factors, [](const Factor& factor) { return factor.times == 0; });
}

/// What two have in common.
Factors common(const Factors& a, const Factors& b) {
  Factors both;
  for (const Factor& factor : a) {
    if (const Index times = std::min(factor.times, count_of(b, factor.p)); times > 0) {
      both.push_back({factor.p, times});
    }
  }
  return both;
}

Factors without(Factors factors, const Factors& less) {
  for (const Factor& factor : less) {
    remove(factors, factor.p, factor.times);
  }
  return factors;
}

Factors together(Factors factors, const Factors& more) {
  for (const Factor& factor : more) {
    multiply(factors, factor.p, factor.times);
  }
  return factors;
}

Polynomial expanded(const Factors& factors, Polynomial p) {
  for (const Factor& factor : factors) {
    for (Index i = 0; i < factor.times; ++i) {
      p = detail::times(p, factor.p);
    }
  }
  return p;
}

/// gain Π num / Π den e^{-delay s}, factored as it was written.
struct Quotient {
  Polynomial gain = constant(1.0);  ///< A number.
  Factors num{};
  Factors den{};
  double delay = 0.0;

  [[nodiscard]] bool is_zero() const { return classical::is_zero(gain); }
  [[nodiscard]] bool is_constant() const { return num.empty() && den.empty() && delay == 0.0; }
  [[nodiscard]] double value() const { return gain.rounded()(0, 0); }
};

Quotient number(double value) {
  return {.gain = constant(value)};
}

/// The quotient of a polynomial; nothing but a gain if it is of degree 0.
Quotient of_polynomial(const Polynomial& p) {
  const Polynomial q = detail::trimmed(p);
  if (q.rows() == 1) {
    return {.gain = q};
  }
  return {.num = {{q, 1}}};
}

/// z/z is one: its pole is no dynamics of the plant, but of how it is written.
void clear_shifts(Quotient& q, char variable) {
  if (variable != 'z') {
    return;
  }
  for (const Factor& factor : common(q.num, q.den)) {
    if (is_variable(factor.p)) {
      remove(q.num, factor.p, factor.times);
      remove(q.den, factor.p, factor.times);
    }
  }
}

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
        return product(values[node.a], values[node.b]);
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
    // a/c + b/d = (a d' + b c')/lcm(c, d), factors that both have kept in front.
    Quotient whole{.delay = a.delay};
    const Factors in_front = common(a.num, b.num);
    const Factors below = common(a.den, b.den);
    const Factors only_a = without(a.den, below);
    const Factors only_b = without(b.den, below);
    const Polynomial left = expanded(together(without(a.num, in_front), only_b), a.gain);
    const Polynomial right = expanded(together(without(b.num, in_front), only_a), b.gain);
    const Polynomial above = detail::trimmed(detail::plus(left, sign, right));
    if (is_zero(above)) {
      return number(0.0);
    }
    whole.num = in_front;
    whole.den = together(together(below, only_a), only_b);
    if (above.rows() == 1) {
      whole.gain = above;
    } else {
      multiply(whole.num, above, 1);
    }
    return whole;
  }

  [[nodiscard]] Error delays_differ(const TransferNode& node, double a, double b) const {
    return Error(TransferError::delay_in_loop)
        .about(words(node))
        .got(format("a sum of parts with {} s and {} s of dead time", a, b))
        .expected("of one dead time: the sum of others is no rational function")
        .hint("approximate one of them by (1 - T*s/2)/(1 + T*s/2)");
  }

  static Quotient product(const Quotient& a, const Quotient& b) {
    if (a.is_zero() || b.is_zero()) {
      return number(0.0);
    }
    return {.gain = detail::times(a.gain, b.gain),
            .num = together(a.num, b.num),
            .den = together(a.den, b.den),
            .delay = a.delay + b.delay};
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

Expected<TransferFunction> parse_transfer_product(std::span<const std::string> texts,
                                                  std::optional<Time> period) {
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
    if (whole.is_zero() || parsed->value.is_zero()) {
      whole = number(0.0);
    } else {
      whole.gain = detail::times(whole.gain, parsed->value.gain);
      whole.num = together(whole.num, parsed->value.num);
      whole.den = together(whole.den, parsed->value.den);
      whole.delay += parsed->value.delay;
    }
    clear_shifts(whole, variable);
  }
  if (std::max(degree(whole.num), degree(whole.den)) > highest_degree) {
    return refusal(TransferTextError::degree_too_high, where, "the product")
        .got(format("of degree {}", std::max(degree(whole.num), degree(whole.den))))
        .expected(format("of degree {} at most", highest_degree));
  }
  std::string product;
  for (const std::string& text : texts) {
    product += (product.empty() ? "(" : "*(") + text + ")";
  }
  return finished(whole, period, texts.size() == 1 ? texts.front() : product);
}

}  // namespace flyball::classical
