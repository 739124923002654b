#include <flyball/io/plot.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <stdlib.h>

#include <flyball/core/argument.hpp>
#include <flyball/io/file.hpp>

#include "io/examples.hpp"
#include "io/plot_data.hpp"
#include "io/plot_labels.hpp"
#include "io/plot_script.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::plot_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Plot example(std::size_t points) {
  Plot plot;
  plot.title = "Velocity";
  plot.x_label = "Time (s)";
  PlotLine line{"measured", {}, {}};
  for (std::size_t i = 0; i < points; ++i) {
    line.x.push_back(static_cast<double>(i) / static_cast<double>(points));
    line.y.push_back(std::sin(20.0 * line.x.back()));
  }
  PlotBand band{"interval", line.x, line.y, line.y};
  PlotPanel panel{"Velocity (m/s)", {line}, {band}, {{0.5, "step", true}, {1.2, "limit"}}};
  for (const LineStyle style :
       {LineStyle::dashed, LineStyle::points, LineStyle::steps, LineStyle::crosses,
        LineStyle::circles, LineStyle::squares, LineStyle::frames, LineStyle::diamonds,
        LineStyle::dash_dot, LineStyle::dotted, LineStyle::samples}) {
    panel.lines.push_back({"", {0.1, 0.2}, {0.1, 0.2}, style});
  }
  plot.panels = {panel, {"Voltage (V)", {line}}};
  return plot;
}

SurfacePlot example_surface() {
  return {"Cost-to-go", "x (m)", "v (m/s)", "cost", {0, 1, 2}, {0, 1}, {0, 1, 4, 1, nan, 5}};
}

// A curve that runs along the top, then along the bottom, of a panel of 500 by 200 pixels.
TEST(Plot, LabelsOfMarksStandWhereNoCurveIs) {
  PlotPanel panel;
  panel.lines = {{.x = {0.0, 0.49, 0.51, 1.0}, .y = {0.96, 0.96, 0.04, 0.04}}};
  panel.marks = {{0.1, "settled", true}, {0.7, "settled", true}, {0.72, "late", true}};
  io::PanelView view{io::Range(), io::Range(), false, false, 500.0, 200.0};
  for (io::Range* range : {&view.x, &view.y}) {
    range->include(0.0);
    range->include(1.0);
  }
  io::Labels labels(panel, view);
  EXPECT_LT(labels.place(panel.marks[0], 12.0).height, 0.3);
  const auto second = labels.place(panel.marks[1], 12.0);
  EXPECT_GT(second.height, 0.9);
  // It stands on the side of its mark where the other mark is not; that one's does not meet it.
  EXPECT_TRUE(second.before);
  const auto third = labels.place(panel.marks[2], 12.0);
  EXPECT_FALSE(third.before);
  EXPECT_GT(third.height, 0.9);
  // Where there is no room on one side it stands on the other, and two that must meet do not.
  panel.marks = {{0.98, "settled", true}, {0.985, "settled", true}};
  io::Labels at_the_end(panel, view);
  const auto last = at_the_end.place(panel.marks[0], 12.0);
  const auto beside = at_the_end.place(panel.marks[1], 12.0);
  EXPECT_TRUE(last.before && beside.before);
  EXPECT_GT(std::abs(last.height - beside.height) * 200.0, 15.0);
  // Where there is nothing a label is at the top, after its mark.
  PlotPanel empty;
  empty.marks = {{0.1, "settled", true}};
  const auto free = io::Labels(empty, view).place(empty.marks[0], 12.0);
  EXPECT_EQ(free.height, 0.96);
  EXPECT_FALSE(free.before);
}

TEST(Plot, SvgIsOneElementWithTheTexts) {
  const Expected<std::string> svg = render_svg(example(50));
  ASSERT_TRUE(svg) << to_string(svg.error());
  EXPECT_TRUE(svg->starts_with("<svg"));
  EXPECT_TRUE(svg->ends_with("</svg>\n") || svg->ends_with("</svg>\n\n"));
  for (const char* text : {"<title>Velocity</title>", "Time (s)", "Velocity (m/s)", "Voltage (V)",
                           "measured", "interval", "step", "limit", "#0072B2"}) {
    EXPECT_TRUE(contains(*svg, text) || contains(*svg, "0, 114, 178")) << text;
  }
}

TEST(Plot, PngIsAPng) {
  const Expected<std::string> png = render_png(example(50));
  ASSERT_TRUE(png) << to_string(png.error());
  EXPECT_TRUE(png->starts_with("\x89PNG\r\n\x1A\n"));
  // IHDR's width, big endian at byte 16: 900 pixels at 1.5.
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>((*png)[i]); };
  EXPECT_EQ(byte(18) * 256 + byte(19), 1350);
}

TEST(Plot, TheSamePlotGivesTheSameBytes) {
  EXPECT_EQ(render_svg(example(50)).value(), render_svg(example(50)).value());
  EXPECT_EQ(render_png(example(50)).value(), render_png(example(50)).value());
}

TEST(Plot, PicturesOfOneGnuplotAreThoseOfManyAndARefusedOneCostsItself) {
  Plot marked = example(10);
  marked.panels[0].spans = {{0.0, 3.0, "unused"}, {5.0, 6.0, "unused"}};
  marked.panels[1].y_ticks = {{1.0, "kS"}};
  const Plot wrong;  // No panel.
  const Plot first = example(50);
  const std::vector<const Plot*> plots{&first, &wrong, &marked, &first};
  const auto svgs = render_svgs(plots);
  const auto pngs = render_pngs(plots);
  for (const auto& drawn : {svgs, pngs}) {
    ASSERT_EQ(drawn.size(), plots.size());
    EXPECT_TRUE(drawn[1].error().is(ArgumentError::empty));
  }
  for (const std::size_t i : {0U, 2U, 3U}) {
    ASSERT_TRUE(svgs[i]) << to_string(svgs[i].error());
    EXPECT_EQ(*svgs[i], render_svg(*plots[i]).value());
    EXPECT_EQ(*pngs[i], render_png(*plots[i]).value());
  }
  EXPECT_TRUE(contains(*svgs[2], "kS"));
  // A label once, however many stretches have it.
  EXPECT_EQ(svgs[2]->find("unused"), svgs[2]->rfind("unused"));
}

// What gnuplot refuses of several is told of that one alone.
TEST(Plot, OneThatGnuplotRefusesLeavesTheOthers) {
  const TemporaryFolder folder;
  const std::string fake = folder.file("gnuplot");
  std::ofstream(fake) << "#!/bin/sh\nif grep -q poison /dev/stdin; then echo no >&2; exit 3; fi\n"
                         "exec /usr/bin/gnuplot -d /dev/stdin\n";
  std::filesystem::permissions(fake, std::filesystem::perms::owner_all);
  Plot poisoned = example(3);
  poisoned.title = "poison";
  const Plot good = example(3);
  const std::vector<const Plot*> plots{&good, &poisoned, &good};
  const std::string expected = render_svg(good).value();
  const std::string before = ::getenv("PATH");
  ::setenv("PATH", (fake.substr(0, fake.rfind('/')) + ":" + before).c_str(), 1);
  const auto svgs = render_svgs(plots);
  ::setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(svgs[0].value(), expected);
  EXPECT_EQ(svgs[2].value(), expected);
  ASSERT_FALSE(svgs[1]);
  EXPECT_TRUE(svgs[1].error().is(PlotError::gnuplot_failed));
}

// ln z = -ζω ± jω√(1 - ζ²) on each curve: one of the two is the same along it.
TEST(Plot, AGridOfDampingLiesBehindThePoles) {
  for (const bool discrete : {true, false}) {
    const Plot plot = pole_plot("", {{"a", {{-0.5, 0.0}, {-0.2, 0.3}}, {}}}, discrete);
    const std::vector<PlotLine>& lines = plot.panels[0].lines;
    ASSERT_EQ(lines[0].style, LineStyle::guide);
    EXPECT_EQ(lines[1].style, LineStyle::crosses);
    std::size_t curves = 0;
    std::vector<std::complex<double>> curve;
    for (std::size_t i = 0; i < lines[0].x.size(); ++i) {
      const std::complex<double> at(lines[0].x[i], lines[0].y[i]);
      if (!std::isnan(at.real())) {
        curve.push_back(discrete ? std::log(at) : at);
        continue;
      }
      ++curves;
      const std::complex<double> a = curve[10];
      const std::complex<double> b = curve[30];
      const bool same_frequency = std::abs(std::abs(a) - std::abs(b)) < 1e-9;
      const bool same_ratio = std::abs(a.real() / std::abs(a) - b.real() / std::abs(b)) < 1e-9;
      EXPECT_NE(same_frequency, same_ratio);
      curve.clear();
    }
    EXPECT_EQ(curves, 20U);
  }
}

TEST(Plot, TextIsNeverAProgram) {
  const TemporaryFolder folder;
  const std::string bait = folder.file("owned");
  Plot plot = example(3);
  const std::string evil = "'\n`touch " + bait + "` $(touch " + bait + ") \"; system('touch " +
                           bait + "') @x {/Symbol a} \\n <b>&amp; θ̇";
  plot.title = evil;
  plot.x_label = evil;
  plot.panels[0].y_label = evil;
  plot.panels[0].lines[0].label = evil;
  plot.panels[0].bands[0].label = evil;
  plot.panels[0].marks[0].label = evil;
  const Expected<std::string> svg = render_svg(plot);
  ASSERT_TRUE(svg) << to_string(svg.error());
  EXPECT_TRUE(contains(*svg, "{/Symbol a} \\n &lt;b&gt;&amp;amp; θ̇"));
  EXPECT_EQ(folder.names(), std::set<std::string>{});
}

TEST(Plot, LongSeriesStaySmallAndKeepTheirExtremes) {
  Plot plot;
  PlotLine line{"", {}, {}};
  for (int i = 0; i < 300'000; ++i) {
    line.x.push_back(i);
    line.y.push_back(i == 123'456 ? 5.0 : std::sin(0.37 * i));
  }
  PlotLine scatter = line;
  scatter.style = LineStyle::points;
  plot.panels = {{"", {line}}};
  const Expected<std::string> svg = render_svg(plot);
  ASSERT_TRUE(svg) << to_string(svg.error());
  EXPECT_LT(svg->size(), 120'000U);
  plot.panels = {{"", {scatter}}};
  EXPECT_LT(render_svg(plot).value().size(), 500'000U);

  // The single spike decides the height of the curve: without it the picture differs.
  const std::string with = render_svg({.panels = {{"", {line}}}}).value();
  line.y[123'456] = 0.0;
  PlotPanel flat{"", {line}};
  flat.marks.push_back({5.0, "", false});  // the same range of y
  EXPECT_NE(with, render_svg({.panels = {flat}}).value());
}

TEST(Plot, TicksAreOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_DOUBLE_EQ(io::tick_step(1.0, 10), 0.1);
  EXPECT_DOUBLE_EQ(io::tick_step(1.0, 9), 0.2);
  EXPECT_DOUBLE_EQ(io::tick_step(8.9, 5), 2.0);
  EXPECT_DOUBLE_EQ(io::tick_step(2400.0, 5), 500.0);
  EXPECT_DOUBLE_EQ(io::tick_step(60.0, 1), 100.0);
  EXPECT_DOUBLE_EQ(io::tick_step(60.0, 0), 100.0);
  EXPECT_EQ(io::tick_step(1e-300, 5), 0.0);
  EXPECT_EQ(io::tick_step(std::numeric_limits<double>::infinity(), 5), 0.0);

  io::Range range;
  range.include(0.004);
  range.include(5.999);
  io::round_out(range, 1.0);
  EXPECT_EQ(range.low(), 0.0);
  EXPECT_EQ(range.high(), 6.0);
  range.include(6.5);
  io::round_out(range, 1.0);
  EXPECT_EQ(range.high(), 6.5);
}

TEST(Plot, NotesAndLimits) {
  Plot plot = example(50);
  plot.panels[0].notes = {{0.5, 0.5, "here"}, {nan, 0.0, "nowhere"}};
  plot.panels[0].y_limits = PlotLimits{-0.5, 0.5};
  const std::string svg = render_svg(plot).value();
  EXPECT_TRUE(contains(svg, "here"));
  EXPECT_FALSE(contains(svg, "nowhere"));
  plot.panels[0].y_limits.reset();
  EXPECT_NE(svg, render_svg(plot).value());
}

TEST(Plot, GapsConstantsAndNothing) {
  Plot plot = example(3);
  plot.panels = {
      {"gap", {{"", {0, 1, 2, 3}, {1, nan, std::numeric_limits<double>::infinity(), 2}}}},
      {"constant", {{"", {0, 1}, {5, 5}}}},
      {"one point", {{"", {1}, {1}}}},
      {"tiny", {{"", {0, 1}, {1e-320, 2e-320}}}},
      {"huge", {{"", {0, 1}, {-1e308, 1e308}}}},
      {"nothing", {{"", {}, {}}}, {{"", {}, {}, {}}}},
      {"nan", {{"", {nan}, {nan}}}, {}, {{nan, "lost"}}}};
  const Expected<std::string> svg = render_svg(plot);
  ASSERT_TRUE(svg) << to_string(svg.error());
  EXPECT_TRUE(contains(*svg, "no data"));
}

TEST(Plot, LogarithmicAxesSkipWhatHasNoLogarithm) {
  Plot plot;
  plot.log_x = true;
  plot.panels = {{"gain", {{"", {-1, 0, 0.1, 10, 100}, {1, 1, 1, 0, 1e-3}}}, {}, {}, true}};
  const Expected<std::string> svg = render_svg(plot);
  ASSERT_TRUE(svg) << to_string(svg.error());
  plot.panels = {{"nothing positive", {{"", {1, 2}, {-1, -2}}}, {}, {}, true}};
  EXPECT_TRUE(render_svg(plot));
}

TEST(Plot, PolesInTheUnitCircle) {
  const Plot plot =
      pole_plot("Poles", {{"controller", {{0.5, 0.5}, {0.5, -0.5}}, {{0.0, 0.0}}}}, true);
  EXPECT_TRUE(plot.unit_circle);
  EXPECT_TRUE(plot.equal_axes);
  EXPECT_EQ(plot.panels[0].lines.size(), 3U);  // The grid of damping, poles, zeros.
  EXPECT_TRUE(render_svg(plot));
  EXPECT_TRUE(render_svg(pole_plot("Poles", {{"plant", {{-3.0, 0.0}}, {}}}, false)));
  EXPECT_TRUE(render_svg(pole_plot("None", {}, false)));
}

TEST(Plot, Surfaces) {
  SurfacePlot surface = example_surface();
  EXPECT_TRUE(contains(render_svg(surface).value(), "Cost-to-go"));
  surface.from_above = true;
  EXPECT_TRUE(render_png(surface).value().starts_with("\x89PNG"));

  // A map beside it: one picture, whatever may be in it, that carries its pixels itself.
  SurfacePlot right = example_surface();
  right.unit_circle = true;
  surface.equal_axes = true;
  surface.beside.push_back(right);
  const std::string pair = render_svg(surface).value();
  EXPECT_TRUE(contains(pair, "data:image/png;base64,"));
  EXPECT_GT(pair.size(), render_svg(example_surface()).value().size() / 2);
  surface.beside[0].z.pop_back();
  EXPECT_TRUE(render_svg(surface).error().is(ArgumentError::wrong_shape));
  surface.beside.clear();
  surface.x = {0, 1, 3};
  EXPECT_TRUE(render_svg(surface).error().is(ArgumentError::out_of_range));
  surface.from_above = false;  // polygons may be of any width
  EXPECT_TRUE(render_svg(surface));

  surface = example_surface();
  surface.z.pop_back();
  EXPECT_TRUE(render_svg(surface).error().is(ArgumentError::wrong_shape));
  surface.z.assign(6, nan);
  EXPECT_TRUE(render_svg(surface).error().is(ArgumentError::empty));
  surface = example_surface();
  surface.width = 1;
  EXPECT_TRUE(render_svg(surface).error().is(ArgumentError::out_of_range));
}

TEST(Plot, Misuse) {
  EXPECT_TRUE(render_svg(Plot()).error().is(ArgumentError::empty));
  Plot plot = example(3);
  plot.panels[0].lines[0].y.pop_back();
  EXPECT_TRUE(render_svg(plot).error().is(ArgumentError::wrong_shape));
  plot = example(3);
  plot.panels[0].bands[0].high.pop_back();
  EXPECT_TRUE(render_svg(plot).error().is(ArgumentError::wrong_shape));
  plot = example(3);
  plot.width = 1;
  EXPECT_TRUE(render_svg(plot).error().is(ArgumentError::out_of_range));
}

TEST(Plot, WritesFiles) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_svg(folder.file("a.svg"), example(3)));
  ASSERT_TRUE(write_png(folder.file("a.png"), example(3)));
  ASSERT_TRUE(write_svg(folder.file("b.svg"), example_surface()));
  ASSERT_TRUE(write_png(folder.file("b.png"), example_surface()));
  EXPECT_EQ(folder.get("a.svg"), render_svg(example(3)).value());
  EXPECT_TRUE(write_svg(folder.file("no/a.svg"), example(3)).error().is(FileError::not_found));
  EXPECT_EQ(folder.names(), (std::set<std::string>{"a.svg", "a.png", "b.svg", "b.png"}));
}

/// Runs with another PATH, and restores it.
class WithPath {
 public:
  explicit WithPath(const std::string& path) : before_(::getenv("PATH")) {
    ::setenv("PATH", path.c_str(), 1);
  }
  WithPath(const WithPath&) = delete;
  WithPath& operator=(const WithPath&) = delete;
  ~WithPath() { ::setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_;
};

TEST(Plot, AMissingGnuplotIsToldWithWhatToDo) {
  const TemporaryFolder folder;
  const WithPath empty(folder.file("."));
  const Expected<std::string> svg = render_svg(example(3));
  ASSERT_FALSE(svg);
  EXPECT_TRUE(svg.error().is(PlotError::gnuplot_missing));
  EXPECT_EQ(svg.error().kind(), ErrorKind::environment);
  EXPECT_TRUE(contains(to_string(svg.error()), "apt install gnuplot-nox"));
}

// A PNG whose words are missing is none; an SVG is written with the fonts of who looks at it.
TEST(Plot, MissingFontsAreToldWithWhatToDo) {
  const TemporaryFolder folder;
  const std::string none =
      folder.put("fonts.conf",
                 "<?xml version=\"1.0\"?><!DOCTYPE fontconfig SYSTEM \"fonts.dtd\">"
                 "<fontconfig></fontconfig>\n");
  ::setenv("FONTCONFIG_FILE", none.c_str(), 1);
  const Plot plot = example(3);
  const std::vector<const Plot*> plots{&plot, &plot};
  const Expected<std::string> png = render_png(plot);
  const auto pngs = render_pngs(plots);
  const Expected<std::string> surface = render_png(example_surface());
  const Expected<std::string> svg = render_svg(plot);
  ::unsetenv("FONTCONFIG_FILE");
  ASSERT_FALSE(png);
  EXPECT_TRUE(png.error().is(PlotError::no_fonts));
  EXPECT_EQ(png.error().kind(), ErrorKind::environment);
  EXPECT_TRUE(contains(to_string(png.error()), "apt install fonts-dejavu-core"));
  for (const auto& each : pngs) {
    EXPECT_TRUE(!each && each.error().is(PlotError::no_fonts));
  }
  EXPECT_TRUE(!surface && surface.error().is(PlotError::no_fonts));
  EXPECT_TRUE(svg) << to_string(svg.error());
  EXPECT_TRUE(render_png(plot)) << "with fonts it is one";
}

TEST(Plot, WhatGnuplotComplainsAboutIsTold) {
  const TemporaryFolder folder;
  const std::string fake =
      folder.put("gnuplot", "#!/bin/sh\necho 'line 7: no such terminal' >&2\nexit 3\n");
  std::filesystem::permissions(fake, std::filesystem::perms::owner_all);
  const WithPath only(folder.file("."));
  const Expected<std::string> svg = render_svg(example(3));
  ASSERT_FALSE(svg);
  EXPECT_TRUE(svg.error().is(PlotError::gnuplot_failed));
  EXPECT_TRUE(contains(to_string(svg.error()), "no such terminal"));
  EXPECT_TRUE(contains(to_string(svg.error()), "code = 3"));
}

/// What a program that pretends to be gnuplot makes of a plot.
Expected<std::string> drawn_by(const std::string& script, double seconds, bool png = false) {
  const TemporaryFolder folder;
  const std::string fake = folder.put("gnuplot", "#!/bin/sh\nPATH=/usr/bin:/bin\n" + script + "\n");
  std::filesystem::permissions(fake, std::filesystem::perms::owner_all);
  const WithPath only(folder.file("."));
  return png ? render_png(example(3), seconds) : render_svg(example(3), seconds);
}

TEST(Plot, AGnuplotThatHangsIsEnded) {
  const auto start = std::chrono::steady_clock::now();
  for (const char* script : {"sleep 100", "sleep 100 & wait", "exec >&- 2>&-; sleep 100", "yes >&2",
                             "trap '' TERM; sleep 100"}) {
    EXPECT_TRUE(drawn_by(script, 0.5).error().is(PlotError::timed_out)) << script;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(Plot, WhatIsNoPictureIsNotTaken) {
  constexpr double long_enough = 20.0;  // on a busy machine
  for (const char* script : {"yes", "echo '<svg><script>alert(1)</script></svg>'",
                             "echo '<svg></svg></div>'", "echo hello"}) {
    EXPECT_FALSE(drawn_by(script, long_enough)) << script;
  }
  EXPECT_TRUE(drawn_by("yes", long_enough).error().is(PlotError::not_a_picture));
  EXPECT_TRUE(drawn_by("echo hello", long_enough, true).error().is(PlotError::not_a_picture));
  EXPECT_EQ(drawn_by("echo '<svg></svg>'", long_enough).value(), "<svg></svg>\n");
}

// A decade and a bit has 1, 2 and 5 of it as numbers, the digits between without; less than a
// decade even steps; more the decades.
TEST(Ticks, OfALogarithmicAxis) {
  const auto between = [](double low, double high) {
    io::Range range(true);
    range.include(low);
    range.include(high);
    return io::ticks('x', range, 8, true);
  };
  EXPECT_EQ(between(3.0, 30.0),
            "set xtics ('' 3 1, '' 4 1, 5, '' 6 1, '' 7 1, '' 8 1, '' 9 1, 10, 20, '' 30 1)\n");
  EXPECT_EQ(between(2.0, 5.0), "set xtics (2, 2.5, 3, 3.5, 4, 4.5, 5)\n");
  EXPECT_EQ(between(0.001, 1000.0), "set xtics autofreq\n");
  EXPECT_EQ(between(1.0, 1.0), "set xtics autofreq\n");
}

}  // namespace
}  // namespace flyball::plot_test
