#include <flyball/mechanisms/drivetrain/wheeled_drive.hpp>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/integration/adaptive.hpp>
#include <flyball/mechanisms/drivetrain/pose_drive.hpp>
#include <flyball/systems/linearize.hpp>
#include <flyball/systems/model_step.hpp>

#include "support/allocation_count.hpp"

namespace flyball::mechanisms::wheeled_drive_test {
namespace {

using namespace flyball::literals;
using Eigen::Vector2d;
using Complex = std::complex<double>;

constexpr double g = standard_gravity;

const RobotBody body{.mass = 55_kg, .moment_of_inertia = 5_kg_m2};
const DriveShaft side{.motor = cim(2),
                      .gearing = 60.0 / 11.0,
                      .moment_of_inertia = MomentOfInertia(0.02),
                      .friction = 0.4,
                      .damping = 0.01};

SlippingDifferentialParameters six_wheels() {
  return {.body = body,
          .side = side,
          .wheel_radius = Length(0.05),
          .trackwidth = Length(0.6),
          .wheelbase = Length(0.5)};
}

SlippingMecanumParameters mecanum() {
  return {.body = {.mass = 40_kg,
                   .moment_of_inertia = 3_kg_m2,
                   .center_of_mass = Vector2d(0.03, -0.02)},
          .wheel = {.motor = neo(), .gearing = 10.0, .moment_of_inertia = MomentOfInertia(0.01)},
          .wheel_radius = Length(0.076),
          .positions = {Vector2d(0.3, 0.25), {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}}};
}

template <int N>
Eigen::Vector<double, N> random_vector(Random& random, double size) {
  Eigen::Vector<double, N> x;
  for (auto& entry : x) {
    entry = random.uniform(-size, size);
  }
  return x;
}

// Little slip: F = -stiffness N σ. Much: |F| falls from μ N to sin(C π/2) μ N, and is never above
// μ N, whichever way it slides; it takes power from the sliding.
TEST(Tire, HoldsInItsFrictionCircle) {
  const Tire tire{.friction = 0.9, .stiffness = 15.0, .shape = 1.4, .rest_speed = 0.1};
  const double reference = std::hypot(2.0, 0.1);
  const Vector2d little = tire.force(Vector2d(3e-6, -4e-6), 2.0, 150.0);
  EXPECT_NEAR(little(0), -15.0 * 150.0 * 3e-6 / reference, 1e-11);
  EXPECT_NEAR(little(1), 15.0 * 150.0 * 4e-6 / reference, 1e-11);
  EXPECT_NEAR(tire.force(Vector2d(0.0, 1e9), 2.0, 150.0).norm(),
              0.9 * 150.0 * std::sin(0.7 * std::numbers::pi), 1e-6);
  EXPECT_EQ(tire.force(Vector2d(0.0, 0.0), 0.0, 150.0), Vector2d(0.0, 0.0));
  // The peak: C atan(B σ) = π/2.
  const double B = 15.0 / (0.9 * 1.4);
  const double peak = std::tan(0.5 * std::numbers::pi / 1.4) / B;
  EXPECT_NEAR(tire.force(Vector2d(peak * reference, 0.0), 2.0, 150.0)(0), -135.0, 1e-11);
  Random random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vector2d sliding = random_vector<2>(random, std::exp(random.uniform(-9.0, 3.0)));
    const double rolling = random.uniform(-5.0, 5.0);
    const Vector2d F = tire.force(sliding, rolling, 150.0);
    EXPECT_LE(F.norm(), 135.0 * (1.0 + 1e-15));
    EXPECT_NEAR(F.dot(sliding), -F.norm() * sliding.norm(), 1e-12 * F.norm() * sliding.norm());
    EXPECT_EQ(tire.force(sliding, -rolling, 150.0), F);
    const auto slope = jacobian(
        [&](const auto& s) {
          using Scalar = typename std::decay_t<decltype(s)>::Scalar;
          return tire.force(Eigen::Vector<Scalar, 2>(s), Scalar(rolling), 150.0);
        },
        sliding);
    EXPECT_TRUE(slope.allFinite());
  }
}

// Kinetic energy changes by what the shafts put in and what sliding takes out, to rounding.
template <class Drive, class Energy, class Power>
void expect_energy_balance(const Drive& drive, Random& random, const Energy& energy,
                           const Power& power) {
  for (int trial = 0; trial < 200; ++trial) {
    auto x = random_vector<Drive::states()>(random, 3.0);
    x.template tail<Drive::inputs()>() *= 20.0;
    const auto u = random_vector<Drive::inputs()>(random, 12.0);
    const auto rate = drive.derivative(x, u);
    const auto slope = gradient(energy, x);
    const double scale = slope.cwiseAbs().dot(rate.cwiseAbs());
    EXPECT_NEAR(slope.dot(rate), power(x, u), 1e-12 * scale);
  }
}

TEST(WheeledDrive, EnergyOfTheDifferentialDrive) {
  Random random(12);
  const auto drive = slipping_differential_drive<6>(six_wheels()).value();
  const auto energy = [](const auto& x) {
    return 0.5 * 55.0 * (x(3) * x(3) + x(4) * x(4)) + 0.5 * 5.0 * x(5) * x(5) +
           0.5 * 0.02 * (x(6) * x(6) + x(7) * x(7));
  };
  const auto power = [&](const auto& x, const auto& u) {
    double sum = 0.0;
    for (int s = 0; s < 2; ++s) {
      sum += drive.shaft(s).torque(x(6 + s), u(s)) * x(6 + s);
    }
    for (std::size_t i = 0; i < 6; ++i) {
      const double at_x = 0.25 - 0.25 * static_cast<double>(i / 2);
      const double at_y = i % 2 == 0 ? 0.3 : -0.3;
      const Vector2d sliding(x(3) - x(5) * at_y - 0.05 * x(6 + static_cast<int>(i % 2)),
                             x(4) + x(5) * at_x);
      const double taken = drive.wheel_force(x, i, drive.parameters()).dot(sliding);
      EXPECT_LE(taken, 0.0);
      sum += taken;
    }
    return sum;
  };
  expect_energy_balance(drive, random, energy, power);
}

TEST(WheeledDrive, EnergyOfTheMecanumDrive) {
  Random random(13);
  const auto made = mecanum();
  const auto drive = slipping_mecanum_drive(made).value();
  const auto energy = [](const auto& x) {
    const auto vx = x(3) - x(5) * -0.02;
    const auto vy = x(4) + x(5) * 0.03;
    auto sum = 0.5 * 40.0 * (vx * vx + vy * vy) + 0.5 * 3.0 * x(5) * x(5);
    for (int s = 6; s < 10; ++s) {
      sum += 0.5 * 0.01 * x(s) * x(s);
    }
    return sum;
  };
  const auto power = [&](const auto& x, const auto& u) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int at = 6 + static_cast<int>(i);
      sum += drive.shaft(at - 6).torque(x(at), u(at - 6)) * x(at);
      const Vector2d& r = made.positions[i];
      const Vector2d sliding(x(3) - x(5) * r(1) - 0.076 * x(at), x(4) + x(5) * r(0));
      const Vector2d F = drive.wheel_force(x, i, drive.parameters());
      // The rollers give way across their axis.
      const double roller = (i == 0 || i == 3 ? -0.25 : 0.25) * std::numbers::pi;
      EXPECT_NEAR(F(0) * std::sin(roller) - F(1) * std::cos(roller), 0.0, 1e-12);
      sum += F.dot(sliding);
    }
    return sum;
  };
  expect_energy_balance(drive, random, energy, power);
}

// The laws in an inertial frame, in complex numbers, integrated on their own at 1e-10: where the
// centre of mass is and how fast, each wheel's contact in the field.
TEST(WheeledDrive, AgainstNewtonInTheField) {
  const auto made = mecanum();
  const auto drive = slipping_mecanum_drive(made).value();
  const Complex c(0.03, -0.02);
  const Tire tire;
  std::array<double, 4> share{};
  {
    // Shares of the weight: 1/4 ± c_x/(4·0.3) ± c_y/(4·0.25).
    for (std::size_t i = 0; i < 4; ++i) {
      share[i] = 0.25 + 0.25 * 0.03 / made.positions[i](0) - 0.25 * 0.02 / made.positions[i](1);
    }
  }
  const auto volts = [](double t, int i) {
    return 9.0 * std::sin(1.5 * t + i) + (i == 2 ? 4.0 : 1.0);
  };
  const DcMotor motor = neo();
  const auto field = [&](double t, const Eigen::Vector<double, 10>& z) {
    const Complex V(z(3), z(4));  // of the centre of mass
    const double w = z(5);
    const Complex turn = std::polar(1.0, z(2));
    Complex F_all = 0.0;
    double M_all = 0.0;
    Eigen::Vector<double, 10> rate;
    for (int i = 0; i < 4; ++i) {
      const Vector2d& at = made.positions[static_cast<std::size_t>(i)];
      const Complex r = turn * (Complex(at(0), at(1)) - c);
      const double Omega = z(6 + i);
      const Complex sliding = V + Complex(0.0, w) * r - 0.076 * Omega * turn;
      const Complex axis =
          turn * std::polar(1.0, (i == 0 || i == 3 ? -0.25 : 0.25) * std::numbers::pi);
      const double along = (sliding * std::conj(axis)).real();
      const double slip = along / std::hypot(0.076 * Omega, tire.rest_speed);
      const double N = share[static_cast<std::size_t>(i)] * 40.0 * g;
      const double B = tire.stiffness / (tire.friction * tire.shape);
      const Complex F = -tire.friction * N * std::sin(tire.shape * std::atan(B * slip)) * axis;
      F_all += F;
      M_all += (std::conj(r) * F).imag();
      const double current = (volts(t, i) - 10.0 * Omega / motor.Kv) / motor.R;
      rate(6 + i) = (10.0 * motor.Kt * current - 0.076 * (F * std::conj(turn)).real()) / 0.01;
    }
    rate.head<6>() << z(3), z(4), w, F_all.real() / 40.0, F_all.imag() / 40.0, M_all / 3.0;
    return rate;
  };
  const auto start = drive.derivative(Eigen::Vector<double, 10>::Zero(), Eigen::Vector4d::Zero());
  EXPECT_TRUE(start.isZero());
  const IntegrationOptions tight{.relative_tolerance = 1e-10, .absolute_tolerance = 1e-12};
  Eigen::Vector<double, 10> z0 = Eigen::Vector<double, 10>::Zero();
  z0.head<2>() << c.real(), c.imag();
  const auto reference = integrate(field, 0.0, z0, 1.5, tight).value();
  const auto path =
      integrate(
          [&](double t, const Eigen::Vector<double, 10>& x) {
            const Eigen::Vector4d u(volts(t, 0), volts(t, 1), volts(t, 2), volts(t, 3));
            return Eigen::Vector<double, 10>(drive.derivative(x, u));
          },
          0.0, Eigen::Vector<double, 10>(Eigen::Vector<double, 10>::Zero()), 1.5, tight)
          .value();
  const Eigen::VectorXd& z = reference.final_state();
  const Eigen::VectorXd& x = path.final_state();
  const Complex turn = std::polar(1.0, z(2));
  const Complex origin = Complex(z(0), z(1)) - turn * c;
  const Complex v = (Complex(z(3), z(4)) - Complex(0.0, z(5)) * turn * c) * std::conj(turn);
  Eigen::VectorXd expected = z;
  expected.head<2>() << origin.real(), origin.imag();
  expected.segment<2>(3) << v.real(), v.imag();
  EXPECT_LE((x - expected).norm(), 1e-8 * expected.norm());
  EXPECT_GT(std::abs(x(2)), 0.3);
}

// Of tires that hardly slip the middle goes as Theorem 8.7.1 says of a drive with the wheels'
// inertias in its mass and moment: (vl + vr)/2 for wheels at the axle.
TEST(WheeledDrive, GripsAsTheorem871) {
  SlippingDifferentialParameters made = six_wheels();
  made.wheelbase = Length(0.0);
  made.side.friction = made.side.damping = 0.0;
  made.tire.stiffness = 2e4;
  made.tire.friction = 50.0;
  const auto slipping = slipping_differential_drive<2>(made).value();
  const double rotors = 0.02 / (0.05 * 0.05);  // kg at the floor, a side
  const PoseDrive ideal =
      pose_drive(DifferentialDriveParameters{
                     .motor = cim(2),
                     .left_gearing = 60.0 / 11.0,
                     .right_gearing = 60.0 / 11.0,
                     .mass = Mass(55.0 + 2.0 * rotors),
                     .wheel_radius = Length(0.05),
                     .trackwidth = Length(0.6),
                     .moment_of_inertia = MomentOfInertia(5.0 + 2.0 * rotors * 0.09)})
          .value();
  const Vector2d u(9.0, 6.0);
  const auto slid = integrate(with_input(slipping, u), 0.0,
                              Eigen::Vector<double, 8>(Eigen::Vector<double, 8>::Zero()), 1.0)
                        .value();
  const auto rolled = integrate(with_input(ideal, u), 0.0,
                                Eigen::Vector<double, 5>(Eigen::Vector<double, 5>::Zero()), 1.0)
                          .value();
  const Eigen::VectorXd& x = slid.final_state();
  const Eigen::VectorXd& z = rolled.final_state();
  EXPECT_LE((x.head(3) - z.head(3)).norm(), 2e-3 * z.head(3).norm());
  EXPECT_NEAR(0.05 * x(6), z(3), 2e-3 * z(3));
  EXPECT_NEAR(0.05 * x(7), z(4), 2e-3 * z(4));
}

// Six wheels turn on the spot slower than their sides' speeds over half the trackwidth: the outer
// wheels slide across, which shows as a wider trackwidth; and hard acceleration spins them.
TEST(WheeledDrive, SlipsWhereItMust) {
  const auto drive = slipping_differential_drive<6>(six_wheels()).value();
  using State = Eigen::Vector<double, 8>;
  const auto turned =
      integrate(with_input(drive, Vector2d(-6.0, 6.0)), 0.0, State(State::Zero()), 3.0).value();
  const Eigen::VectorXd& x = turned.final_state();
  const double effective = 0.05 * (x(7) - x(6)) / x(5);
  EXPECT_GT(effective, 0.6 * 1.02);
  EXPECT_LT(effective, 0.6 * 2.0);
  SlippingDifferentialParameters ice = six_wheels();
  ice.tire.friction = 0.1;
  const auto icy = slipping_differential_drive<6>(ice).value();
  const auto started =
      integrate(with_input(icy, Vector2d(12.0, 12.0)), 0.0, State(State::Zero()), 0.5).value();
  const Eigen::VectorXd& on_ice = started.final_state();
  EXPECT_LE(on_ice(3), 0.1 * g * 0.5 * (1.0 + 1e-9));
  EXPECT_GT(0.05 * on_ice(6), 3.0 * on_ice(3));
}

// Where the robot is and looks does not matter to how it moves.
TEST(WheeledDrive, IsTheSameEverywhere) {
  Random random(5);
  const auto drive = slipping_mecanum_drive(mecanum()).value();
  for (int trial = 0; trial < 50; ++trial) {
    auto x = random_vector<10>(random, 2.0);
    const auto u = random_vector<4>(random, 12.0);
    const auto here = drive.derivative(x, u);
    const double by = random.uniform(-3.0, 3.0);
    x.head<3>() += Eigen::Vector3d(1.0, -2.0, by);
    const auto there = drive.derivative(x, u);
    EXPECT_LE((Rotation2d(by) * Vector2d(here.head<2>()) - there.head<2>()).norm(), 1e-13);
    EXPECT_EQ(here.tail<8>(), there.tail<8>());
  }
}

TEST(WheeledDrive, IsAModel) {
  const AnyModel model = slipping_mecanum_drive(mecanum()).value();
  EXPECT_EQ(model.names().states.size(), 10U);
  EXPECT_EQ(label(model.names().inputs[3]), "voltage 4 (V)");
  EXPECT_TRUE(model.names().states[2].is_angle);
  const auto heavy = model.with_parameter("mass", 80.0);
  ASSERT_TRUE(heavy);
  // Weak tires: without slip there is no force, with it the heavier robot's is the greater.
  const auto system = linearize(slipping_mecanum_drive(mecanum()).value(),
                                Eigen::Vector<double, 10>(Eigen::Vector<double, 10>::Zero()),
                                Eigen::Vector4d(Eigen::Vector4d::Zero()));
  ASSERT_TRUE(system) << to_string(system.error());
  EXPECT_LT(system->A(3, 3), 0.0);
  const auto drive = slipping_differential_drive<4>(six_wheels()).value();
  Eigen::Vector<double, 8> x = Eigen::Vector<double, 8>::Zero();
  const test::AllocationCounter counter;
  for (int k = 0; k < 100; ++k) {
    x = rk4(drive, x, Vector2d(9.0, 8.0), 1e-4);
  }
  if (test::counts_allocations()) {
    EXPECT_EQ(counter.count(), 0U);
  }
  EXPECT_GT(x(3), 0.0);
}

TEST(WheeledDrive, RefusesImpossibleRobots) {
  SlippingDifferentialParameters made = six_wheels();
  made.trackwidth = Length(0.0);
  EXPECT_EQ(to_string(slipping_differential_drive<4>(made).error()),
            "slipping_differential_drive: trackwidth is 0 m; it must be greater than zero");
  made = six_wheels();
  made.wheelbase = Length(0.0);
  EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "wheelbase");
  EXPECT_TRUE(slipping_differential_drive<2>(made));
  made = six_wheels();
  made.body.center_of_mass = Vector2d(0.3, 0.0);
  EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "center_of_mass");
  made.wheelbase = Length(0.0);
  EXPECT_EQ(slipping_differential_drive<2>(made).error().subject(), "center_of_mass");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    made = six_wheels();
    made.body.mass = Mass(bad);
    EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "mass");
    made = six_wheels();
    made.side.moment_of_inertia = MomentOfInertia(bad);
    EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(),
              "moment_of_inertia of shaft 1");
    made = six_wheels();
    made.wheel_radius = Length(bad);
    EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "the radius of wheel 1");
    made = six_wheels();
    made.tire.friction = bad;
    EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "the tire's friction");
  }
  made = six_wheels();
  made.tire.shape = 2.5;
  EXPECT_TRUE(slipping_differential_drive<4>(made).error().is(ArgumentError::out_of_range));
  made = six_wheels();
  made.side.gearing = -2.0;
  EXPECT_EQ(slipping_differential_drive<4>(made).error().subject(), "the gearing of shaft 1");
  WheeledDriveParameters<2, 2> lone{
      .body = body,
      .wheels = {SlippingWheel{.mount = {.position = {0.0, 0.3}}, .radius = Length(0.05)},
                 SlippingWheel{.mount = {.position = {0.0, -0.3}}, .radius = Length(0.05)}},
      .shafts = {side, side}};
  EXPECT_EQ(to_string(wheeled_drive(lone).error()),
            "wheeled_drive: shaft 2 is one without wheels; it must be the shaft of one wheel at "
            "least");
  lone.wheels[1].shaft = 2;
  EXPECT_FALSE(wheeled_drive(lone));
  lone.wheels[1].shaft = 1;
  EXPECT_TRUE(wheeled_drive(lone));
  lone.wheels[1].has_rollers = true;
  lone.wheels[1].mount.roller_angle = 0.5 * std::numbers::pi;
  EXPECT_EQ(wheeled_drive(lone).error().subject(), "wheel 2");
}

}  // namespace
}  // namespace flyball::mechanisms::wheeled_drive_test
