#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/partial_fractions.hpp>
#include <flyball/classical/steady_state.hpp>
#include <flyball/classical/transfer_matrix.hpp>
#include <flyball/systems/realization.hpp>
#include <flyball/systems/transmission_zeros.hpp>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// What transfer functions are made of and made into (appendices A and E.2, E.3).
namespace flyball::solve {

namespace {

using classical::DelaySystem;
using classical::TransferFunction;
using classical::ZeroPoleGain;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

void write_cancellations(const std::vector<classical::Cancellation>& cancelled, bool hides,
                         JsonWriter& answer) {
  VectorXcd zeros(static_cast<Index>(cancelled.size()));
  for (Index i = 0; i < zeros.size(); ++i) {
    zeros(i) = cancelled[static_cast<std::size_t>(i)].pole;
  }
  answer.add("cancelled", zeros);
  answer.add("hides_instability", hides);
}

/// All of them, rows of outputs.
template <class System>
Outcome write_channels(const System& plant, double tolerance, JsonWriter& answer) {
  FLYBALL_TRY(auto G, classical::TransferMatrix::of(plant));
  if (tolerance > 0.0) {
    FLYBALL_TRY(G, G.without_cancellations(tolerance));
  }
  std::vector<std::vector<TransferFunction>> rows;
  for (Index i = 0; i < G.outputs(); ++i) {
    rows.emplace_back();
    for (Index j = 0; j < G.inputs(); ++j) {
      FLYBALL_TRY(auto entry, G(i, j).to_transfer_function());
      rows.back().push_back(std::move(entry));
    }
  }
  answer.list("G", rows, [&](const std::vector<TransferFunction>& row) {
    answer.open('[');
    for (const TransferFunction& entry : row) {
      answer.object([&] {
        answer.add("num", entry.num());
        answer.add("den", entry.den());
      });
    }
    answer.close(']');
  });
  return {};
}

Outcome solve_ss2tf(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const ZeroPoleGain whole, classical::channel_of(plant, problem.integer("output"),
                                                                problem.integer("input"), false));
    classical::Cancelled left{whole};
    if (problem.number("tolerance") > 0.0) {
      FLYBALL_TRY(left, classical::without_cancellations(whole, problem.number("tolerance")));
    }
    FLYBALL_TRY(const TransferFunction G, left.transfer.to_transfer_function());
    answer.add("num", G.num());
    answer.add("den", G.den());
    answer.add("zeros", left.transfer.zeros());
    answer.add("poles", left.transfer.poles());
    answer.add("gain", left.transfer.gain());
    write_cancellations(left.cancelled, left.hides_instability, answer);
    if (plant.B.cols() * plant.C.rows() > 1) {
      FLYBALL_CHECK(write_channels(plant, problem.number("tolerance"), answer));
    }
    return {};
  });
}

/// Every channel by itself, with its dead times.
Outcome write_late_matrix(const std::vector<std::vector<DelaySystem>>& entries,
                          JsonWriter& answer) {
  constexpr std::string_view where = "tf2ss";
  const auto p = static_cast<Index>(entries.size());
  const auto m = static_cast<Index>(entries.front().size());
  std::optional<DelaySystem> all;
  classical::Wiring wiring{MatrixXd::Zero(p * m, p * m), MatrixXd::Zero(p * m, m),
                           MatrixXd::Zero(p, p * m), MatrixXd::Zero(p, m)};
  Index channel = 0;
  for (Index i = 0; i < p; ++i) {
    for (Index j = 0; j < m; ++j, ++channel) {
      const DelaySystem& entry = entries[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      if (!all) {
        all = entry;
      } else {
        FLYBALL_TRY_IN(where, auto more, classical::append(*all, entry));
        all = std::move(more);
      }
      wiring.E(channel, j) = 1.0;
      wiring.H(i, channel) = 1.0;
    }
  }
  FLYBALL_TRY_IN(where, const auto system, classical::rewired(*all, wiring));
  write_delay_form(system, answer);
  answer.add("delay", 0.0);
  return {};
}

/// Of several channels, of as few states as needed.
Outcome solve_matrix_tf2ss(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "tf2ss";
  for (const char* name : {"num", "den", "expr"}) {
    if (problem.has(name)) {
      return refusal(ArgumentError::malformed, where, name)
          .got("given beside G")
          .expected("left out: the entries of G are the transfer functions");
    }
  }
  const double dt = problem.number("dt");
  const double delay = problem.number("delay");
  std::vector<std::vector<TransferFunction>> entries;
  bool several = false;
  bool late = false;
  std::vector<std::vector<DelaySystem>> systems;
  for (const auto& row : problem.transfers("G")) {
    entries.emplace_back();
    systems.emplace_back();
    for (TransferCoefficients written : row) {
      written.dt = written.dt > 0.0 ? written.dt : dt;
      written.delay += delay;
      FLYBALL_TRY(auto entry, transfer_system_of(written, where));
      FLYBALL_TRY(auto system, delay_system_of(entry));
      late = late || (!system.period() && system.has_delay());
      systems.back().push_back(std::move(system));
      if (auto* rational = std::get_if<TransferFunction>(&entry)) {
        entries.back().push_back(std::move(*rational));
      } else {
        several = true;
      }
    }
  }
  if (late || several) {
    return write_late_matrix(systems, answer);
  }
  FLYBALL_TRY_IN(where, const auto G, classical::TransferMatrix::create(entries));
  if (G.period()) {
    // The dead times of a discrete one are states.
    FLYBALL_TRY_IN(where, const auto delayed, G.to_delay_system());
    FLYBALL_TRY_IN(where, const DiscreteSystem<> states, delayed.to_discrete());
    FLYBALL_TRY_IN(where, const auto least, minimal_realization(states));
    write_system(least.system, answer);
  } else {
    FLYBALL_TRY_IN(where, const ContinuousSystem<> least, G.to_continuous());
    write_system(least, answer);
  }
  answer.add("delay", 0.0);
  return {};
}

Outcome solve_tf2ss(const Problem& problem, JsonWriter& answer) {
  if (problem.has("G")) {
    return solve_matrix_tf2ss(problem, answer);
  }
  FLYBALL_TRY(const auto given, transfer_system_of(problem, "tf2ss"));
  FLYBALL_TRY(const DelaySystem late, delay_system_of(given));
  if (const auto* several = std::get_if<DelaySystem>(&given); several && !several->period()) {
    write_delay_form(*several, answer);
    answer.add("delay", 0.0);
    return {};
  }
  if (late.period()) {
    // The dead time of a discrete one is states.
    FLYBALL_TRY(const DiscreteSystem<> s, late.to_discrete());
    write_system(s, answer);
    answer.add("delay", 0.0);
    return {};
  }
  const classical::DelayForm& form = late.form();
  const Eigen::MatrixXd& B = late.has_delay() ? form.B2 : form.B1;
  const Eigen::MatrixXd& D = late.has_delay() ? form.D12 : form.D11;
  write_system(ContinuousSystem<>{form.A, B, form.C1, D}, answer);
  answer.add("delay", late.has_delay() ? late.delays()(0) : 0.0);
  return {};
}

Outcome solve_zeros(const Problem& problem, JsonWriter& answer) {
  return with_system(problem, [&](const auto& plant) -> Outcome {
    FLYBALL_TRY(const auto found, transmission_zeros(plant, problem.number("tolerance")));
    answer.add("zeros", found.zeros);
    answer.add("normal_rank", found.normal_rank);
    return {};
  });
}

/// Improper ones, too.
Expected<classical::PartialFractions> fractions_of(const Problem& problem) {
  constexpr std::string_view where = "residue";
  for (const char* name : {"num", "den"}) {
    if (problem.has(name) == problem.has("expr")) {
      return refusal(ArgumentError::malformed, where, name)
          .got(problem.has(name) ? "given beside expr" : "left out")
          .expected("num and den, or expr in their place");
    }
  }
  if (!problem.has("expr")) {
    return classical::partial_fractions(problem.matrix("num"), problem.matrix("den"));
  }
  const std::string texts[] = {problem.text("expr")};
  FLYBALL_TRY(const ZeroPoleGain whole, classical::parse_zero_pole_gain(texts));
  if (whole.delay() > 0.0) {
    return refusal(ArgumentError::out_of_range, where, "expr")
        .got("a function with dead time")
        .expected("one without: the fractions are those of num/den");
  }
  return classical::partial_fractions(whole);
}

Outcome solve_residue(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto found, fractions_of(problem));
  Index count = 0;
  for (const classical::PartialFraction& fraction : found.fractions) {
    count += fraction.residues.size();
  }
  VectorXcd residues(count);
  VectorXcd poles(count);
  VectorXd powers(count);
  Index at = 0;
  for (const classical::PartialFraction& fraction : found.fractions) {
    for (Index k = 0; k < fraction.residues.size(); ++k, ++at) {
      residues(at) = fraction.residues(k);
      poles(at) = fraction.pole;
      powers(at) = static_cast<double>(k + 1);
    }
  }
  answer.add("residues", residues);
  answer.add("poles", poles);
  answer.add("powers", powers);
  answer.add("polynomial", found.polynomial);
  answer.add("impulse_response", classical::function_of_time(found).text(6));
  return {};
}

/// With dead time: a rational function behind it where one is, or the delays drawn out.
Outcome write_late_interconnections(const classical::TransferSystem& G_system,
                                    const classical::TransferSystem& H_system, JsonWriter& answer) {
  constexpr std::string_view where = "interconnect";
  FLYBALL_TRY(const DelaySystem G, delay_system_of(G_system));
  FLYBALL_TRY(const DelaySystem H, delay_system_of(H_system));
  FLYBALL_TRY_IN(where, const auto cascade, classical::series(G, H));
  FLYBALL_TRY_IN(where, const auto sum, classical::parallel(G, H));
  FLYBALL_TRY_IN(where, const auto loop, classical::feedback(G, H));
  const auto positive = classical::feedback(G, H, FeedbackSign::positive);
  const auto* rational_G = std::get_if<TransferFunction>(&G_system);
  const auto* rational_H = std::get_if<TransferFunction>(&H_system);
  const bool rational = rational_G != nullptr && rational_H != nullptr;
  const auto both =
      rational ? std::optional(classical::series(*rational_G, *rational_H)) : std::nullopt;
  const auto added =
      rational ? std::optional(classical::parallel(*rational_G, *rational_H)) : std::nullopt;
  if (both && *both) {
    write_transfer("series", **both, answer);
  }
  if (added && *added) {
    write_transfer("parallel", **added, answer);
  }
  std::vector<std::pair<std::string, DelaySystem>> delayed;
  if (!both || !*both) {
    delayed.emplace_back("series", cascade);
  }
  if (!added || !*added) {
    delayed.emplace_back("parallel", sum);
  }
  delayed.emplace_back("feedback_neg", loop);
  if (positive) {
    delayed.emplace_back("feedback_pos", *positive);
  }
  answer.list("delayed", delayed, [&](const auto& one) {
    answer.object([&] {
      answer.add("name", one.first);
      write_delay_form(one.second, answer);
    });
  });
  return {};
}

Outcome solve_interconnect(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "interconnect";
  FLYBALL_TRY(const auto G_system, transfer_system_of(problem.transfer("G"), where));
  FLYBALL_TRY(const auto H_system, transfer_system_of(problem.transfer("H"), where));
  const auto* rational_G = std::get_if<TransferFunction>(&G_system);
  const auto* rational_H = std::get_if<TransferFunction>(&H_system);
  if (rational_G == nullptr || rational_H == nullptr ||
      (!rational_G->period() && !rational_H->period() &&
       (rational_G->delay() > 0.0 || rational_H->delay() > 0.0))) {
    return write_late_interconnections(G_system, H_system, answer);
  }
  const TransferFunction& G = *rational_G;
  const TransferFunction& H = *rational_H;
  FLYBALL_TRY(const auto cascade, classical::series(G, H));
  FLYBALL_TRY(const auto loop, classical::feedback(G, H, true));
  write_transfer("series", cascade, answer);
  if (const auto sum = classical::parallel(G, H)) {
    write_transfer("parallel", *sum, answer);
  }
  write_transfer("feedback_neg", loop, answer);
  if (const auto positive = classical::feedback(G, H, false)) {
    write_transfer("feedback_pos", *positive, answer);
  }
  return {};
}

Outcome solve_closed_loop_poles(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto L, transfer_system_of(problem, "closed-loop-poles"));
  FLYBALL_TRY(const DelaySystem open, delay_system_of(L));
  FLYBALL_TRY(const DelaySystem loop, classical::feedback(open));
  FLYBALL_TRY(const auto found, classical::rightmost_poles(loop));
  answer.add("poles", found.poles);
  answer.add("stable", found.stable);
  answer.add("unstable", count_of_poles(found.unstable));
  answer.add("high_frequency_abscissa", found.high_frequency_abscissa);
  return {};
}

Outcome solve_transfer_steady_state(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const TransferFunction L, transfer_of(problem, "steady-state-error"));
  FLYBALL_TRY(const auto error, classical::steady_state_error(L));
  answer.add("type", error.type);
  answer.add("stable", error.stable);
  answer.add("Kp", error.position_constant);
  answer.add("Kv", error.velocity_constant);
  answer.add("Ka", error.acceleration_constant);
  answer.add("step", or_nan(error.step));
  answer.add("ramp", or_nan(error.ramp));
  answer.add("parabola", or_nan(error.parabola));
  return {};
}

}  // namespace

std::vector<Kind> transfer_algebra_kinds() {
  using namespace field;
  const std::vector<Field> given = transfer_fields();
  const std::vector<Field> any_system{A, B, C, D, or_first(domain), any_period};
  static const std::vector<Field> delayed_system =
      std::vector{text("name", "which")} + answered_system("n", "m", "p") + delay_form_fields();
  const Field tolerance =
      or_number(number("tolerance", "",
                       "zeros and poles nearer than that share of their size cancel; 0 cancels "
                       "nothing"),
                0.0);
  return {
      {"ss2tf",
       "the transfer function of one channel of a system by its zeros and poles, and all of "
       "several",
       any_system +
           std::vector{or_number(integer("input", "from which of the inputs, from 0"), 0.0),
                       or_number(integer("output", "to which of the outputs, from 0"), 0.0),
                       tolerance},
       {list("num", "v", "", "the numerator's coefficients, the highest power first"),
        list("den", "o", "", "the denominator's, which begin with 1"),
        complex_list("zeros", "z", "of the numerator"),
        complex_list("poles", "s", "of the denominator"),
        number("gain", "", "k of k Π(s - z)/Π(s - p)"),
        complex_list("cancelled", "c", "poles that zeros took away"),
        flag("hides_instability", "whether one of those is unstable or its zero nonminimum phase"),
        optional(transfers("G", "p", "m", "every channel, of a system of several"))},
       R"({"A": [[0, 1], [-2, -3]], "B": [[0], [1]], "C": [[1, 0]]})",
       &solve_ss2tf},
      {"tf2ss",
       "a transfer function as a system, in sections of its roots, or a matrix of them as one of "
       "as few states as needed; other dead times are drawn out of it",
       given + std::vector{optional(transfers(
                   "G", "p", "m",
                   "in place of one: rows of outputs, an entry an input; dt and delay are theirs "
                   "where an entry says none"))},
       answered_system("n", "m", "p") +
           std::vector{number("delay", "s",
                              "dead time before its input; that of a discrete one is states")} +
           delay_form_fields(),
       R"({"num": [1, 3], "den": [1, 2, 5]})", &solve_tf2ss},
      {"zeros",
       "the transmission zeros of a system of any inputs and outputs, and the modes that are not "
       "moved or not seen",
       any_system + std::vector{or_number(
                        number("tolerance", "",
                               "below which singular values are zero, relative to the data; 0 "
                               "takes 100 n times the rounding error"),
                        0.0)},
       {complex_list("zeros", "z", "where the rank of [sI - A, -B; C, D] falls"),
        integer("normal_rank", "of the transfer matrix almost everywhere")},
       R"({"A": [[-1, 0], [0, -2]], "B": [[1], [1]], "C": [[2, -1]]})",
       &solve_zeros},
      {"residue",
       "num/den as partial fractions, Σ r/(s - p)^k and a polynomial",
       {optional(list("num", "v", "", "the numerator's coefficients, the highest power first")),
        optional(list("den", "o", "", "the denominator's, of any degree")),
        optional(text("expr", "in place of num and den, in s; it may be improper"))},
       {complex_list("residues", "r", "r"), complex_list("poles", "r", "p of each"),
        list("powers", "r", "", "k of each"),
        list("polynomial", "q", "", "coefficients, empty of a strictly proper function"),
        text("impulse_response", "the function of time of which num/den is the Laplace transform")},
       R"({"num": [1, 4], "den": [1, 4, 5, 2]})",
       &solve_residue},
      {"interconnect",
       "two transfer functions in series, in parallel and in a loop (A.1 to A.4)",
       {transfer("G", "a", "b", "on the way forward"),
        transfer("H", "c", "d", "behind it, beside it, or on the way back")},
       {optional(transfer("series", "e", "f", "G H")),
        optional(transfer("parallel", "g", "h", "G + H")),
        optional(transfer("feedback_neg", "i", "j", "G/(1 + G H)")),
        optional(transfer("feedback_pos", "k", "l", "G/(1 - G H), unless that is algebraic")),
        optional(objects("delayed", delayed_system,
                         "what is no rational function behind one dead time: the same names, each "
                         "with its dead times drawn out of it"))},
       R"({"G": {"num": [1], "den": [1, 1]}, "H": {"num": [2], "den": [1, 3]}})",
       &solve_interconnect},
      {"closed-loop-poles",
       "the poles of L/(1 + L), with dead time the rightmost of infinitely many",
       given,
       {complex_list("poles", "s", "by falling real part, or size of a discrete one"),
        flag("stable", "whether all are where a stable loop has them"),
        unbounded(number("unstable", "", "how many are not")),
        unbounded(number("high_frequency_abscissa", "1/s",
                         "where poles of the highest frequencies tend to"))},
       R"({"num": [1], "den": [1, 0], "delay": 0.5})",
       &solve_closed_loop_poles},
      {"steady-state-error",
       "what is left of the error of a loop L under unity feedback (E.3.5)",
       given,
       {integer("type", "integrators in L"), flag("stable", "the closed loop"),
        unbounded(number("Kp", "", "L(0)")), unbounded(number("Kv", "1/s", "lim s L")),
        unbounded(number("Ka", "1/s²", "lim s² L")),
        unbounded(number("step", "", "error for r = 1; null of an unstable loop")),
        unbounded(number("ramp", "", "for r = t")),
        unbounded(number("parabola", "", "for r = t²/2"))},
       R"({"num": [5], "den": [1, 1, 0]})",
       &solve_transfer_steady_state},
  };
}

}  // namespace flyball::solve
