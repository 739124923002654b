#pragma once

// Part of modal_kernel_baseline.cpp and modal_kernel_wide.cpp: compiled once for each instruction
// set, in its own namespace (see instruction_set.hpp).

namespace flyball::classical::detail::FLYBALL_VARIANT {

using Lanes = double __attribute__((vector_size(32)));
using Bits = long long __attribute__((vector_size(32)));

[[gnu::always_inline]] inline Lanes load(const double* from) {
  Lanes lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
[[gnu::always_inline]] inline void store(double* to, Lanes lanes) {
  __builtin_memcpy(to, &lanes, sizeof lanes);
}
[[gnu::always_inline]] inline Lanes magnitude(Lanes lanes) {
  constexpr long long all_but_sign = 0x7fffffffffffffff;
  return (Lanes)((Bits)lanes & (Bits{} + all_but_sign));
}

/// `Entries` entries from the first one on, of one block of points.
template <int Entries>
[[gnu::always_inline]] inline void add_terms(const ModalTerms& terms, int first,
                                             const double* points, double* values, double* bound) {
  const Lanes z_re = load(points);
  const Lanes z_re_lo = load(points + modal_lanes);
  const Lanes z_im = load(points + 2 * modal_lanes);
  const Lanes z_im_lo = load(points + 3 * modal_lanes);
  Lanes re[Entries];
  Lanes im[Entries];
  for (int e = 0; e < Entries; ++e) {
    re[e] = Lanes{} + terms.direct[static_cast<std::size_t>(first + e)];
    im[e] = Lanes{};
  }
  Lanes sum = Lanes{} + terms.direct_size;
  const double* residue = terms.residue.data() + 2 * first;
  const int stride = 2 * terms.outputs_times_inputs;
  for (int k = 0; k < terms.count; ++k, residue += stride) {
    const auto at = static_cast<std::size_t>(k);
    const Lanes a = (z_re - terms.re[at]) + (z_re_lo - terms.re_lo[at]);
    const Lanes d = (z_im - terms.im[at]) + (z_im_lo - terms.im_lo[at]);
    // 1/(a + jd) = (a - jd)/(a² + d²)
    const Lanes q = 1.0 / (a * a + d * d);
    const Lanes x = a * q;
    const Lanes y = -d * q;
    if (k >= terms.pairs) {
      for (int e = 0; e < Entries; ++e) {
        re[e] += residue[2 * e] * x;
        im[e] += residue[2 * e] * y;
      }
      sum += terms.weight[at] * (magnitude(x) + magnitude(y));
      continue;
    }
    const Lanes d_other = (z_im + terms.im[at]) + (z_im_lo + terms.im_lo[at]);
    const Lanes q_other = 1.0 / (a * a + d_other * d_other);
    const Lanes x_other = a * q_other;
    const Lanes y_other = -d_other * q_other;
    // R/(z - λ) + R̄/(z - λ̄)
    const Lanes x_sum = x + x_other;
    const Lanes y_sum = y + y_other;
    const Lanes x_difference = x - x_other;
    const Lanes y_difference = y - y_other;
    for (int e = 0; e < Entries; ++e) {
      const double r = residue[2 * e];
      const double i = residue[2 * e + 1];
      re[e] += r * x_sum;
      re[e] -= i * y_difference;
      im[e] += r * y_sum;
      im[e] += i * x_difference;
    }
    sum += terms.weight[at] *
           ((magnitude(x) + magnitude(y)) + (magnitude(x_other) + magnitude(y_other)));
  }
  for (int e = 0; e < Entries; ++e) {
    store(values + 2 * modal_lanes * e, re[e]);
    store(values + 2 * modal_lanes * e + modal_lanes, im[e]);
  }
  store(bound, sum);
}

void modal_response(const ModalTerms& terms, const double* points, int blocks, double* values,
                    double* bound) {
  const int entries = terms.outputs_times_inputs;
  for (int block = 0; block < blocks; ++block) {
    int first = 0;
    for (; first + 4 <= entries; first += 4) {
      add_terms<4>(terms, first, points, values + 2 * modal_lanes * first, bound);
    }
    for (; first < entries; ++first) {
      add_terms<1>(terms, first, points, values + 2 * modal_lanes * first, bound);
    }
    points += modal_point;
    values += 2 * modal_lanes * entries;
    bound += modal_lanes;
  }
}

}  // namespace flyball::classical::detail::FLYBALL_VARIANT
