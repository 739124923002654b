#pragma once

#include <Eigen/Core>

#include <flyball/identification/one_step_fit.hpp>

namespace flyball::identification {

/// The gains of x_{k+1} = α x_k + β u_k + γ sgn(x_k), behind which stands a constant (elevator) or
/// a factor each of cos θ and sin θ (arm). Source: book, equations (14.7)–(14.9).
[[nodiscard]] OneStepFit one_step_gains(const Eigen::VectorXd& solution, double period,
                                        bool elevator, bool arm);

}  // namespace flyball::identification
