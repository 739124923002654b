#include <flyball/classical/frequency_response.hpp>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "classical/transfer_cases.hpp"
#include "math/extended/double_double.hpp"
#include "support/oracle.hpp"

namespace flyball::classical::frequency_response_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using flyball::test::transfer;

constexpr double pi = std::numbers::pi;

double phase_at(const TransferFunction& G, double w) {
  return bode(frequency_response(G).value(), VectorXd::Constant(1, w)).value().curves[0].phase(0);
}

// The phase of each asymptote: -90° an integrator, less 180° of a negative gain, and from there
// what each root turns.
TEST(Bode, PhaseFromTheAsymptote) {
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, 0.0}), 3.0), -90.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({-1.0}, {1.0}), 3.0), -180.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({1.0, 0.0}, {1.0, 1.0}), 1.0), 45.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, 0.0, 0.0, 0.0}), 7.0), -270.0, 1e-12);
  // 1/(s - 1) comes from -180°, (1 - s)/(1 + s) goes to it, 1/(s (s - 1)) begins at -270°.
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, -1.0}), 1.0), -135.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({-1.0, 1.0}, {1.0, 1.0}), 1.0), -90.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, -1.0, 0.0}), 1.0), -225.0, 1e-12);
  // A pole on the axis costs half a turn, a zero gives one, on either side of it.
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, 0.0, 4.0}), 1.9), 0.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({1.0}, {1.0, 0.0, 4.0}), 2.1), -180.0, 1e-12);
  EXPECT_NEAR(phase_at(transfer({1.0, 0.0, 4.0}, {1.0, 2.0, 1.0}), 2.1),
              180.0 - 2.0 * std::atan(2.1) * 180.0 / pi, 1e-12);
  // Nine lags and a delay of ten seconds: far more than one turn.
  double angle = 0.0;
  VectorXd den = VectorXd::Ones(1);
  for (int k = 1; k <= 9; ++k) {
    VectorXd next = VectorXd::Zero(den.size() + 1);
    next.head(den.size()) = den;
    next.tail(den.size()) += k * den;
    den = next;
    angle -= std::atan(50.0 / k);
  }
  const auto lags =
      TransferFunction::create(VectorXd::Ones(1), den, std::nullopt, Time(10.0)).value();
  EXPECT_NEAR(phase_at(lags, 50.0), (angle - 500.0) * 180.0 / pi, 1e-8);
}

// z's: T/(z - 1) loses 90° + ωT/2, 1/z loses ωT, z = 2 outside gives what z = 1/2 inside takes.
TEST(Bode, PhaseOfSampledSystems) {
  const auto sampled = [](std::initializer_list<double> num, std::initializer_list<double> den,
                          double delay = 0.0) {
    const auto list = [](std::initializer_list<double> v) {
      return VectorXd(Eigen::Map<const VectorXd>(v.begin(), static_cast<Index>(v.size())));
    };
    return TransferFunction::create(list(num), list(den), Time(0.1), Time(delay)).value();
  };
  for (const double w : {0.1, 10.0, 31.0}) {
    const double half = 0.05 * w * 180.0 / pi;
    EXPECT_NEAR(phase_at(sampled({0.1}, {1.0, -1.0}), w), -90.0 - half, 1e-10);
    EXPECT_NEAR(phase_at(sampled({0.01}, {1.0, -2.0, 1.0}), w), -180.0 - 2.0 * half, 1e-9);
    EXPECT_NEAR(phase_at(sampled({1.0}, {1.0, 0.0}), w), -2.0 * half, 1e-10);
    EXPECT_NEAR(phase_at(sampled({1.0}, {1.0}, 1.0), w), -20.0 * half, 1e-9);
    EXPECT_NEAR(phase_at(sampled({1.0}, {1.0, -2.0}), w),
                -180.0 - std::arg(std::polar(1.0, 0.1 * w) - 2.0) * 180.0 / pi + 180.0, 1e-9);
  }
}

TransferFunction random_transfer(Random& random, bool discrete) {
  const auto roots = [&](Index count) {
    Eigen::VectorXcd all(count);
    for (Index k = 0; k < count;) {
      const bool pair = k + 1 < count && random.uniform() < 0.6;
      const double size =
          discrete ? 1.3 * random.uniform() : std::pow(10.0, 3.0 * random.uniform() - 1.5);
      Complex r = pair ? std::polar(size, pi * (0.02 + 0.96 * random.uniform()))
                       : Complex(random.uniform() < 0.7 ? -size : size, 0.0);
      all(k) = r;
      if (pair) {
        all(k + 1) = std::conj(r);
      }
      k += pair ? 2 : 1;
    }
    return all;
  };
  const auto n = static_cast<Index>(1 + random.bits() % 7);
  const auto m = static_cast<Index>(random.bits() % static_cast<std::uint64_t>(n + 1));
  return TransferFunction::from_zeros(roots(m), roots(n), random.normal(),
                                      discrete ? std::optional(Time(0.1)) : std::nullopt)
      .value();
}

// The phase is the angle of the value, and between points that are close it does not jump.
TEST(Bode, PhaseIsContinuous) {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const bool discrete = i % 2 == 1;
    const TransferFunction G = random_transfer(random, discrete);
    const auto response = frequency_response(G).value();
    const BodeData data = bode(response).value();
    const auto& curve = data.curves[0];
    ASSERT_GE(data.frequency.size(), 20);
    for (Index k = 0; k < data.frequency.size(); ++k) {
      const Complex value = G.response(data.frequency(k));
      EXPECT_EQ(curve.gain(k), std::abs(value));
      EXPECT_LE(std::abs(std::remainder(curve.phase(k) - std::arg(value) * 180.0 / pi, 360.0)),
                1e-9);
      if (k > 0) {
        EXPECT_LE(std::abs(curve.phase(k) - curve.phase(k - 1)), 120.0);
      }
    }
    // The same system as states: the same phase, from other poles and zeros.
    const auto s = G.to_state_space();
    const BodeData other =
        bode(discrete ? frequency_response(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(0.1)}).value()
                      : frequency_response(s).value(),
             data.frequency)
            .value();
    EXPECT_LE((other.curves[0].phase - curve.phase).cwiseAbs().maxCoeff(), 1e-4) << i;
  }
}

/// What the largest distance of the response from straight lines over log ω is, at many places
/// between the points.
std::pair<double, double> distance_from_lines(const FrequencyResponse& response,
                                              const VectorXd& grid) {
  double gain = 0.0;
  double phase = 0.0;
  for (Index k = 0; k + 1 < grid.size(); ++k) {
    VectorXd inner(9);
    for (int i = 0; i < 9; ++i) {
      inner(i) = grid(k) * std::pow(grid(k + 1) / grid(k), 0.125 * i);
    }
    inner(8) = grid(k + 1);
    const BodeData b = bode(response, inner).value();
    const auto& c = b.curves[0];
    for (int i = 1; i < 8; ++i) {
      const double share = 0.125 * i;
      const double line = (1.0 - share) * std::log10(c.gain(0)) + share * std::log10(c.gain(8));
      gain = std::max(gain, 20.0 * std::abs(std::log10(c.gain(i)) - line));
      phase =
          std::max(phase, std::abs(c.phase(i) - (1.0 - share) * c.phase(0) - share * c.phase(8)));
    }
  }
  return {gain, phase};
}

TEST(FrequencyGrid, IsStraightBetweenItsPoints) {
  Random random(8);
  Index most = 0;
  for (int i = 0; i < 200; ++i) {
    const auto response = frequency_response(random_transfer(random, i % 2 == 1)).value();
    const FrequencyGrid grid = frequency_grid(response).value();
    EXPECT_LE(grid.gain_error, 0.1);
    EXPECT_LE(grid.phase_error, 0.5);
    const auto [gain, phase] = distance_from_lines(response, grid.frequency);
    EXPECT_LE(gain, 0.2) << i;
    EXPECT_LE(phase, 1.0) << i;
    most = std::max(most, grid.frequency.size());
  }
  EXPECT_LE(most, 1500);
}

// ζ = 1e-6 at 3 and a notch as sharp at 40 rad/s: a plain grid of 100 points a decade is 1e4 times
// too coarse for either.
TEST(FrequencyGrid, FindsResonanceAndNotch) {
  const TransferFunction G =
      series(transfer({9.0}, {1.0, 6e-6, 9.0}), transfer({1.0, 8e-5, 1600.0}, {1.0, 80.0, 1600.0}))
          .value();
  const BodeData data = bode(frequency_response(G).value()).value();
  const VectorXd& gain = data.curves[0].gain;
  Index at = 0;
  const double peak = gain.maxCoeff(&at);
  EXPECT_NEAR(peak, std::abs(G.response(3.0)), 0.02 * peak);
  EXPECT_NEAR(data.frequency(at), 3.0, 3e-6);
  const auto notch = (data.frequency.array() - 40.0).abs() < 4.0;
  double lowest = 1.0;
  for (Index k = 0; k < gain.size(); ++k) {
    lowest = notch(k) ? std::min(lowest, gain(k)) : lowest;
  }
  EXPECT_NEAR(lowest, std::abs(G.response(40.0)), 0.02 * lowest);
  EXPECT_LE(data.frequency.size(), 1500);
}

// A peak of 1.7e308 times 50 and more is beyond doubles: there is no point to begin at.
TEST(FrequencyGrid, RefusesAResponseWithoutAFiniteValue) {
  const auto peak = frequency_response(transfer({1.7e308}, {1.0, 0.002, 1.0})).value();
  FrequencyGridOptions near;
  near.low = 0.995;
  near.high = 1.005;
  const auto grid = frequency_grid(peak, near);
  ASSERT_FALSE(grid.has_value());
  EXPECT_TRUE(grid.error().is(ArgumentError::not_finite));
}

TEST(FrequencyGrid, IsBoundedAndGoesWhereItIsTold) {
  // A delay of a thousand turns.
  const auto late = frequency_response(transfer({1.0}, {1.0, 1.0}, 1000.0)).value();
  FrequencyGridOptions few;
  few.most_points = 200;
  few.low = 0.1;
  few.high = 7.0;
  const FrequencyGrid grid = frequency_grid(late, few).value();
  EXPECT_LE(grid.frequency.size(), 200);
  EXPECT_GT(grid.phase_error, 0.5);
  EXPECT_EQ(grid.frequency(0), 0.1);
  EXPECT_NEAR(grid.frequency(grid.frequency.size() - 1), 7.0, 1e-12);
  // A pole on the axis is not among the points, an integrator's crossover is.
  const auto undamped = frequency_response(transfer({1.0}, {1.0, 0.0, 4.0})).value();
  const VectorXd w = frequency_grid(undamped).value().frequency;
  EXPECT_TRUE((w.array() != 2.0).all());
  EXPECT_LE((w.array() - 2.0).abs().minCoeff(), 1e-6);
  const VectorXd crossed =
      frequency_grid(frequency_response(transfer({1e4}, {1.0, 0.0})).value()).value().frequency;
  EXPECT_LE(crossed(0), 1e4);
  EXPECT_GE(crossed(crossed.size() - 1), 1e4);
  // Of a sampled system up to Nyquist, of a gain anywhere.
  const auto filter =
      TransferFunction::create(Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(1.0, 0.0), Time(0.01))
          .value();
  const VectorXd sampled = frequency_grid(frequency_response(filter).value()).value().frequency;
  EXPECT_EQ(sampled(sampled.size() - 1), pi / 0.01);
  EXPECT_GE(
      frequency_grid(frequency_response(transfer({2.0}, {1.0})).value()).value().frequency.size(),
      2);
}

TEST(FrequencyResponse, OfStatesIsThatOfThePolynomials) {
  Random random(21);
  double worst = 0.0;
  for (int i = 0; i < 300; ++i) {
    const bool discrete = i % 2 == 1;
    const TransferFunction G = random_transfer(random, discrete);
    const auto s = G.to_state_space();
    const auto response =
        discrete ? frequency_response(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(0.1)}).value()
                 : frequency_response(s).value();
    const VectorXd w = frequency_grid(frequency_response(G).value()).value().frequency;
    const Eigen::MatrixXcd values = response.sample(w).value();
    for (Index k = 0; k < w.size(); ++k) {
      const Complex expected = G.response(w(k));
      worst = std::max(worst, std::abs(values(0, k) - expected) / std::abs(expected));
    }
  }
  EXPECT_LE(worst, 1e-7);
}

/// C(zI - A)⁻¹B + D in 31 digits, over the reals; z in 19.
Eigen::MatrixXcd in_many_digits(const ContinuousSystem<>& s, long double re, long double im) {
  using flyball::detail::DoubleDoubleMatrix;
  const Index n = s.A.rows();
  const Index m = s.B.cols();
  const Index p = s.C.rows();
  MatrixXd left(2 * n, 2 * n);
  left << -s.A, MatrixXd::Zero(n, n), MatrixXd::Zero(n, n), -s.A;
  DoubleDoubleMatrix z = DoubleDoubleMatrix::zero(2 * n, 2 * n);
  const auto set = [&](Index i, Index j, long double value) {
    z.hi(i, j) = static_cast<double>(value);
    z.lo(i, j) = static_cast<double>(value - static_cast<long double>(z.hi(i, j)));
  };
  for (Index i = 0; i < n; ++i) {
    set(i, i, re);
    set(n + i, n + i, re);
    set(i, n + i, -im);
    set(n + i, i, im);
  }
  MatrixXd right = MatrixXd::Zero(2 * n, m);
  right.topRows(n) = s.B;
  MatrixXd rows = MatrixXd::Zero(2 * p, 2 * n);
  rows.topLeftCorner(p, n) = s.C;
  rows.bottomRightCorner(p, n) = s.C;
  MatrixXd direct = MatrixXd::Zero(2 * p, m);
  direct.topRows(p) = s.D;
  const auto X =
      flyball::detail::solve(sum(DoubleDoubleMatrix(left), 1.0, z), DoubleDoubleMatrix(right));
  const MatrixXd parts =
      add_product(DoubleDoubleMatrix(direct), 1.0, DoubleDoubleMatrix(rows), *X).rounded();
  Eigen::MatrixXcd G = parts.topRows(p).cast<Complex>();
  G.imag() = parts.bottomRows(p);
  return G;
}

// 1e-12 of the largest entry, also where modes are weakly damped, alike, or a chain that falls as
// ω⁻⁸: where a sum over modes cannot have it, it is not asked.
TEST(FrequencyResponse, IsWithinItsGuarantee) {
  Random random(77);
  const char* many = std::getenv("FLYBALL_TEST_RUNS");
  const int runs = many != nullptr ? std::atoi(many) : 120;
  double worst = 0.0;
  for (int i = 0; i < runs; ++i) {
    const bool discrete = i % 2 == 1;
    const Index n = 1 + static_cast<Index>(random.bits() % 12);
    const Index m = 1 + static_cast<Index>(random.bits() % 3);
    const Index p = 1 + static_cast<Index>(random.bits() % 3);
    MatrixXd M(n + p, n + m);
    for (double& entry : M.reshaped()) {
      entry = random.normal();
    }
    ContinuousSystem<> s{M.topLeftCorner(n, n), M.topRightCorner(n, m), M.bottomLeftCorner(p, n),
                         M.bottomRightCorner(p, m)};
    const int kind = i / 2 % 4;
    if (kind == 1) {  // Equal lags in a chain.
      s.A = -MatrixXd::Identity(n, n);
      s.A.diagonal(-1).setOnes();
      s.B.bottomRows(n - 1).setZero();
      s.C.leftCols(n - 1).setZero();
      s.D.setZero();
    }
    const Eigen::VectorXcd at = poles(s.A).value();
    if (kind == 2) {  // One mode almost undamped.
      s.A.diagonal().array() -= at.real().maxCoeff() + 1e-6;
    }
    if (kind == 3) {
      s.D.setZero();
    }
    if (discrete) {
      s.A *= (kind == 2 ? 1.0 - 1e-5 : 0.9) / std::max(1e-3, at.cwiseAbs().maxCoeff());
    }
    const double T = 0.1;
    const auto response =
        discrete ? frequency_response(DiscreteSystem<>{s.A, s.B, s.C, s.D, Time(T)}).value()
                 : frequency_response(s).value();
    VectorXd w(9);
    for (double& entry : w) {
      entry = discrete ? pi / T * random.uniform() : std::pow(10.0, 6.0 * random.uniform() - 3.0);
    }
    w(0) = 0.0;
    if (kind == 2) {
      const Complex pole = poles(s.A).value()(0);
      w(1) = discrete ? std::abs(std::arg(pole)) / T : std::abs(pole.imag());
    }
    const Eigen::MatrixXcd values = response.sample(w).value();
    for (Index k = 0; k < w.size(); ++k) {
      const long double angle = static_cast<long double>(w(k)) * static_cast<long double>(T);
      const Eigen::MatrixXcd expected = discrete
                                            ? in_many_digits(s, std::cos(angle), std::sin(angle))
                                            : in_many_digits(s, 0.0L, w(k));
      const Eigen::MatrixXcd got = values.col(k).reshaped(p, m);
      worst =
          std::max(worst, (got - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
    }
  }
  EXPECT_LE(worst, 1e-12);
}

TEST(FrequencyResponse, EntriesAndDelay) {
  Random random(5);
  MatrixXd M(6, 6);
  for (double& entry : M.reshaped()) {
    entry = random.normal();
  }
  const ContinuousSystem<> s{M.topLeftCorner(4, 4), M.topRightCorner(4, 2),
                             M.bottomLeftCorner(2, 4), M.bottomRightCorner(2, 2)};
  const auto G = frequency_response(s, Time(0.3)).value();
  const Complex p(0.0, 1.7);
  const Eigen::MatrixXcd expected =
      std::exp(-0.3 * p) * (s.C.cast<Complex>() *
                                flyball::test::inverse(Eigen::MatrixXcd(
                                    p * Eigen::MatrixXcd::Identity(4, 4) - s.A.cast<Complex>())) *
                                s.B.cast<Complex>() +
                            s.D.cast<Complex>());
  EXPECT_LE((G.at(1.7) - expected).norm(), 1e-13 * expected.norm());
  EXPECT_LE((G.at_point(p) - expected).norm(), 1e-13 * expected.norm());
  const auto entry = G.entry(1, 0).value();
  EXPECT_EQ(entry.at(1.7)(0, 0), G.at(1.7)(1, 0));
  const BodeData data = bode(G, Eigen::Vector2d(0.5, 1.7)).value();
  ASSERT_EQ(data.curves.size(), 4U);
  EXPECT_EQ(data.curves[1].output, 1);
  EXPECT_EQ(data.curves[1].input, 0);
  EXPECT_NEAR(data.curves[1].gain(1), std::abs(expected(1, 0)), 1e-13);
}

TEST(FrequencyResponse, Refuses) {
  const auto G = frequency_response(transfer({1.0}, {1.0, 1.0})).value();
  EXPECT_EQ(to_string(bode(G, Eigen::Vector2d(2.0, 1.0)).error()),
            "bode: a frequency is 1 rad/s, number 2; it must be above 2 rad/s, the one before it");
  EXPECT_TRUE(bode(G, Eigen::Vector2d(0.0, 1.0)).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(G.sample(VectorXd::Constant(1, std::nan(""))).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(G.entry(1, 0).error().is(ArgumentError::out_of_range));
  const auto sampled =
      frequency_response(DiscreteSystem<>{MatrixXd::Zero(1, 1), MatrixXd::Ones(1, 1),
                                          MatrixXd::Ones(1, 1), MatrixXd::Zero(1, 1), Time(0.1)});
  EXPECT_TRUE(
      sampled.value().sample(VectorXd::Constant(1, 40.0)).error().is(ArgumentError::out_of_range));
  FrequencyGridOptions bad;
  bad.low = 3.0;
  bad.high = 2.0;
  EXPECT_TRUE(frequency_grid(G, bad).error().is(ArgumentError::out_of_range));
  bad = {};
  bad.gain_tolerance = 0.0;
  EXPECT_TRUE(frequency_grid(G, bad).error().is(ArgumentError::not_positive));
  ContinuousSystem<> wrong{MatrixXd::Zero(2, 2), MatrixXd::Ones(1, 1), MatrixXd::Ones(1, 2),
                           MatrixXd::Zero(1, 1)};
  EXPECT_TRUE(frequency_response(wrong).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::classical::frequency_response_test
