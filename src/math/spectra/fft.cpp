#include <flyball/math/spectra/fft.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/try.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

constexpr Index largest_length = Index{1} << 28;

/// Without the standard's care for infinities, which costs a branch a product.
inline Complex times(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
inline Complex times_minus_i(Complex a) {
  return {a.imag(), -a.real()};
}

/// e^(-2πi k/n), the angle reduced to an eighth of a turn so that sine and cosine are exact where
/// they are simple and rounded once elsewhere.
Complex root_of_unity(Index k, Index n) {
  k %= n;
  // k/n of a turn as octant/8 + rest/(8n).
  const Index eighths = 8 * k;
  const Index octant = eighths / n;
  const Index rest = eighths % n;
  const bool odd = octant % 2 != 0;
  const double part = static_cast<double>(odd ? n - rest : rest) / static_cast<double>(n);
  const double angle = part * (std::numbers::pi / 4.0);
  double c = std::cos(angle);
  double s = std::sin(angle);
  if (odd) {
    std::swap(c, s);
  }
  switch (octant / 2) {
    case 0:
      return {c, -s};
    case 1:
      return {-s, -c};
    case 2:
      return {-c, s};
    default:
      return {s, c};
  }
}

std::vector<int> factors_of(Index n) {
  std::vector<int> factors;
  for (const int radix : {4, 2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31}) {
    while (n % radix == 0) {
      factors.push_back(radix);
      n /= radix;
    }
  }
  return n == 1 ? factors : std::vector<int>{};
}

/// One butterfly a place: in[k * step], times its twiddle, to out[k * stride].
struct Radix2 {
  static void apply(const Complex* x, Index m, Complex* y, Index s, const Complex* w) {
    const Complex a = x[0];
    const Complex b = x[m];
    y[0] = a + b;
    y[s] = times(a - b, w[0]);
  }
};
struct Radix3 {
  static void apply(const Complex* x, Index m, Complex* y, Index s, const Complex* w) {
    constexpr double sine = 0.86602540378443864676;
    const Complex a = x[0];
    const Complex b = x[m] + x[2 * m];
    const Complex c = sine * times_minus_i(x[m] - x[2 * m]);
    const Complex d = a - 0.5 * b;
    y[0] = a + b;
    y[s] = times(d + c, w[0]);
    y[2 * s] = times(d - c, w[1]);
  }
};
struct Radix4 {
  static void apply(const Complex* x, Index m, Complex* y, Index s, const Complex* w) {
    const Complex a = x[0] + x[2 * m];
    const Complex b = x[0] - x[2 * m];
    const Complex c = x[m] + x[3 * m];
    const Complex d = times_minus_i(x[m] - x[3 * m]);
    y[0] = a + c;
    y[s] = times(b + d, w[0]);
    y[2 * s] = times(a - c, w[1]);
    y[3 * s] = times(b - d, w[2]);
  }
};
struct Radix5 {
  static void apply(const Complex* x, Index m, Complex* y, Index s, const Complex* w) {
    constexpr double c1 = 0.30901699437494742410;
    constexpr double c2 = -0.80901699437494742410;
    constexpr double s1 = 0.95105651629515357212;
    constexpr double s2 = 0.58778525229247312917;
    const Complex a = x[0];
    const Complex p1 = x[m] + x[4 * m];
    const Complex m1 = times_minus_i(x[m] - x[4 * m]);
    const Complex p2 = x[2 * m] + x[3 * m];
    const Complex m2 = times_minus_i(x[2 * m] - x[3 * m]);
    const Complex e1 = a + c1 * p1 + c2 * p2;
    const Complex e2 = a + c2 * p1 + c1 * p2;
    const Complex o1 = s1 * m1 + s2 * m2;
    const Complex o2 = s2 * m1 - s1 * m2;
    y[0] = a + p1 + p2;
    y[s] = times(e1 + o1, w[0]);
    y[2 * s] = times(e2 + o2, w[1]);
    y[3 * s] = times(e2 - o2, w[2]);
    y[4 * s] = times(e1 - o1, w[3]);
  }
};

/// A pass over all places: n = radix m numbers in each of s interleaved transforms.
template <class Radix, int radix>
void pass(const Complex* x, Complex* y, Index m, Index s, const Complex* w) {
  for (Index p = 0; p < m; ++p) {
    const Complex* from = x + s * p;
    Complex* to = y + s * radix * p;
    for (Index q = 0; q < s; ++q) {
      Radix::apply(from + q, s * m, to + q, s, w);
    }
    w += radix - 1;
  }
}

void generic_pass(int radix, const Complex* roots, const Complex* x, Complex* y, Index m, Index s,
                  const Complex* w) {
  for (Index p = 0; p < m; ++p) {
    for (Index q = 0; q < s; ++q) {
      const Complex* from = x + s * p + q;
      Complex* to = y + s * radix * p + q;
      for (int k = 0; k < radix; ++k) {
        Complex sum = from[0];
        for (int j = 1; j < radix; ++j) {
          sum += times(from[s * m * j], roots[(j * k) % radix]);
        }
        to[s * k] = k == 0 ? sum : times(sum, w[k - 1]);
      }
    }
    w += radix - 1;
  }
}

Expected<void> check_length(Index length, std::string_view where) {
  if (length < 1 || length > largest_length) {
    return refusal(ArgumentError::out_of_range, where, "the length")
        .got(std::to_string(length))
        .expected("from 1 to 268435456");
  }
  return {};
}

}  // namespace

Expected<Fft> Fft::create(Index length) {
  FLYBALL_CHECK(check_length(length, "Fft"));
  Fft fft;
  fft.length_ = fft.size_ = length;
  std::vector<int> factors = factors_of(length);
  if (factors.empty() && length > 1) {
    fft.size_ = 1;
    while (fft.size_ < 2 * length - 1) {
      fft.size_ *= 2;
    }
    factors = factors_of(fft.size_);
  }
  Index n = fft.size_;
  for (const int radix : factors) {
    fft.stages_.push_back(
        {radix, static_cast<Index>(fft.twiddles_.size()), static_cast<Index>(fft.roots_.size())});
    for (int k = 0; radix > 5 && k < radix; ++k) {
      fft.roots_.push_back(root_of_unity(k, radix));
    }
    for (Index p = 0; p < n / radix; ++p) {
      for (int k = 1; k < radix; ++k) {
        fft.twiddles_.push_back(root_of_unity(p * k, n));
      }
    }
    n /= radix;
  }
  fft.work_.resize(static_cast<std::size_t>(fft.size_));
  if (fft.size_ != length) {
    const Index twice = 2 * length;
    fft.padded_.resize(static_cast<std::size_t>(fft.size_));
    fft.filter_.assign(static_cast<std::size_t>(fft.size_), Complex());
    Index square = 0;  // j² mod 2n.
    for (Index j = 0; j < length; ++j) {
      fft.chirp_.push_back(root_of_unity(square, twice));
      fft.filter_[static_cast<std::size_t>(j)] = std::conj(fft.chirp_.back());
      if (j > 0) {
        fft.filter_[static_cast<std::size_t>(fft.size_ - j)] = std::conj(fft.chirp_.back());
      }
      square = (square + 2 * j + 1) % twice;
    }
    fft.transform(fft.filter_.data());
    for (Complex& value : fft.filter_) {
      value /= static_cast<double>(fft.size_);
    }
  }
  return fft;
}

void Fft::transform(Complex* data) noexcept {
  Complex* x = data;
  Complex* y = work_.data();
  Index n = size_;
  Index s = 1;
  for (const Stage& stage : stages_) {
    const Index m = n / stage.radix;
    const Complex* w = twiddles_.data() + stage.twiddle;
    switch (stage.radix) {
      case 2:
        pass<Radix2, 2>(x, y, m, s, w);
        break;
      case 3:
        pass<Radix3, 3>(x, y, m, s, w);
        break;
      case 4:
        pass<Radix4, 4>(x, y, m, s, w);
        break;
      case 5:
        pass<Radix5, 5>(x, y, m, s, w);
        break;
      default:
        generic_pass(stage.radix, roots_.data() + stage.roots, x, y, m, s, w);
    }
    std::swap(x, y);
    n = m;
    s *= stage.radix;
  }
  if (x != data) {
    std::copy(x, x + size_, data);
  }
}

void Fft::convolve(Complex* data) noexcept {
  // jk = (j² + k² - (k - j)²)/2.
  const auto n = static_cast<std::size_t>(length_);
  for (std::size_t j = 0; j < n; ++j) {
    padded_[j] = times(data[j], chirp_[j]);
  }
  std::fill(padded_.begin() + length_, padded_.end(), Complex());
  transform(padded_.data());
  // The inverse of a transform is that of the conjugate, conjugated.
  for (std::size_t k = 0; k < padded_.size(); ++k) {
    padded_[k] = std::conj(times(padded_[k], filter_[k]));
  }
  transform(padded_.data());
  for (std::size_t j = 0; j < n; ++j) {
    data[j] = times(std::conj(padded_[j]), chirp_[j]);
  }
}

void Fft::forward(const Complex* in, Complex* out) noexcept {
  if (in != out) {
    std::copy(in, in + length_, out);
  }
  if (chirp_.empty()) {
    transform(out);
  } else {
    convolve(out);
  }
}

void Fft::inverse(const Complex* in, Complex* out) noexcept {
  std::transform(in, in + length_, out, [](Complex x) { return std::conj(x); });
  forward(out, out);
  const double scale = 1.0 / static_cast<double>(length_);
  std::transform(out, out + length_, out, [&](Complex x) { return scale * std::conj(x); });
}

Expected<RealFft> RealFft::create(Index length) {
  FLYBALL_CHECK(check_length(length, "RealFft"));
  const bool even = length % 2 == 0;
  FLYBALL_TRY(Fft fft, Fft::create(even ? length / 2 : length));
  RealFft real(std::move(fft));
  real.length_ = length;
  real.work_.resize(static_cast<std::size_t>(real.fft_.length()) + 1);
  for (Index k = 0; even && k <= length / 2; ++k) {
    real.factors_.push_back(root_of_unity(k, length));
  }
  return real;
}

void RealFft::forward(const double* in, Complex* out) noexcept {
  const Index half = length_ / 2;
  if (factors_.empty()) {
    std::copy(in, in + length_, work_.data());
    fft_.forward(work_.data(), work_.data());
    std::copy(work_.data(), work_.data() + half + 1, out);
    return;
  }
  // z_j = x_2j + i x_2j+1, so Z_k = E_k + i O_k, and X_k = E_k + e^(-2πi k/n) O_k.
  for (Index j = 0; j < half; ++j) {
    work_[static_cast<std::size_t>(j)] = {in[2 * j], in[2 * j + 1]};
  }
  fft_.forward(work_.data(), work_.data());
  work_[static_cast<std::size_t>(half)] = work_[0];
  for (Index k = 0; k <= half; ++k) {
    const Complex z = work_[static_cast<std::size_t>(k)];
    const Complex mirrored = std::conj(work_[static_cast<std::size_t>(half - k)]);
    const Complex even = 0.5 * (z + mirrored);
    const Complex odd = 0.5 * times_minus_i(z - mirrored);
    out[k] = even + times(factors_[static_cast<std::size_t>(k)], odd);
  }
}

void RealFft::inverse(const Complex* in, double* out) noexcept {
  const Index half = length_ / 2;
  if (factors_.empty()) {
    work_[0] = in[0].real();
    for (Index k = 1; k <= half; ++k) {
      work_[static_cast<std::size_t>(k)] = in[k];
      work_[static_cast<std::size_t>(length_ - k)] = std::conj(in[k]);
    }
    fft_.inverse(work_.data(), work_.data());
    for (Index j = 0; j < length_; ++j) {
      out[j] = work_[static_cast<std::size_t>(j)].real();
    }
    return;
  }
  const auto bin = [&](Index k) { return k == 0 || k == half ? Complex(in[k].real()) : in[k]; };
  for (Index k = 0; k < half; ++k) {
    const Complex X = bin(k);
    const Complex mirrored = std::conj(bin(half - k));
    const Complex even = 0.5 * (X + mirrored);
    const Complex odd = 0.5 * times(X - mirrored, std::conj(factors_[static_cast<std::size_t>(k)]));
    work_[static_cast<std::size_t>(k)] = {even.real() - odd.imag(), even.imag() + odd.real()};
  }
  fft_.inverse(work_.data(), work_.data());
  for (Index j = 0; j < half; ++j) {
    out[2 * j] = work_[static_cast<std::size_t>(j)].real();
    out[2 * j + 1] = work_[static_cast<std::size_t>(j)].imag();
  }
}

namespace {

template <class Vector>
Expected<void> check_some(const Vector& x, std::string_view where) {
  if (x.size() == 0) {
    return refusal(ArgumentError::empty, where, "x").expected("samples");
  }
  return check_length(x.size(), where);
}

}  // namespace

Expected<Eigen::VectorXcd> fft(const Eigen::VectorXcd& x) {
  FLYBALL_CHECK(check_some(x, "fft"));
  FLYBALL_TRY(Fft plan, Fft::create(x.size()));
  Eigen::VectorXcd X(x.size());
  plan.forward(x.data(), X.data());
  return X;
}

Expected<Eigen::VectorXcd> inverse_fft(const Eigen::VectorXcd& X) {
  FLYBALL_CHECK(check_some(X, "inverse_fft"));
  FLYBALL_TRY(Fft plan, Fft::create(X.size()));
  Eigen::VectorXcd x(X.size());
  plan.inverse(X.data(), x.data());
  return x;
}

Expected<Eigen::VectorXcd> real_fft(const Eigen::VectorXd& x) {
  FLYBALL_CHECK(check_some(x, "real_fft"));
  FLYBALL_TRY(RealFft plan, RealFft::create(x.size()));
  Eigen::VectorXcd X(plan.bins());
  plan.forward(x.data(), X.data());
  return X;
}

Expected<Eigen::VectorXd> inverse_real_fft(const Eigen::VectorXcd& X, Index length) {
  FLYBALL_TRY(RealFft plan, RealFft::create(length));
  if (X.size() != plan.bins()) {
    return refusal(ArgumentError::wrong_shape, "inverse_real_fft", "X")
        .got("of " + std::to_string(X.size()))
        .expected("of length/2 + 1: " + std::to_string(plan.bins()));
  }
  Eigen::VectorXd x(length);
  plan.inverse(X.data(), x.data());
  return x;
}

}  // namespace flyball
