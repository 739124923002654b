#pragma once

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/mimo_margins.hpp>
#include <flyball/classical/nyquist.hpp>

/// How far loops with dead time anywhere in them are from instability.
namespace flyball::classical {

/// `loop_margins` of a loop with any delays, exact in them, in loops within L too.
///
/// No crossing in the range is missed: on a disk around a frequency the characteristic matrix moves
/// by no more than its entries' bounds, so that L there is within a bound of its value and slope,
/// and an interval that may hold two crossings is halved. The range goes from where the asymptote
/// at ω → 0 rules to where no larger frequency has |L| = 1; where the part of L that passes by all
/// states can have that gain for ever, and for phase crossings, it ends at ten times the fastest
/// pole or 1/delay. Whether the closed loop is stable is `rightmost_poles`'s word.
/// Without dead time, and of a discrete loop, it is the other `loop_margins`.
/// @param loop  L, one input, one output; negative feedback.
/// @return  A delay margin of zero also where the least further delay destabilizes: L keeps a gain
/// above one at infinite frequency.
/// @errors ArgumentError::wrong_shape; SystemError::algebraic_loop, no_convergence (of
/// `rightmost_poles`, or where crossings do not end).
/// Cost: some thousand systems of n + delays equations; for the crossings at most 60 000, for the
/// peaks 20 000 each, and of more than ten equations, N, fewer by (10/N)³.
[[nodiscard]] Expected<LoopMargins> loop_margins(const DelaySystem& loop);

/// `mimo_margins` of a square loop with dead time in any of its channels or loops. Peaks are found
/// to 1e-5 by the same bounds, and refined. @errors As `loop_margins`.
[[nodiscard]] Expected<MimoMargins> mimo_margins(const DelaySystem& loop);

/// The largest singular value over all frequencies, to 1e-5, then refined; that at infinite
/// frequency for the worst phases of the delays counts. Not of a discrete system.
/// @errors TransferError::period_mismatch; those of `frequency_grid`.
[[nodiscard]] Expected<Peak> peak_gain(const DelaySystem& system);

/// The first frequency at which |G| falls below |G(0)| by the factor, as `bandwidth` of a transfer
/// function. @errors As `loop_margins`.
[[nodiscard]] Expected<std::optional<double>> bandwidth(const DelaySystem& system,
                                                        double factor = 0.7079457843841379);

/// `nyquist` of it: a curve by the grid, poles on the axis passed on half circles; what is counted
/// is counted by the poles of L and of the closed loop (`rightmost_poles`), of which the
/// encirclements are the difference.
/// @errors ArgumentError::wrong_shape; those of `frequency_grid` and `rightmost_poles`.
[[nodiscard]] Expected<NyquistData> nyquist(const DelaySystem& loop,
                                            const FrequencyGridOptions& options = {});

}  // namespace flyball::classical
