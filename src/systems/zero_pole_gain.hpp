#pragma once

#include <complex>
#include <optional>
#include <vector>

#include <flyball/systems/system.hpp>

namespace flyball::detail {

/// gain Π(s - zero) / Π(s - pole), conjugate pairs adjacent to nothing in particular.
struct ZeroPoleGain {
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
  double gain = 0.0;
};

/// Of a system with one input and one output; nothing if its transfer function is zero or the
/// eigenvalues did not converge. Modes that cannot be moved or seen appear as a zero on a pole.
[[nodiscard]] std::optional<ZeroPoleGain> zero_pole_gain(const ContinuousSystem<>& system);

/// Real first- and second-order sections in series, each with its poles in a real Jordan or
/// oscillator block, so that no polynomial is multiplied out.
[[nodiscard]] ContinuousSystem<> series_of_sections(const ZeroPoleGain& zpk);

}  // namespace flyball::detail
