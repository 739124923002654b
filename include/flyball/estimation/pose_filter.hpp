#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <variant>

#include <Eigen/Core>

#include <flyball/core/quantity.hpp>
#include <flyball/estimation/invariant.hpp>
#include <flyball/geometry/se2.hpp>

/// What a PoseEstimator is made of: the noise of odometry, measurements of a pose, and the filter.
namespace flyball {

/// How far odometry goes wrong, as a random walk: the standard deviations of the error (forward,
/// left: m; heading: rad) after one metre, after one radian turned, and after one second, each
/// growing with the square root. The defaults are for wheels on carpet and a gyro, and a guess:
/// a robot's own come from its logs.
struct OdometryNoise {
  Eigen::Vector3d per_metre{0.03, 0.03, 0.005};
  Eigen::Vector3d per_radian{0.01, 0.01, 0.005};
  Eigen::Vector3d per_second{0.002, 0.002, 0.001};
};

/// Options of a PoseEstimator.
struct PoseEstimatorOptions {
  OdometryNoise odometry{};
  /// What becomes of measurements that do not fit.
  OutlierTreatment treatment = OutlierTreatment::gate;
  double probability = 0.999;  ///< Of good measurements, the share taken as it is (gate, huber).
  double freedom = 4.0;        ///< Of Student's distribution (student).
  /// So many poses that do not fit but agree with each other, over at least `recover_time`, replace
  /// the estimate; 0: never.
  int recover_after = 5;
  Time recover_time{0.3};
  /// Of several candidates the likeliest must be so much likelier than each other one.
  double least_ratio = 10.0;
};

/// What came of a prediction or a measurement. Of `not_finite` and what is below it nothing has
/// changed. What does not fit, is ambiguous or singular stays in the history without an effect, to
/// be judged again should an earlier measurement come later.
enum class PoseStatus {
  taken,
  relocated,            ///< The estimate was replaced by poses that it had rejected.
  rejected,             ///< It does not fit.
  ambiguous,            ///< Two of the candidates are about equally likely.
  singular_innovation,  ///< It has no noise and tells what is known without error.
  not_finite,           ///< NaN, an infinity, no rotation, or a landmark at the robot's own place.
  invalid_noise,        ///< No covariance, or a negative standard deviation.
  invalid_candidates,   ///< None, or more than `max_pose_candidates`.
  in_the_past,          ///< A prediction for a time that is over.
  too_old,              ///< A measurement of before the oldest sample that is kept.
  in_the_future,        ///< A measurement of a time that no prediction has reached.
};

/// What a measurement did.
struct PoseOutcome {
  PoseStatus status = PoseStatus::not_finite;
  double weight = 0.0;  ///< What it counted for: 1 fully, 0 not at all.
  double nis = 0.0;     ///< νᵀ S⁻¹ ν
  int candidate = -1;   ///< Which candidate was the likeliest; -1: there was no choice to make.
  std::size_t replayed = 0;  ///< How many later samples were gone through again.
};

inline constexpr std::size_t max_pose_candidates = 4;

namespace detail {

/// The pose is one of these, y = x Exp(v), v ~ N(0, R).
struct SeenPose {
  std::array<Pose2d, max_pose_candidates> candidates;
  std::size_t count;
  MeasurementNoise<3> noise;
};
struct SeenHeading {
  double angle;
  MeasurementNoise<1> noise;
};
struct SeenLandmark {
  Eigen::Vector2d landmark;
  double range, bearing;
  MeasurementNoise<2> noise;
};

/// An estimate of the pose, and beside it the rival that the poses it rejects agree on.
struct PoseBelief {
  Estimate<Pose2d> estimate;
  Estimate<Pose2d> rival;
  double rival_age = 0.0;
  int agreed = 0;  ///< How many poses are for the rival, less those against it; 0: there is none.
  int relocations = 0;
};

/// The lower half of a pose's covariance, in closed forms of 3 x 3.
struct PoseCovariance {
  double xx, yx, tx, yy, ty, tt;

  explicit PoseCovariance(const Eigen::Matrix3d& P) noexcept
      : xx(P(0, 0)), yx(P(1, 0)), tx(P(2, 0)), yy(P(1, 1)), ty(P(2, 1)), tt(P(2, 2)) {}
  [[nodiscard]] Eigen::Matrix3d matrix() const noexcept {
    Eigen::Matrix3d P;
    P << xx, yx, tx, yx, yy, ty, tx, ty, tt;
    return P;
  }
  void add(const Eigen::Vector3d& variances) noexcept {
    xx += variances(0);
    yy += variances(1);
    tt += variances(2);
  }
  /// P <- M P Mᵀ with M = [a, b, u; -b, a, v; 0, 0, 1], as adjoints and Jacobians are.
  void pass(double a, double b, double u, double v) noexcept {
    const PoseCovariance P = *this;
    const double cross = 2.0 * a * b * P.yx;
    tx = a * P.tx + b * P.ty;
    ty = a * P.ty - b * P.tx;
    xx = a * a * P.xx + cross + b * b * P.yy + u * (2.0 * tx + u * tt);
    yy = b * b * P.xx - cross + a * a * P.yy + v * (2.0 * ty + v * tt);
    yx = a * b * (P.yy - P.xx) + (a * a - b * b) * P.yx + u * ty + v * (tx + u * tt);
    tx += u * tt;
    ty += v * tt;
  }
  /// The correction with z of the whole twist whose entries err independently, entry by entry.
  /// @param delta  Takes the step. @param nis  Takes zᵀ S⁻¹ z.
  /// @return  False, and nothing is of use, where a noise is so small that rounding counts.
  bool correct(const Eigen::Vector3d& z, const Eigen::Vector3d& R, Eigen::Vector3d& delta,
               double& nis) noexcept {
    nis = 0.0;
    delta.setZero();
    return entry(xx, yx, tx, yy, ty, tt, R(0), z(0), delta(0), delta(1), delta(2), nis) &&
           entry(yy, yx, ty, xx, tx, tt, R(1), z(1), delta(1), delta(0), delta(2), nis) &&
           entry(tt, tx, ty, xx, yx, yy, R(2), z(2), delta(2), delta(0), delta(1), nis);
  }

 private:
  /// Entry j with the noise r: K = P_j/(P_jj + r), and P <- P - K P_jᵀ, whose row j is r K.
  static bool entry(double& jj, double& ja, double& jb, double& aa, double& ba, double& bb,
                    double r, double z, double& dj, double& da, double& db, double& nis) noexcept {
    constexpr double least = 1e-3;  // Below, Joseph's form is needed: JosephCovariance::correct.
    const double variance = jj + r;
    if (!(variance > 0.0 && r >= least * variance)) {
      return false;
    }
    const double inverse = 1.0 / variance;
    const double innovation = z - dj;
    const double step = innovation * inverse;
    nis += innovation * step;
    dj += jj * step;
    da += ja * step;
    db += jb * step;
    aa -= ja * ja * inverse;
    ba -= ja * jb * inverse;
    bb -= jb * jb * inverse;
    const double left = r * inverse;
    jj *= left;
    ja *= left;
    jb *= left;
    return true;
  }
};

/// A filter of the pose as a DelayedFilter takes it, whose inputs are twists per second.
class PoseFilter {
 public:
  using InputVector = Eigen::Vector3d;

  PoseFilter(const PoseBelief& belief, const PoseEstimatorOptions& options,
             const OutlierGuard& guard) noexcept
      : belief_(belief),
        guard_(guard),
        per_metre_(options.odometry.per_metre.cwiseAbs2()),
        per_radian_(options.odometry.per_radian.cwiseAbs2()),
        per_second_(options.odometry.per_second.cwiseAbs2()),
        recover_after_(options.recover_after),
        recover_time_(options.recover_time.si()),
        least_difference_(2.0 * std::log(options.least_ratio)) {}

  [[nodiscard]] const PoseBelief& estimate() const noexcept { return belief_; }
  void restore(const PoseBelief& belief) noexcept { belief_ = belief; }

  /// x <- x Exp(τ) with W = diag(σ_m² |(τx, τy)| + σ_r² |τθ| + σ_s² dt), that half of which comes
  /// before the motion and half after it (the trapezoid of a random walk along it):
  /// P <- F P Fᵀ + (F W Fᵀ + W)/2 with F = Ad(Exp(-τ)).
  [[gnu::flatten]] void predict(const InputVector& rate, double dt) noexcept {
    const Eigen::Vector3d twist = rate * dt;
    const double way = std::sqrt(twist(0) * twist(0) + twist(1) * twist(1));
    const Eigen::Vector3d half =
        0.5 * (per_metre_ * way + per_radian_ * std::abs(twist(2)) + per_second_ * dt);
    const Pose2d step = Pose2d::exp(twist);
    move(belief_.estimate, step, half);
    if (belief_.agreed > 0) {
      move(belief_.rival, step, half);
      belief_.rival_age += dt;
    }
  }

  [[gnu::flatten]] PoseOutcome take(const SeenPose& seen) noexcept {
    const Choice choice = choose(belief_.estimate, seen);
    PoseOutcome outcome;
    if (choice.clear) {
      outcome = correct(belief_.estimate, choice.residual, seen);
    } else {
      outcome.status = PoseStatus::ambiguous;
    }
    outcome.candidate = seen.count > 1 ? choice.index : -1;
    if (outcome.weight >= hardly) {
      belief_.agreed = 0;
    } else if (recover_after_ > 0 &&
               (outcome.status == PoseStatus::rejected || outcome.weight > 0.0) &&
               rival_wins(seen)) {
      outcome.status = PoseStatus::relocated;
      outcome.weight = 1.0;
    }
    return outcome;
  }

  /// h = θ, H = [0, 0, 1].
  PoseOutcome take(const SeenHeading& seen) noexcept {
    Estimate<Pose2d>& estimate = belief_.estimate;
    const Rotation2d off = estimate.x_hat().rotation().inverse() * Rotation2d(seen.angle);
    using Row = Eigen::Matrix<double, 1, 3>;
    return outcome_of(estimate.correct<1>(Eigen::Matrix<double, 1, 1>(off.angle()),
                                          Row(0.0, 0.0, 1.0), seen.noise, {.guard = &guard_}));
  }

  /// With (a, b) = x⁻¹ l, r² = a² + b²: h = (r, atan2(b, a)) and
  /// H = [-a/r, -b/r, 0; b/r², -a/r², -1].
  PoseOutcome take(const SeenLandmark& seen) noexcept {
    Estimate<Pose2d>& estimate = belief_.estimate;
    const Eigen::Vector2d at = estimate.x_hat().inverse() * seen.landmark;
    const double r = std::hypot(at(0), at(1));
    const Eigen::Vector2d e = at / r;
    Eigen::Matrix<double, 2, 3> H;
    H << -e(0), -e(1), 0.0, e(1) / r, -e(0) / r, -1.0;
    const Eigen::Vector2d residual(
        seen.range - r,
        std::remainder(seen.bearing - std::atan2(at(1), at(0)), 2.0 * std::numbers::pi));
    return outcome_of(estimate.correct<2>(residual, H, seen.noise, {.guard = &guard_}));
  }

 private:
  /// As an OutlierGuard counts: what weighs less does not fit.
  static constexpr double hardly = 0.1;

  struct Choice {
    Eigen::Vector3d residual;
    int index = 0;
    bool clear = true;
  };

  /// x <- x step, P <- F (P + half) Fᵀ + half with F = Ad(step⁻¹) = [R, (y, -x)ᵀ; 0, 1].
  static void move(Estimate<Pose2d>& estimate, const Pose2d& step,
                   const Eigen::Vector3d& half) noexcept {
    const Pose2d back = step.inverse();
    PoseCovariance P(estimate.P());
    P.add(half);
    P.pass(back.rotation().cos(), -back.rotation().sin(), back.y(), -back.x());
    P.add(half);
    set(estimate, estimate.x_hat() * step, P);
  }
  static void set(Estimate<Pose2d>& estimate, const Pose2d& pose,
                  const PoseCovariance& P) noexcept {
    const Eigen::Matrix<double, 3, 0> nothing;
    estimate.assign(pose, nothing, PlainNoise<3>(P.matrix()));
  }

  template <int M>
  static PoseOutcome outcome_of(const Correction<M>& correction) noexcept {
    PoseOutcome outcome;
    outcome.weight = correction.weight;
    outcome.nis = correction.nis;
    switch (correction.status) {
      case UpdateStatus::updated:
        outcome.status = PoseStatus::taken;
        break;
      case UpdateStatus::rejected:
        outcome.status = PoseStatus::rejected;
        break;
      case UpdateStatus::singular_innovation:
        outcome.status = PoseStatus::singular_innovation;
        break;
      case UpdateStatus::invalid_noise:
        outcome.status = PoseStatus::invalid_noise;
        break;
      case UpdateStatus::not_finite:
        break;
    }
    return outcome;
  }

  [[gnu::flatten]] PoseOutcome correct(Estimate<Pose2d>& estimate, const Eigen::Vector3d& residual,
                                       const SeenPose& seen) noexcept {
    if (seen.noise.is_diagonal() && is_signal(residual)) {
      // What fits, with errors that are independent and not tiny, as nearly every pose does: what
      // `Estimate::correct` does, without the zeros of H = I and of the Jacobian.
      PoseCovariance P(estimate.P());
      Eigen::Vector3d delta;
      PoseOutcome outcome{.status = PoseStatus::taken, .weight = 1.0};
      if (P.correct(residual, seen.noise.D(), delta, outcome.nis) &&
          guard_.weight(outcome.nis, 3) == 1.0) {
        const Eigen::Matrix3d J = Pose2d::right_jacobian(delta);
        P.pass(J(0, 0), J(0, 1), J(0, 2), J(1, 2));
        set(estimate, estimate.x_hat().plus(delta), P);
        guard_.judged(1.0);
        return outcome;
      }
    }
    return outcome_of(
        estimate.correct<3>(residual, Eigen::Matrix3d::Identity(), seen.noise, {.guard = &guard_}));
  }

  /// eᵀ S⁻¹ e
  static double distance(Eigen::Vector3d e, const MeasurementNoise<3>& S) noexcept {
    S.make_independent(e);
    double sum = 0.0;
    for (Eigen::Index j = 0; j < 3; ++j) {
      sum += e(j) * e(j) / std::max(S.D()(j), least_variance);
    }
    return sum;
  }

  /// The likeliest candidate. S is that of all, so the likelihoods' ratio is e^(-Δ(νᵀ S⁻¹ ν)/2). It
  /// is clear where each other one is less likely by the options' ratio, or is the same pose within
  /// the noise.
  [[nodiscard]] Choice choose(const Estimate<Pose2d>& estimate,
                              const SeenPose& seen) const noexcept {
    Choice choice;
    choice.residual = seen.candidates[0].minus(estimate.x_hat());
    if (seen.count == 1) {
      return choice;
    }
    const MeasurementNoise<3> S(Eigen::Matrix3d(estimate.P() + seen.noise.R()));
    std::array<double, max_pose_candidates> off{};
    std::size_t best = 0;
    for (std::size_t k = 0; k < seen.count; ++k) {
      const Eigen::Vector3d residual = seen.candidates[k].minus(estimate.x_hat());
      off[k] = distance(residual, S);
      if (off[k] < off[best]) {
        best = k;
        choice.residual = residual;
      }
    }
    choice.index = static_cast<int>(best);
    for (std::size_t k = 0; k < seen.count; ++k) {
      choice.clear = choice.clear &&
                     (k == best || off[k] - off[best] >= least_difference_ ||
                      distance(seen.candidates[k].minus(seen.candidates[best]), seen.noise) < 1.0);
    }
    return choice;
  }

  /// A pose that the estimate has rejected is for the rival, or against it, or begins one.
  bool rival_wins(const SeenPose& seen) noexcept {
    if (belief_.agreed > 0) {
      const Choice choice = choose(belief_.rival, seen);
      if (choice.clear && correct(belief_.rival, choice.residual, seen).weight >= hardly) {
        ++belief_.agreed;
        if (belief_.agreed < recover_after_ || belief_.rival_age < recover_time_) {
          return false;
        }
        belief_.estimate = belief_.rival;
        belief_.agreed = 0;
        ++belief_.relocations;
        return true;
      }
      if (--belief_.agreed > 0) {
        return false;
      }
    }
    if (belief_.rival.reset(seen.candidates[0], seen.noise.R())) {
      belief_.agreed = 1;
      belief_.rival_age = 0.0;
    }
    return false;
  }

  PoseBelief belief_;
  OutlierGuard guard_;
  Eigen::Vector3d per_metre_, per_radian_, per_second_;  ///< Variances.
  int recover_after_;
  double recover_time_;
  double least_difference_;  ///< Of νᵀ S⁻¹ ν.
};

/// A measurement of a pose, as a DelayedFilter takes it.
struct PoseMeasurement {
  std::variant<SeenPose, SeenHeading, SeenLandmark> what;

  PoseOutcome operator()(PoseFilter& filter) const noexcept {
    if (const auto* pose = std::get_if<SeenPose>(&what)) {
      return filter.take(*pose);
    }
    if (const auto* heading = std::get_if<SeenHeading>(&what)) {
      return filter.take(*heading);
    }
    return filter.take(*std::get_if<SeenLandmark>(&what));
  }
};

}  // namespace detail

}  // namespace flyball
