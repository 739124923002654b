#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

/// Small text helpers that several readers share; private to io.
namespace flyball::io {

/// Without blanks, tabs, carriage returns and no-break spaces at either end.
[[nodiscard]] std::string_view trim(std::string_view text);

[[nodiscard]] std::string lower(std::string_view text);

/// A whole cell or token as a number ("1.5", "+2e-3", "NaN", "-inf"), or nothing. Independent of
/// the locale. A number beyond the range of double is ±infinity.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// "path:line:column" of a byte offset, both counted from 1.
[[nodiscard]] std::string place(const std::string& source, std::string_view text,
                                std::size_t offset);

/// `text` cut to what fits in a message, control characters and broken UTF-8 replaced.
[[nodiscard]] std::string printable(std::string_view text, std::size_t max_bytes = 60);

[[nodiscard]] bool is_utf8(std::string_view text);

/// Windows-1252 (of which Latin-1's printable part is a subset) as UTF-8.
[[nodiscard]] std::string from_windows_1252(std::string_view text);

/// "1 row", "2 rows".
[[nodiscard]] std::string counted(std::size_t count, std::string_view noun);

}  // namespace flyball::io
