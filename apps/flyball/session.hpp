#pragma once

/// What a run of the command owes to those who started it.
namespace flyball::app {

/// Opens standard streams that are closed, so that no file gets their numbers; what is written to
/// such an output fails. Makes INT, TERM and HUP remove temporary folders before they end the
/// process as they would have. Before any thread is started.
void begin_session();

/// @return The status, or that of bad input if not all of standard output could be written.
[[nodiscard]] int end_session(int status);

}  // namespace flyball::app
