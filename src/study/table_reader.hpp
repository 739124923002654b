#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include <flyball/core/errors.hpp>
#include <flyball/core/quantity.hpp>

namespace flyball::study {

/// Reads the tables of one TOML file and keeps all that is wrong with them, the first twenty.
class TableReader {
 public:
  /// What is no TOML is an error and an empty table. @param text  Outlives the reader.
  TableReader(std::string path, std::string_view text);

 protected:
  using NameList = std::vector<std::string_view>;

  /// Keeps an error with its place in the file; of a default region, with the file alone.
  void refuse(const toml::source_region& source, Error error);
  /// The same of a value that is not `what`.
  void wrong_type(const toml::node& node, const std::string& name, std::string what);
  /// Refuses keys that are none of `names`.
  void known(const toml::table& table, const std::string& what, const NameList& names);
  /// Of keys: what is missing is `otherwise`, what is of another type is refused.
  std::string text(const toml::table& table, std::string_view key, std::string otherwise = {});
  bool flag(const toml::table& table, std::string_view key);
  double quantity(const toml::node& node, Dimension dimension, const std::string& name);
  std::optional<double> optional_quantity(const toml::table& table, std::string_view key,
                                          Dimension dimension);
  /// What has to be there. @param of  Whose it is, for the message.
  double needed(const toml::table& table, std::string_view key, Dimension dimension,
                const std::string& of);
  /// Two quantities; zeros where they are not.
  std::array<double, 2> point(const toml::node* node, const std::string& name,
                              Dimension first = Dimension::length,
                              Dimension second = Dimension::length);
  std::array<double, 2> needed_point(const toml::table& table, std::string_view key,
                                     const std::string& of);
  std::vector<std::array<double, 2>> points(const toml::table& table, std::string_view key,
                                            Dimension first = Dimension::length,
                                            Dimension second = Dimension::length);
  std::vector<std::string> texts(const toml::node* node, const std::string& name);
  /// Reads each table of the list [[name]].
  template <class Read>
  void each(std::string_view name, const Read& read) {
    const toml::node* node = root_.get(name);
    if (node == nullptr) {
      return;
    }
    const toml::array* list = node->as_array();
    if (list == nullptr) {
      wrong_type(*node, std::string(name), fmt::format("[[{}]], one for each", name));
      return;
    }
    for (const toml::node& entry : *list) {
      if (const toml::table* table = entry.as_table()) {
        read(*table);
      } else {
        wrong_type(entry, std::string(name), fmt::format("[[{}]], one for each", name));
      }
    }
  }

  std::string path_;
  std::string_view text_;
  toml::table root_{};
  std::vector<QuotedError> errors_{};
};

}  // namespace flyball::study
