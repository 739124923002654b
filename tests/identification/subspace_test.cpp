#include <flyball/identification/subspace.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>

#include "identification/subspace_data.hpp"
#include "support/oracle.hpp"

namespace flyball::identification::subspace_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const Time T(0.01);
constexpr SubspaceWeighting weightings[] = {SubspaceWeighting::cva, SubspaceWeighting::moesp,
                                            SubspaceWeighting::n4sid};

MatrixXd noise(Random& random, Index rows, Index columns, double deviation = 1.0) {
  MatrixXd M(rows, columns);
  for (Index i = 0; i < M.size(); ++i) {
    M(i) = random.normal(0.0, deviation);
  }
  return M;
}

/// A stable system with poles of size 0.5 to 0.95.
InnovationsModel random_model(Random& random, Index n, Index m, Index p) {
  InnovationsModel model;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; i += 2) {
    const double size = random.uniform(0.5, 0.95);
    if (i + 1 < n) {
      const double angle = random.uniform(0.2, 2.5);
      A.block(i, i, 2, 2) << size * std::cos(angle), size * std::sin(angle),
          -size * std::sin(angle), size * std::cos(angle);
    } else {
      A(i, i) = size;
    }
  }
  const MatrixXd V = noise(random, n, n) + 2.0 * MatrixXd::Identity(n, n);
  model.system = {V * A * test::inverse(V), noise(random, n, m), noise(random, p, n),
                  noise(random, p, m), T};
  model.K = 0.1 * noise(random, n, p);
  // Else e is not what a predictor leaves.
  while (test::eigenvalues(model.system.A - model.K * model.system.C).cwiseAbs().maxCoeff() >
         0.98) {
    model.K *= 0.5;
  }
  model.noise = MatrixXd::Identity(p, p);
  model.x0 = noise(random, n, 1);
  return model;
}

MatrixXd record(const InnovationsModel& model, const MatrixXd& u, const MatrixXd& e) {
  MatrixXd y(u.rows(), model.system.C.rows());
  VectorXd x = model.x0;
  for (Index k = 0; k < u.rows(); ++k) {
    y.row(k) = model.system.C * x + model.system.D * u.row(k).transpose() + e.row(k).transpose();
    x = (model.system.A * x + model.system.B * u.row(k).transpose() +
         model.K * e.row(k).transpose())
            .eval();
  }
  return y;
}

/// D, CB, CAB, …: what does not depend on the choice of states.
MatrixXd markov(const DiscreteSystem<>& system, int count) {
  MatrixXd all(system.C.rows(), count * system.B.cols());
  MatrixXd power = system.B;
  all.leftCols(system.B.cols()) = system.D;
  for (int i = 1; i < count; ++i) {
    all.middleCols(i * system.B.cols(), system.B.cols()) = system.C * power;
    power = system.A * power;
  }
  return all;
}

VectorXd simulation_fit(const InnovationsModel& model, const MatrixXd& u, const MatrixXd& y) {
  return fit_of(y, simulate(model, u).value()).value();
}

// H Hᵀ = L Lᵀ, whichever way L was made.
TEST(Subspace, Compression) {
  Random random(1);
  for (const bool exact : {false, true}) {
    const MatrixXd u = noise(random, 400, 2);
    MatrixXd y = noise(random, 400, 1);
    if (exact) {
      y = u.col(0) + u.col(1);  // Only reflections can factor it.
    }
    const Index s = 4;
    const ScaledSignals record = scaled(u, y);
    const PastAndFuture data = compress(record, s);
    EXPECT_EQ(data.future.size(), exact ? 0 : s * s);
    ASSERT_EQ(data.columns, 400 - 2 * s + 1);
    MatrixXd H(2 * s * 3, data.columns);
    for (Index t = 0; t < data.columns; ++t) {
      VectorXd column(2 * s * 3);
      for (Index i = 0; i < s; ++i) {
        column.segment(2 * i, 2) = record.u().row(t + s + i);
        column.segment(2 * s + 2 * i, 2) = record.u().row(t + i);
        column(4 * s + i) = record.y()(t + i, 0);
        column(5 * s + i) = record.y()(t + s + i, 0);
      }
      H.col(t) = column;
    }
    EXPECT_LT((data.L * data.L.transpose() - H * H.transpose()).norm(), 1e-12 * H.squaredNorm());
    EXPECT_EQ(MatrixXd(data.L.triangularView<Eigen::StrictlyUpper>()).norm(), 0.0);
  }
}

// Without noise every weighting finds order and system to rounding, badly scaled signals included.
TEST(Subspace, IsExactWithoutNoise) {
  Random random(2);
  for (int trial = 0; trial < 30; ++trial) {
    const Index n = 1 + trial % 6;
    const Index m = 1 + trial % 3;
    const Index p = 1 + (trial / 2) % 3;
    const InnovationsModel truth = random_model(random, n, m, p);
    MatrixXd u = noise(random, 600, m);
    u.col(0) *= trial % 2 == 0 ? 1.0 : 1e7;
    MatrixXd y = record(truth, u, MatrixXd::Zero(600, p));
    y.col(p - 1) *= trial % 2 == 0 ? 1.0 : 1e-6;
    DiscreteSystem<> scaled = truth.system;
    if (trial % 2 != 0) {
      scaled.C.row(p - 1) *= 1e-6;
      scaled.D.row(p - 1) *= 1e-6;
    }
    const MatrixXd expected = markov(scaled, 20);
    for (const SubspaceWeighting weighting : weightings) {
      SubspaceOptions options;
      options.weighting = weighting;
      const auto fit = fit_subspace(u, y, T, options);
      ASSERT_TRUE(fit) << to_string(fit.error());
      EXPECT_EQ(fit->order, n) << trial;
      if (fit->order != n) {
        continue;
      }
      const MatrixXd found = markov(fit->model.system, 20);
      for (Index i = 0; i < p; ++i) {
        EXPECT_LT((found.row(i) - expected.row(i)).norm(), 1e-6 * expected.row(i).norm()) << trial;
      }
      EXPECT_GT(simulation_fit(fit->model, u, y).minCoeff(), 1.0 - 1e-7) << trial;
      // The free run starts at x0.
      EXPECT_LT((simulate(fit->model, u).value().row(0) - y.row(0)).norm(),
                1e-6 * y.colwise().norm().norm());
    }
  }
}

// With noise: the order by its criterion, the prediction as good as the truth's own.
TEST(Subspace, PredictsAsWellAsTheTruth) {
  Random random(3);
  int right = 0;
  constexpr int trials = 30;
  for (int trial = 0; trial < trials; ++trial) {
    const Index n = 2 + trial % 3;
    const Index m = 1 + trial % 2;
    const Index p = 1 + (trial / 2) % 2;
    const InnovationsModel truth = random_model(random, n, m, p);
    const MatrixXd u = noise(random, 3000, m);
    const MatrixXd e = noise(random, 3000, p, 0.3);
    const MatrixXd y = record(truth, u, e);
    const VectorXd own = fit_of(y, y - e).value();
    for (const SubspaceWeighting weighting : weightings) {
      SubspaceOptions options;
      options.order = n;
      options.weighting = weighting;
      const SubspaceFit fit = fit_subspace(u, y, T, options).value();
      EXPECT_TRUE(fit.noise_determined);
      const VectorXd ahead = fit_of(y, predict(fit.model, u, y).value()).value();
      EXPECT_GT((ahead - own).minCoeff(), -0.03) << trial;
      EXPECT_NEAR(fit.model.noise(0, 0), 0.09, 0.04) << trial;
    }
    right += fit_subspace(u, y, T)->order == n ? 1 : 0;
  }
  EXPECT_GE(right, trials - 6);
}

TEST(Subspace, Options) {
  Random random(4);
  InnovationsModel truth = random_model(random, 2, 1, 1);
  truth.system.D.setZero();
  truth.x0.setZero();
  const MatrixXd u = noise(random, 500, 1);
  const MatrixXd y = record(truth, u, noise(random, 500, 1, 0.1));
  SubspaceOptions options;
  options.order = 2;
  options.feedthrough = false;
  options.initial_state = false;
  const SubspaceFit fit = fit_subspace(u, y, T, options).value();
  EXPECT_EQ(fit.model.system.D(0, 0), 0.0);
  EXPECT_EQ(fit.model.x0.norm(), 0.0);
  EXPECT_GT(simulation_fit(fit.model, u, y)(0), 0.8);

  // An unstable plant in its loop: u = -0.5 y + r. Found as it is, or made stable on request.
  InnovationsModel growing;
  growing.system = {MatrixXd::Constant(1, 1, 1.1), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 1),
                    MatrixXd::Zero(1, 1), T};
  MatrixXd in(800, 1);
  MatrixXd out(800, 1);
  double x = 0.0;
  for (Index k = 0; k < 800; ++k) {
    out(k) = x + random.normal(0.0, 0.05);
    in(k) = -0.5 * out(k) + random.normal();
    x = 1.1 * x + in(k);
  }
  SubspaceOptions one;
  one.order = 1;
  const SubspaceFit found = fit_subspace(in, out, T, one).value();
  EXPECT_NEAR(found.model.system.A(0, 0), 1.1, 0.02);
  EXPECT_FALSE(found.stabilized);
  one.stable = true;
  EXPECT_NEAR(fit_subspace(in, out, T, one)->model.system.A(0, 0), 1.0 / 1.1, 0.02);
}

// A pole at 0.9995 comes out beyond the circle of some records: it is put back, and predicts as
// well as the truth.
TEST(Subspace, StablePlantsStayStable) {
  Random random(6);
  int stabilized = 0;
  for (int trial = 0; trial < 40; ++trial) {
    InnovationsModel truth;
    truth.system = {MatrixXd::Constant(1, 1, 0.9995), MatrixXd::Constant(1, 1, 0.1),
                    MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 1), T};
    truth.K = MatrixXd::Constant(1, 1, 0.05);
    truth.x0 = VectorXd::Zero(1);
    const MatrixXd u = noise(random, 400, 1);
    const MatrixXd y = record(truth, u, noise(random, 400, 1, 0.5));
    SubspaceOptions one;
    one.order = 1;
    const SubspaceFit fit = fit_subspace(u, y, T, one).value();
    EXPECT_LT(fit.model.system.A(0, 0), 1.0) << trial;
    stabilized += fit.stabilized ? 1 : 0;
    if (fit.stabilized) {
      EXPECT_GT(fit.model.system.A(0, 0), 0.97) << trial;
      const auto ahead = [&](const InnovationsModel& model) {
        return fit_of(y, predict(model, u, y).value()).value()(0);
      };
      EXPECT_GT(ahead(fit.model), ahead(truth) - 0.02) << trial;
    }
  }
  EXPECT_GE(stabilized, 3);
}

// The normal equations find what the reflections find; where inputs are too nearly the same for
// them, and without noise, the reflections do.
TEST(Subspace, RegressionOfTheInputs) {
  Random random(8);
  InnovationsModel model = random_model(random, 3, 2, 2);
  MatrixXd u = noise(random, 700, 2);
  const auto regress = [&](bool noisy, bool direct) {
    const MatrixXd y = record(model, u, MatrixXd(0.1 * u.rowwise().reverse().cwiseAbs2()));
    ScaledSignals signals{MatrixXd::Zero(700 + detail::record_margin, 4), 2, VectorXd::Ones(4)};
    signals.w.topRows(700) << u, y;
    SubspaceOptions options;
    options.feedthrough = direct;
    options.initial_state = direct;
    return regress_inputs(signals, model, MatrixXd::Identity(2, 2), options, noisy).value();
  };
  for (const bool direct : {true, false}) {
    const VectorXd by_reflections = regress(false, direct);
    ASSERT_EQ(by_reflections.size(), direct ? 3 + 6 + 4 : 6);
    const VectorXd by_products = regress(true, direct);
    EXPECT_LT((by_products - by_reflections).norm(), 1e-10 * by_reflections.norm());
    EXPECT_NE(by_products, by_reflections);
  }
  u.col(1) = u.col(0) + 1e-6 * u.col(1);
  EXPECT_EQ(regress(true, true), regress(false, true));
}

// The errors one sample ahead by the kernel are those of the definition, of few states and many.
TEST(Subspace, PredictionSquares) {
  Random random(9);
  for (const Index n : {1, 4, 9, 14}) {
    InnovationsModel model = random_model(random, n, 2, 3);
    const MatrixXd u = noise(random, 300, 2);
    const MatrixXd y = record(model, u, noise(random, 300, 3));
    ScaledSignals signals{MatrixXd::Zero(300 + detail::record_margin, 5), 2, VectorXd::Ones(5)};
    signals.w.topRows(300) << u, y;
    const MatrixXd errors = y - predict(model, u, y).value();
    const MatrixXd expected = errors.transpose() * errors;
    EXPECT_LT((prediction_squares(signals, model) - expected).norm(), 1e-10 * expected.norm()) << n;
  }
}

TEST(Subspace, Refusals) {
  Random random(5);
  const MatrixXd u = noise(random, 200, 1);
  const MatrixXd y = noise(random, 200, 1);
  EXPECT_TRUE(fit_subspace(u, y.topRows(10), T).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(fit_subspace(u, MatrixXd(200, 0), T).error().is(ArgumentError::empty));
  SubspaceOptions options;
  options.order = 0;
  EXPECT_EQ(to_string(fit_subspace(u, y, T, options).error()),
            "fit_subspace: order is 0; it must be from 1 to 200");
  SubspaceOptions one_row;
  one_row.block_rows = 1;
  EXPECT_EQ(to_string(fit_subspace(u, y, T, one_row).error()),
            "fit_subspace: block_rows is 1; it must be from 2 to 200");
  options.order = 60;
  EXPECT_TRUE(fit_subspace(u, y, T, options).error().is(IdentificationError::too_short));
  options.order = 5;
  options.block_rows = 3;
  EXPECT_TRUE(fit_subspace(u, y, T, options).error().is(IdentificationError::too_short));
  EXPECT_TRUE(fit_subspace(MatrixXd::Ones(200, 1), y, T).error().is(IdentificationError::singular));
}

}  // namespace
}  // namespace flyball::identification::subspace_test
