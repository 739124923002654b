#pragma once

#include <vector>

#include "classical/polynomial.hpp"

/// Quotients of polynomials whose factors stay as they were written.
namespace flyball::classical::detail {

/// A polynomial that is not a constant, and how often it stands there.
struct RatioFactor {
  Polynomial p;
  Eigen::Index times = 1;
};
using RatioFactors = std::vector<RatioFactor>;

[[nodiscard]] Polynomial constant(double value);
[[nodiscard]] bool is_zero(const Polynomial& p);

[[nodiscard]] Eigen::Index degree(const RatioFactors& factors);
/// Puts a factor to the others.
void multiply(RatioFactors& factors, const Polynomial& p, Eigen::Index times);
/// What two have in common.
[[nodiscard]] RatioFactors common(const RatioFactors& a, const RatioFactors& b);
[[nodiscard]] RatioFactors without(RatioFactors factors, const RatioFactors& less);
[[nodiscard]] RatioFactors together(RatioFactors factors, const RatioFactors& more);
/// p times all of them.
[[nodiscard]] Polynomial expanded(const RatioFactors& factors, Polynomial p);

/// gain Π num / Π den e^{-delay s}, factored as it was written; it may be improper.
struct Quotient {
  Polynomial gain = constant(1.0);  ///< A number.
  RatioFactors num{};
  RatioFactors den{};
  double delay = 0.0;

  [[nodiscard]] bool is_zero() const { return detail::is_zero(gain); }
  [[nodiscard]] bool is_constant() const { return num.empty() && den.empty() && delay == 0.0; }
  [[nodiscard]] double value() const { return gain.rounded()(0, 0); }
};

[[nodiscard]] Quotient number(double value);
/// The quotient of a polynomial; nothing but a gain if it is of degree 0.
[[nodiscard]] Quotient of_polynomial(const Polynomial& p);
[[nodiscard]] Quotient product(const Quotient& a, const Quotient& b);
/// a + sign·b, which have one delay, over the least common denominator of the factors.
[[nodiscard]] Quotient sum(const Quotient& a, double sign, const Quotient& b);
/// z/z is one: its pole is no dynamics of the plant, but of how it is written.
void clear_shifts(Quotient& q, char variable);

}  // namespace flyball::classical::detail
