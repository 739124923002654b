#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <flyball/classical/frequency_response.hpp>

#include "classical/factors.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

/// What is known before the first evaluation: where the response is steep, and how far it goes.
struct Landmarks {
  std::vector<Complex> roots;  ///< In s.
  std::vector<double> places;  ///< Further frequencies within the range, rad/s.
  double delay = 0.0;
  bool known = true;
};

Landmarks landmarks_of(const FrequencyResponse& response) {
  Landmarks found;
  const auto period = response.period();
  for (Index j = 0; j < response.inputs(); ++j) {
    for (Index i = 0; i < response.outputs(); ++i) {
      const auto factors = response.factors(i, j);
      if (!factors) {
        found.known = false;
        const auto hints = response.hints();
        found.delay = std::max(found.delay, hints.delay);
        for (const Complex place : hints.places) {
          if (place.imag() >= 0.0) {
            found.roots.push_back(place);
          }
        }
        continue;
      }
      found.delay = std::max(found.delay, factors->delay);
      for (const auto* roots : {&factors->zeros, &factors->poles}) {
        for (const Complex root : *roots) {
          if (const auto s = detail::in_s(root, period); s && s->imag() >= 0.0) {
            found.roots.push_back(*s);
          }
        }
      }
      // Where the asymptotes at both ends cross the gain of one, within six decades of the rest.
      const detail::Asymptote low = detail::low_asymptote(*factors, period);
      if (low.integrators != 0) {
        found.places.push_back(std::exp(low.log_gain / low.integrators));
      }
      const Index excess = factors->poles.size() - factors->zeros.size();
      if (excess != 0 && !period) {
        found.places.push_back(
            std::exp(std::log(std::abs(factors->gain)) / static_cast<double>(excess)));
      }
    }
  }
  std::sort(found.roots.begin(), found.roots.end(), [](Complex a, Complex b) {
    return a.imag() != b.imag() ? a.imag() < b.imag() : a.real() < b.real();
  });
  found.roots.erase(std::unique(found.roots.begin(), found.roots.end()), found.roots.end());
  return found;
}

double full_decade(double frequency, bool up) {
  const double power = std::log10(frequency);
  return std::pow(10.0, up ? std::ceil(power - 1e-9) : std::floor(power + 1e-9));
}

/// From a decade below the slowest to a decade above the fastest thing.
std::pair<double, double> range_of(const FrequencyResponse& response, const Landmarks& landmarks) {
  const VectorXd data = response.known_frequencies();
  if (data.size() > 0) {
    const double first = data(0) > 0.0 || data.size() == 1 ? data(0) : data(1);
    return {first, data(data.size() - 1)};
  }
  const double end = response.highest_frequency();
  double low = infinity;
  double high = 0.0;
  const auto take = [&](double w) {
    if (std::isfinite(w) && w > 0.0) {
      low = std::min(low, w);
      high = std::max(high, w);
    }
  };
  for (const Complex s : landmarks.roots) {
    take(std::abs(s));
  }
  take(landmarks.delay > 0.0 ? 1.0 / landmarks.delay : 0.0);
  if (high == 0.0 && std::isfinite(end)) {
    take(0.1 * end);
  }
  const double slowest = low;
  const double fastest = high;
  for (const double w : landmarks.places) {
    if (high == 0.0 || (w > 1e-6 * slowest && w < 1e6 * fastest)) {
      take(w);
    }
  }
  if (high == 0.0) {
    take(1.0);
  }
  low = std::max(full_decade(0.1 * low, false), 1e-300);
  high = std::min(full_decade(10.0 * high, true), 1e300);
  return {std::min(low, 0.01 * end), std::min(high, end)};
}

std::vector<double> first_grid(const Landmarks& landmarks, double low, double high) {
  std::vector<double> grid{low, high};
  const double per_decade = landmarks.known ? 16.0 : 64.0;
  const int steps = std::max(2, static_cast<int>(per_decade * std::log10(high / low)));
  for (int i = 1; i < steps; ++i) {
    grid.push_back(low * std::pow(high / low, static_cast<double>(i) / steps));
  }
  for (const Complex s : landmarks.roots) {
    const double size = std::abs(s);
    const double middle = std::abs(s.imag());
    grid.push_back(size);
    if (middle == 0.0) {
      continue;
    }
    const double width = std::max(std::abs(s.real()), 1e-7 * middle);
    if (std::abs(s.real()) > 1e-13 * middle) {
      grid.push_back(middle);
    } else {
      grid.pop_back();
    }
    for (double offset = 0.25 * width; offset < 0.5 * middle; offset *= 2.0) {
      grid.push_back(middle - offset);
      grid.push_back(middle + offset);
    }
  }
  std::erase_if(grid, [&](double w) { return !(w >= low && w <= high); });
  std::sort(grid.begin(), grid.end());
  std::vector<double> distinct;
  for (const double w : grid) {
    // Of a delay no step turns by more than a radian.
    while (!distinct.empty() && landmarks.delay * (w - distinct.back()) > 1.0 &&
           distinct.size() < 100'000) {
      distinct.push_back(distinct.back() + 1.0 / landmarks.delay);
    }
    if (distinct.empty() || w > distinct.back() * (1.0 + 1e-9)) {
      distinct.push_back(w);
    }
  }
  return distinct;
}

struct Interval {
  Index from = 0;  ///< Column of the samples.
  Index to = 0;
  Index middle = -1;
  double error = infinity;  ///< Relative to the tolerances.
  double gain_error = 0.0;
  double phase_error = 0.0;
};

/// Frequencies and responses as they come.
class Samples {
 public:
  explicit Samples(const FrequencyResponse& response) : response_(response) {}

  Expected<Index> add(const VectorXd& frequencies) {
    FLYBALL_TRY(const MatrixXcd more, response_.sample(frequencies));
    const Index first = count_;
    for (Index k = 0; k < frequencies.size(); ++k) {
      frequency_.push_back(frequencies(k));
      for (Index i = 0; i < more.rows(); ++i) {
        values_.push_back(more(i, k));
      }
    }
    rows_ = more.rows();
    count_ += frequencies.size();
    return first;
  }
  [[nodiscard]] double frequency(Index k) const { return frequency_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] Complex value(Index i, Index k) const {
    return values_[static_cast<std::size_t>(k * rows_ + i)];
  }
  [[nodiscard]] Index rows() const { return rows_; }
  [[nodiscard]] bool usable(Index k) const {
    for (Index i = 0; i < rows_; ++i) {
      if (!std::isfinite(value(i, k).real()) || !std::isfinite(value(i, k).imag())) {
        return false;
      }
    }
    return true;
  }

 private:
  const FrequencyResponse& response_;
  std::vector<double> frequency_;
  std::vector<Complex> values_;
  Index rows_ = 0;
  Index count_ = 0;
};

/// How far the middle is from the straight line over log ω.
void judge(Interval& interval, const Samples& samples, const FrequencyGridOptions& options) {
  interval.gain_error = 0.0;
  interval.phase_error = 0.0;
  if (!samples.usable(interval.from) || !samples.usable(interval.to) ||
      !samples.usable(interval.middle)) {
    interval.error = infinity;
    return;
  }
  double largest = 0.0;
  for (Index i = 0; i < samples.rows(); ++i) {
    largest = std::max(largest, std::abs(samples.value(i, interval.middle)));
  }
  for (Index i = 0; i < samples.rows(); ++i) {
    const Complex a = samples.value(i, interval.from);
    const Complex b = samples.value(i, interval.to);
    const Complex m = samples.value(i, interval.middle);
    // An entry that is nothing but the rounding of the others has no shape.
    if (std::max({std::abs(a), std::abs(b), std::abs(m)}) <= 1e-14 * largest) {
      continue;
    }
    const Complex bend = (m / a) * (m / b);
    const double gain = std::abs(10.0 * std::log10(std::abs(bend)));
    interval.gain_error = std::max(interval.gain_error, std::isnan(gain) ? infinity : gain);
    interval.phase_error =
        std::max(interval.phase_error, 0.5 * std::abs(std::arg(bend)) * 180.0 / pi);
  }
  interval.error = std::max(interval.gain_error / options.gain_tolerance,
                            interval.phase_error / options.phase_tolerance);
}

}  // namespace

Expected<FrequencyGrid> frequency_grid(const FrequencyResponse& response,
                                       const FrequencyGridOptions& options) {
  constexpr std::string_view where = "frequency grid";
  FLYBALL_CHECK(Checks(where)
                    .positive(options.gain_tolerance, "gain_tolerance", "dB")
                    .positive(options.phase_tolerance, "phase_tolerance", "deg")
                    .within(options.most_points, 2.0, 10'000'000.0, "most_points"));
  const Landmarks landmarks = landmarks_of(response);
  auto [low, high] = range_of(response, landmarks);
  if (options.high) {
    FLYBALL_CHECK(check_positive(*options.high, where, "high", "rad/s"));
    high = std::min(*options.high, response.highest_frequency());
    low = std::min(low, 1e-3 * high);
  }
  if (options.low) {
    FLYBALL_CHECK(check_positive(*options.low, where, "low", "rad/s"));
    low = *options.low;
    high = options.high ? high : std::min(std::max(high, 1e3 * low), response.highest_frequency());
  }
  if (!(low < high)) {
    return refusal(ArgumentError::out_of_range, where, "low")
        .got(flyball::detail::format("{} rad/s", low))
        .expected(flyball::detail::format("below {} rad/s, where the range ends", high));
  }
  if (const VectorXd data = response.known_frequencies(); data.size() > 0) {
    std::vector<double> within;
    for (const double w : data) {
      if (w >= low && w <= high) {
        within.push_back(w);
      }
    }
    if (within.empty()) {
      return refusal(ArgumentError::out_of_range, where, "low and high")
          .got(flyball::detail::format("{} and {} rad/s", low, high))
          .expected("frequencies between which there are data");
    }
    return FrequencyGrid{Eigen::Map<VectorXd>(within.data(), static_cast<Index>(within.size()))};
  }

  Samples samples(response);
  std::vector<double> start = first_grid(landmarks, low, high);
  const auto most = static_cast<std::size_t>(options.most_points);
  while (start.size() > most) {
    // Every other one, but for the ends.
    std::vector<double> fewer;
    for (std::size_t i = 0; i < start.size(); i += 2) {
      fewer.push_back(start[i]);
    }
    fewer.back() = start.back();
    start = std::move(fewer);
  }
  FLYBALL_TRY(const Index first,
              samples.add(Eigen::Map<VectorXd>(start.data(), static_cast<Index>(start.size()))));
  std::vector<Interval> intervals;
  for (Index k = first; k + 1 < static_cast<Index>(start.size()); ++k) {
    intervals.push_back({.from = k, .to = k + 1});
  }
  constexpr double closest = 1e-8;
  for (;;) {
    std::vector<double> middles;
    for (const Interval& interval : intervals) {
      if (interval.middle < 0) {
        middles.push_back(std::sqrt(samples.frequency(interval.from)) *
                          std::sqrt(samples.frequency(interval.to)));
      }
    }
    if (middles.empty()) {
      break;
    }
    FLYBALL_TRY(Index next, samples.add(Eigen::Map<VectorXd>(middles.data(),
                                                             static_cast<Index>(middles.size()))));
    for (Interval& interval : intervals) {
      if (interval.middle < 0) {
        interval.middle = next++;
        judge(interval, samples, options);
      }
    }
    // The worst are halved, as many as there are points left.
    std::vector<std::size_t> bad;
    for (std::size_t i = 0; i < intervals.size(); ++i) {
      const Interval& interval = intervals[i];
      if (interval.error > 1.0 &&
          samples.frequency(interval.to) > samples.frequency(interval.from) * (1.0 + closest)) {
        bad.push_back(i);
      }
    }
    const std::size_t room = most - std::min(most, intervals.size() + 1);
    if (bad.size() > room) {
      std::nth_element(
          bad.begin(), bad.begin() + static_cast<std::ptrdiff_t>(room), bad.end(),
          [&](std::size_t a, std::size_t b) { return intervals[a].error > intervals[b].error; });
      bad.resize(room);
    }
    for (const std::size_t i : bad) {
      const Interval whole = intervals[i];
      intervals[i] = {.from = whole.from, .to = whole.middle};
      intervals.push_back({.from = whole.middle, .to = whole.to});
    }
  }
  std::sort(intervals.begin(), intervals.end(), [&](const Interval& a, const Interval& b) {
    return samples.frequency(a.from) < samples.frequency(b.from);
  });
  FrequencyGrid grid;
  std::vector<double> frequencies;
  const auto keep = [&](Index k) {
    if (samples.usable(k)) {
      frequencies.push_back(samples.frequency(k));
    }
  };
  keep(intervals.front().from);
  for (const Interval& interval : intervals) {
    grid.gain_error = std::max(grid.gain_error, interval.gain_error);
    grid.phase_error = std::max(grid.phase_error, interval.phase_error);
    keep(interval.to);
  }
  if (frequencies.empty()) {
    return refusal(ArgumentError::not_finite, where, "the response")
        .got(flyball::detail::format("without a finite value from {} to {} rad/s", low, high))
        .expected("finite")
        .hint("measure time and signals in units in which its numbers are near one");
  }
  grid.frequency = Eigen::Map<VectorXd>(frequencies.data(), static_cast<Index>(frequencies.size()));
  return grid;
}

}  // namespace flyball::classical
