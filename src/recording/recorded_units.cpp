#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/constants.hpp"
#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "recording/channel_names.hpp"
#include "recording/recorded_motion.hpp"
#include "recording/recorded_units.hpp"

namespace flyball::recording {

namespace {

using identification::TestRun;
using mechanisms::MechanismKind;

constexpr double inch = 0.0254;
constexpr double foot = 12.0 * inch;

/// Units that logs have, of a position, with the words that name them in a channel's name. The
/// words of a letter or two mean something else unless a name ends in them.
struct KnownUnit {
  std::string_view text;
  double factor;
  bool linear;
  std::array<std::string_view, 8> words;
  std::string_view last_word;
};
constexpr std::array<KnownUnit, 8> known_units{
    {{"rotations",
      full_turn,
      false,
      {"rot", "rots", "rotation", "rotations", "rev", "revs", "revolutions", "turns"},
      ""},
     {"rad", 1.0, false, {"rad", "rads", "radian", "radians"}, ""},
     {"deg", one_degree, false, {"deg", "degs", "degree", "degrees"}, ""},
     {"m", 1.0, true, {"meter", "meters", "metre", "metres"}, "m"},
     {"cm", 0.01, true, {"cm", "centimeters", "centimetres"}, ""},
     {"mm", 0.001, true, {"mm", "millimeters", "millimetres"}, ""},
     {"in", inch, true, {"inch", "inches"}, "in"},
     {"ft", foot, true, {"feet", "foot", "ft"}, ""}}};

/// Words with their "per second" in them, and rates that are not a unit a second.
struct RateWord {
  std::string_view word;
  std::string_view unit;  ///< Of KnownUnit.
  double seconds = 1.0;
};
constexpr std::array<RateWord, 11> rate_words{{{"rpm", "rotations", 60.0},
                                               {"rps", "rotations"},
                                               {"rotps", "rotations"},
                                               {"radps", "rad"},
                                               {"radpersec", "rad"},
                                               {"dps", "deg"},
                                               {"degps", "deg"},
                                               {"degpersec", "deg"},
                                               {"mps", "m"},
                                               {"fps", "ft"},
                                               {"ips", "in"}}};

RecordedUnit position_in(const KnownUnit& unit, UnitSource source) {
  return {std::string(unit.text), unit.factor, unit.linear, source};
}

RecordedUnit rate_in(const KnownUnit& unit, double seconds, UnitSource source) {
  const bool minutes = seconds == 60.0;
  std::string text = minutes && unit.text == "rotations"
                         ? "RPM"
                         : fmt::format("{}/{}", unit.text, minutes ? "min" : "s");
  return {std::move(text), unit.factor / seconds, unit.linear, source};
}

const KnownUnit& unit_called(std::string_view text) {
  return *std::find_if(known_units.begin(), known_units.end(),
                       [&](const KnownUnit& unit) { return unit.text == text; });
}

/// "per second" or "per minute" after a unit's word: "RadPerSec", "rad_s", "MetersPerMinute".
struct PerTime {
  double seconds = 1.0;
  std::size_t words = 0;  ///< That say it; none if it does not follow.
};

PerTime per_time(const std::vector<std::string>& words, std::size_t at) {
  const std::size_t per = at < words.size() && words[at] == "per" ? 1 : 0;
  if (at + per >= words.size()) {
    return {};
  }
  const std::string& word = words[at + per];
  if (word == "s" || word == "sec" || word == "secs" || word == "second" || word == "seconds") {
    return {1.0, per + 1};
  }
  if (word == "min" || word == "mins" || word == "minute" || word == "minutes") {
    return {60.0, per + 1};
  }
  return {};
}

/// Ratios that a mistaken unit makes, with what they are between.
struct NamedRatio {
  double value;
  std::string_view meaning;
};
const std::array<NamedRatio, 8>& named_ratios() {
  static constexpr std::array<NamedRatio, 8> ratios{
      {{60.0, "the seconds in a minute"},
       {full_turn, "2π, the radians in a rotation"},
       {360.0, "the degrees in a rotation"},
       {360.0 / full_turn, "the degrees in a radian"},
       {60.0 / full_turn, "rotations a minute in a radian a second"},
       {6.0, "degrees a second in a rotation a minute"},
       {100.0, "the centimetres in a metre"},
       {1000.0, "the milli- in a unit"}}};
  return ratios;
}

constexpr double agreement = 0.12;  ///< Relative, within which two ratios are the same.

bool agrees(double a, double b, double tolerance = agreement) {
  return std::abs(std::log(a / b)) < tolerance;
}

RecordedUnit from_parsed(std::string text, const Unit& unit, UnitSource source) {
  const bool linear = unit.dimension == Dimension::length || unit.dimension == Dimension::velocity;
  return {std::move(text), unit.factor, linear, source};
}

bool is_of(const Unit& unit, bool rate) {
  return rate ? unit.dimension == Dimension::velocity ||
                    unit.dimension == Dimension::angular_velocity
              : unit.dimension == Dimension::length || unit.dimension == Dimension::angle;
}

/// The known unit, of a position or of a rate, that a measured ratio makes of the other column's.
/// @param wanted  Its factor by the ratio.
RecordedUnit nearest_unit(double wanted, bool linear, bool rate) {
  RecordedUnit best;
  double least = agreement;
  const auto consider = [&](const RecordedUnit& unit) {
    const double miss = std::abs(std::log(wanted / unit.factor));
    if (unit.linear == linear && miss < least) {
      least = miss;
      best = unit;
    }
  };
  for (const KnownUnit& unit : known_units) {
    if (rate) {
      consider(rate_in(unit, 1.0, UnitSource::data));
      consider(rate_in(unit, 60.0, UnitSource::data));
    } else {
      consider(position_in(unit, UnitSource::data));
    }
  }
  return best;
}

RecordedUnit rate_by_ratio(const RecordedUnit& position, double ratio) {
  return nearest_unit(position.factor / ratio, position.linear, true);
}

RecordedUnit position_by_ratio(const RecordedUnit& velocity, double ratio) {
  return nearest_unit(velocity.factor * ratio, velocity.linear, false);
}

/// A rate of the position's own unit a second.
RecordedUnit per_second(const RecordedUnit& position) {
  return {position.text + "/s", position.factor, position.linear, position.source};
}

std::string_view in_words(UnitSource source) {
  switch (source) {
    case UnitSource::said:
      return "as said";
    case UnitSource::metadata:
      return "by the log's metadata";
    case UnitSource::name:
      return "by the channel's name";
    default:
      return "by assumption";
  }
}

Error disagreement(const RecordedUnits& units, double ratio) {
  const double expected = units.position.factor / units.velocity.factor;
  return Error(
      refusal(RecordingError::unit_mismatch, {}, "the velocity channel")
          .got(fmt::format("{:.4g} times the derivative of the position channel", ratio))
          .expected(fmt::format("{:.4g} times it, with positions in {} ({}) and velocities "
                                "in {} ({})",
                                expected, units.position.text, in_words(units.position.source),
                                units.velocity.text, in_words(units.velocity.source)))
          .hint("say what they are with --unit and --velocity-unit, or leave the velocity "
                "out with --no-velocity"));
}

}  // namespace

RecordedUnit unit_of_text(std::string_view text, bool rate, UnitSource source) {
  if (text.empty()) {
    return {};
  }
  const auto unit = parse_unit(text);
  if (!unit) {
    return {};
  }
  if (is_of(*unit, rate)) {
    return from_parsed(std::string(text), *unit, source);
  }
  return rate && is_of(*unit, false) ? from_parsed(std::string(text) + "/s", *unit, source)
                                     : RecordedUnit{};
}

RecordedUnit unit_in_name(std::string_view name, bool rate) {
  constexpr std::array<std::string_view, 8> quantities{"position", "pos",   "angle", "distance",
                                                       "velocity", "speed", "rate",  "vel"};
  const std::vector<std::string> words = words_of(name);
  // What stands before the quantity is whose it is ("REV", "FeetSubsystem").
  const auto quantity = std::find_if(words.begin(), words.end(), [&](const std::string& word) {
    return std::find(quantities.begin(), quantities.end(), word) != quantities.end();
  });
  const std::size_t first =
      quantity == words.end() ? 0 : static_cast<std::size_t>(quantity - words.begin()) + 1;
  RecordedUnit found;
  for (std::size_t i = first; i < words.size(); ++i) {
    const PerTime per = per_time(words, i + 1);
    const bool last = i > 0 && i + 1 + per.words >= words.size();
    for (const KnownUnit& unit : known_units) {
      const bool named =
          std::find(unit.words.begin(), unit.words.end(), words[i]) != unit.words.end() ||
          (last && words[i] == unit.last_word);
      if (named && rate) {
        found = rate_in(unit, per.seconds, UnitSource::name);
      } else if (named && per.words == 0) {
        found = position_in(unit, UnitSource::name);
      }
    }
    for (const RateWord& known : rate_words) {
      if (rate && words[i] == known.word) {
        found = rate_in(unit_called(known.unit), known.seconds, UnitSource::name);
      }
    }
  }
  return found;
}

bool counts_ticks(std::string_view name, std::string_view unit) {
  constexpr std::array<std::string_view, 6> ticks{"tick",   "ticks",  "count",
                                                  "counts", "pulses", "cpr"};
  for (const std::string_view text : {name, unit}) {
    for (const std::string& word : words_of(text)) {
      if (std::find(ticks.begin(), ticks.end(), word) != ticks.end()) {
        return true;
      }
    }
  }
  return false;
}

Expected<RecordedUnits> settle_units(RecordedUnits units, std::optional<double> ratio,
                                     std::vector<Diagnostic>& notes) {
  RecordedUnit& position = units.position;
  RecordedUnit& velocity = units.velocity;
  if (position.known() && velocity.known() && position.linear != velocity.linear) {
    return refusal(RecordingError::unit_mismatch, {}, "the velocity channel")
        .got(fmt::format("in {} beside a position in {}", velocity.text, position.text))
        .expected("both lengths or both angles")
        .hint(
            "say what they are with --unit and --velocity-unit, or leave the velocity out with "
            "--no-velocity");
  }
  if (!ratio) {
    if (!position.known() && velocity.known()) {
      const auto same = std::find_if(known_units.begin(), known_units.end(), [&](const auto& unit) {
        return unit.linear == velocity.linear &&
               (agrees(unit.factor, velocity.factor, 1e-9) ||
                agrees(unit.factor, 60.0 * velocity.factor, 1e-9));
      });
      position = position_in(
          same == known_units.end() ? unit_called(velocity.linear ? "m" : "rad") : *same,
          UnitSource::data);
    } else if (position.known() && !velocity.known()) {
      velocity = per_second(position);
    }
    return units;
  }
  if (!position.known() && !velocity.known()) {
    // What the ratio alone tells: a pair of angles, as no pair of lengths is usual.
    constexpr double closely = 0.03;
    const auto& rotations = unit_called("rotations");
    for (const KnownUnit& base : known_units) {
      for (const RecordedUnit& of_rate :
           {rate_in(rotations, 1.0, UnitSource::data), rate_in(rotations, 60.0, UnitSource::data),
            rate_in(unit_called("rad"), 1.0, UnitSource::data),
            rate_in(unit_called("deg"), 1.0, UnitSource::data)}) {
        const bool same = agrees(base.factor, of_rate.factor, 1e-9);
        if (!base.linear && !same && agrees(*ratio, base.factor / of_rate.factor, closely)) {
          note(notes, "units_from_data",
               "velocities are {:.4g} times the derivative of the positions: positions are taken "
               "for {}, velocities for {}",
               *ratio, base.text, of_rate.text);
          return RecordedUnits{position_in(base, UnitSource::data), of_rate};
        }
      }
    }
    if (!agrees(*ratio, 1.0)) {
      return refusal(RecordingError::unit_mismatch, {}, "the velocity channel")
          .got(fmt::format("{:.4g} times the derivative of the position channel, and no unit is "
                           "told",
                           *ratio))
          .expected("its derivative, or a ratio that units make")
          .hint(
              "say what they are with --unit and --velocity-unit, or leave the velocity out with "
              "--no-velocity");
    }
    return units;
  }
  if (!velocity.known()) {
    velocity = rate_by_ratio(position, *ratio);
    if (!velocity.known()) {
      velocity = per_second(position);
      return tl::unexpected(disagreement(units, *ratio));
    }
    if (!agrees(*ratio, 1.0)) {
      note(notes, "units_from_data",
           "velocities are {:.4g} times the derivative of the positions, which are in {}: they are "
           "taken for {}",
           *ratio, position.text, velocity.text);
    }
    return units;
  }
  if (!position.known()) {
    position = position_by_ratio(velocity, *ratio);
    if (!position.known()) {
      return refusal(RecordingError::unit_mismatch, {}, "the velocity channel")
          .got(fmt::format("{:.4g} times the derivative of the position channel, in {}", *ratio,
                           velocity.text))
          .expected("a ratio that units make")
          .hint(
              "say the position's unit with --unit, or leave the velocity out with "
              "--no-velocity");
    }
    note(notes, "units_from_data",
         "velocities are in {} and {:.4g} times the derivative of the positions: those are taken "
         "for {}",
         velocity.text, *ratio, position.text);
    return units;
  }
  const double miss = *ratio * velocity.factor / position.factor;
  if (agrees(miss, 1.0)) {
    return units;
  }
  // One of the two is mistaken: the one that is known from the weaker source, the velocity if both
  // are known alike (a position goes through fewer conversions).
  RecordedUnit corrected = position.source < velocity.source ? position_by_ratio(velocity, *ratio)
                                                             : rate_by_ratio(position, *ratio);
  if (!corrected.known()) {
    return tl::unexpected(disagreement(units, *ratio));
  }
  const auto named =
      std::find_if(named_ratios().begin(), named_ratios().end(), [&](const NamedRatio& known) {
        return agrees(miss, known.value) || agrees(1.0 / miss, known.value);
      });
  const bool of_position = position.source < velocity.source;
  RecordedUnit& mistaken = of_position ? position : velocity;
  warn(notes, "unit_mistaken",
       "the velocity channel is {:.4g} times the derivative of the position channel, {:.4g} with "
       "{} in {} ({}){}: {} are taken for {} (say it with --{})",
       *ratio, position.factor / velocity.factor, of_position ? "positions" : "velocities",
       mistaken.text, in_words(mistaken.source),
       named == named_ratios().end() ? std::string()
                                     : fmt::format("; between the two are {}", named->meaning),
       of_position ? "positions" : "velocities", corrected.text,
       of_position ? "unit" : "velocity-unit");
  mistaken = corrected;
  return units;
}

RecordedUnit likely_way_unit(const std::vector<TestRun>& runs, std::optional<double> ratio) {
  const double speed = speed_at_full_voltage(runs, ratio);
  for (const std::string_view unit : {"m", "ft", "in"}) {
    RecordedUnit found = position_in(unit_called(unit), UnitSource::assumed);
    if (speed * found.factor > 0.8 && speed * found.factor < 8.0) {
      return found;
    }
  }
  return position_in(unit_called("m"), UnitSource::assumed);
}

bool has_usual_speed(std::optional<MechanismKind> kind, double speed) {
  constexpr double slowest_arm = 0.3;
  constexpr double fastest_arm = 40.0;
  constexpr double slowest_flywheel = 40.0;
  constexpr double fastest_flywheel = 1600.0;
  const bool spins = kind && controls_velocity(*kind);
  const bool swings = kind && !spins && kind != MechanismKind::elevator;
  return speed >= (spins ? slowest_flywheel : slowest_arm) &&
         speed <= (swings ? fastest_arm : fastest_flywheel);
}

RecordedUnit likely_angle_unit(const std::vector<TestRun>& runs, std::optional<double> ratio,
                               std::optional<MechanismKind> kind) {
  const double speed = speed_at_full_voltage(runs, ratio);
  for (const std::string_view base : {"rotations", "rad", "deg"}) {
    const KnownUnit& unit = unit_called(base);
    if (has_usual_speed(kind, speed * unit.factor)) {
      return position_in(unit, UnitSource::assumed);
    }
  }
  return position_in(unit_called("rotations"), UnitSource::assumed);
}

}  // namespace flyball::recording
