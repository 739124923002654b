#include <flyball/io/motion/wpilib_trajectory.hpp>

#include <flyball/io/file.hpp>

#include "core/try.hpp"
#include "io/motion/json_fields.hpp"

namespace flyball {

namespace {

using io::JsonKind;
using io::JsonNode;

/// All on one line, as WPILib writes.
constexpr io::JsonStyle wpilib_style{.indent = 0, .rows = true, .colon = ":"};

struct DescribeTranslation {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("x", s.x);
    a("y", s.y);
  }
};

struct DescribeRotation {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a(a.has("value") && !a.has("radians") ? "value" : "radians", s.angle);
  }
};

struct DescribePose {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a.part("rotation", s, DescribeRotation{});
    a.part("translation", s, DescribeTranslation{});
  }
};

struct DescribeSpeeds {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("vx", s.vx);
    a("vy", s.vy);
    a("omega", s.omega);
  }
};

struct DescribeAccelerations {
  template <class A, class S>
  void operator()(A& a, S& s) const {
    a.maybe("ax", s.ax);
    a.maybe("ay", s.ay);
    a.maybe("alpha", s.alpha);
  }
};

struct DescribeState {
  bool speeds = false;

  template <class A, class S>
  void operator()(A& a, S& s) const {
    a("time", s.time);
    a.part("pose", s, DescribePose{});
    if (speeds) {
      a.object("velocity", s.speeds, DescribeSpeeds{});
      a.object("acceleration", s.accelerations, DescribeAccelerations{});
      a("leftVelocity", s.left_velocity);
      a("rightVelocity", s.right_velocity);
      return;
    }
    a("velocity", s.velocity);
    a.usual("acceleration", s.acceleration);
    a.usual("curvature", s.curvature);
    a("holonomicRotation", s.holonomic_rotation);
    a("holonomicAngularVelocity", s.holonomic_angular_velocity);
    a("angularVelocity", s.angular_velocity);
  }
};

struct DescribeTrajectory {
  template <class A, class T>
  void operator()(A& a, T& t) const {
    a.list("samples", t.states, DescribeState{true});
  }
};

}  // namespace

ExpectedAll<WpilibTrajectory> parse_wpilib_trajectory(std::string_view text,
                                                      const std::string& source) {
  FLYBALL_TRY(const auto tree, io::parse_json_tree(text, source));
  const JsonNode& root = tree->root;
  WpilibTrajectory trajectory;
  trajectory.is_object = root.kind == JsonKind::object;
  const JsonNode* const list = trajectory.is_object ? root.find("samples") : &root;
  if (list == nullptr || list->kind != JsonKind::array) {
    return tl::unexpected(
        Errors(Error(MotionFileError::wrong_kind)
                   .in(source)
                   .about("the JSON")
                   .got(io::outline(root))
                   .expected("a WPILib trajectory: a list of {time, velocity, acceleration, "
                             "curvature, pose}")));
  }
  if (trajectory.is_object) {
    return io::read_document(tree, source, std::move(trajectory), DescribeTrajectory{});
  }
  io::JsonReading reading(tree, source);
  if (!io::JsonMembersIn::read_list(reading, root, trajectory.states, DescribeState{false})) {
    return tl::unexpected(reading.error());
  }
  trajectory.origin = JsonOrigin(tree, root);
  return trajectory;
}

Expected<std::string> to_wpilib(const WpilibTrajectory& trajectory) {
  if (trajectory.is_object) {
    return io::checked_text(io::write_document(trajectory, DescribeTrajectory{}, wpilib_style));
  }
  const JsonOrigin& origin = trajectory.origin;
  const auto spot = io::JsonSpot{.style = wpilib_style, .row = true}.of(origin);
  std::string text = io::JsonMembersOut::list_text(spot, trajectory.states, DescribeState{false});
  if (const JsonNode* root = origin.node()) {
    const io::JsonTree& tree = *origin.tree();
    text = std::string(tree.slice(0, root->begin)) + text +
           std::string(tree.slice(root->end, tree.text.size()));
  }
  return io::checked_text(std::move(text));
}

Expected<void> write_wpilib(const std::string& path, const WpilibTrajectory& trajectory) {
  FLYBALL_TRY(const std::string text, to_wpilib(trajectory));
  return write_file_atomically(path, text);
}

}  // namespace flyball
