#include <flyball/control/lyapunov/region_of_attraction.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/control/continuous_lqr.hpp>
#include <flyball/core/random.hpp>
#include <flyball/mechanisms/acrobot.hpp>
#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/mechanisms/lagrangian/planar_linkage.hpp>
#include <flyball/mechanisms/pendulum.hpp>
#include <flyball/systems/any_model.hpp>
#include <flyball/systems/linearize.hpp>

namespace flyball::region_of_attraction_test {
namespace {

using namespace flyball::literals;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// dx/dt = f(x) + u of one state.
template <class F>
struct Scalar {
  F f;
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{f(x(0)) + u(0)};
  }
};
template <class F>
SaturatedLoop scalar_loop(const F& f, double K) {
  return {.model = model_tape(Scalar<F>{f}),
          .x = VectorXd::Zero(1),
          .u = VectorXd::Zero(1),
          .K = MatrixXd::Constant(1, 1, K)};
}

// dx/dt = -x + x³: V = x²/2 falls for |x| < 1.
TEST(RegionOfAttraction, CubicIsKnown) {
  const auto region = certify_region(scalar_loop([](const auto& x) { return x * x * x - x; }, 0.0),
                                     {.closeness = 0.999})
                          .value();
  EXPECT_NEAR(region.P(0, 0), 0.5, 1e-15);
  EXPECT_NEAR(region.refuted, 0.5, 1e-9);
  EXPECT_GE(region.level, 0.999 * 0.5);
  EXPECT_LE(region.level, 0.5);
  EXPECT_EQ(region.limit, AttractionLimit::rate);
  EXPECT_NEAR(std::abs(region.limiting_state(0)), 1.0, 1e-9);
  EXPECT_NEAR(region.extent(0), 1.0, 1e-3);
  EXPECT_NEAR(region.volume(), 2.0, 2e-3);
  EXPECT_GT(region.core, 0.0);
  EXPECT_GT(region.core_rate, 0.0);
}

// dx/dt = x + u, u = clamp(-2 x, -1, 1): from |x| < 1 it comes back, from beyond no input holds it.
TEST(RegionOfAttraction, SaturatedIntegrator) {
  SaturatedLoop loop = scalar_loop([](const auto& x) { return x; }, 2.0);
  loop.u_min = VectorXd::Constant(1, -1.0);
  loop.u_max = VectorXd::Constant(1, 1.0);
  const auto region = certify_region(loop, {.closeness = 0.999}).value();
  EXPECT_NEAR(region.extent(0), 1.0, 1e-3);
  EXPECT_LE(region.extent(0), 1.0);
  // Without limits it is stable everywhere: as far as anyone looks.
  loop.u_min = VectorXd();
  loop.u_max = VectorXd();
  const auto whole = certify_region(loop).value();
  EXPECT_EQ(whole.limit, AttractionLimit::reach);
  EXPECT_EQ(whole.refuted, std::numeric_limits<double>::infinity());
  EXPECT_GT(whole.extent(0), 1e3);
  // As far as the track goes.
  const auto track = certify_region(loop, {.reach = VectorXd::Constant(1, 0.3)}).value();
  EXPECT_NEAR(track.extent(0), 0.3, 1e-6);
  EXPECT_LE(track.extent(0), 0.3);
}

/// Van der Pol's oscillator with time reversed; its input does nothing that K = 0 would use.
struct VanDerPol {
  static constexpr int states() { return 2; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{-x(1), x(0) + (x(0) * x(0) - 1.0) * x(1) + u(0)};
  }
};

// Khalil, "Nonlinear Systems", example 8.9: V = 1.5 x₁² - x₁x₂ + x₂²; that V̇ < 0 in V < 2.25 is
// read off a contour plot there. The limit cycle is the border of the whole region.
TEST(RegionOfAttraction, VanDerPol) {
  const SaturatedLoop loop{.model = model_tape(VanDerPol{}),
                           .x = VectorXd::Zero(2),
                           .u = VectorXd::Zero(1),
                           .K = MatrixXd::Zero(1, 2)};
  const auto region = certify_region(loop, {.closeness = 0.999}).value();
  EXPECT_TRUE(region.P.isApprox(Eigen::Matrix2d{{1.5, -0.5}, {-0.5, 1.0}}, 1e-14));
  EXPECT_NEAR(region.level, 2.25, 0.08);
  EXPECT_LE(region.level, region.refuted);
  EXPECT_GE(region.level, 0.999 * region.refuted);
  // Backward in time the border goes to the limit cycle, whose area is some 13.
  const auto rings = backward_rings(loop, region, 0, 1, {8.0, 0.0}, 400).value();
  const auto area = [](const MatrixXd& ring) {
    double sum = 0.0;
    for (Eigen::Index k = 1; k < ring.cols(); ++k) {
      sum += 0.5 * (ring(0, k - 1) * ring(1, k) - ring(0, k) * ring(1, k - 1));
    }
    return std::abs(sum);
  };
  EXPECT_NEAR(area(rings[1]), region.volume(), 1e-3 * region.volume());
  EXPECT_GT(area(rings[0]), 1.5 * region.volume());
  const auto sampled =
      sample_region(loop, region, Eigen::Vector2d(3.0, 3.0),
                    {.duration = 20.0, .step = 2e-2, .count = 900, .plane = {0, 1}})
          .value();
  EXPECT_NEAR(sampled.attracted * 36.0, area(rings[0]), 0.8);
  EXPECT_NEAR(sampled.certified * 36.0, region.volume(), 0.5);
  EXPECT_NEAR(sampled.missed(), 1.0 - region.volume() / area(rings[0]), 0.1);
}

SaturatedLoop balanced(const ModelTape& tape, const ContinuousSystem<>& linear, const VectorXd& x,
                       double limit, const std::vector<double>& tolerances,
                       std::vector<Eigen::Index> angles, MatrixXd& S) {
  const auto design = continuous_lqr(linear, bryson(tolerances), bryson({limit})).value();
  S = design.S;
  return {.model = tape,
          .x = x,
          .u = VectorXd::Zero(1),
          .K = design.K,
          .u_min = VectorXd::Constant(1, -limit),
          .u_max = VectorXd::Constant(1, limit),
          .angles = std::move(angles)};
}

/// No state of a seeded sample below the level has a rate of V that is not negative; and starts on
/// the border come in.
void expect_true(const SaturatedLoop& loop, const CertifiedRegion& region, double duration) {
  Random random(83);
  const Eigen::Index n = region.x.size();
  VectorXd half(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    half(i) = region.extent(i);
  }
  std::vector<double> values(loop.model.f.size());
  loop.model.f.prepare<double>(loop.model.parameters, values);
  int inside = 0;
  for (int k = 0; k < 20'000; ++k) {
    VectorXd x = region.x;
    for (Eigen::Index i = 0; i < n; ++i) {
      x(i) += random.uniform(-half(i), half(i));
    }
    const VectorXd e = x - region.x;
    if (region.value(x) > region.level) {
      continue;
    }
    ++inside;
    const double u = std::clamp(-(loop.K * e).value(), loop.u_min(0), loop.u_max(0));
    std::vector<double> in(x.begin(), x.end());
    in.push_back(u);
    VectorXd dxdt(n);
    loop.model.f.evaluate<double>(in, {dxdt.data(), static_cast<std::size_t>(n)}, values);
    EXPECT_LT(e.dot(region.P * dxdt), 0.0);
  }
  EXPECT_GT(inside, 500);
  const auto sampled =
      sample_region(loop, region, 0.99 * half, {.duration = duration, .count = 50}).value();
  EXPECT_GE(sampled.attracted, sampled.certified);
}

TEST(RegionOfAttraction, PendulumWithLimitedTorque) {
  const mechanisms::Pendulum model{1.0, 1.0, 0.0, 9.81};
  const Eigen::Vector2d x(pi, 0.0);
  MatrixXd S;
  const SaturatedLoop loop =
      balanced(model_tape(model), linearize(AnyModel(model), x, VectorXd::Zero(1)).value(), x,
               0.4 * 9.81, {0.1, 0.3}, {0}, S);
  const auto region = certify_region(loop, {.P = S}).value();
  expect_true(loop, region, 5.0);
  EXPECT_EQ(region.limit, AttractionLimit::rate);
  EXPECT_GT(region.extent(0), 0.15);
  EXPECT_LT(region.extent(0), std::asin(0.4));
  // A turn more is the same state.
  EXPECT_NEAR(region.value(Eigen::Vector2d(3.0 * pi, 0.1)), region.value(Eigen::Vector2d(pi, 0.1)),
              1e-12);
  RecordProperty("cells", region.cells);
}

TEST(RegionOfAttraction, CartPoleOnATrack) {
  const auto model =
      mechanisms::cart_pole({.cart_mass = 5_kg, .pole_mass = 0.5_kg, .pole_length = 50_cm}).value();
  const Eigen::Vector4d x(0.0, pi, 0.0, 0.0);
  MatrixXd S;
  const SaturatedLoop loop =
      balanced(model_tape(model), linearize(AnyModel(model), x, VectorXd::Zero(1)).value(), x, 20.0,
               {0.5, 0.2, 1.0, 1.0}, {1}, S);
  VectorXd reach = VectorXd::Constant(4, std::numeric_limits<double>::infinity());
  reach(0) = 2.0;
  const auto region = certify_region(loop, {.P = S, .reach = reach, .closeness = 0.9}).value();
  expect_true(loop, region, 10.0);
  EXPECT_GE(region.level, 0.9 * region.refuted);
  EXPECT_LE(region.extent(0), 2.0);
  RecordProperty("cells", region.cells);
}

// The energies' own model is as good as the closed form.
TEST(RegionOfAttraction, OfALagrangianModel) {
  const auto chain =
      mechanisms::planar_model(
          mechanisms::PlanarChain<1>{{mechanisms::point_mass_link(1.0, 1.0)}, -pi / 2.0})
          .value();
  const Eigen::Vector2d x(pi, 0.0);
  MatrixXd S;
  const SaturatedLoop loop =
      balanced(model_tape(chain), linearize(AnyModel(chain), x, VectorXd::Zero(1)).value(), x, 4.0,
               {0.1, 0.3}, {0}, S);
  const auto region = certify_region(loop, {.P = S}).value();
  expect_true(loop, region, 5.0);
  const mechanisms::Pendulum by_hand{1.0, 1.0, 0.0, mechanisms::standard_gravity};
  SaturatedLoop closed = loop;
  closed.model = model_tape(by_hand);
  EXPECT_NEAR(certify_region(closed, {.P = S}).value().level, region.level, 0.02 * region.level);
}

TEST(RegionOfAttraction, Errors) {
  const SaturatedLoop good = scalar_loop([](const auto& x) { return x * x * x - x; }, 0.0);
  const auto refused = [&](auto&& change, const RegionOptions& options = {}) {
    SaturatedLoop loop = good;
    change(loop);
    const auto answer = certify_region(loop, options);
    EXPECT_FALSE(answer.has_value());
    return answer ? Error(ArgumentError::empty) : answer.error();
  };
  const auto as_is = [](SaturatedLoop&) {};
  EXPECT_TRUE(refused([](auto& l) { l.x(0) = nan; }).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused([](auto& l) { l.K = MatrixXd::Zero(2, 1); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(refused([](auto& l) { l.K(0, 0) = nan; }).is(ArgumentError::not_finite));
  EXPECT_TRUE(
      refused([](auto& l) { l.u_min = VectorXd::Zero(1); }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      refused([](auto& l) { l.u_max = VectorXd::Constant(1, nan); }).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused([](auto& l) { l.angles = {1}; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused([](auto& l) { l.model.states = 2; }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(refused([](auto& l) { l.x(0) = 0.5; }).is(RegionError::not_an_equilibrium));
  const Error unstable = refused([](auto& l) { l.K(0, 0) = -2.0; });
  EXPECT_TRUE(unstable.is(RegionError::not_stable));
  EXPECT_EQ(to_string(unstable),
            "certify_region: A - B K is not stable; give a K that stabilises the linearisation "
            "(pole = [1, 0])")
      << to_string(unstable);
  EXPECT_TRUE(refused(as_is, {.P = -MatrixXd::Identity(1, 1)}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused(as_is, {.Q = -MatrixXd::Identity(1, 1)}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused(as_is, {.P = MatrixXd::Identity(2, 2)}).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      refused(as_is, {.reach = VectorXd::Constant(1, -1.0)}).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      refused(as_is, {.reach = VectorXd::Constant(1, nan)}).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused(as_is, {.closeness = 1.5}).is(ArgumentError::out_of_range));
  // √|x| has no slope at 0; floor has a step.
  const auto kink = certify_region(
      scalar_loop([](const auto& x) { return x * abs(x) - x - 0.5 * sqrt(x * x); }, 0.0));
  EXPECT_FALSE(kink.has_value());
  // A Lyapunov function of another loop.
  const SaturatedLoop oscillator{.model = model_tape(VanDerPol{}),
                                 .x = VectorXd::Zero(2),
                                 .u = VectorXd::Zero(1),
                                 .K = MatrixXd::Zero(1, 2)};
  EXPECT_TRUE(certify_region(oscillator, {.P = Eigen::Matrix2d{{1.0, 0.9}, {0.9, 1.0}}})
                  .error()
                  .is(RegionError::not_stable));
  // Work that does not suffice leaves a smaller region, not a wrong one.
  const auto little = certify_region(oscillator, {.most_cells = 30}).value();
  EXPECT_EQ(little.limit, AttractionLimit::work);
  EXPECT_LT(little.level, 2.2);
  const auto region = certify_region(oscillator).value();
  EXPECT_TRUE(
      sample_region(oscillator, region, VectorXd::Ones(3)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(sample_region(oscillator, region, VectorXd::Ones(2), {.step = 0.0})
                  .error()
                  .is(ArgumentError::not_positive));
  EXPECT_TRUE(sample_region(oscillator, region, VectorXd::Ones(2), {.plane = {0, 0}})
                  .error()
                  .is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      backward_rings(oscillator, region, 0, 2, {1.0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      backward_rings(oscillator, region, 0, 1, {nan}).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::region_of_attraction_test
