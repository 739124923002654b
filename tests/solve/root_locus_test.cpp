#include <cmath>

#include "answers.hpp"

namespace flyball::solve::root_locus_test {
namespace {

// s(s + 1)(s + 2) + k: branches meet at -1 + 1/√3 for k = 2/(3√3), and cross the axis at √2 for 6.
TEST(SolveRootLocus, ThirdOrder) {
  const Json locus = answer("rlocus", R"({"num":[1],"den":[1,3,2,0],"damping":0.5})");
  EXPECT_NEAR(number(locus.at("branch_points").at(0), "real"), -1.0 + 1.0 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(number(locus.at("branch_points").at(0), "gain"), 2.0 / (3.0 * std::sqrt(3.0)), 1e-15);
  EXPECT_NEAR(number(locus.at("crossings").at(0), "w"), std::sqrt(2.0), 1e-14);
  EXPECT_NEAR(number(locus.at("stable_gains").at(0), "high"), 6.0, 1e-13);
  EXPECT_EQ(locus.at("asymptote_angles"), Json::parse("[-60.0, 60.0, 180.0]"));
  // (s + 7/3)(s² + 2/3 s + 4/9) = s³ + 3 s² + 2 s + 28/27.
  EXPECT_NEAR(number(locus.at("at_damping").at(0), "gain"), 28.0 / 27.0, 1e-13);
  EXPECT_EQ(locus.at("gains").size(), locus.at("real").size());
  EXPECT_EQ(refusal("rlocus", R"({"num":[1],"den":[1,1],"delay":1})"), "delay_in_loop");
  EXPECT_EQ(refusal("rlocus", R"({"num":[1],"den":[1,1],"damping":1})"), "out_of_range");
}

// 1 - e^{-t} after a dead time of 2 s: 10 to 90 % takes ln 9.
TEST(SolveStep, FirstOrder) {
  const Json step = answer("step", R"({"num":[1],"den":[1,1],"delay":2,"duration":3,"samples":4})");
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(step.at("time").at(static_cast<std::size_t>(k)), 2.0 + k);
    EXPECT_NEAR(step.at("y").at(static_cast<std::size_t>(k)).get<double>(), 1.0 - std::exp(-k),
                1e-15);
  }
  EXPECT_NEAR(number(step.at("metrics"), "rise_time"), std::log(9.0), 1e-9);
  EXPECT_EQ(refusal("step", R"({"num":[1,0],"den":[1]})"), "improper");
  EXPECT_EQ(refusal("step", R"({"num":[1],"den":[1,1],"duration":0})"), "not_positive");
}

}  // namespace
}  // namespace flyball::solve::root_locus_test
