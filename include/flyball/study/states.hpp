#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/planning/configuration/configuration_space.hpp>

/// Validation of a state machine with safe sets (book, section 16.4): the mechanisms' coordinates
/// span a configuration space, states are places in it, events move the mechanisms from place to
/// place, and no move may leave what is allowed.
namespace flyball::study {

/// A part of the configuration space with a name.
struct NamedSet {
  std::string name{};
  Region region{};
};

/// A state of the machine: where its mechanisms are when they have arrived.
struct MachineState {
  std::string name{};
  std::vector<double> at{};           ///< An entry a coordinate, SI.
  std::vector<std::string> within{};  ///< Sets in which it must be.
};

/// What an event does in a state.
struct MachineTransition {
  std::string from{};  ///< A state; "*": any that has no transition of its own.
  std::string event{};
  std::string to{};
  std::vector<std::vector<double>> via{};  ///< Places on the way, one after the other.
  /// Coordinates that move one after the other, the others with the last of them; empty: all move
  /// together, in a straight line.
  std::vector<int> order{};
  std::vector<std::string> within{};  ///< Sets that the way must not leave.
};

/// Events whose outcome is known: the book's unit test of a state machine.
struct MachineSequence {
  std::string name{};
  std::vector<std::string> events{};
  std::vector<std::string> states{};  ///< Expected after each event; empty: any.
  std::vector<std::string> within{};  ///< Sets that the whole way must not leave.
};

/// A state machine, its space and what is to be tried.
struct StatesJob {
  std::string path{};
  ConfigurationSpace space;
  std::vector<NamedSet> sets{};
  std::vector<MachineState> states{};
  std::vector<MachineTransition> transitions{};
  std::string start{};
  std::vector<MachineSequence> sequences{};
  int depth = 6;        ///< Events of the sequences that are explored, all of them.
  int interrupts = 0;   ///< At how many places of each move the next event may come before its end.
  bool strict = false;  ///< An event that a state does not know is a violation, not ignored.
};

/// What went wrong first.
struct MachineViolation {
  std::vector<std::string> events{};  ///< From the start, the last one among them.
  /// Where each event but the first came on the way of the one before, in [0, 1]; 1: at its end.
  std::vector<double> arrived{};
  std::string from{}, to{};      ///< States.
  std::string broken{};          ///< The constraint, the set, or what was expected.
  std::vector<double> before{};  ///< Where the move began,
  std::vector<double> at{};      ///< and where it went wrong.
  double share = 0.0;            ///< Of the move's way to there.
  std::string explanation{};     ///< A sentence.
  std::string sequence{};        ///< Its name, of one that was replayed.
};

/// What became of a sequence.
struct SequenceResult {
  std::string name{};
  std::vector<std::string> states{};  ///< From the start.
  std::optional<MachineViolation> violation{};
  std::vector<std::vector<double>> way{};  ///< Its corners in the space.
};

/// What validation found.
struct StatesResult {
  StatesJob job;
  std::vector<SequenceResult> sequences{};
  std::optional<MachineViolation> violation{};  ///< The first of the exploration: the shortest.
  std::size_t moves = 0;                        ///< Different moves that were judged.
  double sequences_explored = 0;                ///< Sequences of events that these stand for.
  bool complete = true;   ///< False: a bound ended it before the depth was reached.
  int depth_reached = 0;  ///< Of the longest sequences tried: not all of them if not complete.
  std::vector<std::string> unreached{};                  ///< States,
  std::vector<std::string> unknown_events{};             ///< "event in state", ignored.
  std::vector<std::vector<std::vector<double>>> ways{};  ///< Of each different move, for pictures.
};

/// Reads a file of a state machine (docs/guide/chapter-16.md). @errors FileError, ProjectError with
/// line and column, ArgumentError, those of the space.
[[nodiscard]] ExpectedAll<StatesJob> read_states(const std::string& path);
/// The same of a text.
[[nodiscard]] ExpectedAll<StatesJob> parse_states(std::string_view text, const std::string& path);

/// Replays the sequences, then tries all sequences of events up to the depth, shortest first, each
/// event at the end of the move before or, with interrupts, on its way. Moves are judged along
/// their whole length (`ConfigurationSpace::check_move`). Sequences that lead to the same state and
/// place are tried once.
/// @errors ArgumentError: names that are not there, two transitions of one state and event, depth
/// or
///         interrupts out of range; ConfigurationError::in_collision for a start that is not valid.
/// Cost: O(places · events) moves, at most 200 000. Source: book, section 16.4.
[[nodiscard]] Expected<StatesResult> validate_state_machine(const StatesJob& job);

/// What was tried and what broke, the space with the moves. Schema "flyball.states/1".
[[nodiscard]] Answer answer_of(const StatesResult& result);

}  // namespace flyball::study
