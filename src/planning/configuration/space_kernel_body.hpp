#pragma once

// The margins of a configuration, and moves. Part of space_kernel_baseline.cpp, _wide.cpp and
// _exact.cpp, which say in what numbers.

#include "planning/configuration/space_lanes.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

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

/// The smallest of what regions demand. @param share  What a margin of a leaf is, given the leaf.
template <class Share>
FLYBALL_LANE Real region_reach(const SpaceView<Number>& space, const Real* q, const Share& share) {
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
        Real value = splat(step.a);
        for (int k = step.first; k < step.last; ++k) {
          value = value - splat(space.normals[k]) * q[k - step.first];
        }
        stack[top++] = share(step, value);
        break;
      }
      case RegionCode::interval: {
        const Real value = q[step.coordinate];
        stack[top++] = share(step, smaller(value - splat(step.a), splat(step.b) - value));
        break;
      }
      case RegionCode::turn: {
        const Real value = unwind(q[step.coordinate], step.a);
        stack[top++] = share(step, splat(step.b) - size(value - splat(step.a)));
        break;
      }
      case RegionCode::polygon: {
        Real x = q[step.coordinate];
        Real y = q[step.up];
        x = (step.wraps & 1) != 0 ? unwind(x, step.a) : x;
        y = (step.wraps & 2) != 0 ? unwind(y, step.b) : y;
        stack[top++] = share(
            step, polygon_margin(space, step, x - splat(step.shift_x), y - splat(step.shift_y)));
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

/// Where the joints' frames are.
struct Poses {
  Real ox[most_joints];
  Real oy[most_joints];
  Real c[most_joints];
  Real s[most_joints];
};

FLYBALL_LANE void place_joints(const SpaceView<Number>& space, const Real* q, Poses& to) {
  for (int j = 0; j < space.joint_count; ++j) {
    const JointStep<Number>& joint = space.joints[j];
    Real mx = splat(joint.x);
    Real my = splat(joint.y);
    Real mc = splat(joint.cosine);
    Real ms = splat(joint.sine);
    if (joint.parent >= 0) {
      const int p = joint.parent;
      mx = to.ox[p] + to.c[p] * splat(joint.x) - to.s[p] * splat(joint.y);
      my = to.oy[p] + to.s[p] * splat(joint.x) + to.c[p] * splat(joint.y);
      if (joint.turned != 0) {
        mc = to.c[p] * splat(joint.cosine) - to.s[p] * splat(joint.sine);
        ms = to.s[p] * splat(joint.cosine) + to.c[p] * splat(joint.sine);
      } else {
        mc = to.c[p];
        ms = to.s[p];
      }
    }
    const Real value = q[joint.coordinate];
    if (joint.slides != 0) {
      to.ox[j] = mx + value * mc;
      to.oy[j] = my + value * ms;
      to.c[j] = mc;
      to.s[j] = ms;
    } else {
      Real qs;
      Real qc;
      sine_cosine(value, qs, qc);
      to.ox[j] = mx;
      to.oy[j] = my;
      to.c[j] = mc * qc - ms * qs;
      to.s[j] = ms * qc + mc * qs;
    }
  }
}

FLYBALL_LANE Segment place(const Poses& at, const BodyStep<Number>& body) {
  const int j = body.joint;
  if (body.shifted == 0) {
    return Segment{at.ox[j], at.oy[j], at.c[j], at.s[j], body.length};
  }
  return Segment{at.ox[j] + at.c[j] * splat(body.x) - at.s[j] * splat(body.y),
                 at.oy[j] + at.s[j] * splat(body.x) + at.c[j] * splat(body.y),
                 at.c[j] * splat(body.ux) - at.s[j] * splat(body.uy),
                 at.s[j] * splat(body.ux) + at.c[j] * splat(body.uy), body.length};
}

/// What a joint holds.
FLYBALL_LANE Real held(const SpaceView<Number>& space, const Poses& at,
                       const HoldStep<Number>& hold) {
  Real sum = splat(0);
  for (int m = hold.first; m < hold.last; ++m) {
    const MassStep<Number>& mass = space.masses[m];
    const int j = mass.joint;
    const Real arm = hold.slides != 0 ? at.s[hold.joint]
                                      : at.ox[j] + at.c[j] * splat(mass.x) -
                                            at.s[j] * splat(mass.y) - at.ox[hold.joint];
    sum = sum + splat(mass.weight) * arm;
  }
  return size(sum);
}

/// The smallest margin in shares of a move. @param hasty  Whether it may stop at a negative one.
FLYBALL_LANE Real reach(const SpaceView<Number>& space, const Real* q,
                        const InverseRates<Number>& rates, bool hasty) {
  Poses at;
  place_joints(space, q, at);
  Real least = splat(boundless);
  for (int b = 0; b < space.body_count; ++b) {
    const BodyStep<Number>& body = space.bodies[b];
    const Segment segment = place(at, body);
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
        segment_distance(place(at, space.bodies[pair.a]), place(at, space.bodies[pair.b]));
    least = smaller(least, (distance - splat(pair.reach)) * splat(rates.pair[i]));
  }
  for (int i = 0; i < space.hold_count; ++i) {
    const HoldStep<Number>& hold = space.holds[i];
    least = smaller(least, (splat(hold.limit) - held(space, at, hold)) * splat(rates.hold[i]));
  }
  if (space.region_count > 0) {
    least = smaller(least, region_reach(space, q, [&](const RegionStep<Number>& step, Real value) {
                      return (value - splat(step.slack)) * splat(rates.leaf[step.leaf]);
                    }));
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

}  // namespace flyball::detail::FLYBALL_VARIANT
