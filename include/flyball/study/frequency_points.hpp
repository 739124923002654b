#pragma once

#include <complex>
#include <vector>

namespace flyball::study {

/// A response at one frequency.
struct FrequencyPoint {
  double frequency = 0.0;  ///< rad/s
  double gain = 0.0;       ///< Its magnitude.
  double phase = 0.0;      ///< rad, continuous along the frequencies.
};

/// Adds a point; its phase is the one of those a turn apart that is next to the last point's.
void append(std::vector<FrequencyPoint>& response, double frequency, std::complex<double> value);

/// `count` frequencies from one to another, both included, in equal ratios.
[[nodiscard]] std::vector<double> frequencies_between(double first, double last, int count);

}  // namespace flyball::study
