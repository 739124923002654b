// A space's program in floats, on the safe side of their rounding.
#include <algorithm>
#include <cmath>
#include <vector>

#include "planning/configuration/polygons.hpp"
#include "planning/configuration/space_model.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail {

namespace {

/// How far the mechanism reaches, and what stands around it: what the rounding of floats is of.
double extent_of(const SpaceModel& model) {
  double extent = 1e-3;
  if (!model.mechanism) {
    return extent;
  }
  const PlanarMechanism& mechanism = *model.mechanism;
  for (const PlanarJoint& joint : mechanism.joints) {
    const SpaceAxis& axis = model.axes[static_cast<std::size_t>(joint.coordinate)];
    extent += std::hypot(joint.x, joint.y);
    extent += joint.slides ? std::max(std::abs(axis.low), std::abs(axis.high)) : 0.0;
  }
  double most = 0.0;
  for (const LinkBody& body : mechanism.bodies) {
    most = std::max({most, std::hypot(body.from[0], body.from[1]) + body.radius,
                     std::hypot(body.to[0], body.to[1]) + body.radius});
  }
  for (const PlanarObstacle& obstacle : mechanism.obstacles) {
    most = std::max(most, std::hypot(obstacle.at[0], obstacle.at[1]) + obstacle.radius);
    for (const Point& v : obstacle.vertices) {
      most = std::max(most, std::hypot(v[0], v[1]));
    }
  }
  return extent + most;
}

template <class To, class From>
void copy_all(const std::vector<From>& from, std::vector<To>& to, To (*as)(const From&)) {
  to.reserve(from.size());
  for (const From& one : from) {
    to.push_back(as(one));
  }
}

}  // namespace

SpaceProgram<float> in_floats(const SpaceModel& model, const SpaceProgram<double>& exact,
                              const std::vector<int>& signs) {
  constexpr double relative = 4e-6;
  const double extent = extent_of(model);
  const double slack = relative * extent;
  const auto f = [](double x) { return static_cast<float>(x); };
  SpaceProgram<float> to;
  to.dimension = exact.dimension;
  to.rates = exact.rates;
  to.slack = slack;
  for (const auto& j : exact.joints) {
    to.joints.push_back(
        {j.parent, j.coordinate, j.slides, j.turned, f(j.x), f(j.y), f(j.cosine), f(j.sine)});
  }
  for (const auto& b : exact.bodies) {
    to.bodies.push_back({b.joint, b.shifted, f(b.x), f(b.y), f(b.ux), f(b.uy), f(b.length),
                         b.first_run, b.last_run, b.first_plane, b.last_plane, b.first_piece,
                         b.last_piece});
  }
  for (const auto& r : exact.runs) {
    to.runs.push_back({r.first, r.last, f(r.reach + slack)});
  }
  copy_all<float, double>(exact.disc_x, to.disc_x, [](const double& x) { return float(x); });
  copy_all<float, double>(exact.disc_y, to.disc_y, [](const double& x) { return float(x); });
  for (const auto& p : exact.planes) {
    to.planes.push_back({f(p.nx), f(p.ny), f(p.d + slack)});
  }
  for (const auto& p : exact.pieces) {
    to.pieces.push_back({p.first, p.last, f(p.reach + slack)});
  }
  const auto edge = [](const EdgeStep<double>& e) {
    return EdgeStep<float>{float(e.x),      float(e.y),  float(e.tx), float(e.ty),
                           float(e.length), float(e.nx), float(e.ny), float(e.d)};
  };
  copy_all<EdgeStep<float>, EdgeStep<double>>(exact.edges, to.edges, edge);
  copy_all<EdgeStep<float>, EdgeStep<double>>(exact.sides, to.sides, edge);
  for (const auto& p : exact.pairs) {
    to.pairs.push_back({p.a, p.b, f(p.reach + slack)});
  }
  for (const auto& m : exact.masses) {
    to.masses.push_back({m.joint, f(m.x), f(m.y), f(m.weight)});
  }
  for (const auto& h : exact.holds) {
    double weight = 0.0;
    for (int i = h.first; i < h.last; ++i) {
      weight += exact.masses[static_cast<std::size_t>(i)].weight;
    }
    const double lost = relative * (weight * (h.slides != 0 ? 1.0 : extent) + h.limit);
    to.holds.push_back({h.joint, h.slides, h.first, h.last, f(h.limit - lost)});
  }
  copy_all<float, double>(exact.normals, to.normals, [](const double& x) { return float(x); });
  const auto far = [&](int k) {
    const SpaceAxis& axis = model.axes[static_cast<std::size_t>(k)];
    return std::max({std::abs(axis.low), std::abs(axis.high), axis.wraps ? 13.0 : 0.0});
  };
  const auto size = [](double x) { return std::isfinite(x) ? std::abs(x) : 0.0; };
  for (const auto& r : exact.regions) {
    double lost = 0.0;
    switch (r.code) {
      case RegionCode::half_space:
        lost = size(r.a);
        for (int k = r.first; k < r.last; ++k) {
          lost += std::abs(exact.normals[static_cast<std::size_t>(k)]) * far(k - r.first);
        }
        break;
      case RegionCode::interval:
      case RegionCode::turn:
        lost = size(r.a) + size(r.b) + far(r.coordinate);
        break;
      case RegionCode::polygon:
        lost = far(r.coordinate) + far(r.up) + std::abs(r.shift_x) + std::abs(r.shift_y);
        for (int i = r.first; i < r.last; ++i) {
          const EdgeStep<double>& e = exact.sides[static_cast<std::size_t>(i)];
          lost = std::max(lost, std::abs(e.x) + std::abs(e.y));
        }
        break;
      default:
        break;
    }
    const bool leaf = r.code == RegionCode::half_space || r.code == RegionCode::interval ||
                      r.code == RegionCode::turn || r.code == RegionCode::polygon;
    const double sign = leaf ? signs[static_cast<std::size_t>(r.leaf)] : 0.0;
    to.regions.push_back({r.code, r.coordinate, r.up, r.first, r.last, r.leaf, r.wraps, f(r.a),
                          f(r.b), f(r.shift_x), f(r.shift_y), f(sign * relative * lost)});
  }
  return to;
}

}  // namespace flyball::detail
