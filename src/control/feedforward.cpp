#include <flyball/control/feedforward.hpp>

#include <cmath>

#include <flyball/control/feedforward.tpp>

namespace flyball {

SimpleFeedforward::SimpleFeedforward(mechanisms::MechanismKind kind,
                                     const mechanisms::FeedforwardGains& gains,
                                     Time period) noexcept
    : kind_(kind), gains_(gains) {
  // A_d = e^{-T kV/kA}; an expm1 keeps 1 - A_d when the period is short.
  const double decay = gains.kA > 0.0 ? period.si() * gains.kV / gains.kA : 0.0;
  next_gain_ = gains.kA > 0.0 ? gains.kV / -std::expm1(-decay) : gains.kV;
  gain_ = gains.kA > 0.0 ? std::exp(-decay) * next_gain_ : 0.0;
}

Expected<SimpleFeedforward> SimpleFeedforward::create(mechanisms::MechanismKind kind,
                                                      const mechanisms::FeedforwardGains& gains,
                                                      Time period) {
  constexpr std::string_view where = "SimpleFeedforward";
  return Checks(where)
      .positive(gains.kV, "kV")
      .not_negative(gains.kS, "kS")
      .not_negative(gains.kA, "kA")
      .finite(gains.kG, "kG")
      .finite(gains.angle_offset, "angle_offset")
      .positive(period.si(), "period", "s")
      .map([&] { return SimpleFeedforward(kind, gains, period); });
}

#define FLYBALL_STATES_INPUTS(States, Inputs) template class LinearPlantInversion<States, Inputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
