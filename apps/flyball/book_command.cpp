#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include <flyball/core/progress.hpp>
#include <flyball/core/text.hpp>
#include <flyball/io/json_writer.hpp>
#include <flyball/report/terminal.hpp>

#include "book/figures.hpp"
#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

constexpr const char* book_schema = "flyball.book/1";

struct BookOptions {
  CommonOptions common;
  std::vector<std::string> figures;
  bool list = false;
  bool check = false;
  bool all = false;
};

/// "Figure 6.3", "Table 7.2".
std::string name_of(const std::string& id) {
  return id.starts_with("table") ? "T" + id.substr(1) : "Figure " + id;
}

int list(const BookOptions& options) {
  if (options.common.json) {
    JsonWriter json;
    json.object([&] {
      json.add("schema", book_schema);
      json.list("figures", book::figures(), [&](const book::FigureEntry& entry) {
        json.object([&] {
          json.add("id", entry.id);
          json.add("section", entry.section);
          json.add("title", entry.title);
        });
      });
    });
    print(json.text());
    return success;
  }
  Table table{.header = {"figure", "section", "title"}, .words = {0, 1, 2}};
  for (const book::FigureEntry& entry : book::figures()) {
    table.rows.push_back(
        {std::string(entry.id), std::string(entry.section), std::string(entry.title)});
  }
  print(report::to_terminal({.sections = {{"figures", "", {std::move(table)}}}}, terminal_style()));
  return success;
}

// The checks of the figures that were asked for, or of all.
Expected<std::vector<book::FigureCheck>> checks_of(const BookOptions& options) {
  if (options.figures.empty()) {
    return book::check_figures();
  }
  std::vector<book::FigureCheck> checks;
  for (const std::string& id : options.figures) {
    auto entry = book::find_figure(id);
    if (!entry) {
      return tl::unexpected(std::move(entry).error());
    }
    const std::vector<book::FigureCheck> of_figure = book::check_figure((*entry)->id);
    checks.insert(checks.end(), of_figure.begin(), of_figure.end());
  }
  return checks;
}

Document document_of(const std::vector<book::FigureCheck>& checks) {
  Table table{.header = {"figure", "number or series", "values", "worst error", "tolerance", ""},
              .words = {0, 1, 5}};
  std::size_t wrong = 0;
  for (const book::FigureCheck& c : checks) {
    const Value mark = c.passed ? Value("ok", Tone::good) : Value("WRONG", Tone::bad);
    table.rows.push_back({c.figure, c.name, fmt::to_string(c.values),
                          fmt::format("{:.2e}", c.worst_error), fmt::format("{:.0e}", c.tolerance),
                          c.problem.empty() ? mark : Value(c.problem, Tone::bad)});
    wrong += c.passed ? 0 : 1;
  }
  const Paragraph sum =
      wrong == 0
          ? Paragraph{fmt::format("all {} agree with their references", checks.size()), Tone::good}
          : Paragraph{fmt::format("{} of {} are WRONG", wrong, checks.size()), Tone::bad};
  return {.sections = {{"checks", "", {std::move(table), sum}}}};
}

int check(const BookOptions& options) {
  const auto checks = checks_of(options);
  if (!checks) {
    return fail(checks.error(), options.common, book_schema);
  }
  const bool passed = std::all_of(checks->begin(), checks->end(),
                                  [](const book::FigureCheck& c) { return c.passed; });
  if (options.common.json) {
    JsonWriter json;
    json.object([&] {
      json.add("schema", book_schema);
      json.add("passed", passed);
      json.list("checks", *checks, [&](const book::FigureCheck& c) {
        json.object([&] {
          json.add("figure", c.figure);
          json.add("name", c.name);
          json.add("values", c.values);
          json.add("worst_error", c.worst_error);
          json.add("tolerance", c.tolerance);
          json.add("passed", c.passed);
          json.add("source", c.source);
          json.add("problem", c.problem);
        });
      });
    });
    print(json.text());
  } else {
    print(report::to_terminal(document_of(*checks), terminal_style()));
  }
  return passed ? success : no_answer;
}

void write(JsonWriter& json, const book::FigureResult& figure,
           const std::vector<std::string>& files) {
  json.object([&] {
    json.add("id", figure.id);
    json.add("title", figure.title);
    json.object("numbers", [&] {
      for (const book::FigureNumber& number : figure.numbers) {
        json.object(number.name, [&] {
          json.add("value", number.value);
          json.add("unit", number.unit);
        });
      }
    });
    json.add("files", files);
  });
}

std::string text_of(const book::FigureResult& figure, const std::vector<std::string>& files) {
  std::string text = fmt::format("{}: {}\n", name_of(figure.id), figure.title);
  for (const book::FigureNumber& number : figure.numbers) {
    text += fmt::format("  {} = {:.6g} {}\n", number.name, number.value, number.unit);
  }
  for (const std::string& file : files) {
    text += fmt::format("  {}\n", file);
  }
  return text;
}

int draw(const BookOptions& options) {
  const std::string folder = options.common.out.empty() ? "." : options.common.out;
  JsonWriter json;
  json.open('{');
  json.add("schema", book_schema);
  json.key("figures");
  json.open('[');
  std::size_t done = 0;
  for (const std::string& id : options.figures) {
    tell_progress("draws figures", done++, options.figures.size());
    const auto entry = book::find_figure(id);
    if (!entry) {
      return fail(entry.error(), options.common, book_schema);
    }
    const auto figure = (*entry)->compute();
    if (!figure) {
      return fail(figure.error(), options.common, book_schema);
    }
    const auto files = book::write_figure(*figure, folder);
    if (!files) {
      return fail(files.error(), options.common, book_schema);
    }
    if (options.common.json) {
      write(json, *figure, *files);
    } else {
      print(printable(text_of(*figure, *files)));
    }
  }
  if (options.common.json) {
    json.close(']');
    json.close('}');
    print(json.text());
  }
  return success;
}

}  // namespace

void add_book_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "book", "Draw figures of Controls Engineering in FRC, and check them against references");
  auto options = std::make_shared<BookOptions>();
  command->add_option("FIGURE", options->figures, "Figures by number, such as 6.3");
  command->add_flag("--all", options->all, "Draw every figure that is there");
  command->add_flag("--list", options->list, "List the figures that are there");
  command->add_flag("--check", options->check,
                    "Compare with reference numbers; exit status 1 if any is off");
  add_common_options(*command, options->common,
                     "Write picture (PNG, SVG) and CSV here (this folder if absent)");
  command->callback([options, &invocation] {
    int& status = invocation.status;
    if (options->all) {
      options->figures.clear();
      for (const book::FigureEntry& entry : book::figures()) {
        options->figures.emplace_back(entry.id);
      }
    }
    if (options->list) {
      status = list(*options);
    } else if (options->check) {
      status = check(*options);
    } else if (options->figures.empty()) {
      status = fail(Error(ArgumentError::empty)
                        .about("book")
                        .got("called without a figure")
                        .expected("a figure's number, --all, --list or --check"),
                    options->common, book_schema);
    } else {
      status = draw(*options);
    }
  });
}

}  // namespace flyball::app
