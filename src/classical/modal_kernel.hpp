#pragma once

#include <vector>

#include "math/dense/instruction_set.hpp"

namespace flyball::classical::detail {

/// Σ Rₖ/(z - λₖ) + D: its simple poles with their residues, a pair of conjugates once.
struct ModalTerms {
  int outputs_times_inputs = 0;
  int pairs = 0;  ///< The first terms; the others are real.
  int count = 0;
  /// λ = (re + re_lo) + j (im + im_lo), so that its distance from z keeps all its digits.
  std::vector<double> re, re_lo, im, im_lo;
  std::vector<double> weight;   ///< The largest magnitude of Rₖ's entries.
  std::vector<double> residue;  ///< Rₖ entry by entry, real and imaginary part.
  std::vector<double> direct;   ///< D
  double direct_size = 0.0;     ///< The largest magnitude in it.
};

/// Four points in lanes: their real parts, what rounding left of these, the imaginary parts alike.
inline constexpr int modal_lanes = 4;
inline constexpr int modal_point = 4 * modal_lanes;

/// @param points  `modal_point` numbers a block of four points. @param values  Real parts of an
/// entry in four lanes, then its imaginary parts, entry by entry, block by block.
/// @param bound  |D| + Σ |Rₖ| |1/(z - λₖ)| of each point at least.
FLYBALL_KERNEL(void modal_response(const ModalTerms& terms, const double* points, int blocks,
                                   double* values, double* bound))

}  // namespace flyball::classical::detail
