#pragma once

#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/report/html.hpp>

namespace flyball::report {

/// What a report lacks after it was written.
struct WrittenReport {
  std::vector<std::string> problems{};  ///< Of the pictures that are not in it, one each.
};

/// Writes a report's folder (io's OutputFolder: a new one whole or not at all; in one that holds an
/// earlier report what Flyball wrote is replaced, any other that is not empty is refused):
/// index.html (to_html), result.json, the answer's files, pictures/*.svg and *.png. The same answer
/// gives the same bytes.
///
/// @param folder  Where it will stand. @param provenance  Its `files` are filled in here.
/// @errors FileError. A picture that gnuplot refuses, or has not drawn when a minute is over, is
/// left out and said so in the page.
[[nodiscard]] Expected<WrittenReport> write_report(const Answer& answer, const std::string& folder,
                                                   const Provenance& provenance = {});

}  // namespace flyball::report
