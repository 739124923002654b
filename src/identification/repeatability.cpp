#include <flyball/identification/repeatability.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/try.hpp"

namespace flyball::identification {
namespace {

constexpr double normal_95 = 1.959963984540054;

struct Gain {
  std::string_view name;
  std::string unit;
  GainEstimate* estimate;
};

/// The gains of a fit that it has.
std::vector<Gain> gains_of(FeedforwardFit& fit) {
  std::vector<Gain> gains{{"kS", "V", &fit.kS},
                          {"kV", "V·s/" + fit.unit, &fit.kV},
                          {"kA", "V·s²/" + fit.unit, &fit.kA}};
  if (fit.kG) {
    gains.push_back({"kG", "V", &*fit.kG});
  }
  if (fit.angle_offset) {
    gains.push_back({"angle_offset", "rad", &*fit.angle_offset});
  }
  return gains;
}

/// One value of one log, with its standard error.
struct Reading {
  std::size_t log;
  double value;
  double sigma;
};

/// Half the interval over 1.96: intervals also hold what standard errors of one fit do not.
double sigma_of(const GainEstimate& gain) {
  return std::max(gain.standard_error, 0.5 * (gain.interval[1] - gain.interval[0]) / normal_95);
}

struct Scatter {
  double Q = 0.0;
  double ratio = 1.0;
  double p_value = 1.0;
  double between_squared = 0.0;
};

Scatter scatter_of(const std::vector<Reading>& readings) {
  double sum_w = 0.0;
  double sum_w2 = 0.0;
  double sum_wx = 0.0;
  for (const Reading& reading : readings) {
    const double w = 1.0 / (reading.sigma * reading.sigma);
    sum_w += w;
    sum_w2 += w * w;
    sum_wx += w * reading.value;
  }
  Scatter scatter;
  for (const Reading& reading : readings) {
    scatter.Q += std::pow((reading.value - sum_wx / sum_w) / reading.sigma, 2);
  }
  const double freedom = static_cast<double>(readings.size()) - 1.0;
  if (freedom > 0.0) {
    scatter.ratio = std::sqrt(std::max(1.0, scatter.Q / freedom));
    scatter.p_value = chi_squared_tail(scatter.Q, freedom);
    scatter.between_squared = std::max(0.0, (scatter.Q - freedom) / (sum_w - sum_w2 / sum_w));
  }
  return scatter;
}

/// The log that alone disagrees with the others, who agree; of three or more.
std::optional<std::size_t> outlier_of(const std::vector<Reading>& readings) {
  if (readings.size() < 3) {
    return std::nullopt;
  }
  std::size_t odd = 0;
  double best = -1.0;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    std::vector<Reading> others = readings;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    if (const double p = scatter_of(others).p_value; p > best) {
      best = p;
      odd = i;
    }
  }
  return best >= GainComparison::least_p_value ? std::optional(readings[odd].log) : std::nullopt;
}

GainComparison compare(std::string_view name, std::string unit,
                       const std::vector<Reading>& readings) {
  GainComparison comparison{.name = std::string(name), .unit = std::move(unit)};
  const Scatter scatter = scatter_of(readings);
  comparison.between = std::sqrt(scatter.between_squared);
  comparison.ratio = scatter.ratio;
  comparison.p_value = scatter.p_value;
  double sum_w = 0.0;
  double sum_wx = 0.0;
  for (const Reading& reading : readings) {
    comparison.logs.push_back(reading.log);
    const double w = 1.0 / (reading.sigma * reading.sigma + scatter.between_squared);
    sum_w += w;
    sum_wx += w * reading.value;
    for (const Reading& other : readings) {
      const double z =
          std::abs(reading.value - other.value) / std::hypot(reading.sigma, other.sigma);
      if (other.log > reading.log && z > comparison.largest_z) {
        comparison.largest_z = z;
        comparison.pair = {reading.log, other.log};
      }
    }
  }
  comparison.mean = sum_wx / sum_w;
  comparison.standard_error = std::sqrt(1.0 / sum_w);
  if (!comparison.agrees()) {
    comparison.outlier = outlier_of(readings);
  }
  return comparison;
}

void keep_shared_channels(Recording& recording, bool position, bool velocity) {
  for (TestRun& run : recording.runs) {
    if (!position) {
      run.position.clear();
    }
    if (!velocity) {
      run.velocity.clear();
    }
  }
}

}  // namespace

Expected<std::vector<GainComparison>> compare_fits(const std::vector<FeedforwardFit>& fits) {
  constexpr std::string_view where = "compare_fits";
  if (fits.size() < 2) {
    return refusal(ArgumentError::wrong_shape, where, "fits")
        .got(fits.empty() ? "none" : "one")
        .expected("two or more");
  }
  std::vector<FeedforwardFit> copies = fits;
  for (const FeedforwardFit& fit : fits) {
    if (fit.mechanism != fits[0].mechanism || fit.unit != fits[0].unit) {
      return refusal(ArgumentError::wrong_unit, where, "a fit")
          .got(std::string(to_string(fit.mechanism)) + " in " + fit.unit)
          .expected(std::string(to_string(fits[0].mechanism)) + " in " + fits[0].unit +
                    ", as the first");
    }
  }
  std::vector<GainComparison> comparisons;
  for (const Gain& first : gains_of(copies[0])) {
    std::vector<Reading> readings;
    for (std::size_t log = 0; log < copies.size(); ++log) {
      for (const Gain& gain : gains_of(copies[log])) {
        if (gain.name == first.name && gain.estimate->determined &&
            sigma_of(*gain.estimate) > 0.0) {
          readings.push_back({log, gain.estimate->value, sigma_of(*gain.estimate)});
        }
      }
    }
    if (readings.size() > 1) {
      comparisons.push_back(compare(first.name, first.unit, readings));
    }
  }
  return comparisons;
}

void widen_by_scatter(FeedforwardFit& joint, const std::vector<GainComparison>& comparisons) {
  for (const Gain& gain : gains_of(joint)) {
    const auto found = std::find_if(comparisons.begin(), comparisons.end(),
                                    [&](const GainComparison& c) { return c.name == gain.name; });
    GainEstimate& estimate = *gain.estimate;
    if (found == comparisons.end() || !estimate.determined) {
      continue;
    }
    if (found->agrees()) {
      estimate.standard_error *= found->ratio;
      for (double& end : estimate.interval) {
        end = estimate.value + found->ratio * (end - estimate.value);
      }
      continue;
    }
    const auto k = static_cast<double>(found->logs.size());
    const double own = sigma_of(estimate) * sigma_of(estimate);
    const double scatter = found->between * found->between / k;
    const double freedom = (k - 1.0) * std::pow((own + scatter) / scatter, 2);
    estimate.standard_error = std::sqrt(own + scatter);
    const double half = student_quantile(0.975, freedom) * estimate.standard_error;
    estimate.interval = {estimate.value - half, estimate.value + half};
  }
}

Expected<Recording> joined(const std::vector<Recording>& recordings) {
  constexpr std::string_view where = "joined";
  if (recordings.empty()) {
    return refusal(ArgumentError::empty, where, "recordings");
  }
  bool position = true;
  bool velocity = true;
  Recording all = recordings[0];
  all.runs.clear();
  for (const Recording& recording : recordings) {
    if (recording.mechanism != all.mechanism || recording.unit != all.unit) {
      return refusal(ArgumentError::wrong_unit, where, "a recording")
          .got("of another mechanism or unit than the first")
          .expected("recordings of one mechanism");
    }
    for (const TestRun& run : recording.runs) {
      position = position && !run.position.empty();
      velocity = velocity && !run.velocity.empty();
      all.runs.push_back(run);
    }
  }
  if (!position && !velocity) {
    return refusal(ArgumentError::wrong_shape, where, "the recordings")
        .got("some with positions alone and some with velocities alone")
        .expected("one channel that all have");
  }
  keep_shared_channels(all, position, velocity);
  return all;
}

}  // namespace flyball::identification
