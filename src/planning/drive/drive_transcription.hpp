#pragma once

#include <vector>

#include <Eigen/Core>

#include <flyball/optimization/ocp/optimal_control.hpp>
#include <flyball/planning/drive/drive_problem.hpp>
#include <flyball/planning/drive/optimize_drive.hpp>

/// A drive trajectory as an optimal control problem.
namespace flyball::drive_transcription {

/// Where the parts of a problem are among states, inputs, parameters and data.
///
/// States: those of the body, then the duration of the segment that a stage is in. Inputs: forces,
/// the change of that duration (in a stage of its own between two segments), an angle for each
/// obstacle (the direction from it to the robot). Parameters, where constraints give way: by how
/// much each constraint, then each waypoint does. Data of a stage: 1 over its segment's intervals,
/// the margins of the wheels' speed and of the motors' line, those of the constraints.
struct Layout {
  Layout(const DriveProblem& problem, std::vector<int> intervals, bool elastic);

  int n = 0;                             ///< Of the body.
  int m = 0;                             ///< Forces.
  std::vector<int> first{};              ///< Stage of each waypoint.
  std::vector<std::size_t> obstacles{};  ///< Constraints that have an angle.
  bool elastic = false;
  int constraints = 0;
  double longest = 120.0;  ///< s, of a segment.

  [[nodiscard]] int stages() const noexcept { return first.back(); }
  [[nodiscard]] int duration() const noexcept { return n; }
  [[nodiscard]] int change() const noexcept { return m; }
  /// Whether a stage stands between two segments: at the first of the two nodes a waypoint is.
  [[nodiscard]] bool is_change(int stage) const noexcept;
  /// The stage at which a segment begins.
  [[nodiscard]] int begin(std::size_t segment) const noexcept {
    return first[segment] + (segment > 0 ? 1 : 0);
  }
  [[nodiscard]] int angle(std::size_t obstacle) const noexcept;
  [[nodiscard]] int states() const noexcept { return n + 1; }
  [[nodiscard]] int inputs() const noexcept { return m + 1 + static_cast<int>(obstacles.size()); }
  [[nodiscard]] int parameters() const noexcept {
    return elastic ? constraints + static_cast<int>(first.size()) : 0;
  }
  [[nodiscard]] int data() const noexcept { return 3 + constraints; }
};

/// What limits are drawn tighter by at each stage: shares of the wheels' limits, units of
/// constraints (a row each).
struct Margins {
  Eigen::VectorXd wheel_speed{};
  Eigen::VectorXd motor_line{};
  Eigen::MatrixXd constraints{};
};

/// A start: x (n + 1) x (N + 1) without the durations, and the durations of the segments.
struct Guess {
  std::string name{};
  Eigen::MatrixXd states{};        ///< n x (N + 1).
  Eigen::MatrixXd inputs{};        ///< Forces over `DriveModel::force()`, m x N; empty: none.
  Eigen::MatrixXd angles{};        ///< rad, of the obstacles' lines, a row each; empty: chosen.
  Eigen::VectorXd durations{};     ///< s, of the segments.
  std::vector<double> headings{};  ///< rad, of the waypoints: the turn that is wanted.
};

/// Records the problem; headings that are fixed are fixed at the guess's.
[[nodiscard]] optimization::OptimalControlProblem transcribe(const DriveProblem& problem,
                                                             const Layout& layout,
                                                             const Guess& guess);
/// States and inputs of a start.
struct Start {
  Eigen::MatrixXd states{}, inputs{};
};
[[nodiscard]] Start start_of(const DriveProblem& problem, const Layout& layout, const Guess& guess);
[[nodiscard]] Margins no_margins(const Layout& layout);
[[nodiscard]] Eigen::MatrixXd data_of(const Layout& layout, const Margins& margins);

/// The trajectory in what was solved.
void write_samples(const DriveProblem& problem, const Layout& layout,
                   const optimization::OptimalControlSolution& found, DriveSolution& solution);

}  // namespace flyball::drive_transcription
