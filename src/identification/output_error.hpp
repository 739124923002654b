#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/identification/feedforward_fit.hpp>

#include "identification/response.hpp"

/// The comparison of a recording with its simulation, as a least-squares problem.
namespace flyball::identification {

namespace parameter {

/// Parameters that all runs share; after them, each run's own: its initial velocity, and by how
/// much its sensors' values are older than those of the others (where they are refreshed within a
/// row differs by run).
enum Shared : int {
  // Before them those of Simulation that runs share.
  position_delay = initial_velocity,  ///< s.
  velocity_delay,                     ///< s, to the middle of the averaging window.
  averaging_width,                    ///< s.
  velocity_scale,                     ///< Velocity column over true velocity.
  /// unit, by which the encoder is ahead of the inertia after a start from rest: it crosses
  /// backlash alone.
  take_up,
  end_of_shared,
};

}  // namespace parameter

inline constexpr int shared_parameter_count = parameter::end_of_shared;
inline constexpr int own_parameter_count = 2;

[[nodiscard]] inline Eigen::Index initial_velocity_of(std::size_t run) {
  return shared_parameter_count + own_parameter_count * static_cast<Eigen::Index>(run);
}
[[nodiscard]] inline Eigen::Index extra_delay_of(std::size_t run) {
  return initial_velocity_of(run) + 1;
}

/// What the simulation of a run depends on. @param x  All parameters.
[[nodiscard]] inline SimulationVector simulation_parameters(const Eigen::VectorXd& x,
                                                            std::size_t run) {
  SimulationVector simulated{};
  for (int k = 0; k < parameter::initial_velocity; ++k) {
    simulated[static_cast<std::size_t>(k)] = x[k];
  }
  simulated[parameter::initial_velocity] = x[initial_velocity_of(run)];
  return simulated;
}

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

/// s, kA/kV of a mechanism of which nothing is known, give or take a factor of e.
inline constexpr double usual_time_constant = 0.1;

/// Measured − simulated with its Jacobian, in units of the channel.
struct ResidualBlock {
  Eigen::VectorXd difference;
  Eigen::VectorXd velocity;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Jacobian difference_jacobian;
  Jacobian velocity_jacobian;
  /// Of all parameters, that of each column of both; -1 for a column of zeros.
  std::vector<Eigen::Index> columns;
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
    return shared_parameter_count + own_parameter_count * static_cast<int>(runs_.size());
  }
  [[nodiscard]] std::size_t residuals() const;

  /// What the forces depend on: the angle under gravity and the position of a spring are the
  /// measured ones, the position's delay later; the velocity of a drag is that of the last
  /// simulation with x. @param x  All parameters.
  void refresh_forces(const Eigen::VectorXd& x);

  /// Whether the forces hold what friction along the travel is made of, from the next refresh on.
  void offer_field(bool offered) { field_ = offered; }
  /// @param time  s, that a step takes for it.
  void cross_backlash_in(double time) { take_up_time_ = time; }
  /// Whether a start may be one across backlash.
  void offer_backlash(bool offered) { backlash_ = offered; }

  /// Makes a term of the model free that a mechanism need not have: bias, spring, drag, sag, all of
  /// the friction field, headroom, take_up.
  void extend(int parameter, bool by_it) { extended_[static_cast<std::size_t>(parameter)] = by_it; }
  void take_terms_out() { extended_.fill(false); }
  [[nodiscard]] bool is_extended(int parameter) const {
    return extended_[static_cast<std::size_t>(parameter)];
  }
  /// Whether that term can be told from the model's others: no spring without a travel.
  [[nodiscard]] bool can_extend(int parameter) const;

  /// Residuals of one run. @param x  All parameters.
  void evaluate(std::size_t run, const Eigen::VectorXd& x, ResidualBlock& block);
  /// And Jacobians. @param wanted  Those of all parameters that they are taken by, at least.
  void evaluate(std::size_t run, const Eigen::VectorXd& x, const std::vector<bool>& wanted,
                ResidualBlock& block);

  /// The velocity (as the column shows it) and the position at the given times of a run.
  [[nodiscard]] double velocity_shown(std::size_t run, const Eigen::VectorXd& x, double time) const;
  [[nodiscard]] double position_shown(std::size_t run, const Eigen::VectorXd& x, double time) const;

  /// What is known of the nuisance parameters before the data: sensors are 0 to 40 ms late and
  /// average over 0 to 100 ms, which matters where data are so noisy that delay and inertia trade;
  /// a run that starts in motion starts about as fast as its smoothed velocity says, within a tenth
  /// of top speed (with a short time constant its data do not tell the start).
  struct Prior {
    Eigen::Index parameter;
    double mean;
    double deviation;  ///< Standard.
  };
  [[nodiscard]] const std::vector<Prior>& priors() const { return priors_; }

  /// The steps' own shares of the sensors' age. Their sum is held at zero, so that the delays are
  /// the steps' mean age: a ramp tells an age only as friction, or as what the voltage's noise
  /// leaves in its simulation, and must not move what the steps tell.
  [[nodiscard]] const std::vector<Eigen::Index>& ages() const { return ages_; }
  /// s, of a run's share.
  [[nodiscard]] double age_deviation() const {
    return std::max(1e-4, recording_.row_period) / std::sqrt(12.0);  // uniform within a row
  }

  /// Whether friction and gravity are one number: a lift that moves in one direction alone.
  [[nodiscard]] bool hides_friction() const { return hides_friction_; }

  /// Whether no step tells the inertia: friction takes a ramp's share of it (Theorem 14.3.2).
  [[nodiscard]] bool hides_inertia() const { return hides_inertia_; }

  /// Which parameters the data can move at all.
  [[nodiscard]] std::vector<bool> free_parameters() const;

 private:
  template <int width>
  void linearize(std::size_t run, const Eigen::VectorXd& x, ResidualBlock& block);

  const PreparedRecording& recording_;
  mechanisms::MechanismKind mechanism_;
  std::vector<ResidualRun> runs_;
  std::vector<Response> responses_;
  std::array<bool, shared_parameter_count> extended_{};
  std::vector<Prior> priors_;
  std::vector<Eigen::Index> ages_;
  double low_ = 0.0;            ///< Of the travel.
  double high_ = 0.0;           ///< Of the travel.
  double take_up_time_ = 5e-3;  ///< s
  bool backlash_ = true;
  bool field_ = false;  ///< Whether the forces hold friction along the travel.
  bool hides_friction_ = false;
  bool hides_inertia_ = false;
};

}  // namespace flyball::identification
