// What is said of a drivetrain's log and of its gains.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::DriveFit;
using identification::DriveReport;
using identification::DriveRun;
using identification::FeedforwardFit;
using identification::GainEstimate;
using text::count;
using text::number;
using text::percent;
using text::seconds;

double largest_magnitude_of(const std::vector<double>& values) {
  double size = 0.0;
  for (const double value : values) {
    size = std::max(size, std::abs(value));
  }
  return size;
}

double turned(const std::vector<double>& heading) {
  return heading.empty() ? 0.0 : heading.back() - heading.front();
}

Table runs_table(const DriveReport& report) {
  const std::string rate = report.recording.unit + "/s";
  Table table;
  table.header = {"test",
                  "driven",
                  "rows",
                  "time (s)",
                  "left (V)",
                  "right (V)",
                  "left (" + rate + ")",
                  "right (" + rate + ")",
                  "turned (rad)",
                  "in the fit"};
  table.words = {0, 1, 9};
  const auto cell = [](double value, const std::string& unit) {
    return quantity(value, unit, 3, /*shown=*/false);
  };
  for (std::size_t i = 0; i < report.recording.runs.size(); ++i) {
    const DriveRun& run = report.recording.runs[i];
    const bool used = i < report.runs.size() && report.runs[i].used;
    const std::string driven(i < report.tests.size() ? to_string(report.tests[i]) : "");
    table.rows.push_back(
        {std::string(to_string(run.kind)), driven, fmt::to_string(run.time.size()),
         cell(run.time.empty() ? 0.0 : run.time.back() - run.time.front(), "s"),
         cell(largest_magnitude_of(run.left.voltage), "V"),
         cell(largest_magnitude_of(run.right.voltage), "V"),
         run.left.velocity.empty() ? Value("")
                                   : cell(largest_magnitude_of(run.left.velocity), rate),
         run.right.velocity.empty() ? Value("")
                                    : cell(largest_magnitude_of(run.right.velocity), rate),
         run.heading.empty() ? Value("") : cell(turned(run.heading), "rad"),
         used ? Value("yes", Tone::good) : Value("no", Tone::caution)});
  }
  return table;
}

/// Sensors as one of the modes sees them.
void sensor_facts(Facts& facts, const std::string& name, const FeedforwardFit& fit) {
  facts.add(name + " sensors",
            fmt::format("position {} old, velocity {} with half of its averaging over {}",
                        seconds(fit.position_delay), seconds(fit.velocity_delay),
                        seconds(fit.averaging_width)));
}

std::vector<Value> empty_row(const std::string& name, const std::string& unit,
                             const std::string& meaning) {
  std::vector<Value> row{name};
  row.emplace_back("not excited", Tone::caution);
  row.emplace_back("");
  row.emplace_back(unit);
  row.emplace_back("");
  row.emplace_back(meaning);
  return row;
}

/// kS, kV and kA of a mode.
void mode_rows(Table& table, const std::string& mode, const std::optional<FeedforwardFit>& fit,
               const std::string& unit, const GainEstimate* trackwidth, const std::string& moved) {
  const std::string rate = unit + "/s";
  const auto named = [&](const char* gain) { return fmt::format("{} {}", gain, mode); };
  if (!fit) {
    table.rows.push_back(empty_row(named("kV"), "V·s/" + unit, "hold a speed"));
    table.rows.push_back(empty_row(named("kA"), "V·s²/" + unit, "speed up"));
    return;
  }
  const auto in_unit = [&](const GainEstimate& gain) {
    return trackwidth == nullptr ? gain : identification::per_radian(gain, *trackwidth);
  };
  const double scale = trackwidth == nullptr ? 1.0 : 0.5 * trackwidth->value;
  const bool has = fit->one_step.has_value();
  const auto one = fit->one_step.value_or(identification::OneStepFit{});
  table.rows.push_back(
      gain_row(named("kS"), fit->kS, "V", one.kS, has, "overcome friction, " + moved));
  table.rows.push_back(gain_row(named("kV"), in_unit(fit->kV), "V·s/" + unit, scale * one.kV, has,
                                fmt::format("hold 1 {}", rate)));
  table.rows.push_back(gain_row(named("kA"), in_unit(fit->kA), "V·s²/" + unit, scale * one.kA, has,
                                fmt::format("speed up by 1 {}²", rate)));
  term_rows(table, " " + mode, *fit);
}

Table gains_table(const DriveFit& fit) {
  Table table;
  table.header = {"gain", "value", "95 % interval", "unit", "one-step", "volts it takes to"};
  table.words = {0, 3, 5};
  const bool width = fit.trackwidth && fit.trackwidth->determined;
  mode_rows(table, "linear", fit.linear, fit.unit, nullptr, "straight on");
  mode_rows(table, "angular", fit.angular, width ? "rad" : fit.unit,
            width ? &*fit.trackwidth : nullptr, "turning");
  if (fit.kS_left) {
    table.rows.push_back(gain_row("kS left", *fit.kS_left, "V", 0.0, false, "move the left side"));
    table.rows.push_back(
        gain_row("kS right", *fit.kS_right, "V", 0.0, false, "move the right side"));
  }
  if (fit.trackwidth) {
    table.rows.push_back(gain_row("trackwidth", *fit.trackwidth, "m", 0.0, false,
                                  "(between the wheels, as it turns)"));
  }
  return table;
}

std::string matrix_text(const Eigen::Matrix2d& M) {
  return fmt::format("[{}, {}; {}, {}]", number(M(0, 0), 5), number(M(0, 1), 5), number(M(1, 0), 5),
                     number(M(1, 1), 5));
}

}  // namespace

Section drive_data(const IdentifyResult& result) {
  const DriveReport& report = *result.drive;
  Section section{"data", "Data", {}};
  Facts facts;
  facts.add("log", fmt::format("{} ({})", result.source.path, result.source.format));
  facts.add(
      "mechanism",
      fmt::format("drivetrain{}, positions in {}",
                  result.source.subject.empty() ? "" : fmt::format(" “{}”", result.source.subject),
                  result.unit));
  std::size_t rows = 0;
  bool heading = false;
  for (const DriveRun& run : report.recording.runs) {
    rows += run.time.size();
    heading = heading || !run.heading.empty();
  }
  facts.add("size", count(report.recording.runs.size(), "run") + ", " + count(rows, "row"));
  facts.add("heading",
            heading ? Value("recorded") : Value("not recorded: no trackwidth", Tone::caution));
  if (report.fit && report.fit->linear) {
    sensor_facts(facts, "linear", *report.fit->linear);
  }
  if (report.fit && report.fit->angular) {
    sensor_facts(facts, "angular", *report.fit->angular);
  }
  section.blocks = {std::move(facts), runs_table(report)};
  return section;
}

Section drive_gains(const IdentifyResult& result) {
  Section section{"gains", "Gains", {}};
  if (!result.drive->fit) {
    section.blocks.emplace_back(
        Paragraph{"No gains: " + to_string(result.drive->fit.error()) + ".", Tone::bad});
    return section;
  }
  const DriveFit& fit = *result.drive->fit;
  section.blocks.emplace_back(gains_table(fit));
  const bool width = fit.trackwidth && fit.trackwidth->determined;
  section.blocks.emplace_back(Paragraph{
      fmt::format("Linear is half the sum of the sides' voltages over their mean speed, angular "
                  "half their difference (right less left) over {}.",
                  width ? "the robot's angular velocity"
                        : "half the difference of their speeds, as the trackwidth is not known"),
      Tone::plain});
  const auto explain = [&](const std::string& mode, const std::optional<FeedforwardFit>& of) {
    if (of && !of->kA.determined) {
      section.blocks.emplace_back(Paragraph{
          fmt::format("kA {} is not determined: {}.", mode, of->kA.reason), Tone::caution});
    }
  };
  explain("linear", fit.linear);
  explain("angular", fit.angular);
  Facts quality;
  const auto tell = [&](const std::string& mode, const std::optional<FeedforwardFit>& of) {
    if (of) {
      quality.add(mode, fmt::format("R² {}, NRMSE {} of the velocity, simulated in free run from "
                                    "the recorded voltages",
                                    number(of->r_squared, 4), percent(of->velocity_nrmse)));
    }
  };
  tell("linear", fit.linear);
  tell("angular", fit.angular);
  if (fit.linear && fit.angular) {
    quality.add("turning", fmt::format("takes {} times the volts of driving straight on at the "
                                       "same wheel speed",
                                       number(fit.angular->kV.value / fit.linear->kV.value, 3)));
  }
  if (const auto gains = fit.gains()) {
    if (const auto drive = mechanisms::differential_drive(*gains)) {
      quality.add("A", matrix_text(drive->A) + " of [vl, vr] (Theorem 14.4.1)");
      quality.add("B", matrix_text(drive->B));
    }
  }
  section.blocks.emplace_back(std::move(quality));
  return section;
}

}  // namespace flyball::study
