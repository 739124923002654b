#pragma once

#include <optional>
#include <vector>

#include <flyball/classical/step_metrics.hpp>
#include <flyball/control/pid_design.hpp>

namespace flyball::detail {

/// The output of a stable loop P C after a step, and where it ends.
struct LoopMotion {
  std::vector<double> times;
  std::vector<double> values;
  std::vector<double> slopes;  ///< dy/dt, of either side of a corner that of the right; none of a
                               ///< discrete loop.
  double final_value = 0.0;
  bool settled = true;  ///< Whether the second half is at its end.
};

/// What is stepped: the reference, or a load at the plant's input.
enum class LoopStep { reference, load };

/// Of a continuous loop with dead time by the method of steps: the delayed input is a cubic over
/// each step, the rest of the loop exact. @param plant, controller  Of one period or none; the
/// controller without delay, and the plant without feedthrough if it has one.
/// At most 150 000 steps are made. Nothing for a delayed plant with feedthrough, or a final value
/// that is not finite.
[[nodiscard]] std::optional<LoopMotion> loop_motion(const classical::TransferFunction& plant,
                                                    const classical::TransferFunction& controller,
                                                    LoopStep step);

/// As `classical::step_metrics` with 2 %.
[[nodiscard]] classical::StepMetrics reference_metrics(const LoopMotion& motion);
[[nodiscard]] LoadResponse load_metrics(const LoopMotion& motion);

}  // namespace flyball::detail
