#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/classical/loop_margins.hpp>
#include <flyball/classical/nyquist.hpp>
#include <flyball/classical/root_locus.hpp>
#include <flyball/classical/step_metrics.hpp>
#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// How a loop is looked at.
enum class LoopView { bode, nyquist, nichols, rlocus, step, impulse, margins, sisotool };
inline constexpr std::array loop_views{LoopView::bode,    LoopView::nyquist, LoopView::nichols,
                                       LoopView::rlocus,  LoopView::step,    LoopView::impulse,
                                       LoopView::margins, LoopView::sisotool};
/// The command's name: "bode".
[[nodiscard]] std::string_view to_string(LoopView view);

/// Transfer functions, each the plant of a loop 1/(1 + k C G) or a system of its own, and what of
/// them is asked for.
struct LoopJob {
  LoopView view = LoopView::bode;
  std::vector<std::string> expressions{};  ///< G, as typed.
  std::string compensator{};               ///< C; empty: 1.
  double gain = 1.0;                       ///< k
  std::optional<Time> period{};            ///< Of z.
  Time delay{0.0};                         ///< Further dead time of the loop, s.
  bool closed = false;                     ///< Whether the response is that of the closed loop.
  bool negative = false;                   ///< Whether the locus is that of negative gains.
  std::optional<double> damping{};         ///< ζ at which gains of the locus are told.
  std::optional<AngularVelocity> from{};   ///< Frequencies; absent: chosen.
  std::optional<AngularVelocity> to{};
  std::optional<Time> duration{};  ///< Of responses; absent: until they have settled.
};

/// The fields that a view has, for whoever asks a person for them.
[[nodiscard]] std::vector<FieldInfo> loop_fields(LoopView view);

/// A job of a command line.
/// @param expressions  Transfer functions (`classical::parse_transfer_function`), or the paths of
/// JSON files with `expr`, or `num` and `den`, and `dt`, `delay` where they are not zero.
/// @param given  Options of `loop_fields`.
/// @errors ProjectError, ArgumentError, FileError; ArgumentError::empty without an expression.
[[nodiscard]] ExpectedAll<LoopJob> loop_job(LoopView view,
                                            const std::vector<std::string>& expressions,
                                            std::span<const Override> given);

/// A response over time.
struct LoopResponse {
  std::vector<double> time{};
  std::vector<double> value{};
  std::optional<classical::StepMetrics> metrics{};  ///< Of a step.
};

/// One of the transfer functions, as far as its view needs it.
struct LoopFindings {
  std::string name;                      ///< As typed.
  classical::TransferFunction transfer;  ///< k C G.
  Eigen::VectorXcd zeros{};
  Eigen::VectorXcd poles{};
  std::optional<classical::LoopMargins> margins{};
  std::optional<double> bandwidth{};           ///< rad/s, of L; none if it has none.
  std::optional<classical::BodeCurve> bode{};  ///< At `LoopResult::frequency`.
  std::optional<classical::NyquistData> nyquist{};
  std::optional<classical::RootLocus> locus{};  ///< Of C G.
  std::vector<classical::LocusPoint> at_damping{};
  std::optional<Eigen::VectorXcd> closed_poles{};  ///< Of 1 + k C G, without dead time.
  std::optional<LoopResponse> response{};
};

/// What a view shows.
struct LoopResult {
  LoopJob job;
  Eigen::VectorXd frequency{};  ///< rad/s, of all Bode curves.
  std::vector<LoopFindings> loops{};
  std::vector<Diagnostic> diagnostics{};
};

/// Margins, curves, loci and responses of the job's transfer functions.
/// @errors ArgumentError, TransferError, TransferTextError, expression::ExpressionError (with the
/// place in the text), SystemError; those of the parts.
[[nodiscard]] ExpectedAll<LoopResult> study_loops(const LoopJob& job);

/// Tables, and the view's pictures. Schema "flyball.loop/1".
[[nodiscard]] Answer answer_of(const LoopResult& result);

}  // namespace flyball::study
