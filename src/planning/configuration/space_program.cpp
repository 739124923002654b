#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "planning/configuration/polygons.hpp"
#include "planning/configuration/space_model.hpp"
#include "planning/configuration/space_program.hpp"

namespace flyball::detail {

template <class E>
InverseRates<E> inverse_rates(const SpaceProgram<E>& program, const double* by, E* to) noexcept {
  const RateStep& rates = program.rates;
  double turning[most_joints];
  double speed[most_joints];
  for (std::size_t j = 0; j < rates.joints.size(); ++j) {
    const RateStep::Joint& joint = rates.joints[j];
    const double change = by[joint.coordinate];
    double carried = 0.0;
    double v = 0.0;
    if (joint.parent >= 0) {
      const auto p = static_cast<std::size_t>(joint.parent);
      carried = turning[p];
      v = speed[p] + std::abs(carried) * joint.mount;
    }
    turning[j] = joint.slides ? carried : carried + change;
    speed[j] = joint.slides ? v + std::abs(change) + std::abs(carried) * joint.extent : v;
  }
  constexpr double most = 1e30;
  auto put = [&, i = std::size_t{0}](double rate) mutable {
    to[i++] = static_cast<E>(rate > 1.0 / most ? 1.0 / rate : most);
  };
  for (const RateStep::Body& body : rates.bodies) {
    const auto j = static_cast<std::size_t>(body.joint);
    put(speed[j] + std::abs(turning[j]) * body.far);
  }
  const auto n = static_cast<std::size_t>(program.dimension);
  for (const std::vector<double>* table : {&rates.pairs, &rates.holds}) {
    for (std::size_t i = 0; i + n <= table->size(); i += n) {
      double rate = 0.0;
      for (std::size_t k = 0; k < n; ++k) {
        rate += (*table)[i + k] * std::abs(by[k]);
      }
      put(rate);
    }
  }
  for (const RateStep::Leaf& leaf : rates.leaves) {
    if (leaf.code == RegionCode::half_space) {
      double rate = 0.0;
      for (int k = leaf.first; k < leaf.last; ++k) {
        rate += std::abs(rates.normals[static_cast<std::size_t>(k)] * by[k - leaf.first]);
      }
      put(rate);
    } else if (leaf.code == RegionCode::polygon) {
      put(std::hypot(by[leaf.coordinate], by[leaf.up]));
    } else {
      put(std::abs(by[leaf.coordinate]));
    }
  }
  const std::size_t bodies = rates.bodies.size();
  E* const pair = to + bodies;
  E* const hold = pair + (n > 0 ? rates.pairs.size() / n : 0);
  E* const leaf = hold + (n > 0 ? rates.holds.size() / n : 0);
  return {to, pair, hold, leaf};
}

template InverseRates<double> inverse_rates(const SpaceProgram<double>& program, const double* by,
                                            double* to) noexcept;
template InverseRates<float> inverse_rates(const SpaceProgram<float>& program, const double* by,
                                           float* to) noexcept;

namespace {

using Kind = RegionNode::Kind;

std::string body_name(const PlanarMechanism& mechanism, std::size_t b) {
  const std::string& name = mechanism.bodies[b].name;
  return name.empty() ? "body " + std::to_string(b + 1) : name;
}

std::string obstacle_name(const PlanarMechanism& mechanism, std::size_t o) {
  const std::string& name = mechanism.obstacles[o].name;
  return name.empty() ? "obstacle " + std::to_string(o + 1) : name;
}

std::string joint_name(const PlanarMechanism& mechanism, int j) {
  const std::string& name = mechanism.joints[static_cast<std::size_t>(j)].name;
  return name.empty() ? "joint " + std::to_string(j + 1) : name;
}

/// Whether a joint carries another, or is it.
bool carries(const PlanarMechanism& mechanism, int joint, int other) {
  while (other > joint) {
    other = mechanism.joints[static_cast<std::size_t>(other)].parent;
  }
  return other == joint;
}

class Builder {
 public:
  explicit Builder(const SpaceModel& model) : model_(model) {
    program.dimension = model.dimension();
  }

  /// The joints, which everything of a mechanism needs first.
  void add_joints() {
    const PlanarMechanism& mechanism = *model_.mechanism;
    for (const PlanarJoint& joint : mechanism.joints) {
      const bool turned = joint.angle != 0.0;
      program.joints.push_back({joint.parent, joint.coordinate, joint.slides ? 1 : 0,
                                turned ? 1 : 0, joint.x, joint.y, std::cos(joint.angle),
                                std::sin(joint.angle)});
      const SpaceAxis& axis = model_.axes[static_cast<std::size_t>(joint.coordinate)];
      program.rates.joints.push_back({joint.parent, joint.coordinate, joint.slides,
                                      std::hypot(joint.x, joint.y),
                                      std::max(std::abs(axis.low), std::abs(axis.high))});
    }
  }

  /// A body and those obstacles that the filter lets through.
  template <class Filter>
  void add_body(std::size_t b, const Filter& wanted) {
    const PlanarMechanism& mechanism = *model_.mechanism;
    const LinkBody& body = mechanism.bodies[b];
    const double dx = body.to[0] - body.from[0];
    const double dy = body.to[1] - body.from[1];
    const double length = std::hypot(dx, dy);
    BodyStep<double> step{};
    step.joint = body.joint;
    step.x = body.from[0];
    step.y = body.from[1];
    step.ux = length > 0.0 ? dx / length : 1.0;
    step.uy = length > 0.0 ? dy / length : 0.0;
    step.length = length;
    step.shifted = step.x != 0.0 || step.y != 0.0 || step.ux != 1.0 || step.uy != 0.0 ? 1 : 0;
    step.first_run = static_cast<int>(program.runs.size());
    step.first_plane = static_cast<int>(program.planes.size());
    step.first_piece = static_cast<int>(program.pieces.size());
    std::map<double, std::vector<Point>> discs;
    for (std::size_t o = 0; o < mechanism.obstacles.size(); ++o) {
      const PlanarObstacle& obstacle = mechanism.obstacles[o];
      const bool spared = !body.name.empty() &&
                          std::find(obstacle.spares.begin(), obstacle.spares.end(), body.name) !=
                              obstacle.spares.end();
      if (spared || !wanted(o)) {
        continue;
      }
      switch (obstacle.shape) {
        case PlanarObstacle::Shape::disc:
          discs[obstacle.radius].push_back(obstacle.at);
          break;
        case PlanarObstacle::Shape::half_plane: {
          const double size = std::hypot(obstacle.normal[0], obstacle.normal[1]);
          const double nx = obstacle.normal[0] / size;
          const double ny = obstacle.normal[1] / size;
          program.planes.push_back(
              {nx, ny, nx * obstacle.at[0] + ny * obstacle.at[1] + body.radius});
          break;
        }
        case PlanarObstacle::Shape::polygon:
          for (const auto& piece : convex_pieces(tidy(obstacle.vertices))) {
            const int first = static_cast<int>(program.edges.size());
            add_edges(piece, program.edges);
            program.pieces.push_back({first, static_cast<int>(program.edges.size()), body.radius});
          }
          break;
        case PlanarObstacle::Shape::frame: {
          std::vector<EdgeStep<double>> edges;
          add_edges(tidy(obstacle.vertices), edges);
          for (const EdgeStep<double>& edge : edges) {
            program.planes.push_back({-edge.nx, -edge.ny, -edge.d + body.radius});
          }
          break;
        }
      }
    }
    for (const auto& [radius, places] : discs) {
      const int first = static_cast<int>(program.disc_x.size());
      for (const Point& at : places) {
        program.disc_x.push_back(at[0]);
        program.disc_y.push_back(at[1]);
      }
      program.runs.push_back(
          {first, static_cast<int>(program.disc_x.size()), radius + body.radius});
    }
    step.last_run = static_cast<int>(program.runs.size());
    step.last_plane = static_cast<int>(program.planes.size());
    step.last_piece = static_cast<int>(program.pieces.size());
    program.bodies.push_back(step);
    program.rates.bodies.push_back({body.joint, std::max(std::hypot(body.from[0], body.from[1]),
                                                         std::hypot(body.to[0], body.to[1]))});
  }

  /// Two of the bodies that were added must not touch.
  void add_pair(int a, int b) {
    const PlanarMechanism& mechanism = *model_.mechanism;
    const auto body_of = [&](int i) -> const LinkBody& {
      return mechanism.bodies[static_cast<std::size_t>(i)];
    };
    program.pairs.push_back({a, b, body_of(a).radius + body_of(b).radius});
    // Only what is between them moves one against the other.
    int common = std::min(body_of(a).joint, body_of(b).joint);
    while (common >= 0 && !(carries(mechanism, common, body_of(a).joint) &&
                            carries(mechanism, common, body_of(b).joint))) {
      common = mechanism.joints[static_cast<std::size_t>(common)].parent;
    }
    for (int k = 0; k < program.dimension; ++k) {
      double rate = 0.0;
      for (const int i : {a, b}) {
        const RateStep::Body& body = all_bodies_[static_cast<std::size_t>(i)];
        const auto [v, w] = motion(k, common, body.joint, false);
        rate += v + w * body.far;
      }
      program.rates.pairs.push_back(rate);
    }
  }

  void add_hold(const HoldingLimit& hold) {
    const PlanarMechanism& mechanism = *model_.mechanism;
    const int first = static_cast<int>(program.masses.size());
    const bool slides = mechanism.joints[static_cast<std::size_t>(hold.joint)].slides;
    std::vector<double> rates(static_cast<std::size_t>(program.dimension), 0.0);
    for (const LinkMass& mass : mechanism.masses) {
      if (!carries(mechanism, hold.joint, mass.joint)) {
        continue;
      }
      const double weight = mass.mass * mechanism.gravity;
      program.masses.push_back({mass.joint, mass.at[0], mass.at[1], weight});
      for (int k = 0; k < program.dimension; ++k) {
        double& rate = rates[static_cast<std::size_t>(k)];
        if (slides) {
          rate += weight * motion(k, -1, hold.joint, true)[1];
        } else {
          const auto [v, w] = motion(k, hold.joint, mass.joint, true);
          rate += weight * (v + w * std::hypot(mass.at[0], mass.at[1]));
        }
      }
    }
    program.holds.push_back(
        {hold.joint, slides ? 1 : 0, first, static_cast<int>(program.masses.size()), hold.most});
    program.rates.holds.insert(program.rates.holds.end(), rates.begin(), rates.end());
  }

  /// What a region demands. @param sign  Of its leaves: -1 below a complement.
  void add_region(const RegionNode& node, bool forbidden) {
    emit(node, forbidden ? -1 : 1);
    if (forbidden) {
      op(RegionCode::negate);
    }
    op(RegionCode::demand);
  }

  /// The rates of bodies for pairs, whatever bodies are in the program in this order.
  void know_bodies() {
    for (const LinkBody& body : model_.mechanism->bodies) {
      all_bodies_.push_back({body.joint, std::max(std::hypot(body.from[0], body.from[1]),
                                                  std::hypot(body.to[0], body.to[1]))});
    }
  }

  /// Takes the buffer off every margin of the mechanism.
  void take_buffer() {
    if (std::all_of(model_.buffer.begin(), model_.buffer.end(),
                    [](double e) { return e == 0.0; })) {
      return;
    }
    std::vector<double> inverse(program.rate_count());
    const InverseRates<double> rates = inverse_rates(program, model_.buffer.data(), inverse.data());
    const auto loss = [](double inverse_rate) {
      return inverse_rate < 1e29 ? 1.0 / inverse_rate : 0.0;
    };
    for (std::size_t b = 0; b < program.bodies.size(); ++b) {
      const BodyStep<double>& body = program.bodies[b];
      const double lost = loss(rates.body[b]);
      for (int i = body.first_run; i < body.last_run; ++i) {
        program.runs[static_cast<std::size_t>(i)].reach += lost;
      }
      for (int i = body.first_plane; i < body.last_plane; ++i) {
        program.planes[static_cast<std::size_t>(i)].d += lost;
      }
      for (int i = body.first_piece; i < body.last_piece; ++i) {
        program.pieces[static_cast<std::size_t>(i)].reach += lost;
      }
    }
    for (std::size_t i = 0; i < program.pairs.size(); ++i) {
      program.pairs[i].reach += loss(rates.pair[i]);
    }
    for (std::size_t i = 0; i < program.holds.size(); ++i) {
      program.holds[i].limit -= loss(rates.hold[i]);
    }
  }

  SpaceProgram<double> program{};
  std::vector<int> signs{};  ///< Of the leaves.

 private:
  static void add_edges(const std::vector<Point>& polygon, std::vector<EdgeStep<double>>& to) {
    const std::size_t n = polygon.size();
    for (std::size_t i = 0; i < n; ++i) {
      const Point& a = polygon[i];
      const Point& b = polygon[(i + 1) % n];
      const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
      const double tx = (b[0] - a[0]) / length;
      const double ty = (b[1] - a[1]) / length;
      to.push_back({a[0], a[1], tx, ty, length, ty, -tx, ty * a[0] - tx * a[1]});
    }
  }

  /// How fast the origin of a joint's frame moves, and turns, for a unit change of a coordinate,
  /// seen from another joint's frame. @param turned  Whether the turning of the first frame counts.
  [[nodiscard]] std::array<double, 2> motion(int k, int from, int to, bool turned) const {
    std::vector<int> chain;
    for (int j = to; j >= 0; j = program.rates.joints[static_cast<std::size_t>(j)].parent) {
      chain.push_back(j);
    }
    double v = 0.0;
    double w = 0.0;
    bool after = from < 0;
    for (std::size_t i = chain.size(); i-- > 0;) {
      const RateStep::Joint& joint = program.rates.joints[static_cast<std::size_t>(chain[i])];
      const double change = joint.coordinate == k ? 1.0 : 0.0;
      if (after) {
        v += w * joint.mount;
        v += joint.slides ? change + w * joint.extent : 0.0;
      }
      if ((after || turned) && !joint.slides) {
        w += change;
      }
      after = after || chain[i] == from;
    }
    return {v, w};
  }

  void op(RegionCode code) {
    RegionStep<double> step{};
    step.code = code;
    program.regions.push_back(step);
  }

  static std::size_t leaves_of(const RegionNode& node) {
    switch (node.kind) {
      case Kind::both:
      case Kind::either:
        return leaves_of(*node.a) + leaves_of(*node.b);
      case Kind::complement:
        return leaves_of(*node.a);
      default:
        return 1;
    }
  }

  void leaf(RegionStep<double> step, int sign) {
    step.leaf = static_cast<int>(program.rates.leaves.size());
    program.rates.leaves.push_back({step.code, step.coordinate, step.up, step.first, step.last});
    signs.push_back(sign);
    program.regions.push_back(step);
  }

  void emit(const RegionNode& node, int sign) {
    RegionStep<double> step{};
    step.coordinate = node.coordinate;
    switch (node.kind) {
      case Kind::everything:
        op(RegionCode::everything);
        return;
      case Kind::half_space:
        step.code = RegionCode::half_space;
        step.first = static_cast<int>(program.normals.size());
        program.normals.insert(program.normals.end(), node.normal.begin(), node.normal.end());
        program.rates.normals = program.normals;
        step.last = static_cast<int>(program.normals.size());
        step.a = node.offset;
        leaf(step, sign);
        return;
      case Kind::interval: {
        const bool wraps = model_.axes[static_cast<std::size_t>(node.coordinate)].wraps;
        if (wraps && node.high - node.low >= 2.0 * std::numbers::pi * (1.0 - 1e-12)) {
          op(RegionCode::everything);
          return;
        }
        step.code = wraps ? RegionCode::turn : RegionCode::interval;
        step.a = wraps ? 0.5 * (node.low + node.high) : node.low;
        step.b = wraps ? 0.5 * (node.high - node.low) : node.high;
        leaf(step, sign);
        return;
      }
      case Kind::polygon: {
        step.code = RegionCode::polygon;
        step.up = node.up;
        const std::vector<Point> vertices = tidy(node.vertices);
        double low[2] = {vertices[0][0], vertices[0][1]};
        double high[2] = {low[0], low[1]};
        for (const Point& v : vertices) {
          for (std::size_t i = 0; i < 2; ++i) {
            low[i] = std::min(low[i], v[i]);
            high[i] = std::max(high[i], v[i]);
          }
        }
        step.first = static_cast<int>(program.sides.size());
        add_edges(vertices, program.sides);
        step.last = static_cast<int>(program.sides.size());
        for (std::size_t i = 0; i < vertices.size(); ++i) {
          // Of a side the kernel asks where it ends, not its offset.
          program.sides[static_cast<std::size_t>(step.first) + i].d =
              vertices[(i + 1) % vertices.size()][1];
        }
        step.a = 0.5 * (low[0] + high[0]);
        step.b = 0.5 * (low[1] + high[1]);
        const bool x = model_.axes[static_cast<std::size_t>(node.coordinate)].wraps;
        const bool y = model_.axes[static_cast<std::size_t>(node.up)].wraps;
        step.wraps = (x ? 1 : 0) + (y ? 2 : 0);
        bool first = true;
        for (int i = x ? -1 : 0; i <= (x ? 1 : 0); ++i) {
          for (int j = y ? -1 : 0; j <= (y ? 1 : 0); ++j) {
            step.shift_x = 2.0 * std::numbers::pi * i;
            step.shift_y = 2.0 * std::numbers::pi * j;
            leaf(step, sign);
            if (!first) {
              op(RegionCode::most);
            }
            first = false;
          }
        }
        return;
      }
      case Kind::both:
      case Kind::either: {
        // The larger part first keeps the stack as low as the logarithm of their number.
        const bool swap = leaves_of(*node.b) > leaves_of(*node.a);
        emit(swap ? *node.b : *node.a, sign);
        emit(swap ? *node.a : *node.b, sign);
        op(node.kind == Kind::both ? RegionCode::least : RegionCode::most);
        return;
      }
      case Kind::complement:
        emit(*node.a, -sign);
        op(RegionCode::negate);
        return;
    }
  }

  const SpaceModel& model_;
  std::vector<RateStep::Body> all_bodies_{};
};

std::vector<double> unit_rates_of(const SpaceModel& model, const SpaceProgram<double>& program) {
  std::vector<double> scales;
  for (const SpaceAxis& axis : model.axes) {
    scales.push_back(axis.scale);
  }
  std::vector<double> rates(program.rate_count());
  inverse_rates(program, scales.data(), rates.data());
  return rates;
}

void add_constraint(SpaceModel& model, std::string name, std::string unit, Builder& builder) {
  SpaceConstraint constraint{std::move(name), std::move(unit), {}, {}, {}, false};
  builder.take_buffer();
  constraint.program = std::move(builder.program);
  constraint.unit_rates = unit_rates_of(model, constraint.program);
  model.constraints.push_back(std::move(constraint));
}

void add_contacts(SpaceModel& model) {
  const PlanarMechanism& mechanism = *model.mechanism;
  const auto part = [&] {
    Builder builder(model);
    builder.add_joints();
    return builder;
  };
  for (std::size_t b = 0; b < mechanism.bodies.size(); ++b) {
    for (std::size_t o = 0; o < mechanism.obstacles.size(); ++o) {
      Builder builder = part();
      builder.add_body(b, [&](std::size_t other) { return other == o; });
      const BodyStep<double>& body = builder.program.bodies[0];
      if (body.last_run == 0 && body.last_plane == 0 && body.last_piece == 0) {
        continue;
      }
      const bool leaves = mechanism.obstacles[o].shape == PlanarObstacle::Shape::frame;
      add_constraint(
          model,
          body_name(mechanism, b) + (leaves ? " leaves " : " meets ") + obstacle_name(mechanism, o),
          "m", builder);
    }
  }
  const auto index_of = [&](const std::string& name) {
    const auto found = std::find_if(mechanism.bodies.begin(), mechanism.bodies.end(),
                                    [&](const LinkBody& body) { return body.name == name; });
    return static_cast<int>(found - mechanism.bodies.begin());
  };
  const auto nothing = [](std::size_t) { return false; };
  Builder all(model);
  all.add_joints();
  all.know_bodies();
  for (std::size_t b = 0; b < mechanism.bodies.size(); ++b) {
    all.add_body(b, [](std::size_t) { return true; });
  }
  for (const auto& names : mechanism.apart) {
    const int a = index_of(names[0]);
    const int b = index_of(names[1]);
    all.add_pair(a, b);
    Builder builder = part();
    builder.know_bodies();
    for (std::size_t i = 0; i < mechanism.bodies.size(); ++i) {
      builder.add_body(i, nothing);
    }
    builder.add_pair(a, b);
    add_constraint(model, names[0] + " meets " + names[1], "m", builder);
  }
  for (const HoldingLimit& hold : mechanism.holding) {
    all.add_hold(hold);
    Builder builder = part();
    builder.add_hold(hold);
    const bool slides = mechanism.joints[static_cast<std::size_t>(hold.joint)].slides;
    add_constraint(model, "what " + joint_name(mechanism, hold.joint) + " has to hold",
                   slides ? "N" : "N·m", builder);
  }
  all.take_buffer();
  model.contacts = std::move(all.program);
}

}  // namespace

void complete(SpaceModel& model) {
  model.constraints.clear();
  model.contacts = {};
  model.contacts.dimension = model.dimension();
  if (model.mechanism) {
    add_contacts(model);
  }
  Builder all(model);
  all.program = model.contacts;
  model.has_regions = !model.regions.empty();
  for (const ConfigurationSpace::NamedRegion& named : model.regions) {
    // A constraint keeps what the buffer leaves of it.
    const std::shared_ptr<const RegionNode> node(std::shared_ptr<const RegionNode>(),
                                                 &named.region.node());
    std::shared_ptr<const RegionNode> kept =
        offset_region(beyond_stops(model, node), model.buffer, named.forbidden);
    Builder builder(model);
    builder.add_region(*kept, named.forbidden);
    SpaceConstraint constraint{named.name, "",   std::move(builder.program),
                               {},         kept, named.forbidden};
    constraint.unit_rates = unit_rates_of(model, constraint.program);
    model.constraints.push_back(std::move(constraint));
    all.add_region(*kept, named.forbidden);
  }
  model.exact = std::move(all.program);
  model.unit_rates = unit_rates_of(model, model.exact);
  model.quick = in_floats(model, model.exact, all.signs);
}

}  // namespace flyball::detail
