// Records a drive of a simulated robot among landmarks, as files that `flyball localize` reads: its
// odometry is scaled and leads by 0.15 s, its camera tells depths for ranges, and some landmarks
// are taken for others. examples/drive is what it writes.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/random.hpp>
#include <flyball/geometry/se2.hpp>

int main(int argc, char** argv) {
  using namespace flyball;
  if (argc != 2) {
    std::fprintf(stderr, "usage: record_drive FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::FILE* odometry = std::fopen((folder + "/odometry.csv").c_str(), "w");
  std::FILE* sightings = std::fopen((folder + "/sightings.csv").c_str(), "w");
  std::FILE* landmarks = std::fopen((folder + "/landmarks.csv").c_str(), "w");
  std::FILE* truth = std::fopen((folder + "/truth.csv").c_str(), "w");
  if (odometry == nullptr || sightings == nullptr || landmarks == nullptr || truth == nullptr) {
    std::fprintf(stderr, "record_drive: %s cannot be written into\n", folder.c_str());
    return 2;
  }
  std::fprintf(odometry, "time (s),velocity (m/s),turn rate (rad/s)\n");
  std::fprintf(sightings, "time (s),landmark,range (m),bearing (rad)\n");
  std::fprintf(landmarks, "number,x (m),y (m)\n");
  std::fprintf(truth, "time (s),x (m),y (m),heading (rad)\n");

  Random random(2026);
  std::vector<Eigen::Vector2d> marks;
  for (int i = 0; i < 12; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 12.0;
    marks.emplace_back(4.0 * std::cos(angle) + random.uniform(-0.5, 0.5),
                       3.0 * std::sin(angle) + random.uniform(-0.5, 0.5));
    std::fprintf(landmarks, "%d,%.4f,%.4f\n", i + 1, marks.back()(0), marks.back()(1));
  }

  constexpr double dt = 0.05;
  constexpr double lead = 0.15;
  const auto commanded = [](double t) {
    return Eigen::Vector2d(0.3 + 0.1 * std::sin(0.21 * t), 0.4 * std::sin(0.37 * t) + 0.12);
  };
  Pose2d pose(-1.0, -0.5, 0.3);
  for (int i = 0; i <= 1800; ++i) {
    const double t = dt * i;
    const Eigen::Vector2d now = commanded(t + lead);
    std::fprintf(odometry, "%.2f,%.4f,%.4f\n", t, now(0), now(1));
    std::fprintf(truth, "%.2f,%.4f,%.4f,%.4f\n", t, pose.x(), pose.y(), pose.angle());
    if (i % 6 == 0) {
      for (std::size_t j = 0; j < marks.size(); ++j) {
        const Eigen::Vector2d seen = pose.inverse() * marks[j];
        const double bearing = std::atan2(seen(1), seen(0));
        if (std::abs(bearing) > 0.6 || random.uniform() < 0.3) {
          continue;
        }
        const std::size_t named = random.uniform() < 0.05 ? (j + 5) % marks.size() : j;
        std::fprintf(sightings, "%.2f,%zu,%.3f,%.4f\n", t, named + 1,
                     1.02 * seen(0) + 0.03 * random.normal(), bearing + 0.01 * random.normal());
      }
    }
    const Eigen::Vector2d done = commanded(t);
    pose = pose * Pose2d::exp(Eigen::Vector3d(dt * (0.96 * done(0) + 0.03 * random.normal()), 0.0,
                                              dt * (1.05 * done(1) + 0.08 * random.normal())));
  }
  for (std::FILE* file : {odometry, sightings, landmarks, truth}) {
    if (std::fclose(file) != 0) {
      std::fprintf(stderr, "record_drive: %s could not be written\n", folder.c_str());
      return 2;
    }
  }
  return 0;
}
