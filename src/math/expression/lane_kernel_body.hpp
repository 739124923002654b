#pragma once

// The loop over the steps of a lane tape, in the namespace FLYBALL_VARIANT.

namespace flyball::expression::detail::FLYBALL_VARIANT {

namespace {

// 64 bytes: one register of 512 bits, or two or four of those that there are.
using Pack = double __attribute__((vector_size(64), aligned(8), may_alias));
using Bits = long long __attribute__((vector_size(64), aligned(8), may_alias));
constexpr std::size_t packs = LaneTape::lanes / 8;

inline Bits bits_of(const Pack& x) {
  Bits b;
  __builtin_memcpy(&b, &x, sizeof b);
  return b;
}
inline Pack pack_of(const Bits& x) {
  Pack p;
  __builtin_memcpy(&p, &x, sizeof p);
  return p;
}

/// sin x and cos x, by reduction to |r| ≤ π/4 and polynomials.
/// Source: Cody, Waite, "Software manual for the elementary functions" (1980); coefficients of the
/// Cephes library (Moshier).
inline void sine_cosine(const Pack& x, Pack& sine, Pack& cosine) {
  const Pack shift = Pack{} + 6755399441055744.0;  // 1.5 · 2⁵²: rounds to whole numbers
  const Pack shifted = x * 0.63661977236758134308 + shift;
  const Bits quadrant = bits_of(shifted);
  const Pack n = shifted - shift;
  Pack r = x - n * 1.57079632673412561417e+00;  // π/2 in three parts of 33 bits
  r = r - n * 6.07710050630396597660e-11;
  r = r - n * 2.02226624879595063154e-21;
  const Pack z = r * r;
  Pack s = z * 1.58962301576546568060e-10 + -2.50507477628578072866e-8;
  s = s * z + 2.75573136213857245213e-6;
  s = s * z + -1.98412698295895385996e-4;
  s = s * z + 8.33333333332211858878e-3;
  s = s * z + -1.66666666666666307295e-1;
  s = r + (r * z) * s;
  Pack c = z * -1.13585365213876817300e-11 + 2.08757008419747316778e-9;
  c = c * z + -2.75573141792967388112e-7;
  c = c * z + 2.48015872888517045348e-5;
  c = c * z + -1.38888888888730564116e-3;
  c = c * z + 4.16666666666665929218e-2;
  c = (c * z) * z + (1.0 - 0.5 * z);
  const Bits odd = -(quadrant & 1);
  const Bits first = (bits_of(s) & ~odd) | (bits_of(c) & odd);
  const Bits second = (bits_of(c) & ~odd) | (bits_of(s) & odd);
  sine = pack_of(first ^ ((quadrant & 2) << 62));
  cosine = pack_of(second ^ (((quadrant + 1) & 2) << 62));
}

/// Whether the reduction is exact enough: |x| < 10⁵ in all lanes.
inline bool in_range(const double* a) {
  bool good = true;
  for (std::size_t l = 0; l < LaneTape::lanes; ++l) {
    good = good & (a[l] < 1e5) & (a[l] > -1e5);
  }
  return good;
}

}  // namespace

void run_steps(const LaneTape::Step* steps, std::size_t count, double* work) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const LaneTape::Step& step = steps[i];
    const double* const pa = work + std::size_t{step.a} * LaneTape::lanes;
    const double* const pb = work + std::size_t{step.b} * LaneTape::lanes;
    const double* const pc = work + std::size_t{step.c} * LaneTape::lanes;
    double* const pt = work + std::size_t{step.to} * LaneTape::lanes;
    const auto* const a = reinterpret_cast<const Pack*>(pa);
    const auto* const b = reinterpret_cast<const Pack*>(pb);
    const auto* const c = reinterpret_cast<const Pack*>(pc);
    auto* const to = reinterpret_cast<Pack*>(pt);
    switch (step.code) {
      case static_cast<std::uint32_t>(Operation::add):
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] + b[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::subtract):
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] - b[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::multiply):
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] * b[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::divide):
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] / b[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::negate):
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = -a[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::chain):
        for (std::size_t l = 0; l < packs; ++l) {
          const Pack product = a[l] * b[l];
          const Bits zero = (product != product) & ((a[l] == 0.0) | (b[l] == 0.0));
          to[l] = pack_of(bits_of(product) & ~zero);
        }
        break;
      case multiply_add:
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] * b[l] + c[l];
        }
        break;
      case multiply_subtract:
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = a[l] * b[l] - c[l];
        }
        break;
      case negated_multiply_add:
        for (std::size_t l = 0; l < packs; ++l) {
          to[l] = c[l] - a[l] * b[l];
        }
        break;
      case static_cast<std::uint32_t>(Operation::sin):
      case static_cast<std::uint32_t>(Operation::cos):
        if (in_range(pa)) {
          for (std::size_t l = 0; l < packs; ++l) {
            Pack sine;
            Pack cosine;
            sine_cosine(a[l], sine, cosine);
            to[l] = step.code == static_cast<std::uint32_t>(Operation::sin) ? sine : cosine;
          }
          break;
        }
        [[fallthrough]];
      default:
        run_scalar(static_cast<Operation>(step.code), pa, pb, pc, pt);
    }
  }
}

}  // namespace flyball::expression::detail::FLYBALL_VARIANT
