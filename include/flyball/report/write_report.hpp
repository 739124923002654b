#pragma once

#include <string>

#include <flyball/core/expected.hpp>
#include <flyball/report/html.hpp>

namespace flyball::report {

/// Writes a report's folder, whole or not at all (io's OutputFolder: a folder that holds an earlier
/// report is replaced, any other that is not empty is refused).
///
/// index.html (to_html), result.json (study::to_json), gains.toml (a project file: `flyball design`
/// reads it), data/*.csv (each run measured against simulated, the closed-loop response, the
/// robustness grid, the step responses), pictures/*.svg and *.png, constants/*.txt, and the
/// generated C++ header. What a result does not have is left out. The same result gives the same
/// bytes.
///
/// @param folder  Where it shall stand. @param provenance  Its `files` are filled in here.
/// @errors FileError. A picture that gnuplot refuses is left out and said so in the page.
[[nodiscard]] Expected<void> write_identify_report(const study::IdentifyResult& result,
                                                   const std::string& folder,
                                                   const Provenance& provenance = {});
[[nodiscard]] Expected<void> write_design_report(const study::DesignResult& result,
                                                 const std::string& folder,
                                                 const Provenance& provenance = {});
[[nodiscard]] Expected<void> write_tune_report(const study::TuneResult& result,
                                               const std::string& folder,
                                               const Provenance& provenance = {});
[[nodiscard]] Expected<void> write_analyze_report(const study::ModelAnalysis& result,
                                                  const std::string& folder,
                                                  const Provenance& provenance = {});

}  // namespace flyball::report
