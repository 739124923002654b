// What several logs of one mechanism say together.
#include <array>
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

constexpr const char* schema = "flyball.identify_logs/1";

double half_width(const GainEstimate& gain) {
  return 0.5 * (gain.interval[1] - gain.interval[0]);
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

Value cell_of(const GainEstimate* gain) {
  if (gain == nullptr || !gain->determined) {
    return {"not determined", Tone::caution};
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
      row.push_back(log.fit ? cell_of(named(*log.fit, gain.name)) : Value("", Tone::quiet));
    }
    row.push_back(log.fit ? Value(text::number(log.fit->r_squared, 4))
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

Verdict verdict_of_logs(const IdentifyLogsResult& result) {
  Verdict verdict = verdict_of(result.joint);
  std::string differing;
  for (const GainComparison& gain : result.gains) {
    if (!gain.agrees()) {
      differing += (differing.empty() ? "" : ", ") + gain.name;
    }
  }
  if (!result.joint.report.fit) {
    verdict.line = "The logs give no joint gains.";
    return verdict;
  }
  verdict.line += differing.empty() ? fmt::format(" The {} logs agree.", result.used.size())
                                    : fmt::format(" The logs do not agree on {}.", differing);
  return verdict;
}

}  // namespace

std::string to_json(const IdentifyLogsResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    if (result.joint.report.fit) {
      write_fit(json, *result.joint.report.fit);
    } else {
      json.add("error", result.joint.report.fit.error());
    }
    json.add("repeats", result.repeats());
    json.list("comparisons", result.gains,
              [&](const GainComparison& gain) { write_comparison(json, result, gain); });
    json.list("logs", result.logs, [&](const LogOutcome& log) {
      json.object([&] {
        json.add("path", log.path);
        json.add("rows", log.rows);
        if (log.fit) {
          write_gains(json, *log.fit);
          json.add("r_squared", log.fit->r_squared);
        } else {
          json.add("error", log.fit.error());
        }
        json.add("diagnostics", log.diagnostics);
      });
    });
    json.add("diagnostics", result.joint.diagnostics());
  });
  return std::move(json).text();
}

Answer answer_of(const IdentifyLogsResult& result) {
  Answer answer{.schema = schema, .json = to_json(result)};
  Document& document = answer.document;
  document.title = title_of(kind_of(result.joint), "", result.joint.source.path);
  document.verdict = verdict_of_logs(result);
  Section repeats{"repeatability", "Repeatability", {}};
  repeats.blocks.emplace_back(logs_table(result));
  repeats.blocks.emplace_back(scatter_table(result));
  document.sections = {std::move(repeats), gains_section(result.joint), data_section(result.joint),
                       diagnostics_section(result.joint.diagnostics())};
  for (const LogOutcome& log : result.logs) {
    document.origins.add("log", log.path);
  }
  answer.figures = figures_of(result.joint);
  if (result.joint.report.fit) {
    answer.files.push_back({"gains.toml", gains_toml(result.joint)});
  } else {
    answer.refusal = result.joint.report.fit.error();
  }
  append(answer.files, data_files(result.joint));
  return answer;
}

}  // namespace flyball::study
