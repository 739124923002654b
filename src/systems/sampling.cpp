#include <flyball/systems/sampling.hpp>

#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;

Expected<void> check(double frequency, Time period, std::string_view where) {
  return Checks(where).positive(period.si(), "period", "s").finite(frequency, "frequency");
}

Expected<void> check(Complex pole, Time period, std::string_view where) {
  return Checks(where)
      .positive(period.si(), "period", "s")
      .finite(pole.real(), "pole")
      .finite(pole.imag(), "pole");
}

}  // namespace

Expected<double> nyquist_frequency(Time period) {
  return check_positive(period.si(), "nyquist_frequency", "period", "s").map([&] {
    return pi / period.si();
  });
}

Expected<double> alias_frequency(double frequency, Time period) {
  return check(frequency, period, "alias_frequency").map([&] {
    return std::abs(std::remainder(frequency, 2.0 * pi / period.si()));
  });
}

Expected<double> sample_delay_phase_loss(double frequency, Time period) {
  constexpr std::string_view where = "sample_delay_phase_loss";
  return Checks(where)
      .positive(period.si(), "period", "s")
      .not_negative(frequency, "frequency", "rad/s")
      .map([&] { return 0.5 * frequency * period.si(); });
}

Expected<Complex> discrete_pole(Complex s, Time period) {
  return check(s, period, "discrete_pole").map([&] { return std::exp(s * period.si()); });
}

Expected<Complex> continuous_pole(Complex z, Time period) {
  return check(z, period, "continuous_pole").map([&] {
    return z == 0.0 ? Complex(-infinity, 0.0) : std::log(z) / period.si();
  });
}

Expected<SamplingAnalysis> analyze_sampling(const ContinuousSystem<>& plant, Time period,
                                            double crossover) {
  constexpr std::string_view where = "analyze_sampling";
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_system(plant, where); })
                    .positive(period.si(), "period", "s")
                    .not_negative(crossover, "crossover", "rad/s"));
  FLYBALL_TRY(const auto found, poles(plant));
  const double T = period.si();
  SamplingAnalysis analysis;
  analysis.nyquist_frequency = pi / T;
  analysis.fastest_frequency = found.imag().cwiseAbs().maxCoeff();
  analysis.fastest_rate = found.cwiseAbs().maxCoeff();
  analysis.samples_per_radian = 1.0 / (T * analysis.fastest_rate);
  analysis.sample_delay = 0.5 * T;
  analysis.phase_loss = 0.5 * crossover * T;
  analysis.aliases = analysis.fastest_frequency >= analysis.nyquist_frequency * (1.0 - 1e-12);
  constexpr double close = 1e-9;
  for (Eigen::Index i = 0; i < found.size(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const Complex difference = found(i) - found(j);
      const double turns = difference.imag() * T / (2.0 * pi);
      const double size = std::max(std::abs(found(i)), std::abs(found(j)));
      analysis.loses_controllability =
          analysis.loses_controllability ||
          (std::abs(difference.real()) <= close * size && std::abs(std::round(turns)) >= 1.0 &&
           std::abs(turns - std::round(turns)) <= close * std::max(1.0, std::abs(turns)));
    }
  }
  return analysis;
}

}  // namespace flyball
