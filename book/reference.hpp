#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "book/figures.hpp"

namespace flyball::book {

/// A number that somebody else computed, or that the book prints.
struct ReferenceNumber {
  std::string name;
  double value = 0.0;
  double tolerance =
      0.0;  ///< Relative to `value`; for a printed one half a unit of its last digit.
  std::string source;
};

/// Rows of a column that somebody else computed, and what is known of all of its rows.
struct ReferenceSeries {
  std::string name;
  std::size_t length = 0;         ///< How many rows the column has.
  std::vector<std::size_t> rows;  ///< Below `length`.
  std::vector<double> values;     ///< As many as `rows`.
  std::optional<double> min{};
  std::optional<double> max{};
  std::optional<double> mean{};
};

/// What a figure is compared with.
struct FigureReference {
  std::string figure;
  std::string source;
  double tolerance = 0.0;  ///< Relative to a series' largest magnitude.
  std::vector<ReferenceNumber> numbers;
  std::vector<ReferenceSeries> series;
};

/// Reads a file of book/reference.
/// @errors ArgumentError::malformed for what is not such a file, naming the entry.
[[nodiscard]] Expected<FigureReference> parse_reference(std::string_view json);

/// The files of book/reference, as the build put them into the library.
[[nodiscard]] std::span<const std::string_view> embedded_references();

/// book/items.csv, every numbered item of the book, as the build put it into the library.
[[nodiscard]] std::string_view book_items();

/// Compares what was computed with a reference: one check a number and a series.
[[nodiscard]] std::vector<FigureCheck> compare(const FigureResult& figure,
                                               const FigureReference& reference);

/// Computes the figure of each reference and compares.
[[nodiscard]] std::vector<FigureCheck> check_references(
    std::span<const std::string_view> references);

}  // namespace flyball::book
