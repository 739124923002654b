#include <flyball/identification/moment_of_inertia.hpp>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/math/regression/least_squares.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::identification {

namespace {

/// The slope of y over x times `factor`, with its errors.
Expected<InertiaEstimate> from_slope(const std::vector<double>& x, const std::vector<double>& y,
                                     double factor, std::string_view where) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd X = Eigen::MatrixXd::Ones(n, 2);
  X.col(0) = Eigen::Map<const Eigen::VectorXd>(x.data(), n);
  const Eigen::VectorXd values = Eigen::Map<const Eigen::VectorXd>(y.data(), n);
  FLYBALL_TRY(const auto line, least_squares(X, values));
  const double J = factor * line.coefficients[0];
  if (!line.determined[0] || !(J > 0.0)) {
    return refusal(IdentificationError::unphysical_gains, where, "the moment of inertia")
        .got(detail::format("{:.4g} kg m²", J))
        .expected("positive")
        .hint("give the rows of a step of constant voltage, from its start on");
  }
  const double low = factor * line.intervals(0, factor > 0.0 ? 0 : 1);
  const double high = factor * line.intervals(0, factor > 0.0 ? 1 : 0);
  return InertiaEstimate{.value = MomentOfInertia(J),
                         .standard_error = std::abs(factor) * line.standard_errors[0],
                         .interval = {low, high},
                         .r_squared = line.r_squared};
}

Expected<void> check_pair(std::span<const double> first, std::span<const double> second,
                          std::string_view where, std::string_view names) {
  if (first.size() != second.size() || first.size() < 3) {
    return refusal(
               first.size() != second.size() ? ArgumentError::wrong_shape : ArgumentError::empty,
               where, std::string(names))
        .got(detail::format("{} and {} values", first.size(), second.size()))
        .expected("equally many, three at least");
  }
  for (const std::span<const double> values : {first, second}) {
    for (const double value : values) {
      FLYBALL_CHECK(check_finite(value, where, names));
    }
  }
  return {};
}

}  // namespace

Expected<InertiaEstimate> inertia_from_step(const mechanisms::DcMotor& motor, double gearing,
                                            std::span<const double> time,
                                            std::span<const double> velocity) {
  constexpr std::string_view where = "inertia_from_step";
  FLYBALL_CHECK(check_pair(time, velocity, where, "time and velocity"));
  FLYBALL_CHECK(Checks(where)
                    .positive(motor.R, "motor.R", "Ohm")
                    .positive(motor.Kt, "motor.Kt", "N m/A")
                    .positive(motor.Kv, "motor.Kv", "rad/s/V")
                    .positive(gearing, "gearing"));
  std::vector<double> accelerations;
  std::vector<double> speeds;
  for (std::size_t i = 1; i < time.size(); ++i) {
    const double step = time[i] - time[i - 1];
    FLYBALL_CHECK(check_positive(step, where, "the step of time", "s"));
    accelerations.push_back((velocity[i] - velocity[i - 1]) / step);
    speeds.push_back(0.5 * (velocity[i] + velocity[i - 1]));
  }
  // ω = -(J K_v R/(G² K_t)) dω/dt + (K_v/G) V (12.19)
  return from_slope(accelerations, speeds, -gearing * gearing * motor.Kt / (motor.Kv * motor.R),
                    where);
}

Expected<InertiaEstimate> drive_inertia_from_steps(Mass mass, Length trackwidth,
                                                   std::span<const double> speed,
                                                   std::span<const double> angular_velocity) {
  constexpr std::string_view where = "drive_inertia_from_steps";
  FLYBALL_CHECK(check_pair(speed, angular_velocity, where, "speed and angular_velocity"));
  FLYBALL_CHECK(
      Checks(where).positive(mass.si(), "mass", "kg").positive(trackwidth.si(), "trackwidth", "m"));
  // v = J/(m r_b) ω + C_3 (12.37)
  return from_slope({angular_velocity.begin(), angular_velocity.end()},
                    {speed.begin(), speed.end()}, mass.si() * 0.5 * trackwidth.si(), where);
}

MomentOfInertia rod_moment_of_inertia(Mass mass, Length length) {
  return MomentOfInertia(mass.si() * length.si() * length.si() / 3.0);
}

}  // namespace flyball::identification
