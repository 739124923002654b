#include <flyball/estimation/localization/localize.hpp>

#include <algorithm>
#include <cmath>

#include <flyball/core/argument.hpp>
#include <flyball/estimation/localization/landmark_filter.hpp>
#include <flyball/optimization/factor_graph.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "estimation/localization/residuals.hpp"

namespace flyball {

using optimization::FactorGraph;
using optimization::Variable;

ErrorInfo error_info(LocalizationError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"too_few_sightings", "no pose follows from the landmarks that were seen",
       ErrorKind::no_answer},
  };
  return detail::info_of(code, "localization", rows);
}

namespace {

using Errors = Eigen::Vector2d;
using Calibration = LandmarkFilter::Calibration;

Expected<void> check_wanted(const std::vector<double>& times, std::string_view where) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i]) || (i > 0 && times[i] < times[i - 1])) {
      return refusal(ArgumentError::out_of_range, where, detail::format("times[{}]", i))
          .got(detail::format("{}", times[i]))
          .expected("finite times that do not fall");
    }
  }
  return {};
}

/// The odometry as its integrals, between the samples too.
class Integrals {
 public:
  explicit Integrals(const std::vector<OdometrySample>& samples) : samples_(samples) {
    way_.resize(samples.size());
    turned_.resize(samples.size());
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const double dt = samples[i].time - samples[i - 1].time;
      way_[i] = way_[i - 1] + dt * samples[i - 1].velocity;
      turned_[i] = turned_[i - 1] + dt * samples[i - 1].turn_rate;
    }
  }

  struct At {
    double way = 0.0, turned = 0.0, velocity = 0.0, turn_rate = 0.0;
    double age = 0.0;  ///< Of the sample that holds, s.
  };
  [[nodiscard]] At operator()(double time) const {
    const auto after =
        std::upper_bound(samples_.begin(), samples_.end(), time,
                         [](double t, const OdometrySample& sample) { return t < sample.time; });
    if (after == samples_.begin()) {
      return {};
    }
    const auto i = static_cast<std::size_t>(after - samples_.begin() - 1);
    const double dt = time - samples_[i].time;
    return {way_[i] + dt * samples_[i].velocity, turned_[i] + dt * samples_[i].turn_rate,
            samples_[i].velocity, samples_[i].turn_rate, dt};
  }

 private:
  const std::vector<OdometrySample>& samples_;
  std::vector<double> way_;
  std::vector<double> turned_;
};

/// The first and the last time of a log.
std::pair<double, double> span_of(const LandmarkLog& log) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  if (!log.odometry.empty()) {
    first = std::min(first, log.odometry.front().time);
    last = std::max(last, log.odometry.back().time);
  }
  if (!log.sightings.empty()) {
    first = std::min(first, log.sightings.front().time);
    last = std::max(last, log.sightings.back().time);
  }
  return {first, last};
}

}  // namespace

Expected<LocalizedPath> dead_reckon_landmarks(const LandmarkLog& log,
                                              const LandmarkOptions& options,
                                              const std::vector<double>& times,
                                              const Pose2d& start) {
  FLYBALL_CHECK(check_landmark_log(log, options));
  FLYBALL_CHECK(check_wanted(times, "dead_reckon_landmarks"));
  const Integrals integrals(log.odometry);
  LocalizedPath path;
  Pose2d pose = start;
  std::size_t next = 0;
  double before = times.empty() ? 0.0 : times.front();
  const auto go_on = [&](double to) {
    const auto a = integrals(before);
    const auto b = integrals(to);
    pose = pose * Pose2d::exp(Eigen::Vector3d(b.way - a.way, 0.0, b.turned - a.turned));
    before = to;
  };
  for (const double time : times) {
    while (next < log.odometry.size() && log.odometry[next].time <= time) {
      if (log.odometry[next].time > before) {
        go_on(log.odometry[next].time);
      }
      ++next;
    }
    go_on(time);
    path.time.push_back(time);
    path.pose.push_back(pose);
    path.covariance.push_back(Eigen::Matrix3d::Zero());
  }
  return path;
}

Expected<FilteredLandmarks> filter_landmarks(const LandmarkLog& log, const LandmarkOptions& options,
                                             const std::vector<double>& times,
                                             const std::optional<Pose2d>& start) {
  FLYBALL_CHECK(check_landmark_log(log, options));
  FLYBALL_CHECK(check_wanted(times, "filter_landmarks"));
  FLYBALL_TRY(LandmarkFilter filter, LandmarkFilter::create(options));
  FilteredLandmarks result;
  std::size_t odometry = 0;
  std::size_t sighting = 0;
  if (start) {
    filter.reset(*start);
  }
  const auto take_until = [&](double time) {
    constexpr double never = std::numeric_limits<double>::infinity();
    for (;;) {
      const double moved = odometry < log.odometry.size() ? log.odometry[odometry].time : never;
      const double seen = sighting < log.sightings.size() ? log.sightings[sighting].time : never;
      if (!(std::min(moved, seen) <= time)) {
        return;
      }
      if (moved <= seen) {
        const OdometrySample& sample = log.odometry[odometry++];
        filter.odometry(sample.time, sample.velocity, sample.turn_rate);
        continue;
      }
      const Sighting& s = log.sightings[sighting++];
      const auto correction =
          filter.sighting(s.time, log.landmarks[s.landmark].position, s.range, s.bearing);
      result.weight.push_back(correction.accepted() ? correction.weight : 0.0);
      result.nis.push_back(correction.nis);
    }
  };
  const double first = span_of(log).first;
  for (const double time : times) {
    if (time < first) {
      continue;
    }
    take_until(time);
    filter.predict(time);
    if (filter.located()) {
      result.path.time.push_back(time);
      result.path.pose.push_back(filter.pose());
      result.path.covariance.push_back(filter.pose_covariance());
    }
  }
  take_until(span_of(log).second);
  if (!filter.located()) {
    return refusal(LocalizationError::too_few_sightings, "filter_landmarks", "the sightings")
        .got(detail::format("{} sightings from which no pose follows", log.sightings.size()))
        .expected("at least four that agree, of two landmarks or more")
        .hint("give the pose at the start, or check that the sightings name the right landmarks");
  }
  result.calibration = filter.calibration();
  result.relocalizations = filter.relocalizations();
  return result;
}

namespace {

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
    errors_.assign(node_times_.size(), Errors::Zero());
    calibration_ = filtered.calibration.vector();
    SmoothedLandmarks result;
    result.used.resize(log_.sightings.size());
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      result.used[i] = filtered.weight[i] > 0.0 && log_.sightings[i].time >= node_times_.front();
    }
    // The odometry is linearised in the delay, and sightings come in that fit the result.
    constexpr int most_rounds = 4;
    for (int round = 0; round < most_rounds; ++round) {
      const double delay = calibration_(3);
      FLYBALL_TRY(const bool last, solve(result, round + 1 == most_rounds));
      const bool settled = std::abs(calibration_(3) - delay) < 1e-3 && !reconsider(result);
      if (last || (settled && round > 0)) {
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
    constexpr double most = 1e6;
    const double step = (last - first) / std::min(std::max(steps, 1.0), most);
    for (double k = 0.0; k <= std::min(steps, most); k += 1.0) {
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
    graph_.add_factor(
        localization::OdometryResidual{way, turned, b.velocity - a.velocity,
                                       b.turn_rate - a.turn_rate, delay, dt, std.cwiseInverse()},
        optimization::RobustLoss{optimization::Loss::cauchy, 5.0}, nodes_[i - 1], nodes_[i],
        node_errors_[i - 1], constants_);
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

  Expected<bool> solve(SmoothedLandmarks& result, bool last) {
    build(result.used);
    // Poses are known to 1e-3 of their deviations long before the optimum is exact.
    FLYBALL_TRY(const auto solved, graph_.solve({.max_iterations = 50, .tolerance = 1e-5}));
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      poses_[i] = graph_[nodes_[i]];
      errors_[i] = graph_[node_errors_[i]];
    }
    calibration_ = graph_[constants_];
    result.iterations += solved.iterations;
    result.optimality = solved.optimality;
    result.converged = solved.converged;
    result.unknowns = solved.unknowns;
    return last;
  }

  /// Takes in what fits now. @return  Whether anything has changed.
  bool reconsider(SmoothedLandmarks& result) {
    constexpr double fits = 4.0;
    result.distance.assign(log_.sightings.size(), 0.0);
    bool changed = false;
    for (std::size_t i = 0; i < log_.sightings.size(); ++i) {
      const Sighting& s = log_.sightings[i];
      if (s.time < node_times_.front()) {
        continue;
      }
      result.distance[i] = residual_of(s)(poses_[node_of(s.time)], calibration_).norm();
      if (!result.used[i] && result.distance[i] < fits) {
        result.used[i] = true;
        changed = true;
      }
    }
    return changed;
  }

  Expected<void> finish(SmoothedLandmarks& result) {
    FLYBALL_TRY(const auto covariances, graph_.covariances());
    result.calibration = SensorCalibration::from(calibration_);
    result.calibration_std = SensorCalibration::from(covariances[0].diagonal().cwiseSqrt());
    for (const double time : times_) {
      if (time < node_times_.front() || time > node_times_.back()) {
        continue;
      }
      const std::size_t after = std::max<std::size_t>(node_of(time), 1);
      const std::size_t before = after - 1;
      const double share =
          (time - node_times_[before]) / (node_times_[after] - node_times_[before]);
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
