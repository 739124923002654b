#include <flyball/estimation/localization/landmark_filter.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include <flyball/estimation/unscented_kalman_filter.hpp>
#include <flyball/math/derivatives/differentiation.hpp>

#include "core/try.hpp"
#include "estimation/localization/residuals.hpp"

namespace flyball {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix = TangentMatrix<LandmarkFilter::State>;

/// Where the parts' errors begin.
enum Column : int { velocity_error = 3, turn_error = 4, velocity_scale = 5 };

Matrix start_covariance(const LandmarkOptions& options) {
  Matrix P = Matrix::Zero();
  P(0, 0) = P(1, 1) = options.position_std * options.position_std;
  P(2, 2) = options.heading_std * options.heading_std;
  P(velocity_error, velocity_error) = options.velocity_error * options.velocity_error;
  P(turn_error, turn_error) = options.turn_error * options.turn_error;
  const auto std = options.calibration_std.vector();
  for (int i = 0; i < SensorCalibration::size; ++i) {
    P(velocity_scale + i, velocity_scale + i) = std(i) * std(i);
  }
  return P;
}

JosephCovariance<LandmarkFilter::size> start_form(const LandmarkOptions& options) {
  JosephCovariance<LandmarkFilter::size> form;
  form.set(start_covariance(options));
  return form;
}

LandmarkFilter::State start_state(const LandmarkOptions& options, const Pose2d& pose) {
  return LandmarkFilter::State(pose, Vector2d::Zero(), options.calibration.vector());
}

}  // namespace

Expected<LandmarkFilter> LandmarkFilter::create(const LandmarkOptions& options) {
  FLYBALL_CHECK(check_landmark_log({}, options));
  FLYBALL_TRY(const auto guard, OutlierGuard::create({.treatment = OutlierTreatment::student,
                                                      .freedom = options.freedom,
                                                      .iterations = 5}));
  return LandmarkFilter(options, guard);
}

LandmarkFilter::LandmarkFilter(const LandmarkOptions& options, const OutlierGuard& guard) noexcept
    : options_(options),
      estimate_(start_state(options, Pose2d()), start_form(options)),
      guard_(guard),
      noise_(MeasurementNoise<2>::independent(
          {options.range_std * options.range_std, options.bearing_std * options.bearing_std})) {}

bool LandmarkFilter::reset(const Pose2d& pose) noexcept {
  if (!is_signal(pose.matrix())) {
    return false;
  }
  // What is known of the sensors stays; the pose's own errors are independent of it.
  Matrix P = estimate_.P();
  P.topRows<5>().setZero();
  P.leftCols<5>().setZero();
  const Matrix start = start_covariance(options_);
  P.topLeftCorner<5, 5>() = start.topLeftCorner<5, 5>();
  State state = estimate_.x_hat();
  state.get<0>() = pose;
  state.get<1>().setZero();
  located_ = estimate_.reset(state, P);
  guard_.reset();
  relocalizer_.clear();
  return located_;
}

bool LandmarkFilter::reset(const Pose2d& pose, double time) noexcept {
  if (!is_signal(time) || !reset(pose)) {
    return false;
  }
  time_ = time;
  started_ = true;
  sample_count_ = next_sample_ = 0;
  return true;
}

/// Whether a time is one of this clock: finite, and not far ahead of what has come.
bool LandmarkFilter::is_near(double time) const noexcept {
  double newest = time_;
  if (sample_count_ > 0) {
    newest = std::max(
        newest, samples_[static_cast<std::size_t>((next_sample_ - 1 + memory) % memory)].time);
  }
  return is_signal(time) && (!started_ || time - newest <= longest_pause);
}

bool LandmarkFilter::odometry(double time, double velocity, double turn_rate) noexcept {
  constexpr double shortest = 0.004;  // s
  if (!is_near(time) || !is_signal(velocity) || !is_signal(turn_rate)) {
    return false;
  }
  if (sample_count_ == 0) {
    samples_[0] = {time, 0.0, 0.0, velocity, turn_rate};
    next_sample_ = 1;
    sample_count_ = 1;
    if (!started_) {
      time_ = time;
      started_ = true;
    }
    return true;
  }
  Sample& last = samples_[static_cast<std::size_t>((next_sample_ - 1 + memory) % memory)];
  const double dt = time - last.time;
  if (!(dt >= 0.0)) {
    return false;
  }
  if (dt < shortest) {
    last.velocity = velocity;
    last.turn_rate = turn_rate;
    return true;
  }
  samples_[static_cast<std::size_t>(next_sample_)] = {
      time, last.way + dt * last.velocity, last.turned + dt * last.turn_rate, velocity, turn_rate};
  next_sample_ = (next_sample_ + 1) % memory;
  sample_count_ = std::min(sample_count_ + 1, memory);
  return true;
}

LandmarkFilter::Driven LandmarkFilter::driven(double time) const noexcept {
  if (sample_count_ == 0) {
    return {};
  }
  // Back from the newest: that is where a time of now is found at once.
  int back = 0;
  const auto sample = [&](int k) -> const Sample& {
    return samples_[static_cast<std::size_t>((next_sample_ - 1 - k + 2 * memory) % memory)];
  };
  while (back + 1 < sample_count_ && sample(back).time > time) {
    ++back;
  }
  const Sample& at = sample(back);
  const double dt = time - at.time;
  if (dt < 0.0) {  // Before all that is known: it stood.
    return {at.way, at.turned, 0.0, 0.0, false};
  }
  return {at.way + dt * at.velocity, at.turned + dt * at.turn_rate, at.velocity, at.turn_rate,
          dt > options_.longest_gap};
}

void LandmarkFilter::step(double from, double to) noexcept {
  const State& x = estimate_.x_hat();
  const Calibration& k = x.get<2>();
  const double dt = to - from;
  const double late = std::clamp(k(3), 0.0, 2.0);
  const Driven a = driven(from - late);
  const Driven b = driven(to - late);
  const double way = b.way - a.way;
  const double turned = b.turned - a.turned;
  const localization::Driven between{
      way, turned, b.velocity - a.velocity, b.turn_rate - a.turn_rate, k(3), dt};
  const double stays = std::exp(-dt / options_.error_time);
  const auto moved = [&](const auto& state) {
    auto after = state;
    after.template get<0>() = state.template get<0>().plus(
        localization::twist(between, state.template get<1>(), state.template get<2>()));
    after.template get<1>() *= stays;
    return after;
  };
  const auto square = [](double value) { return value * value; };
  const double speed = way / dt;
  const double rate = turned / dt;
  const double moving = way != 0.0 || turned != 0.0 ? 1.0 : options_.standstill;
  const double missing = a.missing || b.missing ? 1.0 : 0.0;
  Matrix Q = Matrix::Zero();
  Q(0, 0) =
      dt * (square(moving * options_.velocity_density) + square(options_.relative_density * speed));
  Q(1, 1) = square(options_.slip_density) * std::abs(way);
  Q(2, 2) =
      dt * (square(moving * options_.turn_density) + square(options_.relative_density * rate));
  const double fresh = 1.0 - stays * stays;
  Q(velocity_error, velocity_error) =
      fresh * square(moving * options_.velocity_error + missing * options_.gap_velocity_error);
  Q(turn_error, turn_error) =
      fresh * square(moving * options_.turn_error + missing * options_.gap_turn_error);
  // Calibrations drift by 1 % of what was unknown of them in the root of a second.
  const auto std = options_.calibration_std.vector();
  for (int i = 0; i < SensorCalibration::size; ++i) {
    Q(velocity_scale + i, velocity_scale + i) = dt * square(0.002 * std(i));
  }
  dead_reckoned_ = dead_reckoned_ * x.get<0>().between(moved(x).get<0>());
  const PlainNoise<size> noise(Q);
  if (options_.method == LandmarkFilterMethod::unscented) {
    Unscented<>().predict(estimate_, moved, noise);
  } else {
    Extended().predict(estimate_, moved, noise);
  }
}

bool LandmarkFilter::predict(double time) noexcept {
  constexpr double longest_step = 0.05;  // s
  constexpr double most_steps = 400.0;
  if (!is_near(time) || (started_ && time < time_)) {
    return false;
  }
  if (!started_) {
    time_ = time;
    started_ = true;
  }
  const double total = time - time_;
  const double steps = std::clamp(std::ceil(total / longest_step), 1.0, most_steps);
  const double begin = time_;
  for (int i = 0; i < static_cast<int>(steps); ++i) {
    const double from = begin + total * (i / steps);
    const double to = begin + total * ((i + 1) / steps);
    if (to > from) {
      step(from, to);
    }
  }
  time_ = time;
  return true;
}

Correction<2> LandmarkFilter::take(Estimate<State>& estimate, const Vector2d& landmark,
                                   const Vector2d& reading) noexcept {
  const CorrectionOptions how{.guard = &guard_, .iterations = 5};
  if (options_.method == LandmarkFilterMethod::invariant) {
    // x seen = landmark. The noise is that of the reading, brought into the fixed frame; there the
    // slope by an error Exp(ξ) x, ξ = Ad(x) δ, is [I, J (x seen)], and a step in ξ is the same step
    // in δ, since Exp(ξ) x = x Exp(δ).
    const State& x = estimate.x_hat();
    const Eigen::Matrix2d slope =
        x.get<0>().rotation().matrix() *
        jacobian([&](const auto& r) { return localization::seen(x.get<2>(), r(0), r(1)); },
                 reading);
    const MeasurementNoise<2> noise(
        Eigen::Matrix2d(slope * noise_.D().asDiagonal() * slope.transpose()));
    const auto there = [&](const auto& at) {
      using Scalar = typename std::remove_cvref_t<decltype(at)>::Scalar;
      return Eigen::Matrix<Scalar, 2, 1>(
          at.template get<0>() *
          localization::seen(at.template get<2>(), Scalar(reading(0)), Scalar(reading(1))));
    };
    return Extended().correct(estimate, landmark, there, noise, how);
  }
  const auto expected = [&](const auto& at) {
    return localization::sighting(at.template get<0>(), at.template get<2>(), landmark);
  };
  if (options_.method == LandmarkFilterMethod::unscented) {
    auto taken =
        Unscented<>().correct(estimate, reading, expected, noise_, how, AngleDifference<1>());
    // Where h bends much, what its line leaves is noise beside which everything fits: what counts
    // is how far off the reading still is.
    const Vector2d off = AngleDifference<1>()(reading, expected(estimate.x_hat()));
    taken.weight = std::min(taken.weight, guard_.weight(off.dot(off.cwiseQuotient(noise_.D())), 2));
    return taken;
  }
  return Extended().correct(estimate, reading, expected, noise_, how, AngleDifference<1>());
}

Correction<2> LandmarkFilter::sighting(double time, const Vector2d& landmark, double range,
                                       double bearing) noexcept {
  Correction<2> result;
  if (!is_near(time) || !is_signal(landmark) || !is_signal(range) || !is_signal(bearing) ||
      !(range > 0.0)) {
    return result;
  }
  predict(time);
  relocalizer_.add(time_, dead_reckoned_,
                   localization::seen(estimate_.x_hat().get<2>(), range, bearing), landmark);
  if (!located_) {
    relocalize();
    result.status = located_ ? UpdateStatus::updated : UpdateStatus::rejected;
    return result;
  }
  // Student's noise still lets what is far off pull a little, and a landmark that is taken for
  // another pulls at every sighting: below this weight it does not count at all.
  constexpr double least_weight = 0.05;
  constexpr double doubtful = 0.5;
  Estimate<State> trial = estimate_;
  result = take(trial, landmark, {range, bearing});
  if (result.accepted() && result.weight >= least_weight) {
    estimate_ = trial;
  } else if (result.accepted()) {
    result.status = UpdateStatus::rejected;
  }
  if (options_.relocalize && (!result.accepted() || result.weight < doubtful)) {
    relocalize();
  }
  return result;
}

void LandmarkFilter::relocalize() noexcept {
  constexpr int least_at_start = 4;
  constexpr int least_anew = 5;
  const auto found = relocalizer_.find(dead_reckoned_, located_ ? least_anew : least_at_start);
  if (!found) {
    return;
  }
  if (located_ &&
      3 * relocalizer_.agreeing(pose(), dead_reckoned_, found->considered) > found->considered) {
    return;
  }
  if (reset(found->pose)) {
    ++relocalizations_;
  }
}

}  // namespace flyball
