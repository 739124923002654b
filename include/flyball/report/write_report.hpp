#pragma once

#include <string>

#include <flyball/core/expected.hpp>
#include <flyball/report/html.hpp>

namespace flyball::report {

/// Writes a report's folder, whole or not at all (io's OutputFolder: a folder that holds an earlier
/// report is replaced, any other that is not empty is refused): index.html (to_html), result.json,
/// the answer's files, pictures/*.svg and *.png. The same answer gives the same bytes.
///
/// @param folder  Where it will stand. @param provenance  Its `files` are filled in here.
/// @errors FileError. A picture that gnuplot refuses is left out and said so in the page.
[[nodiscard]] Expected<void> write_report(const Answer& answer, const std::string& folder,
                                          const Provenance& provenance = {});

}  // namespace flyball::report
