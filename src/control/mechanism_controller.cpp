#include <flyball/control/mechanism_controller.hpp>

#include <cmath>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_mechanism_controller = "MechanismController";

// @param wanted  The states of the class that is asked; two when it was not said.
Expected<void> check_states(const MechanismControllerDesign& design, Eigen::Index wanted) {
  const bool flywheel = controls_velocity(design.kind);
  const Eigen::Index n = design.plant.A.rows();
  if (n == wanted && !(flywheel && n == 2)) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, in_mechanism_controller, "the plant")
      .got(n == 1 ? std::string("of one state") : detail::format("of {} states", n))
      .expected(flywheel      ? "of one state, the velocity"
                : wanted == 1 ? "of one state, the position"
                : n == 1      ? "of two states, position and velocity"
                              : "of one state, the position, or of two, position and velocity");
}

// The measurement is of the first state: what the plant's C and D have to say.
Expected<void> check_output(const DiscreteSystem<>& plant) {
  const Eigen::RowVectorXd first = Eigen::RowVectorXd::Unit(plant.A.rows(), 0);
  if (plant.C == first && plant.D.isZero(0.0)) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, in_mechanism_controller, "the plant's output")
      .got("a mixture of its states and input")
      .expected("its first state: C = [1 0], D = 0");
}

}  // namespace

mechanisms::FeedforwardGains MechanismControllerDesign::fed_forward() const noexcept {
  mechanisms::FeedforwardGains fed = gains;
  fed.kG = feed_forward_gravity ? gains.kG : 0.0;
  fed.kS = feed_forward_friction ? gains.kS : 0.0;
  return fed;
}

template <int States>
MechanismController<States>::MechanismController(const MechanismControllerDesign& design,
                                                 const Regulator& regulator,
                                                 const SimpleFeedforward& feedforward)
    : regulator_(regulator),
      feedforward_(feedforward),
      compensation_(design.nominal_voltage),
      max_voltage_(design.max_voltage),
      period_(design.plant.period.si()),
      delay_(design.predicts_with ? 0.0 : design.measurement_delay.si()),
      compensates_(design.compensate_voltage) {}

template <int States>
auto MechanismController<States>::create(const MechanismControllerDesign& design)
    -> Expected<MechanismController> {
  const DiscreteSystem<>& plant = design.plant;
  FLYBALL_CHECK(check_states(design, States));
  FLYBALL_CHECK(check_system(plant, in_mechanism_controller));
  FLYBALL_CHECK(Checks(in_mechanism_controller)
                    .shape(plant.B, States, 1, "the plant's B", "states x 1 input")
                    .shape(plant.C, 1, States, "the plant's C", "1 output x states")
                    .also([&] { return check_output(plant); })
                    .shape(design.K, 1, States, "K", "1 input x states")
                    .shape(design.K_e, States, 1, "K_e", "states x 1 output")
                    .positive(design.max_voltage, "max_voltage", "V")
                    .positive(design.nominal_voltage, "nominal_voltage", "V")
                    .not_negative(design.measurement_delay.si(), "measurement_delay", "s"));
  FLYBALL_TRY(auto regulator, regulator_of(design));
  FLYBALL_TRY(auto feedforward,
              SimpleFeedforward::create(design.kind, design.fed_forward(), plant.period));
  return MechanismController(design, regulator, feedforward);
}

template <int States>
auto MechanismController<States>::regulator_of(const MechanismControllerDesign& design)
    -> Expected<Regulator> {
  using Limit = typename Prompt::InputVector;
  const typename Prompt::Plant plant{design.plant.A, design.plant.B, design.plant.C, design.plant.D,
                                     design.plant.period};
  const Limit most(design.max_voltage);
  if (!design.predicts_with) {
    FLYBALL_TRY(auto prompt, Prompt::create(plant, design.K, design.K_e, -most, most));
    return Regulator(prompt);
  }
  const ContinuousSystem<>& model = *design.predicts_with;
  FLYBALL_CHECK(Checks(in_mechanism_controller)
                    .shape(model.A, States, States, "predicts_with's A", "of the plant's states")
                    .shape(model.B, States, 1, "predicts_with's B", "states x 1 input"));
  FLYBALL_TRY(const auto predictor,
              Predicting::Predictor::create(
                  ContinuousSystem<States, 1, 1>{model.A, model.B, plant.C, plant.D}, plant.period,
                  design.measurement_delay));
  FLYBALL_TRY(auto predicting,
              Predicting::create(plant, predictor, design.K, design.K_e, -most, most));
  return Regulator(predicting);
}

template <int States>
auto MechanismController<States>::states_of(const MotionState& motion) const noexcept
    -> StateVector {
  if constexpr (States == 1) {
    return StateVector(controls_velocity(feedforward_.kind()) ? motion.velocity : motion.position);
  } else {
    return StateVector(motion.position, motion.velocity);
  }
}

template <int States>
double MechanismController<States>::update(double measurement, const MotionState& r,
                                           const MotionState& r_next,
                                           double rail_voltage) noexcept {
  using Scalar = Eigen::Matrix<double, 1, 1>;
  const bool flywheel = controls_velocity(feedforward_.kind());
  const double rate = flywheel ? (r_next.velocity - r.velocity) / period_ : r.velocity;
  const double y = delay_ > 0.0 ? measurement + delay_ * rate : measurement;
  const double direction = r.velocity != 0.0 ? r.velocity : r_next.velocity;
  const double extra = feedforward_.disturbance(r.position, direction);
  const double rail =
      compensates_ ? compensation_.rail(rail_voltage) : compensation_.nominal_voltage();
  const StateVector now = states_of(r);
  const StateVector next = states_of(r_next);
  if (auto* prompt = std::get_if<Prompt>(&regulator_)) {
    voltage_ = prompt->step(now, next, Scalar(y), Scalar(extra), rail)(0);
  } else if (auto* predicting = std::get_if<Predicting>(&regulator_)) {
    voltage_ = predicting->step(now, next, Scalar(y), Scalar(extra), rail)(0);
  }
  command_ = compensates_ ? compensation_.command(voltage_, rail) : voltage_;
  limit_ = max_voltage_ < rail ? max_voltage_ : rail;
  return voltage_;
}

template <int States>
void MechanismController<States>::reset(const MotionState& state) noexcept {
  std::visit([&](auto& regulator) { regulator.reset(states_of(state)); }, regulator_);
  voltage_ = 0.0;
  command_ = 0.0;
}

template class MechanismController<1>;
template class MechanismController<2>;

auto MechanismController<Eigen::Dynamic>::create(const MechanismControllerDesign& design)
    -> Expected<MechanismController> {
  if (design.plant.A.rows() == 1) {
    return MechanismController<1>::create(design).map(
        [](const auto& sized) { return MechanismController(sized); });
  }
  return MechanismController<2>::create(design).map(
      [](const auto& sized) { return MechanismController(sized); });
}

double MechanismController<Eigen::Dynamic>::update(double measurement, const MotionState& r,
                                                   const MotionState& r_next,
                                                   double rail_voltage) noexcept {
  return std::visit([&](auto& sized) { return sized.update(measurement, r, r_next, rail_voltage); },
                    sized_);
}

void MechanismController<Eigen::Dynamic>::reset(const MotionState& state) noexcept {
  std::visit([&](auto& sized) { sized.reset(state); }, sized_);
}

bool MechanismController<Eigen::Dynamic>::measured() const noexcept {
  return std::visit([](const auto& sized) { return sized.measured(); }, sized_);
}

double MechanismController<Eigen::Dynamic>::voltage() const noexcept {
  return std::visit([](const auto& sized) { return sized.voltage(); }, sized_);
}

double MechanismController<Eigen::Dynamic>::command() const noexcept {
  return std::visit([](const auto& sized) { return sized.command(); }, sized_);
}

double MechanismController<Eigen::Dynamic>::limit() const noexcept {
  return std::visit([](const auto& sized) { return sized.limit(); }, sized_);
}

Eigen::Map<const Eigen::VectorXd> MechanismController<Eigen::Dynamic>::x_hat() const noexcept {
  return std::visit(
      [](const auto& sized) {
        return Eigen::Map<const Eigen::VectorXd>(sized.x_hat().data(), sized.x_hat().size());
      },
      sized_);
}

Eigen::Map<const Eigen::RowVectorXd> MechanismController<Eigen::Dynamic>::B_pinv() const noexcept {
  return std::visit(
      [](const auto& sized) {
        const auto& B_pinv = sized.B_pinv();
        return Eigen::Map<const Eigen::RowVectorXd>(B_pinv.data(), B_pinv.size());
      },
      sized_);
}

}  // namespace flyball
