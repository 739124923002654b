#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/loop_margins.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/classical/transfer_function.hpp>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// Transfer functions of one input and one output (appendix E).
namespace flyball::solve {

namespace {

void write_as_loop(const classical::LoopMargins& margins, const std::optional<double>& width,
                   const classical::StepMetrics& step, JsonWriter& answer) {
  answer.list("gain_margins", margins.phase_crossings, [&](const classical::PhaseCrossing& at) {
    answer.object([&] { answer.add({{"w", at.frequency}, {"gm", at.gain_margin}}); });
  });
  answer.list("phase_margins", margins.gain_crossings, [&](const classical::GainCrossing& at) {
    answer.object([&] { answer.add({{"w", at.frequency}, {"pm_deg", at.phase_margin}}); });
  });
  answer.add("closed_loop_stable", margins.stable);
  answer.add("delay_margin", margins.delay_margin);
  answer.add("disk_margin", margins.disk_margin);
  answer.add("bandwidth", or_nan(width));
  answer.object("sensitivity_peak", [&] {
    answer.add({{"Ms", margins.sensitivity.value}, {"w", margins.sensitivity.frequency}});
  });
  write_step_metrics("step", step, answer);
}

Outcome write_transfer_function(const classical::TransferFunction& transfer, JsonWriter& answer) {
  FLYBALL_TRY(const auto zeros, transfer.zeros());
  FLYBALL_TRY(const auto poles, transfer.poles());
  FLYBALL_TRY(const bool stable, transfer.is_stable());
  FLYBALL_TRY(const auto margins, classical::loop_margins(transfer));
  FLYBALL_TRY(const auto width, classical::bandwidth(transfer));
  FLYBALL_TRY(const auto step, classical::step_metrics(transfer));
  answer.add("zeros", zeros);
  answer.add("poles", poles);
  answer.add("dcgain", transfer.dc_gain());
  answer.add("stable", stable);
  write_as_loop(margins, width, step, answer);
  return {};
}

/// Of several dead times, whose zeros are infinitely many.
Outcome write_transfer_function(const classical::DelaySystem& system, JsonWriter& answer) {
  FLYBALL_TRY(const auto found, classical::rightmost_poles(system));
  FLYBALL_TRY(const auto margins, classical::loop_margins(system));
  FLYBALL_TRY(const auto width, classical::bandwidth(system));
  FLYBALL_TRY(const auto step, classical::step_metrics(system, 0, 0));
  const double rest = system.dc_gain()(0, 0);
  answer.add("poles", found.poles);
  answer.add("dcgain", std::isfinite(rest) ? rest : std::numeric_limits<double>::infinity());
  answer.add("stable", found.stable);
  write_as_loop(margins, width, step, answer);
  return {};
}

Outcome solve_transfer_function(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto system, transfer_system_of(problem, "tf"));
  return std::visit([&](const auto& one) { return write_transfer_function(one, answer); }, system);
}

Outcome solve_pade(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto transfer,
              classical::pade(Time(problem.number("T")), static_cast<int>(problem.integer("n"))));
  answer.add("num", transfer.num());
  answer.add("den", transfer.den());
  return {};
}

}  // namespace

std::vector<Kind> transfer_function_kinds() {
  return {
      {"tf",
       "what a transfer function is like, alone and as an open loop L under negative feedback",
       transfer_fields(),
       {optional(complex_list("zeros", "z", "of the numerator; left out of several dead times")),
        complex_list("poles", "s", "of the denominator; with dead time in a loop the rightmost"),
        unbounded(number("dcgain", "", "G(0), or G(1) of a discrete one")),
        flag("stable", "whether all poles are where a stable system has them"),
        records("gain_margins", "w gm", "where L is negative: rad/s and 1/|L|"),
        records("phase_margins", "w pm_deg", "where |L| = 1: rad/s and 180 + arg L in degrees"),
        flag("closed_loop_stable", "whether 1/(1 + L) is stable"),
        unbounded(number("delay_margin", "s", "the further delay that the loop bears")),
        unbounded(number("disk_margin", "",
                         "2/‖S - T‖∞ of a stable loop; null where dead time turns too often")),
        unbounded(number("bandwidth", "rad/s", "where |G| is 3 dB below G(0) first")),
        unbounded(record("sensitivity_peak", "Ms w", "the largest |1/(1 + L)| and where, rad/s")),
        step_metrics_field(
            "step",
            "G's step response: 10 to 90 %, 2 %, percent of the final value; exact in time, "
            "null where there is none")},
       R"({"num": [100], "den": [1, 2, 100]})",
       &solve_transfer_function},
      {"pade",
       "the rational function nearest to a delay e^(-Ts) at low frequencies",
       {number("T", "s", "the delay"), integer("n", "the order, 0 to 20")},
       {list("num", "v", "", "the numerator's coefficients, the highest power first"),
        list("den", "v", "", "the denominator's")},
       R"({"T": 0.02, "n": 3})",
       &solve_pade},
  };
}

}  // namespace flyball::solve
