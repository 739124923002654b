#pragma once

#include <string>

#include <flyball/report/write_report.hpp>
#include <flyball/study/schema.hpp>

#include "console.hpp"

namespace flyball::app {

/// Writes a result's report, prints the result and tells why it is no, if it is.
///
/// A folder that --out names must be written, or nothing is printed but the error; a report that
/// nobody asked for only gives a warning.
/// @param write    report::write_identify_report and its siblings.
/// @param by_default  Whether a report is written without --out, too.
/// @param refusal  What the result ended with; null for a success.
/// @return The exit status.
template <class Result>
int answer(const Result& result,
           Expected<void> (*write)(const Result&, const std::string&, const report::Provenance&),
           const CommonOptions& options, bool by_default, const std::string& schema,
           const Error* refusal = nullptr) {
  std::string written;
  if (const auto folder = report_folder(options, by_default)) {
    const report::Provenance provenance{.command = options.typed, .files = {}};
    if (auto report = write(result, *folder, provenance)) {
      written = *folder;
    } else if (!options.out.empty()) {
      return fail(report.error(), options, schema);
    } else {
      warn("no report: " + to_string(report.error()));
    }
  }
  print(options.json ? study::to_json(result)
                     : report::to_terminal(result, terminal_style(), written));
  if (refusal != nullptr) {
    tell(*refusal);
    return exit_status(*refusal);
  }
  return success;
}

}  // namespace flyball::app
