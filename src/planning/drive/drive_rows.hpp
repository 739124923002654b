#pragma once

#include <cstddef>

#include <flyball/optimization/ocp/optimal_control.hpp>
#include <flyball/planning/drive/drive_problem.hpp>

#include "planning/drive/drive_transcription.hpp"

/// What a drive trajectory's parts become in the optimal control problem.
namespace flyball::drive_transcription {

/// The body's motion, the segments' durations and the cost: the time, and what gives way.
void write_dynamics(const DriveProblem& problem, const Layout& layout,
                    optimization::OptimalControlProblem& ocp);
/// What wheels and motors can: forces, speeds, motor lines, supply power, grip.
void write_wheels(const DriveProblem& problem, const Layout& layout,
                  optimization::OptimalControlProblem& ocp);
/// One of the problem's constraints.
void write_constraint(const DriveProblem& problem, const Layout& layout, std::size_t number,
                      optimization::OptimalControlProblem& ocp);

}  // namespace flyball::drive_transcription
