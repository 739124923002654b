#pragma once

#include <complex>
#include <vector>

#include "classical/locus_loop.hpp"

/// Branches of a root locus, followed.
namespace flyball::classical::detail {

/// A gain at which branches meet: at a point, or at infinity.
struct Meeting {
  double gain = 0.0;
  std::complex<double> point;  ///< Not below the real axis; its mirror image meets, too.
  bool infinite = false;
  int branches = 2;
  /// a of ln L = ln L(point) + a (s - point)^branches + …, or of s^-branches.
  std::complex<double> coefficient;
};

/// gains, and a row of branches each. In the loop's own unit, without its fixed roots.
struct Trace {
  std::vector<double> gains{};
  std::vector<Eigen::VectorXcd> rows{};
};

/// @param loop  Whose gain has the sign that the locus is asked for: k is positive.
/// @param meetings  By gain. @param last  The last gain; ∞: until the branches have arrived.
/// @param size  What is far of a picture of the locus. @errors SystemError::no_convergence.
[[nodiscard]] Expected<Trace> trace_locus(const LocusLoop& loop,
                                          const std::vector<Meeting>& meetings, double last,
                                          double size);

/// All roots of 1 + kL, beginning from estimates that are distinct.
/// @return Nothing where Aberth's iteration does not end.
[[nodiscard]] std::optional<Eigen::VectorXcd> roots_at(const LocusLoop& loop, double gain,
                                                       const Eigen::VectorXcd& estimates);

}  // namespace flyball::classical::detail
