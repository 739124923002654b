#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "identification/estimates.hpp"
#include "identification/model_terms.hpp"

namespace flyball::identification {
namespace {

/// Where friction differs most from its mean: what its size is made of there.
Eigen::VectorXd steepest_field(const OutputErrorProblem& problem, const Eigen::VectorXd& x) {
  Eigen::VectorXd most = Eigen::VectorXd::Zero(x.size());
  for (const ResidualRun& run : problem.runs()) {
    for (std::size_t i = 0; i < run.input.time.size(); ++i) {
      Eigen::VectorXd here = Eigen::VectorXd::Zero(x.size());
      for (int k = parameter::friction_field; k < parameter::headroom; ++k) {
        here[k] = run.input.forces[static_cast<std::size_t>(k - parameter::first_force)][i];
      }
      if (std::abs(here.dot(x)) > std::abs(most.dot(x))) {
        most = std::copysign(1.0, here.dot(x)) * here;
      }
    }
  }
  return most;
}

/// kG of parameters that are moved by so much.
double gravity_with(const FeedforwardFit& fit, const Eigen::VectorXd& moved) {
  if (!fit.kG) {
    return 0.0;
  }
  const double offset = fit.angle_offset ? fit.angle_offset->value : 0.0;
  const double cosine = fit.kG->value * std::cos(offset) + moved[parameter::gravity_cosine];
  const double sine = -fit.kG->value * std::sin(offset) + moved[parameter::gravity_sine];
  return fit.angle_offset ? std::hypot(cosine, sine) : cosine;
}

}  // namespace

std::vector<ModelTerm> estimate_terms(const OutputErrorProblem& problem, const RobustFit& best,
                                      const Covariances& spread) {
  struct Row {
    int parameter;
    const char* name;
    const char* unit;
  };
  static constexpr std::array rows{Row{parameter::bias, "asymmetric_friction", "V"},
                                   Row{parameter::spring, "spring", "V/unit"},
                                   Row{parameter::drag, "drag", "V/(unit/s)²"},
                                   Row{parameter::sag, "sag", ""},
                                   Row{parameter::friction_field, "friction_along_travel", "V"},
                                   Row{parameter::take_up, "backlash", "unit"},
                                   Row{parameter::headroom, "current_limit", "V"}};
  std::vector<ModelTerm> terms;
  const std::string& unit = problem.recording().unit;
  for (const Row& row : rows) {
    if (!problem.is_extended(row.parameter)) {
      continue;
    }
    ModelTerm term;
    term.name = row.name;
    term.unit = row.unit;
    if (const std::size_t at = term.unit.find("unit"); at != std::string::npos) {
      term.unit.replace(at, 4, unit);
    }
    Eigen::VectorXd gradient = Eigen::VectorXd::Unit(best.x.size(), row.parameter);
    if (row.parameter == parameter::friction_field) {
      gradient = steepest_field(problem, best.x);
    }
    term.value = symmetric_estimate(gradient.dot(best.x), spread.standard_error(gradient));
    // What it makes at most in this log.
    const int force = row.parameter - parameter::first_force;
    term.largest = term.value.value;
    if (force < force_count && row.parameter != parameter::friction_field) {
      term.largest = 0.0;
      for (const ResidualRun& run : problem.runs()) {
        for (const double input : run.input.forces[static_cast<std::size_t>(force)]) {
          term.largest = std::max(term.largest, std::abs(input * term.value.value));
        }
      }
    }
    terms.push_back(std::move(term));
  }
  return terms;
}

void report_open_terms(const Extension& extension, const FeedforwardFit& fit,
                       std::vector<Diagnostic>& diagnostics) {
  constexpr double large = 0.4;  // of half an interval
  const double kV_half = 0.5 * (fit.kV.interval[1] - fit.kV.interval[0]);
  const double kS_half = 0.5 * (fit.kS.interval[1] - fit.kS.interval[0]);
  const double kA_half = 0.5 * (fit.kA.interval[1] - fit.kA.interval[0]);
  std::vector<Extension::Open> all = extension.open;
  std::stable_partition(all.begin(), all.end(), [](const Extension::Open& open) {
    return open.term == parameter::sag;  // It moves kA most, of which nothing else tells.
  });
  for (const Extension::Open& open : all) {
    const double kV = fit.kV.value + open.moved[parameter::velocity_gain];
    const double kS = fit.kS.value + open.moved[parameter::static_friction];
    const double kA =
        fit.kA.value * std::exp(open.moved[parameter::log_time_constant]) * kV / fit.kV.value;
    // What of the half widths the term makes.
    const auto widens = [&](double moved, double half) {
      return open.weight * std::abs(moved) >= large * half;
    };
    const bool of_kA = fit.kA.determined && widens(kA - fit.kA.value, kA_half);
    // Gravity's share of an arm is told by its angle, which a force along the travel trades with.
    const double kG = gravity_with(fit, open.moved);
    const bool of_kG =
        fit.kG && widens(kG - fit.kG->value, 0.5 * (fit.kG->interval[1] - fit.kG->interval[0]));
    if (!widens(kV - fit.kV.value, kV_half) && !widens(kS - fit.kS.value, kS_half) && !of_kA &&
        !of_kG && !open.instead) {
      continue;
    }
    const bool lift = fit.mechanism == mechanisms::MechanismKind::elevator;
    const char* const what =
        open.term == parameter::bias   ? "friction that differs by direction"
        : open.term == parameter::drag ? "drag that grows with the square of the speed"
        : open.term == parameter::sag  ? "a battery that sags while the command was recorded"
        : open.term == parameter::friction_field ? "friction that varies along the travel"
        : open.term == parameter::take_up        ? "backlash"
        : open.term == parameter::headroom       ? "a current limit"
        : lift
            ? "a force that grows along the travel (a spring, a cable, or a further stage that is "
              "lifted from some height on)"
            : "a force that grows along the travel (a spring, a counterbalance or a cable)";
    note(diagnostics, "term_in_doubt",
         "the log leaves open whether there is {}{}: with it kV would be {:.4g} V·s/{}{}{} and kS "
         "{:.3g} V. The intervals hold both and are that wide for it; {}",
         what, open.instead ? " instead" : "", kV, fit.unit,
         of_kA ? detail::format(", kA {:.4g} V·s²/{}", kA, fit.unit) : "",
         of_kG ? detail::format(", kG {:.3g} V", kG) : "", kS,
         open.term == parameter::sag || open.term == parameter::drag
             ? "a log of the voltage at the motor (applied output times bus voltage), or steps of "
               "another height, decide"
             : "a second log, or tests over more of the travel, decide");
    return;  // the one that matters most
  }
}

void report_terms(const FeedforwardFit& fit, std::vector<Diagnostic>& diagnostics) {
  for (const ModelTerm& term : fit.terms) {
    const double value = term.value.value;
    if (term.name == "spring") {
      warn(diagnostics, "spring",
           "a force that {} with the position by {:.3g} {} ({:.2g} V at an end of the travel) "
           "explains the log: a spring, a counterbalance, a cable{}. The gains hold beside it; a "
           "feedforward of kS, kV, kA and kG alone lacks it",
           value > 0.0 ? "grows" : "falls", std::abs(value), term.unit, term.largest,
           fit.mechanism == mechanisms::MechanismKind::elevator && value > 0.0
               ? ", or a further stage that is lifted from some height on"
               : "");
    } else if (term.name == "drag") {
      warn(diagnostics, "drag",
           "a drag of {:.3g} {} that grows with the square of the speed explains the log ({:.2g} V "
           "at its top speed). The gains hold beside it: kV v alone is too little at speed",
           value, term.unit, term.largest);
    } else if (term.name == "sag") {
      warn(
          diagnostics, "sag",
          "the motors get less than the log says, by a share that grows with the square of the "
          "command, {:.0f} % at 12 V: a battery that sags, or wires, with {:.2g} times the motors' "
          "resistance, while the command was recorded. The gains are those of the voltage at the "
          "motor; record that (applied output times bus voltage), or use voltage compensation",
          100.0 * value / (1.0 + value), value);
    } else if (term.name == "friction_along_travel") {
      warn(diagnostics, "friction_along_travel",
           "friction varies along the travel by up to {:.2g} V about kS = {:.3g} V. The gains hold "
           "beside it; look for a place that binds",
           value, fit.kS.value);
    } else if (term.name == "backlash") {
      warn(
          diagnostics, "backlash",
          "at the start of a step the encoder moves {:.2g} {} before the load follows: backlash or "
          "slack between them. The gains are those after it is taken up; a controller should not "
          "count on the load's moving before",
          value, term.unit);
    } else if (term.name == "asymmetric_friction" && std::abs(value) > fit.kS.value) {
      warn(diagnostics, "asymmetric_friction",
           "a constant force of {:.3g} V acts against the motion {} and with it {}: friction that "
           "differs by direction, a spring of little stiffness or a weight; the gains hold beside "
           "it",
           std::abs(value), value > 0.0 ? "forward" : "in reverse",
           value > 0.0 ? "in reverse" : "forward");
    } else if (term.name == "asymmetric_friction") {
      warn(diagnostics, "asymmetric_friction",
           "friction differs by direction: kS is {:.3g} V forward and {:.3g} V in reverse",
           fit.kS.value + value, fit.kS.value - value);
    } else if (term.name == "current_limit") {
      warn(diagnostics, "current_limit",
           "the speed rises as at a current limit: the voltage across the motor's resistance stays "
           "at {:.3g} V (limit times resistance) while the log says more. It holds what was "
           "commanded, not what was applied; the gains allow for it",
           value);
    }
  }
}

}  // namespace flyball::identification
