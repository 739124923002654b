#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>

namespace flyball {

/// What the machine refused.
enum class MemoryError {
  not_enough_memory,  ///< An allocation failed.
};
[[nodiscard]] ErrorInfo error_info(MemoryError code);
/// For whoever catches std::bad_alloc. @param what  Completes "there is not enough memory for …".
[[nodiscard]] Error not_enough_memory(std::string_view what);

/// An error of a text, with the lines at fault as they stand and a caret below; empty if a look at
/// them says nothing.
struct QuotedError : Error {
  std::string excerpt{};
  std::optional<Place> place{};
};

/// Everything that is wrong with one input, in its order. As an error it is the first of them, so
/// that it goes up to callers who want only one.
class Errors : public Error {
 public:
  /// @param all  Not empty.
  explicit Errors(std::vector<QuotedError> all) : Error(all.front()), all_(std::move(all)) {}
  // NOLINTNEXTLINE(google-explicit-constructor): whatever returns Errors may meet a single one.
  Errors(Error error) noexcept : Error(std::move(error)) {}

  /// As a copy of Error where memory is too short.
  Errors(const Errors& other) noexcept;
  Errors(Errors&&) noexcept = default;
  Errors& operator=(const Errors& other) noexcept { return *this = Errors(other); }
  Errors& operator=(Errors&&) noexcept = default;
  ~Errors() = default;

  [[nodiscard]] std::vector<QuotedError> all() const;

  /// What was noticed before the error, which nobody else can tell once there is no result.
  [[nodiscard]] const std::vector<Diagnostic>& diagnostics() const noexcept { return diagnostics_; }
  /// With that, in front of what is there.
  [[nodiscard]] Errors after(std::vector<Diagnostic> noticed) && {
    diagnostics_.insert(diagnostics_.begin(), noticed.begin(), noticed.end());
    return std::move(*this);
  }

 private:
  std::vector<QuotedError> all_{};  ///< Empty if there is but the one that this is.
  std::vector<Diagnostic> diagnostics_{};
};

/// A result, or all the reasons why there is none. What readers of files return.
template <class T>
using ExpectedAll = tl::expected<T, Errors>;

}  // namespace flyball
