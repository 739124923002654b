#include <flyball/classical/partial_fractions.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/polynomial.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr std::string_view in_partial_fractions = "partial_fractions";

/// A root and how often it is one.
struct Repeated {
  Complex root;
  int times = 1;
};

VectorXd without_leading_zeros(const VectorXd& p) {
  Index first = 0;
  while (first + 1 < p.size() && p(first) == 0.0) {
    ++first;
  }
  return p.tail(p.size() - first);
}

/// Π(s - r)^m and Π(s + |r|)^m, the size of its coefficients' terms.
std::pair<VectorXcd, VectorXd> expanded(const std::vector<Repeated>& roots) {
  std::vector<std::complex<long double>> p{1.0L};
  std::vector<long double> sizes{1.0L};
  for (const Repeated& r : roots) {
    for (int k = 0; k < r.times; ++k) {
      p.push_back(0.0L);
      sizes.push_back(0.0L);
      const std::complex<long double> root(r.root);
      for (std::size_t i = p.size() - 1; i > 0; --i) {
        p[i] -= root * p[i - 1];
        sizes[i] += std::abs(root) * sizes[i - 1];
      }
    }
  }
  VectorXcd coefficients(static_cast<Index>(p.size()));
  VectorXd terms(static_cast<Index>(p.size()));
  for (std::size_t i = 0; i < p.size(); ++i) {
    coefficients(static_cast<Index>(i)) = Complex(p[i]);
    terms(static_cast<Index>(i)) = static_cast<double>(sizes[i]);
  }
  return {coefficients, terms};
}

/// Whether the polynomial of these roots is the given monic one but for rounding.
bool agrees(const std::vector<Repeated>& roots, const VectorXd& monic) {
  const auto [p, terms] = expanded(roots);
  for (Index i = 0; i < monic.size(); ++i) {
    if (!(std::abs(p(i) - monic(i)) <= 1e-14 * terms(i))) {
      return false;
    }
  }
  return true;
}

/// Roots of a polynomial with those that its coefficients do not tell apart as one.
std::vector<Repeated> gathered(const VectorXcd& roots, const VectorXd& den) {
  const VectorXd monic = den / den(0);
  std::vector<Repeated> best;
  for (const Complex& root : roots) {
    best.push_back({root, 1});
  }
  const auto near = [](const std::vector<Repeated>& all, std::size_t i, std::size_t j) {
    return std::abs(all[i].root - all[j].root);
  };
  // Merges nearest first, of conjugates alike; what agrees at any stage is taken.
  std::vector<Repeated> merged = best;
  for (;;) {
    std::size_t a = 0;
    std::size_t b = 0;
    double distance = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < merged.size(); ++i) {
      for (std::size_t j = i + 1; j < merged.size(); ++j) {
        const double size = std::max(std::abs(merged[i].root), std::abs(merged[j].root));
        if (near(merged, i, j) < distance && near(merged, i, j) <= 0.1 * size) {
          distance = near(merged, i, j);
          a = i;
          b = j;
        }
      }
    }
    if (!std::isfinite(distance)) {
      return best;
    }
    const auto join = [&](std::size_t i, std::size_t j) {
      const int times = merged[i].times + merged[j].times;
      merged[i].root = (static_cast<double>(merged[i].times) * merged[i].root +
                        static_cast<double>(merged[j].times) * merged[j].root) /
                       static_cast<double>(times);
      merged[i].times = times;
      merged.erase(merged.begin() + static_cast<std::ptrdiff_t>(j));
    };
    const Complex first = merged[a].root;
    const Complex second = merged[b].root;
    join(a, b);
    Complex& mean = merged[a].root;
    if (std::abs(mean.imag()) <= 1e-3 * std::abs(first - second) || second == std::conj(first)) {
      mean.imag(0.0);
    }
    if (mean.imag() != 0.0) {
      // The same for their conjugates.
      const auto place = [&](Complex root) {
        return static_cast<std::size_t>(
            std::find_if(merged.begin(), merged.end(),
                         [&](const Repeated& r) { return r.root == std::conj(root); }) -
            merged.begin());
      };
      const std::size_t i = place(first);
      const std::size_t j = place(second);
      if (i < merged.size() && j < merged.size() && i != j) {
        const Complex conjugate = std::conj(merged[a].root);
        join(std::min(i, j), std::max(i, j));
        merged[std::min(i, j)].root = conjugate;
      }
    }
    if (agrees(merged, monic)) {
      best = merged;
    }
  }
}

std::vector<Repeated> equal_ones(const VectorXcd& roots) {
  std::vector<Repeated> found;
  for (const Complex& root : roots) {
    const auto known =
        std::find_if(found.begin(), found.end(), [&](const Repeated& r) { return r.root == root; });
    if (known == found.end()) {
      found.push_back({root, 1});
    } else {
      ++known->times;
    }
  }
  return found;
}

/// Series in t = s - p up to t^{m-1}: times (c + t), divided by it.
void multiply(std::vector<Complex>& series, Complex c) {
  for (std::size_t k = series.size(); k-- > 0;) {
    series[k] = c * series[k] + (k > 0 ? series[k - 1] : 0.0);
  }
}
void divide(std::vector<Complex>& series, Complex c) {
  for (std::size_t k = 0; k < series.size(); ++k) {
    series[k] = (series[k] - (k > 0 ? series[k - 1] : 0.0)) / c;
  }
}

std::vector<PartialFraction> fractions_of(const VectorXcd& zeros,
                                          const std::vector<Repeated>& poles, double gain) {
  std::vector<PartialFraction> fractions;
  for (const Repeated& pole : poles) {
    std::vector<Complex> series(static_cast<std::size_t>(pole.times), 0.0);
    series[0] = gain;
    // Factors above and below by turns, so that nothing overflows.
    std::vector<Complex> below;
    for (const Repeated& other : poles) {
      if (&other != &pole) {
        below.insert(below.end(), static_cast<std::size_t>(other.times), pole.root - other.root);
      }
    }
    const auto above = static_cast<std::size_t>(zeros.size());
    for (std::size_t i = 0; i < std::max(above, below.size()); ++i) {
      if (i < above) {
        multiply(series, pole.root - zeros(static_cast<Index>(i)));
      }
      if (i < below.size()) {
        divide(series, below[i]);
      }
    }
    PartialFraction fraction{pole.root, VectorXcd(pole.times)};
    for (int k = 0; k < pole.times; ++k) {
      fraction.residues(k) = series[static_cast<std::size_t>(pole.times - 1 - k)];
    }
    if (pole.root.imag() == 0.0) {
      fraction.residues.imag().setZero();
    }
    fractions.push_back(std::move(fraction));
  }
  std::sort(
      fractions.begin(), fractions.end(), [](const PartialFraction& a, const PartialFraction& b) {
        const Complex p = a.pole;
        const Complex q = b.pole;
        return p.real() != q.real()                       ? p.real() > q.real()
               : std::abs(p.imag()) != std::abs(q.imag()) ? std::abs(p.imag()) < std::abs(q.imag())
                                                          : p.imag() > q.imag();
      });
  return fractions;
}

/// The quotient of two polynomials, in 31 digits.
VectorXd quotient_of(const VectorXd& num, const VectorXd& den) {
  if (num.size() < den.size() || (num.size() == 1 && num(0) == 0.0)) {
    return VectorXd(0);
  }
  detail::Polynomial rest = detail::polynomial(num);
  const detail::Polynomial d = detail::polynomial(den);
  const Index more = num.size() - den.size();
  VectorXd q(more + 1);
  for (Index i = 0; i <= more; ++i) {
    const auto share = flyball::detail::solve(d.block(0, 0, 1, 1), rest.block(0, 0, 1, 1));
    q(i) = share ? share->rounded()(0, 0) : 0.0;
    if (share) {
      // (rest - q d s^k) without its leading coefficient.
      detail::Polynomial less = detail::times(d, *share);
      detail::Polynomial padded = detail::Polynomial::zero(rest.rows(), 1);
      padded.hi.topRows(less.rows()) = less.hi;
      padded.lo.topRows(less.rows()) = less.lo;
      rest = flyball::detail::sum(rest, -1.0, padded);
    }
    rest = rest.block(1, 0, rest.rows() - 1, 1);
  }
  return q;
}

Expected<PartialFractions> checked(PartialFractions found) {
  bool finite = found.polynomial.allFinite();
  for (const PartialFraction& fraction : found.fractions) {
    finite = finite && fraction.residues.allFinite();
  }
  if (!finite) {
    return refusal(ArgumentError::not_finite, in_partial_fractions, "a residue")
        .got("beyond the largest double")
        .hint("measure time in a unit in which the poles are near one");
  }
  return found;
}

}  // namespace

Complex PartialFractions::at(Complex s) const {
  Complex sum = detail::value(polynomial, s);
  for (const PartialFraction& fraction : fractions) {
    Complex power = 1.0;
    for (const Complex& residue : fraction.residues) {
      power /= s - fraction.pole;
      sum += residue * power;
    }
  }
  return sum;
}

Expected<PartialFractions> partial_fractions(const VectorXd& num, const VectorXd& den) {
  for (const auto& [p, name] :
       {std::pair<const VectorXd&, const char*>{num, "num"}, {den, "den"}}) {
    if (p.size() == 0) {
      return refusal(ArgumentError::empty, in_partial_fractions, name)
          .got("empty")
          .expected("coefficients in descending powers");
    }
    FLYBALL_CHECK(check_finite(MatrixXd(p), in_partial_fractions, name));
  }
  const VectorXd n = without_leading_zeros(num);
  const VectorXd d = without_leading_zeros(den);
  if (d(0) == 0.0) {
    return refusal(TransferError::zero_denominator, in_partial_fractions, "den").got("zero");
  }
  const auto zeros = detail::roots(detail::polynomial(n));
  const auto poles = detail::roots(detail::polynomial(d));
  if (!zeros || !poles) {
    return refusal(SystemError::no_convergence, in_partial_fractions, zeros ? "a pole" : "a zero")
        .got("not found: the iteration for the eigenvalues of the companion matrix did not end");
  }
  PartialFractions found{quotient_of(n, d), {}};
  if (n(0) != 0.0) {
    found.fractions = fractions_of(*zeros, gathered(*poles, d), n(0) / d(0));
  }
  return checked(std::move(found));
}

Expected<PartialFractions> partial_fractions(const ZeroPoleGain& transfer) {
  PartialFractions found;
  const std::vector<Repeated> poles = equal_ones(transfer.poles());
  if (transfer.is_zero()) {
    return found;
  }
  if (transfer.zeros().size() >= transfer.poles().size()) {
    const auto num = expanded(equal_ones(transfer.zeros())).first.real().eval();
    const auto den = expanded(poles).first.real().eval();
    found.polynomial = transfer.gain() * quotient_of(num, den);
  }
  found.fractions = fractions_of(transfer.zeros(), poles, transfer.gain());
  return checked(std::move(found));
}

}  // namespace flyball::classical
