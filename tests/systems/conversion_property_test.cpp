#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/sampled_cost.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::conversion_property_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::epsilon;
using test::Law;
using test::LongMatrix;
using test::Plane;
using test::RandomSystem;
using test::wide;

/// eˣ, φ₁ = (eˣ - 1)/x and φ₂ = (eˣ - 1 - x)/x²: their series at x/2ᵏ, then
/// φ₂(2x) = (φ₁(x)² + 2φ₂(x))/4, φ₁(2x) = (eˣ + 1)φ₁(x)/2.
struct Holds {
  LongMatrix exponential, one, two;

  explicit Holds(const LongMatrix& X) {
    const Index n = X.rows();
    const LongMatrix I = LongMatrix::Identity(n, n);
    int halvings = 0;
    while (std::ldexp(X.norm(), -halvings) > 0.25L) {
      ++halvings;
    }
    const LongMatrix x = X * std::ldexp(1.0L, -halvings);
    LongMatrix term = 0.5L * I;
    two = term;
    for (int k = 3; k < 20; ++k) {
      term = (term * x / k).eval();
      two += term;
    }
    one = I + x * two;
    exponential = I + x * one;
    for (int k = 0; k < halvings; ++k) {
      two = (0.25L * (one * one + 2.0L * two)).eval();
      one = (0.5L * (exponential * one + one)).eval();
      exponential = (exponential * exponential).eval();
    }
  }
};

/// Without the units of s.
template <class System>
System out_of_units(const RandomSystem& s, System system) {
  const auto x = s.states.asDiagonal();
  const Eigen::VectorXd x_inverse = s.states.cwiseInverse();
  const Eigen::VectorXd u_inverse = s.inputs.cwiseInverse();
  system.A = (x * system.A * x_inverse.asDiagonal()).eval();
  system.B = (x * system.B * u_inverse.asDiagonal()).eval();
  system.C = (s.outputs.asDiagonal() * system.C * x_inverse.asDiagonal()).eval();
  system.D = (s.outputs.asDiagonal() * system.D * u_inverse.asDiagonal()).eval();
  return system;
}

/// What is left of the equations that tie a discrete system to a continuous one, in units of ε
/// times their terms.
class Ties {
 public:
  explicit Ties(const std::string& name)
      : A_(name + " A"), B_(name + " B"), C_(name + " C"), D_(name + " D") {}

  /// A_d = e^{AT}; zoh: B_d = T φ₁ B; foh: B_d = T φ₁² B, D_d = D + C T φ₂ B. A changes by ε of
  /// itself, and eˣ and φ as much more as the exponential's sensitivity says.
  void hold(const RandomSystem& s, const ContinuousSystem<>& c, const DiscreteSystem<>& d, double T,
            bool first_order, Random& random, int trial) {
    const LongMatrix X = wide(c.A) * T;
    const Holds holds(X);
    constexpr double nudge = 1e-9;
    long double sensitivity = 1.0L;
    for (int k = 0; k < 2; ++k) {
      const LongMatrix moved = test::exponential(test::nudged(X, random, nudge));
      sensitivity = std::max(
          sensitivity, (moved - holds.exponential).norm() / (nudge * holds.exponential.norm()));
    }
    const long double unit = epsilon * sensitivity;
    A_.holds((wide(d.A) - holds.exponential).norm() / (unit * holds.exponential.norm()), trial, s);
    const LongMatrix B = wide(c.B) * T;
    const LongMatrix C = wide(c.C);
    if (!first_order) {
      B_.holds((wide(d.B) - holds.one * B).norm() / (unit * holds.one.norm() * B.norm()), trial, s);
      C_.holds((wide(d.C) - C).norm(), trial, s);
      D_.holds((d.D - c.D).norm(), trial, s);
      return;
    }
    const LongMatrix CB = C * holds.two * B;
    B_.holds((wide(d.B) - holds.one * (holds.one * B)).norm() /
                 (unit * holds.one.squaredNorm() * B.norm()),
             trial, s);
    C_.holds((wide(d.C) - C).norm(), trial, s);
    D_.holds((wide(d.D) - wide(c.D) - CB).norm() /
                 (unit * (C.norm() * holds.two.norm() * B.norm() + c.D.norm())),
             trial, s);
  }

  /// (I - θTA) A_d = I + (1 - θ)TA, (I - θTA) B_d = T B, C_d (I - θTA) = C, D_d = D + θ C B_d.
  /// forward Euler: θ = 0, backward: 1, bilinear: 1/2.
  void hold(const RandomSystem& s, const ContinuousSystem<>& c, const DiscreteSystem<>& d, double T,
            long double theta, int trial) {
    const LongMatrix A = wide(c.A) * static_cast<long double>(T);
    const LongMatrix I = LongMatrix::Identity(A.rows(), A.cols());
    const LongMatrix E = I - theta * A;
    const LongMatrix CB = theta * wide(c.C) * wide(d.B);
    const long double size = 1.0L + theta * A.norm();
    A_.holds((E * wide(d.A) - I - (1.0L - theta) * A).norm() /
                 (epsilon * (size * d.A.norm() + A.norm())),
             trial, s);
    B_.holds((E * wide(d.B) - wide(c.B) * static_cast<long double>(T)).norm() /
                 (epsilon * (size * d.B.norm() + T * c.B.norm())),
             trial, s);
    C_.holds((wide(d.C) * E - wide(c.C)).norm() / (epsilon * (size * d.C.norm() + c.C.norm())),
             trial, s);
    D_.holds((wide(d.D) - wide(c.D) - CB).norm() /
                 (epsilon * (d.D.norm() + c.D.norm() + theta * c.C.norm() * d.B.norm())),
             trial, s);
  }

  void expect_within(double bound) const {
    for (const Law* law : {&A_, &B_, &C_, &D_}) {
      law->expect_within(bound, 1e6, 9950);
    }
  }

 private:
  Law A_, B_, C_, D_;
};

// Each method is an equation between the two systems, which holds after either direction.
TEST(ConversionProperties, BothWaysSatisfyTheDefinition) {
  constexpr ConversionMethod methods[] = {ConversionMethod::zoh, ConversionMethod::foh,
                                          ConversionMethod::tustin, ConversionMethod::forward_euler,
                                          ConversionMethod::backward_euler};
  for (const ConversionMethod method : methods) {
    SCOPED_TRACE(to_string(method));
    test::RandomSystems systems(171, Plane::s, 5);
    Random random(172);
    test::Refusals refusals;
    Ties there(std::string(to_string(method)));
    Ties back(std::string(to_string(method)) + " back");
    for (int trial = 0; trial < 10000; ++trial) {
      const RandomSystem s = systems.next();
      const ContinuousSystem<> plant = test::continuous(test::plain(s));
      const double frequency = test::eigenvalues(plant.A).imag().cwiseAbs().maxCoeff();
      const double wanted = std::pow(10.0, random.uniform(-3.0, 0.8)) / plant.A.norm();
      // Below the Nyquist frequency, so that there is a way back.
      const double T = frequency * wanted > 3.0 ? 3.0 / frequency : wanted;
      const bool warp = method == ConversionMethod::tustin && trial % 2 == 0;
      const AngularVelocity prewarp(warp ? random.uniform(0.1, 3.0) / T : 0.0);
      const auto discrete = discretize(test::continuous(s), Time(T), method, prewarp);
      if (!discrete) {
        refusals.add(discrete.error(), trial, s);
        continue;
      }
      const auto returned = undiscretize(*discrete, method, prewarp);
      if (!returned) {
        refusals.add(returned.error(), trial, s);
        continue;
      }
      const auto d = out_of_units(s, *discrete);
      const auto c = out_of_units(s, *returned);
      if (method == ConversionMethod::zoh || method == ConversionMethod::foh) {
        const bool first_order = method == ConversionMethod::foh;
        there.hold(s, plant, d, T, first_order, random, trial);
        back.hold(s, c, d, T, first_order, random, trial);
      } else {
        const long double theta = method == ConversionMethod::tustin           ? 0.5L
                                  : method == ConversionMethod::backward_euler ? 1.0L
                                                                               : 0.0L;
        const double step = warp ? 2.0 * std::tan(0.5 * prewarp.si() * T) / prewarp.si() : T;
        there.hold(s, plant, d, step, theta, trial);
        back.hold(s, c, d, step, theta, trial);
      }
    }
    refusals.expect_at_most(50);
    there.expect_within(20.0);
    back.expect_within(20.0);
  }
}

// det(zI - A_d) = Π(z - e^{λT}), G_d(1) = G(0), and back again the transfer function.
TEST(ConversionProperties, MatchedPolesAndGain) {
  test::RandomSystems systems(173, Plane::s, 4);
  Random random(174);
  test::Refusals refusals;
  Law poles("poles");
  Law gain("gain");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    ContinuousSystem<> given{s.A, s.B.leftCols(1), s.C.topRows(1), s.D.topLeftCorner(1, 1)};
    const RandomSystem p = test::plain(s);
    const ContinuousSystem<> plant{p.A, p.B.leftCols(1), p.C.topRows(1), p.D.topLeftCorner(1, 1)};
    const double T = std::pow(10.0, random.uniform(-2.0, 0.3)) / plant.A.norm();
    const auto discrete = discretize(given, Time(T), ConversionMethod::matched);
    if (!discrete) {
      // A zero whose image overflows has none; no other refusal is right.
      if (!discrete.error().is(SystemError::no_image)) {
        refusals.add(discrete.error(), trial, s);
      }
      continue;
    }
    const std::complex<double> z = std::polar(random.uniform(8.0, 10.0), random.uniform(0.1, 3.0));
    std::complex<double> expected = 1.0;
    std::complex<double> found = 1.0;
    for (const std::complex<double>& lambda : test::eigenvalues(plant.A)) {
      expected *= z - std::exp(lambda * T);
    }
    for (const std::complex<double>& lambda : test::eigenvalues(discrete->A)) {
      found *= z - lambda;
    }
    if (discrete->A.norm() < 1e3) {  // where a zero is beyond, the eigenvalues of A_d lose digits
      poles.holds(std::abs(found - expected) / std::abs(expected), trial, s);
    }
    const Eigen::VectorXd values = test::singular_values(plant.A);
    const double smallest = values(values.size() - 1);
    if (smallest > 1e-6 * values(0)) {
      const double rest = test::response(plant, 0.0)(0, 0).real();
      const double size =
          std::abs(rest) + plant.C.norm() * plant.B.norm() / smallest + plant.D.norm();
      const double unit = s.outputs(0) / s.inputs(0);
      gain.holds(std::abs(unit * test::response(*discrete, 1.0)(0, 0).real() - rest) / size, trial,
                 s);
    }
  }
  refusals.expect_at_most(50);
  poles.expect_within(1e-9, 9000);
  gain.expect_within(1e-8);
}

/// ∫₀ᵀ e^{Gτ} W e^{Gᵀτ} dτ by its series for T/2ᵏ and doubling.
LongMatrix integral(const LongMatrix& G, const LongMatrix& W, long double T) {
  int halvings = 0;
  while (std::ldexp(G.norm() * T, -halvings) > 0.125L) {
    ++halvings;
  }
  const long double h = std::ldexp(T, -halvings);
  LongMatrix term = W * h;
  LongMatrix sum = term;
  for (int k = 2; k < 22; ++k) {
    const LongMatrix once = G * term;
    term = (once + once.transpose()) * (h / k);
    sum += term;
  }
  LongMatrix phi = test::exponential(G * h);
  for (int k = 0; k < halvings; ++k) {
    sum += (phi * sum * phi.transpose()).eval();
    phi = (phi * phi).eval();
  }
  return sum;
}

/// How much relative changes of G move the integral, at least one.
long double sensitivity(const LongMatrix& G, const LongMatrix& W, long double T,
                        const LongMatrix& sum, Random& random) {
  constexpr double nudge = 1e-9;
  long double largest = 1.0L;
  for (int k = 0; k < 2; ++k) {
    const LongMatrix moved = integral(test::nudged(G, random, nudge), W, T);
    largest = std::max(largest, (moved - sum).norm() / (nudge * sum.norm()));
  }
  return largest;
}

// Q_d is the integral (7.8), satisfies A Q_d + Q_d Aᵀ = e^{AT} Q e^{AᵀT} - Q, and is positive
// semidefinite; ‖A‖T up to 30.
TEST(ConversionProperties, NoiseCovariance) {
  test::RandomSystems systems(175, Plane::s, 5);
  Random random(176);
  test::Refusals refusals;
  Law value("integral");
  Law identity("identity");
  Law semidefinite("smallest eigenvalue");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    const Index n = s.A.rows();
    if (s.kind == test::SystemClass::reference && n == 2) {
      continue;  // turned double integrators: as the exponential's
    }
    const LongMatrix A = wide(test::plain(s).A);
    const MatrixXd root = test::random_matrix(random, n, 1 + trial % n);
    MatrixXd Q = root * root.transpose();
    Q = (0.5 * (Q + Q.transpose())).eval();
    const double T = std::pow(10.0, random.uniform(-3.0, 1.5)) / static_cast<double>(A.norm());
    const auto x = s.states.cwiseInverse().asDiagonal();
    const auto found = discretize(s.A, ProcessDensity{x * Q * x}, Time(T));
    if (!found) {
      refusals.add(found.error(), trial, s);
      continue;
    }
    const MatrixXd covariance = s.states.asDiagonal() * *found * s.states.asDiagonal();
    EXPECT_EQ(*found, found->transpose());
    const LongMatrix expected = integral(A, wide(Q), T);
    const long double unit = epsilon * sensitivity(A, wide(Q), T, expected, random);
    value.holds((wide(covariance) - expected).norm() / (unit * expected.norm()), trial, s);
    const LongMatrix AQ = A * wide(covariance);
    const LongMatrix phi = test::exponential(A * T);
    const LongMatrix moved = phi * wide(Q) * phi.transpose();
    identity.holds((AQ + AQ.transpose() - moved + wide(Q)).norm() /
                       (unit * (A.norm() * covariance.norm() + moved.norm() + Q.norm())),
                   trial, s);
    const Eigen::VectorXd eigenvalues = test::symmetric_eigenvalues(covariance).cwiseAbs();
    semidefinite.holds(-test::symmetric_eigenvalues(covariance)(0) / eigenvalues.maxCoeff(), trial,
                       s);
  }
  refusals.expect_at_most(0);
  value.expect_within(100.0, 8500);
  identity.expect_within(100.0, 8500);
  semidefinite.expect_within(1e-14);
}

// [Q_d N_d; N_dᵀ R_d] = ∫ e^{Fᵀτ} [Q N; Nᵀ R] e^{Fτ} dτ, F = [A B; 0 0].
TEST(ConversionProperties, SampledCost) {
  test::RandomSystems systems(177, Plane::s, 5);
  Random random(178);
  test::Refusals refusals;
  Law value("integral");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    const RandomSystem p = test::plain(s);
    const Index n = s.A.rows();
    const Index m = s.B.cols();
    const double T = std::pow(10.0, random.uniform(-3.0, 1.0)) / p.A.norm();
    const auto found = sampled_cost(s.A, s.B, s.Q, s.R, s.N, Time(T));
    if (!found) {
      refusals.add(found.error(), trial, s);
      continue;
    }
    // The input in units in which B T is as large as I.
    const long double scale = 1.0L / (T * p.B.norm());
    LongMatrix F = LongMatrix::Zero(n + m, n + m);
    F.topLeftCorner(n, n) = wide(p.A);
    F.topRightCorner(n, m) = wide(p.B) * scale;
    LongMatrix W(n + m, n + m);
    W << wide(p.Q), wide(p.N) * scale, wide(p.N).transpose() * scale, wide(p.R) * scale * scale;
    const LongMatrix expected = integral(F.transpose(), W, T);
    LongMatrix got(n + m, n + m);
    const auto x = s.states.cwiseInverse().asDiagonal();
    const auto u = s.inputs.cwiseInverse().asDiagonal();
    const MatrixXd N = x * found->N * u;
    got << wide(x * found->Q * x), wide(N) * scale, wide(N).transpose() * scale,
        wide(u * found->R * u) * scale * scale;
    value.holds((got - expected).norm() / (epsilon * expected.norm() *
                                           sensitivity(F.transpose(), W, T, expected, random)),
                trial, s);
  }
  refusals.expect_at_most(0);
  value.expect_within(100.0);
}

}  // namespace
}  // namespace flyball::conversion_property_test
