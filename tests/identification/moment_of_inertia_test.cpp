#include <flyball/identification/moment_of_inertia.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/mechanisms/differential_drive.hpp>
#include <flyball/mechanisms/flywheel.hpp>

namespace flyball::identification::moment_of_inertia_test {
namespace {

using namespace flyball::literals;

struct Step {
  std::vector<double> time, velocity;
};

// A flywheel under 6 V from rest: ω(t) = ω_end (1 − e^{−λt}), exactly.
Step flywheel_step(double J, double noise) {
  const auto model = mechanisms::flywheel({.motor = mechanisms::vex_775pro(),
                                           .gearing = 2.0,
                                           .moment_of_inertia = MomentOfInertia(J)})
                         .value();
  const double rate = -model.A(0, 0);
  const double end = 6.0 * model.B(0, 0) / rate;
  Random random(3);
  Step step;
  for (int i = 0; i < 300; ++i) {
    step.time.push_back(0.005 * i);
    step.velocity.push_back(-end * std::expm1(-rate * step.time.back()) + noise * random.normal());
  }
  return step;
}

// Of exponentials the difference quotient at the mean velocity is a line of slope
// −(T/2) coth(λT/2), which is −1/λ (1 + (λT)²/12 + …); λT is 0.024 here.
TEST(InertiaFromStep, ComesBackFromAFlywheel) {
  const double J = 3e-4;
  const Step step = flywheel_step(J, 0.0);
  const auto found = inertia_from_step(mechanisms::vex_775pro(), 2.0, step.time, step.velocity);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->value.si(), J, 1e-4 * J);
  EXPECT_NEAR(found->r_squared, 1.0, 1e-9);
}

// Noise in the regressor pulls the slope to zero, as in any such regression
// (docs/identification.md).
TEST(InertiaFromStep, HasAnInterval) {
  const double J = 3e-4;
  const Step step = flywheel_step(J, 0.005);
  const auto found = inertia_from_step(mechanisms::vex_775pro(), 2.0, step.time, step.velocity);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->value.si(), J, 0.05 * J);
  EXPECT_GT(found->standard_error, 0.0);
  EXPECT_LT(found->interval[0], found->value.si());
  EXPECT_GT(found->interval[1], found->value.si());
}

// While the back EMF is small, the same force accelerates m and, at r_b, J: m = 50 kg, r_b = 0.3 m,
// J = 4 kg m², so v/ω = 4/(50 · 0.3).
TEST(DriveInertia, IsTheSlopeOfSpeedOverTurning) {
  std::vector<double> speed;
  std::vector<double> turning;
  for (int i = 0; i < 50; ++i) {
    speed.push_back(0.02 * i * 200.0 / 50.0);
    turning.push_back(0.02 * i * 200.0 * 0.3 / 4.0);
  }
  const auto found = drive_inertia_from_steps(50_kg, Length(0.6), speed, turning);
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_NEAR(found->value.si(), 4.0, 1e-12);
}

TEST(RodMomentOfInertia, IsAThirdOfMassTimesLengthSquared) {
  EXPECT_DOUBLE_EQ(rod_moment_of_inertia(3_kg, 2_m).si(), 4.0);
}

TEST(InertiaFromStep, Refuses) {
  const Step step = flywheel_step(3e-4, 0.0);
  const auto motor = mechanisms::vex_775pro();
  std::vector<double> values = step.velocity;
  values.pop_back();
  EXPECT_TRUE(
      inertia_from_step(motor, 2.0, step.time, values).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(inertia_from_step(motor, 2.0, {}, {}).error().is(ArgumentError::empty));
  EXPECT_TRUE(inertia_from_step(motor, 0.0, step.time, step.velocity)
                  .error()
                  .is(ArgumentError::not_positive));
  values = step.velocity;
  values[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(
      inertia_from_step(motor, 2.0, step.time, values).error().is(ArgumentError::not_finite));
  std::vector<double> backward(step.time.rbegin(), step.time.rend());
  EXPECT_TRUE(inertia_from_step(motor, 2.0, backward, step.velocity)
                  .error()
                  .is(ArgumentError::not_positive));
  // What runs away has no end speed.
  values = step.time;
  for (double& value : values) {
    value = std::exp(value);
  }
  EXPECT_TRUE(inertia_from_step(motor, 2.0, step.time, values)
                  .error()
                  .is(IdentificationError::unphysical_gains));
  const std::vector<double> one{1.0, 2.0, 3.0};
  const std::vector<double> down{3.0, 2.0, 1.0};
  EXPECT_TRUE(drive_inertia_from_steps(50_kg, 1_m, one, down)
                  .error()
                  .is(IdentificationError::unphysical_gains));
  EXPECT_TRUE(
      drive_inertia_from_steps(0_kg, 1_m, one, one).error().is(ArgumentError::not_positive));
}

}  // namespace
}  // namespace flyball::identification::moment_of_inertia_test
