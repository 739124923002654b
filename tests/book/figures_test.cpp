#include <charconv>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <flyball/io/csv.hpp>

#include "book/figures.hpp"

namespace flyball::book::figures_test {
namespace {

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// An empty folder that is gone after the test.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "flyball-book-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST(Figures, TheListHasThemInOrderWithTitleAndSection) {
  std::vector<std::string_view> ids;
  for (const FigureEntry& entry : figures()) {
    ids.push_back(entry.id);
    EXPECT_FALSE(entry.title.empty());
    const auto figure = entry.compute();
    ASSERT_TRUE(figure) << to_string(figure.error());
    EXPECT_EQ(figure->id, entry.id);
    EXPECT_EQ(figure->title, entry.title);
    EXPECT_GE(figure->columns.size(), 2u);
  }
  EXPECT_EQ(ids,
            (std::vector<std::string_view>{
                "2.3",       "2.5",       "2.6",       "2.7",       "2.9",      "6.1",  "6.3",
                "6.5",       "6.6",       "6.7",       "6.9",       "7.1",      "7.2",  "7.3",
                "7.4",       "7.5",       "7.6",       "7.7",       "7.8",      "7.10", "8.3",
                "8.4",       "8.5",       "8.6",       "8.7",       "8.8",      "8.9",  "8.10",
                "8.11",      "8.12",      "8.13",      "9.1",       "9.2",      "9.3",  "9.4",
                "9.5",       "9.6",       "9.7",       "9.8",       "9.9",      "10.1", "10.2",
                "10.3",      "10.4",      "12.2",      "15.1",      "15.2",     "16.1", "16.2",
                "16.3",      "16.4",      "17.1",      "17.2",      "17.3",     "B.1",  "B.2",
                "B.3",       "B.4",       "B.5",       "B.6",       "C.1",      "C.2",  "C.3",
                "E.1",       "E.2",       "E.5",       "E.6",       "E.9",      "E.10", "E.11",
                "E.13",      "E.14",      "E.15",      "E.16",      "E.17",     "E.18", "E.19",
                "E.20",      "E.21",      "E.22",      "E.23",      "E.24",     "E.25", "table 7.1",
                "table 7.2", "table 7.3", "table E.1", "table E.2", "table E.3"}));
}

TEST(Figures, AreFoundAsPeopleWriteThem) {
  for (const char* text : {"6.3", "Figure 6.3", "figure6.3", "fig. 6.3", "FIG 6.3", " 6.3 "}) {
    const auto entry = find_figure(text);
    ASSERT_TRUE(entry) << text;
    EXPECT_EQ((*entry)->id, "6.3");
    EXPECT_EQ((*entry)->section, "6.9.4");
  }
  for (const char* text : {"table 7.2", "Table 7.2", "TABLE 7.2 ", "table7.2"}) {
    const auto entry = find_figure(text);
    ASSERT_TRUE(entry) << text;
    EXPECT_EQ((*entry)->id, "table 7.2");
  }
  EXPECT_EQ((*find_figure("figure b.2"))->id, "B.2");
}

TEST(Figures, AnUnknownOneIsAnsweredWithTheNearest) {
  for (const auto& [text, nearest] : std::vector<std::pair<std::string, std::string>>{
           {"6.4", "a drawing, without numbers"},
           {"Figure 7.9", "block diagram of plant inversion"},
           {"figure a.10", "a drawing, without numbers"},
           {"6.14", "a figure or table of the book; the nearest: 6.1, E.14;"},
           {"table 9.2", "the nearest: table 7.2, table E.2;"},
           {"table 5.1", "the nearest: table 7.1, table E.1;"},
           {"theorem 6.9.1", "a figure or table of the book"},
           {"figure 2.4", "the nearest: 2.3, 2.5, 2.6, 2.7, 2.9, 7.4, 8.4, 9.4, B.4;"},
           {"", "the nearest: 2.3, 2.5,"}}) {
    const auto entry = find_figure(text);
    ASSERT_FALSE(entry) << text;
    EXPECT_TRUE(entry.error().is(ArgumentError::unknown_name));
    EXPECT_EQ(entry.error().kind(), ErrorKind::misuse);
    const std::string message = to_string(entry.error());
    EXPECT_NE(message.find(nearest), std::string::npos) << message;
    EXPECT_NE(message.find("\"" + text + "\""), std::string::npos) << message;
  }
}

// What must be seen in a figure, without a look at numbers of others: Figure 6.3 goes up to its
// reference and comes down, within the limits of its battery; Figure 2.3 has no feedforward and
// lags.
TEST(Figures, ShowWhatTheBookSays) {
  const auto column = [](const FigureResult& figure, std::string_view name) {
    for (const auto& candidate : figure.columns) {
      if (candidate.name == name) {
        return candidate.values;
      }
    }
    ADD_FAILURE() << "no column " << name;
    return std::vector<double>{};
  };
  const auto elevator = find_figure("6.3").value()->compute().value();
  const auto position = column(elevator, "position");
  ASSERT_EQ(position.size(), 2040u);
  EXPECT_NEAR(position[1000], 1.524, 1e-12);
  EXPECT_NEAR(position.back(), 0.0, 1e-12);
  for (const double u : column(elevator, "voltage")) {
    ASSERT_LE(std::abs(u), 12.0);
  }

  // Without feedforward a PD controller follows a ramp with the error e = u/K_p - (K_d/K_p) 0 once
  // the velocity has settled, and the voltage that holds 0.5 m/s is 0.5 m/s over -B/A of the
  // continuous model: e = 0.5·(164.209/21.4574)/234.037 = 16.35 mm.
  const auto pd = find_figure("2.3").value()->compute().value();
  const auto reference = column(pd, "reference_position");
  const auto lagging = column(pd, "position");
  EXPECT_NEAR(reference[650] - lagging[650],
              0.5 * 164.20904979369794 / 21.457377744727182 / 234.03740840771752, 1e-9);
}

TEST(Figures, CsvReadsBackToTheSameNumbers) {
  for (const FigureEntry& entry : figures()) {
    const auto figure = entry.compute().value();
    std::istringstream csv(to_csv(figure));
    std::string line;
    std::getline(csv, line);
    std::string header;
    for (const auto& column : figure.columns) {
      header += header.empty() ? "" : ",";
      header += column.name;
      header += column.unit.empty() ? "" : " (" + column.unit + ")";
    }
    EXPECT_EQ(line, header);
    std::size_t row = 0;
    for (; std::getline(csv, line); ++row) {
      const char* at = line.data();
      const char* const end = at + line.size();
      for (const auto& column : figure.columns) {
        ASSERT_LT(row, column.values.size());
        double value = 0.0;
        const auto [next, status] = std::from_chars(at, end, value);
        ASSERT_EQ(status, std::errc()) << line;
        ASSERT_EQ(value, column.values[row]) << entry.id << " row " << row;
        at = next == end ? end : next + 1;
      }
      ASSERT_EQ(at, end) << line;
    }
    for (const auto& column : figure.columns) {
      EXPECT_EQ(column.values.size(), row) << column.name;
    }
  }
}

TEST(Figures, CsvIsALogThatFlyballReads) {
  const auto figure = find_figure("6.9").value()->compute().value();
  const auto log = parse_csv(to_csv(figure), "figure_6_9.csv");
  ASSERT_TRUE(log) << to_string(log.error());
  ASSERT_EQ(log->signals.size(), figure.columns.size() - 1);
  for (std::size_t i = 0; i < log->signals.size(); ++i) {
    EXPECT_EQ(log->signals[i].name, figure.columns[i + 1].name);
    EXPECT_EQ(log->signals[i].unit, figure.columns[i + 1].unit);
    EXPECT_EQ(log->signals[i].time, figure.columns[0].values);
    EXPECT_EQ(log->signals[i].value, figure.columns[i + 1].values);
  }
}

TEST(Figures, AreWrittenAsPictureAndCsv) {
  const Folder folder;
  const auto target = folder.path() / "deep" / "figures";
  for (const FigureEntry& entry : figures()) {
    const auto figure = entry.compute().value();
    const auto written = write_figure(figure, target.string());
    if (!written && written.error().is(PlotError::gnuplot_missing)) {
      GTEST_SKIP() << "no gnuplot";
    }
    ASSERT_TRUE(written) << to_string(written.error());
    ASSERT_EQ(written->size(), 3u);
    EXPECT_EQ(read((*written)[0]).substr(1, 3), "PNG");
    EXPECT_NE(read((*written)[1]).find("<svg"), std::string::npos);
    EXPECT_EQ(read((*written)[2]), to_csv(figure));
  }
  EXPECT_TRUE(std::filesystem::exists(target / "figure_6_3.png"));
  EXPECT_TRUE(std::filesystem::exists(target / "table_7_2.csv"));
  std::set<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(target)) {
    names.insert(file.path().extension().string());
  }
  EXPECT_EQ(names, (std::set<std::string>{".csv", ".png", ".svg"}));  // and nothing temporary
}

TEST(Figures, AFolderThatCannotBeMadeIsAnEnvironmentError) {
  const Folder folder;
  const auto file = folder.path() / "file";
  std::ofstream(file) << "in the way";
  const auto figure = find_figure("6.5").value()->compute().value();
  const auto written = write_figure(figure, (file / "figures").string());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind(), ErrorKind::environment);
  EXPECT_EQ(read(file), "in the way");
}

}  // namespace
}  // namespace flyball::book::figures_test
