#include <flyball/control/margins.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/mechanisms/arm.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/input_delay.hpp>
#include <flyball/systems/system_error.hpp>

#include "control/regulated_plant.hpp"

namespace flyball::margins_test {
namespace {

using namespace flyball::literals;
using namespace test;
constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

PlantInputLoop loop_of(const Regulated& r, Time delay) {
  return observer_regulator_loop(r.truth.A, r.truth.B, r.truth.C, r.model, r.K, r.K_e, delay)
      .value();
}

double radius(const PlantInputLoop& loop, double gain, double further_delay = 0.0) {
  return closed_loop_radius(loop, gain, Time(further_delay)).value();
}

// u = -(30 x + 8 v) before 1/(2 s²): L's two poles at z = 1 hold its phase at -180° towards zero
// frequency without ever reaching it. By hand L(-1) = 8 (T/2)/(-1 - 1) = -0.02.
TEST(StabilityMargins, OfAMassThatIsPushed) {
  Eigen::MatrixXd A(2, 2);
  A << 0.0, 1.0, 0.0, 0.0;
  const Eigen::MatrixXd B = Eigen::Vector2d(0.0, 0.5);
  const Eigen::MatrixXd K = Eigen::RowVector2d(30.0, 8.0);
  for (const double delay : {0.0, 0.004, 0.012}) {
    const auto margins =
        state_feedback_loop(A, B, K, Time(0.01), Time(delay)).and_then(&stability_margins);
    ASSERT_TRUE(margins) << to_string(margins.error());
    EXPECT_TRUE(margins->stable);
    ASSERT_EQ(margins->gain_crossovers.size(), 1U);
    if (delay == 0.0) {
      EXPECT_NEAR(margins->gain_margin_up, 50.0, 1e-9);
    }
    // 180° + arg L where |L| = 1, behind half a period of hold and the delay.
    const double w = margins->gain_crossovers[0].frequency;
    const double expected = std::atan2(8.0 * w, 30.0) - w * (0.005 + delay);
    EXPECT_NEAR(margins->phase_margin, expected * 180.0 / std::numbers::pi, 0.2);
  }
}

// An integrator under zero-order hold: L = k T/(z - 1). It is unstable from k T = 2 on, at Nyquist.
// |L| = 1 at 2 sin(θ/2) = kT, where the phase is -90° - θ/2, so PM = 90° - θ/2. The delay margin is
// exact: z - 1 + kT z^{-d} or its fractional kin reaches the circle.
// 1 + L = 0 with S - T = (1 - L)/(1 + L) = (z - 1 - kT)/(z - 1 + kT), largest at z = -1:
// (2 + kT)/(2 - kT), so α = 2 (2 - kT)/(2 + kT).
TEST(StabilityMargins, IntegratorInClosedForm) {
  const double kT = 0.4;
  const double T = 0.02;
  const auto loop =
      state_feedback_loop(scalar(0.0), scalar(1.0), scalar(kT / T), Time(T), Time(0.0)).value();
  const auto margins = stability_margins(loop).value();
  EXPECT_TRUE(margins.stable);
  EXPECT_NEAR(margins.spectral_radius, 1.0 - kT, 1e-14);
  EXPECT_NEAR(margins.gain_margin_up, 2.0 / kT, 1e-12);
  EXPECT_EQ(margins.gain_margin_down, 0.0);
  const double theta = 2.0 * std::asin(0.5 * kT);
  ASSERT_EQ(margins.gain_crossovers.size(), 1u);
  EXPECT_NEAR(margins.gain_crossovers[0].frequency, theta / T, 1e-10);
  EXPECT_NEAR(margins.phase_margin, 90.0 - 0.5 * theta * 180.0 / pi, 1e-9);
  EXPECT_NEAR(margins.disk_margin, 2.0 * (2.0 - kT) / (2.0 + kT), 1e-12);
  EXPECT_NEAR(margins.disk_frequency, pi / T, 1e-9);
  EXPECT_NEAR(margins.disk_gain_up, (2.0 + margins.disk_margin) / (2.0 - margins.disk_margin),
              1e-12);
}

// With d whole periods of delay an integrator's loop z^d (z - 1) + kT is on the circle at
// kT = 2 sin(π/(2(2d + 1))) (a classic of sampled control).
TEST(StabilityMargins, DelayedIntegratorInClosedForm) {
  const double T = 0.01;
  for (const int d : {1, 2, 5, 12}) {
    const double limit = 2.0 * std::sin(pi / (2.0 * (2.0 * d + 1.0)));
    const double kT = 0.5 * limit;
    const auto loop =
        state_feedback_loop(scalar(0.0), scalar(1.0), scalar(kT / T), Time(T), Time(d * T)).value();
    const auto margins = stability_margins(loop).value();
    EXPECT_NEAR(margins.gain_margin_up, 2.0, 1e-10) << d;
  }
  // And from the other side: at kT = 2 sin(π/10) without delay the margin is two periods.
  const double kT = 2.0 * std::sin(pi / 10.0);
  const auto loop =
      state_feedback_loop(scalar(0.0), scalar(1.0), scalar(kT / T), Time(T), Time(0.0)).value();
  EXPECT_NEAR(stability_margins(loop).value().delay_margin, 2.0 * T, 1e-12);
}

// An integrator with a fraction f of a period: x⁺ = x + (T - f) u + f u₋, so the closed loop is
// z² - (1 - k(T - f)) z + k f; both products of poles reach 1 at k f = 1 (T < 2 f).
TEST(StabilityMargins, FractionalDelayInClosedForm) {
  const double T = 0.02;
  const double k = 1.4 / T;
  const auto loop =
      state_feedback_loop(scalar(0.0), scalar(1.0), scalar(k), Time(T), Time(0.0)).value();
  EXPECT_NEAR(stability_margins(loop).value().delay_margin, 1.0 / k, 1e-12);
}

// dx/dt = x + u under K = 2 in continuous terms: L(1) = -K B/(A - 1) < -1 holds the unstable pole
// only while the gain stays above one half at frequency zero.
TEST(StabilityMargins, UnstablePlantHasALowerGainMargin) {
  const double T = 0.01;
  const double a = std::exp(T);
  const double b = std::expm1(T);
  const double K = 3.0;
  const auto loop =
      state_feedback_loop(scalar(1.0), scalar(1.0), scalar(K), Time(T), Time(0.0)).value();
  const auto margins = stability_margins(loop).value();
  EXPECT_TRUE(margins.stable);
  // a - g b K = 1 at the lower and -1 at the upper end.
  EXPECT_NEAR(margins.gain_margin_down, (a - 1.0) / (b * K), 1e-12);
  EXPECT_NEAR(margins.gain_margin_up, (a + 1.0) / (b * K), 1e-10);
}

// The margin that python-control misses: it lies at the Nyquist frequency. z = -1 at g =
// (1+a)/(bK).
TEST(StabilityMargins, AtTheNyquistFrequency) {
  const double T = 0.005;
  const double rate = 30.0;
  const double a = std::exp(-rate * T);
  const double b = -std::expm1(-rate * T) / rate;
  const double K = 0.9 * (1.0 + a) / b;
  const auto loop =
      state_feedback_loop(scalar(-rate), scalar(1.0), scalar(K), Time(T), Time(0.0)).value();
  const auto margins = stability_margins(loop).value();
  EXPECT_NEAR(margins.gain_margin_up, 1.0 / 0.9, 1e-11);
  ASSERT_FALSE(margins.phase_crossovers.empty());
  EXPECT_NEAR(margins.phase_crossovers.back().frequency, pi / T, 1e-9);
}

TEST(StabilityMargins, LowGainHasNoCrossover) {
  const auto loop =
      state_feedback_loop(scalar(-1.0), scalar(1.0), scalar(0.5), Time(0.01), Time(0.0)).value();
  const auto margins = stability_margins(loop).value();
  EXPECT_TRUE(margins.gain_crossovers.empty());
  EXPECT_EQ(margins.phase_margin, 180.0);
  EXPECT_EQ(margins.delay_margin, infinity);
}

// 1 + L = det(zI - A_closed)/det(zI - A_open) at any z: the response and the eigenvalues are two
// ways to the same loop.
TEST(StabilityMargins, ResponseAgreesWithTheEigenvalues) {
  const auto design = regulated_elevator();
  for (const double delay : {0.0, 0.013, 0.04, 0.057}) {
    const auto loop = loop_of(design, Time(delay));
    const double T = loop.period.si();
    for (const double theta : {0.01, 0.3, 1.0, 2.0, 3.0}) {
      const auto L = loop_response(loop, theta / T).value();
      // det ratio by the poles of both; gain 0 leaves the open loop.
      const auto delayed = discretize_with_input_delay({loop.A, loop.B, loop.C, scalar(0.0)},
                                                       loop.period, Time(delay))
                               .value();
      const Eigen::Index n = delayed.A.rows();
      const Eigen::Index q = loop.A_c.rows();
      Eigen::MatrixXcd M = Eigen::MatrixXcd::Zero(n + q, n + q);
      M.topLeftCorner(n, n) =
          (delayed.A - delayed.B * loop.D_c * delayed.C).cast<std::complex<double>>();
      M.topRightCorner(n, q) = (-delayed.B * loop.C_c).cast<std::complex<double>>();
      M.bottomLeftCorner(q, n) = (loop.B_c * delayed.C).cast<std::complex<double>>();
      M.bottomRightCorner(q, q) = loop.A_c.cast<std::complex<double>>();
      Eigen::MatrixXcd open = Eigen::MatrixXcd::Zero(n + q, n + q);
      open.topLeftCorner(n, n) = delayed.A.cast<std::complex<double>>();
      open.bottomLeftCorner(q, n) = M.bottomLeftCorner(q, n);
      open.bottomRightCorner(q, q) = M.bottomRightCorner(q, q);
      const auto z = std::polar(1.0, theta);
      const Eigen::MatrixXcd I = Eigen::MatrixXcd::Identity(n + q, n + q);
      const auto ratio = (z * I - M).determinant() / (z * I - open).determinant();
      EXPECT_LT(std::abs(1.0 + L - ratio), 1e-9 * (1.0 + std::abs(L))) << delay << " " << theta;
    }
  }
}

// A margin is a margin: a hair inside it the closed loop is stable, a hair outside it is not.
void expect_margins_flip(const PlantInputLoop& loop) {
  const auto margins = stability_margins(loop).value();
  ASSERT_TRUE(margins.stable);
  constexpr double hair = 1e-4;
  if (std::isfinite(margins.gain_margin_up)) {
    EXPECT_LT(radius(loop, margins.gain_margin_up * (1.0 - hair)), 1.0);
    EXPECT_GT(radius(loop, margins.gain_margin_up * (1.0 + hair)), 1.0);
  }
  if (margins.gain_margin_down > 0.0) {
    EXPECT_LT(radius(loop, margins.gain_margin_down * (1.0 + hair)), 1.0);
    EXPECT_GT(radius(loop, margins.gain_margin_down * (1.0 - hair)), 1.0);
  }
  if (std::isfinite(margins.delay_margin)) {
    EXPECT_LT(radius(loop, 1.0, margins.delay_margin * (1.0 - hair)), 1.0);
    EXPECT_GT(radius(loop, 1.0, margins.delay_margin * (1.0 + hair)), 1.0);
    for (int i = 1; i < 10; ++i) {
      EXPECT_LT(radius(loop, 1.0, margins.delay_margin * i / 10.0), 1.0);
    }
  }
  // The disk lies within each single margin, and touches the loop somewhere.
  EXPECT_LE(margins.disk_gain_up, margins.gain_margin_up * (1.0 + 1e-9));
  EXPECT_GE(margins.disk_gain_down, margins.gain_margin_down * (1.0 - 1e-9));
  EXPECT_LE(margins.disk_phase, margins.phase_margin * (1.0 + 1e-9));
  const auto L =
      loop_response(loop, std::min(margins.disk_frequency, pi / loop.period.si())).value();
  EXPECT_NEAR(std::abs(1.0 - L) / std::abs(1.0 + L), 2.0 / margins.disk_margin,
              1e-9 * 2.0 / margins.disk_margin);
  for (int i = 1; i <= 500; ++i) {
    const auto at = loop_response(loop, pi / loop.period.si() * i / 500.0).value();
    EXPECT_LE(std::abs(1.0 - at) / std::abs(1.0 + at), 2.0 / margins.disk_margin * (1.0 + 1e-9));
  }
}

TEST(StabilityMargins, FlipStabilityForTheElevator) {
  for (const double period : {0.005, 0.02}) {
    const auto design = regulated_elevator(period);
    for (const double delay : {0.0, 0.004, 0.013}) {
      expect_margins_flip(
          state_feedback_loop(design.truth.A, design.truth.B, design.K, Time(period), Time(delay))
              .value());
      const auto loop = loop_of(design, Time(delay));
      if (stability_margins(loop).value().stable) {
        expect_margins_flip(loop);
      }
    }
  }
}

// Random plants of one to three states, some unstable, some with an integrator, with delays.
TEST(StabilityMargins, FlipStabilityForRandomPlants) {
  Random random(2024);
  int checked = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Eigen::Index n = 1 + trial % 3;
    ContinuousSystem<> plant;
    plant.A = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return 3.0 * random.normal(); });
    if (trial % 4 == 0) {
      plant.A.col(0).setZero();
    }
    plant.B = Eigen::MatrixXd::NullaryExpr(n, 1, [&] { return random.normal(); });
    plant.C = Eigen::MatrixXd::NullaryExpr(1, n, [&] { return random.normal(); });
    plant.D = scalar(0.0);
    const Time period(0.05);
    const auto model = discretize(plant, period).value();
    const auto K = lqr(model, Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)), scalar(1.0));
    const auto K_e =
        kalman_gain(model, Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)), scalar(1.0));
    if (!K || !K_e) {
      continue;
    }
    const Time delay(trial % 3 == 0 ? 0.0 : random.uniform(0.0, 0.04));
    const auto loop =
        trial % 2 == 0
            ? state_feedback_loop(plant.A, plant.B, K->K, period, delay).value()
            : observer_regulator_loop(plant.A, plant.B, plant.C, model, K->K, K_e->K, delay)
                  .value();
    if (stability_margins(loop).value().stable) {
      SCOPED_TRACE(trial);
      expect_margins_flip(loop);
      ++checked;
    }
  }
  EXPECT_GT(checked, 30);
}

// A delay of many periods, where the loop's phase winds around several times.
TEST(StabilityMargins, LongDelay) {
  const double T = 0.005;
  const auto loop_with = [&](double K) {
    return state_feedback_loop(scalar(-1.0), scalar(1.0), scalar(K), Time(T), Time(0.3)).value();
  };
  const auto loop = loop_with(3.0);
  expect_margins_flip(loop);
  EXPECT_GT(stability_margins(loop).value().phase_crossovers.size(), 20u);
  // L = K b z⁻ᵈ/(z - a) is 1 in size at cos θ = (1 + a² - K²b²)/(2a), where the delay may turn it
  // by π - arg(z - a) in all; 770 stored inputs are too many for eigenvalues. A part of a period is
  // that part of its lag but for a few thousandths, T against the plant's time constant.
  const double K = 1.2;
  const double a = std::exp(-T);
  const double b = -std::expm1(-T);
  const double theta = std::acos((1.0 + a * a - K * K * b * b) / (2.0 * a));
  const double periods = (pi - std::arg(std::polar(1.0, theta) - a)) / theta;
  const auto margins = stability_margins(loop_with(K)).value();
  EXPECT_GT(margins.phase_crossovers.size(), 20u);
  EXPECT_NEAR(margins.delay_margin, periods * T - 0.3, 5e-3 * T);
  EXPECT_GT(margins.delay_margin, 3.0);
}

// The book's remark on 7.7.2: with state feedback and a short period the LQR keeps 60°, and a gain
// from one half to infinity in continuous time (a disk of S with radius 1 around -1).
TEST(StabilityMargins, LqrKeepsSixtyDegrees) {
  const auto plant = elevator(4.0, 0.3);
  const auto model = discretize(plant, Time(1e-4)).value();
  const auto K = lqr(model, bryson({0.02, 0.4}), bryson({12.0})).value().K;
  const auto margins =
      stability_margins(state_feedback_loop(plant.A, plant.B, K, Time(1e-4), Time(0.0)).value())
          .value();
  EXPECT_GT(margins.phase_margin, 60.0);
  EXPECT_LT(margins.gain_margin_down, 0.5);
}

TEST(StabilityMargins, AnUnstableLoopHasNone) {
  const auto design = regulated_elevator();
  const auto margins = stability_margins(loop_of(design, Time(0.5))).value();
  EXPECT_FALSE(margins.stable);
  EXPECT_GT(margins.spectral_radius, 1.0);
  EXPECT_EQ(margins.gain_margin_up, 1.0);
  EXPECT_EQ(margins.phase_margin, 0.0);
  EXPECT_EQ(margins.delay_margin, 0.0);
  EXPECT_EQ(margins.disk_margin, 0.0);
}

// An observer whose correction is 1e20 times itself: what L is, rounding decides, at each frequency
// anew. That ends.
TEST(StabilityMargins, RefusesAResponseThatIsRounding) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6, 6);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(6, 1);
  B(0, 0) = -1.1;
  Eigen::RowVectorXd row(6);
  row << 0.5, 1e-8, 1.8, 1.0, 2.0, -1e20;
  const Eigen::MatrixXd C = row.replicate(2, 1);
  Eigen::RowVectorXd K(6);
  K << -1.6e8, -1.7e8, 6.5e7, 2.2e-8, -1.9e8, -1e-8;
  const Eigen::MatrixXd K_e = Eigen::RowVector2d(2.2e-16, 1.7).replicate(6, 1);
  const Time period(1e-300);
  const auto model = discretize(ContinuousSystem<>{A, B, C, Eigen::MatrixXd::Zero(2, 1)}, period);
  const auto loop = observer_regulator_loop(A, B, C, model.value(), K, K_e, Time(0.0)).value();
  const auto margins = stability_margins(loop);
  ASSERT_FALSE(margins.has_value());
  EXPECT_TRUE(margins.error().is(SystemError::no_convergence));
}

TEST(StabilityMargins, Errors) {
  auto loop = state_feedback_loop(scalar(-1.0), scalar(1.0), scalar(0.5), 10_ms, 0_ms).value();
  EXPECT_TRUE(
      state_feedback_loop(scalar(-1.0), scalar(1.0), Eigen::RowVector2d(1.0, 1.0), 10_ms, 0_ms)
          .error()
          .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(state_feedback_loop(scalar(-1.0), scalar(1.0), scalar(1.0), Time(0.0), 0_ms)
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(state_feedback_loop(scalar(-1.0), scalar(1.0), scalar(1.0), 10_ms, Time(-1.0))
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(state_feedback_loop(scalar(std::nan("")), scalar(1.0), scalar(1.0), 10_ms, 0_ms)
                  .error()
                  .is(ArgumentError::not_finite));
  EXPECT_TRUE(loop_response(loop, 1e6).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(loop_response(loop, -1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(closed_loop_radius(loop, infinity).error().is(ArgumentError::not_finite));
  auto through = regulated_elevator();
  through.model.D(0, 0) = 1.0;
  EXPECT_TRUE(observer_regulator_loop(through.truth.A, through.truth.B, through.truth.C,
                                      through.model, through.K, through.K_e, 0_ms)
                  .error()
                  .is(ArgumentError::out_of_range));
  loop.D_c = Eigen::RowVector2d(1.0, 1.0);
  EXPECT_TRUE(stability_margins(loop).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::margins_test
