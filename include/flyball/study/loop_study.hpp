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
#include <flyball/classical/transfer_expression.hpp>
#include <flyball/control/pid_design.hpp>
#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study {

/// How a loop is looked at.
enum class LoopView { bode, nyquist, nichols, rlocus, step, impulse, margins, sisotool, pidtune };
inline constexpr std::array loop_views{LoopView::bode,    LoopView::nyquist,  LoopView::nichols,
                                       LoopView::rlocus,  LoopView::step,     LoopView::impulse,
                                       LoopView::margins, LoopView::sisotool, LoopView::pidtune};
/// The command's name: "bode".
[[nodiscard]] std::string_view to_string(LoopView view);

/// What decides about PID gains.
enum class PidMethod {
  robust,      ///< The most integral gain for a robustness (`tune_by_robustness`).
  loop_shape,  ///< Crossover and phase margin (`tune_by_loop_shape`).
  simc,        ///< `tune_simc`
  poles,       ///< `tune_by_poles`
};

/// PID gains that are asked for.
struct PidGoal {
  PidForm form = PidForm::pid;
  PidMethod method = PidMethod::robust;  ///< With a crossover loop_shape, a frequency poles.
  double sensitivity = 1.4;              ///< max |S|, of robust.
  std::optional<double> complementary{};
  std::optional<AngularVelocity> crossover{};
  double phase_margin = 60.0;                          ///< deg, of loop_shape.
  Time closed_loop_time{0.0};                          ///< s, of simc; 0: the delay.
  std::optional<AngularVelocity> natural_frequency{};  ///< Of poles.
  double damping_ratio = 0.7;
  double filter_ratio = 10.0;  ///< N, τ = T_d/N.
};

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
  PidGoal pid{};                   ///< Of pidtune, whose plants are C G with k = 1.
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
  std::string name;                  ///< As typed.
  classical::TransferSystem system;  ///< k C G, or what pidtune found times C G.
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
  std::optional<PidLoop> pid{};
  std::optional<classical::TransferFunction> plant{};  ///< Of pid: C G.
  std::optional<LoopResponse>
      load{};  ///< Of pidtune: the output after a step at the plant's input.

  /// Null where it has several dead times.
  [[nodiscard]] const classical::TransferFunction* rational() const {
    return std::get_if<classical::TransferFunction>(&system);
  }
  [[nodiscard]] std::optional<Time> period() const;
  [[nodiscard]] double dc_gain() const;
  /// s, each once, rising; empty without dead time.
  [[nodiscard]] std::vector<double> delays() const;
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
