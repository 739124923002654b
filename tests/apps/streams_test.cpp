#include <vector>

#include <nlohmann/json.hpp>

#include "run.hpp"
#include "support/sanitizer.hpp"

// Streams, signals and folders: what a shell and a terminal see of the command.
namespace flyball::test::streams_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Streams : public Command {
 protected:
  /// Runs a script in which "$flyball" is the command.
  [[nodiscard]] Answer shell(const std::string& script) const {
    write("script", "flyball='" FLYBALL_COMMAND "'\n" + script + "\n");
    return run("--version >/dev/null; exec bash ./script");
  }

  /// For the start of a script: what comes after has that much memory, if the build can do with it.
  [[nodiscard]] static std::string bounded(int kib) {
    return FLYBALL_SANITIZED ? "" : "ulimit -v " + std::to_string(kib) + "\n";
  }

  /// A program that is gnuplot for the script that has it in its PATH.
  void fake_gnuplot(const std::string& script) const {
    fs::create_directory(work() / "bin");
    write("bin/gnuplot", "#!/bin/bash\n" + script + "\n");
    fs::permissions(work() / "bin/gnuplot", fs::perms::owner_all);
  }
};

TEST_F(Streams, OutputThatCannotBeWrittenIsAnError) {
  write("problem", R"({"A":[[0]]})");
  const std::string elevator = example("elevator.toml");
  const std::string log = example("logs/elevator.json");
  for (const std::string& arguments : std::vector<std::string>{
           std::string("--help"), std::string("--version"), std::string("design --help"),
           std::string("solve --help"), std::string("solve dare --help"),
           std::string("solve --list"), std::string("solve --schema"),
           std::string("solve expm <problem"), std::string("solve none <problem"),
           std::string("design --fields"), std::string("motors"), std::string("motors --json"),
           std::string("book --list"), "design --json " + elevator, "design --json missing.toml",
           "analyze " + elevator, "simulate --json " + elevator, "identify " + log,
           "tune --json " + log}) {
    const Answer answer =
        shell("for to in '>/dev/full' '>&-'; do\n  eval \"$flyball $(cat <<'END'\n" + arguments +
              "\nEND\n) $to\" 2>>words\n  [ $? -eq 2 ] || exit 1\ndone\ngrep -c 'standard output "
              "cannot be written' words; rm words");
    EXPECT_EQ(answer.status, 0) << arguments << answer.err;
    EXPECT_EQ(answer.out, "2\n") << arguments;
  }
  EXPECT_EQ(files(), 2U);
}

TEST_F(Streams, NobodyWhoReadsIsAnError) {
  const Answer answer = shell(
      "for k in {1..20000}; do echo '{\"A\":[[0]]}'; done >many\n"
      "$flyball solve expm <many 2>/dev/null | head -1 >/dev/null\n"
      "[ ${PIPESTATUS[0]} -ne 0 ] || exit 1\n"
      "trap '' PIPE\n"
      "$flyball solve expm <many 2>words | head -1 >/dev/null\n"
      "[ ${PIPESTATUS[0]} -eq 2 ] || exit 1\n"
      "cat words");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(holds(answer.out, "standard output cannot be written")) << answer.out;
}

// A closed standard output must not be the report's first file.
TEST_F(Streams, AClosedOutputDoesNotEndInAFile) {
  const Answer answer =
      shell("$flyball analyze " + example("elevator.toml") + " --out report >&- 2>/dev/null");
  EXPECT_EQ(answer.status, 2);
  const Json json = Json::parse(contents(work() / "report/result.json"), nullptr, false);
  EXPECT_FALSE(json.is_discarded());
}

TEST_F(Streams, AnswersComeAsTheyAreAsked) {
  const Answer answer = shell(
      "coproc \"$flyball\" solve expm\n"
      "for id in 1 2 3; do\n"
      "  echo \"{\\\"id\\\":$id,\\\"A\\\":[[0]]}\" >&${COPROC[1]}\n"
      "  read -t 60 -r line <&${COPROC[0]} || exit 1\n"
      "  echo \"$line\"\n"
      "done");
  EXPECT_EQ(answer.status, 0);
  EXPECT_TRUE(holds(answer.out, "{\"id\":3,")) << answer.out;
}

TEST_F(Streams, NoControlCharacterReachesATerminal) {
  const std::string evil =
      "\x1b]0;owned\x07\x1b[2J\xC2\x9B"
      "31m\u202Emoc\u2066\u200F\u061C\uFEFF";
  write("key.toml",
        "[mechanism]\ntype = \"elevator\"\n\""
        "\\u001b[2J\\u009b1m"
        "\" = 1\n");
  write("value.toml", "[mechanism]\ntype = \"\\u001b[2J\"\n");
  write("raw.toml", "[mechanism]\ntype = \"" + evil + "\"\n");
  write("model.toml",
        "[model]\nname = \"\\u001b[2J\\u009b1m\"\nstates = { x = \"m\" }\n[model.derivative]\n"
        "x = \"-x/(1 s)\"\n");
  write("log.json", "{\"" + evil + "\": 1}");
  write("log.csv", "Time" + evil + "," + evil + "\n0,1\n1,x\n2," + evil + "\n");
  write("problem", "{\"\\u001b[2J\\u009b1m\": 1}\n" + evil + "\n");
  write(evil + ".json", "{}");
  for (const std::string& arguments : std::vector<std::string>{
           std::string("design key.toml"), std::string("design value.toml"),
           std::string("design raw.toml"), std::string("simulate model.toml"),
           std::string("analyze model.toml"), std::string("identify log.json"),
           std::string("identify log.csv"), std::string("analyze log.json"),
           std::string("solve expm <problem"), "identify '" + evil + ".json'",
           "motors '" + evil + "'", "solve '" + evil + "'", "'" + evil + "'",
           "design --" + std::string("'") + evil + "'", "design key.toml --mass '" + evil + "'",
           "design key.toml --out '" + evil + "/x/'", "book '" + evil + "'"}) {
    for (const char* json : {"", " --json"}) {
      const Answer answer = shell("$flyball " + arguments + json + " 2>&1");
      EXPECT_FALSE(answer.out.empty()) << arguments;
      for (std::size_t i = 0; i < answer.out.size(); ++i) {
        const auto byte = static_cast<unsigned char>(answer.out[i]);
        const bool c1 = byte == 0xC2 && static_cast<unsigned char>(answer.out[i + 1]) < 0xA0;
        const std::string_view rest = std::string_view(answer.out).substr(i);
        const bool turns = rest.starts_with("\u202E") || rest.starts_with("\u2066") ||
                           rest.starts_with("\u200F") || rest.starts_with("\u061C") ||
                           rest.starts_with("\uFEFF");
        if ((byte < 0x20 && byte != '\n') || byte == 0x7F || c1 || turns) {
          ADD_FAILURE() << arguments << " at " << i << " of " << answer.out;
          break;
        }
      }
    }
  }
}

TEST_F(Streams, GnuplotWithoutAnEndCostsOnlyThePictures) {
  fake_gnuplot("yes '<svg><script>alert(1)</script></svg>'");
  const Answer answer = shell("PATH=$PWD/bin:$PATH\n" + bounded(2000000) + "$flyball analyze " +
                              example("elevator.toml") + " --out report");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_TRUE(
      holds(answer.err, "pictures could not be drawn: plot: what gnuplot answered is no picture"))
      << answer.err;
  EXPECT_FALSE(holds(contents(work() / "report/index.html"), "<script>alert"));
  EXPECT_FALSE(fs::exists(work() / "report/pictures"));
}

// Told to end while it builds a report, it leaves neither a folder nor a program.
TEST_F(Streams, SignalsLeaveNothingBehind) {
  fake_gnuplot("touch running; exec -a flyball-fake-$PPID sleep 100");
  for (const char* signal : {"INT", "TERM", "HUP"}) {
    const Answer answer = shell(
        "PATH=$PWD/bin:$PATH\n"
        "rm -f running\n"
        "set -m\n"  // else INT is ignored by what runs in the background
        "$flyball analyze " +
        example("elevator.toml") +
        " --out deep/er/report 2>/dev/null &\n"
        "pid=$!\n"
        "for k in {1..600}; do [ -e running ] && break; sleep 0.1; done\n"
        "ls -A deep/er\n"
        "kill -" +
        signal +
        " $pid\n"
        "wait $pid; echo $?\n"
        "for k in {1..100}; do pgrep -f flyball-fake-$pid >/dev/null || break; sleep 0.1; done\n"
        "pgrep -f flyball-fake-$pid; ls");
    EXPECT_TRUE(answer.out.starts_with(".report.flyball-")) << answer.out << answer.err;
    const int number = signal == std::string("INT") ? 2 : signal == std::string("TERM") ? 15 : 1;
    const std::string rest = answer.out.substr(answer.out.find('\n') + 1);
    EXPECT_EQ(rest, std::to_string(128 + number) + "\nbin\nrunning\nscript\n");
  }
}

// Killed, it can do nothing more: what draws for it ends all the same, with what that started.
TEST_F(Streams, AKillLeavesNoProgramBehind) {
  fake_gnuplot(
      "touch running\ntrap '' TERM INT HUP\n"
      "(exec -a flyball-child-$PPID sleep 100) &\n"
      "exec -a flyball-fake-$PPID sleep 100");
  const Answer answer = shell(
      "PATH=$PWD/bin:$PATH\n"
      "$flyball analyze " +
      example("elevator.toml") +
      " --out report >/dev/null 2>&1 &\n"
      "pid=$!\n"
      "for k in {1..600}; do pgrep -f flyball-child-$pid >/dev/null && break; sleep 0.1; done\n"
      "test $(pgrep -f \"flyball-(fake|child)-$pid\" | wc -l) -ge 2 && echo drawn\n"
      "kill -KILL $pid; wait $pid 2>/dev/null; echo $?\n"
      "for k in {1..100}; do pgrep -f \"flyball-(fake|child)-$pid\" >/dev/null || break; sleep "
      "0.1; done\n"
      "pgrep -f \"flyball-(fake|child)-$pid\" | wc -l");
  EXPECT_EQ(answer.out, "drawn\n137\n0\n") << answer.err;
}

TEST_F(Streams, WhatAKillLeftIsSwept) {
  fake_gnuplot("touch running; sleep 3; exit 1");
  const std::string analyze = "$flyball analyze " + example("elevator.toml") + " --out report";
  const Answer answer = shell(
      "for k in 1 2; do\n"
      "  (PATH=$PWD/bin:$PATH; exec " +
      analyze +
      ") >/dev/null 2>&1 &\n"
      "  for k in {1..600}; do [ -e running ] && break; sleep 0.1; done\n"
      "  kill -KILL $!; wait $! 2>/dev/null\n"
      "  rm running\n"
      "  find . -name '*report.*' -type d | wc -l\n" +
      analyze +
      " >/dev/null || exit 1\n"
      "  find . -name '*report.*' -type d | wc -l\n"
      "done");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_EQ(answer.out, "1\n0\n1\n0\n");
}

TEST_F(Streams, AReportLeavesAlonePeoplesFiles) {
  const std::string analyze = "$flyball analyze " + example("elevator.toml") + " --out report";
  const Answer answer =
      shell("set -e\n" + analyze + " >/dev/null\ncp " + example("logs/elevator.json") +
            " report/log.json\nchmod 2750 report\n"
            "$flyball identify report/log.json --out report >/dev/null\n"
            "stat -c %a report; cmp report/log.json " +
            example("logs/elevator.json") + "\necho mine >>report/index.html\n" + analyze);
  EXPECT_EQ(answer.status, 2);
  EXPECT_EQ(answer.out, "2750\n");
  EXPECT_TRUE(
      holds(answer.err, "report/index.html: the file of the earlier report is changed since"))
      << answer.err;
  EXPECT_TRUE(contents(work() / "report/index.html").ends_with("mine\n"));
}

// Refused before the log is even looked for.
TEST_F(Streams, AFolderIsLookedAtBeforeTheWork) {
  fs::create_directory_symlink("nowhere", work() / "link");
  const Answer answer = run("identify missing.json --out link");
  EXPECT_EQ(answer.status, 2);
  EXPECT_TRUE(holds(answer.err, "link: the output folder is a link to a folder that is missing"))
      << answer.err;
  EXPECT_FALSE(holds(answer.err, "missing.json"));
}

// Time in microseconds: by its steps, or refused where its header says seconds.
TEST_F(Streams, ATimeInMicrosecondsNeedsNoMemory) {
  const Json log = Json::parse(contents(FLYBALL_EXAMPLES "/logs/elevator.json"));
  std::string rows;
  double time = 1e7;
  for (const auto& test : {std::pair("quasistatic-forward", "slow-forward"),
                           {"quasistatic-reverse", "slow-backward"},
                           {"dynamic-forward", "fast-forward"},
                           {"dynamic-reverse", "fast-backward"}}) {
    const Json& recorded = log.at(test.second);
    for (std::size_t i = 0; i < recorded.size(); ++i) {
      const auto cell = [&](std::size_t column) { return recorded.at(i).at(column).get<double>(); };
      time += i == 0 ? 1e6 : 1e6 * (cell(0) - recorded.at(i - 1).at(0).get<double>());
      std::ostringstream row;
      row.precision(12);
      row << time << ',' << test.first << ',' << cell(1) << ',' << cell(2) << ',' << cell(3)
          << '\n';
      rows += row.str();
    }
  }
  write("none.csv", "timestamp,test,voltage,position,velocity\n" + rows);
  write("micro.csv", "time (us),test,voltage,position,velocity\n" + rows);
  write("seconds.csv", "time (s),test,voltage,position,velocity\n" + rows);
  const std::string identify =
      bounded(1000000) + "$flyball identify --mechanism elevator --json --unit m ";
  const Answer none = shell(identify + "none.csv");
  const Answer micro = shell(identify + "micro.csv");
  ASSERT_EQ(none.status, 0) << none.out << none.err;
  ASSERT_EQ(micro.status, 0) << micro.out << micro.err;
  EXPECT_EQ(Json::parse(none.out).at("gains"), Json::parse(micro.out).at("gains"));
  EXPECT_TRUE(holds(none.out, "assumed_time_unit"));
  const Answer seconds = shell(identify + "seconds.csv");
  EXPECT_EQ(seconds.status, 2) << seconds.out;
  EXPECT_TRUE(holds(seconds.err, "the distance of two rows in time is")) << seconds.err;
}

}  // namespace
}  // namespace flyball::test::streams_test
