#include <flyball/core/coordinate.hpp>

#include <gtest/gtest.h>

namespace flyball::coordinate_test {
namespace {

TEST(Coordinate, LabelCarriesTheUnit) {
  EXPECT_EQ(label({"angle", "rad"}), "angle (rad)");
  EXPECT_EQ(label({"ratio"}), "ratio");
  const std::vector<Coordinate> states{{"position", "m"}, {"velocity", "m/s"}};
  EXPECT_EQ(labels(states), (std::vector<std::string>{"position (m)", "velocity (m/s)"}));
}

// Whatever a person calls a state, its label is what was written.
TEST(Coordinate, ALabelReadsBack) {
  for (const char* text : {"angle (rad)", "x", "f(x)", "f(x) (m)", "speed (left) (m/s)", " (m)",
                           "a ()", "(m)", "", "a (b", "a (b) c", "a  (m)"}) {
    EXPECT_EQ(label(coordinate_from_label(text)), text);
  }
  const Coordinate angle = coordinate_from_label("arm angle (rad)");
  EXPECT_EQ(angle.name, "arm angle");
  EXPECT_EQ(angle.unit, "rad");
  EXPECT_EQ(coordinate_from_label("f(x)").unit, "");
  EXPECT_EQ(coordinate_from_label(" (m)").name, " (m)");
  EXPECT_EQ(coordinate_from_label("speed (left) (m/s)").unit, "m/s");
}

}  // namespace
}  // namespace flyball::coordinate_test
