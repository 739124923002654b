#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "book/reference.hpp"

namespace flyball::book {

namespace {

using Json = nlohmann::json;

/// Half a unit of the last printed digit, relative to the printed value.
double printed_tolerance(double value, int decimals) {
  return 0.5 * std::pow(10.0, -decimals) / std::abs(value);
}

ReferenceNumber read_number(const Json& entry, const FigureReference& reference) {
  ReferenceNumber number{.name = entry.at("name").get<std::string>(),
                         .value = entry.at("value").get<double>(),
                         .tolerance = reference.tolerance,
                         .source = entry.value("source", reference.source)};
  if (entry.contains("decimals")) {
    number.tolerance = printed_tolerance(number.value, entry.at("decimals").get<int>());
  }
  return number;
}

std::optional<double> read_optional(const Json& entry, const char* key) {
  return entry.contains(key) ? std::optional(entry.at(key).get<double>()) : std::nullopt;
}

ReferenceSeries read_series(const Json& entry) {
  return {.name = entry.at("name").get<std::string>(),
          .length = entry.at("length").get<std::size_t>(),
          .rows = entry.at("rows").get<std::vector<std::size_t>>(),
          .values = entry.at("values").get<std::vector<double>>(),
          .min = read_optional(entry, "min"),
          .max = read_optional(entry, "max"),
          .mean = read_optional(entry, "mean")};
}

Error malformed(std::string what) {
  return Error(ArgumentError::malformed).in("book").about("reference").got(std::move(what));
}

}  // namespace

Expected<FigureReference> parse_reference(std::string_view json) {
  FigureReference reference;
  try {
    const Json document = Json::parse(json);
    reference.figure = document.at("figure").get<std::string>();
    reference.source = document.at("source").get<std::string>();
    reference.tolerance = document.at("tolerance").get<double>();
    for (const Json& entry : document.at("numbers")) {
      reference.numbers.push_back(read_number(entry, reference));
    }
    for (const Json& entry : document.at("series")) {
      reference.series.push_back(read_series(entry));
    }
  } catch (const Json::exception& reason) {
    return tl::unexpected(malformed(reason.what()));
  }
  for (const ReferenceSeries& series : reference.series) {
    if (series.rows.size() != series.values.size() || series.rows.empty()) {
      return tl::unexpected(
          malformed(fmt::format("{} rows and {} values of \"{}\"", series.rows.size(),
                                series.values.size(), series.name)));
    }
    for (const std::size_t row : series.rows) {
      if (row >= series.length) {
        return tl::unexpected(
            malformed(fmt::format("row {} of {} of \"{}\"", row, series.length, series.name)));
      }
    }
  }
  return reference;
}

}  // namespace flyball::book
