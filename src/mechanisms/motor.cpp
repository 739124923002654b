#include <flyball/mechanisms/motor.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::mechanisms {

namespace {

constexpr std::array table{
    MotorTableEntry{"CIM", "", 12, 2.42, 133, 2.7, 5310},
    MotorTableEntry{"MiniCIM", "Mini CIM", 12, 1.41, 89, 3, 5840},
    MotorTableEntry{"BAG", "", 12, 0.43, 53, 1.8, 13180},
    MotorTableEntry{"775pro", "Vex775Pro", 12, 0.71, 134, 0.7, 18730},
    MotorTableEntry{"AndyMark RS775-125", "RS775_125", 12, 0.28, 18, 1.6, 5800},
    MotorTableEntry{"BaneBots RS-775", "BanebotsRS775", 12, 0.72, 97, 2.7, 13050},
    MotorTableEntry{"AndyMark 9015", "Andymark9015", 12, 0.36, 71, 3.7, 14270},
    MotorTableEntry{"BaneBots RS-550", "BanebotsRS550", 12, 0.38, 84, 0.4, 19000},
    MotorTableEntry{"NEO", "", 12, 2.6, 105, 1.8, 5676},
    MotorTableEntry{"NEO 550", "", 12, 0.97, 100, 1.4, 11000},
    MotorTableEntry{"NEO Vortex", "NeoVortex", 12, 3.60, 211, 3.615, 6784},
    MotorTableEntry{"Falcon 500", "", 12, 4.69, 257, 1.5, 6380},
    MotorTableEntry{"Falcon 500 FOC", "", 12, 5.84, 304, 1.5, 6080},
    MotorTableEntry{"Kraken X60", "", 12, 7.09, 366, 2, 6000},
    MotorTableEntry{"Kraken X60 FOC", "", 12, 9.37, 483, 2, 5800},
    MotorTableEntry{"Kraken X44", "", 12, 4.11, 279, 2, 7758},
    MotorTableEntry{"Kraken X44 FOC", "", 12, 5.01, 329, 2, 7368},
    MotorTableEntry{"Minion", "", 12, 3.17, 211, 2, 7704},
    MotorTableEntry{"Romi built-in", "RomiBuiltIn", 4.5, 0.1765, 1.25, 0.13, 150},
};

std::string fold(std::string_view text) {
  std::string folded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) {
      folded += static_cast<char>(std::tolower(byte));
    }
  }
  return folded;
}

std::vector<std::string> folded_names(const MotorTableEntry& entry) {
  std::vector<std::string> names{fold(entry.name)};
  for (const std::string_view alias : text::split(entry.aliases, ",")) {
    names.push_back(fold(alias));
  }
  return names;
}

/// Whether a folded text is words of a name: "vortex" of "NEO Vortex", not "neo5" of "NEO 550".
bool is_words_of(std::string_view name, std::string_view wanted) {
  std::string folded;
  std::vector<std::size_t> bounds{0};
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) == 0) {
      bounds.push_back(folded.size());
      continue;
    }
    if (!folded.empty() && (std::isdigit(byte) != 0) !=
                               (std::isdigit(static_cast<unsigned char>(folded.back())) != 0)) {
      bounds.push_back(folded.size());
    }
    folded += static_cast<char>(std::tolower(byte));
  }
  bounds.push_back(folded.size());
  const auto is_bound = [&](std::size_t at) {
    return std::find(bounds.begin(), bounds.end(), at) != bounds.end();
  };
  for (std::size_t at = folded.find(wanted); at != std::string::npos;
       at = folded.find(wanted, at + 1)) {
    if (is_bound(at) && is_bound(at + wanted.size())) {
      return true;
    }
  }
  return false;
}

MotorDatasheet datasheet(const MotorTableEntry& entry) {
  return {.nominal_voltage = Voltage(entry.nominal_voltage),
          .stall_torque = Torque(entry.stall_torque),
          .stall_current = Current(entry.stall_current),
          .free_current = Current(entry.free_current),
          .free_speed = AngularVelocity(entry.free_speed_rpm * std::numbers::pi / 30.0)};
}

DcMotor from_datasheet(std::string_view name, const MotorDatasheet& one, int count) {
  const double n = count;
  DcMotor motor;
  motor.name = name;
  motor.count = count;
  motor.nominal_voltage = one.nominal_voltage.si();
  motor.stall_torque = n * one.stall_torque.si();
  motor.stall_current = n * one.stall_current.si();
  motor.free_current = n * one.free_current.si();
  motor.free_speed = one.free_speed.si();
  motor.R = motor.nominal_voltage / motor.stall_current;
  motor.Kt = motor.stall_torque / motor.stall_current;
  motor.Kv = motor.free_speed / (motor.nominal_voltage - motor.R * motor.free_current);
  return motor;
}

DcMotor table_motor(std::string_view name, int count) {
  const auto entry = std::find_if(table.begin(), table.end(),
                                  [&](const MotorTableEntry& e) { return e.name == name; });
  return from_datasheet(entry->name, datasheet(*entry), count);
}

Expected<void> check_count(int count) {
  if (count >= 1) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, "motor", "motor count")
      .got(std::to_string(count))
      .expected("at least 1");
}

}  // namespace

std::span<const MotorTableEntry> motor_table() {
  return table;
}

Expected<DcMotor> motor(std::string_view name, const MotorDatasheet& one, int count) {
  constexpr std::string_view where = "motor";
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_count(count); })
                    .positive(one.nominal_voltage.si(), "nominal_voltage", "V")
                    .positive(one.stall_torque.si(), "stall_torque", "N m")
                    .positive(one.stall_current.si(), "stall_current", "A")
                    .not_negative(one.free_current.si(), "free_current", "A")
                    .positive(one.free_speed.si(), "free_speed", "rad/s"));
  if (one.free_current >= one.stall_current) {
    return refusal(ArgumentError::out_of_range, where, "free_current")
        .got(to_text(one.free_current))
        .expected(
            flyball::detail::format("below the stall current ({})", to_text(one.stall_current)));
  }
  DcMotor result = from_datasheet(name, one, count);
  // Numbers can have quotients that are none: 1e300 V / 1e-300 A.
  return Checks(where)
      .positive(result.R, "R", "Ohm")
      .positive(result.Kt, "Kt", "N m/A")
      .positive(result.Kv, "Kv", "rad/s/V")
      .map([&] { return std::move(result); });
}

std::vector<std::string_view> motors_like(std::string_view part) {
  const std::string wanted = fold(part);
  std::vector<std::string_view> names;
  for (const MotorTableEntry& entry : table) {
    const std::vector<std::string> known = folded_names(entry);
    if (!wanted.empty() && std::any_of(known.begin(), known.end(), [&](const std::string& one) {
          return one.find(wanted) != std::string::npos;
        })) {
      names.push_back(entry.name);
    }
  }
  return names;
}

Expected<DcMotor> motor(std::string_view name, int count) {
  FLYBALL_CHECK(check_count(count));
  const std::string wanted = fold(name);
  for (const MotorTableEntry& entry : table) {
    for (const std::string& known : folded_names(entry)) {
      if (known == wanted) {
        return from_datasheet(entry.name, datasheet(entry), count);
      }
    }
  }
  if (const auto candidates = motors_like(name); candidates.size() > 1) {
    return refusal(ArgumentError::ambiguous_name, {}, "motor")
        .got(flyball::detail::format("\"{}\", which fits several", name))
        .expected(flyball::detail::format("one of {}",
                                          flyball::detail::comma_separated("{}", candidates)));
  } else if (candidates.size() == 1 && is_words_of(candidates.front(), wanted)) {
    return table_motor(candidates.front(), count);
  } else if (candidates.size() == 1) {
    return refusal(ArgumentError::unknown_name, {}, "motor")
        .got(flyball::detail::format("\"{}\", which is not in the table", name))
        .hint(flyball::detail::format("is it \"{}\"?", candidates.front()));
  }
  std::vector<std::string_view> names;
  names.reserve(table.size());
  for (const MotorTableEntry& entry : table) {
    names.push_back(entry.name);
  }
  const std::string nearest = nearest_name(name, names);
  return refusal(ArgumentError::unknown_name, {}, "motor")
      .got(flyball::detail::format("\"{}\", which is not in the table", name))
      .hint(nearest.empty()
                ? flyball::detail::format(
                      "known motors are {}; another one can be given by its five datasheet numbers",
                      flyball::detail::comma_separated("{}", names))
                : flyball::detail::format("did you mean \"{}\"?", nearest));
}

DcMotor cim(int count) {
  return table_motor("CIM", count);
}
DcMotor mini_cim(int count) {
  return table_motor("MiniCIM", count);
}
DcMotor bag(int count) {
  return table_motor("BAG", count);
}
DcMotor vex_775pro(int count) {
  return table_motor("775pro", count);
}
DcMotor neo(int count) {
  return table_motor("NEO", count);
}
DcMotor neo_550(int count) {
  return table_motor("NEO 550", count);
}
DcMotor neo_vortex(int count) {
  return table_motor("NEO Vortex", count);
}
DcMotor falcon_500(int count) {
  return table_motor("Falcon 500", count);
}
DcMotor falcon_500_foc(int count) {
  return table_motor("Falcon 500 FOC", count);
}
DcMotor kraken_x60(int count) {
  return table_motor("Kraken X60", count);
}
DcMotor kraken_x60_foc(int count) {
  return table_motor("Kraken X60 FOC", count);
}
DcMotor kraken_x44(int count) {
  return table_motor("Kraken X44", count);
}
DcMotor kraken_x44_foc(int count) {
  return table_motor("Kraken X44 FOC", count);
}
DcMotor minion(int count) {
  return table_motor("Minion", count);
}

}  // namespace flyball::mechanisms
