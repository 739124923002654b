#include <cmath>

#include "control/robust/structured_bound.hpp"
#include "math/dense/dense.hpp"
#include "math/verified/definite.hpp"
#include "math/verified/interval.hpp"

// Hermitian matrices and the proof of a bound.
namespace flyball::detail {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

bool factor_hermitian(MatrixXcd& S) {
  const Index n = S.rows();
  for (Index j = 0; j < n; ++j) {
    const double d = S(j, j).real();
    if (!(d > 0.0) || !std::isfinite(d)) {
      return false;
    }
    const double pivot = std::sqrt(d);
    S(j, j) = pivot;
    for (Index i = j + 1; i < n; ++i) {
      S(i, j) /= pivot;
    }
    for (Index k = j + 1; k < n; ++k) {
      const Complex factor = std::conj(S(k, j));
      for (Index i = k; i < n; ++i) {
        S(i, k) -= S(i, j) * factor;
      }
    }
    for (Index i = 0; i < j; ++i) {
      S(i, j) = 0.0;
    }
  }
  return true;
}

MatrixXcd inverse_of_lower(const MatrixXcd& L) {
  const Index n = L.rows();
  MatrixXcd R = MatrixXcd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    R(j, j) = 1.0 / L(j, j);
    for (Index i = j + 1; i < n; ++i) {
      Complex sum = 0.0;
      for (Index k = j; k < i; ++k) {
        sum += L(i, k) * R(k, j);
      }
      R(i, j) = -sum / L(i, i);
    }
  }
  return R;
}

double largest_ratio(const MatrixXcd& X, const MatrixXcd& Y) {
  MatrixXcd L = Y;
  if (!factor_hermitian(L)) {
    return std::numeric_limits<double>::infinity();
  }
  const MatrixXcd R = inverse_of_lower(L);
  const MatrixXcd RX = R.lazyProduct(X);
  const MatrixXcd Z = RX.lazyProduct(R.adjoint());
  const Index n = Z.rows();
  MatrixXd doubled(2 * n, 2 * n);
  doubled << Z.real(), -Z.imag(), Z.imag(), Z.real();
  return symmetric_eigensystem_of(symmetrized(doubled)).values(2 * n - 1);
}

MatrixXcd structured_form(const MatrixXcd& M, const StructuredScaling& scaling, double squared) {
  const MatrixXcd DM = scaling.D_out.lazyProduct(M);
  const MatrixXcd GM = scaling.G.lazyProduct(M);
  MatrixXcd form = squared * scaling.D_in - M.adjoint().lazyProduct(DM);
  form -= Complex(0.0, 1.0) * (GM - GM.adjoint());
  return form;
}

bool proves(const MatrixXcd& M, const StructuredScaling& scaling, double beta, double error) {
  if (!surely_positive(scaling.D_out, 0.0) || !surely_positive(scaling.D_in, 0.0)) {
    return false;
  }
  const Index n = M.rows() + M.cols();
  const MatrixXd size = M.cwiseAbs() * inflation;
  const MatrixXd D_out = scaling.D_out.cwiseAbs() * inflation;
  const MatrixXd D_in = scaling.D_in.cwiseAbs() * inflation;
  const MatrixXd G = scaling.G.cwiseAbs() * inflation;
  const MatrixXd DM = D_out.lazyProduct(size);
  const MatrixXd MDM = size.transpose().lazyProduct(DM);
  const MatrixXd GM = G.lazyProduct(size);
  // A complex product is four real ones; M is within `error` of what is meant.
  MatrixXd rest = 4.0 * product_rounding(2 * n) * (beta * beta * D_in + MDM + GM + GM.transpose());
  if (error > 0.0) {
    const MatrixXd E = MatrixXd::Constant(M.rows(), M.cols(), error);
    const MatrixXd moved = (DM + D_out.lazyProduct(E)).transpose().lazyProduct(E);
    const MatrixXd turned = G.lazyProduct(E);
    rest += 2.0 * (moved + moved.transpose() + turned + turned.transpose());
  }
  rest = rest * inflation;
  rest.array() += underflow;
  return surely_positive(structured_form(M, scaling, beta * beta), norm_above(rest) * inflation);
}

double proven_bound(const MatrixXcd& M, StructuredBound& bound, double error) {
  if (bound.squared <= 0.0 && proves(M, bound.scaling, 0.0, error)) {
    return 0.0;
  }
  const double beta = std::sqrt(std::max(bound.squared, 0.0));
  const double size = M.norm();
  if (std::isfinite(beta)) {
    for (double more = 1e-14; more < 1e-2; more *= 4.0) {
      const double above = beta * (1.0 + more) + 1e-3 * more * size;
      if (proves(M, bound.scaling, above, error)) {
        return above;
      }
    }
  }
  bound.scaling = {MatrixXcd::Identity(M.rows(), M.rows()), MatrixXcd::Identity(M.cols(), M.cols()),
                   MatrixXcd::Zero(M.cols(), M.rows())};
  // σ(M) is no more than the Frobenius norm.
  const auto entries = static_cast<double>(M.size());
  return (size * (1.0 + (entries + 8.0) * unit_roundoff) + std::sqrt(entries) * error) * inflation +
         underflow;
}

}  // namespace flyball::detail
