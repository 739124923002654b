#pragma once

#include <optional>
#include <vector>

#include <flyball/classical/delay_system.hpp>
#include <flyball/classical/zero_pole_gain.hpp>

namespace flyball::classical {

/// G(s) of several inputs and outputs: a transfer function from each input to each output, each
/// with a dead time of its own, their roots kept.
class TransferMatrix {
 public:
  /// @param entries  Rows of outputs, one entry for each input; proper or not.
  /// @errors ArgumentError::empty, wrong_shape (rows of different length);
  /// TransferError::period_mismatch with the entry.
  [[nodiscard]] static Expected<TransferMatrix> create(
      std::vector<std::vector<ZeroPoleGain>> entries);
  [[nodiscard]] static Expected<TransferMatrix> create(
      const std::vector<std::vector<TransferFunction>>& entries);

  /// C (sI - A)⁻¹B + D by the zeros, poles and gain of each channel; no polynomial is formed.
  /// States that an input does not reach or an output does not see because entries are zero are no
  /// poles of their channel; nothing else is cancelled.
  /// @errors ArgumentError for the system; SystemError::no_convergence.
  [[nodiscard]] static Expected<TransferMatrix> of(const ContinuousSystem<>& system);
  [[nodiscard]] static Expected<TransferMatrix> of(const DiscreteSystem<>& system);

  [[nodiscard]] Eigen::Index outputs() const { return static_cast<Eigen::Index>(entries_.size()); }
  [[nodiscard]] Eigen::Index inputs() const {
    return static_cast<Eigen::Index>(entries_.front().size());
  }
  [[nodiscard]] const ZeroPoleGain& operator()(Eigen::Index output, Eigen::Index input) const {
    return entries_[static_cast<std::size_t>(output)][static_cast<std::size_t>(input)];
  }
  [[nodiscard]] const std::optional<Time>& period() const {
    return entries_.front().front().period();
  }
  [[nodiscard]] bool has_delay() const;

  /// G(jω), or G(e^{jωT}), outputs x inputs. @param frequency  rad/s
  [[nodiscard]] Eigen::MatrixXcd response(double frequency) const;
  [[nodiscard]] Eigen::MatrixXd dc_gain() const;
  /// Each channel without the pairs of zero and pole nearer than the tolerance, as
  /// `without_cancellations`. @errors As there.
  [[nodiscard]] Expected<TransferMatrix> without_cancellations(double tolerance = 1e-8) const;

  /// Every channel realised by itself, with its dead time. @errors TransferError::improper.
  [[nodiscard]] Expected<DelaySystem> to_delay_system() const;
  /// Of as few states as needed: every channel by itself, and what is not reached or not seen left
  /// out (`minimal_realization`). @param tolerance  Of that.
  /// @errors TransferError::improper; delay_in_loop for one with dead time; period_mismatch for the
  /// other kind.
  [[nodiscard]] Expected<ContinuousSystem<>> to_continuous(double tolerance = 1e-10) const;
  [[nodiscard]] Expected<DiscreteSystem<>> to_discrete(double tolerance = 1e-10) const;

 private:
  explicit TransferMatrix(std::vector<std::vector<ZeroPoleGain>> entries)
      : entries_(std::move(entries)) {}

  std::vector<std::vector<ZeroPoleGain>> entries_;
};

/// The zeros, poles and gain of one channel of a system, in 16 digits of its own condition.
/// @param output, input  From 0. @param cut  Leave out the states that zero entries of A, B and C
/// cut off from the channel. @errors ArgumentError for the system, out_of_range for the channel;
/// SystemError::no_convergence.
/// Source: Emami-Naeini and Van Dooren, Automatica 18 (1982).
[[nodiscard]] Expected<ZeroPoleGain> channel_of(const ContinuousSystem<>& system,
                                                Eigen::Index output = 0, Eigen::Index input = 0,
                                                bool cut = true);
[[nodiscard]] Expected<ZeroPoleGain> channel_of(const DiscreteSystem<>& system,
                                                Eigen::Index output = 0, Eigen::Index input = 0,
                                                bool cut = true);

}  // namespace flyball::classical
