#include <flyball/classical/block_diagram.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include <flyball/core/text.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "core/wording.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr std::string_view in_connect = "connect";

/// A name as it is used: its sign and the signal.
struct Use {
  double sign = 1.0;
  std::string_view name;
};

Use use_of(std::string_view text) {
  const bool minus = !text.empty() && text.front() == '-';
  return {minus ? -1.0 : 1.0, minus || text.starts_with('+') ? text.substr(1) : text};
}

/// The signals of a diagram: those from outside first, then what blocks and junctions make.
class Signals {
 public:
  Expected<void> add(const std::string& name, std::string maker) {
    if (name.empty() || name.front() == '-' || name.front() == '+') {
      return refusal(ArgumentError::empty, in_connect, "the name of a signal of " + maker)
          .got(name.empty() ? "empty" : text::printable(name))
          .expected("a name without a sign");
    }
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found != names_.end()) {
      return refusal(ArgumentError::ambiguous_name, in_connect, "signal " + text::printable(name))
          .got(flyball::detail::format("made by {} and by {}",
                                       makers_[static_cast<std::size_t>(found - names_.begin())],
                                       maker))
          .expected("made once")
          .hint("rename one, or add them in a junction");
    }
    names_.push_back(name);
    makers_.push_back(std::move(maker));
    used_.push_back(false);
    return {};
  }

  Expected<Index> find(std::string_view name, std::string_view user) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) {
      std::vector<std::string_view> known(names_.begin(), names_.end());
      const std::string nearest = nearest_name(name, known);
      return refusal(ArgumentError::unknown_name, in_connect,
                     flyball::detail::format("signal {} of {}", text::printable(name), user))
          .got("made by nothing")
          .expected("made by a block or a junction, or an input of the diagram")
          .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?");
    }
    const auto i = static_cast<std::size_t>(found - names_.begin());
    used_[i] = true;
    return static_cast<Index>(i);
  }

  [[nodiscard]] Index size() const { return static_cast<Index>(names_.size()); }
  [[nodiscard]] std::vector<std::string> unused() const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!used_[i]) {
        names.push_back(names_[i]);
      }
    }
    return names;
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::string> makers_;
  std::vector<bool> used_;
};

/// A block, or a junction as one.
struct Part {
  std::string name;
  DelaySystem system;
  const std::vector<std::string>* inputs;
  std::vector<std::string> outputs;
};

Expected<std::vector<Part>> parts_of(const BlockDiagram& diagram,
                                     const std::optional<Time>& period) {
  std::vector<Part> parts;
  for (const Block& block : diagram.blocks) {
    const std::string name = flyball::detail::format("block {}", text::printable(block.name));
    for (const auto& [names, count, what] :
         {std::tuple{&block.inputs, block.system.inputs(), "input"},
          {&block.outputs, block.system.outputs(), "output"}}) {
      if (static_cast<Index>(names->size()) != count) {
        return refusal(ArgumentError::wrong_shape, in_connect,
                       flyball::detail::format("the number of names for {}s of {}", what, name))
            .got(std::to_string(names->size()))
            .expected(flyball::detail::format("{}, one for each {}", count, what));
      }
    }
    parts.push_back({name, block.system, &block.inputs, block.outputs});
  }
  for (const SummingJunction& junction : diagram.junctions) {
    const std::string name =
        flyball::detail::format("the junction of {}", text::printable(junction.output));
    if (junction.terms.empty()) {
      return refusal(ArgumentError::empty, in_connect, name).got("without terms");
    }
    FLYBALL_TRY(
        const auto sum,
        DelaySystem::gain(MatrixXd::Ones(1, static_cast<Index>(junction.terms.size())), period));
    parts.push_back({name, sum, &junction.terms, {junction.output}});
  }
  return parts;
}

/// The parts of the loops in L, u = L u, by their inputs.
std::string loop_text(const MatrixXd& L, const std::vector<Part>& parts) {
  const Index m = L.rows();
  Eigen::MatrixXi reach = (L.array() != 0.0).cast<int>();
  for (Index via = 0; via < m; ++via) {
    for (Index i = 0; i < m; ++i) {
      if (reach(i, via) != 0) {
        reach.row(i) = reach.row(i).cwiseMax(reach.row(via));
      }
    }
  }
  std::vector<std::string> names;
  Index first = 0;
  for (const Part& part : parts) {
    const Index count = part.system.inputs();
    if (reach.diagonal().segment(first, count).any()) {
      names.push_back(part.name);
    }
    first += count;
  }
  return text::enumerate(names);
}

}  // namespace

Expected<ConnectedDiagram> connect(const BlockDiagram& diagram) {
  if (diagram.blocks.empty()) {
    return refusal(ArgumentError::empty, in_connect, "the list of blocks").got("empty");
  }
  for (const auto& [names, what] :
       {std::pair{&diagram.inputs, "inputs"}, {&diagram.outputs, "outputs"}}) {
    if (names->empty()) {
      return refusal(ArgumentError::empty, in_connect,
                     flyball::detail::format("the list of the diagram's {}", what))
          .got("empty");
    }
  }
  const std::optional<Time> period = diagram.blocks.front().system.period();
  FLYBALL_TRY(const auto parts, parts_of(diagram, period));

  Signals signals;
  for (const std::string& name : diagram.inputs) {
    FLYBALL_CHECK(signals.add(name, "the inputs"));
  }
  for (const Part& part : parts) {
    for (const std::string& name : part.outputs) {
      FLYBALL_CHECK(signals.add(name, part.name));
    }
  }

  DelaySystem all = parts.front().system;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    FLYBALL_TRY_IN(parts[i].name, all, append(all, parts[i].system));
  }
  // Columns of F, H are the parts' outputs, those of E, J what comes from outside.
  const auto outside = static_cast<Index>(diagram.inputs.size());
  const Index made = signals.size() - outside;
  const auto wanted = static_cast<Index>(diagram.outputs.size());
  Wiring wiring{MatrixXd::Zero(all.inputs(), made), MatrixXd::Zero(all.inputs(), outside),
                MatrixXd::Zero(wanted, made), MatrixXd::Zero(wanted, outside)};
  const auto wire = [&](std::string_view text, std::string_view user, MatrixXd& inner,
                        MatrixXd& outer, Index row) -> Expected<void> {
    const Use use = use_of(text);
    FLYBALL_TRY(const Index signal, signals.find(use.name, user));
    (signal < outside ? outer(row, signal) : inner(row, signal - outside)) += use.sign;
    return {};
  };
  Index row = 0;
  for (const Part& part : parts) {
    for (const std::string& text : *part.inputs) {
      FLYBALL_CHECK(wire(text, part.name, wiring.F, wiring.E, row++));
    }
  }
  row = 0;
  for (const std::string& text : diagram.outputs) {
    FLYBALL_CHECK(wire(text, "the outputs", wiring.H, wiring.J, row++));
  }

  auto connected = rewired(all, wiring);
  if (!connected && connected.error().is(SystemError::algebraic_loop)) {
    const MatrixXd L = flyball::detail::product(wiring.F, all.form().D11);
    return refusal(SystemError::algebraic_loop, in_connect, "the loop of " + loop_text(L, parts))
        .got("without dynamics and without an answer")
        .expected("a loop whose gain is not one at infinite frequency")
        .hint("give one of them dynamics or dead time");
  }
  return std::move(connected).map(
      [&](DelaySystem&& system) { return ConnectedDiagram{std::move(system), signals.unused()}; });
}

}  // namespace flyball::classical
