// Sparse least squares over poses: the Manhattan graph of 3500 poses (its .g2o file as argument),
// a grid world of our own, and a path among landmarks, beside Ceres where there is one.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include <Eigen/Cholesky>

#include <flyball/core/random.hpp>
#include <flyball/estimation/pose_residuals.hpp>
#include <flyball/geometry/se2.hpp>
#include <flyball/optimization/factor_graph.hpp>

#include "pose_graph.hpp"
#include "timing.hpp"

namespace {

using bench::Edge;
using bench::PoseGraph;
using bench::Solved;
using flyball::Pose2d;
using flyball::optimization::FactorGraph;
using flyball::optimization::Variable;

/// A known landmark seen.
struct Seen {
  Eigen::Vector2d landmark;
  flyball::RangeAndBearing sighting;

  template <class Pose>
  auto operator()(const Pose& pose) const {
    return sighting(pose, landmark);
  }
};

Solved solve(const PoseGraph& graph) {
  Solved solved;
  solved.milliseconds =
      1e-3 * bench::microseconds(1, [&] {
        FactorGraph<Pose2d> factors;
        std::vector<Variable<Pose2d>> poses;
        for (const Pose2d& pose : graph.start) {
          poses.push_back(factors.add(pose));
        }
        factors.fix(poses[0]);
        for (const Edge& edge : graph.edges) {
          factors.add_factor(
              flyball::RelativePoseByCoordinates{{edge.x, edge.y}, edge.angle, edge.root},
              poses[edge.a], poses[edge.b]);
        }
        const auto result = factors.solve();
        if (result) {
          solved.cost = result->cost;
          solved.iterations = result->iterations;
        }
      });
  return solved;
}

PoseGraph read(const char* path) {
  PoseGraph graph;
  std::ifstream file(path);
  std::string line;
  std::size_t poses = 0;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind != "EDGE_SE2") {
      continue;
    }
    Edge edge;
    double xx = 0.0, xy = 0.0, xt = 0.0, yy = 0.0, yt = 0.0, tt = 0.0;
    words >> edge.a >> edge.b >> edge.x >> edge.y >> edge.angle >> xx >> xy >> xt >> yy >> yt >> tt;
    Eigen::Matrix3d information;
    information << xx, xy, xt, xy, yy, yt, xt, yt, tt;
    edge.root = information.llt().matrixU();
    poses = std::max({poses, edge.a + 1, edge.b + 1});
    graph.edges.push_back(edge);
  }
  graph.start.resize(poses);
  for (const Edge& edge : graph.edges) {
    if (edge.b == edge.a + 1) {
      graph.start[edge.b] = graph.start[edge.a] * Pose2d(edge.x, edge.y, edge.angle);
    }
  }
  return graph;
}

/// A walk on a grid, which sees where it has been before.
PoseGraph grid_world(std::size_t poses, std::uint64_t seed) {
  flyball::Random random(seed);
  PoseGraph graph;
  std::vector<Pose2d> truth{Pose2d()};
  const Eigen::Matrix3d root = Eigen::Vector3d(20.0, 20.0, 100.0).asDiagonal();
  const auto edge = [&](std::size_t a, std::size_t b) {
    const Pose2d seen = truth[a].between(truth[b]);
    graph.edges.push_back({a, b, seen.x() + 0.05 * random.normal(),
                           seen.y() + 0.05 * random.normal(), seen.angle() + 0.01 * random.normal(),
                           root});
  };
  for (std::size_t i = 1; i < poses; ++i) {
    const double turn =
        i % 4 == 0 ? std::floor(random.uniform(-1.0, 2.0)) * 1.5707963267948966 : 0.0;
    Pose2d next = truth.back() * Pose2d(1.0, 0.0, turn);
    if (next.translation().cwiseAbs().maxCoeff() > 20.0) {
      next = truth.back() * Pose2d(0.0, 0.0, 3.0);
    }
    truth.push_back(next);
    edge(i - 1, i);
    for (int tries = 0; tries < 20; ++tries) {
      const auto j = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(i)));
      if (j + 10 < i && (truth[j].translation() - next.translation()).norm() < 2.0) {
        edge(j, i);
        break;
      }
    }
  }
  graph.start.resize(poses);
  for (const Edge& e : graph.edges) {
    if (e.b == e.a + 1) {
      graph.start[e.b] = graph.start[e.a] * Pose2d(e.x, e.y, e.angle);
    }
  }
  return graph;
}

void compare(const char* name, const PoseGraph& graph) {
  Solved ours{.milliseconds = 1e300};
  Solved theirs{.milliseconds = 1e300};
  for (int repeat = 0; repeat < 5; ++repeat) {
    const Solved mine = solve(graph);
    if (mine.milliseconds < ours.milliseconds) {
      ours = mine;
    }
#ifdef FLYBALL_HAS_CERES
    const Solved other = bench::solve_with_ceres(graph);
    if (other.milliseconds < theirs.milliseconds) {
      theirs = other;
    }
#endif
  }
  std::printf("%-22s %6zu poses %6zu edges  %10.4f in %2d steps, %7.1f ms", name,
              graph.start.size(), graph.edges.size(), ours.cost, ours.iterations,
              ours.milliseconds);
  if (theirs.milliseconds < 1e300) {
    std::printf(";  Ceres %10.4f in %2d, %7.1f ms;  ratio %.2f", theirs.cost, theirs.iterations,
                theirs.milliseconds, theirs.milliseconds / ours.milliseconds);
  }
  std::printf("\n");
}

/// 20 000 poses of a path, 4000 sightings of known landmarks.
void path_among_landmarks() {
  flyball::Random random(5);
  constexpr int count = 20000;
  std::vector<Pose2d> truth{Pose2d()};
  std::vector<Pose2d> steps;
  for (int i = 1; i < count; ++i) {
    const Eigen::Vector3d twist(0.05, 0.0, 0.02 * std::sin(0.003 * i) + 0.004);
    truth.push_back(truth.back() * Pose2d::exp(twist));
    steps.push_back(Pose2d::exp(Eigen::Vector3d(
        twist + Eigen::Vector3d(0.002 * random.normal(), 0.0, 0.002 * random.normal()))));
  }
  std::vector<Eigen::Vector2d> landmarks;
  for (int i = 0; i < 30; ++i) {
    landmarks.emplace_back(random.uniform(-15.0, 15.0), random.uniform(-15.0, 15.0));
  }
  double best = 1e300;
  double cost = 0.0;
  double rms = 0.0;
  int iterations = 0;
  std::vector<std::pair<int, Seen>> sightings;
  for (int k = 0; k < 4000; ++k) {
    const auto i = static_cast<std::size_t>(5 * k);
    const Eigen::Vector2d& landmark = landmarks[static_cast<std::size_t>(k % 30)];
    const Eigen::Vector2d seen = truth[i].inverse() * landmark;
    sightings.push_back(
        {5 * k, Seen{landmark,
                     {seen.norm() + 0.05 * random.normal(),
                      std::atan2(seen(1), seen(0)) + 0.02 * random.normal(), 0.05, 0.02}}});
  }
  // A filter would begin nearer.
  std::vector<Pose2d> start;
  for (const Pose2d& pose : truth) {
    start.push_back(pose *
                    Pose2d(0.2 * random.normal(), 0.2 * random.normal(), 0.05 * random.normal()));
  }
  for (int repeat = 0; repeat < 3; ++repeat) {
    const double ms =
        1e-3 * bench::microseconds(1, [&] {
          FactorGraph<Pose2d> graph;
          std::vector<Variable<Pose2d>> poses;
          for (const Pose2d& pose : start) {
            poses.push_back(graph.add(pose));
          }
          const Eigen::Matrix3d root = Eigen::Vector3d(500.0, 1000.0, 500.0).asDiagonal();
          for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
            graph.add_factor(flyball::RelativePose<Pose2d>{steps[i], root}, poses[i], poses[i + 1]);
          }
          for (const auto& [pose, seen] : sightings) {
            graph.add_factor(seen, poses[static_cast<std::size_t>(pose)]);
          }
          const auto result = graph.solve();
          if (result) {
            cost = result->cost;
            iterations = result->iterations;
          }
          rms = 0.0;
          for (std::size_t i = 0; i < poses.size(); ++i) {
            rms += (graph[poses[i]].translation() - truth[i].translation()).squaredNorm() / count;
          }
        });
    best = std::min(best, ms);
  }
  std::printf("path of %d poses, %zu sightings: cost %.1f in %d steps, %.3f m rms, %.1f ms\n",
              count, sightings.size(), cost, iterations, std::sqrt(rms), best);
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    compare(argv[i], read(argv[i]));
  }
  compare("grid world", grid_world(1000, 1));
  compare("grid world", grid_world(4000, 2));
  path_among_landmarks();
  return 0;
}
