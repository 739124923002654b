#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/identification/feedforward_fit.hpp>

#include "identification/response.hpp"

/// The comparison of a recording with its simulation, as a least-squares problem.
namespace flyball::identification {

namespace parameter {

/// Parameters that all runs share; after them, the initial velocity of each run.
enum Shared : int {
  // 0 to 4 are those of Simulation.
  position_delay = 5,   ///< s.
  velocity_delay = 6,   ///< s, to the middle of the averaging window.
  averaging_width = 7,  ///< s.
  velocity_scale = 8,   ///< Velocity column over true velocity.
};

}  // namespace parameter

inline constexpr int shared_parameter_count = 9;
/// Columns of a run's Jacobian: the shared parameters and the run's initial velocity.
inline constexpr int local_parameter_count = 10;

enum class Channel { position, velocity };

/// One run's share of the problem.
struct ResidualRun {
  std::size_t prepared = 0;  ///< Index in PreparedRecording::runs.
  bool ramp = false;
  bool starts_at_rest = false;
  double likely_initial_velocity = 0.0;
  double window_end = 0.0;
  RunInput input;
  /// Rows of the prepared run (from, to) whose position difference is compared.
  std::vector<std::pair<std::size_t, std::size_t>> differences;
  std::vector<std::size_t> velocities;  ///< Rows whose velocity is compared.
  std::vector<double> angle_time;       ///< Fresh position rows, for the angle under gravity.
  std::vector<double> angle;
};

/// Measured − simulated with its Jacobian, in units of the channel; differences first.
struct ResidualBlock {
  Eigen::VectorXd difference;
  Eigen::VectorXd velocity;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, local_parameter_count, Eigen::RowMajor>;
  Jacobian difference_jacobian;
  Jacobian velocity_jacobian;
};

class OutputErrorProblem {
 public:
  /// @param thinning  Only one residual of so many is compared (to find a start quickly).
  OutputErrorProblem(const PreparedRecording& recording, const FitOptions& options,
                     std::size_t thinning = 1);

  [[nodiscard]] const std::vector<ResidualRun>& runs() const { return runs_; }
  [[nodiscard]] const PreparedRecording& recording() const { return recording_; }
  [[nodiscard]] mechanisms::MechanismKind mechanism() const { return mechanism_; }
  [[nodiscard]] int parameters() const {
    return shared_parameter_count + static_cast<int>(runs_.size());
  }
  [[nodiscard]] std::size_t residuals() const;

  /// The angle under gravity is the measured one, `delay` later; only arms depend on it.
  void set_angle_delay(double delay);

  /// Residuals (and Jacobians) of one run. @param x  All parameters.
  void evaluate(std::size_t run, const Eigen::VectorXd& x, bool jacobian, ResidualBlock& block);

  /// The velocity (as the column shows it) and the position at the given times of a run.
  [[nodiscard]] double velocity_shown(std::size_t run, const Eigen::VectorXd& x, double time) const;
  [[nodiscard]] double position_shown(std::size_t run, const Eigen::VectorXd& x, double time) const;

  /// A weak prior: a run that starts in motion starts about as fast as its smoothed velocity says,
  /// within a tenth of top speed (with a short time constant its data do not tell the start).
  /// @param parameter  Index of the initial velocity in x. @return  In standard deviations.
  [[nodiscard]] double initial_velocity_deviation(const Eigen::VectorXd& x,
                                                  Eigen::Index parameter) const;
  /// 1/(standard deviation of that prior)².
  [[nodiscard]] double initial_velocity_information() const;

  /// Which parameters the data can move at all.
  [[nodiscard]] std::vector<bool> free_parameters() const;

 private:
  const PreparedRecording& recording_;
  mechanisms::MechanismKind mechanism_;
  std::vector<ResidualRun> runs_;
  std::vector<Response> responses_;
};

}  // namespace flyball::identification
