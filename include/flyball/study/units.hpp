#pragma once

#include <optional>

#include <flyball/core/answer.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// The units that texts are read in: per dimension the SI unit, an example, and every name with
/// its size in SI. @param of  One dimension; all if none. Schema "flyball.units/1".
[[nodiscard]] Answer units_answer(std::optional<Dimension> of = std::nullopt);

/// docs/units.md: all of them as a page.
[[nodiscard]] std::string units_page();

/// A dimension by its name, "moment of inertia".
/// @errors ArgumentError::unknown_name with the nearest.
[[nodiscard]] Expected<Dimension> find_dimension(std::string_view name);

}  // namespace flyball::study
