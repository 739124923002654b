#include <flyball/study/schema.hpp>

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <flyball/core/version.hpp>

namespace flyball::study {

namespace {

using Json = nlohmann::ordered_json;
using identification::GainEstimate;
using mechanisms::MechanismKind;

// JSON has no infinity: it is a text, and what is not a number is null.
Json number(double value) {
  if (std::isnan(value)) {
    return nullptr;
  }
  if (std::isinf(value)) {
    return value > 0.0 ? "inf" : "-inf";
  }
  return value;
}

Json matrix(const Eigen::MatrixXd& M) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      row.push_back(number(M(i, j)));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Json complex_list(const Eigen::VectorXcd& values) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    list.push_back({number(values(i).real()), number(values(i).imag())});
  }
  return list;
}

Json diagnostics_json(const std::vector<Diagnostic>& diagnostics) {
  Json list = Json::array();
  for (const Diagnostic& diagnostic : diagnostics) {
    list.push_back({{"code", diagnostic.code},
                    {"severity", std::string(to_string(diagnostic.severity))},
                    {"message", diagnostic.message}});
  }
  return list;
}

Json error_json(const Error& error) {
  Json json = {{"code", std::string(error.code())}, {"message", to_string(error)}};
  for (const Evidence& evidence : error.evidence()) {
    if (json.contains(evidence.name)) {
      continue;
    }
    if (evidence.values.size() == 1) {
      json[evidence.name] = number(evidence.values.front());
    } else if (!evidence.values.empty()) {
      Json list = Json::array();
      for (const double value : evidence.values) {
        list.push_back(number(value));
      }
      json[evidence.name] = std::move(list);
    } else {
      json[evidence.name] = evidence.text;
    }
  }
  return json;
}

Json gain_json(const GainEstimate& gain, const std::string& unit) {
  if (!gain.determined) {
    return {{"value", nullptr},
            {"determined", false},
            {"unit", unit},
            {"upper_bound", number(gain.upper_bound)},
            {"reason", gain.reason}};
  }
  return {{"value", number(gain.value)},
          {"determined", true},
          {"unit", unit},
          {"standard_error", number(gain.standard_error)},
          {"interval", {number(gain.interval[0]), number(gain.interval[1])}}};
}

Json one_step_json(const identification::OneStepFit& fit, bool gravity) {
  Json json = {{"kS", number(fit.kS)},
               {"kV", number(fit.kV)},
               {"kA", number(fit.kA)},
               {"r_squared", number(fit.r_squared)}};
  if (gravity) {
    json["kG"] = number(fit.kG);
  }
  return json;
}

Json source_json(const LoadedRecording& source) {
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
    json["error"] = error_json(result.report.fit.error());
    json["log"] = source_json(result.source);
    json["diagnostics"] = diagnostics_json(result.diagnostics());
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
  json["fit"] = {{"r_squared", number(fit.r_squared)},
                 {"velocity_nrmse", number(fit.velocity_nrmse)},
                 {"position_delay", number(fit.position_delay)},
                 {"velocity_delay", number(fit.velocity_delay)},
                 {"averaging_width", number(fit.averaging_width)},
                 {"iterations", fit.iterations}};
  if (fit.one_step) {
    json["one_step_regression"] = one_step_json(*fit.one_step, fit.kG.has_value());
  }
  json["log"] = source_json(result.source);
  json["diagnostics"] = diagnostics_json(result.diagnostics());
  return json;
}

Json design_body(const DesignResult& result) {
  const PlantDescription& plant = result.job.plant;
  const mechanisms::FeedforwardGains& gains = plant.gains;
  Json paste = Json::array();
  for (const PasteGains& entry : result.paste) {
    paste.push_back({{"per", entry.per},
                     {"kP", number(entry.kP)},
                     {"kD", number(entry.kD)},
                     {"kS", number(entry.kS)},
                     {"kV", number(entry.kV)},
                     {"kA", number(entry.kA)},
                     {"kG", number(entry.kG)}});
  }
  Json grid = Json::array();
  for (const RobustnessPoint& point : result.robustness) {
    grid.push_back({{"inertia_factor", number(point.inertia_factor)},
                    {"gain_factor", number(point.gain_factor)},
                    {"stable", point.stable},
                    {"spectral_radius", number(point.spectral_radius)},
                    {"overshoot", number(point.overshoot)}});
  }
  Json feedforward = {{"kS", number(gains.kS)},
                      {"kV", number(gains.kV)},
                      {"kA", plant.kA_determined ? number(gains.kA) : Json(nullptr)},
                      {"kG", number(gains.kG)},
                      {"plant_inversion", matrix(result.inversion)}};
  if (plant.kind == MechanismKind::arm) {
    feedforward["angle_offset"] = number(gains.angle_offset);
  }
  return {
      {"mechanism", std::string(to_string(plant.kind))},
      {"unit", plant.unit},
      {"period", number(result.job.controller.period)},
      {"delay", number(result.job.controller.delay.value_or(0.0))},
      {"states", result.states},
      {"input", result.velocity_servo ? "velocity" : "voltage"},
      {"K", matrix(result.K)},
      {"K_delay_compensated", matrix(result.K_delayed)},
      {"kalman_gain", matrix(result.kalman_gain)},
      {"poles", complex_list(result.poles)},
      {"estimator_poles", complex_list(result.estimator_poles)},
      {"feedforward", std::move(feedforward)},
      {"margins",
       {{"gain_margin", number(result.margins.gain_margin)},
        {"gain_reduction", number(result.margins.gain_reduction)},
        {"phase_margin", number(result.margins.phase_margin)},
        {"delay_margin", number(result.margins.delay_margin)},
        {"disk_margin", number(result.margins.disk_margin)},
        {"crossover", number(result.margins.crossover)}}},
      {"robustness",
       {{"stable", result.robust},
        {"worst_overshoot", number(result.worst_overshoot)},
        {"grid", std::move(grid)}}},
      {"motion",
       {{"max_velocity", number(result.motion.max_velocity)},
        {"max_acceleration", number(result.motion.max_acceleration)},
        {"goal", number(result.motion.goal)},
        {"duration", number(result.motion.duration)},
        {"voltage_reserve", number(result.motion.voltage_reserve)}}},
      {"simulation",
       {{"tracking_error_rms", number(result.tracking_error_rms)},
        {"tracking_error_max", number(result.tracking_error_max)},
        {"seed", result.job.seed}}},
      {"plant",
       {{"A", matrix(result.A)},
        {"B", matrix(result.B)},
        {"C", matrix(result.C)},
        {"A_continuous", matrix(result.A_continuous)},
        {"B_continuous", matrix(result.B_continuous)}}},
      {"weights", {{"Q", matrix(result.Q)}, {"R", matrix(result.R)}}},
      {"paste", std::move(paste)},
      {"diagnostics", diagnostics_json(result.diagnostics)},
  };
}

std::string dump(const Json& json) {
  // Log texts may hold bytes that are not UTF-8; they must not throw here.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
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
    json["error"] = error_json(result.identification.report.fit.error());
  } else if (!designed && result.design) {
    json["error"] = error_json(result.design->error());
  }
  json["identification"] = identify_json(result.identification);
  if (designed) {
    json["design"] = design_body(**result.design);
  } else {
    json["diagnostics"] = json["identification"]["diagnostics"];
  }
  return dump(json);
}

std::string to_json(const Error& error, const std::string& schema) {
  return dump({{"schema", schema}, {"error", error_json(error)}, {"diagnostics", Json::array()}});
}

}  // namespace flyball::study
