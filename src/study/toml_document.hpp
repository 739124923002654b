#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include <flyball/core/errors.hpp>
#include <flyball/study/project.hpp>

#include "study/field.hpp"

namespace flyball::study {

/// A TOML file with the command line's values in place of its own, and what is wrong with both.
///
/// Nothing stops at an error: each is kept, so that one run tells all of them.
class TomlDocument {
 public:
  /// Takes the text apart. What is no TOML is an error and an empty document.
  TomlDocument(std::string_view text, std::string file);

  /// Takes the tables of [[name]] out, each as a document of its own that has it as [name], with
  /// its places in the file. What else stands there is refused.
  [[nodiscard]] std::vector<TomlDocument> take_tables(std::string_view name);

  /// Puts options into the place of the file's values.
  void apply(std::span<const Override> overrides, std::span<const Section> sections);

  /// Reads all sections into the document's struct.
  void read(const Document& document, void* into);

  [[nodiscard]] bool is_toml() const { return is_toml_; }
  /// Whether the file has a section, or what is none in its place; not only the command line.
  [[nodiscard]] bool writes(std::string_view section) const;
  /// What the file is about: a model if it has one, a drivetrain if it has one.
  [[nodiscard]] Subject subject() const {
    return writes("model") ? Subject::model : writes("drive") ? Subject::drive : Subject::mechanism;
  }
  /// Whether a key is the command line's alone.
  [[nodiscard]] bool is_new(std::string_view section, std::string_view key) const;
  [[nodiscard]] bool has(std::string_view section, std::string_view key) const {
    return node(section, key) != nullptr;
  }

  /// Whether a flag is there and set.
  [[nodiscard]] bool says(std::string_view section, std::string_view key) const {
    const toml::node* const flag = node(section, key);
    return flag != nullptr && flag->value_or(false);
  }

  /// "controller.period", or "--period" if the value is the command line's.
  [[nodiscard]] std::string name(std::string_view section, std::string_view key) const;

  /// What is wrong: the key, or the value that it has.
  enum class Fault { key, value };
  /// Keeps an error with the place of what is wrong in the file, or its option.
  void refuse(std::string_view section, std::string_view key, Error error,
              Fault fault = Fault::value);
  /// The same of one of a list. @param index  From 0.
  void refuse_item(std::string_view section, std::string_view key, std::size_t index, Error error);
  /// The same of a part of a text: evidence `offset` and `length`, in bytes, say which.
  void refuse_part(std::string_view section, std::string_view key, Error error);
  /// An error about a key that should be there, with the section's place.
  [[nodiscard]] QuotedError missing(std::string_view section, std::string_view key,
                                    std::string hint) const;
  /// The same, kept; not of a key that stands there misspelt, which is told.
  void miss(std::string_view section, std::string_view key, std::string hint);

  /// Nothing if all is well; else the errors in the order of the file, the first twenty of them.
  [[nodiscard]] std::optional<Errors> errors() const;

 private:
  TomlDocument(std::string_view text, std::string file, toml::table root)
      : text_(text), file_(std::move(file)), root_(std::move(root)) {}

  struct Found {
    toml::source_region source;
    Error error;
    bool quote = true;
    std::string excerpt{};  // if not the file's line
  };

  [[nodiscard]] const toml::table* table(std::string_view section) const;
  [[nodiscard]] const toml::node* node(std::string_view section, std::string_view key) const;
  [[nodiscard]] toml::source_region source_of(std::string_view section) const;
  [[nodiscard]] std::string place(const toml::source_region& source) const;
  [[nodiscard]] static std::optional<Place> place_in_file(const toml::source_region& source);
  [[nodiscard]] std::string_view line_of(toml::source_index number) const;
  [[nodiscard]] std::string excerpt(const toml::source_region& source) const;
  /// The texts of a table, in the order of the file; what is no text is refused.
  [[nodiscard]] NamedTexts named_texts(const std::string& section, const toml::table& keys);
  /// Refuses what is about the other kind of file. @return Whether it was.
  bool refuse_other(const Section& section, const Field* field);
  void check_names(const toml::table& names, std::string_view section,
                   std::span<const std::string_view> known);
  void read_section(const Section& section, const toml::table& keys, const Document& document,
                    void* into);

  std::string_view text_;
  std::string file_;
  toml::table root_;
  bool is_toml_ = true;
  std::map<std::string, std::string, std::less<>> options_;  // of overridden keys, by their names
  std::vector<std::string> meant_;  // the names nearest to those that are not known
  std::vector<Found> found_;
};

}  // namespace flyball::study
