#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/describing_function.hpp>
#include <flyball/classical/discretization_error.hpp>
#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/mimo_margins.hpp>
#include <flyball/classical/nyquist.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/control/margins.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/norms.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "solve/transfer_problem.hpp"

// What systems do to sinusoids, and how far loops are from instability (sections E.3 to E.7).
namespace flyball::solve {

namespace {

using classical::DelaySystem;
using classical::FrequencyResponse;
using classical::LoopMargins;
using classical::TransferError;
using classical::TransferFunction;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A system told as a transfer function or as matrices, continuous or with the period dt.
struct Told {
  std::optional<TransferFunction> transfer;
  std::optional<DelaySystem> late;  ///< Of several dead times, also of several channels.
  ContinuousSystem<> system;
  std::optional<Time> period;
  Time delay{0.0};

  [[nodiscard]] DiscreteSystem<> sampled() const {
    return {system.A, system.B, system.C, system.D, *period};
  }
  [[nodiscard]] bool is_single() const {
    return transfer || (late && late->inputs() == 1 && late->outputs() == 1) ||
           (!late && system.B.cols() == 1 && system.C.rows() == 1);
  }
  [[nodiscard]] Expected<FrequencyResponse> response() const {
    return transfer ? classical::frequency_response(*transfer)
           : late   ? classical::frequency_response(*late)
           : period ? classical::frequency_response(sampled(), delay)
                    : classical::frequency_response(system, delay);
  }
};

Expected<Told> told(const Problem& problem, std::string_view where) {
  Told it;
  const double dt = problem.number("dt");
  FLYBALL_CHECK(Checks(where).not_negative(dt, "dt", "s"));
  it.period = dt > 0.0 ? std::optional(Time(dt)) : std::nullopt;
  it.delay = Time(problem.number("delay"));
  const bool transfer = problem.has("num") || problem.has("den") || problem.has("expr");
  const bool matrices = problem.has("A") || problem.has("B") || problem.has("C");
  if (transfer == matrices) {
    return refusal(ArgumentError::malformed, where, "the system")
        .got(transfer ? "told twice, as a transfer function and as matrices" : "left out")
        .expected("num and den, expr, or A, B and C");
  }
  if (transfer) {
    FLYBALL_TRY(auto system, transfer_system_of(problem, where));
    if (auto* late = std::get_if<DelaySystem>(&system)) {
      it.late = std::move(*late);
    } else {
      it.transfer = std::get<TransferFunction>(std::move(system));
    }
    return it;
  }
  for (const char* name : {"A", "B", "C"}) {
    if (!problem.has(name)) {
      return refusal(ArgumentError::malformed, where, name)
          .got("left out")
          .expected("there: a state space has A, B and C");
    }
  }
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& C = problem.matrix("C");
  it.system = {problem.matrix("A"), B, C,
               problem.has("D") ? problem.matrix("D") : MatrixXd::Zero(C.rows(), B.cols())};
  return it;
}

/// The loops of several channels have no single curve.
Expected<FrequencyResponse> single_response(const Told& it, std::string_view where) {
  if (!it.is_single()) {
    return refusal(ArgumentError::wrong_shape, where, "the system")
        .got("of several inputs or outputs")
        .expected("of one input and one output");
  }
  return it.response();
}

Outcome solve_response(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "freqresp";
  FLYBALL_TRY(const Told it, told(problem, where));
  FLYBALL_TRY(const auto response, it.response());
  const VectorXd w = problem.matrix("w");
  const Index entries = response.outputs() * response.inputs();
  FLYBALL_CHECK(check_size(3.0 * static_cast<double>(w.size() * entries), where, "w"));
  FLYBALL_TRY(const MatrixXcd values, response.sample(w));
  for (Index k = 0; k < w.size(); ++k) {
    if (!values.col(k).allFinite()) {
      return refusal(TransferError::at_a_pole, where,
                     flyball::detail::format("w({}), {} rad/s,", k, format_number(w(k))))
          .got("a pole of the system")
          .expected("a frequency at which the response is finite")
          .hint("leave it out, or take one beside it");
    }
  }
  if (it.is_single()) {
    answer.add("real", VectorXd(values.row(0).real().transpose()));
    answer.add("imag", VectorXd(values.row(0).imag().transpose()));
    answer.add("gain_db",
               VectorXd(20.0 * values.row(0).cwiseAbs().array().log10().matrix().transpose()));
    return {};
  }
  std::vector<MatrixXd> real;
  std::vector<MatrixXd> imaginary;
  MatrixXd sigma(w.size(), std::min(response.outputs(), response.inputs()));
  for (Index k = 0; k < w.size(); ++k) {
    const MatrixXcd G = values.col(k).reshaped(response.outputs(), response.inputs());
    real.emplace_back(G.real());
    imaginary.emplace_back(G.imag());
    sigma.row(k) = flyball::detail::singular_values_of_complex(G).transpose();
  }
  answer.add("G_real", real);
  answer.add("G_imag", imaginary);
  answer.add("singular_values", sigma);
  return {};
}

Outcome solve_bode(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "bode";
  FLYBALL_TRY(const Told it, told(problem, where));
  FLYBALL_TRY(const auto response, single_response(it, where));
  FLYBALL_TRY(const auto data, problem.has("w") ? classical::bode(response, problem.matrix("w"))
                                                : classical::bode(response));
  answer.add("w", data.frequency);
  answer.add("gain", data.curves[0].gain);
  answer.add("phase", data.curves[0].phase);
  return {};
}

Outcome solve_nyquist(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "nyquist";
  FLYBALL_TRY(const Told it, told(problem, where));
  FLYBALL_TRY(const auto response, single_response(it, where));
  FLYBALL_TRY(const auto curve,
              it.late ? classical::nyquist(*it.late) : classical::nyquist(response));
  answer.add("w", curve.frequency);
  answer.add("real", VectorXd(curve.value.real()));
  answer.add("imag", VectorXd(curve.value.imag()));
  const auto count = [](const std::optional<int>& number) {
    return number ? static_cast<double>(*number) : nan;
  };
  answer.add("encirclements", count(curve.encirclements));
  answer.add("open_loop_unstable", static_cast<double>(curve.open_loop_unstable));
  answer.add("closed_loop_unstable", count(curve.closed_loop_unstable));
  answer.add("distance", curve.distance);
  return {};
}

Outcome solve_sampled_margins(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& K = problem.matrix("K");
  const Time period(problem.number("T"));
  const Time delay(problem.number("delay"));
  constexpr double most_periods = 500.0;  // each adds a state to the loop
  if (period.si() > 0.0) {
    FLYBALL_CHECK(
        check_within(delay.si(), 0.0, most_periods * period.si(), "margins", "delay", "s"));
  }
  const bool observer = problem.has("K_e");
  if (observer != problem.has("C")) {
    return refusal(ArgumentError::malformed, "margins", observer ? "C" : "K_e")
        .got("left out")
        .expected("there: an observer has both C and K_e");
  }
  FLYBALL_TRY(const auto loop,
              observer
                  ? discretize(ContinuousSystem<>{A, B, problem.matrix("C"),
                                                  MatrixXd::Zero(problem.matrix("C").rows(), 1)},
                               period)
                        .and_then([&](const DiscreteSystem<>& model) {
                          return observer_regulator_loop(A, B, model.C, model, K,
                                                         problem.matrix("K_e"), delay);
                        })
                  : state_feedback_loop(A, B, K, period, delay));
  FLYBALL_TRY(const auto margins, stability_margins(loop));
  answer.add("stable", margins.stable);
  answer.add("spectral_radius", margins.spectral_radius);
  answer.add("gain_margin_up", margins.gain_margin_up);
  answer.add("gain_margin_down", margins.gain_margin_down);
  answer.add("phase_margin", margins.phase_margin);
  answer.add("delay_margin", margins.delay_margin);
  answer.add("disk_margin", margins.disk_margin);
  answer.add("disk_gain_up", margins.disk_gain_up);
  answer.add("disk_gain_down", margins.disk_gain_down);
  answer.add("disk_phase", margins.disk_phase);
  answer.add("disk_frequency", margins.disk_frequency);
  const auto frequencies = [](const std::vector<Crossover>& crossovers) {
    Eigen::VectorXd list(static_cast<Eigen::Index>(crossovers.size()));
    for (Eigen::Index k = 0; k < list.size(); ++k) {
      list(k) = crossovers[static_cast<std::size_t>(k)].frequency;
    }
    return list;
  };
  answer.add("gain_crossovers", frequencies(margins.gain_crossovers));
  answer.add("phase_crossovers", frequencies(margins.phase_crossovers));
  return {};
}

/// What all loops have.
void write_loop_margins(const LoopMargins& margins, JsonWriter& answer) {
  answer.add("unstable_poles", count_of_poles(margins.unstable_poles));
  answer.list("gain_margins", margins.phase_crossings, [&](const classical::PhaseCrossing& at) {
    answer.object([&] { answer.add({{"w", at.frequency}, {"gm", at.gain_margin}}); });
  });
  answer.list("phase_margins", margins.gain_crossings, [&](const classical::GainCrossing& at) {
    answer.object([&] { answer.add({{"w", at.frequency}, {"pm_deg", at.phase_margin}}); });
  });
  answer.add("gain_margin", margins.gain_margin.value_or(nan));
  answer.add("phase_margin", margins.phase_margin.value_or(nan));
  answer.add("delay_margin", margins.delay_margin);
}

void write_peak(std::string_view name, const classical::Peak& peak, JsonWriter& answer) {
  answer.object(name, [&] { answer.add({{"Ms", peak.value}, {"w", peak.frequency}}); });
}

/// Of a loop of several channels, each behind the delay.
Expected<classical::MimoMargins> channel_margins(const Told& loop) {
  if (loop.delay.si() == 0.0) {
    return loop.period ? classical::mimo_margins(loop.sampled())
                       : classical::mimo_margins(loop.system);
  }
  FLYBALL_TRY(const auto prompt,
              loop.period ? DelaySystem::create(loop.sampled()) : DelaySystem::create(loop.system));
  FLYBALL_TRY(const auto late,
              prompt.with_input_delays(VectorXd::Constant(prompt.inputs(), loop.delay.si())));
  return classical::mimo_margins(late);
}

Outcome solve_margins(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "margins";
  if (problem.has("K")) {
    for (const char* name : {"A", "B", "T"}) {
      if (!problem.has(name)) {
        return refusal(ArgumentError::malformed, where, name)
            .got("left out")
            .expected("there: a loop of sampled feedback has A, B, K and T");
      }
    }
    if (problem.matrix("B").cols() != 1) {
      return refusal(ArgumentError::wrong_shape, where, "B")
          .got("of several columns")
          .expected("of one: a loop of sampled feedback is opened at its one input");
    }
    return solve_sampled_margins(problem, answer);
  }
  FLYBALL_TRY(const Told loop, told(problem, where));
  if (loop.is_single()) {
    // Polynomials in 31 digits where there are some that are not too long.
    constexpr Index most_states = 60;
    const bool short_one =
        loop.transfer && static_cast<double>(loop.transfer->order()) +
                                 (loop.period ? loop.transfer->delay() / loop.period->si() : 0.0) <=
                             static_cast<double>(most_states);
    FLYBALL_TRY(const LoopMargins margins,
                short_one   ? classical::loop_margins(*loop.transfer)
                : loop.late ? classical::loop_margins(*loop.late)
                            : loop.response().and_then([](const FrequencyResponse& response) {
                                return classical::loop_margins(response);
                              }));
    answer.add("stable", margins.stable);
    answer.add("disk_margin", margins.disk_margin);
    write_loop_margins(margins, answer);
    write_peak("sensitivity_peak", margins.sensitivity, answer);
    return {};
  }
  FLYBALL_TRY(const auto margins, channel_margins(loop));
  answer.add("stable", margins.stable);
  answer.add("disk_margin", margins.disk_margin);
  answer.add("disk_frequency", margins.disk_frequency);
  answer.add("full_disk_margin", margins.full_disk_margin);
  write_peak("sensitivity_peak", margins.sensitivity, answer);
  write_peak("complementary_peak", margins.complementary, answer);
  answer.list("channels", margins.loop_at_a_time, [&](const LoopMargins& alone) {
    answer.object([&] {
      answer.add({{"gain_margin", alone.gain_margin.value_or(nan)},
                  {"phase_margin", alone.phase_margin.value_or(nan)},
                  {"delay_margin", alone.delay_margin},
                  {"disk_margin", alone.disk_margin}});
    });
  });
  return {};
}

Outcome solve_l_infinity_norm(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const HInfinityNorm peak, l_infinity_norm(plant));
    answer.add("norm", peak.norm);
    answer.add("frequency", peak.frequency);
    answer.add("upper_bound", peak.upper_bound);
    return {};
  });
}

Expected<classical::Nonlinearity> nonlinearity_of(const Problem& problem) {
  classical::Nonlinearity element;
  FLYBALL_TRY(element.kind, classical::parse_nonlinearity(problem.choice("nonlinearity")));
  element.width = problem.number("width");
  element.slope = problem.number("slope");
  element.height = problem.number("height");
  return element;
}

Outcome solve_describing_function(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto element, nonlinearity_of(problem));
  const MatrixXd& amplitudes = problem.matrix("amplitude");
  VectorXd real(amplitudes.size());
  VectorXd imaginary(amplitudes.size());
  for (Index k = 0; k < amplitudes.size(); ++k) {
    FLYBALL_TRY(const auto gain, classical::describing_function(element, amplitudes(k)));
    real(k) = gain ? gain->real() : nan;
    imaginary(k) = gain ? gain->imag() : nan;
  }
  answer.add("real", real);
  answer.add("imag", imaginary);
  return {};
}

Outcome solve_limit_cycles(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "limit-cycles";
  FLYBALL_TRY(const auto element, nonlinearity_of(problem));
  FLYBALL_TRY(const Told it, told(problem, where));
  FLYBALL_TRY(const auto response, single_response(it, where));
  FLYBALL_TRY(const auto cycles, classical::limit_cycles(response, element));
  answer.list("cycles", cycles, [&](const classical::LimitCycle& cycle) {
    answer.object([&] {
      answer.add({{"amplitude", cycle.amplitude},
                  {"w", cycle.frequency},
                  {"stable", cycle.stable ? 1.0 : 0.0}});
    });
  });
  return {};
}

Outcome solve_discretizations(const Problem& problem, JsonWriter& answer) {
  const ContinuousSystem<> plant = problem.system();
  const Time period(problem.number("T"));
  FLYBALL_TRY(const auto all, problem.has("w") ? classical::compare_discretizations(
                                                     plant, period, problem.matrix("w"))
                                               : classical::compare_discretizations(plant, period));
  // In the order of the row; NaN where a method has no image of the plant.
  using enum ConversionMethod;
  constexpr std::array order{zoh, foh, tustin, forward_euler, backward_euler, matched};
  const auto methods = static_cast<Index>(order.size());
  std::array<double, order.size()> largest{};
  std::array<double, order.size()> stable{};
  MatrixXd gain = MatrixXd::Constant(all.frequency.size(), methods, nan);
  MatrixXd phase = gain;
  largest.fill(nan);
  stable.fill(nan);
  for (const auto& made : all.methods) {
    const auto at = static_cast<std::size_t>(std::find(order.begin(), order.end(), made.method) -
                                             order.begin());
    largest[at] = made.largest_error;
    stable[at] = made.stable ? 1.0 : 0.0;
    gain.col(static_cast<Index>(at)) = made.gain_error;
    phase.col(static_cast<Index>(at)) = made.phase_error;
  }
  const auto write = [&](std::string_view name, const auto& values) {
    answer.object(name, [&] {
      for (std::size_t k = 0; k < order.size(); ++k) {
        answer.add(to_string(order[k]), values[k]);
      }
    });
  };
  write("largest_error", largest);
  write("stable", stable);
  answer.add("w", all.frequency);
  answer.add("gain_error", gain);
  answer.add("phase_error", phase);
  return {};
}

}  // namespace

std::vector<Kind> frequency_response_kinds() {
  using namespace field;
  const Field some_B = optional(matrix("B", "n", "m", "how the inputs move the states"));
  const std::vector<Field> told_system =
      transfer_fields() +
      std::vector{
          optional(matrix("A", "n", "n", "in place of num and den: how the states move")), some_B,
          optional(matrix("C", "p", "n", "how the outputs see the states")),
          optional(matrix("D", "p", "m", "how the inputs reach the outputs, zero if left out"))};
  const std::vector<Field> element{
      choice("nonlinearity", "saturation dead-zone relay hysteresis backlash",
             "what stands before the loop's linear part"),
      or_number(number("width", "", "half of what saturates late, is dead, switches late, or gaps"),
                1.0),
      or_number(number("slope", "", "of saturation, dead zone and backlash"), 1.0),
      or_number(number("height", "", "of relay and hysteresis"), 1.0)};
  const std::vector<Field> norm{
      number("norm", "", "the largest singular value of G(jω), or of G(e^{jωT})"),
      unbounded(number("frequency", "rad/s", "where it is")),
      number("upper_bound", "", "no gain exceeds it")};
  return {
      {"freqresp",
       "a transfer function or a state space on the imaginary axis, or the unit circle",
       told_system + std::vector{list("w", "w", "rad/s", "frequencies")},
       {optional(unbounded(list("real", "w", "", "Re G, of one input and one output"))),
        optional(unbounded(list("imag", "w", "", "Im G"))),
        optional(unbounded(list("gain_db", "w", "dB", "20 log |G|"))),
        optional(matrices("G_real", "p", "m", "Re G at each frequency, of a matrix")),
        optional(matrices("G_imag", "p", "m", "Im G")),
        optional(unbounded(matrix("singular_values", "w", "l", "of G, decreasing")))},
       R"({"num": [1], "den": [1, 1], "w": [0.1, 1, 10]})",
       &solve_response},
      {"bode",
       "gain and phase, the phase from the system's own asymptote on",
       told_system +
           std::vector{optional(
               list("w", "w", "rad/s", "increasing; a grid that follows the curve if left out"))},
       {list("w", "l", "rad/s", "frequencies"), unbounded(list("gain", "l", "", "|G|")),
        unbounded(list("phase", "l", "deg", "continuous"))},
       R"({"num": [1], "den": [1, 1, 0], "w": [0.1, 1, 10]})",
       &solve_bode},
      {"nyquist",
       "the Nyquist curve of a loop under negative feedback, and how often it encircles -1",
       told_system,
       {list("w", "l", "rad/s", "not decreasing: poles on the axis are passed on half circles"),
        unbounded(list("real", "l", "", "Re L")), unbounded(list("imag", "l", "", "Im L")),
        unbounded(number("encirclements", "", "clockwise; null where it passes through -1")),
        number("open_loop_unstable", "", "poles of L on the right"),
        unbounded(number("closed_loop_unstable", "", "poles of 1/(1 + L) there")),
        number("distance", "", "of the curve from -1")},
       R"({"num": [10], "den": [1, 3, 3, 1]})",
       &solve_nyquist},
      {"margins",
       "how far a loop is from instability: of L under negative feedback, of one channel or of "
       "several, or of a continuous plant's input under sampled feedback u = K(r - x)",
       told_system +
           std::vector{
               optional(matrix("K", "1", "n", "gain of sampled feedback", "input/state")),
               optional(number("T", "s", "sample period of that controller")),
               optional(matrix("K_e", "n", "p", "the gain of its observer of C, filter form"))},
       {flag("stable", "whether the loop is; if not there is no margin"),
        optional(number("spectral_radius", "", "sampled: the largest magnitude of its poles")),
        optional(unbounded(number("gain_margin_up", "", "stable for every gain up to this one"))),
        optional(unbounded(number("gain_margin_down", "", "and down to this one"))),
        optional(unbounded(number("gain_margin", "", "of L: the one nearest to 1, 1/|L|"))),
        optional(unbounded(
            number("phase_margin", "deg", "the smallest rotation that destabilizes; of L signed"))),
        optional(
            unbounded(number("delay_margin", "s", "the shortest further delay that destabilizes"))),
        unbounded(
            number("disk_margin", "", "2/‖S - T‖∞, of several channels each with its own factor")),
        optional(unbounded(number("disk_gain_up", "", "the disk's largest real factor"))),
        optional(unbounded(number("disk_gain_down", "", "its smallest"))),
        optional(unbounded(number("disk_phase", "deg", "its rotation"))),
        optional(unbounded(number("disk_frequency", "rad/s", "where ‖S - T‖ is largest"))),
        optional(number("full_disk_margin", "", "2/‖S - T‖∞, for factors that mix the channels")),
        optional(list("gain_crossovers", "g", "rad/s", "sampled: where the loop gain is 1")),
        optional(list("phase_crossovers", "f", "rad/s", "where it is real and negative")),
        optional(unbounded(number("unstable_poles", "", "of 1/(1 + L)"))),
        optional(records("gain_margins", "w gm", "where L is negative: rad/s and 1/|L|")),
        optional(records("phase_margins", "w pm_deg", "where |L| = 1: rad/s, 180 + arg L")),
        optional(record("sensitivity_peak", "Ms w", "the largest ‖(I + L)⁻¹‖ and where, rad/s")),
        optional(record("complementary_peak", "Ms w", "the largest ‖L(I + L)⁻¹‖ and where")),
        optional(records("channels", "gain_margin phase_margin delay_margin disk_margin",
                         "each opened with the others closed"))},
       R"({"num": [10], "den": [1, 3, 2, 0]})",
       &solve_margins},
      {"linf-norm",
       "the largest gain over all frequencies of a system that need not be stable",
       {A, B, or_first(domain), C, D, any_period},
       norm,
       R"({"A": [[1]], "B": [[2]], "C": [[1]], "domain": "continuous"})",
       &solve_l_infinity_norm},
      {"describing-function",
       "the first harmonic of what a nonlinearity makes of a sine, as a gain",
       element + std::vector{list("amplitude", "l", "", "of the sine")},
       {unbounded(list("real", "l", "", "Re N(a)")),
        unbounded(list("imag", "l", "", "Im N(a); null where the sine does not move it"))},
       R"({"nonlinearity": "saturation", "amplitude": [0.5, 2, 10]})",
       &solve_describing_function},
      {"limit-cycles",
       "the oscillations L(jω) N(a) = -1 of a loop with one nonlinearity",
       element + told_system,
       {records("cycles", "amplitude w stable",
                "at the nonlinearity's input, rad/s, and 1 for one that returns")},
       R"({"nonlinearity": "relay", "num": [1], "den": [1, 2, 1, 0]})",
       &solve_limit_cycles},
      {"discretizations",
       "what each method of discretization does to gain and phase (E.5)",
       {A, B, C, D, number("T", "s", "sample period"),
        optional(list("w", "w", "rad/s", "increasing, up to π/T"))},
       {record("largest_error", "zoh foh tustin forward-euler backward-euler matched",
               "|G_d/G - 1| at most; null where a method has no image of the plant"),
        record("stable", "zoh foh tustin forward-euler backward-euler matched", "1 where G_d is"),
        list("w", "l", "rad/s", "frequencies"),
        unbounded(matrix("gain_error", "l", "6", "20 log |G_d/G|, a column a method, in that order",
                         "dB")),
        unbounded(matrix("phase_error", "l", "6", "arg G_d/G", "deg"))},
       R"({"A": [[-10]], "B": [[10]], "C": [[1]], "T": 0.01, "w": [1, 10, 50]})",
       &solve_discretizations},
  };
}

}  // namespace flyball::solve
