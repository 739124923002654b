#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::each_command_test {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

std::vector<Json> lines_of(const std::string& text) {
  std::vector<Json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(Json::parse(line));
  }
  return lines;
}

/// A folder of logs, good and bad, with what is no log beside them.
class Each : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    fs::create_directories(work() / "logs/deep/.hidden");
    const std::string log = contents(FLYBALL_EXAMPLES "/logs/elevator.json");
    write("logs/b.json", log);
    write("logs/deep/a.JSON", log + "\n");
    write("logs/deep/.hidden/c.json", log);
    write("logs/broken.json", "{\"slow-forward\": [[0,");
    write("logs/empty.csv", "");
    write("logs/still.json",
          R"({"sysid": true, "test": "Elevator", "units": "Meters", "unitsPerRotation": 1.0,)"
          R"("slow-forward": [)" +
              still_rows() + R"(], "fast-forward": [)" + still_rows() + R"(]})");
    write("logs/README.txt", "not a log");
  }

  static std::string still_rows() {
    std::string rows;
    for (int i = 0; i < 300; ++i) {
      rows += (i == 0 ? "" : ",") + ("[" + std::to_string(0.01 * i)) + ",2.0,0.5,0.0]";
    }
    return rows;
  }
};

TEST_F(Each, EveryLogOfAFolderHasALine) {
  const Answer answer = run("identify logs --json --jobs 2");
  EXPECT_EQ(answer.status, 2) << answer.err;  // some are no logs
  EXPECT_TRUE(answer.err.empty()) << answer.err;
  const std::vector<Json> lines = lines_of(answer.out);
  ASSERT_EQ(lines.size(), 5U) << answer.out;
  const std::vector<std::string> paths{"logs/b.json", "logs/broken.json", "logs/deep/a.JSON",
                                       "logs/empty.csv", "logs/still.json"};
  const std::vector<int> statuses{0, 2, 0, 2, 1};
  const std::vector<std::string> codes{"", "no_data", "", "empty", "no_motion"};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i].at("schema"), "flyball.log_row/1");
    EXPECT_EQ(lines[i].at("log"), i);
    EXPECT_EQ(lines[i].at("logs"), 5);
    EXPECT_EQ(lines[i].at("path"), paths[i]);
    EXPECT_EQ(lines[i].at("status"), statuses[i]) << lines[i];
    EXPECT_EQ(lines[i].contains("error") ? lines[i]["error"]["code"].get<std::string>() : "",
              codes[i]);
  }
  // As the log alone.
  const Json alone = Json::parse(run("identify logs/b.json --json").out);
  EXPECT_EQ(lines[0].at("gains"), alone.at("gains"));
  EXPECT_EQ(lines[0].at("diagnostics"), alone.at("diagnostics"));
  EXPECT_EQ(files(), 1U);
}

TEST_F(Each, TheTableIsForPeople) {
  const Answer answer = run("identify logs");
  EXPECT_EQ(answer.status, 2);
  EXPECT_TRUE(holds(answer.out, "2 of 5 logs have gains")) << answer.out;
  EXPECT_TRUE(holds(answer.out, "1 other file passed over")) << answer.out;
  EXPECT_TRUE(holds(answer.out, "In logs/")) << answer.out;
  EXPECT_TRUE(holds(answer.out, "deep/a.JSON")) << answer.out;
  EXPECT_TRUE(holds(answer.out, "no_motion")) << answer.out;
}

// What is wanted of logs that are named one by one is said by an option; else they are compared.
TEST_F(Each, FilesAreComparedUnlessAskedOneByOne) {
  EXPECT_EQ(Json::parse(run("identify logs/b.json logs/deep/a.JSON --json").out).at("schema"),
            "flyball.identify_logs/1");
  const Answer answer = run("identify logs/deep/a.JSON logs/b.json --each --json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  const std::vector<Json> lines = lines_of(answer.out);
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].at("path"), "logs/b.json");
  EXPECT_EQ(lines[1].at("path"), "logs/deep/a.JSON");
}

TEST_F(Each, PartsGoTogetherByteByByte) {
  const Answer whole = run("identify logs --json --out whole");
  for (const std::string jobs : {"1", "3"}) {
    EXPECT_EQ(run("identify logs --json --jobs " + jobs).out, whole.out) << jobs;
  }
  for (const std::string part : {"1", "2", "3"}) {
    const Answer answer = run("identify logs --shard " + part + "/3 --json --out part" + part);
    EXPECT_NE(answer.out, whole.out);
    write("part" + part + ".jsonl", answer.out);
  }
  const Answer merged = run("merge part2 part3 part1 --json --out merged");
  EXPECT_EQ(merged.status, whole.status) << merged.err;
  EXPECT_EQ(merged.out, whole.out);
  EXPECT_EQ(run("merge part3.jsonl part1.jsonl part2.jsonl --json").out, whole.out);
  for (const char* file : {"logs.csv", "logs.jsonl", "result.json"}) {
    EXPECT_EQ(contents(work() / "merged" / file), contents(work() / "whole" / file)) << file;
    EXPECT_FALSE(contents(work() / "merged" / file).empty()) << file;
  }
  // The same folder for one part after the other gathers them.
  for (const std::string part : {"1", "2", "3"}) {
    EXPECT_NE(run("identify logs --shard " + part + "/3 --out gathered").out, "");
  }
  EXPECT_EQ(contents(work() / "gathered/logs.jsonl"), whole.out);

  const Answer missing = run("merge part1 part3 --json");
  EXPECT_EQ(missing.status, 2);
  EXPECT_EQ(Json::parse(missing.out).at("error").at("code"), "rows_missing") << missing.out;
  EXPECT_TRUE(holds(missing.err, "without 2 of 5 logs: those numbered 1, 4")) << missing.err;
  EXPECT_NE(run("identify logs --shard 2/3 --mechanism elevator --out other").out, "");
  const Answer differ = run("merge part1 other part3 --json");
  EXPECT_EQ(Json::parse(differ.out).at("error").at("code"), "rows_differ") << differ.out;
  EXPECT_EQ(Json::parse(run("merge logs/b.json --json").out).at("error").at("code"), "not_rows");
}

TEST_F(Each, PartsAreSpelledRight) {
  for (const char* part : {"0/3", "4/3", "1", "1/0", "-1/2", "1/3x", "a/b"}) {
    const Answer answer = run(std::string("identify logs --shard ") + part);
    EXPECT_EQ(answer.status, 2) << part;
    EXPECT_TRUE(holds(answer.err, "shard: the part is")) << answer.err;
  }
}

// More parts than logs: the empty ones are parts, too.
TEST_F(Each, APartMayBeEmpty) {
  for (const std::string part : {"1", "2", "3", "4", "5", "6"}) {
    EXPECT_EQ(run("identify logs --shard " + part + "/6 --out part" + part).err, "");
  }
  const Answer merged = run("merge part1 part2 part3 part4 part5 part6 --json");
  EXPECT_EQ(merged.out, run("identify logs --json").out) << merged.err;
}

// A row whose log has not changed is taken as it is: it is marked to tell.
TEST_F(Each, WhatIsDoneStaysDone) {
  EXPECT_EQ(run("identify logs --out done").err, "");
  const std::string rows = contents(work() / "done/logs.jsonl");
  const std::string word = "The gains can be used";
  ASSERT_TRUE(holds(rows, word)) << rows;
  const auto marked = [&](std::string text) {
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at)) {
      text.replace(at, word.size(), "Marked");
    }
    return text;
  };
  // As a run leaves it that was killed while it wrote a line.
  fs::remove_all(work() / "done");
  write("done.part.jsonl", marked(rows) + R"({"schema":"flyball.log_row/1","log":)");
  EXPECT_EQ(run("identify logs --json --out done").out, marked(rows));
  EXPECT_FALSE(fs::exists(work() / "done.part.jsonl"));
  // A log that changed is done again, alone.
  write("logs/b.json", contents(work() / "logs/b.json") + " ");
  const std::string again = run("identify logs --json --out done").out;
  EXPECT_EQ(lines_of(again)[2], lines_of(marked(rows))[2]);
  EXPECT_TRUE(holds(lines_of(again)[0].at("words"), word)) << again;
  // Other options are other rows.
  EXPECT_FALSE(holds(run("identify logs --json --mechanism elevator --out done").out, "Marked"));
}

TEST_F(Each, ALogIsBounded) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer reserves all memory";
#endif
  std::string rows;
  for (int i = 0; i < 200'000; ++i) {
    rows += (i == 0 ? "[" : ",[") + std::to_string(0.01 * i) + ",2.0,0.5,0.0]";
  }
  write("logs/deep/large.json", R"({"sysid": true, "test": "Elevator", "slow-forward": [)" + rows +
                                    R"(], "fast-forward": [)" + rows + "]}");
  const Answer answer = run("identify logs --json --log-memory 24 --out bounded");
  EXPECT_EQ(answer.status, 2);
  const std::vector<Json> lines = lines_of(answer.out);
  ASSERT_EQ(lines.size(), 6U);
  EXPECT_EQ(lines[3].at("path"), "logs/deep/large.json");
  ASSERT_TRUE(lines[3].contains("error")) << lines[3];
  EXPECT_EQ(lines[3].at("error").at("code"), "took_too_much_memory") << lines[3];
  EXPECT_EQ(lines[0].at("status"), 0) << lines[0];
  // With more memory it is tried again.
  const Answer again = run("identify logs --json --out bounded");
  EXPECT_FALSE(holds(again.out, "took_too_much_memory")) << again.out;
}

TEST_F(Each, AFolderWithoutLogs) {
  fs::create_directories(work() / "none");
  const Answer answer = run("identify none --json");
  EXPECT_EQ(answer.status, 2);
  EXPECT_EQ(Json::parse(answer.out).at("error").at("code"), "is_a_folder");
  EXPECT_TRUE(holds(answer.err, "without a log")) << answer.err;
  // A report in the folder is none of its logs.
  EXPECT_EQ(run("identify logs --out logs/report").status, 2);
  EXPECT_EQ(lines_of(run("identify logs --json").out).size(), 5U);
}

}  // namespace
}  // namespace flyball::test::each_command_test
