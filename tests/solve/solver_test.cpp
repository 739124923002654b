#include <cmath>
#include <string>

#include "answers.hpp"

namespace flyball::solve::solver_test {
namespace {

// x² - 4x - 1 = 0 and 2x - x² + 1 = 0.
TEST(Solve, RiccatiEquations) {
  const Json dare = answer("dare", R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]]})");
  EXPECT_NEAR(entry(dare, "X"), 2.0 + std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(entry(dare, "K"), 0.5 + 0.5 * std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(entry(dare, "poles"), 1.5 - 0.5 * std::sqrt(5.0), 1e-14);
  EXPECT_EQ(entry(dare, "poles", 0, 1), 0.0);
  EXPECT_LT(dare.at("residual").get<double>(), 1e-15);
  EXPECT_GT(dare.at("condition").get<double>(), 0.0);
  const Json care = answer("care", R"({"A":[[1]],"B":[[1]],"Q":[[1]],"R":[[1]],"N":[[0]]})");
  EXPECT_NEAR(entry(care, "X"), 1.0 + std::sqrt(2.0), 1e-14);
  const Json cross = answer("care", R"({"A":[[1]],"B":[[1]],"Q":[[5]],"R":[[1]],"N":[[1]]})");
  EXPECT_NEAR(entry(cross, "X"), 2.0, 1e-14);
}

TEST(Solve, LinearEquations) {
  EXPECT_EQ(entry(answer("lyapunov", R"({"A":[[-2]],"Q":[[4]]})"), "X"), 1.0);
  EXPECT_EQ(entry(answer("discrete-lyapunov", R"({"A":[[0.5]],"Q":[[3]]})"), "X"), 4.0);
  EXPECT_EQ(entry(answer("sylvester", R"({"A":[[2]],"B":[[3]],"C":[[10]]})"), "X"), 2.0);
  EXPECT_EQ(entry(answer("discrete-sylvester", R"({"A":[[2]],"B":[[3]],"C":[[10]]})"), "X"), -2.0);
}

TEST(Solve, MatrixFunctions) {
  EXPECT_NEAR(entry(answer("expm", R"({"A":[[0,1],[0,0]]})"), "X", 0, 1), 1.0, 1e-16);
  EXPECT_NEAR(entry(answer("logm", R"({"A":[[2,1],[0,2]]})"), "X", 0, 1), 0.5, 1e-15);
  EXPECT_NEAR(entry(answer("powm", R"({"A":[[4]],"power":-0.5})"), "X"), 0.5, 1e-16);
}

// The integrator: A = 1, B = T; Tustin's D is T/2; Q and R by (7.8) and (7.9).
TEST(Solve, Conversions) {
  const std::string integrator = R"("A":[[0]],"B":[[1]],"C":[[1]],"D":[[0]],"T":0.02)";
  const Json zoh = answer("c2d", "{" + integrator + R"(,"Q":[[2]],"R":[[3]]})");
  EXPECT_EQ(entry(zoh, "B"), 0.02);
  EXPECT_NEAR(entry(zoh, "Q"), 0.04, 1e-17);
  EXPECT_NEAR(entry(zoh, "R"), 150.0, 1e-12);
  EXPECT_NEAR(entry(answer("c2d", "{" + integrator + R"(,"method":"tustin"})"), "D"), 0.01, 1e-17);
  const Json back = answer("d2c", R"({"A":[[0.5]],"B":[[1]],"T":0.1,"method":"zoh"})");
  EXPECT_NEAR(entry(back, "A"), std::log(0.5) / 0.1, 1e-13);
  EXPECT_EQ(refusal("c2d", "{" + integrator + R"(,"method":"tustn"})"), "unknown_name");
  EXPECT_EQ(refusal("c2d", R"({"A":[[0]],"B":[[1]],"T":0})"), "not_positive");
}

TEST(Solve, Designs) {
  // The double integrator with Q = diag(1, 2), R = 1: K = [1 2].
  const std::string plant = R"("A":[[0,1],[0,0]],"B":[[0],[1]])";
  const Json lqr = answer("lqr", "{" + plant + R"(,"Q":[[1,0],[0,2]],"R":[[1]]})");
  EXPECT_NEAR(entry(lqr, "K", 0, 1), 2.0, 1e-14);
  // Sampled, and the same sampled by hand.
  const Json sampled = answer("lqr", "{" + plant + R"(,"Q":[[1,0],[0,2]],"R":[[1]],"T":0.5})");
  const Json by_hand =
      answer("dare", R"({"A":[[1,0.5],[0,1]],"B":[[0.125],[0.5]],"Q":[[1,0],[0,2]],"R":[[1]]})");
  EXPECT_NEAR(entry(sampled, "K", 0, 0), entry(by_hand, "K", 0, 0), 1e-14);
  const Json place = answer("place", "{" + plant + R"(,"poles":[[-1,1],[-1,-1]]})");
  EXPECT_NEAR(entry(place, "K", 0, 0), 2.0, 1e-14);
  EXPECT_NEAR(entry(place, "K", 0, 1), 2.0, 1e-14);
  // A random walk in as much noise: P = (1 + √5)/2, K = P/(P + 1).
  const Json kalman = answer("kalman", R"({"A":[[1]],"C":[[1]],"Q":[[1]],"R":[[1]]})");
  const double P = 0.5 + 0.5 * std::sqrt(5.0);
  EXPECT_NEAR(entry(kalman, "P"), P, 1e-15);
  EXPECT_NEAR(entry(kalman, "K"), P / (P + 1.0), 1e-15);
}

TEST(Solve, Analysis) {
  const Json gramians =
      answer("gramians", R"({"A":[[-1]],"B":[[2]],"C":[[1]],"domain":"continuous"})");
  EXPECT_NEAR(entry(gramians, "Wc"), 2.0, 1e-15);
  EXPECT_NEAR(entry(gramians, "Wo"), 0.5, 1e-15);
  EXPECT_NEAR(gramians.at("hankel_singular_values").at(0).get<double>(), 1.0, 1e-15);
  const Json analysis =
      answer("analyze", R"({"A":[[1,0],[0,-2]],"B":[[0],[1]],"C":[[1,0]],"domain":"continuous"})");
  EXPECT_FALSE(analysis.at("controllable").get<bool>());
  EXPECT_FALSE(analysis.at("stabilizable").get<bool>());
  EXPECT_FALSE(analysis.at("observable").get<bool>());
  EXPECT_TRUE(analysis.at("detectable").get<bool>());
  EXPECT_NEAR(entry(analysis, "uncontrollable_modes"), 1.0, 1e-12);
  EXPECT_NEAR(entry(analysis, "unobservable_modes"), -2.0, 1e-12);
  const Json simulation =
      answer("simulate", R"({"A":[[0]],"B":[[1]],"domain":"continuous","T":0.5,"u":[[1],[2]]})");
  EXPECT_EQ(entry(simulation, "x", 2), 1.5);
  EXPECT_EQ(entry(simulation, "y", 1), 0.5);
}

TEST(Solve, EchoesTheId) {
  const Json json = answer("expm", R"({"id":{"run":[7,"a"]},"A":[[0]]})");
  EXPECT_EQ(json.at("id"), Json::parse(R"({"run":[7,"a"]})"));
  EXPECT_EQ(answer("expm", R"({"id":3})").at("id"), 3);
  // A text to the byte; in lists and objects what a terminal would obey is escaped.
  const auto line = [](const std::string& id) {
    return Solver::create("expm").value().solve("{\"id\":" + id + ",\"A\":[[0]]}").json;
  };
  const std::string hostile = "\"a\x7f\u009b[2J\u202e\"";
  EXPECT_TRUE(line(hostile).starts_with("{\"id\":" + hostile + ",")) << line(hostile);
  EXPECT_EQ(Json::parse(line(hostile)).at("id"), Json::parse(hostile));
  EXPECT_EQ(Json::parse(line("[" + hostile + "]")).at("id"), Json::parse("[" + hostile + "]"));
  for (const char c : line("{\"k\":" + hostile + "}")) {
    EXPECT_TRUE(c >= ' ' && c < '\x7f');
  }
  EXPECT_TRUE(line("\"é \\u00e9/\\/\"").starts_with("{\"id\":\"é \\u00e9/\\/\","));
  // Of a problem that there is no memory for, as far as it was read.
  const auto forgotten = [](const std::string& beginning) {
    return Json::parse(Solver::without_memory(beginning).json);
  };
  EXPECT_EQ(forgotten(R"({"id":12,"A":[[0,)").at("id"), 12);
  EXPECT_EQ(forgotten(R"({"id":["a"],"A":[[0,)").at("id"), Json::parse(R"(["a"])"));
  EXPECT_EQ(forgotten(R"({"id":12,"A":[[0,)").at("error").at("code"), "not_enough_memory");
  for (const char* open : {R"({"id":12)", R"({"id":"a)", R"({"id":[1,)", R"({"A":[[0,)", "{", ""}) {
    EXPECT_FALSE(forgotten(open).contains("id")) << open;
  }
}

TEST(Solve, NumbersRoundTrip) {
  const double value = 0.1 + 0.2;
  const Json json = answer("expm", Json{{"A", {{std::log(value)}}}}.dump());
  EXPECT_EQ(entry(json, "X"), std::exp(std::log(value)));
}

TEST(Solve, RefusesWithEvidence) {
  const Json json =
      answer("dare", R"({"A":[[1.2,0],[0,0.9]],"B":[[0],[1]],"Q":[[1,0],[0,1]],"R":[[1]]})");
  EXPECT_EQ(json.at("error").at("code"), "not_stabilizable");
  EXPECT_NEAR(json.at("error").at("eigenvalue").at(0).get<double>(), 1.2, 1e-12);
  const Answer none = Solver::create("logm").value().solve(R"({"A":[[-1]]})");
  EXPECT_EQ(none.kind, ErrorKind::no_answer);
}

TEST(Solve, RefusesBadInput) {
  EXPECT_EQ(refusal("dare", R"({"A":[[1]],"B":[[1]],"Q":[[1]],"R":[[1]],"q":1})"), "unknown_name");
  EXPECT_EQ(refusal("dare", R"({"A":[[1]],"B":[[1]],"Q":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("dare", R"({"A":[[1,2],[3]],"B":[[1]],"Q":[[1]],"R":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("dare", R"({"A":[1,2],"B":[[1]],"Q":[[1]],"R":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("dare", R"({"A":[["x"]],"B":[[1]],"Q":[[1]],"R":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("dare", R"({"A":[[1]],"B":[[1],[2]],"Q":[[1]],"R":[[1]]})"), "wrong_shape");
  const Json flat = answer("dare", R"({"A":[[1]],"B":[0,1],"Q":[[1]],"R":[[1]]})");
  EXPECT_EQ(flat.at("error").at("message"),
            "dare: B is [0, 1], without rows; it must be a list of rows: [[0], [1]] is a column, "
            "[[0, 1]] a row");
  EXPECT_EQ(refusal("expm", R"({"A":[[)"), "malformed");
  EXPECT_EQ(refusal("expm", "[1, 2]"), "malformed");
  EXPECT_EQ(refusal("expm", "\xff\xfe{"), "malformed");
  EXPECT_EQ(refusal("expm", R"({"A":[]})"), "empty");
  EXPECT_EQ(refusal("expm", R"({"A":[["inf"]]})"), "not_finite");
  EXPECT_EQ(refusal("expm", R"({"A":[["nan"]]})"), "not_finite");
  EXPECT_EQ(refusal("expm", R"({"A":[[1e999]]})"), "malformed");
  EXPECT_EQ(refusal("place", R"({"A":[[1]],"B":[[1]],"poles":[[1,2,3]]})"), "malformed");
  EXPECT_EQ(refusal("gramians", R"({"A":[[1]],"B":[[1]],"C":[[1]],"domain":"z"})"), "unknown_name");
  EXPECT_EQ(refusal("simulate", R"({"A":[[1]],"B":[[1]],"u":[[1]],"domain":"continuous"})"),
            "malformed");
  const Json twice = answer("expm", "{\"A\": [[1]],\n  \"A\": [[2]]}").at("error");
  EXPECT_EQ(twice.at("code"), "malformed");
  EXPECT_EQ(twice.at("message"),
            "expm: the problem is an object with the key \"A\" twice; it must be an object with "
            "each key once "
            "(line = 2, column = 3)");
  EXPECT_EQ(twice.at("line"), 2);
  EXPECT_EQ(twice.at("column"), 3);
  EXPECT_EQ(answer("expm", "{\"A\":\n x}").at("error").at("line"), 2);
  EXPECT_EQ(answer("dare", R"({"A":[[1]],"B":[[1]],"Q":[[1]]})").at("error").at("message"),
            "dare: R is left out; it must be there; a problem needs A, B, Q, R");
  EXPECT_EQ(Solver::create("dear").error().code(), "unknown_name");
}

// Long and deep text costs time and memory in proportion, and no more.
TEST(Solve, SurvivesLongAndDeepText) {
  std::string zeros = "0";
  for (int k = 0; k < 1000000; ++k) {
    zeros += ",0";
  }
  EXPECT_EQ(refusal("expm", R"({"A":[[)" + zeros + "]]}"), "wrong_shape");
  EXPECT_EQ(refusal("expm", R"({"A":)" + std::string(1000000, '[')), "malformed");
  EXPECT_EQ(
      refusal("expm", R"({"A":)" + std::string(1000000, '[') + std::string(1000000, ']') + "}"),
      "malformed");
  EXPECT_EQ(refusal("expm", R"({"id":)" + std::string(1000000, '[') + std::string(1000000, ']') +
                                R"(,"A":[[0]]})"),
            "malformed");
  EXPECT_EQ(refusal("expm", R"({"id":"[[\"]]","A":[[0]]})"), "");
  EXPECT_EQ(refusal("expm", R"({")" + std::string(10000000, 'a') + R"(":1})"), "unknown_name");
}

}  // namespace
}  // namespace flyball::solve::solver_test
