#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <flyball/math/expression/tape.hpp>

namespace flyball::expression {

/// Writes a tape node by node. What was written already is not written again (x·y and y·x are one),
/// operations on constants are computed at once, and x + 0, x - 0, 1 x, x/1, -(-x), whole powers up
/// to 16 and square roots take their simpler form. Results are those of the operations as written,
/// but for the sign of a zero, a whole power's last digits, and (-∞)^0.5, which is NaN. Work that
/// no output needs is left out by `finish`.
///
/// ```
/// TapeBuilder tape;
/// const Slot angle = tape.input(0);
/// const Slot speed = tape.input(1);
/// const Slot pull = tape.unary(Operation::sin, angle);
/// const std::array outputs{speed, tape.binary(Operation::multiply, tape.constant(-9.81), pull)};
/// const Tape pendulum = tape.finish(outputs);
/// ```
class TapeBuilder {
 public:
  /// @param inputs, parameters  As many as the tape has at least, used or not.
  explicit TapeBuilder(std::size_t inputs = 0, std::size_t parameters = 0)
      : inputs_(inputs), parameters_(parameters) {}

  /// Writing needs slots of this builder. Cost: O(1) each, allocates.
  ///@{
  Slot constant(double value);
  Slot parameter(std::size_t number);
  Slot input(std::size_t number);
  Slot unary(Operation operation, Slot a);
  Slot binary(Operation operation, Slot a, Slot b);
  /// condition ≠ 0 ? then : otherwise. Both are computed.
  Slot select(Slot condition, Slot then, Slot otherwise);
  /// A node of any kind, its operands slots of this builder.
  Slot node(const Node& node);
  ///@}

  [[nodiscard]] const Node& operator[](Slot slot) const { return nodes_[slot.index]; }
  [[nodiscard]] std::size_t size() const noexcept { return nodes_.size(); }
  /// The value of a slot that is a constant.
  [[nodiscard]] std::optional<double> constant_value(Slot slot) const;

  /// The tape of some outputs. The builder can be written on.
  [[nodiscard]] Tape finish(std::span<const Slot> outputs) const;

 private:
  struct Hash {
    std::size_t operator()(const Node& node) const noexcept;
  };

  Slot intern(const Node& node);
  std::optional<Slot> simpler(Operation operation, Slot a, Slot b);
  std::optional<Slot> simpler_power(Slot base, double exponent);

  std::size_t inputs_;
  std::size_t parameters_;
  std::vector<Node> nodes_;
  std::unordered_map<Node, std::uint32_t, Hash> known_;
};

}  // namespace flyball::expression
