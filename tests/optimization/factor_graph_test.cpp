#include <flyball/optimization/factor_graph.hpp>

#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/oracle.hpp"

namespace flyball::optimization::factor_graph_test {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

using One = Eigen::Matrix<double, 1, 1>;

/// W (x - z): where a point is.
template <int N>
struct Seen {
  Eigen::Matrix<double, N, 1> z;
  Eigen::Matrix<double, N, N> W;

  template <class X>
  auto operator()(const X& x) const {
    using Scalar = typename X::Scalar;
    Eigen::Matrix<Scalar, N, 1> r;
    for (int i = 0; i < N; ++i) {
      r(i) = Scalar(0.0);
      for (int j = 0; j < N; ++j) {
        r(i) += W(i, j) * (x(j) - z(j));
      }
    }
    return r;
  }
};

/// W (M x + N y - z) of two points.
struct Pair {
  Matrix2d M;
  Eigen::Matrix<double, 2, 3> N;
  Vector2d z;

  template <class X, class Y>
  auto operator()(const X& x, const Y& y) const {
    using Scalar = typename X::Scalar;
    Eigen::Matrix<Scalar, 2, 1> r;
    for (int i = 0; i < 2; ++i) {
      r(i) = Scalar(-z(i));
      for (int j = 0; j < 2; ++j) {
        r(i) += M(i, j) * x(j);
      }
      for (int j = 0; j < 3; ++j) {
        r(i) += N(i, j) * y(j);
      }
    }
    return r;
  }
};

Seen<1> at(double z, double weight = 1.0) {
  return {One(z), One(weight)};
}

TEST(FactorGraph, LinearResidualsGiveTheLeastSquaresSolutionAndItsCovariance) {
  Random random(1);
  const auto draw = [&](auto matrix) {
    return decltype(matrix)::NullaryExpr([&] { return random.normal(); }).eval();
  };
  for (int trial = 0; trial < 50; ++trial) {
    FactorGraph<Vector2d, Vector3d> graph;
    std::vector<Variable<Vector2d>> a;
    std::vector<Variable<Vector3d>> b;
    for (int i = 0; i < 4; ++i) {
      a.push_back(graph.add(draw(Vector2d())));
      b.push_back(graph.add(draw(Vector3d())));
    }
    // Variables in the order of addition: a0 b0 a1 b1 …, five entries a pair.
    std::vector<MatrixXd> rows;
    std::vector<VectorXd> sides;
    const auto note = [&](Index first, const MatrixXd& left, Index second, const MatrixXd& right,
                          const VectorXd& side) {
      MatrixXd row = MatrixXd::Zero(left.rows(), 20);
      row.middleCols(first, left.cols()) = left;
      if (second >= 0) {
        row.middleCols(second, right.cols()) = right;
      }
      rows.push_back(row);
      sides.push_back(side);
    };
    for (int i = 0; i < 4; ++i) {
      const Seen<2> seen_a{draw(Vector2d()), draw(Matrix2d())};
      const Seen<3> seen_b{draw(Vector3d()), draw(Eigen::Matrix3d())};
      graph.add_factor(seen_a, a[static_cast<std::size_t>(i)]);
      graph.add_factor(seen_b, b[static_cast<std::size_t>(i)]);
      note(5 * i, seen_a.W, -1, {}, seen_a.W * seen_a.z);
      note(5 * i + 2, seen_b.W, -1, {}, seen_b.W * seen_b.z);
      for (int j = 0; j < 4; ++j) {
        if (random.uniform() < 0.5) {
          const Pair pair{draw(Matrix2d()), draw(Eigen::Matrix<double, 2, 3>()), draw(Vector2d())};
          graph.add_factor(pair, a[static_cast<std::size_t>(i)], b[static_cast<std::size_t>(j)]);
          note(5 * i, pair.M, 5 * j + 2, pair.N, pair.z);
        }
      }
    }
    Index count = 0;
    for (const auto& side : sides) {
      count += side.size();
    }
    MatrixXd A(count, 20);
    VectorXd z(count);
    Index at_row = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      A.middleRows(at_row, rows[k].rows()) = rows[k];
      z.segment(at_row, sides[k].size()) = sides[k];
      at_row += rows[k].rows();
    }
    const VectorXd x = test::least_squares(A, z);
    const auto result = graph.solve();
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_TRUE(result->converged);
    EXPECT_NEAR(result->cost, (A * x - z).squaredNorm(), 1e-9 * (1.0 + result->cost));
    const MatrixXd P = test::inverse(MatrixXd(A.transpose() * A));
    const auto covariances = graph.covariances();
    ASSERT_TRUE(covariances) << to_string(covariances.error());
    const VectorXd sizes = test::singular_values(A);
    const double condition = sizes(0) / sizes.tail(1)(0);
    const double tolerance = 1e-14 * condition * condition * (1.0 + x.norm());
    for (int i = 0; i < 4; ++i) {
      const auto k = static_cast<std::size_t>(i);
      EXPECT_LE((graph[a[k]] - x.segment<2>(5 * i)).norm(), tolerance);
      EXPECT_LE((graph[b[k]] - x.segment<3>(5 * i + 2)).norm(), tolerance);
      EXPECT_LE(((*covariances)[2 * k] - P.block(5 * i, 5 * i, 2, 2)).norm(),
                1e-13 * condition * condition * P.norm());
      EXPECT_LE(((*covariances)[2 * k + 1] - P.block(5 * i + 2, 5 * i + 2, 3, 3)).norm(),
                1e-13 * condition * condition * P.norm());
    }
  }
}

// Three sensors say 0 and one says 10: the slopes of Huber's loss, 2x three times and -2 once,
// cancel at x = 1/3; where the square alone would say 2.5.
TEST(FactorGraph, AnOutlierPullsAsItsLossSays) {
  FactorGraph<One> graph;
  const auto x = graph.add(One(5.0));
  for (const double z : {0.0, 0.0, 0.0}) {
    graph.add_factor(at(z), RobustLoss{Loss::huber, 1.0}, x);
  }
  graph.add_factor(at(10.0), RobustLoss{Loss::huber, 1.0}, x);
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(graph[x](0), 1.0 / 3.0, 1e-7);
  // 3 (1/3)² + 2 (10 - 1/3) - 1
  EXPECT_NEAR(result->cost, 1.0 / 3.0 + 2.0 * (10.0 - 1.0 / 3.0) - 1.0, 1e-9);
}

TEST(FactorGraph, AFixedVariableStays) {
  FactorGraph<Vector2d> graph;
  const auto anchor = graph.add(Vector2d(1.0, 2.0));
  const auto x = graph.add(Vector2d(0.0, 0.0));
  graph.fix(anchor);
  graph.add_factor(
      [](const auto& from, const auto& to) {
        return Eigen::Matrix<typename std::decay_t<decltype(to)>::Scalar, 2, 1>(
            {to(0) - from(0) - 3.0, 2.0 * (to(1) - from(1) - 4.0)});
      },
      anchor, x);
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(graph[anchor], Vector2d(1.0, 2.0));
  EXPECT_LE((graph[x] - Vector2d(4.0, 6.0)).norm(), 1e-12);
  EXPECT_EQ(result->unknowns, 2);
  const auto covariances = graph.covariances();
  ASSERT_TRUE(covariances) << to_string(covariances.error());
  EXPECT_EQ(covariances->front().size(), 0);
  EXPECT_LE(((*covariances)[1] - Vector2d(1.0, 0.25).asDiagonal().toDenseMatrix()).norm(), 1e-15);
}

// Gauss and Newton's step from 2 leads to -3.5, farther off each time; the damped one does not.
TEST(FactorGraph, AStepThatRaisesTheCostIsDamped) {
  FactorGraph<One> graph;
  const auto x = graph.add(One(2.0));
  graph.add_factor(
      [](const auto& v) {
        using std::atan2;
        return Eigen::Matrix<typename std::decay_t<decltype(v)>::Scalar, 1, 1>(atan2(v(0), 1.0));
      },
      x);
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_TRUE(result->converged);
  EXPECT_NEAR(graph[x](0), 0.0, 1e-8);
  EXPECT_GT(result->iterations, 2);
}

TEST(FactorGraph, AVariableMayStandTwiceInAFactor) {
  FactorGraph<One> graph;
  const auto x = graph.add(One(3.0));
  graph.add_factor(
      [](const auto& u, const auto& v) {
        return Eigen::Matrix<typename std::decay_t<decltype(u)>::Scalar, 1, 1>(u(0) + v(0) - 2.0);
      },
      x, x);
  const auto result = graph.solve();
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_NEAR(graph[x](0), 1.0, 1e-12);
  const auto covariances = graph.covariances();
  ASSERT_TRUE(covariances);
  EXPECT_NEAR(covariances->front()(0, 0), 0.25, 1e-15);
}

TEST(FactorGraph, TheOrderOfVariablesDoesNotMatter) {
  const auto chain = [](bool reversed) {
    FactorGraph<One> graph;
    std::vector<Variable<One>> x(30);
    for (std::size_t i = 0; i < 30; ++i) {
      x[reversed ? 29 - i : i] = graph.add(One(0.0));
    }
    graph.add_factor(at(1.0, 3.0), x[0]);
    graph.add_factor(at(50.0, 2.0), x[29]);
    for (std::size_t i = 1; i < 30; ++i) {
      graph.add_factor(
          [i](const auto& u, const auto& v) {
            using std::sin;
            return Eigen::Matrix<typename std::decay_t<decltype(u)>::Scalar, 1, 1>(
                v(0) - u(0) - 0.1 * static_cast<double>(i) + 0.2 * sin(u(0)));
          },
          x[i - 1], x[i]);
    }
    EXPECT_TRUE(graph.solve()->converged);
    std::vector<double> values;
    for (const auto v : x) {
      values.push_back(graph[v](0));
    }
    return values;
  };
  const auto forward = chain(false);
  const auto backward = chain(true);
  for (std::size_t i = 0; i < forward.size(); ++i) {
    EXPECT_NEAR(forward[i], backward[i], 1e-6);
  }
}

TEST(FactorGraph, AVariableThatNothingHoldsIsNamed) {
  FactorGraph<Vector2d> graph;
  const auto a = graph.add(Vector2d(0.0, 0.0));
  const auto b = graph.add(Vector2d(1.0, 0.0));
  graph.add_factor(
      [](const auto& from, const auto& to) {
        return Eigen::Matrix<typename std::decay_t<decltype(to)>::Scalar, 2, 1>(to - from);
      },
      a, b);
  const auto free = graph.solve();
  ASSERT_FALSE(free);
  EXPECT_TRUE(free.error().is(FactorGraphError::not_determined));
  EXPECT_FALSE(graph.covariances());
  EXPECT_EQ(graph[b], Vector2d(1.0, 0.0));

  graph.fix(a);
  const auto lone = graph.add(Vector2d(7.0, 7.0));
  const auto missing = graph.solve();
  ASSERT_FALSE(missing);
  EXPECT_TRUE(missing.error().is(FactorGraphError::not_determined));
  EXPECT_NE(to_string(missing.error()).find("variable 2"), std::string::npos)
      << to_string(missing.error());
  graph.fix(lone);
  EXPECT_TRUE(graph.solve());
}

TEST(FactorGraph, WhatCannotBeSolvedIsRefused) {
  FactorGraph<One> graph;
  EXPECT_TRUE(graph.solve().error().is(FactorGraphError::no_factors));
  const auto x = graph.add(One(std::numeric_limits<double>::quiet_NaN()));
  graph.add_factor(at(0.0), x);
  const auto refused = graph.solve();
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(FactorGraphError::no_start));
  graph.set(x, One(1.0));
  EXPECT_TRUE(graph.solve());
  EXPECT_FALSE(graph.solve({.max_iterations = -1}));
  EXPECT_FALSE(graph.solve({.tolerance = 0.0}));
  graph.add_factor(at(0.0), Variable<One>{5});
  EXPECT_TRUE(graph.solve().error().is(ArgumentError::out_of_range));
}

// A variable that no `add` returned, and one of another kind: no memory of theirs is read.
TEST(FactorGraph, VariablesOfNoGraphAreRefused) {
  for (const Variable<One> stranger : {Variable<One>{}, Variable<One>{0}, Variable<One>{7}}) {
    FactorGraph<One, Vector2d> graph;
    const auto pair = graph.add(Vector2d(1.0, 2.0));
    graph.add_factor(at(0.0), stranger);
    graph.fix(stranger);
    graph.set(stranger, One(3.0));
    EXPECT_TRUE(std::isnan(graph.cost()));
    EXPECT_TRUE(graph.solve().error().is(ArgumentError::out_of_range));
    EXPECT_TRUE(graph.covariances().error().is(ArgumentError::out_of_range));
    EXPECT_EQ(graph[pair], Vector2d(1.0, 2.0));
  }
}

TEST(FactorGraph, TheCapIsKept) {
  FactorGraph<One> graph;
  const auto x = graph.add(One(2.0));
  graph.add_factor(
      [](const auto& v) {
        using std::atan2;
        return Eigen::Matrix<typename std::decay_t<decltype(v)>::Scalar, 1, 1>(atan2(v(0), 1.0));
      },
      x);
  const auto result = graph.solve({.max_iterations = 1});
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->converged);
  EXPECT_EQ(result->stop, FactorGraphStop::iteration_limit);
  EXPECT_LE(result->cost, result->start_cost);
}

}  // namespace
}  // namespace flyball::optimization::factor_graph_test
