#include <flyball/identification/motor_curve.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/core/argument.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/math/regression/least_squares.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/estimates.hpp"

namespace flyball::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view curve_name = "fit_motor_curve";
constexpr std::string_view rotor_name = "fit_locked_rotor";

Expected<void> check_rows(Index rows, Index least, std::string_view where) {
  if (rows < least) {
    return refusal(IdentificationError::too_short, where)
        .hint(detail::format("give at least {} rows", least))
        .with("rows", static_cast<double>(rows));
  }
  return {};
}

Refusal not_a_motor(std::string_view what, double got, std::string_view expected) {
  return refusal(IdentificationError::unphysical_gains, curve_name, what)
      .got(detail::format("{:.4g}", got))
      .expected(std::string(expected));
}

/// f's standard error by its slopes along the coefficients of two independent lines.
template <class F>
GainEstimate propagated(const F& f, const Regression& torque, const Regression& current) {
  Eigen::Vector4d at;
  at << torque.coefficients, current.coefficients;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  covariance.topLeftCorner<2, 2>() = torque.covariance;
  covariance.bottomRightCorner<2, 2>() = current.covariance;
  Eigen::Vector4d slope;
  for (Index i = 0; i < 4; ++i) {
    const double step = 1e-6 * std::abs(at(i)) + 1e-300;
    Eigen::Vector4d above = at;
    Eigen::Vector4d below = at;
    above(i) += step;
    below(i) -= step;
    slope(i) = (f(above) - f(below)) / (above(i) - below(i));
  }
  return symmetric_estimate(f(at), std::sqrt(std::max(0.0, slope.dot(covariance * slope))));
}

/// How many rows at the start are of one state of the motor: warm windings, and worse ones that
/// burn, take current away.
Index steady_rows(const VectorXd& current) {
  constexpr Index first = 5;
  constexpr double share = 0.8;
  VectorXd start = current.head(first);
  std::sort(start.begin(), start.end());
  const double level = start(first / 2);
  Index rows = first;
  while (rows < current.size() && current(rows) > share * level && current(rows) * share < level) {
    ++rows;
  }
  return rows;
}

/// Which of the first rows has the most current: before it the voltage is still being switched on,
/// or a sample is torn between before and after.
Index first_whole_row(const VectorXd& current) {
  Index row = 0;
  current.head(std::min<Index>(current.size(), 5)).maxCoeff(&row);
  return row;
}

/// C of V/I = R_0 (1 + α E/C), E the energy until then, J.
Expected<GainEstimate> heat_capacity(const VectorXd& time, const VectorXd& voltage,
                                     const VectorXd& current) {
  constexpr double copper = 0.00393;  // 1/K
  const Index rows = time.size();
  constexpr Index least = 4;
  if (rows < least) {
    GainEstimate unknown;
    unknown.determined = false;
    return unknown;
  }
  const VectorXd power = voltage.cwiseProduct(current);
  MatrixXd X(rows, 2);
  X.col(0).setOnes();
  X(0, 1) = 0.0;
  for (Index k = 1; k < rows; ++k) {
    X(k, 1) = X(k - 1, 1) + 0.5 * (power(k) + power(k - 1)) * (time(k) - time(k - 1));
  }
  LeastSquaresOptions options;
  options.errors = ErrorModel::hac;
  FLYBALL_TRY(const LeastSquares line, least_squares(X, voltage.cwiseQuotient(current), options));
  const double slope = line.coefficients(1);
  const double error = line.standard_errors(1);
  // Of a slope that its error reaches to zero the inverse is anything.
  if (!(slope > 3.0 * error)) {
    GainEstimate unknown;
    unknown.determined = false;
    return unknown;
  }
  const double C = copper * line.coefficients(0) / slope;
  return symmetric_estimate(C, C * error / slope);
}

double root_mean_square(const VectorXd& values) {
  return values.norm() / std::sqrt(static_cast<double>(values.size()));
}

}  // namespace

Expected<MotorConstants> fit_motor_curve(std::string_view name, const MotorCurve& curve) {
  const Index rows = curve.speed.size();
  FLYBALL_CHECK(Checks(curve_name)
                    .positive(curve.voltage, "voltage", "V")
                    .shape(curve.torque, rows, 1, "torque", "rows of the speed")
                    .shape(curve.current, rows, 1, "current", "rows of the speed")
                    .finite(curve.speed, "speed")
                    .finite(curve.torque, "torque")
                    .finite(curve.current, "current"));
  FLYBALL_CHECK(check_rows(rows, 3, curve_name));
  MatrixXd X(rows, 2);
  X << VectorXd::Ones(rows), curve.speed;
  FLYBALL_TRY(const LeastSquares torque, least_squares(X, curve.torque));
  FLYBALL_TRY(const LeastSquares current, least_squares(X, curve.current));
  if (torque.rank < 2) {
    return refusal(IdentificationError::singular, curve_name)
        .hint("measure at several speeds, from stall to no load");
  }
  const double stall_torque = torque.coefficients(0);
  const double stall_current = current.coefficients(0);
  if (!(stall_torque > 0.0)) {
    return not_a_motor("the torque at stall", stall_torque, "positive");
  }
  if (!(torque.coefficients(1) < 0.0)) {
    return not_a_motor("the torque's slope", torque.coefficients(1), "falling with the speed");
  }
  // x: the lines of torque and current, each its value at stall and its slope.
  const auto free_speed = [](const Eigen::Vector4d& x) { return -x(0) / x(1); };
  const auto free_current = [&](const Eigen::Vector4d& x) { return x(2) + x(3) * free_speed(x); };
  Eigen::Vector4d lines;
  lines << torque.coefficients, current.coefficients;
  if (const double free = free_current(lines); !(free > 0.0 && free < stall_current)) {
    return not_a_motor("the current without load", free,
                       detail::format("between zero and {:.4g} A at stall", stall_current));
  }
  MotorConstants found;
  FLYBALL_TRY(found.motor,
              mechanisms::motor(name, {.nominal_voltage = Voltage(curve.voltage),
                                       .stall_torque = Torque(stall_torque),
                                       .stall_current = Current(stall_current),
                                       .free_current = Current(free_current(lines)),
                                       .free_speed = AngularVelocity(free_speed(lines))}));
  const double V = curve.voltage;
  found.R = propagated([&](const Eigen::Vector4d& x) { return V / x(2); }, torque, current);
  found.Kt = propagated([](const Eigen::Vector4d& x) { return x(0) / x(2); }, torque, current);
  found.Kv = propagated(
      [&](const Eigen::Vector4d& x) { return free_speed(x) / (V - free_current(x) * (V / x(2))); },
      torque, current);
  found.torque_deviation = root_mean_square(torque.residuals) / stall_torque;
  found.current_deviation = root_mean_square(current.residuals) / stall_current;
  return found;
}

Expected<LockedRotorConstants> fit_locked_rotor(const LockedRotor& run) {
  const Index rows = run.time.size();
  FLYBALL_CHECK(Checks(rotor_name)
                    .shape(run.voltage, rows, 1, "voltage", "rows of the time")
                    .shape(run.torque, rows, 1, "torque", "rows of the time")
                    .shape(run.current, rows, 1, "current", "rows of the time")
                    .finite(run.time, "time")
                    .finite(run.voltage, "voltage")
                    .finite(run.torque, "torque")
                    .finite(run.current, "current"));
  FLYBALL_CHECK(check_rows(rows, 5, rotor_name));
  if (!((run.current.array() > 0.0).all() && (run.voltage.array() > 0.0).all())) {
    return refusal(IdentificationError::unphysical_gains, rotor_name, "voltage and current")
        .got("not positive throughout")
        .expected("the rows in which the motor is driven");
  }
  const Index used = steady_rows(run.current);
  const VectorXd current = run.current.head(used);
  LeastSquaresOptions options;
  options.errors = ErrorModel::hac;
  FLYBALL_TRY(const LeastSquares torque, least_squares(current, run.torque.head(used), options));
  const VectorXd time = run.time.head(used).array() - run.time(0);
  if (!(time(used - 1) > 0.0)) {
    return refusal(IdentificationError::singular, rotor_name).hint("give the rows in their order");
  }
  MatrixXd X(used, 2);
  X << VectorXd::Ones(used), time;
  FLYBALL_TRY(const LeastSquares resistance,
              least_squares(X, run.voltage.head(used).cwiseQuotient(current), options));
  LockedRotorConstants found;
  found.rows = used;
  found.Kt = symmetric_estimate(torque.coefficients(0), torque.standard_errors(0));
  found.R = symmetric_estimate(resistance.coefficients(0), resistance.standard_errors(0));
  found.R_rise = resistance.coefficients(1) * time(used - 1) / resistance.coefficients(0);
  const Index whole = used - first_whole_row(current);
  FLYBALL_TRY(found.heat_capacity,
              heat_capacity(time.tail(whole), run.voltage.segment(used - whole, whole),
                            current.tail(whole)));
  return found;
}

}  // namespace flyball::identification
