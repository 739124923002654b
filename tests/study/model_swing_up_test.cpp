// Swing-up and region of attraction of models by formula, from a project file alone.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/export/swing_up.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/simulate.hpp>

namespace flyball::study {
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
}  // namespace flyball::study
