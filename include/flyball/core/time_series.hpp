#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// One quantity sampled at its own times, as loggers record it.
struct Signal {
  std::string name;
  std::string unit;           ///< Unit text as recorded ("Rotation per Second", "V", …) or empty.
  std::vector<double> time;   ///< Seconds.
  std::vector<double> value;  ///< As many as `time`.
};

/// Named columns on one clock: what simulations record, what tables and pictures show.
class TimeSeries {
 public:
  /// A quantity on the clock: as many values as there are rows.
  struct Column {
    std::string name;
    std::string unit;
    std::vector<double> values;
  };

  TimeSeries() = default;
  /// A clock of `time` (seconds), without columns yet.
  explicit TimeSeries(std::vector<double> time) : time_(std::move(time)) {}

  [[nodiscard]] std::size_t rows() const noexcept { return time_.size(); }
  [[nodiscard]] const std::vector<double>& time() const noexcept { return time_; }
  [[nodiscard]] const std::vector<Column>& columns() const noexcept { return columns_; }

  /// Adds a column. @errors ArgumentError::wrong_shape if it has not one value a row.
  [[nodiscard]] Expected<void> add(std::string name, std::string unit, std::vector<double> values);

  /// The values of a column, or nullptr.
  [[nodiscard]] const std::vector<double>* find(std::string_view name) const noexcept;

  /// Appends a row: its time and one value a column, in the columns' order.
  void append(double time, const std::vector<double>& values);
  /// Makes room for `rows` rows.
  void reserve(std::size_t rows);

 private:
  std::vector<double> time_;
  std::vector<Column> columns_;
};

}  // namespace flyball
