#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/delay_system.hpp>

/// How a continuous system with dead time moves around a point of the axis.
namespace flyball::classical::detail {

/// G at jω, and what bounds its way from there: what is below is of entries' sizes.
struct DelayPoint {
  Eigen::MatrixXcd value;  ///< Outputs x inputs.
  Eigen::MatrixXcd slope;  ///< dG/ds
  Eigen::MatrixXd inverse;
  Eigen::MatrixXd from_inputs;
  Eigen::MatrixXd to_outputs;
};

/// The bounds follow from M(s) = [sI - A, -B₂Δ; -C₂, I - D₂₂Δ] moving by no more than
/// [r, |B₂|(e^{τr} - 1); 0, |D₂₂|(e^{τr} - 1)], and Neumann's series of its inverse.
class DelayBounds {
 public:
  /// @param system  Continuous.
  explicit DelayBounds(const DelaySystem& system);

  /// Cost: O((n + delays)³), as of `bound`.
  [[nodiscard]] DelayPoint at(double frequency) const;
  /// b, an entry each: on |s - jω| <= radius |G(s) - value| <= b, so that |G(s) - value| <= b t and
  /// |G(s) - value - slope (s - jω)| <= b t²/(1 - t) on |s - jω| <= t radius (Schwarz, Cauchy).
  /// Infinite where a pole may lie in the disk.
  /// @param radius  rad/s.
  [[nodiscard]] Eigen::MatrixXd bound(const DelayPoint& point, double radius) const;

  /// No |G| is larger at any frequency from here on, by entries; infinite where that is not known.
  [[nodiscard]] Eigen::MatrixXd beyond(double frequency) const;
  /// The largest singular value that the part which passes by all states has for some phases of the
  /// delays, by a search.
  [[nodiscard]] double largest_at_infinity() const;

  /// Sizes of poles of A that are not zero, and 1/τ, rad/s, the smallest and the largest.
  [[nodiscard]] double slowest() const { return slowest_; }
  [[nodiscard]] double fastest() const { return fastest_; }
  /// Takes further poles into account.
  void consider(const Eigen::VectorXcd& poles);

 private:
  DelayForm f_;
  double size_of_A_ = 0.0;
  double slowest_ = 0.0;
  double fastest_ = 0.0;
};

}  // namespace flyball::classical::detail
