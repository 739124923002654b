#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::command_test {
namespace {

using Json = nlohmann::json;

TEST_F(Command, HelpAndVersion) {
  const Answer version = run("--version");
  EXPECT_EQ(version.status, 0);
  EXPECT_TRUE(version.out.starts_with("flyball "));
  for (const char* command : {"", "identify ", "design ", "tune ", "motors ", "book "}) {
    const Answer help = run(std::string(command) + "--help");
    EXPECT_EQ(help.status, 0) << command;
    EXPECT_TRUE(holds(help.out, "Usage")) << command;
    EXPECT_TRUE(help.err.empty()) << command;
  }
}

TEST_F(Command, MistypedCommandsAndOptions) {
  const Answer command = run("tun log.json");
  EXPECT_EQ(command.status, 2);
  EXPECT_TRUE(holds(command.err, "did you mean \"tune\"?"));
  EXPECT_TRUE(command.out.empty());
  EXPECT_EQ(run("").status, 2);
  EXPECT_EQ(run("tune").status, 2);
  EXPECT_EQ(run("tune log.json --perod 20ms").status, 2);
}

// The command's options are the fields of a project file.
TEST_F(Command, OptionsStandInPlaceOfTheFile) {
  const Answer help = run("design --help");
  EXPECT_TRUE(holds(help.out, "[controller]")) << help.out;
  EXPECT_TRUE(holds(help.out, "--max-voltage VOLTAGE")) << help.out;
  EXPECT_TRUE(holds(help.out, "Period of the control loop, such as 20ms [20 ms]")) << help.out;
  const std::string design = "design " + example("elevator.toml") + " --json ";
  const Answer answer = run(design + "--period 10ms --state-tolerance 1cm,0.5m/s --goal=-40cm");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const Json json = Json::parse(answer.out);
  EXPECT_EQ(json.at("period"), 0.01);
  EXPECT_EQ(json.at("weights").at("Q")[0][0], 10000.0);
  EXPECT_EQ(json.at("motion").at("goal"), -0.4);
  EXPECT_NE(Json::parse(run(design + "--mass 4kg").out).at("feedforward"),
            Json::parse(run(design).out).at("feedforward"));
}

TEST_F(Command, TellsWhatAProjectFileMaySay) {
  const Answer fields = run("design --fields");
  EXPECT_EQ(fields.status, 0) << fields.err;
  EXPECT_TRUE(holds(fields.out, "| `max_voltage` |"));
  const Answer schema = run("design --schema");
  EXPECT_EQ(schema.status, 0) << schema.err;
  EXPECT_TRUE(Json::parse(schema.out).at("properties").contains("controller"));
}

TEST_F(Command, IdentifyAnswersOneObject) {
  const Answer answer = run("identify " + example("logs/elevator.json") + " --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(answer.err.empty());
  EXPECT_EQ(answer.out.find('\n'), answer.out.size() - 1);
  const Json json = Json::parse(answer.out);
  EXPECT_EQ(json.at("schema"), "flyball.identify/1");
  EXPECT_EQ(json.at("mechanism"), "elevator");
  EXPECT_GT(json.at("gains").at("kV").at("value").get<double>(), 0.0);
  EXPECT_EQ(files(), 0U);
}

TEST_F(Command, TuneWritesTheSameReportTwice) {
  const std::string log = example("logs/elevator.json");
  const Answer first = run("tune " + log + " --out report");
  ASSERT_EQ(first.status, 0) << first.err;
  const std::string page = contents(work() / "report/index.html");
  const std::string result = contents(work() / "report/result.json");
  ASSERT_FALSE(page.empty());
  const Answer again = run("tune " + log + " --out report");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(contents(work() / "report/index.html"), page);
  EXPECT_EQ(contents(work() / "report/result.json"), result);
  EXPECT_EQ(files(), 1U);
  EXPECT_EQ(first.out, again.out);
}

// The page says how it was made, and nothing of the machine it was made on.
TEST_F(Command, AReportSaysWhatWasTyped) {
  std::filesystem::copy(FLYBALL_EXAMPLES "/elevator.toml", work() / "my lift.toml");
  const Answer answer =
      run("design '" + (work() / "my lift.toml").string() + "' --period=10ms --out report/");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const std::string page = contents(work() / "report/index.html");
  EXPECT_TRUE(holds(page, "flyball design &#39;my lift.toml&#39; --period=10ms --out report/") ||
              holds(page, "flyball design 'my lift.toml' --period=10ms --out report/"));
  EXPECT_FALSE(holds(page, work().string()));
}

TEST_F(Command, TheNextReportReplacesTheLast) {
  const std::string design = "design " + example("elevator.toml") + " --out report";
  ASSERT_EQ(run(design).status, 0);
  ASSERT_TRUE(std::filesystem::exists(work() / "report/ElevatorLoop.hpp"));
  std::ofstream(work() / "report/mine.txt") << "a person's\n";
  ASSERT_EQ(run("analyze " + example("elevator.toml") + " --out report").status, 0);
  EXPECT_FALSE(std::filesystem::exists(work() / "report/ElevatorLoop.hpp"));
  EXPECT_TRUE(std::filesystem::exists(work() / "report/mine.txt"));
}

TEST_F(Command, JsonWritesNoReportUnlessAsked) {
  const Answer answer = run("design " + example("elevator.toml") + " --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_EQ(Json::parse(answer.out).at("schema"), "flyball.design/2");
  EXPECT_EQ(files(), 0U);
}

TEST_F(Command, Motors) {
  const Answer all = run("motors");
  EXPECT_EQ(all.status, 0);
  EXPECT_TRUE(holds(all.out, "Kraken X60 FOC"));
  const Answer one = run("motors krakenX60 --json");
  EXPECT_EQ(Json::parse(one.out).at("motors").size(), 1U);
}

}  // namespace
}  // namespace flyball::test::command_test
