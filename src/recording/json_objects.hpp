#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>

/// JSON of planning tools, read with the places of what is wrong.
namespace flyball::recording {

/// The text taken apart. @errors TrajectoryFileError::not_json with line and column; NaN and
/// Infinity, which Python writes, are said to be what is wrong.
[[nodiscard]] Expected<nlohmann::json> json_of(std::string_view text, const std::string& source);

/// A finite number of an object. @param called  For messages. @param otherwise  Where it is absent.
/// @errors TrajectoryFileError::wrong_sample.
[[nodiscard]] Expected<double> number_of(const nlohmann::json& object, const char* key,
                                         std::string_view called, const std::string& where,
                                         std::optional<double> otherwise = std::nullopt);

/// Where the objects of a list begin in a text that is JSON.
class ObjectPlaces {
 public:
  /// @param depth  Of the list's brackets and braces: 1 of a list that is the whole file.
  /// @param member  Of which key of the outermost object the list is the value; empty: of none.
  ObjectPlaces(std::string_view text, int depth, std::string_view member);
  [[nodiscard]] Place of(std::size_t index) const {
    return index < places_.size() ? places_[index] : Place{};
  }

 private:
  std::vector<Place> places_;
};

}  // namespace flyball::recording
