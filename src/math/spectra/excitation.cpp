#include <flyball/math/spectra/excitation.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include <flyball/core/argument.hpp>
#include <flyball/core/random.hpp>
#include <flyball/math/spectra/fft.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index most_samples = 100'000'000;
constexpr Index finest_grid = 16;             // points in a turn of the last harmonic
constexpr Index most_work = Index{1} << 25U;  // samples that the search of phases goes through

Expected<void> check_band(double frequency, Time period, std::string_view where,
                          std::string_view name) {
  FLYBALL_CHECK(
      Checks(where).positive(period.si(), "period", "s").positive(frequency, name, "rad/s"));
  if (frequency * period.si() >= std::numbers::pi) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(detail::format("{:.6g} rad/s", frequency))
        .expected(detail::format("below half the sample rate, {:.6g} rad/s",
                                 std::numbers::pi / period.si()));
  }
  return {};
}

Expected<void> check_count(Index value, Index low, Index high, std::string_view where,
                           std::string_view name) {
  if (value < low || value > high) {
    return refusal(ArgumentError::out_of_range, where, name)
        .got(std::to_string(value))
        .expected(detail::format("from {} to {}", low, high));
  }
  return {};
}

}  // namespace

Expected<VectorXd> chirp(Index samples, Time period, double first, double last, double amplitude,
                         ChirpShape shape) {
  constexpr std::string_view where = "chirp";
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_count(samples, 2, most_samples, where, "samples"); })
                    .also([&] { return check_band(first, period, where, "first"); })
                    .also([&] { return check_band(last, period, where, "last"); })
                    .positive(amplitude, "amplitude"));
  const double duration = static_cast<double>(samples) * period.si();
  const double rate = std::log(last / first) / duration;
  VectorXd u(samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * period.si();
    // The phase is the integral of ω: ω₁t + (ω₂ - ω₁)t²/2D, or ω₁(e^{rt} - 1)/r.
    const double phase = shape == ChirpShape::linear || std::abs(rate * duration) < 1e-9
                             ? first * t + 0.5 * (last - first) * t * t / duration
                             : first * std::expm1(rate * t) / rate;
    u(k) = amplitude * std::sin(phase);
  }
  return u;
}

Expected<SteppedSine> stepped_sine(const VectorXd& frequencies, Time period, int turns,
                                   double amplitude) {
  constexpr std::string_view where = "stepped_sine";
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_count(turns, 2, 1'000'000, where, "turns"); })
                    .positive(amplitude, "amplitude"));
  if (frequencies.size() == 0) {
    return refusal(ArgumentError::empty, where, "frequencies").expected("at least one");
  }
  SteppedSine signal;
  double samples = 0.0;
  for (const double frequency : frequencies) {
    FLYBALL_CHECK(check_band(frequency, period, where, "a frequency"));
    const double needed = std::round(2.0 * std::numbers::pi * turns / (frequency * period.si()));
    samples += needed;
    if (samples > static_cast<double>(most_samples)) {
      return refusal(ArgumentError::out_of_range, where, "the signal")
          .got("longer than 100 000 000 samples")
          .expected("shorter");
    }
    const Index first =
        signal.steps.empty() ? 0 : signal.steps.back().first + signal.steps.back().samples;
    signal.steps.push_back({frequency, first, static_cast<Index>(needed)});
  }
  signal.u.resize(static_cast<Index>(samples));
  for (const SteppedSine::Step& step : signal.steps) {
    for (Index k = 0; k < step.samples; ++k) {
      signal.u(step.first + k) =
          amplitude * std::sin(step.frequency * period.si() * static_cast<double>(k));
    }
  }
  return signal;
}

Expected<double> crest_factor(const VectorXd& u) {
  constexpr std::string_view where = "crest_factor";
  FLYBALL_CHECK(check_finite(u, where, "u"));
  if (u.size() == 0) {
    return refusal(ArgumentError::empty, where, "u").expected("samples");
  }
  const double peak = u.cwiseAbs().maxCoeff();
  if (peak == 0.0) {
    return refusal(ArgumentError::malformed, where, "u").got("zero").expected("a signal");
  }
  return 1.0 / std::sqrt((u / peak).squaredNorm() / static_cast<double>(u.size()));
}

Expected<Multisine> multisine(Index samples, const Harmonics& harmonics, double amplitude,
                              std::uint64_t seed) {
  constexpr std::string_view where = "multisine";
  FLYBALL_CHECK(
      Checks(where)
          .also([&] { return check_count(samples, 4, Index{1} << 24, where, "samples"); })
          .also([&] {
            return check_count(harmonics.first, 1, (samples - 1) / 2, where, "the first harmonic");
          })
          .also([&] {
            return check_count(harmonics.last, harmonics.first, (samples - 1) / 2, where,
                               "the last harmonic");
          })
          .also([&] { return check_count(harmonics.step, 1, samples, where, "the step"); })
          .positive(amplitude, "amplitude"));
  std::vector<Index> lines;
  for (Index k = harmonics.first; k <= harmonics.last; k += harmonics.step) {
    lines.push_back(k);
  }
  // Harmonics far below half the samples are smooth between those of a coarser grid, on which the
  // phases are found.
  Index grid = samples;
  if (const Index last = lines.back(); last < samples / (2 * finest_grid)) {
    grid = 4;
    while (grid < finest_grid * last) {
      grid *= 2;
    }
  }
  FLYBALL_TRY(RealFft plan, RealFft::create(grid));
  using Complex = std::complex<double>;
  std::vector<Complex> bins(static_cast<std::size_t>(plan.bins()));
  std::vector<Complex> best;
  double best_crest = 0.0;
  VectorXd u(grid);
  const auto crest_of = [](const VectorXd& signal) {
    return signal.cwiseAbs().maxCoeff() /
           std::sqrt(signal.squaredNorm() / static_cast<double>(signal.size()));
  };
  const auto judge = [&] {
    plan.inverse(bins.data(), u.data());
    const double crest = crest_of(u);
    if (best.empty() || crest < best_crest) {
      best = bins;
      best_crest = crest;
    }
  };
  Random random(seed);
  const auto count = static_cast<double>(lines.size());
  const int starts = lines.size() > 1 ? 4 : 1;
  const auto affordable = static_cast<int>(std::min<Index>(most_work / grid, 1000)) / starts;
  const int clippings = lines.size() > 1 ? std::clamp(affordable, 1, 150) : 0;
  for (int start = 0; start < starts; ++start) {
    std::fill(bins.begin(), bins.end(), Complex());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      // Schroeder's phases, then random ones.
      const auto k = static_cast<double>(i);
      const double phase = start == 0 ? -std::numbers::pi * k * (k + 1.0) / count
                                      : random.uniform(-std::numbers::pi, std::numbers::pi);
      bins[static_cast<std::size_t>(lines[i])] = std::polar(1.0, phase);
    }
    judge();
    std::vector<Complex> clipped(bins.size());
    for (int step = 0; step < clippings; ++step) {
      // The peaks are cut off, and of what is left only the phases are kept.
      const double level = (0.7 + 0.25 * step / clippings) * u.cwiseAbs().maxCoeff();
      u = u.cwiseMin(level).cwiseMax(-level);
      plan.forward(u.data(), clipped.data());
      for (const Index k : lines) {
        const Complex line = clipped[static_cast<std::size_t>(k)];
        if (std::abs(line) > 0.0) {
          bins[static_cast<std::size_t>(k)] = line / std::abs(line);
        }
      }
      judge();
    }
  }
  Multisine signal;
  signal.u.resize(samples);
  if (grid != samples) {
    FLYBALL_TRY(plan, RealFft::create(samples));
    best.resize(static_cast<std::size_t>(plan.bins()));
  }
  plan.inverse(best.data(), signal.u.data());
  signal.u /= signal.u.cwiseAbs().maxCoeff();
  signal.crest_factor = crest_of(signal.u);
  signal.u *= amplitude;
  return signal;
}

Expected<VectorXd> prbs(int bits, Index hold, double amplitude, std::uint64_t seed) {
  constexpr std::string_view where = "prbs";
  FLYBALL_CHECK(Checks(where)
                    .also([&] { return check_count(bits, 2, 24, where, "bits"); })
                    .also([&] { return check_count(hold, 1, most_samples >> bits, where, "hold"); })
                    .positive(amplitude, "amplitude"));
  // x^n + x^a + … + 1 is primitive; a bit a power, the highest left out.
  constexpr std::uint32_t taps[] = {0,    0,    0x3, 0x3,  0x3,  0x5,  0x3, 0x3,  0x1D,
                                    0x11, 0x9,  0x5, 0x53, 0x1B, 0x2B, 0x3, 0x2D, 0x9,
                                    0x81, 0x27, 0x9, 0x5,  0x3,  0x21, 0x1B};
  const std::uint32_t length = (std::uint32_t{1} << bits) - 1;
  std::uint32_t state = static_cast<std::uint32_t>(Random(seed).bits() % length) + 1;
  VectorXd u(static_cast<Index>(length) * hold);
  for (Index k = 0; k < static_cast<Index>(length); ++k) {
    u.segment(k * hold, hold).setConstant((state & 1U) != 0 ? amplitude : -amplitude);
    std::uint32_t feedback = state & taps[bits];
    feedback ^= feedback >> 16U;
    feedback ^= feedback >> 8U;
    feedback ^= feedback >> 4U;
    feedback ^= feedback >> 2U;
    feedback ^= feedback >> 1U;
    state = (state >> 1U) | ((feedback & 1U) << static_cast<unsigned>(bits - 1));
  }
  return u;
}

}  // namespace flyball
