#include <span>
#include <utility>

#include <flyball/control/pid_tuning.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Gains of PID controllers.
namespace flyball::solve {

namespace {

PidForm form_of(const Problem& problem) {
  const std::string_view form = problem.choice("form");
  return form == "p"    ? PidForm::p
         : form == "pi" ? PidForm::pi
         : form == "pd" ? PidForm::pd
                        : PidForm::pid;
}

Outcome write_gains(const Expected<PidGains>& gains, JsonWriter& answer) {
  return gains.map([&](const PidGains& pid) {
    answer.add("kp", pid.kp);
    answer.add("ki", pid.ki);
    answer.add("kd", pid.kd);
  });
}

Outcome solve_ultimate(const Problem& problem, JsonWriter& answer) {
  const UltimatePoint point{problem.number("ultimate_gain"), problem.number("ultimate_period")};
  return write_gains(problem.choice("rule") == "tyreus-luyben"
                         ? tyreus_luyben(point, form_of(problem))
                         : ziegler_nichols(point, form_of(problem)),
                     answer);
}

Outcome solve_reaction(const Problem& problem, JsonWriter& answer) {
  const ReactionCurve curve{problem.number("gain"), problem.number("time_constant"),
                            problem.number("delay")};
  const std::string_view rule = problem.choice("rule");
  const PidForm form = form_of(problem);
  // As fast as its delay: tight and robust.
  const double closed_loop_time =
      problem.has("closed_loop_time") ? problem.number("closed_loop_time") : curve.delay;
  return write_gains(rule == "simc"         ? simc(curve, closed_loop_time, form)
                     : rule == "cohen-coon" ? cohen_coon(curve, form)
                                            : ziegler_nichols(curve, form),
                     answer);
}

Outcome solve_curve(const Problem& problem, JsonWriter& answer) {
  const Eigen::MatrixXd& times = problem.matrix("times");
  const Eigen::MatrixXd& values = problem.matrix("values");
  FLYBALL_TRY(const auto curve,
              reaction_curve(std::span(times.data(), static_cast<std::size_t>(times.size())),
                             std::span(values.data(), static_cast<std::size_t>(values.size())),
                             problem.number("input_step")));
  answer.add("gain", curve.gain);
  answer.add("time_constant", curve.time_constant);
  answer.add("delay", curve.delay);
  return {};
}

Outcome solve_by_poles(const Problem& problem, JsonWriter& answer) {
  const Eigen::MatrixXd& A = problem.matrix("A");
  const Eigen::MatrixXd& B = problem.matrix("B");
  const double frequency = problem.number("natural_frequency");
  const double damping = problem.number("damping_ratio");
  if (A.rows() == 1) {
    ContinuousSystem<1, 1, 1> plant{};
    plant.A = A;
    plant.B = B;
    plant.C.setOnes();
    plant.D.setZero();
    return write_gains(pi_by_poles(plant, frequency, damping), answer);
  }
  FLYBALL_CHECK(
      Checks("pid-by-poles").shape(A, 2, 2, "A", "1 x 1 of a velocity or 2 x 2 of a position"));
  ContinuousSystem<2, 1, 1> plant{};
  plant.A = A;
  plant.B = B;
  plant.C << 1.0, 0.0;
  plant.D.setZero();
  return write_gains(pd_by_poles(plant, frequency, damping), answer);
}

}  // namespace

std::vector<Kind> pid_kinds() {
  using namespace field;
  const Field form = or_first(choice("form", "pid pi pd p", "which terms the controller has"));
  const std::vector<Field> gains{number("kp", "input/output", "proportional gain"),
                                 number("ki", "input/(output s)", "integral gain, kp/T_i"),
                                 number("kd", "input s/output", "derivative gain, kp T_d")};
  return {
      {"pid-ultimate",
       "gains from the point at which the plant under proportional control just keeps oscillating",
       {number("ultimate_gain", "input/output", "the proportional gain there"),
        number("ultimate_period", "s", "of the oscillation"),
        or_first(choice("rule", "ziegler-nichols tyreus-luyben", "lively, or calm")), form},
       gains,
       R"({"ultimate_gain": 8, "ultimate_period": 2})",
       &solve_ultimate},
      {"pid-reaction",
       "gains from a reaction curve, gain e^(-delay s)/(time_constant s + 1)",
       {number("gain", "output/input", "how far the output goes, by the input's step"),
        number("time_constant", "s", "how long it takes once it moves"),
        number("delay", "s", "how long nothing is seen"),
        or_first(choice("rule", "ziegler-nichols cohen-coon simc", "whose")), form,
        optional(number("closed_loop_time", "s",
                        "time constant that simc aims at, the delay if left out"))},
       gains,
       R"({"gain": 2, "time_constant": 10, "delay": 1, "rule": "cohen-coon", "form": "pi"})",
       &solve_reaction},
      {"reaction-curve",
       "gain, time constant and delay of a recorded step response",
       {list("times", "k", "s", "increasing, the step at the first"),
        list("values", "k", "output", "what was measured"),
        number("input_step", "input", "how much the input changed")},
       {number("gain", "output/input", "how far the output went, by the step"),
        number("time_constant", "s", "from its times at 28.3 % and 63.2 %"),
        number("delay", "s", "as it looks from outside")},
       R"({"times": [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10], "values": [0, 0, 1.26, 1.73, 1.9, 1.96, 1.99, 2, 2, 2, 2], "input_step": 1})",
       &solve_curve},
      {"pid-by-poles",
       "PI gains of a velocity or PD gains of a position with given closed-loop poles (2.2, 7.6)",
       {A, matrix("B", "n", "1", "how the input moves the states"),
        number("natural_frequency", "rad/s", "ω of s² + 2ζωs + ω²"),
        or_number(number("damping_ratio", "", "ζ; 1 is critical"), 1.0)},
       gains,
       R"({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "natural_frequency": 6, "damping_ratio": 0.7})",
       &solve_by_poles},
  };
}

}  // namespace flyball::solve
