#pragma once

#include <string_view>

#include "classical/late_quotient.hpp"
#include "classical/transfer_syntax.hpp"

/// What an expression is, as a quotient.
namespace flyball::classical::detail {

/// More poles or zeros than that are refused.
inline constexpr Eigen::Index highest_degree = 100;

/// The value of the last node. @param text  What `syntax` was made of, for messages.
/// @errors TransferTextError, TransferError::zero_denominator, with their place.
[[nodiscard]] Expected<LateQuotient> evaluate(std::string_view text, const TransferSyntax& syntax);

}  // namespace flyball::classical::detail
