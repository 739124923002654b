#pragma once

#include <optional>

#include <flyball/study/identify.hpp>

namespace flyball::study {

/// `identify` of a log of any size in two passes over its file and in memory that does not grow
/// with it: the fit is of a bounded part (`recording::BoundedLog`), `one_step` the book's
/// regression over all rows. What `identify` does by itself from `recording::streamed_from` bytes
/// on.
///
/// Told by the diagnostic "read_in_passes".
/// @return Nothing for a log that has to be read whole (`recording::read_bounded_log`), as that of
/// a drivetrain.
/// @errors as `identify`. Cost: two passes and a fit of 30 000 rows.
[[nodiscard]] ExpectedAll<std::optional<IdentifyResult>> identify_streamed(const IdentifyJob& job);

}  // namespace flyball::study
