#include <flyball/identification/one_step_fit.hpp>

#include <cmath>

#include <flyball/identification/identification_error.hpp>

#include "recordings.hpp"

namespace one_step_fit_test {
namespace {

using namespace flyball::identification;
using flyball::mechanisms::MechanismKind;

/// x_{k+1} = α x_k + β u_k + γ sgn(x_k) exactly, with (14.3)'s α, β, γ and a constant −β kG.
Recording exact_recording(double kS, double kV, double kA, double kG, double period) {
  const double alpha = std::exp(-kV / kA * period);
  const double beta = (1.0 - alpha) / kV;
  Recording recording;
  recording.mechanism = kG != 0.0 ? MechanismKind::elevator : MechanismKind::flywheel;
  recording.unit = "m";
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    const double sign = is_forward(kind) ? 1.0 : -1.0;
    TestRun run;
    run.kind = kind;
    double position = 0.0;
    double velocity = sign * 1e-3;
    for (int i = 0; i < (is_quasistatic(kind) ? 800 : 200); ++i) {
      const double time = i * period;
      const double voltage = kG + sign * (is_quasistatic(kind) ? kS + 0.5 * time : 4.0);
      run.time.push_back(time);
      run.voltage.push_back(voltage);
      run.position.push_back(position);
      run.velocity.push_back(velocity);
      position += velocity * period;
      velocity = alpha * velocity + beta * (voltage - kG - kS * std::copysign(1.0, velocity));
    }
    recording.runs.push_back(std::move(run));
  }
  return recording;
}

// Without noise the regression of section 14.2 is exact.
TEST(OneStepFit, RecoversExactDataOfAFlywheel) {
  const auto prepared = prepare(exact_recording(0.3, 1.5, 0.4, 0.0, 0.01));
  ASSERT_TRUE(prepared);
  const auto fit = fit_one_step(*prepared);
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_NEAR(fit->kS, 0.3, 1e-9);
  EXPECT_NEAR(fit->kV, 1.5, 1e-9);
  EXPECT_NEAR(fit->kA, 0.4, 1e-9);
  EXPECT_NEAR(fit->r_squared, 1.0, 1e-12);
  EXPECT_NEAR(fit->alpha, std::exp(-1.5 / 0.4 * 0.01), 1e-9);
}

TEST(OneStepFit, RecoversExactDataOfAnElevator) {
  const auto prepared = prepare(exact_recording(0.3, 1.5, 0.4, 0.2, 0.01));
  ASSERT_TRUE(prepared);
  const auto fit = fit_one_step(*prepared);
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_NEAR(fit->kS, 0.3, 1e-9);
  EXPECT_NEAR(fit->kG, 0.2, 1e-9);
  EXPECT_NEAR(fit->kA, 0.4, 1e-9);
}

TEST(OneStepFit, NeedsTheMechanism) {
  Recording recording = exact_recording(0.3, 1.5, 0.4, 0.0, 0.01);
  recording.mechanism.reset();
  const auto fit = fit_one_step(prepare(recording).value());
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::unknown_mechanism));
}

TEST(OneStepFit, RefusesTooFewRows) {
  Recording recording = exact_recording(0.3, 1.5, 0.4, 0.0, 0.01);
  recording.runs.clear();
  const auto fit = fit_one_step(prepare(recording).value());
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::too_short));
}

// One direction only: sgn(v) and gravity are the same column.
TEST(OneStepFit, RefusesOneDirectionOfAnElevator) {
  Recording recording = exact_recording(0.3, 1.5, 0.4, 0.2, 0.01);
  recording.runs = {recording.runs[0], recording.runs[2]};
  const auto fit = fit_one_step(prepare(recording).value());
  ASSERT_FALSE(fit);
  EXPECT_TRUE(fit.error().is(IdentificationError::singular));
}

}  // namespace
}  // namespace one_step_fit_test
