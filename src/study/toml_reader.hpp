#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// Reads one table of a TOML file, keeping the first error with its file, line and column.
///
/// Getters return nothing when the key is absent or an error has been met, so a section reads as a
/// list of assignments and `error()` is asked once at the end.
class TomlReader {
 public:
  /// @param section  The table's name for messages, or empty for the root.
  TomlReader(const toml::table& table, std::string section, std::string file);

  /// Refuses keys that are not in `known`, with the nearest as hint.
  void allow(std::span<const std::string_view> known);

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }
  [[nodiscard]] std::optional<double> quantity(std::string_view key, Dimension dimension);
  [[nodiscard]] std::optional<double> positive(std::string_view key, Dimension dimension);
  [[nodiscard]] std::optional<double> not_negative(std::string_view key, Dimension dimension);
  [[nodiscard]] std::optional<std::string> text(std::string_view key);
  [[nodiscard]] std::optional<long long> integer(std::string_view key, long long least);
  /// An array of quantities, one for each dimension, or a single one where one is expected.
  [[nodiscard]] std::vector<double> quantities(std::string_view key,
                                               std::span<const Dimension> dimensions);
  [[nodiscard]] const toml::table* table(std::string_view key);

  /// Keeps an error found elsewhere about a key's value, with the key's place.
  void refuse(std::string_view key, Error error);
  /// An error about a key that should be there, with the section's place.
  [[nodiscard]] Error missing(std::string_view key, std::string hint) const;
  [[nodiscard]] std::string place(std::string_view key) const;

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  /// Takes over the first error of a reader for a table inside this one.
  void adopt(const TomlReader& inner);

 private:
  [[nodiscard]] std::string name(std::string_view key) const;
  [[nodiscard]] std::optional<double> quantity(const toml::node& node, std::string_view key,
                                               Dimension dimension);

  const toml::table& table_;
  std::string section_;
  std::string file_;
  std::optional<Error> error_;
};

}  // namespace flyball::study
