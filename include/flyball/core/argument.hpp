#pragma once

#include <string_view>
#include <utility>

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

/// |M_ij - M_ji| within 1e-10 of both and of √|M_ii M_jj|, as ten printed digits keep it.
/// @errors ArgumentError::not_symmetric with the offending pair as evidence.
[[nodiscard]] Expected<void> check_symmetric(const MatrixRef& M, std::string_view where,
                                             std::string_view name);

/// Finite and > 0; `unit` words the message. @errors ArgumentError::not_finite, not_positive.
[[nodiscard]] Expected<void> check_positive(double value, std::string_view where,
                                            std::string_view name, std::string_view unit = {});

/// Finite and >= 0. @errors ArgumentError::not_finite, out_of_range.
[[nodiscard]] Expected<void> check_not_negative(double value, std::string_view where,
                                                std::string_view name, std::string_view unit = {});

/// Finite and in [low, high]. @errors ArgumentError::not_finite, out_of_range.
[[nodiscard]] Expected<void> check_within(double value, double low, double high,
                                          std::string_view where, std::string_view name,
                                          std::string_view unit = {});

/// The checks of one function's arguments, which say its name once. After the first error no other
/// check is made, so a later one may rely on the earlier ones.
///
/// ```
/// FLYBALL_CHECK(Checks("lqr").square(A, "A").shape(B, A.rows(), B.cols(), "B").positive(T, "T",
/// "s"));
/// ```
class Checks {
 public:
  /// @param where  The function's name; it must outlive the checks.
  explicit Checks(std::string_view where) noexcept : where_(where) {}

  /// As check_shape.
  Checks& shape(const MatrixRef& M, Eigen::Index rows, Eigen::Index columns, std::string_view name,
                std::string_view meaning = {}) {
    return also([&] { return check_shape(M, rows, columns, where_, name, meaning); });
  }
  /// As check_square.
  Checks& square(const MatrixRef& M, std::string_view name) {
    return also([&] { return check_square(M, where_, name); });
  }
  /// As check_finite.
  Checks& finite(const MatrixRef& M, std::string_view name) {
    return also([&] { return check_finite(M, where_, name); });
  }
  Checks& finite(double value, std::string_view name) {
    return also([&] { return check_finite(value, where_, name); });
  }
  /// As check_symmetric.
  Checks& symmetric(const MatrixRef& M, std::string_view name) {
    return also([&] { return check_symmetric(M, where_, name); });
  }
  /// As check_positive.
  Checks& positive(double value, std::string_view name, std::string_view unit = {}) {
    return also([&] { return check_positive(value, where_, name, unit); });
  }
  /// As check_not_negative.
  Checks& not_negative(double value, std::string_view name, std::string_view unit = {}) {
    return also([&] { return check_not_negative(value, where_, name, unit); });
  }
  /// As check_within.
  Checks& within(double value, double low, double high, std::string_view name,
                 std::string_view unit = {}) {
    return also([&] { return check_within(value, low, high, where_, name, unit); });
  }
  /// Any other check, made only if those before it passed.
  /// @param check  Answers an Expected<void>.
  template <class Check>
    requires requires(Check& check) { Expected<void>(check()); }
  Checks& also(Check&& check) {
    if (result_) {
      result_ = check();
    }
    return *this;
  }

  /// What `make` gives if every check passed. @param make  Answers the function's result.
  template <class Make>
  [[nodiscard]] auto map(Make&& make) const {
    return result_.map(std::forward<Make>(make));
  }

  [[nodiscard]] explicit operator bool() const noexcept { return result_.has_value(); }
  [[nodiscard]] const Error& error() const noexcept { return result_.error(); }
  // NOLINTNEXTLINE(google-explicit-constructor): it is what a function of checks returns.
  [[nodiscard]] operator Expected<void>() const { return result_; }

 private:
  std::string_view where_;
  Expected<void> result_{};
};

/// A number as people write it: shortest form that reads back to at least `digits` digits.
[[nodiscard]] std::string format_number(double value, int digits = 6);

}  // namespace flyball
