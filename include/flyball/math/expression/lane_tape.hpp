#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <flyball/math/expression/tape.hpp>

namespace flyball::expression {

/// A tape made ready to be evaluated at many points side by side: each operation runs over
/// `lanes` points before the next one, in vector registers where the processor has them, products
/// are fused into sums, and values that are no longer needed leave their place to others.
///
/// All numbers of a lane tape stand in a workspace of the caller, a value of all lanes together:
///
/// ```
/// std::vector<double> work(tape.workspace_size());
/// tape.prepare(parameters, work.data());
/// tape.input(0, work.data())[lane] = …;
/// tape.evaluate(work.data());
/// … = tape.output(0, work.data())[lane];
/// ```
///
/// Results differ from those of `Tape` by rounding: fused products, and sines and cosines within
/// two units in the last place.
class LaneTape {
 public:
  /// Points of one evaluation.
  static constexpr std::size_t lanes = 16;

  LaneTape() = default;
  /// Cost: linear in the tape; allocates.
  explicit LaneTape(const Tape& tape);

  [[nodiscard]] std::size_t inputs() const noexcept { return inputs_; }
  [[nodiscard]] std::size_t parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t outputs() const noexcept { return outputs_.size(); }
  /// Operations of one evaluation.
  [[nodiscard]] std::size_t operations() const noexcept { return steps_.size() - first_varying_; }
  /// Doubles that an evaluation needs room for.
  [[nodiscard]] std::size_t workspace_size() const noexcept { return slots_ * lanes; }
  /// Whether an output is the same at all points: a constant, or of parameters alone.
  [[nodiscard]] bool is_fixed(std::size_t output) const noexcept { return fixed_[output]; }

  /// Fills what does not depend on inputs. @param parameters  parameters() numbers.
  void prepare(std::span<const double> parameters, double* work) const noexcept;
  /// Where an input's `lanes` numbers go; they stay until they are overwritten.
  [[nodiscard]] double* input(std::size_t number, double* work) const noexcept {
    return work + (first_input_ + number) * lanes;
  }
  /// Where an output's `lanes` numbers stand after `evaluate`.
  [[nodiscard]] const double* output(std::size_t number, const double* work) const noexcept {
    return work + std::size_t{outputs_[number]} * lanes;
  }
  /// All outputs from the inputs in `work`. Cost: one pass over the operations; no allocation.
  void evaluate(double* work) const noexcept;

  /// What a step computes: the operations of a tape, and fused ones after them. @private
  struct Step {
    std::uint32_t code = 0;
    std::uint32_t to = 0;
    std::uint32_t a = 0, b = 0, c = 0;
  };

 private:
  std::vector<double> constants_{};
  std::vector<Step> steps_{};
  std::vector<std::uint32_t> outputs_{};
  std::vector<bool> fixed_{};
  std::size_t inputs_ = 0;
  std::size_t parameters_ = 0;
  std::size_t first_input_ = 0;
  std::size_t first_varying_ = 0;  // the steps before it are those of `prepare`
  std::size_t slots_ = 0;
};

}  // namespace flyball::expression
