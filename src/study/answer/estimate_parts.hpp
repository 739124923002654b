#pragma once

#include <vector>

#include <flyball/study/estimate.hpp>

/// The parts of the answer to an estimation.
namespace flyball::study {

[[nodiscard]] inline bool is_smoothed(const EstimatedRun& run) {
  return run.smoothed.size() != 0;
}

/// Of each run its states with their bands, and its innovations.
[[nodiscard]] std::vector<Figure> figures_of(const Estimation& result);
/// Each run as CSV, all of them as a WPILOG.
[[nodiscard]] std::vector<AnswerFile> data_files(const Estimation& result);

}  // namespace flyball::study
