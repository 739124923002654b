#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/classical/filters/iir_design.hpp>

// What the tests of filters share.
namespace flyball::classical::test {

using Complex = std::complex<double>;

/// Each wanted root has its own found one within a distance.
inline void expect_roots(const Eigen::VectorXcd& found, std::vector<Complex> wanted,
                         double tolerance) {
  ASSERT_EQ(found.size(), static_cast<Eigen::Index>(wanted.size()));
  for (const Complex root : found) {
    const auto nearest =
        std::ranges::min_element(wanted, {}, [&](Complex other) { return std::abs(other - root); });
    EXPECT_NEAR(std::abs(*nearest - root), 0.0, tolerance) << root;
    wanted.erase(nearest);
  }
}

/// Both of each pair.
inline std::vector<Complex> with_conjugates(const std::vector<Complex>& upper) {
  std::vector<Complex> all;
  for (const Complex root : upper) {
    all.push_back(root);
    if (root.imag() != 0.0) {
      all.push_back(std::conj(root));
    }
  }
  return all;
}

/// dB, positive.
inline double loss(Complex response) {
  return -20.0 * std::log10(std::abs(response));
}

constexpr FilterBand bands[] = {FilterBand::low_pass, FilterBand::high_pass, FilterBand::band_pass,
                                FilterBand::band_stop};
constexpr FilterFamily with_stop_band[] = {FilterFamily::butterworth, FilterFamily::chebyshev1,
                                           FilterFamily::chebyshev2, FilterFamily::elliptic};

}  // namespace flyball::classical::test
