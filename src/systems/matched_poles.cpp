#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include <flyball/core/text.hpp>
#include <flyball/systems/system_error.hpp>

#include "core/constants.hpp"
#include "core/try.hpp"
#include "systems/matched_poles.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;

Expected<void> check_single(const MatrixXd& D, std::string_view where) {
  if (D.rows() == 1 && D.cols() == 1) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, "the system")
      .got(std::to_string(D.rows()) + " outputs by " + std::to_string(D.cols()) + " inputs")
      .expected("one output by one input: only then are there zeros to match")
      .hint("convert each channel, or choose zoh");
}

/// (eˣ - 1)/x.
Complex phi(Complex x) {
  if (std::abs(x) < 0.5) {
    Complex sum = 1.0;
    Complex term = 1.0;
    for (int k = 2; k < 20; ++k) {
      term *= x / static_cast<double>(k);
      sum += term;
    }
    return sum;
  }
  return (std::exp(x) - 1.0) / x;
}

}  // namespace

Expected<DiscreteSystem<>> match_to_discrete(const ContinuousSystem<>& system, Time period) {
  constexpr std::string_view where = "discretize";
  FLYBALL_CHECK(check_single(system.D, where));
  const auto zpk = zero_pole_gain(system);
  if (!zpk) {
    return refusal(SystemError::zero_transfer, where, "the system")
        .hint("there is no gain to match; choose zoh");
  }
  const double T = period.si();
  ZeroPoleGain image;
  // G_d(1) = G(0): (1 - e^{pT})/(-p) = T φ₁(pT), which at the origin is T.
  Complex gain = zpk->gain;
  for (const Complex& p : zpk->poles) {
    image.poles.push_back(std::exp(p * T));
    gain *= T * phi(p * T);
  }
  for (const Complex& z : zpk->zeros) {
    // The zero of a small D far to the right: with the gain that belongs to it nothing is left.
    constexpr double largest_exponent = 300.0;
    if (z.real() * T > largest_exponent) {
      return refusal(SystemError::no_image, where, "a zero")
          .got("whose image exp(s T) a double cannot hold")
          .expected("s T below " + format_number(largest_exponent))
          .hint("shorten the period, set a negligible D to zero, or choose zoh")
          .with("zero", std::vector<double>{z.real(), z.imag()});
    }
    image.zeros.push_back(std::exp(z * T));
    gain /= T * phi(z * T);
  }
  for (std::size_t k = zpk->zeros.size() + 1; k < zpk->poles.size(); ++k) {
    image.zeros.emplace_back(-1.0);
    gain /= 2.0;
  }
  image.gain = gain.real();
  const ContinuousSystem<> sections = series_of_sections(image);
  DiscreteSystem<> discrete{sections.A, sections.B, sections.C, sections.D, period};
  return check_system(discrete, where).map([&] { return discrete; });
}

Expected<ContinuousSystem<>> match_to_continuous(const DiscreteSystem<>& system) {
  constexpr std::string_view where = "undiscretize";
  FLYBALL_CHECK(check_single(system.D, where));
  auto zpk = zero_pole_gain({system.A, system.B, system.C, system.D});
  if (!zpk) {
    return refusal(SystemError::zero_transfer, where, "the system");
  }
  // k equal zeros scatter by the k-th root of rounding.
  std::vector<Complex>& zeros = zpk->zeros;
  std::sort(zeros.begin(), zeros.end(),
            [](Complex a, Complex b) { return std::abs(a + 1.0) < std::abs(b + 1.0); });
  std::size_t at_infinity = 0;
  for (std::size_t k = zeros.size(); k > 0 && at_infinity == 0; --k) {
    const double scatter = 4.0 * std::pow(1e3 * epsilon, 1.0 / static_cast<double>(k));
    at_infinity = std::abs(zeros[k - 1] + 1.0) <= std::min(scatter, 0.3) ? k : 0;
  }
  zeros.erase(zeros.begin(), zeros.begin() + static_cast<std::ptrdiff_t>(at_infinity));
  const double T = system.period.si();
  ZeroPoleGain image;
  Complex gain = zpk->gain * std::ldexp(1.0, static_cast<int>(at_infinity));
  const auto map = [&](const std::vector<Complex>& from, std::vector<Complex>& to,
                       std::string_view what, bool pole) -> Expected<void> {
    for (const Complex& z : from) {
      if (std::abs(z) < 1e-300 || (z.imag() == 0.0 && z.real() <= 0.0)) {
        return refusal(SystemError::no_image, where, "the " + std::string(what))
            .got("zero or negative")
            .expected("off the closed negative real axis: e^{sT} of a real system is")
            .hint("choose tustin")
            .with(std::string(what), std::vector<double>{z.real(), z.imag()});
      }
      const Complex s = std::log(z) / T;
      to.push_back(s);
      gain = pole ? gain / (T * phi(s * T)) : gain * (T * phi(s * T));
    }
    return {};
  };
  FLYBALL_CHECK(map(zpk->poles, image.poles, "pole", true));
  FLYBALL_CHECK(map(zeros, image.zeros, "zero", false));
  image.gain = gain.real();
  ContinuousSystem<> continuous = series_of_sections(image);
  return check_system(continuous, where).map([&] { return continuous; });
}

}  // namespace flyball::detail
