#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "study/answer/frequency_figures.hpp"
#include "study/answer/model_parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

using text::complex_number;
using text::matrix;
using text::number;

/// A gain, each row and each column under its coordinate's name and unit.
Table gain_table(std::string caption, std::string corner, const Eigen::MatrixXd& gain,
                 const std::vector<Coordinate>& rows, const std::vector<Coordinate>& columns) {
  Table table;
  table.caption = std::move(caption);
  table.header = {std::move(corner)};
  for (const Coordinate& column : columns) {
    table.header.push_back(label(column));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<Value> row{label(rows[i])};
    for (const double entry : gain.row(static_cast<Eigen::Index>(i))) {
      row.emplace_back(number(entry));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string poles_text(const Eigen::VectorXcd& poles) {
  constexpr std::size_t most = 12;
  std::vector<std::string> words;
  for (Eigen::Index i = 0; i < poles.size(); ++i) {
    const std::complex<double>& pole = poles(i);
    if (pole == 0.0 && i + 1 < poles.size()) {
      words.push_back(fmt::format("0, {} times", poles.size() - i));
      break;
    }
    if (words.size() == most) {
      words.emplace_back("faster ones");
      break;
    }
    if (pole.imag() >= 0.0) {
      words.push_back(complex_number(pole));
    }
  }
  return text::enumerate(words);
}

Section controller_section(const ModelDesign& result) {
  const ModelRegulator& regulator = result.regulator;
  Section section{"controller", "Controller", {}};
  const ModelDescription& names = result.job.model.names();
  section.blocks.emplace_back(gain_table("Feedback, u = u* + K (r − x)", "K", regulator.K_delayed,
                                         names.inputs, names.states));
  if (regulator.observer) {
    section.blocks.emplace_back(gain_table("Observer, x̂ = x̂⁻ + L (y − C x̂⁻)", "L",
                                           regulator.kalman_gain, names.states, names.outputs));
  }
  Facts facts;
  facts.add("period", text::seconds(result.job.period));
  if (result.job.delay > 0.0) {
    facts.add("delay", text::seconds(result.job.delay));
  }
  if (regulator.loop_poles.size() > 0) {
    facts.add("poles of the loop", poles_text(regulator.loop_poles));
    facts.add("slowest time constant", text::seconds(regulator.time_constant));
  }
  facts.add("poles of A − B K", poles_text(regulator.poles));
  if (regulator.observer) {
    facts.add("observer's poles", poles_text(regulator.estimator_poles));
  }
  if (const auto& margins = regulator.margins) {
    facts.add("gain margin", fmt::format("{} × up, {} × down", number(margins->gain_margin_up, 3),
                                         number(margins->gain_margin_down, 3)));
    facts.add("phase margin", quantity(margins->phase_margin, "deg", 3));
    facts.add("delay margin", text::seconds(margins->delay_margin));
    facts.add("disk margin", number(margins->disk_margin, 3));
  }
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Section plant_section(const ModelDesign& result) {
  constexpr Eigen::Index most_shown = 8;
  const ModelRegulator& regulator = result.regulator;
  Section section{"plant", "About the point", {}};
  Facts facts;
  const auto add = [&](const std::string& name, const Eigen::MatrixXd& M) {
    facts.add(name, std::max(M.rows(), M.cols()) <= most_shown
                        ? matrix(M)
                        : fmt::format("{} x {}, see --json", M.rows(), M.cols()));
  };
  add("A", regulator.linear.A);
  add("B", regulator.linear.B);
  add("sampled A", regulator.plant.A);
  add("sampled B", regulator.plant.B);
  add("C", regulator.linear.C);
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Verdict verdict_of(const ModelDesign& result) {
  Verdict verdict;
  add_warnings(verdict, result.regulator.diagnostics, "of the design");
  if (!result.regulator.margins && std::isinf(result.regulator.time_constant)) {
    verdict.add(Tone::bad, "with its delay the loop is unstable");
  }
  if (const auto& margins = result.regulator.margins) {
    if (!margins->stable) {
      verdict.add(Tone::bad, "with its delay the loop is unstable");
    } else if (margins->gain_margin_up < thin_gain_margin) {
      verdict.add(Tone::caution,
                  fmt::format("the gain margin is only {} ×", number(margins->gain_margin_up, 3)));
    }
    if (margins->stable && margins->phase_margin < thin_phase_margin) {
      verdict.add(Tone::caution,
                  fmt::format("the phase margin is only {}°", number(margins->phase_margin, 3)));
    }
  }
  const auto& states = result.simulation.state_summary;
  const auto& noise = result.job.run.noise;
  const bool noisy = std::any_of(noise.begin(), noise.end(), [](double std) { return std > 0.0; });
  if (!noisy && std::any_of(states.begin(), states.end(),
                            [](const SignalSummary& state) { return !state.settling_time; })) {
    verdict.add(Tone::caution, "the simulated model has not settled at its end");
  }
  verdict.line = verdict.tone == Tone::bad ? "Do not run this controller as it is."
                 : verdict.tone == Tone::good
                     ? "The loop holds the point."
                     : "The loop is stable about the point; mind what follows before you run it.";
  return verdict;
}

Figure pole_figure(const ModelDesign& result) {
  const auto list = [](const Eigen::VectorXcd& values) {
    return std::vector<std::complex<double>>(values.begin(), values.end());
  };
  std::vector<PolePlotGroup> groups{{"running loop", list(result.regulator.loop_poles), {}},
                                    {"A − B K", list(result.regulator.poles), {}}};
  if (result.regulator.observer) {
    groups.push_back({"observer", list(result.regulator.estimator_poles), {}});
  }
  const std::string title = "Poles in the z plane";
  return {
      "controller", "poles", title,
      "Poles of the loop as it runs, with observer and delay, beside those of A − B K and of the "
      "observer; inside the unit circle is stable, nearer to the origin is faster.",
      pole_plot(title, groups, true)};
}

/// The loop opened at each input; of a single one with its margins.
std::vector<Figure> frequency_figures(const ModelDesign& result) {
  const ModelRegulator& regulator = result.regulator;
  const std::vector<Coordinate>& inputs = result.job.model.names().inputs;
  std::vector<Figure> figures;
  for (std::size_t i = 0; i < regulator.frequency_responses.size(); ++i) {
    OpenedLoop loop{.section = "controller", .response = regulator.frequency_responses[i]};
    if (inputs.size() > 1) {
      loop.name = "_" + inputs[i].name;
      loop.where = fmt::format(" at {}, the others closed", inputs[i].name);
    }
    if (const auto& margins = regulator.margins; margins && margins->stable) {
      const auto nearest =
          std::min_element(margins->gain_crossovers.begin(), margins->gain_crossovers.end(),
                           [](const Crossover& a, const Crossover& b) {
                             return 180.0 - std::abs(a.phase) < 180.0 - std::abs(b.phase);
                           });
      if (nearest != margins->gain_crossovers.end()) {
        loop.crossover = nearest->frequency;
        loop.phase_margin = margins->phase_margin * std::numbers::pi / 180.0;
      }
      loop.gain_margin = margins->gain_margin_up;
      for (const Crossover& crossing : margins->phase_crossovers) {
        const double factor = crossing.gain * margins->gain_margin_up;
        if (std::abs(factor - 1.0) < 1e-6) {
          loop.turned = crossing.frequency;
        }
      }
    }
    figures.push_back(bode_figure(loop));
    figures.push_back(nyquist_figure(loop));
  }
  return figures;
}

void write_margins(JsonWriter& json, const StabilityMargins& margins) {
  json.add("margins", {{"gain_margin", margins.gain_margin_up},
                       {"gain_reduction", margins.gain_margin_down},
                       {"phase_margin", margins.phase_margin * std::numbers::pi / 180.0},
                       {"delay_margin", margins.delay_margin},
                       {"disk_margin", margins.disk_margin}});
}

}  // namespace

Section point_section(const OperatingPoint& point, const ModelDescription& model) {
  Section section{"point", "Operating point", {}};
  Facts facts;
  const auto add = [&](const std::vector<Coordinate>& names, const Eigen::VectorXd& values) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      facts.add(names[i].name, quantity(values(static_cast<Eigen::Index>(i)), names[i].unit));
    }
  };
  add(model.states, point.x);
  add(model.inputs, point.u);
  facts.add("it is", describe(point, model), point.is_equilibrium ? Tone::good : Tone::caution);
  section.blocks.emplace_back(std::move(facts));
  return section;
}

void write_point(JsonWriter& json, const OperatingPoint& point) {
  json.object("point", [&] {
    json.add("x", point.x);
    json.add("u", point.u);
    json.add("derivative", point.derivative);
    json.add("is_equilibrium", point.is_equilibrium);
    if (point.nearest) {
      json.object("nearest_equilibrium", [&] {
        json.add("x", point.nearest->x);
        json.add("u", point.nearest->u);
      });
    }
  });
}

Answer answer_of(const ModelDesign& result) {
  const ModelDescription& names = result.job.model.names();
  const ModelRegulator& regulator = result.regulator;
  Answer answer{.schema = "flyball.design_model/2"};
  JsonWriter json;
  json.object([&] {
    json.add("schema", answer.schema);
    json.add("model", names.name);
    json.add("states", names.states);
    json.add("inputs", names.inputs);
    json.add("outputs", names.outputs);
    json.add("period", result.job.period);
    json.add("delay", result.job.delay);
    write_point(json, regulator.point);
    json.add("K", regulator.K);
    json.add("K_delay_compensated", regulator.K_delayed);
    json.add("poles", regulator.loop_poles);
    json.add("time_constant", regulator.time_constant);
    json.add("design_poles", regulator.poles);
    if (regulator.observer) {
      json.add("kalman_gain", regulator.kalman_gain);
      json.add("estimator_poles", regulator.estimator_poles);
    }
    if (regulator.margins) {
      write_margins(json, *regulator.margins);
    }
    json.object("plant", [&] {
      json.add("A", regulator.plant.A);
      json.add("B", regulator.plant.B);
      json.add("C", regulator.plant.C);
      json.add("D", regulator.plant.D);
      json.add("A_continuous", regulator.linear.A);
      json.add("B_continuous", regulator.linear.B);
    });
    json.object("weights", [&] {
      json.add("Q", regulator.Q);
      json.add("R", regulator.R);
    });
    json.object("simulation", [&] { write_simulation(json, result.simulation); });
    write_region(json, result);
    json.add("diagnostics", result.simulation.diagnostics);
  });
  answer.json = std::move(json).text();
  Document& document = answer.document;
  document.title = text::capitalized(names.name) + " controller";
  document.verdict = verdict_of(result);
  document.sections = {point_section(regulator.point, names), plant_section(result),
                       controller_section(result), simulation_section(result.simulation)};
  if (!result.simulation.diagnostics.empty()) {
    document.sections.push_back(diagnostics_section(result.simulation.diagnostics));
  }
  document.origins.add("model", result.job.path);
  document.origins.add("seed", fmt::to_string(result.job.run.seed));
  answer.figures = {pole_figure(result)};
  append(answer.figures, frequency_figures(result));
  append(answer.figures, figures_of(result.simulation));
  answer.files = {data_file(result.simulation)};
  append_region(result, answer);
  return answer;
}

}  // namespace flyball::study
