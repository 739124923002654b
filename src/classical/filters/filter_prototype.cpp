#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <flyball/classical/filters/iir_design.hpp>

#include "classical/filters/elliptic_functions.hpp"
#include "classical/filters/root_sections.hpp"
#include "classical/polynomial.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"

namespace flyball::classical {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using std::numbers::ln10;

/// √(10^(dB/10) - 1): how far a loss is from none.
double excess(double decibels) {
  return std::sqrt(std::expm1(decibels * ln10 / 10.0));
}

/// The pairs p, p* and, of an odd order, one real pole, into a vector.
class Roots {
 public:
  void add(Complex root) {
    if (root.imag() == 0.0) {
      all_.push_back(root);
    } else {
      all_.push_back({root.real(), std::abs(root.imag())});
      all_.push_back({root.real(), -std::abs(root.imag())});
    }
  }
  [[nodiscard]] VectorXcd vector() const {
    return VectorXcd::Map(all_.data(), static_cast<Index>(all_.size()));
  }

 private:
  std::vector<Complex> all_;
};

/// -sin θ + j cos θ for θ = (2i + 1)π/2n, the pole's place on the circle; both exact near the axes.
struct Place {
  double sine;
  double cosine;
};
Place place(int i, int order) {
  const double numerator = 2.0 * i + 1.0;
  const double angle = pi * numerator / (2.0 * order);
  const double rest = pi * (order - numerator) / (2.0 * order);
  return numerator == order ? Place{1.0, 0.0} : Place{std::sin(angle), std::sin(rest)};
}

AnalogFilter butterworth(int order) {
  Roots poles;
  for (int i = 0; 2 * i < order; ++i) {
    const Place at = place(i, order);
    poles.add({-at.sine, at.cosine});
  }
  return {VectorXcd(), poles.vector(), 1.0};
}

AnalogFilter chebyshev1(int order, double ripple) {
  const double width = std::asinh(1.0 / excess(ripple)) / order;
  Roots poles;
  for (int i = 0; 2 * i < order; ++i) {
    const Place at = place(i, order);
    poles.add({-std::sinh(width) * at.sine, std::cosh(width) * at.cosine});
  }
  return {VectorXcd(), poles.vector(), 1.0};
}

AnalogFilter chebyshev2(int order, double attenuation) {
  const double width = std::asinh(excess(attenuation)) / order;
  Roots zeros;
  Roots poles;
  for (int i = 0; 2 * i < order; ++i) {
    const Place at = place(i, order);
    if (at.cosine != 0.0) {
      zeros.add({0.0, 1.0 / at.cosine});
    }
    poles.add(1.0 / Complex(-std::sinh(width) * at.sine, std::cosh(width) * at.cosine));
  }
  return {zeros.vector(), poles.vector(), 1.0};
}

AnalogFilter elliptic(int order, double ripple, double attenuation) {
  const double pass = excess(ripple);
  const double stop = excess(attenuation);
  // k₁ = ε_p/ε_s; 1 - k₁² = 10^(ripple/10) (10^((attenuation - ripple)/10) - 1)/ε_s²
  const detail::Modulus losses{pass / stop,
                               std::pow(10.0, ripple / 20.0) * excess(attenuation - ripple) / stop};
  // The degree equation: the nome of k is that of k₁ to the power 1/n.
  const detail::Modulus m = detail::modulus_of(detail::log_nome(losses) / order);
  // sc(v, k₁') = 1/ε_p; as a fraction of K'.
  const detail::Modulus other = losses.complementary();
  const double whole = detail::complete_integral(other);
  const auto fraction_of = [&](double tangent) {
    const double hypotenuse = std::hypot(1.0, tangent);
    return detail::incomplete_integral(tangent / hypotenuse, 1.0 / hypotenuse, other) / whole;
  };
  const detail::JacobiFunctions v =
      detail::jacobi(fraction_of(1.0 / pass), fraction_of(stop), m.complementary());

  Roots zeros;
  Roots poles;
  for (int j = 1 - order % 2; j < order; j += 2) {
    const double fraction = static_cast<double>(j) / order;
    const auto [s, c, d] = detail::jacobi(fraction, static_cast<double>(order - j) / order, m);
    if (j > 0) {
      zeros.add({0.0, 1.0 / (m.k * s)});
    }
    // 1 - (dn sn')² = cn'² + (k sn sn')²
    const double below = v.cn * v.cn + m.k * m.k * s * s * v.sn * v.sn;
    poles.add({-c * d * v.sn * v.cn / below, s * v.dn / below});
  }
  return {zeros.vector(), poles.vector(), 1.0};
}

/// The roots of θ_n(s) = (2n - 1) θ_{n-1} + s² θ_{n-2}, over θ_n(0)^(1/n).
Expected<AnalogFilter> bessel(int order) {
  Eigen::VectorXd one(1);
  one << 1.0;
  Eigen::VectorXd two(2);
  two << 1.0, 1.0;
  Eigen::VectorXd square(3);
  square << 1.0, 0.0, 0.0;
  detail::Polynomial before = detail::polynomial(one);
  detail::Polynomial theta = detail::polynomial(two);
  double log_constant = 0.0;
  for (int n = 2; n <= order; ++n) {
    one(0) = 2.0 * n - 1.0;
    detail::Polynomial next = detail::plus(detail::times(theta, detail::polynomial(one)), 1.0,
                                           detail::times(before, detail::polynomial(square)));
    before = std::move(theta);
    theta = std::move(next);
    log_constant += std::log(2.0 * n - 1.0);  // θ_n(0) = 1·3·5 … (2n - 1)
  }
  auto roots = detail::roots(theta);
  if (!roots) {
    return refusal(ArgumentError::out_of_range, "filter_prototype", "order")
        .got(std::to_string(order))
        .expected("one whose Bessel polynomial has roots that are found");
  }
  return AnalogFilter{VectorXcd(), *roots / std::exp(log_constant / order), 1.0};
}

}  // namespace

Expected<AnalogFilter> filter_prototype(FilterFamily family, int order, double ripple,
                                        double attenuation) {
  constexpr std::string_view where = "filter_prototype";
  constexpr int most = 20;
  if (order < 1 || order > most) {
    return refusal(ArgumentError::out_of_range, where, "order")
        .got(std::to_string(order))
        .expected("1 to " + std::to_string(most));
  }
  const bool in_pass = family == FilterFamily::chebyshev1 || family == FilterFamily::elliptic;
  const bool in_stop = family == FilterFamily::chebyshev2 || family == FilterFamily::elliptic;
  if (in_pass) {
    FLYBALL_CHECK(check_within(ripple, 1e-12, 300.0, where, "ripple", "dB"));
  }
  if (in_stop) {
    FLYBALL_CHECK(check_within(attenuation, 1e-12, 3000.0, where, "attenuation", "dB"));
  }
  if (family == FilterFamily::elliptic && !(attenuation > ripple)) {
    return refusal(ArgumentError::out_of_range, where, "attenuation")
        .got(format_number(attenuation) + " dB")
        .expected("above the ripple, which is " + format_number(ripple) + " dB");
  }
  AnalogFilter prototype;
  switch (family) {
    case FilterFamily::butterworth:
      prototype = butterworth(order);
      break;
    case FilterFamily::chebyshev1:
      prototype = chebyshev1(order, ripple);
      break;
    case FilterFamily::chebyshev2:
      prototype = chebyshev2(order, attenuation);
      break;
    case FilterFamily::elliptic:
      prototype = elliptic(order, ripple, attenuation);
      break;
    case FilterFamily::bessel: {
      FLYBALL_TRY(prototype, bessel(order));
      break;
    }
  }
  // One at rest; of an even order, where ripples begin at their depth, that.
  const double at_rest = detail::root_quotient(prototype.zeros, prototype.poles, 1.0, 0.0).real();
  const double depth = in_pass && order % 2 == 0 ? std::pow(10.0, -ripple / 20.0) : 1.0;
  prototype.gain = depth / at_rest;
  return prototype;
}

}  // namespace flyball::classical
