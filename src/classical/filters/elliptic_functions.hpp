#pragma once

/// Jacobi's elliptic functions with both digits that a filter of any ripple needs: those of a
/// modulus and those of how far it is from one.
namespace flyball::classical::detail {

/// k and k' with k² + k'² = 1, each to full relative precision and above 1e-150.
struct Modulus {
  double k = 0.0;
  double complement = 1.0;

  [[nodiscard]] Modulus complementary() const { return {complement, k}; }
};

/// K(k) = ∫₀^{π/2} dφ/√(1 - k² sin²φ), by the arithmetic-geometric mean.
[[nodiscard]] double complete_integral(const Modulus& m);

/// ln q = -π K(k')/K(k).
[[nodiscard]] double log_nome(const Modulus& m);

/// The modulus of a nome, by theta functions of q or of the complementary nome, whichever is less.
/// @param log_nome  Negative.
[[nodiscard]] Modulus modulus_of(double log_nome);

/// F(φ, k) = ∫₀^φ dφ/√(1 - k² sin²φ) for φ in [0, π/2], by Carlson's R_F.
[[nodiscard]] double incomplete_integral(double sine, double cosine, const Modulus& m);

struct JacobiFunctions {
  double sn = 0.0;
  double cn = 1.0;
  double dn = 1.0;
};

/// sn, cn and dn of u = fraction K(k), by Landen's transformation; no digit is lost near 0 or K.
/// @param fraction  In [0, 1]. @param rest  1 - fraction, as exactly as it is known.
[[nodiscard]] JacobiFunctions jacobi(double fraction, double rest, const Modulus& m);

}  // namespace flyball::classical::detail
