#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/study/project.hpp>

#include "core/constants.hpp"
#include "study/space_reader.hpp"

namespace flyball::study {

Dimension SpaceReader::dimension_of(std::string_view unit) {
  return unit == "rad" ? Dimension::angle
         : unit == "m" ? Dimension::length
                       : Dimension::dimensionless;
}

SpaceAxis SpaceReader::axis(const toml::table& table) {
  known(table, "[[axis]]",
        {"name", "kind", "low", "high", "wraps", "scale", "velocity", "reverse_velocity",
         "acceleration", "deceleration", "ramp", "error"});
  SpaceAxis to;
  to.name = text(table, "name", fmt::format("axis {}", axes_.size() + limits_.size() + 1));
  const std::string kind = text(table, "kind", "angle");
  to.unit = kind == "angle" ? "rad" : kind == "length" ? "m" : "";
  if (kind != "angle" && kind != "length" && kind != "number") {
    refuse(table.get("kind")->source(), Error(ProjectError::wrong_value)
                                            .about("kind")
                                            .got('"' + kind + '"')
                                            .expected("angle, length or number"));
  }
  const Dimension place = dimension_of(to.unit);
  const bool turns = place == Dimension::angle;
  const bool plain = place == Dimension::dimensionless;
  const Dimension rate = plain ? place : turns ? Dimension::angular_velocity : Dimension::velocity;
  const Dimension change = plain   ? place
                           : turns ? Dimension::angular_acceleration
                                   : Dimension::acceleration;
  to.wraps = flag(table, "wraps");
  to.low = to.wraps ? optional_quantity(table, "low", place).value_or(-pi)
                    : needed(table, "low", place, to.name + ", its lower stop");
  to.high =
      to.wraps ? to.low + full_turn : needed(table, "high", place, to.name + ", its upper stop");
  to.scale = optional_quantity(table, "scale", place).value_or(1.0);
  const std::size_t before = errors_.size();
  MotionLimits limits{
      .velocity = optional_quantity(table, "velocity", rate).value_or(0.0),
      .acceleration = optional_quantity(table, "acceleration", change).value_or(0.0)};
  limits.deceleration = optional_quantity(table, "deceleration", change).value_or(0.0);
  limits.reverse_velocity = optional_quantity(table, "reverse_velocity", rate).value_or(0.0);
  if (const auto ramp = optional_quantity(table, "ramp", Dimension::time)) {
    if (*ramp > 0.0) {
      limits.jerk = limits.acceleration / *ramp;
    } else {
      refuse(table.get("ramp")->source(), Error(ArgumentError::not_positive)
                                              .about("ramp")
                                              .got("not positive")
                                              .expected("a time > 0"));
    }
  }
  const bool has = table.contains("velocity") && table.contains("acceleration");
  if (!has && (table.contains("velocity") || table.contains("acceleration"))) {
    refuse(table.source(), Error(ProjectError::missing_key)
                               .about(table.contains("velocity") ? "acceleration" : "velocity")
                               .got("missing")
                               .hint("of " + to.name + ": limits come in pairs"));
  }
  for (const auto& [key, value] :
       {std::pair("velocity", limits.velocity), std::pair("acceleration", limits.acceleration),
        std::pair("deceleration", limits.deceleration),
        std::pair("reverse_velocity", limits.reverse_velocity)}) {
    if (table.contains(key) && !(value > 0.0) && errors_.size() == before) {
      refuse(table.get(key)->source(), Error(ArgumentError::not_positive)
                                           .about(to.name + ": " + key)
                                           .got(fmt::format("{}", value))
                                           .expected("positive"));
    }
  }
  has_limits_ = has_limits_ && has;
  limits_.push_back(limits);
  errors_of_axes_.push_back(optional_quantity(table, "error", place).value_or(0.0));
  return to;
}

int SpaceReader::axis_index(const toml::table& table, std::string_view key, std::string_view name) {
  NameList names;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    if (axes_[k].name == name) {
      return static_cast<int>(k);
    }
    names.push_back(axes_[k].name);
  }
  const toml::node* node = table.get(key);
  refuse(node == nullptr ? table.source() : node->source(),
         Error(ArgumentError::unknown_name)
             .about(std::string(key))
             .got(fmt::format("\"{}\"", name))
             .expected(fmt::format("one of the axes {}", fmt::join(names, ", "))));
  return 0;
}

std::optional<Region> SpaceReader::region(const toml::table& table, bool named) {
  NameList names{"box", "half_space", "polygon", "any", "all", "not"};
  if (named) {
    names.insert(names.end(), {"name", "rule"});
  }
  known(table, named ? "[[region]]" : "a region", names);
  std::optional<Region> all;
  const auto meet = [&](const Region& one) { all = all ? *all & one : one; };
  if (const toml::node* node = table.get("box")) {
    if (const toml::table* box = node->as_table()) {
      for (const auto& [key, value] : *box) {
        const int k = axis_index(*box, key.str(), key.str());
        const Dimension d = dimension_of(axes_[static_cast<std::size_t>(k)].unit);
        const auto bounds = point(&value, std::string(key.str()), d, d);
        meet(Region::interval(k, bounds[0], bounds[1]));
      }
    } else {
      wrong_type(*node, "box", "bounds of axes: { arm = [\"-45 deg\", \"45 deg\"] }");
    }
  }
  if (const toml::node* node = table.get("half_space")) {
    if (const toml::table* half = node->as_table()) {
      known(*half, "half_space", {"normal", "offset"});
      std::vector<double> normal(axes_.size(), 0.0);
      const toml::node* given = half->get("normal");
      if (const toml::table* entries = given == nullptr ? nullptr : given->as_table()) {
        for (const auto& [key, value] : *entries) {
          normal[static_cast<std::size_t>(axis_index(*entries, key.str(), key.str()))] =
              quantity(value, Dimension::dimensionless, std::string(key.str()));
        }
      } else {
        refuse(half->source(), Error(ProjectError::missing_key)
                                   .about("normal")
                                   .got("missing")
                                   .expected("{ axis = number } in SI units"));
      }
      meet(Region::half_space(std::move(normal), needed(*half, "offset", Dimension::dimensionless,
                                                        "a half-space, in SI units")));
    } else {
      wrong_type(*node, "half_space", "{ normal = { … }, offset = … }");
    }
  }
  if (const toml::node* node = table.get("polygon")) {
    const toml::table* polygon = node->as_table();
    const toml::array* over = polygon == nullptr ? nullptr : polygon->get_as<toml::array>("axes");
    if (over == nullptr || over->size() != 2 || !(*over)[0].is_string() ||
        !(*over)[1].is_string()) {
      wrong_type(*node, "polygon", "{ axes = [\"one\", \"other\"], points = [[…], …] }");
    } else {
      known(*polygon, "polygon", {"axes", "points"});
      const int i = axis_index(*polygon, "axes", (*over)[0].value_or(std::string()));
      const int j = axis_index(*polygon, "axes", (*over)[1].value_or(std::string()));
      meet(Region::polygon(
          i, j,
          points(*polygon, "points", dimension_of(axes_[static_cast<std::size_t>(i)].unit),
                 dimension_of(axes_[static_cast<std::size_t>(j)].unit))));
    }
  }
  for (const char* key : {"any", "all"}) {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      continue;
    }
    const toml::array* list = node->as_array();
    std::optional<Region> joined;
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
      const toml::table* part = (*list)[i].as_table();
      const auto one = part == nullptr ? std::nullopt : region(*part, false);
      if (one) {
        joined = !joined ? *one : std::string_view(key) == "any" ? *joined | *one : *joined & *one;
      }
    }
    if (joined) {
      meet(*joined);
    } else {
      wrong_type(*node, key, "a list of regions");
    }
  }
  if (const toml::node* node = table.get("not")) {
    const toml::table* part = node->as_table();
    const auto one = part == nullptr ? std::nullopt : region(*part, false);
    if (one) {
      meet(!*one);
    } else {
      wrong_type(*node, "not", "a region");
    }
  }
  if (!all) {
    refuse(table.source(), Error(ProjectError::missing_key)
                               .about("the region")
                               .got("without a shape")
                               .expected("box, half_space, polygon, any, all or not"));
  }
  return all;
}

void SpaceReader::add_region(const ConfigurationSpace* space, const toml::table& table) {
  const std::string name = text(table, "name", "region");
  const std::string rule = text(table, "rule", "forbid");
  const std::size_t before = errors_.size();
  const std::optional<Region> one = region(table, true);
  if (rule != "forbid" && rule != "require") {
    refuse(table.get("rule")->source(), Error(ProjectError::wrong_value)
                                            .about("rule")
                                            .got('"' + rule + '"')
                                            .expected("forbid or require"));
  } else if (one && errors_.size() == before) {
    ConfigurationSpace::NamedRegion added{name, *one, rule == "forbid"};
    if (const auto taken = space != nullptr ? space->takes(added) : Expected<void>(); !taken) {
      refuse(table.source(), taken.error());
    } else {
      regions_.push_back(std::move(added));
    }
  }
}

}  // namespace flyball::study
