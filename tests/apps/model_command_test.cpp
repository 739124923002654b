// Models by formula on the command line: simulated, analysed, regulated, fitted.
#include <cmath>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::model_command_test {
namespace {

using Json = nlohmann::json;

TEST_F(Command, SimulatesAModelByFormula) {
  const Answer words = run("simulate " + example("pendulum.toml") + " --out report");
  ASSERT_EQ(words.status, 0) << words.err;
  EXPECT_TRUE(holds(words.out, "theta")) << words.out;
  EXPECT_TRUE(holds(contents(work() / "report/data/simulation.csv"), "omega"));
  const Answer answer = run("simulate " + example("pendulum.toml") + " --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const Json json = Json::parse(answer.out);
  EXPECT_EQ(json.at("schema"), "flyball.simulate/1");
  EXPECT_EQ(json.at("loop"), "closed");
  EXPECT_NEAR(json.at("states")[0].at("final").get<double>(), 3.14159265, 1e-3);
  EXPECT_LE(json.at("inputs")[0].at("max").get<double>(), 6.0);
}

TEST_F(Command, SimulatesAnOpenLoopFromOptions) {
  write("p.toml",
        "[model]\nstates = { x = \"m\" }\ninputs = { v = \"m/s\" }\n[model.derivative]\nx = "
        "\"v\"\n");
  const Answer answer =
      run("simulate p.toml --json --duration 2s --input 'v=if(t < 1, 0.5, 0)' --initial x=10cm");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const Json json = Json::parse(answer.out);
  EXPECT_NEAR(json.at("states")[0].at("final").get<double>(), 0.6, 1e-6);
  EXPECT_EQ(json.at("loop"), "open");
  EXPECT_NEAR(json.at("inputs")[0].at("energy").get<double>(), 0.25, 1e-3);
}

TEST_F(Command, SimulatesAMechanism) {
  const Answer closed = run("simulate " + example("elevator.toml") + " --json");
  ASSERT_EQ(closed.status, 0) << closed.err;
  EXPECT_EQ(Json::parse(closed.out).at("loop"), "closed");
  const Answer open =
      run("simulate " + example("elevator.toml") + " --json --input voltage=6V --duration 1s");
  ASSERT_EQ(open.status, 0) << open.err;
  EXPECT_GT(Json::parse(open.out).at("states")[0].at("final").get<double>(), 0.1);
  const Answer wrong = run("simulate " + example("elevator.toml") + " --input volts=6V");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_TRUE(holds(wrong.err, "\"volts\" is not an input; there are voltage")) << wrong.err;
}

TEST_F(Command, RefusesOptionsOfAMechanismForAModel) {
  for (const char* command : {"simulate", "analyze", "design"}) {
    const Answer answer =
        run(std::string(command) + " " + example("pendulum.toml") + " --mass 3kg");
    EXPECT_EQ(answer.status, 2) << command;
    EXPECT_TRUE(holds(answer.err, "--mass is for a mechanism")) << answer.err;
  }
}

TEST_F(Command, AnalysesAndRegulatesAModelByFormula) {
  const Answer analysis = run("analyze " + example("cart_pole.toml") + " --json");
  ASSERT_EQ(analysis.status, 0) << analysis.err;
  const Json model = Json::parse(analysis.out);
  EXPECT_EQ(model.at("stability"), "unstable");
  EXPECT_EQ(model.at("states")[1], Json({{"name", "theta"}, {"unit", "rad"}}));
  EXPECT_TRUE(model.at("point").at("is_equilibrium").get<bool>());
  const Answer design = run("design " + example("cart_pole.toml") + " --json");
  ASSERT_EQ(design.status, 0) << design.err;
  const Json json = Json::parse(design.out);
  EXPECT_EQ(json.at("schema"), "flyball.design_model/2");
  EXPECT_EQ(json.at("K")[0].size(), 4U);
  EXPECT_EQ(json.at("kalman_gain").size(), 4U);
  EXPECT_NEAR(json.at("simulation").at("states")[0].at("final").get<double>(), 0.5, 0.02);
  const Answer words = run("design " + example("cart_pole.toml"));
  EXPECT_TRUE(holds(words.out, "Operating point")) << words.out;
}

constexpr const char* lag =
    "[model]\nname = \"lag\"\nstates = { x = \"m\" }\ninputs = { u = \"1\" }\n"
    "parameters = { gain = \"1 m\", lag = \"0.2 s\" }\n"
    "[model.derivative]\nx = \"(gain*u - x)/lag\"\n"
    "[fit]\nchannels = { u = \"command\" }\nvalidation_from = \"6 s\"\n"
    "free = { gain = \"0 .. 10 m\", lag = \"1 ms .. 10 s\" }\n";

/// What a lag of 0.5 s with a gain of 2 m does with a square wave, every 20 ms.
/// @param clock  Whether the rows have a time.
std::string lag_table(bool clock) {
  std::string table = std::string(clock ? "time (s)," : "") + "command,x (mm)\n";
  double x = 0.0;
  for (int k = 0; k < 400; ++k) {
    const double u = k / 40 % 2 == 0 ? 1.0 : -0.5;
    table += (clock ? std::to_string(0.02 * k) + "," : "") + std::to_string(u) + "," +
             std::to_string(1000.0 * x) + "\n";
    x += (2.0 * u - x) * (1.0 - std::exp(-0.02 / 0.5));
  }
  return table;
}

TEST_F(Command, FitsAModelByFormulaToALog) {
  write("lag.toml", lag);
  write("lag.csv", lag_table(true));
  const Answer words = run("identify lag.csv lag.toml --out report");
  ASSERT_EQ(words.status, 0) << words.err;
  EXPECT_TRUE(holds(words.out, "kept aside")) << words.out;
  EXPECT_TRUE(holds(contents(work() / "report/data/validation.csv"), "simulated_x"));
  const Answer answer = run("identify lag.csv lag.toml --json --starts 3 --start-seed 4");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const Json json = Json::parse(answer.out);
  EXPECT_EQ(json.at("schema"), "flyball.identify_model/1");
  EXPECT_NEAR(json.at("parameters")[0].at("value").get<double>(), 2.0, 1e-5);
  EXPECT_NEAR(json.at("parameters")[1].at("value").get<double>(), 0.5, 1e-5);
  EXPECT_EQ(json.at("search").at("start_costs").size(), 3U);
  EXPECT_EQ(json.at("validation").size(), 1U);
  const Answer started = run("identify lag.csv lag.toml --json --parameters gain=3m,lag=1s");
  ASSERT_EQ(started.status, 0) << started.err;
  EXPECT_NEAR(Json::parse(started.out).at("parameters")[1].at("value").get<double>(), 0.5, 1e-5);
}

TEST_F(Command, FitsAModelToATableWithoutTime) {
  write("lag.toml", lag);
  write("lag.csv", lag_table(false));
  const Answer wrong = run("identify lag.csv lag.toml");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_TRUE(holds(wrong.err, "[fit] period = \"20 ms\"")) << wrong.err;
  const Answer answer = run("identify lag.csv lag.toml --json --row-period 20ms");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_NEAR(Json::parse(answer.out).at("parameters")[1].at("value").get<double>(), 0.5, 1e-5);
}

// Equations 12.4 to 12.6 of a curve at 12 V, with the header of a dynamometer.
TEST_F(Command, FindsAMotorsConstantsInItsCurve) {
  std::string table =
      "Speed (RPM),Torque (N\xB7m),Current (A),Supplied Power (W),Efficiency (%)\r\n";
  for (int row = 0; row <= 20; ++row) {
    const double share = row / 20.0;
    const double current = 133.0 + (2.7 - 133.0) * share;
    table += std::to_string(5310.0 * share) + "," + std::to_string(2.42 * (1.0 - share)) + "," +
             std::to_string(current) + "," + std::to_string(12.0 * current) + ",1\r\n";
  }
  write("cim-motor-curve.csv", table);
  const Answer answer = run("motor-curves cim-motor-curve.csv --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const Json file = Json::parse(answer.out).at("files")[0];
  EXPECT_EQ(file.at("motor"), "CIM");
  EXPECT_NEAR(file.at("voltage").get<double>(), 12.0, 1e-6);
  EXPECT_NEAR(file.at("R").at("value").get<double>(), 12.0 / 133.0, 1e-8);
  EXPECT_NEAR(file.at("Kt").at("value").get<double>(), 2.42 / 133.0, 1e-8);
  EXPECT_NEAR(file.at("free_speed").get<double>(), 556.0619, 1e-3);
  EXPECT_TRUE(holds(run("motor-curves cim-motor-curve.csv").out, "straight lines"));
  write("power.csv", "Time,Current (A),Power Output (W)\n0,83,374\n1,82,370\n2,80,365\n");
  const Answer refused = run("motor-curves power.csv");
  EXPECT_EQ(refused.status, 2);
  EXPECT_TRUE(holds(refused.err, "power.csv: a column of torque is not there")) << refused.err;
  EXPECT_EQ(run("motor-curves nothing.csv").status, 2);
  write("words.csv", "a,b\nx,y\nz,w\n");
  EXPECT_EQ(run("motor-curves words.csv").status, 2);
  EXPECT_EQ(run("motor-curves cim-motor-curve.csv --voltage -1").status, 2);
}

TEST_F(Command, RefusesWhatAFitOfAModelCannotUse) {
  write("lag.toml", lag);
  write("lag.csv", lag_table(true));
  const auto refused = [&](const std::string& arguments, std::string_view sentence) {
    const Answer answer = run("identify lag.csv " + arguments);
    EXPECT_EQ(answer.status, 2) << arguments;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    EXPECT_TRUE(holds(answer.err, sentence)) << answer.err;
  };
  refused("lag.toml --mechanism elevator", "--mechanism is for a mechanism");
  refused("lag.toml --hold square", "held, linear, cubic");
  refused("lag.toml --starts 0", "starts");
  refused("lag.toml --validation-from 9s", "the log has it from 0 ms to 7.98 s");
  refused("lag.toml --parameters gian=3m", "gian");
  refused("none.toml", "none.toml");
  write("mechanism.toml", "[mechanism]\ntype = \"elevator\"\n[fit]\nstarts = 3\n");
  refused("mechanism.toml", "fit");
  const Answer json = run("identify lag.csv lag.toml --json --validation-from 9s");
  EXPECT_EQ(json.status, 2);
  EXPECT_EQ(Json::parse(json.out).at("schema"), "flyball.identify_model/1");
}

TEST_F(Command, TellsAllMistakesOfAModelByFormula) {
  write("p.toml",
        "[model]\nstates = { theta = \"rad\", omega = \"rad/s\" }\n[model.derivative]\ntheta = "
        "\"omgea\"\nomega = \"-sin(thta)\"\n");
  for (const char* command : {"simulate", "analyze", "design"}) {
    const Answer answer = run(std::string(command) + " p.toml");
    EXPECT_EQ(answer.status, 2) << command;
    EXPECT_TRUE(holds(answer.err, "p.toml:4:10: ")) << answer.err;
    EXPECT_TRUE(holds(answer.err, "p.toml:5:15: ")) << answer.err;
    EXPECT_TRUE(holds(answer.err, "              ^^^^")) << answer.err;
    EXPECT_FALSE(holds(answer.err, "offset")) << answer.err;
    EXPECT_TRUE(answer.out.empty());
  }
}

}  // namespace
}  // namespace flyball::test::model_command_test
