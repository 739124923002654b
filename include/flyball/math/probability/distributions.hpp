#pragma once

/// The distributions that intervals and tests are made of.
namespace flyball {

/// exp(-(x - mean)²/2σ²)/(√2π σ), in 1/(unit of x), and its logarithm, which does not underflow.
/// @param sigma  Standard deviation, positive; NaN otherwise. Source: book, section 9.3.16.
///@{
[[nodiscard]] double normal_pdf(double x, double mean = 0.0, double sigma = 1.0) noexcept;
[[nodiscard]] double normal_log_pdf(double x, double mean = 0.0, double sigma = 1.0) noexcept;
///@}
/// P(X ≤ x) of a standard normal X.
[[nodiscard]] double normal_cdf(double x) noexcept;
/// The x with P(X ≤ x) = p; ∓infinity at 0 and 1, NaN outside.
[[nodiscard]] double normal_quantile(double p) noexcept;

/// P(a, x) = ∫₀ˣ e⁻ᵗ tᵃ⁻¹ dt / Γ(a), and Q = 1 - P without cancellation.
/// @param a  Positive. @param x  Not negative. NaN outside.
/// Source: Abramowitz, Stegun, "Handbook of Mathematical Functions", 6.5.29 and 6.5.31.
///@{
[[nodiscard]] double lower_gamma_ratio(double a, double x) noexcept;
[[nodiscard]] double upper_gamma_ratio(double a, double x) noexcept;
///@}

/// I_x(a, b) = ∫₀ˣ tᵃ⁻¹(1 - t)ᵇ⁻¹ dt / B(a, b).
/// @param a, b  Positive. @param x  In [0, 1]. NaN outside.
/// Source: Abramowitz, Stegun, 26.5.8.
[[nodiscard]] double beta_ratio(double a, double b, double x) noexcept;

/// P(X > x) of a χ² variable. @param freedom  Degrees of freedom, positive.
[[nodiscard]] double chi_squared_tail(double x, double freedom) noexcept;
/// The x with P(X ≤ x) = p of a χ² variable: the gate that a squared Mahalanobis distance in as
/// many dimensions as `freedom` stays below with the probability p. 0 and infinity at 0 and 1, NaN
/// outside.
[[nodiscard]] double chi_squared_quantile(double p, double freedom) noexcept;
/// P(F > f) of Fisher's ratio. @param numerator, denominator  Degrees of freedom, positive.
[[nodiscard]] double f_tail(double f, double numerator, double denominator) noexcept;
/// P(T ≤ t) of Student's T. @param freedom  Degrees of freedom, positive; infinity: normal.
[[nodiscard]] double student_cdf(double t, double freedom) noexcept;
/// The t with P(T ≤ t) = p; ∓infinity at 0 and 1, NaN outside.
[[nodiscard]] double student_quantile(double p, double freedom) noexcept;

}  // namespace flyball
