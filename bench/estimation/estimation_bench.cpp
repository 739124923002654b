#include <algorithm>
#include <array>
#include <cstdio>

#include <Eigen/Dense>

#include <flyball/estimation/delayed_filter.hpp>
#include <flyball/estimation/forms/information_form.hpp>
#include <flyball/estimation/forms/ud_covariance.hpp>
#include <flyball/estimation/invariant.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/geometry/se2.hpp>

#include "drivetrain.hpp"
#include "timing.hpp"

// Filters' steps, against a plain transcription in Eigen's fixed sizes in the same process.
// Budgets: a Kalman filter of two states 45 ns (Joseph), 90 ns (factored); the extended one of a
// drivetrain (5 states, 2 inputs, 3 outputs) 0.6 µs; the square-root unscented one 3 µs.
namespace {

using namespace flyball;
using Vector1 = Eigen::Matrix<double, 1, 1>;
using Vector5 = Eigen::Vector<double, 5>;

template <class T>
void touch(T& value) {
  asm volatile("" : "+m"(value));
}

template <class Work>
double nanoseconds(Work&& work) {
  double best = 1e300;
  for (int k = 0; k < 200; ++k) {
    best = std::min(best, 1e3 * bench::microseconds(2000, work));
  }
  return best;
}

void tell(const char* name, double time, double peer) {
  std::printf("  %-58s %8.1f ns  %6.2f\n", name, time, time / peer);
}

// What a user would write by hand.
struct PlainKalman {
  Eigen::Matrix2d A, Q, P;
  Eigen::Vector2d B, x;
  Eigen::Matrix<double, 1, 2> C;
  Vector1 R;

  void predict(const Vector1& u) {
    x = A * x + B * u;
    P = A * P * A.transpose() + Q;
  }
  void correct(const Vector1& y) {
    const Vector1 S = C * P * C.transpose() + R;
    const Eigen::Vector2d K = P * C.transpose() * S.inverse();
    x += K * (y - C * x);
    const Eigen::Matrix2d I_KC = Eigen::Matrix2d::Identity() - K * C;
    P = I_KC * P * I_KC.transpose() + K * R * K.transpose();
  }
};

struct PlainExtended {
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  bench::Drivetrain model;
  Matrix5 Q, P;
  Vector5 x;
  Eigen::Matrix3d R;

  Matrix5 slope(const Vector5& at) const {
    const double c = std::cos(at(2));
    const double s = std::sin(at(2));
    const double v = 0.5 * (at(3) + at(4));
    Matrix5 A = Matrix5::Zero();
    A(0, 2) = -v * s;
    A(0, 3) = A(0, 4) = 0.5 * c;
    A(1, 2) = v * c;
    A(1, 3) = A(1, 4) = 0.5 * s;
    A(2, 3) = -1.0 / model.trackwidth;
    A(2, 4) = 1.0 / model.trackwidth;
    A(3, 3) = A(4, 4) = model.c1;
    A(3, 4) = A(4, 3) = model.c2;
    return A;
  }
  void predict(const Eigen::Vector2d& u, double h) {
    const Matrix5 I = Matrix5::Identity();
    const Vector5 k1 = model.derivative(x, u);
    const Matrix5 K1 = slope(x);
    const Vector5 x2 = x + 0.5 * h * k1;
    const Vector5 k2 = model.derivative(x2, u);
    const Matrix5 K2 = slope(x2) * (I + 0.5 * h * K1);
    const Vector5 x3 = x + 0.5 * h * k2;
    const Vector5 k3 = model.derivative(x3, u);
    const Matrix5 K3 = slope(x3) * (I + 0.5 * h * K2);
    const Vector5 x4 = x + h * k3;
    const Vector5 k4 = model.derivative(x4, u);
    const Matrix5 K4 = slope(x4) * (I + h * K3);
    x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    const Matrix5 F = I + h / 6.0 * (K1 + 2.0 * K2 + 2.0 * K3 + K4);
    P = F * P * F.transpose() + Q;
  }
  /// One linearisation of the plant, at the start: less exact, and what is usual.
  void predict_by_one_slope(const Eigen::Vector2d& u, double h) {
    const Matrix5 A = h * slope(x);
    const Matrix5 F = Matrix5::Identity() + A + 0.5 * A * A;
    x = rk4([&](const Vector5& at) { return model.derivative(at, u); }, x, h);
    P = F * P * F.transpose() + Q;
  }
  void correct(const Eigen::Vector3d& y) {
    Eigen::Matrix<double, 3, 5> C = Eigen::Matrix<double, 3, 5>::Zero();
    C.rightCols<3>().setIdentity();
    const Eigen::Matrix3d S = C * P * C.transpose() + R;
    const Eigen::Matrix<double, 5, 3> K = S.llt().solve(C * P).transpose();
    x += K * (y - C * x);
    const Matrix5 I_KC = Matrix5::Identity() - K * C;
    P = I_KC * P * I_KC.transpose() + K * R * K.transpose();
  }
};

void two_states() {
  Eigen::Matrix2d A;
  A << 1.0, 0.02, 0.0, 0.95;
  const Eigen::Vector2d B(2e-4, 0.02);
  const Eigen::Matrix<double, 1, 2> C(1.0, 0.0);
  const Eigen::Matrix2d Q = Eigen::Vector2d(1e-6, 2.5e-3).asDiagonal();
  const Vector1 R(1e-4);
  Vector1 u(1.0);
  Vector1 y(0.1);

  std::printf("Kalman filter, 2 states, 1 output: predict and correct; times plain Eigen\n");
  PlainKalman plain{A, Q, Eigen::Matrix2d::Identity(), B, Eigen::Vector2d::Zero(), C, R};
  const double peer = nanoseconds([&] {
    touch(u);
    touch(y);
    plain.predict(u);
    plain.correct(y);
    touch(plain);
  });
  tell("plain Eigen", peer, peer);
  const auto of_form = [&]<class Form>(const char* name, Form) {
    auto estimate = Estimate<Eigen::Vector2d, Form>::create(
                        Eigen::Vector2d::Zero(), Eigen::MatrixXd(Eigen::Matrix2d::Identity()))
                        .value();
    const typename Form::Noise noise(Q);
    const MeasurementNoise<1> of_sensor(R);
    tell(name, nanoseconds([&] {
           touch(u);
           touch(y);
           predict(estimate, A, B, u, noise);
           auto correction = correct(estimate, y, C, of_sensor);
           touch(correction);
         }),
         peer);
  };
  of_form("Estimate, JosephCovariance", JosephCovariance<2>{});
  of_form("Estimate, UdCovariance", UdCovariance<2>{});
  of_form("Estimate, SquareRootCovariance", SquareRootCovariance<2>{});
  of_form("Estimate, InformationForm", InformationForm<2>{});
  auto filter =
      kalman_filter(DiscreteSystem<2, 1, 1>{A, B, C, Vector1(0.0), Time(0.02)}, Eigen::MatrixXd(Q),
                    Eigen::MatrixXd(R), Eigen::MatrixXd(Eigen::Matrix2d::Identity()))
          .value();
  tell("KalmanFilter", nanoseconds([&] {
         touch(u);
         touch(y);
         filter.predict(u);
         filter.update(y, u);
       }),
       peer);
}

struct DriveCase {
  Eigen::MatrixXd Q, R, P0;
  DriveCase() {
    Vector5 of_states;
    of_states << 0.5, 0.5, 10.0, 1.0, 1.0;
    Q = 0.02 * of_states.cwiseAbs2().asDiagonal().toDenseMatrix();
    R = Eigen::Vector3d(1e-8, 1e-4, 1e-4).asDiagonal();
    P0 = Eigen::MatrixXd::Identity(5, 5);
  }
};

template <class Filter>
Filter drive_filter() {
  const DriveCase c;
  return Filter::create(bench::Drivetrain{}, c.Q, c.R, {Vector5(Vector5::Zero()), c.P0}, Time(0.02))
      .value();
}

void drivetrain() {
  const DriveCase c;
  Eigen::Vector2d u(6.0, 5.0);
  Eigen::Vector3d y(0.1, 0.2, 0.3);
  std::printf(
      "Drivetrain, 5 states, 2 inputs, 3 outputs: predict and correct; times plain Eigen\n");
  PlainExtended plain{{}, c.Q, c.P0, Vector5::Zero(), c.R};
  const double peer = nanoseconds([&] {
    touch(u);
    touch(y);
    plain.predict(u, 0.02);
    plain.correct(y);
    touch(plain);
  });
  tell("plain Eigen, RK4's own derivative by hand", peer, peer);
  PlainExtended usual{{}, c.Q, c.P0, Vector5::Zero(), c.R};
  tell("plain Eigen, one derivative a step by hand", nanoseconds([&] {
         touch(u);
         touch(y);
         usual.predict_by_one_slope(u, 0.02);
         usual.correct(y);
         touch(usual);
       }),
       peer);
  const auto of_filter = [&]<class Filter>(const char* name, Filter filter) {
    tell(name, nanoseconds([&] {
           touch(u);
           touch(y);
           filter.predict(u);
           auto correction = filter.correct(y, u);
           touch(correction);
         }),
         peer);
    return filter;
  };
  auto extended =
      of_filter("ExtendedKalmanFilter", drive_filter<ExtendedKalmanFilter<bench::Drivetrain>>());
  tell("  its predict", nanoseconds([&] {
         touch(u);
         extended.predict(u);
       }),
       peer);
  of_filter("ExtendedKalmanFilter, UdCovariance",
            drive_filter<ExtendedKalmanFilter<bench::Drivetrain, UdCovariance<5>>>());
  of_filter("ExtendedKalmanFilter, SquareRootCovariance",
            drive_filter<ExtendedKalmanFilter<bench::Drivetrain, SquareRootCovariance<5>>>());
  of_filter("UnscentedKalmanFilter", drive_filter<UnscentedKalmanFilter<bench::Drivetrain>>());
  of_filter("SquareRootUnscentedKalmanFilter",
            drive_filter<SquareRootUnscentedKalmanFilter<bench::Drivetrain>>());
  of_filter("SquareRootUnscentedKalmanFilter, SimplexPoints",
            drive_filter<SquareRootUnscentedKalmanFilter<bench::Drivetrain, SimplexPoints>>());
}

using Pose = SE2<double>;

/// A landmark in the robot's frame, with its derivative by hand: what a user of poses would write.
struct Landmark {
  Eigen::Vector2d place;
  template <class X>
  auto operator()(const X& x) const {
    using T = typename X::Scalar;
    return Eigen::Matrix<T, 2, 1>(x.inverse() * Eigen::Matrix<T, 2, 1>(place.template cast<T>()));
  }
};

/// An Estimate of a pose as DelayedFilter takes it: the input is the twist of the odometry.
struct PoseFilter {
  using InputVector = Eigen::Vector3d;
  Estimate<Pose> pose;
  Eigen::Matrix3d W = 1e-4 * Eigen::Matrix3d::Identity();

  bool predict(const InputVector& velocity, double dt) noexcept {
    return predict_by_odometry(pose, Eigen::Vector3d(velocity * dt), Eigen::Matrix3d(W * dt));
  }
  const Estimate<Pose>& estimate() const noexcept { return pose; }
  void restore(const Estimate<Pose>& other) noexcept { pose = other; }
};
struct SeenPose {
  Pose y;
  bool operator()(PoseFilter& filter) const noexcept {
    static const MeasurementNoise<3> R(Eigen::Matrix3d(1e-2 * Eigen::Matrix3d::Identity()));
    return filter.pose.correct<3>(y.minus(filter.pose.x_hat()), Eigen::Matrix3d::Identity(), R)
        .accepted();
  }
};

void poses() {
  std::printf("Pose of the plane, 3 states\n");
  const Eigen::MatrixXd P = Eigen::MatrixXd(0.01 * Eigen::Matrix3d::Identity());
  auto filter = Estimate<Pose>::create(Pose(), P).value();
  Eigen::Vector3d twist(0.02, 0.0, 0.01);
  Eigen::Vector2d y(2.0, 1.0);
  const Eigen::Matrix3d W = 1e-6 * Eigen::Matrix3d::Identity();
  const auto R = MeasurementNoise<2>::independent(Eigen::Vector2d(0.01, 0.01));
  const double predict_only = nanoseconds([&] {
    touch(twist);
    predict_by_odometry(filter, twist, W);
  });
  tell("odometry, SE(2)", predict_only, 150.0);
  tell(
      "odometry and a whole pose, H = I", nanoseconds([&] {
        touch(twist);
        predict_by_odometry(filter, twist, W);
        const Eigen::Vector3d off = Pose(0.1, 0.2, 0.3).minus(filter.x_hat());
        static const MeasurementNoise<3> whole(Eigen::Matrix3d(1e-2 * Eigen::Matrix3d::Identity()));
        auto correction = filter.correct<3>(off, Eigen::Matrix3d::Identity(), whole);
        touch(correction);
      }),
      150.0);
  tell("odometry and a landmark, Extended", nanoseconds([&] {
         touch(twist);
         touch(y);
         predict_by_odometry(filter, twist, W);
         auto correction = Extended{}.correct(filter, y, Landmark{{3.0, 2.0}}, R);
         touch(correction);
       }),
       150.0);
  DelayedFilter<PoseFilter, SeenPose, 64> history({Estimate<Pose>::create(Pose(), P).value()}, 0.0);
  double time = 0.0;
  const SeenPose seen{Pose(0.1, 0.0, 0.1)};
  tell("an input and a pose of 50 samples ago, replayed", nanoseconds([&] {
         time += 0.02;
         history.advance(time, twist);
         const auto outcome = history.measure(time - 0.49, seen);
         (void)outcome;
       }),
       10000.0);
}

}  // namespace

int main() {
  two_states();
  drivetrain();
  poses();
}
