#include <flyball/study/frequency_points.hpp>

#include <cmath>
#include <numbers>

namespace flyball::study {

void append(std::vector<FrequencyPoint>& response, double frequency, std::complex<double> value) {
  FrequencyPoint point{frequency, std::abs(value), std::arg(value)};
  const double turn = 2.0 * std::numbers::pi;
  if (!response.empty()) {
    point.phase += turn * std::round((response.back().phase - point.phase) / turn);
  } else if (point.phase > 0.375 * turn) {  // half a turn is half a turn late
    point.phase -= turn;
  }
  response.push_back(point);
}

std::vector<double> frequencies_between(double first, double last, int count) {
  std::vector<double> frequencies;
  for (int i = 0; i < count; ++i) {
    frequencies.push_back(first * std::pow(last / first, i / (count - 1.0)));
  }
  frequencies.back() = last;
  return frequencies;
}

}  // namespace flyball::study
