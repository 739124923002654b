// What nobody should type, and what comes of it: a clear error, the right exit status, nothing
// half-written.
#include <cstdint>

#include <nlohmann/json.hpp>

#include "run.hpp"
#include "support/sanitizer.hpp"

namespace flyball::test::bad_input_test {
namespace {

using Json = nlohmann::json;

class BadInput : public Command {
 protected:
  /// The command must end so, say that, print nothing as a result and leave nothing behind.
  void expect(const std::string& arguments, int status, std::string_view words) const {
    const std::size_t before = files();
    const Answer answer = run(arguments);
    EXPECT_EQ(answer.status, status) << arguments << "\n" << answer.err;
    EXPECT_TRUE(answer.err.starts_with("flyball: ")) << arguments << "\n" << answer.err;
    EXPECT_TRUE(holds(answer.err, words)) << arguments << "\n" << answer.err;
    EXPECT_EQ(files(), before) << arguments;
  }

  /// The same from every command that reads logs, and with --json as one object with the code.
  void expect_log(const std::string& log, int status, std::string_view code,
                  std::string_view words) const {
    expect("identify " + log, status, words);
    expect("tune " + log + " --json", status, words);
    const Answer answer = run("identify " + log + " --json");
    EXPECT_EQ(answer.status, status);
    const Json json = Json::parse(answer.out, nullptr, false);
    ASSERT_FALSE(json.is_discarded()) << answer.out;
    EXPECT_EQ(json.at("schema"), "flyball.identify/1");
    EXPECT_EQ(json.at("error").at("code"), code);
    EXPECT_FALSE(json.at("error").at("message").get<std::string>().empty());
  }

  static Json elevator() { return Json::parse(contents(FLYBALL_EXAMPLES "/logs/elevator.json")); }

  void project(const std::string& mechanism, const std::string& rest = "") const {
    write("project.toml", "[mechanism]\n" + mechanism + rest);
  }
};

constexpr const char* good_elevator =
    "type = \"elevator\"\nmotor = \"NEO\"\nmotor_count = 2\ngearing = 10.0\nmass = \"8 kg\"\n"
    "drum_radius = \"1 in\"\n";

std::string with(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string wpilog_header(std::uint16_t version) {
  std::string text = "WPILOG";
  text += static_cast<char>(version & 0xff);
  text += static_cast<char>(version >> 8);
  return text + std::string(4, '\0');
}

TEST_F(BadInput, LogsThatAreNone) {
  expect_log("nowhere.json", 2, "not_found", "nowhere.json");
  expect_log(".", 2, "is_a_folder", "folder");
  write("empty.json", "");
  expect_log("empty.json", 2, "empty", "empty");
  write("noise.wpilog", std::string("\x01\xff\x00\x80zz\x07", 7) + std::string(300, '\xee'));
  const Answer noise = run("identify noise.wpilog");
  EXPECT_EQ(noise.status, 2);
  EXPECT_TRUE(holds(noise.err, "noise.wpilog")) << noise.err;
  write("magic.wpilog", "WPILOX" + wpilog_header(0x100).substr(6) + std::string(40, '\x01'));
  EXPECT_EQ(run("identify magic.wpilog").status, 2);
  write("version.wpilog", wpilog_header(0x0700) + std::string(40, '\x01'));
  const Answer version = run("identify version.wpilog");
  EXPECT_EQ(version.status, 2);
  EXPECT_TRUE(holds(version.err, "version")) << version.err;
  write("other.json", "{\"hello\": [1, 2, 3]}");
  EXPECT_EQ(run("identify other.json").status, 2);
  write("text.csv", "this is a letter\nto my aunt\n");
  EXPECT_EQ(run("identify text.csv").status, 2);
}

// A record that claims four gigabytes, and one whose lengths run over the end.
TEST_F(BadInput, AbsurdRecordLengths) {
  std::string huge = "\x7f\x01";
  huge += std::string(3, '\0') + std::string(4, '\xff') + std::string(8, '\0') + "abc";
  write("huge.wpilog", wpilog_header(0x100) + huge);
  const Answer answer = run("identify huge.wpilog");
  EXPECT_NE(answer.status, 0);
  EXPECT_LE(answer.status, 2) << "ended by a signal";
  EXPECT_TRUE(holds(answer.err, "huge.wpilog")) << answer.err;
  std::string extra = wpilog_header(0x100);
  extra[8] = extra[9] = extra[10] = extra[11] = '\xff';
  write("extra.wpilog", extra);
  EXPECT_EQ(run("identify extra.wpilog").status, 2);
}

// What precedes the cut is used, with a warning.
TEST_F(BadInput, ATruncatedLog) {
  const std::string whole = contents(FLYBALL_EXAMPLES "/logs/elevator.json");
  write("cut.json", whole.substr(0, whole.size() * 19 / 20));
  const Answer answer = run("identify cut.json --mechanism elevator --unit m --json");
  EXPECT_LE(answer.status, 1) << answer.err;
  EXPECT_TRUE(holds(answer.out, "\"truncated_log\"")) << answer.out;
  write("stump.json", whole.substr(0, whole.size() / 3));
  const Answer stump = run("identify stump.json --mechanism elevator --unit m");
  EXPECT_EQ(stump.status, 0) << stump.err;
  for (const char* words : {"[truncated_log]", "[missing_test]", "kG + kS", "with care"}) {
    EXPECT_TRUE(holds(stump.out, words)) << words << "\n" << stump.out;
  }
}

TEST_F(BadInput, NotANumber) {
  Json log = elevator();
  std::string text = log.dump();
  log["slow-forward"][100][3] = "NaN";
  text = log.dump();
  text = with(text, "\"NaN\"", "NaN");
  write("nan.json", text);
  const Answer answer = run("identify nan.json --json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "non_finite")) << answer.out;
}

TEST_F(BadInput, NoMotion) {
  Json log = elevator();
  for (const char* test : {"slow-forward", "slow-backward", "fast-forward", "fast-backward"}) {
    for (Json& row : log[test]) {
      row[2] = 0.25;
      row[3] = 0.0;
    }
  }
  write("still.json", log.dump());
  expect_log("still.json", 1, "no_motion", "move");
}

TEST_F(BadInput, OneTestOfFour) {
  Json log = elevator();
  const Json whole = log;
  for (const char* test : {"slow-backward", "fast-forward", "fast-backward"}) {
    log[test] = Json::array();
  }
  write("one.json", log.dump());
  const Answer ramp = run("identify one.json");
  EXPECT_EQ(ramp.status, 0) << ramp.err;
  EXPECT_TRUE(holds(ramp.out, "quasistatic-reverse would")) << ramp.out;
  EXPECT_TRUE(holds(ramp.out, "dynamic-forward would")) << ramp.out;
  // Steps of one voltage end in one speed: friction and kV are one number.
  log = whole;
  for (const char* test : {"slow-forward", "slow-backward", "fast-backward"}) {
    log[test] = Json::array();
  }
  write("step.json", log.dump());
  expect_log("step.json", 1, "missing_tests", "quasistatic");
}

TEST_F(BadInput, TimeThatGoesBackIsSorted) {
  Json log = elevator();
  std::swap(log["slow-forward"][50], log["slow-forward"][90]);
  write("unsorted.json", log.dump());
  const Answer answer = run("identify unsorted.json --json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "unsorted_time")) << answer.out;
}

TEST_F(BadInput, MotorsThatAreNone) {
  expect("motors warpdrive", 2, "known motors are");
  project(with(good_elevator, "\"NEO\"", "\"NEP\""));
  expect("design project.toml", 2, "project.toml:3:9: motor is \"NEP\"");
  expect("design project.toml", 2, "did you mean \"NEO\"?");
}

TEST_F(BadInput, ProjectFiles) {
  const auto refused = [&](const std::string& mechanism, const std::string& rest,
                           std::string_view words) {
    project(mechanism, rest);
    expect("design project.toml", 2, words);
    expect("design project.toml --out report", 2, words);
  };
  refused(with(good_elevator, "8 kg", "8 m"), "",
          "project.toml:6:8: mechanism.mass is \"8 m\", a length");
  refused(with(good_elevator, "\"8 kg\"", "8"), "",
          "project.toml:6:8: mechanism.mass is 8, without a unit");
  refused(with(good_elevator, "8 kg", "-8 kg"), "", "mass");
  refused(with(good_elevator, "8 kg", "nan kg"), "", "mass");
  refused(with(good_elevator, "10.0", "0"), "", "gearing");
  refused(with(good_elevator, "10.0", "-10"), "", "gearing");
  refused(with(good_elevator, "10.0", "inf"), "", "gearing");
  refused(with(good_elevator, "motor_count = 2", "motor_count = 0"), "", "motor_count");
  refused(with(good_elevator, "gearing", "gearng"), "", "did you mean \"gearing\"?");
  refused(with(good_elevator, "elevator", "escalator"), "", "elevator");
  refused(good_elevator, "[controler]\nperiod = \"20 ms\"\n", "did you mean \"controller\"?");
  refused(good_elevator, "[controller]\nperiod = \"0 ms\"\n", "period");
  refused(good_elevator, "[controller]\nperiod = \"-5 ms\"\n", "period");
  refused(good_elevator, "[controller]\nperiod = \"20 kg\"\n", "a mass");
  refused(good_elevator, "[controller]\nperiod = ", "project.toml:9");
  write("project.toml", "");
  expect("design project.toml", 2, "mechanism");
  expect("design nowhere.toml", 2, "nowhere.toml");
  write("project.toml", std::string("\xff\xfe\x00\x01", 4));
  expect("design project.toml", 2, "project.toml");
}

// All that is wrong, in one run; with --json as a list, too.
TEST_F(BadInput, SeveralErrorsAtOnce) {
  project(with(with(good_elevator, "gearing", "gearng"), "8 kg", "8 m"));
  const Answer answer = run("design project.toml --period 0ms --json");
  EXPECT_EQ(answer.status, 2);
  EXPECT_EQ(
      answer.err,
      "flyball: --period is 0 s; it must be greater than zero\n"
      "flyball: project.toml:5:1: mechanism.gearng is not a key of [mechanism]; did you mean "
      "\"gearing\"?\n"
      "    5 | gearng = 10.0\n"
      "      | ^^^^^^\n"
      "flyball: project.toml:6:8: mechanism.mass is \"8 m\", a length; it must be a mass such "
      "as \"8 kg\" or \"18 lb\"\n"
      "    6 | mass = \"8 m\"\n"
      "      |        ^^^^^\n");
  const Json json = Json::parse(answer.out);
  EXPECT_EQ(json.at("error").at("code"), "not_positive");
  ASSERT_EQ(json.at("errors").size(), 3U);
  EXPECT_EQ(json.at("errors")[0], json.at("error"));
  EXPECT_EQ(json.at("errors")[2].at("code"), "wrong_unit");
  project("type = \"arm\"\n");
  EXPECT_EQ(Json::parse(run("design project.toml --json").out).at("errors").size(), 5U);
}

TEST_F(BadInput, OptionsOfTheCommandLine) {
  project(good_elevator);
  expect("design project.toml --period 0ms", 2, "--period");
  expect("design project.toml --period 20", 2, "--period");
  expect("design project.toml --period 20kg", 2, "--period");
  expect("design project.toml --max-voltage -3V", 2, "--max-voltage");
  expect("design project.toml --delay -3ms", 2, "--delay");
  expect("design project.toml --seed banana", 2, "--seed");
  expect("design project.toml --state-tolerance 2cm", 2, "--state-tolerance is 1 value long");
  expect("design project.toml --goal 2V", 2, "--goal is \"2V\", a voltage");
  expect("analyze project.toml --mass 0kg", 2, "mass is 0 kg");
  expect("analyze model.json --mass 1kg", 2, "model.json");
  write("model.json", R"({"A":[[-1]],"B":[[1]]})");
  expect("analyze model.json --mass 1kg", 2, "--mass is given with matrices");
  expect("tune " + example("logs/elevator.json") + " --mechanism arm --mass 1", 2, "--mass");
  expect("identify " + example("logs/elevator.json") + " --mechanism turret", 2, "turret");
  expect("identify " + example("logs/elevator.json") + " --unit parsnips", 2, "parsnips");
  expect("identify " + example("logs/elevator.json") + " --scale 0", 2, "scale");
  expect("identify " + example("logs/elevator.json") + " --run 9:0..1", 2, "run 9");
  expect("identify " + example("logs/elevator.json") + " --run 1:90..91", 2, "none of run 1");
  expect("identify " + example("logs/elevator.json") + " --without-run all", 2, "number of a run");
}

TEST_F(BadInput, CommandLinesThatEndTooSoon) {
  expect("identify", 2, "identify: LOG is required");
  expect("identify", 2, "`flyball identify --help`");
  expect("tuen", 2, "did you mean \"tune\"?");
  const Answer alone = run("");
  EXPECT_EQ(alone.status, 2);
  EXPECT_TRUE(holds(alone.err, "flyball tune arm.json")) << alone.err;
}

// Mathematics says no: the motor cannot lift it.
TEST_F(BadInput, AMechanismThatTheMotorCannotMove) {
  project(with(good_elevator, "8 kg", "80000 kg"));
  expect("design project.toml --json", 1, "motor");
}

TEST_F(BadInput, FoldersThatAreNotOurs) {
  project(good_elevator);
  write("in-the-way", "a file\n");
  expect("design project.toml --out in-the-way", 2, "it must be a folder");
  expect("design project.toml --out in-the-way/report", 2, "in-the-way");
  EXPECT_EQ(contents(work() / "in-the-way"), "a file\n");

  expect("design project.toml --out ''", 2, "--out: a folder's name is needed");
  expect("book", 2, "a figure's number, --all, --list or --check");
  write("log.json", "{}");
  expect("log.json", 2, "\"log.json\" is a file, not a command; try \"flyball tune log.json\"");
  expect("design log.json", 2, "a log goes to `flyball tune`");
  expect("book 6.3 --out in-the-way", 2, "in-the-way: the output folder is not writable");
  expect("book 6.3 --out in-the-way/figures", 2, "the output folder is not writable");

  std::filesystem::create_directory(work() / "thesis");
  write("thesis/chapter.txt", "three years\n");
  expect("design project.toml --out thesis", 2, "not empty");
  expect("identify " + example("logs/elevator.json") + " --out thesis", 2, "not empty");
  EXPECT_EQ(contents(work() / "thesis/chapter.txt"), "three years\n");

  // Where nobody asked for a report, one that cannot be written is a warning beside the result.
  std::filesystem::create_directory(work() / "flyball-report");
  write("flyball-report/mine.txt", "mine\n");
  const Answer answer = run("design project.toml");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.err, "warning: no report")) << answer.err;
  EXPECT_FALSE(answer.out.empty());
}

// Whatever is echoed of an input is cut, in words and in JSON.
TEST_F(BadInput, TextsOfAnyLength) {
  const std::string text(100'000, 'x');
  const auto expect_short = [&](const std::string& arguments,
                                const std::string& input = "/dev/null") {
    const Answer answer = run(arguments, input);
    EXPECT_EQ(answer.status, 2) << arguments.substr(0, 80) << answer.err.substr(0, 500);
    EXPECT_LT(answer.out.size() + answer.err.size(), 6000U) << arguments.substr(0, 80);
    EXPECT_FALSE(holds(answer.out + answer.err, std::string(300, 'x'))) << arguments.substr(0, 80);
  };
  for (const std::string& line :
       {"[" + text + "]\n", "[mechanism]\n" + text + " = 1\n",
        "[mechanism]\ntype = \"" + text + "\"\n",
        "[mechanism]\ntype = \"arm\"\nmotor = \"" + text + "\"\nmass = \"" + text +
            "\"\ngearing = \"" + text + "\"\nmotor_count = \"" + text + "\"\n",
        "[mechanism]\ntype = \"arm\"\nmass = \"1 " + text + "\"\n",
        "[model]\nstates = { " + text + " = \"" + text + "\" }\n[model.derivative]\n" + text +
            " = \"y" + text + "+\"\n"}) {
    write("long.toml", line);
    expect_short("design long.toml --json");
  }
  for (const char* const option : {"--delay ", "--", "--tolerance ", "--motor "}) {
    expect_short("design " + example("elevator.toml") + " --json " + option + text);
  }
  for (const std::string& problem : {"{\"" + text + "\": 1}", "{\"A\": \"" + text + "\"}",
                                     "{\"A\": [[\"" + text + "\"]]}", text}) {
    write("long.json", problem);
    expect_short("solve expm", "long.json");
    expect_short("analyze long.json --json");
    expect_short("identify long.json --json");
  }
  expect_short("motors --json " + text);
  expect_short("solve " + text);
  expect_short("book " + text + " --json");
  expect_short(text);
  expect_short("design --json " + text);
}

TEST_F(BadInput, NotEnoughMemory) {
  if (FLYBALL_SANITIZED) {
    GTEST_SKIP() << "a sanitizer needs all addresses";
  }
  std::string zeros = "0";
  for (int k = 0; k < 3'000'000; ++k) {
    zeros += ",0";
  }
  write("huge.json", "{\"id\": 7, \"A\": [[" + zeros + "]], \"B\": [[1]]}\n");
  const std::string limited = "--version >/dev/null; ulimit -v 100000; '" FLYBALL_COMMAND "' ";
  const Answer analyzed = run(limited + "analyze huge.json --json");
  EXPECT_EQ(analyzed.status, 2);
  Json json = Json::parse(analyzed.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << analyzed.out << analyzed.err;
  EXPECT_EQ(json.at("schema"), "flyball.analyze/2");
  EXPECT_EQ(json.at("error").at("code"), "not_enough_memory");
  EXPECT_TRUE(holds(analyzed.err, "not enough memory for huge.json")) << analyzed.err;
  const Answer solved = run(limited + "solve expm", "huge.json");
  EXPECT_EQ(solved.status, 2);
  json = Json::parse(solved.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << solved.out << solved.err;
  EXPECT_EQ(json.at("error").at("code"), "not_enough_memory");
  EXPECT_EQ(json.at("id"), 7);
  // Also of a line that it cannot even read; the others are answered.
  write("lines.jsonl", "{\"id\":1,\"A\":[[0]]}\n{\"id\":[2],\"A\":[[" + zeros + "," + zeros + "," +
                           zeros + "," + zeros + "," + zeros + "]]}\n{\"id\":3,\"A\":[[0]]}\n");
  const Answer lines =
      run("--version >/dev/null; ulimit -v 50000; '" FLYBALL_COMMAND "' solve expm", "lines.jsonl");
  EXPECT_EQ(lines.status, 2);
  std::istringstream answers(lines.out);
  std::string line;
  for (const char* id : {"1", "[2]", "3"}) {
    ASSERT_TRUE(std::getline(answers, line)) << lines.out << lines.err;
    EXPECT_TRUE(line.starts_with(std::string("{\"id\":") + id + ",")) << line;
  }
}

// Too little for a thread or a process is too little memory: it is said, or done without.
TEST_F(BadInput, NoMemoryForAThread) {
  if (FLYBALL_SANITIZED) {
    GTEST_SKIP() << "a sanitizer needs all addresses";
  }
  int ended = 0;
  for (int kib = 26000; kib < 120000; kib += kib / 16) {
    const std::string limited =
        "--version >/dev/null; ulimit -v " + std::to_string(kib) + "; '" FLYBALL_COMMAND "' ";
    for (const std::string& what :
         {"analyze " + example("elevator.toml") + " --json", std::string("motors --json"),
          "identify --json " + example("logs/elevator.json")}) {
      const Answer answer = run(limited + what);
      if (answer.status == 127) {
        continue;  // the loader itself
      }
      ++ended;
      EXPECT_FALSE(holds(answer.err, "defect")) << kib << what << answer.err;
      EXPECT_TRUE(answer.status == 0 || answer.status == 2) << kib << what << answer.err;
      EXPECT_TRUE(answer.status == 0 || holds(answer.err, "not enough memory"))
          << kib << what << answer.err;
    }
  }
  EXPECT_GT(ended, 20);
}

TEST_F(BadInput, AKeyThatStandsTwice) {
  write("twice.json", "{\"A\": [[1]], \"B\": [[1]],\n \"A\": [[2]]}");
  expect("analyze twice.json", 2, "twice.json: the model is an object with the key \"A\" twice");
  std::string log = contents(FLYBALL_EXAMPLES "/logs/elevator.json");
  log.insert(log.rfind('}'), ", \"fast-forward\": []");
  write("log.json", log);
  expect_log("log.json", 2, "malformed", "the key \"fast-forward\" twice");
}

TEST_F(BadInput, ARefusedDesignTellsWhatWasNoticed) {
  project(with(good_elevator, "\"8 kg\"", "\"80000 kg\""));
  const Answer answer = run("design project.toml --json");
  EXPECT_EQ(answer.status, 1);
  const Json json = Json::parse(answer.out);
  ASSERT_FALSE(json.at("diagnostics").empty()) << answer.out;
  EXPECT_EQ(json.at("diagnostics").at(0).at("code"), "assumed");
}

}  // namespace
}  // namespace flyball::test::bad_input_test
