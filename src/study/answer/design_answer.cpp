#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/export/generated_loop.hpp>
#include <flyball/study/design_exports.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/simulate_design.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/rules_of_thumb.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;

constexpr double large_overshoot = 0.25;

void write_feedforward(JsonWriter& json, const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  const mechanisms::FeedforwardGains& gains = plant.gains;
  json.object("feedforward", [&] {
    json.add("kS", gains.kS);
    json.add("kV", gains.kV);
    json.add("kA", plant.kA_determined ? std::optional(gains.kA) : std::nullopt);
    json.add("kG", gains.kG);
    json.add("plant_inversion", result.inversion);
    if (plant.kind == MechanismKind::arm) {
      json.add("angle_offset", gains.angle_offset);
    }
  });
}

void write_robustness(JsonWriter& json, const DesignResult& result) {
  const LoopMargins& margins = result.margins;
  json.add("margins", {{"gain_margin", margins.gain_margin},
                       {"gain_reduction", margins.gain_reduction},
                       {"phase_margin", margins.phase_margin},
                       {"delay_margin", margins.delay_margin},
                       {"disk_margin", margins.disk_margin},
                       {"crossover", margins.crossover}});
  json.object("robustness", [&] {
    json.add("stable", result.robust);
    json.add("worst_overshoot", result.worst_overshoot);
    write_proofs(json, result);
    json.list("grid", result.robustness, [&](const RobustnessPoint& point) {
      json.object([&] {
        json.add({{"inertia_factor", point.inertia_factor},
                  {"kA", point.kA},
                  {"gain_factor", point.gain_factor},
                  {"delay_factor", point.delay_factor}});
        json.add("stable", point.stable);
        json.add({{"spectral_radius", point.spectral_radius}, {"overshoot", point.overshoot}});
      });
    });
  });
}

void write_motion(JsonWriter& json, const DesignResult& result) {
  json.add("motion", {{"max_velocity", result.motion.max_velocity},
                      {"max_acceleration", result.motion.max_acceleration},
                      {"goal", result.motion.goal},
                      {"duration", result.motion.duration},
                      {"voltage_reserve", result.motion.voltage_reserve}});
  json.object("simulation", [&] {
    json.add({{"tracking_error_rms", result.tracking_error_rms},
              {"tracking_error_max", result.tracking_error_max}});
    json.add("seed", result.job.seed);
  });
}

void write_paste(JsonWriter& json, std::string_view name, const std::vector<PasteGains>& all) {
  json.list(name, all, [&](const PasteGains& gains) {
    json.object([&] {
      json.add("per", gains.per);
      json.add({{"kP", gains.kP},
                {"kD", gains.kD},
                {"kS", gains.kS},
                {"kV", gains.kV},
                {"kA", gains.kA},
                {"kG", gains.kG}});
    });
  });
}

}  // namespace

void write_design(JsonWriter& json, const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  json.add("mechanism", to_string(plant.kind));
  json.add("unit", plant.unit);
  json.add("period", result.job.controller.period);
  json.add("delay", result.job.controller.delay.value_or(0.0));
  json.add("predicts_delay", result.predicts);
  json.add("states", result.states);
  json.add("input", "voltage");
  json.add("K", result.K);
  json.add("K_delay_compensated", result.K_delayed);
  json.add("kalman_gain", result.kalman_gain);
  json.add("poles", result.loop.poles);
  json.add("design_poles", result.poles);
  json.add("estimator_poles", result.estimator_poles);
  json.object("step", [&] {
    json.add("time_constant", result.loop.time_constant);
    json.add("rise_time", result.loop.rise_time);
    json.add("settling_time", result.loop.settling_time);
    json.add("overshoot", result.loop.overshoot);
  });
  json.add("feedback", result.feedback);
  write_feedforward(json, result);
  write_robustness(json, result);
  write_motion(json, result);
  json.object("plant", [&] {
    json.add("A", result.A);
    json.add("B", result.B);
    json.add("C", result.C);
    json.add("A_continuous", result.A_continuous);
    json.add("B_continuous", result.B_continuous);
  });
  json.object("weights", [&] {
    json.add("Q", result.Q);
    json.add("R", result.R);
  });
  write_paste(json, "paste", result.paste);
  write_paste(json, "paste_on_board", result.paste_on_board);
  json.add("diagnostics", result.diagnostics);
}

std::string to_json(const DesignResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.design/2");
    write_design(json, result);
  });
  return std::move(json).text();
}

Verdict verdict_of(const DesignResult& result) {
  Verdict verdict;
  const LoopMargins& margins = result.margins;
  if (!result.robust) {
    verdict.add(Tone::bad,
                result.velocity_servo
                    ? "a mechanism with a kA that is not ruled out, and a gain within 20 % of the "
                      "model's, makes the loop unstable"
                : result.predicts
                    ? "a mechanism that differs by 20 %, or a delay by 25 %, from its model makes "
                      "the loop unstable"
                    : "a mechanism that differs by 20 % from its model makes the loop unstable");
  }
  add_proofs(verdict, result);
  if (!result.feedback) {
    verdict.add(Tone::caution, "there is no feedback: " + result.no_feedback);
  }
  if (margins.gain_margin < thin_gain_margin) {
    verdict.add(Tone::caution,
                fmt::format("the gain margin is only {} ×", text::number(margins.gain_margin, 3)));
  }
  const double phase = margins.phase_margin * 180.0 / std::numbers::pi;
  if (phase < thin_phase_margin) {
    verdict.add(Tone::caution, fmt::format("the phase margin is only {}°", text::number(phase, 3)));
  }
  if (result.robust && result.worst_overshoot > large_overshoot) {
    verdict.add(Tone::caution,
                fmt::format("a small step overshoots by up to {} in the grid of errors",
                            text::percent(result.worst_overshoot, 2)));
  }
  add_warnings(verdict, result.diagnostics, "of the design");
  verdict.line =
      verdict.tone == Tone::good  ? proof_line(result)
      : verdict.tone == Tone::bad ? "Do not run this controller as it is."
      : !result.feedback
          ? "Feedforward alone drives the mechanism; mind what follows before you run it."
      : all_proven(result) ? proof_line(result) + " Mind what follows before you run it."
                           : "The loop is stable; mind what follows before you run it.";
  return verdict;
}

void add_design_files(Answer& answer, const DesignResult& result,
                      const identification::FeedforwardFit* fit) {
  const PlantDescription& plant = result.job.plant;
  answer.files.push_back({"gains.toml", gains_toml(result, fit)});
  const std::string name = exports::loop_class_name(plant.kind);
  for (const exports::Language language : exports::languages) {
    auto loop = exports::generate_loop(controller_of(result), language, name, plant.unit);
    if (!loop) {
      answer.document.sections.back().blocks.emplace_back(
          Paragraph{"No source of the loop: " + to_string(loop.error()) + ".", Tone::bad});
      break;
    }
    answer.files.push_back({exports::loop_file_name(language, name), *std::move(loop)});
  }
  for (const exports::PasteText& paste : exports::paste_constants(constants_of(result))) {
    answer.files.push_back({paste.file, paste.text});
  }
  append(answer.files, data_files(result));
}

Answer answer_of(const DesignResult& result) {
  Answer answer{.schema = "flyball.design/2", .json = to_json(result)};
  Document& document = answer.document;
  document.title = text::capitalized(to_string(result.job.plant.kind)) + " controller";
  document.verdict = verdict_of(result);
  document.sections = design_sections(result);
  document.origins.add("seed", fmt::to_string(result.job.seed));
  answer.figures = figures_of(result);
  answer.animations = animations_of(result);
  add_design_files(answer, result, nullptr);
  document.sections.push_back(next_steps(result));
  document.sections.push_back(diagnostics_section(result.diagnostics));
  return answer;
}

}  // namespace flyball::study
