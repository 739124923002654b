// What dynamometers say of motors, beside the table.
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/json_writer.hpp>
#include <flyball/study/motor_curves.hpp>

#include "core/wording.hpp"
#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::GainEstimate;
using text::number;
using text::percent;

constexpr const char* motor_curves_schema = "flyball.motor-curves/1";
constexpr double rpm = 30.0 / std::numbers::pi;

void write_gain(JsonWriter& json, std::string_view name, const GainEstimate& gain) {
  json.object(name, [&] {
    json.add({{"value", gain.value}, {"low", gain.interval[0]}, {"high", gain.interval[1]}});
  });
}

std::string to_json(const MotorCurvesResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", motor_curves_schema);
    json.list("files", result.files, [&](const MotorCurveFile& file) {
      json.object([&] {
        json.add("file", file.source);
        json.add("test", file.curve ? "curve" : "locked_rotor");
        json.add("rows", file.rows);
        json.add({{"voltage", file.voltage}});
        if (file.known) {
          json.add("motor", file.known->name);
        }
        write_gain(json, "R", file.curve ? file.curve->R : file.locked->R);
        write_gain(json, "Kt", file.curve ? file.curve->Kt : file.locked->Kt);
        if (file.curve) {
          write_gain(json, "Kv", file.curve->Kv);
          json.add({{"stall_torque", file.curve->motor.stall_torque},
                    {"stall_current", file.curve->motor.stall_current},
                    {"free_current", file.curve->motor.free_current},
                    {"free_speed", file.curve->motor.free_speed},
                    {"torque_deviation", file.curve->torque_deviation},
                    {"current_deviation", file.curve->current_deviation}});
        } else {
          json.add({{"R_rise", file.locked->R_rise}});
          if (file.locked->heat_capacity.determined) {
            write_gain(json, "heat_capacity", file.locked->heat_capacity);
          }
        }
      });
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

/// Value, half of its interval, and by how much it is off the table's.
void add_constant(Table& table, std::string name, const GainEstimate& gain, double scale,
                  const char* unit, std::optional<double> known) {
  const double half = 0.5 * (gain.interval[1] - gain.interval[0]);
  table.rows.push_back({std::move(name), quantity(scale * gain.value, unit, 6, false),
                        Value("± " + number(scale * half, 2)),
                        known ? quantity(scale * *known, unit, 5, false) : Value("none"),
                        known ? Value(percent(gain.value / *known - 1.0)) : Value(""), unit});
}

void add_number(Table& table, std::string name, double value, const char* unit,
                std::optional<double> known) {
  table.rows.push_back({std::move(name), quantity(value, unit, 6, false), Value(""),
                        known ? quantity(*known, unit, 5, false) : Value("none"),
                        known ? Value(percent(value / *known - 1.0)) : Value(""), unit});
}

Section file_section(const MotorCurveFile& file, std::size_t index) {
  Table table;
  table.header = {"constant", "measured", "95 %", "the table", "off", "unit"};
  table.words = {0, 5};
  const auto& known = file.known;
  const auto of = [&](double mechanisms::DcMotor::* member) {
    return known ? std::optional(known.value().*member) : std::nullopt;
  };
  const GainEstimate& R = file.curve ? file.curve->R : file.locked->R;
  const GainEstimate& Kt = file.curve ? file.curve->Kt : file.locked->Kt;
  add_constant(table, "R", R, 1e3, "mΩ", of(&mechanisms::DcMotor::R));
  add_constant(table, "Kt", Kt, 1.0, "N·m/A", of(&mechanisms::DcMotor::Kt));
  std::string words;
  if (file.curve) {
    const mechanisms::DcMotor& motor = file.curve->motor;
    add_constant(table, "Kv", file.curve->Kv, 1.0, "rad/s/V", of(&mechanisms::DcMotor::Kv));
    add_number(table, "stall torque", motor.stall_torque, "N·m",
               of(&mechanisms::DcMotor::stall_torque));
    add_number(table, "stall current", motor.stall_current, "A",
               of(&mechanisms::DcMotor::stall_current));
    add_number(table, "free current", motor.free_current, "A",
               of(&mechanisms::DcMotor::free_current));
    add_number(table, "free speed", rpm * motor.free_speed, "rpm",
               known ? std::optional(rpm * known->free_speed) : std::nullopt);
    words = fmt::format(
        "A motor curve of {} rows at {} V; torque and current are off their straight lines by {} "
        "and {} of their values at stall.",
        file.rows, number(file.voltage, 4), percent(file.curve->torque_deviation, 2),
        percent(file.curve->current_deviation, 2));
  } else {
    if (file.locked->heat_capacity.determined) {
      add_constant(table, "heat capacity", file.locked->heat_capacity, 1.0, "J/K", std::nullopt);
    }
    words = fmt::format(
        "A locked rotor at {} V, the first {} of {} rows, until the current changes by a fifth. R "
        "is that of the first row; until the last of these it rises by {}.",
        number(file.voltage, 4), file.locked->rows, file.rows, percent(file.locked->R_rise, 2));
  }
  return {fmt::format("file-{}", index + 1),
          known ? fmt::format("{}: {}", known->name, file.source) : file.source,
          {Paragraph{std::move(words)}, std::move(table)}};
}

}  // namespace

Answer answer_of(const MotorCurvesResult& result) {
  Answer answer{.schema = motor_curves_schema, .json = to_json(result)};
  answer.document.title = "Constants of motors";
  for (std::size_t i = 0; i < result.files.size(); ++i) {
    answer.document.sections.push_back(file_section(result.files[i], i));
  }
  if (!result.diagnostics.empty()) {
    answer.document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  return answer;
}

}  // namespace flyball::study
