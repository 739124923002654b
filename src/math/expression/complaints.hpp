#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/math/expression/formula.hpp>

namespace flyball::expression {

/// A part of a formula's text, in bytes.
struct Place {
  std::size_t offset = 0;
  std::size_t length = 0;

  [[nodiscard]] std::size_t end() const noexcept { return offset + length; }
  /// From the start of one to the end of the other.
  [[nodiscard]] Place to(const Place& last) const noexcept { return {offset, last.end() - offset}; }
};

/// The errors of one formula on their way to those of the set.
class Complaints {
 public:
  Complaints(std::string formula, std::string_view text, std::vector<Error>& errors)
      : formula_(std::move(formula)), text_(text), errors_(errors), first_(errors.size()) {}

  /// Another error at a place, unless the formula has its fill of them.
  void add(Error error, Place place);

  /// No more of this formula: what follows an error from which there is no recovery.
  void stop() noexcept { stopped_ = true; }

  [[nodiscard]] bool any() const noexcept { return errors_.size() > first_; }

  /// The text of a place in quotes, shortened and without control characters.
  [[nodiscard]] std::string quote(Place place) const;

 private:
  static constexpr std::size_t most = 20;

  std::string formula_;
  std::string_view text_;
  std::vector<Error>& errors_;
  std::size_t first_;
  bool stopped_ = false;
};

/// How many bytes the character at a place has, and which it is; one byte and U+FFFD where the text
/// is no UTF-8.
struct Character {
  char32_t code = 0;
  std::size_t length = 1;
};
[[nodiscard]] Character character_at(std::string_view text, std::size_t at) noexcept;

}  // namespace flyball::expression
