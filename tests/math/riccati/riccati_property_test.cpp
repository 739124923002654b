#include <cmath>

#include <gtest/gtest.h>

#include <flyball/math/riccati/riccati.hpp>

#include "support/laws.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::riccati_property_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using test::epsilon;
using test::Law;
using test::LongMatrix;
using test::Plane;
using test::RandomSystem;
using test::wide;

Expected<RiccatiSolution> solve(const RandomSystem& s, Plane plane) {
  return plane == Plane::s ? care(s.A, s.B, s.Q, s.R, s.N) : dare(s.A, s.B, s.Q, s.R, s.N);
}

/// An equation in 64 bits:
///   F(X) = AᵀX + XA - CK + Q, C = XB + N, RK = Cᵀ, or
///   F(X) = AᵀXA - X - CK + Q, C = AᵀXB + N, (R + BᵀXB)K = Cᵀ.
struct WideEquation {
  Plane plane = Plane::s;
  LongMatrix A, B, Q, R, N;

  WideEquation(const RandomSystem& s, Plane where)
      : plane(where), A(wide(s.A)), B(wide(s.B)), Q(wide(s.Q)), R(wide(s.R)), N(wide(s.N)) {}

  [[nodiscard]] LongMatrix gain(const LongMatrix& X) const {
    const LongMatrix XB = X * B;
    const LongMatrix weight = plane == Plane::s ? R : LongMatrix(R + B.transpose() * XB);
    return weight.fullPivLu().solve(cross(XB).transpose());
  }
  [[nodiscard]] LongMatrix rest(const LongMatrix& X, const LongMatrix& K) const {
    const LongMatrix XA = X * A;
    const LongMatrix linear =
        plane == Plane::s ? LongMatrix(XA.transpose() + XA) : LongMatrix(A.transpose() * XA - X);
    return linear - cross(X * B) * K + Q;
  }
  [[nodiscard]] LongMatrix cross(const LongMatrix& XB) const {
    return plane == Plane::s ? LongMatrix(XB + N) : LongMatrix(A.transpose() * XB + N);
  }
  /// Every entry changed by up to `size` of itself.
  [[nodiscard]] WideEquation perturbed(Random& random, double size) const {
    WideEquation e = *this;
    const auto change = [&](LongMatrix& M, bool symmetric) {
      for (Index j = 0; j < M.cols(); ++j) {
        for (Index i = 0; i < M.rows(); ++i) {
          M(i, j) = symmetric && i > j ? 0.0L : M(i, j) * (1.0L + random.uniform(-size, size));
        }
      }
      if (symmetric) {
        M = LongMatrix(M.selfadjointView<Eigen::Upper>());
      }
    };
    change(e.A, false);
    change(e.B, false);
    change(e.N, false);
    change(e.Q, true);
    change(e.R, true);
    return e;
  }
};

/// ΔX of SᵀΔX + ΔXS = -F, or SᵀΔXS - ΔX = -F, entry by entry as n² linear equations.
class ClosedLoop {
 public:
  ClosedLoop(const LongMatrix& S, Plane plane) : n_(S.rows()) {
    LongMatrix L = LongMatrix::Zero(n_ * n_, n_ * n_);
    for (Index i = 0; i < n_; ++i) {
      for (Index j = 0; j < n_; ++j) {
        if (plane == Plane::z) {
          L.block(i * n_, j * n_, n_, n_) = S(j, i) * S.transpose();
        } else {
          L.block(i * n_, j * n_, n_, n_).diagonal().array() += S(j, i);
        }
      }
      if (plane == Plane::s) {
        L.block(i * n_, i * n_, n_, n_) += S.transpose();
      }
    }
    if (plane == Plane::z) {
      L.diagonal().array() -= 1.0L;
    }
    lu_.compute(L);
  }
  [[nodiscard]] LongMatrix solve(const LongMatrix& F) const {
    const LongMatrix x = lu_.solve(-F.reshaped());
    const LongMatrix X = x.reshaped(n_, n_);
    return 0.5L * (X + X.transpose());
  }

 private:
  Index n_;
  Eigen::PartialPivLU<LongMatrix> lu_;
};

struct Laws {
  Law solution{"error of X / (n epsilon condition)"};
  Law gain{"error of K / (n epsilon condition)"};
  Law cost{"cost of the closed loop"};
  Law poles{"pole"};

  /// Newton's method in 64 bits from X leads to the exact solution, and its linear equations to how
  /// much relative changes of the entries of the data move X and K. All without the units of s.
  void check(const RandomSystem& s, Plane plane, const RiccatiSolution& found, Random& random,
             int trial) {
    const auto x = s.states.cwiseInverse().asDiagonal();
    const LongMatrix X_found = wide(x * found.X * x);
    const LongMatrix K_found = wide(s.inputs.asDiagonal() * found.K * x);
    const WideEquation e(test::plain(s), plane);
    const long double n = static_cast<long double>(s.A.rows());

    LongMatrix X = X_found;
    LongMatrix K = e.gain(X);
    for (int step = 0; step < 3; ++step) {
      X += ClosedLoop(e.A - e.B * K, plane).solve(e.rest(X, K));
      K = e.gain(X);
    }
    const LongMatrix S = e.A - e.B * K;
    const ClosedLoop closed(S, plane);
    long double moved_X = X.norm();
    long double moved_K = K.norm();
    constexpr double nudge = 1e-11;
    for (int draw = 0; draw < 3; ++draw) {
      const WideEquation other = e.perturbed(random, nudge);
      const LongMatrix dX = closed.solve(other.rest(X, other.gain(X)));
      moved_X = std::max(moved_X, dX.norm() / nudge);
      moved_K = std::max(moved_K, (other.gain(X + dX) - K).norm() / nudge);
    }
    // What the rounding of these 64 bits does to both: beyond ε they cannot judge.
    const long double reach = e.A.norm() + e.B.norm() * K.norm();
    const long double terms = X.norm() * (plane == Plane::s ? 2.0L * reach : 1.0L + reach * reach) +
                              e.Q.norm() + K.norm() * (2.0L * e.N.norm() + e.R.norm() * K.norm());
    const LongMatrix noise =
        closed.solve(wide(test::random_matrix(random, s.A.rows(), s.A.rows())) *
                     (20.0L * std::numeric_limits<long double>::epsilon() * terms / n));
    const long double noise_X = noise.norm();
    const long double noise_K = (e.gain(X + noise) - K).norm();
    if (noise_X <= n * epsilon * moved_X) {
      solution.holds((X_found - X).norm() / (n * epsilon * moved_X), trial, s);
    }
    if (noise_K <= n * epsilon * moved_K) {
      gain.holds((K_found - K).norm() / (n * epsilon * moved_K), trial, s);
    }

    // X is the cost of the closed loop: SᵀX + XS + W = 0, W = Q - NK - KᵀNᵀ + KᵀRK.
    const LongMatrix S_found = e.A - e.B * K_found;
    const LongMatrix NK = e.N * K_found;
    const LongMatrix W = e.Q - NK - NK.transpose() + K_found.transpose() * e.R * K_found;
    const LongMatrix SX = S_found.transpose() * X_found;
    const LongMatrix rest = plane == Plane::s ? LongMatrix(SX + SX.transpose() + W)
                                              : LongMatrix(SX * S_found - X_found + W);
    const long double loop = e.A.norm() + e.B.norm() * K_found.norm();
    const long double size =
        X_found.norm() * (plane == Plane::s ? 2.0L * loop : 1.0L + loop * loop) + e.Q.norm() +
        K_found.norm() * (2.0L * e.N.norm() + e.R.norm() * K_found.norm());
    cost.holds(rest.norm() / (epsilon * size), trial, s);

    const Eigen::VectorXcd values = test::eigenvalues(S_found.cast<double>());
    poles.holds(plane == Plane::s ? values.real().maxCoeff() : values.cwiseAbs().maxCoeff() - 1.0,
                trial, s);
    poles.holds(
        plane == Plane::s ? found.poles.real().maxCoeff() : found.poles.cwiseAbs().maxCoeff() - 1.0,
        trial, s);
  }
};

/// @param references  The bound for the reference cases.
void expect_laws(Plane plane, std::uint64_t seed, double references) {
  test::RandomSystems systems(seed, plane);
  Random random(seed);
  test::Refusals refusals;
  Laws laws;
  for (int trial = 0; trial < 10000; ++trial) {
    const RandomSystem s = systems.next();
    const auto solution = solve(s, plane);
    if (!solution) {
      refusals.add(solution.error(), trial, s);
      continue;
    }
    ASSERT_TRUE(solution->X.allFinite() && solution->K.allFinite()) << trial;
    EXPECT_EQ(solution->X, solution->X.transpose()) << trial;
    laws.check(s, plane, *solution, random, trial);
  }
  refusals.expect_at_most(50);
  laws.solution.expect_within(150.0, references, 8500);
  laws.gain.expect_within(150.0, references, 8500);
  laws.cost.expect_within(150.0, references, 10000 - 50);
  laws.poles.expect_within(0.0);
}

TEST(RiccatiProperties, Continuous) {
  expect_laws(Plane::s, 21, 150.0);
}

TEST(RiccatiProperties, Discrete) {
  // In units 16 decades apart DAREX 2.5's slow state weighs nothing in the norm of X, and keeps
  // nine digits.
  expect_laws(Plane::z, 22, 1e6);
}

}  // namespace
}  // namespace flyball::riccati_property_test
