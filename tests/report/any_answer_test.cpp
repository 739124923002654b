// A job that the library does not know: whoever answers a document is shown.
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include <flyball/io/file.hpp>
#include <flyball/report/terminal.hpp>
#include <flyball/report/write_report.hpp>

namespace flyball::report::any_answer_test {
namespace {

Answer pendulum() {
  Facts facts;
  facts.add("period", quantity(2.006, "s"));
  facts.add("damping", "none", Tone::caution);
  Table table{.caption = "Energy:", .header = {"at", "J"}};
  table.rows = {{"top", quantity(9.81, "J", 4, /*shown=*/false)},
                {"bottom", Value("0", Tone::quiet)}};
  Answer answer{.schema = "mine.pendulum/1", .json = R"({"schema":"mine.pendulum/1"})"};
  answer.document = {
      .title = "Pendulum",
      .verdict = {Tone::caution, "It swings.", {"nothing slows it"}},
      .sections = {{"motion", "Motion", {facts, table, Paragraph{"Undamped."}}},
                   {"code", "Code", {Code{"C", "swing();\n", "c.txt"}}},
                   {"next", "Next", {Steps{{"Push it.", "Watch <it>."}}}},
                   diagnostics_section({{"no_air", Severity::warning, "a vacuum"}})}};
  answer.document.origins.add("seed", "4");
  Figure angle{"motion", "angle", "Angle", "The angle over time.", {}};
  angle.plot.panels = {{.y_label = "Angle (rad)", .lines = {{.x = {0, 1, 2}, .y = {0, 1, 0}}}}};
  answer.figures = {angle};
  answer.files = {{"data/angle.csv", "time,angle\n"}};
  return answer;
}

TEST(AnyAnswer, OnATerminal) {
  EXPECT_EQ(to_terminal(pendulum().document),
            "Pendulum\n"
            "It swings.\n"
            "  - nothing slows it\n"
            "\n"
            "Motion\n"
            "  period   2.006 s\n"
            "  damping  none\n"
            "\n"
            "  Energy:\n"
            "  at         J\n"
            "  ──────  ────\n"
            "  top     9.81\n"
            "  bottom     0\n"
            "\n"
            "  Undamped.\n"
            "\n"
            "Code\n"
            "  C\n"
            "  swing();\n"
            "\n"
            "Next\n"
            "  1. Push it.\n"
            "  2. Watch <it>.\n"
            "\n"
            "What was noticed\n"
            "  warning  a vacuum [no_air]\n");
}

TEST(AnyAnswer, WithoutATitleIsItsBlocks) {
  Table table{.header = {"a", "b"}};
  table.rows = {{"x", "1"}};
  EXPECT_EQ(to_terminal({.sections = {{"", "", {table, Paragraph{"so"}}}}}),
            "  a  b\n  ─  ─\n  x  1\n\n  so\n");
  EXPECT_EQ(to_terminal({}), "");
}

TEST(AnyAnswer, AsAPageWithItsFilesBesideIt) {
  const std::string folder = (std::filesystem::temp_directory_path() /
                              ("flyball_any_answer_" + std::to_string(::getpid())))
                                 .string();
  const auto written = write_report(pendulum(), folder, {.command = "pendulum --go"});
  ASSERT_TRUE(written) << to_string(written.error());
  const std::string page = read_file(folder + "/index.html").value();
  for (const char* part :
       {"<h1>Pendulum</h1>", "▲ It swings.", "<li>nothing slows it</li>", "2.006 s", "<svg",
        "<caption>Energy:</caption>", "swing();",
        "<ol class=\"steps\">\n<li>Push it.</li>\n<li>Watch &lt;it&gt;.</li>\n</ol>", "a vacuum",
        "no_air", "pendulum --go", "href=\"result.json\"", "href=\"data/angle.csv\"",
        "href=\"pictures/angle.png\"",
        "<th scope=\"row\" class=\"w\">seed</th><td class=\"w\">4</td>"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(read_file(folder + "/result.json").value(), pendulum().json + "\n");
  EXPECT_EQ(read_file(folder + "/data/angle.csv").value(), "time,angle\n");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace flyball::report::any_answer_test
