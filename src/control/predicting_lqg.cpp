#include <flyball/control/predicting_lqg.hpp>

#include <algorithm>

#include <flyball/control/lqg.tpp>

#include "core/try.hpp"

namespace flyball {

template <int States, int Inputs, int Outputs>
PredictingLqg<States, Inputs, Outputs>::PredictingLqg(
    const LateObserver& observer, const Predictor& predictor,
    const StateFeedback<States, Inputs>& feedback,
    const LinearPlantInversion<States, Inputs>& inversion)
    : observer_(observer),
      predictor_(predictor),
      feedback_(feedback),
      inversion_(inversion),
      arriving_(LateObserver::InputVector::Zero(observer.plant().B.cols())),
      x_hat_(observer.x_hat()) {}

template <int States, int Inputs, int Outputs>
auto PredictingLqg<States, Inputs, Outputs>::create(const Plant& plant, const Predictor& predictor,
                                                    const FeedbackGain& K, const EstimatorGain& K_e,
                                                    const InputVector& u_min,
                                                    const InputVector& u_max)
    -> Expected<PredictingLqg> {
  constexpr std::string_view where = "PredictingLqg";
  FLYBALL_CHECK(
      detail::check_lqg(plant.A, plant.B, plant.C, plant.D, plant.period, K, K_e, u_min, u_max));
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index m = plant.B.cols();
  FLYBALL_CHECK(Checks(where)
                    .shape(predictor.A(), n, n, "the predictor's A", "states x states")
                    .shape(predictor.B_0(), n, m, "the predictor's B_0", "states x inputs"));
  if (!plant.D.isZero(0.0)) {
    return refusal(ArgumentError::out_of_range, where, "the plant's D")
        .got("not zero")
        .expected("zero: a measurement that contains the input closes a second loop");
  }
  FLYBALL_TRY(auto inversion, linear_plant_inversion(plant));
  typename LateObserver::Plant late{predictor.A(), {}, plant.C, {}, plant.period};
  late.B.resize(n, 2 * m);
  late.B << predictor.B_0(), predictor.B_1();
  late.D.setZero(plant.C.rows(), 2 * m);
  return PredictingLqg(LateObserver(late, K_e), predictor, {K, u_min, u_max}, inversion);
}

template <int States, int Inputs, int Outputs>
auto PredictingLqg<States, Inputs, Outputs>::step(const StateVector& r, const StateVector& r_next,
                                                  const OutputVector& y, const InputVector& extra,
                                                  double rail_voltage) noexcept -> InputVector {
  const Eigen::Index m = extra.size();
  observer_.predict(arriving_);
  measured_ = observer_.update(y, arriving_);
  x_hat_ = predictor_.predict(observer_.x_hat());
  InputVector apart = extra;
  detail::keep_signals(apart);
  const InputVector u_ff = inversion_.calculate(r, r_next) + apart;
  InputVector u = feedback_.calculate(x_hat_, r, u_ff);
  if (rail_voltage > 0.0) {
    for (Eigen::Index i = 0; i < m; ++i) {
      u(i) = std::clamp(u(i), -rail_voltage, rail_voltage);
    }
  }
  arriving_.tail(m) = predictor_.oldest();
  predictor_.sent(u - apart);
  arriving_.head(m) = predictor_.oldest();
  return u;
}

template <int States, int Inputs, int Outputs>
bool PredictingLqg<States, Inputs, Outputs>::reset(const StateVector& x_hat) noexcept {
  predictor_.reset();
  arriving_.setZero();
  const bool taken = observer_.reset(x_hat);
  x_hat_ = observer_.x_hat();
  return taken;
}

template class PredictingLqg<1, 1, 1>;
template class PredictingLqg<2, 1, 1>;
template class PredictingLqg<>;

}  // namespace flyball
