#include <cmath>

#include "answers.hpp"

namespace flyball::solve::compensators_test {
namespace {

// Skogestad and Postlethwaite's (2.62) with their weights of section 2.8.2: 1.37.
TEST(SolveCompensators, MixedSensitivity) {
  const Json K = answer(
      "mixsyn", R"({"A":[[-0.1,1,0],[0,-20,1],[0,0,-20]],"B":[[0],[0],[8000]],"C":[[1,0,0]],)"
                R"("W1_num":[0.6666666666666666,10],"W1_den":[1,0.001],"W2_num":[1]})");
  EXPECT_NEAR(number(K, "gamma"), 1.367, 3e-3);
  EXPECT_LE(number(K, "least_low"), number(K, "gamma"));
  EXPECT_EQ(K.at("A").size(), 4U);
  for (const Json& pole : K.at("poles")) {
    EXPECT_LT(pole.at(0).get<double>(), 0.0);
  }
  EXPECT_EQ(refusal("mixsyn", R"({"A":[[-1]],"B":[[1]],"W1_num":[1],"W1_den":[1,0],"W2_num":[1]})"),
            "not_detectable");
  EXPECT_EQ(refusal("mixsyn", R"({"A":[[-1]],"B":[[1]],"W1_num":[1]})"), "control_without_weight");
  EXPECT_EQ(refusal("mixsyn", R"({"A":[[-1]],"B":[[1]]})"), "empty");
}

// x' = x + w₁ + u, z = [x; u], y = x + w₂: X = Y = 1/(√(2 - 1/γ²) - 1) = γ at γ = 1 + √2... the H₂
// controller is LQG's, whose gains are both 1 + √2.
TEST(SolveCompensators, Synthesis) {
  const std::string plant =
      R"({"A":[[1]],"B":[[1,0,1]],"C":[[1],[0],[1]],"D":[[0,0,0],[0,0,1],[0,1,0]],)"
      R"("measurements":1,"controls":1)";
  const Json h2 = answer("h2syn", plant + "}");
  EXPECT_NEAR(entry(h2, "B") * entry(h2, "C"), -std::pow(1.0 + std::sqrt(2.0), 2), 1e-9);
  const Json hinf = answer("hinfsyn", plant + R"(,"tolerance":1e-6})");
  const double gamma = number(hinf, "gamma");
  EXPECT_NEAR(1.0 / (std::sqrt(2.0 - 1.0 / (gamma * gamma)) - 1.0) / gamma, 1.0, 1e-4);
  EXPECT_EQ(refusal("hinfsyn", plant + R"(,"gamma":1})"), "level_not_reached");
  const Json discrete = answer("hinfsyn", plant + R"(,"domain":"discrete","T":0.1})");
  EXPECT_GE(number(discrete, "gamma"), number(discrete, "least_low") * (1.0 - 1e-6));
  const Json integrator = answer("ncfsyn", R"({"A":[[0]],"B":[[1]]})");
  EXPECT_NEAR(number(integrator, "least_gamma"), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(entry(answer("ncfsyn", R"({"A":[[0]],"B":[[1]],"feedback":"positive"})"), "C"),
              -entry(integrator, "C"), 1e-12);
}

TEST(SolveCompensators, Pid) {
  const Json loop = answer("pidtune", R"({"num":[1],"den":[1,1],"delay":0.5,"form":"pi",)"
                                      R"("crossover":1,"phase_margin":60})");
  EXPECT_NEAR(number(loop, "phase_margin"), 60.0, 1e-9);
  EXPECT_NEAR(number(loop, "crossover"), 1.0, 1e-9);
  EXPECT_NEAR(loop.at("load").at("integral").get<double>() * number(loop, "ki"), 1.0, 1e-3);
  const Json robust =
      answer("pidtune", R"({"num":[1],"den":[1,4,6,4,1],"form":"pi","Ms":1.4,"Mt":1.4})");
  EXPECT_NEAR(number(robust, "kp"), 0.4326, 1e-3);
  EXPECT_LE(number(robust, "Ms"), 1.4 * (1.0 + 1e-9));
  const Json simc =
      answer("pidtune", R"({"num":[1],"den":[1,4,6,4,1],"form":"pi","method":"simc"})");
  EXPECT_NEAR(number(simc, "kp"), 0.3, 1e-6);
  EXPECT_EQ(refusal("pidtune", R"({"num":[1],"den":[1,1],"form":"pi"})"), "unlimited");
  EXPECT_EQ(refusal("pidtune", R"({"num":[1],"den":[1,1],"method":"loop-shape"})"), "malformed");
  EXPECT_EQ(refusal("pidtune", R"({"num":[1],"den":[1,0,0],"form":"pi","crossover":1})"),
            "phase_not_reached");
}

TEST(SolveCompensators, LeadLagNotch) {
  const Json lead = answer("compensator", R"({"num":[4],"den":[1,2,0],"error_constant":20,)"
                                          R"("crossover":9,"phase_margin":50})");
  EXPECT_NEAR(number(lead, "dcgain"), 10.0, 1e-9);
  EXPECT_NEAR(number(lead, "phase_margin"), 50.0, 1e-9);
  const Json poles = answer("compensator", R"({"num":[10],"den":[1,1,0],"natural_frequency":3,)"
                                           R"("damping_ratio":0.5})");
  EXPECT_NEAR(poles.at("poles").at(0).at(0).get<double>(), -4.6458, 1e-4);
  EXPECT_EQ(refusal("compensator", R"({"num":[4],"den":[1,2,0]})"), "malformed");
  EXPECT_EQ(refusal("compensator", R"({"num":[4],"den":[1,2,0],"type":"lag","crossover":1})"),
            "empty");
  const Json notch = answer("notch", R"({"frequency":10,"depth":0.1})");
  EXPECT_NEAR(notch.at("num").at(1).get<double>(), 0.4, 1e-15);
}

TEST(SolveCompensators, Reduce) {
  const Json reduced =
      answer("reduce",
             R"({"A":[[-1,0,0],[0,-20,0],[0,0,0.5]],"B":[[1],[1],[1]],"C":[[1,1,1]],"order":2})");
  EXPECT_EQ(number(reduced, "unstable"), 1.0);
  EXPECT_LE(number(reduced, "achieved_error"), number(reduced, "error_bound") * (1.0 + 1e-9));
  EXPECT_EQ(refusal("reduce", R"({"A":[[1]],"B":[[1]],"order":0})"), "out_of_range");
}

}  // namespace
}  // namespace flyball::solve::compensators_test
