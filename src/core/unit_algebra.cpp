#include <flyball/core/unit_algebra.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/format.hpp"
#include "core/try.hpp"
#include "core/unit_table.hpp"

namespace flyball {

namespace {

constexpr double tolerance = 1e-9;
constexpr int maximum_depth = 16;

struct Symbol {
  std::string_view text;
  std::array<double, 6> exponents;  // kg m s A K rad
  double factor = 1.0;
};

// The symbols to print a dimension with, if one fits; and those that are read beside `parse_unit`.
constexpr std::array printed{
    Symbol{"N", {1, 1, -2}},     Symbol{"N m", {1, 2, -2}},     Symbol{"W", {1, 2, -3}},
    Symbol{"V", {1, 2, -3, -1}}, Symbol{"Ohm", {1, 2, -3, -2}}, Symbol{"N m/A", {1, 2, -2, -1}},
    Symbol{"H", {1, 2, -2, -2}}, Symbol{"F", {-1, -2, 4, 2}},   Symbol{"N s/m", {1, 0, -1}},
    Symbol{"N m s", {1, 2, -1}},
};
constexpr std::array read{
    Symbol{"J", {1, 2, -2}},         Symbol{"W", {1, 2, -3}},      Symbol{"C", {0, 0, 1, 1}},
    Symbol{"F", {-1, -2, 4, 2}},     Symbol{"H", {1, 2, -2, -2}},  Symbol{"T", {1, 0, -2, -1}},
    Symbol{"Wb", {1, 2, -2, -1}},    Symbol{"Pa", {1, -1, -2}},    Symbol{"K", {0, 0, 0, 0, 1}},
    Symbol{"S", {-1, -2, 3, 2}},     Symbol{"h", {0, 0, 1}, 3600}, Symbol{"L", {0, 3}, 1e-3},
    Symbol{"bar", {1, -1, -2}, 1e5}, Symbol{"joule", {1, 2, -2}},  Symbol{"watt", {1, 2, -3}},
};

struct Prefix {
  std::string_view text;
  double factor;
};
constexpr std::array prefixes{
    Prefix{"p", 1e-12}, Prefix{"n", 1e-9}, Prefix{"u", 1e-6}, Prefix{"µ", 1e-6}, Prefix{"μ", 1e-6},
    Prefix{"m", 1e-3},  Prefix{"c", 1e-2}, Prefix{"k", 1e3},  Prefix{"M", 1e6},  Prefix{"G", 1e9},
};
// What takes a prefix: "kV" is a unit, "kin" and "Mmin" are mistakes.
constexpr std::array<std::string_view, 12> prefixed{"g",  "m",   "s", "N",   "V", "A",
                                                    "Hz", "Ohm", "Ω", "rad", "L", "bar"};

std::optional<SiUnit> known(std::string_view text) {
  const auto symbol = std::find_if(read.begin(), read.end(),
                                   [&](const Symbol& candidate) { return candidate.text == text; });
  if (symbol != read.end()) {
    return SiUnit{{symbol->exponents}, symbol->factor};
  }
  if (const auto* const unit = detail::find_unit(text); unit != nullptr && !text.empty()) {
    return SiUnit{si_dimension(unit->dimension), unit->factor};
  }
  return std::nullopt;
}

std::optional<SiUnit> atom(std::string_view text) {
  if (auto unit = known(text)) {
    return unit;
  }
  for (const Prefix& prefix : prefixes) {
    if (!text.starts_with(prefix.text)) {
      continue;
    }
    const std::string_view rest = text.substr(prefix.text.size());
    const bool takes =
        std::find(prefixed.begin(), prefixed.end(), rest) != prefixed.end() ||
        (rest.size() <= 2 && std::any_of(read.begin(), read.end() - 2, [&](const Symbol& s) {
           return s.text == rest && rest != "h";
         }));
    if (takes) {
      SiUnit unit = *known(rest);
      unit.factor *= prefix.factor;
      return unit;
    }
  }
  return std::nullopt;
}

/// A product: unit {separator unit}, where a unit is a symbol or a group with an exponent.
class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  Expected<SiUnit> read_all() {
    FLYBALL_TRY(const SiUnit unit, product(0));
    if (at_ < text_.size()) {
      return malformed("a parenthesis that was not opened");
    }
    return unit;
  }

 private:
  bool take(std::string_view token) {
    if (!text_.substr(at_).starts_with(token)) {
      return false;
    }
    at_ += token.size();
    return true;
  }

  [[nodiscard]] bool digit(std::size_t at) const {
    return at < text_.size() && text_[at] >= '0' && text_[at] <= '9';
  }

  bool take_separator() {
    return take(" ") || take("\t") || take("·") || take("⋅") || take("*") || take("-") || take("_");
  }

  tl::unexpected<Error> malformed(std::string_view what) const {
    return refusal(ArgumentError::malformed, {}, detail::format("unit \"{}\"", text_))
        .got(detail::format("written with {}", what))
        .expected("a product of units such as \"kg m^2/s^2\"");
  }

  Expected<SiUnit> product(int depth) {
    if (depth > maximum_depth) {
      return malformed("too many parentheses");
    }
    SiUnit total;
    while (true) {
      bool divided = false;
      while (true) {
        if (take("/") || take("per ") || take("Per ") || take("PER ") || take("per_")) {
          if (divided) {
            return malformed("two divisions in a row");
          }
          divided = true;
        } else if (!take_separator()) {
          break;
        }
      }
      if (at_ == text_.size() || text_[at_] == ')') {
        return divided ? Expected<SiUnit>(malformed("nothing to divide by")) : total;
      }
      FLYBALL_TRY(const SiUnit next, factor(depth));
      total = divided ? SiUnit{total.dimension / next.dimension, total.factor / next.factor}
                      : SiUnit{total.dimension * next.dimension, total.factor * next.factor};
    }
  }

  Expected<SiUnit> factor(int depth) {
    SiUnit unit;
    if (take("(")) {
      FLYBALL_TRY(unit, product(depth + 1));
      if (!take(")")) {
        return malformed("a parenthesis that is not closed");
      }
    } else {
      const std::size_t start = at_;
      at_ = std::min(text_.find_first_of(" \t/*^()-_0123456789", at_), text_.size());
      for (const std::string_view stop : {"·", "⋅", "²", "³", "⁻"}) {
        at_ = std::min(at_, std::min(text_.find(stop, start), text_.size()));
      }
      const std::string_view name = text_.substr(start, at_ - start);
      if (name.empty()) {
        if (text_[at_] != '1') {
          return malformed(detail::format("\"{}\" where a unit belongs", text_.substr(at_, 1)));
        }
        ++at_;
        return digit(at_) ? Expected<SiUnit>(malformed("a number where a unit belongs")) : unit;
      } else if (const auto found = atom(name)) {
        unit = *found;
      } else {
        // parse_unit words it, and knows the nearest name.
        return tl::unexpected(parse_unit(name).error());
      }
    }
    return raised(unit);
  }

  Expected<SiUnit> raised(const SiUnit& unit) {
    double exponent = 1.0;
    if (take("²")) {
      exponent = 2.0;
    } else if (take("³")) {
      exponent = 3.0;
    } else if (take("⁻¹")) {
      exponent = -1.0;
    } else if (take("⁻²")) {
      exponent = -2.0;
    } else if (take("^") || take("**") || digit(at_) || (digit(at_ + 1) && text_[at_] == '-')) {
      const bool group = take("(");
      if (!number(exponent)) {
        return malformed("an exponent that is no number");
      }
      double divisor = 1.0;
      if (group && take("/") && (!number(divisor) || divisor == 0.0)) {
        return malformed("an exponent that is no number");
      }
      exponent /= divisor;
      if (group && !take(")")) {
        return malformed("a parenthesis that is not closed");
      }
    }
    if (!(std::abs(exponent) <= 100.0)) {
      return malformed("an exponent beyond 100");
    }
    return SiUnit{power(unit.dimension, exponent), std::pow(unit.factor, exponent)};
  }

  bool number(double& value) {
    const auto [end, status] = std::from_chars(text_.data() + at_, text_.data() + text_.size(),
                                               value, std::chars_format::fixed);
    if (status != std::errc{}) {
      return false;
    }
    at_ = static_cast<std::size_t>(end - text_.data());
    return std::isfinite(value);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// "^2", "^(1/2)", nothing for 1.
std::string exponent_text(double exponent) {
  if (std::abs(exponent - 1.0) < tolerance) {
    return "";
  }
  for (int denominator = 1; denominator <= 12; ++denominator) {
    const double numerator = std::round(exponent * denominator);
    if (std::abs(exponent * denominator - numerator) < denominator * tolerance) {
      return denominator == 1 ? detail::format("^{}", numerator)
                              : detail::format("^({}/{})", numerator, denominator);
    }
  }
  return detail::format("^{:.6g}", exponent);
}

}  // namespace

bool SiDimension::fits(const SiDimension& other) const noexcept {
  for (std::size_t i = 0; i < radian; ++i) {
    if (std::abs(exponents[i] - other.exponents[i]) > tolerance) {
      return false;
    }
  }
  return true;
}

SiDimension operator*(const SiDimension& a, const SiDimension& b) noexcept {
  SiDimension product = a;
  for (std::size_t i = 0; i < product.exponents.size(); ++i) {
    product.exponents[i] += b.exponents[i];
  }
  return product;
}

SiDimension operator/(const SiDimension& a, const SiDimension& b) noexcept {
  return a * power(b, -1.0);
}

SiDimension power(const SiDimension& x, double exponent) noexcept {
  SiDimension result = x;
  for (double& each : result.exponents) {
    each *= exponent;
  }
  return result;
}

SiDimension si_dimension(Dimension dimension) noexcept {
  // kg m s A K rad, in the order of the enum.
  static constexpr std::array<double, 6> exponents[] = {
      {},                   // plain number
      {1},                  // mass
      {0, 1},               // length
      {0, 0, 1},            // time
      {0, 0, 0, 0, 0, 1},   // angle
      {0, 1, -1},           // velocity
      {0, 0, -1, 0, 0, 1},  // angular velocity
      {0, 1, -2},           // acceleration
      {0, 0, -2, 0, 0, 1},  // angular acceleration
      {1, 1, -2},           // force
      {1, 2, -2},           // torque
      {1, 2},               // moment of inertia
      {1, 2, -3, -1},       // voltage
      {0, 0, 0, 1},         // current
      {1, 2, -3, -2},       // resistance
      {0, 0, -1},           // frequency
  };
  const auto index = static_cast<std::size_t>(dimension);
  return index < std::size(exponents) ? SiDimension{exponents[index]} : SiDimension{};
}

std::string to_text(const SiDimension& dimension) {
  constexpr std::array<std::string_view, 6> names{"kg", "m", "s", "A", "K", "rad"};
  const bool angle = std::abs(dimension.exponents[SiDimension::radian]) > tolerance;
  if (!angle) {
    for (const Symbol& symbol : printed) {
      if (dimension.fits({symbol.exponents})) {
        return std::string(symbol.text);
      }
    }
  }
  std::string above;
  std::string below;
  int divisors = 0;
  for (std::size_t i : {5U, 0U, 1U, 3U, 4U, 2U}) {
    const double exponent = dimension.exponents[i];
    if (std::abs(exponent) <= tolerance) {
      continue;
    }
    std::string& side = exponent > 0.0 ? above : below;
    divisors += exponent < 0.0 ? 1 : 0;
    side += detail::format("{}{}{}", side.empty() ? "" : " ", names[i],
                           exponent_text(std::abs(exponent)));
  }
  if (below.empty()) {
    return above.empty() ? "1" : above;
  }
  above = above.empty() ? "1" : above;
  return divisors > 1 ? detail::format("{}/({})", above, below)
                      : detail::format("{}/{}", above, below);
}

Expected<SiUnit> parse_si_unit(std::string_view text) {
  // As a whole first: "in lb" is a torque by custom, though its parts would be a mass times a
  // length.
  if (const auto* const unit = detail::find_unit(text)) {
    return SiUnit{si_dimension(unit->dimension), unit->factor};
  }
  return Reader(text).read_all();
}

Expected<QuantityText> split_quantity(std::string_view text, std::string_view name) {
  constexpr std::string_view blanks = " \t\r\n";
  const std::size_t first = std::min(text.find_first_not_of(blanks), text.size());
  const std::size_t sign = first < text.size() && text[first] == '+' ? 1 : 0;
  const char* const digits = text.data() + first + sign;
  double number = 0.0;
  const auto [end, status] = std::from_chars(digits, text.data() + text.size(), number);
  const auto refuse = [&](ArgumentError code, std::string_view expected) {
    return refusal(code, {}, name)
        .got(detail::format("\"{}\"", text))
        .expected(std::string(expected));
  };
  if (status == std::errc::result_out_of_range || !std::isfinite(number)) {
    return refuse(ArgumentError::not_finite, "a finite number with its unit");
  }
  if (status != std::errc{} || (sign == 1 && *digits == '-')) {
    return refuse(ArgumentError::malformed, "a number with its unit, such as \"2.5 kg m^2\"");
  }
  std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  unit.remove_prefix(std::min(unit.find_first_not_of(blanks), unit.size()));
  unit = unit.substr(0, unit.find_last_not_of(blanks) + 1);
  return QuantityText{number, unit};
}

}  // namespace flyball
