#pragma once

#include <span>
#include <string>
#include <string_view>

#include <toml++/toml.h>

#include <flyball/core/errors.hpp>

#include "study/field.hpp"

namespace flyball::study {

/// A field's value from the node of a file.
/// @param dimensions  One; of a list one for each state. @param name  The field's, for messages.
/// @errors ProjectError and ArgumentError, without a place; of a list those of all its values.
[[nodiscard]] ExpectedAll<FieldValue> read_value(const Field& field, const toml::node& node,
                                                 std::span<const Dimension> dimensions,
                                                 const std::string& name);

/// Nothing that a project describes is so large or so small that its square has no double.
/// @errors ArgumentError::out_of_range.
[[nodiscard]] Expected<void> check_size(double value, const std::string& called);

/// The node that a text of the command line stands for.
void insert_text(toml::table& table, const Field& field, std::string_view text);

/// The dimensions of a field; none if the mechanism decides them and is not known.
[[nodiscard]] std::vector<Dimension> dimensions_of(const Field& field,
                                                   const std::optional<SignalDimensions>& signals);

}  // namespace flyball::study
