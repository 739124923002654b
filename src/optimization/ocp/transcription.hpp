#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/optimization/ocp/continuous_solution.hpp>
#include <flyball/optimization/ocp/optimal_control.hpp>

#include "optimization/ocp/continuous_data.hpp"

namespace flyball::optimization::detail {

/// Points of collocation in an interval, after its start: x_j = x + h Σ a_jl f_l.
struct CollocationRule {
  std::vector<double> shares{};          ///< Of the points, the start's 0 first where its f counts.
  bool has_start = false;                ///< Whether f at the start counts: its input is carried.
  std::vector<std::vector<double>> a{};  ///< A row for each point after the start.
  std::vector<double> b{};               ///< Weights of all of `shares`.
};

/// A problem of numbers, and where its parts are.
///
/// Explicit methods: states x, inputs u. Collocation: inputs (u_1 … u_s, x_1 … x_s, and with
/// several phases the input at the next phase's start); where f at the start counts, states (x, u
/// there).
struct TranscriptionLayout {
  TranscriptionLayout(const ContinuousData& data, const TranscriptionOptions& options,
                      std::vector<Eigen::VectorXd> widths);

  [[nodiscard]] bool is_collocation() const noexcept { return !rule.b.empty(); }
  [[nodiscard]] int points() const noexcept { return static_cast<int>(rule.a.size()); }
  [[nodiscard]] int first_stage(std::size_t phase) const noexcept { return first[phase]; }
  [[nodiscard]] int intervals() const noexcept { return first.back(); }

  int n = 0, m = 0;
  Transcription method;
  int steps = 1;  ///< Of Runge and Kutta's method an interval.
  CollocationRule rule{};
  std::vector<Eigen::VectorXd> widths;  ///< Of each phase's intervals, of sum 1.
  std::vector<int> first{};             ///< Stage at which each phase begins, and the end.
  std::vector<int> duration{};          ///< The parameter that is a phase's duration; -1: fixed.
  int durations = 0;
  int states = 0, inputs = 0;
};

/// Records the problem; its start is left at zero.
[[nodiscard]] OptimalControlProblem transcribe(const ContinuousData& data,
                                               const TranscriptionLayout& layout);

/// The trajectory in what was solved, without slopes and errors.
[[nodiscard]] std::vector<PhaseTrajectory> trajectory_of(const ContinuousData& data,
                                                         const TranscriptionLayout& layout,
                                                         const OptimalControlSolution& solution);

/// A polynomial through values at shares of an interval; of one value, that value.
[[nodiscard]] Eigen::VectorXd parabola(const Eigen::VectorXd& shares, const Eigen::MatrixXd& values,
                                       double s);

/// Where the search starts: x(phase, share) and u(phase, share).
void set_start(OptimalControlProblem& problem, const TranscriptionLayout& layout,
               FunctionRef<Eigen::VectorXd(std::size_t, double)> x,
               FunctionRef<Eigen::VectorXd(std::size_t, double)> u,
               const Eigen::VectorXd& durations);

}  // namespace flyball::optimization::detail
