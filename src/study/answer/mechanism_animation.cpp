// Small drawings of mechanisms that move as their simulations say.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "core/constants.hpp"
#include "core/wording.hpp"
#include "study/answer/mechanism_animation.hpp"

namespace flyball::study {

namespace {

using mechanisms::MechanismKind;
using SignalColumn = std::vector<double>;

/// Rows of an animation: between two of them all moves evenly, so that more show nothing more.
constexpr std::size_t most_frames = 2000;

/// The rows that are shown of a simulation: each, or evenly some of them and the last.
std::vector<std::size_t> shown_rows(std::size_t count) {
  const std::size_t stride = (count + most_frames - 1) / most_frames;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < count; i += stride) {
    rows.push_back(i);
  }
  if (rows.back() + 1 != count) {
    rows.push_back(count - 1);
  }
  return rows;
}

SignalColumn picked(const SignalColumn& values, const std::vector<std::size_t>& rows) {
  SignalColumn chosen(rows.size());
  std::transform(rows.begin(), rows.end(), chosen.begin(),
                 [&](std::size_t row) { return values[row]; });
  return chosen;
}

template <class Of>
SignalColumn mapped(const SignalColumn& values, const Of& of) {
  SignalColumn made(values.size());
  std::transform(values.begin(), values.end(), made.begin(), of);
  return made;
}

double largest_value(const SignalColumn& values) {
  double found = 0.0;
  for (const double value : values) {
    found = std::isfinite(value) ? std::max(found, std::abs(value)) : found;
  }
  return found;
}

MovingPart part(std::string label, PartStyle style, int color) {
  MovingPart made;
  made.label = std::move(label);
  made.style = style;
  made.color = color;
  return made;
}

/// Draws on, from a point to the next; a first point after the pen was lifted.
void draw(MovingPart& part, std::initializer_list<std::pair<double, double>> points) {
  if (!part.x.empty()) {
    part.x.push_back(std::numeric_limits<double>::quiet_NaN());
    part.y.push_back(std::numeric_limits<double>::quiet_NaN());
  }
  for (const auto& [x, y] : points) {
    part.x.push_back(x);
    part.y.push_back(y);
  }
}

void draw_rectangle(MovingPart& part, double left, double bottom, double right, double top) {
  draw(part, {{left, bottom}, {right, bottom}, {right, top}, {left, top}, {left, bottom}});
}

/// A circle's arc about a point, counter-clockwise.
void draw_arc(MovingPart& part, double x, double y, double radius, double from = 0.0,
              double to = 2.0 * pi) {
  constexpr int pieces = 48;
  draw(part, {});
  for (int i = 0; i <= pieces; ++i) {
    const double angle = from + (to - from) * i / pieces;
    part.x.push_back(x + radius * std::cos(angle));
    part.y.push_back(y + radius * std::sin(angle));
  }
}

/// What a drawing is made of: the truth and, where there is one, the reference, along the rows
/// that are shown.
struct Motion {
  SignalColumn time;
  SignalColumn position, velocity;
  SignalColumn reference_position, reference_velocity;  ///< Empty: an open loop.
};

/// The same outline where the reference is, behind, and where the mechanism is.
void add_twice(Animation& animation, const MovingPart& outline, const std::string& name,
               const auto& place_by, const SignalColumn& truth, const SignalColumn& reference) {
  const auto add = [&](const std::string& label, PartStyle style, int color,
                       const SignalColumn& coordinate) {
    MovingPart placed = outline;
    placed.label = label;
    placed.style = style;
    placed.color = color;
    placed.*place_by = coordinate;
    animation.parts.push_back(std::move(placed));
  };
  if (!reference.empty()) {
    add("reference", PartStyle::outlined, simulated_color, reference);
  }
  add(name, PartStyle::filled, measured_color, truth);
}

void draw_elevator(Animation& animation, const Motion& motion) {
  double low = 0.0;
  double high = 0.0;
  for (const SignalColumn* heights : {&motion.position, &motion.reference_position}) {
    for (const double height : *heights) {
      low = std::min(low, height);
      high = std::max(high, height);
    }
  }
  const double size = high > low ? high - low : 1.0;
  MovingPart rails = part("", PartStyle::ground, 0);
  for (const double side : {-0.34 * size, 0.34 * size}) {
    draw(rails, {{side, low - 0.06 * size}, {side, high + 0.3 * size}});
  }
  draw(rails, {{-0.6 * size, low - 0.06 * size}, {0.6 * size, low - 0.06 * size}});
  animation.parts.push_back(std::move(rails));
  MovingPart carriage;
  draw_rectangle(carriage, -0.34 * size, 0.0, 0.34 * size, 0.22 * size);
  add_twice(animation, carriage, "carriage", &MovingPart::to_y, motion.position,
            motion.reference_position);
}

/// @param offset  rad, true angle from horizontal less the measured one.
void draw_arm(Animation& animation, const Motion& motion, double offset) {
  MovingPart post = part("", PartStyle::ground, 0);
  draw(post, {{0.0, 0.0}, {0.0, -0.45}});
  draw(post, {{-0.2, -0.45}, {0.2, -0.45}});
  draw(post, {{0.12, 0.0}, {1.0, 0.0}});
  animation.parts.push_back(std::move(post));
  MovingPart arm;
  draw(arm, {{0.0, -0.06}, {1.0, -0.03}, {1.0, 0.03}, {0.0, 0.06}, {0.0, -0.06}});
  const auto true_angle = [&](double angle) { return angle + offset; };
  add_twice(animation, arm, "arm", &MovingPart::angle, mapped(motion.position, true_angle),
            mapped(motion.reference_position, true_angle));
}

void draw_turret(Animation& animation, const Motion& motion) {
  MovingPart base = part("", PartStyle::ground, 0);
  draw_arc(base, 0.0, 0.0, 0.7);
  draw(base, {{0.7, 0.0}, {1.05, 0.0}});
  animation.parts.push_back(std::move(base));
  MovingPart pointer;
  draw(pointer,
       {{-0.45, -0.16}, {0.6, -0.1}, {1.0, 0.0}, {0.6, 0.1}, {-0.45, 0.16}, {-0.45, -0.16}});
  add_twice(animation, pointer, "direction", &MovingPart::angle, motion.position,
            motion.reference_position);
}

/// A wheel that turns, and the needles of how fast. @param radius  Units of position a radian.
void draw_wheel(Animation& animation, const Motion& motion, double radius) {
  MovingPart wheel = part("", PartStyle::filled, measured_color);
  draw_arc(wheel, 0.0, 0.0, 1.0);
  draw_arc(wheel, 0.0, 0.0, 0.86);
  for (int spoke = 0; spoke < 3; ++spoke) {
    const double angle = 2.0 * pi * spoke / 3.0;
    draw(wheel, {{0.16 * std::cos(angle), 0.16 * std::sin(angle)},
                 {0.86 * std::cos(angle), 0.86 * std::sin(angle)}});
  }
  draw_arc(wheel, 0.0, 0.0, 0.16);
  wheel.angle = mapped(motion.position, [&](double position) { return position / radius; });
  animation.parts.push_back(std::move(wheel));

  constexpr double dial = 2.6;            // x of its middle
  constexpr double end = 2.0 * pi / 3.0;  // of its scale, to either side of upright
  MovingPart scale = part("", PartStyle::ground, 0);
  draw_arc(scale, dial, 0.0, 1.0, pi / 2.0 - end, pi / 2.0 + end);
  for (const double tick : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const double angle = pi / 2.0 - end * tick;
    draw(scale, {{dial + 0.9 * std::cos(angle), 0.9 * std::sin(angle)},
                 {dial + std::cos(angle), std::sin(angle)}});
  }
  animation.parts.push_back(std::move(scale));
  const double full =
      std::max({largest_value(motion.velocity), largest_value(motion.reference_velocity), 1e-12});
  const auto needle_angle = [&](double velocity) { return pi / 2.0 - end * velocity / full; };
  MovingPart needle;
  draw(needle, {{-0.12, -0.05}, {0.88, 0.0}, {-0.12, 0.05}, {-0.12, -0.05}});
  needle.to_x.assign(motion.time.size(), dial);
  add_twice(animation, needle, "velocity", &MovingPart::angle,
            mapped(motion.velocity, needle_angle), mapped(motion.reference_velocity, needle_angle));
}

std::string what_is_drawn(MechanismKind kind, bool reference) {
  const std::string dashed = reference ? ", dashed where the reference is" : "";
  switch (kind) {
    case MechanismKind::elevator:
      return "The carriage between its rails" + dashed + ".";
    case MechanismKind::arm:
      return "The arm from the side" + dashed + "; the grey line is horizontal.";
    case MechanismKind::turret:
    case MechanismKind::swerve_steer:
      return "Seen from above" + dashed +
             "; the grey mark is its zero, it turns counter-clockwise.";
    case MechanismKind::flywheel:
    case MechanismKind::roller:
    case MechanismKind::swerve_drive:
      break;
  }
  return "The wheel turns, slowed down where that is too fast to see; the needle is its velocity" +
         (reference ? std::string(", the dashed one the reference's") : "") + ".";
}

}  // namespace

std::vector<Animation> mechanism_animation(const DrawnMechanism& mechanism,
                                           const TimeSeries& series) {
  const SignalColumn* position = series.find("position");
  const SignalColumn* velocity = series.find("velocity");
  if (position == nullptr || velocity == nullptr || series.rows() < 2) {
    return {};
  }
  const bool moves_by_velocity = controls_velocity(mechanism.kind);
  const std::string controlled = moves_by_velocity ? "velocity" : "position";
  const std::vector<std::size_t> rows = shown_rows(series.rows());
  const auto column = [&](const std::string& name) {
    const SignalColumn* values = series.find(name);
    return values == nullptr ? SignalColumn() : picked(*values, rows);
  };
  const Motion motion{picked(series.time(), rows), picked(*position, rows), picked(*velocity, rows),
                      column("reference_position"), column("reference_velocity")};
  const SignalColumn& reference =
      moves_by_velocity ? motion.reference_velocity : motion.reference_position;
  Animation animation{.section = mechanism.section,
                      .name = "animation",
                      .title = "Motion of the " + mechanism.name,
                      .clock = mechanism.clock};
  animation.description =
      what_is_drawn(mechanism.kind, !reference.empty()) +
      " It shows the moment that the cursor of the plots below is at, and the other way round.";
  switch (mechanism.kind) {
    case MechanismKind::elevator:
      draw_elevator(animation, motion);
      break;
    case MechanismKind::arm:
      draw_arm(animation, motion, mechanism.angle_offset);
      break;
    case MechanismKind::turret:
    case MechanismKind::swerve_steer:
      draw_turret(animation, motion);
      break;
    case MechanismKind::flywheel:
    case MechanismKind::roller:
      draw_wheel(animation, motion, 1.0);
      break;
    case MechanismKind::swerve_drive:
      // Rolling to the right it turns clockwise.
      draw_wheel(animation, motion, -mechanism.wheel_radius);
      break;
  }
  const std::string unit = mechanism.unit + (moves_by_velocity ? "/s" : "");
  animation.values.push_back(
      {controlled, unit, moves_by_velocity ? motion.velocity : motion.position});
  if (!reference.empty()) {
    animation.values.push_back({"reference", unit, reference});
  }
  animation.time = motion.time;
  return {std::move(animation)};
}

DrawnMechanism drawn(const PlantDescription& plant, std::string section, std::string clock) {
  constexpr double usual_wheel = 0.0508;  // m
  const double radius = plant.drum_radius > 0.0 ? plant.drum_radius : usual_wheel;
  return {.kind = plant.kind,
          .name = plant.name.empty() ? std::string(to_string(plant.kind)) : plant.name,
          .unit = plant.unit,
          .angle_offset = plant.gains.angle_offset,
          .wheel_radius = plant.unit == "m" ? radius : 1.0,
          .section = std::move(section),
          .clock = std::move(clock)};
}

}  // namespace flyball::study
