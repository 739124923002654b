#include <flyball/control/certificate.hpp>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "control/regulated_plant.hpp"
#include "math/dense/dense.hpp"
#include "math/extended/double_double.hpp"

namespace flyball::certificate_test {
namespace {

using namespace test;
using detail::DoubleDoubleMatrix;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double T = 0.5;
constexpr double k = 8.0;

/// dx/dt = g u, u = -8 x, each half second: the pole is 1 - κ, κ = 4 g.
UncertainLoop integrator(const ParameterSet& set) {
  const MatrixXd none(0, 0);
  return {LinearPlantFamily{scalar(0.0), scalar(1.0), {}, {}, {}, {}},
          scalar(1.0),
          Time(T),
          none,
          MatrixXd(0, 1),
          MatrixXd(1, 0),
          scalar(k),
          set};
}

UncertainLoop integrator(double gain_low, double gain_high, double delay_low, double delay_high) {
  return integrator(parameter_box({gain_low, delay_low}, {gain_high, delay_high}).value());
}

LoopCertificate certified(const UncertainLoop& loop, bool keep = false) {
  return certify_loop(loop, {.keep_proof = keep}).value();
}

// Stable for 0 < g < 1/2 and for no other gain.
TEST(Certificate, KnowsTheGainWhereAnIntegratorBreaks) {
  EXPECT_EQ(certified(integrator(0.01, 0.4999999, 0.0, 0.0)).verdict, LoopVerdict::stable);
  const auto beyond = certified(integrator(0.01, 0.5000001, 0.0, 0.0));
  EXPECT_EQ(beyond.verdict, LoopVerdict::unstable);
  EXPECT_GT(beyond.worst.parameters(0), 0.5);
  EXPECT_GT(beyond.worst.spectral_radius, 1.0);
  const auto below = certified(integrator(-1e-6, 0.4, 0.0, 0.0));
  EXPECT_EQ(below.verdict, LoopVerdict::unstable);
  EXPECT_LT(below.worst.parameters(0), 0.0);
  // On the border the pole is -1: no proof, of either.
  EXPECT_NE(certified(integrator(0.01, 0.5, 0.0, 0.0)).verdict, LoopVerdict::stable);
}

// S - T = (z - 1 - κ)/(z - 1 + κ) is largest at z = -1: α = 2 (2 - κ)/(2 + κ). The slowest pole of
// κ from 0.4 to 1.2 is 0.6.
TEST(Certificate, MarginsAreThoseOfTheWorstMember) {
  const auto answer = certified(integrator(0.1, 0.3, 0.0, 0.0));
  ASSERT_EQ(answer.verdict, LoopVerdict::stable);
  const double exact = 2.0 * (2.0 - 1.2) / (2.0 + 1.2);
  EXPECT_NEAR(answer.worst.disk_margin, exact, 1e-9);
  EXPECT_NEAR(answer.disk_margin, 0.95 * exact, 1e-9);
  EXPECT_NEAR(answer.worst.parameters(0), 0.3, 1e-12);
  EXPECT_NEAR(answer.slowest.spectral_radius, 0.6, 1e-9);
  EXPECT_GE(answer.decay, 0.6);
  EXPECT_LE(answer.decay, 0.7);
  const double a = 0.5 * answer.disk_margin;
  EXPECT_DOUBLE_EQ(answer.gain_up, (1.0 + a) / (1.0 - a));
  EXPECT_DOUBLE_EQ(answer.gain_up * answer.gain_down, 1.0);
  EXPECT_NEAR(answer.phase_margin, 2.0 * std::atan(a) * 180.0 / M_PI, 1e-12);
}

// With a delay of f periods, z² - (1 - κ(1 - f)) z + κ f is stable iff κ f < 1 and κ(1 - 2f) < 2:
// over f from 0 to 0.4 the gain's limit is κ = 2, at f = 0; over 0.4 to 0.6 it is 1/0.6; and past a
// period, z³ - z² + κ(2 - f) z + κ(f - 1), it is that of f = 1.2.
TEST(Certificate, KnowsTheDelaysWhereAnIntegratorBreaks) {
  const auto verdict = [](double kappa, double from, double to) {
    return certified(integrator(0.05, kappa / 4.0, from * T, to * T)).verdict;
  };
  EXPECT_EQ(verdict(1.999, 0.0, 0.4), LoopVerdict::stable);
  EXPECT_EQ(verdict(2.001, 0.0, 0.4), LoopVerdict::unstable);
  EXPECT_EQ(verdict(1.665, 0.4, 0.6), LoopVerdict::stable);
  EXPECT_EQ(verdict(1.668, 0.4, 0.6), LoopVerdict::unstable);
  // z³ - z² + κ(2 - f) z + κ(f - 1) at f = 1.2: Jury's 1 - a² = |b - a c| with a = 0.2 κ.
  double low = 0.1;
  double high = 2.0;
  for (int i = 0; i < 100; ++i) {
    const double kappa = 0.5 * (low + high);
    const double c = 0.2 * kappa;
    const bool stable = 1.0 - c * c > std::abs(0.8 * kappa + c);
    (stable ? low : high) = kappa;
  }
  EXPECT_EQ(verdict(low - 1e-3, 0.7, 1.2), LoopVerdict::stable);
  EXPECT_EQ(verdict(low + 1e-3, 0.7, 1.2), LoopVerdict::unstable);
}

// B = p_0 + p_1 with p in a ball about (0.125, 0.125) of radius 0.15: κ <= 4 (0.25 + 0.15 √2) =
// 1.85, while the box would reach 2.2.
TEST(Certificate, ABallIsLessThanItsBox) {
  UncertainLoop loop = integrator(0.1, 0.2, 0.0, 0.0);
  loop.plant = LinearPlantFamily{scalar(0.0), scalar(0.0), {}, {scalar(1.0), scalar(1.0)}, {}, {}};
  loop.set = {Eigen::Vector4d(0.125, 0.125, 1.0, 0.0), MatrixXd::Zero(4, 2), 2};
  loop.set.axes.topRows(2) = 0.15 * MatrixXd::Identity(2, 2);
  const auto ball = certified(loop);
  EXPECT_EQ(ball.verdict, LoopVerdict::stable);
  EXPECT_NEAR(ball.worst.disk_margin,
              2.0 * (1.0 - 0.6 * std::sqrt(2.0)) / (3.0 + 0.6 * std::sqrt(2.0)), 1e-3);
  loop.set.round = 0;
  EXPECT_EQ(certified(loop).verdict, LoopVerdict::unstable);
}

// dx/dt = g u, u = -x delayed by d periods: stable iff κ < 2 sin(π/(2(2d + 1))) (Levin and May).
// Many states end in time and memory, proven where one function does it, and without a wrong word.
TEST(Certificate, AnswersOfLongDelaysInTime) {
  for (const int d : {10, 30, 80}) {
    const double limit = 2.0 * std::sin(std::acos(-1.0) / (2.0 * (2.0 * d + 1.0))) / 4.0;
    const auto verdict = [&](double low, double high) {
      return certify_loop(integrator(low * limit, high * limit, d * T, d * T),
                          {.most_work = 3e8, .margins = false})
          .value()
          .verdict;
    };
    EXPECT_EQ(verdict(0.5, 0.5), LoopVerdict::stable) << d;
    EXPECT_EQ(verdict(0.5, 1.01), LoopVerdict::unstable) << d;
    EXPECT_NE(verdict(0.5, 0.9), LoopVerdict::unstable) << d;
  }
}

UncertainLoop elevator_loop(double delay, std::variant<LinearPlantFamily, MechanismFamily> family,
                            const ParameterSet& set) {
  const Regulated design = regulated_elevator();
  const auto nominal = observer_regulator_loop(design.truth.A, design.truth.B, design.truth.C,
                                               design.model, design.K, design.K_e, Time(delay));
  return {std::move(family), nominal->C,   nominal->period, nominal->A_c,
          nominal->B_c,      nominal->C_c, nominal->D_c,    set};
}

UncertainLoop elevator_loop(double spread) {
  return elevator_loop(0.0, MechanismFamily{},
                       parameter_box({4.0, 0.3 * (1.0 - spread), 1.0 - spread, 0.0},
                                     {4.0, 0.3 * (1.0 + spread), 1.0 + spread, 0.005})
                           .value());
}

// diag(1, kA) dx/dt = [0 1; 0 -kV] x + [0; 1] u, written both ways.
TEST(Certificate, AMechanismIsADescriptorSystem) {
  const ParameterSet set = parameter_box({3.9, 0.25, 0.9, 0.0}, {4.1, 0.35, 1.1, 0.0}).value();
  const MatrixXd last{{0.0, 0.0}, {0.0, 1.0}};
  const LinearPlantFamily descriptor{
      MatrixXd{{0.0, 1.0}, {0.0, 0.0}}, MatrixXd{{0.0}, {1.0}},
      {-last, MatrixXd::Zero(2, 2)},    {},
      MatrixXd{{1.0, 0.0}, {0.0, 0.0}}, {MatrixXd::Zero(2, 2), last}};
  const auto one = certified(elevator_loop(0.0, MechanismFamily{}, set));
  const auto other = certified(elevator_loop(0.0, descriptor, set));
  EXPECT_EQ(one.verdict, LoopVerdict::stable);
  EXPECT_EQ(other.verdict, LoopVerdict::stable);
  EXPECT_NEAR(one.disk_margin, other.disk_margin, 1e-9);
  ParameterSet logarithmic = set;
  logarithmic.centre(1) = std::log(0.3);
  logarithmic.axes *= 0.1;
  EXPECT_EQ(
      certified(elevator_loop(0.0, MechanismFamily{.logarithmic = true}, logarithmic)).verdict,
      LoopVerdict::stable);
}

// A velocity that follows its voltage at once is the limit of ever smaller kA.
TEST(Certificate, InertiaMayBeNothing) {
  const auto from = [](double low) {
    return certified(elevator_loop(
        0.0, MechanismFamily{}, parameter_box({4.0, low, 1.0, 0.0}, {4.0, 0.3, 1.0, 0.0}).value()));
  };
  const auto nothing = from(0.0);
  const auto little = from(1e-4);
  EXPECT_EQ(nothing.verdict, little.verdict);
  EXPECT_NEAR(nothing.worst.disk_margin, little.worst.disk_margin, 0.01);
  const auto point = certified(elevator_loop(
      0.0, MechanismFamily{}, parameter_box({4.0, 0.0, 1.0, 0.0}, {4.0, 0.0, 1.0, 0.0}).value()));
  EXPECT_NE(point.verdict, LoopVerdict::undecided);
}

// What is claimed of all members holds for many, by the margins' own code.
TEST(Certificate, MembersHaveWhatIsClaimed) {
  const UncertainLoop loop = elevator_loop(0.2);
  const auto answer = certified(loop);
  ASSERT_EQ(answer.verdict, LoopVerdict::stable);
  EXPECT_GT(answer.disk_margin, 0.9 * answer.worst.disk_margin);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> side(-1.0, 1.0);
  double least = 2.0;
  for (int i = 0; i < 400; ++i) {
    VectorXd z(loop.set.axes.cols());
    for (double& x : z) {
      x = i < 200 ? side(random) : std::copysign(1.0, side(random));
    }
    const auto member = loop_of(loop, loop.set.centre + loop.set.axes * z).value();
    EXPECT_LT(closed_loop_radius(member).value(), answer.decay);
    const auto margins = stability_margins(member).value();
    EXPECT_GE(margins.disk_margin, answer.disk_margin);
    EXPECT_GE(margins.gain_margin_up, answer.gain_up);
    EXPECT_GE(margins.phase_margin, answer.phase_margin);
    least = std::min(least, margins.disk_margin);
  }
  EXPECT_NEAR(least, answer.worst.disk_margin, 1e-3);
}

// e^{At} of a matrix in 31 digits: its series on a 2^-12 of it, squared.
DoubleDoubleMatrix exponential(const MatrixXd& H) {
  constexpr int squarings = 12;
  const DoubleDoubleMatrix small =
      detail::scaled(DoubleDoubleMatrix(H), std::ldexp(1.0, -squarings));
  const Index n = H.rows();
  DoubleDoubleMatrix sum = DoubleDoubleMatrix::identity(n);
  for (int j = 16; j >= 1; --j) {
    const DoubleDoubleMatrix divisor(MatrixXd::Identity(n, n) * j);
    sum = detail::sum(DoubleDoubleMatrix::identity(n), 1.0,
                      *detail::solve(divisor, detail::product(small, sum)));
  }
  for (int j = 0; j < squarings; ++j) {
    sum = detail::product(sum, sum);
  }
  return sum;
}

/// A sampled loop of an elevator with a delay below a period, from its equations in 31 digits:
/// [x; gain u_{k-1}; controller].
DoubleDoubleMatrix closed_loop(const UncertainLoop& loop, const VectorXd& p) {
  const auto gamma = [&](double time) {
    MatrixXd H = MatrixXd::Zero(3, 3);
    H(0, 1) = 1.0;
    H(1, 1) = -p(0) / p(1);
    H(1, 2) = 1.0 / p(1);
    return exponential(H * time);
  };
  const double period = loop.period.si();
  const DoubleDoubleMatrix whole = gamma(period);
  const DoubleDoubleMatrix newer = gamma(period - p(3)).block(0, 2, 2, 1);
  const DoubleDoubleMatrix older = detail::sum(whole.block(0, 2, 2, 1), -1.0, newer);
  const Index q = loop.A_c.rows();
  const Index n = 3 + q;
  DoubleDoubleMatrix M = DoubleDoubleMatrix::zero(n, n);
  const auto put = [&](Index i, Index j, const DoubleDoubleMatrix& part) {
    M.hi.block(i, j, part.rows(), part.cols()) = part.hi;
    M.lo.block(i, j, part.rows(), part.cols()) = part.lo;
  };
  put(0, 0, whole.block(0, 0, 2, 2));
  put(0, 2, older);
  put(3, 3, DoubleDoubleMatrix(loop.A_c));
  put(3, 0, detail::product(DoubleDoubleMatrix(loop.B_c), DoubleDoubleMatrix(loop.C)));
  DoubleDoubleMatrix input = DoubleDoubleMatrix::zero(n, 1);
  const DoubleDoubleMatrix driven = detail::product(newer, DoubleDoubleMatrix(scalar(p(2))));
  input.hi.topRows(2) = driven.hi;
  input.lo.topRows(2) = driven.lo;
  input.hi(2, 0) = p(2);
  DoubleDoubleMatrix V = DoubleDoubleMatrix::zero(1, n);
  const auto direct = detail::product(DoubleDoubleMatrix(loop.D_c), DoubleDoubleMatrix(loop.C));
  V.hi.leftCols(2) = direct.hi;
  V.lo.leftCols(2) = direct.lo;
  V.hi.rightCols(q) = loop.C_c;
  return detail::add_product(M, -1.0, input, V);
}

// The proof, held against members whose loops come from their equations in 31 digits: each of them
// lies in a piece, and the piece's form falls by what is claimed.
TEST(Certificate, ProofHoldsInThirtyOneDigits) {
  UncertainLoop loop = elevator_loop(0.15);
  loop.set = parameter_box({4.0, 0.26, 0.85, 0.002}, {4.0, 0.34, 1.15, 0.005}).value();
  const auto answer = certified(loop, /*keep=*/true);
  ASSERT_EQ(answer.verdict, LoopVerdict::stable);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> side(-1.0, 1.0);
  int held = 0;
  for (int i = 0; i < 300; ++i) {
    VectorXd z(loop.set.axes.cols());
    for (double& x : z) {
      x = i % 2 == 0 ? side(random) : std::copysign(1.0 - 1e-12, side(random));
    }
    const VectorXd p = loop.set.centre + loop.set.axes * z;
    const DoubleDoubleMatrix M = closed_loop(loop, p);
    int decays = 0;
    for (const CertifiedPiece& piece : answer.proof) {
      const bool inside = ((z - piece.middle).cwiseAbs() - piece.half).maxCoeff() <= 0.0;
      if (!inside || piece.disk_margin > 0.0) {
        continue;
      }
      ++decays;
      // λ²I - WᵀW with W = T M T⁻¹.
      const DoubleDoubleMatrix factor(piece.T);
      const auto TM = detail::product(factor, M);
      const auto Wt = *detail::solve(factor.transpose(), TM.transpose());
      const auto square = detail::product(Wt, Wt.transpose());
      const MatrixXd room =
          detail::shifted_diagonal(detail::scaled(square, -1.0), piece.decay * piece.decay)
              .rounded();
      EXPECT_TRUE(detail::cholesky_of(room).has_value());
      ++held;
    }
    EXPECT_GE(decays, 1) << z.transpose();
  }
  EXPECT_GE(held, 300);
}

TEST(Certificate, IsTheSameEachTime) {
  const auto one = certified(elevator_loop(0.2), true);
  const auto other = certified(elevator_loop(0.2), true);
  EXPECT_EQ(one.pieces, other.pieces);
  EXPECT_EQ(one.disk_margin, other.disk_margin);
  ASSERT_EQ(one.proof.size(), other.proof.size());
  for (std::size_t i = 0; i < one.proof.size(); ++i) {
    EXPECT_EQ(one.proof[i].T, other.proof[i].T);
  }
}

// A set that cannot be done in the work that is allowed is said to be open, with how much of it.
TEST(Certificate, WorkIsBounded) {
  const auto answer =
      certify_loop(elevator_loop(0.3), {.most_pieces = 1, .margins = false}).value();
  if (answer.verdict == LoopVerdict::undecided) {
    EXPECT_GT(answer.undecided_share, 0.0);
    EXPECT_LE(answer.undecided_share, 1.0);
  }
  EXPECT_LE(answer.pieces, 1);
  // Without feedback the integrator stays where it is, which nothing shows or refutes. Inputs under
  // way are work, too: a piece of 80 periods takes as much as fifty of none.
  const auto pieces = [](double delay) {
    const auto open = certify_loop(integrator(0.0, 0.0, 0.0, delay),
                                   {.most_pieces = 100'000, .most_work = 2e7, .margins = false})
                          .value();
    EXPECT_EQ(open.verdict, LoopVerdict::undecided);
    return open.pieces;
  };
  EXPECT_LT(pieces(80.0 * T), 100);
  EXPECT_GT(pieces(T), pieces(80.0 * T));
}

TEST(Certificate, Errors) {
  EXPECT_TRUE(parameter_box({1.0}, {1.0}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(parameter_box({1.0, 0.0}, {0.5, 0.0}).error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(parameter_box({NAN, 0.0}, {0.5, 0.0}).error().is(ArgumentError::not_finite));
  UncertainLoop loop = integrator(0.1, 0.2, 0.0, 0.0);
  loop.D_c = MatrixXd::Zero(1, 2);
  EXPECT_TRUE(certify_loop(loop).error().is(ArgumentError::wrong_shape));
  loop = integrator(0.1, 0.2, -0.2, -0.1);
  EXPECT_TRUE(certify_loop(loop).error().is(ArgumentError::out_of_range));
  loop = integrator(0.1, 0.2, 0.0, 1000.0);
  EXPECT_EQ(to_string(certify_loop(loop).error()),
            "certify_loop: the set's largest delay is 1000 s; it must be 250 periods or less");
  loop = integrator(0.1, 0.2, 0.0, 0.0);
  loop.set.axes = MatrixXd::Zero(2, 7);
  EXPECT_TRUE(certify_loop(loop).error().is(ArgumentError::out_of_range));
  loop = elevator_loop(0.1);
  loop.set.centre(0) = -1.0;
  EXPECT_TRUE(certify_loop(loop).error().is(ArgumentError::not_positive));
  EXPECT_TRUE(loop_of(integrator(0.1, 0.2, 0.0, 0.0), VectorXd::Zero(5))
                  .error()
                  .is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace flyball::certificate_test
