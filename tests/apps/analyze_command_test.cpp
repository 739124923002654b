#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "run.hpp"

namespace flyball::test::analyze_command_test {
namespace {

using Json = nlohmann::json;

class AnalyzeCommand : public Command {
 protected:
  /// Ends with status 2 and these words on standard error; with --json as one object, too.
  void expect_refused(const std::string& arguments, std::string_view code,
                      std::string_view words) const {
    const std::size_t before = files();
    const Answer answer = run("analyze " + arguments);
    EXPECT_EQ(answer.status, 2) << arguments << "\n" << answer.err;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    EXPECT_TRUE(answer.err.starts_with("flyball: ")) << answer.err;
    EXPECT_TRUE(holds(answer.err, words)) << arguments << "\n" << answer.err;
    const Answer json = run("analyze " + arguments + " --json");
    EXPECT_EQ(json.status, 2);
    const Json refusal = Json::parse(json.out, nullptr, false);
    ASSERT_FALSE(refusal.is_discarded()) << json.out;
    EXPECT_EQ(refusal.at("schema"), "flyball.analyze/2");
    EXPECT_EQ(refusal.at("error").at("code"), code) << json.out;
    EXPECT_EQ(files(), before);
  }
};

constexpr const char* lag = R"j({"A": [[0, 1], [0, -2]], "B": [[0], [1]], "C": [[1, 0]],
 "states": ["position (m)", "velocity (m/s)"], "inputs": ["voltage (V)"]})j";

TEST_F(AnalyzeCommand, AJsonModel) {
  write("model.json", lag);
  const Answer answer = run("analyze model.json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(answer.err.empty());
  EXPECT_TRUE(holds(answer.out, "Linear system from model.json"));
  EXPECT_TRUE(holds(answer.out, "Marginally stable, controllable and observable"));
  EXPECT_TRUE(holds(answer.out, "position (m)"));
  EXPECT_FALSE(holds(answer.out, "\x1b")) << "colours in a file";
  EXPECT_EQ(files(), 1U);

  const Json json = Json::parse(run("analyze model.json --json").out);
  EXPECT_EQ(json.at("schema"), "flyball.analyze/2");
  EXPECT_EQ(json.at("domain"), "continuous");
  EXPECT_EQ(json.at("poles"), Json::parse("[[0.0, 0.0], [-2.0, 0.0]]"));
  EXPECT_TRUE(json.at("controllable").get<bool>());
  EXPECT_EQ(json.at("outputs").at(0).at("name"), "position");
  EXPECT_FALSE(json.contains("dc_gain")) << "it integrates";
  EXPECT_FALSE(json.contains("sampled")) << "nobody named a period";
}

// 2 NEO, 10:1, 8 kg on a drum of 1 in: the pole is -G² K_t/(R r² m K_v) of Theorem 6.9.1, e^{aT} of
// it the sampled one.
TEST_F(AnalyzeCommand, TheMechanismOfAProject) {
  const Answer answer = run("analyze " + example("elevator.toml"));
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "Elevator from elevator.toml"));
  EXPECT_TRUE(holds(answer.out, "Sampled each 20 ms"));
  EXPECT_TRUE(holds(answer.out, "gravity (kG"));
  const Json json = Json::parse(run("analyze " + example("elevator.toml") + " --json").out);
  const Json designed = Json::parse(run("design " + example("elevator.toml") + " --json").out);
  EXPECT_EQ(json.at("A"), designed.at("plant").at("A_continuous"));
  EXPECT_EQ(json.at("sampled").at("A"), designed.at("plant").at("A"));
  EXPECT_EQ(json.at("sampled").at("B"), designed.at("plant").at("B"));
  EXPECT_EQ(
      json.at("states"),
      Json::parse(R"j([{"name": "position", "unit": "m"}, {"name": "velocity", "unit": "m/s"}])j"));
  EXPECT_EQ(json.at("inputs"), Json::parse(R"j([{"name": "voltage", "unit": "V"}])j"));
  EXPECT_EQ(json.at("T"), 0.02);
  const double pole = json.at("poles").at(1).at(0).get<double>();
  EXPECT_NEAR(json.at("sampled").at("poles").at(1).at(0).get<double>(), std::exp(0.02 * pole),
              1e-14);
}

TEST_F(AnalyzeCommand, GainsWithoutAcceleration) {
  write("wheel.toml", "[mechanism]\ntype = \"flywheel\"\n[gains]\nkV = 0.02\n");
  const Answer wheel = run("analyze wheel.toml");
  ASSERT_EQ(wheel.status, 0) << wheel.err;
  EXPECT_TRUE(holds(wheel.out, "kA is not known"));
  EXPECT_EQ(Json::parse(run("analyze wheel.toml --json").out).at("domain"), "discrete");
  write("arm.toml", "[mechanism]\ntype = \"arm\"\n[gains]\nkV = 1.5\nkG = 0.4\n");
  const Json arm = Json::parse(run("analyze arm.toml --json").out);
  EXPECT_EQ(arm.at("B"), Json::array({Json::array({1.0 / 1.5})}));
}

TEST_F(AnalyzeCommand, StandardInput) {
  write("model", lag);
  write("project", contents(FLYBALL_EXAMPLES "/elevator.toml"));
  EXPECT_TRUE(holds(run("analyze -", "model").out, "Linear system from standard input"));
  EXPECT_TRUE(holds(run("analyze -", "project").out, "Elevator from standard input"));
  EXPECT_TRUE(holds(run("analyze project").out, "Elevator from project"));
  EXPECT_EQ(run("analyze -").status, 2);
}

TEST_F(AnalyzeCommand, WritesAReport) {
  const std::string analyze = "analyze " + example("elevator.toml");
  const Answer answer = run(analyze + " --out report");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "report/index.html"));
  const std::string page = contents(work() / "report/index.html");
  EXPECT_TRUE(holds(page, "Poles in the s plane"));
  EXPECT_TRUE(holds(page, "Unit step of voltage (V)"));
  for (const char* load : {"src=\"http", "href=\"http", "url(http", "@import"}) {
    EXPECT_EQ(page.find(load), std::string::npos) << "nothing from a network: " << load;
  }
  EXPECT_TRUE(holds(page, "Content-Security-Policy"));
  for (const char* file : {"result.json", "data/step_response.csv", "pictures/poles.svg",
                           "pictures/poles.png", "pictures/step_response.svg"}) {
    EXPECT_GT(contents(work() / "report" / file).size(), 100U) << file;
  }
  EXPECT_TRUE(contents(work() / "report/data/step_response.csv")
                  .starts_with("time (s),position (m) after voltage (V)\n0,0\n"));
  // Again, it is replaced; what is not ours stays.
  EXPECT_EQ(run(analyze + " --out report").status, 0);
  EXPECT_EQ(contents(work() / "report/index.html"), page);
  std::filesystem::create_directory(work() / "thesis");
  write("thesis/chapter.txt", "three years\n");
  expect_refused(example("elevator.toml") + " --out thesis", "folder_in_use", "not empty");
  EXPECT_EQ(run(analyze + " --out ''").status, 2);
  EXPECT_EQ(contents(work() / "thesis/chapter.txt"), "three years\n");
}

TEST_F(AnalyzeCommand, FilesThatAreNoModel) {
  expect_refused("nowhere.json", "not_found", "nowhere.json");
  expect_refused(".", "is_a_folder", "folder");
  expect_refused("/dev/zero", "not_a_file", "a device");
  write("empty.json", "");
  expect_refused("empty.json", "empty", "empty.json: the model is empty");
  write("blank.toml", "\n \n");
  expect_refused("blank.toml", "empty", "a JSON object with A and B, or a project file (TOML)");
  write("noise", std::string("\x00\x01\x02\xff", 4));
  expect_refused("noise", "malformed", "noise: the model is binary");
  ASSERT_EQ(::mkfifo((work() / "pipe").c_str(), 0600), 0);
  expect_refused("pipe", "not_a_file", "pipe that nothing writes to");
  const std::size_t before = files();
  for (const char* command : {"identify", "design", "tune"}) {
    const Answer answer = run(std::string(command) + " pipe");
    EXPECT_EQ(answer.status, 2) << command;
    EXPECT_TRUE(holds(answer.err, "pipe that nothing writes to")) << answer.err;
  }
  EXPECT_EQ(files(), before);
}

TEST_F(AnalyzeCommand, ModelsThatAreWrong) {
  const auto refused = [&](const std::string& text, std::string_view code, std::string_view words) {
    write("m.json", text);
    expect_refused("m.json", code, words);
  };
  refused("{\"A\": [[1]]", "malformed", "m.json: the model is cut off");
  refused("{\"A\": [[1]],\n \"B\": [[1]],,}", "malformed", "(line = 2, column = 13)");
  refused("[[1]]", "malformed", "a list of 1");
  refused(R"({"A": [[1]]})", "malformed", "m.json: B is left out");
  refused(R"({"A": [[1]], "B": [[1]], "stats": ["x"]})", "unknown_name",
          "did you mean \"states\"?");
  refused(R"({"A": [[1, 2], [3]], "B": [[1], [1]]})", "malformed",
          "m.json: A is 2 numbers in row 0 and 1 in row 1");
  refused(R"({"A": [[1, 2]], "B": [[1]]})", "wrong_shape", "m.json: A is 1x2");
  refused(R"({"A": [[1]], "B": [[1], [2]]})", "wrong_shape", "B is 2x1");
  refused(R"({"A": [[1]], "B": [["nan"]]})", "not_finite", "B");
  refused(R"({"A": [[1e999]], "B": [[1]]})", "malformed", "1.8e308");
  refused(R"({"A": [[1]], "B": [[1]], "domain": "discrete"})", "malformed", "T is left out");
  refused(R"({"A": [[1]], "B": [[1]], "domain": "analog"})", "unknown_name", "analog");
  refused(R"({"A": [[1]], "B": [[1]], "T": 0})", "not_positive", "T");
  refused(R"({"A": [[1]], "B": [[1]], "states": ["a", "b"]})", "wrong_shape", "2 names");
  refused(R"({"A": [[1]], "B": [[1]], "inputs": "u"})", "malformed", "inputs");
  refused("{\"A\": " + std::string(1000, '['), "malformed", "brackets");
  write("p.toml",
        "[mechanism]\ntype = \"flywheel\"\nmotor = \"NEO\"\ngearng = 3\n"
        "moment_of_inertia = \"0.001 kg m^2\"\n");
  expect_refused("p.toml", "unknown_key", "did you mean \"gearing\"?");
  write("p.toml", "[mechanism]\ntype = \"elevator\"\nmotor = \"NEO\"\n");
  expect_refused("p.toml", "missing_key", "gearing");
  write("p.toml", "A = [[1]]\n");
  expect_refused("p.toml", "unknown_key", "p.toml:1:1");
}

// Nothing that can be stabilised, or seen: an answer, not an error.
TEST_F(AnalyzeCommand, WhatNoControllerCanDo) {
  write("m.json", R"({"A": [[1, 0], [0, -1]], "B": [[0], [1]], "C": [[0, 1]]})");
  const Answer answer = run("analyze m.json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "no controller can make it stable")) << answer.out;
  EXPECT_TRUE(holds(answer.out, "no observer can know the state")) << answer.out;
}

}  // namespace
}  // namespace flyball::test::analyze_command_test
