#include <flyball/core/time_series.hpp>

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

Expected<void> TimeSeries::add(std::string name, std::string unit, std::vector<double> values) {
  if (values.size() != time_.size()) {
    return refusal(ArgumentError::wrong_shape, "TimeSeries::add", name)
        .got(detail::format("{} values long", values.size()))
        .expected(detail::format("one value a row ({})", time_.size()));
  }
  columns_.push_back({std::move(name), std::move(unit), std::move(values)});
  return {};
}

const std::vector<double>* TimeSeries::find(std::string_view name) const noexcept {
  const auto column = std::find_if(columns_.begin(), columns_.end(),
                                   [&](const Column& c) { return c.name == name; });
  return column == columns_.end() ? nullptr : &column->values;
}

void TimeSeries::append(double time, const std::vector<double>& values) {
  assert(values.size() == columns_.size());
  time_.push_back(time);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    columns_[i].values.push_back(values[i]);
  }
}

void TimeSeries::reserve(std::size_t rows) {
  time_.reserve(rows);
  for (Column& column : columns_) {
    column.values.reserve(rows);
  }
}

}  // namespace flyball
