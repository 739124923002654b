#include <flyball/mechanisms/drivetrain/pose_drive.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/drivetrain/encoder_drive.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::pose_drive_test {
namespace {

using namespace flyball::literals;

using Vector5 = Eigen::Vector<double, 5>;
using Vector10 = Eigen::Vector<double, 10>;
using Eigen::Vector2d;

static_assert(ParametricModel<PoseDrive> && ParametricModel<EncoderDrive>);

DifferentialDriveParameters random_parts(Random& random) {
  return {.motor = cim(random.uniform(0.0, 1.0) < 0.5 ? 2 : 3),
          .left_gearing = random.uniform(4.0, 12.0),
          .right_gearing = random.uniform(4.0, 12.0),
          .mass = Mass(random.uniform(20.0, 70.0)),
          .wheel_radius = Length(random.uniform(0.03, 0.1)),
          .trackwidth = Length(random.uniform(0.4, 0.9)),
          .moment_of_inertia = MomentOfInertia(random.uniform(1.0, 9.0))};
}

/// C_1 to C_4 and p, q of Theorem 8.7.1, as printed.
struct Printed {
  double C_1, C_2, C_3, C_4, p, q, r_b;
  explicit Printed(const DifferentialDriveParameters& d)
      : C_1(-std::pow(d.left_gearing, 2) * d.motor.Kt /
            (d.motor.Kv * d.motor.R * std::pow(d.wheel_radius.si(), 2))),
        C_2(d.left_gearing * d.motor.Kt / (d.motor.R * d.wheel_radius.si())),
        C_3(-std::pow(d.right_gearing, 2) * d.motor.Kt /
            (d.motor.Kv * d.motor.R * std::pow(d.wheel_radius.si(), 2))),
        C_4(d.right_gearing * d.motor.Kt / (d.motor.R * d.wheel_radius.si())),
        p(1.0 / d.mass.si() + std::pow(d.trackwidth.si() / 2.0, 2) / d.moment_of_inertia.si()),
        q(1.0 / d.mass.si() - std::pow(d.trackwidth.si() / 2.0, 2) / d.moment_of_inertia.si()),
        r_b(d.trackwidth.si() / 2.0) {}
  /// (8.12)
  [[nodiscard]] Eigen::Matrix<double, 5, 5> A(double theta, double v) const {
    const double c = std::cos(theta);
    const double s = std::sin(theta);
    return Eigen::Matrix<double, 5, 5>{{0, 0, -v * s, 0.5 * c, 0.5 * c},
                                       {0, 0, v * c, 0.5 * s, 0.5 * s},
                                       {0, 0, 0, -1.0 / (2 * r_b), 1.0 / (2 * r_b)},
                                       {0, 0, 0, p * C_1, q * C_3},
                                       {0, 0, 0, q * C_1, p * C_3}};
  }
  /// (8.13)
  [[nodiscard]] Eigen::Matrix<double, 5, 2> B() const {
    return Eigen::Matrix<double, 5, 2>{
        {0, 0}, {0, 0}, {0, 0}, {p * C_2, q * C_4}, {q * C_2, p * C_4}};
  }
};

template <int N>
Eigen::Vector<double, N> random_state(Random& random) {
  Eigen::Vector<double, N> x;
  for (auto& entry : x) {
    entry = random.uniform(-4.0, 4.0);
  }
  return x;
}

// Closed forms against the print, and against dual numbers, whatever the drive.
TEST(PoseDrive, JacobiansAreTheorem873) {
  Random random(873);
  for (int trial = 0; trial < 200; ++trial) {
    const auto parts = random_parts(random);
    const PoseDrive drive = pose_drive(parts).value();
    const Printed printed(parts);
    const auto x = random_state<5>(random);
    const Vector2d u(random.uniform(-12.0, 12.0), random.uniform(-12.0, 12.0));
    const auto A = printed.A(x(2), 0.5 * (x(3) + x(4)));
    const auto system = linearize(drive, x, u).value();
    EXPECT_LE((system.A - A).norm(), 1e-12 * A.norm());
    EXPECT_LE((system.B - printed.B()).norm(), 1e-12 * printed.B().norm());
    const auto dual =
        jacobians([&](const auto& at, const auto& in) { return drive.derivative(at, in); }, x, u);
    EXPECT_LE((dual.by_x - A).norm(), 1e-12 * A.norm());
    EXPECT_LE((dual.by_u - printed.B()).norm(), 1e-12 * printed.B().norm());
    // (8.14): the robot's frame is θ = 0.
    Vector5 ahead = x;
    ahead(2) = 0.0;
    Eigen::Matrix<double, 5, 5> A_robot;
    Eigen::Matrix<double, 5, 2> B_robot;
    drive.jacobians(ahead, u, A_robot, B_robot);
    Eigen::Matrix<double, 5, 5> theorem_874 = A;
    theorem_874.topRows<2>() << 0, 0, 0, 0.5, 0.5, 0, 0, 0.5 * (x(3) + x(4)), 0, 0;
    EXPECT_LE((A_robot - theorem_874).norm(), 1e-12 * A.norm());
  }
}

// (8.17) to (8.21), assembled from blocks as the book does, against both Jacobians.
TEST(EncoderDrive, JacobiansAreEquations817To821) {
  Random random(876);
  for (int trial = 0; trial < 200; ++trial) {
    const auto parts = random_parts(random);
    const EncoderDrive drive = encoder_drive(parts).value();
    const Printed printed(parts);
    const auto x = random_state<10>(random);
    const Vector2d u(random.uniform(-12.0, 12.0), random.uniform(-12.0, 12.0));

    const auto positions = encoder_positions_drive(differential_drive(parts).value()).value();
    Eigen::Matrix4d A_wheels;
    A_wheels << printed.A(0, 0).bottomRightCorner<2, 2>(), Eigen::Matrix2d::Zero(),
        Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Zero();
    Eigen::Matrix<double, 4, 2> B_wheels;
    B_wheels << printed.B().bottomRows<2>(), Eigen::Matrix2d::Zero();
    EXPECT_LE((positions.A - A_wheels).norm(), 1e-12 * A_wheels.norm());
    EXPECT_LE((positions.B - B_wheels).norm(), 1e-12 * B_wheels.norm());

    Eigen::Matrix<double, 10, 10> A = Eigen::Matrix<double, 10, 10>::Zero();
    A.topLeftCorner<3, 5>() = printed.A(x(2), 0.5 * (x(3) + x(4))).topRows<3>();
    A.block<4, 4>(3, 3) = A_wheels;
    A.block<4, 2>(3, 7) = B_wheels;
    A.block<4, 1>(3, 9) << 0, 0, 1, -1;  // B_θ
    Eigen::Matrix<double, 10, 2> B = Eigen::Matrix<double, 10, 2>::Zero();
    B.block<4, 2>(3, 0) = B_wheels;
    Eigen::Matrix<double, 3, 10> C = Eigen::Matrix<double, 3, 10>::Zero();
    C(0, 2) = C(1, 5) = C(2, 6) = 1.0;

    const auto system = linearize(drive, x, u).value();
    const auto dual =
        jacobians([&](const auto& at, const auto& in) { return drive.derivative(at, in); }, x, u);
    EXPECT_LE((system.A - A).norm(), 1e-12 * A.norm());
    EXPECT_LE((dual.by_x - A).norm(), 1e-12 * A.norm());
    EXPECT_LE((system.B - B).norm(), 1e-12 * B.norm());
    EXPECT_LE((dual.by_u - B).norm(), 1e-12 * B.norm());
    EXPECT_EQ(system.C, C);
    EXPECT_TRUE(system.D.isZero());
  }
  Eigen::Matrix<double, 2, 3> K_error;
  K_error << 1, 0, 0, 0, 1, 0;
  EXPECT_EQ(EncoderDrive::error_gain(), K_error);
}

// Of identified gains the sides' block is Theorem 14.4.1's, and the friction of each side opposes
// its motion.
TEST(PoseDrive, OfIdentifiedGains) {
  const DriveGains gains{.kS_left = 0.1,
                         .kS_right = 0.2,
                         .kV_linear = 2.5,
                         .kA_linear = 0.4,
                         .kV_angular = 1.1,
                         .kA_angular = 0.15};
  const PoseDrive drive = pose_drive(gains, 60_cm).value();
  const DifferentialDrive sides = differential_drive(gains).value();
  const Vector5 x(1.0, -2.0, 0.7, 1.5, -0.5);
  const Vector2d u(3.0, -4.0);
  const Vector5 rate = drive.derivative(x, u);
  EXPECT_EQ((rate.tail<2>()), sides.derivative(x.tail<2>(), u));
  EXPECT_DOUBLE_EQ(rate(0), 0.5 * std::cos(0.7));
  EXPECT_DOUBLE_EQ(rate(1), 0.5 * std::sin(0.7));
  EXPECT_DOUBLE_EQ(rate(2), -2.0 / 0.6);
  // The observer's model is the same drive where its errors are zero, and adds them to the inputs.
  const EncoderDrive observed = encoder_drive(gains, 60_cm).value();
  Vector10 wide = Vector10::Zero();
  wide.head<5>() = x;
  EXPECT_EQ((observed.derivative(wide, u).head<5>()), rate);
  wide.segment<3>(7) << 0.5, -0.25, 0.125;
  const Vector10 off = observed.derivative(wide, u);
  EXPECT_LE((off.segment<2>(3) - sides.derivative(x.tail<2>(), Vector2d(3.5, -4.25))).norm(),
            1e-14);
  EXPECT_EQ(off(5), 1.625);
  EXPECT_EQ(off(6), -0.625);
  EXPECT_EQ(observed.output(wide, u), Eigen::Vector3d(0.7, 0.0, 0.0));
}

// Constant equal voltages to their steady speeds: an arc whose chord is the exponential of SE(2);
// and the model's path against an integration of the same motion in other coordinates (the middle's
// speed and rate, with the path's complex position), both at 1e-12.
TEST(PoseDrive, PathAgainstAnIntegrationInOtherCoordinates) {
  const DriveGains gains{.kV_linear = 2.5, .kA_linear = 0.4, .kV_angular = 1.1, .kA_angular = 0.15};
  const double width = 0.6;
  const PoseDrive drive = pose_drive(gains, Length(width)).value();
  const IntegrationOptions tight{.relative_tolerance = 1e-12, .absolute_tolerance = 1e-12};
  const auto volts = [](double t) { return Vector2d(8.0 * std::sin(2.0 * t), 5.0 + 3.0 * t); };
  const auto path =
      integrate([&](double t, const Vector5& x) { return Vector5(drive.derivative(x, volts(t))); },
                0.0, Vector5(0.3, -0.2, 0.4, 0.0, 0.0), 2.0, tight);
  const auto other = integrate(
      [&](double t, const Vector5& z) {
        const Vector2d u = volts(t);
        const double v = z(3);
        const double w = z(4);  // (vr - vl)/2
        return Vector5(v * std::cos(z(2)), v * std::sin(z(2)), 2.0 * w / width,
                       (0.5 * (u(0) + u(1)) - 2.5 * v) / 0.4,
                       (0.5 * (u(1) - u(0)) - 1.1 * w) / 0.15);
      },
      0.0, Vector5(0.3, -0.2, 0.4, 0.0, 0.0), 2.0, tight);
  ASSERT_TRUE(path && other);
  const Eigen::VectorXd& x = path->final_state();
  const Eigen::VectorXd& z = other->final_state();
  EXPECT_LE((x.head(3) - z.head(3)).norm(), 1e-8 * z.head(3).norm());
  EXPECT_NEAR(0.5 * (x(3) + x(4)), z(3), 1e-8 * std::abs(z(3)));
  EXPECT_NEAR(0.5 * (x(4) - x(3)), z(4), 1e-8 * std::abs(z(4)));
}

// A period of the loop does not allocate: the derivative, a step and the Jacobians.
TEST(PoseDrive, AllocatesNothing) {
  const PoseDrive drive =
      pose_drive(
          DriveGains{.kV_linear = 2.5, .kA_linear = 0.4, .kV_angular = 1.1, .kA_angular = 0.15},
          60_cm)
          .value();
  const EncoderDrive observed =
      encoder_drive(
          DriveGains{.kV_linear = 2.5, .kA_linear = 0.4, .kV_angular = 1.1, .kA_angular = 0.15},
          60_cm)
          .value();
  Vector5 x(0.0, 0.0, 0.3, 1.0, 2.0);
  Vector10 wide = Vector10::Ones();
  Eigen::Matrix<double, 5, 5> A;
  Eigen::Matrix<double, 5, 2> B;
  Eigen::Matrix<double, 10, 10> A_wide;
  Eigen::Matrix<double, 10, 2> B_wide;
  const test::AllocationCounter counter;
  for (int i = 0; i < 10; ++i) {
    x = rk4(drive, x, Vector2d(3.0, 2.0), 0.005);
    drive.jacobians(x, Vector2d(3.0, 2.0), A, B);
    wide = rk4(observed, wide, Vector2d(3.0, 2.0), 0.005);
    observed.jacobians(wide, Vector2d(3.0, 2.0), A_wide, B_wide);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_TRUE(x.allFinite() && wide.allFinite());
}

TEST(PoseDrive, IsDescribed) {
  const AnyModel model =
      encoder_drive(
          DriveGains{.kV_linear = 2.5, .kA_linear = 0.4, .kV_angular = 1.1, .kA_angular = 0.15},
          60_cm)
          .value();
  EXPECT_EQ(label(model.names().states[2]), "heading (rad)");
  EXPECT_TRUE(model.names().states[2].is_angle && model.names().outputs[0].is_angle);
  EXPECT_EQ(label(model.names().states[9]), "heading error (m/s)");
  EXPECT_EQ(model.description().parameters[0].value, 0.6);
  // Half the trackwidth turns twice as fast.
  const AnyModel narrow = model.with_parameter("trackwidth", 0.3).value();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(10);
  x(4) = 1.0;
  Eigen::VectorXd rate(10);
  narrow.derivative(x, Eigen::VectorXd::Zero(2), rate);
  EXPECT_DOUBLE_EQ(rate(2), 1.0 / 0.3);
}

TEST(PoseDrive, RefusesWhatIsNoDrive) {
  const DriveGains gains{.kV_linear = 2.5, .kA_linear = 0.4, .kV_angular = 1.1, .kA_angular = 0.15};
  EXPECT_EQ(to_string(pose_drive(gains, 0_m).error()),
            "pose_drive: trackwidth is 0 m; it must be greater than zero");
  EXPECT_EQ(encoder_drive(gains, Length(-0.5)).error().subject(), "trackwidth");
  EXPECT_TRUE(encoder_drive(gains, Length(NAN)).error().is(ArgumentError::not_finite));
  EXPECT_FALSE(pose_drive(gains, Length(1e-320)));
  DifferentialDrive drive = differential_drive(gains).value();
  drive.kS_left = -1.0;
  EXPECT_EQ(pose_drive(drive, 60_cm).error().subject(), "kS_left");
  drive.A(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(pose_drive(drive, 60_cm).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(encoder_positions_drive(drive).error().is(ArgumentError::not_finite));
  EXPECT_FALSE(pose_drive(DriveGains{}, 60_cm));
  EXPECT_FALSE(pose_drive(DifferentialDriveParameters{}));
  EXPECT_FALSE(encoder_drive(DifferentialDriveParameters{}));
}

}  // namespace
}  // namespace flyball::mechanisms::pose_drive_test
