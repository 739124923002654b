// A model by formula in a project file: what it says, and every way to write it wrongly.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/study/answer.hpp>
#include <flyball/study/simulate.hpp>

namespace flyball::study::model_project_test {
namespace {

const std::string pendulum = R"([model]
name = "pendulum"
states = { theta = "rad", omega = "rad/s" }
inputs = { u = "N m" }
parameters = { g = "9.81 m/s^2", l = "50 cm", m = "2 kg" }
[model.definitions]
J = "m*l^2"
[model.derivative]
theta = "omega"
omega = "-g/l*sin(theta) + u/J"
)";

/// The text with one part replaced.
std::string with(std::string text, std::string_view part, std::string_view other) {
  const std::size_t at = text.find(part);
  EXPECT_NE(at, std::string::npos) << part;
  return at == std::string::npos ? text : text.replace(at, part.size(), other);
}

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

std::size_t number_of_complaints(const std::string& text) {
  const auto project = parse_project(text, "p.toml");
  return project ? 0 : project.error().all().size();
}

Project read(const std::string& text, std::span<const Override> overrides = {}) {
  auto project = parse_project(text, "p.toml", overrides);
  EXPECT_TRUE(project) << complaints(text, overrides);
  return project ? *std::move(project) : Project{};
}

TEST(ModelProject, SaysWhatTheModelIs) {
  const Project project = read(pendulum + R"([point]
at = { theta = "180 deg", u = "0.5 N m" }
[controller]
period = "10 ms"
tolerance = { u = "3 N m", theta = "5 deg", omega = "1 rad/s" }
limit = { u = "600 N cm" }
[simulation]
duration = "5 s"
initial = { theta = "10 deg" }
noise = { theta = "0.1 deg" }
)");
  ASSERT_TRUE(project.model_job);
  const ModelJob& job = *project.model_job;
  const ModelDescription description = job.model.description();
  EXPECT_EQ(labels(description.states), (std::vector<std::string>{"theta (rad)", "omega (rad/s)"}));
  EXPECT_TRUE(description.states[0].is_angle);
  EXPECT_FALSE(description.states[1].is_angle);
  EXPECT_EQ(label(description.inputs[0]), "u (N m)");
  EXPECT_EQ(description.parameters[1].value, 0.5);
  EXPECT_DOUBLE_EQ(job.x(0), std::numbers::pi);
  EXPECT_EQ(job.u(0), 0.5);
  EXPECT_EQ(job.state_tolerance.size(), 2U);
  EXPECT_DOUBLE_EQ(job.state_tolerance[0], std::numbers::pi / 36);
  EXPECT_EQ(job.input_tolerance, std::vector<double>{3.0});
  EXPECT_DOUBLE_EQ(job.limit(0), 6.0);
  EXPECT_EQ(job.run.duration, 5.0);
  EXPECT_DOUBLE_EQ(job.run.initial(0), std::numbers::pi / 18);
  EXPECT_TRUE(std::isnan(job.run.initial(1)));  // the point's
  EXPECT_TRUE(job.outputs_are_states);
  // The inputs stay those of the point.
  EXPECT_EQ(job.run.input(1.0)(0), 0.5);
  // f(10°, 0; u = 1) by hand: -g/l sin(10°) + 1/(2 · 0.25).
  Eigen::VectorXd u(1);
  u << 1.0;
  EXPECT_DOUBLE_EQ(job.model.derivative(job.run.initial, u)(1),
                   -9.81 / 0.5 * std::sin(std::numbers::pi / 18) + 2.0);
}

TEST(ModelProject, OptionsStandInPlaceOfTheFile) {
  const std::vector<Override> given{{"--parameters", "l=1 m,m=1 kg"},
                                    {"--input", "u=if(t < 1, 0.5, 0)"},
                                    {"--initial", "theta=90deg,omega=0"}};
  const Project project = read(pendulum, given);
  EXPECT_EQ(project.model_job->model.description().parameters.size(), 3U);
  EXPECT_EQ(project.model_job->run.input(0.5)(0), 0.5);
  EXPECT_EQ(project.model_job->run.input(1.5)(0), 0.0);
  EXPECT_DOUBLE_EQ(project.model_job->run.initial(0), std::numbers::pi / 2);
  const std::string wrong =
      complaints(pendulum, std::vector<Override>{{"--initial", "thta=1 rad"}});
  EXPECT_NE(wrong.find("--initial: \"thta\" is not a state; did you mean \"theta\"?"),
            std::string::npos)
      << wrong;
}

struct Wrong {
  std::string_view part;   // of the file
  std::string_view other;  // in its place
  std::string_view place;
  std::string_view says;
};

TEST(ModelProject, EveryMistakeIsToldWithItsPlace) {
  const std::vector<Wrong> all{
      {"sin(theta)", "sin(thta)", "p.toml:10:19: ", "did you mean \"theta\"?"},
      {"sin(theta)", "sin(theta, 1)", "p.toml:10:", "sin"},
      {"sin(theta)", "sin(g)", "p.toml:10:", "m/s^2"},
      {"u/J", "u", "p.toml:10:", "must be in one unit"},
      {"\"omega\"\n", "\"theta\"\n", "p.toml:9:10: ", "must be in rad/s"},
      {"omega = \"-g", "omeg = \"-g", "p.toml:10:1: ", "did you mean \"omega\"?"},
      {"theta = \"omega\"\n", "", "p.toml:8:", "model.derivative.theta is missing"},
      {"g = \"9.81", "u = \"9.81", "p.toml:5:16: ", "\"u\" is given to two"},
      {"omega = \"rad/s\"", "omega = \"\"", "p.toml:3:35: ", "without a unit"},
      {"omega = \"rad/s\"", "omega = \"rda/s\"", "p.toml:3:35: ", "rda"},
      {"J = \"m*l^2\"", "J = \"K\"\nK = \"m*l^2\"", "p.toml:7:6: ", "\"K\""},
      {"J = \"m*l^2\"", "J = \"m*l^2 + J\"", "p.toml:7:14: ", "\"J\""},
      {"m = \"2 kg\"", "m = nan", "p.toml:5:", "parameters.m"},
      {"m = \"2 kg\"", "m = \"two kg\"", "p.toml:5:", "parameters.m"},
      {"m = \"2 kg\"", "m = true", "p.toml:5:", "must be a text in quotes"},
      {"[model.definitions]", "angles = [\"phi\"]\n[model.definitions]",
       "p.toml:6:10: ", "\"phi\" is not a state"},
      {"u/J", "u/J)", "p.toml:10:", "parenthesis"},
  };
  for (const Wrong& wrong : all) {
    const std::string told = complaints(with(pendulum, wrong.part, wrong.other));
    EXPECT_NE(told.find(wrong.place), std::string::npos) << wrong.other << ":\n" << told;
    EXPECT_NE(told.find(wrong.says), std::string::npos) << wrong.other << ":\n" << told;
    EXPECT_EQ(told.find('^') == std::string::npos, wrong.other.empty()) << told;
  }
}

TEST(ModelProject, ValuesAreCheckedAgainstTheirUnits) {
  const std::vector<std::pair<std::string, std::string>> all{
      {"[point]\nat = { theta = \"1 m\" }", "in m; it must be in rad"},
      {"[point]\nat = { theta = 0.1 }", "0.1, without a unit"},
      {"[point]\nat = { phi = \"1 rad\" }", "\"phi\" is not a state or an input"},
      {"[controller]\ntolerance = { theta = \"0 rad\", omega = \"1 rad/s\", u = \"1 N m\" }",
       "greater than zero"},
      {"[controller]\ntolerance = { theta = \"1 rad\", u = \"1 N m\" }",
       "controller.tolerance.omega is missing"},
      {"[controller]\nstate_tolerance = [\"1 rad\", \"1 rad/s\"]", "for a mechanism"},
      {"[controller]\nmax_voltage = \"12 V\"", "for a mechanism"},
      {"[controller]\nlimit = { theta = \"1 rad\" }", "not an input"},
      {"[mechanism]\ntype = \"elevator\"", "[model] or [mechanism], not both"},
      {"[simulation]\ninput = { u = \"2\" }", "without a unit"},
      {"[simulation]\ninput = { u = \"2 V\" }", "must be in"},
      {"[simulation]\ninput = { u = \"sin(tt)\" }", "\"tt\""},
      {"[simulation]\ninput = { u = \"m*g\" }", "must be in N m"},
      {"[simulation]\nnoise = { phi = \"1 rad\" }", "not an output"},
      {"[simulation]\ninitial = [1, 2]", "must be a table such as"},
  };
  for (const auto& [more, says] : all) {
    const std::string told = complaints(pendulum + more + "\n");
    EXPECT_NE(told.find(says), std::string::npos) << more << ":\n" << told;
    EXPECT_EQ(number_of_complaints(pendulum + more + "\n"), 1U) << told;
  }
}

TEST(ModelProject, AllMistakesAreToldInOneRun) {
  std::string text = with(pendulum, "sin(theta)", "sin(thta)");
  text = with(text, "theta = \"omega\"", "theta = \"omgea\"");
  text = with(text, "m = \"2 kg\"", "m = \"2 kgg\"");
  text += "[point]\nat = { theta = \"1 m\" }\n[controler]\n";
  const std::string told = complaints(text);
  for (const char* part : {"p.toml:5:", "kgg", "p.toml:9:10: ", "omgea", "p.toml:10:19: ", "thta",
                           "p.toml:12:", "controler"}) {
    EXPECT_NE(told.find(part), std::string::npos) << part << " in\n" << told;
  }
  EXPECT_EQ(number_of_complaints(text), 5U) << told;
}

TEST(ModelProject, AMistakeIsMarkedWhereItStands) {
  EXPECT_NE(complaints(with(pendulum, "sin(theta)", "sin(thta)"))
                .find("   10 | omega = \"-g/l*sin(thta) + u/J\"\n"
                      "      |                   ^^^^\n"),
            std::string::npos)
      << complaints(with(pendulum, "sin(theta)", "sin(thta)"));
  // Of a text over several lines the formula is shown.
  const std::string told = complaints(
      with(pendulum, "\"-g/l*sin(theta) + u/J\"", "\"\"\"-g/l*sin(theta)\n + u/JJ\"\"\""));
  EXPECT_NE(told.find("JJ"), std::string::npos);
}

TEST(ModelProject, OtherCommandsSayThatTheyNeedAMechanism) {
  EXPECT_TRUE(read(pendulum).plant_error);
  const std::string nothing = complaints("[controller]\nperiod = \"10 ms\"\n");
  EXPECT_NE(nothing.find("[model] and formulas"), std::string::npos) << nothing;
}

/// The example and the compiled model are one, by values and by Jacobians.
void expect_equal(const std::string& example, const AnyModel& compiled, const Eigen::VectorXd& x,
                  const Eigen::VectorXd& u) {
  const auto project = read_project(std::string(FLYBALL_DOCS "/../examples/") + example);
  ASSERT_TRUE(project) << to_string(project.error());
  const AnyModel& formula = project->model_job->model;
  EXPECT_LT((formula.derivative(x, u) - compiled.derivative(x, u)).lpNorm<Eigen::Infinity>(),
            1e-14);
  const auto jacobians = [&](const AnyModel& model) {
    Eigen::MatrixXd A(x.size(), x.size());
    Eigen::MatrixXd B(x.size(), u.size());
    model.jacobians(x, u, A, B);
    A.conservativeResize(Eigen::NoChange, x.size() + u.size());
    A.rightCols(u.size()) = B;
    return A;
  };
  EXPECT_LT((jacobians(formula) - jacobians(compiled)).lpNorm<Eigen::Infinity>(),
            1e-14 * jacobians(compiled).lpNorm<Eigen::Infinity>());
}

TEST(ModelProject, TheExamplesAreTheCompiledModels) {
  Eigen::VectorXd u(1);
  u << 1.3;
  expect_equal("pendulum.toml",
               mechanisms::Pendulum{.mass = 2.0, .length = 0.5, .damping = 0.02, .gravity = 9.81},
               Eigen::Vector2d(2.5, -0.7), u);
  expect_equal(
      "cart_pole.toml",
      mechanisms::CartPole{.cart_mass = 5.0, .pole_mass = 0.5, .pole_length = 0.5, .gravity = 9.81},
      Eigen::Vector4d(0.3, 2.9, -0.4, 1.7), u);
}

// Ten small swings of a linear pendulum, θ'' = -ω₀² θ: cos ω₀t, energy is kept.
TEST(Simulate, AnOpenLoopIsAccurate) {
  const Project project = read(with(pendulum, "sin(theta)", "theta") +
                               "[simulation]\nduration = \"10 s\"\ninitial = { theta = \"0.1 rad\" "
                               "}\naccuracy = 1e-12\n");
  const auto result = simulate(project);
  ASSERT_TRUE(result) << to_string(result.error());
  const std::vector<double>& theta = *result->series.find("theta");
  const std::vector<double>& time = result->series.time();
  ASSERT_EQ(theta.size(), 1001U);
  for (std::size_t k = 0; k < theta.size(); ++k) {
    EXPECT_NEAR(theta[k], 0.1 * std::cos(std::sqrt(9.81 / 0.5) * time[k]), 1e-8);
  }
  EXPECT_FALSE(result->closed_loop);
  EXPECT_EQ(result->input_summary[0].energy, 0.0);
}

TEST(Simulate, ADerivativeThatIsNoNumberIsNamedWithItsTime) {
  const auto refusal = [](const std::string& omega) {
    const Project project = read(with(pendulum, "-g/l*sin(theta) + u/J", omega) +
                                 "[simulation]\nduration = \"5 s\"\ninput = { u = \"-1 N m\" }\n");
    const auto result = simulate(project);
    return result ? std::string() : to_string(result.error());
  };
  const std::string at_start = refusal("u/J*sqrt(u)/sqrt(u)");
  EXPECT_NE(at_start.find("derivative of omega of the model is nan at t = 0 s"), std::string::npos)
      << at_start;
  // From rest with u = -1: it reaches theta = -1 after about a second.
  const std::string later = refusal("u/J*sqrt(theta + 1)/sqrt(theta + 1)");
  EXPECT_NE(later.find("omega"), std::string::npos) << later;
}

const std::string upright = R"([point]
at = { theta = "180 deg" }
[controller]
period = "10 ms"
tolerance = { theta = "5 deg", omega = "1 rad/s", u = "3 N m" }
limit = { u = "6 N m" }
)";

TEST(Simulate, AClosedLoopHoldsThePoint) {
  const Project project = read(pendulum + upright +
                               "[simulation]\nclosed_loop = true\nduration = \"3 s\"\ninitial = { "
                               "theta = \"165 deg\" }\n");
  const auto result = simulate(project);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_NEAR(result->state_summary[0].final, std::numbers::pi, 1e-3);
  ASSERT_TRUE(result->state_summary[0].settling_time);
  EXPECT_LT(*result->state_summary[0].settling_time, 2.0);
  EXPECT_LE(result->input_summary[0].max, 6.0);
  // The same to the last bit, and another seed another noise.
  EXPECT_EQ(answer_of(*simulate(project)).json, answer_of(*result).json);
  Project noisy = project;
  noisy.model_job->run.noise = {0.01, 0.0};
  const auto first = simulate(noisy);
  noisy.model_job->run.seed = 2;
  const auto second = simulate(noisy);
  EXPECT_NE(first->state_summary[0].final, second->state_summary[0].final);
}

TEST(DesignModel, BalancesWithAnObserver) {
  const Project project = read(pendulum + "[model.outputs]\nangle = \"theta\"\n" + upright);
  const auto result = design_model(*project.model_job);
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->regulator.observer);
  EXPECT_EQ(result->regulator.kalman_gain.rows(), 2);
  EXPECT_LT(result->regulator.poles.cwiseAbs().maxCoeff(), 1.0);
  EXPECT_LT(result->regulator.estimator_poles.cwiseAbs().maxCoeff(), 1.0);
  ASSERT_TRUE(result->regulator.margins);
  EXPECT_TRUE(result->regulator.margins->stable);
  EXPECT_NEAR(result->simulation.state_summary[0].final, std::numbers::pi, 1e-2);
  // About the top gravity pushes away: ∂ω'/∂θ = +g/l.
  EXPECT_NEAR(result->regulator.linear.A(1, 0), 9.81 / 0.5, 1e-12);
}

// The poles are of the loop as it runs, as of a mechanism: with observer and delay the slowest is
// what the simulated deviation decays with, whatever A - B K has.
TEST(DesignModel, TellsThePolesOfTheLoopThatRuns) {
  const std::string late = with(pendulum + "[model.outputs]\nangle = \"theta\"\n" + upright,
                                "period = \"10 ms\"", "period = \"10 ms\"\ndelay = \"60 ms\"");
  const auto hanging = with(late, "180 deg", "0 deg");
  const auto result = design_model(*read(hanging).model_job);
  ASSERT_TRUE(result) << to_string(result.error());
  const ModelRegulator& regulator = result->regulator;
  EXPECT_EQ(regulator.loop_poles.size(), 2 + 6 + 2);
  EXPECT_NEAR(std::abs(regulator.loop_poles(0)), regulator.margins->spectral_radius, 1e-9);
  EXPECT_NEAR(regulator.time_constant, -0.01 / std::log(std::abs(regulator.loop_poles(0))), 1e-9);
  const auto json = nlohmann::json::parse(answer_of(*result).json);
  EXPECT_EQ(json["poles"].size(), 10u);
  EXPECT_EQ(json["design_poles"].size(), 2u);
  EXPECT_EQ(json["time_constant"].get<double>(), regulator.time_constant);
}

TEST(DesignModel, APointThatIsNoEquilibriumIsRefusedWithOneThatIs) {
  const std::string aside = with(upright, "180 deg", "170 deg");
  const auto refused = design_model(*read(pendulum + aside).model_job);
  ASSERT_FALSE(refused);
  const std::string said = to_string(refused.error());
  EXPECT_NE(said.find("not an equilibrium: omega changes by -3.407 rad/s²"), std::string::npos)
      << said;
  EXPECT_NE(said.find("theta = 3.142 rad"), std::string::npos) << said;
  const auto found = design_model(
      *read(pendulum + with(aside, "[controller]", "find_equilibrium = true\n[controller]"))
           .model_job);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->regulator.point.x(0), std::numbers::pi, 1e-9);
}

TEST(AnalyzeModel, IsLinearizedAboutItsPoint) {
  const auto model = parse_model(pendulum + upright, "p.toml");
  ASSERT_TRUE(model) << to_string(model.error());
  const auto analysis = analyze(*model);
  ASSERT_TRUE(analysis) << to_string(analysis.error());
  // λ² = g/l
  EXPECT_EQ(analysis->modes.stability, Stability::unstable);
  EXPECT_NEAR(analysis->modes.modes[0].pole.real(), std::sqrt(9.81 / 0.5), 1e-9);
  EXPECT_TRUE(model->notes.empty());
  const auto aside = parse_model(pendulum + "[point]\nat = { theta = \"10 deg\" }\n", "p.toml");
  ASSERT_TRUE(aside);
  ASSERT_EQ(aside->notes.size(), 1U);
  EXPECT_NE(aside->notes[0].message.find("near it is one at theta = 0 rad"), std::string::npos)
      << aside->notes[0].message;
}

TEST(AnalyzeModel, NothingToActWithIsNamed) {
  const auto model =
      parse_model(with(with(pendulum, "inputs = { u = \"N m\" }\n", ""), " + u/J", ""), "p.toml");
  ASSERT_FALSE(model);
  EXPECT_NE(to_string(model.error()).find("model.inputs is empty"), std::string::npos)
      << to_string(model.error());
}

}  // namespace
}  // namespace flyball::study::model_project_test
