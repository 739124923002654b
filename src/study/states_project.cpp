// A file of a state machine: coordinates, sets, states, transitions, sequences.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <flyball/core/argument.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>
#include <flyball/study/project.hpp>
#include <flyball/study/states.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

constexpr std::size_t most_bytes = std::size_t{4} << 20;
constexpr std::size_t most_entries = 10'000;
constexpr int most_depth = 32;  // of sets within each other

struct Axis {
  SpaceAxis axis{};
  Dimension dimension = Dimension::dimensionless;
};

/// Reads tables and says where they are wrong.
class Reader {
 public:
  Reader(std::string_view text, std::string path) : text_(text), path_(std::move(path)) {}

  [[nodiscard]] tl::unexpected<Errors> refuse(const toml::source_region& at, Error error) const {
    const auto line = at.begin.line;
    QuotedError quoted{
        std::move(error).in(line == 0 ? path_
                                      : fmt::format("{}:{}:{}", path_, line, at.begin.column)),
        {},
        {}};
    if (line != 0) {
      quoted.place = Place{line, at.begin.column};
      std::string_view rest = text_;
      for (toml::source_index k = 1; k < line && !rest.empty(); ++k) {
        rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
      }
      std::string words = printable(rest.substr(0, rest.find_first_of("\r\n")));
      std::replace(words.begin(), words.end(), '\t', ' ');
      constexpr std::size_t widest = 100;
      if (at.begin.column <= widest) {
        quoted.excerpt = fmt::format("{:>5} | {}\n{:>5} | {}^", line, cut(words, widest), "",
                                     std::string(at.begin.column - 1, ' '));
      }
    }
    return tl::unexpected(Errors(std::vector<QuotedError>{std::move(quoted)}));
  }
  [[nodiscard]] tl::unexpected<Errors> wrong(const toml::node& node, std::string_view what,
                                             std::string_view expected) const {
    std::string got = "of another type";
    if (const auto* words = node.as_string()) {
      got = fmt::format("\"{}\"", cut(printable(words->get()), 40));
    } else if (const auto* number = node.as_floating_point()) {
      got = fmt::format("{}", number->get());
    } else if (const auto* whole = node.as_integer()) {
      got = fmt::format("{}", whole->get());
    } else if (node.is_array()) {
      got = "a list";
    } else if (node.is_table()) {
      got = "a table";
    }
    return refuse(node.source(), Error(ProjectError::wrong_value)
                                     .about(std::string(what))
                                     .got(got)
                                     .expected(std::string(expected)));
  }
  [[nodiscard]] tl::unexpected<Errors> missing(const toml::table& in, std::string_view what,
                                               std::string_view example) const {
    return refuse(in.source(), Error(ProjectError::missing_key)
                                   .about(std::string(what))
                                   .got("missing")
                                   .hint(fmt::format("for example {}", example)));
  }
  /// Keys of a table that nobody reads.
  [[nodiscard]] ExpectedAll<void> only(const toml::table& table, std::string_view of,
                                       std::initializer_list<std::string_view> known) const {
    for (const auto& [key, value] : table) {
      if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
        const std::string near = nearest_name(key.str(), std::span(known.begin(), known.size()));
        return refuse(key.source(),
                      Error(ProjectError::unknown_key)
                          .about(fmt::format("\"{}\" of {}", cut(printable(key.str()), 40), of))
                          .got("not known")
                          .expected(fmt::format("one of {}", fmt::join(known, ", ")))
                          .hint(near.empty() ? "" : fmt::format("did you mean {}?", near)));
      }
    }
    return {};
  }
  [[nodiscard]] ExpectedAll<std::string> text(const toml::table& table, std::string_view key,
                                              std::string_view of, bool must,
                                              std::string_view example) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      if (!must) {
        return std::string();
      }
      return missing(table, fmt::format("{} of {}", key, of), example);
    }
    if (!node->is_string()) {
      return wrong(*node, key, "a text");
    }
    return node->as_string()->get();
  }
  [[nodiscard]] ExpectedAll<std::vector<std::string>> texts(const toml::table& table,
                                                            std::string_view key) const {
    std::vector<std::string> all;
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      return all;
    }
    if (!node->is_array()) {
      return wrong(*node, key, "a list of texts");
    }
    for (const toml::node& element : *node->as_array()) {
      if (!element.is_string()) {
        return wrong(element, key, "a text");
      }
      all.push_back(element.as_string()->get());
    }
    if (all.size() > most_entries) {
      return wrong(*node, key, "at most 10000 entries");
    }
    return all;
  }
  [[nodiscard]] ExpectedAll<int> whole(const toml::table& table, std::string_view key,
                                       int otherwise) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      return otherwise;
    }
    const auto* number = node->as_integer();
    if (number == nullptr || number->get() < 0 || number->get() > 1000) {
      return wrong(*node, key, "a whole number from 0 to 1000");
    }
    return static_cast<int>(number->get());
  }
  [[nodiscard]] ExpectedAll<bool> flag(const toml::table& table, std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      return false;
    }
    if (!node->is_boolean()) {
      return wrong(*node, key, "true or false");
    }
    return node->as_boolean()->get();
  }
  /// A quantity of a coordinate; a bare number of one without a unit.
  [[nodiscard]] ExpectedAll<double> quantity(const toml::node& node, Dimension dimension,
                                             const std::string& name) const {
    if (dimension == Dimension::dimensionless) {
      if (const auto number = node.value<double>(); number && std::isfinite(*number)) {
        return *number;
      }
      return wrong(node, name, "a finite number");
    }
    if (!node.is_string()) {
      return wrong(node, name,
                   fmt::format("{} with its unit, in quotes: \"{}\"",
                               dimension == Dimension::angle ? "an angle" : "a length",
                               dimension == Dimension::angle ? "30 deg" : "0.5 m"));
    }
    auto value = parse_quantity(node.as_string()->get(), dimension, name);
    if (!value) {
      return refuse(node.source(), std::move(value).error());
    }
    return *value;
  }
  /// The tables of a list [[key]].
  [[nodiscard]] ExpectedAll<std::vector<const toml::table*>> tables(const toml::table& root,
                                                                    std::string_view key) const {
    std::vector<const toml::table*> all;
    const toml::node* node = root.get(key);
    if (node == nullptr) {
      return all;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() > most_entries) {
      return wrong(*node, key, fmt::format("a list of tables: [[{}]]", key));
    }
    for (const toml::node& element : *list) {
      if (!element.is_table()) {
        return wrong(element, key, "a table");
      }
      all.push_back(element.as_table());
    }
    return all;
  }

 private:
  std::string_view text_;
  std::string path_;
};

class StatesFile {
 public:
  StatesFile(const Reader& reader, const toml::table& root) : reader_(reader), root_(root) {}

  ExpectedAll<StatesJob> read(const std::string& path) {
    FLYBALL_CHECK(reader_.only(root_, "the file",
                               {"start", "depth", "interrupts", "strict", "coordinate", "set",
                                "require", "forbid", "state", "transition", "sequence"}));
    FLYBALL_TRY(ConfigurationSpace space, read_space());
    StatesJob job{.path = path, .space = std::move(space)};
    FLYBALL_CHECK(read_sets(job));
    FLYBALL_CHECK(read_states_into(job));
    FLYBALL_CHECK(read_transitions(job));
    FLYBALL_CHECK(read_sequences(job));
    FLYBALL_TRY(job.start, reader_.text(root_, "start", "the file", false, ""));
    if (job.start.empty() && !job.states.empty()) {
      job.start = job.states.front().name;
    }
    FLYBALL_TRY(job.depth, reader_.whole(root_, "depth", job.depth));
    FLYBALL_TRY(job.interrupts, reader_.whole(root_, "interrupts", job.interrupts));
    FLYBALL_TRY(job.strict, reader_.flag(root_, "strict"));
    return job;
  }

 private:
  ExpectedAll<ConfigurationSpace> read_space() {
    FLYBALL_TRY(const auto tables, reader_.tables(root_, "coordinate"));
    if (tables.empty()) {
      return reader_.missing(root_, "[[coordinate]]",
                             "[[coordinate]], name = \"height\", low = \"0 m\", high = \"1.5 m\"");
    }
    std::vector<SpaceAxis> axes;
    for (const toml::table* table : tables) {
      FLYBALL_CHECK(
          reader_.only(*table, "a coordinate", {"name", "kind", "low", "high", "wraps", "scale"}));
      Axis axis;
      FLYBALL_TRY(axis.axis.name,
                  reader_.text(*table, "name", "a coordinate", true, "name = \"height\""));
      FLYBALL_TRY(const std::string kind, reader_.text(*table, "kind", "a coordinate", false, ""));
      if (kind == "angle") {
        axis.dimension = Dimension::angle;
      } else if (kind.empty() || kind == "length") {
        axis.dimension = Dimension::length;
      } else if (kind != "number") {
        return reader_.wrong(*table->get("kind"), "kind", "\"length\", \"angle\" or \"number\"");
      }
      axis.axis.unit = std::string(si_unit(axis.dimension));
      for (const auto& [key, into] :
           {std::pair("low", &axis.axis.low), {"high", &axis.axis.high}}) {
        const toml::node* node = table->get(key);
        if (node == nullptr) {
          return reader_.missing(
              *table, fmt::format("{} of coordinate {}", key, axis.axis.name),
              axis.dimension == Dimension::angle ? "low = \"-90 deg\"" : "low = \"0 m\"");
        }
        FLYBALL_TRY(*into, reader_.quantity(*node, axis.dimension, key));
      }
      FLYBALL_TRY(axis.axis.wraps, reader_.flag(*table, "wraps"));
      if (const toml::node* scale = table->get("scale")) {
        FLYBALL_TRY(axis.axis.scale, reader_.quantity(*scale, axis.dimension, "scale"));
      }
      axes_.push_back(axis);
      axes.push_back(axis.axis);
    }
    auto space = ConfigurationSpace::create(std::move(axes));
    if (!space) {
      return reader_.refuse(tables.front()->source(), std::move(space).error());
    }
    return std::move(*space);
  }

  ExpectedAll<int> axis_of(const toml::node& at, std::string_view name) const {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      if (axes_[i].axis.name == name) {
        return static_cast<int>(i);
      }
    }
    std::vector<std::string_view> known;
    for (const Axis& axis : axes_) {
      known.push_back(axis.axis.name);
    }
    return reader_.refuse(at.source(),
                          Error(ProjectError::wrong_value)
                              .about(fmt::format("\"{}\"", cut(printable(name), 40)))
                              .got("no coordinate")
                              .expected(fmt::format("one of {}", fmt::join(known, ", "))));
  }

  ExpectedAll<std::vector<double>> place(const toml::node& node, std::string_view what) const {
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      return reader_.wrong(node, what, "a table: { height = \"0.2 m\", arm = \"90 deg\" }");
    }
    std::vector<double> q(axes_.size(), 0.0);
    std::vector<bool> said(axes_.size(), false);
    for (const auto& [key, value] : *table) {
      FLYBALL_TRY(const int axis, axis_of(value, key.str()));
      const auto i = static_cast<std::size_t>(axis);
      FLYBALL_TRY(q[i], reader_.quantity(value, axes_[i].dimension, axes_[i].axis.name));
      said[i] = true;
    }
    for (std::size_t i = 0; i < said.size(); ++i) {
      if (!said[i]) {
        return reader_.missing(*table, fmt::format("{} of {}", axes_[i].axis.name, what),
                               fmt::format("{} = …", axes_[i].axis.name));
      }
    }
    return q;
  }

  /// A set's shape: one of box, half_plane, polygon, any, all, outside.
  ExpectedAll<Region> shape(const toml::table& table, int depth) const {
    constexpr std::array<std::string_view, 6> kinds{"box", "half_plane", "polygon",
                                                    "any", "all",        "outside"};
    const toml::node* node = nullptr;
    std::string_view kind;
    for (const std::string_view one : kinds) {
      if (const toml::node* found = table.get(one)) {
        if (node != nullptr) {
          return reader_.refuse(found->source(), Error(ProjectError::wrong_value)
                                                     .about(fmt::format("{} beside {}", one, kind))
                                                     .got("a second shape of one set")
                                                     .expected("one, or any = […], all = […]"));
        }
        node = found;
        kind = one;
      }
    }
    if (node == nullptr) {
      return reader_.missing(table, "the shape of a set",
                             "box = { height = [\"0 m\", \"0.4 m\"] }");
    }
    if (depth > most_depth) {
      return reader_.wrong(*node, kind, "at most 32 sets inside each other");
    }
    if (kind == "box") {
      return box(*node);
    }
    if (kind == "half_plane") {
      return half_plane(*node);
    }
    if (kind == "polygon") {
      return polygon(*node);
    }
    if (kind == "outside") {
      if (!node->is_table()) {
        return reader_.wrong(*node, kind, "a set: { box = … }");
      }
      FLYBALL_TRY(const Region inside, shape(*node->as_table(), depth + 1));
      return !inside;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr || list->empty() || list->size() > 1000) {
      return reader_.wrong(*node, kind, "a list of 1 to 1000 sets");
    }
    std::optional<Region> whole;
    for (const toml::node& element : *list) {
      if (!element.is_table()) {
        return reader_.wrong(element, kind, "a set: { box = … }");
      }
      FLYBALL_TRY(const Region part, shape(*element.as_table(), depth + 1));
      whole = !whole ? part : kind == "any" ? *whole | part : *whole & part;
    }
    return *whole;
  }

  ExpectedAll<Region> box(const toml::node& node) const {
    const toml::table* bounds = node.as_table();
    if (bounds == nullptr || bounds->empty()) {
      return reader_.wrong(node, "box", "a table: { height = [\"0 m\", \"0.4 m\"] }");
    }
    std::optional<Region> whole;
    for (const auto& [key, value] : *bounds) {
      FLYBALL_TRY(const int axis, axis_of(value, key.str()));
      const toml::array* ends = value.as_array();
      if (ends == nullptr || ends->size() != 2) {
        return reader_.wrong(value, key.str(), "a list of the lowest and the highest value");
      }
      const Dimension dimension = axes_[static_cast<std::size_t>(axis)].dimension;
      FLYBALL_TRY(const double low,
                  reader_.quantity(*ends->get(0), dimension, std::string(key.str())));
      FLYBALL_TRY(const double high,
                  reader_.quantity(*ends->get(1), dimension, std::string(key.str())));
      if (!(low <= high)) {
        return reader_.wrong(value, key.str(), "the lowest value first");
      }
      // What reaches a stop goes on beyond it: at the stop one is inside, not on the border.
      const SpaceAxis& of = axes_[static_cast<std::size_t>(axis)].axis;
      constexpr double endless = std::numeric_limits<double>::infinity();
      const Region part = Region::interval(axis, !of.wraps && low <= of.low ? -endless : low,
                                           !of.wraps && high >= of.high ? endless : high);
      whole = whole ? *whole & part : part;
    }
    return *whole;
  }

  ExpectedAll<Region> half_plane(const toml::node& node) const {
    const toml::table* table = node.as_table();
    const toml::node* normal = table != nullptr ? table->get("normal") : nullptr;
    const toml::node* most = table != nullptr ? table->get("at_most") : nullptr;
    if (normal == nullptr || !normal->is_table() || most == nullptr) {
      return reader_.wrong(node, "half_plane",
                           "{ normal = { height = 1.0, arm = 0.2 }, at_most = 1.1 }, in SI");
    }
    FLYBALL_CHECK(reader_.only(*table, "half_plane", {"normal", "at_most"}));
    std::vector<double> of(axes_.size(), 0.0);
    for (const auto& [key, value] : *normal->as_table()) {
      FLYBALL_TRY(const int axis, axis_of(value, key.str()));
      FLYBALL_TRY(of[static_cast<std::size_t>(axis)],
                  reader_.quantity(value, Dimension::dimensionless, std::string(key.str())));
    }
    FLYBALL_TRY(const double offset, reader_.quantity(*most, Dimension::dimensionless, "at_most"));
    return Region::half_space(std::move(of), offset);
  }

  ExpectedAll<Region> polygon(const toml::node& node) const {
    constexpr std::string_view example =
        "{ across = \"arm\", up = \"height\", points = [[\"0 deg\", \"0 m\"], …] }";
    const toml::table* table = node.as_table();
    const toml::array* points = table != nullptr && table->get("points") != nullptr
                                    ? table->get("points")->as_array()
                                    : nullptr;
    if (points == nullptr || table->get("across") == nullptr || table->get("up") == nullptr ||
        points->size() > 1000) {
      return reader_.wrong(node, "polygon", example);
    }
    FLYBALL_CHECK(reader_.only(*table, "polygon", {"across", "up", "points"}));
    FLYBALL_TRY(const std::string across, reader_.text(*table, "across", "polygon", true, ""));
    FLYBALL_TRY(const std::string up, reader_.text(*table, "up", "polygon", true, ""));
    FLYBALL_TRY(const int i, axis_of(*table->get("across"), across));
    FLYBALL_TRY(const int j, axis_of(*table->get("up"), up));
    std::vector<std::array<double, 2>> vertices;
    for (const toml::node& point : *points) {
      const toml::array* pair = point.as_array();
      if (pair == nullptr || pair->size() != 2) {
        return reader_.wrong(point, "points", "a list of two values");
      }
      FLYBALL_TRY(
          const double x,
          reader_.quantity(*pair->get(0), axes_[static_cast<std::size_t>(i)].dimension, across));
      FLYBALL_TRY(
          const double y,
          reader_.quantity(*pair->get(1), axes_[static_cast<std::size_t>(j)].dimension, up));
      vertices.push_back({x, y});
    }
    return Region::polygon(i, j, std::move(vertices));
  }

  ExpectedAll<void> read_sets(StatesJob& job) const {
    std::set<std::string> names;
    FLYBALL_TRY(const auto tables, reader_.tables(root_, "set"));
    for (const toml::table* table : tables) {
      FLYBALL_CHECK(reader_.only(
          *table, "a set", {"name", "box", "half_plane", "polygon", "any", "all", "outside"}));
      NamedSet set;
      FLYBALL_TRY(set.name, reader_.text(*table, "name", "a set", true, "name = \"low\""));
      if (!names.insert(set.name).second) {
        return reader_.wrong(*table->get("name"), "name", "a name that no other set has");
      }
      FLYBALL_TRY(set.region, shape(*table, 0));
      job.sets.push_back(std::move(set));
    }
    for (const char* key : {"require", "forbid"}) {
      FLYBALL_TRY(const auto rules, reader_.tables(root_, key));
      for (const toml::table* table : rules) {
        FLYBALL_CHECK(reader_.only(
            *table, key, {"name", "box", "half_plane", "polygon", "any", "all", "outside"}));
        FLYBALL_TRY(const std::string name,
                    reader_.text(*table, "name", key, true, "name = \"arm over the bumper\""));
        FLYBALL_TRY(const Region region, shape(*table, 0));
        auto done = std::string_view(key) == "require" ? job.space.require(name, region)
                                                       : job.space.forbid(name, region);
        if (!done) {
          return reader_.refuse(table->source(), std::move(done).error());
        }
      }
    }
    return {};
  }

  ExpectedAll<void> read_states_into(StatesJob& job) const {
    FLYBALL_TRY(const auto tables, reader_.tables(root_, "state"));
    if (tables.empty()) {
      return reader_.missing(root_, "[[state]]", "[[state]], name = \"stowed\", at = { … }");
    }
    for (const toml::table* table : tables) {
      FLYBALL_CHECK(reader_.only(*table, "a state", {"name", "at", "within"}));
      MachineState state;
      FLYBALL_TRY(state.name, reader_.text(*table, "name", "a state", true, "name = \"stowed\""));
      const toml::node* at = table->get("at");
      if (at == nullptr) {
        return reader_.missing(*table, fmt::format("at of state {}", cut(state.name, 40)),
                               "at = { height = \"0.2 m\" }");
      }
      FLYBALL_TRY(state.at, place(*at, "at"));
      FLYBALL_TRY(state.within, reader_.texts(*table, "within"));
      job.states.push_back(std::move(state));
    }
    return {};
  }

  ExpectedAll<void> read_transitions(StatesJob& job) const {
    FLYBALL_TRY(const auto tables, reader_.tables(root_, "transition"));
    for (const toml::table* table : tables) {
      FLYBALL_CHECK(
          reader_.only(*table, "a transition", {"from", "event", "to", "via", "order", "within"}));
      MachineTransition transition;
      FLYBALL_TRY(transition.from,
                  reader_.text(*table, "from", "a transition", true, "from = \"stowed\""));
      FLYBALL_TRY(transition.event,
                  reader_.text(*table, "event", "a transition", true, "event = \"raise\""));
      FLYBALL_TRY(transition.to, reader_.text(*table, "to", "a transition", true, "to = \"high\""));
      if (const toml::node* via = table->get("via")) {
        if (!via->is_array() || via->as_array()->size() > 1000) {
          return reader_.wrong(*via, "via", "a list of places");
        }
        for (const toml::node& one : *via->as_array()) {
          FLYBALL_TRY(auto q, place(one, "via"));
          transition.via.push_back(std::move(q));
        }
      }
      if (const toml::node* order = table->get("order")) {
        FLYBALL_TRY(const auto names, reader_.texts(*table, "order"));
        for (const std::string& name : names) {
          FLYBALL_TRY(const int axis, axis_of(*order, name));
          transition.order.push_back(axis);
        }
      }
      FLYBALL_TRY(transition.within, reader_.texts(*table, "within"));
      job.transitions.push_back(std::move(transition));
    }
    return {};
  }

  ExpectedAll<void> read_sequences(StatesJob& job) const {
    FLYBALL_TRY(const auto tables, reader_.tables(root_, "sequence"));
    for (const toml::table* table : tables) {
      FLYBALL_CHECK(reader_.only(*table, "a sequence", {"name", "events", "states", "within"}));
      MachineSequence sequence;
      FLYBALL_TRY(sequence.name, reader_.text(*table, "name", "a sequence", false, ""));
      if (sequence.name.empty()) {
        sequence.name = fmt::format("sequence {}", job.sequences.size() + 1);
      }
      FLYBALL_TRY(sequence.events, reader_.texts(*table, "events"));
      FLYBALL_TRY(sequence.states, reader_.texts(*table, "states"));
      FLYBALL_TRY(sequence.within, reader_.texts(*table, "within"));
      job.sequences.push_back(std::move(sequence));
    }
    return {};
  }

  const Reader& reader_;
  const toml::table& root_;
  std::vector<Axis> axes_;
};

}  // namespace

ExpectedAll<StatesJob> parse_states(std::string_view text, const std::string& path) {
  const Reader reader(text, path);
  toml::table root;
  try {
    root = toml::parse(text);
  } catch (const toml::parse_error& problem) {
    return reader.refuse(problem.source(), Error(ProjectError::syntax)
                                               .about("the file")
                                               .got(std::string(problem.description()))
                                               .expected("TOML"));
  }
  return StatesFile(reader, root).read(path);
}

ExpectedAll<StatesJob> read_states(const std::string& path) {
  FLYBALL_TRY(const std::string text, read_file(path, most_bytes));
  return parse_states(text, path);
}

}  // namespace flyball::study
