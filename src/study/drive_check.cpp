// What in [drive] cannot be.
#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/text.hpp>
#include <flyball/recording/trajectory_file.hpp>
#include <flyball/study/drive.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "core/wording.hpp"
#include "study/drive_fields.hpp"
#include "study/toml_document.hpp"

namespace flyball::study {

namespace {

using Eigen::Vector2d;

/// From the smallest toy to what lifts ships: beyond it a unit or a power of ten is wrong.
struct BodySize {
  std::string_view key;
  double least;
  double most;
  std::string_view unit;
};
constexpr std::array sizes{BodySize{"mass", 0.01, 1e6, "kg"},
                           BodySize{"moment_of_inertia", 1e-6, 1e7, "kg m^2"},
                           BodySize{"trackwidth", 0.01, 100.0, "m"},
                           BodySize{"wheelbase", 0.01, 100.0, "m"},
                           BodySize{"wheel_radius", 1e-3, 10.0, "m"},
                           BodySize{"gearing", 1e-2, 1e4, ""},
                           BodySize{"steer_gearing", 1e-2, 1e4, ""},
                           BodySize{"wheel_inertia", 1e-7, 1e5, "kg m^2"},
                           BodySize{"steer_inertia", 1e-7, 1e5, "kg m^2"},
                           BodySize{"grip", 1e-3, 10.0, ""}};

class Check {
 public:
  Check(TomlDocument& document, const Project& project)
      : document_(document), said_(project.drive) {}

  void all() {
    check_sizes();
    check_follower();
    check_modules();
    check_waypoints();
    if (said_.zeta > 1.0 && document_.has("drive", "zeta")) {
      refuse("zeta", format_number(said_.zeta), "it is above 0 and at most 1, in 1/rad");
    }
    // A file that was typed takes the place of the project's waypoints.
    const bool typed = document_.name("drive", "trajectory").starts_with("--");
    if (!typed && !said_.trajectory.empty() && !said_.waypoints.empty()) {
      refuse("trajectory", "there beside waypoints", "leave one of them out");
    }
  }

 private:
  [[nodiscard]] bool moves_sideways() const { return said_.type != "differential"; }

  void refuse(std::string_view key, std::string got, std::string hint) {
    document_.refuse("drive", key,
                     Error(ProjectError::wrong_value)
                         .about(document_.name("drive", key))
                         .got(std::move(got))
                         .hint(std::move(hint)));
  }
  void refuse(std::string_view key, Error error) {
    document_.refuse("drive", key, std::move(error));
  }
  template <class Said>
  void check_size(std::string_view key, const std::optional<Said>& said) {
    double value = 0.0;
    if constexpr (requires { said->si(); }) {
      value = said ? said->si() : 0.0;
    } else {
      value = said.value_or(0.0);
    }
    if (!said || !document_.has("drive", key)) {
      return;
    }
    if (auto fits = check_drive_size(key, value); !fits) {
      refuse(key, std::move(fits).error().about(document_.name("drive", key)));
    }
  }
  void check_sizes() {
    check_size("mass", said_.mass);
    check_size("moment_of_inertia", said_.moment_of_inertia);
    check_size("trackwidth", said_.trackwidth);
    check_size("wheelbase", said_.wheelbase);
    check_size("wheel_radius", said_.wheel_radius);
    check_size("gearing", said_.gearing);
    check_size("grip", said_.grip);
    check_size("steer_gearing", std::optional(said_.steer_gearing));
    check_size("steer_inertia", std::optional(said_.steer_inertia));
    check_size("wheel_inertia", std::optional(said_.wheel_inertia));
  }
  void check_follower() {
    if (said_.type.empty() || said_.follower.empty() || said_.follower == "pure pursuit") {
      return;
    }
    if ((said_.follower == "holonomic") != moves_sideways()) {
      refuse("follower", fmt::format("\"{}\", for a {} drive", said_.follower, said_.type),
             moves_sideways() ? "a drive that moves in any direction has holonomic or pure pursuit"
                              : "a differential drive has ramsete, ltv unicycle, ltv drive or pure "
                                "pursuit");
    }
  }
  void check_modules() {
    if (said_.modules.empty()) {
      return;
    }
    if (!said_.type.empty() && !moves_sideways()) {
      refuse("modules", "without meaning for a differential drive",
             "it has a trackwidth, and a wheelbase where more than one wheel a side scrubs");
      return;
    }
    if (said_.modules.size() != 4) {
      refuse("modules", fmt::format("{} places", said_.modules.size()),
             "give four: front left, front right, back left, back right");
      return;
    }
    std::array<Vector2d, 4> places;
    for (std::size_t i = 0; i < places.size(); ++i) {
      auto place = quantities_of(said_.modules[i], {Dimension::length, Dimension::length}, 2,
                                 fmt::format("{}[{}]", document_.name("drive", "modules"), i));
      if (!place) {
        document_.refuse_item("drive", "modules", i, std::move(place).error());
        return;
      }
      places[i] = {(*place)[0], (*place)[1]};
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        constexpr double apart = 0.005;  // m
        if ((places[i] - places[j]).norm() < apart) {
          document_.refuse_item(
              "drive", "modules", i,
              Error(ProjectError::wrong_value)
                  .about(fmt::format("{}[{}]", document_.name("drive", "modules"), i))
                  .got(fmt::format("({}, {}) m, where modules[{}] is",
                                   format_number(places[i](0), 4), format_number(places[i](1), 4),
                                   j))
                  .expected("a place of its own")
                  .hint("FL, FR, BL, BR from the middle, x ahead and y to the left"));
          return;
        }
      }
    }
    if (const auto wrong = misplaced_module(places)) {
      refuse("modules", "in another order: " + *wrong,
             "the order is front left, front right, back left, back right; x is ahead, y to the "
             "left");
    }
  }
  void check_waypoints() {
    if (said_.waypoints.size() == 1) {
      refuse("waypoints", "one place", "a path goes from one to another: give two or more");
    }
    std::optional<Vector2d> before;
    for (std::size_t i = 0; i < said_.waypoints.size(); ++i) {
      const std::string name = fmt::format("{}[{}]", document_.name("drive", "waypoints"), i);
      auto values = quantities_of(
          said_.waypoints[i],
          {Dimension::length, Dimension::length, Dimension::angle, Dimension::angle}, 3, name);
      if (!values) {
        document_.refuse_item("drive", "waypoints", i, std::move(values).error());
      } else if (values->size() > 3 && !said_.type.empty() && !moves_sideways()) {
        document_.refuse_item("drive", "waypoints", i,
                              Error(ProjectError::wrong_value)
                                  .about(name)
                                  .got("of four values")
                                  .hint("a differential drive looks where it goes: leave the "
                                        "fourth out"));
      } else if (const Vector2d place((*values)[0], (*values)[1]); before && *before == place) {
        document_.refuse_item("drive", "waypoints", i,
                              Error(ProjectError::wrong_value)
                                  .about(name)
                                  .got("where the one before it is")
                                  .expected("somewhere else"));
      } else {
        before = place;
      }
    }
  }

  TomlDocument& document_;
  const DriveSection& said_;
};

}  // namespace

Expected<std::vector<double>> quantities_of(const std::string& text,
                                            std::initializer_list<Dimension> dimensions,
                                            std::size_t least, const std::string& name) {
  const auto parts = text::split(text, ",");
  if (parts.size() < least || parts.size() > dimensions.size()) {
    return refusal(ArgumentError::malformed, {}, name)
        .got(fmt::format("\"{}\", {}", shortened(text), text::count(parts.size(), "value")))
        .expected(least == dimensions.size() ? fmt::format("{} values, separated by commas", least)
                                             : fmt::format("{} to {} values, separated by commas",
                                                           least, dimensions.size()));
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    FLYBALL_TRY(const double value, parse_quantity(parts[i], *(dimensions.begin() + i), name));
    values.push_back(value);
  }
  return values;
}

Expected<void> check_drive_size(std::string_view key, double value) {
  const auto size =
      std::find_if(sizes.begin(), sizes.end(), [&](const BodySize& one) { return one.key == key; });
  if (size == sizes.end() || (value >= size->least && value <= size->most)) {
    return {};
  }
  const std::string unit = size->unit.empty() ? "" : fmt::format(" {}", size->unit);
  return tl::unexpected(
      Error(ProjectError::wrong_value)
          .about(fmt::format("drive.{}", key))
          .got(fmt::format("{}{}", format_number(value, 4), unit))
          .expected(fmt::format("{}{} to {}{}, as drivetrains have", format_number(size->least),
                                unit, format_number(size->most), unit))
          .hint("look at its unit and its power of ten"));
}

void check_drive(TomlDocument& document, const Project& project) {
  Check(document, project).all();
}

}  // namespace flyball::study
