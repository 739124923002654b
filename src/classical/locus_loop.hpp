#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <vector>

#include <flyball/classical/transfer_function.hpp>

#include "classical/polynomial.hpp"

/// A loop by its factors, as its root locus is computed from.
namespace flyball::classical::detail {

/// A root and its multiplicity.
struct MultipleRoot {
  std::complex<double> at;
  int times = 1;
};

/// Roots that one step of rounding of the coefficients makes one are one: the largest clusters
/// whose means multiply out to the polynomial again.
[[nodiscard]] std::vector<MultipleRoot> grouped(const Eigen::VectorXcd& roots, const Polynomial& p);

/// L = gain Π(s - zero)/Π(s - pole), in a unit of s in which its roots are about one.
struct LocusLoop {
  std::vector<MultipleRoot> zeros{};  ///< Distinct, in pairs of exact conjugates, none a pole.
  std::vector<MultipleRoot> poles{};
  std::vector<std::complex<double>> fixed{};  ///< Zeros on poles: closed-loop poles at any gain.
  double gain = 0.0;
  int unit = 0;      ///< s = 2^unit s'.
  Polynomial num{};  ///< Those that are no fixed roots, in s'.
  Polynomial den{};
  std::optional<Time> period{};

  [[nodiscard]] int zero_count() const { return count(zeros); }
  [[nodiscard]] int pole_count() const { return count(poles); }

  [[nodiscard]] std::complex<double> at(std::complex<double> s) const;

  /// Σ 1/(s - zero) and Σ 1/(s - pole): N'/N and D'/D.
  struct Slopes {
    std::complex<double> zeros;
    std::complex<double> poles;
  };
  [[nodiscard]] Slopes slopes(std::complex<double> s) const;
  /// The k-th derivative of ln L, k >= 1.
  [[nodiscard]] std::complex<double> log_derivative(std::complex<double> s, int k) const;

  /// A root's other factors: lim (s - root)^∓times L(s). @param root  A pole or a zero.
  [[nodiscard]] std::complex<double> rest(const MultipleRoot& root, bool is_pole) const;

  /// ln L = ln L(∞) + coefficient s^-order + … of as many zeros as poles.
  struct AtInfinity {
    int order = 0;  ///< 0: L is constant.
    double coefficient = 0.0;
  };
  [[nodiscard]] AtInfinity at_infinity() const;

  /// Of the largest root, 1 if all are zero.
  [[nodiscard]] double size() const;
  /// From a root to the nearest other one; `size` without another.
  [[nodiscard]] double room(const MultipleRoot& root) const;

  [[nodiscard]] std::complex<double> out(std::complex<double> s) const {
    return {std::ldexp(s.real(), unit), std::ldexp(s.imag(), unit)};
  }

 private:
  static int count(const std::vector<MultipleRoot>& roots) {
    int sum = 0;
    for (const MultipleRoot& root : roots) {
      sum += root.times;
    }
    return sum;
  }
};

/// @errors As `root_locus`.
[[nodiscard]] Expected<LocusLoop> locus_loop(const TransferFunction& loop);
[[nodiscard]] Expected<LocusLoop> locus_loop(const Eigen::VectorXcd& zeros,
                                             const Eigen::VectorXcd& poles, double gain,
                                             std::optional<Time> period);

/// Where ln L is stationary, the branch points of all real gains among them.
[[nodiscard]] std::vector<MultipleRoot> stationary_points(const LocusLoop& loop);

}  // namespace flyball::classical::detail
