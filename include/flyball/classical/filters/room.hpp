#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/core/signal.hpp>

/// What the filters of a fixed size share.
namespace flyball::classical::detail {

using flyball::detail::cut;
using flyball::detail::signal_or_zero;

/// @errors ArgumentError::wrong_shape for more than there is room for.
[[nodiscard]] Expected<void> check_room(std::size_t count, std::size_t room, std::string_view where,
                                        std::string_view what);
/// @errors ArgumentError::empty, not_finite, wrong_shape.
[[nodiscard]] Expected<void> check_taps(std::span<const double> taps, std::size_t room);
/// @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<void> check_window(int window, int room);

}  // namespace flyball::classical::detail
