#pragma once

#include <string>
#include <vector>

#include <flyball/classical/delay_system.hpp>

namespace flyball::classical {

/// A system in a diagram, with a name for each of its signals.
struct Block {
  std::string name;
  DelaySystem system;
  std::vector<std::string> inputs;   ///< The signals that it takes; "-y" turns the sign.
  std::vector<std::string> outputs;  ///< The signals that it makes.
};

/// A signal that is the sum of others.
struct SummingJunction {
  std::string output;
  std::vector<std::string> terms;  ///< "r", "-y"; one signal more than once adds up.
};

/// Systems that are connected by the names of their signals. Each signal is made once: by a block,
/// by a junction, or outside.
struct BlockDiagram {
  std::vector<Block> blocks;
  std::vector<SummingJunction> junctions{};
  std::vector<std::string> inputs;   ///< What comes from outside.
  std::vector<std::string> outputs;  ///< Any signals; "-u" turns the sign.
};

/// A diagram as one system.
struct ConnectedDiagram {
  DelaySystem system;  ///< From `inputs` to `outputs`; its states are the blocks', in their order.
  std::vector<std::string> unused{};  ///< Signals that are made and go nowhere.
};

/// Appendix A's diagrams, of any size.
/// @errors ArgumentError::empty (no block, input or output, or a name), unknown_name for a signal
/// that nothing makes, with the nearest name, ambiguous_name for one that is made twice,
/// wrong_shape for a block with other than as many names as signals;
/// TransferError::period_mismatch; SystemError::algebraic_loop with the blocks and junctions of the
/// loop that acts without dead time and has no answer.
/// Cost: O((blocks' inputs)³ + states²), allocates. Source: book, sections A.1 to A.5.
[[nodiscard]] Expected<ConnectedDiagram> connect(const BlockDiagram& diagram);

}  // namespace flyball::classical
