#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/Dense>

#include <flyball/estimation/pose_estimator.hpp>

#include "timing.hpp"

// The pose estimator's steps, against a plain transcription in Eigen's fixed sizes in the same
// process. Budgets: odometry and a seen pose 0.15 µs, a pose of 50 samples ago 10 µs.
namespace {

using namespace flyball;
using Eigen::Matrix3d;
using Eigen::Vector3d;

template <class T>
void touch(T& value) {
  asm volatile("" : "+m"(value));
}

template <class Work>
double nanoseconds(int batch, Work&& work) {
  double best = 1e300;
  for (int k = 0; k < 200; ++k) {
    best = std::min(best, 1e3 * bench::microseconds(batch, work));
  }
  return best;
}

void tell(const char* name, double time, double peer) {
  std::printf("  %-58s %8.1f ns  %6.2f\n", name, time, time / peer);
}

/// What a user would write by hand: x, y and θ on the field.
struct PlainPose {
  Vector3d x = Vector3d::Zero();
  Matrix3d P = 0.01 * Matrix3d::Identity();

  void predict(const Vector3d& twist, const Matrix3d& W) {
    const double half = 0.5 * twist(2);
    const double chord = std::abs(half) < 1e-9 ? 1.0 : std::sin(half) / half;
    const double c = std::cos(x(2) + half);
    const double s = std::sin(x(2) + half);
    const double dx = chord * (c * twist(0) - s * twist(1));
    const double dy = chord * (s * twist(0) + c * twist(1));
    Matrix3d F = Matrix3d::Identity();
    F(0, 2) = -dy;
    F(1, 2) = dx;
    Matrix3d G = Matrix3d::Identity();
    G.topLeftCorner<2, 2>() << c, -s, s, c;
    x += Vector3d(dx, dy, twist(2));
    P = F * P * F.transpose() + G * W * G.transpose();
  }
  void correct(const Vector3d& y, const Matrix3d& R) {
    const Matrix3d S = P + R;
    const Matrix3d K = S.llt().solve(P).transpose();
    Vector3d e = y - x;
    e(2) = std::remainder(e(2), 2.0 * 3.141592653589793);
    x += K * e;
    const Matrix3d I_K = Matrix3d::Identity() - K;
    P = I_K * P * I_K.transpose() + K * R * K.transpose();
  }
};

detail::PoseFilter made() {
  const PoseEstimatorOptions options;
  const auto estimate =
      Estimate<Pose2d>::create(Pose2d(), Eigen::MatrixXd(0.01 * Matrix3d::Identity())).value();
  return {detail::PoseBelief{estimate, estimate}, options, OutlierGuard::create().value()};
}

}  // namespace

int main() {
  Vector3d twist(0.02, 0.0, 0.01);
  Vector3d y(0.01, 0.02, 0.03);
  Matrix3d W = 1e-6 * Matrix3d::Identity();
  Matrix3d R = 1e-2 * Matrix3d::Identity();
  std::printf("Pose of the plane, 3 states: odometry and a seen pose; times plain Eigen\n");
  PlainPose plain;
  const double peer = nanoseconds(2000, [&] {
    twist = -twist;
    touch(twist);
    touch(y);
    plain.predict(twist, W);
    plain.correct(y, R);
    touch(plain);
  });
  tell("plain Eigen", peer, peer);
  detail::PoseFilter filter = made();
  const detail::SeenPose seen{{Pose2d(y(0), y(1), y(2))}, 1, MeasurementNoise<3>(R)};
  Vector3d rate = twist / 0.02;
  tell("the filter of PoseEstimator, with its gate",
       nanoseconds(2000,
                   [&] {
                     rate = -rate;
                     touch(rate);
                     filter.predict(rate, 0.02);
                     auto outcome = filter.take(seen);
                     touch(outcome);
                   }),
       peer);

  auto estimator =
      PoseEstimator::create(0.0, Pose2d(), Eigen::MatrixXd(0.01 * Matrix3d::Identity())).value();
  double time = 0.0;
  const MeasurementNoise<3> noise(R);
  const Pose2d here(0.01, 0.0, 0.01);
  tell("PoseEstimator, with its history",
       nanoseconds(2000,
                   [&] {
                     twist = -twist;
                     time += 0.02;
                     estimator.predict(time, twist);
                     auto outcome = estimator.correct(time, here, noise);
                     touch(outcome);
                   }),
       peer);

  std::printf("A pose of 50 samples ago, that is gone through again; times the budget of 10 µs\n");
  // `poses` after each prediction, one of them `ago`.
  const auto replay = [&](const char* name, int poses, double ago) {
    auto of_many = estimator;
    std::size_t replayed = 0;
    tell(name,
         nanoseconds(200,
                     [&] {
                       twist = -twist;
                       time += 0.02;
                       of_many.predict(time, twist);
                       for (int k = 1; k < poses; ++k) {
                         of_many.correct(time, here, noise);
                       }
                       replayed = of_many.correct(time - ago, here, noise).replayed;
                     }),
         10000.0);
    std::printf("    (%zu samples replayed)\n", replayed);
  };
  replay("a prediction and the late pose a loop", 1, 0.99);
  replay("a prediction, a pose and the late pose a loop", 2, 0.49);
  replay("a prediction, 3 poses and the late pose a loop", 4, 0.25);
}
