#pragma once

#include <cmath>
#include <numbers>

/// The chord of sections E.3.2 and E.3.3.
namespace flyball::book {

struct Tone {
  const char* name;
  double hertz;
};
/// F major of the fourth octave.
constexpr Tone chord[] = {{"F4", 349.23}, {"A4", 440.0}, {"C4", 261.63}};

[[nodiscard]] inline double sound(const Tone& tone, double t) {
  return std::sin(2.0 * std::numbers::pi * tone.hertz * t);
}

}  // namespace flyball::book
