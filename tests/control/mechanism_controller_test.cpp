#include <flyball/control/mechanism_controller.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "control/mechanism_designs.hpp"
#include "support/allocation_count.hpp"

namespace flyball::mechanism_controller_test {
namespace {

using test::cases;
using test::design_of;
using test::MechanismKind;
using test::predicting;

struct Inputs {
  double measurement;
  MotionState r;
  MotionState r_next;
  double rail;
};

// Motions, sags and sensors that fail, among them a standstill from which a motion starts.
// @param scale  Of the measurement and the velocities: a flywheel's are large.
std::vector<Inputs> inputs(double scale = 1.0) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  const std::array odd{std::nan(""), inf, -inf, 0.0, -3.0, 500.0, 2.0};
  Random random(5);
  std::vector<Inputs> all;
  for (int k = 0; k < 300; ++k) {
    Inputs in{0.1 * scale * random.normal(),
              {0.1 * random.normal(), scale * random.normal()},
              {0.1 * random.normal(), scale * random.normal()},
              9.0 + 4.0 * random.uniform()};
    in.r.velocity = k % 5 == 0 ? 0.0 : in.r.velocity;
    in.measurement = k % 11 == 0 ? odd[static_cast<std::size_t>(k) % 3] : in.measurement;
    in.rail = k % 7 == 0 ? odd[static_cast<std::size_t>(k) % odd.size()] : in.rail;
    all.push_back(in);
  }
  return all;
}

// The equations of the class comment written out over every mechanism and choice.
TEST(MechanismController, IsWhatItsCommentSays) {
  for (const auto& [kind, kA_determined] : cases) {
    for (int choice = 0; choice < 8; ++choice) {
      MechanismControllerDesign design = design_of(kind, kA_determined);
      design.feed_forward_gravity = (choice & 1) == 0;
      design.feed_forward_friction = (choice & 2) == 0;
      design.compensate_voltage = (choice & 4) == 0;
      design.max_voltage = 10.0;
      auto controller = MechanismController<>::create(design).value();
      const bool flywheel = kind == MechanismKind::flywheel;
      const Eigen::Index n = design.plant.A.rows();
      const auto states = [&](const MotionState& m) -> Eigen::VectorXd {
        return n == 2 ? Eigen::VectorXd(Eigen::Vector2d(m.position, m.velocity))
                      : Eigen::VectorXd::Constant(1, flywheel ? m.velocity : m.position);
      };
      const Eigen::MatrixXd B_pinv = pseudoinverse(design.plant.B).value().X;
      Eigen::VectorXd x_hat = Eigen::VectorXd::Zero(n);
      double u_model = 0.0;
      bool saturated = false;
      for (const Inputs& in : inputs(flywheel ? 300.0 : 1.0)) {
        const double rate = flywheel ? (in.r_next.velocity - in.r.velocity) / 0.02 : in.r.velocity;
        const double y = in.measurement + 0.015 * rate;
        x_hat = design.plant.A * x_hat + design.plant.B * u_model;
        if (std::isfinite(y)) {
          x_hat += design.K_e * (y - x_hat(0));
        }
        const double gravity = design.gains.gravity_voltage(kind, in.r.position);
        const double direction = in.r.velocity != 0.0 ? in.r.velocity : in.r_next.velocity;
        const double extra =
            (design.feed_forward_gravity ? gravity : 0.0) +
            (design.feed_forward_friction ? design.gains.kS : 0.0) * (direction > 0.0   ? 1.0
                                                                      : direction < 0.0 ? -1.0
                                                                                        : 0.0);
        const double rail = !design.compensate_voltage               ? 12.0
                            : !(in.rail > 0.0) || !(in.rail < 120.0) ? 12.0
                                                                     : std::max(in.rail, 4.0);
        const double limit = std::min(10.0, rail);
        const double u = std::clamp(
            (design.K * (states(in.r) - x_hat))(0) +
                (B_pinv * (states(in.r_next) - design.plant.A * states(in.r)))(0) + extra,
            -limit, limit);
        saturated = saturated || std::abs(u) == limit;
        u_model = u - extra;
        ASSERT_NEAR(controller.update(in.measurement, in.r, in.r_next, in.rail), u, 1e-9);
        ASSERT_NEAR(controller.voltage(), u, 1e-9);
        ASSERT_EQ(controller.limit(), limit);
        ASSERT_NEAR(controller.command(), std::clamp(u * 12.0 / rail, -12.0, 12.0), 1e-9);
        ASSERT_LT((controller.x_hat() - x_hat).norm(), 1e-9 * (1.0 + x_hat.norm()));
      }
      EXPECT_TRUE(saturated);
    }
  }
}

template <int States>
void expect_the_same_as_dynamic(const MechanismControllerDesign& design) {
  auto fixed = MechanismController<States>::create(design).value();
  auto dynamic = MechanismController<>::create(design).value();
  fixed.reset({0.3, 20.0});
  dynamic.reset({0.3, 20.0});
  for (const Inputs& in : inputs()) {
    ASSERT_EQ(fixed.update(in.measurement, in.r, in.r_next, in.rail),
              dynamic.update(in.measurement, in.r, in.r_next, in.rail));
    ASSERT_EQ(fixed.command(), dynamic.command());
    ASSERT_EQ(fixed.x_hat(), dynamic.x_hat());
  }
}

TEST(MechanismController, FixedIsDynamic) {
  for (const auto& [kind, kA_determined] : cases) {
    const MechanismControllerDesign prompt = design_of(kind, kA_determined);
    for (const auto& design : {prompt, predicting(prompt, Time(0.05))}) {
      if (design.plant.A.rows() == 1) {
        expect_the_same_as_dynamic<1>(design);
      } else {
        expect_the_same_as_dynamic<2>(design);
      }
    }
  }
}

// The measurement is left as it is; the rest is a step of PredictingLqg, written out here over the
// equations of its comment, with a limit and a rail that are reached.
TEST(MechanismController, PredictsAsItsCommentSays) {
  const MechanismControllerDesign design =
      predicting(design_of(MechanismKind::arm), Time(0.05));  // two periods and a half
  const auto& model = *design.predicts_with;
  const auto delayed = discretize_delayed_input(model.A, model.B, Time(0.02), Time(0.05)).value();
  const auto half = discretize_zoh(model.A, model.B, Time(0.01)).value();
  auto controller = MechanismController<>::create(design).value();
  const Eigen::MatrixXd B_pinv = pseudoinverse(design.plant.B).value().X;
  Eigen::Vector2d late = Eigen::Vector2d::Zero();
  std::array<double, 4> sent{};  // u_{k-1}, u_{k-2}, …
  bool limited = false;
  for (const Inputs& in : inputs()) {
    late = delayed.A * late + delayed.B_0 * sent[2] + delayed.B_1 * sent[3];
    if (std::isfinite(in.measurement)) {
      late += design.K_e * (in.measurement - late(0));
    }
    Eigen::Vector2d x = delayed.A * late + delayed.B_0 * sent[1] + delayed.B_1 * sent[2];
    x = delayed.A * x + delayed.B_0 * sent[0] + delayed.B_1 * sent[1];
    x = half.A * x + half.B * sent[0];
    const double direction = in.r.velocity != 0.0 ? in.r.velocity : in.r_next.velocity;
    const double extra =
        design.gains.gravity_voltage(MechanismKind::arm, in.r.position) + (direction > 0.0   ? 0.15
                                                                           : direction < 0.0 ? -0.15
                                                                                             : 0.0);
    const double rail = !(in.rail > 0.0) || !(in.rail < 120.0) ? 12.0 : std::max(in.rail, 4.0);
    const Eigen::Vector2d r(in.r.position, in.r.velocity);
    const Eigen::Vector2d r_next(in.r_next.position, in.r_next.velocity);
    const double limit = std::min(12.0, rail);
    const double u =
        std::clamp((design.K * (r - x))(0) + (B_pinv * (r_next - design.plant.A * r))(0) + extra,
                   -limit, limit);
    limited = limited || std::abs(u) == limit;
    ASSERT_NEAR(controller.update(in.measurement, in.r, in.r_next, in.rail), u, 1e-9);
    ASSERT_LT((controller.x_hat() - x).norm(), 1e-9 * (1.0 + x.norm()));
    sent = {u - extra, sent[0], sent[1], sent[2]};
  }
  EXPECT_TRUE(limited);
}

// At the reference, at rest, only gravity is left: 0.6 V cos(0.2 rad - 0.2 rad) for the arm.
TEST(MechanismController, HoldsWhereItWasReset) {
  auto arm = MechanismController<2>::create(design_of(MechanismKind::arm)).value();
  auto predicts =
      MechanismController<2>::create(predicting(design_of(MechanismKind::arm), Time(0.05))).value();
  (void)predicts.update(3.0, {}, {}, 12.0);
  predicts.reset({-0.2, 0.0});
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(predicts.update(-0.2, {-0.2, 0.0}, {-0.2, 0.0}, 6.0), 0.6, 1e-12);
  }
  (void)arm.update(3.0, {}, {}, 12.0);
  arm.reset({-0.2, 0.0});
  EXPECT_EQ(arm.voltage(), 0.0);
  EXPECT_EQ(arm.command(), 0.0);
  EXPECT_NEAR(arm.update(-0.2, {-0.2, 0.0}, {-0.2, 0.0}, 6.0), 0.6, 1e-12);
  EXPECT_NEAR(arm.command(), 1.2, 1e-12);
}

TEST(MechanismController, Errors) {
  const auto refused = [](auto change) {
    MechanismControllerDesign design = design_of(MechanismKind::elevator);
    change(design);
    return MechanismController<>::create(design).error();
  };
  using Design = MechanismControllerDesign;
  EXPECT_TRUE(refused([](Design& d) { d.plant = {}; }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      refused([](Design& d) { d.K = Eigen::MatrixXd::Zero(1, 1); }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(refused([](Design& d) {
                d.K_e = Eigen::MatrixXd::Zero(1, 2);
              }).is(ArgumentError::wrong_shape));
  EXPECT_TRUE(refused([](Design& d) { d.plant.C(0, 1) = 0.1; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused([](Design& d) { d.plant.D(0, 0) = 0.1; }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(
      refused([](Design& d) { d.plant.period = Time(0.0); }).is(ArgumentError::not_positive));
  EXPECT_TRUE(refused([](Design& d) { d.K(0) = std::nan(""); }).is(ArgumentError::not_finite));
  EXPECT_TRUE(refused([](Design& d) { d.max_voltage = 0.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      refused([](Design& d) { d.nominal_voltage = -12.0; }).is(ArgumentError::not_positive));
  EXPECT_TRUE(
      refused([](Design& d) { d.measurement_delay = Time(-1.0); }).is(ArgumentError::out_of_range));
  EXPECT_TRUE(refused([](Design& d) { d.gains.kS = -1.0; }).is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(refused([](Design& d) { d.kind = MechanismKind::flywheel; })),
            "MechanismController: the plant is of 2 states; it must be of one state, the velocity");
  const auto of_another_size = [](Design& d) {
    d.predicts_with = predicting(design_of(MechanismKind::flywheel), Time(0.05)).predicts_with;
  };
  EXPECT_TRUE(refused(of_another_size).is(ArgumentError::wrong_shape));
  const auto too_late = [](Design& d) { d = predicting(d, Time(1e9)); };
  EXPECT_TRUE(refused(too_late).is(ArgumentError::out_of_range));
  EXPECT_TRUE(MechanismController<1>::create(design_of(MechanismKind::elevator))
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(MechanismController<2>::create(design_of(MechanismKind::elevator, false))
                  .error()
                  .is(ArgumentError::wrong_shape));
}

template <class Controller>
void expect_no_allocation(Controller controller) {
  const std::vector<Inputs> all = inputs();
  const test::AllocationCounter counter;
  double sum = 0.0;
  for (const Inputs& in : all) {
    sum += controller.update(in.measurement, in.r, in.r_next, in.rail) + controller.command();
  }
  controller.reset({});
  EXPECT_EQ(counter.count(), 0u);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(MechanismController, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  const MechanismControllerDesign arm = design_of(MechanismKind::arm);
  expect_no_allocation(MechanismController<1>::create(design_of(MechanismKind::flywheel)).value());
  expect_no_allocation(MechanismController<2>::create(arm).value());
  expect_no_allocation(MechanismController<>::create(arm).value());
  expect_no_allocation(MechanismController<>::create(predicting(arm, Time(0.05))).value());
}

}  // namespace
}  // namespace flyball::mechanism_controller_test
