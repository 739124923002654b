#pragma once

#include <complex>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// The sign with which a feedback path returns to the input.
enum class FeedbackSign { negative, positive };

/// `first`, whose outputs are the inputs of `second`: G₂G₁. The states are [x₁; x₂], with
/// A = [A₁ 0; B₂C₁ A₂], B = [B₁; B₂D₁], C = [D₂C₁ C₂], D = D₂D₁.
/// @errors ArgumentError for shapes and entries, wrong_shape where `second` has not as many inputs
///         as `first` has outputs; discrete: SystemError::period_mismatch.
/// Cost: some products of matrices; allocates. Source: book, section A.1, in state space.
[[nodiscard]] Expected<ContinuousSystem<>> series(const ContinuousSystem<>& first,
                                                  const ContinuousSystem<>& second);
[[nodiscard]] Expected<DiscreteSystem<>> series(const DiscreteSystem<>& first,
                                                const DiscreteSystem<>& second);

/// Both on the same input, their outputs added: G₁ + G₂, of as many inputs and outputs each.
/// @errors As `series`. Source: book, section A.2, in state space.
[[nodiscard]] Expected<ContinuousSystem<>> parallel(const ContinuousSystem<>& first,
                                                    const ContinuousSystem<>& second);
[[nodiscard]] Expected<DiscreteSystem<>> parallel(const DiscreteSystem<>& first,
                                                  const DiscreteSystem<>& second);

/// Side by side, inputs and outputs stacked: diag(G₁, G₂). @errors As `series`, any shapes.
[[nodiscard]] Expected<ContinuousSystem<>> append(const ContinuousSystem<>& first,
                                                  const ContinuousSystem<>& second);
[[nodiscard]] Expected<DiscreteSystem<>> append(const DiscreteSystem<>& first,
                                                const DiscreteSystem<>& second);

/// `forward` with its output led back through `back`: y = G₁(u ∓ G₂y), (I ± G₁G₂)⁻¹G₁. The states
/// are [x₁; x₂].
/// @param back  As many inputs as `forward` has outputs, and vice versa.
/// @errors As `series`; SystemError::algebraic_loop where I ± D₁D₂ is singular, so that no output
///         satisfies the loop, or more than one does; its reciprocal condition is the evidence.
/// Cost: O(n³), allocates. Source: book, section E.2 (block diagrams), in state space.
[[nodiscard]] Expected<ContinuousSystem<>> feedback(const ContinuousSystem<>& forward,
                                                    const ContinuousSystem<>& back,
                                                    FeedbackSign sign = FeedbackSign::negative);
[[nodiscard]] Expected<DiscreteSystem<>> feedback(const DiscreteSystem<>& forward,
                                                  const DiscreteSystem<>& back,
                                                  FeedbackSign sign = FeedbackSign::negative);

/// `forward` under unity feedback. @errors As above; it has as many outputs as inputs.
[[nodiscard]] Expected<ContinuousSystem<>> feedback(const ContinuousSystem<>& forward,
                                                    FeedbackSign sign = FeedbackSign::negative);
[[nodiscard]] Expected<DiscreteSystem<>> feedback(const DiscreteSystem<>& forward,
                                                  FeedbackSign sign = FeedbackSign::negative);

/// A plant under state feedback u = K (r - x), as a system from r to y: A - BK, BK, C - DK, DK.
/// @param K  m x n. @return n states, n inputs. @errors ArgumentError for shapes and entries.
/// Source: book, (6.3) and (6.4); (7.12) and (7.13).
[[nodiscard]] Expected<ContinuousSystem<>> closed_loop(const ContinuousSystem<>& plant,
                                                       const MatrixRef& K);
[[nodiscard]] Expected<DiscreteSystem<>> closed_loop(const DiscreteSystem<>& plant,
                                                     const MatrixRef& K);

/// The transfer matrix C (sI - A)⁻¹B + D at one point s (z, for a discrete system).
/// @return outputs x inputs. @errors ArgumentError for the system and a point that is not finite;
///         SystemError::no_image if the point is a pole. Cost: O(n³), allocates.
/// Source: book, Definition E.2.1's transfer function of (6.1), (6.2).
[[nodiscard]] Expected<Eigen::MatrixXcd> transfer_at(const ContinuousSystem<>& system,
                                                     std::complex<double> s);
[[nodiscard]] Expected<Eigen::MatrixXcd> transfer_at(const DiscreteSystem<>& system,
                                                     std::complex<double> z);

}  // namespace flyball
