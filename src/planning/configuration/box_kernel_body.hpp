#pragma once

// Boxes of configurations, eight at a time. Part of space_kernel_baseline.cpp and _wide.cpp.

#include "planning/configuration/space_kernel_body.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail::FLYBALL_VARIANT {

/// How points of a body move while the configuration goes anywhere in a box.
struct Travel {
  Real most;                ///< No point of it goes farther.
  Real share[most_joints];  ///< Of it by each joint of the chain, the body's own first.
};

/// Joints move one after the other, the last of the chain first: each turns what follows about its
/// origin, which has not moved yet, by no more than its angle times the distance.
FLYBALL_LANE Travel travel(const SpaceView<Number>& space, const Poses& at, const Real* half,
                           int joint, Real ax, Real ay, Real bx, Real by) {
  Travel to;
  to.most = splat(0);
  int n = 0;
  for (int j = joint; j >= 0; j = space.joints[j].parent) {
    const JointStep<Number>& step = space.joints[j];
    Real part = half[step.coordinate];
    if (step.slides == 0) {
      const Real rx = ax - at.ox[j];
      const Real ry = ay - at.oy[j];
      const Real sx = bx - at.ox[j];
      const Real sy = by - at.oy[j];
      part = part * (root(larger(rx * rx + ry * ry, sx * sx + sy * sy)) + to.most);
    }
    to.share[n++] = part;
    to.most = to.most + part;
  }
  return to;
}

/// The same for one point along a direction and across it, with what is of second order beside.
struct Drift {
  Real along, across, rest;
  Real share[most_joints];  ///< What a joint adds to what keeps a contact from being sure.
};
FLYBALL_LANE Drift drift(const SpaceView<Number>& space, const Poses& at, const Real* half,
                         int joint, Real px, Real py, Real nx, Real ny) {
  Drift to;
  to.along = splat(0);
  to.across = splat(0);
  to.rest = splat(0);
  Real moved = splat(0);
  int n = 0;
  for (int j = joint; j >= 0; j = space.joints[j].parent) {
    const JointStep<Number>& step = space.joints[j];
    const Real change = half[step.coordinate];
    const bool slides = step.slides != 0;
    const Real rx = px - at.ox[j];
    const Real ry = py - at.oy[j];
    const Real vx = slides ? at.c[j] : -ry;
    const Real vy = slides ? at.s[j] : rx;
    const Real along = change * size(nx * vx + ny * vy);
    const Real across = change * size(ny * vx - nx * vy);
    to.along = to.along + along;
    to.across = to.across + across;
    to.share[n++] = along + splat(0.3F) * across;
    if (slides) {
      moved = moved + change;
    } else {
      const Real far = root(rx * rx + ry * ry) + moved;
      to.rest = to.rest + change * moved + splat(0.5F) * change * change * far;
      moved = moved + change * far;
    }
  }
  return to;
}

/// What decides a box, as far as it has been looked at.
struct BoxVerdict {
  Real free;              ///< >= 0 while nothing can be broken anywhere in it.
  Real blocked;           ///< < 0 once something is broken everywhere in it.
  Real ratio;             ///< The least margin in shares of what the box moves.
  Real share[most_axes];  ///< What each coordinate adds to that.
};

FLYBALL_LANE void take(const SpaceView<Number>& space, BoxVerdict& to, Real ratio, int joint,
                       const Real* share) {
  const Mask closer = ratio < to.ratio;
  to.ratio = choose(closer, ratio, to.ratio);
  Real all[most_axes];
  for (int k = 0; k < space.dimension; ++k) {
    all[k] = splat(0);
  }
  int n = 0;
  for (int j = joint; j >= 0; j = space.joints[j].parent) {
    const int k = space.joints[j].coordinate;
    all[k] = all[k] + share[n++];
  }
  for (int k = 0; k < space.dimension; ++k) {
    to.share[k] = choose(closer, all[k], to.share[k]);
  }
}

FLYBALL_LANE void take_rates(const SpaceView<Number>& space, BoxVerdict& to, Real margin,
                             Number slack, const Number* rates, const Real* half) {
  Real rate = splat(1e-12F);
  for (int k = 0; k < space.dimension; ++k) {
    rate = rate + splat(rates[k]) * half[k];
  }
  to.free = smaller(to.free, margin - rate);
  to.blocked = smaller(to.blocked, margin + rate + splat(slack));
  const Real ratio = margin / rate;
  const Mask closer = ratio < to.ratio;
  to.ratio = choose(closer, ratio, to.ratio);
  for (int k = 0; k < space.dimension; ++k) {
    to.share[k] = choose(closer, splat(rates[k]) * half[k], to.share[k]);
  }
}

FLYBALL_LANE void take_body(const SpaceView<Number>& space, BoxVerdict& to, const Poses& at,
                            const Real* half, const BodyStep<Number>& body, Number slack) {
  const Segment segment = place(at, body);
  const Real length = splat(body.length);
  const Real ex = segment.x + length * segment.ux;
  const Real ey = segment.y + length * segment.uy;
  const Travel moved = travel(space, at, half, body.joint, segment.x, segment.y, ex, ey);
  const Real most = larger(moved.most, splat(1e-12F));
  Real margin = splat(boundless);
  for (int r = body.first_run; r < body.last_run; ++r) {
    const DiscRun<Number>& run = space.runs[r];
    Real squared = splat(boundless);
    Real px = segment.x;
    Real py = segment.y;
    Real nx = splat(1);
    Real ny = splat(0);
    for (int i = run.first; i < run.last; ++i) {
      const Real cx = splat(space.disc_x[i]);
      const Real cy = splat(space.disc_y[i]);
      Real qx = segment.x;
      Real qy = segment.y;
      if (body.length > 0) {
        const Real along = (cx - segment.x) * segment.ux + (cy - segment.y) * segment.uy;
        const Real on = smaller(larger(along, splat(0)), length);
        qx = qx + on * segment.ux;
        qy = qy + on * segment.uy;
      }
      const Real dx = qx - cx;
      const Real dy = qy - cy;
      const Real now = dx * dx + dy * dy;
      const Mask closer = now < squared;
      squared = choose(closer, now, squared);
      nx = choose(closer, dx, nx);
      ny = choose(closer, dy, ny);
      px = choose(closer, qx, px);
      py = choose(closer, qy, py);
    }
    const Real distance = root(squared);
    const Mask middle = distance < splat(1e-6F);
    const Real inverse = splat(1) / larger(distance, splat(1e-6F));
    nx = choose(middle, splat(1), nx * inverse);
    ny = choose(middle, splat(0), ny * inverse);
    const Drift drifts = drift(space, at, half, body.joint, px, py, nx, ny);
    const Real far = distance + drifts.along;
    to.blocked = smaller(to.blocked, root(far * far + drifts.across * drifts.across) + drifts.rest +
                                         splat(slack - run.reach));
    const Real gap = distance - splat(run.reach);
    margin = smaller(margin, gap);
    take(space, to, gap / most, body.joint, drifts.share);
  }
  for (int i = body.first_plane; i < body.last_plane; ++i) {
    const PlaneStep<Number>& plane = space.planes[i];
    const Real rise = splat(plane.nx) * segment.ux + splat(plane.ny) * segment.uy;
    const Mask falls = rise < splat(0);
    const Real px = choose(falls, ex, segment.x);
    const Real py = choose(falls, ey, segment.y);
    const Real height = splat(plane.nx) * px + splat(plane.ny) * py - splat(plane.d);
    const Drift drifts =
        drift(space, at, half, body.joint, px, py, splat(plane.nx), splat(plane.ny));
    to.blocked = smaller(to.blocked, height + drifts.along + drifts.rest + splat(slack));
    margin = smaller(margin, height);
    take(space, to, height / most, body.joint, drifts.share);
  }
  for (int i = body.first_piece; i < body.last_piece; ++i) {
    const Real gap = piece_distance(space, space.pieces[i], segment) - splat(space.pieces[i].reach);
    to.blocked = smaller(to.blocked, gap + moved.most + splat(slack));
    margin = smaller(margin, gap);
    take(space, to, gap / most, body.joint, moved.share);
  }
  to.free = smaller(to.free, margin - moved.most);
}

FLYBALL_LANE void take_regions(const SpaceView<Number>& space, BoxVerdict& to, const Real* q,
                               const Real* half, const Number* weight) {
  const auto rate = [&](const RegionStep<Number>& step) {
    Real sum = splat(1e-12F);
    if (step.code == RegionCode::half_space) {
      for (int k = step.first; k < step.last; ++k) {
        sum = sum + size(splat(space.normals[k])) * half[k - step.first];
      }
      return sum;
    }
    if (step.code == RegionCode::polygon) {
      const Real across = half[step.coordinate];
      const Real up = half[step.up];
      return sum + root(across * across + up * up);
    }
    return sum + half[step.coordinate];
  };
  const auto least = [&](Number side) {
    return region_reach(space, q, [&](const RegionStep<Number>& step, Real value) {
      return (value - splat(side * step.slack)) / rate(step);
    });
  };
  const Real low = least(1);
  to.free = smaller(to.free, low - splat(1));
  to.blocked = smaller(to.blocked, least(-1) + splat(1.001F));
  const Mask closer = low < to.ratio;
  to.ratio = choose(closer, low, to.ratio);
  for (int k = 0; k < space.dimension; ++k) {
    to.share[k] = choose(closer, splat(weight[k]) * half[k], to.share[k]);
  }
}

[[gnu::flatten]] void judge_boxes(const SpaceView<float>& space, const float* middles,
                                  const float* halves, const BoxRates& rates, BoxState* states,
                                  int* axes) noexcept {
  Real q[most_axes];
  Real half[most_axes];
  __builtin_memcpy(q, middles, sizeof(Real) * static_cast<unsigned long>(space.dimension));
  __builtin_memcpy(half, halves, sizeof(Real) * static_cast<unsigned long>(space.dimension));
  Poses at;
  place_joints(space, q, at);
  BoxVerdict verdict;
  verdict.free = splat(boundless);
  verdict.blocked = splat(boundless);
  verdict.ratio = splat(boundless);
  for (int k = 0; k < space.dimension; ++k) {
    verdict.share[k] = splat(rates.weights[k]) * half[k];
  }
  for (int b = 0; b < space.body_count; ++b) {
    take_body(space, verdict, at, half, space.bodies[b], rates.slack);
  }
  const unsigned long n = static_cast<unsigned long>(space.dimension);
  for (int i = 0; i < space.pair_count; ++i) {
    const PairStep<Number>& pair = space.pairs[i];
    const Real gap =
        segment_distance(place(at, space.bodies[pair.a]), place(at, space.bodies[pair.b])) -
        splat(pair.reach);
    take_rates(space, verdict, gap, rates.slack, rates.pairs + n * static_cast<unsigned long>(i),
               half);
  }
  for (int i = 0; i < space.hold_count; ++i) {
    const HoldStep<Number>& hold = space.holds[i];
    take_rates(space, verdict, splat(hold.limit) - held(space, at, hold), rates.hold_slack[i],
               rates.holds + n * static_cast<unsigned long>(i), half);
  }
  if (space.region_count > 0) {
    take_regions(space, verdict, q, half, rates.weights);
  }
  for (int i = 0; i < lanes; ++i) {
    states[i] = verdict.blocked[i] < 0.0F ? BoxState::blocked
                : verdict.free[i] >= 0.0F ? BoxState::free
                                          : BoxState::mixed;
    int widest = -1;
    float most = 0.0F;
    for (int k = 0; k < space.dimension; ++k) {
      if (verdict.share[k][i] > most) {
        most = verdict.share[k][i];
        widest = k;
      }
    }
    axes[i] = widest;
  }
}

}  // namespace flyball::detail::FLYBALL_VARIANT
