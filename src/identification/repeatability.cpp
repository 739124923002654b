#include <flyball/identification/repeatability.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include <flyball/core/argument.hpp>
#include <flyball/math/probability/distributions.hpp>

#include "core/try.hpp"

namespace flyball::identification {
namespace {

constexpr double z_975 = 1.959963984540054;

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
  return std::max(gain.standard_error, 0.5 * (gain.interval[1] - gain.interval[0]) / z_975);
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

GainComparison compare(std::string name, std::string unit, const std::vector<Reading>& readings) {
  GainComparison comparison{.name = std::move(name), .unit = std::move(unit)};
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

/// A gain of a joint fit with the scatter among the logs.
void widen(GainEstimate& estimate, std::string_view name,
           const std::vector<GainComparison>& comparisons) {
  const auto found = std::find_if(comparisons.begin(), comparisons.end(),
                                  [&](const GainComparison& c) { return c.name == name; });
  if (found == comparisons.end() || !estimate.determined) {
    return;
  }
  if (found->agrees()) {
    estimate.standard_error *= found->ratio;
    for (double& end : estimate.interval) {
      end = estimate.value + found->ratio * (end - estimate.value);
    }
    return;
  }
  const auto k = static_cast<double>(found->logs.size());
  const double own = sigma_of(estimate) * sigma_of(estimate);
  const double scatter = found->between * found->between / k;
  const double freedom = (k - 1.0) * std::pow((own + scatter) / scatter, 2);
  estimate.standard_error = std::sqrt(own + scatter);
  const double half = student_quantile(0.975, freedom) * estimate.standard_error;
  estimate.interval = {estimate.value - half, estimate.value + half};
}

Error few_fits(std::size_t fits) {
  return refusal(ArgumentError::wrong_shape, "compare_fits", "fits")
      .got(fits == 0 ? "none" : "one")
      .expected("two or more");
}

constexpr std::array drive_gains{"kS_linear",  "kV_linear", "kA_linear", "kS_angular", "kV_angular",
                                 "kA_angular", "kS_left",   "kS_right",  "trackwidth"};

/// A gain of a drivetrain, or of one that may be changed; null if it has none.
template <class Fit>
auto* gain_in(Fit& fit, std::string_view name) {
  if (name == "kS_left" || name == "kS_right" || name == "trackwidth") {
    auto& gain = name == "kS_left"    ? fit.kS_left
                 : name == "kS_right" ? fit.kS_right
                                      : fit.trackwidth;
    return gain ? &*gain : nullptr;
  }
  auto& mode = name.ends_with("_linear") ? fit.linear : fit.angular;
  return !mode                    ? nullptr
         : name.starts_with("kS") ? &mode->kS
         : name.starts_with("kV") ? &mode->kV
                                  : &mode->kA;
}

/// V, V·s/m and so on.
std::string drive_unit(std::string_view name, const std::string& unit) {
  return name == "trackwidth"     ? "m"
         : name.starts_with("kS") ? "V"
         : name.starts_with("kV") ? "V·s/" + unit
                                  : "V·s²/" + unit;
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

std::optional<GainComparison> compare_gain(std::string name, std::string unit,
                                           std::span<const GainEstimate* const> gains) {
  std::vector<Reading> readings;
  for (std::size_t log = 0; log < gains.size(); ++log) {
    if (gains[log] != nullptr && gains[log]->determined && sigma_of(*gains[log]) > 0.0) {
      readings.push_back({log, gains[log]->value, sigma_of(*gains[log])});
    }
  }
  return readings.size() > 1 ? std::optional(compare(std::move(name), std::move(unit), readings))
                             : std::nullopt;
}

Expected<std::vector<GainComparison>> compare_fits(const std::vector<FeedforwardFit>& fits) {
  constexpr std::string_view where = "compare_fits";
  if (fits.size() < 2) {
    return tl::unexpected(few_fits(fits.size()));
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
    std::vector<const GainEstimate*> estimates(copies.size(), nullptr);
    for (std::size_t log = 0; log < copies.size(); ++log) {
      for (const Gain& gain : gains_of(copies[log])) {
        estimates[log] = gain.name == first.name ? gain.estimate : estimates[log];
      }
    }
    if (auto compared = compare_gain(std::string(first.name), first.unit, estimates)) {
      comparisons.push_back(*std::move(compared));
    }
  }
  return comparisons;
}

const GainEstimate* drive_gain(const DriveFit& fit, std::string_view name) {
  return gain_in(fit, name);
}

Expected<std::vector<GainComparison>> compare_fits(const std::vector<DriveFit>& fits) {
  if (fits.size() < 2) {
    return tl::unexpected(few_fits(fits.size()));
  }
  std::vector<GainComparison> comparisons;
  for (const std::string_view name : drive_gains) {
    std::vector<const GainEstimate*> estimates;
    for (const DriveFit& fit : fits) {
      if (fit.unit != fits[0].unit) {
        return refusal(ArgumentError::wrong_unit, "compare_fits", "a fit")
            .got("a drivetrain in " + fit.unit)
            .expected("in " + fits[0].unit + ", as the first");
      }
      estimates.push_back(drive_gain(fit, name));
    }
    if (auto compared =
            compare_gain(std::string(name), drive_unit(name, fits[0].unit), estimates)) {
      comparisons.push_back(*std::move(compared));
    }
  }
  return comparisons;
}

void widen_by_scatter(DriveFit& joint, const std::vector<GainComparison>& comparisons) {
  for (const std::string_view name : drive_gains) {
    if (GainEstimate* gain = gain_in(joint, name)) {
      widen(*gain, name, comparisons);
    }
  }
}

Expected<DriveRecording> joined(const std::vector<DriveRecording>& recordings) {
  if (recordings.empty()) {
    return refusal(ArgumentError::empty, "joined", "recordings");
  }
  DriveRecording all{.unit = recordings[0].unit};
  for (const DriveRecording& recording : recordings) {
    if (recording.unit != all.unit) {
      return refusal(ArgumentError::wrong_unit, "joined", "a recording")
          .got("a drivetrain in " + recording.unit)
          .expected("in " + all.unit + ", as the first");
    }
    all.runs.insert(all.runs.end(), recording.runs.begin(), recording.runs.end());
  }
  return all;
}

void widen_by_scatter(FeedforwardFit& joint, const std::vector<GainComparison>& comparisons) {
  for (const Gain& gain : gains_of(joint)) {
    widen(*gain.estimate, gain.name, comparisons);
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
