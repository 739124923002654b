#include <flyball/systems/gramian.hpp>

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/systems/norms.hpp>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::gramian_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

DiscreteSystem<> random_discrete(Random& random, Index n, Index m, Index p) {
  const auto s = test::random_system(random, n, m, p);
  const double radius = test::eigenvalues(s.A).cwiseAbs().maxCoeff();
  return {s.A * (random.uniform(0.3, 0.95) / radius), s.B, s.C, s.D, Time(0.02)};
}

TEST(Gramian, Gold) {
  int seen = 0;
  for (const auto& c : test::cases_of("gramians.json")) {
    ++seen;
    const MatrixXd A = test::matrix_from(c["A"]);
    const MatrixXd B = test::matrix_from(c["B"]);
    const MatrixXd C = test::matrix_from(c["C"]);
    const auto reach = controllability_gramian(A, B, TimeDomain::continuous).value();
    const auto sight = observability_gramian(A, C, TimeDomain::continuous).value();
    const MatrixXd W_c = test::matrix_from(c["Wc"]);
    const MatrixXd W_o = test::matrix_from(c["Wo"]);
    EXPECT_LE((reach.W - W_c).norm(), 1e-14 * W_c.norm()) << c["name"];
    EXPECT_LE((sight.W - W_o).norm(), 1e-14 * W_o.norm()) << c["name"];
    EXPECT_TRUE(reach.is_energy);
    const ContinuousSystem<> plant{A, B, C, MatrixXd::Zero(1, 1)};
    const auto hankel = hankel_singular_values(plant).value();
    const auto expected = c["hankel_sv"].get<std::vector<double>>();
    for (Index k = 0; k < hankel.size(); ++k) {
      EXPECT_NEAR(hankel(k), expected[static_cast<std::size_t>(k)], 1e-13 * expected[0])
          << c["name"];
    }
    const auto h2 = c["h2norm"].get<double>();
    EXPECT_NEAR(h2_norm(plant).value(), h2, 1e-13 * h2) << c["name"];
    const auto infinite = h_infinity_norm(plant).value();
    const auto grid = c["hinf_grid"].get<double>();
    EXPECT_GE(infinite.norm, grid * (1.0 - 1e-12));
    EXPECT_NEAR(infinite.norm, grid, 1e-6 * grid) << c["name"];
    EXPECT_NEAR(infinite.frequency, c["hinf_w"].get<double>(), 1e-2 * (infinite.frequency + 1e-3))
        << c["name"];
  }
  EXPECT_EQ(seen, 2);
}

// dx/dt = a x + b u: W = -b²/(2a), also where it is not an energy. x₊ = a x + b u: b²/(1 - a²).
TEST(Gramian, ScalarInClosedForm) {
  EXPECT_NEAR(controllability_gramian(scalar(-2.0), scalar(3.0), TimeDomain::continuous)->W(0, 0),
              2.25, 1e-15);
  const auto unstable =
      controllability_gramian(scalar(2.0), scalar(3.0), TimeDomain::continuous).value();
  EXPECT_NEAR(unstable.W(0, 0), -2.25, 1e-15);
  EXPECT_FALSE(unstable.is_energy);
  const auto discrete =
      observability_gramian(scalar(0.5), scalar(3.0), TimeDomain::discrete).value();
  EXPECT_NEAR(discrete.W(0, 0), 12.0, 1e-14);
  EXPECT_TRUE(discrete.is_energy);
}

TEST(Gramian, SolvesItsEquation) {
  Random random(111);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto s = test::random_system(random, 1 + trial % 6, 1 + trial % 2, 1 + trial % 3);
    const MatrixXd& A = s.A;
    const MatrixXd W = controllability_gramian(A, s.B, TimeDomain::continuous).value().W;
    EXPECT_LT((A * W + W * A.transpose() + s.B * s.B.transpose()).norm(),
              1e-12 * (A.norm() * W.norm() + s.B.squaredNorm()));
    const MatrixXd V = observability_gramian(A, s.C, TimeDomain::discrete).value().W;
    EXPECT_LT((A.transpose() * V * A - V + s.C.transpose() * s.C).norm(),
              1e-12 * (A.squaredNorm() * V.norm() + s.C.squaredNorm()));
  }
}

// The eigenvalues of W_c W_o are the squares, in any coordinates.
TEST(Gramian, HankelSingularValuesAreInvariant) {
  Random random(112);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 6;
    const auto s = test::random_stable_system(random, n, 1 + trial % 2, 1);
    const auto hankel = hankel_singular_values(s).value();
    const MatrixXd W_c = controllability_gramian(s.A, s.B, TimeDomain::continuous)->W;
    const MatrixXd W_o = observability_gramian(s.A, s.C, TimeDomain::continuous)->W;
    EXPECT_NEAR(hankel.squaredNorm(), (W_c * W_o).trace(), 1e-10 * hankel.squaredNorm());
    const auto other =
        hankel_singular_values(test::rescaled(s, test::random_scales(random, n, 6.0))).value();
    EXPECT_LT((other - hankel).norm(), 1e-10 * hankel.norm()) << trial;
    const auto d = random_discrete(random, n, 1, 2);
    const auto sampled = hankel_singular_values(d).value();
    const MatrixXd V_c = controllability_gramian(d.A, d.B, TimeDomain::discrete)->W;
    const MatrixXd V_o = observability_gramian(d.A, d.C, TimeDomain::discrete)->W;
    EXPECT_NEAR(sampled.squaredNorm(), (V_c * V_o).trace(), 1e-10 * sampled.squaredNorm());
  }
}

// b/(s + a): ‖G‖₂ = b/√(2a), ‖G‖∞ = b/a at 0.
TEST(Norms, FirstOrder) {
  const ContinuousSystem<> G{scalar(-2.0), scalar(3.0), scalar(1.0), scalar(0.0)};
  EXPECT_NEAR(h2_norm(G).value(), 1.5, 1e-15);
  const auto norm = h_infinity_norm(G).value();
  EXPECT_NEAR(norm.norm, 1.5, 1e-15);
  EXPECT_EQ(norm.frequency, 0.0);
  // s/(s + 1): its largest gain lies at infinity.
  const auto high =
      h_infinity_norm(ContinuousSystem<>{scalar(-1.0), scalar(1.0), scalar(-1.0), scalar(1.0)})
          .value();
  EXPECT_NEAR(high.norm, 1.0, 1e-10);
  // 1/(z - a): 1/(1 - a) at 0; for a < 0 1/(1 + a) at the Nyquist frequency.
  const auto discrete = [](double a) {
    return h_infinity_norm(
               DiscreteSystem<>{scalar(a), scalar(1.0), scalar(1.0), scalar(0.0), Time(0.1)})
        .value();
  };
  EXPECT_NEAR(discrete(0.75).norm, 4.0, 1e-13);
  EXPECT_NEAR(discrete(-0.75).norm, 4.0, 4e-10);
  EXPECT_NEAR(discrete(-0.75).frequency, std::numbers::pi / 0.1, 1e-2);
  EXPECT_NEAR(
      h2_norm(DiscreteSystem<>{scalar(0.6), scalar(2.0), scalar(1.0), scalar(1.0), Time(0.1)})
          .value(),
      std::sqrt(4.0 / 0.64 + 1.0), 1e-14);
}

// ω²/(s² + 2ζωs + ω²): peak 1/(2ζ√(1 - ζ²)) at ω√(1 - 2ζ²), down to ζ = 1e-6.
TEST(Norms, Resonances) {
  for (const double zeta : {0.5, 0.1, 1e-2, 1e-4, 1e-6}) {
    for (const double w : {1e-3, 1.0, 1e4}) {
      ContinuousSystem<> G{MatrixXd(2, 2), MatrixXd(2, 1), MatrixXd(1, 2), scalar(0.0)};
      G.A << 0.0, 1.0, -w * w, -2.0 * zeta * w;
      G.B << 0.0, w * w;
      G.C << 1.0, 0.0;
      const auto found = h_infinity_norm(G).value();
      const double expected = 1.0 / (2.0 * zeta * std::sqrt(1.0 - zeta * zeta));
      EXPECT_NEAR(found.norm, expected, 1e-10 * expected) << zeta << ' ' << w;
      EXPECT_NEAR(found.frequency, w * std::sqrt(1.0 - 2.0 * zeta * zeta), 1e-4 * w);
      EXPECT_GE(found.upper_bound, expected * (1.0 - 1e-12));
      // ‖G‖₂² = ω/(4ζ).
      EXPECT_NEAR(h2_norm(G).value(), std::sqrt(w / (4.0 * zeta)),
                  1e-9 * std::sqrt(w / (4.0 * zeta)));
    }
  }
}

// No gain on a fine grid exceeds it, and it is reached at its frequency.
TEST(Norms, LargestGainOfAll) {
  Random random(113);
  for (int trial = 0; trial < 1000; ++trial) {
    const Index n = 1 + trial % 6;
    const auto s = test::random_stable_system(random, n, 1 + trial % 2, 1 + trial % 3,
                                              std::pow(10.0, random.uniform(-3.0, 0.0)));
    const auto found = h_infinity_norm(s).value();
    const auto gain = [&](std::complex<double> at) {
      return test::singular_values(test::response(s, at))(0);
    };
    if (std::isfinite(found.frequency)) {
      EXPECT_NEAR(gain({0.0, found.frequency}), found.norm, 1e-9 * found.norm);
    }
    for (int k = 0; k < 200; ++k) {
      EXPECT_LE(gain({0.0, std::pow(10.0, -3.0 + 0.03 * k)}), found.norm * (1.0 + 1e-10)) << trial;
    }
    const auto d = random_discrete(random, n, 1 + trial % 2, 2);
    const auto sampled = h_infinity_norm(d).value();
    for (int k = 0; k <= 100; ++k) {
      const double theta = std::numbers::pi * k / 100.0;
      EXPECT_LE(test::singular_values(test::response(d, std::polar(1.0, theta)))(0),
                sampled.norm * (1.0 + 1e-10));
    }
    EXPECT_NEAR(
        test::singular_values(test::response(d, std::polar(1.0, sampled.frequency * 0.02)))(0),
        sampled.norm, 1e-9 * sampled.norm);
  }
}

TEST(Norms, Errors) {
  const auto system = [](double a, double d) {
    return ContinuousSystem<>{scalar(a), scalar(1.0), scalar(1.0), scalar(d)};
  };
  EXPECT_TRUE(h2_norm(system(1.0, 0.0)).error().is(SystemError::not_stable));
  EXPECT_TRUE(h2_norm(system(-1.0, 0.5)).error().is(SystemError::infinite_norm));
  EXPECT_TRUE(h_infinity_norm(system(0.0, 0.0)).error().is(SystemError::not_stable));
  EXPECT_TRUE(hankel_singular_values(system(0.0, 0.0)).error().is(SystemError::not_stable));
  EXPECT_TRUE(h_infinity_norm(system(NAN, 0.0)).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(h2_norm(ContinuousSystem<>{}).error().is(ArgumentError::empty));
  EXPECT_EQ(h_infinity_norm(ContinuousSystem<>{scalar(-1.0), scalar(0.0), scalar(1.0), scalar(0.0)})
                .value()
                .norm,
            0.0);
  EXPECT_TRUE(controllability_gramian(scalar(0.0), scalar(1.0), TimeDomain::continuous)
                  .error()
                  .is(MatrixEquationError::no_unique_solution));
  EXPECT_TRUE(controllability_gramian(scalar(1.0), MatrixXd::Ones(2, 1), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(observability_gramian(MatrixXd(), scalar(1.0), TimeDomain::continuous)
                  .error()
                  .is(ArgumentError::empty));
}

// W = B²/-2a where B² is no double.
TEST(Gramian, OfInputsWhoseSquaresAreNoDoubles) {
  const auto continuous = [](double a, double b) {
    return controllability_gramian(scalar(a), scalar(b), TimeDomain::continuous);
  };
  EXPECT_NEAR(continuous(-2.3e-308, 1e-300)->W(0, 0) * 2.3e292, 0.5, 1e-14);
  EXPECT_NEAR(continuous(-4e307, 1e200)->W(0, 0) / 1e92, 1.0 / 0.8, 1e-14);
  EXPECT_TRUE(continuous(-1.0, 1e200).error().is(MatrixEquationError::overflow));
}

// A sensitivity 1/(1 + KG) with the controller's integral in the middle: units in which its entries
// are near one exist, though the input and the output each have but one.
TEST(Norms, OfALoopWhoseInputMovesOneState) {
  ContinuousSystem<> S;
  S.A.setZero(7, 7);
  S.A.diagonal() << -0.1, -20.0, -316.0, -0.001, -0.1, -20.0, -20.0;
  S.A(0, 1) = S.A(1, 2) = S.A(4, 5) = S.A(5, 6) = 1.0;
  S.A(3, 4) = -1.0;
  S.A.row(2).head(2) << -372103.0, -11278.0;
  S.A(2, 3) = 2694776.0;
  S.A.row(6).head(4) << -372103.0, -11278.0, -296.0, 2694776.0;
  S.B = MatrixXd::Zero(7, 1);
  S.B(3, 0) = 1.0;
  S.C = MatrixXd::Zero(1, 7);
  S.C(0, 4) = -1.0;
  S.D = scalar(1.0);
  const HInfinityNorm found = h_infinity_norm(S).value();
  double largest = 0.0;
  for (double w = 1e-4; w < 1e5; w *= 1.01) {
    largest = std::max(largest, std::abs(test::response(S, {0.0, w})(0, 0)));
  }
  EXPECT_NEAR(found.norm / largest, 1.0, 1e-3);
}

}  // namespace
// W₁₂ = 0 and W₂₂ = -1e72: what rounding leaves of W₁₂ in balanced units would be 1e40 in the
// second equation.
TEST(Gramian, HoldsInTheGivenUnits) {
  MatrixXd A(2, 2);
  A << -3.0, 4.4580078125e-37, 1.6220703125e+36, 0.0;
  const Gramian found =
      controllability_gramian(A, Eigen::Vector2d(-1.64605712890625, 0.0), TimeDomain::continuous)
          .value();
  const double w = 1.64605712890625 * 1.64605712890625 / 6.0;
  EXPECT_NEAR(found.W(0, 0), w, 1e-15);
  EXPECT_LE(std::abs(found.W(0, 1)), 1e-16 * 1e-36);
  const double last = -1.6220703125e+36 * w / 4.4580078125e-37;
  EXPECT_NEAR(found.W(1, 1), last, 1e-15 * std::abs(last));
}

// W₃₃ = -1.7e-308 times 1.7e308² is most of an entry of the equation, and no double in the units in
// which CᵀC is one: refused rather than answered as zero.
TEST(Gramian, AnEntryThatIsNoDoubleThere) {
  MatrixXd A(4, 4);
  A << -1.66534423828125, -0.8880615234375, 0.0, -1.7095947265625, 2.3e-308, -2.508544921875,
      1e+154, 1.74542236328125, 1.7e+308, 1e+154, -1.97894287109375, 1e+155, -1.9542236328125,
      -1e-154, -1.03662109375, 1e+100;
  MatrixXd C(3, 4);
  C << -1e+20, -1e+20, -1.3004150390625, 1.42120361328125, -0.131591796875, -1e+154,
      0.63519287109375, -1e-154, -1e-154, -0.6903076171875, 1e-20, -1e-16;
  const auto found = observability_gramian(A, C, TimeDomain::discrete);
  ASSERT_FALSE(found);
  EXPECT_TRUE(found.error().is(MatrixEquationError::overflow) ||
              found.error().is(MatrixEquationError::not_accurate));
}

}  // namespace flyball::gramian_test
