#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "solve/answers.hpp"
#include "support/oracle.hpp"

namespace flyball::solve::transfer_problem_test {
namespace {

/// The same problem, once in words and once in lists.
struct Told {
  const char* kind;
  const char* more;  ///< Further fields, with a comma before them.
};

// An expression is the same as its coefficients, in every kind.
TEST(SolveTransferProblem, WordsAndListsAreAnsweredAlike) {
  for (const Told& told : {Told{"tf", ""},
                           {"tf2ss", ""},
                           {"closed-loop-poles", ""},
                           {"steady-state-error", ""},
                           {"step", R"(, "duration": 3)"},
                           {"freqresp", R"(, "w": [0.1, 1, 10])"},
                           {"bode", R"(, "w": [0.1, 1, 10])"},
                           {"nyquist", ""},
                           {"margins", ""},
                           {"pidtune", R"(, "form": "pi")"},
                           {"compensator", R"(, "crossover": 1.4, "phase_margin": 45)"},
                           {"limit-cycles", R"(, "nonlinearity": "relay")"}}) {
    const Json words = answer(
        told.kind, std::string(R"j({"expr": "4/(s^3+3s^2+3s+1)*exp(-0.1*s)", "delay": 0.1)j") +
                       told.more + "}");
    const Json lists =
        answer(told.kind, std::string(R"j({"num": [4], "den": [1, 3, 3, 1], "delay": 0.2)j") +
                              told.more + "}");
    EXPECT_FALSE(words.contains("error")) << told.kind << ": " << words;
    EXPECT_EQ(words, lists) << told.kind;
  }
  EXPECT_EQ(answer("rlocus", R"j({"expr": "4/(s^3+3s^2+2s)"})j"),
            answer("rlocus", R"j({"num": [4], "den": [1, 3, 2, 0]})j"));
  EXPECT_EQ(answer("tf", R"j({"expr": "0.1*z^-1/(1-0.5z^-1)", "dt": 0.1})j"),
            answer("tf", R"j({"num": [0.1], "den": [1, -0.5], "dt": 0.1})j"));
  // s²/(s + 1) = s - 1 + 1/(s + 1), improper.
  const Json improper = answer("residue", R"j({"expr": "s^2/(s+1)"})j");
  EXPECT_EQ(improper.at("polynomial").size(), 2U);
  EXPECT_NEAR(entry(improper, "residues", 0, 0), 1.0, 1e-14);
  const Json pair = answer("interconnect", R"j({"G": "1/(s+1)", "H": {"expr": "2/(s+3)"}})j");
  const Json lists = answer("interconnect", R"j({"G": {"num": [1], "den": [1, 1]},
                                                  "H": {"num": [2], "den": [1, 3]}})j");
  EXPECT_EQ(pair.at("series"), lists.at("series"));
}

TEST(SolveTransferProblem, SeveralDeadTimes) {
  constexpr const char* L = R"j({"expr": "0.5*(exp(-s) + exp(-3s))/s")j";
  const double pi = std::acos(-1.0);
  const Json margins = answer("margins", std::string(L) + "}");
  EXPECT_NEAR(number(margins, "gain_margin"), pi / (4.0 * std::cos(pi / 4.0)), 1e-11);
  const Json response = answer("freqresp", std::string(L) + R"(, "w": [0.7]})");
  EXPECT_NEAR(response.at("real")[0].get<double>(), -std::sin(1.4) * std::cos(0.7) / 0.7, 1e-14);
  EXPECT_EQ(answer("nyquist", std::string(L) + "}").at("encirclements"), 0);
  EXPECT_TRUE(answer("closed-loop-poles", std::string(L) + "}").at("stable").get<bool>());
  const Json step = answer("step", std::string(L) + R"(, "duration": 4, "samples": 9})");
  EXPECT_NEAR(step.at("y").back().get<double>(), 0.5 * (3.0 + 1.0), 1e-10);
  for (const char* kind : {"rlocus", "pidtune", "steady-state-error"}) {
    EXPECT_EQ(refusal(kind, std::string(L) + "}"), "delay_in_loop") << kind;
  }
  const Json whole = answer("tf", std::string(L) + "}");
  EXPECT_EQ(whole.at("gain_margins"), margins.at("gain_margins"));
  EXPECT_EQ(number(whole, "delay_margin"), number(margins, "delay_margin"));
  EXPECT_FALSE(whole.contains("zeros"));
  EXPECT_FALSE(whole.at("stable").get<bool>());  // The integrator.
  EXPECT_TRUE(whole.at("closed_loop_stable").get<bool>());
}

/// C (sI - A)⁻¹ B + D of a form whose dead times were drawn out of it, by its own equations.
std::complex<double> response_of(const Json& form, double w) {
  const auto n = form.at("A").size();
  const auto k = form.at("delays").size();
  const std::complex<double> s(0.0, w);
  Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(static_cast<long>(n + k), static_cast<long>(n + k));
  Eigen::VectorXcd right(static_cast<long>(n + k));
  Eigen::RowVectorXcd seen(static_cast<long>(n + k));
  const auto at = [](std::size_t i) { return static_cast<long>(i); };
  std::vector<std::complex<double>> late;
  for (const double delay : form.at("delays").get<std::vector<double>>()) {
    late.push_back(std::exp(-s * delay));
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      M(at(i), at(j)) = (i == j ? s : 0.0) - entry(form, "A", i, j);
    }
    for (std::size_t j = 0; j < k; ++j) {
      M(at(i), at(n + j)) = -entry(form, "B_w", i, j) * late[j];
      M(at(n + j), at(i)) = -entry(form, "C_z", j, i);
    }
    right(at(i)) = entry(form, "B", i, 0);
    seen(at(i)) = entry(form, "C", 0, i);
  }
  for (std::size_t i = 0; i < k; ++i) {
    for (std::size_t j = 0; j < k; ++j) {
      M(at(n + i), at(n + j)) = (i == j ? 1.0 : 0.0) - entry(form, "D_zw", i, j) * late[j];
    }
    right(at(n + i)) = entry(form, "D_z", i, 0);
    seen(at(n + i)) = entry(form, "D_w", 0, i) * late[i];
  }
  return (seen * test::solve(M, Eigen::MatrixXcd(right)))(0) + entry(form, "D");
}

// Loops with dead time are answered with the dead times drawn out of them: e^{-s}/(s + 1) in a loop
// with 2/(s + 3).
TEST(SolveTransferProblem, DeadTimesDrawnOut) {
  const auto G = [](std::complex<double> s) { return std::exp(-s) / (s + 1.0); };
  const auto H = [](std::complex<double> s) { return 2.0 / (s + 3.0); };
  const Json pair = answer("interconnect", R"j({"G": "exp(-s)/(s+1)", "H": "2/(s+3)"})j");
  EXPECT_EQ(number(pair.at("series"), "delay"), 1.0);
  EXPECT_FALSE(pair.contains("feedback_neg"));
  int compared = 0;
  for (const Json& one : pair.at("delayed")) {
    for (const double w : {0.0, 0.3, 2.0, 11.0}) {
      const std::complex<double> s(0.0, w);
      const std::string name = one.at("name");
      const std::complex<double> want = name == "parallel"       ? G(s) + H(s)
                                        : name == "feedback_neg" ? G(s) / (1.0 + G(s) * H(s))
                                                                 : G(s) / (1.0 - G(s) * H(s));
      EXPECT_LE(std::abs(response_of(one, w) - want), 1e-13) << name << ' ' << w;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 12);
  const Json system =
      answer("tf2ss", R"j({"expr": "feedback(exp(-s)/(s+1), 2/(s+3)*exp(-0.3s))"})j");
  for (const double w : {0.1, 1.0, 7.0}) {
    const std::complex<double> s(0.0, w);
    const auto want = G(s) / (1.0 + G(s) * H(s) * std::exp(-0.3 * s));
    EXPECT_LE(std::abs(response_of(system, w) - want), 1e-13) << w;
  }
  const Json row = answer("tf2ss", R"j({"G": [["exp(-s)/(s+1)", "1/(s+2)"]]})j");
  EXPECT_EQ(row.at("delays"), Json({1.0}));
  EXPECT_LE(std::abs(response_of(row, 0.7) - G({0.0, 0.7})), 1e-14);
}

// What is written as factors keeps their roots: of (s + 1)^20 multiplied out they would be off by
// 0.05.
TEST(SolveTransferProblem, FactorsKeepTheirRoots) {
  const Json many = answer("tf", R"j({"expr": "(s+3)^2/((s+1)^20*(s+0.1)^6)"})j");
  ASSERT_EQ(many.at("poles").size(), 26U);
  for (std::size_t i = 0; i < 26; ++i) {
    EXPECT_NEAR(entry(many, "poles", i, 0), entry(many, "poles", i, 0) < -0.5 ? -1.0 : -0.1, 1e-15);
    EXPECT_EQ(entry(many, "poles", i, 1), 0.0);
  }
  EXPECT_NEAR(entry(many, "zeros", 1, 0), -3.0, 1e-15);
  const Json states = answer("tf2ss", R"j({"expr": "1/(s+1)^20"})j");
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(entry(states, "A", i, i), -1.0);
  }
}

// Numbers near the end of the doubles' range: 10^200/(s + 10^-100) crosses at 10^200 rad/s.
TEST(SolveTransferProblem, ExtremeUnits) {
  const Json huge = answer("margins", R"j({"expr": "1e200/(s+1e-100)"})j");
  ASSERT_EQ(huge.at("phase_margins").size(), 1U);
  EXPECT_NEAR(huge.at("phase_margins")[0].at("w").get<double>() / 1e200, 1.0, 1e-12);
  EXPECT_NEAR(number(huge, "phase_margin"), 90.0, 1e-9);
  EXPECT_TRUE(huge.at("stable").get<bool>());
  const Json slow = answer("margins", R"j({"expr": "1/(s+1e-300)"})j");
  EXPECT_NEAR(slow.at("phase_margins")[0].at("w").get<double>(), 1.0, 1e-12);
  EXPECT_NEAR(number(slow, "phase_margin"), 90.0, 1e-9);
  const Json loop = answer("margins", R"j({"expr": "1e-150/(s*(s+1e-150))"})j");
  EXPECT_EQ(loop.at("phase_margins").size(), 1U);
}

TEST(SolveTransferProblem, Refusals) {
  EXPECT_EQ(refusal("tf", R"j({"expr": "1/(s+1"})j"), "unclosed_parenthesis");
  EXPECT_EQ(refusal("tf", R"({"expr": "1/z"})"), "period_missing");
  EXPECT_EQ(refusal("tf", R"({"expr": "1/s", "dt": 0.1})"), "period_without_z");
  EXPECT_EQ(refusal("tf", R"({"expr": "1/s", "num": [1]})"), "malformed");
  EXPECT_EQ(refusal("tf", R"({"num": [1]})"), "malformed");
  EXPECT_EQ(refusal("tf", "{}"), "malformed");
  EXPECT_EQ(refusal("tf", R"({"expr": 3})"), "malformed");
  EXPECT_EQ(refusal("tf", R"({"expr": ""})"), "empty_formula");
  EXPECT_EQ(refusal("margins", "{}"), "malformed");
  EXPECT_EQ(refusal("margins", R"({"expr": "1/s", "A": [[1]]})"), "malformed");
  EXPECT_EQ(refusal("interconnect", R"({"G": {"num": [1]}, "H": "1"})"), "malformed");
  EXPECT_EQ(refusal("residue", R"({"expr": "exp(-s)/s"})"), "out_of_range");
  // A delay that is no period and is not nothing.
  EXPECT_EQ(refusal("tf2ss", R"({"delay": 5e-324, "den": [1, 0.5, 0.5, -0.95], "dt": 100,
                                 "num": [0.05, -0.4, 1]})"),
            "out_of_range");
}

// [1/(s+1), 2/(s+1); 1/(s+2), 1/(s+2)]: each row's pole once, two states in all.
TEST(SolveTransferProblem, MatricesOfTransferFunctions) {
  const Json there = answer("tf2ss", R"j({"G": [["1/(s+1)", {"num": [2], "den": [1, 1]}],
                                              ["1/(s+2)", "1/(s+2)"]]})j");
  ASSERT_FALSE(there.contains("error")) << there;
  EXPECT_EQ(there.at("A").size(), 2U);
  EXPECT_EQ(there.at("D"), Json::parse("[[0.0, 0.0], [0.0, 0.0]]"));
  Json back = there;
  back.erase("delay");
  const Json channels = answer("ss2tf", back.dump());
  ASSERT_EQ(channels.at("G").size(), 2U);
  const Json& entry = channels.at("G")[0][1];
  EXPECT_NEAR(entry.at("num").back().get<double>() / entry.at("den").back().get<double>(), 2.0,
              1e-12);
  const Json sampled =
      answer("tf2ss", R"j({"G": [["1/(z-0.5)", "z^-1"]], "dt": 0.1, "delay": 0.1})j");
  ASSERT_FALSE(sampled.contains("error")) << sampled;
  EXPECT_EQ(sampled.at("A").size(), 3U);
  EXPECT_EQ(refusal("tf2ss", R"({"G": [["1/s", "1"], ["1"]]})"), "malformed");
  EXPECT_EQ(refusal("tf2ss", R"({"G": []})"), "malformed");
  EXPECT_EQ(refusal("tf2ss", R"({"G": [["1/s"]], "num": [1]})"), "malformed");
  EXPECT_EQ(answer("tf2ss", R"j({"G": [["exp(-s)/s", "1/s"]]})j").at("delays"), Json({1.0}));
  EXPECT_EQ(refusal("tf2ss", R"({"G": [["s"]]})"), "improper");
}

// PI and plant under unity feedback: y/r = (2s + 1)/(s² + 3s + 1).
TEST(SolveConnect, Diagrams) {
  constexpr const char* loop = R"j({"blocks": [
      {"name": "C", "inputs": ["e"], "outputs": ["u"], "expr": "2 + 1/s"},
      {"name": "G", "inputs": ["u"], "outputs": ["y"], "A": [[-1]], "B": [[1]]}],
      "sums": [{"output": "e", "terms": ["r", "-y"]}], "inputs": ["r"], "outputs": ["y", "-u"]})j";
  const Json whole = answer("connect", loop);
  ASSERT_FALSE(whole.contains("error")) << whole;
  EXPECT_TRUE(whole.at("stable").get<bool>());
  ASSERT_EQ(whole.at("poles").size(), 2U);
  const double product = entry(whole, "poles", 0, 0) * entry(whole, "poles", 1, 0);
  EXPECT_NEAR(product, 1.0, 1e-12);
  EXPECT_EQ(whole.at("C").size(), 2U);
  Json system = {
      {"A", whole.at("A")}, {"B", whole.at("B")}, {"C", whole.at("C")}, {"D", whole.at("D")}};
  const Json first = answer("ss2tf", system.dump());
  EXPECT_NEAR(first.at("num").back().get<double>() / first.at("den").back().get<double>(), 1.0,
              1e-12);
  EXPECT_EQ(first.at("den").size(), 3U);
  EXPECT_NEAR(first.at("den")[1].get<double>(), 3.0, 1e-12);
}

// A delay in the loop, and one that is states of a sampled loop.
TEST(SolveConnect, DeadTime) {
  const Json late = answer("connect", R"j({"blocks": [
      {"name": "G", "inputs": ["e"], "outputs": ["y"], "expr": "1/s", "delay": 1.5}],
      "sums": [{"output": "e", "terms": ["r", "-y"]}], "inputs": ["r"], "outputs": ["y"]})j");
  ASSERT_FALSE(late.contains("error")) << late;
  EXPECT_EQ(late.at("delays"), Json::parse("[1.5]"));
  EXPECT_TRUE(late.at("stable").get<bool>());  // below π/2
  EXPECT_EQ(late.at("D_zw").size(), 1U);
  const Json sampled = answer("connect", R"j({"blocks": [
      {"name": "G", "inputs": ["e"], "outputs": ["y"], "expr": "0.1/(z-1)", "dt": 0.1, "delay": 0.2}],
      "sums": [{"output": "e", "terms": ["r", "-y"]}], "inputs": ["r"], "outputs": ["y"]})j");
  EXPECT_EQ(sampled.at("A").size(), 3U);
  EXPECT_EQ(number(sampled, "dt"), 0.1);
}

TEST(SolveConnect, RefusalsByName) {
  const Json algebraic = answer("connect", R"({"blocks": [
      {"name": "one", "inputs": ["e"], "outputs": ["y"], "D": [[1]]},
      {"name": "other", "inputs": ["y"], "outputs": ["w"], "D": [[-1]]}],
      "sums": [{"output": "e", "terms": ["r", "-w"]}], "inputs": ["r"], "outputs": ["y"]})");
  ASSERT_TRUE(algebraic.contains("error")) << algebraic;
  EXPECT_EQ(algebraic.at("error").at("code"), "algebraic_loop");
  const std::string message = algebraic.at("error").at("message");
  EXPECT_NE(message.find("one"), std::string::npos) << message;
  EXPECT_NE(message.find("other"), std::string::npos) << message;
  const auto with = [](const char* block) {
    return std::string(R"({"blocks": [)") + block + R"(], "inputs": ["u"], "outputs": ["y"]})";
  };
  EXPECT_EQ(refusal("connect",
                    with(R"({"name": "G", "inputs": ["v"], "outputs": ["y"], "expr": "1/s"})")),
            "unknown_name");
  EXPECT_EQ(refusal("connect", with(R"({"name": "G", "inputs": ["u"], "outputs": ["y"]})")),
            "malformed");
  EXPECT_EQ(
      refusal("connect", with(R"({"name": "G", "inputs": ["u"], "outputs": ["y"], "B": [[1]]})")),
      "malformed");
  EXPECT_EQ(refusal("connect",
                    with(R"({"name": "G", "inputs": ["u", "u"], "outputs": ["y"], "expr": "1"})")),
            "wrong_shape");
  EXPECT_EQ(refusal("connect", with(R"({"nane": "G"})")), "unknown_name");
  EXPECT_EQ(refusal("connect", with("3")), "malformed");
  EXPECT_EQ(refusal("connect", with("")), "empty");
}

// A weight of the output has as many coefficients as it likes.
TEST(SolveTransferProblem, WeightsOfTheOutput) {
  const Json design =
      answer("mixsyn",
             R"({"A": [[-1]], "B": [[1]], "W1_num": [0.5, 1], "W1_den": [1, 0.001], "W2_num": [0.1],
          "W3_num": [1, 1], "W3_den": [0.01, 10]})");
  EXPECT_FALSE(design.contains("error")) << design;
}

}  // namespace
}  // namespace flyball::solve::transfer_problem_test
