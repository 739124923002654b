#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include <flyball/systems/gramian.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/realization.hpp>

#include "support/laws.hpp"
#include "systems/random_systems.hpp"

namespace flyball::realization_property_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::epsilon;
using test::Law;
using test::Plane;
using test::RandomSystem;
using test::SystemClass;

using WideComplex = std::complex<long double>;
using WideResponse = Eigen::Matrix<WideComplex, Eigen::Dynamic, Eigen::Dynamic>;

/// C (sI - A)⁻¹ B + D in 64 bits.
template <class System>
WideResponse response(const System& g, WideComplex s) {
  WideResponse shifted = -g.A.template cast<WideComplex>();
  shifted.diagonal().array() += s;
  const WideResponse B = g.B.template cast<WideComplex>();
  return g.C.template cast<WideComplex>() * shifted.partialPivLu().solve(B) +
         g.D.template cast<WideComplex>();
}

/// A point well outside the spectrum of both.
WideComplex outside(const MatrixXd& A, const MatrixXd& B, double angle) {
  const double radius = 2.0 * std::max(A.norm(), B.norm());
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

// G₂G₁, G₁ + G₂, diag(G₁, G₂), (I ± G₁G₂)⁻¹G₁.
TEST(RealizationProperties, ConnectionsAreTransferAlgebra) {
  test::RandomSystems systems(191, Plane::s, 4);
  test::Refusals refusals;
  Law chain("series");
  Law sum("parallel");
  Law side("append");
  Law negative("negative feedback");
  Law positive("positive feedback");
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = test::plain(systems.next());
    const ContinuousSystem<> G = test::continuous(s);
    const Index m = s.B.cols();
    const Index p = s.C.rows();
    Random& random = systems.random();
    const double size = s.A.norm();
    auto H = test::random_system(random, 1 + trial % 4, p, m);
    auto G2 = test::random_system(random, 1 + trial % 3, m, p);
    H.A *= size;
    G2.A *= size;
    const WideComplex at = outside(G.A, H.A, random.uniform(0.2, 3.0)) * 2.0L;
    const WideResponse g = response(G, at);
    const WideResponse h = response(H, at);
    const WideResponse g2 = response(G2, at);
    const WideResponse I = WideResponse::Identity(p, p);
    const auto check = [&](Law& law, const Expected<ContinuousSystem<>>& system,
                           const WideResponse& expected, long double scale) {
      if (!system) {
        refusals.add(system.error(), trial, s);
        return;
      }
      law.holds((response(*system, at) - expected).norm() / scale, trial, s);
    };
    const long double terms = (G.D.norm() + g.norm()) * (H.D.norm() + h.norm());
    check(chain, series(G, H), h * g, terms);
    check(sum, parallel(G, G2), g + g2, g.norm() + g2.norm());
    WideResponse both = WideResponse::Zero(2 * p, 2 * m);
    both.topLeftCorner(p, m) = g;
    both.bottomRightCorner(p, m) = g2;
    check(side, append(G, G2), both, both.norm());
    const auto loop = [&](Law& law, FeedbackSign sign, long double factor) {
      const WideResponse difference = I + factor * g * h;
      const WideResponse inverse = difference.inverse();
      const MatrixXd direct = MatrixXd::Identity(p, p) + static_cast<double>(factor) * G.D * H.D;
      // A loop that is nearly algebraic loses as many digits as I ± D₁D₂ has.
      const double algebraic = direct.inverse().norm() * (1.0 + direct.norm());
      check(law, feedback(G, H, sign), inverse * g,
            algebraic * inverse.norm() * (1.0L + terms) * (g.norm() + G.D.norm()));
    };
    loop(negative, FeedbackSign::negative, 1.0L);
    loop(positive, FeedbackSign::positive, -1.0L);
  }
  refusals.expect_at_most(50);
  for (const Law* law : {&chain, &sum, &side, &negative, &positive}) {
    law->expect_within(1e-13, 9900);
  }
}

// The balanced system has the transfer function of the given one, both Gramians diag(σ), and σ² are
// the eigenvalues of W_c W_o; in units of 1e±8 too.
TEST(RealizationProperties, BalancedIsTheSameSystem) {
  for (const Plane plane : {Plane::s, Plane::z}) {
    const TimeDomain domain = plane == Plane::s ? TimeDomain::continuous : TimeDomain::discrete;
    test::RandomSystems systems(192, plane, 5);
    test::Refusals refusals;
    Law transfer("transfer");
    Law gramians("Gramians");
    Law hankel("Hankel singular values");
    for (int trial = 0; trial < 10000; ++trial) {
      RandomSystem s = systems.next_stable();
      const RandomSystem p = test::plain(s);
      const Index n = s.A.rows();
      Expected<BalancedRealization<ContinuousSystem<>>> found;
      if (plane == Plane::s) {
        found = balanced_realization(test::continuous(s));
      } else {
        auto discrete = balanced_realization(test::discrete(s));
        if (discrete) {
          const auto& d = discrete->system;
          found = BalancedRealization<ContinuousSystem<>>{{d.A, d.B, d.C, d.D},
                                                          discrete->hankel,
                                                          discrete->T,
                                                          discrete->T_inverse,
                                                          discrete->error_bound};
        } else {
          found = tl::unexpected(discrete.error());
        }
      }
      if (!found) {
        // A reference's random output may see next to nothing of a state in its units.
        if (s.kind != SystemClass::reference) {
          refusals.add(found.error(), trial, s);
        }
        continue;
      }
      const auto& b = found->system;
      const double largest = found->hankel(0);
      const double spread = largest / found->hankel(n - 1);
      const WideComplex at = outside(p.A, p.A, systems.random().uniform(0.2, 3.0));
      const WideResponse expected = response(test::continuous(s), at);
      const WideResponse got = response(b, at);
      const auto y = s.outputs.cast<WideComplex>().asDiagonal();
      const auto u = s.inputs.cwiseInverse().cast<WideComplex>().asDiagonal();
      transfer.holds((y * (got - expected) * u).norm() / (y * expected * u).norm() /
                         std::max(1.0, 1e-3 * spread),
                     trial, s);
      const MatrixXd sigma = found->hankel.asDiagonal();
      const auto W_c = controllability_gramian(b.A, b.B, domain);
      const auto W_o = observability_gramian(b.A, b.C, domain);
      if (W_c && W_o) {
        gramians.holds(std::max((W_c->W - sigma).norm(), (W_o->W - sigma).norm()) / largest /
                           std::max(1.0, 1e-3 * spread),
                       trial, s);
      }
      const MatrixXd V_c = controllability_gramian(s.A, s.B, domain)->W;
      const MatrixXd V_o = observability_gramian(s.A, s.C, domain)->W;
      // Beside the terms of the trace, which may cancel.
      const double terms = V_c.cwiseProduct(V_o).cwiseAbs().sum();
      hankel.holds(std::abs((V_c * V_o).trace() - found->hankel.squaredNorm()) / terms, trial, s);
    }
    refusals.expect_at_most(50);
    transfer.expect_within(1e-9);
    gramians.expect_within(1e-9);
    hankel.expect_within(1e-12, 1e-5, 9000);
  }
}

// [A 0 *; * A_o *; 0 0 A_u], [B; *; 0], [C 0 *], turned and in units: the order is A's, the states
// left out are A_u's and A_o's, and the transfer function stays.
TEST(RealizationProperties, MinimalHasTheExpectedOrder) {
  test::RandomSystems systems(193, Plane::s, 4);
  Law transfer("transfer");
  std::array<int, 5> wrong{};
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    if (s.kind == SystemClass::reference) {
      continue;
    }
    const RandomSystem core = test::plain(s);
    Random& random = systems.random();
    const Index r = core.A.rows();
    const Index u = trial % 3;
    const Index o = trial % 2;
    const Index n = r + u + o;
    ContinuousSystem<> whole = test::random_system(random, n, s.B.cols(), s.C.rows());
    whole.A.topLeftCorner(r, r) = core.A;
    whole.A.block(0, r, r, o).setZero();
    whole.A.bottomLeftCorner(u, r + o).setZero();
    whole.B.topRows(r) = core.B;
    whole.B.bottomRows(u).setZero();
    whole.C.leftCols(r) = core.C;
    whole.C.middleCols(r, o).setZero();
    whole.D = core.D;
    const MatrixXd U = test::random_rotation(random, n);
    const ContinuousSystem<> turned{U * whole.A * U.transpose(), U * whole.B,
                                    whole.C * U.transpose(), whole.D};
    const bool scaled = s.kind == SystemClass::badly_scaled;
    const auto given = test::rescaled(turned, test::random_units(random, n, scaled ? 8.0 : 0.0));
    const auto found = minimal_realization(given).value();
    if (found.system.A.rows() != r || found.unreached != u || found.unseen != o) {
      ++wrong[static_cast<std::size_t>(s.kind)];
      continue;
    }
    const WideComplex at = outside(turned.A, turned.A, random.uniform(0.2, 3.0));
    const WideResponse expected = response(test::continuous(core), at);
    transfer.holds((response(found.system, at) - expected).norm() / expected.norm(), trial, s);
  }
  for (const int count : wrong) {
    EXPECT_EQ(count, 0);
  }
  transfer.expect_within(1e-12, 8000);
}

// No modes are left that hang on far less than the tolerance, and the transfer function moves by
// what a change of the matrices of that size can do: ‖δG‖ ≲ tolerance ‖C‖ ‖(sI - A)⁻¹‖ ‖B‖, with
// ‖(sI - A)⁻¹‖ < 1/‖A‖ at |s| = 2‖A‖.
TEST(RealizationProperties, ToleranceIsWhatTheAnswerMayDifferBy) {
  test::RandomSystems systems(194, Plane::s, 5);
  Law transfer("change over the tolerance");
  int weak = 0;
  int kept = 0;
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    if (s.kind == SystemClass::reference) {
      continue;
    }
    const RandomSystem p = test::plain(s);
    const double tolerance = std::pow(10.0, -2.0 - trial % 8);
    const auto found = minimal_realization(test::continuous(s), tolerance).value();
    const Index order = found.system.A.rows();
    EXPECT_EQ(order + found.unreached + found.unseen, s.A.rows());
    if (s.kind == SystemClass::nearly_uncontrollable && s.coupling < 1e-2 * tolerance) {
      ++weak;
      kept += order <= s.A.rows() - s.weak_modes ? 0 : 1;
    }
    const WideComplex at = outside(p.A, p.A, systems.random().uniform(0.2, 3.0));
    // The units of inputs and outputs weigh them; those of the states do not.
    const RandomSystem q = test::rescaled(p, s.states.cwiseQuotient(s.states), s.inputs, s.outputs);
    const WideResponse change = response(found.system, at) - response(test::continuous(s), at);
    transfer.holds(change.norm() * q.A.norm() / (q.B.norm() * q.C.norm()) / tolerance, trial, s);
  }
  EXPECT_GT(weak, 300);
  // Two weak modes that all but meet move by the root of their coupling.
  EXPECT_LE(kept, 2);
  transfer.expect_within(2.0, 8000);
}

}  // namespace
}  // namespace flyball::realization_property_test
