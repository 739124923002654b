#include <optional>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/unit_algebra.hpp>

#include "core/try.hpp"
#include "study/named_value.hpp"

namespace flyball::study {

Expected<double> named_value(const std::string& text, const std::string& called,
                             const std::string& unit, Sign sign) {
  std::optional<SiDimension> wanted;
  if (!unit.empty()) {
    FLYBALL_TRY(const SiUnit known, parse_si_unit(unit));
    wanted = known.dimension;
  }
  FLYBALL_TRY(const QuantityText parts, split_quantity(text, called));
  FLYBALL_TRY(const SiUnit given, parse_si_unit(parts.unit));
  const bool plain = parts.unit.empty();
  const bool takes_plain = wanted && wanted->exponents == SiDimension{}.exponents;
  if (wanted && parts.number != 0.0 &&
      (!wanted->fits(given.dimension) || (plain && !takes_plain))) {
    return refusal(ArgumentError::wrong_unit, {}, called)
        .got(plain ? fmt::format("{}, without a unit", text)
                   : fmt::format("\"{}\", in {}", text, to_text(given.dimension)))
        .expected(fmt::format("in {}, such as \"1 {}\"", to_text(*wanted), unit));
  }
  const double si = parts.number * given.factor;
  if ((sign == Sign::positive && !(si > 0.0)) || (sign == Sign::not_negative && !(si >= 0.0))) {
    return tl::unexpected(
        Error(sign == Sign::positive ? ArgumentError::not_positive : ArgumentError::out_of_range)
            .about(called)
            .got(text)
            .expected(sign == Sign::positive ? "greater than zero" : "zero or greater"));
  }
  return si;
}

}  // namespace flyball::study
