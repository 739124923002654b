#include <cmath>

#include "solve/answers.hpp"

namespace flyball::solve::transfer_algebra_test {
namespace {

// (s + 3)/((s + 1)(s + 2)) and back.
TEST(SolveTransferAlgebra, ThereAndBack) {
  const Json there =
      answer("ss2tf", R"({"A": [[-1, 0], [0, -2]], "B": [[1], [1]], "C": [[2, -1]]})");
  const std::vector<double> num = there.at("num");
  const std::vector<double> den = there.at("den");
  ASSERT_EQ(num.size(), 2U);
  ASSERT_EQ(den.size(), 3U);
  EXPECT_NEAR(num[0], 1.0, 1e-14);
  EXPECT_NEAR(num[1], 3.0, 1e-14);
  EXPECT_NEAR(den[1], 3.0, 1e-14);
  EXPECT_NEAR(den[2], 2.0, 1e-14);
  EXPECT_NEAR(number(there, "gain"), 1.0, 1e-14);
  const Json back = answer("tf2ss", R"({"num": [1, 3], "den": [1, 3, 2], "delay": 0.5})");
  EXPECT_EQ(back.at("A").size(), 2U);
  EXPECT_EQ(number(back, "delay"), 0.5);
  // Discrete dead time is states.
  EXPECT_EQ(
      answer("tf2ss", R"({"num": [1], "den": [1, -0.5], "dt": 0.1, "delay": 0.2})").at("A").size(),
      3U);
  EXPECT_EQ(refusal("tf2ss", R"({"num": [1, 2, 3], "den": [1, 1]})"), "improper");
}

TEST(SolveTransferAlgebra, CancelsWhenAsked) {
  constexpr const char* plant =
      R"({"A": [[1, 0], [0, -2]], "B": [[0], [1]], "C": [[1, 1]], "tolerance": )";
  const Json kept = answer("ss2tf", std::string(plant) + "0}");
  EXPECT_EQ(kept.at("poles").size(), 2U);
  EXPECT_FALSE(kept.at("hides_instability").get<bool>());
  const Json cancelled = answer("ss2tf", std::string(plant) + "1e-9}");
  EXPECT_EQ(cancelled.at("poles").size(), 1U);
  EXPECT_TRUE(cancelled.at("hides_instability").get<bool>());
  EXPECT_NEAR(cancelled.at("cancelled")[0][0].get<double>(), 1.0, 1e-14);
}

TEST(SolveTransferAlgebra, Zeros) {
  const Json zeros =
      answer("zeros", R"({"A": [[-1, 0], [0, -2]], "B": [[1], [1]], "C": [[2, -1]]})");
  EXPECT_NEAR(entry(zeros, "zeros", 0, 0), -3.0, 1e-14);
  EXPECT_EQ(zeros.at("normal_rank").get<int>(), 1);
}

// (s + 4)/((s + 1)²(s + 2)) = -2/(s + 1) + 3/(s + 1)² + 2/(s + 2).
TEST(SolveTransferAlgebra, Residues) {
  const Json found = answer("residue", R"({"num": [1, 4], "den": [1, 4, 5, 2]})");
  EXPECT_NEAR(entry(found, "residues", 0, 0), -2.0, 1e-13);
  EXPECT_NEAR(entry(found, "residues", 1, 0), 3.0, 1e-13);
  EXPECT_NEAR(entry(found, "residues", 2, 0), 2.0, 1e-13);
  EXPECT_EQ(found.at("powers"), Json::parse("[1, 2, 1]"));
  EXPECT_EQ(found.at("impulse_response").get<std::string>(), "-2 e^(-t) + 3 t e^(-t) + 2 e^(-2 t)");
  EXPECT_EQ(refusal("residue", R"({"num": [1], "den": [0, 0]})"), "zero_denominator");
}

// G = 1/(s + 1), H = 2/(s + 3): G/(1 ± G H) = (s + 3)/(s² + 4s + 3 ± 2).
TEST(SolveTransferAlgebra, Interconnect) {
  const Json made = answer(
      "interconnect", R"({"G": {"num": [1], "den": [1, 1]}, "H": {"num": [2], "den": [1, 3]}})");
  EXPECT_EQ(made.at("series").at("num"), Json::parse("[2.0]"));
  EXPECT_EQ(made.at("series").at("den"), Json::parse("[1.0, 4.0, 3.0]"));
  EXPECT_EQ(made.at("parallel").at("num"), Json::parse("[3.0, 5.0]"));
  EXPECT_EQ(made.at("feedback_neg").at("den"), Json::parse("[1.0, 4.0, 5.0]"));
  EXPECT_EQ(made.at("feedback_pos").at("den"), Json::parse("[1.0, 4.0, 1.0]"));
  EXPECT_EQ(
      refusal("interconnect", R"({"G": {"num": [1], "den": [1]}, "H": {"num": [-1], "den": [1]}})"),
      "algebraic_loop");
  EXPECT_EQ(refusal("interconnect",
                    R"({"G": {"num": [1], "den": [1], "dt": 0.1}, "H": {"num": [1], "den": [1]}})"),
            "period_mismatch");
  EXPECT_EQ(refusal("interconnect", R"({"G": 1, "H": {"num": [1], "den": [1]}})"), "malformed");
  EXPECT_EQ(refusal("interconnect", R"({"G": {"num": [1]}, "H": {"num": [1], "den": [1]}})"),
            "malformed");
}

// 1/s with half a second of dead time: s = W(-1/2)/(1/2).
TEST(SolveTransferAlgebra, ClosedLoops) {
  const Json loop = answer("closed-loop-poles", R"({"num": [1], "den": [1, 0], "delay": 0.5})");
  EXPECT_NEAR(entry(loop, "poles", 0, 0), 2.0 * -0.794023632344689, 1e-14);
  EXPECT_NEAR(entry(loop, "poles", 0, 1), 2.0 * 0.770111750510379, 1e-14);
  EXPECT_TRUE(loop.at("stable").get<bool>());
  const Json error = answer("steady-state-error", R"({"num": [5], "den": [1, 1, 0]})");
  EXPECT_EQ(error.at("type").get<int>(), 1);
  EXPECT_EQ(number(error, "step"), 0.0);
  EXPECT_DOUBLE_EQ(number(error, "ramp"), 0.2);
}

}  // namespace
}  // namespace flyball::solve::transfer_algebra_test
