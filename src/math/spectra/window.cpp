#include <flyball/math/spectra/window.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"

namespace flyball {

std::string_view to_string(Window window) {
  switch (window) {
    case Window::rectangular:
      return "rectangular";
    case Window::hann:
      return "hann";
    case Window::hamming:
      return "hamming";
    case Window::blackman:
      return "blackman";
    case Window::blackman_harris:
      return "blackman-harris";
    case Window::flat_top:
      return "flat-top";
  }
  return "unknown";
}

Expected<Eigen::VectorXd> window_samples(Window window, Eigen::Index length) {
  if (length < 1) {
    return refusal(ArgumentError::out_of_range, "window_samples", "the length")
        .got(std::to_string(length))
        .expected("at least 1");
  }
  // a₀ - a₁ cos φ + a₂ cos 2φ - …
  std::vector<double> a;
  switch (window) {
    case Window::rectangular:
      a = {1.0};
      break;
    case Window::hann:
      a = {0.5, 0.5};
      break;
    case Window::hamming:
      a = {0.54, 0.46};
      break;
    case Window::blackman:
      a = {0.42, 0.5, 0.08};
      break;
    case Window::blackman_harris:
      a = {0.35875, 0.48829, 0.14128, 0.01168};
      break;
    case Window::flat_top:
      a = {0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368};
      break;
  }
  Eigen::VectorXd samples(length);
  for (Eigen::Index j = 0; j < length; ++j) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(length);
    double value = 0.0;
    double sign = 1.0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      value += sign * a[k] * std::cos(static_cast<double>(k) * angle);
      sign = -sign;
    }
    samples(j) = value;
  }
  return samples;
}

}  // namespace flyball
