#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "classical/transfer_syntax.hpp"

/// The words of transfer functions in text.
namespace flyball::classical::detail {

enum class Token : std::uint8_t {
  number,
  name,
  plus,
  minus,
  times,
  divide,
  power,
  squared,
  cubed,
  open,
  close,
  list,
  comma,  ///< Between the arguments of feedback.
  end,
};

struct Lexeme {
  Token token = Token::end;
  TextPlace place;
  double number = 0.0;
};

[[nodiscard]] bool is_digit(char c);
/// Bytes of the character there.
[[nodiscard]] std::size_t character_length(std::string_view text, std::size_t at);
/// Bytes of the blank there; 0 without one.
[[nodiscard]] std::size_t blank_length(std::string_view text, std::size_t at);

/// A text, read word by word; the first error ends it.
class TransferLexer {
 public:
  explicit TransferLexer(std::string_view text) : text_(text) {}

 protected:
  void fail(Error error, TextPlace place);
  /// The next lexeme.
  void next();
  /// An unsigned number here; an error where its digits make none.
  std::optional<Lexeme> read_number();

  std::string_view text_;
  std::size_t at_ = 0;
  Lexeme here_;
  std::optional<Error> error_;
  int calls_ = 0;  ///< Of functions whose arguments a comma separates.

 private:
  void stray();
};

}  // namespace flyball::classical::detail
