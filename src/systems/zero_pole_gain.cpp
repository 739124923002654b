#include <algorithm>
#include <cmath>
#include <limits>

#include "core/constants.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_blocks.hpp"
#include "systems/balance.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;

/// Two poles, or one, and up to as many zeros.
struct Section {
  std::vector<Complex> poles;
  std::vector<Complex> zeros;
};

bool is_real(Complex value) {
  return value.imag() == 0.0;
}

std::vector<Section> sections_of(const ZeroPoleGain& zpk) {
  std::vector<Section> sections;
  std::vector<Complex> real;
  for (const Complex& pole : zpk.poles) {
    if (is_real(pole)) {
      real.push_back(pole);
    } else if (pole.imag() > 0.0) {
      sections.push_back({{pole, std::conj(pole)}, {}});
    }
  }
  std::sort(real.begin(), real.end(), [](Complex a, Complex b) { return a.real() < b.real(); });
  for (std::size_t k = 0; k < real.size(); k += 2) {
    sections.push_back(k + 1 < real.size() ? Section{{real[k], real[k + 1]}, {}}
                                           : Section{{real[k]}, {}});
  }
  const auto place = [&](const std::vector<Complex>& zeros) {
    Section* nearest = nullptr;
    double smallest = std::numeric_limits<double>::infinity();
    for (Section& section : sections) {
      if (section.zeros.size() + zeros.size() > section.poles.size()) {
        continue;
      }
      const double distance = std::abs(section.poles.front() - zeros.front());
      if (distance < smallest) {
        smallest = distance;
        nearest = &section;
      }
    }
    if (nearest != nullptr) {
      nearest->zeros.insert(nearest->zeros.end(), zeros.begin(), zeros.end());
    }
  };
  for (const Complex& zero : zpk.zeros) {
    if (zero.imag() > 0.0) {
      place({zero, std::conj(zero)});
    }
  }
  for (const Complex& zero : zpk.zeros) {
    if (is_real(zero)) {
      place({zero});
    }
  }
  return sections;
}

ContinuousSystem<> realized(const Section& section) {
  const auto n = static_cast<Index>(section.poles.size());
  ContinuousSystem<> part;
  part.A.setZero(n, n);
  part.B.setZero(n, 1);
  part.C.setZero(1, n);
  part.D.setZero(1, 1);
  part.B(n - 1, 0) = 1.0;
  const Complex p = section.poles.front();
  const std::vector<Complex>& z = section.zeros;
  if (n == 1) {
    part.A(0, 0) = p.real();
    part.C(0, 0) = z.empty() ? 1.0 : (p - z[0]).real();
    part.D(0, 0) = z.empty() ? 0.0 : 1.0;
    return part;
  }
  // x₁ = u/den, x₂ = (s - a) u/den with a = p₁ or its real part; the numerator is
  // c₁ + c₂ (s - a) + d den.
  const bool complex = !is_real(p);
  const double a = p.real();
  const double b = section.poles[1].real();
  part.A << a, 1.0, complex ? -p.imag() * p.imag() : 0.0, b;
  if (z.empty()) {
    part.C << 1.0, 0.0;
  } else if (z.size() == 1) {
    part.C << a - z[0].real(), 1.0;
  } else {
    const double at_a = ((a - z[0]) * (a - z[1])).real();
    part.C << (complex ? at_a - p.imag() * p.imag() : at_a), ((a - z[0]) + (b - z[1])).real();
    part.D(0, 0) = 1.0;
  }
  return part;
}

}  // namespace

std::optional<ZeroPoleGain> zero_pole_gain(const ContinuousSystem<>& system) {
  const auto [A, b0, c0, d0] = scaled_system(system, scaling_of(system.A, system.B, system.C));

  ZeroPoleGain zpk;
  const Eigen::VectorXcd poles = eigenvalues_by_parts_of(A);
  if (!poles.allFinite()) {
    return std::nullopt;
  }
  zpk.poles.assign(poles.begin(), poles.end());

  // Where y stays zero, so does x along c, whose derivative is then a further output: Emami-Naeini
  // and Van Dooren, Automatica 18 (1982), for one input and one output.
  MatrixXd F = A;
  MatrixXd b = b0;
  MatrixXd c = c0;
  double d = d0(0, 0);
  const double unit_b = b0.norm();
  const double tolerance = 1e3 * epsilon * static_cast<double>(A.rows());
  double gain = 1.0;
  if (std::abs(d) <= tolerance * (unit_b * c0.norm()) / std::max(A.norm(), 1e-300)) {
    d = 0.0;
  }
  while (d == 0.0) {
    const double length = c.norm();
    if (F.rows() == 0 || length == 0.0) {
      return std::nullopt;
    }
    // A reflection that takes c to the last axis.
    Eigen::VectorXd v = c.transpose() / length;
    const Index last = v.size() - 1;
    const double sign = v(last) >= 0.0 ? 1.0 : -1.0;
    v(last) += sign;
    const MatrixXd H = MatrixXd::Identity(v.size(), v.size()) -
                       (2.0 / v.squaredNorm()) * MatrixXd(v.lazyProduct(v.transpose()));
    F = product(H, product(F, H));
    b = product(H, b);
    gain *= -sign * length;
    d = b(last, 0);
    c = MatrixXd(F.row(last).head(last));
    const double row = unit_b > 0.0 ? c.norm() / std::max(A.norm(), 1e-300) * unit_b : 0.0;
    if (std::abs(d) <= tolerance * std::max(row, unit_b * 1e-3)) {
      d = 0.0;
      if (c.norm() <= tolerance * A.norm()) {
        return std::nullopt;
      }
    }
    F = MatrixXd(F.topLeftCorner(last, last));
    b = MatrixXd(b.topRows(last));
  }
  zpk.gain = gain * d;
  if (F.rows() > 0) {
    const Eigen::VectorXcd zeros = eigenvalues_of(F - product(b, c) / d);
    if (!zeros.allFinite()) {
      return std::nullopt;
    }
    zpk.zeros.assign(zeros.begin(), zeros.end());
  }
  return zpk;
}

ContinuousSystem<> series_of_sections(const ZeroPoleGain& zpk) {
  const auto n = static_cast<Index>(zpk.poles.size());
  ContinuousSystem<> chain;
  chain.A.setZero(n, n);
  chain.B.setZero(n, 1);
  chain.C.setZero(1, n);
  chain.D.setOnes(1, 1);
  Index done = 0;
  for (const Section& section : sections_of(zpk)) {
    const ContinuousSystem<> part = realized(section);
    const Index k = part.A.rows();
    // u of this section is C x + D u of what precedes it.
    chain.A.block(done, done, k, k) = part.A;
    chain.A.block(done, 0, k, done) = product(part.B, chain.C.leftCols(done));
    chain.B.middleRows(done, k) = part.B * chain.D(0, 0);
    chain.C.leftCols(done) *= part.D(0, 0);
    chain.C.middleCols(done, k) = part.C;
    chain.D *= part.D(0, 0);
    done += k;
  }
  chain.C *= zpk.gain;
  chain.D *= zpk.gain;
  return chain;
}

}  // namespace flyball::detail
