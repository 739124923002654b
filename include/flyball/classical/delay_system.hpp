#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>
#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::classical {

/// A linear system with its dead times drawn out of it:
///   x' = A x + B₁u + B₂w,  y = C₁x + D₁₁u + D₁₂w,  z = C₂x + D₂₁u + D₂₂w,  wᵢ(t) = zᵢ(t - τᵢ),
/// or, of a discrete one, x_{k+1} in place of x' and τᵢ in whole periods.
struct DelayForm {
  Eigen::MatrixXd A;       ///< n x n
  Eigen::MatrixXd B1;      ///< n x inputs
  Eigen::MatrixXd B2;      ///< n x delays
  Eigen::MatrixXd C1;      ///< outputs x n
  Eigen::MatrixXd C2;      ///< delays x n
  Eigen::MatrixXd D11;     ///< outputs x inputs
  Eigen::MatrixXd D12;     ///< outputs x delays
  Eigen::MatrixXd D21;     ///< delays x inputs
  Eigen::MatrixXd D22;     ///< delays x delays
  Eigen::VectorXd delays;  ///< τ, s, all positive.
};

/// A continuous or discrete system of any number of inputs and outputs with dead time anywhere in
/// it, in loops too: nothing is approximated. Its response, its motion
/// (`delay_response.hpp`) and its poles (`delay_poles.hpp`) are those of the delays themselves.
/// Source: Gumussoy, Eryilmaz and Gahinet, "Working with time-delay systems in MATLAB", IFAC
/// Workshop on Time Delay Systems (2012), for the form; Michiels and Niculescu, "Stability,
/// Control, and Computation for Time-Delay Systems", 2nd ed. (2014).
class DelaySystem {
 public:
  /// @param form  Delays of zero are closed. @param period  Of a discrete system, whose delays are
  /// whole periods.
  /// @errors ArgumentError::wrong_shape, not_finite, out_of_range (a negative delay, one that is
  /// not whole periods), not_positive; SystemError::algebraic_loop where delays of zero leave one.
  [[nodiscard]] static Expected<DelaySystem> create(const DelayForm& form,
                                                    std::optional<Time> period = std::nullopt);

  /// A system without dead time. @errors ArgumentError for shapes and entries.
  [[nodiscard]] static Expected<DelaySystem> create(const ContinuousSystem<>& system);
  [[nodiscard]] static Expected<DelaySystem> create(const DiscreteSystem<>& system);

  /// Its dead time at the input; states by its roots, in sections in series, so that no coefficient
  /// is rounded. @errors ArgumentError::out_of_range for an order above 200.
  [[nodiscard]] static Expected<DelaySystem> create(const TransferFunction& transfer);

  /// y = M u. @errors ArgumentError::not_finite, empty.
  [[nodiscard]] static Expected<DelaySystem> gain(const MatrixRef& M,
                                                  std::optional<Time> period = std::nullopt);

  [[nodiscard]] const DelayForm& form() const { return form_; }
  [[nodiscard]] const std::optional<Time>& period() const { return period_; }
  [[nodiscard]] Eigen::Index states() const { return form_.A.rows(); }
  [[nodiscard]] Eigen::Index inputs() const { return form_.D11.cols(); }
  [[nodiscard]] Eigen::Index outputs() const { return form_.D11.rows(); }
  /// τ, s, all positive; empty without dead time.
  [[nodiscard]] const Eigen::VectorXd& delays() const { return form_.delays; }
  [[nodiscard]] bool has_delay() const { return form_.delays.size() > 0; }
  /// Whether a delayed signal comes back to its own delay: else the poles are those of A.
  [[nodiscard]] bool has_delay_in_loop() const;

  /// Further dead time before each input, behind each output. @param delays  s, one each, zeros
  /// allowed. @errors As `create`.
  [[nodiscard]] Expected<DelaySystem> with_input_delays(const Eigen::VectorXd& delays) const;
  [[nodiscard]] Expected<DelaySystem> with_output_delays(const Eigen::VectorXd& delays) const;
  /// Some inputs and outputs of it, in that order. @errors ArgumentError::out_of_range, empty.
  [[nodiscard]] Expected<DelaySystem> channels(const std::vector<Eigen::Index>& outputs,
                                               const std::vector<Eigen::Index>& inputs) const;

  /// G at a point of the plane, outputs x inputs, exact in the delays.
  /// @errors TransferError::at_a_pole; ArgumentError::not_finite.
  [[nodiscard]] Expected<Eigen::MatrixXcd> at(std::complex<double> s) const;
  /// G(jω), or G(e^{jωT}); not finite at a pole on the axis. @param frequency  rad/s. Cost:
  /// O((n + delays)³).
  [[nodiscard]] Eigen::MatrixXcd response(double frequency) const;
  /// G(0), or G(1); not finite with a pole there.
  [[nodiscard]] Eigen::MatrixXd dc_gain() const;

  /// Without its delays, or the delays of a discrete one as states.
  /// @errors TransferError::delay_in_loop where a continuous one has delays (`pade` approximates);
  /// period_mismatch for the other kind; ArgumentError::out_of_range above 2000 states.
  [[nodiscard]] Expected<ContinuousSystem<>> to_continuous() const;
  [[nodiscard]] Expected<DiscreteSystem<>> to_discrete() const;
  /// Each delay replaced by its diagonal Padé approximation. @param order  0 to 20; 0 leaves the
  /// delays out. @errors As `pade`; SystemError::algebraic_loop where that leaves one.
  [[nodiscard]] Expected<ContinuousSystem<>> pade(int order) const;

 private:
  DelaySystem(DelayForm form, std::optional<Time> period)
      : form_(std::move(form)), period_(period) {}

  DelayForm form_;
  std::optional<Time> period_;
};

/// G₂G₁. @errors ArgumentError::wrong_shape for inputs and outputs that do not fit;
/// TransferError::period_mismatch. Source: book, section A.1.
[[nodiscard]] Expected<DelaySystem> series(const DelaySystem& first, const DelaySystem& second);
/// G₁ + G₂, of any delays. @errors As `series`. Source: book, section A.2.
[[nodiscard]] Expected<DelaySystem> parallel(const DelaySystem& first, const DelaySystem& second);
/// diag(G₁, G₂). @errors As `series`, any shapes.
[[nodiscard]] Expected<DelaySystem> append(const DelaySystem& first, const DelaySystem& second);
/// (I ± G₁G₂)⁻¹G₁, + for negative feedback, with dead time anywhere.
/// @errors As `series`; SystemError::algebraic_loop where the part of the loop that acts without
/// dead time has no answer. Source: book, sections A.3, A.4.
[[nodiscard]] Expected<DelaySystem> feedback(const DelaySystem& forward, const DelaySystem& back,
                                             FeedbackSign sign = FeedbackSign::negative);
/// (I ± G)⁻¹G. @errors As above; it has as many outputs as inputs.
[[nodiscard]] Expected<DelaySystem> feedback(const DelaySystem& forward,
                                             FeedbackSign sign = FeedbackSign::negative);

/// What leads the signals of a system to each other: u = F y + E r, y' = H y + J r with r the new
/// inputs and y' the new outputs.
struct Wiring {
  Eigen::MatrixXd F;  ///< inputs x outputs
  Eigen::MatrixXd E;  ///< inputs x new inputs
  Eigen::MatrixXd H;  ///< new outputs x outputs
  Eigen::MatrixXd J;  ///< new outputs x new inputs
};

/// Every interconnection is one of these. @errors ArgumentError::wrong_shape, not_finite;
/// SystemError::algebraic_loop where I - F D₁₁ has no inverse.
[[nodiscard]] Expected<DelaySystem> rewired(const DelaySystem& system, const Wiring& wiring);

}  // namespace flyball::classical
