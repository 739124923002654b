#pragma once

#include <string_view>

#include <flyball/control/integral_control.hpp>
#include <flyball/systems/analysis.hpp>

#include "math/riccati/riccati_work.hpp"

/// What the designs with quadratic costs have in common.
namespace flyball::detail {

/// `lqr` and `continuous_lqr`. @param N  The cross weight, none where it is null.
/// @param work  What is left of a budget for equations that doubles do not solve, where there is
/// one.
[[nodiscard]] Expected<LqrDesign<>> solve_lqr(const MatrixRef& A, const MatrixRef& B,
                                              const Weight& Q, const Weight& R,
                                              const Eigen::MatrixXd* N, TimeDomain domain,
                                              CarefulWork* work = nullptr);

/// The matrix of a weight, or its maker's error; symmetric, of the given size.
[[nodiscard]] Expected<Eigen::MatrixXd> weight_of(const Weight& weight, Eigen::Index size,
                                                  std::string_view where, std::string_view name,
                                                  std::string_view meaning);

/// What `care` or `dare` refuses, said by a regulator, with reasons that hold: a mode is out of
/// reach only where the pair's own analysis, which knows no units, says so; R is singular, and a
/// mode on the boundary, only if the evidence does.
[[nodiscard]] Error regulator_error(Error error, const MatrixRef& A, const MatrixRef& B,
                                    TimeDomain domain, std::string_view where);

/// [x; x_I]₊ = [A 0; -h C  e I][x; x_I] + [B; -h D] u: h = T and e = 1 sampled, h = 1 and e = 0
/// not.
struct IntegralPlant {
  Eigen::MatrixXd A, B;
};

/// The plant with the integral of its outputs' error, where these can be tracked and Q fits it.
[[nodiscard]] Expected<IntegralPlant> integral_plant(const MatrixRef& A, const MatrixRef& B,
                                                     const MatrixRef& C, const MatrixRef& D,
                                                     double h, double e, const Weight& Q,
                                                     std::string_view where);

/// Its regulator, taken apart after n states.
[[nodiscard]] Expected<IntegralLqr> split_integral(Expected<LqrDesign<>>&& design, Eigen::Index n,
                                                   std::string_view where);

}  // namespace flyball::detail
