#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <flyball/identification/feedforward_fit.hpp>

/// A bounded part of recordings that are longer than a fit needs.
namespace flyball::identification {

/// Rows that a fit takes, all runs together.
inline constexpr std::size_t most_fitted_rows = 30'000;

/// A recording of more rows than a fit takes that come faster than one every 2.5 ms, at that
/// period: a row stands for those up to the next, with the mean of their voltages (the voltage is
/// held in between), its own position, and the mean of the velocities about it. Nothing of a
/// recording that is not like that. Says so.
[[nodiscard]] std::optional<Recording> at_coarser_rows(const Recording& recording,
                                                       std::vector<Diagnostic>& diagnostics);

/// Of a recording with more usable rows than a fit takes, stretches that are evenly spread over
/// each run from its start, on which a step sets off, to its end; each is a run that goes on from
/// an unknown speed, with the source of its run. Runs that are short beside the others stay whole.
/// Of more than 48 tests eight of each kind, spread over the log, are taken; the others did not
/// move. Nothing of a recording without more. Says so.
[[nodiscard]] std::optional<PreparedRecording> representative_part(
    const PreparedRecording& prepared, std::vector<Diagnostic>& diagnostics);

/// Puts the stretches of one run together, so that the fit has one entry for each run again.
void join_stretches(FeedforwardFit& fit);

}  // namespace flyball::identification
