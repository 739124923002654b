#include <flyball/core/quantity.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <flyball/core/text.hpp>

namespace flyball {

namespace {

constexpr double pi = std::numbers::pi;

struct NamedUnit {
  std::string_view text;  // as `canonical` leaves it
  Dimension dimension;
  double factor;
};

using enum Dimension;

// Written as `canonical` leaves them: no spaces, no "^", "·" or "*", "per" as "/", squares as a
// trailing 2. Where only the case of a prefix tells units apart (mN, MN) the short form keeps it.
constexpr std::array units{
    NamedUnit{"", dimensionless, 1.0},
    NamedUnit{"%", dimensionless, 0.01},
    NamedUnit{"kg", mass, 1.0},
    NamedUnit{"g", mass, 1e-3},
    NamedUnit{"lb", mass, 0.45359237},
    NamedUnit{"lbs", mass, 0.45359237},
    NamedUnit{"lbm", mass, 0.45359237},
    NamedUnit{"oz", mass, 0.028349523125},
    NamedUnit{"kilogram", mass, 1.0},
    NamedUnit{"gram", mass, 1e-3},
    NamedUnit{"pound", mass, 0.45359237},
    NamedUnit{"ounce", mass, 0.028349523125},
    NamedUnit{"m", length, 1.0},
    NamedUnit{"cm", length, 1e-2},
    NamedUnit{"mm", length, 1e-3},
    NamedUnit{"in", length, 0.0254},
    NamedUnit{"\"", length, 0.0254},
    NamedUnit{"ft", length, 0.3048},
    NamedUnit{"meter", length, 1.0},
    NamedUnit{"metre", length, 1.0},
    NamedUnit{"centimeter", length, 1e-2},
    NamedUnit{"millimeter", length, 1e-3},
    NamedUnit{"inch", length, 0.0254},
    NamedUnit{"inche", length, 0.0254},  // "inches" less its plural s
    NamedUnit{"foot", length, 0.3048},
    NamedUnit{"feet", length, 0.3048},
    NamedUnit{"s", time, 1.0},
    NamedUnit{"ms", time, 1e-3},
    NamedUnit{"us", time, 1e-6},
    NamedUnit{"min", time, 60.0},
    NamedUnit{"sec", time, 1.0},
    NamedUnit{"second", time, 1.0},
    NamedUnit{"millisecond", time, 1e-3},
    NamedUnit{"microsecond", time, 1e-6},
    NamedUnit{"minute", time, 60.0},
    NamedUnit{"rad", angle, 1.0},
    NamedUnit{"deg", angle, pi / 180.0},
    NamedUnit{"°", angle, pi / 180.0},
    NamedUnit{"rot", angle, 2.0 * pi},
    NamedUnit{"rev", angle, 2.0 * pi},
    NamedUnit{"turn", angle, 2.0 * pi},
    NamedUnit{"radian", angle, 1.0},
    NamedUnit{"degree", angle, pi / 180.0},
    NamedUnit{"rotation", angle, 2.0 * pi},
    NamedUnit{"revolution", angle, 2.0 * pi},
    NamedUnit{"m/s", velocity, 1.0},
    NamedUnit{"mps", velocity, 1.0},
    NamedUnit{"cm/s", velocity, 1e-2},
    NamedUnit{"mm/s", velocity, 1e-3},
    NamedUnit{"in/s", velocity, 0.0254},
    NamedUnit{"ft/s", velocity, 0.3048},
    NamedUnit{"fps", velocity, 0.3048},
    NamedUnit{"meter/second", velocity, 1.0},
    NamedUnit{"inch/second", velocity, 0.0254},
    NamedUnit{"inche/second", velocity, 0.0254},
    NamedUnit{"foot/second", velocity, 0.3048},
    NamedUnit{"feet/second", velocity, 0.3048},
    NamedUnit{"rad/s", angular_velocity, 1.0},
    NamedUnit{"deg/s", angular_velocity, pi / 180.0},
    NamedUnit{"°/s", angular_velocity, pi / 180.0},
    NamedUnit{"rot/s", angular_velocity, 2.0 * pi},
    NamedUnit{"rev/s", angular_velocity, 2.0 * pi},
    NamedUnit{"rps", angular_velocity, 2.0 * pi},
    NamedUnit{"rpm", angular_velocity, pi / 30.0},
    NamedUnit{"rot/min", angular_velocity, pi / 30.0},
    NamedUnit{"rev/min", angular_velocity, pi / 30.0},
    NamedUnit{"radian/second", angular_velocity, 1.0},
    NamedUnit{"degree/second", angular_velocity, pi / 180.0},
    NamedUnit{"rotation/second", angular_velocity, 2.0 * pi},
    NamedUnit{"revolution/second", angular_velocity, 2.0 * pi},
    NamedUnit{"rotation/minute", angular_velocity, pi / 30.0},
    NamedUnit{"revolution/minute", angular_velocity, pi / 30.0},
    NamedUnit{"m/s2", acceleration, 1.0},
    NamedUnit{"m/s/s", acceleration, 1.0},
    NamedUnit{"in/s2", acceleration, 0.0254},
    NamedUnit{"ft/s2", acceleration, 0.3048},
    NamedUnit{"meter/second/second", acceleration, 1.0},
    NamedUnit{"rad/s2", angular_acceleration, 1.0},
    NamedUnit{"rad/s/s", angular_acceleration, 1.0},
    NamedUnit{"deg/s2", angular_acceleration, pi / 180.0},
    NamedUnit{"rot/s2", angular_acceleration, 2.0 * pi},
    NamedUnit{"rotation/second/second", angular_acceleration, 2.0 * pi},
    NamedUnit{"radian/second/second", angular_acceleration, 1.0},
    NamedUnit{"N", force, 1.0},
    NamedUnit{"kN", force, 1e3},
    NamedUnit{"lbf", force, 4.4482216152605},
    NamedUnit{"newton", force, 1.0},
    NamedUnit{"Nm", torque, 1.0},
    NamedUnit{"mNm", torque, 1e-3},
    NamedUnit{"Ncm", torque, 1e-2},
    NamedUnit{"lbfin", torque, 0.1129848290276167},
    NamedUnit{"inlb", torque, 0.1129848290276167},
    NamedUnit{"lbfft", torque, 1.3558179483314004},
    NamedUnit{"ftlb", torque, 1.3558179483314004},
    NamedUnit{"ozin", torque, 0.00706155181422604},
    NamedUnit{"newtonmeter", torque, 1.0},
    NamedUnit{"kgm2", moment_of_inertia, 1.0},
    NamedUnit{"kgcm2", moment_of_inertia, 1e-4},
    NamedUnit{"gcm2", moment_of_inertia, 1e-7},
    NamedUnit{"lbin2", moment_of_inertia, 0.45359237 * 0.0254 * 0.0254},
    NamedUnit{"lbft2", moment_of_inertia, 0.45359237 * 0.3048 * 0.3048},
    NamedUnit{"V", voltage, 1.0},
    NamedUnit{"mV", voltage, 1e-3},
    NamedUnit{"volt", voltage, 1.0},
    NamedUnit{"millivolt", voltage, 1e-3},
    NamedUnit{"A", current, 1.0},
    NamedUnit{"mA", current, 1e-3},
    NamedUnit{"amp", current, 1.0},
    NamedUnit{"ampere", current, 1.0},
    NamedUnit{"Ohm", resistance, 1.0},
    NamedUnit{"mOhm", resistance, 1e-3},
    NamedUnit{"Ω", resistance, 1.0},
    NamedUnit{"mΩ", resistance, 1e-3},
    NamedUnit{"Hz", frequency, 1.0},
    NamedUnit{"kHz", frequency, 1e3},
    NamedUnit{"1/s", frequency, 1.0},
    NamedUnit{"hertz", frequency, 1.0},
};

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
    text.replace(at, from.size(), to);
    at += to.size();
  }
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : static_cast<char>(c);
  });
  return out;
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

const NamedUnit* find_unit(std::string_view text) {
  const std::string exact = canonical(text);
  const auto match = [&](const std::string& wanted, bool fold) -> const NamedUnit* {
    const auto found = std::find_if(units.begin(), units.end(), [&](const NamedUnit& unit) {
      if (fold && exact.starts_with('M') && has_milli_prefix(unit)) {
        return false;
      }
      return fold ? lower(unit.text) == wanted : unit.text == wanted;
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

std::string nearest_unit(std::string_view text) {
  std::vector<std::string_view> names;
  names.reserve(units.size());
  for (const NamedUnit& unit : units) {
    names.push_back(unit.text);
  }
  return nearest_name(canonical(text), names);
}

std::string_view example(Dimension dimension) {
  switch (dimension) {
    case dimensionless:
      return "0.5";
    case mass:
      return "\"8 kg\" or \"18 lb\"";
    case length:
      return "\"2.54 cm\" or \"1 in\"";
    case time:
      return "\"20 ms\"";
    case angle:
      return "\"15 deg\"";
    case velocity:
      return "\"1.5 m/s\"";
    case angular_velocity:
      return "\"3000 rpm\" or \"10 rad/s\"";
    case acceleration:
      return "\"2 m/s^2\"";
    case angular_acceleration:
      return "\"20 rad/s^2\"";
    case force:
      return "\"10 N\"";
    case torque:
      return "\"2.4 N m\"";
    case moment_of_inertia:
      return "\"0.01 kg m^2\"";
    case voltage:
      return "\"12 V\"";
    case current:
      return "\"40 A\"";
    case resistance:
      return "\"15 mOhm\"";
    case frequency:
      return "\"50 Hz\"";
  }
  return "";
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::string article(Dimension dimension) {
  const std::string_view name = to_string(dimension);
  const bool vowel = std::string_view("aeiou").find(name.front()) != std::string_view::npos;
  return fmt::format("{} {}", vowel ? "an" : "a", name);
}

}  // namespace

std::string_view to_string(Dimension dimension) {
  switch (dimension) {
    case dimensionless:
      return "plain number";
    case mass:
      return "mass";
    case length:
      return "length";
    case time:
      return "time";
    case angle:
      return "angle";
    case velocity:
      return "velocity";
    case angular_velocity:
      return "angular velocity";
    case acceleration:
      return "acceleration";
    case angular_acceleration:
      return "angular acceleration";
    case force:
      return "force";
    case torque:
      return "torque";
    case moment_of_inertia:
      return "moment of inertia";
    case voltage:
      return "voltage";
    case current:
      return "current";
    case resistance:
      return "resistance";
    case frequency:
      return "frequency";
  }
  return "";
}

std::string_view si_unit(Dimension dimension) {
  switch (dimension) {
    case dimensionless:
      return "";
    case mass:
      return "kg";
    case length:
      return "m";
    case time:
      return "s";
    case angle:
      return "rad";
    case velocity:
      return "m/s";
    case angular_velocity:
      return "rad/s";
    case acceleration:
      return "m/s^2";
    case angular_acceleration:
      return "rad/s^2";
    case force:
      return "N";
    case torque:
      return "N m";
    case moment_of_inertia:
      return "kg m^2";
    case voltage:
      return "V";
    case current:
      return "A";
    case resistance:
      return "Ohm";
    case frequency:
      return "Hz";
  }
  return "";
}

Expected<Unit> parse_unit(std::string_view text) {
  if (const NamedUnit* unit = find_unit(trim(text))) {
    return Unit{unit->dimension, unit->factor};
  }
  const std::string nearest = nearest_unit(text);
  return tl::unexpected(Error(ArgumentError::wrong_unit)
                            .about("unit")
                            .got(fmt::format("\"{}\", which is not known", text))
                            .hint(nearest.empty() ? "units are written like kg, cm, in, rpm, V"
                                                  : fmt::format("did you mean \"{}\"?", nearest)));
}

Expected<double> parse_quantity(std::string_view text, Dimension dimension, std::string_view name) {
  const std::string_view trimmed = trim(text);
  const std::string_view digits = trimmed.starts_with('+') ? trimmed.substr(1) : trimmed;
  double number = 0.0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), number,
                                             std::chars_format::general);
  const auto expected = [&] {
    return fmt::format("{} such as {}", article(dimension), example(dimension));
  };
  if (status != std::errc{} || end == digits.data() || trimmed.starts_with("+-")) {
    return tl::unexpected(Error(status == std::errc::result_out_of_range ? ArgumentError::not_finite
                                                                         : ArgumentError::malformed)
                              .about(std::string(name))
                              .got(fmt::format("\"{}\"", text))
                              .expected(expected()));
  }
  const auto not_finite = [&] {
    return tl::unexpected(Error(ArgumentError::not_finite)
                              .about(std::string(name))
                              .got(fmt::format("\"{}\"", text))
                              .expected(fmt::format("finite, {}", expected())));
  };
  if (!std::isfinite(number)) {
    return not_finite();
  }
  const std::string_view unit_text =
      trim(digits.substr(static_cast<std::size_t>(end - digits.data())));
  if (unit_text.empty() && dimension != dimensionless) {
    return tl::unexpected(Error(ArgumentError::wrong_unit)
                              .about(std::string(name))
                              .got(fmt::format("\"{}\", without a unit", text))
                              .expected(expected()));
  }
  auto unit = parse_unit(unit_text);
  if (!unit) {
    const std::string nearest = nearest_unit(unit_text);
    return tl::unexpected(Error(ArgumentError::wrong_unit)
                              .about(std::string(name))
                              .got(fmt::format("\"{}\", in an unknown unit", text))
                              .expected(expected())
                              .hint(nearest.empty()
                                        ? std::string("see the list of units in the docs")
                                        : fmt::format("did you mean \"{}\"?", nearest)));
  }
  if (unit->dimension != dimension) {
    return tl::unexpected(Error(ArgumentError::wrong_unit)
                              .about(std::string(name))
                              .got(fmt::format("\"{}\", {}", text, article(unit->dimension)))
                              .expected(expected()));
  }
  const double si = number * unit->factor;
  if (!std::isfinite(si)) {
    return not_finite();
  }
  return si;
}

std::string to_text(double si, Dimension dimension) {
  const std::string_view unit = si_unit(dimension);
  return unit.empty() ? fmt::format("{}", si) : fmt::format("{} {}", si, unit);
}

}  // namespace flyball
