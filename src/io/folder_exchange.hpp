#pragma once

#include <filesystem>
#include <vector>

#include "io/report_marker.hpp"
#include "io/unfinished_folder.hpp"

namespace flyball::io {

/// Puts a whole report where an earlier one stands, in one step of the file system: a reader, and
/// whoever looks after a kill, finds all of the one or all of the other. What is not of the earlier
/// report is in both until then, each file by a second link. The new folder gets the mode, the
/// owner and the group of the other.
///
/// @param made     The whole report, beside `folder`. If true is returned it is what stood in
///                 `folder` before, to be removed.
/// @param earlier  The files of the earlier report.
/// @return         False where it cannot be done, and `folder` is as it was: something is mounted
///                 there, the file system exchanges or links nothing, a program works in it, it has
///                 attributes that a new folder would not have, or somebody's own folder in it.
[[nodiscard]] bool exchange(UnfinishedFolder& made, const std::filesystem::path& folder,
                            const std::vector<WrittenFile>& earlier);

}  // namespace flyball::io
