#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/io/plot.hpp>

/// The figures of *Controls Engineering in the FIRST Robotics Competition*, computed by this
/// library and compared with what the book's own scripts computed. Each figure is one function in
/// the folder of its chapter (book/chapter_6), written to be read as an example of the library.
namespace flyball::book {

/// A number that belongs to a figure, such as a gain.
struct FigureNumber {
  std::string name;  ///< "K_p"
  std::string unit;  ///< "V/m"; empty if it has none.
  double value = 0.0;
};

/// What a figure shows.
struct FigureResult {
  std::string id;     ///< "6.3", or "table 7.2"
  std::string title;  ///< "Elevator response"
  /// The plotted data, columns of equal length; the abscissa (time, or the two axes of a surface)
  /// comes first.
  std::vector<TimeSeries::Column> columns{};
  std::vector<FigureNumber> numbers{};
  std::variant<Plot, SurfacePlot> picture{};
};

/// A figure of the book that this library can draw.
struct FigureEntry {
  std::string_view id;                  ///< "6.3"
  std::string_view title;               ///< "Elevator response"
  std::string_view section;             ///< "6.9.4"
  Expected<FigureResult> (*compute)();  ///< Computes it; the error of the library if it refuses.
};

/// Every figure that is there, in the book's order.
[[nodiscard]] std::span<const FigureEntry> figures();

/// A figure by its number, as people write it: "6.3", "Figure 6.3", "fig. 6.3"; "Table 7.2".
/// @errors ArgumentError::unknown_name with the nearest figures that are there.
[[nodiscard]] Expected<const FigureEntry*> find_figure(std::string_view id);

/// The columns as CSV: header `time (s),position (m),…`, one row a line, each number the shortest
/// that reads back to the same double.
[[nodiscard]] std::string to_csv(const FigureResult& figure);

/// "figure_6_3" or "table_7_2", which every file of the figure is called.
[[nodiscard]] std::string file_stem(const FigureResult& figure);

/// Writes figure_6_3.png, .svg and .csv into a folder, which is made if it is not there. Everything
/// is drawn before anything is written, and each file appears whole or not at all.
/// @return The paths written.
/// @errors PlotError, FileError.
[[nodiscard]] Expected<std::vector<std::string>> write_figure(const FigureResult& figure,
                                                              const std::string& folder);

/// What became of one comparison.
struct FigureCheck {
  std::string figure;        ///< "6.3"
  std::string name;          ///< Of the number or the column.
  std::string source{};      ///< Where the reference numbers come from.
  std::size_t values = 0;    ///< How many were compared.
  double worst_error = 0.0;  ///< Largest |ours - reference| over the reference's largest magnitude.
  double tolerance = 0.0;    ///< Of `worst_error`.
  bool passed = false;
  std::string problem{};  ///< Why nothing could be compared; empty otherwise.
};

/// Computes every figure and compares its numbers and columns with the references that are built
/// into the library (book/reference). A figure that cannot be computed, a reference without its
/// column and a figure without a reference are failed checks.
/// Cost: some milliseconds a figure.
[[nodiscard]] std::vector<FigureCheck> check_figures();

/// The same for one figure, or for none: an id that is not there gives no checks.
[[nodiscard]] std::vector<FigureCheck> check_figure(std::string_view id);

}  // namespace flyball::book
