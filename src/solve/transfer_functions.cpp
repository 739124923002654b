#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/classical/loop_margins.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/classical/transfer_function.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Transfer functions of one input and one output (appendix E).
namespace flyball::solve {

namespace {

using classical::TransferFunction;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double or_nan(const std::optional<double>& value) {
  return value.value_or(nan);
}

Expected<TransferFunction> transfer_of(const Problem& problem) {
  const double dt = problem.number("dt");
  FLYBALL_CHECK(Checks("transfer function").not_negative(dt, "dt", "s"));
  return TransferFunction::create(problem.matrix("num"), problem.matrix("den"),
                                  dt > 0.0 ? std::optional(Time(dt)) : std::nullopt,
                                  Time(problem.number("delay")));
}

Outcome solve_transfer_function(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto transfer, transfer_of(problem));
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
  answer.object("step", [&] {
    answer.add({{"rise_time", or_nan(step.rise_time)},
                {"settling_time", or_nan(step.settling_time)},
                {"overshoot", 100.0 * or_nan(step.overshoot)},
                {"undershoot", 100.0 * or_nan(step.undershoot)},
                {"peak", or_nan(step.peak)},
                {"peak_time", or_nan(step.peak_time)},
                {"final_value", step.final_value}});
  });
  return {};
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
  const std::vector<Field> transfer{
      list("num", "v", "", "the numerator's coefficients, the highest power first"),
      list("den", "o", "", "the denominator's"),
      or_number(number("dt", "s", "sample period of a discrete one, of z; 0 for one of s"), 0.0),
      or_number(number("delay", "s", "dead time, exact"), 0.0)};
  return {
      {"tf",
       "what a transfer function is like, alone and as an open loop L under negative feedback",
       transfer,
       {complex_list("zeros", "z", "of the numerator"),
        complex_list("poles", "s", "of the denominator"),
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
        record("step", "rise_time settling_time overshoot undershoot peak peak_time final_value",
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
