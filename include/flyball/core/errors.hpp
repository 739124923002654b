#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/core/expected.hpp>

namespace flyball {

/// An error of a text, with the lines at fault as they stand and a caret below; empty if a look at
/// them says nothing.
struct QuotedError : Error {
  std::string excerpt{};
};

/// Everything that is wrong with one input, in its order. As an error it is the first of them, so
/// that it goes up to callers who want only one.
class Errors : public Error {
 public:
  /// @param all  Not empty.
  explicit Errors(std::vector<QuotedError> all) : Error(all.front()), all_(std::move(all)) {}
  // NOLINTNEXTLINE(google-explicit-constructor): whatever returns Errors may meet a single one.
  Errors(Error error) : Error(error) { all_.push_back({std::move(error), {}}); }

  [[nodiscard]] const std::vector<QuotedError>& all() const noexcept { return all_; }

 private:
  std::vector<QuotedError> all_;
};

/// A result, or all the reasons why there is none. What readers of files return.
template <class T>
using ExpectedAll = tl::expected<T, Errors>;

}  // namespace flyball
