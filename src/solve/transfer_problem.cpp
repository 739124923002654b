#include <limits>
#include <string>
#include <utility>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

namespace flyball::solve {

using classical::DelaySystem;
using classical::TransferFunction;
using classical::TransferSystem;

std::vector<Field> transfer_fields(std::string_view delay) {
  return {
      optional(list("num", "v", "", "the numerator's coefficients, the highest power first")),
      optional(list("den", "o", "", "the denominator's")),
      or_number(number("dt", "s", "sample period of a discrete one, of z; 0 for one of s"), 0.0),
      or_number(number("delay", "s", delay), 0.0),
      optional(text("expr", "in place of num and den, such as \"2/(s^2+3*s+2)*exp(-0.1*s)\""))};
}

Expected<TransferSystem> transfer_system_of(const TransferCoefficients& written,
                                            std::string_view where) {
  FLYBALL_CHECK(Checks(where).not_negative(written.dt, "dt", "s"));
  const auto period = written.dt > 0.0 ? std::optional(Time(written.dt)) : std::nullopt;
  if (written.expr) {
    FLYBALL_CHECK(Checks(where).not_negative(written.delay, "delay", "s"));
    const std::string texts[] = {*written.expr};
    return classical::parse_transfer_system(texts,
                                            {.period = period, .delay = Time(written.delay)});
  }
  return TransferFunction::create(written.num, written.den, period, Time(written.delay))
      .map([](TransferFunction&& transfer) { return TransferSystem(std::move(transfer)); });
}

Expected<TransferSystem> transfer_system_of(const Problem& problem, std::string_view where) {
  TransferCoefficients written;
  if (problem.has("expr")) {
    written.expr = problem.text("expr");
  }
  for (const char* name : {"num", "den"}) {
    if (problem.has(name) == problem.has("expr")) {
      return refusal(ArgumentError::malformed, where, name)
          .got(problem.has(name) ? "given beside expr" : "left out")
          .expected("num and den, or expr in their place");
    }
    if (problem.has(name)) {
      (name[0] == 'n' ? written.num : written.den) = problem.matrix(name);
    }
  }
  written.dt = problem.number("dt");
  written.delay = problem.number("delay");
  return transfer_system_of(written, where);
}

namespace {

Expected<TransferFunction> rational(Expected<TransferSystem> system, std::string_view where) {
  if (!system) {
    return tl::unexpected(std::move(system).error());
  }
  if (auto* transfer = std::get_if<TransferFunction>(&*system)) {
    return std::move(*transfer);
  }
  return refusal(classical::TransferError::delay_in_loop, where, "expr")
      .got("made of parts of several dead times")
      .expected("a rational function behind one dead time")
      .hint(
          "tf, tf2ss, bode, nyquist, margins, step, freqresp, interconnect and closed-loop-poles "
          "take it "
          "as it is");
}

}  // namespace

Expected<TransferFunction> transfer_of(const Problem& problem, std::string_view where) {
  return rational(transfer_system_of(problem, where), where);
}

Expected<TransferFunction> transfer_of(const TransferCoefficients& written,
                                       std::string_view where) {
  return rational(transfer_system_of(written, where), where);
}

Expected<DelaySystem> delay_system_of(const TransferSystem& system) {
  if (const auto* late = std::get_if<DelaySystem>(&system)) {
    return *late;
  }
  return DelaySystem::create(std::get<TransferFunction>(system));
}

void write_transfer(std::string_view name, const TransferFunction& transfer, JsonWriter& answer) {
  answer.object(name, [&] {
    answer.add("num", transfer.num());
    answer.add("den", transfer.den());
    if (transfer.period()) {
      answer.add("dt", transfer.period()->si());
    }
    if (transfer.delay() > 0.0) {
      answer.add("delay", transfer.delay());
    }
  });
}

std::vector<Field> delay_form_fields() {
  return {optional(list("delays", "T", "s", "τ: w(t) = z(t - τ) beside x and u")),
          optional(matrix("B_w", "n", "T", "dx/dt = A x + B u + B_w w")),
          optional(matrix("C_z", "T", "n", "z = C_z x + D_z u + D_zw w")),
          optional(matrix("D_w", "p", "T", "y = C x + D u + D_w w")),
          optional(matrix("D_z", "T", "m", "how the inputs reach z")),
          optional(matrix("D_zw", "T", "T", "how w reaches z"))};
}

void write_delay_form(const DelaySystem& system, JsonWriter& answer) {
  const classical::DelayForm& f = system.form();
  write_system(ContinuousSystem<>{f.A, f.B1, f.C1, f.D11}, answer);
  if (system.has_delay()) {
    answer.add("delays", f.delays);
    answer.add("B_w", f.B2);
    answer.add("C_z", f.C2);
    answer.add("D_w", f.D12);
    answer.add("D_z", f.D21);
    answer.add("D_zw", f.D22);
  }
}

Field step_metrics_field(std::string_view name, std::string_view help) {
  return record(name, "rise_time settling_time overshoot undershoot peak peak_time final_value",
                help);
}

void write_step_metrics(std::string_view name, const classical::StepMetrics& metrics,
                        JsonWriter& answer) {
  answer.object(name, [&] {
    answer.add({{"rise_time", or_nan(metrics.rise_time)},
                {"settling_time", or_nan(metrics.settling_time)},
                {"overshoot", 100.0 * or_nan(metrics.overshoot)},
                {"undershoot", 100.0 * or_nan(metrics.undershoot)},
                {"peak", or_nan(metrics.peak)},
                {"peak_time", or_nan(metrics.peak_time)},
                {"final_value", metrics.final_value}});
  });
}

double count_of_poles(int count) {
  return count == std::numeric_limits<int>::max() ? std::numeric_limits<double>::infinity()
                                                  : static_cast<double>(count);
}

double or_nan(const std::optional<double>& value) {
  return value.value_or(std::numeric_limits<double>::quiet_NaN());
}

std::optional<double> optional_number(const Problem& problem, std::string_view name) {
  return problem.has(name) ? std::optional(problem.number(name)) : std::nullopt;
}

}  // namespace flyball::solve
