#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/estimation/mode_probabilities.hpp>
#include <flyball/estimation/semidefinite_solve.hpp>

namespace flyball {

/// One of the models that may be true.
template <int States, int Inputs, int Outputs>
struct ModelHypothesis {
  DiscreteSystem<States, Inputs, Outputs> plant;
  Covariance Q;   ///< n x n, per sample.
  Covariance R;   ///< p x p, per sample.
  Covariance P0;  ///< n x n.
};

/// A Kalman filter for each of several models on the same data, and which of them is true.
///
/// With the transition I (multiple model adaptive estimation, MMAE) the mode never changes and the
/// filters know nothing of each other. With another (interacting multiple model, IMM) each filter
/// starts each prediction from what all of them say, weighted by where its mode came from:
///
///     x_0j = Σ_i μ_{i|j} x_i,  P_0j = Σ_i μ_{i|j} (P_i + (x_i - x_0j)(x_i - x_0j)ᵀ)
///
/// The estimate is x_hat = Σ μ_j x_j with the covariance Σ μ_j (P_j + (x_j - x_hat)(x_j - x_hat)ᵀ).
///
/// Run-time object: noexcept, bounded, finite whatever comes, and for sizes known at compile time
/// allocation-free.
/// Source: book, section 9.10; Magill, "Optimal adaptive estimation of sampled stochastic
/// processes", IEEE Trans. Automatic Control 10 (1965); Blom and Bar-Shalom, "The interacting
/// multiple model algorithm", IEEE Trans. Automatic Control 33 (1988).
template <int Models, int States = Eigen::Dynamic, int Inputs = Eigen::Dynamic,
          int Outputs = Eigen::Dynamic>
class MultipleModelFilter {
 public:
  using Filter = KalmanFilter<States, Inputs, Outputs>;
  using Modes = ModeProbabilities<Models>;
  using Hypothesis = ModelHypothesis<States, Inputs, Outputs>;
  using StateVector = Eigen::Matrix<double, States, 1>;
  using StateMatrix = Eigen::Matrix<double, States, States>;
  using InputVector = Eigen::Matrix<double, Inputs, 1>;
  using OutputVector = Eigen::Matrix<double, Outputs, 1>;
  using OutputMatrix = Eigen::Matrix<double, Outputs, Outputs>;
  static constexpr auto models = static_cast<std::size_t>(Models);

  /// Filters that start at x_hat = 0, with the modes' probabilities.
  /// @errors As KalmanFilter::create, with the number of the model; ArgumentError::wrong_shape
  /// where
  ///         models have states, inputs or outputs of other numbers than the first.
  [[nodiscard]] static Expected<MultipleModelFilter> create(
      const std::array<Hypothesis, models>& hypotheses, const Modes& modes);

  /// Mixes the filters where modes change, and predicts each (9.20, 9.21).
  /// @return  Whether every filter used u and moved.
  bool predict(const InputVector& u) noexcept;

  /// Corrects each filter (9.22 to 9.24), and the probabilities by log N(y - C x⁻ - D u; 0, CP⁻Cᵀ +
  /// R).
  /// @return  `updated` if any filter has the measurement; otherwise what the first one said.
  UpdateStatus update(const OutputVector& y, const InputVector& u) noexcept;

  [[nodiscard]] const StateVector& x_hat() const noexcept { return x_hat_; }
  [[nodiscard]] const StateMatrix& P() const noexcept { return P_; }
  [[nodiscard]] const Modes& modes() const noexcept { return modes_; }
  /// The filter of a model. @param model  Below Models.
  [[nodiscard]] const Filter& filter(int model) const noexcept {
    return filters_[static_cast<std::size_t>(model)];
  }

  /// Starts all filters again from one estimate; the probabilities stay.
  /// @return  Whether it was taken, as KalmanFilter::reset.
  bool reset(const StateVector& x_hat, const StateMatrix& P) noexcept;

 private:
  MultipleModelFilter(std::array<Filter, models> filters,
                      const std::array<Hypothesis, models>& hypotheses, const Modes& modes);
  void combine() noexcept;

  std::array<Filter, models> filters_;
  std::array<DiscreteSystem<States, Inputs, Outputs>, models> plants_;
  std::array<OutputMatrix, models> R_;
  Modes modes_;
  bool interacting_;
  std::array<StateVector, models> x_;
  std::array<StateMatrix, models> P_of_model_;
  StateVector x_hat_;
  StateMatrix P_;
};

namespace detail {

/// That a model has the sizes of the first one.
[[nodiscard]] Expected<void> check_same_sizes(const MatrixRef& B, const MatrixRef& C,
                                              const MatrixRef& first_B, const MatrixRef& first_C,
                                              std::size_t model);
/// "MultipleModelFilter: model 1: …"
[[nodiscard]] Error in_model(Error error, std::size_t model);

template <class Make, std::size_t... I>
[[nodiscard]] auto array_of(const Make& make, std::index_sequence<I...>) {
  return std::array{make(I)...};
}

}  // namespace detail

template <int Models, int States, int Inputs, int Outputs>
MultipleModelFilter<Models, States, Inputs, Outputs>::MultipleModelFilter(
    std::array<Filter, models> filters, const std::array<Hypothesis, models>& hypotheses,
    const Modes& modes)
    : filters_(std::move(filters)),
      modes_(modes),
      interacting_(!modes.transition().isIdentity(0.0)),
      x_hat_(filters_[0].x_hat()),
      P_(filters_[0].P()) {
  for (std::size_t i = 0; i < models; ++i) {
    plants_[i] = hypotheses[i].plant;
    R_[i] = *hypotheses[i].R.get();
    x_[i] = filters_[i].x_hat();
    P_of_model_[i] = filters_[i].P();
  }
  combine();
}

template <int Models, int States, int Inputs, int Outputs>
auto MultipleModelFilter<Models, States, Inputs, Outputs>::create(
    const std::array<Hypothesis, models>& hypotheses, const Modes& modes)
    -> Expected<MultipleModelFilter> {
  const auto make = [&](std::size_t i) {
    const Hypothesis& of = hypotheses[i];
    return Filter::create(of.plant, of.Q, of.R, of.P0);
  };
  auto filters = detail::array_of(make, std::make_index_sequence<models>());
  for (std::size_t i = 0; i < models; ++i) {
    if (!filters[i]) {
      return tl::unexpected(detail::in_model(filters[i].error(), i));
    }
    const auto& plant = hypotheses[i].plant;
    const auto& first = hypotheses[0].plant;
    if (auto same = detail::check_same_sizes(plant.B, plant.C, first.B, first.C, i); !same) {
      return tl::unexpected(same.error());
    }
  }
  return MultipleModelFilter(detail::array_of([&](std::size_t i) { return *filters[i]; },
                                              std::make_index_sequence<models>()),
                             hypotheses, modes);
}

template <int Models, int States, int Inputs, int Outputs>
void MultipleModelFilter<Models, States, Inputs, Outputs>::combine() noexcept {
  for (std::size_t i = 0; i < models; ++i) {
    x_[i] = filters_[i].x_hat();
    P_of_model_[i] = filters_[i].P();
  }
  match_moments(modes_.probabilities(), x_, P_of_model_, x_hat_, P_);
}

template <int Models, int States, int Inputs, int Outputs>
bool MultipleModelFilter<Models, States, Inputs, Outputs>::predict(const InputVector& u) noexcept {
  const auto mixing = modes_.predict();
  if (interacting_) {
    for (std::size_t j = 0; j < models; ++j) {
      match_moments(mixing.col(static_cast<Eigen::Index>(j)), x_, P_of_model_, x_hat_, P_);
      filters_[j].reset(x_hat_, P_);
    }
  }
  bool moved = true;
  for (Filter& filter : filters_) {
    moved = filter.predict(u) & moved;
  }
  combine();
  return moved;
}

template <int Models, int States, int Inputs, int Outputs>
UpdateStatus MultipleModelFilter<Models, States, Inputs, Outputs>::update(
    const OutputVector& y, const InputVector& u) noexcept {
  typename Modes::Vector log_likelihoods;
  UpdateStatus status = UpdateStatus::updated;
  bool any = false;
  for (std::size_t i = 0; i < models; ++i) {
    const auto& plant = plants_[i];
    OutputVector innovation = y;
    innovation.noalias() -= plant.C * x_[i];
    innovation.noalias() -= plant.D * u;
    Eigen::Matrix<double, Outputs, States> CP = plant.C;
    CP.noalias() = plant.C * P_of_model_[i];
    OutputMatrix S = R_[i];
    S.noalias() += CP * plant.C.transpose();
    const auto model = static_cast<Eigen::Index>(i);
    log_likelihoods(model) = detail::log_normal_density(innovation, S);
    const UpdateStatus of_model = filters_[i].update(y, u);
    if (of_model != UpdateStatus::updated) {
      log_likelihoods(model) = -std::numeric_limits<double>::infinity();
      status = i == 0 ? of_model : status;
    } else {
      any = true;
    }
  }
  if (any) {
    modes_.update(log_likelihoods);
    combine();
  }
  return any ? UpdateStatus::updated : status;
}

template <int Models, int States, int Inputs, int Outputs>
bool MultipleModelFilter<Models, States, Inputs, Outputs>::reset(const StateVector& x_hat,
                                                                 const StateMatrix& P) noexcept {
  bool taken = true;
  for (Filter& filter : filters_) {
    taken = filter.reset(x_hat, P) & taken;
  }
  combine();
  return taken;
}

}  // namespace flyball
