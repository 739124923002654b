#include <fmt/format.h>

#include <flyball/core/progress.hpp>
#include <flyball/report/terminal.hpp>
#include <flyball/report/write_report.hpp>

#include "answer.hpp"

namespace flyball::app {

int tell(const Answer& answer, const CommonOptions& options, bool by_default) {
  std::string written;
  if (const auto folder = report_folder(options, by_default)) {
    tell_progress("writes the report");
    if (auto report = report::write_report(answer, *folder, {.command = options.typed})) {
      written = *folder;
      if (const auto& problems = report->problems; !problems.empty()) {
        warn(fmt::format("{} of the report's {} pictures could not be drawn: {}", problems.size(),
                         answer.figures.size(), problems.front()));
      }
    } else if (!options.out.empty()) {
      return fail(report.error(), options, answer.schema);
    } else {
      warn("no report: " + to_string(report.error()));
    }
  }
  print(options.json ? answer.json
                     : report::to_terminal(answer.document, terminal_style(), written));
  if (answer.refusal) {
    tell(*answer.refusal);
    return exit_status(*answer.refusal);
  }
  return success;
}

}  // namespace flyball::app
