// Factor graphs of poses: loops, maps, and the public graph of Manhattan.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/pose_residuals.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/geometry/se3.hpp>
#include <flyball/optimization/factor_graph.hpp>

#include "support/oracle.hpp"

namespace flyball::pose_graph_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using optimization::FactorGraph;
using optimization::Variable;

template <class Pose>
TangentOf<Pose> noise(Random& random, double size) {
  return TangentOf<Pose>::NullaryExpr([&] { return size * random.normal(); });
}

// Edges of exact measurements, closed in a ring, from a start that is far off: the truth comes
// back.
template <class Pose>
void expect_ring(double off) {
  Random random(5);
  std::vector<Pose> truth{Pose()};
  for (int i = 1; i < 12; ++i) {
    truth.push_back(truth.back() * Pose::exp(noise<Pose>(random, 0.6)));
  }
  FactorGraph<Pose> graph;
  std::vector<Variable<Pose>> x;
  for (const Pose& pose : truth) {
    x.push_back(graph.add(pose.plus(noise<Pose>(random, off))));
  }
  graph.set(x[0], truth[0]);
  graph.fix(x[0]);
  const TangentMatrix<Pose> W = TangentMatrix<Pose>::Identity();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const std::size_t j = (i + 1) % truth.size();
    graph.add_factor(RelativePose<Pose>{truth[i].between(truth[j]), W}, x[i], x[j]);
  }
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_LE(result->cost, 1e-16);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LE(graph[x[i]].minus(truth[i]).norm(), 1e-7);
  }
}
TEST(PoseGraph, ARingOfPosesOfThePlaneCloses) {
  expect_ring<Pose2d>(0.3);
}
TEST(PoseGraph, ARingOfPosesOfSpaceCloses) {
  expect_ring<Pose3d>(0.2);
}

// Poses and landmarks that are both unknown: over many draws the squared error in units of the
// claimed covariance is as large as it has entries.
TEST(PoseGraph, AMapsCovarianceIsTrue) {
  constexpr int draws = 200;
  constexpr int poses = 15;
  double of_poses = 0.0;
  double of_points = 0.0;
  for (int draw = 0; draw < draws; ++draw) {
    Random random(static_cast<std::uint64_t>(draw) + 1);
    std::vector<Pose2d> truth{Pose2d(0.0, 0.0, 0.3)};
    const std::vector<Vector2d> points{{3.0, 1.0}, {1.0, 4.0}, {-2.0, 2.0}, {4.0, 4.0}};
    FactorGraph<Pose2d, Vector2d> graph;
    std::vector<Variable<Pose2d>> x{graph.add(truth[0])};
    graph.fix(x[0]);
    std::vector<Variable<Vector2d>> m;
    for (const Vector2d& point : points) {
      m.push_back(
          graph.add(Vector2d(point + Vector2d(0.1 * random.normal(), 0.1 * random.normal()))));
    }
    const Vector3d std(0.02, 0.01, 0.02);
    const Matrix3d W = std.cwiseInverse().asDiagonal();
    const auto see = [&](std::size_t i) {
      for (std::size_t j = 0; j < points.size(); ++j) {
        const Vector2d seen = truth[i].inverse() * points[j];
        graph.add_factor(
            RangeAndBearing{seen.norm() + 0.05 * random.normal(),
                            std::atan2(seen(1), seen(0)) + 0.02 * random.normal(), 0.05, 0.02},
            x[i], m[j]);
      }
    };
    see(0);
    for (std::size_t i = 1; i < poses; ++i) {
      const Vector3d step(0.3, 0.0, 0.15);
      truth.push_back(truth.back() * Pose2d::exp(step));
      const Pose2d measured =
          Pose2d::exp(step) * Pose2d::exp(Vector3d(std.cwiseProduct(noise<Pose2d>(random, 1.0))));
      x.push_back(graph.add(graph[x.back()] * measured));
      graph.add_factor(RelativePose<Pose2d>{measured, W}, x[i - 1], x[i]);
      see(i);
    }
    const auto result = graph.solve();
    ASSERT_TRUE(result) << to_string(result.error());
    const auto P = graph.covariances();
    ASSERT_TRUE(P) << to_string(P.error());
    const auto at = [&](auto variable) { return (*P)[static_cast<std::size_t>(variable.place)]; };
    const Vector3d e = truth[poses - 1].minus(graph[x[poses - 1]]);
    of_poses += test::squared_distance(at(x[poses - 1]), e);
    const Vector2d d = points[0] - graph[m[0]];
    of_points += test::squared_distance(at(m[0]), d);
  }
  // χ² with 3·200 and 2·200 degrees of freedom: three standard deviations.
  EXPECT_NEAR(of_poses / draws, 3.0, 3.0 * std::sqrt(2.0 * 3.0 / draws));
  EXPECT_NEAR(of_points / draws, 2.0, 3.0 * std::sqrt(2.0 * 2.0 / draws));
}

#ifdef FLYBALL_TEST_DATA
// The M3500 graph from odometry; Ceres 2.1 ends at 3533.4585.
TEST(PoseGraph, ManhattanFromOdometry) {
  const std::string path = FLYBALL_TEST_DATA "/benchmarks/manhattan3500.g2o.gz";
  std::FILE* const pipe = ::popen(("gzip -cd '" + path + "' 2> /dev/null").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string text;
  char buffer[1 << 14];
  for (std::size_t read = 0; (read = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
    text.append(buffer, read);
  }
  ::pclose(pipe);
  if (text.empty()) {
    GTEST_SKIP() << "without the recordings";
  }
  FactorGraph<Pose2d> graph;
  std::vector<Variable<Pose2d>> poses{graph.add(Pose2d())};
  graph.fix(poses[0]);
  std::istringstream lines(text);
  std::string kind;
  struct Edge {
    std::size_t a = 0, b = 0;
    RelativePoseByCoordinates residual{};
  };
  std::vector<Edge> edges;
  while (lines >> kind) {
    Edge edge;
    double x = 0.0, y = 0.0;
    double xx = 0.0, xy = 0.0, xt = 0.0, yy = 0.0, yt = 0.0, tt = 0.0;
    lines >> edge.a >> edge.b >> x >> y >> edge.residual.angle >> xx >> xy >> xt >> yy >> yt >> tt;
    Matrix3d information;
    information << xx, xy, xt, xy, yy, yt, xt, yt, tt;
    edge.residual.translation = {x, y};
    edge.residual.W = test::cholesky_factor(information).transpose();
    edges.push_back(edge);
  }
  ASSERT_EQ(edges.size(), 5453U);
  for (std::size_t i = 1; i < 3500; ++i) {
    for (const Edge& edge : edges) {
      if (edge.a + 1 == i && edge.b == i) {
        poses.push_back(graph.add(graph[poses.back()] * Pose2d(edge.residual.translation(0),
                                                               edge.residual.translation(1),
                                                               edge.residual.angle)));
        break;
      }
    }
  }
  ASSERT_EQ(poses.size(), 3500U);
  for (const Edge& edge : edges) {
    graph.add_factor(edge.residual, poses[edge.a], poses[edge.b]);
  }
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(result->cost, 3533.4585, 1e-4);
  EXPECT_LE(result->factorizations, 12);
}
#endif

}  // namespace
}  // namespace flyball::pose_graph_test
