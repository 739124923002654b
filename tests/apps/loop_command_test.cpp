#include <cmath>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::loop_command_test {
namespace {

using Json = nlohmann::json;

class LoopCommand : public Command {
 protected:
  [[nodiscard]] Json answer(const std::string& arguments, int status = 0) const {
    const Answer answer = run(arguments + " --json");
    EXPECT_EQ(answer.status, status) << arguments << "\n" << answer.err;
    const Json json = Json::parse(answer.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << answer.out;
    EXPECT_EQ(json.value("schema", ""), "flyball.loop/1");
    return json;
  }
  /// Ends with a status, the words on standard error and the caret under the place.
  void expect_refused(const std::string& arguments, std::string_view code, std::string_view words,
                      int status = 2) const {
    const Answer answer = run(arguments);
    EXPECT_EQ(answer.status, status) << arguments << "\n" << answer.err;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    EXPECT_TRUE(holds(answer.err, words)) << arguments << "\n" << answer.err;
    const Json refusal = this->answer(arguments, status);
    EXPECT_EQ(refusal.at("error").at("code"), code) << refusal.dump();
  }
};

// L = 4/(s (s + 1)(s + 2)): |L| = 1 and the phase -180 at ω = √2, where the gain is 4/6.
TEST_F(LoopCommand, Margins) {
  const Answer told = run("margins '4/(s*(s+1)*(s+2))'");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(told.err.empty()) << told.err;
  EXPECT_TRUE(holds(told.out, "The closed loop is stable")) << told.out;
  EXPECT_TRUE(holds(told.out, "3.522 dB")) << told.out;
  EXPECT_TRUE(holds(told.out, "--out DIR")) << told.out;
  EXPECT_EQ(files(), 0U);
  const Json loop = answer("margins '4/(s*(s+1)*(s+2))'").at("loops").at(0);
  EXPECT_NEAR(loop.at("margins").at("gain_margin").get<double>(), 1.5, 1e-14);
  EXPECT_NEAR(loop.at("margins").at("gain_margins").at(0).at("w").get<double>(), std::sqrt(2.0),
              1e-14);
  // The same by a gain, a compensator, lists and a file.
  write("loop.json", R"({"num": [4], "den": [1, 3, 2, 0]})");
  write("text.json", R"j({"expr": "4/(s*(s+1)*(s+2))"})j");
  for (const char* same :
       {"'1/(s*(s+1)*(s+2))' --gain 4", "'1/(s*(s+1))' --compensator '4/(s+2)'", "'[4]/[1 3 2 0]'",
        "'-(-4)/(s*(s+1)*(s+2))'", "'-4/(s*(s+1))' --compensator '-1/(s+2)'",
        "--num 4 --den '1 3 2 0'", "loop.json", "text.json"}) {
    const Json other = answer(std::string("margins ") + same).at("loops").at(0);
    EXPECT_NEAR(other.at("margins").at("gain_margin").get<double>(), 1.5, 1e-14) << same;
  }
}

// Without an end the curve has no count, and 0 rad/s no place in the picture.
TEST_F(LoopCommand, ADirectPathBehindDeadTime) {
  const Json loop = answer("margins '2*exp(-0.1s)'").at("loops").at(0).at("margins");
  EXPECT_EQ(loop.at("stable"), false);
  EXPECT_TRUE(holds(run("nyquist '2*exp(-0.1s)'").out, "infinitely many"));
  EXPECT_EQ(answer("margins '2/(s-1)'").at("loops").at(0).at("margins").at("gain_margin"), 0.5);
  EXPECT_EQ(run("bode '2/(s-1)' --out report").status, 0);
}

TEST_F(LoopCommand, WhatHasNoSettlingTime) {
  EXPECT_TRUE(holds(run("step '1/s'").out, "Does not settle"));
  EXPECT_TRUE(holds(run("step 's/(s+1)'").out, "Ends at 0, where it began"));
  EXPECT_TRUE(holds(run("step '1/(s^2+1e-8s+1)'").out, "Ends at 1, after very long swinging"));
}

TEST_F(LoopCommand, Bode) {
  const Json json = answer("bode 'exp(-0.5s)/(s+1)' '1/(s+1)'");
  const Json& w = json.at("w");
  const Json& late = json.at("loops").at(0).at("phase_deg");
  const Json& prompt = json.at("loops").at(1).at("phase_deg");
  ASSERT_EQ(w.size(), late.size());
  ASSERT_EQ(w.size(), prompt.size());
  for (std::size_t i = 0; i < w.size(); ++i) {
    const double delayed = 0.5 * w[i].get<double>() * 180.0 / std::acos(-1.0);
    EXPECT_NEAR(late[i].get<double>() + delayed, prompt[i].get<double>(), 1e-9 * (1.0 + delayed));
  }
  EXPECT_EQ(answer("bode '1/(s+1)' --from 1rad/s --to '10 rad/s'").at("w").front(), 1.0);
}

TEST_F(LoopCommand, NyquistCounts) {
  const Json loop = answer("nyquist '8/((s-1)*(s+2)*(s+3))'").at("loops").at(0).at("nyquist");
  EXPECT_EQ(loop.at("open_loop_unstable"), 1);
  EXPECT_EQ(loop.at("closed_loop_unstable").get<int>(),
            loop.at("encirclements").get<int>() + loop.at("open_loop_unstable").get<int>());
}

TEST_F(LoopCommand, RootLocus) {
  const Answer told = run("rlocus '1/(s*(s+1)*(s+2))' --damping 0.5");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "0 to 6")) << told.out;
  EXPECT_TRUE(holds(told.out, "two branches meet")) << told.out;
  const Json loop = answer("rlocus '1/(s*(s+1)*(s+2))' --damping 0.5 --gain 2").at("loops").at(0);
  EXPECT_NEAR(loop.at("root_locus").at("stable_gains").at(0).at("high").get<double>(), 6.0, 1e-13);
  EXPECT_EQ(loop.at("root_locus").at("at_damping").size(), 1U);
  EXPECT_EQ(loop.at("closed_loop_poles").size(), 3U);
  EXPECT_EQ(answer("rlocus '1/(s+1)' --negative")
                    .at("loops")
                    .at(0)
                    .at("root_locus")
                    .at("gains")
                    .back()
                    .get<double>() < 0.0,
            true);
}

// 1/(s + 1) is at 1 - e^{-t}: 90 % after ln 10; the closed loop 1/(s + 2) ends at 1/2.
TEST_F(LoopCommand, Step) {
  const Json open = answer("step '1/(s+1)'").at("loops").at(0).at("response");
  EXPECT_NEAR(open.at("step").at("rise_time").get<double>(), std::log(9.0), 1e-9);
  const Json closed = answer("step '1/(s+1)' --closed").at("loops").at(0).at("response");
  EXPECT_NEAR(closed.at("step").at("final_value").get<double>(), 0.5, 1e-15);
  for (std::size_t i = 0; i < closed.at("time").size(); ++i) {
    const double t = closed.at("time")[i].get<double>();
    EXPECT_NEAR(closed.at("value")[i].get<double>(), 0.5 * (1.0 - std::exp(-2.0 * t)), 1e-12);
  }
  // With dead time in the loop: until 2T nothing has come back, y = t - T of an integrator.
  const Json late =
      answer("step 'exp(-0.5s)/s' --closed --duration 3s").at("loops").at(0).at("response");
  for (std::size_t i = 0; i < late.at("time").size(); ++i) {
    const double t = late.at("time")[i].get<double>();
    if (t < 1.0) {
      EXPECT_NEAR(late.at("value")[i].get<double>(), std::max(0.0, t - 0.5), 1e-10) << t;
    }
  }
  // 10 % at 0.6 s; 1/2 + x - x²/2 + (x - 1/2)³/6 from 1.5 s to 2 s, x = t - 1.
  const double x = late.at("step").at("rise_time").get<double>() + 0.6 - 1.0;
  EXPECT_NEAR(0.5 + x - 0.5 * x * x + std::pow(x - 0.5, 3.0) / 6.0, 0.9, 1e-9);
  const Json impulse = answer("impulse '1/(s+1)'").at("loops").at(0).at("response");
  EXPECT_NEAR(impulse.at("value")[0].get<double>(), 1.0, 1e-14);
}

TEST_F(LoopCommand, Discrete) {
  const Json loop = answer("sisotool '0.1*z^-1/(1-0.9z^-1)' --period 20ms").at("loops").at(0);
  EXPECT_EQ(loop.at("dt"), 0.02);
  EXPECT_TRUE(loop.at("margins").at("stable").get<bool>());
  // 0.1/(z - 0.9): the pole 0.9 - 0.1 k reaches -1 at k = 19.
  EXPECT_NEAR(loop.at("root_locus").at("stable_gains").at(0).at("high").get<double>(), 19.0, 1e-12);
}

// The closed loop of (s - 1)/((s - 1)(s + 2)) keeps its pole at 1.
TEST_F(LoopCommand, WhatAZeroHides) {
  const Json hidden = answer("margins '(s-1)/((s-1)*(s+2))'");
  EXPECT_EQ(hidden.at("diagnostics").at(0).at("code"), "unstable_cancellation");
  EXPECT_FALSE(hidden.at("loops").at(0).at("margins").at("stable").get<bool>());
  EXPECT_EQ(answer("margins '(s+1)/((s+1)*(s+2))'").at("diagnostics").at(0).at("code"),
            "cancellation");
}

TEST_F(LoopCommand, PolesAsWritten) {
  const Json poles = answer("margins '1/(s+1)^20'").at("loops").at(0).at("poles");
  ASSERT_EQ(poles.size(), 20U);
  for (const Json& pole : poles) {
    EXPECT_EQ(pole, Json::parse("[-1.0, 0.0]"));
  }
}

// k (e^{-s} + e^{-3s})/s is real and negative first at π/4, where it is -8k cos(π/4)/π.
TEST_F(LoopCommand, SeveralDeadTimes) {
  const Json loop = answer("margins '0.5*(exp(-s) + exp(-3s))/s'").at("loops").at(0);
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(loop.at("margins").at("gain_margin").get<double>(), pi / (4.0 * std::cos(pi / 4.0)),
              1e-11);
  EXPECT_EQ(loop.at("delays"), Json::parse("[1.0, 3.0]"));
  EXPECT_FALSE(loop.contains("num"));
  const Json late = answer("bode 'feedback(exp(-s)/(s+1), exp(-0.5*s))'").at("loops").at(0);
  EXPECT_NEAR(late.at("gain_db").front().get<double>(), 20.0 * std::log10(0.5), 1e-2);
  // y = t - 1 of the first path from 1 s on, and t - 3 of the second from 3 s on.
  const Json step =
      answer("step '(exp(-s) + exp(-3s))/s' --duration 6s").at("loops").at(0).at("response");
  for (std::size_t i = 0; i < step.at("time").size(); ++i) {
    const double t = step.at("time")[i].get<double>();
    EXPECT_NEAR(step.at("value")[i].get<double>(), std::max(0.0, t - 1.0) + std::max(0.0, t - 3.0),
                1e-9);
  }
  const Json counted = answer("nyquist '0.6*(exp(-s) + exp(-3s))/s'").at("loops").at(0);
  EXPECT_EQ(counted.at("nyquist").at("encirclements"), 2);
  EXPECT_EQ(counted.at("margins").at("unstable_poles"), 2);
  const Answer told = run("sisotool 'exp(-s)/(s+1) + exp(-0.3*s)/(s+2)' --out late");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "300 ms")) << told.out;
  expect_refused("rlocus 'exp(-s)/s + 1/s'", "delay_in_loop", "several dead times");
}

TEST_F(LoopCommand, PidTune) {
  // C = 2 ζ... by crossover: |L| = 1 at 3 rad/s with 55°.
  const Json shaped =
      answer("pidtune '1/(s*(s+1))' --form pd --crossover '3 rad/s' --phase-margin 55")
          .at("loops")
          .at(0);
  EXPECT_NEAR(shaped.at("margins").at("phase_margin_deg").get<double>(), 55.0, 1e-8);
  EXPECT_NEAR(shaped.at("margins").at("phase_margins").at(0).at("w").get<double>(), 3.0, 1e-8);
  EXPECT_EQ(shaped.at("pid").at("ki"), 0.0);
  const Json robust = answer("pidtune 'exp(-0.2*s)/(s+1)^3' --form pi --ms 1.4").at("loops").at(0);
  EXPECT_NEAR(robust.at("margins").at("sensitivity_peak").at("Ms").get<double>(), 1.4, 1e-3);
  // With an integral the load is gone in the end, and ∫ e dt is 1/ki.
  EXPECT_NEAR(robust.at("load").at("value").back().get<double>(), 0.0, 0.02);
  EXPECT_NEAR(robust.at("response").at("step").at("final_value").get<double>(), 1.0, 1e-12);
  const Json rule = answer("pidtune 'exp(-s)/(2s+1)' --method simc --form pi").at("loops").at(0);
  EXPECT_NEAR(rule.at("pid").at("kp").get<double>(), 1.0, 1e-12);  // τ/(K (θ + θ))
  EXPECT_NEAR(rule.at("pid").at("ki").get<double>(), 0.5, 1e-12);
  const Json placed = answer("pidtune '1/s^2' --form pd --natural-frequency 2rad/s");
  EXPECT_TRUE(placed.at("loops").at(0).at("margins").at("stable").get<bool>());
  const Json sampled = answer("pidtune '0.1*z^-1/(1-0.9z^-1)' --period 20ms --form pi --ms 1.6");
  EXPECT_TRUE(sampled.at("loops").at(0).at("margins").at("stable").get<bool>());
  const Answer told = run("pidtune 'exp(-0.2*s)/(s+1)^3' --out pid");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "Kp")) << told.out;
  for (const char* file :
       {"index.html", "data/load.csv", "pictures/bode.svg", "pictures/step_response.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(work() / "pid" / file)) << file;
  }
  expect_refused("pidtune '1/s' --method loop-shape", "malformed", "--crossover");
  expect_refused("pidtune '1/s' --method simc --crossover 2rad/s", "malformed", "--crossover");
  expect_refused("pidtune '1/s' --form q", "unknown_name", "--form");
  expect_refused("pidtune '1/s + exp(-s)/s'", "delay_in_loop", "several dead times");
  expect_refused("pidtune '1/(s+1)' --form pi", "unlimited", "any is as robust", 1);
}

TEST_F(LoopCommand, AReportOfTheLoop) {
  const Answer told = run("sisotool '2/(s^2+3*s+2)*exp(-0.1*s)' --gain 3 --out report");
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_TRUE(holds(told.out, "overshoot"));
  for (const char* file : {"index.html", "result.json", "data/bode.csv", "data/nyquist.csv",
                           "data/response.csv", "pictures/bode.svg", "pictures/nyquist.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(work() / "report" / file)) << file;
  }
  ASSERT_EQ(run("rlocus '(s+3)/(s*(s+1)*(s^2+2s+5))' '1/(s+1)' --out locus").status, 0);
  EXPECT_TRUE(std::filesystem::exists(work() / "locus/pictures/root_locus.svg"));
  ASSERT_EQ(run("nichols '1/(s+1)^3' --out nichols").status, 0);
  EXPECT_TRUE(std::filesystem::exists(work() / "nichols/pictures/nichols.svg"));
}

TEST_F(LoopCommand, Refusals) {
  expect_refused("bode '2/(s^2+3*s+2'", "unclosed_parenthesis", "2/(s^2+3*s+2\n  ^");
  expect_refused("bode '2/(s+x)'", "unknown_name", "2/(s+x)\n     ^");
  expect_refused("bode '1/(z-0.5)'", "period_missing", "--period");
  expect_refused("bode '1/s+1/z'", "both_variables", "1/s+1/z\n      ^");
  expect_refused("step 's'", "improper", "degree 1 above and 0 below");
  expect_refused("rlocus 'exp(-s)/s'", "delay_in_loop", "bode and nyquist");
  expect_refused("bode", "empty", "EXPR is left out");
  expect_refused("bode --num 1", "empty", "--den is left out");
  expect_refused("bode '1/s' --gain 0", "not_positive", "--gain");
  expect_refused("bode '1/s' --gain x", "wrong_type", "--gain");
  expect_refused("bode '1/s' --delay=-1s", "out_of_range", "--delay");
  expect_refused("bode '1/s' --from '10 rad/s' --to '1 rad/s'", "out_of_range", "--from");
  expect_refused("rlocus '1/s' --damping 1", "out_of_range", "--damping");
  expect_refused("bode '1/s' --compensator '1/('", "missing_operand", "1/(\n   ^");
  expect_refused("bode missing.json", "not_found", "missing.json");
  write("bad.json", R"({"num": [1], "den": "x"})");
  expect_refused("bode bad.json", "malformed", "no list of numbers");
  expect_refused("impulse 2", "out_of_range", "a gain");
}

}  // namespace
}  // namespace flyball::test::loop_command_test
