#pragma once

#include <string>
#include <vector>

#include <flyball/study/optimize.hpp>

/// Pieces of the answer of `flyball optimize`.
namespace flyball::study {

/// The field from above, speeds and forces over time.
[[nodiscard]] std::vector<Figure> optimize_figures(const OptimizeTask& task,
                                                   const DriveSolution& solution,
                                                   std::size_t number);
/// The robot on the field, moving.
[[nodiscard]] Animation optimize_animation(const OptimizeTask& task, const DriveSolution& solution,
                                           std::size_t number);
/// "trajectory_1": a trajectory's section of the document.
[[nodiscard]] std::string section_title(std::size_t number);
/// "front_left", "left".
[[nodiscard]] std::string wheel_name(Drivetrain drivetrain, std::size_t wheel);

}  // namespace flyball::study
