#include <flyball/systems/analysis.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <flyball/math/equations/matrix_equation.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/balanced.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_blocks.hpp"
#include "systems/balance.hpp"
#include "systems/modes.hpp"
#include "systems/timed.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

/// Re λ, or |λ| - 1: positive outside the stable region.
double excess(Complex lambda, TimeDomain domain) {
  return domain == TimeDomain::continuous ? lambda.real() : std::abs(lambda) - 1.0;
}

Expected<Equilibrium> rest(const MatrixXd& balance, const ContinuousSystem<>& system,
                           const Eigen::VectorXd& u) {
  constexpr std::string_view where = "equilibrium";
  FLYBALL_CHECK(Checks(where).shape(u, system.B.cols(), 1, "u", "inputs x 1").finite(u, "u"));
  // balance x = B u, in units in which the states are of like size.
  const detail::SystemScaling scaling = detail::scaling_of(balance, system.B, system.C);
  const MatrixXd M = detail::scaled_state_matrix(balance, scaling);
  const Eigen::VectorXd right =
      scaling.states.cwiseInverse().asDiagonal() * detail::product(system.B, u);
  double rcond = 0.0;
  Eigen::VectorXd x = detail::solve_linear(M, right, &rcond);
  const double small = 10.0 * epsilon * static_cast<double>(M.rows());
  const bool unique = rcond > small && x.allFinite();
  if (!unique) {
    x = detail::solve_least_squares(M, right);
  }
  const double left = (detail::product(M, x) - right).norm();
  const double size = M.norm() * x.norm() + right.norm();
  if (!(left <= 1e3 * small * size)) {
    return refusal(SystemError::no_equilibrium, where, "u")
        .got("driving an integrator")
        .hint("only inputs that leave every integrator at rest have one")
        .with("relative residual", left / size);
  }
  Equilibrium found;
  found.x = scaling.states.asDiagonal() * x;
  found.y = detail::product(system.C, found.x) + detail::product(system.D, u);
  found.unique = unique;
  return found;
}

}  // namespace

namespace detail {

namespace {

Eigen::VectorXcd shifted(const Eigen::VectorXcd& values, int exponent) {
  return exponent == 0 ? values : Eigen::VectorXcd(values.unaryExpr([&](const Complex& x) {
    return Complex(std::ldexp(x.real(), exponent), std::ldexp(x.imag(), exponent));
  }));
}

bool is_triangular(const MatrixXd& M) {
  for (Index j = 0; j + 1 < M.cols(); ++j) {
    if (!M.col(j).tail(M.rows() - j - 1).isZero(0.0)) {
      return false;
    }
  }
  return true;
}

/// Adds the eigenvalues of a block and what is known of each; false where there are none.
bool judge_block(const MatrixXd& block, TimeDomain domain, double blur, int exponent,
                 JudgedEigenvalues& judged, Index first) {
  const BalancedMatrix in_units = balanced_of(block);
  const MatrixXd& balanced = in_units.M;
  const int back = in_units.unit;
  const Index n = block.rows();
  blur = std::ldexp(blur, -back);
  // Such a matrix shows its eigenvalues without any computing, which would round them.
  const bool exact = is_triangular(balanced) || is_triangular(balanced.transpose());
  const Eigensystem system =
      exact ? Eigensystem{balanced.diagonal().cast<Complex>(), Eigen::MatrixXcd::Identity(n, n)}
            : eigensystem_of(balanced);
  judged.of_A.segment(first, n) = shifted(system.values, back);
  judged.values.segment(first, n) = shifted(system.values, back + exponent);
  if (!judged.values.segment(first, n).allFinite()) {
    return false;
  }
  // The condition of an eigenvalue is ‖v‖‖w‖ with wᵀ the row of V⁻¹; a defective one has none, and
  // moves by the root of rounding.
  const double rounding = 10.0 * epsilon * std::sqrt(static_cast<double>(n)) * balanced.norm();
  double rcond = 0.0;
  const Eigen::MatrixXcd rows =
      solve_complex(system.vectors, Eigen::MatrixXcd::Identity(n, n), &rcond);
  for (Index k = 0; k < n; ++k) {
    const double condition = rows.row(k).norm();
    const double most = std::sqrt(epsilon) * std::max(balanced.norm(), 1e-300);
    const double margin_scaled =
        blur + (exact                      ? epsilon * std::abs(system.values(k))
                : std::isfinite(condition) ? std::min(rounding * condition, 10.0 * most)
                                           : most);
    judged.uncertainty(first + k) = std::ldexp(margin_scaled, back + exponent);
    const bool continuous = domain == TimeDomain::continuous;
    const double by = excess(continuous ? system.values(k) : judged.values(first + k), domain);
    const double margin = continuous ? margin_scaled : judged.uncertainty(first + k);
    judged.verdicts.push_back(by < -margin  ? Stability::stable
                              : by > margin ? Stability::unstable
                                            : Stability::marginal);
  }
  return true;
}

}  // namespace

JudgedEigenvalues judged_eigenvalues(const MatrixRef& A, TimeDomain domain, double blur,
                                     int exponent) {
  const Index n = A.rows();
  JudgedEigenvalues judged;
  if (n == 0) {
    return judged;
  }
  judged.values.resize(n);
  judged.of_A.resize(n);
  judged.uncertainty.resize(n);
  const std::vector<MatrixXd> blocks = spectral_blocks(A);
  Index done = 0;
  for (const MatrixXd& block : blocks) {
    if (!judge_block(block, domain, blur, exponent, judged, done)) {
      judged.converged = false;
      return judged;
    }
    done += block.rows();
  }
  const bool marginal = std::find(judged.verdicts.begin(), judged.verdicts.end(),
                                  Stability::marginal) != judged.verdicts.end();
  const auto [balanced, d, back, far] = marginal ? balanced_far(A) : BalancedMatrix{};
  const auto value = [&](Index k) {
    return Complex(std::ldexp(judged.of_A(k).real(), -back),
                   std::ldexp(judged.of_A(k).imag(), -back));
  };
  for (Index k = 0; k < n; ++k) {
    const Stability verdict = judged.verdicts[static_cast<std::size_t>(k)];
    if (verdict == Stability::unstable) {
      judged.stability = Stability::unstable;
      return judged;
    }
    if (verdict != Stability::marginal) {
      continue;
    }
    judged.stability = Stability::marginal;
    // On the boundary a chain grows: fewer eigenvectors than eigenvalues.
    Index same = 0;
    const double near = 100.0 * std::sqrt(epsilon) * balanced.norm();
    Complex mean = 0.0;
    for (Index j = 0; j < n; ++j) {
      if (std::abs(value(j) - value(k)) <= near) {
        ++same;
        mean += value(j);
      }
    }
    if (same == 1) {
      continue;
    }
    mean /= static_cast<double>(same);
    Eigen::MatrixXcd shifted = balanced.cast<Complex>();
    shifted.diagonal().array() -= mean;
    const Eigen::VectorXd sizes = singular_values_of_complex(shifted);
    const auto vectors = (sizes.array() <= 1e-10 * balanced.norm()).count();
    if (vectors < same) {
      judged.stability = Stability::unstable;
      return judged;
    }
  }
  return judged;
}

std::string pole_text(Complex pole) {
  return pole.imag() == 0.0 ? format_number(pole.real(), 4)
                            : detail::format("{} +/- {}i", format_number(pole.real(), 4),
                                             format_number(std::abs(pole.imag()), 4));
}

}  // namespace detail

std::string_view to_string(Stability stability) {
  switch (stability) {
    case Stability::stable:
      return "stable";
    case Stability::marginal:
      return "marginally stable";
    case Stability::unstable:
      return "unstable";
  }
  return "unknown";
}

Expected<ModalAnalysis> analyze_modes(const MatrixRef& A, TimeDomain domain, Time period) {
  constexpr std::string_view where = "analyze_modes";
  FLYBALL_CHECK(check_square(A, where, "A"));
  const bool discrete = domain == TimeDomain::discrete;
  FLYBALL_CHECK(Checks(where).finite(A, "A").also([&] {
    return discrete ? check_positive(period.si(), where, "period", "s") : Expected<void>();
  }));
  const detail::JudgedEigenvalues judged = detail::judged_eigenvalues(A, domain);
  if (!judged.converged) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A")
        .hint("scale its rows and columns to like magnitudes");
  }
  ModalAnalysis analysis;
  analysis.stability = judged.stability;
  for (Index k = 0; k < judged.values.size(); ++k) {
    Mode mode;
    mode.pole = judged.values(k);
    mode.uncertainty = judged.uncertainty(k);
    mode.stability = judged.verdicts[static_cast<std::size_t>(k)];
    mode.s = !discrete          ? mode.pole
             : mode.pole == 0.0 ? Complex(-infinity, 0.0)
                                : std::log(mode.pole) / period.si();
    if (mode.s == Complex(-infinity, 0.0)) {
      mode.natural_frequency = infinity;
      mode.damping_ratio = 1.0;
    } else {
      mode.natural_frequency = std::abs(mode.s);
      const double size = std::max(std::abs(mode.s.real()), std::abs(mode.s.imag()));
      mode.damping_ratio =
          size > 0.0 ? -(mode.s.real() / size) / std::abs(Complex(mode.s / size)) : 0.0;
      mode.time_constant = mode.s.real() == 0.0 ? infinity : -1.0 / mode.s.real();
    }
    if (mode.stability == Stability::marginal) {
      mode.time_constant = infinity;
    }
    analysis.modes.push_back(mode);
    analysis.slowest_time_constant = std::max(analysis.slowest_time_constant, mode.time_constant);
  }
  if (analysis.stability != Stability::stable) {
    analysis.slowest_time_constant = infinity;
  }
  std::sort(analysis.modes.begin(), analysis.modes.end(), [](const Mode& a, const Mode& b) {
    return a.s.real() != b.s.real() ? a.s.real() > b.s.real() : a.s.imag() > b.s.imag();
  });
  return analysis;
}

std::string describe(const ModalAnalysis& analysis) {
  std::string text = detail::format("{}\n", to_string(analysis.stability));
  for (const Mode& mode : analysis.modes) {
    if (mode.pole.imag() < 0.0) {
      continue;
    }
    text += detail::pole_text(mode.pole) + ": ";
    const std::string frequency =
        detail::format("{} rad/s", format_number(mode.natural_frequency, 3));
    if (mode.stability == Stability::marginal) {
      text += mode.s.imag() != 0.0 ? "oscillates at " + frequency + " for ever"
                                   : std::string("integrates");
    } else {
      text += mode.stability == Stability::stable ? "decays" : "grows";
      text += detail::format(" with the time constant {} s",
                             format_number(std::abs(mode.time_constant), 3));
      if (mode.s.imag() != 0.0) {
        text += detail::format(", oscillating at {} with the damping ratio {}", frequency,
                               format_number(mode.damping_ratio, 3));
      }
    }
    text += '\n';
  }
  return text;
}

Expected<Equilibrium> equilibrium(const ContinuousSystem<>& system, const Eigen::VectorXd& u) {
  FLYBALL_CHECK(check_system(system, "equilibrium"));
  return rest(-system.A, system, u);
}

Expected<Equilibrium> equilibrium(const DiscreteSystem<>& system, const Eigen::VectorXd& u) {
  FLYBALL_CHECK(check_system(system, "equilibrium"));
  const Index n = system.A.rows();
  return rest(MatrixXd::Identity(n, n) - system.A, detail::bare(system), u);
}

Expected<LyapunovCertificate> lyapunov_certificate(const MatrixRef& A, const MatrixRef& Q,
                                                   TimeDomain domain) {
  constexpr std::string_view where = "lyapunov_certificate";
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .finite(A, "A")
                    .shape(Q, A.rows(), A.rows(), "Q", "states x states")
                    .finite(Q, "Q")
                    .symmetric(Q, "Q"));
  const MatrixXd weight = detail::symmetrized(Q);
  if (!detail::cholesky_of(weight)) {
    return refusal(ArgumentError::not_positive, where, "Q")
        .got("not positive definite")
        .expected("positive definite: V has to fall wherever x is not zero")
        .with("smallest eigenvalue", detail::symmetric_eigensystem_of(weight).values(0));
  }
  FLYBALL_TRY(auto solution, domain == TimeDomain::continuous
                                 ? lyapunov(A.transpose(), weight)
                                 : discrete_lyapunov(A.transpose(), weight));
  LyapunovCertificate certificate;
  certificate.P = detail::symmetrized(solution.X);
  certificate.residual = solution.residual;
  certificate.eigenvalues = detail::symmetric_eigensystem_of(certificate.P).values;
  // Definiteness does not depend on the states' units; rounding does.
  const Eigen::VectorXd scale = certificate.P.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt();
  const MatrixXd unit =
      scale.cwiseInverse().asDiagonal() * certificate.P * scale.cwiseInverse().asDiagonal();
  const auto L =
      (certificate.P.diagonal().array() > 0.0).all() ? detail::cholesky_of(unit) : std::nullopt;
  certificate.positive_definite = L.has_value();
  if (L) {
    // P⁻¹Q has the eigenvalues of L⁻¹ Q L⁻ᵀ.
    const MatrixXd Q_unit =
        scale.cwiseInverse().asDiagonal() * weight * scale.cwiseInverse().asDiagonal();
    const MatrixXd half = detail::solve_linear(*L, Q_unit);
    const MatrixXd whole = detail::solve_linear(*L, half.transpose());
    certificate.decay_rate =
        std::max(0.0, detail::symmetric_eigensystem_of(detail::symmetrized(whole)).values(0));
  }
  return certificate;
}

Expected<LyapunovCertificate> lyapunov_certificate(const MatrixRef& A, TimeDomain domain) {
  return lyapunov_certificate(A, MatrixXd::Identity(A.rows(), A.rows()), domain);
}

}  // namespace flyball
