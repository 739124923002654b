#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <flyball/systems/controllability.hpp>
#include <flyball/systems/gramian.hpp>
#include <flyball/systems/norms.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "systems/mode_distance.hpp"
#include "systems/random_systems.hpp"
#include "systems/staircase.hpp"

namespace flyball::reach_property_test {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using test::epsilon;
using test::Law;
using test::LongMatrix;
using test::Plane;
using test::RandomSystem;
using test::SystemClass;
using test::wide;

/// Nearest pair of eigenvalues that mirror each other, relative: no Gramian exists at zero.
double mirror_distance(const MatrixXd& A, Plane plane) {
  const Eigen::VectorXcd values = test::eigenvalues(A);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Complex& a : values) {
    for (const Complex& b : values) {
      nearest =
          std::min(nearest, plane == Plane::s ? std::abs(a + b) / A.norm() : std::abs(a * b - 1.0));
    }
  }
  return nearest;
}

// A W + W Aᵀ + BBᵀ = 0 or A W Aᵀ - W + BBᵀ = 0 and the dual, entry by entry, for unstable systems
// too; positive semidefinite exactly where the system is stable.
TEST(ReachProperties, Gramians) {
  for (const Plane plane : {Plane::s, Plane::z}) {
    const TimeDomain domain = plane == Plane::s ? TimeDomain::continuous : TimeDomain::discrete;
    test::RandomSystems systems(181, plane);
    test::Refusals refusals;
    Law reach("controllability");
    Law sight("observability");
    for (int trial = 0; trial < 10000; ++trial) {
      const RandomSystem s = systems.next();
      const auto W_c = controllability_gramian(s.A, s.B, domain);
      const auto W_o = observability_gramian(s.A, s.C, domain);
      if (!W_c || !W_o) {
        if (mirror_distance(test::plain(s).A, plane) > 1e-7) {
          refusals.add(!W_c ? W_c.error() : W_o.error(), trial, s);
        }
        continue;
      }
      const auto check = [&](Law& law, const LongMatrix& A, const LongMatrix& B,
                             const MatrixXd& solution) {
        const LongMatrix W = wide(solution);
        const LongMatrix AW =
            plane == Plane::s ? LongMatrix(A * W) : LongMatrix(A * W * A.transpose());
        const LongMatrix a = A.cwiseAbs();
        const LongMatrix w = W.cwiseAbs();
        const LongMatrix aw =
            plane == Plane::s ? LongMatrix(a * w) : LongMatrix(a * w * a.transpose());
        const LongMatrix BB = B * B.transpose();
        const LongMatrix bb = B.cwiseAbs() * B.cwiseAbs().transpose();
        const LongMatrix rest =
            plane == Plane::s ? LongMatrix(AW + AW.transpose() + BB) : LongMatrix(AW - W + BB);
        const LongMatrix size =
            plane == Plane::s ? LongMatrix(aw + aw.transpose() + bb) : LongMatrix(aw + w + bb);
        if (s.kind == SystemClass::reference) {
          law.holds(rest.norm() / size.norm(), trial, s);  // some entries are zero by cancellation
          return;
        }
        law.holds(
            (rest.cwiseAbs().array() / (size.array() > 0.0L).select(size.array(), 1.0L)).maxCoeff(),
            trial, s);
      };
      check(reach, wide(s.A), wide(s.B), W_c->W);
      check(sight, wide(s.A).transpose(), wide(s.C).transpose(), W_o->W);
      if (s.kind == SystemClass::stable || s.kind == SystemClass::unstable) {
        EXPECT_EQ(W_c->is_energy, s.kind == SystemClass::stable) << trial;
        EXPECT_EQ(W_o->is_energy, W_c->is_energy);
      }
      if (s.kind == SystemClass::stable) {
        EXPECT_GT(W_c->eigenvalues(0), -1e-13 * W_c->eigenvalues.cwiseAbs().maxCoeff()) << trial;
      }
    }
    refusals.expect_at_most(0);
    reach.expect_within(1e-14, 9000);
    sight.expect_within(1e-14, 9000);
  }
}

// ‖G‖₂² = tr C W_c Cᵀ = tr Bᵀ W_o B by the other kernel, in any units.
TEST(ReachProperties, PowerOfTheOutput) {
  for (const Plane plane : {Plane::s, Plane::z}) {
    const TimeDomain domain = plane == Plane::s ? TimeDomain::continuous : TimeDomain::discrete;
    test::RandomSystems systems(182, plane);
    test::Refusals refusals;
    Law law("difference");
    for (int trial = 0; trial < 10000; ++trial) {
      RandomSystem s = systems.next_stable();
      if (plane == Plane::s) {
        s.D.setZero();
      }
      const auto norm =
          plane == Plane::s ? h2_norm(test::continuous(s)) : h2_norm(test::discrete(s));
      if (!norm) {
        refusals.add(norm.error(), trial, s);
        continue;
      }
      const MatrixXd W_c = controllability_gramian(s.A, s.B, domain)->W;
      const MatrixXd W_o = observability_gramian(s.A, s.C, domain)->W;
      const double through = plane == Plane::s ? 0.0 : s.D.squaredNorm();
      const auto power = [&](const MatrixXd& C, const MatrixXd& W) {
        const double value = (C * W * C.transpose()).trace() + through;
        const double terms = (C.cwiseAbs() * W.cwiseAbs() * C.cwiseAbs().transpose()).trace();
        law.holds(std::abs(*norm * *norm - value) / (terms + through), trial, s);
      };
      power(s.C, W_c);
      power(s.B.transpose(), W_o);
    }
    refusals.expect_at_most(50);
    law.expect_within(1e-10);
  }
}

/// The largest gain over the boundary by sums over the modes, on a grid that is dense around each.
class Sweep {
 public:
  Sweep(const RandomSystem& s, Plane plane) : s_(s), plane_(plane) {
    const auto [poles, V] = test::modes_of(s.A);
    poles_ = poles;
    B_ = test::solve(V, s.B.cast<Complex>());
    C_ = s.C.cast<Complex>() * V;
  }
  /// Estimates the gain at each frequency and checks the largest exactly.
  [[nodiscard]] double largest() const {
    std::vector<double> frequencies{0.0};
    const double fastest = poles_.cwiseAbs().maxCoeff();
    for (int k = 0; k < 100; ++k) {
      frequencies.push_back(plane_ == Plane::z ? std::numbers::pi * (k + 1) / 100.0
                                               : fastest * std::pow(10.0, -5.0 + 0.07 * k));
    }
    for (const Complex& pole : poles_) {
      const Complex p = plane_ == Plane::s ? pole : std::log(pole + 1e-300);
      for (int k = -10; k <= 10; ++k) {
        const double w = std::abs(p.imag()) + 0.2 * k * std::abs(p.real());
        if (w >= 0.0 && (plane_ == Plane::s || w <= std::numbers::pi)) {
          frequencies.push_back(w);
        }
      }
    }
    double best = 0.0;
    double at = 0.0;
    for (const double w : frequencies) {
      const double gain = estimate(boundary(w));
      if (gain > best) {
        best = gain;
        at = w;
      }
    }
    return exact(at);
  }
  [[nodiscard]] double exact(double w) const {
    if (std::isinf(w)) {
      return test::singular_values(s_.D)(0);
    }
    return test::singular_values(test::response(s_, boundary(w)))(0);
  }

 private:
  [[nodiscard]] Complex boundary(double w) const {
    return plane_ == Plane::s ? Complex(0.0, w) : std::polar(1.0, w);
  }
  [[nodiscard]] double estimate(Complex s) const {
    Eigen::MatrixXcd G = s_.D.cast<Complex>();
    for (Index k = 0; k < poles_.size(); ++k) {
      G += C_.col(k) * (B_.row(k) / (s - poles_(k)));
    }
    return G.norm();
  }

  const RandomSystem& s_;
  Plane plane_;
  Eigen::VectorXcd poles_;
  Eigen::MatrixXcd B_, C_;
};

// The norm is reached at its frequency, no gain of a sweep is above it nor above its bound, and it
// is the same in other axes and units.
TEST(ReachProperties, LargestGain) {
  for (const Plane plane : {Plane::s, Plane::z}) {
    test::RandomSystems systems(183, plane, 5);
    test::Refusals refusals;
    Law reached("reached");
    Law above("sweep above");
    Law units("units");
    Law axes("axes");
    for (int trial = 0; trial < 5000; ++trial) {
      const RandomSystem s = systems.next_stable();
      const RandomSystem p = test::plain(s);
      const auto norm_of = [&](const RandomSystem& r) {
        return plane == Plane::s ? h_infinity_norm(test::continuous(r))
                                 : h_infinity_norm(test::discrete(r, 1.0));
      };
      const auto found = norm_of(p);
      if (!found) {
        refusals.add(found.error(), trial, s);
        continue;
      }
      const Sweep sweep(p, plane);
      reached.holds(std::abs(sweep.exact(found->frequency) / found->norm - 1.0), trial, s);
      above.holds(sweep.largest() / found->norm - 1.0, trial, s);
      EXPECT_GE(found->upper_bound, found->norm);
      EXPECT_LE(found->upper_bound, found->norm * (1.0 + 2e-10));
      // Inputs and outputs keep their units: they weigh the gain.
      const Eigen::VectorXd d = test::random_units(systems.random(), s.A.rows(), 8.0);
      const auto scaled = norm_of(test::rescaled(p, d, Eigen::VectorXd::Ones(s.B.cols()),
                                                 Eigen::VectorXd::Ones(s.C.rows())));
      const auto turned =
          norm_of(test::turned(p, test::random_rotation(systems.random(), s.A.rows())));
      if (!scaled || !turned) {
        refusals.add(!scaled ? scaled.error() : turned.error(), trial, s);
        continue;
      }
      units.holds(std::abs(scaled->norm / found->norm - 1.0), trial, s);
      axes.holds(std::abs(turned->norm / found->norm - 1.0), trial, s);
    }
    refusals.expect_at_most(25);
    reached.expect_within(1e-10);
    above.expect_within(1e-10);
    units.expect_within(1e-9);
    axes.expect_within(1e-8);
  }
}

/// The smallest singular value of [A - λI, B] by Jacobi's iteration, and that of this class, whose
/// vector must belong to it; both relative to the pencil.
void compare(Law& value, Law& relative, Law& vector, const MatrixXd& A, const MatrixXd& B,
             Complex lambda, int trial, const RandomSystem& s) {
  const Index n = A.rows();
  Eigen::MatrixXcd pencil(n, n + B.cols());
  pencil << A.cast<Complex>(), B.cast<Complex>();
  pencil.diagonal().array() -= lambda;
  const double size = pencil.norm();
  const double expected = test::singular_values(pencil)(n - 1);
  const auto found = detail::ModeDistance(A, B).at(lambda);
  value.holds(std::abs(found.value - expected) / size, trial, s);
  if (expected > 1e-9 * size) {
    relative.holds(std::abs(found.value / expected - 1.0), trial, s);
  }
  vector.holds(std::abs((found.left.adjoint() * pencil).norm() - expected) / size, trial, s);
  EXPECT_NEAR(found.left.norm(), 1.0, 1e-14);
}

// At modes and elsewhere, in the form of a staircase and in any other.
TEST(ReachProperties, DistanceIsTheSmallestSingularValue) {
  Law value("value");
  Law relative("relative");
  Law vector("vector");
  const auto check = [&](const MatrixXd& A, const MatrixXd& B, Complex lambda, int trial,
                         const RandomSystem& s) {
    compare(value, relative, vector, A, B, lambda, trial, s);
    const auto stairs = detail::staircase_of(A, B, 1e-13);
    compare(value, relative, vector, stairs.A, stairs.B, lambda, trial, s);
  };
  test::RandomSystems systems(186, Plane::s);
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = test::plain(systems.next());
    if (s.kind == SystemClass::reference) {
      continue;
    }
    const Eigen::VectorXcd modes = test::eigenvalues(s.A);
    check(s.A, s.B, trial % 3 == 0 ? Complex(0.1, trial % 2) : modes(trial % modes.size()), trial,
          s);
  }
  for (int trial = 0; trial < 12; ++trial) {
    RandomSystem s;
    s.kind = trial % 2 == 0 ? SystemClass::stable : SystemClass::nearly_uncontrollable;
    const Index n = 60;
    const Index hidden = 1 + trial % 3;
    s.A = test::random_matrix(systems.random(), n, n);
    s.B = test::random_matrix(systems.random(), n, Index{1} << trial % 7);
    if (trial % 2 == 1) {
      s.A.bottomLeftCorner(hidden, n - hidden) *= 1e-6;
      s.B.bottomRows(hidden) *= 1e-6;
    }
    const Eigen::VectorXcd modes = test::eigenvalues(s.A.bottomRightCorner(hidden, hidden));
    check(s.A, s.B, modes(0), trial, s);
  }
  value.expect_within(2e-15, 16000);
  relative.expect_within(1e-7, 10000);
  vector.expect_within(2e-15, 16000);
}

// Everything is reached and seen in random systems, weakly coupled ones included, and the weakest
// mode's distance is the size of the coupling, in any axes and units.
TEST(ReachProperties, WeakIsNotAbsent) {
  test::RandomSystems systems(184, Plane::s);
  Law weak("distance above the coupling's root");
  Law strong("coupling above the distance");
  Law axes("distance in other axes");
  int wrong = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    if (s.kind == SystemClass::reference) {
      continue;
    }
    const auto reach = analyze_controllability(s.A, s.B, TimeDomain::continuous).value();
    const auto sight = analyze_observability(s.A, s.C, TimeDomain::continuous).value();
    wrong += reach.controllable && sight.observable && reach.rank == s.A.rows() ? 0 : 1;
    EXPECT_TRUE(reach.stabilizable && sight.detectable) << trial << describe(reach);
    if (s.kind == SystemClass::nearly_uncontrollable) {
      const double distance = reach.modes.front().distance;
      weak.holds(distance / std::sqrt(s.coupling), trial, s);
      strong.holds(s.coupling / distance, trial, s);
      const RandomSystem t = test::turned(s, test::random_rotation(systems.random(), s.A.rows()));
      const auto again = analyze_controllability(t.A, t.B, TimeDomain::continuous).value();
      EXPECT_TRUE(again.controllable) << trial << describe(again);
      axes.holds(std::abs(std::log10(again.modes.front().distance / distance)), trial, s);
    }
  }
  EXPECT_LE(wrong, 0);
  weak.expect_within(10.0);
  strong.expect_within(1e4);
  axes.expect_within(3.0);
}

// [A₁ A₁₂; 0 A₂], [B₁; 0], turned and in units of 1e±8: as many hidden directions as A₂ has states,
// each wᵀA^kB = 0; the hidden modes are A₂'s, and decide whether it can be stabilised.
TEST(ReachProperties, HiddenModesAreFound) {
  test::RandomSystems systems(185, Plane::s);
  Law modes("eigenvalue");
  Law directions("direction");
  int wrong = 0;
  int words = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    if (s.kind == SystemClass::reference || s.A.rows() < 2) {
      continue;
    }
    RandomSystem p = test::plain(s);
    const Index n = s.A.rows();
    const Index hidden = 1 + trial % (n - 1);
    p.A.bottomLeftCorner(hidden, n - hidden).setZero();
    p.B.bottomRows(hidden).setZero();
    const MatrixXd A_2 = p.A.bottomRightCorner(hidden, hidden);
    const Eigen::VectorXcd expected = test::eigenvalues(A_2);
    const Eigen::VectorXcd others = test::eigenvalues(p.A.topLeftCorner(n - hidden, n - hidden));
    const MatrixXd U = test::random_rotation(systems.random(), n);
    const RandomSystem turned = test::turned(p, U);
    const RandomSystem given = test::rescaled(turned, s.states, s.inputs, s.outputs);
    const auto reach = analyze_controllability(given.A, given.B, TimeDomain::continuous).value();
    if (reach.rank != n - hidden || reach.controllable || reach.hidden.cols() != hidden) {
      ++wrong;
      continue;
    }
    if (std::abs(expected.real().maxCoeff()) > 1e-9 * p.A.norm()) {
      words += reach.stabilizable == (expected.real().maxCoeff() < 0.0) ? 0 : 1;
    }
    double nearest = std::numeric_limits<double>::infinity();
    for (const Complex& a : expected) {
      for (const Complex& b : others) {
        nearest = std::min(nearest, std::abs(a - b) / p.A.norm());
      }
    }
    for (Index k = 0; k < hidden; ++k) {
      const Complex found = reach.modes[static_cast<std::size_t>(k)].eigenvalue;
      EXPECT_FALSE(reach.modes[static_cast<std::size_t>(k)].reached);
      if (nearest > 1e-2) {
        modes.holds((expected.array() - found).abs().minCoeff() / p.A.norm(), trial, s);
      }
      // In plain units and axes a hidden direction has no part in the first states.
      const Eigen::VectorXd w = U * (s.states.cwiseInverse().asDiagonal() * reach.hidden.col(k));
      directions.holds(w.head(n - hidden).norm() / w.norm(), trial, s);
    }
  }
  EXPECT_LE(wrong, 10);
  EXPECT_EQ(words, 0);
  modes.expect_within(1e-7);
  directions.expect_within(1e-8);
}

}  // namespace
}  // namespace flyball::reach_property_test
