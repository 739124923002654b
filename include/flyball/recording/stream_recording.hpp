#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <flyball/core/errors.hpp>
#include <flyball/identification/one_step_fit.hpp>
#include <flyball/io/log.hpp>
#include <flyball/recording/load_recording.hpp>

/// Logs that are larger than what is held of them.
namespace flyball::recording {

/// Bytes of a file from which on it is read in passes: 16 MiB.
inline constexpr std::uintmax_t streamed_from = std::uintmax_t{16} << 20;

/// A part of a log that a fit takes, read in one pass over the file.
///
/// Of each kind of test (told by the channel that names them, in a SysId JSON by its tables, else
/// by the voltage's sign) a few are kept, drawn by lot, whole: as many as the 30 000 rows of a fit
/// hold. Of a test longer than 32 s there are eight stretches of 2 s from its start, on which a
/// step sets off, to its end. What comes faster than one every 2.5 ms is put together: voltages to
/// their mean until the next, velocities to the mean about it, of positions one.
struct BoundedLog {
  Log log;
  std::vector<double> begins{};  ///< s, of the tests that are kept; not of a SysId JSON.
  std::size_t samples = 0;       ///< Rows of the file, or records of a WPILOG.
  std::size_t tests = 0;         ///< In the file.
  std::size_t kept = 0;          ///< Of them, whole or in stretches.
  std::size_t in_stretches = 0;  ///< Of these.
};

/// Reads it. @param selection  Its channels are kept, beside those whose names fit.
/// @return Nothing for a file that has to be read whole: see `stream_log`, and for a person's
/// choice of runs and of a second log.
/// @errors FileError, LogError. Cost: one pass; memory by the number of channels.
[[nodiscard]] ExpectedAll<std::optional<BoundedLog>> read_bounded_log(
    const std::string& path, const LogSelection& selection = {});

/// As `recording_from_log`; what begins in the middle of a test is a run of its own, whose first
/// row is cut off as by hand (`from`), so that its speed is not taken for rest.
/// @errors As `recording_from_log`.
[[nodiscard]] ExpectedAll<LoadedRecording> recording_from_bounded_log(
    const BoundedLog& bounded, const LogSelection& selection = {});

/// The book's regression over all rows of a file.
struct StreamedRegression {
  identification::OneStepFit fit;
  std::size_t rows = 0;  ///< That were regressed.
};

/// x_{k+1} = α x_k + β u_k + γ sgn(x_k) (and gravity) over all rows of a log in a second pass, by
/// QR updates: no row is kept, no digit lost. Rows are the velocity's; the voltage is the one in
/// force. Used are neighbours about one period apart, in tests, faster than 4 % of the top speed.
///
/// @param prepared  Of the bounded part, which tells units, signs, kind and top speed.
/// @return Nothing where a drivetrain, a log without a usable velocity, or signs that were mended
/// run by run leave no regression.
/// @errors As `read_bounded_log`; IdentificationError::too_short, singular.
/// Cost: one pass; constant memory. Source: book, section 14.2.
[[nodiscard]] ExpectedAll<std::optional<StreamedRegression>> regress_whole_log(
    const std::string& path, const BoundedLog& bounded, const LogSelection& selection,
    const identification::PreparedRecording& prepared);

}  // namespace flyball::recording
