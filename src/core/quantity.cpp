#include <flyball/core/quantity.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <vector>

#include <flyball/core/text.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "core/unit_table.hpp"

namespace flyball {

namespace {

using detail::units;
using enum Dimension;

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
    text.replace(at, from.size(), to);
    at += to.size();
  }
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](char c) { return lower(c); });
  return out;
}

bool is_lower_case_of(std::string_view folded, std::string_view text) {
  return std::equal(folded.begin(), folded.end(), text.begin(), text.end(),
                    [](char a, char b) { return a == lower(b); });
}

// One spelling for "kg·m²", "kg m^2", "kg*m**2" and "Rotations per Second".
std::string canonical(std::string_view text) {
  std::string out(text);
  replace_all(out, "²", "2");
  replace_all(out, "**2", "2");
  replace_all(out, "^2", "2");
  replace_all(out, "µ", "u");
  replace_all(out, "μ", "u");
  replace_all(out, "\u2126", "Ω");  // OHM SIGN, which looks like the Greek letter
  for (const std::string_view per : {" per ", " Per ", " PER ", "_per_"}) {
    replace_all(out, per, "/");
  }
  for (const std::string_view separator : {"·", "⋅", "*", " ", "\t", "-", "_"}) {
    replace_all(out, separator, "");
  }
  return out;
}

// "degrees/second" -> "degree/second"; short symbols such as "s" and "lbs" are left alone.
std::string singular(const std::string& text) {
  std::string out;
  std::size_t start = 0;
  while (start <= text.size()) {
    std::size_t end = text.find('/', start);
    end = end == std::string::npos ? text.size() : end;
    std::string part = text.substr(start, end - start);
    if (part.size() > 3 && part.back() == 's') {
      part.pop_back();
    }
    out += (start == 0 ? "" : "/") + part;
    start = end + 1;
  }
  return out;
}

// mV, mA, mNm, mOhm: written with a capital M they would be a thousand million times as much.
bool has_milli_prefix(const NamedUnit& unit) {
  if (unit.text.size() < 2 || unit.text[0] != 'm') {
    return false;
  }
  const auto symbol = static_cast<unsigned char>(unit.text[1]);
  return (symbol >= 'A' && symbol <= 'Z') || symbol >= 0x80;
}

/// @param of  The dimension that is wanted; any if it is not known.
std::string nearest_unit(std::string_view text, std::optional<Dimension> of = std::nullopt) {
  std::vector<std::string_view> names;
  for (const NamedUnit& unit : units) {
    if (!of || unit.dimension == *of) {
      names.push_back(unit.text);
    }
  }
  return nearest_name(canonical(text), names);
}

/// What a dimension is called, the SI unit to print it in, and how a quantity of it is written; in
/// the order of the enum.
struct DimensionTexts {
  std::string_view name;
  std::string_view si_unit;
  std::string_view example;
};
constexpr DimensionTexts dimension_texts[] = {
    {"plain number", "", "0.5"},
    {"mass", "kg", "\"8 kg\" or \"18 lb\""},
    {"length", "m", "\"2.54 cm\" or \"1 in\""},
    {"time", "s", "\"20 ms\""},
    {"angle", "rad", "\"15 deg\""},
    {"velocity", "m/s", "\"1.5 m/s\""},
    {"angular velocity", "rad/s", "\"3000 rpm\" or \"10 rad/s\""},
    {"acceleration", "m/s^2", "\"2 m/s^2\""},
    {"angular acceleration", "rad/s^2", "\"20 rad/s^2\""},
    {"force", "N", "\"10 N\""},
    {"torque", "N m", "\"2.4 N m\""},
    {"moment of inertia", "kg m^2", "\"0.01 kg m^2\""},
    {"voltage", "V", "\"12 V\""},
    {"current", "A", "\"40 A\""},
    {"resistance", "Ohm", "\"15 mOhm\""},
    {"frequency", "Hz", "\"50 Hz\""},
};

constexpr DimensionTexts texts_of(Dimension dimension) {
  const auto index = static_cast<std::size_t>(dimension);
  return index < std::size(dimension_texts) ? dimension_texts[index] : DimensionTexts{};
}

/// What stands between two dimensions that are taken for each other.
struct Confusion {
  Dimension given;
  Dimension wanted;
  std::string_view hint;
};
constexpr std::string_view over_radius =
    "what turns and what goes straight on differ by the radius of drum or wheel: multiply radians "
    "by it";
constexpr Confusion confusions[] = {
    {angle, length, over_radius},
    {angular_velocity, velocity, over_radius},
    {angular_acceleration, acceleration, over_radius},
    {length, angle, "an angle is the way over the radius of drum or wheel"},
    {velocity, angular_velocity, "radians a second are the speed over the radius"},
    {acceleration, angular_acceleration, "it is the acceleration over the radius"},
    {torque, force, "a force is the torque over the lever's length"},
    {force, torque, "a torque is the force times the lever's length"},
    {mass, force, "a force of one pound is written \"1 lbf\", of a kilogram's weight \"9.81 N\""},
    {force, mass, "a mass is written in kg or lb"},
    {frequency, time, "a period is one over the frequency"},
    {time, frequency, "a frequency is one over the period"},
};

std::string_view confusion(Dimension given, Dimension wanted) {
  const auto* const found = std::find_if(
      std::begin(confusions), std::end(confusions),
      [&](const Confusion& one) { return one.given == given && one.wanted == wanted; });
  return found == std::end(confusions) ? std::string_view() : found->hint;
}

std::string article(Dimension dimension) {
  const std::string_view name = to_string(dimension);
  const bool vowel = std::string_view("aeiou").find(name.front()) != std::string_view::npos;
  return detail::format("{} {}", vowel ? "an" : "a", name);
}

}  // namespace

std::vector<NamedUnit> units_of(Dimension dimension) {
  std::vector<NamedUnit> found;
  std::copy_if(units.begin(), units.end(), std::back_inserter(found),
               [&](const NamedUnit& unit) { return unit.dimension == dimension; });
  std::stable_partition(found.begin(), found.end(),
                        [](const NamedUnit& unit) { return unit.factor == 1.0; });
  return found;
}

const NamedUnit* detail::find_unit(std::string_view text) {
  const std::string exact = canonical(trim(text));
  const auto match = [&](const std::string& wanted, bool fold) -> const NamedUnit* {
    const auto found = std::find_if(units.begin(), units.end(), [&](const NamedUnit& unit) {
      if (fold && exact.starts_with('M') && has_milli_prefix(unit)) {
        return false;
      }
      return fold ? is_lower_case_of(wanted, unit.text) : unit.text == wanted;
    });
    return found == units.end() ? nullptr : &*found;
  };
  if (const NamedUnit* unit = match(exact, false)) {
    return unit;
  }
  const std::string folded = lower(exact);
  if (const NamedUnit* unit = match(folded, true)) {
    return unit;
  }
  return match(singular(folded), true);
}

std::string_view to_string(Dimension dimension) {
  return texts_of(dimension).name;
}

std::string_view si_unit(Dimension dimension) {
  return texts_of(dimension).si_unit;
}

Expected<Unit> parse_unit(std::string_view text) {
  if (const NamedUnit* unit = detail::find_unit(text)) {
    return Unit{unit->dimension, unit->factor};
  }
  const std::string nearest = nearest_unit(text);
  return refusal(ArgumentError::wrong_unit, {}, "unit")
      .got(detail::format("\"{}\", which is not known", text))
      .hint(nearest.empty() ? "units are written like kg, cm, in, rpm, V"
                            : detail::format("did you mean \"{}\"?", nearest));
}

Expected<double> parse_quantity(std::string_view text, Dimension dimension, std::string_view name) {
  const std::string_view trimmed = trim(text);
  const std::string_view digits = trimmed.starts_with('+') ? trimmed.substr(1) : trimmed;
  double number = 0.0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), number,
                                             std::chars_format::general);
  const auto expected = [&] {
    return detail::format("{} such as {}", article(dimension), texts_of(dimension).example);
  };
  if (status != std::errc{} || end == digits.data() || trimmed.starts_with("+-")) {
    return tl::unexpected(Error(status == std::errc::result_out_of_range ? ArgumentError::not_finite
                                                                         : ArgumentError::malformed)
                              .about(std::string(name))
                              .got(detail::format("\"{}\"", text))
                              .expected(expected()));
  }
  const auto not_finite = [&] {
    return refusal(ArgumentError::not_finite, {}, name)
        .got(detail::format("\"{}\"", text))
        .expected(detail::format("finite, {}", expected()));
  };
  if (!std::isfinite(number)) {
    return not_finite();
  }
  const std::string_view unit_text =
      trim(digits.substr(static_cast<std::size_t>(end - digits.data())));
  if (unit_text.empty() && dimension != dimensionless) {
    return refusal(ArgumentError::wrong_unit, {}, name)
        .got(detail::format("\"{}\", without a unit", text))
        .expected(expected());
  }
  if (dimension == dimensionless && unit_text.starts_with(':')) {
    // A ratio, as gearings are written.
    const std::string_view second = trim(unit_text.substr(1));
    double below = 0.0;
    const auto [stop, read] = std::from_chars(second.data(), second.data() + second.size(), below);
    const double ratio = number / below;
    if (read != std::errc{} || stop != second.data() + second.size() || !std::isfinite(ratio)) {
      return refusal(ArgumentError::malformed, {}, name)
          .got(detail::format("\"{}\"", text))
          .expected("a ratio of two numbers such as \"3:2\"");
    }
    return ratio;
  }
  const NamedUnit* const unit = detail::find_unit(unit_text);
  if (unit == nullptr) {
    const std::string nearest = nearest_unit(unit_text, dimension);
    return refusal(ArgumentError::wrong_unit, {}, name)
        .got(detail::format("\"{}\", in an unknown unit", text))
        .expected(expected())
        .hint(nearest.empty() ? std::string("`flyball units` and docs/units.md list them")
                              : detail::format("did you mean \"{}\"?", nearest));
  }
  if (unit->dimension != dimension) {
    return refusal(ArgumentError::wrong_unit, {}, name)
        .got(detail::format("\"{}\", {}", text, article(unit->dimension)))
        .expected(expected())
        .hint(std::string(confusion(unit->dimension, dimension)));
  }
  const double si = number * unit->factor;
  if (!std::isfinite(si)) {
    return not_finite();
  }
  return si;
}

std::string to_text(double si, Dimension dimension) {
  const std::string_view unit = si_unit(dimension);
  return unit.empty() ? detail::format("{}", si) : detail::format("{} {}", si, unit);
}

}  // namespace flyball
