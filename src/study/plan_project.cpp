// A configuration space as a TOML file.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/plan.hpp>
#include <flyball/study/project.hpp>

#include "core/try.hpp"
#include "study/space_reader.hpp"

namespace flyball::study {

namespace {

/// The space, the mechanism in it and what is asked.
class PlanReader : public SpaceReader {
 public:
  using SpaceReader::SpaceReader;

  ExpectedAll<PlanJob> read(const PlanOverrides& given) {
    if (!errors_.empty()) {
      return tl::unexpected(Errors(std::move(errors_)));
    }
    known(root_, "the file",
          {"plan", "axis", "region", "mechanism", "joint", "body", "obstacle", "mass", "holding"});
    std::vector<SpaceAxis> axes;
    each("axis", [&](const toml::table& table) {
      axes.push_back(axis(table));
      check_axis(axes, table);
    });
    if (axes.empty()) {
      refuse({}, Error(ProjectError::missing_key)
                     .about("[[axis]]")
                     .got("missing")
                     .hint("name what moves: [[axis]] name = \"arm\", low = \"-90 deg\", high = "
                           "\"90 deg\""));
    }
    axes_ = axes;
    if (axes.empty()) {
      return tl::unexpected(Errors(std::move(errors_)));
    }
    auto space = ConfigurationSpace::create(axes);
    if (!space && errors_.empty()) {
      refuse({}, std::move(space).error());
    }
    // What else is wrong is told with what is wrong with the axes.
    const bool whole = space.has_value();
    if (!whole) {
      space = ConfigurationSpace::create({SpaceAxis{.low = 0.0, .high = 1.0}});
    }
    each("region", [&](const toml::table& table) { add_region(whole ? &*space : nullptr, table); });
    if (whole) {
      if (auto constrained = space->constrain(std::move(regions_)); !constrained) {
        refuse({}, std::move(constrained).error());
      }
    }
    read_mechanism();
    if (whole) {
      add_mechanism(*space);
    }
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
  /// An axis that cannot be one is told at its place, so that others are, too.
  void check_axis(const std::vector<SpaceAxis>& axes, const toml::table& table) {
    const SpaceAxis& axis = axes.back();
    const auto at = [&](const char* key) {
      const toml::node* const node = table.get(key);
      return node == nullptr ? table.source() : node->source();
    };
    const bool told = std::any_of(errors_.begin(), errors_.end(), [&](const QuotedError& error) {
      return error.place && error.place->line >= table.source().begin.line;
    });
    const auto alone = ConfigurationSpace::create({axis});
    if (!alone) {
      if (!told) {
        refuse(at("low"), alone.error());
      }
    } else if (const double error = errors_of_axes_.back(); table.contains("error")) {
      if (const auto buffered = alone->with_buffer({&error, 1}); !buffered) {
        refuse(at("error"), buffered.error());
      }
    }
    if (table.contains("name") &&
        std::any_of(axes.begin(), axes.end() - 1,
                    [&](const SpaceAxis& other) { return other.name == axis.name; })) {
      refuse(at("name"), Error(ArgumentError::ambiguous_name)
                             .about("name")
                             .got('"' + axis.name + "\", which another axis has")
                             .expected("different names"));
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
    obstacles_at_.push_back(table.source());
  }
  void read_mechanism() {
    each("joint", [&](const toml::table& table) {
      known(table, "[[joint]]", {"name", "axis", "parent", "slides", "x", "y", "angle"});
      PlanarJoint joint;
      joint.name = text(table, "name");
      joint.coordinate = axis_index(table, "axis", text(table, "axis", joint.name));
      const std::string parent = text(table, "parent");
      const std::size_t before = errors_.size();
      joint.parent = parent.empty() ? -1 : joint_index(table, "parent", parent);
      joint.parent = errors_.size() > before ? -1 : joint.parent;  // it is told: go on
      joint.slides = table.contains("slides")
                         ? flag(table, "slides")
                         : axes_[static_cast<std::size_t>(joint.coordinate)].unit == "m";
      joint.x = optional_quantity(table, "x", Dimension::length).value_or(0.0);
      joint.y = optional_quantity(table, "y", Dimension::length).value_or(0.0);
      joint.angle = optional_quantity(table, "angle", Dimension::angle).value_or(0.0);
      mechanism_.joints.push_back(std::move(joint));
      joints_at_.push_back(table.source());
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
      bodies_at_.push_back(table.source());
    });
    each("obstacle", [&](const toml::table& table) { add_obstacle(table); });
    each("mass", [&](const toml::table& table) {
      known(table, "[[mass]]", {"joint", "at", "mass"});
      mechanism_.masses.push_back({joint_index(table, "joint", text(table, "joint")),
                                   point(table.get("at"), "at"),
                                   needed(table, "mass", Dimension::mass, "[[mass]]")});
      masses_at_.push_back(table.source());
    });
    each("holding", [&](const toml::table& table) {
      known(table, "[[holding]]", {"joint", "most"});
      const int joint = joint_index(table, "joint", text(table, "joint"));
      const bool slides = static_cast<std::size_t>(joint) < mechanism_.joints.size() &&
                          mechanism_.joints[static_cast<std::size_t>(joint)].slides;
      mechanism_.holding.push_back(
          {joint,
           needed(table, "most", slides ? Dimension::force : Dimension::torque, "[[holding]]")});
      holding_at_.push_back(table.source());
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
  }
  void add_mechanism(ConfigurationSpace& space) {
    if (mechanism_.joints.empty() && mechanism_.bodies.empty() && mechanism_.obstacles.empty()) {
      return;
    }
    const std::size_t before = errors_.size();
    const auto added = space.attach(mechanism_);
    if (added) {
      return;
    }
    // Each part beside the joints alone: what is wrong with several is told of all, where they are.
    PlanarMechanism joints;
    joints.joints = mechanism_.joints;
    const auto attempt = [&](const PlanarMechanism& part, const toml::source_region& source) {
      ConfigurationSpace with = space;
      if (const auto taken = with.attach(part); !taken) {
        refuse(source, taken.error());
      }
    };
    const auto each_alone = [&](auto PlanarMechanism::* list,
                                const std::vector<toml::source_region>& places) {
      for (std::size_t i = 0; i < places.size(); ++i) {
        PlanarMechanism part = joints;
        (part.*list).push_back((mechanism_.*list)[i]);
        attempt(part, places[i]);
      }
    };
    if (!joints.joints.empty()) {
      attempt(joints, joints_at_.front());
    }
    if (errors_.size() == before && !joints.joints.empty()) {
      each_alone(&PlanarMechanism::bodies, bodies_at_);
      joints.bodies = mechanism_.bodies;  // an obstacle may spare them
      for (LinkBody& body : joints.bodies) {
        body.radius = 0.0;
        body.from = body.to = {};
      }
      each_alone(&PlanarMechanism::obstacles, obstacles_at_);
      each_alone(&PlanarMechanism::masses, masses_at_);
      each_alone(&PlanarMechanism::holding, holding_at_);
    }
    if (errors_.size() == before) {
      refuse({}, added.error());
    }
  }

  // What is asked.
  void wrong_count(const toml::source_region& source, std::string name, std::size_t count) {
    std::string all;
    for (const SpaceAxis& axis : axes_) {
      all += (all.empty() ? "" : ", ") + axis.name;
    }
    refuse(source, Error(ArgumentError::wrong_shape)
                       .about(std::move(name))
                       .got(fmt::format("of {} value{}", count, count == 1 ? "" : "s"))
                       .expected(fmt::format("of {}, one an axis in their order: {}", axes_.size(),
                                             cut(all, 100))));
  }
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
      if (parts.size() != axes_.size()) {
        wrong_count({}, fmt::format("--{}", key), parts.size());
        return to;
      }
      for (std::size_t k = 0; k < parts.size(); ++k) {
        const Dimension d = dimension_of(axes_[k].unit);
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
      if (list->size() != axes_.size()) {
        wrong_count(node->source(), fmt::format("plan.{}", key), list->size());
        return to;
      }
      for (std::size_t k = 0; k < list->size(); ++k) {
        to.push_back(quantity((*list)[k], dimension_of(axes_[k].unit), std::string(key)));
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
    job.ompl = method == "ompl";
    if (!method.empty() && !job.ompl) {
      if (const auto parsed = parse_path_method(method)) {
        job.search.method = *parsed;
      } else {
        Error error = parsed.error();
        std::string methods;
        for (int i = 0; i <= static_cast<int>(PathMethod::decomposition); ++i) {
          methods += std::string(to_string(static_cast<PathMethod>(i))) + ", ";
        }
        refuse(
            source("method", !given.method.empty()),
            std::move(error).expected("one of " + methods + "or ompl where it is built with it"));
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
    number("period", "", Dimension::time, [&](double value) {
      if (!(value > 0.0)) {
        refuse(source("period", false), Error(ArgumentError::not_positive)
                                            .about("plan.period")
                                            .got(format_number(value) + " s")
                                            .expected("positive"));
      } else {
        job.motion.period = value;
      }
    });
    // Each bound of the search at its place.
    const auto bound = [&](const char* key, auto PathSearch::* member, bool typed) {
      PathSearch one;
      one.*member = job.search.*member;
      if (const auto checked = check(one); !checked) {
        refuse(source(key, typed), checked.error());
      }
    };
    bound("seconds", &PathSearch::seconds, !given.seconds.empty());
    bound("work", &PathSearch::work, false);
    bound("cells", &PathSearch::cells, false);
    bound("nodes", &PathSearch::nodes, false);
    bound("clearance", &PathSearch::clearance, false);
  }

  PlanarMechanism mechanism_{};
  std::vector<toml::source_region> joints_at_{}, bodies_at_{}, obstacles_at_{}, masses_at_{},
      holding_at_{};
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
