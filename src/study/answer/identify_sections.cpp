#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"
#include "study/per_unit.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::FittedRun;
using identification::GainEstimate;
using identification::PreparedRun;
using identification::TestKind;
using text::count;
using text::in_digits_of;
using text::number;
using text::percent;
using text::seconds;
using text::with_half_width;

double largest_magnitude(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double value : values) {
    largest = std::max(largest, std::abs(value));
  }
  return largest;
}

double duration(const std::vector<double>& time) {
  return time.empty() ? 0.0 : time.back() - time.front();
}

/// How late a channel is; a negative delay in words.
std::string delay_text(double delay) {
  return delay < 0.0 ? seconds(-delay) + " ahead of the voltage in its row" : seconds(delay);
}

/// How often a channel has a new value, and in what steps.
std::string channel_text(double refresh, double row_period, double quantum,
                         const std::string& unit) {
  std::string text = refresh > 0.0 ? "a new value every " + seconds(refresh) : "recorded";
  if (row_period > 0.0 && refresh > 1.5 * row_period) {
    text += fmt::format(" (repeated over {} rows)", number(std::round(refresh / row_period)));
  }
  return quantum > 0.0 ? fmt::format("{}, steps of {} {}", text, number(quantum, 3), unit) : text;
}

Table runs_table(const IdentifyResult& result) {
  const std::string rate = result.unit + "/s";
  const std::vector<PreparedRun> shown = shown_runs(result);
  Table table;
  table.header = {"run",
                  "test",
                  "rows",
                  "time (s)",
                  "used (s)",
                  "voltage (V)",
                  "top speed (" + rate + ")",
                  "in the fit"};
  table.words = {1, 7};
  const auto cell = [](double value, const std::string& unit) {
    return quantity(value, unit, 3, /*shown=*/false);
  };
  constexpr std::array kinds{TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                             TestKind::dynamic_forward, TestKind::dynamic_reverse};
  for (const TestKind kind : kinds) {
    bool found = false;
    for (const PreparedRun& prepared : shown) {
      if (prepared.run.kind != kind) {
        continue;
      }
      found = true;
      const FittedRun* fitted = fitted_run(result, prepared.source);
      const bool used = fitted != nullptr && fitted->used;
      // A recorded velocity's largest value may be its noise.
      const std::vector<double>& speed =
          prepared.smoothed_velocity.empty() ? prepared.run.velocity : prepared.smoothed_velocity;
      Value state = used ? Value("yes", Tone::good) : Value("no", Tone::caution);
      if (prepared.run.left_out) {
        state = {"left out by hand", Tone::quiet};
      } else if (!prepared.moved) {
        state = {"did not move", Tone::bad};
      } else if (prepared.run.is_trimmed()) {
        state.text += ", trimmed by hand";
      }
      table.rows.push_back({fmt::to_string(prepared.source + 1), std::string(to_string(kind)),
                            fmt::to_string(prepared.run.time.size()),
                            cell(duration(prepared.run.time), "s"),
                            fitted != nullptr ? cell(duration(fitted->time), "s") : "",
                            cell(largest_magnitude(prepared.run.voltage), "V"),
                            cell(largest_magnitude(speed), rate), state});
    }
    if (!found) {
      table.rows.push_back(
          {"", std::string(to_string(kind)), "0", "", "", "", "", Value("missing", Tone::caution)});
    }
  }
  return table;
}

std::string interval_text(const GainEstimate& gain) {
  const double half = 0.5 * (gain.interval[1] - gain.interval[0]);
  return fmt::format("{} to {}", in_digits_of(gain.interval[0], half),
                     in_digits_of(gain.interval[1], half));
}

Table gains_table(const FeedforwardFit& fit, bool per_unit) {
  const std::string speed = fit.unit + "/s";
  const std::string V = per_unit ? "p.u." : "V";
  Table table;
  table.header = {"gain", "value",    "95 % interval",
                  "unit", "one-step", (per_unit ? V : "volts") + " it takes to"};
  table.words = {0, 3, 5};
  const bool has = fit.one_step.has_value();
  const auto one = fit.one_step.value_or(identification::OneStepFit{});
  table.rows.push_back(gain_row("kS", fit.kS, V, one.kS, has, "overcome friction"));
  table.rows.push_back(
      gain_row("kV", fit.kV, V + "·s/" + fit.unit, one.kV, has, "hold a speed of 1 " + speed));
  table.rows.push_back(
      gain_row("kA", fit.kA, V + "·s²/" + fit.unit, one.kA, has, "speed up by 1 " + speed + "²"));
  if (fit.kG) {
    const bool arm = fit.mechanism == mechanisms::MechanismKind::arm;
    table.rows.push_back(
        gain_row("kG", *fit.kG, V, one.kG, has, arm ? "hold the arm level" : "hold it up"));
  }
  if (fit.gravity_with_friction) {
    table.rows.push_back(gain_row(fit.in_reverse ? "kG − kS" : "kG + kS",
                                  *fit.gravity_with_friction, V, 0.0, false,
                                  fit.in_reverse ? "let it down" : "move it up"));
  }
  if (fit.angle_offset) {
    table.rows.push_back(gain_row("offset", *fit.angle_offset, "rad", one.angle_offset, has,
                                  "(true angle − measured)"));
  }
  term_rows(table, "", fit);
  return table;
}

}  // namespace

std::vector<Value> gain_row(const std::string& name, const GainEstimate& gain,
                            const std::string& unit, double one_step, bool has_one_step,
                            const std::string& meaning) {
  std::vector<Value> row{name};
  if (gain.determined) {
    Value& value =
        row.emplace_back(with_half_width(gain.value, 0.5 * (gain.interval[1] - gain.interval[0])));
    value.number = gain.value;
    value.unit = unit;
    row.emplace_back(interval_text(gain));
  } else {
    row.emplace_back("not determined", Tone::caution);
    row.emplace_back(std::isfinite(gain.upper_bound) ? "below " + number(gain.upper_bound, 3) : "",
                     Tone::caution);
  }
  row.emplace_back(unit);
  row.emplace_back(has_one_step ? number(one_step, 4) : "", Tone::quiet);
  row.emplace_back(meaning);
  return row;
}

void term_rows(Table& table, const std::string& mode, const FeedforwardFit& fit) {
  for (const identification::ModelTerm& term : fit.terms) {
    std::string meaning = fmt::format("({} V at most in the log)", number(term.largest, 2));
    if (term.name == "current_limit") {
      meaning = "(resistance times the limit)";
    } else if (term.name == "sag") {
      meaning = "(resistance of battery and wires over the motors')";
    } else if (term.name == "backlash") {
      meaning = "(taken up at the start of a step)";
    } else if (term.name == "friction_along_travel") {
      meaning = "(at most, about kS)";
    }
    std::string name = term.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    table.rows.push_back(gain_row(name + mode, term.value, term.unit, 0.0, false, meaning));
  }
}

const FittedRun* fitted_run(const IdentifyResult& result, std::size_t source) {
  if (result.report.fit) {
    for (const FittedRun& run : result.report.fit->runs) {
      if (run.source == source) {
        return &run;
      }
    }
  }
  return nullptr;
}

std::vector<PreparedRun> shown_runs(const IdentifyResult& result) {
  std::vector<PreparedRun> runs = result.report.prepared.runs;
  if (runs.empty()) {
    for (const identification::TestRun& run : result.source.recording.runs) {
      PreparedRun shown;
      shown.run = run;
      shown.source = runs.size();
      shown.moved = true;  // not looked at
      runs.push_back(std::move(shown));
    }
  }
  return runs;
}

Section data_section(const IdentifyResult& result) {
  if (result.drive) {
    return drive_data(result);
  }
  const identification::PreparedRecording& data = result.report.prepared;
  const std::string rate = result.unit + "/s";
  Section section{"data", "Data", {}};
  Facts facts;
  facts.add("log",
            result.source.path +
                (result.source.format.empty() ? "" : fmt::format(" ({})", result.source.format)));
  facts.add(
      "mechanism",
      fmt::format("{}{}, position in {}", kind_of(result),
                  result.source.subject.empty() ? "" : fmt::format(" “{}”", result.source.subject),
                  result.unit));
  std::size_t rows = 0;
  const std::vector<PreparedRun> runs = shown_runs(result);
  for (const PreparedRun& run : runs) {
    rows += run.run.time.size();
  }
  std::string size = count(runs.size(), "run") + ", " + count(rows, "row");
  if (data.row_period > 0.0) {
    size += ", one every " + seconds(data.row_period);
  }
  facts.add("size", size);
  if (runs.size() > most_pictured) {
    facts.add("pictures", fmt::format("of {} runs: the first {}, and the {} whose simulation is "
                                      "furthest from what was measured; the data are of all",
                                      most_pictured, most_pictured / 2, most_pictured / 2));
  }
  if (data.has_position) {
    facts.add("position", channel_text(data.position_refresh_period, data.row_period,
                                       data.position_quantum, result.unit));
  } else if (!data.runs.empty()) {
    facts.add("position", "not recorded", Tone::caution);
  }
  if (data.has_velocity) {
    facts.add("velocity", channel_text(data.velocity_refresh_period, data.row_period,
                                       data.velocity_quantum, rate));
  } else if (!data.runs.empty()) {
    facts.add("velocity", "not recorded; derived from the position", Tone::caution);
  }
  if (!data.runs.empty()) {
    facts.add("top speed", quantity(data.top_speed, rate));
  }
  if (result.report.fit) {
    const FeedforwardFit& fit = *result.report.fit;
    if (data.has_position) {
      facts.add("position delay", delay_text(fit.position_delay));
    }
    facts.add("velocity delay",
              fmt::format("{}, with half of its averaging over {}", delay_text(fit.velocity_delay),
                          seconds(fit.averaging_width)));
    if (data.has_position && data.has_velocity) {
      facts.add("velocity scale",
                fmt::format("{} of the position's derivative", number(fit.velocity_scale, 4)));
    }
    facts.add("noise",
              data.has_position
                  ? fmt::format("{} {} (velocity), {} {} (position)", number(fit.velocity_noise, 3),
                                rate, number(fit.position_noise, 3), result.unit)
                  : fmt::format("{} {} (velocity)", number(fit.velocity_noise, 3), rate));
  }
  section.blocks.emplace_back(std::move(facts));
  section.blocks.emplace_back(runs_table(result));
  return section;
}

Section gains_section(const IdentifyResult& result) {
  if (result.drive) {
    return drive_gains(result);
  }
  Section section{"gains", "Gains", {}};
  if (!result.report.fit) {
    section.blocks.emplace_back(
        Paragraph{"No gains: " + to_string(result.report.fit.error()) + ".", Tone::bad});
    section.blocks.emplace_back(Paragraph{
        "The log is shown as it is; record it again as the sentence above says.", Tone::plain});
    return section;
  }
  const FeedforwardFit& fit = *result.report.fit;
  const bool per_unit = is_per_unit(result);
  section.blocks.emplace_back(gains_table(fit, per_unit));
  if (per_unit) {
    section.blocks.emplace_back(
        Paragraph{"p.u. is one of what was recorded as the voltage. Of a duty cycle it is the "
                  "battery's voltage: with --voltage-scale 12 the gains are in volts. If it was "
                  "volts, read V.",
                  Tone::caution});
  }
  if (!fit.kA.determined) {
    section.blocks.emplace_back(Paragraph{
        fmt::format("kA is not determined, below {} V·s²/{} (95 %): {}. The design takes the "
                    "velocity to follow the voltage at once (Theorem 14.3.2).",
                    number(fit.kA.upper_bound, 3), fit.unit, fit.kA.reason),
        Tone::caution});
  }
  const auto explain = [&](const char* name, const GainEstimate& gain) {
    if (!gain.determined) {
      section.blocks.emplace_back(
          Paragraph{fmt::format("{} is not determined: {}.", name, gain.reason), Tone::caution});
    }
  };
  if (fit.gravity_with_friction) {
    section.blocks.emplace_back(
        Paragraph{"kS and kG are not determined: " + fit.kS.reason +
                      ". A design takes all of it for gravity: the way up and holding are right.",
                  Tone::caution});
  } else {
    explain("kS", fit.kS);
    if (fit.kG) {
      explain("kG", *fit.kG);
    }
  }
  explain("kV", fit.kV);
  if (fit.angle_offset) {
    explain("The angle offset", *fit.angle_offset);
  }
  Facts quality;
  quality.add("R²", fmt::format("{} of the velocity, simulated in free run from the recorded "
                                "voltage",
                                number(fit.r_squared, 4)));
  quality.add("NRMSE",
              fmt::format("{} of the velocity's standard deviation", percent(fit.velocity_nrmse)));
  quality.add("fit", fmt::format("output error, {} in {}", count(fit.residuals, "residual"),
                                 count(static_cast<std::size_t>(std::max(0, fit.iterations)),
                                       "iteration")));
  if (fit.one_step) {
    quality.add("one-step",
                fmt::format("the regression of x(k+1) on x(k) and u(k), R² {} with T = {}; noise "
                            "and repeated rows bias it: shown for comparison, not used",
                            number(fit.one_step->r_squared, 4), seconds(fit.one_step->period)),
                Tone::quiet);
  }
  section.blocks.emplace_back(std::move(quality));
  return section;
}

}  // namespace flyball::study
