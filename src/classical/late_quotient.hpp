#pragma once

#include <vector>

#include <flyball/classical/delay_system.hpp>

#include "classical/quotient.hpp"

/// Quotients in which parts of several dead times stand above and below.
namespace flyball::classical::detail {

/// p(s) e^{-delay s}
struct LateTerm {
  double delay = 0.0;  ///< s
  Polynomial p;
};
/// Their sum, by rising delay, each delay once, no polynomial zero.
using LateSum = std::vector<LateTerm>;

/// q Π above / Π below. Sums are of two terms at least, the first of no dead time: what one term
/// can say is said by q.
struct LateQuotient {
  Quotient q;
  std::vector<LateSum> above{};
  std::vector<LateSum> below{};

  [[nodiscard]] bool is_rational() const { return above.empty() && below.empty(); }
  [[nodiscard]] bool is_zero() const { return q.is_zero(); }
  [[nodiscard]] bool is_constant() const { return is_rational() && q.is_constant(); }
  [[nodiscard]] double value() const { return q.value(); }
};

/// The largest degree in s above or below, and the largest count of terms of one sum.
[[nodiscard]] Eigen::Index degree(const LateQuotient& value);
[[nodiscard]] std::size_t terms(const LateQuotient& value);

[[nodiscard]] LateQuotient product(const LateQuotient& a, const LateQuotient& b);
/// a + sign·b over the least common denominator of the factors and the sums.
[[nodiscard]] LateQuotient sum(const LateQuotient& a, double sign, const LateQuotient& b);
/// 1/b but for the constants: its gain is one, and its delay that of b with the other sign. Sums
/// and factors that stand above and below are taken off by `product`.
[[nodiscard]] LateQuotient turned_over(const LateQuotient& b);

/// One chain of states with the poles of the part below that has no dead time; what is delayed is a
/// signal of it each: no polynomial becomes a companion matrix, and no pole stands there twice.
/// @param value  A function of s. @param delay  s, further dead time.
/// @errors TransferError::improper for a derivative that is delayed above the highest one below, or
/// stands above; SystemError::no_convergence; those of `DelaySystem::create`.
[[nodiscard]] Expected<DelaySystem> realised(const LateQuotient& value, double gain, double delay);

}  // namespace flyball::classical::detail
