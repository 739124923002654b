// The best gearing of a mechanism, why it is, and what else was tried.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/json_writer.hpp>

#include "core/wording.hpp"
#include "study/answer/mechanism_animation.hpp"
#include "study/answer/size_parts.hpp"

namespace flyball::study {

namespace {

using mechanisms::PowerBound;
using text::number;
using text::percent;
using text::seconds;

constexpr const char* size_schema = "flyball.size/1";

/// A row for each number of a choice; beside it that of the given gearing.
Table choices_table(const SizeResult& result) {
  const SizeChoice& best = result.best;
  const SizeChoice* given = result.given ? &*result.given : nullptr;
  Table table;
  table.header = {"", "best"};
  if (given != nullptr) {
    table.header.emplace_back("given");
  }
  table.header.emplace_back("unit");
  table.words = {0, table.header.size() - 1};
  const auto add = [&](std::string name, const char* unit, auto of, auto bad) {
    const auto cell = [&](const SizeChoice& choice) {
      Value value = quantity(of(choice), unit, 4, false);
      if (bad(choice)) {
        value.tone = Tone::bad;
      }
      return value;
    };
    std::vector<Value> row{std::move(name), cell(best)};
    if (given != nullptr) {
      row.push_back(cell(*given));
    }
    row.emplace_back(unit);
    table.rows.push_back(std::move(row));
  };
  const auto fine = [](const SizeChoice&) { return false; };
  const std::string speed = speed_unit(result);
  add("gearing", "", [](const SizeChoice& c) { return c.gearing; }, fine);
  add("time", "s", [](const SizeChoice& c) { return c.travel.time; }, fine);
  add("top speed", speed.c_str(), [](const SizeChoice& c) { return c.travel.top_speed; }, fine);
  if (result.job.travel.stops && !result.job.travel.speed) {
    add("brakes after", "s", [](const SizeChoice& c) { return c.travel.switching_time; }, fine);
  }
  add(
      "peak current of the windings", "A",
      [](const SizeChoice& c) { return c.travel.peak_current; }, fine);
  add(
      "peak current from the battery", "A",
      [](const SizeChoice& c) { return c.travel.peak_supply; }, fine);
  if (best.holding_current > 0.0) {
    add("current to hold it", "A", [](const SizeChoice& c) { return c.holding_current; }, fine);
  }
  add(
      "least rail", "V", [](const SizeChoice& c) { return c.travel.least_rail; },
      [](const SizeChoice& c) { return c.browns_out; });
  add("energy taken", "J", [](const SizeChoice& c) { return c.travel.energy; }, fine);
  add("of it given back", "J", [](const SizeChoice& c) { return c.travel.returned; }, fine);
  add("heat in the windings", "J", [](const SizeChoice& c) { return c.travel.heat; }, fine);
  if (result.job.travel.winding.is_known()) {
    add(
        "windings at the end", "°C", [](const SizeChoice& c) { return c.travel.temperature; },
        [](const SizeChoice& c) { return c.overheats; });
  }
  return table;
}

/// "the stator limit 60 %, the voltage limit 40 %".
std::string bounds_in_words(const Travel& travel) {
  std::vector<std::pair<double, std::string>> shares;
  for (int i = 0; i < mechanisms::power_bounds; ++i) {
    const double share = travel.bound_time[static_cast<std::size_t>(i)] / travel.time;
    if (share >= 0.005) {
      shares.emplace_back(share, fmt::format("{} for {}", to_string(static_cast<PowerBound>(i)),
                                             percent(share, 2)));
    }
  }
  std::sort(shares.begin(), shares.end(),
            [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> words;
  for (auto& share : shares) {
    words.push_back(std::move(share.second));
  }
  return text::enumerate(words);
}

std::string motors_in_words(const SizeResult& result) {
  const mechanisms::DcMotor& motor = result.job.travel.load.motor;
  return motor.count == 1 ? motor.name : fmt::format("{} {}", motor.count, motor.name);
}

Facts facts_of(const SizeResult& result) {
  const TravelJob& travel = result.job.travel;
  const mechanisms::GearedLoad& load = travel.load;
  const mechanisms::PowerLimits& limits = travel.limits;
  const double n = load.motor.count;
  Facts facts;
  facts.add("mechanism", std::string(to_string(load.kind)));
  facts.add("motors", motors_in_words(result));
  facts.add("motion", motion_in_words(result));
  const auto limit = [&](const char* name, double current) {
    facts.add(name, std::isfinite(current) ? Value(fmt::format("{} A a motor", number(current / n)))
                                           : Value("none", Tone::quiet));
  };
  limit("stator limit", limits.stator_current);
  limit("supply limit", limits.supply_current);
  facts.add("voltage", fmt::format("{} V, battery {} V behind {} mΩ", number(limits.voltage),
                                   number(limits.battery.open_circuit_voltage),
                                   number(1e3 * limits.battery.resistance)));
  if (travel.winding.is_known()) {
    facts.add("windings", fmt::format("{} J/K a motor", number(travel.winding.heat_capacity)));
  }
  return facts;
}

Section best_section(const SizeResult& result) {
  Section section{"best", "The best gearing", {facts_of(result), choices_table(result)}};
  section.blocks.emplace_back(Paragraph{
      fmt::format("From {} to {} the time is within 2 % of the best. It is the best because {}.",
                  number(result.low, 3), number(result.high, 3), result.reason)});
  section.blocks.emplace_back(Paragraph{fmt::format(
      "At the best gearing the motion is bound by {}.", bounds_in_words(result.best.travel))});
  if (!result.given_refusal.empty()) {
    section.blocks.emplace_back(
        Paragraph{fmt::format("At the given gearing, {}: {}.",
                              number(result.job.gearing.value_or(0.0)), result.given_refusal),
                  Tone::bad});
  }
  return section;
}

/// A few gearings about the best.
Section gearing_section(const SizeResult& result) {
  Table table;
  table.header = {"gearing", "time s", "windings A", "battery A", "rail V", "energy J", ""};
  table.words = {6};
  table.wide_column = 6;
  constexpr std::size_t stride = 6;
  for (std::size_t i = 0; i < result.gearings.size(); i += stride) {
    const SizePoint& point = result.gearings[i];
    std::vector<Value> row{quantity(point.value, "", 3, false)};
    const auto cell = [&](double value, const char* unit) {
      row.push_back(point.at_gearing ? quantity(value, unit, 3, false) : Value(""));
    };
    const SizeChoice choice = point.at_gearing.value_or(SizeChoice{});
    cell(choice.travel.time, "s");
    cell(choice.travel.peak_current, "A");
    cell(choice.travel.peak_supply, "A");
    cell(choice.travel.least_rail, "V");
    cell(choice.travel.energy, "J");
    std::string refusal = point.refusal;
    std::replace(refusal.begin(), refusal.end(), '_', ' ');
    row.push_back(!point.at_gearing   ? Value(std::move(refusal), Tone::quiet)
                  : choice.browns_out ? Value("browns out", Tone::bad)
                  : choice.overheats  ? Value("overheats", Tone::bad)
                                      : Value(""));
    table.rows.push_back(std::move(row));
  }
  return {"gearing", "Every gearing", {std::move(table)}};
}

/// The ends and the middle of each sweep.
Section sweeps_section(const SizeResult& result) {
  Table table;
  table.header = {"what", "value", "unit", "time s", "best gearing", "time there s"};
  table.words = {0, 2};
  for (const SizeSweep& sweep : result.sweeps) {
    const std::size_t last = sweep.points.size() - 1;
    for (const std::size_t i : {std::size_t{0}, last / 4, last / 2, 3 * last / 4, last}) {
      const SizePoint& point = sweep.points[i];
      const auto& at = point.at_gearing;
      const auto& best = point.at_best;
      table.rows.push_back({sweep.title, quantity(point.value, sweep.unit, 3, false), sweep.unit,
                            at ? quantity(at->travel.time, "s", 3, false) : Value("none"),
                            best ? quantity(best->gearing, "", 3, false) : Value("none"),
                            best ? quantity(best->travel.time, "s", 3, false) : Value("none")});
    }
  }
  return {"sweeps", "Other loads and limits", {std::move(table)}};
}

Section motors_section(const SizeResult& result) {
  Table table;
  const double n = result.job.travel.load.motor.count;
  table.header = {"motor",     "gearing", "time s",   "windings A",
                  "battery A", "rail V",  "energy J", ""};
  table.words = {0, 7};
  if (result.best.holding_current > 0.0) {
    table.header.insert(table.header.begin() + 5, "hold A");
    table.words = {0, 8};
  }
  table.wide_column = table.header.size() - 1;
  for (const SizeMotor& motor : result.motors) {
    std::vector<Value> row{motor.name};
    const auto cell = [&](double value, const char* unit, int digits) {
      row.push_back(motor.choice ? quantity(value, unit, digits, false) : Value(""));
    };
    const SizeChoice choice = motor.choice.value_or(SizeChoice{});
    cell(choice.gearing, "", 3);
    cell(choice.travel.time, "s", 3);
    cell(choice.travel.peak_current / n, "A", 3);
    cell(choice.travel.peak_supply / n, "A", 3);
    if (result.best.holding_current > 0.0) {
      cell(choice.holding_current / n, "A", 3);
    }
    cell(choice.travel.least_rail, "V", 3);
    cell(choice.travel.energy, "J", 3);
    row.push_back(!motor.choice       ? Value("not there", Tone::quiet)
                  : choice.browns_out ? Value("browns out", Tone::bad)
                  : motor.is_own      ? Value("given", Tone::good)
                                      : Value(""));
    table.rows.push_back(std::move(row));
  }
  return {
      "motors",
      "Motors",
      {std::move(table),
       Paragraph{fmt::format(
           "Each motor of the table, as many of it ({}), at its own best gearing under the same "
           "limits; currents are of one motor. The fastest stands first, those that brown out "
           "or do not get there last.",
           number(n))}}};
}

Verdict verdict_of(const SizeResult& result) {
  Verdict verdict;
  verdict.line =
      fmt::format("A gearing of {} is the fastest: {}, {}.", number(result.best.gearing, 3),
                  seconds(result.best.travel.time), motion_in_words(result));
  if (result.best.browns_out) {
    verdict.add(Tone::bad, fmt::format("the battery falls to {} V, a brownout",
                                       number(result.best.travel.least_rail, 3)));
  }
  if (result.best.overheats) {
    verdict.add(Tone::bad, fmt::format("the windings get {} °C warm",
                                       number(result.best.travel.temperature, 3)));
  }
  if (!result.given_refusal.empty()) {
    verdict.add(Tone::bad, fmt::format("at the given gearing, {}, {}", number(*result.job.gearing),
                                       result.given_refusal));
  } else if (result.given) {
    const SizeChoice& given = *result.given;
    if (given.browns_out) {
      verdict.add(Tone::bad,
                  fmt::format("the given gearing, {}, browns out at {} V", number(given.gearing),
                              number(given.travel.least_rail, 3)));
    }
    const double more = given.travel.time / result.best.travel.time - 1.0;
    if (more > 0.02) {
      verdict.add(Tone::caution,
                  fmt::format("the given gearing, {}, takes {}, {} more", number(given.gearing),
                              seconds(given.travel.time), percent(more, 2)));
    }
  }
  return verdict;
}

void write_choice(JsonWriter& json, const SizeChoice& choice) {
  const Travel& travel = choice.travel;
  json.add({{"gearing", choice.gearing},
            {"time", travel.time},
            {"switching_time", travel.switching_time},
            {"top_speed", travel.top_speed},
            {"peak_stator_current", travel.peak_current},
            {"peak_supply_current", travel.peak_supply},
            {"holding_current", choice.holding_current},
            {"least_rail", travel.least_rail},
            {"energy", travel.energy},
            {"returned", travel.returned},
            {"heat", travel.heat},
            {"temperature", travel.temperature}});
  json.add("browns_out", choice.browns_out);
  json.add("overheats", choice.overheats);
  json.object("bound_share", [&] {
    static constexpr std::array<const char*, mechanisms::power_bounds> names{
        "voltage", "rail", "battery", "stator", "supply", "grip"};
    for (std::size_t i = 0; i < names.size(); ++i) {
      json.add(names[i], travel.bound_time[i] / travel.time);
    }
  });
}

void write_optional(JsonWriter& json, std::string_view name,
                    const std::optional<SizeChoice>& choice) {
  if (choice) {
    json.object(name, [&] { write_choice(json, *choice); });
  } else {
    json.add_json(name, "null");
  }
}

std::string csv_of(const SizeResult& result) {
  std::string text =
      "Gearing,Time (s),Top speed,Peak windings (A),Peak battery (A),Least rail (V),Energy (J),"
      "Heat (J)\n";
  for (const SizePoint& point : result.gearings) {
    if (!point.at_gearing) {
      text += fmt::format("{},,,,,,,\n", point.value);
      continue;
    }
    const Travel& travel = point.at_gearing->travel;
    text += fmt::format("{},{},{},{},{},{},{},{}\n", point.value, travel.time, travel.top_speed,
                        travel.peak_current, travel.peak_supply, travel.least_rail, travel.energy,
                        travel.heat);
  }
  return text;
}

}  // namespace

std::string way_unit(const SizeResult& result) {
  return std::string(mechanisms::position_unit(result.job.travel.load.kind));
}

std::string speed_unit(const SizeResult& result) {
  return way_unit(result) + "/s";
}

std::string motion_in_words(const SizeResult& result) {
  const TravelJob& travel = result.job.travel;
  if (travel.speed) {
    return fmt::format(
        "{} to {} {}",
        travel.start == 0.0 ? "from rest" : fmt::format("from {}", number(travel.start)),
        number(travel.end), speed_unit(result));
  }
  return fmt::format("{} to {} {}, from rest {}", number(travel.start), number(travel.end),
                     way_unit(result), travel.stops ? "to rest" : "without a stop");
}

std::string to_json(const SizeResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", size_schema);
    json.add("mechanism", to_string(result.job.travel.load.kind));
    json.add("motor", result.job.travel.load.motor.name);
    json.add("motor_count", result.job.travel.load.motor.count);
    json.add("unit", way_unit(result));
    json.object("motion", [&] {
      json.add("of", result.job.travel.speed ? "speed" : "position");
      json.add({{"start", result.job.travel.start}, {"end", result.job.travel.end}});
      json.add("stops", result.job.travel.stops && !result.job.travel.speed);
    });
    json.object("best", [&] { write_choice(json, result.best); });
    json.add("within_two_percent", {{"low", result.low}, {"high", result.high}});
    json.add("reason", result.reason);
    write_optional(json, "given", result.given);
    if (!result.given_refusal.empty()) {
      json.add("given_refusal", result.given_refusal);
    }
    json.list("gearings", result.gearings, [&](const SizePoint& point) {
      json.object([&] {
        json.add("gearing", point.value);
        write_optional(json, "choice", point.at_gearing);
        if (!point.refusal.empty()) {
          json.add("refusal", point.refusal);
        }
      });
    });
    json.list("sweeps", result.sweeps, [&](const SizeSweep& sweep) {
      json.object([&] {
        json.add("name", sweep.name);
        json.add("unit", sweep.unit);
        json.add("here", sweep.here);
        json.list("points", sweep.points, [&](const SizePoint& point) {
          json.object([&] {
            json.add("value", point.value);
            json.add("time", point.at_gearing ? std::optional(point.at_gearing->travel.time)
                                              : std::nullopt);
            json.add("best_gearing",
                     point.at_best ? std::optional(point.at_best->gearing) : std::nullopt);
            json.add("best_time",
                     point.at_best ? std::optional(point.at_best->travel.time) : std::nullopt);
          });
        });
      });
    });
    json.list("motors", result.motors, [&](const SizeMotor& motor) {
      json.object([&] {
        json.add("motor", motor.name);
        write_optional(json, "choice", motor.choice);
        if (!motor.refusal.empty()) {
          json.add("refusal", motor.refusal);
        }
      });
    });
    json.object("series", [&] {
      json.add("time", result.motion.time());
      for (const TimeSeries::Column& column : result.motion.columns()) {
        json.add(column.name, column.values);
      }
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const SizeResult& result) {
  Answer answer{.schema = size_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title =
      fmt::format("{} with {}", text::capitalized(to_string(result.job.travel.load.kind)),
                  motors_in_words(result));
  document.verdict = verdict_of(result);
  document.sections = {best_section(result),
                       gearing_section(result),
                       {"motion",
                        "The fastest motion",
                        {Paragraph{"Full push, then full brake: data/motion.csv of the report has "
                                   "it row by row."}}},
                       sweeps_section(result)};
  if (!result.motors.empty()) {
    document.sections.push_back(motors_section(result));
  }
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("project", result.job.path);
  answer.figures = figures_of(result);
  const mechanisms::GearedLoad& load = result.job.travel.load;
  DrawnMechanism drawing{.kind = load.kind,
                         .name = std::string(to_string(load.kind)),
                         .unit = way_unit(result),
                         .angle_offset = load.angle_offset,
                         .section = "motion",
                         .clock = size_clock};
  if (load.kind == mechanisms::MechanismKind::swerve_drive) {
    drawing.wheel_radius = load.radius;
  }
  answer.animations = mechanism_animation(drawing, result.motion);
  answer.files = {{"data/gearings.csv", csv_of(result)},
                  {"data/motion.csv", to_csv(result.motion)}};
  if (result.given_motion) {
    answer.files.push_back({"data/given_motion.csv", to_csv(*result.given_motion)});
  }
  return answer;
}

}  // namespace flyball::study
