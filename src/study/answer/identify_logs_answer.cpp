// What several logs of one mechanism say together.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <flyball/study/identify_logs.hpp>
#include <flyball/study/project.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::FeedforwardFit;
using identification::GainComparison;
using identification::GainEstimate;
using text::with_half_width;

constexpr const char* identify_logs_schema = "flyball.identify_logs/1";

double half_width(const GainEstimate& gain) {
  return 0.5 * (gain.interval[1] - gain.interval[0]);
}

/// Of a mechanism or, in its place, a drivetrain.
std::optional<double> r_squared(const LogOutcome& log) {
  if (log.fit) {
    return log.fit->r_squared;
  }
  if (!log.drive) {
    return std::nullopt;
  }
  const auto of = [](const std::optional<FeedforwardFit>& mode) {
    return mode ? mode->r_squared : 1.0;
  };
  return std::min(of(log.drive->linear), of(log.drive->angular));
}

/// A gain of a fit by its name, or null.
const GainEstimate* named(const FeedforwardFit& fit, std::string_view name) {
  const std::array<std::pair<std::string_view, const GainEstimate*>, 5> all{
      {{"kS", &fit.kS},
       {"kV", &fit.kV},
       {"kA", &fit.kA},
       {"kG", fit.kG ? &*fit.kG : nullptr},
       {"angle_offset", fit.angle_offset ? &*fit.angle_offset : nullptr}}};
  for (const auto& [known, gain] : all) {
    if (known == name) {
      return gain;
    }
  }
  return nullptr;
}

Value cell_of(const LogOutcome& log, std::string_view name) {
  if (!log.has_gains()) {
    return {"", Tone::quiet};
  }
  const GainEstimate* gain = log.drive ? drive_gain(*log.drive, name) : named(*log.fit, name);
  if (gain == nullptr || !gain->determined) {
    return {gain == nullptr ? "not excited" : "not determined", Tone::caution};
  }
  Value value = with_half_width(gain->value, half_width(*gain));
  value.number = gain->value;
  return value;
}

/// A row a log, a column a gain, each with half of its 95 % interval.
Table logs_table(const IdentifyLogsResult& result) {
  Table table;
  table.caption = "Each log by itself, with half of its 95 % interval";
  table.header = {"log", "rows"};
  table.words = {0};
  for (const GainComparison& gain : result.gains) {
    table.header.push_back(fmt::format("{} ({})", gain.name, gain.unit));
  }
  table.header.emplace_back("R²");
  for (const LogOutcome& log : result.logs) {
    std::vector<Value> row{log.path, fmt::to_string(log.rows)};
    for (const GainComparison& gain : result.gains) {
      row.push_back(cell_of(log, gain.name));
    }
    const auto explained = r_squared(log);
    row.push_back(explained ? Value(text::number(*explained, 4))
                            : Value("left out", Tone::caution));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table scatter_table(const IdentifyLogsResult& result) {
  Table table;
  table.caption = "Whether the logs agree";
  table.header = {"gain", "mean of the logs",   "scatter beyond their intervals",
                  "unit", "largest difference", "verdict"};
  table.words = {0, 3, 5};
  for (const GainComparison& gain : result.gains) {
    table.rows.push_back(
        {gain.name, text::number(gain.mean, 5),
         gain.between > 0.0 ? fmt::format("{} ({})", text::number(gain.between, 2),
                                          text::percent(gain.between / std::abs(gain.mean)))
                            : "none",
         gain.unit, fmt::format("{} standard errors", text::number(gain.largest_z, 2)),
         gain.agrees() ? Value("agree", Tone::good) : Value("differ", Tone::caution)});
  }
  return table;
}

void write_comparison(JsonWriter& json, const IdentifyLogsResult& result,
                      const GainComparison& gain) {
  json.object([&] {
    json.add("gain", gain.name);
    json.add("unit", gain.unit);
    std::vector<double> logs;
    for (const std::size_t log : gain.logs) {
      logs.push_back(static_cast<double>(result.used[log]));
    }
    json.add("logs", std::span<const double>(logs));
    json.add({{"mean", gain.mean},
              {"standard_error", gain.standard_error},
              {"between", gain.between},
              {"ratio", gain.ratio},
              {"p_value", gain.p_value},
              {"largest_z", gain.largest_z}});
    json.add("agrees", gain.agrees());
    if (gain.outlier) {
      json.add("outlier", result.used[*gain.outlier]);
    }
  });
}

bool has_joint_gains(const IdentifyLogsResult& result) {
  return result.joint.drive ? result.joint.drive->fit.has_value()
                            : result.joint.report.fit.has_value();
}

/// Why there are no joint gains.
const Error& joint_refusal(const IdentifyLogsResult& result) {
  return result.joint.drive ? result.joint.drive->fit.error() : result.joint.report.fit.error();
}

Verdict verdict_of_logs(const IdentifyLogsResult& result) {
  Verdict verdict = verdict_of(result.joint);
  std::string differing;
  for (const GainComparison& gain : result.gains) {
    if (!gain.agrees()) {
      differing += (differing.empty() ? "" : ", ") + gain.name;
    }
  }
  if (!has_joint_gains(result)) {
    verdict.line = "The logs give no joint gains.";
    return verdict;
  }
  verdict.line +=
      result.gains.empty()
          ? std::string(" No gain is told by two of the logs, so that none is compared.")
      : differing.empty() ? fmt::format(" The {} logs agree.", result.used.size())
                          : fmt::format(" The logs do not agree on {}.", differing);
  return verdict;
}

}  // namespace

std::string to_json(const IdentifyLogsResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", identify_logs_schema);
    if (!has_joint_gains(result)) {
      json.add("error", joint_refusal(result));
    } else if (result.joint.drive) {
      write_drive(json, result.joint);
    } else {
      write_fit(json, *result.joint.report.fit);
    }
    json.add("repeats", result.repeats());
    json.list("comparisons", result.gains,
              [&](const GainComparison& gain) { write_comparison(json, result, gain); });
    json.list("logs", result.logs, [&](const LogOutcome& log) {
      json.object([&] {
        json.add("path", log.path);
        json.add("rows", log.rows);
        if (log.drive) {
          json.object("gains", [&] { write_drive_gains(json, *log.drive); });
        } else if (log.fit) {
          write_gains(json, *log.fit);
        } else {
          json.add("error", log.fit.error());
        }
        if (const auto explained = r_squared(log)) {
          json.add("r_squared", *explained);
        }
        json.add("diagnostics", log.diagnostics);
      });
    });
    json.add("diagnostics", result.joint.diagnostics());
  });
  return std::move(json).text();
}

Answer answer_of(const IdentifyLogsResult& result) {
  Answer answer{.schema = identify_logs_schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = title_of(kind_of(result.joint), "", result.joint.source.path);
  document.verdict = verdict_of_logs(result);
  Section repeats{"repeatability", "Repeatability", {}};
  repeats.blocks.emplace_back(logs_table(result));
  if (!result.gains.empty()) {
    repeats.blocks.emplace_back(scatter_table(result));
  }
  if (result.joint.drive) {
    repeats.blocks.emplace_back(
        Paragraph{"Gains of turning are compared per " + result.joint.unit +
                  " of a wheel's way; below, they are per radian where the trackwidth is known."});
  }
  document.sections = {std::move(repeats), gains_section(result.joint), data_section(result.joint),
                       diagnostics_section(result.joint.diagnostics())};
  for (const LogOutcome& log : result.logs) {
    document.origins.add("log", log.path);
  }
  answer.figures = figures_of(result.joint);
  if (!has_joint_gains(result)) {
    answer.refusal = joint_refusal(result);
  } else if (!result.joint.drive) {
    answer.files.push_back({"gains.toml", gains_toml(result.joint)});
  }
  append(answer.files, data_files(result.joint));
  return answer;
}

}  // namespace flyball::study
