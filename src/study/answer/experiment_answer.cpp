// The tests to run, and what they will tell.
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/study/experiment.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::GainEstimate;
using text::number;
using text::percent;
using text::seconds;

constexpr const char* experiment_schema = "flyball.experiment/1";

std::string voltage_text(const PlannedTest& test) {
  return test.ramp_rate > 0.0 ? fmt::format("from 0 V by {} V/s, to {} V at most",
                                            number(std::copysign(test.ramp_rate, test.voltage), 3),
                                            number(test.voltage, 3))
                              : fmt::format("{} V at once", number(test.voltage, 3));
}

Table tests_table(const ExperimentResult& result) {
  const std::string& unit = result.job.plant.unit;
  Table table;
  table.header = {"test", "voltage", "ends after (s)", "moves (" + unit + ")",
                  "top speed (" + unit + "/s)"};
  table.words = {0, 1};
  for (const PlannedTest& test : result.best.tests) {
    table.rows.push_back({std::string(to_string(test.kind)), voltage_text(test),
                          quantity(test.duration, "s", 3, false),
                          quantity(test.travel, unit, 3, false),
                          quantity(test.top_speed, unit + "/s", 3, false)});
  }
  return table;
}

Value width_of(const GainForecast& gain) {
  if (!gain.determined) {
    return {"not determined", Tone::caution};
  }
  return {fmt::format("± {} ({})", number(gain.half_width, 2),
                      percent(gain.half_width / std::abs(gain.value))),
          gain.half_width <= gain.wanted ? Tone::good : Tone::caution};
}

/// What the log knows, or nothing.
const GainEstimate* known(const ExperimentResult& result, std::string_view name) {
  if (!result.job.log) {
    return nullptr;
  }
  const identification::FeedforwardFit& fit = *result.job.log;
  return name == "kS"   ? &fit.kS
         : name == "kV" ? &fit.kV
         : name == "kA" ? &fit.kA
         : fit.kG       ? &*fit.kG
                        : nullptr;
}

Table forecast_table(const ExperimentResult& result) {
  Table table;
  table.header = {"gain", "assumed", "these tests", "1 V/s and 7 V", "wanted", "unit"};
  table.words = {0, 5};
  if (result.job.log) {
    table.header.insert(table.header.begin() + 2, "the log");
    table.words.back() = 6;
  }
  for (std::size_t i = 0; i < result.best.gains.size(); ++i) {
    const GainForecast& gain = result.best.gains[i];
    std::vector<Value> row{gain.name, number(gain.value, 4)};
    if (result.job.log) {
      const GainEstimate* now = known(result, gain.name);
      row.push_back(now != nullptr && now->determined
                        ? Value("± " + number(0.5 * (now->interval[1] - now->interval[0]), 2))
                        : Value("not determined", Tone::caution));
    }
    row.push_back(width_of(gain));
    row.push_back(i < result.usual.gains.size() ? width_of(result.usual.gains[i])
                                                : Value("no gains", Tone::caution));
    row.emplace_back("± " + number(gain.wanted, 2));
    row.emplace_back(gain.unit);
    table.rows.push_back(std::move(row));
  }
  return table;
}

Verdict verdict_of(const ExperimentResult& result) {
  Verdict verdict;
  verdict.line =
      fmt::format("{} of these four tests, {} in all.",
                  result.best.repeats == 1 ? std::string("One round")
                                           : fmt::format("{} rounds", result.best.repeats),
                  seconds(result.best.duration));
  for (const GainForecast& gain : result.best.gains) {
    if (!gain.determined) {
      const mechanisms::FeedforwardGains& gains = result.job.plant.gains;
      const double refresh = result.job.sensor.refresh;
      const bool quick = gain.name == "kA" && gains.kA < 2.0 * refresh * gains.kV;
      verdict.add(Tone::caution,
                  quick
                      ? fmt::format("kA will not be determined: it speeds up with a time constant "
                                    "of {}, and its sensor shows a new value every {}",
                                    seconds(gains.kA / gains.kV), seconds(refresh))
                      : fmt::format("{} will not be determined", gain.name));
    } else if (gain.half_width > gain.wanted) {
      verdict.add(Tone::caution,
                  fmt::format("{} will be known to ± {} only: more travel, voltage, time or a "
                              "faster sensor would tell more",
                              gain.name, percent(gain.half_width / std::abs(gain.value))));
    }
  }
  return verdict;
}

void write_experiment(JsonWriter& json, std::string_view name, const Experiment& experiment) {
  json.object(name, [&] {
    json.add("repeats", experiment.repeats);
    json.add("duration", experiment.duration);
    json.list("tests", experiment.tests, [&](const PlannedTest& test) {
      json.object([&] {
        json.add("test", to_string(test.kind));
        json.add({{"ramp_rate", test.ramp_rate},
                  {"voltage", test.voltage},
                  {"duration", test.duration},
                  {"travel", test.travel},
                  {"top_speed", test.top_speed}});
      });
    });
    json.list("gains", experiment.gains, [&](const GainForecast& gain) {
      json.object([&] {
        json.add("gain", gain.name);
        json.add("unit", gain.unit);
        json.add("determined", gain.determined);
        json.add({{"half_width", gain.half_width}, {"wanted", gain.wanted}});
      });
    });
  });
}

}  // namespace

std::string to_json(const ExperimentResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", experiment_schema);
    json.add("mechanism", to_string(result.job.plant.kind));
    json.add("unit", result.job.plant.unit);
    write_experiment(json, "experiment", result.best);
    write_experiment(json, "usual", result.usual);
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Answer answer_of(const ExperimentResult& result) {
  Answer answer{.schema = experiment_schema, .json = to_json(result)};
  Document& document = answer.document;
  const std::string kind(to_string(result.job.plant.kind));
  document.title = fmt::format("Tests of {} {}", kind == "flywheel" ? "a" : "an", kind);
  document.verdict = verdict_of(result);
  Section tests{"tests", "Tests", {tests_table(result)}};
  if (result.job.limits.travel_low && !controls_velocity(result.job.plant.kind)) {
    tests.blocks.emplace_back(Paragraph{
        fmt::format("Between {} and {} {}; each test starts at rest near one end and is ended "
                    "before the other.",
                    number(*result.job.limits.travel_low, 3),
                    number(*result.job.limits.travel_high, 3), result.job.plant.unit)});
  }
  document.sections = {std::move(tests),
                       {"forecast",
                        "What their log will tell",
                        {forecast_table(result),
                         Paragraph{"Half widths of 95 % intervals, of simulated logs that were "
                                   "fitted."}}},
                       diagnostics_section(result.diagnostics)};
  return answer;
}

}  // namespace flyball::study
