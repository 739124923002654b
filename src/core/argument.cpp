#include <flyball/core/argument.hpp>

#include <algorithm>
#include <cmath>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

std::string shape_text(const MatrixRef& M) {
  return detail::format("{}x{}", M.rows(), M.cols());
}

std::string with_unit(double value, std::string_view unit) {
  return detail::format("{}{}{}", format_number(value), unit.empty() ? "" : " ", unit);
}

}  // namespace

std::string format_number(double value, int digits) {
  return detail::format("{:.{}g}", value, digits);
}

Expected<void> check_shape(const MatrixRef& M, Eigen::Index rows, Eigen::Index columns,
                           std::string_view where, std::string_view name,
                           std::string_view meaning) {
  if (M.rows() == rows && M.cols() == columns) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, name)
      .got(shape_text(M))
      .expected(meaning.empty() ? detail::format("{}x{}", rows, columns)
                                : detail::format("{} ({}x{})", meaning, rows, columns));
}

Expected<void> check_square(const MatrixRef& M, std::string_view where, std::string_view name) {
  if (M.size() == 0) {
    return refusal(ArgumentError::empty, where, name)
        .got("empty")
        .expected("a square matrix with at least one row");
  }
  if (M.rows() != M.cols()) {
    return refusal(ArgumentError::wrong_shape, where, name).got(shape_text(M)).expected("square");
  }
  return {};
}

Expected<void> check_finite(const MatrixRef& M, std::string_view where, std::string_view name) {
  if ((M.array() * 0.0).sum() == 0.0) {
    return {};
  }
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    for (Eigen::Index i = 0; i < M.rows(); ++i) {
      if (!std::isfinite(M(i, j))) {
        return refusal(ArgumentError::not_finite, where, detail::format("{}({}, {})", name, i, j))
            .got(format_number(M(i, j)))
            .expected("a finite number");
      }
    }
  }
  return {};
}

Expected<void> check_finite(double value, std::string_view where, std::string_view name) {
  if (std::isfinite(value)) {
    return {};
  }
  return refusal(ArgumentError::not_finite, where, name)
      .got(format_number(value))
      .expected("a finite number");
}

Expected<void> check_symmetric(const MatrixRef& M, std::string_view where, std::string_view name) {
  FLYBALL_CHECK(check_square(M, where, name));
  constexpr double rounding = 1e-10;
  for (Eigen::Index j = 0; j < M.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) {
      // Beside what the two have to do with: an entry of another unit says nothing about them.
      const double size = std::max({std::abs(M(i, j)), std::abs(M(j, i)),
                                    std::sqrt(std::abs(M(i, i))) * std::sqrt(std::abs(M(j, j)))});
      if (!(std::abs(M(i, j) - M(j, i)) <= rounding * size)) {
        return refusal(ArgumentError::not_symmetric, where, name)
            .got(detail::format(
                "not symmetric: entries ({0}, {1}) and ({1}, {0}) are {2:.17g} and {3:.17g}", i, j,
                M(i, j), M(j, i)))
            .expected("symmetric");
      }
    }
  }
  return {};
}

Expected<void> check_positive(double value, std::string_view where, std::string_view name,
                              std::string_view unit) {
  FLYBALL_CHECK(check_finite(value, where, name));
  if (value > 0.0) {
    return {};
  }
  return refusal(ArgumentError::not_positive, where, name)
      .got(with_unit(value, unit))
      .expected("greater than zero");
}

Expected<void> check_not_negative(double value, std::string_view where, std::string_view name,
                                  std::string_view unit) {
  FLYBALL_CHECK(check_finite(value, where, name));
  if (value >= 0.0) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, name)
      .got(with_unit(value, unit))
      .expected("zero or greater");
}

Expected<void> check_within(double value, double low, double high, std::string_view where,
                            std::string_view name, std::string_view unit) {
  if (auto finite = check_finite(value, where, name); !finite) {
    return finite;
  }
  if (value >= low && value <= high) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, where, name)
      .got(with_unit(value, unit))
      .expected(detail::format("in [{}, {}]", format_number(low), format_number(high)));
}

}  // namespace flyball
