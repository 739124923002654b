#include <flyball/math/expression/lane_tape.hpp>

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/math/expression/lagrangian.hpp>
#include <flyball/math/expression/tape_builder.hpp>

namespace lane_tape_test {
namespace {

using namespace flyball;
using namespace flyball::expression;
using enum Operation;

/// ẋ = (v, sin x · v / (1 + u²) + p eˣ) of x, v, u.
Tape oscillator() {
  TapeBuilder t(3, 1);
  const Slot x = t.input(0);
  const Slot v = t.input(1);
  const Slot u = t.input(2);
  const Slot pull = t.binary(divide, t.binary(multiply, t.unary(Operation::sin, x), v),
                             t.binary(add, t.constant(1.0), t.binary(multiply, u, u)));
  const std::array outputs{
      v, t.binary(add, pull, t.binary(multiply, t.parameter(0), t.unary(Operation::exp, x)))};
  return t.finish(outputs);
}

std::vector<double> at(const Tape& tape, const std::vector<double>& inputs, double parameter) {
  std::vector<double> work(tape.size());
  std::vector<double> out(tape.outputs());
  tape.prepare<double>(std::vector<double>(tape.parameters(), parameter), work);
  tape.evaluate<double>(inputs, out, work);
  return out;
}

TEST(LaneTape, EveryLaneIsTheTape) {
  const Tape tape = oscillator();
  const LaneTape lanes(tape);
  std::vector<double> work(lanes.workspace_size());
  const double parameter = 0.7;
  lanes.prepare({&parameter, 1}, work.data());
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    // Angles up to 10⁷: beyond 10⁵ the sine is the library's.
    const double range = std::pow(10.0, round % 8);
    std::vector<std::vector<double>> points;
    for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
      points.push_back({random.uniform(-1.0, 1.0) * (round % 2 == 0 ? range : 3.0), random.normal(),
                        random.normal()});
      points.back()[0] = std::min(points.back()[0], 600.0);
      for (std::size_t i = 0; i < 3; ++i) {
        lanes.input(i, work.data())[l] = points[l][i];
      }
    }
    lanes.evaluate(work.data());
    for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
      const std::vector<double> y = at(tape, points[l], parameter);
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(lanes.output(i, work.data())[l], y[i], 4e-15 * std::max(1.0, std::abs(y[i])));
      }
    }
  }
}

TEST(LaneTape, SinesAndCosinesToTheLastDigits) {
  TapeBuilder t(1);
  const std::array outputs{t.unary(Operation::sin, t.input(0)),
                           t.unary(Operation::cos, t.input(0))};
  const LaneTape lanes(t.finish(outputs));
  std::vector<double> work(lanes.workspace_size());
  lanes.prepare({}, work.data());
  Random random(5);
  for (int round = 0; round < 2000; ++round) {
    double* const x = lanes.input(0, work.data());
    for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
      x[l] = random.uniform(-1.0, 1.0) * std::pow(10.0, round % 5);
    }
    const std::vector<double> points(x, x + LaneTape::lanes);
    lanes.evaluate(work.data());
    for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
      EXPECT_NEAR(lanes.output(0, work.data())[l], std::sin(points[l]), 2.3e-16);
      EXPECT_NEAR(lanes.output(1, work.data())[l], std::cos(points[l]), 2.3e-16);
    }
  }
}

TEST(LaneTape, DerivativesTimesZeroStayZero) {
  TapeBuilder t(2);
  const std::array outputs{t.binary(chain, t.input(0), t.input(1))};
  const LaneTape lanes(t.finish(outputs));
  std::vector<double> work(lanes.workspace_size());
  lanes.prepare({}, work.data());
  const double inf = std::numeric_limits<double>::infinity();
  lanes.input(0, work.data())[0] = 0.0;
  lanes.input(1, work.data())[0] = inf;
  lanes.input(0, work.data())[1] = 2.0;
  lanes.input(1, work.data())[1] = 3.0;
  lanes.input(0, work.data())[2] = 2.0;
  lanes.input(1, work.data())[2] = inf;
  lanes.evaluate(work.data());
  EXPECT_EQ(lanes.output(0, work.data())[0], 0.0);
  EXPECT_EQ(lanes.output(0, work.data())[1], 6.0);
  EXPECT_EQ(lanes.output(0, work.data())[2], inf);
}

/// Value, Jacobian and Hessian of a Lagrangian's tape at a point with weights.
struct Evaluated {
  Eigen::VectorXd y;
  Eigen::MatrixXd J, H;
};

Evaluated evaluate(const Lagrangian& f, std::vector<double> point,
                   const std::vector<double>& weights, double parameter) {
  point.insert(point.end(), weights.begin(), weights.end());
  const std::vector<double> out = at(f.tape, point, parameter);
  const auto rows = static_cast<Eigen::Index>(f.rows);
  const auto columns = static_cast<Eigen::Index>(f.columns);
  Evaluated e{Eigen::Map<const Eigen::VectorXd>(out.data(), rows),
              Eigen::MatrixXd::Zero(rows, columns), Eigen::MatrixXd::Zero(columns, columns)};
  for (std::size_t k = 0; k < f.jacobian.size(); ++k) {
    e.J(f.jacobian[k].row, f.jacobian[k].column) = out[f.rows + k];
  }
  for (std::size_t k = 0; k < f.hessian.size(); ++k) {
    const double value = out[f.rows + f.jacobian.size() + k];
    e.H(f.hessian[k].row, f.hessian[k].column) = value;
    e.H(f.hessian[k].column, f.hessian[k].row) = value;
  }
  return e;
}

// y₁ = v, y₂ = s v / w + p eˣ with s = sin x, w = 1 + u²; the Hessian of μ₁ y₁ + μ₂ y₂ by hand.
TEST(Lagrangian, ByHand) {
  const double x = 0.4, v = -1.3, u = 0.8, p = 0.7, m = 2.5;
  const double s = std::sin(x), c = std::cos(x), w = 1.0 + u * u;
  const Evaluated e = evaluate(lagrangian(oscillator(), 3), {x, v, u}, {-4.0, m}, p);
  const double slope = -2.0 * u / (w * w);                // of 1/w
  const double bend = (8.0 * u * u / w - 2.0) / (w * w);  // its second
  Eigen::Matrix3d H;
  H << -s * v / w + p * std::exp(x), c / w, c * v * slope, c / w, 0.0, s * slope, c * v * slope,
      s * slope, s * v * bend;
  EXPECT_LT((e.H - m * H).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(e.J(0, 1), 1.0, 0.0);
  EXPECT_NEAR(e.J(1, 0), c * v / w + p * std::exp(x), 1e-15);
  EXPECT_NEAR(e.J(1, 2), s * v * slope, 1e-15);
  EXPECT_NEAR(e.y(1), s * v / w + p * std::exp(x), 1e-15);
}

/// The classical step of the oscillator, written out on one tape.
Tape whole_step(double h) {
  const Tape f = oscillator();
  TapeBuilder t(3, 1);
  const std::array parameters{t.parameter(0)};
  const Slot u = t.input(2);
  const auto k_of = [&](Slot x, Slot v) {
    const std::array in{x, v, u};
    return replay(t, f, in, parameters);
  };
  const auto ahead = [&](const std::vector<Slot>& k, double by) {
    std::array<Slot, 2> point{};
    for (std::size_t i = 0; i < 2; ++i) {
      point[i] = t.binary(add, t.input(i), t.binary(multiply, t.constant(by), k[i]));
    }
    return point;
  };
  const auto k1 = k_of(t.input(0), t.input(1));
  const auto p2 = ahead(k1, h / 2.0);
  const auto k2 = k_of(p2[0], p2[1]);
  const auto p3 = ahead(k2, h / 2.0);
  const auto k3 = k_of(p3[0], p3[1]);
  const auto p4 = ahead(k3, h);
  const auto k4 = k_of(p4[0], p4[1]);
  std::vector<Slot> out;
  for (std::size_t i = 0; i < 2; ++i) {
    Slot sum = t.binary(add, k1[i], k4[i]);
    sum = t.binary(add, sum, t.binary(multiply, t.constant(2.0), t.binary(add, k2[i], k3[i])));
    out.push_back(t.binary(add, t.input(i), t.binary(multiply, t.constant(h / 6.0), sum)));
  }
  return t.finish(out);
}

// The chain rule over the stages gives what differentiating the whole step gives, with fewer
// operations.
TEST(Lagrangian, OfARungeKuttaStep) {
  const double h = 0.3;
  constexpr ButcherTableau<4> classical{.A = {{{0.0, 0.0, 0.0, 0.0},
                                               {0.5, 0.0, 0.0, 0.0},
                                               {0.0, 0.5, 0.0, 0.0},
                                               {0.0, 0.0, 1.0, 0.0}}},
                                        .b = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0},
                                        .c = {0.0, 0.5, 0.5, 1.0},
                                        .order = 4};
  const Lagrangian by_stages = runge_kutta_step(lagrangian(oscillator(), 3), classical, h);
  const Lagrangian whole = lagrangian(whole_step(h), 3);
  const std::vector<double> point{0.4, -1.3, 0.8};
  const Evaluated a = evaluate(by_stages, point, {1.7, -0.6}, 0.7);
  const Evaluated b = evaluate(whole, point, {1.7, -0.6}, 0.7);
  EXPECT_LT((a.y - b.y).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((a.J - b.J).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((a.H - b.H).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT(by_stages.tape.size(), whole.tape.size());
  const std::vector<double> alone = at(values_of(by_stages), point, 0.7);
  EXPECT_NEAR(alone[1], b.y(1), 1e-15);
}

TEST(Lagrangian, Stacked) {
  const Lagrangian one = lagrangian(oscillator(), 3);
  TapeBuilder t(3);
  const Slot square = t.binary(multiply, t.input(2), t.input(2));
  const std::array both{one, lagrangian(t.finish({&square, 1}), 3)};
  const Lagrangian f = stack(both);
  ASSERT_EQ(f.rows, 3U);
  const std::vector<double> point{0.4, -1.3, 0.8};
  const Evaluated a = evaluate(f, point, {1.0, 2.0, 5.0}, 0.7);
  const Evaluated b = evaluate(one, point, {1.0, 2.0}, 0.7);
  EXPECT_NEAR(a.y(2), 0.64, 1e-15);
  EXPECT_NEAR(a.J(2, 2), 1.6, 1e-15);
  EXPECT_NEAR(a.H(2, 2), b.H(2, 2) + 10.0, 1e-13);
  EXPECT_LT((a.H - b.H).topRows(2).cwiseAbs().maxCoeff(), 1e-15);
}

}  // namespace
}  // namespace lane_tape_test
