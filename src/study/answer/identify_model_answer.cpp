#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <flyball/io/csv.hpp>
#include <flyball/study/identify_model.hpp>

#include "core/wording.hpp"
#include "study/answer/drawing.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::ExperimentRun;
using identification::FittedParameter;
using identification::OutputFit;
using identification::RunFit;
using optimization::Bound;

std::string interval_of(const FittedParameter& one) {
  const auto end = [](double value, bool open) {
    return !std::isfinite(value) ? std::string("…")
                                 : text::number(value) + (open ? " (bound)" : "");
  };
  return fmt::format("{} … {}", end(one.low, one.low_is_open), end(one.high, one.high_is_open));
}

Tone tone_of(const FittedParameter& one) {
  return one.bound == Bound::lower || one.bound == Bound::upper ? Tone::caution
         : !std::isfinite(one.standard_error)                   ? Tone::bad
                                                                : Tone::plain;
}

Table parameter_table(const ModelIdentification& result) {
  Table table;
  table.header = {"parameter", "value", "unit",
                  fmt::format("{} interval", text::percent(result.confidence))};
  table.words = {0, 2, 3};
  for (const FittedParameter& one : result.fit.parameters) {
    table.rows.push_back({one.name, quantity(one.value, one.unit, 5, false), one.unit,
                          Value(interval_of(one), tone_of(one))});
  }
  return table;
}

Table run_table(const ModelIdentification& result) {
  Table table;
  table.header = {"run", "output", "samples", "error (rms)", "fit"};
  table.words = {0, 1};
  const std::vector<Coordinate>& outputs = result.fit.model.names().outputs;
  const auto add = [&](const std::vector<RunFit>& fits, const std::vector<ExperimentRun>& runs) {
    for (std::size_t r = 0; r < fits.size(); ++r) {
      for (std::size_t p = 0; p < outputs.size(); ++p) {
        const OutputFit& one = fits[r].outputs[p];
        table.rows.push_back({fits[r].name, outputs[p].name, fmt::to_string(runs[r].time.size()),
                              quantity(one.rmse, outputs[p].unit), text::percent(one.fit)});
      }
    }
  };
  add(result.fit.runs, result.runs);
  add(result.validation, result.validation_runs);
  return table;
}

Section model_section(const ModelIdentification& result) {
  const identification::PredictionErrorFit& fit = result.fit;
  Section section{"model", "Model", {}};
  section.blocks.emplace_back(parameter_table(result));
  section.blocks.emplace_back(run_table(result));
  Facts facts;
  const std::vector<Coordinate>& outputs = fit.model.names().outputs;
  for (std::size_t p = 0; p < outputs.size(); ++p) {
    const identification::Whiteness& found = fit.whiteness[p];
    facts.add("residuals of " + outputs[p].name,
              found.is_white() ? fmt::format("white (p = {})", text::number(found.p_value, 2))
                               : fmt::format("not white (p = {}), correlated over {}",
                                             text::number(found.p_value, 2),
                                             text::count(found.correlated_lags, "sample")),
              found.is_white() ? Tone::good : Tone::caution);
  }
  facts.add("search",
            fmt::format("{} after {}, optimality {}", to_string(fit.minimum.stop),
                        text::count(static_cast<std::size_t>(fit.minimum.iterations), "iteration"),
                        text::number(fit.minimum.optimality, 2)),
            fit.minimum.converged ? Tone::plain : Tone::caution);
  if (fit.start_costs.size() > 1) {
    facts.add(
        "starts",
        fmt::format("{} of {} ended at the best fit", fit.agreeing_starts, fit.start_costs.size()),
        fit.agreeing_starts > 1 ? Tone::plain : Tone::caution);
  }
  facts.add("integration", fmt::format("{} steps of at most {}",
                                       fit.integration.implicit ? "implicit" : "explicit",
                                       text::seconds(fit.integration.step)));
  facts.add("AIC, BIC", fmt::format("{}, {}", text::number(fit.aic, 6), text::number(fit.bic, 6)));
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Figure run_figure(const ModelIdentification& result, const RunFit& fit, const ExperimentRun& run) {
  std::string name = "fit_" + fit.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  Figure made = over_time(
      "model", name, text::capitalized(fit.name),
      fmt::format("Measured and simulated outputs of {}, and their difference.", result.name));
  const std::vector<Coordinate>& outputs = result.fit.model.names().outputs;
  const std::vector<double> time = since(run.time.empty() ? 0.0 : run.time.front(), run.time);
  for (std::size_t p = 0; p < outputs.size(); ++p) {
    const auto row = [&](const Eigen::MatrixXd& M) {
      const Eigen::VectorXd values = M.row(static_cast<Eigen::Index>(p));
      return std::vector<double>(values.begin(), values.end());
    };
    made.plot.panels.push_back(
        panel(outputs[p],
              {line("measured", time, row(run.outputs), measured_color),
               line("simulated", time, row(fit.simulated), simulated_color, LineStyle::dashed)}));
    Coordinate error = outputs[p];
    error.name += " error";
    made.plot.panels.push_back(
        panel(error, {line("", time, row(fit.residuals), quiet_color)}, true));
  }
  return made;
}

AnswerFile run_file(const ModelIdentification& result, const RunFit& fit,
                    const ExperimentRun& run) {
  TimeSeries series(run.time);
  const ModelDescription& names = result.fit.model.names();
  const auto add = [&](const std::vector<Coordinate>& list, const Eigen::MatrixXd& values,
                       const std::string& prefix) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Eigen::VectorXd row = values.row(static_cast<Eigen::Index>(i));
      // As many as there are times, so that none is refused.
      (void)series.add(prefix + list[i].name, list[i].unit, {row.begin(), row.end()});
    }
  };
  add(names.inputs, run.inputs, "");
  add(names.outputs, run.outputs, "measured_");
  add(names.outputs, fit.simulated, "simulated_");
  std::string name = fit.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return {"data/" + name + ".csv", to_csv(series)};
}

std::string bound_name(Bound bound) {
  return bound == Bound::lower   ? "lower"
         : bound == Bound::upper ? "upper"
         : bound == Bound::fixed ? "fixed"
                                 : "none";
}

void write_runs(JsonWriter& json, const ModelIdentification& result, std::string_view key,
                const std::vector<RunFit>& runs) {
  const ModelDescription& names = result.fit.model.names();
  json.list(key, runs, [&](const RunFit& run) {
    json.object([&] {
      json.add("name", run.name);
      json.object("initial", [&] {
        for (std::size_t i = 0; i < names.states.size(); ++i) {
          json.add(names.states[i].name, run.initial(static_cast<Eigen::Index>(i)));
        }
      });
      json.key("outputs");
      json.open('[');
      for (std::size_t p = 0; p < names.outputs.size(); ++p) {
        json.object([&] {
          json.add("name", names.outputs[p].name);
          json.add("unit", names.outputs[p].unit);
          json.add("rmse", run.outputs[p].rmse);
          json.add("nrmse", run.outputs[p].nrmse);
        });
      }
      json.close(']');
    });
  });
}

std::string json_of(const ModelIdentification& result, const std::string& schema) {
  const identification::PredictionErrorFit& fit = result.fit;
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    json.add("model", result.name);
    json.list("parameters", fit.parameters, [&](const FittedParameter& one) {
      json.object([&] {
        json.add("name", one.name);
        json.add("unit", one.unit);
        json.add("value", one.value);
        json.add("standard_error", one.standard_error);
        json.key("interval");
        json.write(std::vector<double>{one.low, one.high});
        json.add("bound", bound_name(one.bound));
        json.add("determined", std::isfinite(one.standard_error));
      });
    });
    write_runs(json, result, "runs", fit.runs);
    write_runs(json, result, "validation", result.validation);
    json.key("residuals");
    json.open('[');
    for (std::size_t p = 0; p < fit.whiteness.size(); ++p) {
      json.object([&] {
        json.add("output", fit.model.names().outputs[p].name);
        json.add("std", fit.output_std[p]);
        json.add("white", fit.whiteness[p].is_white());
        json.add("p_value", fit.whiteness[p].p_value);
        json.add("autocorrelation", fit.whiteness[p].autocorrelation);
      });
    }
    json.close(']');
    json.add("undetermined", fit.undetermined);
    json.object("search", [&] {
      json.add("converged", fit.minimum.converged);
      json.add("stop", to_string(fit.minimum.stop));
      json.add("iterations", fit.minimum.iterations);
      json.add("optimality", fit.minimum.optimality);
      json.add("reciprocal_condition", fit.minimum.reciprocal_condition);
      json.add("start_costs", fit.start_costs);
    });
    json.add({{"aic", fit.aic}, {"bic", fit.bic}});
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Verdict verdict_of(const ModelIdentification& result) {
  Verdict verdict;
  const identification::PredictionErrorFit& fit = result.fit;
  const std::vector<RunFit>& shown = result.validation.empty() ? fit.runs : result.validation;
  double least = 1.0;
  for (const RunFit& run : shown) {
    for (const OutputFit& one : run.outputs) {
      least = std::min(least, one.fit);
    }
  }
  verdict.line =
      fmt::format("The simulation explains {} of {}.", text::percent(std::max(0.0, least)),
                  result.validation.empty() ? "what was fitted" : "the part that was kept aside");
  add_warnings(verdict, result.diagnostics, "about the fit");
  return verdict;
}

}  // namespace

Answer answer_of(const ModelIdentification& result) {
  Answer answer{.schema = "flyball.identify_model/1"};
  answer.json = json_of(result, answer.schema);
  Document& document = answer.document;
  document.title = title_of(result.name, "", result.log);
  document.verdict = verdict_of(result);
  document.sections = {model_section(result)};
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("log", result.log);
  document.origins.add("model", result.project);
  const auto add = [&](const std::vector<RunFit>& fits, const std::vector<ExperimentRun>& runs) {
    for (std::size_t r = 0; r < fits.size(); ++r) {
      answer.figures.push_back(run_figure(result, fits[r], runs[r]));
      answer.files.push_back(run_file(result, fits[r], runs[r]));
    }
  };
  add(result.fit.runs, result.runs);
  add(result.validation, result.validation_runs);
  return answer;
}

}  // namespace flyball::study
