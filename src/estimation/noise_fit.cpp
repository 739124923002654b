#include <flyball/estimation/noise_fit.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view in_fit_noise = "fit_noise";

/// The search over the logarithms of what is free.
class Search {
 public:
  Search(std::span<const NoiseRecord> records, VectorXd process, VectorXd measurement)
      : records_(records), process_(std::move(process)), measurement_(std::move(measurement)) {
    for (Index i = 0; i < process_.size() + measurement_.size(); ++i) {
      if (of(i) > 0.0) {
        free_.push_back(i);
      }
    }
  }

  /// A place and what the records say there; without a likelihood they cannot be.
  struct Place {
    VectorXd log;  ///< Logarithms of the free deviations.
    double value = -infinity;
    VectorXd gradient;
  };

  [[nodiscard]] Index size() const { return static_cast<Index>(free_.size()); }
  [[nodiscard]] const std::vector<Index>& free() const { return free_; }

  [[nodiscard]] VectorXd start() const {
    VectorXd log(size());
    for (Index i = 0; i < size(); ++i) {
      log(i) = std::log(of(free_[static_cast<std::size_t>(i)]));
    }
    return log;
  }

  [[nodiscard]] Expected<Place> at(const VectorXd& log) const {
    VectorXd process = process_;
    VectorXd measurement = measurement_;
    for (Index i = 0; i < size(); ++i) {
      const Index k = free_[static_cast<std::size_t>(i)];
      (k < process.size() ? process(k) : measurement(k - process.size())) = std::exp(log(i));
    }
    FLYBALL_TRY(const NoiseLikelihood found, noise_likelihood(records_, process, measurement));
    Place place{log, found.log_likelihood, VectorXd(size())};
    for (Index i = 0; i < size(); ++i) {
      const Index k = free_[static_cast<std::size_t>(i)];
      place.gradient(i) = k < process.size() ? found.by_log_process(k)
                                             : found.by_log_measurement(k - process.size());
    }
    return place;
  }

  /// How many readings there are.
  [[nodiscard]] double readings() const {
    Index count = 0;
    for (const NoiseRecord& record : records_) {
      for (const NoiseStep& step : record.steps) {
        count += step.y.size() - step.y.array().isNaN().count();
      }
    }
    return static_cast<double>(count);
  }

 private:
  [[nodiscard]] double of(Index i) const {
    return i < process_.size() ? process_(i) : measurement_(i - process_.size());
  }

  std::span<const NoiseRecord> records_;
  VectorXd process_;
  VectorXd measurement_;
  std::vector<Index> free_;
};

/// A step uphill from a place, along H g and shortened until it is one, not below the least
/// logarithms; the same place if none is.
Search::Place uphill(const Search& search, const Search::Place& from, const VectorXd& direction,
                     const VectorXd& least) {
  constexpr double longest = 2.0;  // a factor of e² of any deviation
  constexpr double sufficient = 1e-4;
  constexpr int halvings = 40;
  const double slope = from.gradient.dot(direction);
  double share = std::min(1.0, longest / std::max(1e-300, direction.cwiseAbs().maxCoeff()));
  for (int k = 0; k < halvings; ++k, share *= 0.5) {
    const auto next = search.at((from.log + share * direction).cwiseMax(least));
    if (next && next->value >= from.value + sufficient * share * slope &&
        next->value > from.value) {
      return *next;
    }
  }
  return from;
}

/// BFGS's inverse of the negative Hessian after a step.
void learn(MatrixXd& H, const VectorXd& step, const VectorXd& fall) {
  const double curvature = step.dot(fall);
  if (!(curvature > 1e-10 * step.norm() * fall.norm())) {
    return;  // the gradient did not fall along the step
  }
  const VectorXd Hy = detail::product(H, fall);
  const double factor = (1.0 + fall.dot(Hy) / curvature) / curvature;
  H += factor * detail::product_transposed(step, step) -
       (detail::product_transposed(Hy, step) + detail::product_transposed(step, Hy)) / curvature;
}

/// Standard errors of the logarithms from the observed information, by differences of gradients.
VectorXd errors_of(const Search& search, const Search::Place& place,
                   const std::vector<bool>& negligible) {
  constexpr double h = 1e-3;
  const Index size = search.size();
  MatrixXd information = MatrixXd::Identity(size, size);
  for (Index i = 0; i < size; ++i) {
    if (negligible[static_cast<std::size_t>(i)]) {
      continue;
    }
    VectorXd moved = place.log;
    moved(i) += h;
    const auto above = search.at(moved);
    moved(i) -= 2.0 * h;
    const auto below = search.at(moved);
    if (!above || !below) {
      return VectorXd::Constant(size, infinity);
    }
    information.col(i) = (below->gradient - above->gradient) / (2.0 * h);
  }
  for (Index i = 0; i < size; ++i) {
    if (negligible[static_cast<std::size_t>(i)]) {
      information.row(i).setZero();
      information.col(i).setZero();
      information(i, i) = 1.0;
    }
  }
  information = detail::symmetrized(information);
  if (!detail::cholesky_of(information)) {
    return VectorXd::Constant(size, infinity);
  }
  const MatrixXd inverse = detail::solve_symmetric(information, MatrixXd::Identity(size, size));
  VectorXd errors = inverse.diagonal().cwiseSqrt();
  for (Index i = 0; i < size; ++i) {
    if (negligible[static_cast<std::size_t>(i)]) {
      errors(i) = infinity;
    }
  }
  return errors;
}

}  // namespace

Expected<NoiseFit> fit_noise(std::span<const NoiseRecord> records, const VectorXd& process,
                             const VectorXd& measurement, const NoiseFitOptions& options) {
  if (options.iterations < 1 || !(options.tolerance > 0.0)) {
    return refusal(ArgumentError::out_of_range, in_fit_noise, "options")
        .got(detail::format("{} iterations, tolerance {}", options.iterations, options.tolerance))
        .expected("one iteration at least and a positive tolerance");
  }
  const Search search(records, process, measurement);
  const Index size = search.size();
  if (size == 0 || search.readings() == 0.0) {
    return refusal(ArgumentError::empty, in_fit_noise,
                   size == 0 ? "what is looked for" : "the records")
        .got(size == 0 ? "empty: every deviation is zero" : "without a measurement")
        .hint(size == 0 ? "begin with a positive one" : "");
  }
  FLYBALL_TRY(Search::Place place, search.at(search.start()));
  NoiseFit fit;
  fit.start_log_likelihood = place.value;
  // Of a deviation that all readings tell, the variance of its logarithm.
  MatrixXd H = MatrixXd::Identity(size, size) / (2.0 * search.readings());
  constexpr double smallest = 1e-6;
  const VectorXd least = (place.log.array() + std::log(smallest)).matrix();
  // Zero where a deviation is at its least and would go on.
  const auto climbing = [&](VectorXd values) {
    for (Index i = 0; i < size; ++i) {
      values(i) = place.log(i) <= least(i) && place.gradient(i) < 0.0 ? 0.0 : values(i);
    }
    return values;
  };
  for (bool fresh = true; fit.iterations < options.iterations; ++fit.iterations) {
    const VectorXd direction = climbing(detail::product(H, climbing(place.gradient)));
    fit.expected_gain = 0.5 * climbing(place.gradient).dot(direction);
    if (!fresh && fit.expected_gain <= options.tolerance) {
      fit.converged = true;
      break;
    }
    const Search::Place next = uphill(search, place, direction, least);
    if (next.value == place.value) {
      // Rounding hides what is left, or H is wrong: it begins anew once.
      constexpr double rounding = 1e-11;
      if (fit.expected_gain <= rounding * std::abs(place.value) || fresh) {
        fit.converged = fit.expected_gain <= rounding * std::abs(place.value);
        break;
      }
      H = MatrixXd::Identity(size, size) / (2.0 * search.readings());
      fresh = true;
      continue;
    }
    learn(H, next.log - place.log, place.gradient - next.gradient);
    fresh = false;
    place = next;
  }
  fit.log_likelihood = place.value;
  std::vector<bool> negligible(static_cast<std::size_t>(size), false);
  for (Index i = 0; i < size; ++i) {
    VectorXd without = place.log;
    constexpr double much_less = 4.6;  // a hundredth
    without(i) -= much_less;
    const auto found = search.at(without);
    constexpr double hardly = 1e-3;  // of log p
    negligible[static_cast<std::size_t>(i)] =
        place.log(i) <= least(i) || (found && found->value >= place.value - hardly);
  }
  const VectorXd errors = errors_of(search, place, negligible);
  for (const double value : process) {
    fit.process.push_back({.value = value});
  }
  for (const double value : measurement) {
    fit.measurement.push_back({.value = value});
  }
  for (Index i = 0; i < size; ++i) {
    const Index k = search.free()[static_cast<std::size_t>(i)];
    (k < process.size() ? fit.process[static_cast<std::size_t>(k)]
                        : fit.measurement[static_cast<std::size_t>(k - process.size())]) = {
        .value = std::exp(place.log(i)),
        .relative_error = errors(i),
        .is_free = true,
        .is_negligible = negligible[static_cast<std::size_t>(i)],
        .vanishes = place.log(i) <= least(i)};
  }
  return fit;
}

}  // namespace flyball
