#include <flyball/study/identify.hpp>

#include <utility>

#include "core/try.hpp"

namespace flyball::study {

std::vector<Diagnostic> IdentifyResult::diagnostics() const {
  std::vector<Diagnostic> all = source.diagnostics;
  all.insert(all.end(), report.diagnostics.begin(), report.diagnostics.end());
  return all;
}

ExpectedAll<IdentifyResult> identify(const IdentifyJob& job) {
  FLYBALL_TRY(auto source, load_recording(job.log, job.selection));
  if (source.refusal) {
    identification::FitReport refused{
        .prepared = {}, .diagnostics = {}, .fit = tl::unexpected(*source.refusal)};
    return IdentifyResult{
        .source = std::move(source), .report = std::move(refused), .mechanism = {}, .unit = "unit"};
  }
  const mechanisms::MechanismKind mechanism = *source.recording.mechanism;
  const std::string unit = source.recording.unit;
  identification::FitReport report = identification::identify_feedforward(source.recording);
  return IdentifyResult{.source = std::move(source),
                        .report = std::move(report),
                        .mechanism = mechanism,
                        .unit = unit};
}

}  // namespace flyball::study
