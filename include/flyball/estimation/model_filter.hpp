#pragma once

#include <concepts>
#include <utility>
#include <variant>

#include <flyball/estimation/extended.hpp>
#include <flyball/estimation/filter_model.hpp>
#include <flyball/estimation/state_limits.hpp>
#include <flyball/systems/discretize.hpp>

namespace flyball {

/// What disturbs a model's states: a covariance per sample, or a spectral density, which a filter
/// integrates over each of its steps.
class ProcessNoise {
 public:
  // NOLINTBEGIN(google-explicit-constructor): being implicit is its purpose.
  /// A covariance per sample.
  template <std::convertible_to<Covariance> C>
  ProcessNoise(C&& covariance) : value_(Covariance(std::forward<C>(covariance))) {}
  /// A spectral density.
  ProcessNoise(ProcessDensity density) : value_(std::move(density)) {}
  // NOLINTEND(google-explicit-constructor)

  [[nodiscard]] bool is_density() const noexcept {
    return std::holds_alternative<ProcessDensity>(value_);
  }
  /// The matrix, or the error of its maker.
  [[nodiscard]] Expected<Eigen::MatrixXd> matrix() const {
    return is_density() ? Expected<Eigen::MatrixXd>(std::get<ProcessDensity>(value_).Q)
                        : std::get<Covariance>(value_).get();
  }

 private:
  std::variant<Covariance, ProcessDensity> value_;
};

/// How a ModelFilter starts.
template <int States>
struct FilterStart {
  Eigen::Matrix<double, States, 1> x_hat;  ///< n x 1
  Covariance P;                            ///< n x n, of its error.
};

namespace detail {

/// What ModelFilter::create asks of its arguments beyond R and P.
[[nodiscard]] Expected<void> check_model_filter(const MatrixRef& Q, const MatrixRef& x_hat,
                                                Eigen::Index states, Eigen::Index inputs,
                                                Eigen::Index outputs, Eigen::Index noise_rows,
                                                const Eigen::MatrixXd* input_noise, Time period);

}  // namespace detail

/// A Kalman filter of any model: of the house (`derivative(x, u)` over a generic scalar, stepped by
/// RK4), of one's own with `next(x, u, dt)`, or a DiscreteSystem. `ExtendedKalmanFilter`,
/// `UnscentedKalmanFilter` and `SquareRootUnscentedKalmanFilter` are this class with the method of
/// their name.
///
/// Run-time object: noexcept, bounded, finite whatever comes, and for sizes known at compile time
/// allocation-free (where the model is). Measurements may come in any number, at any rate and
/// before the first prediction; those of another kind than the model's output bring their own h and
/// R. Source: book, sections 9.6, 9.8 and 9.9.
template <class M, class CovarianceForm, class FilterMethod>
class ModelFilter {
 public:
  static constexpr int states = FilterModel<M>::states;
  static constexpr int inputs = FilterModel<M>::inputs;
  using StateVector = Eigen::Matrix<double, states, 1>;
  using InputVector = Eigen::Matrix<double, inputs, 1>;
  using OutputVector =
      decltype(FilterModel<M>::output(std::declval<const M&>(), std::declval<const StateVector&>(),
                                      std::declval<const InputVector&>()));
  static constexpr int outputs = OutputVector::RowsAtCompileTime;
  using StateMatrix = Eigen::Matrix<double, states, states>;
  using InputMatrix = Eigen::Matrix<double, inputs, inputs>;
  using Method = FilterMethod;
  using EstimateType = Estimate<StateVector, CovarianceForm>;

  /// @param model  The model, which is copied.
  /// @param Q  n x n, what disturbs the states: a covariance per sample of `period`, or a
  ///           ProcessDensity. A step of another length takes its share of the covariance.
  /// @param R  p x p, the output's noise, a covariance per sample.
  /// @param start  x_hat and P. @param period  s, between two predictions; of a DiscreteSystem its
  ///               own.
  /// @param input_noise  m x m, the covariance of the input's error, a new one each sample; empty:
  ///               none.
  /// @errors  Those of the covariances' makers; ArgumentError for shapes, entries, asymmetry, a
  ///          covariance that is none and a period that is not positive.
  [[nodiscard]] static Expected<ModelFilter> create(const M& model, const ProcessNoise& Q,
                                                    const Covariance& R,
                                                    const FilterStart<states>& start, Time period,
                                                    const Covariance& input_noise = no_matrix(),
                                                    const Method& method = {}) {
    const auto of_states = Q.matrix();
    const auto& of_inputs = input_noise.get();
    if (!of_states || !of_inputs) {
      return tl::unexpected(of_states ? of_inputs.error() : of_states.error());
    }
    return EstimateType::create(start.x_hat, start.P).and_then([&](const EstimateType& estimate) {
      return MeasurementNoise<outputs>::create(R).and_then(
          [&](const MeasurementNoise<outputs>& noise) -> Expected<ModelFilter> {
            const Eigen::Index n = FilterModel<M>::state_count(model);
            const Eigen::Index m = FilterModel<M>::input_count(model);
            if (auto checked = detail::check_model_filter(
                    *of_states, start.x_hat, n, m, output_size(model, n, m), noise.size(),
                    of_inputs->size() == 0 ? nullptr : &*of_inputs, period);
                !checked) {
              return tl::unexpected(checked.error());
            }
            return ModelFilter(model, *of_states, Q.is_density(), noise, estimate, period,
                               *of_inputs, method);
          });
    });
  }

  /// x_hat and P one period on. @param u  m x 1, held over the period; what is not a finite number
  /// counts as zero. @return  As Estimate::predict; false too where u was not used.
  bool predict(const InputVector& u) noexcept { return predict(u, period_); }
  /// The same after another time. @param dt  s, not negative; other values do nothing.
  bool predict(const InputVector& u, double dt) noexcept {
    if (!(dt >= 0.0) || !is_signal(dt)) {
      return false;
    }
    InputVector known = u;
    detail::keep_signals(known);
    const detail::ModelStep<M> step{model_, known, dt};
    if (constant_noise_ && dt == period_) {
      return method_.predict(estimate_, step, Q_, &F_) && is_signal(u);
    }
    const StateVector x = estimate_.x_hat();
    const auto noise = [&](const StateMatrix& F) noexcept {
      return typename CovarianceForm::Noise(noise_over(x, known, F, dt));
    };
    return method_.predict(estimate_, step, noise, &F_) && is_signal(u);
  }

  /// Corrects with the model's output. @param y  p x 1. @param u  m x 1, the input at the time of
  /// it, where the output depends on it.
  Correction<outputs> correct(const OutputVector& y, const InputVector& u,
                              const CorrectionOptions& options = {}) noexcept {
    return correct(y, u, R_, options);
  }
  /// The same with a noise of its own.
  Correction<outputs> correct(const OutputVector& y, const InputVector& u,
                              const MeasurementNoise<outputs>& R,
                              const CorrectionOptions& options = {}) noexcept {
    const auto subtract = [this](const OutputVector& a, const OutputVector& b) {
      OutputVector difference = a - b;
      if (has_angles_) {
        for (Eigen::Index i = 0; i < difference.size(); ++i) {
          difference(i) =
              is_angle_(i) ? angle_difference(double(difference(i)), 0.0) : difference(i);
        }
      }
      return difference;
    };
    return method_.correct(estimate_, y, detail::ModelOutput<M>{model_, u}, R, options, subtract);
  }
  /// Corrects with any other measurement y = h(x) ⊕ v.
  /// @param h  h(x), over a generic scalar. @param subtract  As Extended::correct.
  template <Manifold Y, class H, class Subtract = Difference>
  Correction<tangent_size<Y>> correct(const Y& y, const H& h,
                                      const MeasurementNoise<tangent_size<Y>>& R,
                                      const CorrectionOptions& options = {},
                                      const Subtract& subtract = {}) noexcept
    requires std::invocable<const H&, const StateVector&>
  {
    return method_.correct(estimate_, y, h, R, options, subtract);
  }

  /// Cuts the estimate off where a state leaves its limits; as `truncate` of state_limits.hpp.
  /// @param state  Its number. @param lower, upper  In its unit; either may be infinite.
  bool limit(Eigen::Index state, double lower, double upper) noexcept {
    return limit_state(estimate_, state, lower, upper);
  }

  [[nodiscard]] const StateVector& x_hat() const noexcept { return estimate_.x_hat(); }
  [[nodiscard]] decltype(auto) P() const noexcept { return estimate_.P(); }
  [[nodiscard]] const EstimateType& estimate() const noexcept { return estimate_; }
  /// Goes on from an estimate of before, or from one that is changed.
  void restore(const EstimateType& estimate) noexcept { estimate_ = estimate; }
  /// As Estimate::reset.
  bool reset(const StateVector& x_hat) noexcept { return estimate_.reset(x_hat); }
  bool reset(const StateVector& x_hat, const StateMatrix& P) noexcept {
    return estimate_.reset(x_hat, P);
  }
  /// The transition matrix of the last prediction (of an unscented filter, the one that its points
  /// show): cov(x⁺, x) = F P, what smoothers need.
  [[nodiscard]] const StateMatrix& F() const noexcept { return F_; }
  [[nodiscard]] const M& model() const noexcept { return model_; }
  [[nodiscard]] const MeasurementNoise<outputs>& R() const noexcept { return R_; }
  [[nodiscard]] double period() const noexcept { return period_; }
  [[nodiscard]] const Method& method() const noexcept { return method_; }

 private:
  ModelFilter(const M& model, const StateMatrix& Q, bool is_density,
              const MeasurementNoise<outputs>& R, const EstimateType& estimate, Time period,
              const Eigen::MatrixXd& input_noise, const Method& method)
      : model_(model),
        method_(method),
        estimate_(estimate),
        R_(R),
        Q_matrix_(Q),
        Q_(Q),
        is_density_(is_density),
        constant_noise_(!is_density && input_noise.size() == 0),
        has_input_noise_(input_noise.size() != 0),
        period_(period.si()) {
    if (has_input_noise_) {
      input_noise_ = input_noise;
    }
    const auto coordinates = FilterModel<M>::outputs(model);
    is_angle_.setConstant(R.size(), false);
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      is_angle_(static_cast<Eigen::Index>(i)) = coordinates[i].is_angle;
      has_angles_ = has_angles_ || coordinates[i].is_angle;
    }
    const Eigen::Index n = Q_matrix_.rows();
    F_.setIdentity(n, n);
  }

  static Covariance no_matrix() { return Covariance(Eigen::MatrixXd(0, 0)); }
  static Eigen::Index output_size(const M& model, Eigen::Index n, Eigen::Index m) {
    return FilterModel<M>::output(model, StateVector(StateVector::Zero(n)),
                                  InputVector(InputVector::Zero(m)))
        .size();
  }

  /// The noise of a step of another length, or that of a density, and what the input adds.
  [[nodiscard]] StateMatrix noise_over(const StateVector& x, const InputVector& u,
                                       const StateMatrix& F, double dt) const noexcept {
    StateMatrix Q = Q_matrix_ * (is_density_ ? dt : dt / period_);
    if (is_density_) {
      // Simpson's rule for ∫ Φ Q Φᵀ (7.8), with Φ(dt/2) = √F to third order.
      const Eigen::Index n = F.rows();
      const StateMatrix E = F - StateMatrix::Identity(n, n);
      const StateMatrix half = StateMatrix::Identity(n, n) + 0.5 * E - 0.125 * E.lazyProduct(E);
      const StateMatrix of_half = half.lazyProduct(Q_matrix_);
      const StateMatrix of_whole = F.lazyProduct(Q_matrix_);
      Q = (dt / 6.0) * (Q_matrix_ + 4.0 * of_half.lazyProduct(half.transpose()) +
                        of_whole.lazyProduct(F.transpose()));
    }
    if (has_input_noise_) {
      Eigen::Matrix<double, states, inputs> G(x.size(), u.size());
      if constexpr (detail::HasJacobians<M>) {
        StateVector next = x;
        StateMatrix by_x = F;
        detail::rk4_with_jacobians(model_, x, u, dt, next, by_x, &G);
      } else {
        using T = Dual<inputs>;
        Eigen::Matrix<T, inputs, 1> varied(u.size());
        for (Eigen::Index i = 0; i < u.size(); ++i) {
          varied(i) = T::variable(u(i), i, u.size());
        }
        const Eigen::Matrix<T, states, 1> start = x.template cast<T>();
        detail::read_gradients(
            Eigen::Matrix<T, states, 1>(FilterModel<M>::next(model_, start, varied, dt)), G);
      }
      const Eigen::Matrix<double, states, inputs> GU = G.lazyProduct(input_noise_);
      Q += GU.lazyProduct(G.transpose());
    }
    return Q;
  }

  M model_;
  Method method_;
  EstimateType estimate_;
  MeasurementNoise<outputs> R_;
  StateMatrix Q_matrix_;
  typename CovarianceForm::Noise Q_;
  InputMatrix input_noise_;
  StateMatrix F_;
  Eigen::Matrix<bool, outputs, 1> is_angle_;
  bool has_angles_ = false;
  bool is_density_;
  bool constant_noise_;
  bool has_input_noise_;
  double period_;
};

/// The extended Kalman filter (Theorem 9.8.1, Table 9.3). The Jacobians are exact: those of the RK4
/// step itself, by dual numbers, or by the variational equation where the model has its own.
template <class M, class Form = JosephCovariance<FilterModel<M>::states>>
using ExtendedKalmanFilter = ModelFilter<M, Form, Extended>;

}  // namespace flyball
