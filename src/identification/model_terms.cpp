#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "identification/model_terms.hpp"
#include "identification/record_noise.hpp"
#include "math/dense/dense.hpp"

namespace flyball::identification {
namespace {

constexpr int most_terms = 2;

/// Parameters that one cause moves.
using Term = std::vector<Eigen::Index>;

/// Whether it is the starts of the steps alone that tell the term.
bool tells_a_start(const Term& term) {
  return term.front() == parameter::take_up || term.front() == parameter::headroom;
}

/// Of a term over its standard error, squared; χ² of as many degrees of freedom as it has
/// parameters if it is absent: one in a million, as several terms are looked at and residuals are
/// not quite what is supposed. A start is looked at for one thing alone, and with white noise.
double beyond_doubt(const Term& term) {
  if (tells_a_start(term)) {
    return 12.0;
  }
  return 24.0 + 2.9 * static_cast<double>(term.size() - 1);
}

/// Of χ² of one degree of freedom whose sign is known, exceeded once in twenty.
constexpr double evidence_95 = 2.7;

/// Whether it is a step or two that tell the term beside the inertia. Residuals' own covariances
/// know little of so few, and see a sag in one plain log in six; the noise of the record is asked.
bool hangs_on_steps(const Term& term) {
  return term.front() == parameter::sag || term.front() == parameter::drag;
}

/// Of the evidence beyond doubt: with more, a term is fitted to see what would come of it.
constexpr double worth_a_fit = 0.5;
constexpr std::size_t most_fits = 3;
/// Of a current limit, its standard error at most: what is known worse is no limit that acts.
constexpr double widest_limit = 0.2;
/// s, that crossing backlash may take in a step.
constexpr std::array take_up_times{0.005, 0.015};
/// V, of a force: recorded voltages are not much better.
constexpr double perceptible = 0.05;
/// Two terms that differ by less evidence explain the same.
constexpr double as_good = 0.5;

/// The terms that the model's cost has a gradient by.
std::vector<Term> differentiable_terms() {
  std::vector<Term> terms{
      {parameter::bias}, {parameter::spring}, {parameter::drag}, {parameter::sag}};
  terms.emplace_back();
  for (int k = 0; k < field_count; ++k) {
    terms.back().push_back(parameter::friction_field + k);
  }
  return terms;
}

/// Drag pushes nothing, a battery gives nothing and has less resistance than the motors, and an
/// encoder is not behind its load.
bool is_physical(const Term& term, double value) {
  switch (term.front()) {
    case parameter::drag:
    case parameter::take_up:
      return value > 0.0;
    case parameter::sag:
      return value > 0.0 && value < 1.0;
    default:
      return true;
  }
}

void extend(OutputErrorProblem& problem, const Term& term, bool by_it) {
  for (const Eigen::Index k : term) {
    problem.extend(static_cast<int>(k), by_it);
  }
}

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

/// V, the largest force of a term in the log.
double largest_force(const OutputErrorProblem& problem, const Eigen::VectorXd& x,
                     const Term& term) {
  double largest = 0.0;
  for (const ResidualRun& run : problem.runs()) {
    for (std::size_t i = 0; i < run.input.time.size(); ++i) {
      double force = 0.0;
      for (const Eigen::Index k : term) {
        const auto& values = run.input.forces[static_cast<std::size_t>(k - parameter::first_force)];
        force += values.empty() ? 0.0 : x[k] * values[i];
      }
      largest = std::max(largest, std::abs(force));
    }
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
/// @param gain  What it must gain to count.
RobustFit with_limit(OutputErrorProblem& problem, const RobustFit& base, const Bounds& bounds,
                     const ChannelScales& scales, double gain) {
  const double most = largest_across(problem);
  RobustFit best = base;
  for (const double share : {0.8, 0.6, 0.4}) {
    Eigen::VectorXd start = base.x;
    start[parameter::headroom] = share * most;
    // Less voltage speeds the same mechanism up as fast only if there is less inertia.
    start[parameter::log_time_constant] += std::log(0.5 * (1.0 + share));
    RobustFit fit = minimize(problem, start, problem.free_parameters(), bounds, scales, 12, 0.1,
                             base.cost - gain);
    if (fit.cost < best.cost) {
      best = std::move(fit);
    }
  }
  return best;
}

/// The best fit with backlash, from sensors that are as late as usual: without it they are found so
/// early, and the inertia so large, that to first order nothing is left for it to explain.
/// @param gain  What it must gain to count.
RobustFit with_take_up(OutputErrorProblem& problem, const RobustFit& base, const Bounds& bounds,
                       const ChannelScales& scales, double gain) {
  const std::vector<bool> free = problem.free_parameters();
  RobustFit fit = base;
  for (const OutputErrorProblem::Prior& prior : problem.priors()) {
    const bool of_sensors = prior.parameter == parameter::position_delay ||
                            prior.parameter == parameter::velocity_delay ||
                            prior.parameter == parameter::averaging_width;
    if (of_sensors && free[static_cast<std::size_t>(prior.parameter)]) {
      fit.x[prior.parameter] = prior.mean;
    }
  }
  fit.x[parameter::take_up] = 0.005 * problem.recording().top_speed;  // of 5 ms
  RobustFit best = base;
  double best_time = take_up_times.front();
  for (const double time : take_up_times) {
    problem.cross_backlash_in(time);
    RobustFit tried = minimize(problem, fit.x, free, bounds, scales, 8, 0.3, base.cost - gain);
    if (tried.cost < best.cost && tried.x[parameter::take_up] > 0.0) {
      best = std::move(tried);
      best_time = time;
    }
  }
  problem.cross_backlash_in(best_time);
  return best;
}

struct Candidate {
  Term term;
  double evidence;  ///< Over what is beyond doubt, to first order.
  RobustFit start;
};

/// The largest evidence of those found, at least 1. A constant force has the most of what
/// correlated residuals make by chance: beside it others must not be overlooked.
double strongest(const std::vector<Candidate>& found) {
  double most = 1.0;
  for (const Candidate& candidate : found) {
    most = std::max(most, candidate.term.front() == parameter::bias ? 1.0 : candidate.evidence);
  }
  return most;
}

/// The terms that the model lacks, those first that to first order gain most.
std::vector<Candidate> candidates(OutputErrorProblem& problem, const Bounds& bounds,
                                  const ChannelScales& scales, const RobustFit& best) {
  std::vector<Term> absent;
  for (const Term& term : differentiable_terms()) {
    const auto first = static_cast<int>(term.front());
    if (problem.can_extend(first) && !problem.is_extended(first)) {
      absent.push_back(term);
    }
  }
  std::vector<Candidate> found;
  const std::vector<Score> all =
      scores(problem, best.x, problem.free_parameters(), bounds, scales, absent);
  for (std::size_t k = 0; k < absent.size(); ++k) {
    if (all[k].gain > 0.0 && is_physical(absent[k], all[k].step[0])) {
      found.push_back({absent[k], all[k].gain / beyond_doubt(absent[k]), best});
    }
  }
  const auto worthwhile = [&found](const Term& term) {
    return worth_a_fit * strongest(found) * beyond_doubt(term);
  };
  if (problem.can_extend(parameter::take_up) && !problem.is_extended(parameter::take_up)) {
    const Term backlash{parameter::take_up};
    extend(problem, backlash, true);
    RobustFit ahead = with_take_up(problem, best, bounds, scales, worthwhile(backlash));
    extend(problem, backlash, false);
    const double gain = best.cost - ahead.cost;
    found.push_back({backlash, gain / beyond_doubt(backlash), std::move(ahead)});
  }
  const Term limit{parameter::headroom};
  if (!problem.is_extended(parameter::headroom)) {
    extend(problem, limit, true);
    RobustFit limited = with_limit(problem, best, bounds, scales, worthwhile(limit));
    extend(problem, limit, false);
    const double gain = best.cost - limited.cost;
    found.push_back({limit, gain / beyond_doubt(limit), std::move(limited)});
  }
  std::sort(found.begin(), found.end(),
            [](const Candidate& a, const Candidate& b) { return a.evidence > b.evidence; });
  return found;
}

/// How much correlated residuals inflate the fall of the cost by a term. What a start tells stands
/// in one or two blocks, whose sums say nothing of their spread: there the correlation of all
/// residuals is what is left to go by.
/// @param small  Whether the term is so small that few blocks may have made it.
double inflation_of(const Covariances& spread, const Term& term, bool small) {
  if (term.front() == parameter::take_up) {
    return std::max(1.0, spread.estimates.back()(term.front(), term.front()) /
                             spread.independent(term.front(), term.front()));
  }
  double largest = 1.0;
  for (const Eigen::Index k : term) {
    largest = std::max(largest, small ? spread.inflation(k) : spread.score_inflation(k));
  }
  return largest;
}

/// A model with one term more.
struct Judged {
  Term term;
  RobustFit fit;
  double gain = 0.0;      ///< Of the cost.
  double evidence = 0.0;  ///< Over what is beyond doubt.
  Eigen::VectorXd moved;  ///< Of the parameters, by the term.
  /// Of a term in doubt that hangs on steps, over its covariance as the record's noise makes it.
  double by_noise = std::numeric_limits<double>::infinity();
  [[nodiscard]] double chi_squared() const { return evidence * beyond_doubt(term); }
  /// What it is worth where it is not beyond doubt.
  [[nodiscard]] double in_doubt() const { return std::min(chi_squared(), by_noise); }
};

/// The term over its covariance at a minimum, squared, as the noise of the record makes it.
double over_noise(OutputErrorProblem& problem, const Bounds& bounds, const ChannelScales& scales,
                  const Eigen::VectorXd& x, const Term& term) {
  const RecordNoise noise = estimate_record_noise(problem, x, scales);
  const Covariances spread =
      covariances(problem, x, problem.free_parameters(), bounds, scales, &noise);
  if (spread.singular) {
    return 0.0;
  }
  const Eigen::VectorXd value = x(term);
  const Eigen::VectorXd solution = detail::solve_symmetric(spread.estimates[1](term, term), value);
  return value.dot(solution);
}

/// Fits the model with a term more, and leaves it without.
Judged judge(OutputErrorProblem& problem, const Bounds& bounds, const ChannelScales& scales,
             const RobustFit& best, const Candidate& candidate) {
  const Term& term = candidate.term;
  extend(problem, term, true);
  const RobustFit larger = refit(problem, candidate.start, bounds, scales);
  Judged judged{term, larger, 0.0, 0.0, Eigen::VectorXd::Zero(best.x.size())};
  if (larger.cost < best.cost && is_physical(term, larger.x[term.front()])) {
    problem.refresh_forces(larger.x);
    // Judged by the residuals that the larger model leaves, which are white if it is right.
    const ChannelScales fresh = residual_scales(problem, larger.x);
    const Covariances spread =
        covariances(problem, larger.x, problem.free_parameters(), bounds, fresh);
    judged.fit = minimize(problem, larger.x, problem.free_parameters(), bounds, fresh, 60, 1e-2);
    const bool small = term.front() < parameter::headroom &&
                       largest_force(problem, judged.fit.x, term) < perceptible;
    const auto of_noise = [&] {
      extend(problem, term, true);
      problem.refresh_forces(judged.fit.x);
      return over_noise(problem, bounds, fresh, judged.fit.x, term);
    };
    extend(problem, term, false);
    problem.refresh_forces(best.x);
    const RobustFit without =
        minimize(problem, best.x, problem.free_parameters(), bounds, fresh, 60, 1e-2);
    judged.gain = without.cost - judged.fit.cost;
    judged.evidence = spread.singular
                          ? 0.0
                          : judged.gain / inflation_of(spread, term, small) / beyond_doubt(term);
    const Eigen::VectorXd first = Eigen::VectorXd::Unit(best.x.size(), term.front());
    if (term.front() == parameter::headroom &&
        spread.standard_error(first) > widest_limit * judged.fit.x[term.front()]) {
      judged.evidence = std::min(judged.evidence, worth_a_fit);
    }
    judged.moved = judged.fit.x - without.x;
    if (hangs_on_steps(term) && judged.evidence < 1.0 && judged.chi_squared() > evidence_95) {
      judged.by_noise = of_noise();
    }
    // So far away, and no better: another valley, not a doubt.
    if (judged.evidence < 1.0 && std::abs(judged.moved[parameter::log_time_constant]) > 0.5) {
      judged.moved.setZero();
    }
    judged.fit.iterations += larger.iterations + best.iterations;
  }
  extend(problem, term, false);
  problem.refresh_forces(best.x);
  return judged;
}

std::vector<Judged>::iterator find(std::vector<Judged>& all, Eigen::Index term) {
  return std::find_if(all.begin(), all.end(),
                      [term](const Judged& judged) { return judged.term.front() == term; });
}

/// That there is the term: odds of one to ten before the data, of which half is lost to what else
/// it could have been.
double probability(const Judged& judged) {
  constexpr double against = 20.0;
  return 1.0 / (1.0 + against * std::exp(-0.5 * judged.in_doubt()));
}

/// The parameters that are there without the term, as far as it would move them.
Eigen::VectorXd doubt(const Judged& judged, double share) {
  Eigen::VectorXd moved = share * judged.moved;
  for (const Eigen::Index k : judged.term) {
    moved[k] = 0.0;
  }
  return moved;
}

/// Slack and a current limit both make a speed rise late: where one was judged, the other is.
void judge_rivals(OutputErrorProblem& problem, const Bounds& bounds, const ChannelScales& scales,
                  const RobustFit& best, const std::vector<Candidate>& found,
                  std::vector<Judged>& all) {
  const auto judged = [&all](const Term& term) { return find(all, term.front()) != all.end(); };
  if (std::none_of(all.begin(), all.end(),
                   [](const Judged& one) { return tells_a_start(one.term); })) {
    return;
  }
  for (const Candidate& candidate : found) {
    if (tells_a_start(candidate.term) && !judged(candidate.term)) {
      all.push_back(judge(problem, bounds, scales, best, candidate));
    }
  }
}

/// Of slack and a current limit the one is taken that explains more; where the other explains
/// nearly as much, it is told, too.
void choose_start(std::vector<Judged>& all, std::vector<Judged>::iterator& better,
                  Extension& extension) {
  if (better == all.end() || better->evidence < 1.0 || !tells_a_start(better->term)) {
    return;
  }
  const bool limited = better->term.front() == parameter::headroom;
  const int rival = limited ? int{parameter::take_up} : int{parameter::headroom};
  auto other = find(all, rival);
  if (other == all.end()) {
    return;
  }
  if (other->gain > better->gain && other->evidence > worth_a_fit) {
    std::swap(other, better);
    better->evidence = std::max(better->evidence, 1.0);
  }
  constexpr double surely = 12.0;  // of twice the logarithm of the likelihood
  if (better->gain - other->gain < std::max(surely, 0.1 * better->gain)) {
    Judged between = *other;
    between.moved -= better->moved;
    between.term.push_back(better->term.front());
    extension.doubts.push_back(doubt(between, 0.5));
    extension.open.push_back({static_cast<int>(other->term.front()), between.moved, true, 0.5});
  }
}

}  // namespace

Extension extend_model(OutputErrorProblem& problem, const Bounds& bounds, ChannelScales scales,
                       RobustFit& best, bool backlash) {
  Extension extension;
  problem.offer_backlash(backlash);
  problem.offer_field(true);
  problem.refresh_forces(best.x);
  for (int round = 0; round < most_terms; ++round) {
    const std::vector<Candidate> found = candidates(problem, bounds, scales, best);
    // To first order a term may look better than it is: some are fitted, the best is taken.
    std::vector<Judged> all;
    const double least = worth_a_fit * strongest(found);
    for (std::size_t k = 0; k < found.size(); ++k) {
      const bool promising = k < most_fits && found[k].evidence >= least;
      const bool as_drag =
          found[k].term.front() == parameter::sag && find(all, parameter::drag) != all.end();
      if (promising || as_drag) {
        all.push_back(judge(problem, bounds, scales, best, found[k]));
      }
    }
    judge_rivals(problem, bounds, scales, best, found, all);
    auto better = std::max_element(all.begin(), all.end(), [](const Judged& a, const Judged& b) {
      const bool sure = b.evidence >= 1.0;
      return (a.evidence >= 1.0) == sure ? a.chi_squared() < b.chi_squared() : sure;
    });
    choose_start(all, better, extension);
    if (better == all.end() || better->evidence < 1.0) {
      for (const Judged& judged : all) {
        if (hangs_on_steps(judged.term) && judged.in_doubt() <= evidence_95) {
          continue;
        }
        // No log of a step of one height tells a sagging battery from more inertia: with a sag a
        // standard error larger than found.
        const double weight = judged.term.front() == parameter::sag
                                  ? 1.0 + 1.0 / std::sqrt(judged.in_doubt())
                                  : std::sqrt(probability(judged));
        extension.doubts.push_back(doubt(judged, weight));
        extension.open.push_back(
            {static_cast<int>(judged.term.front()), judged.moved, false, weight});
      }
      break;
    }
    // At a flywheel a sagging battery looks like a little drag and more inertia.
    const auto sag = find(all, parameter::sag);
    const auto drag = find(all, parameter::drag);
    if (sag != all.end() && drag != all.end() && (better == sag || better == drag)) {
      Judged between = *drag;
      between.moved -= sag->moved;
      between.term.push_back(parameter::sag);
      if (std::abs(sag->evidence - drag->evidence) < as_good) {
        better = sag;
        extension.doubts.push_back(doubt(between, 0.5));
      } else if (better == drag && sag->gain > 0.5 * drag->gain) {
        between.moved = -between.moved;
        extension.doubts.push_back(doubt(between, 1.0));
        extension.open.push_back({parameter::sag, between.moved, true, 1.0});
      }
    }
    extend(problem, better->term, true);
    problem.refresh_forces(better->fit.x);
    scales = residual_scales(problem, better->fit.x);
    const int iterations = better->fit.iterations;
    best = minimize(problem, better->fit.x, problem.free_parameters(), bounds, scales, 60, 1e-2);
    best.iterations += iterations;
    extension.extended = true;
  }
  problem.offer_field(problem.is_extended(parameter::friction_field));
  problem.refresh_forces(best.x);
  return extension;
}

}  // namespace flyball::identification
