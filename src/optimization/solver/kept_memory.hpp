#pragma once

namespace flyball::optimization::detail {

/// Problems are stated and solved one after another, each in memory of its own. glibc gives the top
/// of the heap back to the system when more of it is free than twice the largest block that was
/// ever mapped and freed again, and maps larger blocks each by itself; the next problem then
/// touches fresh pages, which takes longer than to solve it. One block of 4 MiB, freed untouched
/// the first time that a problem is made, lets 8 MiB stay with the process, as mallopt(3)
/// describes; where thresholds are set, and with other allocators, nothing changes.
void keep_freed_memory() noexcept;

}  // namespace flyball::optimization::detail
