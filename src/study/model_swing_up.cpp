#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <flyball/core/random.hpp>
#include <flyball/math/expression/differentiate.hpp>
#include <flyball/math/expression/tape_builder.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "study/model_swing_up.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using expression::Operation;
using expression::Slot;

constexpr std::string_view in_swing_up = "swing_up";

/// Of the equations' tape the derivatives alone.
expression::Tape derivatives_of(const ModelJob& job) {
  const expression::Tape& all = job.equations.tape;
  const auto n = static_cast<std::size_t>(job.model.states());
  expression::TapeBuilder builder(all.inputs(), all.parameters());
  std::vector<Slot> made;
  for (const expression::Node& node : all.nodes()) {
    expression::Node moved = node;
    const int operands = expression::operand_count(node.operation);
    moved.a = operands > 0 ? made[node.a].index : node.a;
    moved.b = operands > 1 ? made[node.b].index : node.b;
    moved.c = operands > 2 ? made[node.c].index : node.c;
    made.push_back(builder.node(moved));
  }
  std::vector<Slot> outputs;
  for (const Slot& slot : all.output_slots().first(n)) {
    outputs.push_back(made[slot.index]);
  }
  return builder.finish(outputs);
}

/// E and ∂E/∂x ∂f/∂u, what a unit of the input adds to it a second.
expression::Tape law_of(const ModelJob& job) {
  const auto n = static_cast<std::size_t>(job.model.states());
  const expression::Derivatives all = expression::differentiate(job.equations.tape);
  expression::TapeBuilder builder(all.tape.inputs(), all.tape.parameters());
  std::vector<Slot> made;
  for (const expression::Node& node : all.tape.nodes()) {
    expression::Node moved = node;
    const int operands = expression::operand_count(node.operation);
    moved.a = operands > 0 ? made[node.a].index : node.a;
    moved.b = operands > 1 ? made[node.b].index : node.b;
    moved.c = operands > 2 ? made[node.c].index : node.c;
    made.push_back(builder.node(moved));
  }
  const auto slot_of = [&](std::size_t row, std::size_t column) {
    for (std::size_t e = 0; e < all.entries.size(); ++e) {
      if (all.entries[e].row == row && all.entries[e].column == column) {
        return std::optional(made[all.tape.output_slots()[all.rows + e].index]);
      }
    }
    return std::optional<Slot>();
  };
  Slot power = builder.constant(0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const auto slope = slot_of(n, i);
    const auto pushed = slot_of(i, n);
    if (slope && pushed) {
      power = builder.binary(Operation::add, power,
                             builder.binary(Operation::multiply, *slope, *pushed));
    }
  }
  const std::array outputs{made[all.tape.output_slots()[n].index], power};
  return builder.finish(outputs);
}

/// The law, as it runs.
class Swinging {
 public:
  Swinging(const ModelJob& job, const ModelRegulator& regulator, const ModelRegion& region,
           const SwingUpRunResult& made)
      : job_(job), regulator_(regulator), region_(region), made_(made), values_(made.law.size()) {
    made.law.prepare<double>(made.parameters, values_);
  }

  [[nodiscard]] std::array<double, 2> energy(const VectorXd& x) {
    std::vector<double> in(x.begin(), x.end());
    in.push_back(regulator_.point.u(0));
    std::array<double, 2> out{};
    made_.law.evaluate<double>(in, out, values_);
    return out;
  }

  LoopCommand operator()(const LoopSample& sample) {
    const CertifiedRegion& region = region_.certified;
    const double V = region.value(sample.x);
    constexpr double hysteresis = 1.5;
    const bool before = balances;
    balances = V <= (balances ? hysteresis : 1.0) * region.level;
    if (balances && !before) {
      taken = sample.time;
    }
    constexpr double standing = 0.01;
    if (!balances || V > standing * region.level) {
      stands.reset();
    } else if (!stands) {
      stands = sample.time;
    }
    const OperatingPoint& point = regulator_.point;
    VectorXd error = point.x - sample.x;
    wrap_angles(error, job_.model.names().states);
    if (balances) {
      return VectorXd(point.u + regulator_.K * error);
    }
    const auto [E, power] = energy(sample.x);
    const double missing =
        std::clamp(job_.swing_up.sharpness * (made_.energy - E) / made_.scale, -1.0, 1.0);
    const double push = job_.limit(0) * missing * (power < 0.0 ? -1.0 : 1.0);
    return VectorXd::Constant(1, point.u(0) + push + job_.swing_up.hold.dot(error));
  }

  bool balances = false;
  std::optional<double> taken{}, stands{};

 private:
  const ModelJob& job_;
  const ModelRegulator& regulator_;
  const ModelRegion& region_;
  const SwingUpRunResult& made_;
  std::vector<double> values_;
};

/// States that are angles.
std::vector<Index> angles_of(const ModelJob& job) {
  std::vector<Index> angles;
  const auto& states = job.model.names().states;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i].is_angle) {
      angles.push_back(static_cast<Index>(i));
    }
  }
  return angles;
}

/// The plane that is shown: the first angle, or state, and the state that moves it most.
void choose_plane(const ModelJob& job, const ModelRegulator& regulator, ModelRegion& region) {
  const std::vector<Index> angles = angles_of(job);
  region.first = angles.empty() ? 0 : angles.front();
  const Eigen::MatrixXd& A = regulator.linear.A;
  region.second = region.first == 0 ? 1 : 0;
  for (Index j = 0; j < A.cols(); ++j) {
    if (j != region.first &&
        std::abs(A(region.first, j)) > std::abs(A(region.first, region.second))) {
      region.second = j;
    }
  }
}

}  // namespace

bool wants_region(const ModelJob& job, const ModelRegulator& regulator) {
  if (job.swing_up.has_energy) {
    return true;
  }
  constexpr std::size_t most_operations = 2000;  // else the search takes longer than it is worth
  if (job.equations.tape.size() > most_operations) {
    return false;
  }
  const Eigen::VectorXcd poles = flyball::detail::eigenvalues_of(regulator.linear.A);
  return job.equations.tape.outputs() > 0 && job.limit.allFinite() && job.model.states() >= 2 &&
         job.model.states() <= 6 && std::any_of(poles.begin(), poles.end(), [](const auto& pole) {
           return pole.real() > 1e-9;
         });
}

Expected<ModelRegion> region_of(const ModelJob& job, const ModelRegulator& regulator) {
  if (!job.limit.allFinite()) {
    return refusal(ArgumentError::empty, in_swing_up, "controller.limit")
        .got("missing")
        .expected("how much each input can do, such as limit = { u = \"6 N m\" }");
  }
  ModelRegion region{.loop = {.model = {.f = derivatives_of(job),
                                        .parameters = job.equations.parameters,
                                        .states = job.model.states(),
                                        .inputs = job.model.inputs()},
                              .x = regulator.point.x,
                              .u = regulator.point.u,
                              .K = regulator.K,
                              .u_min = -job.limit,
                              .u_max = job.limit,
                              .angles = angles_of(job)}};
  // About a second's work for the proof, and less for the sample, whatever the size of the
  // formulas.
  const double operations = 50.0 + static_cast<double>(region.loop.model.f.size());
  const double cells = std::clamp(1.2e7 / operations, 1e3, 1.5e5);
  const Eigen::MatrixXd Q = regulator.Q + regulator.K.transpose() * regulator.R * regulator.K;
  FLYBALL_TRY(region.certified,
              certify_region(region.loop, {.Q = Q,
                                           .reach = job.swing_up.reach,
                                           .closeness = 0.95,
                                           .most_cells = static_cast<int>(cells)}));
  if (job.model.states() < 2) {
    return region;
  }
  choose_plane(job, regulator, region);
  VectorXd half(job.model.states());
  for (Index i = 0; i < half.size(); ++i) {
    constexpr double margin = 2.5;
    half(i) = margin * region.certified.extent(i);
  }
  for (const Index i : region.loop.angles) {
    half(i) = std::min(half(i), std::numbers::pi);
  }
  constexpr double duration = 4.0;
  constexpr double step = 5e-3;
  constexpr int count = 625;
  FLYBALL_TRY(region.sampled, sample_region(region.loop, region.certified, half,
                                            {.duration = duration,
                                             .step = step,
                                             .count = count,
                                             .plane = {region.first, region.second}}));
  return region;
}

void doubt_energy(const ModelJob& job, const ModelRegulator& regulator,
                  std::vector<Diagnostic>& doubts) {
  const expression::Derivatives all = expression::differentiate(job.equations.tape);
  const auto n = static_cast<std::size_t>(job.model.states());
  std::vector<double> values(all.workspace_size());
  all.tape.prepare<double>(job.equations.parameters, values);
  std::vector<double> y(all.rows);
  Eigen::MatrixXd J(static_cast<Index>(all.rows), static_cast<Index>(all.columns));
  std::vector<double> in(n + 1);
  const auto row = static_cast<Index>(n);
  // dE/dt of all that moves it, and the sum of its parts' sizes: cancelling is what keeps energy.
  const auto rate_of = [&](const VectorXd& x, double u) {
    std::copy(x.begin(), x.end(), in.begin());
    in[n] = u;
    all.evaluate(in, y, J, values);
    double rate = 0.0;
    double size = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double part = J(row, static_cast<Index>(i)) * y[i];
      rate += part;
      size += std::abs(part);
    }
    return std::pair(rate, size);
  };
  constexpr int samples = 64;
  constexpr double rounding = 1e-6;
  constexpr double wide = 2.0;  // in SI, of what is no angle
  Random random(7);
  const VectorXd& point = regulator.point.x;
  const double rests = regulator.point.u(0);
  const std::vector<Index> angles = angles_of(job);
  double worst_rest = 0.0;
  double worst_held = 0.0;
  bool pushed = false;
  bool holds = false;
  VectorXd worst = point;
  double worst_rate = 0.0;
  for (int k = 0; k < samples; ++k) {
    VectorXd x = point;
    for (Index i = 0; i < x.size(); ++i) {
      const bool turns = std::find(angles.begin(), angles.end(), i) != angles.end();
      x(i) += (turns ? std::numbers::pi : wide) * random.uniform(-1.0, 1.0);
    }
    const auto [rate, size] = rate_of(x, rests);
    double power = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      power += J(row, static_cast<Index>(i)) * J(static_cast<Index>(i), row);
    }
    pushed = pushed || std::abs(power) > 0.0;
    if (!std::isfinite(rate) || !(size > 0.0)) {
      continue;
    }
    if (rate / size > worst_rest) {
      worst_rest = rate / size;
      worst = x;
      worst_rate = rate;
    }
    for (std::size_t i = 0; i < n; ++i) {  // the input that keeps a held state's rate zero
      const auto at = static_cast<Index>(i);
      if (job.swing_up.hold(at) != 0.0 && J(at, row) != 0.0) {
        const auto [held, held_size] = rate_of(x, rests - y[i] / J(at, row));
        holds = true;
        worst_held = std::max(worst_held, held_size > 0.0 ? held / held_size : 0.0);
        break;
      }
    }
  }
  if (!pushed) {
    warn(doubts, "energy_not_pushed",
         "the input does not change swing_up.energy anywhere: it swings nothing");
  } else if (worst_rest > rounding && !(holds && worst_held <= rounding)) {
    std::string place;
    const auto& states = job.model.names().states;
    for (std::size_t i = 0; i < n; ++i) {
      place += fmt::format("{}{} = {}", i == 0 ? "" : ", ", states[i].name,
                           format_number(worst(static_cast<Index>(i)), 3));
    }
    warn(doubts, "energy_not_kept",
         "swing_up.energy is no energy of this model: with the input at rest it grows, at {} by {} "
         "a second; look at its formula against the model's (½ J ω² and a potential)",
         place, format_number(worst_rate, 3));
  }
}

Expected<SwingUpRunResult> swing_up(const ModelJob& job, const ModelRegulator& regulator,
                                    const ModelRegion& region) {
  SwingUpRunResult result{.law = law_of(job), .parameters = job.equations.parameters};
  Swinging law(job, regulator, region, result);
  const VectorXd& point = regulator.point.x;
  result.energy = law.energy(point)[0];
  // Its range over the angles, the rest at the point: what there is to swing through.
  double lowest = result.energy;
  double highest = result.energy;
  result.start = point;
  constexpr int parts = 36;
  std::vector<int> turn(region.loop.angles.size());
  for (bool more = !turn.empty(); more;) {
    VectorXd x = point;
    for (std::size_t k = 0; k < turn.size(); ++k) {
      x(region.loop.angles[k]) += 2.0 * std::numbers::pi * turn[k] / parts;
    }
    const double E = law.energy(x)[0];
    if (E < lowest) {
      lowest = E;
      result.start = x;
    }
    highest = std::max(highest, E);
    more = false;
    for (std::size_t k = 0; k < turn.size() && !more; ++k) {
      more = ++turn[k] < parts;
      turn[k] = more ? turn[k] : 0;
    }
  }
  result.scale = 0.5 * (highest - lowest);
  if (!std::isfinite(result.energy) || !(result.scale > 0.0) || !std::isfinite(result.scale)) {
    return refusal(ArgumentError::out_of_range, in_swing_up, "swing_up.energy")
        .got(turn.empty() ? "for a model without angles"
                          : fmt::format("{} to {} over all angles", format_number(lowest),
                                        format_number(highest)))
        .expected("an energy that the angles change, such as \"J*omega^2/2 - m*g*l*cos(theta)\"")
        .hint("angles are states in rad, or those that model.angles names");
  }
  ModelRun run = job.run;
  if (run.initial.array().isNaN().all()) {
    run.initial = result.start;
  } else {
    result.start = run.initial.array().isNaN().select(point, run.initial);
  }
  if (!run.duration_is_given) {
    constexpr double long_enough = 20.0;
    run.duration = std::max(long_enough, 10.0 * job.period);
  }
  run.closed_loop = true;
  FLYBALL_TRY(result.simulation, simulate_with(job, regulator, run, law));
  result.taken = law.balances ? law.taken : std::nullopt;
  result.stands = law.stands;
  return result;
}

}  // namespace flyball::study
