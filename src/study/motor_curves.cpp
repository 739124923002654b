#include <flyball/study/motor_curves.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::string_view in_motor_curves = "motor-curves";

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// A column in SI, by its row.
struct CurveColumn {
  std::string name;
  std::map<Index, double> rows{};

  [[nodiscard]] bool empty() const { return rows.empty(); }
};

/// The first column whose name has one of the words, in SI; none where there is no such name.
/// @param dimension  Of its unit, if any; nothing where the unit has none that is known (W, %).
Expected<CurveColumn> column_of(const Log& log, std::initializer_list<std::string_view> words,
                                std::optional<Dimension> dimension, double factor_if_bare) {
  for (const Signal& signal : log.signals) {
    const std::string name = lower_case(signal.name);
    if (std::none_of(words.begin(), words.end(),
                     [&](std::string_view word) { return name.find(word) != std::string::npos; })) {
      continue;
    }
    double factor = factor_if_bare;
    if (dimension && !signal.unit.empty()) {
      const auto unit = parse_unit(signal.unit);
      if (!unit || unit->dimension != *dimension) {
        return refusal(ArgumentError::wrong_unit, in_motor_curves,
                       "the column \"" + signal.name + "\"")
            .got("in \"" + signal.unit + "\"")
            .expected(fmt::format("a {}", to_string(*dimension)));
      }
      factor = unit->factor;
    }
    CurveColumn column{.name = signal.name};
    for (std::size_t k = 0; k < signal.value.size(); ++k) {
      // The rows' times are their numbers.
      column.rows.emplace(static_cast<Index>(std::lround(signal.time[k])),
                          factor * signal.value[k]);
    }
    return column;
  }
  return CurveColumn{};
}

/// The rows that all columns have.
std::vector<VectorXd> rows_of(std::initializer_list<const CurveColumn*> columns) {
  std::vector<Index> common;
  for (const auto& [row, value] : (*columns.begin())->rows) {
    if (std::all_of(columns.begin(), columns.end(), [row = row](const CurveColumn* column) {
          return column->rows.find(row) != column->rows.end();
        })) {
      common.push_back(row);
    }
  }
  std::vector<VectorXd> all;
  for (const CurveColumn* column : columns) {
    VectorXd values(static_cast<Index>(common.size()));
    for (std::size_t k = 0; k < common.size(); ++k) {
      values(static_cast<Index>(k)) = column->rows.at(common[k]);
    }
    all.push_back(std::move(values));
  }
  return all;
}

Error no_column(std::string_view what, const Log& log) {
  std::vector<std::string> names;
  for (const Signal& signal : log.signals) {
    names.push_back("\"" + signal.name + "\"");
  }
  return Error(refusal(ArgumentError::empty, in_motor_curves, std::string(what))
                   .got(names.size() < 2
                            ? std::string("not there: this is no table of numbers")
                            : fmt::format("not there, among {}", fmt::join(names, ", ")))
                   .expected("speed, torque and current (a motor curve), or time, voltage, torque "
                             "and current (a locked rotor)"));
}

/// The motor of the table whose name the file's begins with.
std::optional<mechanisms::DcMotor> motor_of_file(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  const std::string name = lower_case(slash == std::string::npos ? path : path.substr(slash + 1));
  std::optional<mechanisms::DcMotor> found;
  std::size_t longest = 0;
  for (const mechanisms::MotorTableEntry& entry : mechanisms::motor_table()) {
    const std::string known = lower_case(std::string(entry.name));
    if (known.size() > longest && name.starts_with(known)) {
      longest = known.size();
      found = mechanisms::motor(entry.name).value();
    }
  }
  return found;
}

Expected<void> fit_curve(const Log& log, const CurveColumn& speed, const CurveColumn& torque,
                         const CurveColumn& current, const MotorCurvesJob& job,
                         MotorCurveFile& file, std::vector<Diagnostic>& diagnostics) {
  const auto rows = rows_of({&speed, &torque, &current});
  identification::MotorCurve curve{0.0, rows[0], rows[1], rows[2]};
  FLYBALL_TRY(const CurveColumn power,
              column_of(log, {"supplied power", "input power"}, std::nullopt, 1.0));
  if (job.voltage) {
    curve.voltage = *job.voltage;
  } else if (!power.empty()) {
    const auto both = rows_of({&power, &current});
    std::vector<double> ratios;
    for (Index k = 0; k < both[0].size(); ++k) {
      if (both[1](k) > 0.0) {
        ratios.push_back(both[0](k) / both[1](k));
      }
    }
    if (!ratios.empty()) {
      const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
      std::nth_element(ratios.begin(), middle, ratios.end());
      curve.voltage = *middle;
    }
  }
  if (!(curve.voltage > 0.0)) {
    curve.voltage = 12.0;
    warn(diagnostics, "assumed_voltage",
         "{} does not say at which voltage it was measured; 12 V is taken (--voltage says it)",
         file.source);
  }
  file.rows = curve.speed.size();
  file.voltage = curve.voltage;
  FLYBALL_TRY(file.curve,
              identification::fit_motor_curve(file.known ? file.known->name : file.source, curve));
  return {};
}

Expected<void> fit_locked(const Log& log, const CurveColumn& torque, const CurveColumn& current,
                          MotorCurveFile& file, std::vector<Diagnostic>& diagnostics) {
  FLYBALL_TRY(const CurveColumn time, column_of(log, {"time"}, Dimension::time, 1.0));
  FLYBALL_TRY(CurveColumn voltage, column_of(log, {"volt"}, Dimension::voltage, 1.0));
  FLYBALL_TRY(const CurveColumn output, column_of(log, {"output"}, std::nullopt, 0.01));
  if (time.empty() || voltage.empty()) {
    return tl::unexpected(
        no_column(time.empty() ? "a column of time" : "a column of voltage", log));
  }
  std::vector<VectorXd> rows;
  if (output.empty()) {
    rows = rows_of({&time, &voltage, &torque, &current});
  } else {
    // A controller chops the bus: V = duty V_bus, and the power in and out is one, I = I_in / duty.
    rows = rows_of({&time, &voltage, &torque, &current, &output});
    rows[1] = rows[1].cwiseProduct(rows[4]);
    rows[3] = rows[3].cwiseQuotient(rows[4]);
    warn(
        diagnostics, "motor_side",
        "{}: the motor's voltage is taken for \"{}\" times \"{}\", and its current for \"{}\" over "
        "that: the controller's losses and current limit are in the constants",
        file.source, voltage.name, output.name, current.name);
  }
  // Driven: before and after that there is no voltage, or a controller's rounding of it.
  const double most = rows[2].size() > 0 ? rows[2].maxCoeff() : 0.0;
  std::vector<Index> driven;
  for (Index k = 0; k < rows[0].size(); ++k) {
    if (rows[1](k) > 0.0 && rows[3](k) > 0.0 && std::isfinite(rows[3](k)) &&
        rows[2](k) > 0.05 * most) {
      driven.push_back(k);
    }
  }
  const identification::LockedRotor run{rows[0](driven), rows[1](driven), rows[2](driven),
                                        rows[3](driven)};
  file.rows = run.time.size();
  file.voltage = file.rows > 0 ? run.voltage.mean() : 0.0;
  FLYBALL_TRY(file.locked, identification::fit_locked_rotor(run));
  return {};
}

Expected<MotorCurveFile> fit_file(const std::string& path, const MotorCurvesJob& job,
                                  std::vector<Diagnostic>& diagnostics) {
  FLYBALL_TRY(const std::string text, read_file(path));
  FLYBALL_TRY(const Log log, parse_csv(text, path, 1.0));
  MotorCurveFile file{.source = path};
  if (job.motor.empty()) {
    file.known = motor_of_file(path);
  } else {
    FLYBALL_TRY(file.known, mechanisms::motor(job.motor));
  }
  const double rpm = parse_unit("rpm").value().factor;
  FLYBALL_TRY(const CurveColumn speed, column_of(log, {"speed"}, Dimension::angular_velocity, rpm));
  FLYBALL_TRY(const CurveColumn torque, column_of(log, {"torque"}, Dimension::torque, 1.0));
  FLYBALL_TRY(const CurveColumn current,
              column_of(log, {"current", "amps"}, Dimension::current, 1.0));
  if (torque.empty() || current.empty()) {
    return tl::unexpected(
        no_column(torque.empty() ? "a column of torque" : "a column of current", log));
  }
  FLYBALL_CHECK(speed.empty() ? fit_locked(log, torque, current, file, diagnostics)
                              : fit_curve(log, speed, torque, current, job, file, diagnostics));
  return file;
}

}  // namespace

Expected<MotorCurvesResult> fit_motor_curves(const MotorCurvesJob& job) {
  if (job.paths.empty()) {
    return refusal(ArgumentError::empty, in_motor_curves, "the files").expected("at least one");
  }
  if (job.voltage) {
    FLYBALL_CHECK(Checks(in_motor_curves).positive(*job.voltage, "--voltage", "V"));
  }
  MotorCurvesResult result;
  for (const std::string& path : job.paths) {
    auto file = fit_file(path, job, result.diagnostics);
    if (!file) {
      return tl::unexpected(std::move(file).error().in(path));
    }
    result.files.push_back(*std::move(file));
  }
  return result;
}

}  // namespace flyball::study
