#include <flyball/mechanisms/differential_drive.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/systems/discretize.hpp>

namespace flyball::mechanisms::differential_drive_test {
namespace {

using namespace flyball::literals;

constexpr DriveGains some_gains{.kS_left = 0.1,
                                .kS_right = 0.2,
                                .kV_linear = 2.5,
                                .kA_linear = 0.4,
                                .kV_angular = 1.1,
                                .kA_angular = 0.15};

void expect_matrix(const Eigen::Matrix2d& found, const Eigen::Matrix2d& expected, double relative) {
  EXPECT_LE((found - expected).norm(), relative * expected.norm()) << found;
}

DifferentialDriveParameters of_book(int motors) {
  return {.motor = cim(motors),
          .left_gearing = 60.0 / 11.0,
          .right_gearing = 60.0 / 11.0,
          .mass = 52_kg,
          .wheel_radius = Length(0.08255 / 2.0),
          .trackwidth = Length(0.59055),
          .moment_of_inertia = MomentOfInertia(6.0)};
}

// The matrices of the book's figures 8.3 and 8.4, printed in full by its scripts (frccontrol
// b0a237a, Python 3.11): two and three CIMs a side; the first discretised at 5 ms.
TEST(DifferentialDrive, NumbersOfTheBooksScripts) {
  const DifferentialDrive two = differential_drive(of_book(2)).value();
  Eigen::Matrix2d A;
  Eigen::Matrix2d B;
  A << -5.027892724619944, -0.6998646867368526, -0.6998646867368526, -5.027892724619944;
  B << 1.7995488399804316, 0.25049076305735457, 0.25049076305735457, 1.7995488399804316;
  expect_matrix(two.A, A, 1e-14);
  expect_matrix(two.B, B, 1e-14);

  const auto discrete = discretize(two, 5_ms).value();
  A << 0.9751798718961207, -0.003412455848986536, -0.003412455848986536, 0.9751798718961207;
  B << 0.00888344982357952, 0.0012213627658478623, 0.0012213627658478625, 0.008883449823579522;
  expect_matrix(discrete.A, A, 1e-14);
  expect_matrix(discrete.B, B, 1e-14);

  const DifferentialDrive three = differential_drive(of_book(3)).value();
  A << -7.541839086929915, -1.0497970301052788, -1.0497970301052788, -7.541839086929915;
  B << 2.6993232599706474, 0.37573614458603183, 0.37573614458603183, 2.6993232599706474;
  expect_matrix(three.A, A, 1e-14);
  expect_matrix(three.B, B, 1e-14);
}

// (14.12) by hand: kV/kA are 6.25 and 7 1/3, 1/kA 2.5 and 6 2/3; half their sum and difference.
TEST(DifferentialDrive, Theorem1441) {
  const DifferentialDrive drive = differential_drive(some_gains).value();
  Eigen::Matrix2d A;
  Eigen::Matrix2d B;
  A << -6.791666666666667, 0.541666666666667, 0.541666666666667, -6.791666666666667;
  B << 4.583333333333334, -2.0833333333333335, -2.0833333333333335, 4.583333333333334;
  expect_matrix(drive.A, A, 1e-15);
  expect_matrix(drive.B, B, 1e-15);
}

// Of equal modes the sides are decoupled (the book's remark after the theorem).
TEST(DifferentialDrive, EqualModesLeaveTheSidesAlone) {
  const DifferentialDrive drive =
      differential_drive(
          DriveGains{.kV_linear = 2.0, .kA_linear = 0.5, .kV_angular = 2.0, .kA_angular = 0.5})
          .value();
  expect_matrix(drive.A, Eigen::Vector2d(-4.0, -4.0).asDiagonal().toDenseMatrix(), 1e-15);
  expect_matrix(drive.B, Eigen::Vector2d(2.0, 2.0).asDiagonal().toDenseMatrix(), 1e-15);
}

// Theorem 14.5.1 is Theorem 14.4.1 in other coordinates: [v, ω] = T [vl, vr].
TEST(DifferentialDrive, Theorem1451IsTheSameDrive) {
  const double width = 0.6;
  const DifferentialDrive drive = differential_drive(some_gains).value();
  const auto modes = linear_angular_drive(some_gains, Length(width)).value();
  Eigen::Matrix2d T;
  T << 0.5, 0.5, -1.0 / width, 1.0 / width;
  expect_matrix(modes.A, T * drive.A * T.inverse(), 1e-14);
  expect_matrix(modes.B, T * drive.B, 1e-14);
  EXPECT_EQ(modes.A(0, 1), 0.0);
  EXPECT_EQ(modes.A(1, 0), 0.0);
  // kV_angular in V·s/rad is 1.1 · 0.3, kA_angular 0.15 · 0.3.
  EXPECT_NEAR(modes.A(1, 1), -0.33 / 0.045, 1e-13);
  EXPECT_NEAR(modes.B(1, 1), 0.5 / 0.045, 1e-13);
}

TEST(DifferentialDrive, Theorem872AddsTheHeading) {
  const DifferentialDrive drive = differential_drive(of_book(2)).value();
  const auto system = heading_drive(drive, Length(0.59055)).value();
  EXPECT_DOUBLE_EQ(system.A(0, 1), -1.0 / 0.59055);
  EXPECT_DOUBLE_EQ(system.A(0, 2), 1.0 / 0.59055);
  EXPECT_TRUE(system.A.col(0).isZero());
  EXPECT_TRUE(system.B.row(0).isZero());
  EXPECT_EQ((system.A.bottomRightCorner<2, 2>()), drive.A);
  EXPECT_EQ((system.B.bottomRows<2>()), drive.B);
  EXPECT_TRUE(system.C.isIdentity());
}

double between(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1000001);
}

// Newton's laws on the motors' own equation: m dv/dt is the sum of the sides' forces, J dω/dt r_b
// times their difference; a gearing of its own for each side.
TEST(DifferentialDrive, IsNewtonsLawOnTheMotors) {
  {
    const bool holds = rc::check([] {
      const DcMotor drive = neo(*rc::gen::inRange(1, 4));
      const DifferentialDriveParameters made{
          .motor = drive,
          .left_gearing = between(2.0, 15.0),
          .right_gearing = between(2.0, 15.0),
          .mass = Mass(between(5.0, 80.0)),
          .wheel_radius = Length(between(0.03, 0.1)),
          .trackwidth = Length(between(0.3, 0.9)),
          .moment_of_inertia = MomentOfInertia(between(0.3, 9.0))};
      const DifferentialDrive model = differential_drive(made).value();
      const Eigen::Vector2d x(between(-4.0, 4.0), between(-4.0, 4.0));
      const Eigen::Vector2d u(between(-12.0, 12.0), between(-12.0, 12.0));
      const double r = made.wheel_radius.si();
      const auto force = [&](double G, double v, double V) {
        return G * drive.torque(G * v / r, V) / r;
      };
      const double left = force(made.left_gearing, x(0), u(0));
      const double right = force(made.right_gearing, x(1), u(1));
      const double dv = (left + right) / made.mass.si();
      const double r_b = 0.5 * made.trackwidth.si();
      const double domega = r_b * (right - left) / made.moment_of_inertia.si();
      const Eigen::Vector2d found = model.derivative(x, u);
      const double scale =
          (model.A.cwiseAbs() * x.cwiseAbs() + model.B.cwiseAbs() * u.cwiseAbs()).norm();
      RC_ASSERT(std::abs(found(0) - (dv - r_b * domega)) <= 1e-13 * scale);
      RC_ASSERT(std::abs(found(1) - (dv + r_b * domega)) <= 1e-13 * scale);
    });
    EXPECT_TRUE(holds);
  }
}

TEST(DifferentialDrive, GainsComeBack) {
  {
    const bool holds = rc::check([] {
      const DriveGains gains{.kS_left = between(0.0, 1.0),
                             .kS_right = between(0.0, 1.0),
                             .kV_linear = between(0.5, 8.0),
                             .kA_linear = between(0.05, 3.0),
                             .kV_angular = between(0.5, 8.0),
                             .kA_angular = between(0.05, 3.0)};
      const DriveGains back = drive_gains(differential_drive(gains).value()).value();
      const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(b); };
      RC_ASSERT(same(back.kV_linear, gains.kV_linear));
      RC_ASSERT(same(back.kA_linear, gains.kA_linear));
      RC_ASSERT(same(back.kV_angular, gains.kV_angular));
      RC_ASSERT(same(back.kA_angular, gains.kA_angular));
      RC_ASSERT(back.kS_left == gains.kS_left && back.kS_right == gains.kS_right);
    });
    EXPECT_TRUE(holds);
  }
}

// Friction opposes each side's own motion; at rest it is not a derivative.
TEST(DifferentialDrive, FrictionOpposesEachSide) {
  const DifferentialDrive drive = differential_drive(some_gains).value();
  const Eigen::Vector2d x(1.0, -1.0);
  const Eigen::Vector2d u(2.0, 3.0);
  const Eigen::Vector2d expected = drive.A * x + drive.B * Eigen::Vector2d(2.0 - 0.1, 3.0 + 0.2);
  EXPECT_LE((drive.derivative(x, u) - expected).norm(), 1e-14);
  EXPECT_EQ(drive.description().states.at(1).name, "right velocity");
}

// A drive of the book's parts: the gains' ratio of inertias gives back its J.
TEST(DifferentialDrive, InertiaComesBackFromTheGains) {
  const DriveGains gains = drive_gains(differential_drive(of_book(2)).value()).value();
  EXPECT_NEAR(moment_of_inertia(gains, 52_kg, Length(0.59055)).value().si(), 6.0, 1e-13);
  EXPECT_NEAR(gains.kV_linear, gains.kV_angular, 1e-13);  // no wheel slips
}

TEST(DifferentialDrive, RefusesWhatIsNoDrive) {
  DifferentialDriveParameters parameters = of_book(2);
  parameters.right_gearing = 0.0;
  const auto geared = differential_drive(parameters);
  ASSERT_FALSE(geared);
  EXPECT_EQ(to_string(geared.error()),
            "differential_drive: right_gearing is 0; it must be greater than zero; write motor "
            "turns per output turn, above 1 for a reduction");
  parameters = of_book(0);
  EXPECT_TRUE(differential_drive(parameters).error().is(ArgumentError::out_of_range));
  for (const auto spoil :
       {+[](DifferentialDriveParameters& p) { p.mass = 0_kg; },
        +[](DifferentialDriveParameters& p) { p.wheel_radius = 0_m; },
        +[](DifferentialDriveParameters& p) { p.trackwidth = 0_m; },
        +[](DifferentialDriveParameters& p) { p.moment_of_inertia = MomentOfInertia(-1.0); }}) {
    parameters = of_book(2);
    spoil(parameters);
    EXPECT_TRUE(differential_drive(parameters).error().is(ArgumentError::not_positive));
  }
  for (const auto gain : {&DriveGains::kV_linear, &DriveGains::kA_linear, &DriveGains::kV_angular,
                          &DriveGains::kA_angular}) {
    DriveGains gains = some_gains;
    gains.*gain = 0.0;
    EXPECT_TRUE(differential_drive(gains).error().is(ArgumentError::not_positive));
    EXPECT_FALSE(linear_angular_drive(gains, 1_m));
    gains.*gain = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(differential_drive(gains).error().is(ArgumentError::not_finite));
  }
  EXPECT_FALSE(linear_angular_drive(some_gains, 0_m));
  EXPECT_FALSE(heading_drive(differential_drive(some_gains).value(), 0_m));
  EXPECT_FALSE(moment_of_inertia(some_gains, 0_kg, 1_m));
  parameters = of_book(2);
  parameters.left_gearing = 6.0;
  const auto unlike = drive_gains(differential_drive(parameters).value());
  ASSERT_FALSE(unlike);
  EXPECT_NE(to_string(unlike.error()).find("different left and right sides"), std::string::npos);
}

}  // namespace
}  // namespace flyball::mechanisms::differential_drive_test
