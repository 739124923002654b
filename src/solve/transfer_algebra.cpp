#include <limits>
#include <optional>
#include <utility>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/partial_fractions.hpp>
#include <flyball/classical/steady_state.hpp>
#include <flyball/classical/transfer_matrix.hpp>
#include <flyball/systems/transmission_zeros.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// What transfer functions are made of and made into (appendices A and E.2, E.3).
namespace flyball::solve {

namespace {

using classical::DelaySystem;
using classical::TransferFunction;
using classical::ZeroPoleGain;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

Expected<TransferFunction> transfer_of(const VectorXd& num, const VectorXd& den, double dt,
                                       double delay) {
  FLYBALL_CHECK(Checks("transfer function").not_negative(dt, "dt", "s"));
  return TransferFunction::create(num, den, dt > 0.0 ? std::optional(Time(dt)) : std::nullopt,
                                  Time(delay));
}

Expected<TransferFunction> transfer_of(const Problem& problem) {
  return transfer_of(problem.matrix("num"), problem.matrix("den"), problem.number("dt"),
                     problem.number("delay"));
}

Expected<TransferFunction> transfer_of(const Problem& problem, std::string_view name) {
  const TransferCoefficients& G = problem.transfer(name);
  return transfer_of(G.num, G.den, G.dt, G.delay);
}

void write_cancellations(const std::vector<classical::Cancellation>& cancelled, bool hides,
                         JsonWriter& answer) {
  VectorXcd zeros(static_cast<Index>(cancelled.size()));
  for (Index i = 0; i < zeros.size(); ++i) {
    zeros(i) = cancelled[static_cast<std::size_t>(i)].pole;
  }
  answer.add("cancelled", zeros);
  answer.add("hides_instability", hides);
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
    return {};
  });
}

Outcome solve_tf2ss(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const TransferFunction G, transfer_of(problem));
  FLYBALL_TRY(const DelaySystem late, DelaySystem::create(G));
  if (G.period()) {
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
  answer.add("delay", G.delay());
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

Outcome solve_residue(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto found,
              classical::partial_fractions(problem.matrix("num"), problem.matrix("den")));
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

Outcome solve_interconnect(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const TransferFunction G, transfer_of(problem, "G"));
  FLYBALL_TRY(const TransferFunction H, transfer_of(problem, "H"));
  const auto write = [&](std::string_view name, const TransferFunction& made) {
    answer.object(name, [&] {
      answer.add("num", made.num());
      answer.add("den", made.den());
      if (made.period()) {
        answer.add("dt", made.period()->si());
      }
      if (made.delay() > 0.0) {
        answer.add("delay", made.delay());
      }
    });
  };
  FLYBALL_TRY(const auto cascade, classical::series(G, H));
  FLYBALL_TRY(const auto loop, classical::feedback(G, H, true));
  write("series", cascade);
  if (const auto sum = classical::parallel(G, H)) {
    write("parallel", *sum);
  }
  write("feedback_neg", loop);
  if (const auto positive = classical::feedback(G, H, false)) {
    write("feedback_pos", *positive);
  }
  return {};
}

Outcome solve_closed_loop_poles(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const TransferFunction L, transfer_of(problem));
  FLYBALL_TRY(const DelaySystem open, DelaySystem::create(L));
  FLYBALL_TRY(const DelaySystem loop, classical::feedback(open));
  FLYBALL_TRY(const auto found, classical::rightmost_poles(loop));
  answer.add("poles", found.poles);
  answer.add("stable", found.stable);
  answer.add("unstable", found.unstable == std::numeric_limits<int>::max()
                             ? std::numeric_limits<double>::infinity()
                             : static_cast<double>(found.unstable));
  answer.add("high_frequency_abscissa", found.high_frequency_abscissa);
  return {};
}

Outcome solve_steady_state(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const TransferFunction L, transfer_of(problem));
  FLYBALL_TRY(const auto error, classical::steady_state_error(L));
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  answer.add("type", error.type);
  answer.add("stable", error.stable);
  answer.add("Kp", error.position_constant);
  answer.add("Kv", error.velocity_constant);
  answer.add("Ka", error.acceleration_constant);
  answer.add("step", error.step.value_or(nan));
  answer.add("ramp", error.ramp.value_or(nan));
  answer.add("parabola", error.parabola.value_or(nan));
  return {};
}

}  // namespace

std::vector<Kind> transfer_algebra_kinds() {
  using namespace field;
  const std::vector<Field> given{
      list("num", "v", "", "the numerator's coefficients, the highest power first"),
      list("den", "o", "", "the denominator's"),
      or_number(number("dt", "s", "sample period of a discrete one, of z; 0 for one of s"), 0.0),
      or_number(number("delay", "s", "dead time, exact"), 0.0)};
  const std::vector<Field> any_system{A, B, C, D, or_first(domain), any_period};
  const Field tolerance =
      or_number(number("tolerance", "",
                       "zeros and poles nearer than that share of their size cancel; 0 cancels "
                       "nothing"),
                0.0);
  return {
      {"ss2tf",
       "the transfer function of one channel of a system, by its zeros and poles",
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
        flag("hides_instability", "whether one of those is unstable or its zero nonminimum phase")},
       R"({"A": [[0, 1], [-2, -3]], "B": [[0], [1]], "C": [[1, 0]]})",
       &solve_ss2tf},
      {"tf2ss", "a transfer function as a system, in sections of its roots", given,
       answered_system("n", "m", "p") +
           std::vector{number("delay", "s",
                              "dead time before its input; that of a discrete one is states")},
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
       {list("num", "v", "", "the numerator's coefficients, the highest power first"),
        list("den", "o", "", "the denominator's, of any degree")},
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
       {transfer("series", "e", "f", "G H"),
        optional(transfer("parallel", "g", "h", "G + H, unless their dead times differ")),
        transfer("feedback_neg", "i", "j", "G/(1 + G H)"),
        optional(transfer("feedback_pos", "k", "l", "G/(1 - G H), unless that is algebraic"))},
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
       &solve_steady_state},
  };
}

}  // namespace flyball::solve
