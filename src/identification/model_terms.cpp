#include <algorithm>
#include <array>
#include <cmath>

#include "core/diagnose.hpp"
#include "identification/estimates.hpp"
#include "identification/model_terms.hpp"

namespace flyball::identification {
namespace {

/// Of a term over its standard error, squared; χ² of one degree of freedom if it is absent: one in
/// a million, as four terms are looked at and residuals are not quite what is supposed.
constexpr double beyond_doubt = 24.0;
constexpr int most_terms = 2;

constexpr std::array linear_terms{parameter::bias, parameter::spring, parameter::drag};

/// The largest voltage across the resistance that the model without a limit supposes.
double largest_across(OutputErrorProblem& problem) {
  double largest = 0.0;
  for (const ResidualRun& run : problem.runs()) {
    const auto [low, high] =
        std::minmax_element(run.input.voltage.begin(), run.input.voltage.end());
    largest = std::max({largest, std::abs(*low), std::abs(*high)});
  }
  return largest;
}

RobustFit refit(OutputErrorProblem& problem, const RobustFit& from, const Bounds& bounds,
                const ChannelScales& scales) {
  constexpr int refreshes = 3;
  RobustFit fit = from;
  for (int refresh = 0; refresh < refreshes; ++refresh) {
    problem.refresh_forces(fit.x);
    const bool last = refresh + 1 == refreshes;
    fit = minimize(problem, fit.x, problem.free_parameters(), bounds, scales, last ? 60 : 15,
                   last ? 1e-3 : 0.1);
  }
  return fit;
}

/// The best fit with a current limit, looked for from several.
RobustFit with_limit(OutputErrorProblem& problem, const RobustFit& base, const Bounds& bounds,
                     const ChannelScales& scales) {
  const double most = largest_across(problem);
  RobustFit best = base;
  for (const double share : {0.8, 0.6, 0.4}) {
    Eigen::VectorXd start = base.x;
    start[parameter::headroom] = share * most;
    // Less voltage speeds the same mechanism up as fast only if there is less inertia.
    start[parameter::log_time_constant] += std::log(0.5 * (1.0 + share));
    RobustFit fit = minimize(problem, start, problem.free_parameters(), bounds, scales, 12, 0.1);
    if (fit.cost < best.cost) {
      best = std::move(fit);
    }
  }
  return best;
}

}  // namespace

Extension extend_model(OutputErrorProblem& problem, const Bounds& bounds,
                       const ChannelScales& scales, RobustFit& best) {
  struct Candidate {
    int term;
    double gain;
    RobustFit start;
  };
  Extension extension;
  for (int round = 0; round < most_terms; ++round) {
    const std::vector<bool> free = problem.free_parameters();
    std::vector<int> absent;
    for (const int term : linear_terms) {
      if (problem.can_extend(term) && !problem.is_extended(term)) {
        absent.push_back(term);
      }
    }
    std::vector<Candidate> candidates;
    const std::vector<Score> found = scores(problem, best.x, free, bounds, scales, absent);
    for (std::size_t k = 0; k < absent.size(); ++k) {
      const bool pushes = absent[k] == parameter::drag && found[k].step < 0.0;
      if (!pushes) {
        candidates.push_back({absent[k], found[k].gain, best});
      }
    }
    if (!problem.is_extended(parameter::headroom)) {
      problem.extend(parameter::headroom, true);
      RobustFit limited = with_limit(problem, best, bounds, scales);
      problem.extend(parameter::headroom, false);
      const double gain = best.cost - limited.cost;
      candidates.push_back({parameter::headroom, gain, std::move(limited)});
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
    // To first order a term may look better than it is: two are fitted, the better is taken.
    RobustFit better = best;
    int term = -1;
    for (std::size_t k = 0; k < std::min<std::size_t>(2, candidates.size()); ++k) {
      if (candidates[k].gain < beyond_doubt) {
        break;
      }
      problem.extend(candidates[k].term, true);
      RobustFit fit = refit(problem, candidates[k].start, bounds, scales);
      problem.extend(candidates[k].term, false);
      if (fit.cost < better.cost) {
        better = std::move(fit);
        term = candidates[k].term;
      }
    }
    if (term < 0) {
      problem.refresh_forces(best.x);
      break;
    }
    problem.extend(term, true);
    problem.refresh_forces(better.x);
    // Judged by the residuals that the larger model leaves, which are white if it is right.
    const ChannelScales fresh = residual_scales(problem, better.x);
    const Covariances spread =
        covariances(problem, better.x, problem.free_parameters(), bounds, fresh);
    problem.extend(term, false);
    problem.refresh_forces(best.x);
    const RobustFit without =
        minimize(problem, best.x, problem.free_parameters(), bounds, fresh, 60, 1e-2);
    problem.extend(term, true);
    problem.refresh_forces(better.x);
    RobustFit with =
        minimize(problem, better.x, problem.free_parameters(), bounds, fresh, 60, 1e-2);
    const double fall = without.cost - with.cost;
    const double evidence = spread.singular ? 0.0 : fall / spread.inflation(term);
    if (evidence < beyond_doubt) {
      const double weight = std::clamp(evidence / beyond_doubt, 0.0, 1.0);
      extension.doubt = std::sqrt(weight) * (with.x - without.x);
      extension.doubt[term] = 0.0;
      problem.extend(term, false);
      problem.refresh_forces(best.x);
      break;
    }
    with.iterations += better.iterations + best.iterations;
    best = std::move(with);
    extension.extended = true;
  }
  return extension;
}

std::vector<ModelTerm> estimate_terms(const OutputErrorProblem& problem, const RobustFit& best,
                                      const Covariances& spread) {
  struct Row {
    int parameter;
    const char* name;
    const char* unit;  ///< After "V".
  };
  static constexpr std::array rows{
      Row{parameter::bias, "asymmetric_friction", ""}, Row{parameter::spring, "spring", "/unit"},
      Row{parameter::drag, "drag", "/(unit/s)²"}, Row{parameter::headroom, "current_limit", ""}};
  std::vector<ModelTerm> terms;
  const std::string& unit = problem.recording().unit;
  for (const Row& row : rows) {
    if (!problem.is_extended(row.parameter)) {
      continue;
    }
    ModelTerm term;
    term.name = row.name;
    term.unit = std::string("V") + row.unit;
    if (const std::size_t at = term.unit.find("unit"); at != std::string::npos) {
      term.unit.replace(at, 4, unit);
    }
    const Eigen::VectorXd gradient = Eigen::VectorXd::Unit(best.x.size(), row.parameter);
    term.value = symmetric_estimate(best.x[row.parameter], spread.standard_error(gradient));
    // What it makes at most in this log.
    const int force = row.parameter - parameter::first_force;
    for (const ResidualRun& run : problem.runs()) {
      if (force < force_count) {
        for (const double input : run.input.forces[static_cast<std::size_t>(force)]) {
          term.largest = std::max(term.largest, std::abs(input * term.value.value));
        }
      }
    }
    if (row.parameter == parameter::headroom) {
      term.largest = term.value.value;
    }
    terms.push_back(std::move(term));
  }
  return terms;
}

void report_terms(const FeedforwardFit& fit, std::vector<Diagnostic>& diagnostics) {
  for (const ModelTerm& term : fit.terms) {
    const double value = term.value.value;
    if (term.name == "spring") {
      warn(diagnostics, "spring",
           "a force that {} with the position by {:.3g} {} ({:.2g} V at an end of the travel) "
           "explains the log: a spring, a counterbalance or a cable. The gains hold beside it; a "
           "feedforward of kS, kV, kA and kG alone lacks it",
           value > 0.0 ? "grows" : "falls", std::abs(value), term.unit, term.largest);
    } else if (term.name == "drag") {
      warn(diagnostics, "drag",
           "a drag of {:.3g} {} that grows with the square of the speed explains the log ({:.2g} V "
           "at its top speed). The gains hold beside it: kV v alone is too little at speed",
           value, term.unit, term.largest);
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
