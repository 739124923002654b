#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "classical/modal_response.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "math/extended/double_double.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Complex = std::complex<double>;
using flyball::detail::DoubleDoubleMatrix;
#ifdef FLYBALL_WIDE_VECTORS
using flyball::detail::has_wide_vectors;
#endif
using flyball::detail::product;

namespace {

/// A V = V Λ over the reals: a pair a ± jb is a block [a b; -b a], its columns of V the real and
/// the imaginary part of the eigenvector of a + jb.
struct RealModes {
  DoubleDoubleMatrix V;
  DoubleDoubleMatrix Lambda;
  std::vector<bool> begins_pair;
};

std::optional<RealModes> first_modes(const MatrixXd& A) {
  const auto system = flyball::detail::eigensystem_of(A);
  if (!system.values.allFinite() || !system.vectors.allFinite()) {
    return std::nullopt;
  }
  const Index n = A.rows();
  MatrixXd V(n, n);
  MatrixXd Lambda = MatrixXd::Zero(n, n);
  RealModes modes;
  modes.begins_pair.assign(static_cast<std::size_t>(n), false);
  for (Index k = 0; k < n;) {
    const Complex value = system.values(k);
    V.col(k) = system.vectors.col(k).real();
    Lambda(k, k) = value.real();
    if (value.imag() == 0.0) {
      ++k;
      continue;
    }
    if (k + 1 == n || value.imag() < 0.0) {
      return std::nullopt;
    }
    V.col(k + 1) = system.vectors.col(k).imag();
    Lambda(k, k + 1) = value.imag();
    Lambda(k + 1, k) = -value.imag();
    Lambda(k + 1, k + 1) = value.real();
    modes.begins_pair[static_cast<std::size_t>(k)] = true;
    k += 2;
  }
  modes.V = DoubleDoubleMatrix(std::move(V));
  modes.Lambda = DoubleDoubleMatrix(std::move(Lambda));
  return modes;
}

/// Columns of real and imaginary parts as pairs of conjugates, and back.
MatrixXcd complex_columns(const MatrixXd& M, const std::vector<bool>& begins_pair) {
  MatrixXcd all(M.rows(), M.cols());
  for (Index k = 0; k < M.cols(); ++k) {
    if (begins_pair[static_cast<std::size_t>(k)]) {
      for (Index i = 0; i < M.rows(); ++i) {
        all(i, k) = Complex(M(i, k), M(i, k + 1));
        all(i, k + 1) = std::conj(all(i, k));
      }
      ++k;
    } else {
      all.col(k) = M.col(k).cast<Complex>();
    }
  }
  return all;
}

MatrixXd real_columns(const MatrixXcd& M, const std::vector<bool>& begins_pair) {
  MatrixXd all = M.real();
  for (Index k = 0; k < M.cols(); ++k) {
    if (begins_pair[static_cast<std::size_t>(k)]) {
      all.col(k + 1) = M.col(k).imag();
    }
  }
  return all;
}

/// V ← V (I + F), Λ ← Λ + diag of V⁻¹(A V - V Λ), with the rest of that over the distances of the
/// poles for F; the largest entry of F, infinite where it has none.
double refine(const DoubleDoubleMatrix& A, RealModes& modes) {
  const Index n = A.rows();
  const DoubleDoubleMatrix error = add_product(product(A, modes.V), -1.0, modes.V, modes.Lambda);
  const MatrixXcd V = complex_columns(modes.V.hi, modes.begins_pair);
  const MatrixXcd E =
      flyball::detail::solve_complex(V, complex_columns(error.rounded(), modes.begins_pair));
  if (!E.allFinite()) {
    return infinity;
  }
  const auto value = [&](Index k) {
    const bool second = k > 0 && modes.begins_pair[static_cast<std::size_t>(k - 1)];
    return Complex(modes.Lambda.hi(k, k), second ? modes.Lambda.hi(k, k - 1)
                                          : modes.begins_pair[static_cast<std::size_t>(k)]
                                              ? modes.Lambda.hi(k, k + 1)
                                              : 0.0);
  };
  MatrixXcd F = MatrixXcd::Zero(n, n);
  for (Index l = 0; l < n; ++l) {
    for (Index k = 0; k < n; ++k) {
      if (k != l) {
        F(k, l) = E(k, l) / (value(l) - value(k));
      }
    }
  }
  const double size = F.cwiseAbs().maxCoeff();
  if (!(size < 1e-3)) {
    return infinity;
  }
  MatrixXd shift = MatrixXd::Zero(n, n);
  for (Index k = 0; k < n; ++k) {
    shift(k, k) = E(k, k).real();
    if (modes.begins_pair[static_cast<std::size_t>(k)]) {
      shift(k, k + 1) = E(k, k).imag();
      shift(k + 1, k) = -E(k, k).imag();
      shift(k + 1, k + 1) = E(k, k).real();
      ++k;
    }
  }
  modes.Lambda = sum(std::move(modes.Lambda), 1.0, DoubleDoubleMatrix(shift));
  modes.V = sum(
      std::move(modes.V), 1.0,
      DoubleDoubleMatrix(real_columns(flyball::detail::complex_product(V, F), modes.begins_pair)));
  return size;
}

}  // namespace

FinePoint point_on_axis(double frequency, const std::optional<Time>& period) {
  if (!period) {
    return {.im = frequency};
  }
  const double T = period->si();
  const double theta = frequency * T;
  const double rest = std::fma(frequency, T, -theta);
  const long double c = std::cos(static_cast<long double>(theta));
  const long double s = std::sin(static_cast<long double>(theta));
  const long double turned_c = c - s * rest;
  const long double turned_s = s + c * rest;
  FinePoint z;
  z.re = static_cast<double>(turned_c);
  z.re_lo = static_cast<double>(turned_c - z.re);
  z.im = static_cast<double>(turned_s);
  z.im_lo = static_cast<double>(turned_s - z.im);
  return z;
}

std::optional<ModalResponse> ModalResponse::create(const ContinuousSystem<>& system) {
  auto modes = first_modes(system.A);
  if (!modes) {
    return std::nullopt;
  }
  const DoubleDoubleMatrix A(system.A);
  double left = std::numeric_limits<double>::infinity();
  constexpr int most_steps = 4;
  for (int step = 0; step < most_steps && left > 1e-9; ++step) {
    left = refine(A, *modes);
    if (std::isinf(left)) {
      return std::nullopt;
    }
  }
  if (left > 1e-9) {
    return std::nullopt;
  }
  const DoubleDoubleMatrix B(system.B);
  const MatrixXd c = product(DoubleDoubleMatrix(system.C), modes->V).rounded();
  DoubleDoubleMatrix W(flyball::detail::solve_linear(modes->V.hi, system.B));
  for (int step = 0; step < 2; ++step) {
    const MatrixXd rest = add_product(B, -1.0, modes->V, W).rounded();
    W = sum(std::move(W), 1.0,
            DoubleDoubleMatrix(flyball::detail::solve_linear(modes->V.hi, rest)));
  }
  const MatrixXd w = W.rounded();
  if (!c.allFinite() || !w.allFinite()) {
    return std::nullopt;
  }

  ModalResponse response;
  ModalTerms& terms = response.terms_;
  const Index outputs = c.rows();
  const Index inputs = w.cols();
  terms.outputs_times_inputs = static_cast<int>(outputs * inputs);
  const auto add = [&](Index k, bool pair) {
    terms.re.push_back(modes->Lambda.hi(k, k));
    terms.re_lo.push_back(modes->Lambda.lo(k, k));
    terms.im.push_back(pair ? modes->Lambda.hi(k, k + 1) : 0.0);
    terms.im_lo.push_back(pair ? modes->Lambda.lo(k, k + 1) : 0.0);
    double largest = 0.0;
    for (Index j = 0; j < inputs; ++j) {
      for (Index i = 0; i < outputs; ++i) {
        // Re v wᵣ + Im v wᵢ = 2 Re(v (wᵣ - j wᵢ)/2)
        const Complex R =
            pair ? Complex(c(i, k), c(i, k + 1)) * (0.5 * Complex(w(k, j), -w(k + 1, j)))
                 : Complex(c(i, k) * w(k, j));
        terms.residue.push_back(R.real());
        terms.residue.push_back(R.imag());
        largest = std::max(largest, std::abs(R));
      }
    }
    terms.weight.push_back(largest);
  };
  for (Index k = 0; k < c.cols(); ++k) {
    if (modes->begins_pair[static_cast<std::size_t>(k)]) {
      add(k, true);
      ++k;
    }
  }
  terms.pairs = static_cast<int>(terms.re.size());
  for (Index k = 0; k < c.cols(); ++k) {
    if (modes->begins_pair[static_cast<std::size_t>(k)]) {
      ++k;
    } else {
      add(k, false);
    }
  }
  terms.count = static_cast<int>(terms.re.size());
  for (Index j = 0; j < inputs; ++j) {
    for (Index i = 0; i < outputs; ++i) {
      terms.direct.push_back(system.D(i, j));
      terms.direct_size = std::max(terms.direct_size, std::abs(system.D(i, j)));
    }
  }
  return response;
}

std::vector<Index> ModalResponse::evaluate(const std::vector<FinePoint>& points,
                                           Complex* values) const {
  // A term has up to ten roundings, a sum as many as it has terms.
  const double rounding = 0.5 * std::numeric_limits<double>::epsilon();
  const double growth = rounding * (16.0 + 2.0 * terms_.count);
  const int entries = terms_.outputs_times_inputs;
  constexpr int at_once = 64;
  std::vector<double> lanes(static_cast<std::size_t>(at_once * modal_point));
  std::vector<double> sums(static_cast<std::size_t>(at_once * 2 * modal_lanes * entries));
  std::vector<double> bounds(static_cast<std::size_t>(at_once * modal_lanes));
  std::vector<Index> doubtful;
  const auto count = static_cast<Index>(points.size());
  for (Index first = 0; first < count; first += at_once * modal_lanes) {
    const Index here = std::min<Index>(at_once * modal_lanes, count - first);
    const Index blocks = (here + modal_lanes - 1) / modal_lanes;
    for (Index k = 0; k < blocks * modal_lanes; ++k) {
      const FinePoint& z = points[static_cast<std::size_t>(std::min(first + k, count - 1))];
      double* block = lanes.data() + k / modal_lanes * modal_point + k % modal_lanes;
      block[0] = z.re;
      block[modal_lanes] = z.re_lo;
      block[2 * modal_lanes] = z.im;
      block[3 * modal_lanes] = z.im_lo;
    }
    FLYBALL_RUN_KERNEL(modal_response, terms_, lanes.data(), static_cast<int>(blocks), sums.data(),
                       bounds.data());
    for (Index k = 0; k < here; ++k) {
      const double* from =
          sums.data() + k / modal_lanes * 2 * modal_lanes * entries + k % modal_lanes;
      Complex* to = values + (first + k) * entries;
      double largest = 0.0;
      for (int e = 0; e < entries; ++e, from += 2 * modal_lanes) {
        to[e] = {from[0], from[modal_lanes]};
        largest = std::max(largest, from[0] * from[0] + from[modal_lanes] * from[modal_lanes]);
      }
      const double error = growth * bounds[static_cast<std::size_t>(k)];
      if (!(error * error <= 1e-24 * largest) || !std::isfinite(largest)) {
        doubtful.push_back(first + k);
      }
    }
  }
  return doubtful;
}

}  // namespace flyball::classical::detail
