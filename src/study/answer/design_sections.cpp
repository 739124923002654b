#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include <flyball/export/constants.hpp>
#include <flyball/study/design_exports.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;
using text::complex_number;
using text::enumerate;
using text::matrix;
using text::number;
using text::percent;
using text::seconds;

double degrees(double radians) {
  return radians * 180.0 / std::numbers::pi;
}

Coordinate state_of(const DesignResult& result, Eigen::Index i) {
  const auto at = static_cast<std::size_t>(i);
  return at < result.states.size() ? result.states[at]
                                   : Coordinate{.name = fmt::format("x{}", i + 1)};
}

/// Of a loop with a long delay the slowest are shown, the others counted.
constexpr Eigen::Index most_poles = 6;

void add_poles(Table& table, const std::string& which, const Eigen::VectorXcd& poles,
               double period) {
  for (Eigen::Index i = 0; i < poles.size(); ++i) {
    const std::complex<double> pole = poles(i);
    if (pole.imag() < 0.0 && i > 0 && std::abs(poles(i - 1) - std::conj(pole)) < 1e-9) {
      continue;  // shown with its conjugate
    }
    if (pole == 0.0) {
      const Eigen::Index zeros = poles.size() - i;
      table.rows.push_back(
          {which, zeros > 1 ? fmt::format("0, {} times", zeros) : "0", "0", "0 ms"});
      break;
    }
    if (i >= most_poles) {
      table.rows.push_back({which, fmt::format("{} faster ones", poles.size() - i), "", ""});
      break;
    }
    const double radius = std::abs(pole);
    const double settles = radius < 1.0 ? -period / std::log(radius) : INFINITY;
    table.rows.push_back({which,
                          complex_number(pole),
                          {number(radius, 4), radius < 1.0 ? Tone::plain : Tone::bad},
                          radius > 0.0 ? seconds(settles) : "0 ms"});
  }
}

Value entry(const std::vector<double>& values, Eigen::Index i, const std::string& unit) {
  const auto at = static_cast<std::size_t>(i);
  return at < values.size() ? quantity(values[at], unit, 4, /*shown=*/false) : "";
}

Value entry(const Eigen::MatrixXd& M, Eigen::Index i, Eigen::Index j) {
  return i < M.rows() && j < M.cols() ? quantity(M(i, j), "", 6) : "";
}

Tone tone_of_margin(double value, double good, double poor) {
  return value >= good ? Tone::good : value >= poor ? Tone::caution : Tone::bad;
}

std::vector<double> distinct(const std::vector<RobustnessPoint>& points,
                             double RobustnessPoint::* factor) {
  std::vector<double> values;
  for (const RobustnessPoint& point : points) {
    if (std::find(values.begin(), values.end(), point.*factor) == values.end()) {
      values.push_back(point.*factor);
    }
  }
  std::sort(values.begin(), values.end());
  return values;
}

Table robustness_table(const DesignResult& result) {
  const std::vector<double> gains = distinct(result.robustness, &RobustnessPoint::gain_factor);
  const auto row_factor =
      result.velocity_servo ? &RobustnessPoint::kA : &RobustnessPoint::inertia_factor;
  Table table;
  table.caption = "Overshoot of a small step if the mechanism is not as it was modelled:";
  table.header = {result.velocity_servo ? fmt::format("kA (V·s²/{})", result.job.plant.unit)
                                        : "inertia"};
  for (const double gain : gains) {
    table.header.push_back("gain × " + number(gain));
  }
  for (const double inertia : distinct(result.robustness, row_factor)) {
    std::vector<Value> row{(result.velocity_servo ? "" : "× ") + number(inertia)};
    for (const double gain : gains) {
      Value cell("");
      for (const RobustnessPoint& point : result.robustness) {
        if (point.*row_factor == inertia && point.gain_factor == gain &&
            point.delay_factor == 1.0) {
          cell = point.stable ? Value(percent(point.overshoot, 2)) : Value("unstable", Tone::bad);
        }
      }
      row.push_back(std::move(cell));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// What a delay makes of the loop that is not as long as it was predicted over, the worst kA.
Facts delay_error_facts(const DesignResult& result) {
  Facts facts;
  for (const double factor : distinct(result.robustness, &RobustnessPoint::delay_factor)) {
    double overshoot = 0.0;
    for (const RobustnessPoint& point : result.robustness) {
      overshoot = point.delay_factor == factor ? std::max(overshoot, point.overshoot) : overshoot;
    }
    if (factor != 1.0) {
      facts.add(fmt::format("delay × {}", number(factor)),
                std::isfinite(overshoot)
                    ? Value(fmt::format("a small step overshoots by {}", percent(overshoot, 2)))
                    : Value("unstable", Tone::bad));
    }
  }
  return facts;
}

double largest(const TimeSeries& series, std::string_view column) {
  double found = NAN;
  if (const std::vector<double>* values = series.find(column)) {
    for (const double value : *values) {
      found = std::isnan(found) ? std::abs(value) : std::max(found, std::abs(value));
    }
  }
  return found;
}

/// The kA that stands for one that is not determined.
std::string kA_text(const PlantDescription& plant) {
  return plant.kA_upper_bound > 0.0 ? fmt::format("kA at its upper bound, {} V·s²/{}",
                                                  number(plant.kA_upper_bound), plant.unit)
                                    : "no inertia";
}

Section plant_section(const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  Section section{"plant", "Plant", {}};
  Facts facts = plant_facts(plant);
  facts.add("states", enumerate(labels(result.states)));
  facts.add("input", result.velocity_servo
                         ? "voltage (V), which the velocity follows (Theorem 14.3.2)"
                         : "voltage (V)");
  facts.add("continuous", fmt::format("A = {}, B = {}", matrix(result.A_continuous),
                                      matrix(result.B_continuous)));
  facts.add("discrete",
            fmt::format("A = {}, B = {}, C = {}, T = {}", matrix(result.A), matrix(result.B),
                        matrix(result.C), seconds(result.job.controller.period)));
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Section controller_section(const DesignResult& result) {
  const ControllerOptions& controller = result.job.controller;
  const PlantDescription& plant = result.job.plant;
  const bool gravity = has_gravity(plant.kind);
  const double delay = controller.delay.value_or(0.0);
  Section section{"controller", "Controller", {}};
  section.blocks.emplace_back(Paragraph{fmt::format(
      "Every {}: u = K (r − x̂) + B⁺ (r_next − A r){}, limited to ±{} V; x̂ is "
      "predicted by the plant and corrected by the measured {}{}.",
      seconds(controller.period), gravity ? " + kS sgn(v) + gravity" : " + kS sgn(v)",
      number(controller.max_voltage), measured_name(plant.kind),
      result.predicts ? fmt::format(", then carried over the {} of delay by the voltages that the "
                                    "motor saw in them",
                                    seconds(delay))
                      : "")});
  Table table;
  const bool delayed = result.K_delayed.size() > 0 && delay > 0.0;
  const bool compensated = delayed && !result.predicts;
  table.header = {"state", "tolerance", "K"};
  if (compensated) {
    table.header.emplace_back("K, delay " + seconds(delay));
  }
  table.header.emplace_back("B⁺");
  table.header.emplace_back("Kalman gain");
  const bool model_given = !result.job.estimator.model_std.empty();
  if (model_given) {
    table.header.emplace_back("model std");
  }
  for (Eigen::Index i = 0; i < result.A.rows(); ++i) {
    const Coordinate state = state_of(result, i);
    std::vector<Value> row{label(state), entry(controller.state_tolerance, i, state.unit),
                           entry(result.K, 0, i)};
    if (compensated) {
      row.emplace_back(entry(result.K_delayed, 0, i));
    }
    row.emplace_back(entry(result.inversion, 0, i));
    row.emplace_back(entry(result.kalman_gain, i, 0));
    if (model_given) {
      row.emplace_back(entry(result.job.estimator.model_std, i, state.unit));
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));

  Facts facts;
  facts.add("units", fmt::format("K and B⁺: V per unit of the state; Kalman gain: unit of the "
                                 "state per {}",
                                 controlled_unit(plant)));
  if (compensated) {
    facts.add("used", fmt::format("the gain for a state that is {} old (B.12)", seconds(delay)));
  } else if (controller.delay) {
    facts.add("delay", seconds(delay));
  }
  facts.add("input tolerance", quantity(controller.input_tolerance, "V"));
  facts.add("weights",
            fmt::format("Q = {}, R = {} (Bryson's rule)", matrix(result.Q), matrix(result.R)));
  if (result.job.estimator.measurement_std) {
    facts.add("measurement std",
              quantity(*result.job.estimator.measurement_std, controlled_unit(plant)));
  }
  section.blocks.emplace_back(std::move(facts));

  Table poles;
  poles.header = {"poles", "z", "|z|", "time constant"};
  add_poles(poles, "loop as it runs", result.loop.poles, controller.period);
  add_poles(poles, delayed ? "design, no delay" : "design", result.poles, controller.period);
  add_poles(poles, "estimator", result.estimator_poles, controller.period);
  section.blocks.emplace_back(std::move(poles));

  Facts step;
  const auto time = [](const std::optional<double>& value) {
    return value ? seconds(*value) : std::string("not reached");
  };
  step.add("rise time", time(result.loop.rise_time) + ", 10 % to 90 %");
  step.add("settling time", time(result.loop.settling_time) + ", within 2 %");
  step.add("overshoot", percent(result.loop.overshoot, 2));
  section.blocks.emplace_back(Paragraph{fmt::format(
      "A small step of the loop as it runs, with its {}{}; it reaches no limit:",
      delayed ? "observer and delay" : "observer",
      result.velocity_servo ? fmt::format(", on a mechanism with {}", kA_text(plant)) : "")});
  section.blocks.emplace_back(std::move(step));
  return section;
}

/// Over which kA the margins are the smallest.
std::string checked_kA(const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  if (!result.velocity_servo) {
    return "";
  }
  return plant.kA_upper_bound > 0.0 ? fmt::format(", the smallest over kA from 0 to {} V·s²/{}",
                                                  number(plant.kA_upper_bound), plant.unit)
                                    : ", of a mechanism with no inertia";
}

Section robustness_section(const DesignResult& result) {
  const LoopMargins& margins = result.margins;
  Section section{"robustness", "Robustness", {}};
  if (!result.feedback) {
    section.blocks.emplace_back(Paragraph{
        fmt::format("There is no feedback: {}. Nothing can make the loop unstable, and nothing "
                    "corrects it: there are no margins.",
                    result.no_feedback),
        Tone::caution});
    return section;
  }
  Facts facts;
  facts.add(
      "gain margin",
      fmt::format("the gain may rise {} × ({} dB) and fall to {} ×", number(margins.gain_margin, 3),
                  number(20.0 * std::log10(margins.gain_margin), 3),
                  number(margins.gain_reduction, 3)),
      tone_of_margin(margins.gain_margin, 2.0, 1.4));
  std::string phase = number(degrees(margins.phase_margin), 3) + "°";
  if (margins.crossover > 0.0) {
    phase += fmt::format(" at {} rad/s ({} Hz)", number(margins.crossover, 3),
                         number(margins.crossover / (2.0 * std::numbers::pi), 3));
  }
  facts.add("phase margin", phase, tone_of_margin(degrees(margins.phase_margin), 30.0, 20.0));
  facts.add(
      "delay margin",
      fmt::format("{} more{}", seconds(margins.delay_margin),
                  result.job.controller.delay ? fmt::format(", beyond the {} in the loop",
                                                            seconds(*result.job.controller.delay))
                                              : ""),
      tone_of_margin(margins.delay_margin, result.job.controller.period,
                     0.25 * result.job.controller.period));
  facts.add("disk margin", number(margins.disk_margin, 3),
            tone_of_margin(margins.disk_margin, 0.5, 0.3));
  section.blocks.emplace_back(Paragraph{fmt::format(
      "Of the loop opened at the plant input, with the delay in it{}:", checked_kA(result))});
  section.blocks.emplace_back(std::move(facts));
  append(section.blocks, proof_blocks(result));
  if (!result.robustness.empty()) {
    section.blocks.emplace_back(robustness_table(result));
    if (result.predicts) {
      section.blocks.emplace_back(
          Paragraph{"And if the delay is not as long as it was predicted over:"});
      section.blocks.emplace_back(delay_error_facts(result));
    }
    section.blocks.emplace_back(
        result.robust
            ? Paragraph{fmt::format("Stable at every point of this grid, worst overshoot {}.",
                                    percent(result.worst_overshoot, 3)),
                        Tone::good}
            : Paragraph{"Not stable at every point of this grid.", Tone::bad});
  }
  return section;
}

Section motion_section(const DesignResult& result) {
  const FastestMotion& motion = result.motion;
  const PlantDescription& plant = result.job.plant;
  const bool flywheel = controls_velocity(plant.kind);
  Section section{"motion", flywheel ? "Fastest ramp" : "Fastest trapezoid", {}};
  Facts facts;
  facts.add("velocity", quantity(motion.max_velocity, plant.unit + "/s"));
  facts.add("acceleration", quantity(motion.max_acceleration, plant.unit + "/s²"));
  facts.add("voltage reserve",
            fmt::format("{} V of {} V kept back for feedback", number(motion.voltage_reserve),
                        number(result.job.controller.max_voltage)));
  facts.add("simulated",
            fmt::format("to {} {} in {}{}", number(motion.goal), controlled_unit(plant),
                        seconds(motion.duration),
                        result.velocity_servo ? fmt::format(", with {}", kA_text(plant)) : ""));
  facts.add("tracking error",
            fmt::format("{} {} RMS, {} {} at most", number(result.tracking_error_rms, 3),
                        controlled_unit(plant), number(result.tracking_error_max, 3),
                        controlled_unit(plant)));
  const double voltage = largest(result.response, "motor_voltage");
  if (!std::isnan(voltage)) {
    facts.add("peak voltage", quantity(voltage, "V", 3));
  }
  const double current = largest(result.response, "current");
  if (!std::isnan(current) && current > 0.0) {
    facts.add("peak current", number(current, 3) + " A of the battery");
  }
  section.blocks.emplace_back(std::move(facts));
  return section;
}

Section constants_section(const DesignResult& result) {
  Section section{"constants", "Constants to paste", {}};
  const std::vector<exports::PasteText> all = exports::paste_constants(constants_of(result));
  for (const exports::PasteText& paste : all) {
    section.blocks.emplace_back(Code{paste.title, paste.text, paste.file});
  }
  const PlantDescription& plant = result.job.plant;
  const bool per_rotation =
      std::any_of(all.begin(), all.end(), [](const exports::PasteText& paste) {
        return paste.file.find("revlib") != std::string::npos;
      });
  if (!per_rotation) {
    const bool drum = plant.unit == "m";
    section.blocks.emplace_back(Paragraph{
        fmt::format("Phoenix 6 and REVLib count rotations, which {} would tell: put gearing{} into "
                    "gains.toml beside this page, [mechanism], and design again with it: flyball "
                    "design gains.toml (or flyball tune LOG gains.toml).",
                    drum ? "the gearing and the drum's radius" : "the gearing",
                    drum ? " = 10.0 and drum_radius = \"1 in\"" : " = 10.0"),
        Tone::quiet});
  }
  return section;
}

}  // namespace

std::string measured_name(MechanismKind kind) {
  return controls_velocity(kind) ? "velocity" : "position";
}

std::string controlled_unit(const PlantDescription& plant) {
  return controls_velocity(plant.kind) ? plant.unit + "/s" : plant.unit;
}

Facts plant_facts(const PlantDescription& plant) {
  const std::string& unit = plant.unit;
  Facts facts;
  facts.add("mechanism", plant.name.empty() ? std::string(to_string(plant.kind)) : plant.name);
  if (plant.motor) {
    const mechanisms::DcMotor& motor = *plant.motor;
    facts.add("motor",
              fmt::format("{} {}, R {} Ω, Kt {} N·m/A, Kv {} rad/s/V", motor.count, motor.name,
                          number(motor.R), number(motor.Kt), number(motor.Kv)));
    facts.add("gearing", quantity(plant.gearing, "motor turns per output turn"));
  }
  if (plant.drum_radius > 0.0) {
    facts.add(plant.kind == MechanismKind::elevator ? "drum radius" : "wheel radius",
              quantity(plant.drum_radius, "m"));
  }
  std::string gains =
      fmt::format("kS {} V, kV {} V·s/{}", number(plant.gains.kS), number(plant.gains.kV), unit);
  gains += plant.kA_determined ? fmt::format(", kA {} V·s²/{}", number(plant.gains.kA), unit)
           : plant.kA_upper_bound > 0.0
               ? fmt::format(", kA below {} V·s²/{}", number(plant.kA_upper_bound), unit)
               : std::string(", kA not known");
  if (has_gravity(plant.kind)) {
    gains += fmt::format(", kG {} V", number(plant.gains.kG));
  }
  if (plant.kind == MechanismKind::arm) {
    gains += fmt::format(", angle offset {} rad", number(plant.gains.angle_offset));
  }
  facts.add("gains", gains);
  return facts;
}

std::vector<Section> design_sections(const DesignResult& result) {
  return {plant_section(result), controller_section(result), robustness_section(result),
          motion_section(result), constants_section(result)};
}

}  // namespace flyball::study
