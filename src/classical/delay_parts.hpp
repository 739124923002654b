#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <flyball/systems/system.hpp>

/// What systems with dead time are made and connected with.
namespace flyball::classical::detail {

/// diag(first, second)
[[nodiscard]] Eigen::MatrixXd diagonal(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second);

/// "0.1 s", or "continuous".
[[nodiscard]] std::string period_text(const std::optional<Time>& period);

/// @param of  What the count is of, for messages. @errors ArgumentError::wrong_shape.
[[nodiscard]] Expected<void> check_count(Eigen::Index got, Eigen::Index expected,
                                         std::string_view where, std::string_view subject,
                                         std::string_view of);

/// (I - L)⁻¹R, in signals' units in which L is balanced. @errors SystemError::algebraic_loop.
[[nodiscard]] Expected<Eigen::MatrixXd> solve_loop(const Eigen::MatrixXd& L,
                                                   const Eigen::MatrixXd& R, std::string_view where,
                                                   std::string_view subject);

}  // namespace flyball::classical::detail
