#pragma once

#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// x⁺ = A x + B u, y = C x + D u, sample by sample; of up to six states with one input and one
/// output all in registers.
/// @param u  samples x inputs. @param x  The first state; afterwards that behind the last input.
/// @param states  Receives the states, a column each, from the second row on, `rows` apart; may be
/// null. @param y  samples x outputs, of this shape already.
void run_recurrence(const DiscreteSystem<>& system, const MatrixRef& u, Eigen::VectorXd& x,
                    double* states, Eigen::Index rows, Eigen::MatrixXd& y);

}  // namespace flyball::detail
