#pragma once

#include <string>
#include <vector>

#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

#include "report/document.hpp"

namespace flyball::report {

/// The runs to show: as prepared, or as recorded where the log was refused before.
[[nodiscard]] std::vector<identification::PreparedRun> shown_runs(
    const study::IdentifyResult& result);

[[nodiscard]] Section data_section(const study::IdentifyResult& result);
/// Gains and the quality of the fit; for a refused fit, its reason.
[[nodiscard]] Section gains_section(const study::IdentifyResult& result);
[[nodiscard]] Section plant_section(const study::DesignResult& result);
[[nodiscard]] Section controller_section(const study::DesignResult& result);
[[nodiscard]] Section robustness_section(const study::DesignResult& result);
[[nodiscard]] Section motion_section(const study::DesignResult& result);
/// @param kA_reason  Why the log does not determine kA, if it does not and says so.
[[nodiscard]] Section constants_section(const study::DesignResult& result,
                                        const std::string& kA_reason);
/// Most severe first; in the order found among equals; equal sentences once.
[[nodiscard]] Section diagnostics_section(std::vector<Diagnostic> diagnostics);

[[nodiscard]] Document document_of(const study::IdentifyResult& result);
[[nodiscard]] Document document_of(const study::DesignResult& result);
[[nodiscard]] Document document_of(const study::TuneResult& result);
[[nodiscard]] Document document_of(const study::ModelAnalysis& result);

[[nodiscard]] Verdict verdict_of(const study::IdentifyResult& result);
[[nodiscard]] Verdict verdict_of(const study::DesignResult& result);
[[nodiscard]] Verdict verdict_of(const study::TuneResult& result);
[[nodiscard]] Verdict verdict_of(const study::ModelAnalysis& result);

/// Its kind, motors, gearing, drum and gains.
[[nodiscard]] Facts plant_facts(const study::PlantDescription& plant);
/// "Elevator “lift” from log.json". @param subject  May be empty, as `path`.
[[nodiscard]] std::string title_of(const std::string& kind, const std::string& subject,
                                   const std::string& path);
/// What was measured: "velocity" for a flywheel, else "position".
[[nodiscard]] std::string measured_name(mechanisms::MechanismKind kind);
/// The unit of the controlled quantity: "rad/s" for a flywheel, else the unit itself.
[[nodiscard]] std::string controlled_unit(const study::PlantDescription& plant);
/// "Elevator", "Arm", "Flywheel".
[[nodiscard]] std::string capitalized(mechanisms::MechanismKind kind);
/// "elevator", …, or "drivetrain" for a log that was refused as one.
[[nodiscard]] std::string kind_of(const study::IdentifyResult& result);
[[nodiscard]] std::string capitalized(std::string name);

}  // namespace flyball::report
