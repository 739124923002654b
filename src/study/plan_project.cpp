// A configuration space as a TOML file.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/plan.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

using NameList = std::vector<std::string_view>;

/// Reads one file and keeps all that is wrong with it.
class PlanReader {
 public:
  PlanReader(std::string path, std::string_view text) : path_(std::move(path)), text_(text) {
    try {
      root_ = toml::parse(text);
    } catch (const toml::parse_error& problem) {
      refuse(problem.source(),
             Error(ProjectError::syntax).hint(std::string(problem.description())));
    }
  }

  ExpectedAll<PlanJob> read(const PlanOverrides& given) {
    if (!errors_.empty()) {
      return tl::unexpected(Errors(std::move(errors_)));
    }
    known(root_, "the file",
          {"plan", "axis", "region", "mechanism", "joint", "body", "obstacle", "mass", "holding"});
    std::vector<SpaceAxis> axes;
    each("axis", [&](const toml::table& table) { axes.push_back(axis(table)); });
    if (axes.empty()) {
      refuse(root_.source(), Error(ProjectError::missing_key)
                                 .about("[[axis]]")
                                 .got("missing")
                                 .hint("name what moves: [[axis]] name = \"arm\", low = \"-90 "
                                       "deg\", high = \"90 deg\""));
    }
    axes_ = axes;
    if (axes.empty()) {
      return tl::unexpected(Errors(std::move(errors_)));
    }
    auto space = ConfigurationSpace::create(std::move(axes));
    if (!space) {
      if (errors_.empty()) {
        refuse({}, std::move(space).error());
      }
      return tl::unexpected(Errors(std::move(errors_)));
    }
    each("region", [&](const toml::table& table) { add_region(*space, table); });
    add_mechanism(*space);
    PlanJob job{.path = path_, .space = *space};
    job.motion.limits = limits_;
    job.motion.error = errors_of_axes_;
    job.has_limits = has_limits_;
    read_plan(job, given);
    if (!errors_.empty()) {
      return tl::unexpected(Errors(std::move(errors_)));
    }
    return job;
  }

 private:
  // Places and errors.
  void refuse(const toml::source_region& source, Error error) {
    constexpr std::size_t most = 20;
    if (errors_.size() >= most) {
      return;
    }
    QuotedError quoted{std::move(error).in(source.begin.line == 0
                                               ? path_
                                               : fmt::format("{}:{}:{}", path_, source.begin.line,
                                                             source.begin.column)),
                       {},
                       {}};
    if (source.begin.line != 0) {
      std::size_t from = 0;
      for (toml::source_index i = 1; i < source.begin.line && from != std::string_view::npos; ++i) {
        from = text_.find('\n', from);
        from = from == std::string_view::npos ? from : from + 1;
      }
      if (from != std::string_view::npos) {
        std::string line(text_.substr(from, text_.find('\n', from) - from));
        for (char& c : line) {
          c = static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
        }
        constexpr std::size_t widest = 200;
        if (line.size() <= widest) {
          quoted.excerpt = "  " + line + "\n  " + std::string(source.begin.column - 1, ' ') + "^";
        }
      }
    }
    errors_.push_back(std::move(quoted));
  }
  void wrong_type(const toml::node& node, const std::string& name, std::string what) {
    refuse(
        node.source(),
        Error(ProjectError::wrong_type).about(name).got("another type").expected(std::move(what)));
  }
  void known(const toml::table& table, const std::string& what, const NameList& names) {
    for (const auto& [key, value] : table) {
      if (std::find(names.begin(), names.end(), key.str()) == names.end()) {
        const std::string nearest = nearest_name(key.str(), names);
        refuse(key.source(),
               Error(ProjectError::unknown_key)
                   .about(std::string(key.str()))
                   .got("not a key of " + what)
                   .hint(nearest.empty() ? fmt::format("it has {}", fmt::join(names, ", "))
                                         : fmt::format("did you mean \"{}\"?", nearest)));
      }
    }
  }

  // Values.
  template <class Read>
  void each(std::string_view name, const Read& read) {
    const toml::node* node = root_.get(name);
    if (node == nullptr) {
      return;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr) {
      wrong_type(*node, std::string(name), fmt::format("[[{}]], one for each", name));
      return;
    }
    for (const toml::node& entry : *list) {
      if (const toml::table* table = entry.as_table()) {
        read(*table);
      } else {
        wrong_type(entry, std::string(name), fmt::format("[[{}]], one for each", name));
      }
    }
  }
  std::string text(const toml::table& table, std::string_view key, std::string otherwise = {}) {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      return otherwise;
    }
    if (!node->is_string()) {
      wrong_type(*node, std::string(key), "a text in quotes");
      return otherwise;
    }
    return *node->value_exact<std::string>();
  }
  bool flag(const toml::table& table, std::string_view key) {
    const toml::node* node = table.get(key);
    if (node != nullptr && !node->is_boolean()) {
      wrong_type(*node, std::string(key), "true or false");
    }
    return node != nullptr && node->value_or(false);
  }
  double quantity(const toml::node& node, Dimension dimension, const std::string& name) {
    if (node.is_number() && dimension == Dimension::dimensionless) {
      return node.value<double>().value_or(0.0);
    }
    if (node.is_number() && node.value<double>().value_or(1.0) == 0.0) {
      return 0.0;
    }
    if (!node.is_string()) {
      wrong_type(node, name,
                 fmt::format("a text with a unit, such as \"{}\"", to_text(1.0, dimension)));
      return 0.0;
    }
    const auto value = parse_quantity(*node.value_exact<std::string>(), dimension, name);
    if (!value) {
      refuse(node.source(), value.error());
      return 0.0;
    }
    return *value;
  }
  std::optional<double> optional_quantity(const toml::table& table, std::string_view key,
                                          Dimension dimension) {
    const toml::node* node = table.get(key);
    return node == nullptr ? std::nullopt
                           : std::optional(quantity(*node, dimension, std::string(key)));
  }
  double needed(const toml::table& table, std::string_view key, Dimension dimension,
                const std::string& of) {
    if (const auto value = optional_quantity(table, key, dimension)) {
      return *value;
    }
    refuse(
        table.source(),
        Error(ProjectError::missing_key).about(std::string(key)).got("missing").hint("of " + of));
    return 0.0;
  }
  std::array<double, 2> point(const toml::node* node, const std::string& name,
                              Dimension first = Dimension::length,
                              Dimension second = Dimension::length) {
    const toml::array* list = node == nullptr ? nullptr : node->as_array();
    if (list == nullptr || list->size() != 2) {
      if (node != nullptr) {
        wrong_type(*node, name, "two quantities, such as [\"1 m\", \"0.5 m\"]");
      }
      return {};
    }
    return {quantity((*list)[0], first, name), quantity((*list)[1], second, name)};
  }
  std::array<double, 2> needed_point(const toml::table& table, std::string_view key,
                                     const std::string& of) {
    if (table.get(key) == nullptr) {
      refuse(
          table.source(),
          Error(ProjectError::missing_key).about(std::string(key)).got("missing").hint("of " + of));
    }
    return point(table.get(key), std::string(key));
  }
  std::vector<std::array<double, 2>> points(const toml::table& table, std::string_view key,
                                            Dimension first = Dimension::length,
                                            Dimension second = Dimension::length) {
    std::vector<std::array<double, 2>> all;
    const toml::node* node = table.get(key);
    const toml::array* list = node == nullptr ? nullptr : node->as_array();
    if (list == nullptr) {
      refuse(node == nullptr ? table.source() : node->source(),
             Error(node == nullptr ? ProjectError::missing_key : ProjectError::wrong_type)
                 .about(std::string(key))
                 .got(node == nullptr ? "missing" : "another type")
                 .expected("a list of points"));
      return all;
    }
    for (const toml::node& entry : *list) {
      all.push_back(point(&entry, std::string(key), first, second));
    }
    return all;
  }

  // Axes.
  static Dimension dimension_of(std::string_view unit) {
    return unit == "rad" ? Dimension::angle
           : unit == "m" ? Dimension::length
                         : Dimension::dimensionless;
  }
  SpaceAxis axis(const toml::table& table) {
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
    const Dimension rate = plain   ? place
                           : turns ? Dimension::angular_velocity
                                   : Dimension::velocity;
    const Dimension change = plain   ? place
                             : turns ? Dimension::angular_acceleration
                                     : Dimension::acceleration;
    to.wraps = flag(table, "wraps");
    constexpr double pi = 3.14159265358979323846;
    to.low = to.wraps ? optional_quantity(table, "low", place).value_or(-pi)
                      : needed(table, "low", place, to.name + ", its lower stop");
    to.high =
        to.wraps ? to.low + 2.0 * pi : needed(table, "high", place, to.name + ", its upper stop");
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
  int axis_index(const toml::table& table, std::string_view key, std::string_view name) {
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

  // Regions.
  std::optional<Region> region(const toml::table& table, bool named) {
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
          joined = !joined                          ? *one
                   : std::string_view(key) == "any" ? *joined | *one
                                                    : *joined & *one;
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
  void add_region(ConfigurationSpace& space, const toml::table& table) {
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
      const auto added = rule == "forbid" ? space.forbid(name, *one) : space.require(name, *one);
      if (!added) {
        refuse(table.source(), added.error());
      }
    }
  }

  // The mechanism.
  int joint_index(const toml::table& table, std::string_view key, const std::string& name) {
    NameList names;
    for (std::size_t j = 0; j < mechanism_.joints.size(); ++j) {
      if (mechanism_.joints[j].name == name) {
        return static_cast<int>(j);
      }
      names.push_back(mechanism_.joints[j].name);
    }
    const toml::node* node = table.get(key);
    refuse(
        node == nullptr ? table.source() : node->source(),
        Error(ArgumentError::unknown_name)
            .about(std::string(key))
            .got(name.empty() ? "missing" : '"' + name + '"')
            .expected(names.empty() ? "the name of a [[joint]]"
                                    : fmt::format("one of the joints {}", fmt::join(names, ", "))));
    return 0;
  }
  std::vector<std::string> texts(const toml::node* node, const std::string& name) {
    std::vector<std::string> all;
    if (node == nullptr) {
      return all;
    }
    const toml::array* list = node->as_array();
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
      if ((*list)[i].is_string()) {
        all.push_back((*list)[i].value_or(std::string()));
      }
    }
    if (list == nullptr || all.size() != list->size()) {
      wrong_type(*node, name, "a list of names");
    }
    return all;
  }
  void add_obstacle(const toml::table& table) {
    known(table, "[[obstacle]]",
          {"name", "shape", "at", "radius", "low", "high", "points", "normal", "spares"});
    const std::string name = text(table, "name");
    const std::string shape = text(table, "shape");
    PlanarObstacle to;
    if (shape == "disc") {
      to = PlanarObstacle::disc(name, needed_point(table, "at", "a disc"),
                                needed(table, "radius", Dimension::length, "a disc"));
    } else if (shape == "box") {
      to = PlanarObstacle::box(name, needed_point(table, "low", "a box"),
                               needed_point(table, "high", "a box"));
    } else if (shape == "polygon" || shape == "frame") {
      to = PlanarObstacle::polygon(name, points(table, "points"));
      to.shape = shape == "frame" ? PlanarObstacle::Shape::frame : to.shape;
    } else if (shape == "half_plane") {
      std::array<double, 2> normal{0.0, 1.0};
      if (table.contains("normal")) {
        normal = point(table.get("normal"), "normal", Dimension::dimensionless,
                       Dimension::dimensionless);
      }
      to = PlanarObstacle::half_plane(name, needed_point(table, "at", "a half-plane"), normal);
    } else {
      const toml::node* node = table.get("shape");
      refuse(node == nullptr ? table.source() : node->source(),
             Error(node == nullptr ? ProjectError::missing_key : ProjectError::wrong_value)
                 .about("shape")
                 .got(node == nullptr ? "missing" : '"' + shape + '"')
                 .expected("disc, box, polygon, half_plane or frame"));
      return;
    }
    to.spares = texts(table.get("spares"), "spares");
    mechanism_.obstacles.push_back(std::move(to));
  }
  void add_mechanism(ConfigurationSpace& space) {
    each("joint", [&](const toml::table& table) {
      known(table, "[[joint]]", {"name", "axis", "parent", "slides", "x", "y", "angle"});
      PlanarJoint joint;
      joint.name = text(table, "name");
      joint.coordinate = axis_index(table, "axis", text(table, "axis", joint.name));
      const std::string parent = text(table, "parent");
      joint.parent = parent.empty() ? -1 : joint_index(table, "parent", parent);
      joint.slides = table.contains("slides")
                         ? flag(table, "slides")
                         : axes_[static_cast<std::size_t>(joint.coordinate)].unit == "m";
      joint.x = optional_quantity(table, "x", Dimension::length).value_or(0.0);
      joint.y = optional_quantity(table, "y", Dimension::length).value_or(0.0);
      joint.angle = optional_quantity(table, "angle", Dimension::angle).value_or(0.0);
      mechanism_.joints.push_back(std::move(joint));
    });
    each("body", [&](const toml::table& table) {
      known(table, "[[body]]", {"name", "joint", "from", "to", "radius"});
      LinkBody body;
      body.name = text(table, "name");
      body.joint = joint_index(table, "joint", text(table, "joint"));
      body.from = point(table.get("from"), "from");
      body.to = table.contains("to") ? point(table.get("to"), "to") : body.from;
      body.radius = optional_quantity(table, "radius", Dimension::length).value_or(0.0);
      mechanism_.bodies.push_back(std::move(body));
    });
    each("obstacle", [&](const toml::table& table) { add_obstacle(table); });
    each("mass", [&](const toml::table& table) {
      known(table, "[[mass]]", {"joint", "at", "mass"});
      mechanism_.masses.push_back({joint_index(table, "joint", text(table, "joint")),
                                   point(table.get("at"), "at"),
                                   needed(table, "mass", Dimension::mass, "[[mass]]")});
    });
    each("holding", [&](const toml::table& table) {
      known(table, "[[holding]]", {"joint", "most"});
      const int joint = joint_index(table, "joint", text(table, "joint"));
      const bool slides = static_cast<std::size_t>(joint) < mechanism_.joints.size() &&
                          mechanism_.joints[static_cast<std::size_t>(joint)].slides;
      mechanism_.holding.push_back(
          {joint,
           needed(table, "most", slides ? Dimension::force : Dimension::torque, "[[holding]]")});
    });
    if (const toml::node* node = root_.get("mechanism")) {
      const toml::table* table = node->as_table();
      if (table == nullptr) {
        wrong_type(*node, "mechanism", "a section");
      } else {
        known(*table, "[mechanism]", {"apart", "gravity"});
        mechanism_.gravity = optional_quantity(*table, "gravity", Dimension::acceleration)
                                 .value_or(mechanism_.gravity);
        const toml::array* pairs = table->get_as<toml::array>("apart");
        for (std::size_t i = 0; pairs != nullptr && i < pairs->size(); ++i) {
          const std::vector<std::string> names = texts(&(*pairs)[i], "apart");
          if (names.size() == 2) {
            mechanism_.apart.push_back({names[0], names[1]});
          } else {
            wrong_type((*pairs)[i], "apart", "pairs of names: [[\"claw\", \"mast\"]]");
          }
        }
      }
    }
    if (mechanism_.joints.empty() && mechanism_.bodies.empty() && mechanism_.obstacles.empty()) {
      return;
    }
    if (errors_.empty()) {
      if (const auto added = space.attach(mechanism_); !added) {
        refuse(root_.source(), added.error());
      }
    }
  }

  // What is asked.
  std::vector<double> place(const toml::table* table, std::string_view key,
                            const std::string& typed) {
    std::vector<double> to;
    if (!typed.empty()) {
      std::size_t from = 0;
      std::vector<std::string> parts;
      while (from <= typed.size()) {
        const std::size_t comma = std::min(typed.find(',', from), typed.size());
        parts.push_back(typed.substr(from, comma - from));
        from = comma + 1;
      }
      for (std::size_t k = 0; k < parts.size(); ++k) {
        const Dimension d =
            k < axes_.size() ? dimension_of(axes_[k].unit) : Dimension::dimensionless;
        const auto value = parse_quantity(parts[k], d, fmt::format("--{}", key));
        if (!value) {
          refuse({}, value.error());
        }
        to.push_back(value.value_or(0.0));
      }
    } else {
      const toml::node* node = table == nullptr ? nullptr : table->get(key);
      const toml::array* list = node == nullptr ? nullptr : node->as_array();
      if (list == nullptr) {
        refuse(node != nullptr ? node->source() : toml::source_region{},
               Error(node == nullptr ? ProjectError::missing_key : ProjectError::wrong_type)
                   .about(fmt::format("plan.{}", key))
                   .got(node == nullptr ? "missing" : "another type")
                   .expected("a value an axis, in their order: [\"-57 deg\", \"0.5 m\"]"));
        return to;
      }
      for (std::size_t k = 0; k < list->size(); ++k) {
        to.push_back(quantity(
            (*list)[k], k < axes_.size() ? dimension_of(axes_[k].unit) : Dimension::dimensionless,
            std::string(key)));
      }
    }
    return to;
  }
  void read_plan(PlanJob& job, const PlanOverrides& given) {
    const toml::node* node = root_.get("plan");
    const toml::table* table = node == nullptr ? nullptr : node->as_table();
    if (node != nullptr && table == nullptr) {
      wrong_type(*node, "plan", "a section");
    }
    const toml::table none;
    const toml::table& plan = table == nullptr ? none : *table;
    known(plan, "[plan]",
          {"start", "goal", "method", "seed", "seconds", "work", "cells", "nodes", "clearance",
           "traversal", "period"});
    job.start = place(table, "start", given.start);
    job.goal = place(table, "goal", given.goal);
    const auto source = [&](std::string_view key, bool typed) {
      return typed || plan.get(key) == nullptr ? toml::source_region{} : plan.get(key)->source();
    };
    const std::string method = given.method.empty() ? text(plan, "method") : given.method;
    if (!method.empty()) {
      if (const auto parsed = parse_path_method(method)) {
        job.search.method = *parsed;
      } else {
        refuse(source("method", !given.method.empty()), parsed.error());
      }
    }
    const std::string traversal =
        given.traversal.empty() ? text(plan, "traversal") : given.traversal;
    if (traversal == "sequential") {
      job.motion.traversal = Traversal::sequential;
    } else if (!traversal.empty() && traversal != "synchronized") {
      refuse(source("traversal", !given.traversal.empty()),
             Error(ProjectError::wrong_value)
                 .about("traversal")
                 .got('"' + traversal + '"')
                 .expected("synchronized or sequential"));
    }
    const auto number = [&](std::string_view key, const std::string& typed, Dimension dimension,
                            const auto& put) {
      if (!typed.empty()) {
        const auto value = parse_quantity(typed, dimension, fmt::format("--{}", key));
        if (value) {
          put(*value);
        } else {
          refuse({}, value.error());
        }
      } else if (const auto value = optional_quantity(plan, key, dimension)) {
        put(*value);
      }
    };
    const auto count = [&](auto& to) {
      return [&to](double value) {
        using Count = std::remove_reference_t<decltype(to)>;
        to = static_cast<Count>(std::clamp(std::isfinite(value) ? value : -1.0, -1.0, 2e9));
      };
    };
    long seed = 1;
    number("seed", given.seed, Dimension::dimensionless, [&](double value) {
      if (!(value >= 0.0 && value <= 2e9 && value == std::floor(value))) {
        const toml::node* const set = given.seed.empty() ? plan.get("seed") : nullptr;
        refuse(set != nullptr ? set->source() : toml::source_region{},
               refusal(ArgumentError::out_of_range, {}, given.seed.empty() ? "plan.seed" : "--seed")
                   .got(format_number(value))
                   .expected("a whole number from 0 to 2000000000"));
        return;
      }
      seed = static_cast<long>(value);
    });
    job.search.seed = static_cast<std::uint64_t>(seed);
    number("seconds", given.seconds, Dimension::time,
           [&](double value) { job.search.seconds = value; });
    number("work", "", Dimension::dimensionless, count(job.search.work));
    number("cells", "", Dimension::dimensionless, count(job.search.cells));
    number("nodes", "", Dimension::dimensionless, count(job.search.nodes));
    number("clearance", "", Dimension::dimensionless,
           [&](double value) { job.search.clearance = value; });
    number("period", "", Dimension::time, [&](double value) { job.motion.period = value; });
  }

  std::string path_;
  std::string_view text_;
  toml::table root_{};
  std::vector<SpaceAxis> axes_{};
  std::vector<MotionLimits> limits_{};
  std::vector<double> errors_of_axes_{};
  bool has_limits_ = true;
  PlanarMechanism mechanism_{};
  std::vector<QuotedError> errors_{};
};

}  // namespace

ExpectedAll<PlanJob> plan_job(const std::string& path, const PlanOverrides& given) {
  constexpr std::size_t most_bytes = std::size_t{4} << 20;
  const auto text = read_file(path, most_bytes);
  if (!text) {
    return tl::unexpected(Errors(text.error()));
  }
  return PlanReader(path, *text).read(given);
}

}  // namespace flyball::study
