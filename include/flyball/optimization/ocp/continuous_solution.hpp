#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/optimization/ocp/continuous_problem.hpp>
#include <flyball/optimization/solver/solution.hpp>

/// Solves optimal control problems in continuous time.
namespace flyball::optimization {

/// How a problem in continuous time becomes one of finitely many numbers.
enum class Transcription : std::uint8_t {
  /// Direct transcription: a step of Runge and Kutta's method of order 4 an interval, the input
  /// held.
  runge_kutta,
  /// Multiple shooting: several such steps an interval.
  multiple_shooting,
  /// Collocation by Lobatto IIIA of three points: order 4; the input is a parabola an interval and
  /// continuous within a phase.
  hermite_simpson,
  /// Collocation by Radau IIA of three points: order 5, stiffly accurate; the input is a parabola
  /// an interval and may jump between two.
  radau,
};
[[nodiscard]] std::string_view to_string(Transcription method);
/// The order p: an interval's error is of order h^(p + 1).
[[nodiscard]] int order_of(Transcription method) noexcept;

/// How to solve.
struct TranscriptionOptions {
  Transcription method = Transcription::hermite_simpson;
  int intervals = 40;      ///< Of each phase, of equal length at first.
  int shooting_steps = 4;  ///< Of multiple shooting, an interval.
  /// Largest error of an interval, relative to 1 + the state's size; intervals with more are
  /// divided and the problem is solved again. 0: the mesh stays as it is.
  double error_tolerance = 0.0;
  int max_refinements = 8;    ///< Of the mesh.
  int max_intervals = 20000;  ///< Of a phase, in all.
  SolverOptions solver{};     ///< Of each solve.
};

/// A phase of a solution.
struct PhaseTrajectory {
  double duration = 0.0;           ///< s
  Eigen::VectorXd times{};         ///< Of the mesh's N + 1 points from the problem's start, s.
  Eigen::MatrixXd states{};        ///< n x (N + 1), there.
  Eigen::MatrixXd start_slopes{};  ///< n x N: ẋ where intervals begin.
  Eigen::MatrixXd end_slopes{};    ///< n x N: ẋ where they end.
  Eigen::VectorXd input_shares{};  ///< Where in an interval the inputs' points stand, 0 … 1.
  Eigen::MatrixXd inputs{};        ///< m x (N · shares), interval after interval.
  /// Of each interval: how far the state at its end is from where an integrator of its own
  /// accuracy gets with this input, relative to 1 + the largest |x_i| of the trajectory.
  Eigen::VectorXd errors{};

  /// The input at a time from the problem's start, within the phase.
  [[nodiscard]] Eigen::VectorXd input(double t) const;
  /// The state there, by cubics.
  [[nodiscard]] Eigen::VectorXd state(double t) const;
};

/// A trajectory, and what it was checked by.
struct ContinuousSolution {
  std::vector<PhaseTrajectory> phases{};
  double cost = 0.0;
  double duration = 0.0;  ///< Of all phases, s.
  SolveStatus status = SolveStatus::no_progress;
  double largest_error = 0.0;           ///< Of all phases' intervals.
  int refinements = 0;                  ///< Of the mesh.
  bool accurate = true;                 ///< Whether the error tolerance, if any, was reached.
  SolverCounts counts{};                ///< Of all solves.
  double seconds = 0.0;                 ///< Wall time.
  std::vector<Violation> violations{};  ///< As OptimalControlSolution; names say the phase.
  std::string message{};                ///< What a person should know; empty where solved.
  [[nodiscard]] bool solved() const noexcept {
    return status == SolveStatus::solved || status == SolveStatus::acceptable;
  }
};

/// Solves a problem. The status says how it ended; the trajectory is the best found.
///
/// Collocation's points are inputs of their interval and its equations constraints, so the
/// structure stays that of stages and a Newton step costs O(N (n s + m s)³) for s points.
/// The error of each interval is measured by integrating f anew, to 1e-11, with the input found.
/// @errors ArgumentError::wrong_shape, not_finite, out_of_range, empty for what is stated.
/// Source: Betts, "Practical Methods for Optimal Control" 3rd ed. (2020), chapter 4; Kelly, "An
/// Introduction to Trajectory Optimization" (2017).
[[nodiscard]] Expected<ContinuousSolution> solve(const ContinuousProblem& problem,
                                                 const TranscriptionOptions& options = {});

}  // namespace flyball::optimization
