#pragma once

#include <string>

#include <flyball/core/expected.hpp>

namespace flyball::study {

/// What must be true of a value.
enum class Sign { any, positive, not_negative };

/// A value with its unit, in SI; zero needs no unit.
/// @param called  The key, for messages. @param unit  What it must fit; "1" is a plain number,
/// empty is not known.
/// @errors ArgumentError for what is no quantity, for its unit and for its sign.
[[nodiscard]] Expected<double> named_value(const std::string& text, const std::string& called,
                                           const std::string& unit, Sign sign);

}  // namespace flyball::study
