#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/sysid_columns.hpp"

/// The rows of a SysId JSON, before it is known what their columns are.
namespace flyball::io {

inline constexpr std::size_t max_columns = columns_2020.size();

/// A test's rows as they stand in the file, one after the other.
struct SysIdTable {
  bool present = false;
  std::vector<double> values;
  std::vector<unsigned char> widths;  ///< Of each row.
};

/// Collects complete rows while the parser walks through the text, so that whatever precedes a cut
/// or an error is already there.
class SysIdRows : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::array<SysIdTable, run_names.size()> tables;
  std::string test;
  std::string units;
  std::optional<double> units_per_rotation;
  bool sysid = false;
  std::optional<std::string> first_key;
  std::vector<std::string> unknown_keys;
  std::size_t odd_rows = 0;  ///< Neither 4, 9 nor 10 numbers.
  bool top_is_object = false;
  std::size_t error_at = 0;
  std::string error_text;

  bool null() override { return scalar(not_a_number); }
  bool boolean(bool value) override {
    sysid = sysid || (depth_ == 1 && key_ == "sysid" && value);
    return scalar(not_a_number);
  }
  bool number_integer(number_integer_t value) override {
    return scalar(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return scalar(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return scalar(value);
  }
  bool string(string_t& value) override {
    if (depth_ == 1 && key_ == "test") {
      test = value;
    } else if (depth_ == 1 && key_ == "units") {
      units = value;
    }
    return scalar(not_a_number);
  }
  bool binary(binary_t& /*value*/) override { return scalar(not_a_number); }

  bool start_object(std::size_t /*elements*/) override {
    top_is_object = top_is_object || depth_ == 0;
    row_is_odd_ = row_is_odd_ || in_row();
    ++depth_;
    return true;
  }
  bool key(string_t& value) override {
    if (depth_ != 1) {
      return true;
    }
    key_ = value;
    if (!first_key) {
      first_key = value;
    }
    const auto run = std::find(run_names.begin(), run_names.end(), value);
    run_ = static_cast<std::size_t>(run - run_names.begin());
    if (run != run_names.end()) {
      tables[run_].present = true;
    } else if (value != "sysid" && value != "test" && value != "units" &&
               value != "unitsPerRotation") {
      unknown_keys.push_back(value);
    }
    return true;
  }
  bool end_object() override {
    --depth_;
    return true;
  }
  bool start_array(std::size_t /*elements*/) override {
    row_is_odd_ = in_row();
    ++depth_;
    if (in_row()) {
      width_ = 0;
    }
    return true;
  }
  bool end_array() override {
    if (in_row()) {
      const bool known = width_ == 4 || width_ == 9 || width_ == 10;
      if (known && !row_is_odd_) {
        std::vector<double>& values = tables[run_].values;
        values.insert(values.end(), row_.begin(),
                      row_.begin() + static_cast<std::ptrdiff_t>(width_));
        tables[run_].widths.push_back(static_cast<unsigned char>(width_));
      } else {
        ++odd_rows;
      }
    }
    --depth_;
    return true;
  }
  bool parse_error(std::size_t position, const std::string& /*last_token*/,
                   const nlohmann::detail::exception& error) override {
    error_at = position;
    error_text = error.what();
    return false;
  }

 private:
  static constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

  /// Directly in a row: {"slow-forward": [[ here ]]}.
  bool in_row() const { return depth_ == 3 && top_is_object && run_ < run_names.size(); }

  bool scalar(double value) {
    if (in_row()) {
      if (width_ < max_columns) {
        row_[width_] = value;
      }
      ++width_;
    } else if (depth_ == 1 && key_ == "unitsPerRotation" && std::isfinite(value)) {
      units_per_rotation = value;
    } else if (depth_ == 2 && run_ < run_names.size()) {
      ++odd_rows;
    }
    return true;
  }

  std::size_t depth_ = 0;
  std::string key_;
  std::size_t run_ = run_names.size();
  std::array<double, max_columns> row_{};
  std::size_t width_ = 0;
  bool row_is_odd_ = false;
};

/// Python and JavaScript write NaN and Infinity, which JSON has no word for: each is replaced by an
/// empty string of the same length, which SysIdRows takes for "not a number".
[[nodiscard]] std::string without_nan_words(std::string_view text);

}  // namespace flyball::io
