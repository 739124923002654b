#pragma once

// Eight floats, or one double, with what kernels of configuration spaces do to them. Part of
// space_kernel_baseline.cpp, _wide.cpp and _exact.cpp: compiled once for each instruction set, and
// once for doubles. The includer defines FLYBALL_VARIANT; FLYBALL_ONE_LANE means doubles.

#include "planning/configuration/space_program.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

#ifdef FLYBALL_ONE_LANE
using Number = double;
using Real = double;
using Mask = bool;
#else
using Number = float;
#if defined(FLYBALL_WIDE_LANES) || !defined(__SSE2__)
typedef float Real __attribute__((vector_size(32)));
typedef int Mask __attribute__((vector_size(32)));
#else
// Halves, since compilers take vectors that the processor does not have apart lane by lane.
typedef float Half __attribute__((vector_size(16)));
typedef int HalfMask __attribute__((vector_size(16)));
struct Mask {
  HalfMask a, b;
};
struct Real {
  Half a, b;
  float operator[](int i) const { return i < 4 ? a[i] : b[i - 4]; }
};
#define FLYBALL_HALVES(type, op)                                          \
  [[gnu::always_inline]] static inline type operator op(type x, type y) { \
    return {x.a op y.a, x.b op y.b};                                      \
  }
#define FLYBALL_COMPARE(op)                                               \
  [[gnu::always_inline]] static inline Mask operator op(Real x, Real y) { \
    return {x.a op y.a, x.b op y.b};                                      \
  }
FLYBALL_HALVES(Real, +)
FLYBALL_HALVES(Real, -)
FLYBALL_HALVES(Real, *)
FLYBALL_HALVES(Real, /)
FLYBALL_HALVES(Mask, ^)
FLYBALL_COMPARE(<)
FLYBALL_COMPARE(>)
FLYBALL_COMPARE(>=)
#undef FLYBALL_HALVES
#undef FLYBALL_COMPARE
[[gnu::always_inline]] static inline Real operator-(Real x) {
  return {-x.a, -x.b};
}
#define FLYBALL_HALF_LANES
#endif
#endif

#define FLYBALL_LANE [[gnu::always_inline]] static inline

#ifdef FLYBALL_ONE_LANE
FLYBALL_LANE Real splat(Number x) {
  return x;
}
FLYBALL_LANE Real choose(Mask mask, Real a, Real b) {
  return mask ? a : b;
}
FLYBALL_LANE Real root(Real x) {
  return __builtin_sqrt(x);
}
FLYBALL_LANE bool any_negative(Real) {
  return false;
}
FLYBALL_LANE Real round_off(Real x) {
  return __builtin_rint(x);
}
FLYBALL_LANE void sine_cosine(Real x, Real& s, Real& c) {
  s = __builtin_sin(x);
  c = __builtin_cos(x);
}
#else
#if defined(FLYBALL_HALF_LANES)
FLYBALL_LANE Real splat(Number x) {
  return {Half{x, x, x, x}, Half{x, x, x, x}};
}
FLYBALL_LANE Real choose(Mask mask, Real a, Real b) {
  return {mask.a ? a.a : b.a, mask.b ? a.b : b.b};
}
FLYBALL_LANE Mask choose(Mask mask, Mask a, Mask b) {
  return {mask.a ? a.a : b.a, mask.b ? a.b : b.b};
}
FLYBALL_LANE Real root(Real x) {
  return {reinterpret_cast<Half>(_mm_sqrt_ps(reinterpret_cast<__m128>(x.a))),
          reinterpret_cast<Half>(_mm_sqrt_ps(reinterpret_cast<__m128>(x.b)))};
}
FLYBALL_LANE bool any_negative(Real x) {
  return (_mm_movemask_ps(reinterpret_cast<__m128>(x.a)) |
          _mm_movemask_ps(reinterpret_cast<__m128>(x.b))) != 0;
}
FLYBALL_LANE Mask bits(Real x) {
  return {reinterpret_cast<HalfMask>(x.a), reinterpret_cast<HalfMask>(x.b)};
}
FLYBALL_LANE Real from_bits(Mask x) {
  return {reinterpret_cast<Half>(x.a), reinterpret_cast<Half>(x.b)};
}
FLYBALL_LANE Mask has_bit(Mask x, int bit) {
  return {(x.a & bit) != 0, (x.b & bit) != 0};
}
FLYBALL_LANE Mask bit_as_sign(Mask x, int add) {
  return {((x.a + add) & 2) << 30, ((x.b + add) & 2) << 30};
}
FLYBALL_LANE Mask count_from(int i) {
  return {HalfMask{i, i + 1, i + 2, i + 3}, HalfMask{i + 4, i + 5, i + 6, i + 7}};
}
FLYBALL_LANE int lane(Mask x, int i) {
  return i < 4 ? x.a[i] : x.b[i - 4];
}
#else
FLYBALL_LANE Real splat(Number x) {
  return Real{x, x, x, x, x, x, x, x};
}
FLYBALL_LANE Real choose(Mask mask, Real a, Real b) {
  return mask ? a : b;
}
FLYBALL_LANE Mask choose(Mask mask, Mask a, Mask b) {
  return mask ? a : b;
}
FLYBALL_LANE Mask bits(Real x) {
  return reinterpret_cast<Mask>(x);
}
FLYBALL_LANE Real from_bits(Mask x) {
  return reinterpret_cast<Real>(x);
}
FLYBALL_LANE Mask has_bit(Mask x, int bit) {
  return (x & bit) != 0;
}
FLYBALL_LANE Mask bit_as_sign(Mask x, int add) {
  return ((x + add) & 2) << 30;
}
FLYBALL_LANE Mask count_from(int i) {
  return Mask{i, i + 1, i + 2, i + 3, i + 4, i + 5, i + 6, i + 7};
}
FLYBALL_LANE int lane(Mask x, int i) {
  return x[i];
}
FLYBALL_LANE Real root(Real x) {
#if defined(FLYBALL_WIDE_LANES)
  return reinterpret_cast<Real>(_mm256_sqrt_ps(reinterpret_cast<__m256>(x)));
#else
  Real y = x;
  for (int i = 0; i < lanes; ++i) {
    y[i] = __builtin_sqrtf(x[i]);
  }
  return y;
#endif
}
FLYBALL_LANE bool any_negative(Real x) {
#if defined(FLYBALL_WIDE_LANES)
  return _mm256_movemask_ps(reinterpret_cast<__m256>(x)) != 0;
#else
  bool any = false;
  for (int i = 0; i < lanes; ++i) {
    any = any || x[i] < 0.0F;
  }
  return any;
#endif
}
#endif
/// To the nearest whole number, of numbers far below 2^22.
FLYBALL_LANE Real round_off(Real x) {
  const Real magic = splat(12582912.0F);
  return (x + magic) - magic;
}
/// Sine and cosine within 1e-7 of angles of some turns (Cody and Waite's reduction by π/2,
/// polynomials of degree 7 and 8).
FLYBALL_LANE void sine_cosine(Real x, Real& s, Real& c) {
  const Real magic = splat(12582912.0F);
  const Real biased = x * splat(0.636619772F) + magic;
  const Mask quadrant = bits(biased);
  const Real k = biased - magic;
  Real r = x - k * splat(1.5703125F);
  r = r - k * splat(4.83751296997e-4F);
  r = r - k * splat(7.5497899548918821e-8F);
  const Real r2 = r * r;
  const Real sine = r + r * r2 *
                            (splat(-1.6666654611e-1F) +
                             r2 * (splat(8.3321608736e-3F) + r2 * splat(-1.9515295891e-4F)));
  const Real cosine = splat(1.0F) - splat(0.5F) * r2 +
                      r2 * r2 *
                          (splat(4.166664568298827e-2F) + r2 * (splat(-1.388731625493765e-3F) +
                                                                r2 * splat(2.443315711809948e-5F)));
  const Mask odd = has_bit(quadrant, 1);
  const Real a = choose(odd, cosine, sine);
  const Real b = choose(odd, sine, cosine);
  s = from_bits(bits(a) ^ bit_as_sign(quadrant, 0));
  c = from_bits(bits(b) ^ bit_as_sign(quadrant, 1));
}
#endif

FLYBALL_LANE Real smaller(Real a, Real b) {
  return choose(a < b, a, b);
}
FLYBALL_LANE Real larger(Real a, Real b) {
  return choose(a > b, a, b);
}
FLYBALL_LANE Real size(Real a) {
  return larger(a, -a);
}

constexpr Number boundless = static_cast<Number>(1e30);

}  // namespace flyball::detail::FLYBALL_VARIANT
