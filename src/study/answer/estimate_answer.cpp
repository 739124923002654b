#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/wording.hpp"
#include "study/answer/estimate_parts.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

std::string unit_of_walk(const std::string& unit) {
  return unit.empty()
             ? "1/√s"
             : fmt::format("{}/√s",
                           unit.find(' ') == std::string::npos ? unit : fmt::format("({})", unit));
}

/// How well the runs know a state: the median of its standard deviations.
double usual(const std::vector<EstimatedRun>& runs, bool smoothed, Index i) {
  std::vector<double> all;
  for (const EstimatedRun& run : runs) {
    const Eigen::VectorXd row = (smoothed ? run.smoothed_std : run.filtered_std).row(i);
    all.insert(all.end(), row.begin(), row.end());
  }
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle;
}

Section states_section(const Estimation& result) {
  Section section{"states", "States", {}};
  const bool smoothed = is_smoothed(result.runs.front());
  Table table;
  table.header = {"state", "filter: usual σ", "at the end", "σ"};
  if (smoothed) {
    table.header.insert(table.header.begin() + 2, "smoother: usual σ");
  }
  const std::vector<Coordinate>& states = result.model.names().states;
  const EstimatedRun& last = result.runs.back();
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto k = static_cast<Index>(i);
    const std::string& unit = states[i].unit;
    std::vector<Value> cells{states[i].name, quantity(usual(result.runs, false, k), unit)};
    if (smoothed) {
      cells.push_back(quantity(usual(result.runs, true, k), unit));
    }
    cells.push_back(quantity(last.filtered(k, last.filtered.cols() - 1), unit));
    cells.push_back(quantity(last.filtered_std(k, last.filtered_std.cols() - 1), unit));
    table.rows.push_back(std::move(cells));
  }
  section.blocks.emplace_back(std::move(table));
  std::size_t samples = 0;
  for (const EstimatedRun& run : result.runs) {
    samples += run.time.size();
  }
  Facts facts;
  facts.add("filter", fmt::format("{} Kalman filter{}",
                                  result.settings.is_unscented ? "unscented" : "extended",
                                  smoothed ? ", Rauch-Tung-Striebel smoother" : ""));
  facts.add("log", fmt::format("{} in {}", text::count(samples, "sample"),
                               text::count(result.runs.size(), "run")));
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Value error_of(const NoiseDeviation* found) {
  if (found == nullptr || !found->is_free) {
    return "as given";
  }
  return found->is_negligible ? Value("not seen in the log", Tone::quiet)
         : !std::isfinite(found->relative_error)
             ? Value("not determined", Tone::caution)
             : Value("± " + text::percent(found->relative_error, 2));
}

/// Of each state with process noise and each output, its noise and what a fit says of it.
template <class Take>
void for_each_noise(const Estimation& result, const Take& take) {
  const ModelDescription& names = result.model.names();
  std::size_t next = 0;
  for (std::size_t i = 0; i < names.states.size(); ++i) {
    const double value = result.settings.process_noise(static_cast<Index>(i));
    if (value > 0.0) {
      take("process", names.states[i].name, unit_of_walk(names.states[i].unit), value,
           result.tuned ? &result.tuned->process[next] : nullptr);
      ++next;
    }
  }
  for (std::size_t i = 0; i < names.outputs.size(); ++i) {
    take("measurement", names.outputs[i].name, names.outputs[i].unit,
         result.settings.measurement_noise(static_cast<Index>(i)),
         result.tuned ? &result.tuned->measurement[i] : nullptr);
  }
}

Section noise_section(const Estimation& result) {
  Section section{"noise", "Noise", {}};
  Table table;
  table.header = {"noise", "of", "σ", "unit", result.tuned ? "standard error" : "said"};
  table.words = {0, 1, 3, 4};
  for_each_noise(result, [&](const char* kind, const std::string& of, const std::string& unit,
                             double value, const NoiseDeviation* found) {
    table.rows.push_back({kind, of, quantity(value, unit, 4, false), unit, error_of(found)});
  });
  section.blocks.emplace_back(std::move(table));
  if (result.tuned) {
    const NoiseFit& fit = *result.tuned;
    Facts facts;
    facts.add("search",
              fmt::format("{} after {}, the model linearised {} along the smoothed path",
                          fit.converged ? "converged" : "not converged",
                          text::count(static_cast<std::size_t>(fit.iterations), "iteration"),
                          result.relinearizations == 1
                              ? "once"
                              : fmt::format("{} times", result.relinearizations)),
              fit.converged ? Tone::plain : Tone::caution);
    facts.add("log-likelihood",
              fmt::format("from {} to {}", text::number(fit.start_log_likelihood, 6),
                          text::number(fit.log_likelihood, 6)));
    section.blocks.emplace_back(std::move(facts));
  }
  return section;
}

Section residuals_section(const Estimation& result) {
  Section section{"residuals", "Residuals", {}};
  Facts facts;
  const InnovationTest& test = result.nis;
  if (test.readings > 0) {
    facts.add("NIS a reading",
              fmt::format("{} (right filters: {} to {})", text::number(test.mean, 4),
                          text::number(test.low, 4), text::number(test.high, 4)),
              test.passed() ? Tone::good : Tone::caution);
    facts.add("samples within 95 %", text::percent(test.within));
  } else {
    facts.add("NIS a reading", "none", Tone::caution);
  }
  const std::vector<Coordinate>& outputs = result.model.names().outputs;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const identification::Whiteness& found = result.whiteness[i];
    facts.add("innovations of " + outputs[i].name,
              std::isnan(found.p_value)
                  ? std::string("too few to tell")
                  : fmt::format("{}white (p = {})", found.is_white() ? "" : "not ",
                                text::number(found.p_value, 2)),
              found.is_white() ? Tone::good : Tone::caution);
  }
  facts.add("log-likelihood", text::number(result.log_likelihood, 8));
  section.blocks.emplace_back(std::move(facts));
  return section;
}

std::string json_of(const Estimation& result, const std::string& schema) {
  const ModelDescription& names = result.model.names();
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    json.add("model", names.name);
    json.add("filter", result.settings.is_unscented ? "unscented" : "extended");
    json.key("noise");
    json.open('[');
    for_each_noise(result, [&](const char* kind, const std::string& of, const std::string& unit,
                               double value, const NoiseDeviation* found) {
      json.object([&] {
        json.add("kind", kind);
        json.add("of", of);
        json.add("unit", unit);
        json.add("std", value);
        if (found != nullptr) {
          json.add("relative_error", found->relative_error);
          json.add("negligible", found->is_negligible);
        }
      });
    });
    json.close(']');
    json.key("states");
    json.open('[');
    const EstimatedRun& last = result.runs.back();
    for (std::size_t i = 0; i < names.states.size(); ++i) {
      const auto k = static_cast<Index>(i);
      json.object([&] {
        json.add("name", names.states[i].name);
        json.add("unit", names.states[i].unit);
        json.add("end", last.filtered(k, last.filtered.cols() - 1));
        json.add("end_std", last.filtered_std(k, last.filtered_std.cols() - 1));
        json.add("filter_std", usual(result.runs, false, k));
        if (is_smoothed(last)) {
          json.add("smoother_std", usual(result.runs, true, k));
        }
      });
    }
    json.close(']');
    json.list("runs", result.runs, [&](const EstimatedRun& run) {
      json.object([&] {
        json.add("name", run.name);
        json.add("samples", run.time.size());
        json.add("from", run.time.front());
        json.add("to", run.time.back());
      });
    });
    json.object("nis", [&] {
      json.add("readings", result.nis.readings);
      json.add({{"mean", result.nis.mean},
                {"low", result.nis.low},
                {"high", result.nis.high},
                {"within", result.nis.within}});
      json.add("passed", result.nis.passed());
    });
    json.key("innovations");
    json.open('[');
    for (std::size_t i = 0; i < names.outputs.size(); ++i) {
      json.object([&] {
        json.add("output", names.outputs[i].name);
        json.add("white", result.whiteness[i].is_white());
        json.add("p_value", result.whiteness[i].p_value);
        json.add("autocorrelation", result.whiteness[i].autocorrelation);
      });
    }
    json.close(']');
    json.add("log_likelihood", result.log_likelihood);
    if (result.tuned) {
      const NoiseFit& fit = *result.tuned;
      json.object("tuning", [&] {
        json.add("converged", fit.converged);
        json.add("iterations", fit.iterations);
        json.add("linearizations", static_cast<int>(result.relinearizations));
        json.add({{"start_log_likelihood", fit.start_log_likelihood},
                  {"log_likelihood", fit.log_likelihood},
                  {"expected_gain", fit.expected_gain}});
      });
    }
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Verdict verdict_of(const Estimation& result) {
  Verdict verdict;
  verdict.line = result.nis.readings > 0 && result.nis.passed()
                     ? "The estimates err as much as they say: the innovations fit."
                     : "The estimates are there; how far they err is not proven.";
  add_warnings(verdict, result.diagnostics, "about the estimate");
  return verdict;
}

}  // namespace

Answer answer_of(const Estimation& result) {
  Answer answer{.schema = "flyball.estimate/1"};
  answer.json = json_of(result, answer.schema);
  Document& document = answer.document;
  document.title = title_of(result.model.names().name, "", result.log);
  document.verdict = verdict_of(result);
  document.sections = {states_section(result), residuals_section(result), noise_section(result)};
  if (!result.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  document.origins.add("log", result.log);
  document.origins.add("model", result.project);
  answer.figures = figures_of(result);
  answer.files = data_files(result);
  return answer;
}

}  // namespace flyball::study
