// Where a robot was, beside what its odometry says.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <flyball/io/json_writer.hpp>
#include <flyball/study/localize.hpp>

#include "core/wording.hpp"
#include "study/answer/localize_animation.hpp"
#include "study/answer/parts.hpp"
#include "study/answer/pose_log.hpp"

namespace flyball::study {

namespace {

using text::number;
using text::percent;

constexpr const char* localize_schema = "flyball.localize/1";
constexpr const char* localize_clock = "drive";  ///< Of its pictures over time.

/// The paths that there are, the best last.
struct NamedPath {
  const char* name;
  const LocalizedPath* path;
  const std::optional<PathError>* error;
};
std::vector<NamedPath> paths_of(const LocalizeResult& result) {
  std::vector<NamedPath> paths{{"odometry", &result.odometry, &result.odometry_error},
                               {"filter", &result.filter.path, &result.filter_error}};
  if (result.smoother) {
    paths.push_back({"smoother", &result.smoother->path, &result.smoother_error});
  }
  return paths;
}

const SensorCalibration& calibration_of(const LocalizeResult& result) {
  return result.smoother ? result.smoother->calibration : result.filter.calibration;
}

std::size_t used_by_filter(const LocalizeResult& result) {
  std::size_t used = 0;
  for (const double weight : result.filter.weight) {
    used += weight > 0.0 ? 1 : 0;
  }
  return used;
}

/// The largest standard deviation of the position along the path.
double spread(const Eigen::Matrix3d& P) {
  return std::sqrt(P(0, 0) + P(1, 1));
}

std::string to_json(const LocalizeResult& result) {
  JsonWriter json;
  json.object([&] {
    json.add("schema", localize_schema);
    json.list("files", result.files, [&](const std::string& file) { json.write(file); });
    json.add("filter", name_of(result.method));
    json.object("sightings", [&] {
      json.add("used_by_filter", used_by_filter(result));
      json.add("of_landmarks", result.log.sightings.size());
      json.add("of_other_marks", result.other_sightings);
    });
    json.add("relocalizations", result.filter.relocalizations);
    json.object("calibration", [&] {
      const auto values = calibration_of(result).vector();
      for (int i = 0; i < SensorCalibration::size; ++i) {
        std::string key(SensorCalibration::name(i).name);
        std::replace(key.begin(), key.end(), ' ', '_');
        json.object(key, [&] {
          json.add({{"value", values(i)}});
          if (result.smoother) {
            json.add({{"std", result.smoother->calibration_std.vector()(i)}});
          }
          json.add("unit", SensorCalibration::name(i).unit);
        });
      }
    });
    if (result.track_width) {
      json.object("track_width", [&] {
        json.add({{"value", result.track_width->value}, {"std", result.track_width->std}});
        json.add("unit", "m");
      });
    }
    json.list("paths", paths_of(result), [&](const NamedPath& named) {
      json.object([&] {
        json.add("name", named.name);
        json.add("points", named.path->time.size());
        if (!named.path->pose.empty()) {
          const Pose2d& end = named.path->pose.back();
          json.add("end", {{"x", end.x()}, {"y", end.y()}, {"heading", end.angle()}});
        }
        if (*named.error) {
          const PathError& error = **named.error;
          json.object("error", [&] {
            json.add("points", error.points);
            json.add({{"rms", error.rms},
                      {"median", error.median},
                      {"worst", error.worst},
                      {"heading_rms", error.heading_rms},
                      {"nees", error.nees}});
          });
        }
      });
    });
    json.add("diagnostics", result.diagnostics);
  });
  return std::move(json).text();
}

Section path_section(const LocalizeResult& result) {
  Section section{"path", "The path", {}};
  const auto& log = result.log;
  Facts facts;
  facts.add("odometry",
            Value(fmt::format("{} rows over {} s", log.odometry.size(),
                              number(log.odometry.back().time - log.odometry.front().time, 4))));
  facts.add(
      "sightings",
      Value(fmt::format("{} of {} landmarks{}", log.sightings.size(), log.landmarks.size(),
                        result.other_sightings > 0
                            ? fmt::format(", {} of other marks left aside", result.other_sightings)
                            : std::string())));
  facts.add("filter", Value(fmt::format("{} Kalman filter", name_of(result.method))));
  facts.add("taken by the filter", Value(fmt::format("{}", used_by_filter(result))));
  const LocalizedPath& best = result.smoother ? result.smoother->path : result.filter.path;
  double worst = 0.0;
  double sum = 0.0;
  for (const Eigen::Matrix3d& P : best.covariance) {
    worst = std::max(worst, spread(P));
    sum += spread(P);
  }
  facts.add(
      "standard deviation",
      Value(fmt::format("{} m on average, {} m at worst",
                        number(sum / static_cast<double>(best.time.size()), 2), number(worst, 2))));
  section.blocks.push_back(std::move(facts));
  if (result.filter_error) {
    Table table;
    table.caption = "Against the truth";
    table.header = {"path",      "points",          "rms (m)", "median (m)",
                    "worst (m)", "heading rms (°)", "NEES"};
    for (const NamedPath& named : paths_of(result)) {
      const PathError& error = **named.error;
      table.rows.push_back(
          {named.name, fmt::format("{}", error.points), quantity(error.rms, "m", 3, false),
           quantity(error.median, "m", 3, false), quantity(error.worst, "m", 3, false),
           quantity(error.heading_rms * 180.0 / std::numbers::pi, "°", 3, false),
           error.nees > 0.0 ? quantity(error.nees, "", 3, false) : Value("")});
    }
    section.blocks.push_back(std::move(table));
    section.blocks.push_back(Paragraph{
        "NEES is the mean squared error of the position over what its covariance says: 1 where "
        "that is true, less where it is cautious.",
        Tone::quiet});
  }
  return section;
}

Section calibration_section(const LocalizeResult& result) {
  Table table;
  table.header = {"constant", "value", "± σ", "unit"};
  table.words = {0, 3};
  const auto values = calibration_of(result).vector();
  for (int i = 0; i < SensorCalibration::size; ++i) {
    const auto& name = SensorCalibration::name(i);
    table.rows.push_back(
        {std::string(name.name), quantity(values(i), std::string(name.unit), 4, false),
         result.smoother ? Value("± " + number(result.smoother->calibration_std.vector()(i), 2))
                         : Value(""),
         std::string(name.unit)});
  }
  if (result.track_width) {
    table.rows.push_back({"track width", quantity(result.track_width->value, "m", 4, false),
                          Value("± " + number(result.track_width->std, 2)), "m"});
  }
  Section section{"calibration", "The sensors", {std::move(table)}};
  section.blocks.push_back(Paragraph{
      "Speed = velocity scale × odometry's; turn rate = turn scale × (odometry's - gyro bias) + "
      "turn per velocity × speed; both `delay` later. Range = (1 + range scale) d cosᵖ β + range "
      "offset of a "
      "landmark "
      "at the distance d and the direction β, p the depth exponent: 0 for a sensor of distance, 1 "
      "for a camera, which tells a depth along its axis.",
      Tone::quiet});
  return section;
}

PlotLine line_of(const LocalizedPath& path, const char* label, LineStyle style, int color) {
  PlotLine line{.label = label, .style = style, .color = color};
  for (const Pose2d& pose : path.pose) {
    line.x.push_back(pose.x());
    line.y.push_back(pose.y());
  }
  return line;
}

Figure map_figure(const LocalizeResult& result) {
  Figure figure{.section = "path", .name = "map", .title = "The map"};
  figure.plot = {.title = "The map", .x_label = "x (m)", .equal_axes = true, .height = 800};
  PlotPanel panel{.y_label = "y (m)"};
  // Odometry alone soon leaves the map: as much of it as lies near the landmarks.
  if (!result.truth.pose.empty()) {
    panel.lines.push_back(line_of(result.truth, "truth", LineStyle::solid, 5));
  }
  LocalizedPath near;
  double low_x = 1e300, high_x = -1e300, low_y = 1e300, high_y = -1e300;
  const auto see = [&](double x, double y) {
    low_x = std::min(low_x, x);
    high_x = std::max(high_x, x);
    low_y = std::min(low_y, y);
    high_y = std::max(high_y, y);
  };
  for (const Pose2d& pose : result.filter.path.pose) {
    see(pose.x(), pose.y());
  }
  for (const Landmark& landmark : result.log.landmarks) {
    see(landmark.position(0), landmark.position(1));
  }
  const double room = 0.2 * std::max(high_x - low_x, high_y - low_y);
  for (std::size_t i = 0; i < result.odometry.pose.size(); ++i) {
    const Pose2d& pose = result.odometry.pose[i];
    if (pose.x() < low_x - room || pose.x() > high_x + room || pose.y() < low_y - room ||
        pose.y() > high_y + room) {
      break;
    }
    near.pose.push_back(pose);
  }
  panel.lines.push_back(line_of(near, "odometry alone", LineStyle::dotted, 6));
  panel.lines.push_back(line_of(result.filter.path, "filter", LineStyle::dashed, 1));
  if (result.smoother) {
    panel.lines.push_back(line_of(result.smoother->path, "smoother", LineStyle::solid, 0));
  }
  PlotLine landmarks{.label = "landmarks", .style = LineStyle::squares, .color = 3};
  for (const Landmark& landmark : result.log.landmarks) {
    landmarks.x.push_back(landmark.position(0));
    landmarks.y.push_back(landmark.position(1));
    panel.notes.push_back({landmark.position(0), landmark.position(1), " " + landmark.name});
  }
  panel.lines.push_back(std::move(landmarks));
  figure.plot.panels.push_back(std::move(panel));
  figure.description = fmt::format(
      "The robot's path on the map by the filter{} and, where it starts, by odometry alone.",
      result.smoother ? " and the smoother" : "");
  return figure;
}

Figure error_figure(const LocalizeResult& result) {
  const bool known = result.filter_error.has_value();
  Figure figure{.section = "path",
                .name = known ? "errors" : "uncertainty",
                .title = known ? "Distance from the truth" : "Standard deviation of the position"};
  figure.plot = {.title = figure.title, .x_label = "Time (s)", .clock = localize_clock};
  const double begin = result.log.odometry.front().time;
  const auto add = [&](const LocalizedPath& path, const char* name, int color) {
    PlotPanel panel{.y_label = fmt::format("{} (m)", name)};
    PlotBand band{.label = "2 σ", .color = color};
    PlotLine line{.label = known ? "distance" : "σ", .color = color};
    std::size_t k = 0;
    for (std::size_t i = 0; i < path.time.size(); ++i) {
      const double time = path.time[i] - begin;
      const double sigma = spread(path.covariance[i]);
      band.x.push_back(time);
      band.low.push_back(0.0);
      band.high.push_back(2.0 * sigma);
      line.x.push_back(time);
      if (known) {
        while (result.truth.time[k] < path.time[i]) {
          ++k;
        }
        line.y.push_back((result.truth.pose[k].translation() - path.pose[i].translation()).norm());
      } else {
        line.y.push_back(sigma);
      }
    }
    panel.bands.push_back(std::move(band));
    panel.lines.push_back(std::move(line));
    figure.plot.panels.push_back(std::move(panel));
  };
  add(result.filter.path, "filter", 1);
  if (result.smoother) {
    add(result.smoother->path, "smoother", 0);
  }
  figure.description = known
                           ? "How far the paths are from the truth, with the band of two standard "
                             "deviations that the estimate itself claims."
                           : "How well the position is known along the path.";
  return figure;
}

Figure sightings_figure(const LocalizeResult& result) {
  Figure figure{.section = "sightings", .name = "sightings", .title = "Sightings"};
  figure.plot = {.title = "Sightings", .x_label = "Time (s)", .clock = localize_clock};
  const double begin = result.log.odometry.front().time;
  PlotPanel panel{.y_label = "off, in assumed σ"};
  PlotLine taken{.label = "taken", .style = LineStyle::points, .color = 0};
  PlotLine left{.label = "left out", .style = LineStyle::crosses, .color = 3};
  constexpr double most = 20.0;
  const double start = result.filter.path.time.front();
  for (std::size_t i = 0; i < result.log.sightings.size(); ++i) {
    if (result.log.sightings[i].time < start) {
      continue;
    }
    const double off =
        result.smoother ? result.smoother->distance[i] : std::sqrt(result.filter.nis[i]);
    const bool used = result.smoother ? result.smoother->used[i] : result.filter.weight[i] > 0.0;
    PlotLine& line = used ? taken : left;
    line.x.push_back(result.log.sightings[i].time - begin);
    line.y.push_back(std::min(off, most));
  }
  for (PlotLine* line : {&taken, &left}) {
    if (!line->x.empty()) {
      panel.lines.push_back(std::move(*line));
    }
  }
  figure.plot.panels.push_back(std::move(panel));
  figure.description =
      fmt::format("How far each sighting is off from what the path expects (at most {} is shown).",
                  number(most, 2));
  return figure;
}

Verdict verdict_of(const LocalizeResult& result) {
  Verdict verdict;
  const LocalizedPath& best = result.smoother ? result.smoother->path : result.filter.path;
  double sum = 0.0;
  for (const Eigen::Matrix3d& P : best.covariance) {
    sum += spread(P);
  }
  const auto left_out = static_cast<double>(result.log.sightings.size() - used_by_filter(result));
  constexpr double too_many = 0.3;
  const bool believed =
      left_out <= too_many * static_cast<double>(result.log.sightings.size()) &&
      std::none_of(result.diagnostics.begin(), result.diagnostics.end(),
                   [](const Diagnostic& d) { return d.severity == Severity::error; });
  const std::string spread_text = number(sum / static_cast<double>(best.time.size()), 2);
  verdict.line =
      believed
          ? fmt::format("the path is known, to {} m on average by its own account", spread_text)
          : "the path cannot be trusted: sightings, odometry and map contradict each "
            "other";
  if (!believed) {
    verdict.tone = Tone::bad;
  }
  for (const Diagnostic& diagnostic : result.diagnostics) {
    if (diagnostic.severity != Severity::info) {
      verdict.add(tone_of(diagnostic.severity), diagnostic.message);
    }
  }
  return verdict;
}

}  // namespace

Answer answer_of(const LocalizeResult& result) {
  Answer answer{.schema = localize_schema, .json = to_json(result)};
  answer.document.title = "Where the robot was";
  answer.document.verdict = verdict_of(result);
  answer.document.sections = {
      path_section(result), calibration_section(result),
      Section{"sightings",
              "Sightings",
              {Paragraph{"What each sighting is off by, and which are left out, is "
                         "in the report's picture (--out).",
                         Tone::quiet}}}};
  if (!result.diagnostics.empty()) {
    answer.document.sections.push_back(diagnostics_section(result.diagnostics));
  }
  for (const std::string& file : result.files) {
    answer.document.origins.add("file", Value(file));
  }
  answer.figures = {map_figure(result), error_figure(result), sightings_figure(result)};
  answer.animations = localize_animation(result, "path", localize_clock);
  for (const NamedPath& named : paths_of(result)) {
    answer.files.push_back({fmt::format("data/{}.csv", named.name), csv_of(*named.path)});
  }
  answer.files.push_back(localize_log_file(result));
  return answer;
}

}  // namespace flyball::study
