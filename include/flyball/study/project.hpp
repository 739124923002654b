#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>
#include <flyball/study/design.hpp>

namespace flyball::study {

/// What is wrong with a project file; each error carries file, line and column in `where`.
enum class ProjectError {
  syntax,       ///< Not TOML.
  unknown_key,  ///< A key that means nothing; the nearest valid one is the hint.
  missing_key,  ///< A key without which the mechanism is not defined.
  wrong_type,   ///< A number where a text with a unit is needed, or the like.
  wrong_value,  ///< A value that cannot be.
};
[[nodiscard]] ErrorInfo error_info(ProjectError code);

/// A TOML project file: the design job it describes. A file that only sets controller options can
/// accompany a log; then `plant_error` tells what it would need to stand alone.
struct Project {
  std::string path{};
  std::optional<Error>
      plant_error{};  ///< Why the file does not define a mechanism, if it does not.
  std::optional<mechanisms::MechanismKind> mechanism{};
  DesignJob job;
};

/// Reads a project file. @errors ProjectError, FileError, ArgumentError (units, motors).
[[nodiscard]] Expected<Project> read_project(const std::string& path);

/// Parses its text. @param name  The file's name for messages.
[[nodiscard]] Expected<Project> parse_project(std::string_view text, const std::string& name);

}  // namespace flyball::study
