#include <flyball/study/schema.hpp>

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "io/json.hpp"

namespace flyball::study {

namespace {

using Json = nlohmann::ordered_json;
using identification::GainEstimate;
using mechanisms::MechanismKind;

Json matrix(const Eigen::MatrixXd& M) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      row.push_back(json_of(M(i, j)));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Json complex_list(const Eigen::VectorXcd& values) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    list.push_back({json_of(values(i).real()), json_of(values(i).imag())});
  }
  return list;
}

Json gain_json(const GainEstimate& gain, const std::string& unit) {
  if (!gain.determined) {
    return {{"value", nullptr},
            {"determined", false},
            {"unit", unit},
            {"upper_bound", json_of(gain.upper_bound)},
            {"reason", gain.reason}};
  }
  return {{"value", json_of(gain.value)},
          {"determined", true},
          {"unit", unit},
          {"standard_error", json_of(gain.standard_error)},
          {"interval", {json_of(gain.interval[0]), json_of(gain.interval[1])}}};
}

Json one_step_json(const identification::OneStepFit& fit, bool gravity) {
  Json json = {{"kS", json_of(fit.kS)},
               {"kV", json_of(fit.kV)},
               {"kA", json_of(fit.kA)},
               {"r_squared", json_of(fit.r_squared)}};
  if (gravity) {
    json["kG"] = json_of(fit.kG);
  }
  return json;
}

Json source_json(const recording::LoadedRecording& source) {
  std::size_t rows = 0;
  Json runs = Json::array();
  for (const identification::TestRun& run : source.recording.runs) {
    rows += run.time.size();
    runs.push_back({{"test", std::string(to_string(run.kind))},
                    {"rows", run.time.size()},
                    {"duration", run.time.empty() ? 0.0 : run.time.back() - run.time.front()}});
  }
  return {{"path", source.path},
          {"format", source.format},
          {"subject", source.subject},
          {"rows", rows},
          {"runs", std::move(runs)}};
}

Json identify_json(const IdentifyResult& result) {
  Json json = {{"schema", "flyball.identify/1"}};
  if (!result.report.fit) {
    json["error"] = json_of(result.report.fit.error());
    json["log"] = source_json(result.source);
    json["diagnostics"] = json_of(result.diagnostics());
    return json;
  }
  const identification::FeedforwardFit& fit = *result.report.fit;
  const std::string& unit = fit.unit;
  json["mechanism"] = std::string(to_string(fit.mechanism));
  json["unit"] = unit;
  Json gains = {{"kS", gain_json(fit.kS, "V")},
                {"kV", gain_json(fit.kV, fmt::format("V·s/{}", unit))},
                {"kA", gain_json(fit.kA, fmt::format("V·s²/{}", unit))}};
  if (fit.kG) {
    gains["kG"] = gain_json(*fit.kG, "V");
  }
  if (fit.angle_offset) {
    gains["angle_offset"] = gain_json(*fit.angle_offset, "rad");
  }
  json["gains"] = std::move(gains);
  json["fit"] = {{"r_squared", json_of(fit.r_squared)},
                 {"velocity_nrmse", json_of(fit.velocity_nrmse)},
                 {"position_delay", json_of(fit.position_delay)},
                 {"velocity_delay", json_of(fit.velocity_delay)},
                 {"averaging_width", json_of(fit.averaging_width)},
                 {"iterations", fit.iterations}};
  if (fit.one_step) {
    json["one_step_regression"] = one_step_json(*fit.one_step, fit.kG.has_value());
  }
  json["log"] = source_json(result.source);
  json["diagnostics"] = json_of(result.diagnostics());
  return json;
}

Json design_body(const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  const mechanisms::FeedforwardGains& gains = plant.gains;
  Json paste = Json::array();
  for (const PasteGains& entry : result.paste) {
    paste.push_back({{"per", entry.per},
                     {"kP", json_of(entry.kP)},
                     {"kD", json_of(entry.kD)},
                     {"kS", json_of(entry.kS)},
                     {"kV", json_of(entry.kV)},
                     {"kA", json_of(entry.kA)},
                     {"kG", json_of(entry.kG)}});
  }
  Json grid = Json::array();
  for (const RobustnessPoint& point : result.robustness) {
    grid.push_back({{"inertia_factor", json_of(point.inertia_factor)},
                    {"gain_factor", json_of(point.gain_factor)},
                    {"stable", point.stable},
                    {"spectral_radius", json_of(point.spectral_radius)},
                    {"overshoot", json_of(point.overshoot)}});
  }
  Json feedforward = {{"kS", json_of(gains.kS)},
                      {"kV", json_of(gains.kV)},
                      {"kA", plant.kA_determined ? json_of(gains.kA) : Json(nullptr)},
                      {"kG", json_of(gains.kG)},
                      {"plant_inversion", matrix(result.inversion)}};
  if (plant.kind == MechanismKind::arm) {
    feedforward["angle_offset"] = json_of(gains.angle_offset);
  }
  return {
      {"mechanism", std::string(to_string(plant.kind))},
      {"unit", plant.unit},
      {"period", json_of(result.job.controller.period)},
      {"delay", json_of(result.job.controller.delay.value_or(0.0))},
      {"states", result.states},
      {"input", result.velocity_servo ? "velocity" : "voltage"},
      {"K", matrix(result.K)},
      {"K_delay_compensated", matrix(result.K_delayed)},
      {"kalman_gain", matrix(result.kalman_gain)},
      {"poles", complex_list(result.poles)},
      {"estimator_poles", complex_list(result.estimator_poles)},
      {"feedforward", std::move(feedforward)},
      {"margins",
       {{"gain_margin", json_of(result.margins.gain_margin)},
        {"gain_reduction", json_of(result.margins.gain_reduction)},
        {"phase_margin", json_of(result.margins.phase_margin)},
        {"delay_margin", json_of(result.margins.delay_margin)},
        {"disk_margin", json_of(result.margins.disk_margin)},
        {"crossover", json_of(result.margins.crossover)}}},
      {"robustness",
       {{"stable", result.robust},
        {"worst_overshoot", json_of(result.worst_overshoot)},
        {"grid", std::move(grid)}}},
      {"motion",
       {{"max_velocity", json_of(result.motion.max_velocity)},
        {"max_acceleration", json_of(result.motion.max_acceleration)},
        {"goal", json_of(result.motion.goal)},
        {"duration", json_of(result.motion.duration)},
        {"voltage_reserve", json_of(result.motion.voltage_reserve)}}},
      {"simulation",
       {{"tracking_error_rms", json_of(result.tracking_error_rms)},
        {"tracking_error_max", json_of(result.tracking_error_max)},
        {"seed", result.job.seed}}},
      {"plant",
       {{"A", matrix(result.A)},
        {"B", matrix(result.B)},
        {"C", matrix(result.C)},
        {"A_continuous", matrix(result.A_continuous)},
        {"B_continuous", matrix(result.B_continuous)}}},
      {"weights", {{"Q", matrix(result.Q)}, {"R", matrix(result.R)}}},
      {"paste", std::move(paste)},
      {"diagnostics", json_of(result.diagnostics)},
  };
}

}  // namespace

std::string to_json(const IdentifyResult& result) {
  return dump(identify_json(result));
}

std::string to_json(const DesignResult& result) {
  Json json = {{"schema", "flyball.design/1"}};
  json.update(design_body(result));
  return dump(json);
}

std::string to_json(const TuneResult& result) {
  Json json = {{"schema", "flyball.tune/1"}};
  const bool fitted = result.identification.report.fit.has_value();
  const bool designed = result.design.has_value() && result.design->has_value();
  if (!fitted) {
    json["error"] = json_of(result.identification.report.fit.error());
  } else if (!designed && result.design) {
    json["error"] = json_of(result.design->error());
  }
  json["identification"] = identify_json(result.identification);
  if (designed) {
    json["design"] = design_body(**result.design);
  } else {
    json["diagnostics"] = json["identification"]["diagnostics"];
  }
  return dump(json);
}

std::string to_json(const Errors& errors, const std::string& schema) {
  Json json = {{"schema", schema}, {"error", json_of(errors)}};
  if (errors.all().size() > 1) {
    for (const QuotedError& error : errors.all()) {
      json["errors"].push_back(json_of(error));
    }
  }
  json["diagnostics"] = Json::array();
  return dump(json);
}

}  // namespace flyball::study
