#include <algorithm>
#include <cmath>
#include <limits>

#include "control/robust/stretch.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"

namespace flyball::detail {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

namespace {

constexpr Complex imaginary_unit(0.0, 1.0);

MatrixXcd times(const MatrixXcd& A, const MatrixXcd& B) {
  return A.lazyProduct(B);
}

/// M = D + C (ζ I - A)⁻¹ B with complex matrices.
struct ComplexSystem {
  MatrixXcd A, B, C, D;
};

MatrixXcd shifted(const ContinuousSystem<>& system, double frequency) {
  MatrixXcd jw_A = -system.A.cast<Complex>();
  jw_A.diagonal().array() += imaginary_unit * frequency;
  return jw_A;
}

/// The system in ζ, s = jω₀ + 1/ζ; with X = (jω₀ - A)⁻¹ it is M(jω₀) - C X² (ζ + X)⁻¹ B.
ComplexSystem about(const ContinuousSystem<>& system, double frequency) {
  const Index n = system.A.rows();
  if (std::isinf(frequency)) {
    return {system.A.cast<Complex>(), system.B.cast<Complex>(), system.C.cast<Complex>(),
            system.D.cast<Complex>()};
  }
  const MatrixXcd X = solve_complex(shifted(system, frequency), MatrixXcd::Identity(n, n));
  const MatrixXcd B = system.B.cast<Complex>();
  const MatrixXcd CX = times(system.C.cast<Complex>(), X);
  return {-X, B, -times(CX, X), MatrixXcd(system.D.cast<Complex>() + times(CX, B))};
}

/// Eigenvalues with what rounding may have moved each by, to first order.
struct RoundedEigenvalue {
  Complex value;
  double error = 0.0;
};

std::vector<RoundedEigenvalue> rounded_eigenvalues(const MatrixXcd& H) {
  const ComplexSchur schur = complex_schur_of_complex(H);
  std::vector<RoundedEigenvalue> found;
  if (!schur.converged) {
    return found;
  }
  const Index n = H.rows();
  const double norm = H.norm();
  const double least = std::max(epsilon * norm, std::numeric_limits<double>::min());
  const double rounding = 20.0 * static_cast<double>(n) * epsilon * norm;
  const auto apart = [&](const Complex& d) { return std::abs(d) < least ? Complex(least) : d; };
  for (Index k = 0; k < n; ++k) {
    const Complex value = schur.T(k, k);
    VectorXcd right = VectorXcd::Zero(n);
    VectorXcd left = VectorXcd::Zero(n);
    right(k) = left(k) = 1.0;
    for (Index i = k; i-- > 0;) {
      Complex sum = 0.0;
      for (Index l = i + 1; l <= k; ++l) {
        sum += schur.T(i, l) * right(l);
      }
      right(i) = -sum / apart(schur.T(i, i) - value);
    }
    for (Index i = k + 1; i < n; ++i) {
      Complex sum = 0.0;
      for (Index l = k; l < i; ++l) {
        sum += left(l) * schur.T(l, i);
      }
      left(i) = -sum / apart(schur.T(i, i) - value);
    }
    // The two overlap in their k-th entries alone, which are one.
    found.push_back({value, rounding * right.norm() * left.norm()});
  }
  return found;
}

}  // namespace

MatrixXcd response_at(const ContinuousSystem<>& system, double frequency) {
  MatrixXcd M = system.D.cast<Complex>();
  if (system.A.size() > 0 && std::isfinite(frequency)) {
    M += times(system.C.cast<Complex>(),
               solve_complex(shifted(system, frequency), system.B.cast<Complex>()));
  }
  return M;
}

MatrixXcd response_slope(const ContinuousSystem<>& system, double frequency) {
  const MatrixXcd jw_A = shifted(system, frequency);
  const MatrixXcd X = solve_complex(jw_A, solve_complex(jw_A, system.B.cast<Complex>()));
  return -imaginary_unit * times(system.C.cast<Complex>(), X);
}

Stretch stretch_around(const ContinuousSystem<>& system, double frequency,
                       const StructuredScaling& scaling, double beta) {
  const Stretch none{frequency, frequency};
  const Index n = system.A.rows();
  if (n == 0) {
    return {0.0, infinity};
  }
  const ComplexSystem M = about(system, frequency);
  // [M; I]ᴴ [-D_out, jGᴴ; -jG, β² D_in] [M; I] with R at ζ = ∞.
  const MatrixXcd DC = times(scaling.D_out, M.C);
  const MatrixXcd GC = times(scaling.G, M.C);
  const MatrixXcd Q = -times(M.C.adjoint(), DC);
  const MatrixXcd S_adjoint = -times(M.D.adjoint(), DC) - imaginary_unit * GC;
  const MatrixXcd R = structured_form(M.D, scaling, beta * beta);
  const Index m = R.rows();
  MatrixXcd right(m, 2 * n);
  right << S_adjoint, M.B.adjoint();
  double rcond = 0.0;
  const MatrixXcd solved = solve_complex(R, right, &rcond);
  if (!(rcond > 1e-13) || !solved.allFinite()) {
    return none;
  }
  MatrixXcd H(2 * n, 2 * n);
  H.topLeftCorner(n, n) = M.A - times(M.B, solved.leftCols(n));
  H.topRightCorner(n, n) = -times(M.B, solved.rightCols(n));
  H.bottomLeftCorner(n, n) = -Q + times(S_adjoint.adjoint(), solved.leftCols(n));
  H.bottomRightCorner(n, n) = -H.topLeftCorner(n, n).adjoint();
  const double upper = H.topRightCorner(n, n).norm();
  const double lower = H.bottomLeftCorner(n, n).norm();
  if (upper > 0.0 && lower > 0.0) {
    const double even = std::exp2(std::round(0.5 * (std::log2(lower) - std::log2(upper))));
    H.topRightCorner(n, n) *= even;
    H.bottomLeftCorner(n, n) /= even;
  }
  if (!H.allFinite()) {
    return none;
  }
  const auto eigenvalues = rounded_eigenvalues(H);
  if (eigenvalues.empty()) {
    return none;
  }
  // What lies nearest on either side: 1/|ζ| away, or from infinity at |ζ|.
  constexpr double near_axis = 1e-7;
  double below = 0.0;
  double above = 0.0;
  for (const auto& [value, error] : eigenvalues) {
    const double reach = near_axis * std::abs(value) + error;
    if (!(std::abs(value.real()) > reach)) {
      below = std::max(below, value.imag() + reach);
      above = std::max(above, reach - value.imag());
    }
  }
  constexpr double inside = 1.0 - 1e-9;
  if (std::isinf(frequency)) {
    return {std::max(below, above) / inside, infinity};
  }
  return {below > 0.0 ? std::max(0.0, frequency - inside / below) : 0.0,
          above > 0.0 ? frequency + inside / above : infinity};
}

}  // namespace flyball::detail
