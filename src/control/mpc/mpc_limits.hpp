#pragma once

#include <string_view>

#include <flyball/control/mpc/predictive_controller.hpp>
#include <flyball/core/function_ref.hpp>

#include "optimization/mpc/stage_qp_solver.hpp"

/// What predictive controllers check of their settings.
namespace flyball::detail {

/// The settings with every vector there that any of its kind needs: limits of inputs always, those
/// of rates and states if one of them is finite, else empty; what violations cost; and Q_end.
/// @param n, m  States and inputs. @param Q_end  Makes it where it is left out.
/// @errors ArgumentError::wrong_shape, not_finite (NaN), out_of_range, with the entry; not_positive
///         for the weights.
[[nodiscard]] Expected<MpcSettings> complete_settings(
    const MpcSettings& settings, Eigen::Index n, Eigen::Index m, const MatrixRef& Q,
    const MatrixRef& R, std::string_view where, FunctionRef<Expected<Eigen::MatrixXd>()> Q_end);

/// The program that complete settings make.
[[nodiscard]] optimization::detail::StageQpSizes sizes_of(const MpcSettings& settings,
                                                          Eigen::Index n, Eigen::Index m);

}  // namespace flyball::detail
