#include <flyball/study/schema.hpp>

#include <utility>

#include <fmt/format.h>

#include <flyball/io/json_writer.hpp>

namespace flyball::study {

namespace {

using identification::GainEstimate;
using mechanisms::MechanismKind;

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

void write_gains(JsonWriter& json, const identification::FeedforwardFit& fit) {
  json.object("gains", [&] {
    write_gain(json, "kS", fit.kS, "V");
    write_gain(json, "kV", fit.kV, fmt::format("V·s/{}", fit.unit));
    write_gain(json, "kA", fit.kA, fmt::format("V·s²/{}", fit.unit));
    if (fit.kG) {
      write_gain(json, "kG", *fit.kG, "V");
    }
    if (fit.angle_offset) {
      write_gain(json, "angle_offset", *fit.angle_offset, "rad");
    }
  });
}

void write_fit(JsonWriter& json, const identification::FeedforwardFit& fit) {
  json.add("mechanism", to_string(fit.mechanism));
  json.add("unit", fit.unit);
  write_gains(json, fit);
  json.object("fit", [&] {
    json.add("r_squared", fit.r_squared);
    json.add("velocity_nrmse", fit.velocity_nrmse);
    json.add("position_delay", fit.position_delay);
    json.add("velocity_delay", fit.velocity_delay);
    json.add("averaging_width", fit.averaging_width);
    json.add("iterations", fit.iterations);
  });
  if (fit.one_step) {
    json.object("one_step_regression", [&] {
      json.add("kS", fit.one_step->kS);
      json.add("kV", fit.one_step->kV);
      json.add("kA", fit.one_step->kA);
      json.add("r_squared", fit.one_step->r_squared);
      if (fit.kG) {
        json.add("kG", fit.one_step->kG);
      }
    });
  }
}

void write_source(JsonWriter& json, const LoadedRecording& source) {
  json.object("log", [&] {
    json.add("path", source.path);
    json.add("format", source.format);
    json.add("subject", source.subject);
    std::size_t rows = 0;
    for (const identification::TestRun& run : source.recording.runs) {
      rows += run.time.size();
    }
    json.add("rows", rows);
    json.list("runs", source.recording.runs, [&](const identification::TestRun& run) {
      json.object([&] {
        json.add("test", to_string(run.kind));
        json.add("rows", run.time.size());
        json.add("duration", run.time.empty() ? 0.0 : run.time.back() - run.time.front());
      });
    });
  });
}

void write_identify(JsonWriter& json, const IdentifyResult& result) {
  json.object([&] {
    json.add("schema", "flyball.identify/1");
    if (result.report.fit) {
      write_fit(json, *result.report.fit);
    } else {
      json.add("error", result.report.fit.error());
    }
    write_source(json, result.source);
    json.add("diagnostics", result.diagnostics());
  });
}

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
    json.list("grid", result.robustness, [&](const RobustnessPoint& point) {
      json.object([&] {
        json.add("inertia_factor", point.inertia_factor);
        json.add("gain_factor", point.gain_factor);
        json.add("stable", point.stable);
        json.add("spectral_radius", point.spectral_radius);
        json.add("overshoot", point.overshoot);
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
    json.add("tracking_error_rms", result.tracking_error_rms);
    json.add("tracking_error_max", result.tracking_error_max);
    json.add("seed", result.job.seed);
  });
}

void write_paste(JsonWriter& json, const DesignResult& result) {
  json.list("paste", result.paste, [&](const PasteGains& gains) {
    json.object([&] {
      json.add("per", gains.per);
      json.add("kP", gains.kP);
      json.add("kD", gains.kD);
      json.add("kS", gains.kS);
      json.add("kV", gains.kV);
      json.add("kA", gains.kA);
      json.add("kG", gains.kG);
    });
  });
}

void write_design(JsonWriter& json, const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  json.add("mechanism", to_string(plant.kind));
  json.add("unit", plant.unit);
  json.add("period", result.job.controller.period);
  json.add("delay", result.job.controller.delay.value_or(0.0));
  json.add("states", result.states);
  json.add("input", result.velocity_servo ? "velocity" : "voltage");
  json.add("K", result.K);
  json.add("K_delay_compensated", result.K_delayed);
  json.add("kalman_gain", result.kalman_gain);
  json.add("poles", result.poles);
  json.add("estimator_poles", result.estimator_poles);
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
  write_paste(json, result);
  json.add("diagnostics", result.diagnostics);
}

}  // namespace

std::string to_json(const IdentifyResult& result) {
  JsonWriter json;
  write_identify(json, result);
  return std::move(json).text();
}

std::string to_json(const DesignResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.design/1");
    write_design(json, result);
  });
  return std::move(json).text();
}

std::string to_json(const TuneResult& result) {
  const auto& fit = result.identification.report.fit;
  const bool designed = result.design && result.design->has_value();
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.tune/1");
    if (!fit) {
      json.add("error", fit.error());
    } else if (result.design && !designed) {
      json.add("error", result.design->error());
    }
    json.key("identification");
    write_identify(json, result.identification);
    if (designed) {
      json.object("design", [&] { write_design(json, **result.design); });
    } else {
      json.add("diagnostics", result.identification.diagnostics());
    }
  });
  return std::move(json).text();
}

std::string to_json(const Errors& errors, const std::string& schema) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", schema);
    json.add("error", static_cast<const Error&>(errors));
    if (errors.all().size() > 1) {
      json.add("errors", errors.all());
    }
    json.add("diagnostics", std::vector<Diagnostic>());
  });
  return std::move(json).text();
}

}  // namespace flyball::study
