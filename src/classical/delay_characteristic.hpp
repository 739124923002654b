#pragma once

#include <complex>
#include <vector>

#include <flyball/classical/delay_system.hpp>

/// The equation of which the poles of a system with dead time are the zeros.
namespace flyball::classical::detail {

/// A gain of jumps round a loop without a state, |L(∞)| behind dead time, from which on infinitely
/// many poles lie right of the axis or come as near to it as one likes: 1 but for rounding.
inline constexpr double endless_from = 1.0 - 1e-12;

/// The characteristic matrix of the loops alone.
class Characteristic {
 public:
  explicit Characteristic(const DelayForm& form);

  [[nodiscard]] Eigen::Index states() const { return A_.rows(); }
  [[nodiscard]] const Eigen::VectorXd& delays() const { return delays_; }
  [[nodiscard]] const Eigen::MatrixXd& jumps() const { return D_; }
  [[nodiscard]] const Eigen::VectorXcd& open_poles() const { return open_; }

  [[nodiscard]] Eigen::VectorXcd late(std::complex<double> s) const;
  [[nodiscard]] Eigen::MatrixXcd at(std::complex<double> s) const;
  /// d/ds of it.
  [[nodiscard]] Eigen::MatrixXcd slope(std::complex<double> s) const;
  /// H = C(sI - A)⁻¹B + D, from w to z.
  [[nodiscard]] Eigen::MatrixXcd around(std::complex<double> s) const;
  /// No loop gain at jω exceeds it, whatever the phases of the delays.
  [[nodiscard]] double gain(double frequency) const;

  /// x' and the delay lines v' = -dv/dθ at Chebyshev's points of each.
  [[nodiscard]] Eigen::MatrixXd discretised(const std::vector<Eigen::Index>& points) const;

 private:
  Eigen::MatrixXd A_;
  Eigen::MatrixXd B_;
  Eigen::MatrixXd C_;
  Eigen::VectorXd delays_;
  Eigen::MatrixXd D_;
  Eigen::VectorXcd open_;
};

/// ρ(M), 0 of none.
[[nodiscard]] double radius_of(const Eigen::MatrixXd& M);
/// The largest ρ(D diag e^{jθ}) that a search over the angles finds.
[[nodiscard]] double largest_radius(const Eigen::MatrixXd& D);
/// c for which the loops of jumps decay like e^{ct}: ρ(|D| diag e^{-cτ}) = 1.
[[nodiscard]] double jump_abscissa(const Eigen::MatrixXd& D, const Eigen::VectorXd& delays);

}  // namespace flyball::classical::detail
