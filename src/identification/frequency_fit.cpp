#include <flyball/identification/frequency_fit.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>

#include <flyball/core/argument.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/systems/conversion.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/vector_fitting.hpp"

namespace flyball::identification {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;
constexpr std::string_view in_fit_frequency_response = "fit_frequency_response";

/// Σ R_i φ_i + D in real states: for each pole as many as the smaller side of R has.
ContinuousSystem<> realize(const Poles& poles, const MatrixXd& coefficients, Index outputs,
                           Index inputs, bool feedthrough, double unit) {
  const bool by_inputs = inputs <= outputs;
  const Index width = std::min(inputs, outputs);
  const Index N = count_of(poles);
  const Index n = N * width;
  ContinuousSystem<> system{MatrixXd::Zero(n, n), MatrixXd::Zero(n, inputs),
                            MatrixXd::Zero(outputs, n), MatrixXd::Zero(outputs, inputs)};
  const auto R = [&](Index i) {
    const VectorXd entries = coefficients.row(i);
    return MatrixXd(Eigen::Map<const MatrixXd>(entries.data(), outputs, inputs));
  };
  const MatrixXd one = MatrixXd::Identity(width, width);
  Index i = 0;
  for (const Pole& pole : poles) {
    const Index at = i * width;
    const Index count = pole.imaginary > 0.0 ? 2 : 1;
    system.A.block(at, at, width, width) = unit * pole.real * one;
    if (count == 2) {
      system.A.block(at, at + width, width, width) = unit * pole.imaginary * one;
      system.A.block(at + width, at, width, width) = -unit * pole.imaginary * one;
      system.A.block(at + width, at + width, width, width) = unit * pole.real * one;
    }
    // A pair is [2; 0] in, [R₁ R₂] out; its transpose, where the outputs are fewer.
    const double factor = count == 2 ? 2.0 : 1.0;
    for (Index part = 0; part < count; ++part) {
      const Index here = at + part * width;
      if (by_inputs) {
        system.C.middleCols(here, width) = unit * R(i + part);
      } else {
        system.B.middleRows(here, width) = unit * (part == 0 ? 1.0 : -1.0) * R(i + part);
      }
    }
    if (by_inputs) {
      system.B.middleRows(at, width) = factor * one;
    } else {
      system.C.middleCols(at, width) = factor * one;
    }
    i += count;
  }
  if (feedthrough) {
    system.D = R(N);
  }
  return system;
}

Expected<void> check(const VectorXd& frequency, const std::vector<MatrixXcd>& response,
                     const FrequencyFitOptions& options) {
  FLYBALL_CHECK(check_finite(frequency, in_fit_frequency_response, "frequency"));
  if (frequency.size() == 0 || static_cast<Index>(response.size()) != frequency.size()) {
    return refusal(frequency.size() == 0 ? ArgumentError::empty : ArgumentError::wrong_shape,
                   in_fit_frequency_response, "the response")
        .got(detail::format("of {} frequencies", response.size()))
        .expected(detail::format("of {}, as frequency has", frequency.size()));
  }
  for (Index k = 0; k < frequency.size(); ++k) {
    if (frequency(k) < 0.0 || (k > 0 && frequency(k) <= frequency(k - 1))) {
      return refusal(ArgumentError::out_of_range, in_fit_frequency_response,
                     detail::format("frequency {}", k))
          .got(format_number(frequency(k)))
          .expected("not negative and larger than the one before");
    }
    const MatrixXcd& G = response[static_cast<std::size_t>(k)];
    if (G.size() == 0 || G.rows() != response[0].rows() || G.cols() != response[0].cols()) {
      return refusal(ArgumentError::wrong_shape, in_fit_frequency_response,
                     detail::format("response {}", k))
          .got(detail::format("{}x{}", G.rows(), G.cols()))
          .expected("outputs x inputs, as the others");
    }
    if (G.cwiseAbs().maxCoeff() == std::numeric_limits<double>::infinity()) {
      return refusal(ArgumentError::not_finite, in_fit_frequency_response,
                     detail::format("response {}", k))
          .got("infinite")
          .expected("numbers, or NaN for what is not known");
    }
  }
  if (options.weights) {
    const Index entries = response[0].size();
    FLYBALL_CHECK(check_finite(*options.weights, in_fit_frequency_response, "weights"));
    if (options.weights->rows() != frequency.size() ||
        (options.weights->cols() != 1 && options.weights->cols() != entries)) {
      return refusal(ArgumentError::wrong_shape, in_fit_frequency_response, "weights")
          .got(detail::format("{}x{}", options.weights->rows(), options.weights->cols()))
          .expected(
              detail::format("frequencies x 1 or x entries ({}x{})", frequency.size(), entries));
    }
    if (options.weights->minCoeff() < 0.0) {
      return refusal(ArgumentError::out_of_range, in_fit_frequency_response, "a weight")
          .got(format_number(options.weights->minCoeff()))
          .expected("not negative");
    }
  }
  for (const auto& [value, most, name] :
       {std::tuple{options.poles, Index{100}, "poles"},
        {Index{options.most_iterations}, Index{10'000}, "most_iterations"}}) {
    if (value < 1 || value > most) {
      return refusal(ArgumentError::out_of_range, in_fit_frequency_response, name)
          .got(std::to_string(value))
          .expected(detail::format("from 1 to {}", most));
    }
  }
  return {};
}

/// Those that are numbers and have weight, the frequencies mapped and in units of their middle.
Points points_of(const VectorXd& axis, const std::vector<MatrixXcd>& response,
                 const FrequencyFitOptions& options, double& unit) {
  const Index entries = response[0].size();
  std::vector<Index> good;
  for (Index k = 0; k < axis.size(); ++k) {
    const MatrixXcd& G = response[static_cast<std::size_t>(k)];
    if (G.allFinite() && (!options.weights || options.weights->row(k).maxCoeff() > 0.0)) {
      good.push_back(k);
    }
  }
  Points points{axis(good), MatrixXcd(static_cast<Index>(good.size()), entries),
                MatrixXd::Ones(static_cast<Index>(good.size()), entries)};
  for (std::size_t k = 0; k < good.size(); ++k) {
    const auto row = static_cast<Index>(k);
    const MatrixXcd& G = response[static_cast<std::size_t>(good[k])];
    points.values.row(row) = Eigen::Map<const VectorXcd>(G.data(), entries);
    for (Index e = 0; options.weights && e < entries; ++e) {
      points.weights(row, e) = (*options.weights)(good[k], options.weights->cols() == 1 ? 0 : e);
    }
  }
  unit = points.frequency.size() > 0 ? points.frequency.maxCoeff() : 1.0;
  unit = unit > 0.0 ? unit : 1.0;
  points.frequency /= unit;
  return points;
}

/// Poles and system on an imaginary axis.
Expected<FrequencyFit<ContinuousSystem<>>> fit_axis(const VectorXd& axis,
                                                    const std::vector<MatrixXcd>& response,
                                                    const FrequencyFitOptions& options) {
  double unit = 1.0;
  const Points points = points_of(axis, response, options, unit);
  const Index K = points.frequency.size();
  if (K < options.poles + 1 || points.frequency.maxCoeff() == 0.0) {
    return refusal(IdentificationError::too_short, in_fit_frequency_response)
        .hint("give more frequencies, or take fewer poles")
        .with("frequencies", static_cast<double>(K))
        .with("poles", static_cast<double>(options.poles));
  }
  const double size = points.weights.cwiseProduct(points.values.cwiseAbs()).norm();
  FrequencyFit<ContinuousSystem<>> fit;
  fit.frequencies = K;
  const VectorFit found = fit_vectors(points, options, size);
  const Poles& best = found.poles;
  fit.iterations = found.iterations;
  fit.error = size > 0.0 ? found.residues.errors.norm() / size : 0.0;
  fit.system = realize(best, found.residues.coefficients, response[0].rows(), response[0].cols(),
                       options.feedthrough, unit);
  fit.poles.resize(count_of(best));
  Index at = 0;
  for (const Pole& pole : best) {
    fit.poles(at++) = unit * Complex(pole.real, pole.imaginary);
    if (pole.imaginary > 0.0) {
      fit.poles(at++) = unit * Complex(pole.real, -pole.imaginary);
    }
  }
  return fit;
}

}  // namespace

Expected<FrequencyFit<ContinuousSystem<>>> fit_frequency_response(
    const VectorXd& frequency, const std::vector<MatrixXcd>& response,
    const FrequencyFitOptions& options) {
  FLYBALL_CHECK(check(frequency, response, options));
  return fit_axis(frequency, response, options);
}

Expected<FrequencyFit<DiscreteSystem<>>> fit_frequency_response(
    const VectorXd& frequency, const std::vector<MatrixXcd>& response, Time period,
    const FrequencyFitOptions& options) {
  FLYBALL_CHECK(check_positive(period.si(), in_fit_frequency_response, "period", "s"));
  FLYBALL_CHECK(check(frequency, response, options));
  // w = (z - 1)/(z + 1) is j tan(ωT/2) on the circle. At half the sample rate it has no place.
  VectorXd axis = 0.5 * period.si() * frequency;
  if (axis(axis.size() - 1) >= 0.5 * std::numbers::pi * (1.0 + 1e-9)) {
    return refusal(ArgumentError::out_of_range, in_fit_frequency_response, "frequency")
        .got(format_number(frequency(frequency.size() - 1)) + " rad/s")
        .expected("below half the sample rate, " + format_number(std::numbers::pi / period.si()) +
                  " rad/s");
  }
  std::vector<MatrixXcd> values = response;
  for (Index k = 0; k < axis.size(); ++k) {
    if (axis(k) > 0.5 * std::numbers::pi * (1.0 - 1e-6)) {
      values[static_cast<std::size_t>(k)].setConstant(std::numeric_limits<double>::quiet_NaN());
      axis(k) = 1e6;
    } else {
      axis(k) = std::tan(axis(k));
    }
  }
  FLYBALL_TRY(const FrequencyFit<ContinuousSystem<>> fit, fit_axis(axis, values, options));
  FrequencyFit<DiscreteSystem<>> discrete;
  FLYBALL_TRY(discrete.system, discretize(fit.system, Time(2.0), ConversionMethod::tustin));
  discrete.system.period = period;
  discrete.poles = ((1.0 + fit.poles.array()) / (1.0 - fit.poles.array())).matrix();
  discrete.error = fit.error;
  discrete.frequencies = fit.frequencies;
  discrete.iterations = fit.iterations;
  return discrete;
}

MatrixXd weights_of(const FrequencyResponseEstimate& estimate) {
  const auto K = static_cast<Index>(estimate.radius.size());
  MatrixXd weights = MatrixXd::Zero(K, K > 0 ? estimate.radius[0].size() : 0);
  for (Index k = 0; k < K; ++k) {
    const MatrixXd& radius = estimate.radius[static_cast<std::size_t>(k)];
    const MatrixXcd& G = estimate.response[static_cast<std::size_t>(k)];
    for (Index e = 0; e < radius.size(); ++e) {
      // Without noise the radius is rounding: no point counts more than 10⁸ of its value.
      const double least = 1e-8 * std::abs(G(e));
      if (std::isfinite(radius(e)) && std::isfinite(least) && std::max(radius(e), least) > 0.0) {
        weights(k, e) = 1.0 / std::max(radius(e), least);
      }
    }
  }
  return weights;
}

}  // namespace flyball::identification
