#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <utility>

#include <flyball/planning/configuration/grid_path.hpp>

#include "planning/configuration/corner_path.hpp"
#include "planning/configuration/polygons.hpp"

namespace flyball::detail {

namespace {

using Kind = RegionNode::Kind;

/// A line, or a part of one, that bounds something.
struct Side {
  Point a, b;
  bool ends;  ///< Whether it ends at its points.
};

void add_sides(const SpaceModel& model, const RegionNode& node, std::vector<Side>& sides) {
  switch (node.kind) {
    case Kind::everything:
      return;
    case Kind::half_space: {
      const double nx = node.normal[0];
      const double ny = node.normal[1];
      const double s = node.offset / (nx * nx + ny * ny);
      sides.push_back({{nx * s, ny * s}, {nx * s - ny, ny * s + nx}, false});
      return;
    }
    case Kind::interval:
      for (const double at : {node.low, node.high}) {
        if (std::isfinite(at)) {
          sides.push_back(node.coordinate == 0 ? Side{{at, 0.0}, {at, 1.0}, false}
                                               : Side{{0.0, at}, {1.0, at}, false});
        }
      }
      return;
    case Kind::polygon:
      for (std::size_t i = 0; i < node.vertices.size(); ++i) {
        Point a = node.vertices[i];
        Point b = node.vertices[(i + 1) % node.vertices.size()];
        if (node.coordinate != 0) {
          std::swap(a[0], a[1]);
          std::swap(b[0], b[1]);
        }
        sides.push_back({a, b, true});
      }
      return;
    case Kind::both:
    case Kind::either:
      add_sides(model, *node.a, sides);
      add_sides(model, *node.b, sides);
      return;
    case Kind::complement:
      add_sides(model, *node.a, sides);
      return;
  }
}

/// Where two sides cross.
std::optional<Point> crossing(const Side& s, const Side& t) {
  const Point u{s.b[0] - s.a[0], s.b[1] - s.a[1]};
  const Point v{t.b[0] - t.a[0], t.b[1] - t.a[1]};
  const double turn = u[0] * v[1] - u[1] * v[0];
  if (std::abs(turn) < 1e-12 * std::hypot(u[0], u[1]) * std::hypot(v[0], v[1])) {
    return std::nullopt;
  }
  const Point d{t.a[0] - s.a[0], t.a[1] - s.a[1]};
  const double along_s = (d[0] * v[1] - d[1] * v[0]) / turn;
  const double along_t = (d[0] * u[1] - d[1] * u[0]) / turn;
  if ((s.ends && (along_s < -1e-12 || along_s > 1.0 + 1e-12)) ||
      (t.ends && (along_t < -1e-12 || along_t > 1.0 + 1e-12))) {
    return std::nullopt;
  }
  // Along an axis the number as it was given.
  Point p{s.a[0] + along_s * u[0], s.a[1] + along_s * u[1]};
  for (std::size_t k = 0; k < 2; ++k) {
    p[k] = u[k] == 0.0 ? s.a[k] : (v[k] == 0.0 ? t.a[k] : p[k]);
  }
  return p;
}

/// Free, and not between two regions that touch: one of its sides must be free, too.
bool passes(const ConfigurationSpace& space, const Point& from, const std::vector<double>& by) {
  if (!space.check_move(from, by).free) {
    return false;
  }
  const double length = std::hypot(by[0], by[1]);
  if (!(length > 1e-9)) {
    return true;
  }
  const double off = 1e-7 * std::min(1.0, length);
  const Point middle{from[0] + 1e-4 * by[0], from[1] + 1e-4 * by[1]};
  const std::array<double, 2> inner{by[0] * (1.0 - 2e-4), by[1] * (1.0 - 2e-4)};
  for (const double side : {off, -off}) {
    const Point shifted{middle[0] - side * by[1] / length, middle[1] + side * by[0] / length};
    if (space.check_move(shifted, inner).free) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::optional<ConfigurationPath> corner_path(const ConfigurationSpace& space, const double* start,
                                             const double* goal, WorkBound& bound, bool& complete) {
  complete = false;
  const SpaceModel& model = space.model();
  std::vector<Side> sides;
  for (const SpaceConstraint& constraint : model.constraints) {
    if (constraint.region) {
      add_sides(model, *constraint.region, sides);
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (!model.axes[k].wraps) {
      for (const double at : {model.axes[k].low, model.axes[k].high}) {
        sides.push_back(k == 0 ? Side{{at, 0.0}, {at, 1.0}, false}
                               : Side{{0.0, at}, {1.0, at}, false});
      }
    }
  }
  constexpr std::size_t most_sides = 400;
  constexpr std::size_t most_corners = 600;
  if (sides.size() > most_sides) {
    return std::nullopt;
  }
  std::vector<Point> corners{{start[0], start[1]}, {goal[0], goal[1]}};
  const auto add = [&](const Point& p) {
    if (space.valid(p) && std::find(corners.begin(), corners.end(), p) == corners.end()) {
      corners.push_back(p);
    }
  };
  for (std::size_t i = 0; i < sides.size() && corners.size() <= most_corners; ++i) {
    if (sides[i].ends) {
      add(sides[i].a);
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (const auto p = crossing(sides[i], sides[j])) {
        add(*p);
      }
    }
  }
  if (corners.size() > most_corners) {
    return std::nullopt;
  }
  // Dijkstra; what passes is asked for when a corner is reached.
  constexpr double far = std::numeric_limits<double>::infinity();
  std::vector<double> cost(corners.size(), far);
  std::vector<std::size_t> from(corners.size(), 0);
  std::vector<bool> done(corners.size(), false);
  cost[0] = 0.0;
  while (true) {
    std::size_t at = corners.size();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!done[i] && cost[i] < far && (at == corners.size() || cost[i] < cost[at])) {
        at = i;
      }
    }
    if (at == corners.size()) {
      // On a circle a side may meet another in another turn.
      complete = !model.axes[0].wraps && !model.axes[1].wraps;
      return std::nullopt;
    }
    if (!bound.spend()) {
      return std::nullopt;
    }
    if (at == 1) {
      break;
    }
    done[at] = true;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (done[i]) {
        continue;
      }
      const std::vector<double> by = space.difference(corners[at], corners[i]);
      const double length = cost[at] + space.length(by);
      if (length < cost[i] - 1e-12 && passes(space, corners[at], by)) {
        cost[i] = length;
        from[i] = at;
      }
    }
  }
  ConfigurationPath path;
  for (std::size_t i = 1; i != 0; i = from[i]) {
    path.push_back({corners[i][0], corners[i][1]});
  }
  path.push_back({corners[0][0], corners[0][1]});
  std::reverse(path.begin(), path.end());
  return path;
}

std::optional<ConfigurationPath> space_grid_path(Judge& judge, const double* start,
                                                 const double* goal, int cells, double clearance,
                                                 WorkBound& bound) {
  const SpaceModel& model = judge.model();
  OccupancyGrid grid{cells, cells, {}};
  grid.blocked.assign(static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells), 0);
  std::array<double, most_axes> half{};
  std::array<double, 2> low{};
  std::array<double, 2> size{};
  for (std::size_t k = 0; k < 2; ++k) {
    const SpaceAxis& axis = model.axes[k];
    low[k] = axis.low;
    size[k] = (axis.high - axis.low) / cells;
    half[k] = 0.5 * size[k] + clearance * axis.scale;
  }
  judge.set_box(half.data());
  std::array<float, most_axes * lanes> q{};
  std::array<float, lanes> reach{};
  for (int r = 0; r < cells; ++r) {
    if (!bound.spend()) {
      return std::nullopt;
    }
    for (std::size_t l = 0; l < lanes; ++l) {
      q[lanes + l] = static_cast<float>(low[1] + (r + 0.5) * size[1]);
    }
    for (int c = 0; c < cells; c += lanes) {
      for (int l = 0; l < lanes; ++l) {
        q[static_cast<std::size_t>(l)] = static_cast<float>(low[0] + (c + l + 0.5) * size[0]);
      }
      judge.reaches_of_set(q.data(), reach.data());
      for (int l = 0; l < lanes && c + l < cells; ++l) {
        grid.blocked[static_cast<std::size_t>(r * cells + c + l)] =
            reach[static_cast<std::size_t>(l)] >= 1.0F ? 0 : 1;
      }
    }
  }
  const auto middle = [&](std::array<int, 2> cell) {
    return std::vector<double>{low[0] + (cell[0] + 0.5) * size[0],
                               low[1] + (cell[1] + 0.5) * size[1]};
  };
  const auto free = [&](const std::vector<double>& a, const std::vector<double>& b) {
    Configuration from{};
    Configuration by{};
    for (std::size_t k = 0; k < 2; ++k) {
      from[k] = static_cast<float>(a[k]);
      by[k] = static_cast<float>(b[k] - a[k]);
    }
    return judge.free(from, by);
  };
  // The nearest free cell that a move leads to.
  const auto cell_of = [&](const double* end) -> std::optional<std::array<int, 2>> {
    std::array<int, 2> at{};
    for (std::size_t k = 0; k < 2; ++k) {
      at[k] = std::clamp(static_cast<int>((end[k] - low[k]) / size[k]), 0, cells - 1);
    }
    const std::vector<double> place(end, end + 2);
    for (int ring = 0; ring < cells / 4; ++ring) {
      for (int dr = -ring; dr <= ring; ++dr) {
        for (int dc = -ring; dc <= ring; dc += std::abs(dr) == ring ? 1 : 2 * ring) {
          const std::array<int, 2> cell{at[0] + dc, at[1] + dr};
          if (cell[0] >= 0 && cell[1] >= 0 && cell[0] < cells && cell[1] < cells &&
              grid.blocked[static_cast<std::size_t>(cell[1] * cells + cell[0])] == 0 &&
              free(place, middle(cell))) {
            return cell;
          }
        }
      }
    }
    return std::nullopt;
  };
  const auto from = cell_of(start);
  const auto to = cell_of(goal);
  if (!from || !to) {
    return std::nullopt;
  }
  const auto found = grid_path(grid, *from, *to);
  if (!found || !*found) {
    return std::nullopt;
  }
  ConfigurationPath path{{start[0], start[1]}};
  for (const auto& cell : (*found)->cells) {
    path.push_back(middle(cell));
  }
  path.push_back({goal[0], goal[1]});
  return path;
}

std::vector<Roadmap::Link> Roadmap::links_from(const Judge& judge, const Configuration& q) const {
  constexpr std::size_t neighbours = 12;
  std::vector<Link> all;
  for (const auto& [place, length] : nearest_places(judge, nodes_, q, neighbours)) {
    all.push_back({place, length, 0});
  }
  return all;
}

void Roadmap::grow(Judge& judge, Random& random, int nodes, WorkBound& bound) {
  Configuration q{};
  const Configuration still{};
  while (size() < nodes && bound.spend()) {
    judge.sample(random, q.data());
    if (!judge.free(q, still)) {
      continue;
    }
    std::vector<Link> links = links_from(judge, q);
    for (const Link& link : links) {
      links_[static_cast<std::size_t>(link.to)].push_back({size(), link.length, 0});
    }
    nodes_.push_back(q);
    links_.push_back(std::move(links));
  }
}

std::optional<ConfigurationPath> Roadmap::way(Judge& judge, const double* start, const double* goal,
                                              WorkBound& bound) {
  const int n = judge.dimension();
  std::array<Configuration, 2> ends{};
  for (int k = 0; k < n; ++k) {
    ends[0][static_cast<std::size_t>(k)] = static_cast<float>(start[k]);
    ends[1][static_cast<std::size_t>(k)] = static_cast<float>(goal[k]);
  }
  const int source = size();
  const int target = source + 1;
  std::vector<Link> first = links_from(judge, ends[0]);
  std::vector<Link> last = links_from(judge, ends[1]);
  const auto place = [&](int i) -> const Configuration& {
    return i < source ? nodes_[static_cast<std::size_t>(i)]
                      : ends[static_cast<std::size_t>(i - source)];
  };
  Configuration by{};
  const auto judged = [&](int a, Link& link) {
    if (link.state == 0) {
      judge.difference(place(a).data(), place(link.to).data(), by.data());
      link.state = judge.free(place(a), by) ? 1 : 2;
    }
    return link.state == 1;
  };
  constexpr float far = std::numeric_limits<float>::infinity();
  std::vector<float> cost(static_cast<std::size_t>(size()) + 2, far);
  std::vector<int> from(cost.size(), -1);
  std::vector<bool> done(cost.size(), false);
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  cost[static_cast<std::size_t>(source)] = 0.0F;
  queue.emplace(0.0F, source);
  while (!queue.empty()) {
    const int at = queue.top().second;
    queue.pop();
    if (done[static_cast<std::size_t>(at)]) {
      continue;
    }
    if (!bound.spend()) {
      return std::nullopt;
    }
    done[static_cast<std::size_t>(at)] = true;
    if (at == target) {
      break;
    }
    const auto relax = [&](Link& link) {
      const float length = cost[static_cast<std::size_t>(at)] + link.length;
      const auto to = static_cast<std::size_t>(link.to);
      if (!done[to] && length < cost[to] && judged(at, link)) {
        cost[to] = length;
        from[to] = at;
        judge.difference(place(link.to).data(), ends[1].data(), by.data());
        queue.emplace(length + judge.length(by.data()), link.to);
      }
    };
    std::vector<Link>& links = at == source ? first : links_[static_cast<std::size_t>(at)];
    for (Link& link : links) {
      relax(link);
    }
    for (const Link& link : last) {
      if (link.to == at) {
        Link end{target, link.length, 0};
        relax(end);
      }
    }
  }
  if (!done[static_cast<std::size_t>(target)]) {
    return std::nullopt;
  }
  ConfigurationPath path;
  for (int i = target; i >= 0; i = from[static_cast<std::size_t>(i)]) {
    const Configuration& q = place(i);
    path.emplace_back(q.begin(), q.begin() + n);
  }
  std::reverse(path.begin(), path.end());
  path.front().assign(start, start + n);
  path.back().assign(goal, goal + n);
  return path;
}

}  // namespace flyball::detail
