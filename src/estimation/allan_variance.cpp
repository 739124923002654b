#include <flyball/estimation/allan_variance.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Core>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;

constexpr std::string_view in_allan_deviation = "allan_deviation";
constexpr std::size_t least_readings = 18;
constexpr std::size_t averages = 9;  ///< Of the longest time of averaging, in the record.

/// m² T² σ²(m T) of θ over T.
double squared_difference(const std::vector<double>& theta, std::size_t m) {
  double sum = 0.0;
  const std::size_t count = theta.size() - 2 * m;
  for (std::size_t k = 0; k < count; ++k) {
    const double d = theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k];
    sum += d * d;
  }
  return sum / (2.0 * static_cast<double>(count));
}

constexpr std::size_t terms = 4;

/// The terms of σ²(τ) for noises of one.
std::array<double, terms> terms_at(double tau) {
  return {3.0 / (tau * tau), 1.0 / tau, 2.0 * std::numbers::ln2 / std::numbers::pi, tau / 3.0};
}

}  // namespace

Expected<std::vector<AllanPoint>> allan_deviation(std::span<const double> readings, double period,
                                                  int per_decade) {
  FLYBALL_CHECK(Checks(in_allan_deviation)
                    .positive(period, "period", "s")
                    .within(per_decade, 1.0, 1000.0, "per_decade"));
  if (readings.size() < least_readings) {
    return refusal(ArgumentError::out_of_range, in_allan_deviation, "readings")
        .got(detail::format("{} of them", readings.size()))
        .expected(detail::format("{} at least", least_readings));
  }
  // Of y less its mean, which does not count, so that θ stays small.
  double mean = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    FLYBALL_CHECK(check_finite(readings[k], in_allan_deviation, detail::format("readings({})", k)));
    mean += (readings[k] - mean) / static_cast<double>(k + 1);
  }
  std::vector<double> theta(readings.size() + 1, 0.0);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    theta[k + 1] = theta[k] + (readings[k] - mean);
  }
  std::vector<AllanPoint> points;
  const double factor = std::pow(10.0, 1.0 / per_decade);
  const std::size_t most = readings.size() / averages;
  double wanted = 1.0;
  for (std::size_t m = 1; m <= most;) {
    const auto size = static_cast<double>(m);
    points.push_back(
        {.tau = size * period,
         .deviation = std::sqrt(squared_difference(theta, m)) / size,
         .relative_error =
             1.0 / std::sqrt(2.0 * (static_cast<double>(readings.size()) / size - 1.0))});
    while (static_cast<std::size_t>(std::lround(wanted)) <= m) {
      wanted *= factor;
    }
    m = static_cast<std::size_t>(std::lround(wanted));
  }
  return points;
}

Expected<SensorNoise> fit_allan_deviation(std::span<const AllanPoint> points) {
  if (points.size() < terms) {
    return refusal(ArgumentError::out_of_range, "fit_allan_deviation", "points")
        .got(detail::format("{} of them", points.size()))
        .expected("four at least");
  }
  for (const AllanPoint& point : points) {
    FLYBALL_CHECK(Checks("fit_allan_deviation")
                      .positive(point.tau, "tau", "s")
                      .positive(point.deviation, "deviation")
                      .positive(point.relative_error, "relative_error"));
  }
  // In units of each variance's error, 2 σ² times that of σ.
  Eigen::MatrixXd A(static_cast<Index>(points.size()), static_cast<Index>(terms));
  Eigen::VectorXd b(A.rows());
  for (Index i = 0; i < A.rows(); ++i) {
    const AllanPoint& point = points[static_cast<std::size_t>(i)];
    const double variance = point.deviation * point.deviation;
    const double error = 2.0 * variance * point.relative_error;
    const auto row = terms_at(point.tau);
    for (std::size_t j = 0; j < terms; ++j) {
      A(i, static_cast<Index>(j)) = row[j] / error;
    }
    b(i) = variance / error;
  }
  // Of all subsets whose solution is not negative, the best: sixteen.
  std::array<double, terms> best{};
  double least = b.squaredNorm();
  for (unsigned subset = 1; subset < 1U << terms; ++subset) {
    std::vector<Index> columns;
    for (std::size_t j = 0; j < terms; ++j) {
      if ((subset >> j & 1U) != 0) {
        columns.push_back(static_cast<Index>(j));
      }
    }
    Eigen::MatrixXd part(A.rows(), static_cast<Index>(columns.size()));
    Eigen::VectorXd size(part.cols());
    for (Index c = 0; c < part.cols(); ++c) {
      const auto column = A.col(columns[static_cast<std::size_t>(c)]);
      size(c) = column.norm();
      part.col(c) = column / size(c);
    }
    const Eigen::VectorXd x = detail::solve_least_squares(part, b);
    const double rest = (b - detail::product(part, x)).squaredNorm();
    if ((x.array() < 0.0).any() || !(rest < least)) {
      continue;
    }
    least = rest;
    best.fill(0.0);
    for (Index c = 0; c < part.cols(); ++c) {
      best[static_cast<std::size_t>(columns[static_cast<std::size_t>(c)])] = x(c) / size(c);
    }
  }
  return SensorNoise{.random_walk = std::sqrt(best[1]),
                     .bias_instability = std::sqrt(best[2]),
                     .bias_random_walk = std::sqrt(best[3]),
                     .quantization = std::sqrt(best[0])};
}

}  // namespace flyball
