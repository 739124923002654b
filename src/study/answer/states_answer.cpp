// What was tried of a state machine and what broke.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/states.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"

namespace flyball::study {

namespace {

constexpr const char* states_schema = "flyball.states/1";

using StateValues = std::vector<double>;

std::string shown(const std::string& name) {
  return cut(printable(name), 60);
}

void write(JsonWriter& json, const MachineViolation& violation) {
  json.object([&] {
    json.add("events", violation.events);
    json.add("arrived", violation.arrived);
    json.add("from", violation.from);
    json.add("to", violation.to);
    json.add("broken", violation.broken);
    json.add("before", violation.before);
    json.add("at", violation.at);
    json.add("share", violation.share);
    json.add("explanation", violation.explanation);
  });
}

std::string to_json(const StatesResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", states_schema);
    json.list("coordinates", result.job.space.axes(), [&](const SpaceAxis& axis) {
      json.object([&] {
        json.add("name", axis.name);
        json.add("unit", axis.unit);
      });
    });
    json.add("states", result.job.states.size());
    json.add("transitions", result.job.transitions.size());
    json.list("sequences", result.sequences, [&](const SequenceResult& sequence) {
      json.object([&] {
        json.add("name", sequence.name);
        json.add("states", sequence.states);
        json.key("violation");
        if (sequence.violation) {
          write(json, *sequence.violation);
        } else {
          json.write_json("null");
        }
      });
    });
    json.object("explored", [&] {
      json.add("depth", result.depth_reached);
      json.add("moves", result.moves);
      json.add("sequences", result.sequences_explored);
      json.add("complete", result.complete);
      json.key("violation");
      if (result.violation) {
        write(json, *result.violation);
      } else {
        json.write_json("null");
      }
    });
    json.add("unreached", result.unreached);
    json.add("ignored", result.unknown_events);
  });
  return std::move(json).text();
}

/// The first violation of all.
const MachineViolation* first_of(const StatesResult& result) {
  for (const SequenceResult& sequence : result.sequences) {
    if (sequence.violation) {
      return &*sequence.violation;
    }
  }
  return result.violation ? &*result.violation : nullptr;
}

std::string axis_label(const SpaceAxis& axis) {
  std::string label = shown(axis.name);
  if (!axis.unit.empty()) {
    label += " (" + axis.unit + ")";
  }
  return label;
}

/// The space of two coordinates, the others as in a place.
Figure space_figure(const StatesResult& result, std::size_t i, std::size_t j) {
  const ConfigurationSpace& space = result.job.space;
  const SpaceAxis& across = space.axes()[i];
  const SpaceAxis& up = space.axes()[j];
  Figure figure{"space",
                fmt::format("space_{}_{}", i + 1, j + 1),
                fmt::format("{} and {}", text::capitalized(shown(across.name)), shown(up.name)),
                "States and the moves between them. Grey points are configurations that are not "
                "allowed.",
                {}};
  const MachineViolation* violation = first_of(result);
  StateValues at = violation != nullptr ? violation->at : result.job.states.front().at;
  Plot& plot = figure.plot;
  plot.title = figure.title;
  plot.x_label = axis_label(across);
  PlotPanel panel{.y_label = axis_label(up)};
  panel.y_limits =
      PlotLimits{up.low - 0.05 * (up.high - up.low), up.high + 0.05 * (up.high - up.low)};
  PlotLine forbidden{.label = "not allowed", .style = LineStyle::points, .color = unused_color};
  constexpr int columns = 70;
  constexpr int rows = 45;
  for (int a = 0; a <= columns; ++a) {
    for (int b = 0; b <= rows; ++b) {
      StateValues q = at;
      q[i] = across.low + (across.high - across.low) * a / columns;
      q[j] = up.low + (up.high - up.low) * b / rows;
      if (!space.valid(q)) {
        forbidden.x.push_back(q[i]);
        forbidden.y.push_back(q[j]);
      }
    }
  }
  if (!forbidden.x.empty()) {
    panel.lines.push_back(std::move(forbidden));
  }
  PlotLine ways{.label = "moves", .style = LineStyle::guide, .color = measured_color};
  for (const std::vector<StateValues>& way : result.ways) {
    for (const StateValues& corner : way) {
      ways.x.push_back(corner[i]);
      ways.y.push_back(corner[j]);
    }
    ways.x.push_back(NAN);
    ways.y.push_back(NAN);
  }
  if (!ways.x.empty()) {
    panel.lines.push_back(std::move(ways));
  }
  panel.lines.push_back({.label = "stops",
                         .x = {across.low, across.high, across.high, across.low, across.low},
                         .y = {up.low, up.low, up.high, up.high, up.low},
                         .color = simulated_color});
  PlotLine states{.label = "states", .style = LineStyle::circles, .color = quiet_color};
  for (const MachineState& state : result.job.states) {
    states.x.push_back(state.at[i]);
    states.y.push_back(state.at[j]);
    panel.notes.push_back({state.at[i], state.at[j], shown(state.name)});
  }
  panel.lines.push_back(std::move(states));
  if (violation != nullptr) {
    panel.lines.push_back({.label = "first violation",
                           .x = {violation->before[i], violation->at[i]},
                           .y = {violation->before[j], violation->at[j]},
                           .style = LineStyle::crosses,
                           .color = voltage_color});
  }
  plot.panels.push_back(std::move(panel));
  return figure;
}

void add_violation(Section& section, const StatesResult& result,
                   const MachineViolation& violation) {
  section.blocks.emplace_back(Paragraph{violation.explanation, Tone::bad});
  Table table{.caption = "The way to it",
              .header = {"event", "comes", "at the end of the way"},
              .words = {0, 1}};
  table.header.pop_back();
  for (std::size_t k = 0; k < violation.events.size(); ++k) {
    const double share = k == 0 ? 1.0 : violation.arrived[k - 1];
    table.rows.push_back({shown(violation.events[k]),
                          k == 0 ? std::string("at the start")
                          : share < 1.0
                              ? fmt::format("at {} of the move before", text::percent(share))
                              : std::string("when the move before has ended")});
  }
  section.blocks.emplace_back(std::move(table));
  Table places{.caption = "Where",
               .header = {"coordinate", "unit", "move begins", "breaks"},
               .words = {0, 1}};
  for (std::size_t i = 0; i < violation.at.size(); ++i) {
    const SpaceAxis& axis = result.job.space.axes()[i];
    places.rows.push_back({shown(axis.name), axis.unit,
                           quantity(violation.before[i], axis.unit, 5, false),
                           quantity(violation.at[i], axis.unit, 5, false)});
  }
  section.blocks.emplace_back(std::move(places));
}

}  // namespace

Answer answer_of(const StatesResult& result) {
  Answer answer{.schema = states_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = "State machine";
  const MachineViolation* first = first_of(result);
  if (first != nullptr) {
    document.verdict.line = first->sequence.empty()
                                ? "Some events lead out of what is allowed."
                                : fmt::format("The sequence \"{}\" does not do what it should.",
                                              shown(first->sequence));
    document.verdict.add(Tone::bad, first->explanation);
    answer.refusal = Error(ConfigurationError::blocked_move)
                         .in("states")
                         .about("the state machine")
                         .got("not safe: " + first->explanation);
  } else if (!result.complete) {
    const std::string sure =
        result.depth_reached > 1
            ? fmt::format("no sequence of up to {} {} leaves what is allowed, longer ones may",
                          result.depth_reached - 1, result.depth_reached == 2 ? "event" : "events")
            : std::string("not even all single events were tried");
    document.verdict.line = fmt::format(
        "Undecided: the search ended at its bound of {} moves, before sequences of {} events.",
        result.moves, result.job.depth);
    document.verdict.add(Tone::caution, sure);
    answer.refusal =
        Error(ConfigurationError::undecided)
            .in("states")
            .about("the state machine")
            .got(fmt::format("{} moves judged: {}", result.moves, sure))
            .expected(fmt::format("all sequences of up to {} events", result.job.depth))
            .hint("explore to a smaller depth, or with fewer interrupts");
  } else {
    document.verdict.line =
        fmt::format("No sequence of up to {} events leaves what is allowed.", result.depth_reached);
  }
  if (first == nullptr && !result.unreached.empty()) {
    document.verdict.add(Tone::caution,
                         fmt::format("no events lead to {}", text::enumerate(result.unreached)));
  }
  Section tried{"tried", "What was tried", {}};
  Facts facts;
  facts.add("states", fmt::format("{}", result.job.states.size()));
  facts.add("transitions", fmt::format("{}", result.job.transitions.size()));
  facts.add("coordinates", fmt::format("{}", result.job.space.dimension()));
  facts.add("different moves judged", fmt::format("{}", result.moves));
  if (!result.violation) {
    facts.add("sequences that they stand for", text::number(result.sequences_explored));
  }
  facts.add("events may come",
            result.job.interrupts > 0
                ? fmt::format("at the end of a move and at {} places of it", result.job.interrupts)
                : std::string("at the end of a move"));
  tried.blocks.emplace_back(std::move(facts));
  if (!result.sequences.empty()) {
    Table table{.caption = "Sequences",
                .header = {"sequence", "states", "outcome"},
                .words = {0, 1, 2},
                .wide_column = 2};
    for (const SequenceResult& sequence : result.sequences) {
      table.rows.push_back(
          {shown(sequence.name),
           cut(printable(fmt::format("{}", fmt::join(sequence.states, " → "))), 80),
           sequence.violation ? Value(sequence.violation->explanation, Tone::bad)
                              : Value("as it should", Tone::good)});
    }
    tried.blocks.emplace_back(std::move(table));
  }
  if (!result.unknown_events.empty() && !result.job.strict) {
    std::vector<std::string> some(
        result.unknown_events.begin(),
        result.unknown_events.begin() +
            static_cast<std::ptrdiff_t>(std::min<std::size_t>(result.unknown_events.size(), 12)));
    if (some.size() < result.unknown_events.size()) {
      some.push_back("others");
    }
    tried.blocks.emplace_back(Paragraph{
        fmt::format("Ignored, as the state has no transition for them: {}.", text::enumerate(some)),
        Tone::quiet});
  }
  document.sections.push_back(std::move(tried));
  if (first != nullptr) {
    Section section{"violation", "The first violation", {}};
    add_violation(section, result, *first);
    document.sections.push_back(std::move(section));
  }
  document.sections.push_back({"space", "The configuration space", {}});
  document.origins.add("file", result.job.path);
  const auto n = static_cast<std::size_t>(result.job.space.dimension());
  for (std::size_t i = 0; i + 1 < n && i < 3; ++i) {
    answer.figures.push_back(space_figure(result, i, i + 1));
  }
  return answer;
}

}  // namespace flyball::study
