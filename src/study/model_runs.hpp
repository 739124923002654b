#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/diagnostic.hpp>
#include <flyball/core/expected.hpp>
#include <flyball/identification/prediction_error.hpp>
#include <flyball/io/log.hpp>
#include <flyball/study/model_job.hpp>

/// A log as recordings of a model's inputs and outputs.
namespace flyball::study {

/// A stretch of the log's time; of NaN it is none.
struct Stretch {
  double from = std::numeric_limits<double>::quiet_NaN();
  double to = std::numeric_limits<double>::quiet_NaN();
  [[nodiscard]] bool holds(double t) const { return t >= from && t <= to; }
};

/// What a part of the log is cut from.
struct Part {
  std::string_view run;                      ///< What its runs are called.
  const std::vector<std::string>& channels;  ///< Of the inputs, then of the outputs.
  std::string_view key;                      ///< Of [fit], which says the channels.
  Stretch within{};
  Stretch without{};
  /// Whether a sample is taken at each time of any channel between the outputs' first and last,
  /// measured or not; otherwise at those of the first output, where the others are read.
  bool every_channel = false;
};

/// Cuts a log into runs. Where the time jumps, a new one begins.
class RunCutter {
 public:
  /// @param job  Whose errors they are.
  RunCutter(const Log& log, const ModelJob& of, std::string_view job,
            std::vector<Diagnostic>& diagnostics)
      : log_(log), model_job_(of), job_(job), diagnostics_(diagnostics) {}

  /// @errors ArgumentError::unknown_name for a channel that is not there, wrong_unit, out_of_range
  ///         for a part without samples.
  Expected<std::vector<identification::ExperimentRun>> cut(const Part& part);

 private:
  struct Channel;
  [[nodiscard]] Expected<Channel> channel_of(const std::string& name, const Coordinate& of,
                                             std::string_view key) const;
  void add_run(const std::vector<double>& times, const std::vector<Channel>& inputs,
               const std::vector<Channel>& outputs, double apart,
               std::vector<identification::ExperimentRun>& runs);

  const Log& log_;
  const ModelJob& model_job_;
  std::string_view job_;
  std::vector<Diagnostic>& diagnostics_;
  std::size_t dropped_ = 0;
};

}  // namespace flyball::study
