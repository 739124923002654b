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
#include "classical/transfer_evaluator.hpp"
#include "classical/transfer_syntax.hpp"
#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using detail::at_place;
using detail::clear_shifts;
using detail::constant;
using detail::degree;
using detail::expanded;
using detail::highest_degree;
using detail::in_transfer_function;
using detail::LateQuotient;
using detail::number;
using detail::quote;
using detail::Quotient;
using detail::RatioFactor;
using detail::RatioFactors;
using detail::TextPlace;
using Eigen::Index;
using Eigen::VectorXd;
using flyball::detail::format;

struct Parsed {
  detail::TransferSyntax syntax;
  LateQuotient value;
};

Expected<Parsed> parse(std::string_view text) {
  FLYBALL_TRY(auto syntax, detail::parse_transfer_syntax(text));
  FLYBALL_TRY(auto value, detail::evaluate(text, syntax));
  return Parsed{std::move(syntax), std::move(value)};
}

/// What the sample period says to the variable.
Expected<void> check_period(const detail::TransferSyntax& syntax,
                            const std::optional<Time>& period) {
  if (syntax.variable == 'z' && !period) {
    return tl::unexpected(at_place(Error(TransferTextError::period_missing)
                                       .in(std::string(in_transfer_function))
                                       .about("the sample period")
                                       .got("not given")
                                       .expected("that of z")
                                       .hint("give it, such as --period 20ms (dt)"),
                                   syntax.first_use));
  }
  if (syntax.variable == 's' && period) {
    return tl::unexpected(at_place(Error(TransferTextError::period_without_z)
                                       .in(std::string(in_transfer_function))
                                       .about("the expression")
                                       .got("of s, which has no sample period")
                                       .expected("of z with a period, or of s without")
                                       .hint("leave the period out"),
                                   syntax.first_use));
  }
  return {};
}

/// The quotient of one that has one dead time.
Expected<Quotient> rational(const LateQuotient& value, std::string_view text) {
  if (value.is_rational()) {
    return value.q;
  }
  const TextPlace whole{0, text.size()};
  return tl::unexpected(at_place(Error(TransferError::delay_in_loop)
                                     .in(std::string(in_transfer_function))
                                     .about(quote(text, whole))
                                     .got("made of parts of several dead times")
                                     .expected("a rational function behind one dead time")
                                     .hint("approximate the others by (1 - T*s/2)/(1 + T*s/2)"),
                                 whole));
}

/// The roots of factors, each on its own.
Expected<Eigen::VectorXcd> roots_of(const RatioFactors& factors, std::string_view name,
                                    bool discrete) {
  std::vector<std::complex<double>> all;
  for (const RatioFactor& factor : factors) {
    auto found = detail::roots(factor.p);
    if (!found) {
      return refusal(SystemError::no_convergence, in_transfer_function, name).got("not found");
    }
    detail::settle_on_border(*found, factor.p, discrete);
    for (const detail::MultipleRoot& root : detail::grouped(*found, factor.p)) {
      all.insert(all.end(), static_cast<std::size_t>(root.times * factor.times), root.at);
    }
  }
  return Eigen::VectorXcd(
      Eigen::Map<const Eigen::VectorXcd>(all.data(), static_cast<Index>(all.size())));
}

bool is_power(const RatioFactors& factors) {
  return std::any_of(factors.begin(), factors.end(),
                     [](const RatioFactor& factor) { return factor.times > 1; });
}

Expected<TransferFunction> finished(const LateQuotient& value, const std::optional<Time>& period,
                                    std::string_view text) {
  FLYBALL_TRY(const Quotient q, rational(value, text));
  const TextPlace whole{0, text.size()};
  const Index above = degree(q.num);
  const Index below = degree(q.den);
  if (above > below) {
    return tl::unexpected(
        at_place(Error(TransferError::improper)
                     .in(std::string(in_transfer_function))
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
  // A factor that stands alone tells no more than its coefficients.
  if (q.num.size() + q.den.size() > 2 || is_power(q.num) || is_power(q.den)) {
    const auto zeros = roots_of(q.num, "a zero", period.has_value());
    const auto poles = roots_of(q.den, "a pole", period.has_value());
    if (zeros && poles) {
      return made->with_roots(*zeros, *poles);
    }
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
Expected<LateQuotient> product_of(std::span<const std::string> texts,
                                  const std::optional<Time>& period) {
  if (texts.empty()) {
    return refusal(ArgumentError::empty, in_transfer_function, "the factors");
  }
  LateQuotient whole{number(1.0)};
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
                               .in(std::string(in_transfer_function))
                               .about(quote(texts[i], parsed->syntax.first_use))
                               .got(format("in a product with an expression of {}", variable))
                               .expected("of one variable"),
                           parsed->syntax.first_use));
    }
    variable = own != 0 ? own : variable;
    whole = detail::product(whole, parsed->value);
    clear_shifts(whole.q, variable);
  }
  if (degree(whole) > highest_degree) {
    return refusal(TransferTextError::degree_too_high, in_transfer_function, "the product")
        .got(format("of degree {}", degree(whole)))
        .expected(format("of degree {} at most", highest_degree));
  }
  return whole;
}

}  // namespace

namespace {

/// The product as one text, for messages.
std::string written(std::span<const std::string> texts) {
  std::string product;
  for (const std::string& text : texts) {
    product += (product.empty() ? "(" : "*(") + text + ")";
  }
  return texts.size() == 1 ? texts.front() : product;
}

}  // namespace

Expected<TransferFunction> parse_transfer_product(std::span<const std::string> texts,
                                                  std::optional<Time> period) {
  FLYBALL_TRY(const LateQuotient whole, product_of(texts, period));
  return finished(whole, period, written(texts));
}

Expected<TransferSystem> parse_transfer_system(std::span<const std::string> texts,
                                               const TransferScale& loop) {
  FLYBALL_CHECK(Checks(in_transfer_function).finite(loop.gain, "the gain"));
  FLYBALL_TRY(const LateQuotient whole, product_of(texts, loop.period));
  const std::string text = written(texts);
  if (whole.is_rational()) {
    FLYBALL_TRY(const auto G, finished(whole, loop.period, text));
    FLYBALL_TRY(auto made, G.scaled(loop.gain, loop.delay));
    return TransferSystem{std::move(made)};
  }
  auto made = detail::realised(whole, loop.gain, loop.delay.si());
  if (!made) {
    return tl::unexpected(at_place(std::move(made).error(), TextPlace{0, text.size()}));
  }
  return TransferSystem{*std::move(made)};
}

Expected<ZeroPoleGain> parse_zero_pole_gain(std::span<const std::string> texts,
                                            std::optional<Time> period) {
  FLYBALL_TRY(const LateQuotient value, product_of(texts, period));
  FLYBALL_TRY(const Quotient whole, rational(value, written(texts)));
  FLYBALL_TRY(const auto zeros, roots_of(whole.num, "a zero", period.has_value()));
  FLYBALL_TRY(const auto poles, roots_of(whole.den, "a pole", period.has_value()));
  double gain = whole.value();
  for (const RatioFactor& factor : whole.num) {
    gain *= std::pow(factor.p.hi(0, 0), static_cast<double>(factor.times));
  }
  for (const RatioFactor& factor : whole.den) {
    gain /= std::pow(factor.p.hi(0, 0), static_cast<double>(factor.times));
  }
  return ZeroPoleGain::create(zeros, poles, gain, period, Time(whole.delay));
}

}  // namespace flyball::classical
