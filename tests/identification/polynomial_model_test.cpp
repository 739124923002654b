#include <flyball/identification/polynomial_model.hpp>

#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>

#include "support/oracle.hpp"

namespace flyball::identification::polynomial_model_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const Time T(0.02);

MatrixXd noise(Index rows, Index columns, std::uint64_t seed, double deviation = 1.0) {
  Random random(seed);
  MatrixXd M(rows, columns);
  for (Index i = 0; i < M.size(); ++i) {
    M(i) = random.normal(0.0, deviation);
  }
  return M;
}

VectorXd polynomial(std::initializer_list<double> coefficients) {
  return Eigen::Map<const VectorXd>(coefficients.begin(), static_cast<Index>(coefficients.size()));
}

/// y of the difference equation, by the definition: v = B/F u and w = C/D e each from rest.
VectorXd response(const PolynomialModel& model, const MatrixXd& u, const VectorXd& e) {
  const auto divide = [](const VectorXd& b, const VectorXd& a, const VectorXd& x) {
    VectorXd y = VectorXd::Zero(x.size());
    for (Index k = 0; k < x.size(); ++k) {
      for (Index i = 0; i < b.size() && i <= k; ++i) {
        y(k) += b(i) * x(k - i);
      }
      for (Index i = 1; i < a.size() && i <= k; ++i) {
        y(k) -= a(i) * y(k - i);
      }
    }
    return y;
  };
  VectorXd right = divide(model.C, model.D, e);
  for (std::size_t j = 0; j < model.B.size(); ++j) {
    right += divide(model.B[j], model.F[j], u.col(static_cast<Index>(j)));
  }
  return divide(VectorXd::Ones(1), model.A, right);
}

PolynomialModel second_order() {
  PolynomialModel model;
  model.A = polynomial({1.0, -1.5, 0.7});
  model.B = {polynomial({0.0, 1.0, 0.5})};
  model.F = {VectorXd::Ones(1)};
  model.period = T;
  return model;
}

// Without noise the difference equation is found to rounding.
TEST(Arx, IsExactWithoutNoise) {
  const PolynomialModel truth = second_order();
  const MatrixXd u = noise(60, 1, 1);
  const VectorXd y = response(truth, u, VectorXd::Zero(60));
  const PolynomialFit fit = fit_arx(u, y, T, {.a = 2, .b = 2}).value();
  EXPECT_LT((fit.model.A - truth.A).norm(), 1e-12);
  EXPECT_LT((fit.model.B[0] - truth.B[0]).norm(), 1e-12);
  EXPECT_NEAR(fit.prediction_fit, 1.0, 1e-12);
  EXPECT_NEAR(fit.simulation_fit, 1.0, 1e-12);
}

// θ̂ = (ΦᵀΦ)⁻¹Φᵀy and its covariance, written out.
TEST(Arx, IsTheRegression) {
  PolynomialModel truth = second_order();
  const MatrixXd u = noise(300, 1, 2, 1e3);
  const VectorXd y = 1e-6 * response(truth, u, noise(300, 1, 3, 400.0));
  const PolynomialFit fit = fit_arx(u, y, T, {.a = 2, .b = 3, .delay = 0}).value();
  MatrixXd Phi(298, 5);
  for (Index k = 2; k < 300; ++k) {
    Phi.row(k - 2) << -y(k - 1), -y(k - 2), u(k, 0), u(k - 1, 0), u(k - 2, 0);
  }
  const MatrixXd information = Phi.transpose() * Phi;
  const VectorXd theta = test::solve(information, MatrixXd(Phi.transpose() * y.tail(298)));
  const VectorXd e = y.tail(298) - Phi * theta;
  const MatrixXd covariance = e.squaredNorm() / 293.0 * test::inverse(information);
  for (Index i = 0; i < 5; ++i) {
    EXPECT_NEAR(fit.parameters(i), theta(i), 1e-9 * std::abs(theta(i)) + 1e-18);
    EXPECT_NEAR(fit.standard_errors(i), std::sqrt(covariance(i, i)),
                1e-7 * std::sqrt(covariance(i, i)));
  }
  EXPECT_NEAR(fit.model.noise, e.squaredNorm() / 293.0, 1e-9 * fit.model.noise);
  EXPECT_LT((fit.residuals - e).norm(), 1e-10 * e.norm());
  EXPECT_NEAR(fit.aic, 298.0 * std::log(e.squaredNorm() / 298.0) + 10.0, 1e-6);
  EXPECT_NEAR(fit.bic - fit.aic, 5.0 * (std::log(298.0) - 2.0), 1e-9);
  EXPECT_LT(fit.whiteness, 1.2);
}

// Octave 7.3, control 3.4.0 (its delay 0 is ours of 1):
//   pkg load control; k = (0:199)'; y = zeros(200, 1); e = 0.2*sin(0.7*k.^2 + 1);
//   u = sign(sin(0.37*k) + 0.3*sin(1.9*k)).*(1 + 0.5*cos(0.11*k));
//   for i = 3:200; y(i) = 1.5*y(i-1) - 0.7*y(i-2) + u(i-1) + 0.5*u(i-2) + e(i); end
//   s = arx(iddata(y, u, 0.02), "na", 2, "nb", 2, "nk", 0); [b, a] = tfdata(s(1, 1), "v")
TEST(Arx, AgreesWithOctave) {
  VectorXd u(200);
  VectorXd y = VectorXd::Zero(200);
  for (Index k = 0; k < 200; ++k) {
    const auto t = static_cast<double>(k);
    const double wave = std::sin(0.37 * t) + 0.3 * std::sin(1.9 * t);
    u(k) = wave == 0.0 ? 0.0 : std::copysign(1.0 + 0.5 * std::cos(0.11 * t), wave);
    if (k >= 2) {
      y(k) = 1.5 * y(k - 1) - 0.7 * y(k - 2) + u(k - 1) + 0.5 * u(k - 2) +
             0.2 * std::sin(0.7 * t * t + 1.0);
    }
  }
  const PolynomialFit fit = fit_arx(u, y, T, {.a = 2, .b = 2}).value();
  EXPECT_LT((fit.model.A - polynomial({1.0, -1.48583543039, 0.689467423551})).norm(), 1e-10);
  EXPECT_LT((fit.model.B[0] - polynomial({0.0, 1.01315927261, 0.532910368308})).norm(), 1e-10);
}

TEST(Arx, ChoosesItsOrders) {
  PolynomialModel truth = second_order();
  truth.B = {polynomial({0.0, 0.0, 0.0, 1.0, 0.5})};
  int right = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const MatrixXd u = noise(500, 1, 100 + seed);
    const VectorXd y = response(truth, u, noise(500, 1, 200 + seed, 0.3));
    const PolynomialFit fit = select_arx(u, y, T, {.a = 4, .b = 4, .delay = 4}).value();
    right += fit.orders == PolynomialOrders{.a = 2, .b = 2, .delay = 3} ? 1 : 0;
    // AIC takes no fewer parameters than BIC.
    const PolynomialFit rich =
        select_arx(u, y, T, {.a = 4, .b = 4, .delay = 4}, OrderCriterion::aic).value();
    EXPECT_GE(rich.parameters.size(), fit.parameters.size());
  }
  EXPECT_GE(right, 18);
}

TEST(Arx, TwoInputs) {
  PolynomialModel truth = second_order();
  truth.B = {polynomial({0.0, 1.0, 0.5}), polynomial({0.0, -0.3, 0.8})};
  truth.F = {VectorXd::Ones(1), VectorXd::Ones(1)};
  MatrixXd u = noise(400, 2, 9);
  u.col(1) *= 1e4;
  const VectorXd y = response(truth, u, VectorXd::Zero(400));
  const PolynomialFit fit = fit_arx(u, y, T, {.a = 2, .b = 2}).value();
  EXPECT_LT((fit.model.B[0] - truth.B[0]).norm(), 1e-8);
  EXPECT_LT((fit.model.B[1] - truth.B[1]).norm(), 1e-12);
}

struct Truth {
  const char* name;
  PolynomialModel model;
  PolynomialOrders orders;
};

std::vector<Truth> family() {
  PolynomialModel armax = second_order();
  armax.C = polynomial({1.0, 0.6, 0.2});
  PolynomialModel output_error = second_order();
  output_error.A = VectorXd::Ones(1);
  output_error.F = {polynomial({1.0, -1.5, 0.7})};
  PolynomialModel box_jenkins = output_error;
  box_jenkins.C = polynomial({1.0, 0.5});
  box_jenkins.D = polynomial({1.0, -0.8});
  PolynomialModel everything = second_order();
  everything.A = polynomial({1.0, -0.9});
  everything.F = {polynomial({1.0, 0.5})};
  everything.C = polynomial({1.0, 0.7});
  return {{"ARMAX", armax, {.a = 2, .b = 2, .c = 2}},
          {"output error", output_error, {.b = 2, .f = 2}},
          {"Box-Jenkins", box_jenkins, {.b = 2, .c = 1, .d = 1, .f = 2}},
          {"A, B, C and F", everything, {.a = 1, .b = 2, .c = 1, .f = 1}}};
}

VectorXd parameters_of(const PolynomialModel& model) {
  std::vector<double> all;
  const auto put = [&](const VectorXd& polynomial, Index first) {
    all.insert(all.end(), polynomial.data() + first, polynomial.data() + polynomial.size());
  };
  put(model.A, 1);
  put(model.B[0], 1);
  put(model.C, 1);
  put(model.D, 1);
  put(model.F[0], 1);
  return Eigen::Map<const VectorXd>(all.data(), static_cast<Index>(all.size()));
}

// The truth is within its intervals as often as they say; the noise is found, and white.
TEST(PredictionError, FindsTheFamily) {
  for (const Truth& truth : family()) {
    if (truth.orders.a > 0 && truth.orders.f > 0) {
      continue;  // Minima in which A and F have changed places are nearly as good.
    }
    const VectorXd expected = parameters_of(truth.model);
    int inside = 0;
    int all = 0;
    for (std::uint64_t seed = 0; seed < 25; ++seed) {
      const MatrixXd u = noise(1000, 1, seed);
      const VectorXd y = response(truth.model, u, noise(1000, 1, 1000 + seed, 0.5));
      const auto fit = fit_prediction_error(u, y, T, truth.orders);
      ASSERT_TRUE(fit) << truth.name << ": " << to_string(fit.error());
      for (Index i = 0; i < expected.size(); ++i) {
        inside += std::abs(fit->parameters(i) - expected(i)) <= 1.96 * fit->standard_errors(i);
        ++all;
      }
      EXPECT_NEAR(fit->model.noise, 0.25, 0.05) << truth.name;
      EXPECT_LT(fit->whiteness, 1.3) << truth.name;
      EXPECT_LT(fit->iterations, 100) << truth.name;
    }
    EXPECT_GE(inside, 0.9 * all) << truth.name;
    EXPECT_LT(inside, all) << truth.name;
  }
}

// The gradient of the sum of squares vanishes where the fit ends.
TEST(PredictionError, IsAMinimum) {
  for (const Truth& truth : family()) {
    const MatrixXd u = noise(400, 1, 5);
    const VectorXd y = response(truth.model, u, noise(400, 1, 6, 0.8));
    const PolynomialFit fit = fit_prediction_error(u, y, T, truth.orders).value();
    const auto cost = [&](VectorXd theta) {
      PolynomialModel model = fit.model;
      Index at = 0;
      const auto take = [&](VectorXd& polynomial, Index first) {
        for (Index i = first; i < polynomial.size(); ++i) {
          polynomial(i) = theta(at++);
        }
      };
      take(model.A, 1);
      take(model.B[0], 1);
      take(model.C, 1);
      take(model.D, 1);
      take(model.F[0], 1);
      const InnovationsModel states = to_state_space(model).value();
      const VectorXd e = y - predict(states, u, y).value();
      return e.tail(398).squaredNorm();
    };
    const double least = cost(fit.parameters);
    EXPECT_NEAR(least, fit.residuals.squaredNorm(), 1e-9 * least) << truth.name;
    for (Index i = 0; i < fit.parameters.size(); ++i) {
      for (const double step : {-1e-3, 1e-3}) {
        VectorXd theta = fit.parameters;
        theta(i) += step * fit.standard_errors(i) * 100.0;
        EXPECT_GT(cost(theta), least) << truth.name << " " << i;
      }
    }
  }
}

// Noise of 50 % in the output of a slow plant: ARX is biased, output error is not.
TEST(PredictionError, OutputErrorIsNotBiased) {
  PolynomialModel truth;
  truth.B = {polynomial({0.0, 0.05})};
  truth.F = {polynomial({1.0, -0.95})};
  double arx = 0.0;
  double error = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const MatrixXd u = noise(2000, 1, seed);
    const VectorXd y = response(truth, u, noise(2000, 1, 50 + seed, 0.1));
    arx += fit_arx(u, y, T, {.a = 1, .b = 1})->model.A(1) / 20.0;
    error += fit_prediction_error(u, y, T, {.b = 1, .f = 1})->model.F[0](1) / 20.0;
  }
  EXPECT_GT(arx, -0.9);
  EXPECT_NEAR(error, -0.95, 0.005);
}

// ŷ by states is ŷ by polynomials: y - e.
TEST(PolynomialModel, InStates) {
  for (const Truth& truth : family()) {
    const MatrixXd u = noise(100, 1, 1);
    const VectorXd e = noise(100, 1, 2);
    const VectorXd y = response(truth.model, u, e);
    const InnovationsModel states = to_state_space(truth.model).value();
    EXPECT_LT((predict(states, u, y).value() - (y - e)).norm(), 1e-11) << truth.name;
    EXPECT_LT((simulate(states, u).value() - response(truth.model, u, VectorXd::Zero(100))).norm(),
              1e-11)
        << truth.name;
  }
  // A gain without memory.
  PolynomialModel gain;
  gain.B = {polynomial({2.0})};
  gain.F = {VectorXd::Ones(1)};
  gain.period = T;
  EXPECT_EQ(simulate(to_state_space(gain).value(), MatrixXd::Ones(3, 1)).value(),
            MatrixXd::Constant(3, 1, 2.0));
}

TEST(PolynomialModel, Refusals) {
  const MatrixXd u = noise(50, 1, 1);
  const VectorXd y = noise(50, 1, 2);
  EXPECT_TRUE(fit_arx(u, y.head(49), T, {}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(fit_arx(u, y, Time(0.0), {}).error().is(ArgumentError::not_positive));
  EXPECT_EQ(to_string(fit_arx(u, y, T, {.a = -1}).error()),
            "fit_arx: the order of A is -1; it must be from 0 to 200");
  EXPECT_TRUE(fit_arx(u, y, T, {.c = 1}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(fit_arx(u, y, T, {.a = 20, .b = 20}).error().is(IdentificationError::too_short));
  EXPECT_TRUE(fit_arx(MatrixXd::Ones(50, 1), y, T, {.a = 1, .b = 2})
                  .error()
                  .is(IdentificationError::singular));
  EXPECT_TRUE(
      fit_prediction_error(MatrixXd(50, 0), y, T, {.f = 1}).error().is(ArgumentError::empty));
  PolynomialModel model = second_order();
  model.A(0) = 2.0;
  EXPECT_TRUE(to_state_space(model).error().is(ArgumentError::malformed));
  model.F.clear();
  EXPECT_TRUE(to_state_space(model).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(to_state_space(PolynomialModel{}).error().is(ArgumentError::empty));
  const InnovationsModel states = to_state_space(second_order()).value();
  EXPECT_TRUE(simulate(states, MatrixXd::Ones(5, 2)).error().is(ArgumentError::wrong_shape));
  InnovationsModel unstable = states;
  unstable.system.A *= 1e3;
  EXPECT_TRUE(simulate(unstable, MatrixXd::Ones(500, 1)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(
      fit_of(MatrixXd::Ones(5, 2), MatrixXd::Ones(5, 1)).error().is(ArgumentError::wrong_shape));
}

// The sums of products of an ARX fit tell what QR of all rows does, its covariance too.
TEST(PolynomialModel, NormalEquationsOfArx) {
  const MatrixXd u = noise(900, 2, 31);
  PolynomialModel truth = second_order();
  truth.B.push_back(polynomial({0.0, 0.3, -0.2}));
  truth.F.push_back(VectorXd::Ones(1));
  const VectorXd y = response(truth, u, noise(900, 1, 32, 0.5));
  const PolynomialFit fit = fit_arx(u, y, T, {.a = 3, .b = 2, .delay = 2}).value();
  const Index first = 3;
  MatrixXd X(900 - first, 7);
  for (Index k = first; k < 900; ++k) {
    X.row(k - first) << -y(k - 1), -y(k - 2), -y(k - 3), u(k - 2, 0), u(k - 3, 0), u(k - 2, 1),
        u(k - 3, 1);
  }
  const VectorXd right = y.tail(900 - first);
  const VectorXd expected = test::least_squares(X, right);
  EXPECT_LT((fit.parameters - expected).norm(), 1e-11 * expected.norm());
  const double variance = (right - X * expected).squaredNorm() / static_cast<double>(X.rows() - 7);
  const MatrixXd covariance = variance * test::inverse(MatrixXd(X.transpose() * X));
  EXPECT_LT((fit.covariance - covariance).norm(), 1e-9 * covariance.norm());
}

}  // namespace
}  // namespace flyball::identification::polynomial_model_test
