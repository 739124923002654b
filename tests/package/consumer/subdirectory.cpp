#include <cmath>
#include <cstdio>

#include <flyball/core/version.hpp>
#include <flyball/planning/profiles/generate_trapezoid_profile.hpp>

using namespace flyball;
using namespace flyball::literals;

int main() {
  const auto refused = generate_trapezoid_profile(-1.0, 500_ms, 20_ms, 1.0);
  const auto profile = generate_trapezoid_profile(1.0, 500_ms, 20_ms, 1.0);
  if (refused || !profile) {
    return 1;
  }
  std::puts(to_string(refused.error()).c_str());
  // Half a second up, half a second at 1 m/s, half a second down.
  const double end = profile->time().back();
  std::printf("Flyball %s: %g s\n", version.data(), end);
  return std::abs(end - 1.5) < 0.021 ? 0 : 1;
}
