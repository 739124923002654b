#include <algorithm>
#include <cmath>

#include <flyball/estimation/localization/landmark_filter.hpp>
#include <flyball/estimation/localization/localize.hpp>
#include <flyball/optimization/factor_graph.hpp>

#include "core/try.hpp"
#include "estimation/localization/drive_log.hpp"
#include "estimation/localization/residuals.hpp"

namespace flyball {

using localization::check_wanted;
using localization::Integrals;
using localization::span_of;
using optimization::FactorGraph;
using optimization::Variable;

namespace {

using Errors = Eigen::Vector2d;
using Calibration = LandmarkFilter::Calibration;

/// The graph of a drive: a node at each sighting and every `spacing`.
class Drive {
 public:
  Drive(const LandmarkLog& log, const LandmarkOptions& options, const std::vector<double>& times,
        const std::optional<Pose2d>& start)
      : log_(log), options_(options), times_(times), start_(start), integrals_(log.odometry) {}

  Expected<SmoothedLandmarks> run() {
    lay_nodes();
    FLYBALL_TRY(const FilteredLandmarks filtered,
                filter_landmarks(log_, options_, node_times_, start_));
    poses_ = filtered.path.pose;
    node_times_ = filtered.path.time;  // From the first at which there is a pose.
    if (node_times_.size() < (start_ ? 1U : 2U)) {
      return refusal(LocalizationError::too_few_sightings, "smooth_landmarks", "the sightings")
          .got("those from which a pose follows end the log")
          .expected("a drive that goes on after them");
    }
    errors_.assign(node_times_.size(), Errors::Zero());
    calibration_ = filtered.calibration.vector();
    SmoothedLandmarks result;
    result.used.resize(log_.sightings.size());
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      result.used[i] = filtered.weight[i] > 0.0 && log_.sightings[i].time >= node_times_.front();
    }
    if (!start_ && std::count(result.used.begin(), result.used.end(), true) == 0) {
      measure(result);  // Those that told the filter's first pose.
      take_in(result);
    }
    // The odometry is linearised in the delay, and sightings come in that fit the result.
    constexpr int most_rounds = 4;
    constexpr double settled = 1e-3;  // s
    for (int round = 1; round <= most_rounds; ++round) {
      const double delay = calibration_(3);
      FLYBALL_CHECK(solve(result));
      measure(result);
      if (round == most_rounds ||
          (!take_in(result) && round > 1 && std::abs(calibration_(3) - delay) < settled)) {
        break;
      }
    }
    FLYBALL_CHECK(finish(result));
    return result;
  }

 private:
  static constexpr double spacing = 0.2;  // s

  void lay_nodes() {
    const auto [first, last] = span_of(log_);
    if (!(first <= last)) {
      return;
    }
    const double steps = std::ceil((last - first) / spacing);
    constexpr double most = 1e5;  // Nodes of a log of five hours; of longer ones they are apart.
    const double count = std::clamp(steps, 1.0, most);
    const double step = (last - first) / count;
    for (double k = 0.0; k <= count; k += 1.0) {
      node_times_.push_back(first + k * step);
    }
    for (const Sighting& sighting : log_.sightings) {
      node_times_.push_back(sighting.time);
    }
    std::sort(node_times_.begin(), node_times_.end());
    constexpr double same = 1e-6;
    std::vector<double> kept;
    for (const double time : node_times_) {
      if (kept.empty() || time > kept.back() + same) {
        kept.push_back(time);
      }
    }
    node_times_ = std::move(kept);
  }

  [[nodiscard]] std::size_t node_of(double time) const {
    const auto at = std::lower_bound(node_times_.begin(), node_times_.end(), time - 1e-6);
    return std::min(static_cast<std::size_t>(at - node_times_.begin()), node_times_.size() - 1);
  }

  [[nodiscard]] localization::SightingResidual residual_of(const Sighting& s) const {
    return {log_.landmarks[s.landmark].position, s.range, s.bearing, 1.0 / options_.range_std,
            1.0 / options_.bearing_std};
  }

  void add_odometry(std::size_t i) {
    const double delay = calibration_(3);
    const double from = node_times_[i - 1];
    const double to = node_times_[i];
    const double dt = to - from;
    const auto a = integrals_(from - delay);
    const auto b = integrals_(to - delay);
    const double way = b.way - a.way;
    const double turned = b.turned - a.turned;
    const bool stands = way == 0.0 && turned == 0.0;
    const double moving = stands ? options_.standstill : 1.0;
    const double missing = std::max(a.age, b.age) > options_.longest_gap ? 1.0 : 0.0;
    const auto square = [](double x) { return x * x; };
    // What is exactly known would make the others' part in the equations vanish.
    constexpr double least = 1e-4;
    const double rate = turned / dt;
    const double speed = way / dt;
    const Eigen::Vector3d std(std::sqrt(dt * (square(moving * options_.velocity_density) +
                                              square(options_.relative_density * speed))) +
                                  least,
                              options_.slip_density * std::sqrt(std::abs(way)) + least,
                              std::sqrt(dt * (square(moving * options_.turn_density) +
                                              square(options_.relative_density * rate))) +
                                  least);
    graph_.add_factor(localization::OdometryResidual{{way, turned, b.velocity - a.velocity,
                                                      b.turn_rate - a.turn_rate, delay, dt},
                                                     std.cwiseInverse()},
                      optimization::RobustLoss{optimization::Loss::cauchy, 5.0}, nodes_[i - 1],
                      nodes_[i], node_errors_[i - 1], constants_);
    const double stays = std::exp(-dt / options_.error_time);
    const double fresh = std::sqrt(1.0 - stays * stays);
    const Eigen::Vector2d error_std(
        fresh * (moving * options_.velocity_error + missing * options_.gap_velocity_error) + 1e-6,
        fresh * (moving * options_.turn_error + missing * options_.gap_turn_error) + 1e-6);
    graph_.add_factor(localization::ErrorResidual{stays, error_std.cwiseInverse()},
                      node_errors_[i - 1], node_errors_[i]);
  }

  void build(const std::vector<bool>& used) {
    graph_ = {};
    nodes_.clear();
    node_errors_.clear();
    constants_ = graph_.add(calibration_);
    // A constant that is kept has a prior as narrow as the equations bear.
    constexpr double kept = 1e-6;
    graph_.add_factor(
        localization::PriorResidual<SensorCalibration::size>{
            options_.calibration.vector(),
            options_.calibration_std.vector().cwiseMax(kept).cwiseInverse()},
        constants_);
    for (std::size_t i = 0; i < node_times_.size(); ++i) {
      nodes_.push_back(graph_.add(poses_[i]));
      node_errors_.push_back(graph_.add(errors_[i]));
      if (i > 0) {
        add_odometry(i);
      }
    }
    graph_.add_factor(localization::PriorResidual<2>{Errors::Zero(),
                                                     Errors(1.0 / (options_.velocity_error + 1e-6),
                                                            1.0 / (options_.turn_error + 1e-6))},
                      node_errors_.front());
    if (start_) {
      graph_.add_factor(
          localization::PosePrior{
              *start_, Eigen::Vector3d(1.0 / options_.position_std, 1.0 / options_.position_std,
                                       1.0 / options_.heading_std)},
          nodes_.front());
    }
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      if (used[i]) {
        graph_.add_factor(
            residual_of(log_.sightings[i]),
            optimization::RobustLoss{optimization::Loss::cauchy, std::sqrt(options_.freedom)},
            nodes_[node_of(log_.sightings[i].time)], constants_);
      }
    }
  }

  Expected<void> solve(SmoothedLandmarks& result) {
    build(result.used);
    // Poses are known to 1e-3 of their deviations long before the optimum is exact.
    FLYBALL_TRY(const auto solved, graph_.solve({.max_iterations = 300, .tolerance = 1e-5}));
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      poses_[i] = graph_[nodes_[i]];
      errors_[i] = graph_[node_errors_[i]];
    }
    calibration_ = graph_[constants_];
    result.iterations += solved.iterations;
    result.optimality = solved.optimality;
    result.converged = solved.converged;
    result.unknowns = solved.unknowns;
    return {};
  }

  /// How far each sighting is off.
  void measure(SmoothedLandmarks& result) const {
    result.distance.assign(log_.sightings.size(), 0.0);
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      const Sighting& s = log_.sightings[i];
      if (s.time >= node_times_.front()) {
        result.distance[i] = residual_of(s)(poses_[node_of(s.time)], calibration_).norm();
      }
    }
  }

  /// Takes in what fits now. @return  Whether there was any.
  bool take_in(SmoothedLandmarks& result) const {
    constexpr double fits = 4.0;
    bool changed = false;
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      if (!result.used[i] && log_.sightings[i].time >= node_times_.front() &&
          result.distance[i] < fits) {
        result.used[i] = changed = true;
      }
    }
    return changed;
  }

  Expected<void> finish(SmoothedLandmarks& result) {
    FLYBALL_TRY(const auto covariances, graph_.covariances());
    result.calibration = SensorCalibration::from(calibration_);
    result.calibration_covariance = covariances[0];
    result.calibration_std = SensorCalibration::from(covariances[0].diagonal().cwiseSqrt());
    for (const double time : times_) {
      if (time < node_times_.front() || time > node_times_.back()) {
        continue;
      }
      const std::size_t after =
          std::min<std::size_t>(std::max<std::size_t>(node_of(time), 1), node_times_.size() - 1);
      const std::size_t before = after == 0 ? 0 : after - 1;
      const double apart = node_times_[after] - node_times_[before];
      const double share = apart > 0.0 ? (time - node_times_[before]) / apart : 0.0;
      result.path.time.push_back(time);
      result.path.pose.push_back(
          poses_[before].interpolate(poses_[after], std::clamp(share, 0.0, 1.0)));
      const std::size_t nearest = share < 0.5 ? before : after;
      result.path.covariance.push_back(
          covariances[static_cast<std::size_t>(nodes_[nearest].place)]);
    }
    return {};
  }

  const LandmarkLog& log_;
  const LandmarkOptions& options_;
  const std::vector<double>& times_;
  const std::optional<Pose2d>& start_;
  Integrals integrals_;
  std::vector<double> node_times_;
  std::vector<Pose2d> poses_;
  std::vector<Errors> errors_;
  Calibration calibration_;
  FactorGraph<Pose2d, Errors, Calibration> graph_;
  std::vector<Variable<Pose2d>> nodes_;
  std::vector<Variable<Errors>> node_errors_;
  Variable<Calibration> constants_;
};

}  // namespace

Expected<SmoothedLandmarks> smooth_landmarks(const LandmarkLog& log, const LandmarkOptions& options,
                                             const std::vector<double>& times,
                                             const std::optional<Pose2d>& start) {
  FLYBALL_CHECK(check_landmark_log(log, options));
  FLYBALL_CHECK(check_wanted(times, "smooth_landmarks"));
  return Drive(log, options, times, start).run();
}

}  // namespace flyball
