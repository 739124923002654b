#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include <flyball/report/terminal.hpp>

#include "report/format.hpp"
#include "report/render_terminal.hpp"

namespace flyball::report {

namespace {

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
    std::size_t at = 0;
    while (entry.name == name && at < entry.aliases.size()) {
      const std::size_t end = std::min(entry.aliases.find(',', at), entry.aliases.size());
      const std::string_view alias = entry.aliases.substr(at, end - at);
      if (folded(alias) != folded(name)) {
        others += (others.empty() ? "" : ", ") + std::string(alias);
      }
      at = end + 1;
    }
  }
  return others;
}

}  // namespace

std::string motors_to_terminal(std::span<const mechanisms::DcMotor> motors,
                               const TerminalStyle& style) {
  Table table;
  table.header = {"motor",  "V",    "rpm",      "stall N·m", "stall A",
                  "free A", "R mΩ", "Kt N·m/A", "Kv rad/s/V"};
  bool any_alias = false;
  for (const mechanisms::DcMotor& motor : motors) {
    any_alias = any_alias || !aliases_of(motor.name).empty();
  }
  if (any_alias) {
    table.header.emplace_back("also");
    table.wide_column = table.header.size() - 1;
  }
  for (const mechanisms::DcMotor& motor : motors) {
    const std::string name =
        motor.count == 1 ? motor.name : fmt::format("{} {}", motor.count, motor.name);
    const double rpm = motor.free_speed * 30.0 / std::numbers::pi;
    table.rows.push_back({name, number(motor.nominal_voltage), number(rpm, 6),
                          number(motor.stall_torque), number(motor.stall_current),
                          number(motor.free_current), number(1e3 * motor.R), number(motor.Kt),
                          number(motor.Kv), aliases_of(motor.name)});
  }
  return render_table(table, style) +
         "\n  rpm: free speed. n motors in one gearbox have n times the torque and current, R/n, "
         "the "
         "same\n  Kt and Kv. Names are read without case, spaces and punctuation.\n";
}

}  // namespace flyball::report
