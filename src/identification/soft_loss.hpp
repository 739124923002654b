#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include "identification/output_error.hpp"

/// The soft-L1 loss and how a run's parameters lie among all of them; shared by the minimisation
/// and the variance of its answer.
namespace flyball::identification {

using LocalMatrix = Eigen::Matrix<double, local_parameter_count, local_parameter_count>;
using LocalVector = Eigen::Matrix<double, local_parameter_count, 1>;

inline constexpr double soft_limit = 1.5;  // δ: residuals beyond 1.5 σ count linearly

inline double square(double value) {
  return value * value;
}

inline double loss(double z) {
  return 2.0 * square(soft_limit) * (std::sqrt(1.0 + square(z / soft_limit)) - 1.0);
}

/// ρ'(z)/(2z): the weight of iterated least squares. ρ''(z)/2 is its cube.
inline double weight(double z) {
  return 1.0 / std::sqrt(1.0 + square(z / soft_limit));
}

/// Adds weight j jᵀ; most terms of the model are absent, and their entries of j zero.
inline void add_square(LocalMatrix& sum, double weight, const LocalVector& j) {
  for (int k = 0; k < local_parameter_count; ++k) {
    if (const double factor = weight * j[k]; factor != 0.0) {
      double* column = sum.data() + static_cast<std::ptrdiff_t>(k) * local_parameter_count;
      for (int i = 0; i < local_parameter_count; ++i) {
        column[i] += factor * j[i];
      }
    }
  }
}

/// 1/scale, and 0 for a channel that is switched off.
inline double inverse(double scale) {
  return scale > 0.0 ? 1.0 / scale : 0.0;
}

inline Eigen::Index global_index(int local, std::size_t run) {
  return local < shared_parameter_count
             ? local
             : initial_velocity_of(run) + (local - shared_parameter_count);
}

/// Adds a run's matrix to that of all parameters.
inline void scatter(Eigen::MatrixXd& global, const LocalMatrix& local, std::size_t run) {
  for (int a = 0; a < local_parameter_count; ++a) {
    for (int b = 0; b < local_parameter_count; ++b) {
      global(global_index(a, run), global_index(b, run)) += local(a, b);
    }
  }
}

}  // namespace flyball::identification
