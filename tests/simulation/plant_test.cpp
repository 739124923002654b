#include <flyball/simulation/plant.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/simulation/closed_loop.hpp>

namespace flyball::plant_test {
namespace {

using namespace flyball::literals;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

ClosedLoop two_seconds() {
  ClosedLoop loop;
  loop.period = 20_ms;
  loop.reference = MatrixXd::Zero(0, 100);
  return loop;
}

LoopCommand one(const LoopSample&) {
  return VectorXd::Ones(1);
}

// A model that is fine where it starts and has no derivative from x = 1 on.
struct Cliff {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using std::sqrt;
    return Eigen::Vector<ScalarOf<X, U>, 1>{sqrt(1.0 - x(0)) + u(0)};
  }
  static ModelDescription description() { return {.states = {{"height", "m"}}}; }
};

// A model whose derivative has one entry too many.
struct Misshapen {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 2>{x(0), u(0)};
  }
};

TEST(ModelPlant, RefusesModelsThatGiveNoNumber) {
  const auto at_once = ModelPlant::create(Cliff{}, MatrixXd::Constant(1, 1, 2.0)).error();
  EXPECT_TRUE(at_once.is(ArgumentError::not_finite));
  EXPECT_NE(to_string(at_once).find("height"), std::string::npos) << to_string(at_once);
  EXPECT_TRUE(
      ModelPlant::create(Misshapen{}, MatrixXd::Zero(1, 1)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(ModelPlant::create(Cliff{}, Vector2d::Zero()).error().is(ArgumentError::wrong_shape));

  // dx/dt = √(1 - x) + 1 passes 1 before 1 s.
  auto plant = ModelPlant::create(Cliff{}, MatrixXd::Zero(1, 1)).value();
  const auto later = simulate_closed_loop(plant, one, two_seconds()).error();
  EXPECT_TRUE(later.is(ArgumentError::not_finite));
  EXPECT_NE(to_string(later).find("height"), std::string::npos) << to_string(later);
  EXPECT_NE(to_string(later).find("t = 0.6"), std::string::npos) << to_string(later);
  auto accurate = ModelPlant::create(Cliff{}, MatrixXd::Zero(1, 1), {.accuracy = 1e-9}).value();
  const auto found = simulate_closed_loop(accurate, one, two_seconds()).error();
  EXPECT_NE(to_string(found).find("t = 0.6"), std::string::npos) << to_string(found);
}

// An output that ends where its model still has a derivative: √(0.51 - x) from 0.51 s on.
struct Blind {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X&, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{u(0)};
  }
  template <class X, class U>
  auto output(const X& x, const U&) const {
    using std::sqrt;
    return Eigen::Vector<ScalarOf<X>, 1>{sqrt(0.51 - x(0))};
  }
  static ModelDescription description() { return {.outputs = {{"distance", "m"}}}; }
};

// The controller is not asked about an output that is no number; the output and the time are named.
TEST(ModelPlant, NamesTheOutputThatIsNoNumber) {
  auto plant = ModelPlant::create(Blind{}, MatrixXd::Zero(1, 1)).value();
  const auto law = [](const LoopSample& s) -> LoopCommand {
    EXPECT_TRUE(s.y.allFinite());
    return one(s);
  };
  const auto error = simulate_closed_loop(plant, law, two_seconds()).error();
  EXPECT_TRUE(error.is(ArgumentError::not_finite));
  EXPECT_NE(to_string(error).find("distance"), std::string::npos) << to_string(error);
  EXPECT_NE(to_string(error).find("t = 0.52 s"), std::string::npos) << to_string(error);
}

// dx/dt = 1 + x² is tan(t): it is infinite at π/2 s, however small the steps.
struct RunsAway {
  static constexpr int states() { return 1; }
  static constexpr int inputs() { return 1; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    return Eigen::Vector<ScalarOf<X, U>, 1>{u(0) + x(0) * x(0)};
  }
  static ModelDescription description() { return {.states = {{"heat", "K"}}}; }
};

TEST(ModelPlant, NamesTheStateThatRunsAway) {
  auto accurate = ModelPlant::create(RunsAway{}, MatrixXd::Zero(1, 1), {.accuracy = 1e-9}).value();
  const auto message = to_string(simulate_closed_loop(accurate, one, two_seconds()).error());
  EXPECT_NE(message.find("ModelPlant: the state heat"), std::string::npos) << message;
  EXPECT_NE(message.find("at t = 1.5708 s"), std::string::npos) << message;
  EXPECT_NE(message.find("runs away"), std::string::npos) << message;

  auto coarse = ModelPlant::create(RunsAway{}, MatrixXd::Zero(1, 1)).value();
  const auto error = simulate_closed_loop(coarse, one, two_seconds()).error();
  EXPECT_TRUE(error.is(ArgumentError::not_finite));
  EXPECT_NE(to_string(error).find("heat"), std::string::npos) << to_string(error);
  EXPECT_NE(to_string(error).find("t = 1.57"), std::string::npos) << to_string(error);
}

}  // namespace
}  // namespace flyball::plant_test
