#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/identification/frequency_fit.hpp>

/// Vector fitting on the imaginary axis: poles and residues, without systems.
namespace flyball::identification {

/// A real pole, or with `imaginary` positive a pair of conjugate ones.
struct Pole {
  double real;
  double imaginary;
};
using Poles = std::vector<Pole>;

/// Of them, a pair as two.
[[nodiscard]] Eigen::Index count_of(const Poles& poles);

/// What the fit works on: points on the imaginary axis, entries side by side.
struct Points {
  Eigen::VectorXd frequency;  ///< In units in which they are about 1.
  Eigen::MatrixXcd values;    ///< Frequencies x entries.
  Eigen::MatrixXd weights;
};

/// The best coefficients for given poles: of 1/(s - p), or for a pair of the sum and j times the
/// difference of both, and of 1 where there is a feedthrough.
struct Residues {
  Eigen::MatrixXd coefficients;  ///< A column an entry.
  Eigen::VectorXd errors;        ///< Weighted, real and imaginary.
};

struct VectorFit {
  Poles poles;
  Residues residues;
  int iterations = 0;
};
/// @param size  Of the weighted values.
[[nodiscard]] VectorFit fit_vectors(const Points& points, const FrequencyFitOptions& options,
                                    double size);

}  // namespace flyball::identification
