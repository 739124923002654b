#pragma once

#include <flyball/core/error.hpp>

namespace flyball {

/// Why a file is not a log that can be read. What the file system refuses is a FileError.
enum class LogError {
  empty,          ///< The file has no bytes.
  not_a_log,      ///< None of the known formats, or another program's file.
  wrong_magic,    ///< A .wpilog that does not begin with "WPILOG".
  wrong_version,  ///< A WPILOG of another major version than 1.
  malformed,      ///< The format is known, its rules are broken at the place named.
  no_data,        ///< Well formed, or cut short, without one usable sample.
  no_time,        ///< A table without a column of time.
};
[[nodiscard]] ErrorInfo error_info(LogError code);

}  // namespace flyball
