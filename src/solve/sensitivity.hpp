#pragma once

#include <algorithm>
#include <limits>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>

#include "solve/row.hpp"

namespace flyball::solve {

/// M with each entry moved to the next double, up or down by a pattern that differs with `draw`:
/// what rounding of the data alone does.
[[nodiscard]] Eigen::MatrixXd in_its_last_digits(const Eigen::MatrixXd& M, int draw);

/// The largest entry of a - b beside that of a, where a is not zero.
[[nodiscard]] double relative_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Whether an exponential's repeated squares may have lost digits that the data's last ones do not
/// show: those of a slow mode beside fast ones. Smaller matrices are squared in twice the
/// precision.
[[nodiscard]] bool loses_by_squares(const Eigen::MatrixXd& exponent);

/// The error, where it is small enough for an answer.
/// @errors SolveError::not_determined beyond 1e-4.
[[nodiscard]] Expected<double> check_determined(double error);

/// How far the last digits of the data move an answer, relative to it: the largest of two draws of
/// `other`, which gives the change of the answer for a draw.
/// @errors As `check_determined`; also where the other data has no answer.
template <class Other>
[[nodiscard]] Expected<double> error_of(Other&& other) {
  double worst = 0.0;
  for (int draw = 0; draw < 2; ++draw) {
    const Expected<double> change = other(draw);
    const double error = change ? *change : std::numeric_limits<double>::infinity();
    worst = error <= worst ? worst : error;
  }
  return check_determined(worst);
}
}  // namespace flyball::solve
