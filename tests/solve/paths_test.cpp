#include <algorithm>
#include <cmath>

#include "answers.hpp"

namespace flyball::solve::paths_test {
namespace {

// The natural cubic through (0, 0), (1, 1), (2, 0) at even knots: y'' = -3 in the middle, so that
// its first piece is 1.5 s - 0.5 s³.
TEST(SolvePaths, ASplineAndItsDerivatives) {
  const Json spline =
      answer("spline", R"({"points":[[0,0],[1,1],[2,0]],"spacing":"uniform","at":[0,1,2]})");
  EXPECT_EQ(spline.at("breaks"), Json::parse("[0.0,1.0,2.0]"));
  const Json& first = spline.at("coefficients").at(0);
  for (const auto& [row, column, value] :
       {std::tuple{0, 1, 1.0}, {1, 1, 1.5}, {1, 2, 0.0}, {1, 3, -0.5}}) {
    EXPECT_NEAR(
        first.at(static_cast<std::size_t>(row)).at(static_cast<std::size_t>(column)).get<double>(),
        value, 1e-12);
  }
  EXPECT_NEAR(spline.at("second").at(1).at(1).get<double>(), -3.0, 1e-12);
  EXPECT_NEAR(spline.at("curvature").at(1).get<double>(), -3.0, 1e-12);
  EXPECT_EQ(refusal("spline", R"({"points":[[0,0]]})"), "empty");
  EXPECT_EQ(refusal("spline", R"({"points":[[0,0],[0,0]]})"), "out_of_range");
  EXPECT_EQ(refusal("spline", R"({"points":[[0,0],[1,1]],"start":[1,0]})"), "malformed");
  EXPECT_EQ(refusal("spline", R"({"points":[[0,0],[1,1]],"curve":"bezier","start":[1,0]})"),
            "malformed");
}

// A clamped cubic keeps to its derivatives; a Bézier curve of two points is the line.
TEST(SolvePaths, Curves) {
  const Json clamped = answer(
      "spline",
      R"({"points":[[0,0],[1,1],[2,0]],"spacing":"uniform","start":[2,0],"end":[0,1],"at":[0,2]})");
  EXPECT_NEAR(clamped.at("first").at(0).at(0).get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(clamped.at("first").at(1).at(1).get<double>(), 1.0, 1e-12);
  const Json line = answer("spline", R"({"points":[[0,0],[3,4]],"curve":"bezier"})");
  EXPECT_NEAR(line.at("length").get<double>(), 5.0, 1e-12);
}

// 8 m at 2 m/s with 1 m/s²: 6 s; in the middle third of the parameter at 0.5 m/s.
TEST(SolvePaths, TheFastestMotion) {
  const Json motion = answer(
      "path-parameterization",
      R"({"points":[[0,0],[8,0]],"curve":"bezier","travel_velocity":2,"travel_acceleration":1,)"
      R"("tolerance":1e-5,"samples":7})");
  EXPECT_NEAR(motion.at("total_time").get<double>(), 6.0, 1e-3);
  EXPECT_EQ(motion.at("time").size(), 7U);
  EXPECT_NEAR(motion.at("velocity").at(3).at(0).get<double>(), 2.0, 1e-9);
  EXPECT_EQ(motion.at("binding"), Json::parse(R"(["acceleration","velocity","acceleration"])"));
  const Json slow = answer(
      "path-parameterization",
      R"({"points":[[0,0],[9,0]],"curve":"bezier","travel_velocity":2,"slow":[[0.333,0.667,0.5]]})");
  // Nothing limits accelerations: velocities jump.
  EXPECT_NEAR(slow.at("total_time").get<double>(), 9.0 * (0.666 / 2.0 + 0.334 / 0.5), 0.05);
  // d/v + v/a + a/j = 4 + 2 + 1/2 s, and a jerk at each sample.
  const Json smooth =
      answer("path-parameterization",
             R"({"points":[[0,0],[8,0]],"curve":"bezier","velocity":[2,2],"acceleration":[1,1],)"
             R"("jerk":[2,2],"samples":101})");
  EXPECT_GE(smooth.at("total_time").get<double>(), 6.5 * (1.0 - 1e-9));
  EXPECT_LE(smooth.at("total_time").get<double>(), 6.5 * (1.0 + 1.5e-3));
  double most = 0.0;
  for (const Json& jerk : smooth.at("jerk")) {
    most = std::max(most, std::abs(jerk.at(0).get<double>()));
  }
  EXPECT_LE(most, 2.0 * (1.0 + 1e-9));
  EXPECT_GE(most, 1.99);
  EXPECT_EQ(refusal("path-parameterization", R"({"points":[[0,0],[9,0]]})"), "empty");
  EXPECT_EQ(refusal("path-parameterization",
                    R"({"points":[[0,0],[9,0]],"velocity":[1,1],"acceleration":[1]})"),
            "wrong_shape");
  EXPECT_EQ(refusal("path-parameterization", R"({"points":[[0,0],[9,0]],"velocity":[1,0]})"),
            "not_positive");
}

}  // namespace
}  // namespace flyball::solve::paths_test
