#pragma once

#include <complex>
#include <string_view>
#include <vector>

#include <flyball/classical/filters/digital_filter.hpp>

namespace flyball::classical::detail {

/// gain Π(at - zᵢ)/Π(at - pⱼ), multiplied so that it neither overflows nor underflows on the way.
[[nodiscard]] std::complex<double> root_quotient(const Eigen::VectorXcd& zeros,
                                                 const Eigen::VectorXcd& poles, double gain,
                                                 std::complex<double> at);

/// Sections with b0 = 1 (or b0 = 0 and the next one 1 where there are less zeros than poles).
/// @errors ArgumentError::malformed for a root without its conjugate.
[[nodiscard]] Expected<std::vector<Biquad>> paired_sections(const Eigen::VectorXcd& zeros,
                                                            const Eigen::VectorXcd& poles,
                                                            std::string_view where);

/// Scales each section's zeros to a gain of one at an angle of the unit circle, by the coefficients
/// as they are rounded; the first one to `wanted`.
void set_gains(std::vector<Biquad>& sections, double wanted, double angle);

}  // namespace flyball::classical::detail
