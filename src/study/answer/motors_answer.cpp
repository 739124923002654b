#include <algorithm>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/json_writer.hpp>
#include <flyball/study/motors.hpp>

#include "core/wording.hpp"

namespace flyball::study {

namespace {

using mechanisms::DcMotor;

std::string folded(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if ((c >= '0' && c <= '9') || (c >= 'a' && c <= 'z')) {
      out += c;
    } else if (c >= 'A' && c <= 'Z') {
      out += static_cast<char>(c - 'A' + 'a');
    }
  }
  return out;
}

/// Other names that say more than another way of writing the name.
std::string aliases_of(const std::string& name) {
  std::string others;
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    if (entry.name != name) {
      continue;
    }
    for (const std::string_view alias : text::split(entry.aliases, ",")) {
      if (folded(alias) != folded(name)) {
        others += (others.empty() ? "" : ", ") + std::string(alias);
      }
    }
  }
  return others;
}

std::string to_json(std::span<const DcMotor> motors) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", "flyball.motors/1");
    json.list("motors", motors, [&](const DcMotor& motor) {
      json.object([&] {
        json.add("name", motor.name);
        json.add({{"nominal_voltage", motor.nominal_voltage},
                  {"stall_torque", motor.stall_torque},
                  {"stall_current", motor.stall_current},
                  {"free_current", motor.free_current},
                  {"free_speed", motor.free_speed},
                  {"R", motor.R},
                  {"Kt", motor.Kt},
                  {"Kv", motor.Kv}});
      });
    });
  });
  return std::move(json).text();
}

Table table_of(std::span<const DcMotor> motors) {
  Table table;
  table.header = {"motor",  "V",    "rpm",      "stall N·m", "stall A",
                  "free A", "R mΩ", "Kt N·m/A", "Kv rad/s/V"};
  if (std::any_of(motors.begin(), motors.end(),
                  [](const DcMotor& motor) { return !aliases_of(motor.name).empty(); })) {
    table.header.emplace_back("also");
    table.wide_column = table.header.size() - 1;
  }
  const auto cell = [](double value, const char* unit, int digits = 4) {
    return quantity(value, unit, digits, /*shown=*/false);
  };
  for (const DcMotor& motor : motors) {
    table.rows.push_back(
        {motor.count == 1 ? motor.name : fmt::format("{} {}", motor.count, motor.name),
         cell(motor.nominal_voltage, "V"),
         cell(motor.free_speed * 30.0 / std::numbers::pi, "rpm", 6),
         cell(motor.stall_torque, "N·m"), cell(motor.stall_current, "A"),
         cell(motor.free_current, "A"), cell(1e3 * motor.R, "mΩ"), cell(motor.Kt, "N·m/A"),
         cell(motor.Kv, "rad/s/V"), aliases_of(motor.name)});
  }
  return table;
}

}  // namespace

Answer answer_of(std::span<const DcMotor> motors) {
  Answer answer{.schema = "flyball.motors/1", .json = to_json(motors)};
  answer.document.sections = {
      {"motors",
       "",
       {table_of(motors),
        Paragraph{"rpm: free speed. n motors in one gearbox have n times the torque and current, "
                  "R/n, the same Kt and Kv. Names are read without case, spaces and "
                  "punctuation."}}}};
  return answer;
}

}  // namespace flyball::study
