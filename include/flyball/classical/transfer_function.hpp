#pragma once

#include <complex>
#include <optional>

#include <flyball/systems/system.hpp>

/// Transfer functions of one input and one output (Appendix A, section E.2).
namespace flyball::classical {

/// What has no transfer function, or no answer.
enum class TransferError {
  zero_denominator,  ///< There is no transfer function: the denominator is zero.
  improper,          ///< The numerator's degree is above the denominator's.
  period_mismatch,   ///< Two of different sample periods, or one of each kind.
  algebraic_loop,    ///< 1 ± G₁G₂ is zero at infinity: no output satisfies the loop, or every one.
  at_a_pole,         ///< It was asked for at a pole.
  delay_in_loop,     ///< A loop with a delay in it is no rational function.
};
[[nodiscard]] ErrorInfo error_info(TransferError code);

/// G(s) = e^{-delay s} num(s)/den(s), or with a period G(z) = z^{-delay/T} num(z)/den(z).
/// Coefficients are real, in descending powers; neither begins with a zero, and the denominator is
/// not zero. The zero function has the numerator [0].
class TransferFunction {
 public:
  /// @param num, den  Descending powers; zeros in front are left out. @param period  Of a discrete
  /// one, z's. @param delay  s, dead time, exact; of a discrete one whole periods.
  /// @errors ArgumentError::empty, not_finite, out_of_range (a negative delay, one that is not
  ///         whole periods), not_positive (the period); TransferError::zero_denominator, improper.
  [[nodiscard]] static Expected<TransferFunction> create(const Eigen::VectorXd& num,
                                                         const Eigen::VectorXd& den,
                                                         std::optional<Time> period = std::nullopt,
                                                         Time delay = Time(0.0));

  /// From zeros, poles and gain, k Π(s - zᵢ)/Π(s - pⱼ), which are kept as they are: `zeros` and
  /// `poles` answer them. @param zeros, poles  In pairs of conjugates.
  /// @errors As `create`, and ArgumentError::malformed for one without its conjugate.
  [[nodiscard]] static Expected<TransferFunction> from_zeros(
      const Eigen::VectorXcd& zeros, const Eigen::VectorXcd& poles, double gain,
      std::optional<Time> period = std::nullopt, Time delay = Time(0.0));

  /// The same, whose roots are known better than the coefficients tell: those of its factors.
  /// @param zeros, poles  As many as the degrees, else they are not taken.
  [[nodiscard]] TransferFunction with_roots(const Eigen::VectorXcd& zeros,
                                            const Eigen::VectorXcd& poles) const;
  /// The same times a gain and behind further dead time, of the same roots.
  /// @errors ArgumentError::not_finite, out_of_range (a negative delay, one of no whole periods).
  [[nodiscard]] Expected<TransferFunction> scaled(double gain, Time further = Time(0.0)) const;

  [[nodiscard]] const Eigen::VectorXd& num() const { return num_; }
  [[nodiscard]] const Eigen::VectorXd& den() const { return den_; }
  [[nodiscard]] const std::optional<Time>& period() const { return period_; }
  /// s
  [[nodiscard]] double delay() const { return delay_; }
  [[nodiscard]] bool is_zero() const { return num_.size() == 1 && num_(0) == 0.0; }
  /// The degree of the denominator: how many poles there are.
  [[nodiscard]] Eigen::Index order() const { return den_.size() - 1; }
  /// Degree of the denominator less the numerator's.
  [[nodiscard]] Eigen::Index relative_degree() const { return den_.size() - num_.size(); }

  /// Those that it was made of, or of the coefficients in 31 digits, so that what is lost is what
  /// those do not tell. Those of a discrete one are without the poles at z = 0 of its delay.
  /// @errors SystemError::no_convergence.
  [[nodiscard]] Expected<Eigen::VectorXcd> zeros() const;
  [[nodiscard]] Expected<Eigen::VectorXcd> poles() const;
  /// Whether they are those that it was made of.
  [[nodiscard]] bool knows_roots() const { return poles_.has_value(); }
  /// Every pole left of the imaginary axis, or within the unit circle. @errors As `poles`.
  [[nodiscard]] Expected<bool> is_stable() const;

  /// G(0), or G(1) of a discrete one; ±∞ with a pole there that no zero cancels.
  [[nodiscard]] double dc_gain() const;
  /// G at a point of the plane. @errors TransferError::at_a_pole; ArgumentError::not_finite.
  [[nodiscard]] Expected<std::complex<double>> at(std::complex<double> s) const;
  /// G(jω), or G(e^{jωT}). Not finite at a pole on the axis. @param frequency  rad/s
  [[nodiscard]] std::complex<double> response(double frequency) const;

  /// Controllable canonical form in balanced units, without the delay.
  [[nodiscard]] ContinuousSystem<> to_state_space() const;

 private:
  TransferFunction(Eigen::VectorXd num, Eigen::VectorXd den, std::optional<Time> period,
                   double delay)
      : num_(std::move(num)), den_(std::move(den)), period_(period), delay_(delay) {}

  Eigen::VectorXd num_;
  Eigen::VectorXd den_;
  std::optional<Time> period_;
  double delay_ = 0.0;
  /// Where they are known.
  std::optional<Eigen::VectorXcd> zeros_{};
  std::optional<Eigen::VectorXcd> poles_{};
};

/// G₂G₁, nothing cancelled; roots that both know stay. @errors TransferError::period_mismatch.
/// Source: book, section A.1.
[[nodiscard]] Expected<TransferFunction> series(const TransferFunction& first,
                                                const TransferFunction& second);
/// G₁ + G₂. @errors As `series`, delay_in_loop for two of different delay. Source: section A.2.
[[nodiscard]] Expected<TransferFunction> parallel(const TransferFunction& first,
                                                  const TransferFunction& second);
/// G₁/(1 ± G₁G₂), + for negative feedback. @errors As `series`, algebraic_loop; delay_in_loop where
/// a delay is in the loop (`margins` and `response` know those). Source: sections A.3, A.4.
[[nodiscard]] Expected<TransferFunction> feedback(const TransferFunction& forward,
                                                  const TransferFunction& back,
                                                  bool negative = true);
/// G/(1 ± G).
[[nodiscard]] Expected<TransferFunction> unity_feedback(const TransferFunction& forward,
                                                        bool negative = true);

/// The diagonal Padé approximation of e^{-delay s}, in which powers up to 2n of s agree.
/// @param order  n, 0 to 20. @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<TransferFunction> pade(Time delay, int order);

}  // namespace flyball::classical
