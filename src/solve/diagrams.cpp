#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <flyball/classical/block_diagram.hpp>
#include <flyball/classical/delay_poles.hpp>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// Whole diagrams of named blocks (appendix A).
namespace flyball::solve {

namespace {

using classical::Block;
using classical::BlockDiagram;
using classical::DelaySystem;
using Eigen::MatrixXd;

/// A block's system: a transfer function, or matrices.
Expected<DelaySystem> system_of(const Problem& block, const std::string& where) {
  bool matrices = false;
  for (const char* name : {"A", "B", "C", "D"}) {
    matrices = matrices || block.has(name);
  }
  if (!matrices) {
    FLYBALL_TRY_IN(where, const auto transfer, transfer_system_of(block, where));
    return delay_system_of(transfer);
  }
  for (const char* name : {"num", "den", "expr"}) {
    if (block.has(name)) {
      return refusal(ArgumentError::malformed, where, name)
          .got("given beside matrices")
          .expected("a transfer function, or A, B, C and D");
    }
  }
  const double dt = block.number("dt");
  const double delay = block.number("delay");
  FLYBALL_CHECK(Checks(where).not_negative(dt, "dt", "s").not_negative(delay, "delay", "s"));
  ContinuousSystem<> system;
  if (block.has("A") || block.has("B") || block.has("C")) {
    for (const char* name : {"A", "B"}) {
      if (!block.has(name)) {
        return refusal(ArgumentError::malformed, where, name)
            .got("left out")
            .expected("there: states have A and B; a gain is D alone");
      }
    }
    const MatrixXd& A = block.matrix("A");
    const MatrixXd& B = block.matrix("B");
    system = {A, B, block.has("C") ? block.matrix("C") : MatrixXd::Identity(A.rows(), A.rows()),
              MatrixXd()};
    system.D = block.has("D") ? block.matrix("D") : MatrixXd::Zero(system.C.rows(), B.cols());
  } else {
    const MatrixXd& D = block.matrix("D");
    system = {MatrixXd(0, 0), MatrixXd(0, D.cols()), MatrixXd(D.rows(), 0), D};
  }
  FLYBALL_TRY_IN(where, const auto prompt,
                 dt > 0.0 ? DelaySystem::create(
                                DiscreteSystem<>{system.A, system.B, system.C, system.D, Time(dt)})
                          : DelaySystem::create(system));
  if (delay == 0.0) {
    return prompt;
  }
  FLYBALL_TRY_IN(where, auto late,
                 prompt.with_input_delays(Eigen::VectorXd::Constant(prompt.inputs(), delay)));
  return late;
}

Outcome solve_connect(const Problem& problem, JsonWriter& answer) {
  constexpr std::string_view where = "connect";
  BlockDiagram diagram;
  for (const Problem& block : problem.objects("blocks")) {
    const std::string& name = block.text("name");
    FLYBALL_TRY(auto system, system_of(block, std::string(where) + " block \"" + name + "\""));
    diagram.blocks.push_back(
        Block{name, std::move(system), block.texts("inputs"), block.texts("outputs")});
  }
  for (const Problem& sum : problem.objects("sums")) {
    diagram.junctions.push_back({sum.text("output"), sum.texts("terms")});
  }
  diagram.inputs = problem.texts("inputs");
  diagram.outputs = problem.texts("outputs");
  FLYBALL_TRY(const auto connected, classical::connect(diagram));
  const DelaySystem& system = connected.system;
  if (system.period()) {
    // Dead times of a discrete one are states.
    FLYBALL_TRY(const auto states, system.to_discrete());
    write_system(states, answer);
    answer.add("dt", system.period()->si());
  } else {
    write_delay_form(system, answer);
  }
  FLYBALL_TRY(const auto found, classical::rightmost_poles(system));
  answer.add("poles", found.poles);
  answer.add("stable", found.stable);
  answer.add("unused", connected.unused);
  return {};
}

}  // namespace

std::vector<Kind> diagram_kinds() {
  static const std::vector<Field> block =
      std::vector{text("name", "what the block is called"),
                  texts("inputs", "m", "the signals that it takes; \"-y\" turns the sign"),
                  texts("outputs", "p", "the signals that it makes")} +
      transfer_fields() +
      std::vector{
          optional(matrix("A", "n", "n", "in place of a transfer function")),
          optional(matrix("B", "n", "m", "how the inputs move the states")),
          optional(matrix("C", "p", "n", "how the outputs see them, the states if left out")),
          optional(matrix("D", "p", "m", "how the inputs reach the outputs; a gain alone"))};
  static const std::vector<Field> sum{
      text("output", "the signal that it makes"),
      texts("terms", "e", "the signals that it adds; \"-y\" subtracts")};
  return {
      {"connect",
       "a whole diagram of blocks and sums that are connected by the names of their signals "
       "(A.1 to A.5), with dead time anywhere",
       {objects("blocks", block, "each a transfer function, or matrices"),
        optional(objects("sums", sum, "summing junctions")),
        texts("inputs", "m", "signals that come from outside"),
        texts("outputs", "p", "signals that are seen; \"-u\" turns the sign")},
       answered_system("n", "m", "p") +
           std::vector{
               optional(number("dt", "s", "of a discrete one, whose dead times are states"))} +
           delay_form_fields() +
           std::vector{complex_list("poles", "s", "with dead time in a loop the rightmost"),
                       flag("stable", "whether all are where a stable system has them"),
                       texts("unused", "l", "signals that go nowhere")},
       R"({"blocks": [{"name": "C", "inputs": ["e"], "outputs": ["u"], "expr": "2 + 1/s"}, {"name": "G", "inputs": ["u"], "outputs": ["y"], "num": [1], "den": [1, 1]}], "sums": [{"output": "e", "terms": ["r", "-y"]}], "inputs": ["r"], "outputs": ["y", "u"]})",
       &solve_connect},
  };
}

}  // namespace flyball::solve
