#include <flyball/systems/interconnection.hpp>

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/norms.hpp>
#include <flyball/systems/realization.hpp>
#include <flyball/systems/response.hpp>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::interconnection_test {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// num/den in descending powers, in controllable canonical form.
ContinuousSystem<> from_polynomials(std::vector<double> num, std::vector<double> den) {
  const auto n = static_cast<Eigen::Index>(den.size()) - 1;
  num.insert(num.begin(), den.size() - num.size(), 0.0);
  ContinuousSystem<> s{MatrixXd::Zero(n, n), MatrixXd::Zero(n, 1), MatrixXd(1, n),
                       MatrixXd::Constant(1, 1, num[0] / den[0])};
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k) + 1;
    s.A(0, k) = -den[i] / den[0];
    s.C(0, k) = (num[i] - num[0] / den[0] * den[i]) / den[0];
    if (k > 0) {
      s.A(k, k - 1) = 1.0;
    }
  }
  s.B(0, 0) = 1.0;
  return s;
}

// dx/dt = -x + 2u, y = 3x + 0.5u under u = 4 (r - x): A - BK = -9, BK = 8, C - DK = 1, DK = 2
// ((6.3), (6.4); (7.12), (7.13)); in Tables 6.2's and 7.4's sizes for any others, where the law
// itself, put into (6.1) and (6.2), gives the same.
TEST(Interconnection, StateFeedbackInClosedForm) {
  const auto number = [](double x) { return MatrixXd::Constant(1, 1, x).eval(); };
  const ContinuousSystem<> plant{number(-1.0), number(2.0), number(3.0), number(0.5)};
  const auto loop = closed_loop(plant, number(4.0)).value();
  EXPECT_EQ(loop.A(0), -9.0);
  EXPECT_EQ(loop.B(0), 8.0);
  EXPECT_EQ(loop.C(0), 1.0);
  EXPECT_EQ(loop.D(0), 2.0);
  Random random(61);
  const auto any = [&](Eigen::Index rows, Eigen::Index columns) {
    return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }).eval();
  };
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Index n = 1 + trial % 5;
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::Index p = 1 + trial % 4;
    const DiscreteSystem<> sampled{any(n, n), any(n, m), any(p, n), any(p, m), Time(0.02)};
    const MatrixXd K = any(m, n);
    const auto closed = closed_loop(sampled, K).value();
    ASSERT_EQ(closed.B.cols(), n);
    ASSERT_EQ(closed.C.rows(), p);
    const MatrixXd x = any(n, 1);
    const MatrixXd r = any(n, 1);
    const MatrixXd u = K * (r - x);
    EXPECT_LT((closed.A * x + closed.B * r - sampled.A * x - sampled.B * u).norm(), 1e-12);
    EXPECT_LT((closed.C * x + closed.D * r - sampled.C * x - sampled.D * u).norm(), 1e-12);
    EXPECT_EQ(closed.period.si(), 0.02);
    // A reference is held without error exactly if A r = r (7.5); if A r = 0 (6.5).
    EXPECT_NEAR((closed.A * r + closed.B * r - r).norm(), (sampled.A * r - r).norm(), 1e-12);
  }
  EXPECT_TRUE(closed_loop(plant, any(1, 2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(closed_loop(plant, number(NAN)).error().is(ArgumentError::not_finite));
}

// G = 1/(s + 1), H = 1/(s + 2): 1/((s+1)(s+2)), (2s + 3)/((s+1)(s+2)), (s + 2)/(s² + 3s + 3).
TEST(Interconnection, FirstOrderInClosedForm) {
  const auto G = from_polynomials({1.0}, {1.0, 1.0});
  const auto H = from_polynomials({1.0}, {1.0, 2.0});
  const Complex s(0.0, 1.0);
  const auto at = [&](const Expected<ContinuousSystem<>>& system) {
    return transfer_at(system.value(), s).value()(0, 0);
  };
  EXPECT_LT(std::abs(at(series(G, H)) - 1.0 / ((s + 1.0) * (s + 2.0))), 1e-15);
  EXPECT_LT(std::abs(at(parallel(G, H)) - (2.0 * s + 3.0) / ((s + 1.0) * (s + 2.0))), 1e-15);
  EXPECT_LT(std::abs(at(feedback(G, H)) - (s + 2.0) / (s * s + 3.0 * s + 3.0)), 1e-15);
  EXPECT_LT(
      std::abs(at(feedback(G, H, FeedbackSign::positive)) - (s + 2.0) / (s * s + 3.0 * s + 1.0)),
      1e-15);
  EXPECT_LT(std::abs(at(feedback(G)) - 1.0 / (s + 2.0)), 1e-15);
  const auto side = append(G, H).value();
  EXPECT_EQ(side.D.rows(), 2);
  EXPECT_EQ(side.B(0, 1), 0.0);
}

TEST(Interconnection, Gold) {
  int seen = 0;
  for (const auto& c : test::cases_of("interconnection.json")) {
    ++seen;
    const auto G = from_polynomials(c["G"]["num"], c["G"]["den"]);
    const auto H = from_polynomials(c["H"]["num"], c["H"]["den"]);
    const auto w = c["w"].get<std::vector<double>>();
    for (const auto& [key, system] :
         {std::pair{"jw_series", series(G, H)},
          {"jw_parallel", parallel(G, H)},
          {"jw_feedback_neg", feedback(G, H)},
          {"jw_feedback_pos", feedback(G, H, FeedbackSign::positive)}}) {
      for (std::size_t k = 0; k < w.size(); ++k) {
        const Complex expected(c[key][k][0].get<double>(), c[key][k][1].get<double>());
        const Complex found = transfer_at(system.value(), {0.0, w[k]}).value()(0, 0);
        EXPECT_LE(std::abs(found - expected), 1e-12 * std::abs(expected))
            << c["name"] << ' ' << key << ' ' << w[k];
      }
    }
  }
  EXPECT_EQ(seen, 3);
}

TEST(Interconnection, TransferMatricesMultiplyAndAdd) {
  Random random(81);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index m = 1 + trial % 3;
    const Eigen::Index p = 1 + trial % 2;
    const auto G = test::random_system(random, 1 + trial % 5, m, p);
    const auto H = test::random_system(random, 1 + trial % 4, p, m);
    const auto G2 = test::random_system(random, 1 + trial % 4, m, p);
    const Complex s(random.normal(), 2.0 + random.uniform());
    const MatrixXcd g = test::response(G, s);
    const MatrixXcd h = test::response(H, s);
    const auto close = [&](const Expected<ContinuousSystem<>>& system, const MatrixXcd& expected) {
      return (transfer_at(system.value(), s).value() - expected).norm() <=
             1e-9 * (1.0 + expected.norm()) * (1.0 + g.norm()) * (1.0 + h.norm());
    };
    EXPECT_TRUE(close(series(G, H), h * g));
    EXPECT_TRUE(close(parallel(G, G2), g + test::response(G2, s)));
    const MatrixXcd I = MatrixXcd::Identity(p, p);
    EXPECT_TRUE(close(feedback(G, H), test::solve(I + g * h, g))) << trial;
    EXPECT_TRUE(close(feedback(G, H, FeedbackSign::positive), test::solve(I - g * h, g)));
    const auto side = transfer_at(append(G, H).value(), s).value();
    EXPECT_LT((side.topLeftCorner(p, m) - g).norm() + side.topRightCorner(p, p).norm(),
              1e-9 * (1.0 + g.norm()));
  }
}

// Discrete systems connect alike, and keep their period.
TEST(Interconnection, DiscreteSystems) {
  Random random(82);
  const auto c = test::random_system(random, 2, 1, 1);
  const auto e = test::random_system(random, 3, 1, 1);
  const DiscreteSystem<> G{c.A, c.B, c.C, c.D, Time(0.02)};
  DiscreteSystem<> H{e.A, e.B, e.C, e.D, Time(0.02)};
  for (const auto& [discrete, continuous] : {std::pair{series(G, H), series(c, e)},
                                             {parallel(G, H), parallel(c, e)},
                                             {append(G, H), append(c, e)},
                                             {feedback(G, H), feedback(c, e)},
                                             {feedback(G), feedback(c)}}) {
    EXPECT_EQ(discrete->A, continuous->A);
    EXPECT_EQ(discrete->D, continuous->D);
    EXPECT_EQ(discrete->period.si(), 0.02);
  }
  H.period = Time(0.01);
  EXPECT_TRUE(series(G, H).error().is(SystemError::period_mismatch));
  EXPECT_TRUE(feedback(G, H).error().is(SystemError::period_mismatch));
}

// Zero states are a system: y = D u.
TEST(Interconnection, StaticGains) {
  const auto gain = [](double k) {
    return ContinuousSystem<>{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0),
                              MatrixXd::Constant(1, 1, k)};
  };
  const auto G = from_polynomials({1.0}, {1.0, 1.0});
  const Complex s(0.0, 1.0);
  const auto at = [&](const Expected<ContinuousSystem<>>& system) {
    return transfer_at(system.value(), s).value()(0, 0);
  };
  EXPECT_LT(std::abs(at(feedback(G, gain(2.0))) - 1.0 / (s + 3.0)), 1e-15);
  EXPECT_LT(std::abs(at(feedback(gain(2.0), G)) - 2.0 * (s + 1.0) / (s + 3.0)), 1e-15);
  EXPECT_LT(std::abs(at(series(gain(3.0), G)) - 3.0 / (s + 1.0)), 1e-15);
  EXPECT_LT(std::abs(at(parallel(G, gain(-1.0))) + s / (s + 1.0)), 1e-15);
  EXPECT_EQ(at(feedback(gain(3.0))), 0.75);
  EXPECT_EQ(append(gain(1.0), gain(2.0)).value().D(1, 1), 2.0);
  EXPECT_TRUE(feedback(gain(-1.0)).error().is(SystemError::algebraic_loop));
  // Far more than rounding from singular: 2⁻⁴² is exact in 1 - 2⁻⁴².
  EXPECT_EQ(at(feedback(gain(std::ldexp(1.0, -42) - 1.0))),
            (std::ldexp(1.0, -42) - 1.0) / std::ldexp(1.0, -42));
  const auto sampled = convert_to_discrete(gain(2.0), Time(0.02), ConversionMethod::tustin).value();
  EXPECT_EQ(transfer_at(sampled, -1.0).value()(0, 0), 2.0);
  EXPECT_EQ(convert_to_continuous(sampled, ConversionMethod::matched).value().D(0, 0), 2.0);
  EXPECT_EQ(step_response(gain(2.0)).value().y.minCoeff(), 2.0);
  EXPECT_EQ(step_response(sampled).value().y.maxCoeff(), 2.0);
  EXPECT_EQ(h_infinity_norm(gain(-2.0)).value().norm, 2.0);
  EXPECT_EQ(h2_norm(sampled).value(), 2.0);
  EXPECT_TRUE(h2_norm(gain(1.0)).error().is(SystemError::infinite_norm));
  EXPECT_EQ(minimal_realization(gain(2.0)).value().system.D(0, 0), 2.0);
}

// Whether a loop is algebraic does not hang on the units of its signals: with y' = S y and u' = W u
// the loop matrix is W(I + D₂D₁)W⁻¹, and what closes it, in those units, stays the same.
TEST(Interconnection, AlgebraicLoopsDoNotDependOnUnits) {
  const auto gain = [](const MatrixXd& D) {
    return ContinuousSystem<>{MatrixXd(0, 0), MatrixXd(0, D.cols()), MatrixXd(D.rows(), 0), D};
  };
  Random random(10);
  for (int trial = 0; trial < 400; ++trial) {
    const Eigen::Index m = 1 + trial % 5;
    const Eigen::Index p = 1 + trial / 3 % 4;
    MatrixXd first = test::random_matrix(random, p, m);
    MatrixXd second = test::random_matrix(random, m, p);
    const bool singular = trial % 2 == 1;
    if (singular) {
      // second first v = -v for v = (1, …, 1)
      const Eigen::VectorXd v = Eigen::VectorXd::Ones(m);
      const Eigen::VectorXd w = first * v;
      second -= (second * w + v) * w.transpose() / w.squaredNorm();
    }
    const auto plain = feedback(gain(first), gain(second));
    ASSERT_EQ(plain.has_value(), !singular) << trial;
    const auto units = [&](Eigen::Index n) {
      return Eigen::VectorXd::NullaryExpr(
                 n, [&] { return std::pow(10.0, random.uniform(-100.0, 100.0)); })
          .eval();
    };
    const Eigen::VectorXd S = units(p);
    const Eigen::VectorXd W = units(m);
    const MatrixXd first_in_units = S.asDiagonal() * first * W.cwiseInverse().asDiagonal();
    const MatrixXd second_in_units = W.asDiagonal() * second * S.cwiseInverse().asDiagonal();
    const auto scaled = feedback(gain(first_in_units), gain(second_in_units));
    ASSERT_EQ(scaled.has_value(), !singular) << trial;
    if (scaled) {
      const MatrixXd back = S.cwiseInverse().asDiagonal() * scaled->D * W.asDiagonal();
      EXPECT_LT((back - plain->D).norm(), 1e-12 * plain->D.norm()) << trial;
    } else {
      EXPECT_TRUE(scaled.error().is(SystemError::algebraic_loop));
    }
  }
  // A large gain beside a small one is no reason either, nor is one that leads on and not around.
  EXPECT_TRUE(feedback(gain(MatrixXd{{1e20, 0.0}, {0.0, 1.0}})).has_value());
  EXPECT_TRUE(feedback(gain(MatrixXd{{1.0, 1e30}, {0.0, 1.0}})).has_value());
  EXPECT_FALSE(feedback(gain(MatrixXd{{1e20, 0.0}, {0.0, -1.0}})).has_value());
}

// A wrong shape is told with the matrix that it has to fit.
TEST(Interconnection, ShapesNameWhatTheyFollowFrom) {
  ContinuousSystem<> G{MatrixXd::Zero(2, 2), MatrixXd::Zero(3, 1), MatrixXd::Zero(1, 2),
                       MatrixXd::Zero(1, 1)};
  EXPECT_EQ(to_string(transfer_at(G, 1.0).error()),
            "transfer_at: B is 3x1; it must be states x inputs, A having 2 states (2x1)");
  G.B = MatrixXd::Zero(2, 1);
  G.C = MatrixXd::Zero(2, 1);
  EXPECT_EQ(to_string(transfer_at(G, 1.0).error()),
            "transfer_at: C is 2x1; it must be outputs x states, A having 2 states (2x2)");
}

TEST(Interconnection, Errors) {
  Random random(83);
  const auto G = test::random_system(random, 2, 1, 2);
  EXPECT_TRUE(series(G, G).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(feedback(G).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(
      parallel(G, test::random_system(random, 2, 2, 2)).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(series(G, ContinuousSystem<>{}).error().is(ArgumentError::empty));
  EXPECT_TRUE(analyze_modes(ContinuousSystem<>{}).error().is(ArgumentError::empty));
  // y = -(y - u): D₁D₂ = -1.
  auto H = test::random_system(random, 1, 1, 1);
  H.D(0, 0) = -1.0;
  const auto loop = feedback(H);
  ASSERT_FALSE(loop.has_value());
  EXPECT_TRUE(loop.error().is(SystemError::algebraic_loop));
  EXPECT_EQ(loop.error().evidence().front().values.front(), 0.0);
  H.D(0, 0) = 1.0;
  EXPECT_TRUE(feedback(H).has_value());
  EXPECT_TRUE(feedback(H, FeedbackSign::positive).error().is(SystemError::algebraic_loop));
  const auto integrator = from_polynomials({1.0}, {1.0, 0.0});
  EXPECT_TRUE(transfer_at(integrator, 0.0).error().is(SystemError::no_image));
  EXPECT_TRUE(transfer_at(integrator, NAN).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::interconnection_test
