#include <flyball/classical/compensators.hpp>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/control/pid_design.hpp>
#include <flyball/control/robust/loop_shaping.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/model_reduction.hpp>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// Controllers from transfer functions and by robust synthesis, and smaller models.
namespace flyball::solve {

namespace {

using classical::TransferFunction;
using Eigen::VectorXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

void write_margins(const classical::LoopMargins& margins, JsonWriter& answer) {
  answer.add("stable", margins.stable);
  answer.add("gain_margin", or_nan(margins.gain_margin));
  answer.add("phase_margin", or_nan(margins.phase_margin));
  answer.add("delay_margin", margins.delay_margin);
  answer.add("disk_margin", margins.disk_margin);
  answer.add("Ms", margins.sensitivity.value);
}

// PID.

Outcome solve_pidtune(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto plant, transfer_of(problem, "pidtune"));
  const std::string_view name = problem.choice("form");
  const PidForm form = name == "p"    ? PidForm::p
                       : name == "pi" ? PidForm::pi
                       : name == "pd" ? PidForm::pd
                                      : PidForm::pid;
  const double ratio = problem.number("filter_ratio");
  const std::string_view method = problem.choice("method");
  const bool shaped = problem.has("crossover");
  const bool by_poles = problem.has("natural_frequency");
  if (by_poles != (method == "poles")) {
    return refusal(ArgumentError::malformed, "pidtune", "natural_frequency")
        .got(by_poles ? "given" : "left out")
        .expected(by_poles ? "left out unless the method is poles"
                           : "given with the method poles, rad/s");
  }
  if (shaped && method != "robust" && method != "loop-shape") {
    return refusal(ArgumentError::malformed, "pidtune", "crossover")
        .got("given")
        .expected("left out with the methods simc and poles");
  }
  if (method == "loop-shape" && !shaped) {
    return refusal(ArgumentError::malformed, "pidtune", "crossover")
        .got("left out")
        .expected("given with the method loop-shape, rad/s");
  }
  const RobustnessGoal robust{.sensitivity = problem.number("Ms"),
                              .complementary = problem.has("Mt")
                                                   ? problem.number("Mt")
                                                   : std::numeric_limits<double>::infinity(),
                              .filter_ratio = ratio};
  FLYBALL_TRY(const auto loop,
              shaped             ? tune_by_loop_shape(plant, form,
                                                      {.crossover = problem.number("crossover"),
                                                       .phase_margin = problem.number("phase_margin"),
                                                       .filter_ratio = ratio})
              : by_poles         ? tune_by_poles(plant, form,
                                                 {.natural_frequency = problem.number("natural_frequency"),
                                                  .damping_ratio = problem.number("damping_ratio"),
                                                  .third_pole = problem.number("third_pole"),
                                                  .filter_ratio = ratio})
              : method == "simc" ? tune_simc(plant, form, problem.number("closed_loop_time"), ratio)
                                 : tune_by_robustness(plant, form, robust));
  answer.add("kp", loop.gains.kp);
  answer.add("ki", loop.gains.ki);
  answer.add("kd", loop.gains.kd);
  answer.add("derivative_time_constant", loop.derivative_time_constant);
  answer.add("num", loop.controller.num());
  answer.add("den", loop.controller.den());
  write_margins(loop.margins, answer);
  answer.add("Mt", loop.margins.complementary.value);
  answer.add("crossover", loop.margins.gain_crossings.empty()
                              ? std::numeric_limits<double>::quiet_NaN()
                              : loop.margins.gain_crossings.back().frequency);
  write_step_metrics("step", loop.reference, answer);
  const LoadResponse load = loop.load.value_or(LoadResponse{});
  answer.object("load", [&] {
    answer.add({{"peak", load.peak},
                {"peak_time", load.peak_time},
                {"recovery_time", or_nan(load.recovery_time)},
                {"integral", load.integral},
                {"absolute_integral", load.absolute_integral},
                {"final_value", load.final_value}});
  });
  return {};
}

// Lead and lag.

Outcome solve_compensator(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "compensator";
  FLYBALL_TRY(const auto plant, transfer_of(problem, where));
  std::optional<double> gain = optional_number(problem, "gain");
  if (problem.has("error_constant")) {
    if (gain) {
      return refusal(ArgumentError::malformed, where, "gain")
          .got("given beside error_constant")
          .expected("one of the two");
    }
    FLYBALL_TRY(gain, classical::gain_for_error_constant(plant, problem.number("error_constant")));
  }
  const std::string_view type = problem.choice("type");
  const int stages = problem.integer("stages");
  const bool by_poles = problem.has("natural_frequency");
  if (by_poles == problem.has("crossover") || (by_poles && type != "lead")) {
    return refusal(ArgumentError::malformed, where, "crossover")
        .got(by_poles ? "replaced by natural_frequency" : "left out")
        .expected("given; a lead may have natural_frequency and damping_ratio in its place");
  }
  const classical::CrossoverGoal goal{.crossover = by_poles ? 0.0 : problem.number("crossover"),
                                      .phase_margin = problem.number("phase_margin"),
                                      .gain = gain,
                                      .stages = stages};
  const classical::PoleGoal poles{
      .natural_frequency = by_poles ? problem.number("natural_frequency") : 0.0,
      .damping_ratio = problem.number("damping_ratio"),
      .gain = gain,
      .stages = stages};
  FLYBALL_TRY(const auto found, by_poles             ? classical::lead_compensator(plant, poles)
                                : type == "lag"      ? classical::lag_compensator(plant, goal)
                                : type == "lead-lag" ? classical::lead_lag_compensator(plant, goal)
                                                     : classical::lead_compensator(plant, goal));
  FLYBALL_TRY(const auto zeros, found.compensator.zeros());
  FLYBALL_TRY(const auto own_poles, found.compensator.poles());
  answer.add("num", found.compensator.num());
  answer.add("den", found.compensator.den());
  answer.add("zeros", zeros);
  answer.add("poles", own_poles);
  answer.add("dcgain", found.compensator.dc_gain());
  write_margins(found.margins, answer);
  answer.add("closed_loop_poles", found.poles);
  return {};
}

Outcome solve_notch(const Problem& problem, JsonWriter& answer) {
  const double dt = problem.number("dt");
  FLYBALL_CHECK(Checks("notch").not_negative(dt, "dt", "s"));
  FLYBALL_TRY(const auto notch,
              classical::notch_compensator(problem.number("frequency"), problem.number("depth"),
                                           problem.number("width"),
                                           dt > 0.0 ? std::optional(Time(dt)) : std::nullopt));
  answer.add("num", notch.num());
  answer.add("den", notch.den());
  return {};
}

// Robust synthesis.

template <class System>
void write_design(const RobustDesign<System>& design, JsonWriter& answer) {
  write_system(design.controller, answer);
  answer.add("gamma", design.gamma);
  answer.add("frequency", design.frequency);
  answer.add("least_low", design.least_low);
  answer.add("least_high", design.least_high);
  answer.add("poles", design.poles);
}

HInfinityOptions options_of(const Problem& problem) {
  return {.gamma = problem.number("gamma"), .tolerance = problem.number("tolerance")};
}

Outcome solve_hinfsyn(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& system) -> Outcome {
    const GeneralizedPlant<std::decay_t<decltype(system)>> plant{
        system, problem.integer("measurements"), problem.integer("controls")};
    FLYBALL_TRY(const auto design, h_infinity_synthesis(plant, options_of(problem)));
    write_design(design, answer);
    return {};
  });
}

Outcome solve_h2syn(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto design, h2_synthesis({problem.system(), problem.integer("measurements"),
                                               problem.integer("controls")}));
  write_system(design.controller, answer);
  answer.add("norm", design.gamma);
  answer.add("poles", design.poles);
  return {};
}

/// A weight by its transfer function, once for each channel; nothing where it is left out.
/// @param system  Of whose kind of time it is.
Expected<std::optional<Continuous>> weight_of(const Problem& problem, std::string_view num,
                                              std::string_view den, Eigen::Index channels) {
  if (!problem.has(num)) {
    return std::optional<Continuous>();
  }
  const VectorXd below = problem.has(den) ? VectorXd(problem.matrix(den)) : VectorXd::Ones(1);
  FLYBALL_TRY_IN(num, const auto transfer, TransferFunction::create(problem.matrix(num), below));
  const Continuous one = transfer.to_state_space();
  Continuous all = one;
  for (Eigen::Index k = 1; k < channels; ++k) {
    FLYBALL_TRY(all, append(all, one));
  }
  return std::optional(all);
}

/// The same as a system of the plant's kind.
template <class System>
std::optional<System> like(const std::optional<Continuous>& weight, const System& plant) {
  if (!weight) {
    return std::nullopt;
  }
  if constexpr (std::is_same_v<System, Discrete>) {
    return Discrete{weight->A, weight->B, weight->C, weight->D, plant.period};
  } else {
    return weight;
  }
}

Outcome solve_mixsyn(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    using System = std::decay_t<decltype(plant)>;
    FLYBALL_TRY(const auto W1, weight_of(problem, "W1_num", "W1_den", plant.C.rows()));
    FLYBALL_TRY(const auto W2, weight_of(problem, "W2_num", "W2_den", plant.B.cols()));
    FLYBALL_TRY(const auto W3, weight_of(problem, "W3_num", "W3_den", plant.C.rows()));
    SensitivityWeights<System> weights;
    weights.error = like(W1, plant);
    weights.input = like(W2, plant);
    weights.output = like(W3, plant);
    FLYBALL_TRY(const auto design, mixed_sensitivity(plant, weights, options_of(problem)));
    write_design(design, answer);
    return {};
  });
}

Outcome solve_ncfsyn(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    using System = std::decay_t<decltype(plant)>;
    FLYBALL_TRY(const auto W1, weight_of(problem, "W1_num", "W1_den", plant.B.cols()));
    FLYBALL_TRY(const auto W2, weight_of(problem, "W2_num", "W2_den", plant.C.rows()));
    LoopShape<System> shape;
    shape.before = like(W1, plant);
    shape.behind = like(W2, plant);
    FLYBALL_TRY(auto design, loop_shaping(plant, shape, problem.number("factor")));
    if (problem.choice("feedback") == "positive") {
      design.controller.C *= -1.0;
      design.controller.D *= -1.0;
    }
    write_system(design.controller, answer);
    answer.add("margin", design.margin);
    answer.add("largest_margin", design.largest_margin);
    answer.add("gamma", 1.0 / design.margin);
    answer.add("least_gamma", 1.0 / design.largest_margin);
    answer.add("poles", design.poles);
    return {};
  });
}

// Smaller models.

Outcome solve_reduce(const Problem& problem, JsonWriter& answer) {
  const std::string_view name = problem.choice("method");
  const ReductionMethod method = name == "matched"   ? ReductionMethod::matched
                                 : name == "coprime" ? ReductionMethod::coprime
                                                     : ReductionMethod::truncation;
  return with_system(problem, [&](const auto& system) -> Outcome {
    FLYBALL_TRY(const auto reduced, reduce_model(system, problem.integer("order"), method));
    write_system(reduced.system, answer);
    answer.add("hankel_singular_values", reduced.hankel);
    answer.add("unstable", reduced.unstable);
    answer.add("error_bound", reduced.error_bound);
    answer.add("achieved_error", reduced.error);
    return {};
  });
}

const std::vector<Field>& margin_fields() {
  static const std::vector<Field> fields{
      flag("stable", "whether the closed loop is"),
      unbounded(number("gain_margin", "", "the nearest, a ratio; null without one")),
      unbounded(number("phase_margin", "deg", "the nearest; null without one")),
      unbounded(number("delay_margin", "s", "the further delay that the loop bears")),
      unbounded(number("disk_margin", "", "2/‖S - T‖∞")),
      unbounded(number("Ms", "", "max |S|"))};
  return fields;
}

Field weight_list(std::string_view name, std::string_view length, std::string_view help) {
  return optional(list(name, length, "", help));
}

std::vector<Kind> synthesis_kinds() {
  using namespace field;
  const std::vector<Field> counts{integer("measurements", "y, the last of the outputs"),
                                  integer("controls", "u, the last of the inputs")};
  const std::vector<Field> aim{
      or_number(number("gamma", "", "the level to stay under; 0 for the least there is"), 0.0),
      or_number(number("tolerance", "", "how far above the least it may be, relative"), 1e-3)};
  const std::vector<Field> level{
      number("gamma", "", "‖F_l(P, K)‖∞, computed of the closed loop"),
      unbounded(number("frequency", "rad/s", "where it is reached")),
      number("least_low", "", "no controller is below; 0 with a gamma that was given"),
      number("least_high", "", "some controller is no higher"),
      complex_list("poles", "s", "of the closed loop")};
  const std::vector<Field> plant{A, B, C, D, or_first(domain), any_period};
  return {
      {"hinfsyn", "the controller u = K y that keeps the largest gain from w to z least",
       plant + counts + aim, answered_system("r", "y", "u") + level,
       R"({"A": [[1]], "B": [[1, 0, 1]], "C": [[1], [0], [1]], "D": [[0, 0, 0], [0, 0, 1], [0, 1, 0]], "measurements": 1, "controls": 1})",
       &solve_hinfsyn},
      {"h2syn", "the controller u = K y under which white noise w has least power in z",
       std::vector<Field>{A, B, C, D} + counts,
       answered_system("r", "y", "u") +
           std::vector{number("norm", "", "‖F_l(P, K)‖₂"),
                       complex_list("poles", "s", "of the closed loop")},
       R"({"A": [[1]], "B": [[1, 0, 1]], "C": [[1], [0], [1]], "D": [[0, 0, 0], [0, 0, 1], [0, 1, 0]], "measurements": 1, "controls": 1})",
       &solve_h2syn},
      {"mixsyn",
       "the controller u = K (r - y) that keeps [W1 S; W2 K S; W3 T] least; the weights are "
       "transfer functions, for each channel the same",
       plant +
           std::vector{weight_list("W1_num", "v", "numerator of the error's weight"),
                       weight_list("W1_den", "o", "its denominator, 1 if left out"),
                       weight_list("W2_num", "t", "of the input's weight"),
                       weight_list("W2_den", "x", "its denominator, 1 if left out"),
                       weight_list("W3_num", "F", "of the output's weight"),
                       weight_list("W3_den", "G", "its denominator, 1 if left out")} +
           aim,
       answered_system("r", "p", "m") + level,
       R"({"A": [[-1]], "B": [[1]], "W1_num": [0.5, 1], "W1_den": [1, 0.001], "W2_num": [0.1]})",
       &solve_mixsyn},
      {"ncfsyn",
       "the controller that stabilises the shaped plant W2 G W1 with the largest margin against "
       "errors of its coprime factors (Glover and McFarlane)",
       plant +
           std::vector{weight_list("W1_num", "v", "numerator of what is before the plant"),
                       weight_list("W1_den", "o", "its denominator, 1 if left out"),
                       weight_list("W2_num", "t", "of what is behind it"),
                       weight_list("W2_den", "x", "its denominator, 1 if left out"),
                       or_number(number("factor", "", "of the margin given away, above 1"), 1.1),
                       or_first(choice("feedback", "negative positive",
                                       "of the answer: u = -K y, or u = K y"))},
       answered_system("r", "p", "m") +
           std::vector{number("margin", "", "ε = 1/‖[I; K](I + GK)⁻¹[I, G]‖∞ of the shaped loop"),
                       number("largest_margin", "", "of any controller"),
                       number("gamma", "", "1/ε"), number("least_gamma", "", "of any controller"),
                       complex_list("poles", "s", "of the shaped loop")},
       R"({"A": [[0, 1], [0, -1]], "B": [[0], [1]], "C": [[1, 0]], "W1_num": [2]})", &solve_ncfsyn},
      {"reduce", "a model of fewer states, its unstable part kept",
       plant + std::vector{integer("order", "states of the reduced model"),
                           or_first(choice("method", "truncation matched coprime",
                                           "weak states left out, or at rest so that the gain at "
                                           "rest stays, or of the coprime factors"))},
       answered_system("r", "m", "p") +
           std::vector{list("hankel_singular_values", "l", "", "of what was reduced, decreasing"),
                       integer("unstable", "states of the unstable part, kept"),
                       number("error_bound", "", "2 Σ of those left out"),
                       number("achieved_error", "",
                              "the largest gain of the difference, of coprime that of the factors "
                              "[M; N]; computed")},
       R"({"A": [[-1, 0, 0], [0, -20, 0], [0, 0, 0.5]], "B": [[1], [1], [1]], "C": [[1, 1, 1]], "order": 2})",
       &solve_reduce},
  };
}

}  // namespace

std::vector<Kind> compensator_kinds() {
  const std::vector<Field> transfer{
      list("num", "t", "", "the controller's numerator, the highest power first"),
      list("den", "x", "", "its denominator")};
  std::vector<Kind> all{
      {"pidtune",
       "PID gains of a plant: the most integral gain for a robustness, by crossover and phase "
       "margin, SIMC, or dominant poles",
       transfer_fields() +
           std::vector{
               or_first(choice("form", "pid pi pd p", "which terms the controller has")),
               or_first(choice("method", "robust loop-shape simc poles",
                               "what decides; with a crossover it is loop-shape")),
               optional(number("crossover", "rad/s", "where |L| is to be 1")),
               or_number(number("phase_margin", "deg", "there"), 60.0),
               or_number(number("Ms", "", "of robust, max |S| at most"), 1.4),
               optional(number("Mt", "", "of robust, max |T| at most; any if left out")),
               or_number(number("closed_loop_time", "s",
                                "of simc, the time constant it aims at; 0 takes the delay"),
                         0.0),
               optional(number("natural_frequency", "rad/s", "of poles, ω of the dominant pair")),
               or_number(number("damping_ratio", "", "of poles, ζ of the pair"), 0.7),
               or_number(number("third_pole", "", "of poles with PID, α of a real pole at -αω"),
                         1.0),
               or_number(number("filter_ratio", "", "N of the derivative's filter, T_d/N"), 10.0)},
       std::vector{number("kp", "input/output", "proportional gain"),
                   number("ki", "input/(output s)", "integral gain"),
                   number("kd", "input s/output", "derivative gain"),
                   number("derivative_time_constant", "s", "τ of kd s/(τ s + 1)")} +
           transfer + margin_fields() +
           std::vector{
               unbounded(number("Mt", "", "max |T|")),
               unbounded(number("crossover", "rad/s", "the last at which |L| = 1")),
               step_metrics_field("step", "of the output to the reference, as in tf"),
               record("load", "peak peak_time recovery_time integral absolute_integral final_value",
                      "of the output to a step of load at the plant's input")},
       R"({"num": [1], "den": [1, 3, 3, 1], "delay": 0.2, "form": "pi", "method": "simc"})",
       &solve_pidtune},
      {"compensator", "a lead, lag or lead-lag compensator in front of a plant",
       transfer_fields() +
           std::vector{
               or_first(choice("type", "lead lag lead-lag", "what it is")),
               optional(number("crossover", "rad/s", "where |L| is to be 1")),
               or_number(number("phase_margin", "deg", "there"), 50.0),
               optional(number("natural_frequency", "rad/s",
                               "of dominant poles, in place of a crossover; of a lead")),
               or_number(number("damping_ratio", "", "of these poles"), 0.7),
               optional(number("gain", "", "C(0); open if left out, for a lead")),
               optional(number("error_constant", "", "of the loop at rest, in place of the gain")),
               optional(integer("stages", "equal ones of a lead, 1 to 4"), Absent::number, 1.0)},
       transfer +
           std::vector{complex_list("zeros", "z", "of the compensator"),
                       complex_list("poles", "z", "of the compensator"),
                       number("dcgain", "", "C(0)")} +
           margin_fields() +
           std::vector{
               complex_list("closed_loop_poles", "s", "none of a continuous loop with dead time")},
       R"({"num": [4], "den": [1, 2, 0], "error_constant": 20, "crossover": 9, "phase_margin": 50})",
       &solve_compensator},
      {"notch",
       "a filter that takes out one frequency",
       {number("frequency", "rad/s", "which"),
        or_number(number("depth", "", "the gain there"), 0.0),
        or_number(number("width", "", "share of the frequency between its points of half power"),
                  0.4),
        or_number(number("dt", "s", "sample period of a discrete one; 0 for one of s"), 0.0)},
       transfer,
       R"({"frequency": 30})",
       &solve_notch},
  };
  for (Kind& kind : synthesis_kinds()) {
    all.push_back(std::move(kind));
  }
  return all;
}

}  // namespace flyball::solve
