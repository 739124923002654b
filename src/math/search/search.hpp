#pragma once

#include <string_view>

#include <flyball/core/argument.hpp>
#include <flyball/math/search/search_error.hpp>

namespace flyball::detail {

/// @errors ArgumentError::not_finite for the ends, out_of_range for options.
[[nodiscard]] Expected<void> check_search(double a, double b, const SearchOptions& options,
                                          std::string_view where);
[[nodiscard]] Error not_a_number(double x, std::string_view where);
[[nodiscard]] Error not_converged(double x, double value, double low, double high,
                                  std::string_view where);

}  // namespace flyball::detail
