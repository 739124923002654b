#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "book/reference.hpp"

namespace flyball::book {

namespace {

FigureCheck failed(std::string figure, std::string name, std::string source, std::string problem) {
  return {.figure = std::move(figure),
          .name = std::move(name),
          .source = std::move(source),
          .problem = std::move(problem)};
}

/// Passes only if the error is a number that is small enough: NaN is neither.
FigureCheck judged(FigureCheck check) {
  check.passed = check.worst_error <= check.tolerance;
  return check;
}

FigureCheck compare_number(const FigureResult& figure, const ReferenceNumber& reference) {
  const auto ours = std::ranges::find(figure.numbers, reference.name, &FigureNumber::name);
  if (ours == figure.numbers.end()) {
    return failed(figure.id, reference.name, reference.source, "the figure has no such number");
  }
  return judged({.figure = figure.id,
                 .name = reference.name,
                 .source = reference.source,
                 .values = 1,
                 .worst_error = std::abs(ours->value - reference.value) / std::abs(reference.value),
                 .tolerance = reference.tolerance});
}

FigureCheck compare_series(const FigureResult& figure, const ReferenceSeries& reference,
                           const FigureReference& of) {
  const auto column = std::ranges::find(figure.columns, reference.name, &TimeSeries::Column::name);
  if (column == figure.columns.end()) {
    return failed(figure.id, reference.name, of.source, "the figure has no such column");
  }
  const std::vector<double>& ours = column->values;
  if (ours.size() != reference.length) {
    return failed(figure.id, reference.name, of.source,
                  fmt::format("{} rows; the reference has {}", ours.size(), reference.length));
  }

  std::vector<double> errors;
  double scale = 0.0;
  const auto add = [&](double value, double expected) {
    errors.push_back(std::abs(value - expected));
    scale = std::max(scale, std::abs(expected));
  };
  for (std::size_t i = 0; i < reference.rows.size(); ++i) {
    add(ours[reference.rows[i]], reference.values[i]);
  }
  if (reference.min) {
    add(*std::ranges::min_element(ours), *reference.min);
  }
  if (reference.max) {
    add(*std::ranges::max_element(ours), *reference.max);
  }
  if (reference.mean) {
    add(std::accumulate(ours.begin(), ours.end(), 0.0) / static_cast<double>(ours.size()),
        *reference.mean);
  }

  // A series that is zero throughout, such as the reference of a velocity, is compared absolutely.
  scale = scale == 0.0 ? 1.0 : scale;
  double worst = 0.0;
  for (const double error : errors) {
    if (std::isnan(error)) {  // the worst of all; max() would drop it
      worst = error;
      break;
    }
    worst = std::max(worst, error / scale);
  }
  return judged({.figure = figure.id,
                 .name = reference.name,
                 .source = of.source,
                 .values = errors.size(),
                 .worst_error = worst,
                 .tolerance = of.tolerance});
}

std::vector<FigureCheck> check_reference(std::string_view json) {
  const auto reference = parse_reference(json);
  if (!reference) {
    return {failed("", "reference", "", to_string(reference.error()))};
  }
  const auto figure = find_figure(reference->figure).and_then([](const FigureEntry* entry) {
    return entry->compute();
  });
  if (!figure) {
    return {failed(reference->figure, "figure", reference->source, to_string(figure.error()))};
  }
  return compare(*figure, *reference);
}

}  // namespace

std::vector<FigureCheck> compare(const FigureResult& figure, const FigureReference& reference) {
  std::vector<FigureCheck> checks;
  for (const ReferenceNumber& number : reference.numbers) {
    checks.push_back(compare_number(figure, number));
  }
  for (const ReferenceSeries& series : reference.series) {
    checks.push_back(compare_series(figure, series, reference));
  }
  return checks;
}

std::vector<FigureCheck> check_references(std::span<const std::string_view> references) {
  std::vector<FigureCheck> checks;
  for (const std::string_view json : references) {
    const auto of_one = check_reference(json);
    checks.insert(checks.end(), of_one.begin(), of_one.end());
  }
  for (const FigureEntry& entry : figures()) {
    if (std::ranges::find(checks, entry.id, &FigureCheck::figure) == checks.end()) {
      checks.push_back(failed(std::string(entry.id), "reference", "", "there is none"));
    }
  }
  return checks;
}

std::vector<FigureCheck> check_figures() {
  return check_references(embedded_references());
}

std::vector<FigureCheck> check_figure(std::string_view id) {
  std::vector<FigureCheck> checks;
  for (const std::string_view json : embedded_references()) {
    if (const auto reference = parse_reference(json); reference && reference->figure == id) {
      const auto of_one = check_reference(json);
      checks.insert(checks.end(), of_one.begin(), of_one.end());
    }
  }
  if (checks.empty() && std::ranges::find(figures(), id, &FigureEntry::id) != figures().end()) {
    checks.push_back(failed(std::string(id), "reference", "", "there is none"));
  }
  return checks;
}

}  // namespace flyball::book
