#pragma once

#include <complex>
#include <vector>

#include <flyball/systems/system.hpp>
#include <flyball/systems/system_error.hpp>

namespace flyball {

/// E x' = A x + B u, y = C x + D u with an E that need not be invertible: equations without a
/// derivative beside those with one, and systems that differentiate (PD, inverses), which no
/// standard system is. G(s) = C (sE - A)⁻¹B + D; of a discrete one E x_{k+1} and z.
struct DescriptorSystem {
  Eigen::MatrixXd E;  ///< n x n
  Eigen::MatrixXd A;  ///< n x n
  Eigen::MatrixXd B;  ///< n x m
  Eigen::MatrixXd C;  ///< p x n
  Eigen::MatrixXd D;  ///< p x m
};

/// What a descriptor system is like.
struct DescriptorAnalysis {
  Eigen::VectorXcd poles;     ///< Finite λ with det(λE - A) = 0, by falling real part.
  Eigen::Index infinite = 0;  ///< How many are at infinity: equations without a derivative.
  int index = 0;              ///< ν: u is differentiated ν - 1 times at most; 0 if E is
                              ///< invertible, 1 if equations determine their states at once.
};

/// @errors ArgumentError for shapes and entries; SystemError::singular_transform if the pencil is
/// singular: det(sE - A) is zero for every s, so that there is no solution, or more than one;
/// no_convergence. Cost: O(n⁴) at worst. Source: Dai, "Singular Control Systems" (1989), chapter 1.
[[nodiscard]] Expected<DescriptorAnalysis> analyze_descriptor(const DescriptorSystem& system);

/// C (sE - A)⁻¹B + D at one point. @errors As `analyze_descriptor`; SystemError::no_image at a
/// pole.
[[nodiscard]] Expected<Eigen::MatrixXcd> transfer_at(const DescriptorSystem& system,
                                                     std::complex<double> s);

/// A descriptor system as a standard one and a polynomial: G(s) = C (sI - A)⁻¹B + D + Σ Pₖ sᵏ.
struct DescriptorParts {
  ContinuousSystem<> proper;              ///< The finite poles' part and what acts at once.
  std::vector<Eigen::MatrixXd> powers{};  ///< P₁, P₂, …, p x m; none if G is proper.
};
/// By the states that (sE - A)⁻¹E maps to zero in the end, and the others.
/// @errors As `analyze_descriptor`. Source: Dai (1989), section 1.2 (Weierstrass' form).
[[nodiscard]] Expected<DescriptorParts> descriptor_parts(const DescriptorSystem& system);

/// The standard system where there is one.
/// @errors As `analyze_descriptor`; SystemError::no_image with the power of s for an improper one.
[[nodiscard]] Expected<ContinuousSystem<>> to_standard(const DescriptorSystem& system);

/// E = I. @errors ArgumentError for shapes and entries.
[[nodiscard]] Expected<DescriptorSystem> to_descriptor(const ContinuousSystem<>& system);

/// num(s)/den(s) of any degrees, with coefficients in descending powers: a chain of differentiators
/// beside the proper part. @errors ArgumentError::empty, not_finite; SystemError::zero_transfer for
/// a denominator that is zero.
[[nodiscard]] Expected<DescriptorSystem> to_descriptor(const Eigen::VectorXd& num,
                                                       const Eigen::VectorXd& den);

/// G⁻¹, of a system with as many inputs as outputs, in the form [E 0; 0 0], [A B; C D]: improper
/// where D has no inverse. @errors ArgumentError for shapes and entries;
/// SystemError::singular_transform where G has no inverse at any s.
[[nodiscard]] Expected<DescriptorSystem> inverse(const DescriptorSystem& system);

/// G₂G₁ without a product of matrices. @errors ArgumentError for shapes and entries.
[[nodiscard]] Expected<DescriptorSystem> series(const DescriptorSystem& first,
                                                const DescriptorSystem& second);

}  // namespace flyball
