#pragma once

#include <string_view>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>

/// The checks at the door of every design-time function. Each returns nothing, or the error that
/// names the function, the argument, what was expected and what was got.
namespace flyball {

/// How a design-time function takes a matrix: any size, fixed or dynamic, without a copy.
using MatrixRef = Eigen::Ref<const Eigen::MatrixXd>;

/// @param M        The matrix. @param rows, columns  The expected shape.
/// @param where    The function's name. @param name  The argument's name.
/// @param meaning  The shape in words, such as "inputs x inputs".
/// @errors ArgumentError::wrong_shape.
[[nodiscard]] Expected<void> check_shape(const MatrixRef& M, Eigen::Index rows,
                                         Eigen::Index columns, std::string_view where,
                                         std::string_view name, std::string_view meaning = {});

/// Square and not empty. @errors ArgumentError::wrong_shape, ArgumentError::empty.
[[nodiscard]] Expected<void> check_square(const MatrixRef& M, std::string_view where,
                                          std::string_view name);

/// No NaN and no infinity; the first offending entry is the evidence.
/// @errors ArgumentError::not_finite.
[[nodiscard]] Expected<void> check_finite(const MatrixRef& M, std::string_view where,
                                          std::string_view name);
[[nodiscard]] Expected<void> check_finite(double value, std::string_view where,
                                          std::string_view name);

/// |M - Mᵀ| within 1e-10 of the largest entry of M, which is what survives a print with ten digits.
/// @errors ArgumentError::not_symmetric with the offending pair as evidence.
[[nodiscard]] Expected<void> check_symmetric(const MatrixRef& M, std::string_view where,
                                             std::string_view name);

/// Finite and > 0; `unit` words the message. @errors ArgumentError::not_finite, not_positive.
[[nodiscard]] Expected<void> check_positive(double value, std::string_view where,
                                            std::string_view name, std::string_view unit = {});

/// Finite and >= 0. @errors ArgumentError::not_finite, out_of_range.
[[nodiscard]] Expected<void> check_not_negative(double value, std::string_view where,
                                                std::string_view name, std::string_view unit = {});

/// The first error of several checks, or nothing.
/// The checks are evaluated by the caller, so pass only cheap ones that do not depend on each
/// other's success.
template <class... Checks>
[[nodiscard]] Expected<void> check_all(Checks&&... checks) {
  Expected<void> first{};
  (void)((checks.has_value() ? true : (first = std::forward<Checks>(checks), false)) && ...);
  return first;
}

/// A number as people write it: shortest form that reads back to at least `digits` digits.
[[nodiscard]] std::string format_number(double value, int digits = 6);

}  // namespace flyball
