#include <flyball/geometry/mean.hpp>

#include <array>
#include <span>

#include "geometry/groups.hpp"
#include "support/allocation_count.hpp"
#include "support/property.hpp"

namespace flyball::test::mean_test {
namespace {

template <class G>
class MeanLaws : public testing::Test {};
TYPED_TEST_SUITE(MeanLaws, Groups);

TYPED_TEST(MeanLaws, DifferencesVanish) {
  using G = TypeParam;
  using Scalar = typename G::Scalar;
  EXPECT_TRUE(holds_for_random("Σ w (x ⊖ mean) = 0, seen from anywhere", [](Random& random) {
    const G centre = random_element<G>(random);
    const double least = std::is_same_v<Scalar, float> ? -2.0 : -6.0;
    const double spread = std::pow(10.0, random.uniform(least, 0.0));
    std::array<G, 7> points;
    std::array<Scalar, 7> weights;
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] = centre.plus(random_tangent<G>(random, spread, spread));
      weights[i] = static_cast<Scalar>(random.uniform(0.1, 2.0));
    }
    const auto mean = weighted_mean(std::span<const G>(points), weights, points[0]);
    require(mean.converged);
    typename G::Tangent sum = G::Tangent::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += weights[i] * points[i].minus(mean.value);
    }
    require(sum.norm() <= roundings<G>(1000));
    const G frame = random_element<G>(random);
    for (G& point : points) {
      point = frame * point;
    }
    const auto seen = weighted_mean(std::span<const G>(points), weights, points[3]);
    require(distance(seen.value, frame * mean.value) <= roundings<G>(1000));
  }));
}

TYPED_TEST(MeanLaws, OfOppositePointsIsTheirCentre) {
  using G = TypeParam;
  Random random(1);
  const G centre = random_element<G>(random);
  const auto delta = random_tangent<G>(random, 1.0, 1.2);
  const std::array<G, 3> points{centre.plus(delta), centre, centre.plus(-delta)};
  const AllocationCounter counter;
  const auto result = mean(std::span<const G>(points));
  if (counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_TRUE(result.converged);
  EXPECT_LE(distance(result.value, centre), roundings<G>(200));
}

// The unscented transform's weights: the centre's is negative, the mean of a symmetric set stays.
TEST(Mean, NegativeWeights) {
  const Pose2d centre(3.0, 1.0, 3.1);
  const std::array<Pose2d, 3> points{centre, centre.plus(Eigen::Vector3d(0.1, 0.2, 0.3)),
                                     centre.plus(Eigen::Vector3d(-0.1, -0.2, -0.3))};
  const std::array<double, 3> weights{-99.0, 50.0, 50.0};
  const auto result = weighted_mean(std::span<const Pose2d>(points), weights, centre);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(distance(result.value, centre), 1e-13);
}

// 170°, -170° and 175°: 178.33°, across the half turn.
TEST(Mean, OfHeadings) {
  const double degree = std::numbers::pi / 180.0;
  const std::array<Rotation2d, 3> points{Rotation2d(170 * degree), Rotation2d(-170 * degree),
                                         Rotation2d(175 * degree)};
  EXPECT_NEAR(mean(std::span<const Rotation2d>(points)).value.angle(), 535.0 / 3.0 * degree, 1e-15);
}

TEST(Mean, OfVectorsIsTheAverage) {
  const std::array<Eigen::Vector2d, 2> points{Eigen::Vector2d(1.0, 2.0), Eigen::Vector2d(3.0, 6.0)};
  const auto result = mean(std::span<const Eigen::Vector2d>(points));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.value, Eigen::Vector2d(2.0, 4.0));
}

// Three headings a third of a turn apart have no mean to be found: it says so or stays finite.
TEST(Mean, WithoutAnAnswerItEnds) {
  const double third = 2 * std::numbers::pi / 3;
  const std::array<Rotation2d, 3> points{Rotation2d(0.0), Rotation2d(third), Rotation2d(-third)};
  const auto result = mean(std::span<const Rotation2d>(points));
  EXPECT_LE(result.iterations, 100);
  EXPECT_TRUE(std::isfinite(result.value.angle()));
}

}  // namespace
}  // namespace flyball::test::mean_test
