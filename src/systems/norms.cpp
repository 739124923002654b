#include <flyball/systems/norms.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include <flyball/math/search/minimum.hpp>
#include <flyball/systems/analysis.hpp>
#include <flyball/systems/conversion.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "systems/balance.hpp"
#include "systems/gramian_factor.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::product;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr double relative_accuracy = 1e-10;

double largest_singular_value(const MatrixXd& M) {
  return M.size() == 0 ? 0.0 : detail::singular_values_of(M)(0);
}

/// The largest singular value of G(jω) at many frequencies: with A in Hessenberg form each costs
/// O(n²).
class Gain {
 public:
  explicit Gain(const ContinuousSystem<>& system) : D_(system.D) {
    const detail::Hessenberg form = detail::hessenberg_of(system.A);
    H_ = form.H;
    B_ = detail::transposed_product(form.Q, system.B);
    C_ = product(system.C, form.Q);
    if (B_.cols() > C_.rows()) {
      // Gᵀ has the same gain and fewer columns to solve for; both orders reversed keep the form.
      MatrixXd B = C_.transpose().colwise().reverse();
      C_ = MatrixXd(B_.transpose().rowwise().reverse());
      B_ = std::move(B);
      H_ = H_.transpose().reverse().eval();
      D_ = D_.transpose().eval();
    }
  }

  [[nodiscard]] double at(double omega) const {
    if (std::isinf(omega)) {
      return largest_singular_value(D_);
    }
    solve(omega);
    G_ = D_.cast<Complex>();
    for (Index j = 0; j < X_.cols(); ++j) {
      for (Index k = 0; k < X_.rows(); ++k) {
        G_.col(j) += C_.col(k) * X_(k, j);
      }
    }
    return largest();
  }

 private:
  /// X = (jωI - H)⁻¹B by elimination of the subdiagonal with row pivoting.
  void solve(double omega) const {
    const Index n = H_.rows();
    U_ = -H_.cast<Complex>();
    U_.diagonal().array() += Complex(0.0, omega);
    X_ = B_.cast<Complex>();
    // Rows stand one behind the other in U.
    for (Index k = 0; k + 1 < n; ++k) {
      const Complex pivot = U_(k, k);
      if (std::abs(U_(k + 1, k).real()) > std::abs(pivot.real()) + std::abs(pivot.imag())) {
        U_.row(k).tail(n - k).swap(U_.row(k + 1).tail(n - k));
        X_.row(k).swap(X_.row(k + 1));
      }
      if (U_(k + 1, k) != 0.0) {
        const Complex factor = U_(k + 1, k) / U_(k, k);
        U_.row(k + 1).tail(n - k - 1) -= factor * U_.row(k).tail(n - k - 1);
        X_.row(k + 1) -= factor * X_.row(k);
      }
    }
    for (Index j = 0; j < X_.cols(); ++j) {
      for (Index k = n - 1; k >= 0; --k) {
        const Index behind = n - k - 1;
        const Complex known =
            U_.row(k).tail(behind).transpose().cwiseProduct(X_.col(j).tail(behind)).sum();
        X_(k, j) = (X_(k, j) - known) / U_(k, k);
      }
    }
  }

  [[nodiscard]] double largest() const {
    if (G_.cols() == 1) {
      return G_.norm();
    }
    if (G_.cols() == 2) {
      // The eigenvalues of [a b; b̄ d] = GᴴG.
      const double a = G_.col(0).squaredNorm();
      const double d = G_.col(1).squaredNorm();
      const double b = std::abs(G_.col(0).dot(G_.col(1)));
      return std::sqrt(0.5 * (a + d + std::hypot(a - d, 2.0 * b)));
    }
    // Squares lose nothing of the largest; the doubled real matrix has each of them twice.
    const Eigen::MatrixXcd square = detail::complex_product(G_.adjoint(), G_);
    const Index m = square.rows();
    MatrixXd doubled(2 * m, 2 * m);
    doubled << square.real(), -square.imag(), square.imag(), square.real();
    return std::sqrt(detail::symmetric_eigensystem_of(doubled).values(2 * m - 1));
  }

  MatrixXd H_, B_, C_, D_;
  mutable Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> U_;
  mutable Eigen::MatrixXcd X_, G_;  // Memory for `at`.
};

/// The frequencies at which a singular value of G may be γ: those of the eigenvalues of the
/// Hamiltonian on the imaginary axis. How far rounding takes them from it, nobody knows beforehand:
/// all are told, which only costs time; `Gain` decides.
std::vector<double> crossings(const ContinuousSystem<>& s, double gamma) {
  const Index n = s.A.rows();
  const Index m = s.B.cols();
  const Index p = s.C.rows();
  // R = γ²I - DᵀD; [A + BR⁻¹DᵀC, γBR⁻¹Bᵀ; -γCᵀS⁻¹C, -(A + BR⁻¹DᵀC)ᵀ], S = γ²I - DDᵀ.
  const MatrixXd R =
      gamma * gamma * MatrixXd::Identity(m, m) - detail::transposed_product(s.D, s.D);
  const MatrixXd S =
      gamma * gamma * MatrixXd::Identity(p, p) - detail::product_transposed(s.D, s.D);
  const MatrixXd R_B = detail::solve_linear(R, s.B.transpose());
  const MatrixXd R_DC = detail::solve_linear(R, detail::transposed_product(s.D, s.C));
  const MatrixXd S_C = detail::solve_linear(S, s.C);
  MatrixXd H(2 * n, 2 * n);
  H.topLeftCorner(n, n) = s.A + product(s.B, R_DC);
  H.topRightCorner(n, n) = gamma * product(s.B, R_B);
  H.bottomLeftCorner(n, n) = -gamma * detail::transposed_product(s.C, S_C);
  H.bottomRightCorner(n, n) = -H.topLeftCorner(n, n).transpose();
  const Eigen::VectorXcd eigenvalues = detail::eigenvalues_of(H);
  std::vector<double> found;
  for (const Complex& lambda : eigenvalues) {
    if (lambda.imag() >= 0.0) {
      found.push_back(lambda.imag());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// G(1/s): what lies at infinity comes to the origin. A has no pole on the axis, so it has an
/// inverse.
ContinuousSystem<> inverted(const ContinuousSystem<>& s) {
  const Index n = s.A.rows();
  MatrixXd right(n, n + s.B.cols());
  right << MatrixXd::Identity(n, n), s.B;
  const MatrixXd solved = detail::solve_linear(s.A, right);
  const MatrixXd A_B = solved.rightCols(s.B.cols());
  return {solved.leftCols(n), -A_B, product(s.C, solved.leftCols(n)), s.D - product(s.C, A_B)};
}

/// @param system  Without a pole on the axis, scaled.
Expected<HInfinityNorm> largest_gain(const ContinuousSystem<>& system, std::string_view where) {
  const Gain gains(system);
  HInfinityNorm best{gains.at(infinity), infinity, 0.0, 0};
  const auto consider = [&](double omega) {
    const double gain = gains.at(omega);
    if (gain > best.norm || (gain == best.norm && omega < best.frequency)) {
      best.norm = gain;
      best.frequency = omega;
    }
  };
  consider(0.0);
  const Eigen::VectorXcd poles = detail::eigenvalues_of(system.A);
  for (const Complex& pole : poles) {
    if (pole.imag() < 0.0) {
      continue;
    }
    consider(std::abs(pole));
    if (pole.imag() > 0.0) {
      consider(pole.imag());
      // Where a second-order peak is: ω² = |p|² - 2 Re(p)².
      const double peak = std::norm(pole) - 2.0 * pole.real() * pole.real();
      if (peak > 0.0) {
        consider(std::sqrt(peak));
      }
    }
  }
  const Eigen::VectorXd sizes = poles.cwiseAbs();
  const double slowest = sizes.minCoeff();
  const double fastest = sizes.maxCoeff();
  constexpr int grid = 24;
  for (int k = 0; k <= grid; ++k) {
    consider(1e-3 * slowest * std::pow(1e6 * fastest / slowest, static_cast<double>(k) / grid));
  }
  if (best.norm == 0.0) {
    return HInfinityNorm{0.0, 0.0, 0.0, 0};
  }
  // γ²I - DᵀD is regular only well above the gain at infinity, or else at the origin.
  const bool turned = gains.at(infinity) > gains.at(0.0);
  const ContinuousSystem<> representative = turned ? inverted(system) : system;
  constexpr int most_iterations = 60;
  double width = 1e-3;  // of the search for the peak itself
  for (best.iterations = 1; best.iterations <= most_iterations; ++best.iterations) {
    const double gamma = best.norm * (1.0 + 0.5 * relative_accuracy);
    std::vector<double> found = crossings(representative, gamma);
    if (turned) {
      std::reverse(found.begin(), found.end());
      for (double& omega : found) {
        omega = 1.0 / omega;
      }
      std::erase_if(found, [](double omega) { return !std::isfinite(omega); });
    }
    const double before = best.norm;
    // Between neighbouring crossings the gain is above γ, or below it throughout.
    double low = 0.0;
    for (const double omega : found) {
      consider(omega);
      consider(0.5 * (low + omega));
      low = omega;
    }
    consider(2.0 * low);
    if (best.norm > gamma) {
      continue;
    }
    if (best.norm <= before * (1.0 + relative_accuracy)) {
      // What no eigenvalue shows beyond rounding: the peak itself, and a flat hill's top.
      if (std::isfinite(best.frequency) && best.frequency > 0.0) {
        const auto top =
            find_minimum([&](double omega) { return -gains.at(omega); },
                         best.frequency * (1.0 - width), best.frequency * (1.0 + width));
        if (top && -top->value > best.norm) {
          const bool grew = -top->value > best.norm * (1.0 + 0.5 * relative_accuracy);
          best.norm = -top->value;
          best.frequency = top->x;
          if (grew) {
            width = std::min(0.5, 4.0 * width);
            continue;
          }
        }
      }
      best.upper_bound = best.norm * (1.0 + relative_accuracy);
      return best;
    }
  }
  return refusal(SystemError::no_convergence, where, "the largest gain")
      .with("gain reached", best.norm)
      .with("frequency", best.frequency);
}

Expected<double> root_of_power(const ContinuousSystem<>& system, TimeDomain domain) {
  if (system.A.size() == 0) {
    return domain == TimeDomain::continuous ? 0.0 : system.D.norm();
  }
  const auto [s, gain, time] = detail::normalized(system, domain);
  FLYBALL_TRY(auto L, detail::gramian_factor(s.A, s.B, domain, "h2_norm"));
  const double energy = product(s.C, L).norm();
  // ‖G‖² = ∫ |G(jω)|² dω/2π takes the unit of time once.
  return std::ldexp(domain == TimeDomain::continuous ? energy : std::hypot(energy, s.D.norm()),
                    gain + time / 2);
}

}  // namespace

Expected<double> h2_norm(const ContinuousSystem<>& system) {
  constexpr std::string_view where = "h2_norm";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  if (!system.D.isZero(0.0)) {
    return refusal(SystemError::infinite_norm, where, "D")
        .got("not zero")
        .expected("zero: white noise through D has infinite power")
        .with("norm of D", system.D.norm());
  }
  return root_of_power(system, TimeDomain::continuous);
}

Expected<double> h2_norm(const DiscreteSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, "h2_norm"));
  return root_of_power({system.A, system.B, system.C, system.D}, TimeDomain::discrete);
}

namespace {

/// No pole on the imaginary axis, or the unit circle, as far as rounding can tell.
Expected<void> check_off_axis(const MatrixRef& A, TimeDomain domain, std::string_view where) {
  FLYBALL_TRY(const auto analysis, analyze_modes(A, domain));
  for (const Mode& mode : analysis.modes) {
    if (mode.stability == Stability::marginal) {
      return refusal(SystemError::not_stable, where, "A")
          .got("marginally stable")
          .expected(domain == TimeDomain::continuous
                        ? "without a pole on the imaginary axis: the gain there is infinite"
                        : "without a pole on the unit circle: the gain there is infinite")
          .with("pole", std::vector<double>{mode.pole.real(), mode.pole.imag()});
    }
  }
  return {};
}

Expected<HInfinityNorm> gain_of_static(const MatrixXd& D) {
  return HInfinityNorm{.norm = largest_singular_value(D), .upper_bound = largest_singular_value(D)};
}

/// @param system  Without a pole on the axis.
Expected<HInfinityNorm> norm_of(const ContinuousSystem<>& system, std::string_view where) {
  const auto [s, gain, time] = detail::normalized(system, TimeDomain::continuous);
  auto norm = largest_gain(s, where);
  if (norm) {
    norm->norm = std::ldexp(norm->norm, gain);
    norm->upper_bound = std::ldexp(norm->upper_bound, gain);
    norm->frequency = std::ldexp(norm->frequency, time);
  }
  return norm;
}

Expected<HInfinityNorm> norm_of(const DiscreteSystem<>& system, std::string_view where) {
  // With T = 2, s = (z - 1)/(z + 1) = j tan(ωT/2).
  const auto [s, gain, time] =
      detail::normalized({system.A, system.B, system.C, system.D}, TimeDomain::discrete);
  FLYBALL_TRY(auto mapped,
              convert_to_continuous({s.A, s.B, s.C, s.D, Time(2.0)}, ConversionMethod::tustin));
  auto norm = norm_of(mapped, where);
  if (norm) {
    norm->norm = std::ldexp(norm->norm, gain);
    norm->upper_bound = std::ldexp(norm->upper_bound, gain);
    norm->frequency = 2.0 * std::atan(norm->frequency) / system.period.si();
  }
  return norm;
}

template <class System>
Expected<HInfinityNorm> h_infinity(const System& system, TimeDomain domain) {
  constexpr std::string_view where = "h_infinity_norm";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  if (system.A.size() == 0) {
    return gain_of_static(system.D);
  }
  FLYBALL_CHECK(detail::check_stable(system.A, domain, where));
  return norm_of(system, where);
}

template <class System>
Expected<HInfinityNorm> l_infinity(const System& system, TimeDomain domain) {
  constexpr std::string_view where = "l_infinity_norm";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  if (system.A.size() == 0) {
    return gain_of_static(system.D);
  }
  FLYBALL_CHECK(check_off_axis(system.A, domain, where));
  return norm_of(system, where);
}

}  // namespace

Expected<HInfinityNorm> h_infinity_norm(const ContinuousSystem<>& system) {
  return h_infinity(system, TimeDomain::continuous);
}

Expected<HInfinityNorm> h_infinity_norm(const DiscreteSystem<>& system) {
  return h_infinity(system, TimeDomain::discrete);
}

Expected<HInfinityNorm> l_infinity_norm(const ContinuousSystem<>& system) {
  return l_infinity(system, TimeDomain::continuous);
}

Expected<HInfinityNorm> l_infinity_norm(const DiscreteSystem<>& system) {
  return l_infinity(system, TimeDomain::discrete);
}

}  // namespace flyball
