#pragma once

#include <flyball/core/instantiated.hpp>
#include <flyball/core/sizes.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/estimation/update_status.hpp>

namespace flyball {

namespace detail {
struct KalmanFilterDefinitions;  ///< Complete where the .tpp is included.
}

/// The Kalman filter of a discrete plant. Theorem 9.6.3.
///
/// The covariance is carried as P = U D Uᵀ (Bierman and Thornton), so that it is symmetric and
/// positive semidefinite whatever P0, Q and R are to each other: with R > 0 no finite measurement
/// is refused. Correlated noises (R with entries beside the diagonal) are made independent once,
/// and the measurements are then taken one after the other.
///
/// Run-time object: noexcept, bounded, finite whatever comes, and for sizes known at compile time
/// allocation-free. A size that the library does not ship needs
/// <flyball/estimation/kalman_filter.tpp>.
/// Source: book, Theorem 9.6.3; Bierman, "Factorization Methods for Discrete Sequential Estimation"
/// (1977), chapters 5 and 6.
template <int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic, int Outputs = Eigen::Dynamic>
class KalmanFilter {
 public:
  static_assert(detail::has_definitions<detail::KalmanFilterDefinitions, States, Inputs, Outputs>,
                "the library has no code for this size: #include "
                "<flyball/estimation/kalman_filter.tpp> first");

  using Plant = DiscreteSystem<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using StateMatrix = Eigen::Matrix<double, States, States>;
  using OutputMatrix = Eigen::Matrix<double, Outputs, Outputs>;

  /// A filter that starts at x_hat = 0 with the error covariance P0.
  /// @param Q, R  Covariances per sample, n x n and p x p. @param P0  n x n.
  /// @errors ArgumentError for shapes, entries and asymmetry; out_of_range for a covariance that is
  ///         not positive semidefinite or has a variance beyond largest_signal².
  [[nodiscard]] static Expected<KalmanFilter> create(const Plant& plant, const Covariance& Q,
                                                     const Covariance& R, const Covariance& P0);

  /// A filter that starts at x_hat = 0 with the error covariance that it would converge to, so that
  /// its gain is the steady one from the first sample.
  /// @errors as `kalman_gain`.
  [[nodiscard]] static Expected<KalmanFilter> steady_state(const Plant& plant, const Covariance& Q,
                                                           const Covariance& R);

  /// x_hat = A x_hat + B u, P = A P Aᵀ + Q (9.20, 9.21). The factors D of P stay at 1e-200 at
  /// least.
  /// @param u  An input that is not a finite number counts as zero.
  /// @return  Whether u was used and x_hat and P have moved: what would grow beyond
  /// `largest_signal`
  ///          (P: its square) stays where it is.
  bool predict(const InputVector& u) noexcept;
  /// A vector of another size.
  template <class A>
    requires wrong_size<A, InputVector>
  bool predict(const Eigen::MatrixBase<A>&) = delete;

  /// Corrects with a measurement of now (9.22 to 9.24).
  /// @param y  The measurement. @param u  The input at the time of it; only D uses it.
  UpdateStatus update(const OutputVector& y, const InputVector& u) noexcept;
  /// A vector of another size.
  template <class A, class B>
    requires(wrong_size<A, OutputVector> || wrong_size<B, InputVector>)
  UpdateStatus update(const Eigen::MatrixBase<A>&, const Eigen::MatrixBase<B>&) = delete;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const StateMatrix& P() const noexcept { return P_; }
  /// Starts again from x_hat; P stays unless it is given.
  /// @return  Whether they were taken: those that are not finite are not.
  bool reset(const StateVector& x_hat) noexcept;
  /// @param P  Symmetric, positive semidefinite; of another the part that is negative is left out.
  bool reset(const StateVector& x_hat, const StateMatrix& P) noexcept;

 private:
  KalmanFilter(const Plant& plant, const StateMatrix& Q, const OutputMatrix& R,
               const StateMatrix& P);
  /// Takes new factors of P unless a variance is beyond the largest one.
  bool take(const StateMatrix& U, const StateVector& d) noexcept;

  Plant plant_;  ///< C and D of the independent measurements.
  StateMatrix Q_factor_;
  StateVector Q_variance_;
  OutputMatrix R_factor_;
  OutputVector R_variance_;
  bool independent_;  ///< R is diagonal.
  bool feedthrough_;  ///< D is not zero.
  StateVector x_hat_;
  StateMatrix P_;
  StateMatrix U_;
  StateVector d_;
};

/// `KalmanFilter::create` with the sizes of the plant.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<KalmanFilter<States, Inputs, Outputs>> kalman_filter(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Covariance& Q, const Covariance& R,
    const Covariance& P0) {
  return KalmanFilter<States, Inputs, Outputs>::create(plant, Q, R, P0);
}

/// `KalmanFilter::steady_state` with the sizes of the plant.
template <int States, int Inputs, int Outputs>
[[nodiscard]] Expected<KalmanFilter<States, Inputs, Outputs>> kalman_filter(
    const DiscreteSystem<States, Inputs, Outputs>& plant, const Covariance& Q,
    const Covariance& R) {
  return KalmanFilter<States, Inputs, Outputs>::steady_state(plant, Q, R);
}

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  extern template class KalmanFilter<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
