#pragma once

#include <concepts>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include <tl/expected.hpp>

#include <flyball/core/error.hpp>

namespace tl {

/// What `.value()` throws where there is no value: a program that ends with it says why.
template <class E>
  requires std::derived_from<E, flyball::Error>
class bad_expected_access<E> : public std::exception {
 public:
  explicit bad_expected_access(E error) noexcept : error_(std::move(error)) {
    try {
      text_ = to_string(error_);
    } catch (const std::bad_alloc&) {
      text_.clear();
    }
  }

  /// The error's own text.
  [[nodiscard]] const char* what() const noexcept override {
    return text_.empty() ? "an error, and no memory for its text" : text_.c_str();
  }
  [[nodiscard]] const E& error() const noexcept { return error_; }

 private:
  E error_;
  std::string text_;
};

}  // namespace tl

namespace flyball {

/// A result, or the reason why there is none. What every design-time function returns.
template <class T>
using Expected = tl::expected<T, Error>;

}  // namespace flyball
