#pragma once

#include <functional>
#include <optional>

#include <flyball/core/random.hpp>

#include "control/robust/uncertainty.hpp"

namespace flyball::detail {

/// A Δ of norm one, block by block.
struct UnitMember {
  struct Block {
    std::complex<double> number = 1.0;  ///< Of δ I: in [-1, 1] if real, else of modulus one.
    Eigen::VectorXcd u, v;              ///< Of a full one: u vᴴ, both of norm one.
  };
  std::vector<Block> blocks;
  double frequency = 0.0;  ///< rad/s, where M depends on it.
};

/// A member and the real eigenvalue λ of Q M that it has: I - M Q/λ is singular.
struct SingularMember {
  UnitMember member;
  double value = 0.0;     ///< λ > 0, µ is at least this,
  double rounding = 0.0;  ///< but for this.
  Eigen::VectorXcd z;     ///< M w of the eigenvector w.
};

/// M as it is searched: constant, or a function of the frequency with its derivative.
struct SearchedMatrix {
  std::function<Eigen::MatrixXcd(double)> at;
  std::function<Eigen::MatrixXcd(double)> slope;  ///< Empty where M is constant.
  double step = 1.0;                              ///< rad/s, of the search in the frequency.
};

/// Climbs to the largest real eigenvalue of Q M over members Q of norm one.
class MemberClimb {
 public:
  MemberClimb(const UncertaintyStructure& structure, SearchedMatrix M)
      : structure_(structure), M_(std::move(M)), complex_(!structure.has_real()) {}

  /// The best of a climb from a member: aligned where that helps, then by steps that keep the
  /// eigenvalue real. Nothing where no real eigenvalue was met.
  [[nodiscard]] std::optional<SingularMember> climb(UnitMember start) const;

  /// The real eigenvalue of largest magnitude as it is, without a step; of a real Q M.
  [[nodiscard]] std::optional<SingularMember> look(const UnitMember& member) const;

  /// The member that answers w to z best, as if y were its left eigenvector.
  [[nodiscard]] UnitMember aligned(const Eigen::VectorXcd& y, const Eigen::VectorXcd& z,
                                   double frequency) const;
  [[nodiscard]] UnitMember random(Random& random, double frequency) const;

  /// Q, inputs x outputs.
  [[nodiscard]] Eigen::MatrixXcd matrix_of(const UnitMember& member) const;

 private:
  struct Eigenvalue;
  /// Of the eigenvalues the one nearest to a place; without one the largest, or the largest real.
  [[nodiscard]] std::optional<Eigenvalue> eigenvalue_of(const UnitMember& member,
                                                        const std::complex<double>* near,
                                                        bool real = false) const;
  [[nodiscard]] Eigen::VectorXcd slopes_of(const UnitMember& member, const Eigenvalue& pair) const;
  [[nodiscard]] UnitMember moved(const UnitMember& member, const Eigen::VectorXd& step) const;
  [[nodiscard]] Eigen::VectorXd step_from(const UnitMember& member, const Eigenvalue& pair,
                                          double length) const;
  /// Turns a complex structure so that λ is real and positive.
  void turn(UnitMember& member, const std::complex<double>& value) const;
  [[nodiscard]] std::optional<Eigenvalue> align(UnitMember& member) const;
  [[nodiscard]] std::optional<SingularMember> result(const UnitMember& member,
                                                     const Eigenvalue& pair) const;

  const UncertaintyStructure& structure_;
  SearchedMatrix M_;
  bool complex_;
};

}  // namespace flyball::detail
