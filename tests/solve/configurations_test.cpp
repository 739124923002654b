#include <numbers>

#include "answers.hpp"

namespace flyball::solve::configurations_test {
namespace {

// Figure 16.4: the way leads by both corners of what is forbidden.
TEST(SolveConfigurations, PathOfFigure16_4) {
  const Json path = answer(
      "plan",
      R"({"low":[-2,0],"high":[2,5],"boxes":[[-0.75,0,0.75,2]],"start":[-1,0.5],"goal":[1,0.5]})");
  EXPECT_EQ(path.at("waypoints"), Json::parse("[[-1.0,0.5],[-0.75,2.0],[0.75,2.0],[1.0,0.5]]"));
  EXPECT_EQ(path.at("method"), "corners");
  EXPECT_EQ(refusal("plan", R"({"low":[-2,0],"high":[2,5],"boxes":[[-0.75,0,0.75,5]],)"
                            R"("start":[-1,0.5],"goal":[1,0.5]})"),
            "no_path");
  EXPECT_EQ(refusal("plan", R"({"low":[-2,0],"high":[2,5],"boxes":[[-0.75,0,0.75,5]],)"
                            R"("start":[0,0.5],"goal":[1,0.5]})"),
            "in_collision");
  EXPECT_EQ(refusal("plan", R"({"low":[0],"high":[0],"start":[0],"goal":[0]})"), "out_of_range");
}

// An elevator of 1 m with a link of 1 m: level it is 0.5 m from the disc; 1.2 m up and hanging
// straight down its end is 0.3 m above the floor.
TEST(SolveConfigurations, LinksAmongDiscs) {
  const Json state = answer(
      "configuration-validity",
      R"({"low":[0,-2],"high":[2,2],"links":[1],"radius":0.1,"discs":[[2,0.5,0.4]],"floor":-0.1,)"
      R"("q":[[0.5,0],[1.2,-1.5707963267948966],[0.5,-1.5707963267948966]]})");
  EXPECT_EQ(state.at("valid"), Json::parse("[1.0, 1.0, 0.0]"));
  EXPECT_EQ(state.at("broken").at(2), "link 1 meets floor");
  // 0.5 m over how fast the end moves: 1 m/s up and 1 rad/s at 1 m.
  EXPECT_NEAR(state.at("clearance").at(0).get<double>(), 0.5 / 2.0, 1e-12);
  EXPECT_NEAR(state.at("clearance").at(1).get<double>(), 0.2 / 2.0, 1e-12);
  EXPECT_EQ(refusal("configuration-validity", R"({"low":[0],"high":[1],"links":[1,1],"q":[[0]]})"),
            "wrong_shape");
}

}  // namespace
}  // namespace flyball::solve::configurations_test
