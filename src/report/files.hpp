#pragma once

#include <string>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>

namespace flyball::report {

/// A file of a report's folder.
struct ReportFile {
  std::string name;  ///< Relative: "data/closed_loop.csv".
  std::string contents;
};

/// Each run, measured and simulated (or as recorded), as CSV.
[[nodiscard]] std::vector<ReportFile> data_files(const study::IdentifyResult& result);
/// The closed-loop response and the robustness grid as CSV.
[[nodiscard]] std::vector<ReportFile> data_files(const study::DesignResult& result);
/// The step responses as CSV.
[[nodiscard]] std::vector<ReportFile> data_files(const study::ModelAnalysis& result);

/// The gains as a project file, intervals as comments; `flyball design` reads it. Without gains
/// (a refused fit) empty.
[[nodiscard]] std::string gains_toml(const study::IdentifyResult& result);
/// The gains with the controller's options.
/// @param fit  For the intervals; may be null.
[[nodiscard]] std::string gains_toml(const study::DesignResult& result,
                                     const identification::FeedforwardFit* fit);

}  // namespace flyball::report
