#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/estimates.hpp"
#include "identification/output_error.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr double two_sided_95 = 1.96;
constexpr double longest_usual = 0.5;         // s, kA/kV that a ramp's friction allows for
constexpr double widest_time_constant = 0.6;  // relative half-width beyond which kA is unknown

// What no residual tells: a meter's offset, a clock's and an encoder's scale, and that a row's
// voltage is held to the next. They are below what noise leaves of a log as short as four tests.
constexpr double voltage_allowance = 2e-4;  // V, standard error added to kS and kG
constexpr double speed_allowance = 5e-5;    // relative, added to kV
constexpr double inertia_allowance = 1e-4;  // relative, added to kA
constexpr double delay_allowance = 2e-4;    // s, added to delays

/// @param allowance  Standard error of what the model leaves out, in the gain's unit.
GainEstimate symmetric(double value, double random_error, double allowance) {
  return symmetric_estimate(value, std::hypot(random_error, allowance));
}

void mark_undetermined(GainEstimate& gain, double upper_bound, std::string reason) {
  gain.determined = false;
  gain.upper_bound = upper_bound;
  gain.reason = std::move(reason);
}

/// V/s, from where the voltage rises to where it is largest.
double ramp_rate(const ResidualRun& run) {
  const std::vector<double>& voltage = run.input.voltage;
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t k = 0; k < voltage.size(); ++k) {
    first = voltage[k] == 0.0 && last == 0 ? k : first;
    last = std::abs(voltage[k]) > std::abs(voltage[last]) ? k : last;
  }
  const double time = run.input.time[last] - run.input.time[first];
  return time > 0.0 ? std::abs(voltage[last] - voltage[first]) / time : 0.0;
}

Eigen::VectorXd unit_gradient(Eigen::Index size, Eigen::Index at) {
  return Eigen::VectorXd::Unit(size, at);
}

/// kA = τ kV, positive: its interval is symmetric in the logarithm.
GainEstimate inertia_gain(const PreparedRecording& prepared, const Eigen::VectorXd& x,
                          const Covariances& spread, const Bounds& bounds) {
  const double tau = std::exp(x[parameter::log_time_constant]);
  const double kV = x[parameter::velocity_gain];
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(x.size());
  gradient[parameter::log_time_constant] = 1.0;
  gradient[parameter::velocity_gain] = 1.0 / kV;
  const double relative = std::hypot(spread.standard_error(gradient), inertia_allowance);
  GainEstimate kA;
  kA.value = tau * kV;
  kA.standard_error = relative * kA.value;
  const double reach = std::min(two_sided_95 * relative, 20.0);
  kA.interval = {kA.value * std::exp(-reach), kA.value * std::exp(reach)};

  const double refresh = std::max(
      {prepared.row_period, prepared.position_refresh_period, prepared.velocity_refresh_period});
  if (x[parameter::log_time_constant] <= bounds.lower[parameter::log_time_constant] + 1e-6) {
    mark_undetermined(
        kA, kA.interval[1],
        detail::format("the speed-up is over within one sensor value ({:.0f} ms)", 1e3 * refresh));
  } else if (x[parameter::log_time_constant] >= bounds.upper[parameter::log_time_constant] - 1e-6) {
    mark_undetermined(kA, kA.interval[1], "the speed hardly settles within the tests");
  } else if (tau < refresh) {
    mark_undetermined(
        kA, kA.interval[1],
        detail::format("the time constant kA/kV = {:.1f} ms is shorter than the {:.0f} "
                       "ms between sensor values",
                       1e3 * tau, 1e3 * refresh));
  } else if (two_sided_95 * relative > widest_time_constant) {
    mark_undetermined(
        kA, kA.interval[1],
        detail::format("its 95 % interval is ±{:.0f} %: it trades against the sensors' "
                       "delay and averaging",
                       100.0 * two_sided_95 * relative));
  }
  return kA;
}

/// [kV/its value, ln kA, delays] with the allowances of their standard errors.
void joint_covariance(const Eigen::VectorXd& x, const Covariances& spread, FeedforwardFit& fit) {
  Eigen::MatrixXd gradients = Eigen::MatrixXd::Zero(4, x.size());
  const double kV = x[parameter::velocity_gain];
  gradients(0, parameter::velocity_gain) = 1.0 / kV;
  gradients(1, parameter::velocity_gain) = 1.0 / kV;
  gradients(1, parameter::log_time_constant) = 1.0;
  gradients(2, parameter::position_delay) = 1.0;
  gradients(3, parameter::velocity_delay) = 1.0;
  const Eigen::MatrixXd joint = spread.joint(gradients);
  const std::array<double, 4> allowances{speed_allowance, inertia_allowance, delay_allowance,
                                         delay_allowance};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      fit.joint_covariance[i][j] =
          joint(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
    if (fit.joint_covariance[i][i] > 0.0) {
      fit.joint_covariance[i][i] += allowances[i] * allowances[i];
    }
  }
}

void gravity_gains(const Eigen::VectorXd& x, const Covariances& spread, FeedforwardFit& fit) {
  const double cosine = x[parameter::gravity_cosine];
  const double sine = x[parameter::gravity_sine];
  if (fit.mechanism == MechanismKind::elevator) {
    fit.kG =
        symmetric(cosine, spread.standard_error(unit_gradient(x.size(), parameter::gravity_cosine)),
                  voltage_allowance);
  } else if (fit.mechanism == MechanismKind::arm) {
    // kG cos(θ + offset) = kG cos(offset) cos θ − kG sin(offset) sin θ
    const double amplitude = std::max(std::hypot(cosine, sine), 1e-12);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(x.size());
    gradient[parameter::gravity_cosine] = cosine / amplitude;
    gradient[parameter::gravity_sine] = sine / amplitude;
    fit.kG = symmetric(amplitude, spread.standard_error(gradient), voltage_allowance);
    gradient[parameter::gravity_cosine] = sine / (amplitude * amplitude);
    gradient[parameter::gravity_sine] = -cosine / (amplitude * amplitude);
    fit.angle_offset = symmetric(std::atan2(-sine, cosine), spread.standard_error(gradient),
                                 voltage_allowance / amplitude);
  } else {
    return;
  }
  GainEstimate& kG = *fit.kG;
  if (kG.interval[0] <= 0.0 && kG.interval[1] >= 0.0) {
    mark_undetermined(kG, std::max(std::abs(kG.interval[0]), std::abs(kG.interval[1])),
                      "gravity cannot be told from zero (a counterbalance or a horizontal axis?)");
    if (fit.angle_offset) {
      mark_undetermined(*fit.angle_offset, 3.141592653589793, "without gravity there is no zero");
    }
  }
}

}  // namespace

GainEstimate symmetric_estimate(double value, double standard_error) {
  GainEstimate estimate;
  estimate.value = value;
  estimate.standard_error = standard_error;
  estimate.interval = {value - two_sided_95 * standard_error,
                       value + two_sided_95 * standard_error};
  return estimate;
}

Expected<void> estimate_gains(const PreparedRecording& prepared, const Eigen::VectorXd& x,
                              const Covariances& spread, const Bounds& bounds,
                              FeedforwardFit& fit) {
  if (spread.singular) {
    return refusal(IdentificationError::singular, "identify")
        .hint("record ramps and steps in both directions with more travel");
  }
  fit.kS = symmetric(x[parameter::static_friction],
                     spread.standard_error(unit_gradient(x.size(), parameter::static_friction)),
                     voltage_allowance);
  fit.kS.interval[0] = std::max(0.0, fit.kS.interval[0]);
  if (fit.kS.interval[0] <= 0.0) {
    mark_undetermined(fit.kS, std::max(fit.kS.interval[1], 1e-3),
                      "static friction cannot be told from zero");
  }
  fit.kV = symmetric(x[parameter::velocity_gain],
                     spread.standard_error(unit_gradient(x.size(), parameter::velocity_gain)),
                     speed_allowance * x[parameter::velocity_gain]);
  fit.kA = inertia_gain(prepared, x, spread, bounds);
  joint_covariance(x, spread, fit);
  gravity_gains(x, spread, fit);

  const bool kV_at_bound =
      x[parameter::velocity_gain] <= 1.001 * bounds.lower[parameter::velocity_gain];
  if (!(fit.kV.value > 0.0) || kV_at_bound) {
    return refusal(IdentificationError::unphysical_gains, "identify", "kV")
        .got(detail::format("{:.4g} V/({}/s)", fit.kV.value, fit.unit))
        .expected("positive")
        .hint("check the signs and units of voltage and velocity");
  }
  if (two_sided_95 * fit.kV.standard_error > 0.5 * fit.kV.value) {
    return refusal(IdentificationError::singular, "identify", "kV")
        .got(detail::format("{:.4g} ± {:.2g} V/({}/s)", fit.kV.value,
                            two_sided_95 * fit.kV.standard_error, fit.unit))
        .expected("known to better than 50 %")
        .hint("record longer tests with more travel");
  }
  if (fit.r_squared < 0.5) {
    return refusal(IdentificationError::unphysical_gains, "identify", "the simulated velocity")
        .got(detail::format("unlike the measured one (R² = {:.2f})", fit.r_squared))
        .hint(
            "no gains of this model explain the log; check the mechanism's kind, the units and the "
            "signs");
  }
  return {};
}

void estimate_what_tests_leave(const TestCoverage& coverage, const OutputErrorProblem& problem,
                               const Eigen::VectorXd& x, const Covariances& spread,
                               FeedforwardFit& fit) {
  const char* other = coverage.forward ? "quasistatic-reverse" : "quasistatic-forward";
  if (problem.hides_friction()) {
    // Forward V = (kG + kS) + kV v, in reverse V = (kG − kS) + kV v.
    const double direction = coverage.forward ? 1.0 : -1.0;
    const GainEstimate both =
        symmetric(x[parameter::gravity_cosine] + direction * x[parameter::static_friction],
                  spread.standard_error(unit_gradient(x.size(), parameter::gravity_cosine)),
                  voltage_allowance);
    const std::string reason = detail::format(
        "tests {} alone tell kG {} kS = {:.3g} ± {:.2g} V, not the two apart; {} would",
        coverage.forward ? "forward" : "in reverse", coverage.forward ? "+" : "−", both.value,
        two_sided_95 * both.standard_error, other);
    double most = both.interval[1];
    for (const ResidualRun& run : problem.runs()) {
      for (std::size_t i = 0; direction < 0.0 && i < run.input.voltage.size(); ++i) {
        most = std::max(most, std::abs(run.input.voltage[i]));
      }
    }
    // With all of it as gravity the way up is right, and it is held.
    fit.kS.value = std::max(0.0, direction < 0.0 ? -both.value : 0.0);
    fit.kG->value = both.value - direction * fit.kS.value;
    for (GainEstimate* gain : {&fit.kS, &*fit.kG}) {
      gain->interval = {0.0, std::max(1e-3, most)};
      gain->standard_error = 0.5 * gain->interval[1];
      mark_undetermined(*gain, gain->interval[1], reason);
    }
    fit.gravity_with_friction = both;
    fit.in_reverse = direction < 0.0;
  } else if (coverage.one_way() && !fit.kS.determined && fit.kG) {
    fit.kS.reason = detail::format(
        "in one direction alone static friction trades with gravity; {} would tell", other);
  }
  if (problem.hides_inertia()) {
    // A ramp's speed-up takes kA r / kV volts of a rate of r V/s, which look like friction.
    double rate = 1e-3;
    for (const ResidualRun& run : problem.runs()) {
      rate = std::max(rate, ramp_rate(run));
    }
    const double tau = std::min(std::exp(x[parameter::log_time_constant]), longest_usual);
    const double share = rate * longest_usual;
    const auto widen = [&](GainEstimate& gain, double sign) {
      const double low = -rate * (sign > 0.0 ? longest_usual - tau : tau);
      gain.interval[0] += low;
      gain.interval[1] += low + share;
      gain.standard_error = (gain.interval[1] - gain.interval[0]) / (2.0 * two_sided_95);
    };
    if (fit.gravity_with_friction) {
      widen(*fit.gravity_with_friction, fit.in_reverse ? -1.0 : 1.0);
    } else {
      widen(fit.kS, 1.0);
      fit.kS.interval[0] = std::max(0.0, fit.kS.interval[0]);
    }
    const double bound =
        std::max(1e-3, fit.kS.determined ? fit.kS.interval[1] : fit.kS.upper_bound) * fit.kV.value /
        rate;
    fit.kA.interval = {0.0, std::max(bound, fit.kA.value)};
    mark_undetermined(
        fit.kA, fit.kA.interval[1],
        detail::format("there is no dynamic test, so kA/kV is supposed to be near {:.1f} s; for up "
                       "to {:.1f} s, {:.2g} V of kS are the ramps' own speed-up; dynamic-forward "
                       "would tell",
                       usual_time_constant, longest_usual, share));
  }
}

void report_fit(const PreparedRecording& prepared, const FeedforwardFit& fit,
                std::vector<Diagnostic>& diagnostics) {
  const std::string& unit = fit.unit;
  if (!fit.kA.determined) {
    warn(diagnostics, "kA_not_determined", "kA is below {:.3g} V·s²/{} but not determined: {}",
         fit.kA.upper_bound, unit, fit.kA.reason);
  }
  if (fit.gravity_with_friction) {
    warn(diagnostics, "gravity_with_friction", "kS and kG are not determined: {}", fit.kS.reason);
  } else if (!fit.kS.determined) {
    note(diagnostics, "kS_indistinguishable", "kS is below {:.3g} V: {}", fit.kS.upper_bound,
         fit.kS.reason);
  }
  if (fit.kG && !fit.kG->determined && !fit.gravity_with_friction) {
    warn(diagnostics, "kG_indistinguishable", "|kG| is below {:.3g} V: {}", fit.kG->upper_bound,
         fit.kG->reason);
  }
  if (prepared.has_velocity && fit.averaging_width > 0.03 && fit.velocity_delay > 0.0) {
    note(diagnostics, "velocity_filtered",
         "the velocity column is averaged over about {:.0f} ms; a controller that uses it sees the "
         "velocity {:.0f} ms late",
         1e3 * fit.averaging_width, 1e3 * fit.velocity_delay);
  }
  if (prepared.has_position && prepared.has_velocity &&
      std::abs(fit.velocity_delay - 0.5 * fit.averaging_width - fit.position_delay) > 0.015) {
    const auto age = [](double delay) {
      return detail::format("{:.0f} ms {}", 1e3 * std::abs(delay), delay < 0.0 ? "newer" : "older");
    };
    note(diagnostics, "channel_skew",
         "position is {} and velocity {} than the voltage of the same row (averaging taken off); "
         "the fit accounts for it{}",
         age(fit.position_delay), age(fit.velocity_delay - 0.5 * fit.averaging_width),
         std::min(fit.position_delay, fit.velocity_delay) < -0.005
             ? ". What is newer was read after the voltage was set, in a row that holds the "
               "voltage of the period before"
             : "");
  } else if (prepared.has_position && fit.position_delay > 0.015) {
    note(diagnostics, "channel_delay",
         "the encoder's values are {:.0f} ms older than the voltage of the same row; the fit "
         "accounts for it",
         1e3 * fit.position_delay);
  }
  if (fit.velocity_nrmse > 0.2) {
    warn(diagnostics, "poor_fit",
         "the simulated velocity misses {:.0f} % of the measured one's spread (R² = {:.3f}): the "
         "mechanism does more than the model says",
         100.0 * fit.velocity_nrmse, fit.r_squared);
  }
}

}  // namespace flyball::identification
