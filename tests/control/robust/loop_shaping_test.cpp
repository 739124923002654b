#include <flyball/control/robust/loop_shaping.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/interconnection.hpp>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"

namespace flyball::loop_shaping_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Continuous = ContinuousSystem<>;
using Discrete = DiscreteSystem<>;

Continuous first_order(double a, double b, double c) {
  return {MatrixXd::Constant(1, 1, -c), MatrixXd::Ones(1, 1), MatrixXd::Constant(1, 1, b - a * c),
          MatrixXd::Constant(1, 1, a)};
}

// The integrator 1/s: X = Z = 1, γ = √2, and K = 1 is the best: [1; 1](1 + 1/s)⁻¹[1, 1/s] has the
// squared norm 2(1 + ω²)/(1 + ω²).
TEST(LoopShaping, TheIntegrator) {
  const Continuous G = first_order(0.0, 1.0, 0.0);
  const auto design = loop_shaping(G).value();
  EXPECT_NEAR(design.largest_margin, std::sqrt(0.5), 1e-14);
  EXPECT_GE(design.margin, std::sqrt(0.5) / 1.1 * (1.0 - 1e-9));
  const Continuous one{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0), MatrixXd::Ones(1, 1)};
  EXPECT_NEAR(coprime_margin(G, one).value(), std::sqrt(0.5), 1e-12);
  Continuous against = one;
  against.D *= -1.0;
  EXPECT_EQ(coprime_margin(G, against).value(), 0.0);
}

// Skogestad and Postlethwaite, example 9.3: the disturbance process shaped by W₁ = (s + 2)/s,
// "γ_min = 2.34 (ε = 0.43)", and the controller of 1.1 γ_min.
TEST(LoopShaping, SkogestadAndPostlethwaitesDisturbanceProcess) {
  MatrixXd A(3, 3);
  A << -0.1, 1.0, 0.0, 0.0, -20.0, 1.0, 0.0, 0.0, -20.0;
  const Continuous G{A, Eigen::Vector3d(0.0, 0.0, 8000.0), Eigen::RowVector3d(1.0, 0.0, 0.0),
                     MatrixXd::Zero(1, 1)};
  LoopShape<> shape;
  shape.before = first_order(1.0, 2.0, 0.0);
  const auto design = loop_shaping(G, shape).value();
  EXPECT_NEAR(1.0 / design.largest_margin, 2.34, 0.005);
  EXPECT_GE(design.margin, design.largest_margin / 1.1 * (1.0 - 1e-9));
  EXPECT_LT(design.poles.real().maxCoeff(), 0.0);
  // K = W₁ K_s on the plant itself is stable, too.
  EXPECT_LT(
      test::eigenvalues(feedback(series(design.controller, G).value()).value().A).real().maxCoeff(),
      0.0);
}

// Octave's ncfsyn (SLICOT SB10ID) with the same factor.
TEST(LoopShaping, AgreesWithSlicot) {
  int compared = 0;
  for (const auto& c : test::cases_of("robust_synthesis.json")) {
    if (!c.contains("ncfsyn")) {
      continue;
    }
    const MatrixXd B = test::matrix_from(c["B"]);
    const MatrixXd C = test::matrix_from(c["C"]);
    const MatrixXd D = test::matrix_from(c["D"]);
    const Index y = c["nmeas"].get<Index>();
    const Index u = c["ncon"].get<Index>();
    const Continuous G{test::matrix_from(c["A"]), B.rightCols(u), C.bottomRows(y),
                       D.bottomRightCorner(y, u)};
    const auto design = loop_shaping(G).value();
    EXPECT_NEAR(design.margin * c["ncfsyn"].get<double>(), 1.0, 1e-6) << compared;
    ++compared;
  }
  EXPECT_EQ(compared, 12);
}

// Every answer stabilises with the margin it tells; that of a random other controller is not above
// the largest.
TEST(LoopShaping, EveryAnswerIsTrue) {
  Random random(81);
  const auto matrix = [&](Index rows, Index columns) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }));
  };
  for (int trial = 0; trial < 150; ++trial) {
    const auto n = static_cast<Index>(1 + random.bits() % 7);
    const auto m = static_cast<Index>(1 + random.bits() % 3);
    const auto p = static_cast<Index>(1 + random.bits() % 3);
    const Continuous G{matrix(n, n), matrix(n, m), matrix(p, n),
                       trial % 2 == 0 ? MatrixXd(MatrixXd::Zero(p, m)) : matrix(p, m)};
    const auto design = loop_shaping(G);
    ASSERT_TRUE(design) << to_string(design.error());
    EXPECT_GE(design->margin, design->largest_margin / 1.1 * 0.99);
    EXPECT_LE(design->margin, design->largest_margin * (1.0 + 1e-9));
    EXPECT_NEAR(coprime_margin(G, design->controller).value() / design->margin, 1.0, 1e-6);
    EXPECT_LT(design->poles.real().maxCoeff(), 0.0);
    // The same of the matrices as a discrete system.
    const Discrete D{G.A / (1.0 + 0.3 * G.A.norm()), G.B, G.C, G.D, Time(0.5)};
    const auto sampled = loop_shaping(D);
    ASSERT_TRUE(sampled) << to_string(sampled.error());
    EXPECT_LT(sampled->poles.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_GE(sampled->margin, sampled->largest_margin / 1.1 * 0.99);
    EXPECT_LE(
        coprime_margin(G, {MatrixXd(0, 0), MatrixXd(0, p), MatrixXd(m, 0), matrix(m, p)}).value(),
        design->largest_margin * (1.0 + 1e-9));
  }
}

TEST(LoopShaping, Errors) {
  MatrixXd A(2, 2);
  A << 1.0, 0.0, 0.0, -1.0;
  const Continuous hidden{A, Eigen::Vector2d(0.0, 1.0), Eigen::RowVector2d(1.0, 1.0),
                          MatrixXd::Zero(1, 1)};
  EXPECT_TRUE(loop_shaping(hidden).error().is(SynthesisError::not_stabilizable));
  const Continuous unseen{A, Eigen::Vector2d(1.0, 1.0), Eigen::RowVector2d(0.0, 1.0),
                          MatrixXd::Zero(1, 1)};
  EXPECT_TRUE(loop_shaping(unseen).error().is(SynthesisError::not_detectable));
  EXPECT_TRUE(
      loop_shaping(first_order(0.0, 1.0, 1.0), {}, 1.0).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(coprime_margin(first_order(0.0, 1.0, 1.0), hidden).has_value());
  EXPECT_TRUE(coprime_margin(first_order(0.0, 1.0, 1.0),
                             {A, MatrixXd::Ones(2, 2), MatrixXd::Ones(1, 2), MatrixXd::Zero(1, 2)})
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::loop_shaping_test
