#pragma once

// Part of space_kernel_baseline.cpp, _wide.cpp and _exact.cpp: compiled once for each instruction
// set, and once for doubles. The includer defines FLYBALL_VARIANT; FLYBALL_ONE_LANE means doubles.

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

/// A segment in lanes.
struct Segment {
  Real x, y;
  Real ux, uy;  ///< Its direction, of length 1.
  Number length;
};

/// Squared distance of a point from a segment.
FLYBALL_LANE Real squared_distance(const Segment& s, Real px, Real py) {
  const Real dx = px - s.x;
  const Real dy = py - s.y;
  const Real along = dx * s.ux + dy * s.uy;
  const Real off = along - smaller(larger(along, splat(0)), splat(s.length));
  const Real across = dy * s.ux - dx * s.uy;
  return off * off + across * across;
}

/// Squared distance of a point from an edge that does not move.
FLYBALL_LANE Real squared_distance(const EdgeStep<Number>& e, Real px, Real py) {
  const Real dx = px - splat(e.x);
  const Real dy = py - splat(e.y);
  const Real along = dx * splat(e.tx) + dy * splat(e.ty);
  const Real off = along - smaller(larger(along, splat(0)), splat(e.length));
  const Real across = dy * splat(e.tx) - dx * splat(e.ty);
  return off * off + across * across;
}

/// Signed distance of a segment from a convex piece: exact outside; inside the depth of one of its
/// points.
FLYBALL_LANE Real piece_distance(const SpaceView<Number>& space, const PieceStep<Number>& piece,
                                 const Segment& s) {
  const Real ex = s.x + splat(s.length) * s.ux;
  const Real ey = s.y + splat(s.length) * s.uy;
  Real enter = splat(0);
  Real leave = splat(1);
  Real squared = splat(boundless);
  for (int i = piece.first; i < piece.last; ++i) {
    const EdgeStep<Number>& e = space.edges[i];
    const Real a = splat(e.nx) * s.x + splat(e.ny) * s.y - splat(e.d);
    const Real b = splat(e.nx) * ex + splat(e.ny) * ey - splat(e.d);
    // The part with n·p < d: from a/(a - b) on, or up to it.
    const Real change = a - b;
    const Mask flat = size(change) < splat(static_cast<Number>(1e-12));
    const Real at = a / choose(flat, splat(1), change);
    const Mask falls = change > splat(0);
    enter = choose(flat, choose(a < splat(0), enter, splat(2)),
                   choose(falls, larger(enter, at), enter));
    leave = choose(flat, leave, choose(falls, leave, smaller(leave, at)));
    squared = smaller(squared, smaller(squared_distance(e, s.x, s.y),
                                       smaller(squared_distance(e, ex, ey),
                                               squared_distance(s, splat(e.x), splat(e.y)))));
  }
  const Real middle = splat(static_cast<Number>(0.5)) * (enter + leave) * splat(s.length);
  const Real mx = s.x + middle * s.ux;
  const Real my = s.y + middle * s.uy;
  Real depth = splat(-boundless);
  for (int i = piece.first; i < piece.last; ++i) {
    const EdgeStep<Number>& e = space.edges[i];
    depth = larger(depth, splat(e.nx) * mx + splat(e.ny) * my - splat(e.d));
  }
  return choose(enter < leave, smaller(depth, splat(0)), root(squared));
}

/// Distance of two segments; 0 where they cross.
FLYBALL_LANE Real segment_distance(const Segment& a, const Segment& b) {
  const Real aex = a.x + splat(a.length) * a.ux;
  const Real aey = a.y + splat(a.length) * a.uy;
  const Real bex = b.x + splat(b.length) * b.ux;
  const Real bey = b.y + splat(b.length) * b.uy;
  const Real squared =
      smaller(smaller(squared_distance(b, a.x, a.y), squared_distance(b, aex, aey)),
              smaller(squared_distance(a, b.x, b.y), squared_distance(a, bex, bey)));
  const Real a0 = (a.y - b.y) * b.ux - (a.x - b.x) * b.uy;
  const Real a1 = (aey - b.y) * b.ux - (aex - b.x) * b.uy;
  const Real b0 = (b.y - a.y) * a.ux - (b.x - a.x) * a.uy;
  const Real b1 = (bey - a.y) * a.ux - (bex - a.x) * a.uy;
  return choose(a0 * a1 < splat(0), choose(b0 * b1 < splat(0), splat(0), root(squared)),
                root(squared));
}

/// q about a middle, for a coordinate on a circle.
FLYBALL_LANE Real unwind(Real q, Number middle) {
  constexpr Number turn = static_cast<Number>(6.283185307179586476925287);
  const Real from = q - splat(middle);
  return q - splat(turn) * round_off(from * splat(static_cast<Number>(1) / turn));
}

/// Signed distance of a point from a polygon of the space: > 0 inside.
FLYBALL_LANE Real polygon_margin(const SpaceView<Number>& space, const RegionStep<Number>& step,
                                 Real x, Real y) {
  Real squared = splat(boundless);
  Real inside = splat(-1);
  for (int i = step.first; i < step.last; ++i) {
    const EdgeStep<Number>& e = space.sides[i];
    squared = smaller(squared, squared_distance(e, x, y));
    // A ray to the right crosses an edge that passes y on the right side of it.
    const Number end_y = e.d;
    const Real across = (y - splat(e.y)) * splat(e.tx) - (x - splat(e.x)) * splat(e.ty);
    const bool rises = end_y > e.y;
    const Real low = splat(rises ? e.y : end_y);
    const Real high = splat(rises ? end_y : e.y);
    const Real side = rises ? across : -across;
    inside = choose(y >= low, choose(y < high, choose(side > splat(0), -inside, inside), inside),
                    inside);
  }
  return inside * root(squared);
}

FLYBALL_LANE Real region_reach(const SpaceView<Number>& space, const Real* q,
                               const Number* inverse) {
  Real stack[deepest_region];
  int top = 0;
  Real least = splat(boundless);
  for (int i = 0; i < space.region_count; ++i) {
    const RegionStep<Number>& step = space.regions[i];
    switch (step.code) {
      case RegionCode::everything:
        stack[top++] = splat(boundless);
        break;
      case RegionCode::half_space: {
        Real value = splat(step.a - step.slack);
        for (int k = step.first; k < step.last; ++k) {
          value = value - splat(space.normals[k]) * q[k - step.first];
        }
        stack[top++] = value * splat(inverse[step.leaf]);
        break;
      }
      case RegionCode::interval: {
        const Real value = q[step.coordinate];
        stack[top++] = (smaller(value - splat(step.a), splat(step.b) - value) - splat(step.slack)) *
                       splat(inverse[step.leaf]);
        break;
      }
      case RegionCode::turn: {
        const Real value = unwind(q[step.coordinate], step.a);
        stack[top++] =
            (splat(step.b - step.slack) - size(value - splat(step.a))) * splat(inverse[step.leaf]);
        break;
      }
      case RegionCode::polygon: {
        Real x = q[step.coordinate];
        Real y = q[step.up];
        x = (step.wraps & 1) != 0 ? unwind(x, step.a) : x;
        y = (step.wraps & 2) != 0 ? unwind(y, step.b) : y;
        stack[top++] =
            (polygon_margin(space, step, x - splat(step.shift_x), y - splat(step.shift_y)) -
             splat(step.slack)) *
            splat(inverse[step.leaf]);
        break;
      }
      case RegionCode::least:
        --top;
        stack[top - 1] = smaller(stack[top - 1], stack[top]);
        break;
      case RegionCode::most:
        --top;
        stack[top - 1] = larger(stack[top - 1], stack[top]);
        break;
      case RegionCode::negate:
        stack[top - 1] = -stack[top - 1];
        break;
      case RegionCode::demand:
        --top;
        least = smaller(least, stack[top]);
        break;
    }
  }
  return least;
}

/// The smallest margin in shares of a move. @param hasty  Whether it may stop at a negative one.
FLYBALL_LANE Real reach(const SpaceView<Number>& space, const Real* q,
                        const InverseRates<Number>& rates, bool hasty) {
  Real ox[most_joints];
  Real oy[most_joints];
  Real c[most_joints];
  Real s[most_joints];
  for (int j = 0; j < space.joint_count; ++j) {
    const JointStep<Number>& joint = space.joints[j];
    Real mx = splat(joint.x);
    Real my = splat(joint.y);
    Real mc = splat(joint.cosine);
    Real ms = splat(joint.sine);
    if (joint.parent >= 0) {
      const int p = joint.parent;
      mx = ox[p] + c[p] * splat(joint.x) - s[p] * splat(joint.y);
      my = oy[p] + s[p] * splat(joint.x) + c[p] * splat(joint.y);
      if (joint.turned != 0) {
        mc = c[p] * splat(joint.cosine) - s[p] * splat(joint.sine);
        ms = s[p] * splat(joint.cosine) + c[p] * splat(joint.sine);
      } else {
        mc = c[p];
        ms = s[p];
      }
    }
    const Real at = q[joint.coordinate];
    if (joint.slides != 0) {
      ox[j] = mx + at * mc;
      oy[j] = my + at * ms;
      c[j] = mc;
      s[j] = ms;
    } else {
      Real qs;
      Real qc;
      sine_cosine(at, qs, qc);
      ox[j] = mx;
      oy[j] = my;
      c[j] = mc * qc - ms * qs;
      s[j] = ms * qc + mc * qs;
    }
  }
  Real least = splat(boundless);
  const auto place = [&](const BodyStep<Number>& body) {
    const int j = body.joint;
    if (body.shifted == 0) {
      return Segment{ox[j], oy[j], c[j], s[j], body.length};
    }
    return Segment{ox[j] + c[j] * splat(body.x) - s[j] * splat(body.y),
                   oy[j] + s[j] * splat(body.x) + c[j] * splat(body.y),
                   c[j] * splat(body.ux) - s[j] * splat(body.uy),
                   s[j] * splat(body.ux) + c[j] * splat(body.uy), body.length};
  };
  for (int b = 0; b < space.body_count; ++b) {
    const BodyStep<Number>& body = space.bodies[b];
    const Segment segment = place(body);
    Real margin = splat(boundless);
    for (int r = body.first_run; r < body.last_run; ++r) {
      const DiscRun<Number>& run = space.runs[r];
      Real squared = splat(boundless);
      if (body.length > 0) {
        const Real half = splat(static_cast<Number>(0.5) * body.length);
        const Real middle_x = segment.x + half * segment.ux;
        const Real middle_y = segment.y + half * segment.uy;
        for (int i = run.first; i < run.last; ++i) {
          const Real dx = splat(space.disc_x[i]) - middle_x;
          const Real dy = splat(space.disc_y[i]) - middle_y;
          const Real along = size(dx * segment.ux + dy * segment.uy) - half;
          const Real off = larger(along, splat(0));
          const Real across = dy * segment.ux - dx * segment.uy;
          squared = smaller(squared, off * off + across * across);
        }
      } else {
        for (int i = run.first; i < run.last; ++i) {
          const Real dx = splat(space.disc_x[i]) - segment.x;
          const Real dy = splat(space.disc_y[i]) - segment.y;
          squared = smaller(squared, dx * dx + dy * dy);
        }
      }
      margin = smaller(margin, root(squared) - splat(run.reach));
    }
    for (int i = body.first_plane; i < body.last_plane; ++i) {
      const PlaneStep<Number>& plane = space.planes[i];
      const Real height =
          splat(plane.nx) * segment.x + splat(plane.ny) * segment.y - splat(plane.d);
      const Real rise = splat(plane.nx) * segment.ux + splat(plane.ny) * segment.uy;
      margin = smaller(margin, height + smaller(rise, splat(0)) * splat(body.length));
    }
    for (int i = body.first_piece; i < body.last_piece; ++i) {
      margin = smaller(
          margin, piece_distance(space, space.pieces[i], segment) - splat(space.pieces[i].reach));
    }
    least = smaller(least, margin * splat(rates.body[b]));
    if (hasty && any_negative(least)) {
      return least;
    }
  }
  for (int i = 0; i < space.pair_count; ++i) {
    const PairStep<Number>& pair = space.pairs[i];
    const Real distance =
        segment_distance(place(space.bodies[pair.a]), place(space.bodies[pair.b]));
    least = smaller(least, (distance - splat(pair.reach)) * splat(rates.pair[i]));
  }
  for (int i = 0; i < space.hold_count; ++i) {
    const HoldStep<Number>& hold = space.holds[i];
    Real sum = splat(0);
    for (int m = hold.first; m < hold.last; ++m) {
      const MassStep<Number>& mass = space.masses[m];
      const int j = mass.joint;
      const Real arm = hold.slides != 0
                           ? s[hold.joint]
                           : ox[j] + c[j] * splat(mass.x) - s[j] * splat(mass.y) - ox[hold.joint];
      sum = sum + splat(mass.weight) * arm;
    }
    least = smaller(least, (splat(hold.limit) - size(sum)) * splat(rates.hold[i]));
  }
  if (space.region_count > 0) {
    least = smaller(least, region_reach(space, q, rates.leaf));
  }
  return least;
}

#ifndef FLYBALL_ONE_LANE

[[gnu::flatten]] void reaches(const SpaceView<float>& space, const float* q,
                              const InverseRates<float>& rates, float* to) noexcept {
  Real all[most_axes];
  __builtin_memcpy(all, q, sizeof(Real) * static_cast<unsigned long>(space.dimension));
  const Real least = reach(space, all, rates, false);
  __builtin_memcpy(to, &least, sizeof least);
}

[[gnu::flatten]] EdgeState check_edge(const SpaceView<float>& space, const float* from,
                                      const float* by, const InverseRates<float>& rates,
                                      int most) noexcept {
  // Stretches that are not proven yet: a stack, the last first.
  constexpr int room = 192;
  float low[room];
  float high[room];
  int count = 0;
  float at[lanes];
  float begin[lanes];
  float end[lanes];
  for (int i = 0; i < lanes; ++i) {
    begin[i] = static_cast<float>(i) * 0.125F;
    end[i] = begin[i] + 0.125F;
    at[i] = begin[i] + 0.0625F;
  }
  int used = lanes;
  for (int batch = 0; batch < most; ++batch) {
    Real where;
    __builtin_memcpy(&where, at, sizeof where);
    Real q[most_axes];
    for (int k = 0; k < space.dimension; ++k) {
      q[k] = splat(from[k]) + where * splat(by[k]);
    }
    const Real least = reach(space, q, rates, true);
    if (any_negative(least)) {
      return EdgeState::blocked;
    }
    for (int i = 0; i < used; ++i) {
      const float half = 0.999F * least[i];
      if (at[i] - half > begin[i] && count < room) {
        low[count] = begin[i];
        high[count++] = at[i] - half;
      }
      if (at[i] + half < end[i] && count < room) {
        low[count] = at[i] + half;
        high[count++] = end[i];
      }
    }
    if (count == 0) {
      return EdgeState::free;
    }
    if (count > room - 2 * lanes) {
      return EdgeState::unproven;
    }
    // Fewer stretches than lanes are cut into equal parts.
    const int parts = count >= lanes ? 1 : lanes / count;
    used = 0;
    while (count > 0 && used + parts <= lanes) {
      --count;
      const float step = (high[count] - low[count]) / static_cast<float>(parts);
      for (int i = 0; i < parts; ++i) {
        begin[used] = low[count] + step * static_cast<float>(i);
        end[used] = i + 1 == parts ? high[count] : begin[used] + step;
        at[used] = 0.5F * (begin[used] + end[used]);
        ++used;
      }
    }
    for (int i = used; i < lanes; ++i) {
      at[i] = at[0];
    }
  }
  return EdgeState::unproven;
}

[[gnu::flatten]] int nearest(const float* points, int stride, int count, int dimension,
                             const float* inverse_scale, const float* turn,
                             const float* to) noexcept {
  Real best = splat(boundless);
  Mask index = count_from(0);
  for (int i = 0; i < count; i += lanes) {
    Real squared = splat(0);
    for (int k = 0; k < dimension; ++k) {
      Real x;
      __builtin_memcpy(&x, points + k * stride + i, sizeof x);
      Real d = x - splat(to[k]);
      if (turn[k] > 0.0F) {
        d = d - splat(turn[k]) * round_off(d * splat(1.0F / turn[k]));
      }
      d = d * splat(inverse_scale[k]);
      squared = squared + d * d;
    }
    const Mask closer = squared < best;
    best = choose(closer, squared, best);
    index = choose(closer, count_from(i), index);
  }
  int least = 0;
  float distance = boundless;
  for (int i = 0; i < lanes; ++i) {
    if (lane(index, i) < count && best[i] < distance) {
      distance = best[i];
      least = lane(index, i);
    }
  }
  return least;
}

#endif

#undef FLYBALL_LANE

}  // namespace flyball::detail::FLYBALL_VARIANT
