#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/classical/delay_system.hpp>

/// How a continuous system with dead time moves around a point of the axis.
namespace flyball::classical::detail {

/// G around jω, an entry each of a matrix of outputs x inputs: on |s - jω| <= radius
/// |G(s) - value| <= bound, so that |G(s) - value| <= bound t and
/// |G(s) - value - slope (s - jω)| <= bound t²/(1 - t) on |s - jω| <= t radius (Schwarz, Cauchy).
struct DelayBall {
  Eigen::MatrixXcd value;
  Eigen::MatrixXcd slope;  ///< dG/ds
  Eigen::MatrixXd bound;   ///< Infinite where a pole may lie in the disk.
};

/// The bounds follow from M(s) = [sI - A, -B₂Δ; -C₂, I - D₂₂Δ] moving by no more than
/// [r, |B₂|(e^{τr} - 1); 0, |D₂₂|(e^{τr} - 1)], and Neumann's series of its inverse.
class DelayBounds {
 public:
  /// @param system  Continuous.
  explicit DelayBounds(const DelaySystem& system);

  /// @param radius  rad/s. Cost: O((n + delays)³).
  [[nodiscard]] DelayBall around(double frequency, double radius) const;

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
