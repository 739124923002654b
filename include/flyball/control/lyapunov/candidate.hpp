#pragma once

#include <limits>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/derivatives/differentiation.hpp>

namespace flyball {

/// What a sample of states says of a Lyapunov candidate.
struct CandidateCheck {
  double at_equilibrium = 0.0;  ///< V(x*), which should be zero.
  /// Least (V(x) - V(x*))/|x - x*|², and where: V is no candidate unless it is positive.
  double least_growth = std::numeric_limits<double>::infinity();
  Eigen::VectorXd lowest{};
  /// Largest V̇(x)/|x - x*|², and where: V does not prove stability unless it is at most zero,
  /// asymptotic stability unless it is negative.
  double largest_rate = -std::numeric_limits<double>::infinity();
  Eigen::VectorXd fastest{};
  int positive = 0;  ///< Samples with V > V(x*).
  int falling = 0;   ///< Samples with V̇ < 0.
  int samples = 0;

  /// Whether no sample speaks against it. That is no proof; one that does is.
  [[nodiscard]] bool holds() const noexcept { return positive == samples && falling == samples; }
};

/// Looks for states that speak against V(x) as a Lyapunov function of dx/dt = f(x): V(x) > V(x*)
/// and V̇ = ∂V/∂x f(x) < 0 for all x ≠ x*, the gradient exact by dual numbers.
///
/// @param V  A number over a generic scalar. @param f  n x 1. @param equilibrium  x*, n x 1, fixed
/// or dynamic. @param half  n x 1, > 0: x is drawn from x* ± half, a half of the samples nearer by
/// powers of two. @param samples  How many. @param seed  Of the draw.
/// @errors ArgumentError::wrong_shape, not_finite, not_positive for the box; not_finite for V or f
/// at
///         a sample, with the state as evidence.
/// Cost: as many calls of V with n derivatives, and of f. Source: book, section 8.3.
template <class Candidate, class F, class Derived>
[[nodiscard]] Expected<CandidateCheck> check_candidate(
    const Candidate& V, const F& f, const Eigen::MatrixBase<Derived>& equilibrium,
    const Eigen::Vector<double, Derived::RowsAtCompileTime>& half, int samples = 10'000,
    unsigned long long seed = 1) {
  using State = Eigen::Vector<double, Derived::RowsAtCompileTime>;
  constexpr std::string_view where = "check_candidate";
  const State centre = equilibrium;
  Checks checks(where);
  checks.finite(centre, "equilibrium")
      .shape(half, centre.size(), 1, "half", "states x 1")
      .finite(half, "half")
      .within(samples, 1.0, 1e9, "samples");
  for (Eigen::Index i = 0; i < half.size(); ++i) {
    checks.positive(half(i), "half");
  }
  if (!checks) {
    return tl::unexpected(checks.error());
  }
  CandidateCheck result;
  result.at_equilibrium = V(centre);
  result.samples = samples;
  Random random(seed);
  constexpr int octaves = 20;
  for (int k = 0; k < samples; ++k) {
    const double scale = k % 2 == 0 ? 1.0 : std::ldexp(1.0, -(k / 2 % octaves));
    State x = centre;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x(i) += scale * random.uniform(-half(i), half(i));
    }
    const double square = (x - centre).squaredNorm();
    const double value = V(x) - result.at_equilibrium;
    const double rate = gradient(V, x).dot(State(f(x)));
    if (!std::isfinite(value) || !std::isfinite(rate)) {
      return tl::unexpected(Error(ArgumentError::not_finite)
                                .in(std::string(where))
                                .about("V, or its rate,")
                                .got("not finite")
                                .with("x", std::vector<double>(x.begin(), x.end())));
    }
    result.positive += value > 0.0 ? 1 : 0;
    result.falling += rate < 0.0 ? 1 : 0;
    if (square > 0.0 && value / square < result.least_growth) {
      result.least_growth = value / square;
      result.lowest = x;
    }
    if (square > 0.0 && rate / square > result.largest_rate) {
      result.largest_rate = rate / square;
      result.fastest = x;
    }
  }
  return result;
}

}  // namespace flyball
