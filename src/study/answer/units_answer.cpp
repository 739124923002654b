#include <algorithm>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/study/units.hpp>

#include "core/try.hpp"

namespace flyball::study {

namespace {

constexpr std::string_view how_written =
    "A quantity is a number and a unit: \"8 kg\", \"2.54cm\", \"-1.5e3 rpm\", \"2 m/s^2\", \"3 "
    "rotations per second\". Spaces, \"·\", \"*\" and \"^\" do not matter, case only where a "
    "prefix "
    "hangs on it (mV, MV); plurals are read. A plain number may be a ratio (\"60:8\") or a share "
    "(\"5 %\").";

std::vector<Dimension> dimensions(std::optional<Dimension> of) {
  if (of) {
    return {*of};
  }
  std::vector<Dimension> all;
  for (int d = 0; !to_string(static_cast<Dimension>(d)).empty(); ++d) {
    all.push_back(static_cast<Dimension>(d));
  }
  return all;
}

/// Names of one size together: "in, inch, \"".
struct Size {
  double factor;
  std::vector<std::string> names;
};

std::vector<Size> sizes_of(Dimension dimension) {
  std::vector<Size> sizes;
  for (const NamedUnit& unit : units_of(dimension)) {
    if (unit.text.empty() || unit.text == "inche" || unit.text.starts_with("inche/")) {
      continue;  // a plural's stem is no name to show
    }
    const auto same = std::find_if(sizes.begin(), sizes.end(),
                                   [&](const Size& size) { return size.factor == unit.factor; });
    Size& size = same == sizes.end() ? sizes.emplace_back(Size{unit.factor, {}}) : *same;
    size.names.emplace_back(unit.text);
  }
  return sizes;
}

}  // namespace

Expected<Dimension> find_dimension(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Dimension dimension : dimensions(std::nullopt)) {
    if (to_string(dimension) == name) {
      return dimension;
    }
    names.push_back(to_string(dimension));
  }
  const std::string nearest = nearest_name(name, names);
  return refusal(ArgumentError::unknown_name, {}, "dimension")
      .got(fmt::format("\"{}\"", name))
      .expected(fmt::format("one of {}", fmt::join(names, ", ")))
      .hint(nearest.empty() ? "" : fmt::format("did you mean \"{}\"?", nearest));
}

std::string units_page() {
  std::string page =
      "# Units\n\nEvery quantity of a project file, an option and a log's channel is a number and "
      "a "
      "unit. `flyball units` lists what\nis read, `flyball units velocity` one dimension; this "
      "page "
      "is written by it.\n\n";
  page += std::string(how_written) + "\n";
  for (const Dimension dimension : dimensions(std::nullopt)) {
    page += fmt::format("\n## {}\n\n| written | in {} |\n|---|---|\n", to_string(dimension),
                        si_unit(dimension).empty() ? "one" : si_unit(dimension));
    for (const Size& size : sizes_of(dimension)) {
      page += fmt::format("| `{}` | {:.10g} |\n", fmt::join(size.names, "`, `"), size.factor);
    }
  }
  return page;
}

Answer units_answer(std::optional<Dimension> of) {
  JsonWriter json;
  Table table{
      .header = {"dimension", "unit", "in SI", "written"}, .words = {0, 1, 3}, .wide_column = 3};
  json.object([&] {
    json.add("schema", "flyball.units/1");
    json.list("dimensions", dimensions(of), [&](Dimension dimension) {
      json.object([&] {
        json.add("name", to_string(dimension));
        json.add("si", si_unit(dimension));
        json.list("units", sizes_of(dimension), [&](const Size& size) {
          json.object([&] {
            json.add("factor", size.factor);
            json.add("names", size.names);
          });
        });
      });
    });
  });
  for (const Dimension dimension : dimensions(of)) {
    bool first = true;
    for (const Size& size : sizes_of(dimension)) {
      table.rows.push_back({first ? std::string(to_string(dimension)) : "", size.names.front(),
                            fmt::format("{:.7g}{}{}", size.factor,
                                        si_unit(dimension).empty() ? "" : " ", si_unit(dimension)),
                            fmt::format("{}", fmt::join(size.names, ", "))});
      first = false;
    }
  }
  return {
      .schema = "flyball.units/1",
      .json = std::move(json).text(),
      .document = {
          .sections = {{"units", "", {std::move(table), Paragraph{std::string(how_written)}}}}}};
}

}  // namespace flyball::study
