#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "math/dense.hpp"
#include "math/double_double.hpp"
#include "math/riccati_robust.hpp"
#include "math/stein.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// A₀ = A - B R⁻¹Nᵀ, G₀ = B R⁻¹Bᵀ, H₀ = Q - N R⁻¹Nᵀ: the equation without N and R,
/// H = Q₀ + A₀ᵀH(I + G₀H)⁻¹A₀.
struct Reduced {
  MatrixXd A;
  MatrixXd G;
  MatrixXd H;
};

std::optional<Reduced> reduce(const RiccatiProblem& p) {
  const Index n = p.A.rows();
  MatrixXd rhs(p.R.rows(), 2 * n);
  rhs << p.B.transpose(), p.N.transpose();
  double rcond = 0.0;
  const MatrixXd solved = solve_equilibrated(p.R, rhs, rcond);
  if (!(rcond > 4.0 * epsilon)) {
    return std::nullopt;
  }
  const MatrixXd BN = product(p.B, solved);
  Reduced reduced{p.A - BN.rightCols(n), symmetrized(BN.leftCols(n)),
                  symmetrized(p.Q - product(p.N, solved.rightCols(n)))};
  if (!reduced.A.allFinite() || !reduced.G.allFinite() || !reduced.H.allFinite()) {
    return std::nullopt;
  }
  return reduced;
}

/// x = D z with powers of two D such that z's A, G and H have comparable rows, columns and
/// entries: minimises Σ A_ij² t_j/t_i + ½ Σ G_ij²/(t_i t_j) + ½ Σ H_ij² t_i t_j over t = D², which
/// is convex in log t, one coordinate after the other.
VectorXd balance(const Reduced& reduced) {
  const Index n = reduced.A.rows();
  MatrixXd A = reduced.A.cwiseAbs2();
  A.diagonal().setZero();
  const MatrixXd G = reduced.G.cwiseAbs2();
  const MatrixXd H = reduced.H.cwiseAbs2();
  VectorXd t = VectorXd::Ones(n);
  for (int sweep = 0; sweep < 30; ++sweep) {
    double change = 0.0;
    for (Index i = 0; i < n; ++i) {
      double up = 0.0;    // coefficient of t_i
      double down = 0.0;  // coefficient of 1/t_i
      for (Index j = 0; j < n; ++j) {
        if (j != i) {
          up += A(j, i) / t(j) + H(i, j) * t(j);
          down += A(i, j) * t(j) + G(i, j) / t(j);
        }
      }
      if (up + H(i, i) == 0.0 || down + G(i, i) == 0.0) {
        continue;
      }
      // d/d(log t) of up·t + down/t + ½H_ii t² + ½G_ii/t², increasing in log t; bisection.
      double low = -300.0;
      double high = 300.0;
      for (int k = 0; k < 16; ++k) {
        const double middle = 0.5 * (low + high);
        const double s = std::exp2(middle);
        const double slope = up * s - down / s + H(i, i) * s * s - G(i, i) / (s * s);
        (slope > 0.0 ? high : low) = middle;
      }
      const double updated = std::exp2(0.5 * (low + high));
      change = std::max(change, std::abs(std::log2(updated / t(i))));
      t(i) = updated;
    }
    if (change < 0.5) {
      break;
    }
  }
  return t.unaryExpr([](double value) { return std::exp2(std::round(0.5 * std::log2(value))); });
}

/// The same for a problem whose R may be singular: then only the sizes of G and H are surrogates.
VectorXd balance(const RiccatiProblem& p) {
  if (const auto reduced = reduce(p)) {
    return balance(*reduced);
  }
  const double weight = p.Q.cwiseAbs().maxCoeff();
  const MatrixXd shift = (weight > 0.0 ? weight : 1.0) * MatrixXd::Identity(p.A.rows(), p.A.rows());
  const RiccatiProblem regular = shifted(p, shift);
  if (const auto reduced = reduce(regular)) {
    return balance(Reduced{p.A, reduced->G, p.Q});
  }
  return VectorXd::Ones(p.A.rows());
}

/// Structure-preserving doubling:
///   W = I + GH,  A ← A W⁻¹A,  G ← G + A W⁻¹G Aᵀ,  H ← H + AᵀH W⁻¹A.
std::optional<MatrixXd> doubling(Reduced r, int& iterations) {
  const Index n = r.A.rows();
  for (int k = 0; k < 64; ++k) {
    ++iterations;
    MatrixXd W = product(r.G, r.H);
    W.diagonal().array() += 1.0;
    MatrixXd AG(n, 2 * n);
    AG << r.A, r.G;
    const MatrixXd solved = solve_linear(W, AG);
    const MatrixXd WA = solved.leftCols(n);
    const MatrixXd dH = symmetrized(transposed_product(r.A, product(r.H, WA)));
    r.G += symmetrized(product(product(r.A, solved.rightCols(n)), r.A.transpose()));
    r.A = product(r.A, WA);
    r.H += dH;
    if (!r.H.allFinite()) {
      return std::nullopt;
    }
    if (dH.norm() <= epsilon * r.H.norm()) {
      return r.H;
    }
    if (!r.G.allFinite() || !r.A.allFinite()) {
      return r.H;  // the dual equation has no solution; X's may still have been reached
    }
  }
  return r.H;
}

/// The stable deflating subspace of the pencil of the shifted problem by inverse-free repeated
/// squaring (Bai, Demmel and Gu, Numerische Mathematik 76 (1997)): only orthogonal factorisations,
/// for data on which doubling breaks down.
std::optional<MatrixXd> inverse_free(const RiccatiProblem& p, int& iterations) {
  const Index n = p.A.rows();
  const Index m = p.B.cols();
  const Index size = 2 * n + m;
  // λ [I 0 0; 0 Aᵀ 0; 0 -Bᵀ 0] - [A 0 B; -Q I -N; Nᵀ 0 R], in (x, costate, u).
  MatrixXd L = MatrixXd::Zero(size, size);
  MatrixXd M = MatrixXd::Zero(size, size);
  L.topLeftCorner(n, n) = p.A;
  L.topRightCorner(n, m) = p.B;
  L.block(n, 0, n, n) = -p.Q;
  L.block(n, n, n, n).setIdentity();
  L.block(n, 2 * n, n, m) = -p.N;
  L.bottomLeftCorner(m, n) = p.N.transpose();
  L.bottomRightCorner(m, m) = p.R;
  M.topLeftCorner(n, n).setIdentity();
  M.block(n, n, n, n) = p.A.transpose();
  M.block(2 * n, n, m, n) = -p.B.transpose();
  MatrixXd previous;
  for (int k = 0; k < 60; ++k) {
    ++iterations;
    MatrixXd stacked(2 * size, size);
    stacked << M, -L;
    const OrthogonalTriangular qr = full_qr(stacked);
    L = transposed_product(qr.Q.topRightCorner(size, size), L);
    M = transposed_product(qr.Q.bottomRightCorner(size, size), M);
    MatrixXd triangle = qr.R.topRows(size);
    triangle = triangle.array().colwise() * triangle.diagonal().array().sign();
    if (k > 0 && (triangle - previous).norm() <= 1e-14 * triangle.norm()) {
      break;
    }
    previous = std::move(triangle);
  }
  double rcond = 0.0;
  const MatrixXd projector = solve_linear(L + M, M, &rcond);
  if (!(rcond > 4.0 * epsilon)) {
    return std::nullopt;
  }
  const MatrixXd basis = pivoted_qr(projector).Q.leftCols(n);
  const MatrixXd X =
      solve_linear(basis.topRows(n).transpose(), basis.middleRows(n, n).transpose()).transpose();
  return X.allFinite() ? std::optional<MatrixXd>(symmetrized(X)) : std::nullopt;
}

/// F(X), and what belongs to it.
struct Evaluation {
  MatrixXd K;
  MatrixXd closed_loop;
  MatrixXd F;
  double scale = 0.0;  // sum of the norms of F's terms
  double rcond = 0.0;  // of R + BᵀXB, scaled
};

Evaluation evaluate(const RiccatiProblem& p, const MatrixXd& X) {
  Evaluation e;
  const MatrixXd XA = product(X, p.A);
  const MatrixXd AXA = transposed_product(p.A, XA);
  const MatrixXd cross = transposed_product(p.B, XA) + p.N.transpose();
  e.K = solve_equilibrated(symmetrized(p.R + transposed_product(p.B, product(X, p.B))), cross,
                           e.rcond);
  const MatrixXd feedback = transposed_product(cross, e.K);
  e.F = symmetrized(AXA - X - feedback + p.Q);
  e.scale = AXA.norm() + X.norm() + feedback.norm() + p.Q.norm();
  e.closed_loop = p.A - product(p.B, e.K);
  return e;
}

/// The same with every product and sum in twice the working precision. K is one refined solve away
/// from exact, and F depends on its error only to second order:
///   F(X) = [I; -K]ᵀ S [I; -K] - X - (K - K*)ᵀ(R + BᵀXB)(K - K*),  S = [A B]ᵀX[A B] + [Q N; Nᵀ R].
Evaluation evaluate_in_double_double(const RiccatiProblem& p, const MatrixXd& X) {
  const Index n = p.A.rows();
  const Index m = p.B.cols();
  Evaluation e = evaluate(p, X);
  MatrixXd AB(n, n + m);
  AB << p.A, p.B;
  MatrixXd W(n + m, n + m);
  W << p.Q, p.N, p.N.transpose(), p.R;
  const DoubleDoubleMatrix XAB =
      add_product(DoubleDoubleMatrix(MatrixXd::Zero(n, n + m)), 1.0, X, DoubleDoubleMatrix(AB));
  const DoubleDoubleMatrix S = add_product(DoubleDoubleMatrix(W), 1.0, AB, XAB);

  const auto block = [&S](Index i, Index j, Index rows, Index columns) {
    DoubleDoubleMatrix part;
    part.hi = S.hi.block(i, j, rows, columns);
    part.lo = S.lo.block(i, j, rows, columns);
    return part;
  };
  const MatrixXd Rt = symmetrized(block(n, n, m, m).rounded());
  for (int k = 0; k < 2; ++k) {
    // S₂₁ - S₂₂K, formed as S₂₁ - (KᵀS₂₂)ᵀ.
    const DoubleDoubleMatrix KS =
        add_product(DoubleDoubleMatrix(MatrixXd::Zero(n, m)), -1.0, e.K, block(n, n, m, m));
    const MatrixXd defect =
        (KS.hi.transpose() + S.hi.block(n, 0, m, n)) + (KS.lo.transpose() + S.lo.block(n, 0, m, n));
    const MatrixXd correction = solve_equilibrated(Rt, defect, e.rcond);
    if (!correction.allFinite()) {
      break;
    }
    e.K += correction;
  }
  MatrixXd Z(n + m, n);
  Z << MatrixXd::Identity(n, n), -e.K;
  DoubleDoubleMatrix SZ;  // S Z = (Zᵀ S)ᵀ because S is symmetric
  {
    const DoubleDoubleMatrix ZS =
        add_product(DoubleDoubleMatrix(MatrixXd::Zero(n, n + m)), 1.0, Z, S);
    SZ.hi = ZS.hi.transpose();
    SZ.lo = ZS.lo.transpose();
  }
  e.F = symmetrized(add_product(DoubleDoubleMatrix(-X), 1.0, Z, SZ).rounded());
  e.closed_loop = p.A - product(p.B, e.K);
  return e;
}

/// Norms as the caller sees them: X = D⁻¹ X_z D⁻¹.
double user_norm(const MatrixXd& X, const VectorXd& d) {
  const VectorXd inverse = d.cwiseInverse();
  return (inverse.asDiagonal() * X * inverse.asDiagonal()).norm();
}

struct Refined {
  MatrixXd X;
  MatrixXd last_step;
  Evaluation evaluation;
  double step = std::numeric_limits<double>::infinity();  // last relative Newton correction
};

/// Newton's method (Hewer): X ← X + ΔX, ΔX = (A - BK)ᵀ ΔX (A - BK) + F(X). Nothing where X does not
/// stabilise.
std::optional<Refined> refine(const RiccatiProblem& p, const VectorXd& d, MatrixXd X,
                              int& iterations) {
  Refined refined;
  double previous = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 60; ++k) {
    ++iterations;
    const Evaluation e = previous < 1e-3 ? evaluate_in_double_double(p, X) : evaluate(p, X);
    if (!e.F.allFinite() || !e.closed_loop.allFinite()) {
      return std::nullopt;
    }
    const auto step = solve_stein(e.closed_loop, e.F);
    if (!step) {
      return std::nullopt;
    }
    X = symmetrized(X + *step);
    const double size = X.norm();
    double relative = 0.0;
    if (step->norm() > 0.0) {
      relative = std::max(step->norm() / size, user_norm(*step, d) / user_norm(X, d));
    }
    if (!(relative < std::numeric_limits<double>::infinity())) {
      return std::nullopt;
    }
    const bool precise = previous < 1e-3;
    refined.step = relative;
    refined.last_step = *step;
    if (precise && (relative <= 2.0 * epsilon || (relative < 1e-12 && relative > 0.5 * previous))) {
      break;
    }
    if (relative == 0.0) {
      break;
    }
    previous = relative;
  }
  refined.X = X;
  refined.evaluation = evaluate_in_double_double(p, X);
  return refined;
}

}  // namespace

RiccatiProblem shifted(const RiccatiProblem& p, const MatrixXd& X0) {
  const MatrixXd XA = product(X0, p.A);
  const MatrixXd XB = product(X0, p.B);
  return {p.A, p.B, symmetrized(p.Q + transposed_product(p.A, XA) - X0),
          symmetrized(p.R + transposed_product(p.B, XB)), p.N + transposed_product(p.A, XB)};
}

MatrixXd solve_equilibrated(const MatrixXd& M, const MatrixXd& rhs, double& rcond) {
  VectorXd s = VectorXd::Ones(M.rows());
  for (int pass = 0; pass < 3; ++pass) {
    for (Index i = 0; i < M.rows(); ++i) {
      const double largest = (M.row(i).cwiseAbs().transpose().cwiseProduct(s)).maxCoeff() * s(i);
      if (largest > 0.0 && std::isfinite(largest)) {
        s(i) *= std::exp2(-std::round(0.5 * std::log2(largest)));
      }
    }
  }
  const MatrixXd scaled = s.asDiagonal() * M * s.asDiagonal();
  return s.asDiagonal() * solve_linear(scaled, s.asDiagonal() * rhs, &rcond);
}

Expected<RiccatiSolution> solve_riccati_robustly(const RiccatiProblem& problem) {
  const Index n = problem.A.rows();
  const VectorXd d = balance(problem);
  const VectorXd inverse = d.cwiseInverse();
  const RiccatiProblem p{
      inverse.asDiagonal() * problem.A * d.asDiagonal(), inverse.asDiagonal() * problem.B,
      d.asDiagonal() * problem.Q * d.asDiagonal(), problem.R, d.asDiagonal() * problem.N};

  // A shift moves X by a known amount: it makes a singular R regular, and it takes doubling away
  // from data on which it would reach another solution or break down.
  const double unit = p.Q.norm() > 0.0 ? p.Q.norm() : 1.0;
  VectorXd uneven(n);
  for (Index i = 0; i < n; ++i) {
    uneven(i) = 1.0 + 0.6180339887498949 * static_cast<double>(i % 7);
  }
  std::vector<MatrixXd> shifts{MatrixXd::Zero(n, n)};
  for (const double factor : {1.0, 0.03, 30.0, -0.3, 1e3, 1e-3, -10.0}) {
    shifts.emplace_back(factor * unit * uneven.asDiagonal().toDenseMatrix());
  }

  int iterations = 0;
  const auto attempt = [&](const std::optional<MatrixXd>& start) -> std::optional<RiccatiSolution> {
    if (!start) {
      return std::nullopt;
    }
    const auto refined = refine(p, d, *start, iterations);
    if (!refined || !(refined->step < 1e-11)) {
      return std::nullopt;
    }
    const Evaluation& e = refined->evaluation;
    RiccatiSolution solution;
    solution.poles = eigenvalues_of(e.closed_loop);
    solution.X = inverse.asDiagonal() * refined->X * inverse.asDiagonal();
    solution.K = e.K * inverse.asDiagonal();
    const auto gain = solve_stein(e.closed_loop, MatrixXd::Identity(n, n));
    if (!gain || !(solution.poles.cwiseAbs().maxCoeff() < 1.0) || !solution.X.allFinite() ||
        !solution.K.allFinite()) {
      return std::nullopt;
    }
    // A change ΔX changes the closed loop by B(R + BᵀXB)⁻¹BᵀΔX(A - BK), so stability is certain
    // while ‖L⁻¹‖ times that is small. At a mode on the unit circle it is not: Newton's ratio stays
    // at 1/2 (last_step), or X hangs on the rounding of the data (rounding).
    double rcond = 0.0;
    const MatrixXd G =
        product(p.B, solve_equilibrated(p.R + transposed_product(p.B, product(refined->X, p.B)),
                                        p.B.transpose(), rcond));
    const MatrixXd size_A = p.A.cwiseAbs();
    const MatrixXd size_K = e.K.cwiseAbs();
    const MatrixXd size_X = refined->X.cwiseAbs();
    const auto rounding = solve_stein(
        e.closed_loop,
        epsilon * (transposed_product(size_A, product(size_X, size_A)) + size_X + p.Q.cwiseAbs() +
                   transposed_product(size_K, product(p.R.cwiseAbs(), size_K))));
    if (!rounding || !(gain->norm() * product(G, refined->last_step).norm() < 0.05) ||
        !(gain->norm() * product(G, *rounding).norm() < 0.05)) {
      return std::nullopt;
    }
    solution.residual = e.scale > 0.0 ? e.F.norm() / e.scale : 0.0;
    const double size = refined->X.norm();
    solution.condition = size > 0.0 ? gain->norm() * e.scale / size : gain->norm();
    solution.iterations = iterations;
    return solution;
  };

  for (const MatrixXd& shift : shifts) {
    const auto reduced = reduce(shifted(p, shift));
    if (!reduced) {
      continue;
    }
    if (const auto Y = doubling(*reduced, iterations)) {
      if (auto solution = attempt(MatrixXd(shift + *Y))) {
        return std::move(*solution);
      }
    }
  }
  if (auto solution = attempt(inverse_free(p, iterations))) {
    return std::move(*solution);
  }
  return tl::unexpected(diagnose_riccati(p));
}

}  // namespace flyball::detail
