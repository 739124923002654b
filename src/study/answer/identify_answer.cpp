#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <flyball/study/project.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/rules_of_thumb.hpp"
#include "study/per_unit.hpp"

namespace flyball::study {

namespace {

using identification::GainEstimate;

/// @param volts  What the gains are in instead of volts.
void write_gains(JsonWriter& json, const identification::FeedforwardFit& fit,
                 std::string_view volts) {
  const std::string V(volts);
  json.object("gains", [&] {
    write_gain(json, "kS", fit.kS, V);
    write_gain(json, "kV", fit.kV, fmt::format("{}·s/{}", V, fit.unit));
    write_gain(json, "kA", fit.kA, fmt::format("{}·s²/{}", V, fit.unit));
    if (fit.kG) {
      write_gain(json, "kG", *fit.kG, V);
    }
    if (fit.gravity_with_friction) {
      write_gain(json, fit.in_reverse ? "kG_minus_kS" : "kG_plus_kS", *fit.gravity_with_friction,
                 V);
    }
    if (fit.angle_offset) {
      write_gain(json, "angle_offset", *fit.angle_offset, "rad");
    }
  });
}

void write_terms(JsonWriter& json, const identification::FeedforwardFit& fit,
                 std::string_view volts) {
  if (!fit.terms.empty()) {
    json.object("terms", [&] {
      for (const identification::ModelTerm& term : fit.terms) {
        const bool of_volts = term.unit.starts_with('V');
        write_gain(json, term.name, term.value,
                   of_volts ? std::string(volts) + term.unit.substr(1) : term.unit);
      }
    });
  }
}

void write_fit(JsonWriter& json, const identification::FeedforwardFit& fit,
               std::string_view volts) {
  json.add("mechanism", to_string(fit.mechanism));
  json.add("unit", fit.unit);
  write_gains(json, fit, volts);
  write_terms(json, fit, volts);
  json.object("fit", [&] { write_quality(json, fit); });
  if (fit.one_step) {
    json.object("one_step_regression", [&] {
      json.add({{"kS", fit.one_step->kS},
                {"kV", fit.one_step->kV},
                {"kA", fit.one_step->kA},
                {"r_squared", fit.one_step->r_squared}});
      if (fit.kG) {
        json.add("kG", fit.one_step->kG);
      }
    });
  }
}

}  // namespace

void write_gains(JsonWriter& json, const identification::FeedforwardFit& fit) {
  write_gains(json, fit, "V");
}

void write_fit(JsonWriter& json, const identification::FeedforwardFit& fit) {
  write_fit(json, fit, "V");
}

namespace {

void write_source(JsonWriter& json, const recording::LoadedRecording& source) {
  json.object("log", [&] {
    json.add("path", source.path);
    json.add("format", source.format);
    json.add("subject", source.subject);
    const auto list = [&](const auto& runs) {
      std::size_t rows = 0;
      for (const auto& run : runs) {
        rows += run.time.size();
      }
      json.add("rows", rows);
      json.list("runs", runs, [&](const auto& run) {
        json.object([&] {
          json.add("test", to_string(run.kind));
          json.add("rows", run.time.size());
          json.add("duration", run.time.empty() ? 0.0 : run.time.back() - run.time.front());
          if constexpr (requires { run.left_out; }) {
            if (run.is_trimmed()) {
              json.add("used_from", run.from);
              json.add("used_to", std::isfinite(run.to) ? std::optional(run.to) : std::nullopt);
            }
            if (run.left_out) {
              json.add("left_out", true);
            }
          }
        });
      });
    };
    source.drive ? list(source.drive->runs) : list(source.recording.runs);
  });
}

}  // namespace

void write_gain(JsonWriter& json, std::string_view name, const GainEstimate& gain,
                const std::string& unit) {
  json.object(name, [&] {
    json.add("value", gain.determined ? std::optional(gain.value) : std::nullopt);
    json.add("determined", gain.determined);
    json.add("unit", unit);
    if (gain.determined) {
      json.add("standard_error", gain.standard_error);
      json.add("interval", std::span<const double>(gain.interval));
    } else {
      json.add("upper_bound", gain.upper_bound);
      json.add("reason", gain.reason);
    }
  });
}

void write_terms(JsonWriter& json, const identification::FeedforwardFit& fit) {
  write_terms(json, fit, "V");
}

void write_quality(JsonWriter& json, const identification::FeedforwardFit& fit) {
  json.add({{"r_squared", fit.r_squared},
            {"velocity_nrmse", fit.velocity_nrmse},
            {"position_delay", fit.position_delay},
            {"velocity_delay", fit.velocity_delay},
            {"averaging_width", fit.averaging_width}});
  json.add("iterations", fit.iterations);
}

void write_identification(JsonWriter& json, const IdentifyResult& result) {
  json.object([&] {
    json.add("schema", "flyball.identify/1");
    if (result.drive && result.drive->fit) {
      write_drive(json, result);
    } else if (result.report.fit) {
      write_fit(json, *result.report.fit, volts_of(result));
    } else {
      json.add("error", result.report.fit.error());
    }
    write_source(json, result.source);
    json.add("diagnostics", result.diagnostics());
  });
}

std::string to_json(const IdentifyResult& result) {
  JsonWriter json;
  write_identification(json, result);
  return std::move(json).text();
}

void add_wiring(Verdict& verdict, const std::vector<Diagnostic>& diagnostics) {
  constexpr std::array codes{"inverted_encoder", "sign_mismatch", "swapped_sides", "gyro_clockwise",
                             "gyro_rate"};
  for (const Diagnostic& found : diagnostics) {
    if (std::ranges::find(codes, found.code) != codes.end()) {
      verdict.add(Tone::caution, found.message.substr(0, found.message.find(". ")));
    }
  }
}

void add_warnings(Verdict& verdict, const std::vector<Diagnostic>& diagnostics,
                  std::string_view about) {
  const auto warnings =
      std::count_if(diagnostics.begin(), diagnostics.end(),
                    [](const Diagnostic& d) { return d.severity != Severity::info; });
  if (warnings > 0) {
    verdict.add(Tone::caution,
                fmt::format("{} {}, listed below",
                            text::count(static_cast<std::size_t>(warnings), "warning"), about));
  }
}

std::string title_of(const std::string& kind, const std::string& subject, const std::string& path) {
  std::string title = text::capitalized(kind);
  if (!subject.empty()) {
    title += fmt::format(" “{}”", subject);
  }
  const std::size_t slash = path.find_last_of('/');
  const std::string file = slash == std::string::npos ? path : path.substr(slash + 1);
  return file.empty() ? title : title + " from " + file;
}

std::string kind_of(const IdentifyResult& result) {
  return result.drive       ? "drivetrain"
         : result.mechanism ? std::string(to_string(*result.mechanism))
                            : "mechanism";
}

Verdict verdict_of(const IdentifyResult& result) {
  if (result.drive) {
    return drive_verdict(result);
  }
  if (!result.report.fit) {
    return {
        Tone::bad, "No gains can be taken from this log.", {to_string(result.report.fit.error())}};
  }
  const identification::FeedforwardFit& fit = *result.report.fit;
  Verdict verdict;
  std::string assumed;
  for (const Diagnostic& found : result.diagnostics()) {
    const bool unit = found.code == "unit_assumed";
    const bool kind = found.code == "mechanism_assumed" || found.code == "mechanism_contradicted";
    const bool volts = found.code == "duty_cycle";
    if (unit || kind || volts) {
      verdict.add(Tone::caution, found.message);
      assumed += (assumed.empty() ? "" : " and ") + std::string(unit    ? "the unit"
                                                                : volts ? "the voltage's unit"
                                                                        : "the mechanism");
    }
  }
  const bool several = assumed.find(" and ") != std::string::npos;
  const auto undetermined = [&](const char* name, const identification::GainEstimate& gain) {
    if (!gain.determined) {
      verdict.add(Tone::caution, fmt::format("the log does not determine {}", name));
    }
  };
  if (fit.gravity_with_friction) {
    verdict.add(Tone::caution, fit.kS.reason);
  } else {
    undetermined("kS", fit.kS);
    if (fit.kG) {
      undetermined("kG", *fit.kG);
    }
  }
  undetermined("kV", fit.kV);
  undetermined("kA; the design does without it", fit.kA);
  if (fit.r_squared < poor_fit) {
    verdict.add(Tone::caution,
                fmt::format("the simulated velocity explains only {} of the measured one: "
                            "compare them before you trust the gains",
                            text::percent(std::max(0.0, fit.r_squared))));
  }
  add_wiring(verdict, result.diagnostics());
  add_warnings(verdict, result.diagnostics(), "about the data");
  verdict.line = verdict.tone == Tone::good
                     ? fmt::format(
                           "The gains can be used: the model explains {} of the measured "
                           "velocity.",
                           text::percent(fit.r_squared))
                 : assumed.empty() ? "The gains can be used with care."
                                   : fmt::format("The gains can be used once {} {} confirmed.",
                                                 assumed, several ? "are" : "is");
  return verdict;
}

Answer answer_of(const IdentifyResult& result) {
  Answer answer{.schema = "flyball.identify/1", .json = to_json(result)};
  Document& document = answer.document;
  document.title = title_of(kind_of(result), result.source.subject, result.source.path);
  document.verdict = verdict_of(result);
  document.sections = {data_section(result), gains_section(result), next_steps(result, nullptr),
                       diagnostics_section(result.diagnostics())};
  document.origins.add("log", result.source.path);
  answer.figures = figures_of(result);
  if (result.report.fit) {
    answer.files.push_back({"gains.toml", gains_toml(result)});
  } else if (!result.drive || !result.drive->fit) {
    answer.refusal = result.report.fit.error();
  }
  append(answer.files, data_files(result));
  return answer;
}

}  // namespace flyball::study
