#include <flyball/systems/descriptor.hpp>

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::descriptor_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::random_matrix;

constexpr Complex points[] = {{0.3, 0.7}, {-0.2, 2.0}, {4.0, 0.0}};

/// A pencil diag(I, N), diag(J, I) in other coordinates and equations, N of the given index.
DescriptorSystem random_descriptor(Random& random, Index finite, Index infinite, bool nilpotent) {
  const Index n = finite + infinite;
  MatrixXd E = MatrixXd::Zero(n, n);
  MatrixXd A = MatrixXd::Identity(n, n);
  E.topLeftCorner(finite, finite).setIdentity();
  A.topLeftCorner(finite, finite) = random_matrix(random, finite, finite);
  for (Index k = 1; nilpotent && k < infinite; ++k) {
    E(finite + k - 1, finite + k) = 0.5 + random.uniform();
  }
  const MatrixXd left = MatrixXd::Identity(n, n) + 0.3 * random_matrix(random, n, n);
  const MatrixXd right = MatrixXd::Identity(n, n) + 0.3 * random_matrix(random, n, n);
  return {left * E * right, left * A * right, random_matrix(random, n, 2),
          random_matrix(random, 2, n), random_matrix(random, 2, 2)};
}

// G = C (sI - A)⁻¹B + D + Σ Pₖ sᵏ of the parts is C (sE - A)⁻¹B + D of the whole.
TEST(Descriptor, PartsAddUp) {
  Random random(9);
  double worst = 0.0;
  for (int trial = 0; trial < 500; ++trial) {
    const auto finite = static_cast<Index>(random.bits() % 4);
    const auto infinite = static_cast<Index>(1 + random.bits() % 3);
    const bool nilpotent = random.bits() % 2 == 0;
    const DescriptorSystem s = random_descriptor(random, finite, infinite, nilpotent);
    const auto analysis = analyze_descriptor(s);
    if (!analysis) {
      EXPECT_TRUE(analysis.error().is(SystemError::no_convergence));
      continue;
    }
    EXPECT_EQ(analysis->infinite, infinite) << trial;
    EXPECT_EQ(analysis->index, nilpotent ? infinite : 1) << trial;
    const DescriptorParts parts = descriptor_parts(s).value();
    EXPECT_EQ(parts.powers.size(), nilpotent ? static_cast<std::size_t>(infinite - 1) : 0U)
        << trial;
    for (const Complex& at : points) {
      const MatrixXcd G = test::solve(MatrixXcd(at * s.E.cast<Complex>() - s.A.cast<Complex>()),
                                      MatrixXcd(s.B.cast<Complex>()));
      const MatrixXcd expected = s.C.cast<Complex>() * G + s.D.cast<Complex>();
      MatrixXcd got =
          test::response(parts.proper.A, parts.proper.B, parts.proper.C, parts.proper.D, at);
      Complex power = 1.0;
      for (const MatrixXd& P : parts.powers) {
        power *= at;
        got += power * P.cast<Complex>();
      }
      const double size = expected.norm() + parts.proper.D.norm() +
                          (parts.powers.empty() ? 0.0 : parts.powers.back().norm());
      worst = std::max(worst, (got - expected).norm() / size);
      worst = std::max(worst, (transfer_at(s, at).value() - expected).norm() / size);
    }
    // At a finite pole the pencil is singular.
    ASSERT_EQ(analysis->poles.size(), finite);
    for (const Complex& pole : analysis->poles) {
      const Eigen::VectorXd values =
          test::singular_values(MatrixXcd(pole * s.E.cast<Complex>() - s.A.cast<Complex>()));
      EXPECT_LE(values(values.size() - 1), 1e-8 * values(0)) << trial;
    }
  }
  EXPECT_LE(worst, 1e-6);
}

// (2s² + 3s + 4)/(s + 5) = 2s - 7 + 39/(s + 5).
TEST(Descriptor, ImproperTransferFunctions) {
  const auto s = to_descriptor(VectorXd{{2.0, 3.0, 4.0}}, VectorXd{{1.0, 5.0}}).value();
  const auto analysis = analyze_descriptor(s).value();
  ASSERT_EQ(analysis.poles.size(), 1);
  EXPECT_LE(std::abs(analysis.poles(0) + 5.0), 1e-14);
  EXPECT_EQ(analysis.infinite, 2);
  EXPECT_EQ(analysis.index, 2);
  const auto parts = descriptor_parts(s).value();
  ASSERT_EQ(parts.powers.size(), 1U);
  EXPECT_NEAR(parts.powers[0](0, 0), 2.0, 1e-14);
  EXPECT_NEAR(parts.proper.D(0, 0), -7.0, 1e-13);
  EXPECT_EQ(to_string(to_standard(s).error()),
            "to_standard: the transfer matrix is improper: it grows like s^1; it must be proper; a "
            "standard system does not differentiate; add a pole that ends it");
  // s², and 3.
  const auto square = to_descriptor(VectorXd{{1.0, 0.0, 0.0}}, VectorXd{{1.0}}).value();
  EXPECT_LE(std::abs(transfer_at(square, {0.0, 3.0}).value()(0, 0) + 9.0), 1e-14);
  EXPECT_EQ(analyze_descriptor(square).value().index, 3);
  const auto three = to_descriptor(VectorXd{{6.0}}, VectorXd{{2.0}}).value();
  EXPECT_EQ(to_standard(three).value().D(0, 0), 3.0);
  // A proper one is standard.
  const auto proper = to_descriptor(VectorXd{{1.0}}, VectorXd{{1.0, 3.0, 2.0}}).value();
  EXPECT_EQ(analyze_descriptor(proper).value().index, 0);
  EXPECT_LE((test::response(to_standard(proper).value().A, to_standard(proper).value().B,
                            to_standard(proper).value().C, to_standard(proper).value().D, 1.0) -
             MatrixXcd::Constant(1, 1, 1.0 / 6.0))
                .norm(),
            1e-14);
}

// G⁻¹G = I, for strictly proper systems too.
TEST(Descriptor, Inverses) {
  Random random(17);
  double worst = 0.0;
  for (int trial = 0; trial < 300; ++trial) {
    ContinuousSystem<> G = test::random_system(random, 3, 2, 2);
    if (trial % 2 == 0) {
      G.D.setZero();
    }
    const auto s = to_descriptor(G).value();
    const auto turned = inverse(s).value();
    for (const Complex& at : points) {
      const MatrixXcd g = transfer_at(s, at).value();
      const MatrixXcd back = transfer_at(turned, at).value();
      worst = std::max(
          worst, (back * g - MatrixXcd::Identity(2, 2)).norm() / (1.0 + back.norm() * g.norm()));
      const MatrixXcd both = transfer_at(series(s, turned).value(), at).value();
      worst = std::max(
          worst, (both - MatrixXcd::Identity(2, 2)).norm() * 1e-3 / (1.0 + back.norm() * g.norm()));
    }
  }
  EXPECT_LE(worst, 1e-11);
}

TEST(Descriptor, Errors) {
  const MatrixXd one = MatrixXd::Ones(1, 1);
  // 0 x' = 0 x + u has no solution.
  const DescriptorSystem singular{0.0 * one, 0.0 * one, one, one, one};
  EXPECT_TRUE(analyze_descriptor(singular).error().is(SystemError::singular_transform));
  EXPECT_TRUE(transfer_at(singular, 1.0).error().is(SystemError::no_image));
  EXPECT_TRUE(descriptor_parts(singular).error().is(SystemError::singular_transform));
  const DescriptorSystem s{one, -one, one, one, one};
  EXPECT_TRUE(transfer_at(s, {NAN, 0.0}).error().is(ArgumentError::not_finite));
  EXPECT_TRUE(transfer_at(s, {-1.0, 0.0}).error().is(SystemError::no_image));
  EXPECT_TRUE(
      inverse({one, -one, 0.0 * one, one, 0.0 * one}).error().is(SystemError::singular_transform));
  EXPECT_TRUE(inverse({one, -one, one, MatrixXd::Ones(2, 1), MatrixXd::Ones(2, 1)})
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(series(s, {one, one, MatrixXd::Ones(1, 2), one, MatrixXd::Ones(1, 2)})
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(analyze_descriptor({MatrixXd::Ones(2, 2), one, one, one, one})
                  .error()
                  .is(ArgumentError::wrong_shape));
  EXPECT_TRUE(to_descriptor(VectorXd(0), VectorXd::Ones(1)).error().is(ArgumentError::empty));
  EXPECT_TRUE(
      to_descriptor(VectorXd::Ones(1), VectorXd::Zero(2)).error().is(SystemError::zero_transfer));
  EXPECT_TRUE(to_descriptor(VectorXd::Constant(1, NAN), VectorXd::Ones(1))
                  .error()
                  .is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::descriptor_test
