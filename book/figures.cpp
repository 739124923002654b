#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <optional>
#include <ranges>

#include <fmt/format.h>

#include <flyball/core/text.hpp>
#include <flyball/io/file.hpp>

#include "book/figure_functions.hpp"
#include "book/figures.hpp"
#include "book/reference.hpp"

namespace flyball::book {

namespace {

/// A figure function's refusal as the error that it is.
template <FigureResult (*figure)()>
Expected<FigureResult> compute() {
  try {
    return figure();
  } catch (const tl::bad_expected_access<Error>& refusal) {
    return tl::unexpected(refusal.error());
  }
}

constexpr std::array table{
    FigureEntry{"2.3", "PD controller on an elevator", "2.2", compute<figure_2_3>},
    FigureEntry{"2.5", "P controller on a flywheel with steady-state error", "2.3",
                compute<figure_2_5>},
    FigureEntry{"2.6", "PI controller on a flywheel without overshoot", "2.3", compute<figure_2_6>},
    FigureEntry{"2.7", "PI controller on a flywheel with overshoot", "2.3", compute<figure_2_7>},
    FigureEntry{"2.9", "Underdamped, overdamped, critically damped responses", "2.5",
                compute<figure_2_9>},
    FigureEntry{"6.1", "Impulse response against the place of the pole", "6.4",
                compute<figure_6_1>},
    FigureEntry{"6.3", "Elevator response", "6.9.4", compute<figure_6_3>},
    FigureEntry{"6.5", "Flywheel response", "6.10.3", compute<figure_6_5>},
    FigureEntry{"6.6", "Position step of a motor with inductance", "6.10.7", compute<figure_6_6>},
    FigureEntry{"6.7", "Position step of a motor without inductance", "6.10.7",
                compute<figure_6_7>},
    FigureEntry{"6.9", "Single-jointed arm response", "6.11.4", compute<figure_6_9>},
    FigureEntry{"7.1", "Mapping of the complex plane from continuous (left) to discrete (right)",
                "7.1", compute<figure_7_1>},
    FigureEntry{"7.2", "Single poles on the real axis", "7.1.2", compute<figure_7_2>},
    FigureEntry{"7.3", "Complex conjugate poles", "7.1.2", compute<figure_7_3>},
    FigureEntry{"7.4", "Aliasing", "7.1.3", compute<figure_7_4>},
    FigureEntry{"7.5", "Taylor series expansions of the exponential", "7.3.1", compute<figure_7_5>},
    FigureEntry{"7.6", "Mapping of the complex plane from continuous (left) to discrete (right)",
                "7.6", compute<figure_7_6>},
    FigureEntry{"7.7", "Cost-to-go for elevator model", "7.7.2", compute<figure_7_7>},
    FigureEntry{"7.8", "Second-order CIM motor response with pole placement and LQR", "7.7.4",
                compute<figure_7_8>},
    FigureEntry{"7.10", "Second-order CIM motor response with plant inversion", "7.8.1",
                compute<figure_7_10>},
    FigureEntry{"8.3", "Drivetrain response", "8.7.1", compute<figure_8_3>},
    FigureEntry{"8.4", "LTV differential drive, first-order: path", "8.7.4", compute<figure_8_4>},
    FigureEntry{"8.5", "LTV differential drive, first-order: response", "8.7.4",
                compute<figure_8_5>},
    FigureEntry{"8.6", "LTV differential drive in the global frame: path", "8.7.4",
                compute<figure_8_6>},
    FigureEntry{"8.7", "LTV differential drive in the global frame: response", "8.7.4",
                compute<figure_8_7>},
    FigureEntry{"8.8", "LTV differential drive: path", "8.7.5", compute<figure_8_8>},
    FigureEntry{"8.9", "LTV differential drive: response", "8.7.5", compute<figure_8_9>},
    FigureEntry{"8.10", "Ramsete: path", "8.8.2", compute<figure_8_10>},
    FigureEntry{"8.11", "Ramsete: response", "8.8.2", compute<figure_8_11>},
    FigureEntry{"8.12", "LTV unicycle: path", "8.9", compute<figure_8_12>},
    FigureEntry{"8.13", "LTV unicycle: response", "8.9", compute<figure_8_13>},
    FigureEntry{"9.1", "Probability density function", "9.3.1", compute<figure_9_1>},
    FigureEntry{"9.2", "Joint probability density function", "9.3.4", compute<figure_9_2>},
    FigureEntry{"9.3", "State estimates and measurements with Kalman filter", "9.6.4",
                compute<figure_9_3>},
    FigureEntry{"9.4", "Robot position estimate and variance with Kalman filter", "9.6.4",
                compute<figure_9_4>},
    FigureEntry{"9.5", "Wall position estimate and variance with Kalman filter", "9.6.4",
                compute<figure_9_5>},
    FigureEntry{"9.6", "Robot position with Kalman smoother", "9.7.2", compute<figure_9_6>},
    FigureEntry{"9.7", "Robot velocity with Kalman smoother", "9.7.2", compute<figure_9_7>},
    FigureEntry{"9.8", "Wall position with Kalman smoother", "9.7.2", compute<figure_9_8>},
    FigureEntry{"9.9", "Robot position variance with Kalman smoother", "9.7.2",
                compute<figure_9_9>},
    FigureEntry{"10.1", "Pose estimation: paths", "10.2.4", compute<figure_10_1>},
    FigureEntry{"10.2", "Pose estimation: error of x", "10.2.4", compute<figure_10_2>},
    FigureEntry{"10.3", "Pose estimation: error of y", "10.2.4", compute<figure_10_3>},
    FigureEntry{"10.4", "Pose estimation: error of the heading", "10.2.4", compute<figure_10_4>},
    FigureEntry{"12.2", "Datasheet curves of a 775pro", "12.1.2", compute<figure_12_2>},
    FigureEntry{"15.1", "Trapezoid profile", "15.1", compute<figure_15_1>},
    FigureEntry{"15.2", "S-curve profile", "15.1", compute<figure_15_2>},
    FigureEntry{"16.1", "Configuration space with independent constraints", "16.2",
                compute<figure_16_1>},
    FigureEntry{"16.2", "Configuration space with dependent constraints", "16.2",
                compute<figure_16_2>},
    FigureEntry{"16.3", "Configuration space with initial state x and goal state r", "16.2",
                compute<figure_16_3>},
    FigureEntry{"16.4", "Configuration space with a path from x to r", "16.2",
                compute<figure_16_4>},
    FigureEntry{"17.1", "Double integrator position", "17.1.1", compute<figure_17_1>},
    FigureEntry{"17.2", "Double integrator velocity", "17.1.1", compute<figure_17_2>},
    FigureEntry{"17.3", "Double integrator acceleration", "17.1.1", compute<figure_17_3>},
    FigureEntry{"B.1", "Elevator with a delay of 50 ms", "B.4", compute<figure_B_1>},
    FigureEntry{"B.2", "Elevator with a delay of 50 ms, compensated", "B.4", compute<figure_B_2>},
    FigureEntry{"B.3", "Drivetrain velocity with a delay of 40 ms", "B.4.2", compute<figure_B_3>},
    FigureEntry{"B.4", "Drivetrain velocity with a delay of 40 ms, compensated", "B.4.2",
                compute<figure_B_4>},
    FigureEntry{"B.5", "Flywheel with a delay of 80 ms", "B.4.2", compute<figure_B_5>},
    FigureEntry{"B.6", "Flywheel with a delay of 80 ms, compensated", "B.4.2", compute<figure_B_6>},
    FigureEntry{"C.1", "Second-order CIM motor response with plant inversion, weighted and not",
                "C.1.2", compute<figure_C_1>},
    FigureEntry{"C.2", "Second-order CIM motor response with various feedforwards", "C.2.3",
                compute<figure_C_2>},
    FigureEntry{"C.3", "Second-order CIM motor response with plant inversions", "C.2.3",
                compute<figure_C_3>},
    FigureEntry{"E.1", "Magnitude of a transfer function", "E.2.2", compute<figure_E_1>},
    FigureEntry{"E.2", "Impulse response against the place of the pole", "E.2.2",
                compute<figure_E_2>},
    FigureEntry{"E.5", "Position step of a motor with inductance", "E.2.3", compute<figure_E_5>},
    FigureEntry{"E.6", "Position step of a motor without inductance", "E.2.3", compute<figure_E_6>},
    FigureEntry{"E.9", "A vector’s coordinates in another basis", "E.3.1", compute<figure_E_9>},
    FigureEntry{"E.10", "Frequency decomposition of a chord", "E.3.2", compute<figure_E_10>},
    FigureEntry{"E.11", "Fourier transform of a chord", "E.3.2", compute<figure_E_11>},
    FigureEntry{"E.13", "A chord at σ = 0 and at σ = −25", "E.3.3", compute<figure_E_13>},
    FigureEntry{"E.14", "Laplace transform of a chord", "E.3.3", compute<figure_E_14>},
    FigureEntry{"E.15", "Position step of a motor with inductance", "E.3.6", compute<figure_E_15>},
    FigureEntry{"E.16", "Position step of a motor without inductance", "E.3.6",
                compute<figure_E_16>},
    FigureEntry{"E.17", "Mapping of the complex plane from continuous (left) to discrete (right)",
                "E.4", compute<figure_E_17>},
    FigureEntry{"E.18", "Single poles on the real axis", "E.4.2", compute<figure_E_18>},
    FigureEntry{"E.19", "Complex conjugate poles", "E.4.2", compute<figure_E_19>},
    FigureEntry{"E.20", "Zero-order hold of a system response", "E.5", compute<figure_E_20>},
    FigureEntry{"E.21", "Discretisation methods applied to velocity data", "E.5",
                compute<figure_E_21>},
    FigureEntry{"E.22", "Positions from discretised velocity data", "E.5", compute<figure_E_22>},
    FigureEntry{"E.23", "Sampling methods for system simulation, T = 0.1 s", "E.5",
                compute<figure_E_23>},
    FigureEntry{"E.24", "Sampling methods for system simulation, T = 0.05 s", "E.5",
                compute<figure_E_24>},
    FigureEntry{"E.25", "Sampling methods for system simulation, T = 0.01 s", "E.5",
                compute<figure_E_25>},
    FigureEntry{"table 7.1", "Mapping from the s-plane to the z-plane", "7.1", compute<table_7_1>},
    FigureEntry{"table 7.2", "Discretisation methods", "7.3.1", compute<table_7_2>},
    FigureEntry{"table 7.3", "Taylor series of the discretisation methods", "7.3.1",
                compute<table_7_3>},
    FigureEntry{"table E.1", "Laplace transforms and their properties", "E.3.4",
                compute<table_E_1>},
    FigureEntry{"table E.2", "Mapping from the s-plane to the z-plane", "E.4", compute<table_E_2>},
    FigureEntry{"table E.3", "Taylor series of the discretisation methods", "E.5",
                compute<table_E_3>},
};

/// "6.3" of "Figure 6.3", "fig. 6.3" or " 6.3 ", "TABLE7.1" of "table 7.1"; figures of the
/// appendices begin with a capital.
std::string bare_id(std::string_view text) {
  std::string id;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      id += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  for (const std::string_view word : {"FIGURE", "FIG.", "FIG"}) {
    if (id.starts_with(word)) {
      return id.substr(word.size());
    }
  }
  return id;
}

/// The figures whose numbers differ the least from one that is not there.
std::string nearest_ids(std::string_view id) {
  const auto distance = [&](const FigureEntry& entry) {
    return edit_distance(id, bare_id(entry.id));
  };
  const std::size_t least = std::ranges::min(table | std::views::transform(distance));
  std::string listed;
  for (const FigureEntry& entry : table) {
    if (distance(entry) == least) {
      listed += fmt::format("{}{}", listed.empty() ? "" : ", ", entry.id);
    }
  }
  return listed;
}

/// A figure or table of the book, computed here or not.
struct BookItem {
  std::string_view section;
  bool drawing = false;
  std::string_view topic;
};

/// Its row of book/items.csv; none for a number that the book does not have.
std::optional<BookItem> find_item(std::string_view id) {
  constexpr std::string_view word = "TABLE";
  const bool is_table = id.starts_with(word);
  const std::string name =
      fmt::format("\n{} {},", is_table ? "Table" : "Figure", id.substr(is_table ? word.size() : 0));
  std::string_view row = book_items();
  const std::size_t place = row.find(name);
  if (place == std::string_view::npos) {
    return std::nullopt;
  }
  row.remove_prefix(place + name.size());
  row = row.substr(0, row.find('\n'));
  const std::size_t first = row.find(',');
  const std::size_t last = row.rfind(',');
  return BookItem{row.substr(0, first), last > first + 1, row.substr(last + 1)};
}

}  // namespace

std::span<const FigureEntry> figures() {
  return table;
}

Expected<const FigureEntry*> find_figure(std::string_view id) {
  const std::string wanted = bare_id(id);
  const auto* found =
      std::ranges::find(table, wanted, [](const FigureEntry& entry) { return bare_id(entry.id); });
  if (found != table.end()) {
    return found;
  }
  std::string got = fmt::format("\"{}\"", id);
  std::string expected = "a figure or table of the book";
  if (const auto item = find_item(wanted)) {
    got += fmt::format(", {}", item->topic);
    expected = "a figure that is computed: this one ";
    expected += item->drawing ? "is a drawing, without numbers"
                              : fmt::format("of section {} is not computed yet", item->section);
  }
  return tl::unexpected(Error(ArgumentError::unknown_name)
                            .in("book")
                            .about("figure")
                            .got(std::move(got))
                            .expected(std::move(expected))
                            .hint(fmt::format("the nearest: {}; `flyball book --list` shows all",
                                              nearest_ids(wanted))));
}

std::string to_csv(const FigureResult& figure) {
  std::string text;
  for (const TimeSeries::Column& column : figure.columns) {
    text += fmt::format("{}{}", text.empty() ? "" : ",", column.name);
    text += column.unit.empty() ? "" : fmt::format(" ({})", column.unit);
  }
  text += '\n';
  const std::size_t rows = figure.columns.empty() ? 0 : figure.columns.front().values.size();
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = 0; i < figure.columns.size(); ++i) {
      text += fmt::format("{}{}", i == 0 ? "" : ",", figure.columns[i].values[row]);
    }
    text += '\n';
  }
  return text;
}

std::string file_stem(const FigureResult& figure) {
  std::string stem = figure.id.starts_with("table") ? figure.id : "figure_" + figure.id;
  std::ranges::replace(stem, '.', '_');
  std::ranges::replace(stem, ' ', '_');
  return stem;
}

Expected<std::vector<std::string>> write_figure(const FigureResult& figure,
                                                const std::string& folder) {
  const auto png = std::visit([](const auto& plot) { return render_png(plot); }, figure.picture);
  const auto svg = std::visit([](const auto& plot) { return render_svg(plot); }, figure.picture);
  for (const auto* picture : {&png, &svg}) {
    if (!*picture) {
      return tl::unexpected(picture->error());
    }
  }
  std::error_code failure;
  const bool made = std::filesystem::create_directories(folder, failure);
  if (failure) {
    return tl::unexpected(Error(FileError::not_writable)
                              .in(folder)
                              .about("the output folder")
                              .got("not writable")
                              .hint("give a folder that you may write to")
                              .with("system", failure.message()));
  }
  const auto path = (std::filesystem::path(folder) / file_stem(figure)).string();
  const std::array<std::pair<std::string, std::string>, 3> files{
      {{path + ".png", *png}, {path + ".svg", *svg}, {path + ".csv", to_csv(figure)}}};
  std::vector<std::string> written;
  for (const auto& [name, contents] : files) {
    if (auto done = write_file_atomically(name, contents); !done) {
      // A figure is there with all its files, or not at all.
      for (const std::string& earlier : written) {
        std::filesystem::remove(earlier, failure);
      }
      if (made) {
        std::filesystem::remove(folder, failure);  // only if it is empty
      }
      return tl::unexpected(done.error());
    }
    written.push_back(name);
  }
  return written;
}

}  // namespace flyball::book
