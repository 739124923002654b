#include <flyball/systems/sampling.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flyball {

namespace {

using Complex = std::complex<double>;
constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

Expected<void> check(double frequency, Time period, std::string_view where) {
  return check_all(check_positive(period.si(), where, "period", "s"),
                   check_finite(frequency, where, "frequency"));
}

Expected<void> check(Complex pole, Time period, std::string_view where) {
  return check_all(check_positive(period.si(), where, "period", "s"),
                   check_finite(pole.real(), where, "pole"),
                   check_finite(pole.imag(), where, "pole"));
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
  return check_all(check_positive(period.si(), where, "period", "s"),
                   check_not_negative(frequency, where, "frequency", "rad/s"))
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
  if (auto checked =
          check_all(check_system(plant, where), check_positive(period.si(), where, "period", "s"),
                    check_not_negative(crossover, where, "crossover", "rad/s"));
      !checked) {
    return tl::unexpected(std::move(checked).error());
  }
  const auto found = poles(plant);
  if (!found) {
    return tl::unexpected(found.error());
  }
  const double T = period.si();
  SamplingAnalysis analysis;
  analysis.nyquist_frequency = pi / T;
  analysis.fastest_frequency = found->imag().cwiseAbs().maxCoeff();
  analysis.fastest_rate = found->cwiseAbs().maxCoeff();
  analysis.samples_per_radian = 1.0 / (T * analysis.fastest_rate);
  analysis.sample_delay = 0.5 * T;
  analysis.phase_loss = 0.5 * crossover * T;
  analysis.aliases = analysis.fastest_frequency >= analysis.nyquist_frequency * (1.0 - 1e-12);
  constexpr double close = 1e-9;
  for (Eigen::Index i = 0; i < found->size(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const Complex difference = (*found)(i) - (*found)(j);
      const double turns = difference.imag() * T / (2.0 * pi);
      const double size = std::max(std::abs((*found)(i)), std::abs((*found)(j)));
      analysis.loses_controllability =
          analysis.loses_controllability ||
          (std::abs(difference.real()) <= close * size && std::abs(std::round(turns)) >= 1.0 &&
           std::abs(turns - std::round(turns)) <= close * std::max(1.0, std::abs(turns)));
    }
  }
  return analysis;
}

}  // namespace flyball
