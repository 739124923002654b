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

}  // namespace flyball::report
