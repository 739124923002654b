#include <cmath>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::solve_command_test {
namespace {

using Json = nlohmann::json;

struct Case {
  const char* kind;
  const char* problem;               ///< Every necessary and optional field of issue and docs.
  std::vector<std::string> answers;  ///< What must be there.
};

class SolveCommand : public Command {
 protected:
  /// One answer a line.
  [[nodiscard]] std::vector<Json> solve(const std::string& kind, const std::string& lines,
                                        int status) const {
    write("problems", lines);
    const Answer answer = run("solve " + kind, "problems");
    EXPECT_EQ(answer.status, status) << kind << "\n" << answer.out.substr(0, 2000) << answer.err;
    std::vector<Json> answers;
    std::istringstream stream(answer.out);
    for (std::string line; std::getline(stream, line);) {
      answers.push_back(Json::parse(line, nullptr, false));
      EXPECT_FALSE(answers.back().is_discarded()) << line;
    }
    return answers;
  }
};

std::string code_of(const Json& answer) {
  return answer.contains("error") ? answer.at("error").at("code").get<std::string>() : "";
}

TEST_F(SolveCommand, EveryKind) {
  const std::vector<Case> cases = {
      {"dare",
       R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]],"N":[[0]]})",
       {"X", "K", "poles", "residual", "condition"}},
      {"care",
       R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]],"N":[[0]]})",
       {"X", "K", "poles", "residual", "condition"}},
      {"lyapunov", R"({"A":[[-2]],"Q":[[1]]})", {"X"}},
      {"discrete-lyapunov", R"({"A":[[0.5]],"Q":[[1]]})", {"X"}},
      {"sylvester", R"({"A":[[1]],"B":[[2]],"C":[[3]]})", {"X"}},
      {"discrete-sylvester", R"({"A":[[1]],"B":[[2]],"C":[[3]]})", {"X"}},
      {"expm", R"({"A":[[1]]})", {"X"}},
      {"logm", R"({"A":[[1]]})", {"X"}},
      {"powm", R"({"A":[[4]],"power":0.5})", {"X"}},
      {"c2d",
       R"({"A":[[-1]],"B":[[1]],"C":[[1]],"D":[[0]],"T":0.1,"method":"tustin","prewarp":1,
 "Q":[[1]],"R":[[1]]})",
       {"A", "B", "C", "D", "Q", "R"}},
      {"d2c",
       R"({"A":[[0.5]],"B":[[1]],"C":[[1]],"D":[[0]],"T":0.1,"method":"zoh"})",
       {"A", "B", "C", "D"}},
      {"lqr",
       R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]],"N":[[0]],"T":0.1})",
       {"K", "S", "poles"}},
      {"place", R"({"A":[[0,1],[0,0]],"B":[[0],[1]],"poles":[[-1,1],[-1,-1]]})", {"K", "poles"}},
      {"kalman", R"({"A":[[1]],"C":[[1]],"Q":[[1]],"R":[[1]]})", {"K", "P", "poles"}},
      {"gramians", R"({"A":[[-1]],"B":[[1]],"C":[[1]],"domain":"continuous"})", {"Wc", "Wo"}},
      {"analyze",
       R"({"A":[[-1]],"B":[[1]],"C":[[1]],"D":[[0]],"domain":"continuous"})",
       {"controllable", "observable", "stabilizable", "detectable", "poles", "uncontrollable_modes",
        "unobservable_modes"}},
      {"simulate",
       R"({"A":[[0.5]],"B":[[1]],"C":[[1]],"D":[[0]],"domain":"discrete","x0":[1],"u":[1,2]})",
       {"x", "y"}},
  };
  for (const Case& one : cases) {
    Json problem = Json::parse(one.problem);
    problem["id"] = {one.kind, 1.5, nullptr};
    const std::vector<Json> answers = solve(one.kind, problem.dump() + "\n", 0);
    ASSERT_EQ(answers.size(), 1U) << one.kind;
    EXPECT_EQ(answers[0].at("id"), problem["id"]);
    for (const std::string& field : one.answers) {
      EXPECT_TRUE(answers[0].contains(field)) << one.kind << " " << field;
    }
    if (answers[0].contains("poles")) {
      EXPECT_EQ(answers[0].at("poles").at(0).size(), 2U) << "a complex number is [re, im]";
    }
    // Each with an unknown field, an infinite entry, an empty matrix, and cut off.
    Json unknown = problem;
    unknown["Zeta"] = 1;
    Json infinite = problem;
    infinite["A"][0][0] = "inf";
    Json empty = problem;
    empty["A"] = Json::array();
    const std::string text = problem.dump();
    const std::vector<Json> refused =
        solve(one.kind,
              unknown.dump() + "\n" + infinite.dump() + "\n" + empty.dump() + "\n" +
                  text.substr(0, text.size() / 2) + "\n",
              2);
    ASSERT_EQ(refused.size(), 4U) << one.kind;
    EXPECT_EQ(code_of(refused[0]), "unknown_name") << one.kind;
    EXPECT_EQ(refused[0].at("id"), problem["id"]);
    EXPECT_EQ(code_of(refused[1]), "not_finite") << one.kind;
    EXPECT_FALSE(code_of(refused[2]).empty()) << one.kind;
    EXPECT_EQ(code_of(refused[3]), "malformed") << one.kind;
  }
}

// 0 all solved, 1 the mathematics says no to some, 2 some input is no problem at all; every line is
// answered, whatever stood before it.
TEST_F(SolveCommand, ExitStatus) {
  const std::string good = R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]],"id":1})";
  const std::string unsolvable = R"({"A":[[2]],"B":[[0]],"Q":[[1]],"R":[[1]],"id":2})";
  const std::string ragged = R"({"A":[[1,2],[3]],"B":[[0]],"Q":[[1]],"R":[[1]],"id":3})";
  EXPECT_EQ(solve("dare", good + "\n" + good, 0).size(), 2U);
  const std::vector<Json> no = solve("dare", unsolvable + "\n\n" + good + "\n", 1);
  ASSERT_EQ(no.size(), 2U);
  EXPECT_EQ(code_of(no[0]), "not_stabilizable");
  EXPECT_EQ(no[0].at("error").at("eigenvalue").at(0), 2.0);
  EXPECT_EQ(code_of(no[1]), "");
  const std::vector<Json> bad = solve("dare", ragged + "\n" + unsolvable + "\n" + good + "\n", 2);
  ASSERT_EQ(bad.size(), 3U);
  EXPECT_EQ(bad[0].at("id"), 3);
  EXPECT_EQ(code_of(bad[2]), "");

  write("problems", good);
  const Answer kind = run("solve dear", "problems");
  EXPECT_EQ(kind.status, 2);
  EXPECT_TRUE(holds(kind.err, "did you mean \"dare\"?")) << kind.err;
  EXPECT_EQ(Json::parse(kind.out).at("error").at("code"), "unknown_name");
  EXPECT_EQ(run("solve dare").status, 2) << "nothing on standard input";
  const Answer none = run("solve", "problems");
  EXPECT_EQ(none.status, 2);
  EXPECT_TRUE(holds(none.err, "KIND is left out")) << none.err;
}

TEST_F(SolveCommand, IdsAreEchoedToTheByte) {
  for (const char* id : {"0", "-7", "9007199254740993", "18446744073709551615",
                         "18446744073709551616", "1.50e+3", "-0.0", "1e2", "true", "null", "\"\"",
                         R"("a\u00e9\ud83d\ude00\/\u0000\"}")", "\"ü\x7f\""}) {
    for (const char* problem : {R"(,"A":[[0]]})", R"(,"A":0})"}) {
      write("problems", "{\"id\": " + std::string(id) + problem + "\n");
      const Answer answer = run("solve expm", "problems");
      EXPECT_TRUE(answer.out.starts_with("{\"id\":" + std::string(id) + ",") ||
                  answer.out.starts_with("{\"id\": " + std::string(id) + ","))
          << answer.out;
    }
  }
}

TEST_F(SolveCommand, ANulIsAnError) {
  const std::string nul(1, '\0');
  const std::string good = R"({"A":[[0]]})";
  const std::vector<Json> answers = solve(
      "expm", good + nul + "\n" + nul + good + "\n{" + nul + "\"A\":[[0]]}\n" + good + "\n", 2);
  ASSERT_EQ(answers.size(), 4U);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(code_of(answers[static_cast<std::size_t>(k)]), "malformed") << k;
  }
  EXPECT_EQ(answers[0].at("error").at("column"), 12);
  EXPECT_TRUE(answers[3].contains("X"));
}

// An object over several lines is answered when it is whole, whatever follows.
TEST_F(SolveCommand, TheFirstObjectMayStandOnSeveralLines) {
  const std::vector<Json> answers = solve(
      "expm", "\n {\n\"A\": [\n[0, 1],\n[0, 0]],\n\"id\": \"}\\\"{\"}\n{\"A\":[[0]],\"id\":2}\nx\n",
      2);
  ASSERT_EQ(answers.size(), 3U);
  EXPECT_EQ(answers[0].at("id"), "}\"{");
  EXPECT_EQ(answers[1].at("id"), 2);
  EXPECT_EQ(code_of(answers[2]), "malformed");
  const std::vector<Json> broken = solve("expm", "{\"A\":[[0]\n{\"A\":[[0]]}\n", 2);
  ASSERT_EQ(broken.size(), 2U);
  EXPECT_TRUE(broken[1].contains("X"));
}

// What is told of the kinds comes from their rows; the problem that a kind's help shows has an
// answer.
TEST_F(SolveCommand, ListAndHelp) {
  const Answer list = run("solve --list");
  EXPECT_EQ(list.status, 0);
  for (const char* kind : {"dare", "hinf-norm", "feedback", "lqi", "pid-reaction", "kalman"}) {
    EXPECT_TRUE(holds(list.out, std::string("\n  ") + kind + " ")) << kind;
    const Answer help = run(std::string("solve ") + kind + " --help");
    EXPECT_EQ(help.status, 0);
    EXPECT_TRUE(help.err.empty()) << help.err;
    const std::size_t from = help.out.find("echo '") + 6;
    const std::string example = help.out.substr(from, help.out.find('\'', from) - from);
    EXPECT_EQ(solve(kind, example + "\n", 0).size(), 1U) << help.out;
  }
  const std::string dare = run("solve dare --help").out;
  for (const char* line : {"flyball solve dare: AᵀXA - X", "A problem has A B Q R [N]", "n x m",
                           "[1/state²]", "the stabilizing solution"}) {
    EXPECT_TRUE(holds(dare, line)) << line << "\n" << dare;
  }
  EXPECT_EQ(dare, run("solve --help dare").out);
  const Answer general = run("solve --help");
  EXPECT_EQ(general.status, 0);
  EXPECT_TRUE(holds(general.out, "flyball solve --list")) << general.out;
  const Answer unknown = run("solve dear --help");
  EXPECT_EQ(unknown.status, 2);
  EXPECT_TRUE(holds(unknown.err, "did you mean \"dare\"?")) << unknown.err;
  const Json schema = Json::parse(run("solve --schema").out);
  EXPECT_TRUE(schema.at("$defs").contains("dare.problem"));
}

// One object over several lines is one problem, also when it is broken.
TEST_F(SolveCommand, ObjectsOverSeveralLines) {
  EXPECT_EQ(solve("expm", "{\n \"A\":\n [[0]]\n}\n", 0).size(), 1U);
  const std::vector<Json> broken = solve("expm", "{\n \"A\":\n [[0,]]\n}\n", 2);
  ASSERT_EQ(broken.size(), 1U);
  EXPECT_EQ(broken[0].at("error").at("line"), 3);
  EXPECT_EQ(solve("expm", "{\"A\":\n{\"A\":[[0]]}\n{\"A\":[[1]]}\n", 2).size(), 3U);
  EXPECT_EQ(solve("expm", "{\"A\":\n{\"A\":\nnonsense\n", 2).size(), 3U);
  EXPECT_EQ(solve("expm", "{\"A\":[[0]]}\r\n{\"A\":[[1]]}\r\n", 0).size(), 2U);
}

TEST_F(SolveCommand, InfinitiesAreTexts) {
  // Whatever has no inverse is infinitely far from one that has.
  const Json json =
      solve("analyze", R"({"A":[[1,0],[0,2]],"B":[[0],[1]],"domain":"discrete"})", 0).at(0);
  EXPECT_EQ(json.at("controllability_condition"), "inf");
  EXPECT_EQ(json.at("uncontrollable_modes"), Json::parse("[[1.0, 0.0]]"));
  // An unstable simulation leaves the doubles: said, not answered with numbers that are none.
  std::string inputs = "0";
  for (int k = 0; k < 2000; ++k) {
    inputs += ",0";
  }
  const Json grown =
      solve("simulate",
            R"({"A":[[2]],"B":[[1]],"x0":[1],"domain":"discrete","u":[)" + inputs + "]}", 2)
          .at(0);
  EXPECT_EQ(code_of(grown), "not_finite");
}

TEST_F(SolveCommand, ManyAndLongLines) {
  std::string lines;
  for (int k = 0; k < 100000; ++k) {
    lines += "{\"id\":" + std::to_string(k) + ",\"A\":[[" + std::to_string(k % 7) + "]]}\n";
  }
  write("problems", lines);
  const Answer answer = run("solve expm", "problems");
  EXPECT_EQ(answer.status, 0);
  EXPECT_EQ(std::count(answer.out.begin(), answer.out.end(), '\n'), 100000);
  const std::string last = answer.out.substr(answer.out.rfind('\n', answer.out.size() - 2) + 1);
  EXPECT_TRUE(last.starts_with("{\"id\":99999,\"X\":[[" + Json(std::exp(99999 % 7)).dump() + "]],"))
      << last;

  std::string row = "1";
  for (int k = 0; k < 5'000'000; ++k) {
    row += ",1";
  }
  const std::vector<Json> answers =
      solve("expm",
            "{\"id\":1,\"A\":[[" + row + "]]}\n{\"id\":\"" + std::string(10'000'000, 'x') +
                "\",\"A\":[[0]]}\n" + std::string(10'000'000, '[') + "\n{\"A\":[[0]]}\n",
            2);
  ASSERT_EQ(answers.size(), 4U);
  EXPECT_EQ(code_of(answers[0]), "wrong_shape");
  EXPECT_EQ(answers[1].at("id").get<std::string>().size(), 10'000'000U);
  EXPECT_EQ(code_of(answers[2]), "malformed");
  EXPECT_EQ(code_of(answers[3]), "");
}

}  // namespace
}  // namespace flyball::test::solve_command_test
