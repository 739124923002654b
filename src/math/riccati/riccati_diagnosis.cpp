#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/riccati/riccati_robust.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// An eigenvalue, or a part of one, in the units of the caller.
double in_units(const RiccatiProblem& p, double value) {
  return std::ldexp(value, p.rate);
}
std::vector<double> parts(const RiccatiProblem& p, std::complex<double> value) {
  return {in_units(p, value.real()), in_units(p, value.imag())};
}

/// What the Hamiltonian matrix [A -G; -H -Aᵀ] says: its eigenvalues on the imaginary axis would be
/// the closed loop's.
Error diagnose_continuous(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  const auto reduced = reduce(p);
  if (!reduced) {
    double rcond = 0.0;
    (void)solve_equilibrated(p.R, MatrixXd::Identity(p.R.rows(), p.R.rows()), rcond);
    return refusal(RiccatiError::singular, "care", "R")
        .got("singular")
        .expected("invertible")
        .hint("weigh every input in R")
        .with("reciprocal condition", rcond);
  }
  // X's unit is free: with it G and H are of one size.
  const double size_G = reduced->G.norm();
  const double size_H = reduced->H.norm();
  const double unit = size_G > 0.0 && size_H > 0.0 ? std::sqrt(size_H / size_G) : 1.0;
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << reduced->A, -unit * reduced->G, -reduced->H / unit, -reduced->A.transpose();
  const double size = hamiltonian.norm();
  double closest = std::numeric_limits<double>::infinity();
  std::complex<double> on_axis;
  for (const std::complex<double>& lambda : eigenvalues_of(hamiltonian)) {
    if (std::abs(lambda.real()) < closest) {
      closest = std::abs(lambda.real());
      on_axis = lambda;
    }
  }
  if (closest <= 1e-6 * size) {
    return refusal(RiccatiError::no_stabilizing_solution, "care", "the closed loop")
        .got("left with a mode on the imaginary axis")
        .expected("left of it")
        .hint("weigh that mode in Q, so that the controller has to move it")
        .with("eigenvalue", parts(p, on_axis))
        .with("distance from the imaginary axis", in_units(p, closest));
  }
  return refusal(RiccatiError::no_convergence, "care", "X")
      .hint("check the scaling of A, B, Q and R, and whether Q and R are the weights of a minimum")
      .with("distance of the Hamiltonian's eigenvalues from the imaginary axis",
            in_units(p, closest));
}

/// Not inside the boundary by more than rounding may have put it there.
bool may_be_unstable(const RiccatiProblem& p, std::complex<double> lambda) {
  const double inside =
      p.continuous ? -lambda.real() / std::max(p.A.norm(), 1e-300) : 1.0 - std::abs(lambda);
  return !(inside > 1e-7);
}

/// Popov-Belevitch-Hautus: λ is reached by the inputs exactly if [A - λI, B] has rank n. B's size
/// is the user's unit, so its columns are compared in A's.
bool is_unreached(const RiccatiProblem& p, std::complex<double> lambda) {
  const Index n = p.A.rows();
  const Index m = p.B.cols();
  const double size_A = p.A.norm();
  const double size_B = p.B.norm();
  const double unit = size_B > 0.0 && size_A > 0.0 ? size_A / size_B : 1.0;
  // [Re -Im; Im Re] of the pencil has its singular values, each twice; the last diagonal entry of
  // the pivoted triangle is the smallest of them but for a factor of order n.
  MatrixXd pencil = MatrixXd::Zero(2 * (n + m), 2 * n);
  pencil.block(0, 0, n, n) = p.A.transpose();
  pencil.block(0, 0, n, n).diagonal().array() -= lambda.real();
  pencil.block(n, 0, m, n) = unit * p.B.transpose();
  pencil.bottomRightCorner(n + m, n) = pencil.topLeftCorner(n + m, n);
  pencil.block(n + m, 0, n, n).diagonal().setConstant(-lambda.imag());
  pencil.block(0, n, n, n).diagonal().setConstant(lambda.imag());
  const double smallest = std::abs(pivoted_qr(pencil).R(2 * n - 1, 2 * n - 1));
  return smallest <=
         1e-12 * static_cast<double>(n) * (p.continuous ? size_A : std::max(1.0, size_A));
}

/// The states that an input acts on, or one of them does: by entries that are not zero.
std::vector<bool> driven_states(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  std::vector<bool> driven(static_cast<std::size_t>(n));
  std::vector<Index> next;
  const auto add = [&](Index i) {
    if (!driven[static_cast<std::size_t>(i)]) {
      driven[static_cast<std::size_t>(i)] = true;
      next.push_back(i);
    }
  };
  for (Index i = 0; i < n; ++i) {
    if (!p.B.row(i).isZero(0.0)) {
      add(i);
    }
  }
  while (!next.empty()) {
    const Index from = next.back();
    next.pop_back();
    for (Index i = 0; i < n; ++i) {
      if (p.A(i, from) != 0.0) {
        add(i);
      }
    }
  }
  return driven;
}

Error not_stabilizable(const RiccatiProblem& p, std::complex<double> lambda) {
  return refusal(RiccatiError::not_stabilizable, p.continuous ? "care" : "dare", "(A, B)")
      .hint("give this mode an input, or take it out of the model")
      .with("eigenvalue", parts(p, lambda))
      .with("magnitude", in_units(p, std::abs(lambda)));
}

}  // namespace

std::optional<Error> unreached_at_sight(const RiccatiProblem& p) {
  const Eigensystem system = eigensystem_of(p.A);
  if (!system.values.allFinite()) {
    return std::nullopt;
  }
  const Index n = p.A.rows();
  bool any = false;
  for (const std::complex<double>& lambda : system.values) {
    any = any || may_be_unstable(p, lambda);
  }
  if (!any) {
    return std::nullopt;
  }
  const Eigen::MatrixXcd left = solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n));
  if (!left.allFinite()) {
    return std::nullopt;
  }
  const Eigen::MatrixXcd reached = complex_product(left, p.B.cast<std::complex<double>>());
  const MatrixXd terms = product(left.cwiseAbs(), p.B.cwiseAbs());
  const double rounding = 4.0 * static_cast<double>(n) * epsilon;
  const auto driven = driven_states(p);
  const auto cancels = [&](Index k) {
    const double size = left.row(k).norm();
    if (terms.row(k).norm() > rounding * size * p.B.norm()) {
      return reached.row(k).norm() <= rounding * terms.row(k).norm();
    }
    // What the mode hangs on the inputs by, these digits do not show: whether it is anything.
    for (Index i = 0; i < n; ++i) {
      if (driven[static_cast<std::size_t>(i)] && std::abs(left(k, i)) > rounding * size) {
        return false;
      }
    }
    return true;
  };
  for (Index k = 0; k < n; ++k) {
    const std::complex<double> lambda = system.values(k);
    if (may_be_unstable(p, lambda) && cancels(k) && is_unreached(p, lambda)) {
      return not_stabilizable(p, lambda);
    }
  }
  return std::nullopt;
}

Error diagnose_riccati(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  const Index m = p.B.cols();
  const char* const where = p.continuous ? "care" : "dare";
  const Eigen::VectorXcd eigenvalues = eigenvalues_of(p.A);
  for (const std::complex<double>& lambda : eigenvalues) {
    if (may_be_unstable(p, lambda) && is_unreached(p, lambda)) {
      return not_stabilizable(p, lambda);
    }
  }

  if (p.continuous) {
    return diagnose_continuous(p);
  }

  // det(λM - L) of the pencil without R: the shift keeps its eigenvalues and makes R regular.
  double best = 0.0;
  RiccatiProblem regular;
  for (const double factor : {0.0, 1.0, 0.37, -0.61}) {
    Eigen::VectorXd uneven(n);
    for (Index i = 0; i < n; ++i) {
      uneven(i) = factor * (1.0 + 0.3 * static_cast<double>(i % 5));
    }
    const RiccatiProblem candidate = shifted(p, uneven.asDiagonal());
    double rcond = 0.0;
    (void)solve_equilibrated(candidate.R, MatrixXd::Identity(m, m), rcond);
    if (rcond > best) {
      best = rcond;
      regular = candidate;
    }
  }
  if (!(best > 10.0 * epsilon)) {
    return refusal(RiccatiError::singular, where, "R + B'XB")
        .got("singular for every X")
        .expected("invertible")
        .hint("weigh every input in R, or remove inputs that do the same")
        .with("reciprocal condition", best);
  }
  double rcond = 0.0;
  MatrixXd rhs(m, 2 * n);
  rhs << regular.B.transpose(), regular.N.transpose();
  const MatrixXd solved = solve_equilibrated(regular.R, rhs, rcond);
  const MatrixXd BN = product(regular.B, solved);
  MatrixXd L = MatrixXd::Zero(2 * n, 2 * n);
  MatrixXd M = MatrixXd::Zero(2 * n, 2 * n);
  L.topLeftCorner(n, n) = regular.A - BN.rightCols(n);
  L.bottomLeftCorner(n, n) = product(regular.N, solved.rightCols(n)) - regular.Q;
  L.bottomRightCorner(n, n).setIdentity();
  M.topLeftCorner(n, n).setIdentity();
  M.topRightCorner(n, n) = BN.leftCols(n);
  M.bottomRightCorner(n, n) = L.topLeftCorner(n, n).transpose();
  // (L - cM)⁻¹M has the eigenvalues 1/(λ - c), those at infinity included; c is near the unit
  // circle, whose eigenvalues matter, and not on it.
  double closest = std::numeric_limits<double>::infinity();
  std::complex<double> on_circle;
  for (const double c : {-1.3, 1.7}) {
    const MatrixXd inverted = solve_linear(L - c * M, M, &rcond);
    if (!(rcond > epsilon) || !inverted.allFinite()) {
      continue;
    }
    for (const std::complex<double>& mu : eigenvalues_of(inverted)) {
      const std::complex<double> lambda = c + 1.0 / mu;
      const double distance = std::abs(std::abs(lambda) - 1.0);
      if (distance < closest) {
        closest = distance;
        on_circle = lambda;
      }
    }
    break;
  }
  if (closest < 1e-5) {
    return refusal(RiccatiError::no_stabilizing_solution, where, "the closed loop")
        .got("left with a mode on the unit circle")
        .expected("inside it")
        .hint("weigh that mode in Q, so that the controller has to move it")
        .with("eigenvalue", parts(p, on_circle))
        .with("distance from the unit circle", closest);
  }
  return refusal(RiccatiError::no_convergence, where, "X")
      .hint("check the scaling of A, B, Q and R, and whether Q and R are the weights of a minimum")
      .with("distance of the pencil's eigenvalues from the unit circle", closest);
}

}  // namespace flyball::detail
