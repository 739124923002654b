#include <cstdio>
#include <string>

#include <flyball/core/quantity.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/core/version.hpp>

using namespace flyball;

int main() {
  const auto refused = parse_quantity<Length>("5 V", "travel");
  const auto travel = parse_quantity<Length>("50 cm", "travel");
  const auto unit = parse_si_unit("kg m^2");
  if (refused || !travel || !unit) {
    return 1;
  }
  std::puts(to_string(refused.error()).c_str());
  std::printf("Flyball %s: %g m, %s\n", version.data(), travel->si(),
              to_text(unit->dimension).c_str());
  return travel->si() == 0.5 && unit->dimension.fits(si_dimension(Dimension::moment_of_inertia))
             ? 0
             : 1;
}
