// Pictures of a path: the space, the way, the motion, the mechanism.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "study/answer/drawing.hpp"
#include "study/answer/plan_parts.hpp"

namespace flyball::study {

namespace {

constexpr std::size_t most_points = 600;

std::string label_of(const SpaceAxis& axis) {
  return axis.unit.empty() ? axis.name : axis.name + " (" + axis.unit + ")";
}

/// What one axis must not be, as stretches, while the others stay.
std::vector<std::pair<double, double>> forbidden(const ConfigurationSpace& space,
                                                 std::vector<double> q, std::size_t k, double low,
                                                 double high) {
  constexpr int cells = 160;
  std::vector<std::pair<double, double>> all;
  const double size = (high - low) / cells;
  bool open = false;
  for (int i = 0; i < cells; ++i) {
    q[k] = low + (i + 0.5) * size;
    const bool bad = !space.valid(q);
    if (bad && !open) {
      all.emplace_back(low + i * size, low + (i + 1) * size);
    } else if (bad) {
      all.back().second = low + (i + 1) * size;
    }
    open = bad;
  }
  return all;
}

/// Stretches over steps of x, as bands: the i-th stretch of each step in the i-th band.
class Bands {
 public:
  void add(double from, double to, const std::vector<std::pair<double, double>>& stretches) {
    while (bands_.size() < stretches.size()) {
      PlotBand band{.label = bands_.empty() ? "forbidden" : "", .color = unused_color};
      band.x = x_;
      band.low.assign(x_.size(), none_);
      band.high.assign(x_.size(), none_);
      bands_.push_back(std::move(band));
    }
    for (const double x : {from, to}) {
      x_.push_back(x);
      for (std::size_t i = 0; i < bands_.size(); ++i) {
        bands_[i].x.push_back(x);
        bands_[i].low.push_back(i < stretches.size() ? stretches[i].first : none_);
        bands_[i].high.push_back(i < stretches.size() ? stretches[i].second : none_);
      }
    }
  }
  explicit Bands(double none) : none_(none) {}
  [[nodiscard]] std::vector<PlotBand> take() { return std::move(bands_); }

 private:
  double none_;
  std::vector<double> x_{};
  std::vector<PlotBand> bands_{};
};

/// Places of an axis on the way of a motion, or of the waypoints.
std::vector<std::vector<double>> way_of(const PlanResult& result) {
  const TimeSeries& table = result.motion.table;
  std::vector<std::vector<double>> way;
  if (table.rows() == 0) {
    return result.path.waypoints;
  }
  const std::size_t stride = (table.rows() + most_points - 1) / most_points;
  for (std::size_t i = 0; i < table.rows(); i += stride) {
    std::vector<double> q;
    for (std::size_t k = 0; k < result.job.space.axes().size(); ++k) {
      q.push_back(table.columns()[3 * k].values[i]);
    }
    way.push_back(std::move(q));
  }
  return way;
}

/// Figure 16.4 of any space of two axes.
Figure space_figure(const PlanResult& result) {
  const ConfigurationSpace& space = result.job.space;
  const std::vector<SpaceAxis>& axes = space.axes();
  Figure figure{"path",
                "space",
                "The configuration space",
                "Shaded: configurations that break a constraint. The path is a straight line from "
                "waypoint to waypoint; where the motion leaves it, the motion is drawn, too.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = label_of(axes[0]);
  PlotPanel panel{.y_label = label_of(axes[1])};
  // Angles that wrap go on as far as the path does.
  std::array<double, 2> low{axes[0].low, axes[1].low};
  std::array<double, 2> high{axes[0].high, axes[1].high};
  std::array<std::vector<double>, 2> path{};
  for (const auto& waypoint : result.path.waypoints) {
    for (std::size_t k = 0; k < 2; ++k) {
      path[k].push_back(waypoint[k]);
      low[k] = std::min(low[k], waypoint[k]);
      high[k] = std::max(high[k], waypoint[k]);
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const double margin = axes[k].wraps ? 0.0 : 0.06 * (high[k] - low[k]);
    low[k] -= margin;
    high[k] += margin;
  }
  Bands bands(low[1]);
  constexpr int columns = 240;
  const double size = (high[0] - low[0]) / columns;
  for (int i = 0; i < columns; ++i) {
    const double x = low[0] + (i + 0.5) * size;
    bands.add(x - 0.5 * size, x + 0.5 * size, forbidden(space, {x, 0.0}, 1, low[1], high[1]));
  }
  panel.bands = bands.take();
  if (result.job.motion.traversal == Traversal::sequential && result.motion.table.rows() > 0) {
    std::array<std::vector<double>, 2> way{};
    for (const auto& q : way_of(result)) {
      way[0].push_back(q[0]);
      way[1].push_back(q[1]);
    }
    panel.lines.push_back({.label = "motion", .x = way[0], .y = way[1], .color = simulated_color});
  }
  panel.lines.push_back({.label = "path",
                         .x = path[0],
                         .y = path[1],
                         .style = LineStyle::samples,
                         .color = measured_color});
  panel.notes.push_back({path[0].front(), path[1].front(), "start"});
  panel.notes.push_back({path[0].back(), path[1].back(), "goal"});
  panel.y_limits = PlotLimits{low[1], high[1]};
  figure.plot.panels.push_back(std::move(panel));
  figure.plot.height = 620;
  return figure;
}

/// What each axis does on the way, and what it could not do there.
Figure way_figure(const PlanResult& result) {
  const ConfigurationSpace& space = result.job.space;
  const TimeSeries& table = result.motion.table;
  const bool timed = table.rows() > 0;
  Figure figure{timed ? "motion" : "path",
                "way",
                "Each axis on the way",
                "Shaded: where an axis would break a constraint if it alone were there at that "
                "moment.",
                {}};
  figure.plot.title = figure.title;
  figure.plot.x_label = timed ? "Time (s)" : "Along the path";
  figure.plot.clock = timed ? "time" : "";
  const std::vector<std::vector<double>> way = way_of(result);
  std::vector<double> x;
  if (timed) {
    const std::size_t stride = (table.rows() + most_points - 1) / most_points;
    for (std::size_t i = 0; i < table.rows(); i += stride) {
      x.push_back(table.time()[i]);
    }
  } else {
    x.push_back(0.0);
    for (std::size_t i = 1; i < way.size(); ++i) {
      x.push_back(x.back() + space.length(space.difference(way[i - 1], way[i])));
    }
  }
  for (std::size_t k = 0; k < space.axes().size(); ++k) {
    const SpaceAxis& axis = space.axes()[k];
    PlotPanel panel{.y_label = label_of(axis)};
    double low = axis.low;
    double high = axis.high;
    std::vector<double> y;
    for (const auto& q : way) {
      y.push_back(q[k]);
      low = std::min(low, q[k]);
      high = std::max(high, q[k]);
    }
    Bands bands(low);
    const std::size_t stride = (way.size() + 149) / 150;
    for (std::size_t i = 0; i < way.size(); i += stride) {
      const double from = i == 0 ? x[0] : 0.5 * (x[i] + x[i - stride]);
      const double to = i + stride < way.size() ? 0.5 * (x[i] + x[i + stride]) : x.back();
      bands.add(from, to, forbidden(space, way[i], k, low, high));
    }
    panel.bands = bands.take();
    panel.lines.push_back(
        {.label = axis.name, .x = x, .y = std::move(y), .color = static_cast<int>(k % 6)});
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

Figure velocity_figure(const PlanResult& result) {
  Figure figure =
      over_time("motion", "velocities", "Velocities", "Of each axis, with its limits dashed.");
  figure.plot.clock = "time";
  const TimeSeries& table = result.motion.table;
  for (std::size_t k = 0; k < result.job.space.axes().size(); ++k) {
    const TimeSeries::Column& column = table.columns()[3 * k + 1];
    PlotPanel panel{.y_label = column.name + " (" + column.unit + ")"};
    panel.lines.push_back({.label = column.name,
                           .x = table.time(),
                           .y = column.values,
                           .color = static_cast<int>(k % 6)});
    const MotionLimits all = result.job.motion.limits[k].both_ways();
    panel.marks = {{.at = all.velocity}, {.at = -all.reverse_velocity}};
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

void add_disc(MovingPart& part, double x, double y, double radius) {
  constexpr int corners = 32;
  for (int i = 0; i <= corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    part.x.push_back(x + radius * std::cos(angle));
    part.y.push_back(y + radius * std::sin(angle));
  }
}

/// The outline of a capsule, at least as wide as can be seen.
MovingPart capsule(const LinkBody& body, double least) {
  MovingPart part;
  const double dx = body.to[0] - body.from[0];
  const double dy = body.to[1] - body.from[1];
  const double turned = std::atan2(dy, dx);
  const double radius = std::max(body.radius, least);
  constexpr int corners = 12;
  for (int side = 0; side < 2; ++side) {
    const auto& at = side == 0 ? body.to : body.from;
    for (int i = 0; i <= corners; ++i) {
      const double angle = turned + std::numbers::pi * (static_cast<double>(i) / corners - 0.5 +
                                                        static_cast<double>(side));
      part.x.push_back(at[0] + radius * std::cos(angle));
      part.y.push_back(at[1] + radius * std::sin(angle));
    }
  }
  return part;
}

MovingPart obstacle_part(const PlanarObstacle& obstacle, double extent) {
  MovingPart part;
  part.style = PartStyle::ground;
  switch (obstacle.shape) {
    case PlanarObstacle::Shape::disc:
      add_disc(part, obstacle.at[0], obstacle.at[1], obstacle.radius);
      break;
    case PlanarObstacle::Shape::half_plane: {
      const double size = std::hypot(obstacle.normal[0], obstacle.normal[1]);
      const double tx = obstacle.normal[1] / size * extent;
      const double ty = -obstacle.normal[0] / size * extent;
      part.x = {obstacle.at[0] - tx, obstacle.at[0] + tx};
      part.y = {obstacle.at[1] - ty, obstacle.at[1] + ty};
      break;
    }
    case PlanarObstacle::Shape::polygon:
    case PlanarObstacle::Shape::frame:
      for (std::size_t i = 0; i <= obstacle.vertices.size(); ++i) {
        const auto& v = obstacle.vertices[i % obstacle.vertices.size()];
        part.x.push_back(v[0]);
        part.y.push_back(v[1]);
      }
      break;
  }
  return part;
}

}  // namespace

std::vector<Figure> plan_figures(const PlanResult& result) {
  std::vector<Figure> all;
  if (result.job.space.dimension() == 2) {
    all.push_back(space_figure(result));
  }
  all.push_back(way_figure(result));
  if (result.motion.table.rows() > 0) {
    all.push_back(velocity_figure(result));
  }
  return all;
}

std::vector<Animation> plan_animation(const PlanResult& result) {
  const PlanarMechanism* mechanism = result.job.space.mechanism();
  const TimeSeries& table = result.motion.table;
  if (mechanism == nullptr || table.rows() < 2) {
    return {};
  }
  Animation animation{.section = "motion",
                      .name = "mechanism",
                      .title = "The mechanism",
                      .description =
                          "The links as they move among what they must not touch, at "
                          "the moment that the cursor of the plots below is at.",
                      .clock = "time"};
  double extent = 0.1;
  for (const LinkBody& body : mechanism->bodies) {
    extent += std::hypot(body.to[0], body.to[1]);
  }
  for (const PlanarObstacle& obstacle : mechanism->obstacles) {
    animation.parts.push_back(obstacle_part(obstacle, extent));
  }
  const std::vector<std::vector<double>> way = way_of(result);
  const std::size_t stride = (table.rows() + most_points - 1) / most_points;
  for (std::size_t i = 0; i < table.rows(); i += stride) {
    animation.time.push_back(table.time()[i]);
  }
  const double least = 0.01 * extent;
  const std::size_t first = animation.parts.size();
  for (std::size_t b = 0; b < mechanism->bodies.size(); ++b) {
    MovingPart part = capsule(mechanism->bodies[b], least);
    part.label = mechanism->bodies[b].name;
    part.color = static_cast<int>(b % 6);
    animation.parts.push_back(std::move(part));
  }
  for (const auto& q : way) {
    const std::vector<PlanarFrame> frames = joint_frames(*mechanism, q);
    for (std::size_t b = 0; b < mechanism->bodies.size(); ++b) {
      const PlanarFrame& at = frames[static_cast<std::size_t>(mechanism->bodies[b].joint)];
      MovingPart& part = animation.parts[first + b];
      part.to_x.push_back(at.x);
      part.to_y.push_back(at.y);
      part.angle.push_back(at.angle);
    }
  }
  for (std::size_t k = 0; k < result.job.space.axes().size(); ++k) {
    TellingValue value{result.job.space.axes()[k].name, result.job.space.axes()[k].unit, {}};
    for (const auto& q : way) {
      value.values.push_back(q[k]);
    }
    animation.values.push_back(std::move(value));
  }
  return {std::move(animation)};
}

}  // namespace flyball::study
