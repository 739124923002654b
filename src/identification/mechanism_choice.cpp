#include <flyball/identification/mechanism_choice.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/gain_fit.hpp"
#include "identification/statistics.hpp"
#include "identification/test_coverage.hpp"

namespace flyball::identification {
namespace {

using mechanisms::MechanismKind;

constexpr double term_beyond_doubt = 24.0;  // as of a term of the model
constexpr double least_gravity = 0.1;       // V; less may be friction that differs by direction
constexpr double hidden_gravity = 0.15;     // V; what can be no larger than that is none
constexpr double turn = 2.0 * std::numbers::pi;
constexpr double arm_travel = 1.05 * turn;       // rad, of an arm at most
constexpr double flywheel_travel = 10.0 * turn;  // rad, of a flywheel at least
constexpr double elevator_travel = 5.0;          // m, of an elevator at most
constexpr std::size_t enough = 1500;             // residuals

/// A kind's model of the recording.
struct Hypothesis {
  PreparedRecording prepared;
  std::unique_ptr<OutputErrorProblem> problem;
  Bounds bounds;
  ChannelScales scales;
  RobustFit fit;
  double likelihood = 0.0;  ///< −ln, of the scales alone: what each fit leaves.
};

double travel_of(const PreparedRecording& prepared) {
  double largest = 0.0;
  for (const PreparedRun& run : prepared.runs) {
    double low = 0.0;
    double high = 0.0;
    if (!run.moved || run.first >= run.last) {
      continue;
    }
    const std::vector<double>& time = run.run.time;
    double at = 0.0;
    for (std::size_t i = run.first + 1; i < run.last; ++i) {
      at +=
          0.5 * (run.smoothed_velocity[i] + run.smoothed_velocity[i - 1]) * (time[i] - time[i - 1]);
      low = std::min(low, at);
      high = std::max(high, at);
    }
    largest = std::max(largest, high - low);
  }
  return largest;
}

Expected<std::unique_ptr<Hypothesis>> fit_kind(const PreparedRecording& prepared,
                                               MechanismKind kind, const FitOptions& options) {
  auto made = std::make_unique<Hypothesis>();
  made->prepared = prepared;
  made->prepared.mechanism = kind;
  FLYBALL_TRY(const auto gains, regress_gains(made->prepared));
  const std::size_t all = OutputErrorProblem(made->prepared, options).residuals();
  made->problem = std::make_unique<OutputErrorProblem>(made->prepared, options,
                                                       std::clamp<std::size_t>(all / enough, 1, 8));
  if (made->problem->residuals() < 10 * static_cast<std::size_t>(made->problem->parameters())) {
    return refusal(IdentificationError::too_short, "identify").hint("record longer tests");
  }
  made->bounds = make_bounds(*made->problem, gains, options);
  made->fit = fit_gains(*made->problem, gains, made->bounds, options, made->scales);
  std::size_t differences = 0;
  for (const ResidualRun& run : made->problem->runs()) {
    differences += run.differences.size();
  }
  const std::size_t velocities = made->problem->residuals() - differences;
  const auto share = [](std::size_t count, double scale) {
    return scale > 0.0 ? static_cast<double>(count) * std::log(scale) : 0.0;
  };
  made->likelihood =
      share(differences, made->scales.difference) + share(velocities, made->scales.velocity);
  return made;
}

/// RMS of the velocity's residuals over the velocity's standard deviation.
double misfit(Hypothesis& made) {
  ResidualBlock block;
  double squares = 0.0;
  double sum = 0.0;
  double power = 0.0;
  double count = 0.0;
  for (std::size_t index = 0; index < made.problem->runs().size(); ++index) {
    const ResidualRun& run = made.problem->runs()[index];
    const TestRun& source = made.prepared.runs[run.prepared].run;
    made.problem->evaluate(index, made.fit.x, block);
    const auto add = [&](double residual, double velocity) {
      squares += residual * residual;
      sum += velocity;
      power += velocity * velocity;
      count += 1.0;
    };
    for (std::size_t i = 0; i < run.velocities.size(); ++i) {
      add(block.velocity[static_cast<Eigen::Index>(i)], source.velocity[run.velocities[i]]);
    }
    for (std::size_t i = 0; run.velocities.empty() && i < run.differences.size(); ++i) {
      const auto [from, to] = run.differences[i];
      const double span = source.time[to] - source.time[from];
      add(block.difference[static_cast<Eigen::Index>(i)] / span,
          (source.position[to] - source.position[from]) / span);
    }
  }
  const double spread = power - sum * sum / std::max(1.0, count);
  return spread > 0.0 ? std::sqrt(squares / spread) : 0.0;
}

KindEvidence weigh(Hypothesis& made) {
  KindEvidence weighed;
  weighed.kind = *made.prepared.mechanism;
  weighed.nrmse = misfit(made);
  if (weighed.kind == MechanismKind::flywheel) {
    return weighed;
  }
  const Covariances spread = covariances(*made.problem, made.fit.x, made.problem->free_parameters(),
                                         made.bounds, made.scales);
  const double cosine = made.fit.x[parameter::gravity_cosine];
  const double sine = made.fit.x[parameter::gravity_sine];
  weighed.gravity = std::hypot(cosine, sine);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(made.fit.x.size());
  gradient[parameter::gravity_cosine] = cosine / std::max(weighed.gravity, 1e-12);
  gradient[parameter::gravity_sine] = sine / std::max(weighed.gravity, 1e-12);
  weighed.standard_error = spread.singular || made.problem->hides_friction()
                               ? std::numeric_limits<double>::infinity()
                               : spread.standard_error(gradient);
  return weighed;
}

/// How much correlated residuals inflate a fall of the cost, by the best model's.
double inflation_of(Hypothesis& best, const ChannelScales& scales) {
  const Covariances spread =
      covariances(*best.problem, best.fit.x, best.problem->free_parameters(), best.bounds, scales);
  double largest = 1.0;
  for (const int term :
       {parameter::static_friction, parameter::gravity_cosine, parameter::gravity_sine}) {
    largest = std::max(largest, spread.singular ? 1.0 : spread.inflation(term));
  }
  return largest;
}

std::string in_travel(const MechanismChoice& choice, bool linear) {
  return linear ? detail::format("a test goes {:.3g} m far", choice.travel)
                : detail::format("a test goes {:.3g} turns far", choice.travel / turn);
}

std::string gravity_text(const KindEvidence& found) {
  if (!std::isfinite(found.standard_error)) {
    return "the tests, in one direction alone, do not tell gravity from friction";
  }
  const char* form =
      found.kind == MechanismKind::arm ? "the cosine of the angle" : "the same throughout";
  return detail::format(
      "a gravity of {:.3g} ± {:.2g} V, {}, explains it (the simulated velocity then misses "
      "{:.2g} % of the measured one's spread; χ² falls by {:.3g})",
      found.gravity, 1.96 * found.standard_error, form, 100.0 * found.nrmse, found.evidence);
}

std::string no_gravity_text(const KindEvidence& found) {
  return std::isfinite(found.standard_error)
             ? detail::format("there is no gravity in it (below {:.2g} V)",
                              found.gravity + 1.96 * found.standard_error)
             : gravity_text(found);
}

/// The kinds that fit, of recordings in metres.
void decide_linear(MechanismChoice& choice, const KindEvidence& constant, bool gravity, bool none) {
  const std::string travel = in_travel(choice, true);
  if (choice.travel <= elevator_travel) {
    choice.fitting = {MechanismKind::elevator};
    choice.evidence = "positions are lengths, " + travel + ", and " +
                      (gravity ? gravity_text(constant) : no_gravity_text(constant));
    return;
  }
  choice.fitting = {MechanismKind::flywheel};
  choice.evidence =
      travel + ", and " + (gravity ? gravity_text(constant) : no_gravity_text(constant));
  if (!none) {
    choice.fitting.push_back(MechanismKind::elevator);
  }
}

}  // namespace

Expected<MechanismChoice> choose_mechanism(const PreparedRecording& prepared,
                                           const FitOptions& options) {
  FLYBALL_CHECK(cover_tests(prepared));
  const bool linear = prepared.unit == "m";
  std::vector<MechanismKind> kinds{MechanismKind::flywheel, MechanismKind::elevator};
  if (!linear && prepared.has_position) {
    kinds.push_back(MechanismKind::arm);
  }
  MechanismChoice choice;
  choice.travel = travel_of(prepared);
  std::vector<std::unique_ptr<Hypothesis>> all;
  for (const MechanismKind kind : kinds) {
    FLYBALL_TRY(auto made, fit_kind(prepared, kind, options));
    all.push_back(std::move(made));
  }
  // One yardstick for all: what the best leaves.
  Hypothesis& best = **std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a->likelihood < b->likelihood;
  });
  const ChannelScales scales = best.scales;
  const double inflation = inflation_of(best, scales);
  for (const auto& made : all) {
    choice.compared.push_back(weigh(*made));
    made->fit = minimize(*made->problem, made->fit.x, made->problem->free_parameters(),
                         made->bounds, scales, 40, 1e-2);
    choice.compared.back().evidence = (all.front()->fit.cost - made->fit.cost) / inflation;
  }
  const auto gravity_of = [](const KindEvidence& found) {
    return std::isfinite(found.standard_error) && found.evidence >= term_beyond_doubt &&
           found.gravity >= least_gravity && found.gravity > 3.0 * found.standard_error;
  };
  const auto none_of = [](const KindEvidence& found) {
    return found.gravity + 1.96 * found.standard_error <= hidden_gravity;
  };
  const KindEvidence& constant = choice.compared[1];
  const bool steady = gravity_of(constant);
  if (linear) {
    decide_linear(choice, constant, steady, none_of(constant));
    return choice;
  }
  const std::string travel = in_travel(choice, false);
  if (choice.compared.size() == 3) {
    const KindEvidence& arm = choice.compared[2];
    if (choice.travel <= arm_travel) {
      const bool turns = gravity_of(arm);
      choice.fitting = {MechanismKind::arm};
      choice.evidence = travel + ", and " + (turns ? gravity_text(arm) : no_gravity_text(arm));
      if (!turns) {
        choice.fitting.push_back(MechanismKind::turret);
      } else if (constant.evidence > arm.evidence + term_beyond_doubt) {
        choice.fitting.push_back(MechanismKind::flywheel);
      }
      return choice;
    }
    if (gravity_of(arm) && arm.evidence > constant.evidence + term_beyond_doubt) {
      choice.fitting = {MechanismKind::arm, MechanismKind::flywheel};
      choice.evidence = travel + ", and " + gravity_text(arm);
      return choice;
    }
  }
  choice.fitting = {MechanismKind::flywheel};
  choice.evidence =
      travel + ", and " + (steady ? gravity_text(constant) : no_gravity_text(constant));
  if (steady || !none_of(constant)) {
    choice.fitting.push_back(MechanismKind::elevator);
  }
  if (choice.travel < flywheel_travel) {
    choice.fitting.push_back(MechanismKind::arm);
  }
  return choice;
}

}  // namespace flyball::identification
