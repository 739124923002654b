#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::matrix_function_property_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::epsilon;
using test::exponential;
using test::Law;
using test::LongMatrix;
using test::Plane;
using test::RandomSystem;
using test::wide;

/// M of the plain system in the units of s, and back: D⁻¹MD, DMD⁻¹.
MatrixXd in_units(const RandomSystem& s, const MatrixXd& M) {
  return s.states.cwiseInverse().asDiagonal() * M * s.states.asDiagonal();
}
MatrixXd out_of_units(const RandomSystem& s, const MatrixXd& M) {
  return s.states.asDiagonal() * M * s.states.cwiseInverse().asDiagonal();
}

double largest_frequency(const MatrixXd& A) {
  return test::eigenvalues(A).imag().cwiseAbs().maxCoeff();
}

/// How much larger a relative change of exp(X) is than one of X: the largest of a few directions,
/// at least one.
long double sensitivity(const LongMatrix& X, const LongMatrix& E, Random& random) {
  constexpr double nudge = 1e-9;
  long double largest = 1.0L;
  for (int k = 0; k < 2; ++k) {
    const LongMatrix moved = exponential(test::nudged(X, random, nudge));
    largest = std::max(largest, (moved - E).norm() / (nudge * E.norm()));
  }
  return largest;
}

// exp(A) against its Taylor series in 64 bits, in units of ε times its sensitivity; ‖A‖ from 1e-3
// to 30, in units 1e±8 apart.
TEST(MatrixFunctionProperties, ExponentialIsItsSeries) {
  test::RandomSystems systems(41, Plane::s);
  Random random(42);
  test::Refusals refusals;
  Law law("error / (epsilon sensitivity)");
  for (int trial = 0; trial < 11000; ++trial) {
    const RandomSystem s = systems.next();
    if (s.kind == test::SystemClass::reference && s.A.rows() == 2) {
      // Turned double integrators, of equal eigenvalues: the closed form of a 2x2 has half the
      // digits there.
      continue;
    }
    const MatrixXd plain = test::plain(s).A;
    const MatrixXd A = plain * (std::pow(10.0, random.uniform(-3.0, 1.5)) / plain.norm());
    const auto found = expm(in_units(s, A));
    if (!found) {
      refusals.add(found.error(), trial, s);
      continue;
    }
    const LongMatrix E = exponential(wide(A));
    law.holds((wide(out_of_units(s, *found)) - E).norm() /
                  (epsilon * E.norm() * sensitivity(wide(A), E, random)),
              trial, s);
  }
  refusals.expect_at_most(0);
  law.expect_within(20.0, 9800);
}

// exp(log A) = A, and no eigenvalue of the logarithm is beyond ±iπ: for A = exp(X), and for the
// systems' own A, whose logarithm is refused only for an eigenvalue on the negative real axis.
TEST(MatrixFunctionProperties, LogarithmIsTheInverse) {
  test::RandomSystems systems(43, Plane::z);
  Random random(44);
  test::Refusals refusals;
  Law inverse("error of exp(log A) / (epsilon sensitivity)");
  Law principal("frequency / pi");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    const RandomSystem p = test::plain(s);
    MatrixXd A = p.A;
    if (trial % 4 != 0) {
      const double frequency = largest_frequency(A);
      const double size = std::pow(10.0, random.uniform(-3.0, 0.8)) / A.norm();
      const double limit = frequency > 0.0 ? 0.99 * std::numbers::pi / frequency : size;
      A = exponential(wide(A) * std::min(size, limit)).cast<double>();
    }
    const auto found = logm(in_units(s, A));
    const Eigen::VectorXd sizes = test::singular_values(A);
    if (sizes(sizes.size() - 1) < 1e-10 * sizes(0)) {
      // Singular but for rounding: refused, or that rounding's logarithm.
      EXPECT_TRUE(!found || found->allFinite());
      continue;
    }
    if (!found) {
      const Eigen::VectorXcd values = test::eigenvalues(A);
      const bool negative = (values.real().array() <= 1e-12 * A.norm() &&
                             values.imag().array().abs() <= 1e-7 * A.norm())
                                .any();
      if (trial % 4 != 0 || !negative) {
        refusals.add(found.error(), trial, s);
      }
      continue;
    }
    const MatrixXd L = out_of_units(s, *found);
    const LongMatrix E = exponential(wide(L));
    inverse.holds((E - wide(A)).norm() / (epsilon * A.norm() * sensitivity(wide(L), E, random)),
                  trial, s);
    principal.holds(largest_frequency(L) / std::numbers::pi - 1e-12, trial, s);
  }
  // Turned double integrators, whose equal eigenvalues leave e^X half its digits.
  refusals.expect_at_most(2);
  inverse.expect_within(50.0, 1000.0, 8000);
  principal.expect_within(1.0);
}

LongMatrix whole_power(const LongMatrix& M, int k) {
  LongMatrix P = M;
  for (int i = 1; i < k; ++i) {
    P = (P * M).eval();
  }
  return P;
}

// (A^{1/k})^k = A with eigenvalues within ±π/k; A^{-p}A^p = I; whole powers are products.
TEST(MatrixFunctionProperties, PowersAreRootsAndProducts) {
  test::RandomSystems systems(45, Plane::z);
  Random random(46);
  test::Refusals refusals;
  Law root("error of the root's power");
  Law principal("angle");
  Law inverse("error of the inverse power");
  Law product("error of the product");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    const MatrixXd plain = test::plain(s).A;
    const double frequency = largest_frequency(plain);
    const double size = std::pow(10.0, random.uniform(-3.0, 0.8)) / plain.norm();
    const double limit = frequency > 0.0 ? 0.99 * std::numbers::pi / frequency : size;
    const MatrixXd A = exponential(wide(plain) * std::min(size, limit)).cast<double>();
    const Index n = A.rows();

    const int k = 2 + trial % 6;
    const auto found = powm(in_units(s, A), 1.0 / k);
    const double p = random.uniform(0.05, 2.0);
    const auto up = powm(in_units(s, A), p);
    const auto down = powm(in_units(s, A), -p);
    const auto whole = powm(in_units(s, A), k);
    if (!found || !up || !down || !whole) {
      refusals.add(!found  ? found.error()
                   : !up   ? up.error()
                   : !down ? down.error()
                           : whole.error(),
                   trial, s);
      continue;
    }
    const MatrixXd X = out_of_units(s, *found);
    // Rounding of X comes back k times: Σ Xⁱ dX X^{k-1-i}.
    const LongMatrix power = whole_power(wide(X), k);
    const LongMatrix size_of_terms = whole_power(wide(X).cwiseAbs(), k);
    root.holds((power - wide(A)).norm() / (epsilon * k * size_of_terms.norm()), trial, s);
    double widest = 0.0;
    for (const std::complex<double>& lambda : test::eigenvalues(X)) {
      widest = std::max(widest, std::abs(std::arg(lambda)) * k);
    }
    principal.holds(widest, trial, s);
    const LongMatrix U = wide(out_of_units(s, *up));
    const LongMatrix V = wide(out_of_units(s, *down));
    inverse.holds((U * V - LongMatrix::Identity(n, n)).norm() / (epsilon * U.norm() * V.norm()),
                  trial, s);
    product.holds(((wide(out_of_units(s, *whole)) - whole_power(wide(A), k)).cwiseAbs() -
                   (epsilon * k * static_cast<double>(n)) * whole_power(wide(A).cwiseAbs(), k))
                      .maxCoeff(),
                  trial, s);
  }
  refusals.expect_at_most(9);
  root.expect_within(50.0);
  principal.expect_within(std::numbers::pi * (1.0 + 1e-6));
  inverse.expect_within(200.0);
  product.expect_within(0.0);
}

}  // namespace
}  // namespace flyball::matrix_function_property_test
