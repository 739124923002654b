// Swing-up and region of attraction of models by formula, from a project file alone.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/export/swing_up.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/simulate.hpp>

#include "compiled.hpp"

namespace flyball::study::model_swing_up_test {
namespace {

constexpr double pi = std::numbers::pi;

const std::string pendulum = R"toml([model]
name = "pendulum"
states = { theta = "rad", omega = "rad/s" }
inputs = { u = "N m" }
parameters = { g = "9.81 m/s^2", l = "50 cm", m = "2 kg" }
[model.definitions]
J = "m*l^2"
[model.derivative]
theta = "omega"
omega = "-g/l*sin(theta) + u/J"
[point]
at = { theta = "180 deg" }
[controller]
period = "5 ms"
tolerance = { theta = "15 deg", omega = "2 rad/s", u = "1 N m" }
limit = { u = "3.9 N m" }
)toml";
const std::string swing_up = R"toml([swing_up]
energy = "J*omega^2/2 - m*g*l*cos(theta)"
)toml";

Project read(const std::string& text) {
  auto project = parse_project(text, "p.toml");
  EXPECT_TRUE(project) << to_string(project.error());
  return project ? *std::move(project) : Project{};
}

std::string complaint(const std::string& text) {
  const auto project = parse_project(text, "p.toml");
  return project ? "" : to_string(project.error());
}

// 0.4 m g l = 3.92 N m do not lift it: ± 9.81 J, E* = 9.81 J. It stands within 10 s.
TEST(ModelSwingUp, PendulumFromAFile) {
  const auto design = design_model(*read(pendulum + swing_up).model_job).value();
  ASSERT_TRUE(design.region && design.swing_up);
  const SwingUpRunResult& run = *design.swing_up;
  EXPECT_NEAR(run.energy, 9.81, 1e-12);
  EXPECT_NEAR(run.scale, 9.81, 1e-12);
  EXPECT_NEAR(std::cos(run.start(0)), 1.0, 1e-12);  // hanging
  ASSERT_TRUE(run.taken && run.stands);
  EXPECT_LT(*run.stands, 10.0);
  EXPECT_GE(*run.stands, *run.taken);
  EXPECT_GT(run.simulation.input_summary[0].saturated_fraction, 0.0);
  EXPECT_LE(run.simulation.input_summary[0].max, 3.9);
  // What is proven is what the law took over in, and the regulator's own try begins beside the
  // point.
  EXPECT_GT(design.region->certified.extent(0), 0.2);
  EXPECT_NEAR(design.simulation.state_summary[0].final, pi, 0.01);
  // The law's tape says what the input does: ∂E/∂ω /J = ω.
  std::vector<double> values(run.law.size());
  run.law.prepare<double>(run.parameters, values);
  std::array<double, 2> out{};
  run.law.evaluate<double>(std::array{0.3, 1.7, 0.0}, out, values);
  EXPECT_NEAR(out[0], 0.25 * 1.7 * 1.7 - 9.81 * std::cos(0.3), 1e-12);
  EXPECT_NEAR(out[1], 1.7, 1e-13);
}

TEST(ModelSwingUp, AnswerShowsIt) {
  const Answer answer = answer_of(design_model(*read(pendulum + swing_up).model_job).value());
  const auto json = nlohmann::json::parse(answer.json);
  EXPECT_EQ(json["region"]["limit"], "rate");
  EXPECT_GT(json["region"]["level"], 0.0);
  EXPECT_EQ(json["region"]["extent"].size(), 2u);
  EXPECT_LT(json["swing_up"]["stands"], 10.0);
  EXPECT_EQ(json["swing_up"]["simulation"]["loop"], "closed");
  const auto has_figure = [&](std::string_view name) {
    return std::any_of(answer.figures.begin(), answer.figures.end(),
                       [&](const Figure& figure) { return figure.name == name; });
  };
  EXPECT_TRUE(has_figure("region_of_attraction"));
  EXPECT_TRUE(has_figure("swing_up_states"));
  EXPECT_TRUE(has_figure("swing_up_inputs"));
  const auto file = std::find_if(answer.files.begin(), answer.files.end(),
                                 [](const AnswerFile& f) { return f.name == "swing_up.hpp"; });
  ASSERT_NE(file, answer.files.end());
  for (const std::string_view part :
       {"inline constexpr int states = 2;", "is_angle[states] = {true, false}", "class Controller",
        "// x[1]: omega (rad/s)", "inline constexpr double limit = 3.9;"}) {
    EXPECT_NE(file->contents.find(part), std::string::npos) << part;
  }
  // Without [swing_up] the region alone, because upright is not stable by itself.
  const auto alone = design_model(*read(pendulum).model_job).value();
  EXPECT_TRUE(alone.region);
  EXPECT_FALSE(alone.swing_up);
  // Hanging is, and nobody asked.
  std::string hanging = pendulum;
  hanging.replace(hanging.find("180 deg"), 7, "0 deg");
  EXPECT_FALSE(design_model(*read(hanging).model_job).value().region);
}

// The header, compiled, asks for what the law does: the energy's push, or K e within the region.
TEST(ModelSwingUp, TheHeaderRuns) {
  const auto design = design_model(*read(pendulum + swing_up).model_job).value();
  const Answer answer = answer_of(design);
  const auto file = std::find_if(answer.files.begin(), answer.files.end(),
                                 [](const AnswerFile& f) { return f.name == "swing_up.hpp"; });
  ASSERT_NE(file, answer.files.end());
  Random random(5);
  std::vector<Eigen::Vector2d> states;
  std::string input;
  for (int k = 0; k < 400; ++k) {
    states.emplace_back(k % 2 == 0 ? pi + random.uniform(-0.2, 0.2) : random.uniform(-4.0, 4.0),
                        (k % 2 == 0 ? 0.3 : 6.0) * random.normal());
    input += test::bits({states.back()(0), states.back()(1)});
  }
  const std::vector<double> out =
      test::run_compiled("swing_up.hpp", file->contents, 2,
                         "    swing_up::Controller law;\n    const double x[2] = {n[0], n[1]};\n"
                         "    const double u = law.calculate(x);\n"
                         "    std::printf(\"%a %d\\n\", u, law.balances() ? 1 : 0);\n",
                         input);
  ASSERT_EQ(out.size(), 2 * states.size());
  const CertifiedRegion& region = design.region->certified;
  int balanced = 0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const Eigen::VectorXd x = states[k];
    const bool balances = region.value(x) <= region.level;
    const Eigen::Vector2d e(std::remainder(pi - x(0), 2.0 * pi), -x(1));
    const double E = 0.25 * x(1) * x(1) - 9.81 * std::cos(x(0));
    const double missing = std::clamp(10.0 * (9.81 - E) / 9.81, -1.0, 1.0);
    const double wanted =
        balances ? design.regulator.K.row(0).dot(e) : 3.9 * missing * (x(1) < 0.0 ? -1.0 : 1.0);
    EXPECT_NEAR(out[2 * k], std::clamp(wanted, -3.9, 3.9), 1e-9) << k;
    EXPECT_EQ(out[2 * k + 1], balances ? 1.0 : 0.0) << k;
    balanced += balances ? 1 : 0;
  }
  EXPECT_GT(balanced, 50);
  EXPECT_LT(balanced, 350);
}

// What is no energy is told: ω² has no half. Friction is a loss, no lie; a pole's energy is kept
// while its cart is held.
TEST(ModelSwingUp, AnEnergyThatIsNoneIsTold) {
  const auto doubted = [](const std::string& text) {
    const auto design = design_model(*read(text).model_job).value();
    return std::any_of(design.regulator.diagnostics.begin(), design.regulator.diagnostics.end(),
                       [](const Diagnostic& d) { return d.code.starts_with("energy_not"); });
  };
  EXPECT_FALSE(doubted(pendulum + swing_up));
  EXPECT_TRUE(doubted(pendulum + "[swing_up]\nenergy = \"J*omega^2 - m*g*l*cos(theta)\"\n"));
  std::string rubbing = pendulum;
  rubbing.replace(rubbing.find("+ u/J"), 5, "- 0.1*omega/1.0 + u/J");
  rubbing.replace(rubbing.find("0.1*omega/1.0"), 13, "b*omega");
  rubbing.replace(rubbing.find("m = \"2 kg\""), 10, "m = \"2 kg\", b = \"0.05 1/s\"");
  EXPECT_FALSE(doubted(rubbing + swing_up));
  std::ifstream file(std::string(FLYBALL_EXAMPLES) + "/cart_pole_swing_up.toml");
  const std::string cart{std::istreambuf_iterator<char>(file), {}};
  EXPECT_FALSE(doubted(cart));
  EXPECT_NE(complaint("[model]\nstates = { x = \"m\" }\nparameters = { m = \"-2 kg\" }\n"
                      "[model.derivative]\nx = \"-x/m*m/1\"\n")
                .find("never negative"),
            std::string::npos);
}

// `simulate` with closed_loop runs the swing-up from simulation.initial.
TEST(ModelSwingUp, Simulate) {
  const auto result = simulate(read(pendulum + swing_up +
                                    "[simulation]\nclosed_loop = true\nduration = \"8 s\"\n"
                                    "initial = { theta = \"10 deg\" }\n"))
                          .value();
  EXPECT_TRUE(result.closed_loop);
  EXPECT_NEAR(result.series.find("theta")->front(), pi / 18.0, 1e-12);
  EXPECT_NEAR(std::cos(result.series.find("theta")->back()), -1.0, 1e-3);
}

TEST(ModelSwingUp, Errors) {
  EXPECT_NE(complaint(pendulum + "[swing_up]\nenergy = \"J*omega^2/2 + m*g*x\"\n")
                .find("\"x\" is not known"),
            std::string::npos);
  EXPECT_NE(complaint(pendulum + "[swing_up]\nenergy = \"J*omega + m*g*l\"\n"), "");  // units
  EXPECT_NE(complaint(pendulum + swing_up + "hold = { x = \"1 N\" }\n").find("x"),
            std::string::npos);
  EXPECT_NE(complaint(pendulum + swing_up + "hold = { theta = \"1 kg\" }\n"), "");
  EXPECT_EQ(complaint(pendulum + swing_up + "hold = { theta = \"1 N m/rad\" }\n"), "");
  EXPECT_NE(complaint(pendulum + swing_up + "reach = { theta = \"-1 rad\" }\n"), "");
  EXPECT_NE(complaint(pendulum + swing_up + "sharpness = -1\n"), "");
  // An energy that the angle does not change, and no limit to swing within.
  const auto flat =
      design_model(*read(pendulum + "[swing_up]\nenergy = \"J*omega^2/2\"\n").model_job);
  ASSERT_FALSE(flat);
  EXPECT_NE(to_string(flat.error()).find("an energy that the angles change"), std::string::npos);
  std::string free = pendulum;
  free.erase(free.find("limit = "), std::string("limit = { u = \"3.9 N m\" }\n").size());
  const auto unlimited = design_model(*read(free + swing_up).model_job);
  ASSERT_FALSE(unlimited);
  EXPECT_NE(to_string(unlimited.error()).find("controller.limit is missing"), std::string::npos);
}

}  // namespace
}  // namespace flyball::study::model_swing_up_test
