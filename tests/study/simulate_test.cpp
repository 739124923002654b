// What a project's [simulation] does, and what means nothing where it stands.
#include <flyball/study/simulate.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/study/answer.hpp>

namespace flyball::study::simulate_test {
namespace {

/// What is wrong with a file, with its excerpts.
std::string complaints(const std::string& text, std::span<const Override> overrides = {}) {
  const auto project = parse_project(text, "p.toml", overrides);
  std::string all;
  if (!project) {
    for (const QuotedError& error : project.error().all()) {
      all += to_string(error) + "\n" + error.excerpt + "\n";
    }
  }
  return all;
}

void expect_told(const std::string& told, std::string_view what) {
  EXPECT_NE(told.find(what), std::string::npos) << what << " in\n" << told;
}

Simulation simulated(const std::string& text, std::span<const Override> overrides = {}) {
  const auto project = parse_project(text, "p.toml", overrides);
  EXPECT_TRUE(project) << complaints(text, overrides);
  const auto result = project.and_then(&simulate);
  EXPECT_TRUE(result) << to_string(result.error());
  return result ? *result : Simulation{};
}

std::string refusal(const std::string& text) {
  const auto project = parse_project(text, "p.toml");
  EXPECT_TRUE(project) << complaints(text);
  const auto result = project.and_then(&simulate);
  EXPECT_FALSE(result);
  return result ? std::string() : to_string(result.error());
}

bool has_note(const Simulation& result, std::string_view part) {
  return std::any_of(result.diagnostics.begin(), result.diagnostics.end(), [&](const auto& note) {
    return note.code == "not_used" && note.message.find(part) != std::string::npos;
  });
}

/// x' = v, v' = u + more.
std::string mass_with(const std::string& more, const std::string& rest) {
  return "[model]\nstates = { x = \"m\", v = \"m/s\" }\ninputs = { u = \"m/s^2\" }\n"
         "parameters = { k = \"1 1/s^2\", one = \"1 m\", s = \"1 s\" }\n"
         "[model.derivative]\nx = \"v\"\nv = \"u" +
         more + "\"\n" + rest;
}

constexpr const char* elevator = "[mechanism]\ntype = \"elevator\"\n[gains]\nkV = 2.0\nkA = 0.2\n";

TEST(OtherSubject, OptionsOfAMechanismAreRefusedForAModelByName) {
  const std::vector<Override> typed{
      {"--mass", "3kg"}, {"--motor", "NEO"}, {"--kV", "2"}, {"--goal", "1m"}};
  const std::string told = complaints(mass_with("", ""), typed);
  for (const char* option : {"--mass is for", "--motor is for", "--kV is for", "--goal is for"}) {
    expect_told(told, option);
  }
  EXPECT_EQ(complaints(mass_with("", ""), std::vector<Override>{{"--seed", "5"}}), "");
}

TEST(OtherSubject, KeysAndOptionsOfAModelAreRefusedForAMechanism) {
  const std::vector<Override> typed{{"--point", "position=1m"}, {"--parameters", "a=3"}};
  const std::string told =
      complaints(std::string(elevator) +
                     "[controller]\nlimit = { voltage = \"3 V\" }\n[simulation]\n"
                     "noise = { position = \"1 mm\" }\naccuracy = 1e-3\n",
                 typed);
  for (const char* part : {"--point is for a model", "--parameters is for a model",
                           "p.toml:7:1: controller.limit is for a model",
                           "p.toml:9:1: simulation.noise is", "p.toml:10:1: simulation.accuracy"}) {
    expect_told(told, part);
  }
}

TEST(OtherSubject, PartsOfAnotherKindOfMechanismAreRefused) {
  const std::string told = complaints(
      "[mechanism]\ntype = \"elevator\"\nmotor_count = 2\ncenter_of_mass = \"1 m\"\n"
      "moment_of_inertia = \"1 kg m^2\"\n[gains]\nkV = 1.0\nangle_offset = \"3 deg\"\n");
  for (const char* part :
       {"p.toml:3:1: mechanism.motor_count is without", "p.toml:4:1: mechanism.center_of_mass is",
        "made of motor, gearing, mass, drum_radius", "p.toml:5:1: mechanism.moment_of_inertia",
        "p.toml:8:1: gains.angle_offset"}) {
    expect_told(told, part);
  }
  expect_told(complaints("[mechanism]\ntype = \"flywheel\"\n[gains]\nkV = 1.0\nkG = 1.0\n"),
              "p.toml:5:1: gains.kG is without meaning for this flywheel");
}

TEST(OtherSubject, ALogsUnitAndScaleAreCheckedWhenRead) {
  const std::string told =
      complaints(std::string(elevator) + "[log]\nscale = 0\nunit = \"parsec\"\n");
  expect_told(told, "p.toml:7:9: log.scale is 0; it must be other than zero");
  expect_told(told, "p.toml:8:8: the position's unit is \"parsec\", which is not known");
  expect_told(complaints(std::string(elevator) + "[log]\nunit = \"kg\"\n"), "a mass");
  EXPECT_EQ(complaints(std::string(elevator) + "[log]\nscale = -0.1\nunit = \"rotations\"\n"), "");
}

TEST(OtherSubject, ABatteryThatCannotSagIsNoted) {
  const Simulation result =
      simulated(std::string(elevator) + "[battery]\nresistance = \"3 Ohm\"\n");
  EXPECT_TRUE(has_note(result, "battery.resistance"));
  EXPECT_FALSE(has_note(simulated(elevator), "battery"));
}

TEST(ModelProject, WhatIsWrongWithAValueIsMarkedThere) {
  const std::string told = complaints(
      "[model]\nstates = { x = \"mm/q\" }\nparameters = { k = \"1 blub\" }\nangles = [\"y\"]\n"
      "[model.derivative]\nx = \"1\"\n[simulation]\naccuracy = 7\n");
  expect_told(told, "p.toml:2:16: model.states.x is");
  expect_told(told, "p.toml:3:20: model.parameters.k is \"blub\"");
  expect_told(told, "p.toml:4:10: \"y\" is not a state");
  expect_told(told, "p.toml:8:12: simulation.accuracy is 7");
  expect_told(complaints(mass_with("", "[simulation]\ninitial = { x = \"1 kg\", y = \"1 m\" }\n")),
              "    9 | initial = { x = \"1 kg\", y = \"1 m\" }\n      |                 ^^^^^^\n");
}

TEST(ModelProject, AMistakeIsToldOnce) {
  const auto count = [](const std::string& text) {
    const auto project = parse_project(text, "p.toml");
    return project ? 0U : project.error().all().size();
  };
  const std::string rest =
      "[model.derivative]\nx = \"v\"\n[simulation]\ninitial = { x = \"1 m\" }\n";
  EXPECT_EQ(count("[model]\nsates = { x = \"m\" }\n" + rest), 1U);
  EXPECT_EQ(count("[model]\nstates = [\"x\"]\n" + rest), 1U);
  EXPECT_EQ(count("[model]\nstates = {}\n" + rest), 1U);
  EXPECT_EQ(count("[model]\nstates = { x = \"m\" }\nderivative = \"v\"\n"), 1U);
  EXPECT_EQ(count("[model]\n"), 2U);  // states and derivative
}

TEST(ModelProject, AnOptionSetsWhatIsThere) {
  expect_told(complaints(mass_with("", ""), std::vector<Override>{{"--parameters", "kk=3 1/s^2"}}),
              "--parameters: \"kk\" is not a parameter of the model; there are k, one, s");
  expect_told(complaints(mass_with("", ""), std::vector<Override>{{"--initial", ""}}),
              "--initial is \"\"; it must be NAME=VALUE");
}

TEST(ModelProject, AnOptionsExampleCanBeTyped) {
  for (const FieldInfo& field : fields_of(JobKind::simulate)) {
    if (field.option == "--input") {
      EXPECT_EQ(field.example, "'u=if(t < 1,0.5,0)'");
    } else if (field.option == "--limit") {
      EXPECT_EQ(field.example, "'u=3 N m'");
    }
  }
  EXPECT_EQ(complaints(mass_with("", ""), std::vector<Override>{{"--initial", "x=1 m, v=2 m/s"}}),
            "");
}

TEST(ModelProject, TomlSaysWhatStandsInQuotes) {
  expect_told(complaints("[model]\nx = a*b\n"), "formulas stand in quotes");
  expect_told(complaints("[model]\nstates = { θ = \"rad\" }\n"), "such a letter stands in quotes");
}

TEST(Simulate, AMechanismTakesAVoltageOverTime) {
  const std::string open = std::string(elevator) +
                           "[simulation]\nduration = \"2 s\"\ninitial = { position = \"10 cm\" }\n"
                           "input = { voltage = \"if(t < 1, 6, 0)\" }\n";
  const Simulation result = simulated(open);
  EXPECT_FALSE(result.closed_loop);
  EXPECT_EQ(result.duration, 2.0);
  const double v_final = 6.0 / 2.0;
  const double tau = 0.2 / 2.0;  // kA/kV; after 10 of them it is at speed, after 10 more at rest
  const double x = 0.1 + v_final * (1.0 - tau) + v_final * tau;
  EXPECT_NEAR(result.state_summary[0].final, x, 2e-3);
  EXPECT_NEAR(result.state_summary[1].max, v_final, 1e-3);
  EXPECT_NEAR(result.input_summary[0].energy, 36.0, 0.1);
  expect_told(complaints(std::string(elevator) +
                         "[simulation]\ninput = { voltage = \"6 m\", volts = \"1 V\" }\n"),
              "p.toml:7:21: simulation.input.voltage is \"6 m\"");
  expect_told(refusal(std::string(elevator) +
                      "[simulation]\ninput = { voltage = \"sqrt(1 - t)\" }\nduration = \"2 s\"\n"),
              "the input voltage of the model is nan at t = 1.0005 s");
  // Without an input it is left alone.
  const Simulation alone = simulated(std::string(elevator) +
                                     "[simulation]\nclosed_loop = false\ninitial = { velocity = "
                                     "\"1 m/s\" }\nduration = \"2 s\"\n");
  EXPECT_NEAR(alone.state_summary[0].final, tau, 1e-6);  // ∫ e^(-t/τ) dt
}

TEST(Simulate, AMechanismsLoopStartsWhereItIsTold) {
  const std::string loop = std::string(elevator) + "[profile]\ngoal = \"0.5 m\"\n[simulation]\n";
  const Simulation result =
      simulated(loop + "initial = { position = \"10 cm\" }\nduration = \"4 s\"\nstep = \"1 s\"\n");
  EXPECT_TRUE(result.closed_loop);
  EXPECT_EQ(result.series.find("position")->front(), 0.1);
  EXPECT_NEAR(result.duration, 4.0, 1e-12);
  EXPECT_NEAR(result.state_summary[0].final, 0.5, 5e-3);
  EXPECT_TRUE(has_note(result, "simulation.step"));
  EXPECT_TRUE(has_note(simulated(loop + "closed_loop = true\ninput = { voltage = \"1 V\" }\n"),
                       "simulation.input"));
}

TEST(Simulate, WhatIsOfTheOtherLoopIsNoted) {
  EXPECT_TRUE(
      has_note(simulated(mass_with("", "[simulation]\nnoise = { x = \"1 mm\" }\n")), "noise"));
  const std::string closed = mass_with(
      "", "[simulation]\nclosed_loop = true\nduration = \"1 s\"\ninput = { u = \"1 m/s^2\" }\n");
  const Simulation result = simulated(closed);
  EXPECT_TRUE(has_note(result, "simulation.input"));
  const Answer answer = answer_of(result);
  EXPECT_NE(answer.json.find("simulation.input is of an open loop"), std::string::npos);
}

TEST(Simulate, AnOpenLoopStartsAtTheEquilibriumThatWasFound) {
  // v' = u + k (1 m) - k x: still at x = 1 m.
  const Simulation result = simulated(
      mass_with(" + k*(one - x)", "[point]\nat = { x = \"0.8 m\" }\nfind_equilibrium = true\n"));
  EXPECT_NEAR(result.series.find("x")->front(), 1.0, 1e-9);
  EXPECT_NEAR(result.state_summary[0].final, 1.0, 1e-9);
  const Simulation moved =
      simulated(mass_with(" + k*(one - x)",
                          "[point]\nat = { x = \"0.8 m\" }\nfind_equilibrium = true\n"
                          "[simulation]\ninitial = { v = \"1 m/s\" }\n"));
  EXPECT_NEAR(moved.series.find("x")->front(), 1.0, 1e-9);
  EXPECT_EQ(moved.series.find("v")->front(), 1.0);
}

TEST(Simulate, AnEquilibriumFarAwayIsNotNear) {
  // At 90° the Jacobian is singular but for rounding.
  const std::string text =
      "[model]\nstates = { a = \"rad\", w = \"rad/s\" }\ninputs = { u = \"1/s^2\" }\n"
      "parameters = { k = \"1 1/s^2\" }\n[model.derivative]\na = \"w\"\nw = \"-k*sin(a) + u\"\n"
      "[point]\nat = { a = \"90 deg\" }\n[simulation]\nclosed_loop = true\n";
  expect_told(refusal(text), "near it is one at a = 1.571 rad, w = 0 rad/s with u = 1 1/s^2");
}

TEST(Simulate, AnEquilibriumThatTheInputsMustMakeIsTold) {
  const std::string told = refusal(
      "[model]\nstates = { x = \"m\" }\ninputs = { u = \"m/s\" }\nparameters = { c = \"1 m/s\" }\n"
      "[model.derivative]\nx = \"c + u\"\n[point]\nfind_equilibrium = true\n"
      "[simulation]\nclosed_loop = true\n");
  expect_told(told, "with other inputs one is at x = 0 m with u = -1 m/s");
}

constexpr const char* to_the_left =
    "[controller]\nperiod = \"10 ms\"\nreference = { x = \"-2 m\" }\n"
    "[simulation]\nclosed_loop = true\nduration = \"10 s\"\n";

TEST(Simulate, ADerivativeThatIsNoNumberInALoopIsNamedWithItsTime) {
  // It is still a number where it begins, and none left of -1 m.
  const std::string told = refusal(mass_with(" + 0*k*sqrt(x*one + one^2)", to_the_left));
  expect_told(told, "simulate: the derivative of v of the model is nan at t = ");
  EXPECT_EQ(told.find("u = 0)"), std::string::npos) << told;  // the loop's input, not the point's
}

TEST(Simulate, AnOutputThatIsNoNumberInALoopIsNamedWithItsTime) {
  const std::string told = refusal(mass_with(
      "", std::string("[model.outputs]\nx = \"x\"\ny = \"sqrt(x*one + one^2)\"\n") + to_the_left));
  expect_told(told, "simulate: the output of y of the model is nan at t = ");
}

TEST(Simulate, AStateThatRunsAwayIsNamedWithItsTime) {
  // x' = x²: x = 1/(1 - t).
  const std::string told = refusal(
      "[model]\nstates = { x = \"1\" }\nparameters = { k = \"1 1/s\" }\n[model.derivative]\n"
      "x = \"k*x^2\"\n[simulation]\ninitial = { x = 1 }\nduration = \"2 s\"\n");
  expect_told(told, "the state x is ");
  expect_told(told, " at t = 1 s, where it changes faster than steps can follow");
}

TEST(Simulate, WhatTakesTooLongIsRefusedInThePersonsWords) {
  const std::string told = refusal(
      mass_with(" - 1e6*k*x", "[simulation]\ninitial = { x = \"1 m\" }\nduration = \"1e9 s\"\n"));
  expect_told(told, "the end of the simulation is not reached");
  expect_told(told, "simulation.accuracy");
  expect_told(refusal(mass_with("",
                                "[controller]\nperiod = \"1 s\"\n[simulation]\n"
                                "closed_loop = true\nduration = \"0.5 s\"\n")),
              "at least a period of the controller, 1 s");
  expect_told(
      refusal(mass_with("",
                        "[controller]\nperiod = \"10 ms\"\ndelay = \"100 s\"\n[simulation]\n"
                        "closed_loop = true\nduration = \"1 s\"\n")),
      "design: controller.delay is 100 s; it must be in [0, 2.5]");
}

}  // namespace
}  // namespace flyball::study::simulate_test
