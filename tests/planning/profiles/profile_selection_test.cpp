#include <flyball/planning/profiles/profile_selection.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>
#include <flyball/planning/profiles/generate_s_curve_profile.hpp>
#include <flyball/planning/profiles/s_curve_profile.hpp>
#include <flyball/planning/profiles/trapezoid_profile.hpp>

namespace flyball::profile_selection_test {
namespace {

const MotionLimits limits{.velocity = 1.5, .acceleration = 3.0};

TEST(SelectProfile, AStiffMechanismOnAMotorGetsTheTrapezoid) {
  const ProfileAdvice advice = select_profile({.limits = limits, .distance = -2.0}).value();
  EXPECT_EQ(advice.kind, ProfileKind::trapezoid);
  EXPECT_NEAR(advice.duration, 2.0 / 1.5 + 0.5, 1e-12);
  ASSERT_FALSE(advice.reasons.empty());
  EXPECT_NE(advice.reasons.front().find("15.1.2"), std::string::npos);
}

// A mode at 3.2 Hz, undamped: with ramps of one of its periods the oscillator is at rest at the
// end; after the trapezoid it is not.
TEST(SelectProfile, TheAdvisedRampLeavesNothingOfTheResonance) {
  const double omega = 2.0 * std::acos(-1.0) * 3.2;
  const ProfileAdvice advice =
      select_profile({.limits = limits, .distance = 2.0, .resonance = 3.2}).value();
  EXPECT_EQ(advice.kind, ProfileKind::s_curve);
  EXPECT_NEAR(advice.ramp_time, 0.3125, 1e-12);
  EXPECT_NEAR(advice.duration, 2.0 / 1.5 + 0.5 + 0.3125, 1e-9);
  // The load lags the carriage: q'' = -ω² q - a.
  const auto left = [&](const auto& profile) {
    double q = 0.0;
    double w = 0.0;
    const double h = 1e-5;
    for (double t = 0.0; t < profile.total_time(); t += h) {
      w += h * (-omega * omega * q - profile.sample(t + 0.5 * h).acceleration);
      q += h * w;
    }
    return std::hypot(q, w / omega);
  };
  const double rings = left(TrapezoidProfile(limits, {}, {2.0}));
  EXPECT_GT(rings, 1e-3);
  EXPECT_LT(left(SCurveProfile(advice.limits, {}, {2.0})), 0.01 * rings);
  // One that has died away by itself does no harm.
  EXPECT_EQ(select_profile({.limits = limits,
                            .distance = 2.0,
                            .resonance = 40.0,
                            .damping_ratio = 0.5,
                            .patience = 0.1})
                .value()
                .kind,
            ProfileKind::trapezoid);
}

// Too short for a whole period: as long as it can be, and it is said.
TEST(SelectProfile, AShortWaySaysWhatStays) {
  const ProfileAdvice advice =
      select_profile({.limits = limits, .distance = 0.06, .resonance = 4.0}).value();
  EXPECT_NEAR(advice.ramp_time, 0.1, 1e-12);
  EXPECT_NE(advice.reasons.front().find("too short"), std::string::npos);
}

TEST(SelectProfile, DelicateCargoHasNoConstantAcceleration) {
  const ProfileAdvice advice =
      select_profile({.limits = limits, .distance = 3.0, .delicate = true}).value();
  EXPECT_EQ(advice.kind, ProfileKind::s_curve);
  const SCurveProfile profile(advice.limits, {}, {3.0});
  for (int i = 0; i < profile.pieces(); ++i) {
    // No piece of it holds an acceleration: what has no jerk is the cruise.
    EXPECT_TRUE(profile.piece(i).jerk != 0.0 || std::abs(profile.piece(i).at.acceleration) < 1e-9);
  }
  EXPECT_NEAR(profile.sample(advice.ramp_time).acceleration, 3.0, 1e-9);
}

TEST(SelectProfile, StepMotors) {
  ProfileNeeds needs{.limits = limits, .distance = 2.0, .actuator = ActuatorKind::step_motor};
  EXPECT_EQ(select_profile(needs).value().kind, ProfileKind::parabolic);
  needs.resonant_velocity = 0.2;
  const ProfileAdvice advice = select_profile(needs).value();
  EXPECT_EQ(advice.kind, ProfileKind::stepper);
  EXPECT_NEAR(advice.jump, 0.24, 1e-12);
}

TEST(SelectProfile, AMotorThatHasNotTheAcceleration) {
  ProfileNeeds needs{.limits = {.velocity = 2.5, .acceleration = 10.0}, .distance = 2.0};
  needs.motor = MotorMotionLimits{.kV = 4.0, .kA = 0.4, .voltage = 12.0};
  const ProfileAdvice advice = select_profile(needs).value();
  EXPECT_EQ(advice.kind, ProfileKind::exponential);
  needs.motor->kA = 0.01;
  EXPECT_EQ(select_profile(needs).value().kind, ProfileKind::trapezoid);
}

TEST(SelectProfile, Refusals) {
  EXPECT_FALSE(select_profile({.limits = {}, .distance = 1.0}));
  EXPECT_FALSE(select_profile({.limits = limits}));
  EXPECT_FALSE(select_profile({.limits = limits, .distance = 1.0, .damping_ratio = 1.5}));
  EXPECT_FALSE(select_profile({.limits = limits, .distance = 1.0, .resonance = -4.0}));
  EXPECT_EQ(parse_profile_kind("parabolic").value(), ProfileKind::parabolic);
  const auto mistyped = parse_profile_kind("trapezoi");
  ASSERT_FALSE(mistyped);
  EXPECT_NE(to_string(mistyped.error()).find("trapezoid"), std::string::npos);
}

// The book's Figure 15.2 at its ends and in the middle.
TEST(GenerateSCurveProfile, IsTheBooksFigure) {
  const TimeSeries table = generate_s_curve_profile(7.0, 3.5, Time(1.0), Time(0.05), 50.0).value();
  EXPECT_EQ(table.rows(), 204u);
  EXPECT_NEAR(table.find("velocity")->at(20), 1.75, 1e-12);
  EXPECT_NEAR(table.find("velocity")->at(100), 7.0, 1e-12);
  EXPECT_EQ(table.find("velocity")->back(), 0.0);
  EXPECT_NEAR(table.find("position")->back(), 50.0, 1e-3);
}

TEST(GenerateSCurveProfile, RefusesWhatMakesNoProfile) {
  const auto generate = [](double v, double a, double ramp, double dt, double goal) {
    return generate_s_curve_profile(v, a, Time(ramp), Time(dt), goal);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(generate(0.0, 1.0, 1.0, 0.02, 1.0).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(generate(1.0, 1.0, 1.0, 0.02, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(generate(1.0, 1.0, 1.0, 1e-9, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(generate(1.0, 1.0, 1.0, 0.02, 1e40).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(generate(nan, 1.0, 1.0, 0.02, 1.0).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::profile_selection_test
