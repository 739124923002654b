#include <flyball/io/motion/choreo.hpp>

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>

#include "core/diagnose.hpp"
#include "core/try.hpp"
#include "io/motion/json_fields.hpp"

namespace flyball {

namespace {

using io::JsonNode;
using io::JsonTree;

/// As Choreo's own formatter: a blank a level, and what stands in a list on one line.
constexpr io::JsonStyle choreo_style{.indent = 1, .rows = true, .colon = ":"};

struct DescribeSample {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("t", s.time);
    a("x", s.x);
    a("y", s.y);
    a("heading", s.heading);
    a("vx", s.vx);
    a("vy", s.vy);
    a("vl", s.vl);
    a("vr", s.vr);
    a("omega", s.omega);
    a("ax", s.ax);
    a("ay", s.ay);
    a("al", s.al);
    a("ar", s.ar);
    a("alpha", s.alpha);
    a("fx", s.fx);
    a("fy", s.fy);
    a("fl", s.fl);
    a("fr", s.fr);
  }
};

struct DescribeSample2024 {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("timestamp", s.time);
    a("x", s.x);
    a("y", s.y);
    a("heading", s.heading);
    a("velocityX", s.vx);
    a("velocityY", s.vy);
    a("angularVelocity", s.omega);
    a("velocityL", s.vl);
    a("velocityR", s.vr);
  }
};

struct DescribeWaypoint {
  template <class A, class W>
  void operator()(A& a, W& w) const {
    a("x", w.x);
    a("y", w.y);
    a("heading", w.heading);
    a("intervals", w.intervals);
    a("split", w.split);
    a("fixTranslation", w.fix_translation);
    a("fixHeading", w.fix_heading);
    a("overrideIntervals", w.override_intervals);
  }
};

struct DescribeWaypoint2024 {
  template <class A, class W>
  void operator()(A& a, W& w) const {
    a("timestamp", w.time);
    a("isStopPoint", w.is_stop_point);
    a("x", w.x);
    a("y", w.y);
    a("heading", w.heading);
    a("isInitialGuess", w.is_initial_guess);
    a("translationConstrained", w.fix_translation);
    a("headingConstrained", w.fix_heading);
    a("controlIntervalCount", w.intervals);
  }
};

struct DescribeConstraintData {
  template <class A, class C>
  void operator()(A& a, C& c) const {
    a("type", c.type);
    a.numbers("props", c.props, "flip", c.flip);
  }
};

struct DescribeConstraint {
  template <class A, class C>
  void operator()(A& a, C& c) const {
    a.id("from", c.from);
    a.id("to", c.to);
    a.part("data", c, DescribeConstraintData{});
    a("enabled", c.enabled);
  }
};

struct DescribeParameters {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a.list("waypoints", p.waypoints, DescribeWaypoint{});
    a.list("constraints", p.constraints, DescribeConstraint{});
    a("targetDt", p.target_dt);
  }
};

struct DescribePlace {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a("x", p.x);
    a("y", p.y);
  }
};

struct DescribeBumper {
  template <class A, class B>
  void operator()(A& a, B& b) const {
    a("front", b.front);
    a("side", b.side);
    a("back", b.back);
  }
};

struct DescribeConfig {
  template <class A, class C>
  void operator()(A& a, C& c) const {
    a.object("frontLeft", c.front_left, DescribePlace{});
    a.object("backLeft", c.back_left, DescribePlace{});
    a("mass", c.mass);
    a("inertia", c.inertia);
    a("gearing", c.gearing);
    a("radius", c.radius);
    a("vmax", c.vmax);
    a("tmax", c.tmax);
    a("cof", c.cof);
    a.object("bumper", c.bumper, DescribeBumper{});
    a("differentialTrackWidth", c.differential_track_width);
  }
};

struct DescribeFrom {
  template <class A, class E>
  void operator()(A& a, E& e) const {
    a.nullable("target", e.target);
    a.nullable("targetTimestamp", e.target_timestamp);
    a("offset", e.offset);
  }
};

struct DescribeEvent {
  template <class A, class E>
  void operator()(A& a, E& e) const {
    a("name", e.name);
    a.part("from", e, DescribeFrom{});
    a.nullable("event", e.command);
  }
};

/// Of a trajectory of 2024.
struct DescribeEvent2024 {
  template <class A, class E>
  void operator()(A& a, E& e) const {
    a.maybe("name", e.name);
    a("timestamp", e.target_timestamp);
    a("command", e.command);
  }
};

/// Of a project of 2024.
struct DescribeProjectEvent2024 {
  template <class A, class E>
  void operator()(A& a, E& e) const {
    a.maybe("name", e.name);
    a("trajTargetIndex", e.target);
    a("targetTimestamp", e.target_timestamp);
    a("offset", e.offset);
    a("command", e.command);
  }
};

struct DescribeGenerated {
  template <class A, class G>
  void operator()(A& a, G& g) const {
    a.object("config", g.config, DescribeConfig{});
    a("sampleType", g.sample_type);
    a("waypoints", g.waypoints);
    a.list("samples", g.samples, DescribeSample{});
    a("splits", g.splits);
  }
};

struct DescribeChoreoTrajectory {
  template <class A, class T>
  void operator()(A& a, T& t) const {
    if (t.is_2024) {
      a.list("samples", t.trajectory.samples, DescribeSample2024{});
      a.list("eventMarkers", t.events, DescribeEvent2024{}, false);
      return;
    }
    a("name", t.name);
    a.id("version", t.version);
    a.object("snapshot", t.snapshot, DescribeParameters{});
    a.object("params", t.params, DescribeParameters{});
    a.object("trajectory", t.trajectory, DescribeGenerated{});
    a.usual_list("events", t.events, DescribeEvent{});
  }
};

struct DescribePath2024 {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a.list("waypoints", p.waypoints, DescribeWaypoint2024{});
    a.list("trajectory", p.trajectory, DescribeSample2024{}, false);
    a.list("trajectoryWaypoints", p.trajectory_waypoints, DescribeWaypoint2024{}, false);
    a.list("eventMarkers", p.events, DescribeProjectEvent2024{}, false);
  }
};

struct DescribeRobot2024 {
  template <class A, class R>
  void operator()(A& a, R& r) const {
    a("mass", r.mass);
    a("rotationalInertia", r.rotational_inertia);
    a("motorMaxTorque", r.motor_max_torque);
    a("motorMaxVelocity", r.motor_max_velocity);
    a("gearing", r.gearing);
    a("wheelbase", r.wheelbase);
    a("trackWidth", r.track_width);
    a("bumperLength", r.bumper_length);
    a("bumperWidth", r.bumper_width);
    a("wheelRadius", r.wheel_radius);
  }
};

struct DescribeProject {
  template <class A, class P>
  void operator()(A& a, P& p) const {
    a.id("version", p.version);
    if (p.robot) {
      a.object("robotConfiguration", p.robot, DescribeRobot2024{});
      a.map("paths", p.paths, DescribePath2024{}, false);
      return;
    }
    a("name", p.name);
    a("type", p.type);
    a.object("config", p.config, DescribeConfig{});
  }
};

/// The schema of a version, if it is a whole number.
std::optional<int> schema_of(const std::string& version) {
  int schema = 0;
  const auto [end, problem] =
      std::from_chars(version.data(), version.data() + version.size(), schema);
  return problem == std::errc() && end == version.data() + version.size() ? std::optional(schema)
                                                                          : std::nullopt;
}

void look_at_version(const std::string& version, int newest, std::vector<Diagnostic>& diagnostics) {
  if (version.starts_with("v2025.") || version.starts_with("v0.")) {
    return;
  }
  const std::optional<int> schema = schema_of(version);
  if (!schema || *schema < 0 || *schema > newest) {
    warn(diagnostics, "unknown_version",
         "the file's version is {}, of which nothing is known (versions 0 to {} are): it was read "
         "as version {}",
         cut(printable(version), 40), newest, newest);
  }
}

tl::unexpected<Errors> wrong_kind(const JsonTree& tree, const std::string& source,
                                  std::string_view expected, std::string_view hint) {
  return tl::unexpected(Errors(Error(MotionFileError::wrong_kind)
                                   .in(source)
                                   .about("the JSON")
                                   .got(io::outline(tree.root))
                                   .expected(std::string(expected))
                                   .hint(std::string(hint))));
}

}  // namespace

std::optional<double> ChoreoConstraint::prop(std::string_view name) const {
  const auto found = std::find_if(props.begin(), props.end(),
                                  [&](const NamedNumber& prop) { return prop.name == name; });
  return found == props.end() ? std::nullopt : std::optional(found->number.value);
}

std::optional<double> ChoreoEvent::time() const {
  return target_timestamp ? std::optional(*target_timestamp + offset.value) : std::nullopt;
}

bool ChoreoTrajectory::differential() const noexcept {
  return trajectory.sample_type
             ? *trajectory.sample_type == "Differential"
             : !trajectory.samples.empty() && trajectory.samples.front().vl.has_value();
}

ExpectedAll<ChoreoTrajectory> parse_choreo_trajectory(std::string_view text,
                                                      const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  const JsonNode& root = tree->root;
  ChoreoTrajectory trajectory;
  trajectory.is_2024 = root.find("trajectory") == nullptr && root.find("samples") != nullptr &&
                       root.find("params") == nullptr;
  if (root.kind != io::JsonKind::object ||
      (!trajectory.is_2024 &&
       (root.find("trajectory") == nullptr || root.find("params") == nullptr))) {
    const bool project = root.find("robotConfiguration") != nullptr ||
                         root.find("generationFeatures") != nullptr ||
                         root.find("config") != nullptr;
    return wrong_kind(*tree, source, "a Choreo trajectory: name, version, params, trajectory",
                      project ? "that is a project (.chor): give one of its .traj files" : "");
  }
  FLYBALL_TRY(trajectory,
              io::read_document(tree, source, std::move(trajectory), DescribeChoreoTrajectory{}));
  if (!trajectory.is_2024) {
    look_at_version(trajectory.version, ChoreoTrajectory::newest, trajectory.diagnostics);
  }
  return trajectory;
}

ExpectedAll<ChoreoProject> parse_choreo_project(std::string_view text, const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  const JsonNode& root = tree->root;
  ChoreoProject project;
  if (root.find("robotConfiguration") != nullptr) {
    project.robot.emplace();
  } else if (root.kind != io::JsonKind::object || root.find("config") == nullptr) {
    return wrong_kind(*tree, source, "a Choreo project: name, version, type, config",
                      root.find("params") != nullptr ? "that is a trajectory (.traj)" : "");
  }
  FLYBALL_TRY(project, io::read_document(tree, source, std::move(project), DescribeProject{}));
  look_at_version(project.version, ChoreoProject::newest, project.diagnostics);
  return project;
}

ExpectedAll<ChoreoTrajectory> read_choreo_trajectory(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path, io::most_json_bytes));
  return parse_choreo_trajectory(text, path);
}

ExpectedAll<ChoreoProject> read_choreo_project(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path, io::most_json_bytes));
  return parse_choreo_project(text, path);
}

Expected<std::string> to_choreo(const ChoreoTrajectory& trajectory) {
  return io::checked_text(io::write_document(trajectory, DescribeChoreoTrajectory{}, choreo_style));
}

Expected<std::string> to_choreo(const ChoreoProject& project) {
  return io::checked_text(io::write_document(project, DescribeProject{}, choreo_style));
}

Expected<void> write_choreo(const std::string& path, const ChoreoTrajectory& trajectory) {
  FLYBALL_TRY(const std::string text, to_choreo(trajectory));
  return write_file_atomically(path, text);
}

Expected<void> write_choreo(const std::string& path, const ChoreoProject& project) {
  FLYBALL_TRY(const std::string text, to_choreo(project));
  return write_file_atomically(path, text);
}

}  // namespace flyball
