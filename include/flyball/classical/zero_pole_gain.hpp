#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>

namespace flyball::classical {

/// G(s) = e^{-delay s} k Π(s - zᵢ)/Π(s - pⱼ), or the same in z with a period, its roots kept: no
/// product of factors is formed, so that none of them loses digits to the others.
class ZeroPoleGain {
 public:
  /// More zeros than poles are allowed: 1/G is one, too.
  /// @param zeros, poles  In pairs of conjugates, to 1e-12 of their size. @param gain  k. @param
  /// period  Of a discrete one. @param delay  s, whole periods of a discrete one.
  /// @errors ArgumentError::not_finite, malformed (a root without its conjugate), not_positive (the
  /// period), out_of_range (the delay).
  [[nodiscard]] static Expected<ZeroPoleGain> create(const Eigen::VectorXcd& zeros,
                                                     const Eigen::VectorXcd& poles, double gain,
                                                     std::optional<Time> period = std::nullopt,
                                                     Time delay = Time(0.0));
  /// By the roots of its polynomials, in 31 digits. @errors SystemError::no_convergence.
  [[nodiscard]] static Expected<ZeroPoleGain> create(const TransferFunction& transfer);

  [[nodiscard]] const Eigen::VectorXcd& zeros() const { return zeros_; }
  [[nodiscard]] const Eigen::VectorXcd& poles() const { return poles_; }
  [[nodiscard]] double gain() const { return gain_; }
  [[nodiscard]] const std::optional<Time>& period() const { return period_; }
  /// s
  [[nodiscard]] double delay() const { return delay_; }
  [[nodiscard]] bool is_zero() const { return gain_ == 0.0; }
  [[nodiscard]] bool is_proper() const { return is_zero() || zeros_.size() <= poles_.size(); }
  /// Every pole left of the imaginary axis, or within the unit circle; false if it is improper.
  [[nodiscard]] bool is_stable() const;
  /// No zero right of the imaginary axis, or outside of the unit circle.
  [[nodiscard]] bool is_minimum_phase() const;

  /// G(0), or G(1); ±∞ with a pole there that no zero cancels. By its factors.
  [[nodiscard]] double dc_gain() const;
  /// G at a point. @errors TransferError::at_a_pole; ArgumentError::not_finite.
  [[nodiscard]] Expected<std::complex<double>> at(std::complex<double> s) const;
  /// G(jω), or G(e^{jωT}), to some roundings of each factor. @param frequency  rad/s
  [[nodiscard]] std::complex<double> response(double frequency) const;

  /// Coefficients from the roots, rounded once. @errors TransferError::improper;
  /// ArgumentError::not_finite where one is beyond the largest double.
  [[nodiscard]] Expected<TransferFunction> to_transfer_function() const;
  /// Sections of first and second order in series, without the delay, in balanced units: no
  /// coefficient is formed. Of a discrete one x_{k+1} in place of x'.
  /// @errors TransferError::improper.
  [[nodiscard]] Expected<ContinuousSystem<>> to_state_space() const;

 private:
  ZeroPoleGain(Eigen::VectorXcd zeros, Eigen::VectorXcd poles, double gain,
               std::optional<Time> period, double delay)
      : zeros_(std::move(zeros)),
        poles_(std::move(poles)),
        gain_(gain),
        period_(period),
        delay_(delay) {}

  Eigen::VectorXcd zeros_;
  Eigen::VectorXcd poles_;
  double gain_ = 0.0;
  std::optional<Time> period_;
  double delay_ = 0.0;
};

/// G₁G₂, nothing cancelled, all roots as they are. @errors TransferError::period_mismatch;
/// ArgumentError::not_finite (the gain).
[[nodiscard]] Expected<ZeroPoleGain> product(const ZeroPoleGain& first, const ZeroPoleGain& second);
/// G₁/G₂. @errors As `product`; TransferError::zero_denominator; ArgumentError::out_of_range where
/// the second has the longer delay.
[[nodiscard]] Expected<ZeroPoleGain> quotient(const ZeroPoleGain& first,
                                              const ZeroPoleGain& second);
/// G₁/(1 ± G₁G₂): its zeros are those of G₁ and the poles of G₂ as they are.
/// @errors As `product`, improper, algebraic_loop; delay_in_loop (see `DelaySystem`).
[[nodiscard]] Expected<ZeroPoleGain> feedback(const ZeroPoleGain& forward, const ZeroPoleGain& back,
                                              bool negative = true);

/// A zero and a pole that were taken for one.
struct Cancellation {
  std::complex<double> zero;
  std::complex<double> pole;
  double distance = 0.0;  ///< |z - p|, relative to the larger of both.
  /// The pole grows: it stays in the plant, unseen, and anything excites it.
  bool unstable = false;
  /// The zero is nonminimum phase: a pole that was put there to cancel it grows unseen.
  bool nonminimum_phase = false;
};

/// What is left, and what was cancelled.
struct Cancelled {
  ZeroPoleGain transfer;
  std::vector<Cancellation> cancelled{};  ///< By distance; of a conjugate pair both.
  bool hides_instability = false;         ///< One of them is unstable or nonminimum phase.
};

/// Without the pairs of zero and pole that are nearer than the tolerance, nearest first, conjugates
/// together. Zeros and poles at the same place stay as long as nobody asks.
/// @param tolerance  Of |z - p|/max(|z|, |p|), from 0 (what is equal) to below 1.
/// @errors ArgumentError::out_of_range. Cost: O(n³). Source: book, section E.2.2.
[[nodiscard]] Expected<Cancelled> without_cancellations(const ZeroPoleGain& transfer,
                                                        double tolerance = 1e-8);

}  // namespace flyball::classical
