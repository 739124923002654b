#pragma once

#include <complex>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// The discrete Fourier transform of one length, planned once and used often:
///
///   forward  X_k = Σ x_j e^(-2πi jk/n),   inverse  x_j = 1/n Σ X_k e^(2πi jk/n).
///
/// Any n: factors 2, 3, 4, 5 and other primes up to 31 by a self-sorting mixed radix transform; a
/// length with a larger prime as a convolution (Bluestein). O(n log n) for all of them. The error
/// is a few ε √log n of the norm: twiddle factors are rounded correctly.
///
/// Transforming does not allocate; a plan has working memory of its own, so each thread needs one.
/// Source: Temperton, J. Computational Physics 52 (1983) (mixed radix); Bluestein, IEEE Trans.
/// Audio Electroacoustics 18 (1970).
class Fft {
 public:
  /// @param length  n, from 1 to 2²⁸. @errors ArgumentError::out_of_range.
  /// Cost: O(n) sines; allocates.
  [[nodiscard]] static Expected<Fft> create(Eigen::Index length);

  /// @param in, out  n numbers each, the same or apart.
  void forward(const std::complex<double>* in, std::complex<double>* out) noexcept;
  void inverse(const std::complex<double>* in, std::complex<double>* out) noexcept;

  [[nodiscard]] Eigen::Index length() const noexcept { return length_; }

 private:
  using Complex = std::complex<double>;
  struct Stage {
    int radix;
    Eigen::Index twiddle;  ///< Where its factors begin.
    Eigen::Index roots;    ///< The same of a generic radix's roots of unity.
  };
  Fft() = default;
  void transform(Complex* data) noexcept;
  void convolve(Complex* data) noexcept;

  Eigen::Index length_ = 0;
  Eigen::Index size_ = 0;  ///< Of the mixed radix transform: n, or that of the convolution.
  std::vector<Stage> stages_;
  std::vector<Complex> twiddles_;
  std::vector<Complex> roots_;  ///< Of generic radices, one after the other.
  std::vector<Complex> work_;
  std::vector<Complex> chirp_;   ///< e^(-πi j²/n), where the length is Bluestein's.
  std::vector<Complex> filter_;  ///< The transform of its conjugate, over size_.
  std::vector<Complex> padded_;
};

/// The transform of real numbers: n real, n/2 + 1 complex ones (rounded down), half the work for
/// even n.
class RealFft {
 public:
  /// @param length  n, from 1 to 2²⁸. @errors ArgumentError::out_of_range.
  [[nodiscard]] static Expected<RealFft> create(Eigen::Index length);

  /// @param in  n. @param out  ⌊n/2⌋ + 1.
  void forward(const double* in, std::complex<double>* out) noexcept;
  /// @param in  ⌊n/2⌋ + 1; the imaginary parts of those that a real signal has none of are left
  /// out. @param out  n.
  void inverse(const std::complex<double>* in, double* out) noexcept;

  [[nodiscard]] Eigen::Index length() const noexcept { return length_; }
  [[nodiscard]] Eigen::Index bins() const noexcept { return length_ / 2 + 1; }

 private:
  explicit RealFft(Fft fft) : fft_(std::move(fft)) {}

  Fft fft_;
  Eigen::Index length_ = 0;
  std::vector<std::complex<double>> factors_;  ///< e^(-2πi k/n).
  std::vector<std::complex<double>> work_;
};

/// One transform. @param x  n x 1, not empty. @errors ArgumentError::empty.
[[nodiscard]] Expected<Eigen::VectorXcd> fft(const Eigen::VectorXcd& x);
[[nodiscard]] Expected<Eigen::VectorXcd> inverse_fft(const Eigen::VectorXcd& X);
/// Of a real signal, up to half of the sample rate. @return  ⌊n/2⌋ + 1.
[[nodiscard]] Expected<Eigen::VectorXcd> real_fft(const Eigen::VectorXd& x);
/// @param length  n, of the signal. @errors ArgumentError::wrong_shape for another number of bins.
[[nodiscard]] Expected<Eigen::VectorXd> inverse_real_fft(const Eigen::VectorXcd& X,
                                                         Eigen::Index length);

}  // namespace flyball
