// Loops in tables and as JSON.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/io/json_writer.hpp>

#include "core/wording.hpp"
#include "study/answer/loop_study_parts.hpp"

namespace flyball::study {

namespace {

using text::number;
using enum LoopView;

double decibels(double gain) {
  return 20.0 * std::log10(gain);
}

/// A number and its unit, or words where there is none.
Value or_none(const std::optional<double>& value, const std::string& unit, double scale = 1.0) {
  return value ? quantity(scale * *value, unit) : Value("none", Tone::quiet);
}

/// "62.7°"
Value degrees_value(double angle) {
  Value value = quantity(angle, "°");
  value.text = number(angle) + "°";
  return value;
}

Value gain_margin(const classical::LoopMargins& margins) {
  if (!margins.gain_margin) {
    return margins.stable ? Value("∞") : Value("none", Tone::quiet);
  }
  return quantity(decibels(*margins.gain_margin), "dB");
}

Value phase_margin(const classical::LoopMargins& margins) {
  if (!margins.phase_margin) {
    return margins.stable ? Value("∞") : Value("none", Tone::quiet);
  }
  return degrees_value(*margins.phase_margin);
}

/// What becomes of the closed loop.
Value stability_of(const LoopFindings& loop) {
  if (loop.margins->stable) {
    return {"stable", Tone::good};
  }
  if (loop.margins->unstable_poles == std::numeric_limits<int>::max()) {
    return {"unstable, infinitely many poles: |L(∞)| ≥ 1 behind dead time", Tone::bad};
  }
  return {fmt::format("unstable, {} {}",
                      text::count(static_cast<std::size_t>(loop.margins->unstable_poles), "pole"),
                      loop.period() ? "not inside the unit circle" : "not left of the axis"),
          Tone::bad};
}

Section margins_section(const LoopResult& result) {
  Section section{"margins", "Margins of the opened loop", {}};
  if (result.loops.size() > 1) {
    Table table{.header = {"loop", "closed loop", "gain margin", "phase margin", "delay margin",
                           "disk margin", "max |S|"},
                .words = {0, 1}};
    for (const LoopFindings& loop : result.loops) {
      const classical::LoopMargins& m = *loop.margins;
      table.rows.push_back({short_name(loop),
                            m.stable ? Value("stable", Tone::good) : Value("unstable", Tone::bad),
                            gain_margin(m), phase_margin(m), quantity(m.delay_margin, "s"),
                            quantity(m.disk_margin, ""), quantity(m.sensitivity.value, "")});
    }
    section.blocks.push_back(std::move(table));
    return section;
  }
  const LoopFindings& loop = result.loops.front();
  const classical::LoopMargins& m = *loop.margins;
  Facts facts;
  facts.add("closed loop", stability_of(loop));
  facts.add("gain margin", gain_margin(m));
  facts.add("phase margin", phase_margin(m));
  facts.add("delay margin", quantity(m.delay_margin, "s"));
  facts.add("disk margin", quantity(m.disk_margin, ""));
  Value peak = quantity(m.sensitivity.value, "");
  peak.text += fmt::format(" at {} rad/s", number(m.sensitivity.frequency));
  facts.add("largest |1/(1 + L)|", std::move(peak));
  facts.add("L(0)", quantity(loop.dc_gain(), ""));
  if (loop.bandwidth) {
    facts.add("bandwidth of L", quantity(*loop.bandwidth, "rad/s"));
  }
  section.blocks.push_back(std::move(facts));
  if (!m.gain_crossings.empty() || !m.phase_crossings.empty()) {
    Table table{.caption = "Every crossing",
                .header = {"frequency (rad/s)", "what", "margin"},
                .words = {1}};
    for (const auto& at : m.gain_crossings) {
      table.rows.push_back(
          {quantity(at.frequency, "rad/s", 5, false), "|L| = 1", degrees_value(at.phase_margin)});
    }
    for (const auto& at : m.phase_crossings) {
      table.rows.push_back({quantity(at.frequency, "rad/s", 5, false), "L < 0",
                            quantity(decibels(at.gain_margin), "dB")});
    }
    std::stable_sort(table.rows.begin(), table.rows.end(), [](const auto& a, const auto& b) {
      return a.front().number.value_or(0.0) < b.front().number.value_or(0.0);
    });
    // A dead time has them without end, of ever less gain: result.json has all.
    constexpr std::size_t most_rows = 12;
    if (table.rows.size() > most_rows) {
      table.caption = fmt::format("The first {} of {} crossings", most_rows, table.rows.size());
      table.rows.resize(most_rows);
    }
    section.blocks.push_back(std::move(table));
  }
  return section;
}

/// What is told of each loop: below each other of one, a row each of several.
struct Column {
  std::string name;
  std::vector<Value> values{};
};
Block told(const LoopResult& result, std::vector<Column> columns) {
  if (result.loops.size() == 1) {
    Facts facts;
    for (Column& column : columns) {
      facts.add(std::move(column.name), std::move(column.values.front()));
    }
    return facts;
  }
  Table table{.header = {""}, .words = {0}};
  for (std::size_t i = 0; i < result.loops.size(); ++i) {
    table.rows.push_back({short_name(result.loops[i])});
    for (Column& column : columns) {
      if (i == 0) {
        table.header.push_back(column.name);
      }
      table.rows.back().push_back(std::move(column.values[i]));
    }
  }
  return table;
}

Section nyquist_section(const LoopResult& result) {
  std::vector<Column> columns{{"unstable poles of L"},
                              {"encirclements of −1"},
                              {"unstable poles of the closed loop"},
                              {"distance from −1"}};
  for (const LoopFindings& loop : result.loops) {
    const classical::NyquistData& n = *loop.nyquist;
    const bool endless =
        loop.margins && loop.margins->unstable_poles == std::numeric_limits<int>::max();
    const auto counted = [&](const std::optional<int>& count) {
      return count     ? Value(fmt::format("{}", *count))
             : endless ? Value("infinitely many")
                       : Value("none: the curve meets −1");
    };
    columns[0].values.emplace_back(fmt::format("{}", n.open_loop_unstable));
    columns[1].values.push_back(counted(n.encirclements));
    columns[2].values.push_back(counted(n.closed_loop_unstable));
    columns[3].values.push_back(quantity(n.distance, ""));
  }
  return {"nyquist", "Nyquist's count", {told(result, std::move(columns))}};
}

std::string ranges_of(const std::vector<classical::GainRange>& ranges) {
  if (ranges.empty()) {
    return "none";
  }
  std::vector<std::string> texts;
  for (const classical::GainRange& range : ranges) {
    texts.push_back(fmt::format("{} to {}", number(range.low, 6), number(range.high, 6)));
  }
  return text::enumerate(texts);
}

std::string angles_of(const std::vector<double>& angles) {
  std::vector<std::string> texts;
  for (const double angle : angles) {
    texts.push_back(number(angle, 4) + "°");
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

void add_locus(Section& section, const LoopResult& result, const LoopFindings& loop) {
  const classical::RootLocus& locus = *loop.locus;
  if (result.loops.size() > 1) {
    section.blocks.push_back(Paragraph{loop.name});
  }
  Facts facts;
  facts.add("stable for k", ranges_of(locus.stable_gains),
            locus.stable_gains.empty() ? Tone::bad : Tone::good);
  if (!locus.asymptotes.angles.empty()) {
    facts.add("asymptotes", fmt::format("from {}, at {}", number(locus.asymptotes.center),
                                        angles_of(locus.asymptotes.angles)));
  }
  section.blocks.push_back(std::move(facts));
  Table table{.header = {"on the locus", "k", "s", "frequency (rad/s)", "damping ratio"},
              .words = {0, 2}};
  if (loop.period()) {
    table.header[2] = "z";
  }
  const auto row = [&](std::string what, std::optional<double> gain, std::complex<double> point) {
    const std::complex<double> s = loop.period() ? std::log(point) / loop.period()->si() : point;
    const double frequency = std::abs(s);
    const double decay = std::abs(s.real()) > 1e-12 * frequency ? -s.real() : 0.0;
    table.rows.push_back(
        {std::move(what), gain ? quantity(*gain, "", 6) : Value("", Tone::quiet),
         text::complex_number(point, 6),
         std::isfinite(frequency) ? quantity(frequency, "rad/s", 5, false) : Value("∞"),
         std::isfinite(frequency) && frequency > 0.0 ? quantity(decay / frequency, "", 4)
                                                     : Value("")});
  };
  for (const classical::BranchPoint& at : locus.branch_points) {
    if (at.point.imag() >= 0.0) {
      row(at.branches == 2 ? "two branches meet" : fmt::format("{} branches meet", at.branches),
          at.gain, at.point);
    }
  }
  for (const classical::BorderCrossing& at : locus.crossings) {
    row("border of stability", at.gain, at.point);
  }
  for (const classical::LocusPoint& at : loop.at_damping) {
    row(fmt::format("damping ratio {}", number(*result.job.damping)), at.gain, at.point);
  }
  if (loop.closed_poles) {
    for (const std::complex<double>& pole : *loop.closed_poles) {
      if (pole.imag() >= 0.0) {
        row("closed loop", result.job.gain, pole);
      }
    }
  }
  section.blocks.push_back(std::move(table));
  Table roots{.header = {"of L", "at", "branches leave or arrive at"}, .words = {0, 1, 2}};
  for (const auto& [angles, what] :
       {std::pair(&locus.departures, "pole"), std::pair(&locus.arrivals, "zero")}) {
    for (const classical::LocusAngles& root : *angles) {
      if (root.root.imag() >= 0.0) {
        roots.rows.push_back({what, text::complex_number(root.root, 6), angles_of(root.angles)});
      }
    }
  }
  section.blocks.push_back(std::move(roots));
}

Section locus_section(const LoopResult& result) {
  Section section{"rlocus", "Root locus", {}};
  for (const LoopFindings& loop : result.loops) {
    if (loop.locus) {
      add_locus(section, result, loop);
    }
  }
  return section;
}

/// Gains of one plant, a row each of several.
Section pid_section(const LoopResult& result) {
  std::vector<Column> columns{{"Kp"}, {"Ki (1/s)"}, {"Kd (s)"}, {"Ti"}, {"Td"}, {"filter τ"}};
  for (const LoopFindings& loop : result.loops) {
    const auto& [kp, ki, kd] = loop.pid->gains;
    columns[0].values.push_back(quantity(kp, "", 6));
    columns[1].values.push_back(quantity(ki, "", 6));
    columns[2].values.push_back(quantity(kd, "", 6));
    columns[3].values.push_back(ki != 0.0 ? quantity(kp / ki, "s") : Value("none", Tone::quiet));
    columns[4].values.push_back(kd != 0.0 && kp != 0.0 ? quantity(kd / kp, "s")
                                                       : Value("none", Tone::quiet));
    columns[5].values.push_back(kd != 0.0 ? quantity(loop.pid->derivative_time_constant, "s")
                                          : Value("none", Tone::quiet));
  }
  Section section{"pid", "PID gains", {told(result, std::move(columns))}};
  section.blocks.push_back(
      Paragraph{result.job.period || result.loops.front().period()
                    ? "u = Kp e + Ki T Σ e + Kd (change of the filtered e per sample)"
                    : "u = Kp e + Ki ∫ e dt + Kd d/dt of e behind the filter 1/(τ s + 1)",
                Tone::quiet});
  return section;
}

/// What a step of load at the plant's input does.
Section load_section(const LoopResult& result) {
  std::vector<Column> columns{
      {"largest deviation"}, {"at"}, {"recovered after"}, {"∫ e dt"}, {"∫ |e| dt"}};
  for (const LoopFindings& loop : result.loops) {
    const LoadResponse load = loop.pid->load.value_or(LoadResponse{});
    columns[0].values.push_back(quantity(load.peak, ""));
    columns[1].values.push_back(quantity(load.peak_time, "s"));
    columns[2].values.push_back(or_none(load.recovery_time, "s"));
    columns[3].values.push_back(quantity(load.integral, "s"));
    columns[4].values.push_back(quantity(load.absolute_integral, "s"));
  }
  return {"load", "After a step of load at the plant's input", {told(result, std::move(columns))}};
}

Section response_section(const LoopResult& result) {
  const bool closed =
      result.job.closed || result.job.view == sisotool || result.job.view == pidtune;
  Section section{"response",
                  result.job.view == LoopView::impulse ? "Impulse response"
                  : closed                             ? "Step response of the closed loop"
                                                       : "Step response",
                  {}};
  if (result.job.view == LoopView::impulse) {
    std::vector<Column> columns{{"largest"}, {"after"}};
    for (const LoopFindings& loop : result.loops) {
      const auto& y = loop.response->value;
      const auto largest = std::max_element(
          y.begin(), y.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
      columns[0].values.push_back(quantity(*largest, "", 5));
      columns[1].values.push_back(
          quantity(loop.response->time[static_cast<std::size_t>(largest - y.begin())], "s"));
    }
    section.blocks.push_back(told(result, std::move(columns)));
    return section;
  }
  std::vector<Column> columns{{"final value"}, {"rise 10–90 %"}, {"settled in 2 %"}, {"overshoot"},
                              {"undershoot"},  {"peak"},         {"peak at"}};
  bool restless = false;
  bool returns = false;
  bool slow = false;
  for (const LoopFindings& loop : result.loops) {
    const classical::StepMetrics m = loop.response->metrics.value_or(
        classical::StepMetrics{.final_value = std::numeric_limits<double>::quiet_NaN()});
    const bool ends = std::isfinite(m.final_value);
    restless = restless || !ends;
    returns = returns || (m.final_value == 0.0 && !m.settling_time);
    slow = slow || (ends && m.final_value != 0.0 && !m.settling_time);
    columns[0].values.push_back(std::isnan(m.final_value) ? Value("none", Tone::quiet)
                                                          : quantity(m.final_value, "", 5));
    columns[1].values.push_back(or_none(m.rise_time, "s"));
    columns[2].values.push_back(or_none(m.settling_time, "s"));
    columns[3].values.push_back(or_none(m.overshoot, "%", 100.0));
    columns[4].values.push_back(or_none(m.undershoot, "%", 100.0));
    columns[5].values.push_back(or_none(m.peak, ""));
    columns[6].values.push_back(or_none(m.peak_time, "s"));
  }
  section.blocks.push_back(told(result, std::move(columns)));
  if (restless) {
    section.blocks.push_back(
        Paragraph{"What does not settle (unstable, or with an integrator) has no final value, and "
                  "nothing that hangs on it.",
                  Tone::quiet});
  }
  if (returns) {
    section.blocks.push_back(
        Paragraph{"What ends at 0 has no shares of its final value: no rise, settling, overshoot.",
                  Tone::quiet});
  }
  if (slow) {
    section.blocks.push_back(Paragraph{
        "What still swings after half a million steps is not followed until it has settled.",
        Tone::quiet});
  }
  return section;
}

Section system_section(const LoopResult& result) {
  Section section{"system", "What was asked about", {}};
  Table table{.header = {"transfer function", "zeros", "poles", "dead time"},
              .words = {0, 1, 2},
              .wide_column = 2};
  for (const LoopFindings& loop : result.loops) {
    const auto roots = [](const Eigen::VectorXcd& all) {
      std::vector<std::string> texts;
      for (const std::complex<double>& root : all) {
        if (root.imag() >= 0.0) {
          texts.push_back(text::complex_number(root, 5));
        }
      }
      constexpr std::size_t most = 12;
      if (texts.size() > most) {
        texts.resize(most);
        texts.push_back("…");
      }
      return texts.empty() ? std::string("none") : fmt::format("{}", fmt::join(texts, ", "));
    };
    if (loop.rational() != nullptr) {
      table.rows.push_back({short_name(loop), roots(loop.zeros), roots(loop.poles),
                            quantity(loop.delays().empty() ? 0.0 : loop.delays().front(), "s")});
      continue;
    }
    std::vector<std::string> delays;
    for (const double delay : loop.delays()) {
      delays.push_back(text::seconds(delay));
    }
    table.rows.push_back({short_name(loop), Value("not counted", Tone::quiet),
                          "rightmost " + roots(loop.poles), text::enumerate(delays)});
  }
  section.blocks.push_back(std::move(table));
  Facts facts;
  if (!result.job.compensator.empty()) {
    facts.add("compensator", result.job.compensator, Tone::plain);
  }
  if (result.job.gain != 1.0) {
    facts.add("gain k", quantity(result.job.gain, "", 6));
  }
  if (const auto& period = result.loops.front().period()) {
    facts.add("sample period", text::seconds(period->si()), Tone::plain);
  }
  if (!facts.facts.empty()) {
    section.blocks.push_back(std::move(facts));
  }
  return section;
}

/// Whether the loop will do, in a line.
Verdict verdict_of(const LoopResult& result) {
  const LoopFindings& first = result.loops.front();
  Verdict verdict;
  if (result.loops.size() > 1) {
    if (first.margins) {
      const auto stable =
          static_cast<std::size_t>(std::count_if(result.loops.begin(), result.loops.end(),
                                                 [](const auto& l) { return l.margins->stable; }));
      verdict.line = fmt::format("{} of {} closed loops are stable", stable, result.loops.size());
      verdict.tone = stable == result.loops.size() ? Tone::good : Tone::caution;
    }
    return verdict;
  }
  if (first.margins) {
    const classical::LoopMargins& m = *first.margins;
    verdict.tone = m.stable ? Tone::good : Tone::bad;
    verdict.line = m.stable
                       ? fmt::format("The closed loop is stable: phase margin {}, gain margin {}",
                                     phase_margin(m).text, gain_margin(m).text)
                       : fmt::format("The closed loop is {}", stability_of(first).text);
    if (m.stable && m.sensitivity.value > 2.0) {
      verdict.add(Tone::caution,
                  fmt::format("the curve passes −1 at {} (1/max |S|), where 0.5 is usual",
                              number(1.0 / m.sensitivity.value, 3)));
    }
  } else if (first.locus) {
    verdict.line = fmt::format("Stable for k: {}", ranges_of(first.locus->stable_gains));
    verdict.tone = first.locus->stable_gains.empty() ? Tone::bad : Tone::good;
  } else if (first.response && first.response->metrics) {
    const classical::StepMetrics& m = *first.response->metrics;
    verdict.tone = m.settling_time ? Tone::good : Tone::caution;
    verdict.line =
        m.settling_time
            ? fmt::format("Ends at {}, settled after {}, overshoot {}", number(m.final_value),
                          text::seconds(*m.settling_time), text::percent(m.overshoot.value_or(0.0)))
        : m.final_value == 0.0 ? std::string("Ends at 0, where it began")
        : std::isfinite(m.final_value)
            ? fmt::format("Ends at {}, after very long swinging", number(m.final_value))
            : std::string("Does not settle");
  }
  return verdict;
}

std::string title_of(const LoopResult& result) {
  static constexpr std::array<std::string_view, 9> titles{
      "Bode plot",        "Nyquist curve", "Nichols plot", "Root locus", "Step response",
      "Impulse response", "Margins",       "Loop",         "PID gains"};
  const auto view = static_cast<std::size_t>(result.job.view);
  return result.loops.size() == 1
             ? fmt::format("{} of {}", titles[view], short_name(result.loops.front()))
             : fmt::format("{}: {} transfer functions", titles[view], result.loops.size());
}

Document document_of(const LoopResult& result) {
  Document document{.title = title_of(result), .verdict = verdict_of(result)};
  const LoopFindings& first = result.loops.front();
  document.sections.push_back(system_section(result));
  if (first.pid) {
    document.sections.push_back(pid_section(result));
  }
  if (first.locus) {
    document.sections.push_back(locus_section(result));
  }
  if (first.margins) {
    document.sections.push_back(margins_section(result));
  }
  if (first.nyquist) {
    document.sections.push_back(nyquist_section(result));
  }
  if (first.response) {
    document.sections.push_back(response_section(result));
  }
  if (first.pid && first.pid->load) {
    document.sections.push_back(load_section(result));
  }
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  return document;
}

}  // namespace

Answer answer_of(const LoopResult& result) {
  return {.schema = loop_schema,
          .json = to_json(result),
          .document = document_of(result),
          .figures = figures_of(result),
          .files = data_files(result)};
}

}  // namespace flyball::study
