#pragma once

#include <complex>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

namespace flyball::detail {

/// The smallest singular value of a pencil [A - λI, B], and the left vector that belongs to it.
struct PencilMinimum {
  double value = 0.0;
  Eigen::VectorXcd left;  ///< Of norm 1.
};

/// How far the modes of a pair are from being cut off. One distance costs O(n²m) where (A, B) has
/// the form of a staircase, whose pencil is all but triangular, and O(n³) of any other.
class ModeDistance {
 public:
  ModeDistance(const MatrixRef& A, const MatrixRef& B);

  /// [A - λI, B] = [0 R] Qᴴ by reflections from the right, then inverse iteration with R, in the
  /// Krylov space of (R Rᴴ)⁻¹.
  [[nodiscard]] PencilMinimum at(std::complex<double> lambda) const;

  /// The same near a computed eigenvalue, which rounding has displaced: λ = uᴴAu is the best for
  /// the vector u that was found.
  /// @param enough  No distance below it is told from another.
  [[nodiscard]] PencilMinimum near(std::complex<double> lambda, double enough) const;

 private:
  template <class Scalar>
  [[nodiscard]] PencilMinimum minimum(Scalar lambda) const;

  Eigen::MatrixXd pencil_;             ///< [B A].
  Eigen::VectorX<Eigen::Index> from_;  ///< Of each row, its first entry that is not zero.
  Eigen::Index inputs_ = 0;
  double size_A_ = 0.0;
};

}  // namespace flyball::detail
