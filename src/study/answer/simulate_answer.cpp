#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>

#include "study/answer/mechanism_animation.hpp"
#include "study/answer/model_parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

/// Of all of its pictures over time.
constexpr const char* simulation_clock = "simulation";

std::vector<Value> row_of(const Coordinate& signal, const SignalSummary& summary) {
  return {label(signal), text::number(summary.min), text::number(summary.max),
          text::number(summary.final),
          summary.settling_time ? text::seconds(*summary.settling_time) : ""};
}

PlotPanel signal_panel(const Simulation& result, const ShownSignal& shown,
                       const std::string& estimate, const std::string& reference, bool steps) {
  PlotPanel made = panel(shown.signal, {});
  const auto add = [&](const std::string& name, const std::string& label, int color,
                       LineStyle style) {
    if (const std::vector<double>* values = name.empty() ? nullptr : result.series.find(name)) {
      made.lines.push_back(line(label, result.series.time(), *values, color, style));
    }
  };
  const bool alone = shown.estimate.empty() && shown.reference.empty();
  add(shown.estimate, estimate, quiet_color, steps ? LineStyle::steps : LineStyle::solid);
  add(shown.truth,
      alone || !result.closed_loop ? ""
      : steps                      ? "applied"
                                   : "truth",
      steps ? voltage_color : measured_color,
      steps && result.closed_loop ? LineStyle::steps : LineStyle::solid);
  add(shown.reference, reference, simulated_color, LineStyle::dashed);
  return made;
}

Figure figure(const Simulation& result, const std::vector<ShownSignal>& signals,
              const std::string& name, const std::string& title, const std::string& estimate,
              const std::string& reference, bool steps) {
  Figure made = over_time("simulation", name, title,
                          fmt::format("{} of the simulated {}.", title, result.name));
  made.plot.clock = simulation_clock;
  for (std::size_t i = 0; i < std::min(signals.size(), most_panels); ++i) {
    made.plot.panels.push_back(signal_panel(result, signals[i], estimate, reference, steps));
    if (steps && std::isfinite(result.limits[i])) {
      made.plot.panels.back().marks.push_back({result.limits[i], "limit", false});
      made.plot.panels.back().marks.push_back({-result.limits[i], "", false});
    }
  }
  return made;
}

/// Of two states one over the other, where it begins, and where it should go.
Figure phase_plane(const Simulation& result) {
  constexpr std::size_t most_points = 5000;
  const ShownSignal& x = result.states[0];
  const ShownSignal& y = result.states[1];
  Figure made{"simulation",
              "phase_plane",
              "Phase plane",
              fmt::format("{} over {}: the way of the simulated {} from where it begins.",
                          text::capitalized(y.signal.name), x.signal.name, result.name),
              {}};
  made.plot.title = made.title;
  made.plot.x_label = label({text::capitalized(x.signal.name), x.signal.unit});
  made.plot.width = 640;
  PlotPanel panel{.y_label = label({text::capitalized(y.signal.name), y.signal.unit})};
  const std::size_t stride = (result.series.rows() + most_points - 1) / most_points;
  const auto add = [&](const std::string& across, const std::string& up, PlotLine line) {
    const std::vector<double>* const xs = across.empty() ? nullptr : result.series.find(across);
    const std::vector<double>* const ys = up.empty() ? nullptr : result.series.find(up);
    if (xs != nullptr && ys != nullptr && !xs->empty()) {
      for (std::size_t i = 0; i < xs->size(); i += stride) {
        line.x.push_back((*xs)[i]);
        line.y.push_back((*ys)[i]);
      }
      panel.lines.push_back(std::move(line));
    }
  };
  add(x.truth, y.truth, {.label = result.closed_loop ? "truth" : "", .color = measured_color});
  add(x.reference, y.reference,
      {.label = "reference", .style = LineStyle::dashed, .color = simulated_color});
  if (!panel.lines.empty()) {
    const PlotLine& truth = panel.lines.front();
    panel.lines.push_back({.label = "begin",
                           .x = {truth.x.front()},
                           .y = {truth.y.front()},
                           .style = LineStyle::circles,
                           .color = measured_color});
  }
  made.plot.panels = {std::move(panel)};
  return made;
}

void write_summary(JsonWriter& json, const Coordinate& signal, const SignalSummary& summary) {
  json.add("name", signal.name);
  json.add("unit", signal.unit);
  json.add("min", summary.min);
  json.add("max", summary.max);
  json.add("final", summary.final);
}

Verdict verdict_of(const Simulation& result) {
  Verdict verdict;
  for (std::size_t i = 0; i < result.inputs.size(); ++i) {
    if (const double share = result.input_summary[i].saturated_fraction; share > 0.0) {
      verdict.add(Tone::caution,
                  fmt::format("{} is at its limit for {} of the time", result.inputs[i].signal.name,
                              text::percent(share, 2)));
    }
  }
  verdict.line =
      fmt::format("The {} was simulated for {}.", result.closed_loop ? "closed loop" : "open loop",
                  text::seconds(result.duration));
  return verdict;
}

}  // namespace

Section simulation_section(const Simulation& result) {
  Section section{"simulation", "Simulation", {}};
  Facts facts;
  facts.add("loop", result.closed_loop
                        ? fmt::format("closed, each {}", text::seconds(result.period))
                        : std::string("open"));
  facts.add("duration", text::seconds(result.duration));
  section.blocks.emplace_back(std::move(facts));
  Table table;
  table.header = {"signal", "least", "greatest", "at the end", "settled after"};
  const bool settles = std::any_of(result.state_summary.begin(), result.state_summary.end(),
                                   [](const auto& summary) { return summary.settling_time; });
  for (std::size_t i = 0; i < result.states.size(); ++i) {
    table.rows.push_back(row_of(result.states[i].signal, result.state_summary[i]));
  }
  for (std::size_t i = 0; i < result.outputs.size(); ++i) {
    table.rows.push_back(row_of(result.outputs[i].signal, result.output_summary[i]));
  }
  for (std::size_t i = 0; i < result.inputs.size(); ++i) {
    table.rows.push_back(row_of(result.inputs[i].signal, result.input_summary[i]));
  }
  if (!settles) {
    table.header.pop_back();
    for (auto& row : table.rows) {
      row.pop_back();
    }
  }
  section.blocks.emplace_back(std::move(table));
  Facts use;
  for (std::size_t i = 0; i < result.inputs.size(); ++i) {
    const Coordinate& input = result.inputs[i].signal;
    const InputSummary& summary = result.input_summary[i];
    use.add("∫ " + input.name + "² dt",
            fmt::format("{} {}", text::number(summary.energy),
                        input.unit.empty() ? "s"
                        : input.unit.find_first_of(" /") == std::string::npos
                            ? input.unit + "² s"
                            : fmt::format("({})² s", input.unit)));
    if (std::isfinite(result.limits[i])) {
      use.add(input.name + " at its limit", text::percent(summary.saturated_fraction, 2),
              summary.saturated_fraction > 0.0 ? Tone::caution : Tone::plain);
    }
  }
  if (!use.facts.empty()) {
    section.blocks.emplace_back(std::move(use));
  }
  return section;
}

std::vector<Figure> figures_of(const Simulation& result) {
  std::vector<Figure> figures{
      figure(result, result.states, "states", "States", "estimate", "reference", false)};
  if (!result.outputs.empty()) {
    figures.push_back(figure(result, result.outputs, "outputs", "Outputs", "", "measured", false));
  }
  if (!result.inputs.empty()) {
    figures.push_back(figure(result, result.inputs, "inputs", "Inputs", "asked for", "", true));
  }
  if (result.states.size() == 2) {
    figures.push_back(phase_plane(result));
  }
  return figures;
}

AnswerFile data_file(const Simulation& result) {
  return {"data/simulation.csv", to_csv(result.series)};
}

void write_simulation(JsonWriter& json, const Simulation& result) {
  json.add("model", result.name);
  json.add("loop", result.closed_loop ? "closed" : "open");
  json.add("duration", result.duration);
  json.add("period", result.closed_loop ? std::optional(result.period) : std::nullopt);
  json.add("seed", result.seed);
  const auto signals = [&](std::string_view key, const std::vector<ShownSignal>& shown,
                           const auto& summaries, const auto& more) {
    json.key(key);
    json.open('[');
    for (std::size_t i = 0; i < shown.size(); ++i) {
      json.object([&] {
        write_summary(json, shown[i].signal, summaries[i]);
        more(summaries[i]);
      });
    }
    json.close(']');
  };
  signals("states", result.states, result.state_summary,
          [&](const SignalSummary& summary) { json.add("settling_time", summary.settling_time); });
  signals("outputs", result.outputs, result.output_summary, [](const SignalSummary&) {});
  signals("inputs", result.inputs, result.input_summary, [&](const InputSummary& summary) {
    json.add("saturated_fraction", summary.saturated_fraction);
    json.add("energy", summary.energy);
  });
  json.object("series", [&] {
    json.add("time", result.series.time());
    for (const TimeSeries::Column& column : result.series.columns()) {
      json.add(column.name, column.values);
    }
  });
}

Answer answer_of(const Simulation& result) {
  Answer answer{.schema = "flyball.simulate/1"};
  JsonWriter json;
  json.object([&] {
    json.add("schema", answer.schema);
    write_simulation(json, result);
    json.add("diagnostics", result.diagnostics);
  });
  answer.json = std::move(json).text();
  Document& document = answer.document;
  document.title = title_of(result.name, "", result.path);
  document.verdict = verdict_of(result);
  document.sections = {simulation_section(result)};
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("model", result.path);
  document.origins.add("seed", fmt::to_string(result.seed));
  answer.figures = figures_of(result);
  if (result.plant) {
    answer.animations =
        mechanism_animation(drawn(*result.plant, "simulation", simulation_clock), result.series);
  }
  answer.files = {data_file(result)};
  return answer;
}

}  // namespace flyball::study
