#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <ranges>
#include <tuple>

#include "classical/filters/root_sections.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;

/// Roots of a real polynomial: one of each pair (imaginary part positive), and real ones.
struct RealRoots {
  std::vector<Complex> pairs;
  std::vector<double> real;
};

Expected<RealRoots> sorted(const VectorXcd& roots, std::string_view where, std::string_view name) {
  RealRoots found;
  std::vector<Complex> lower;
  for (const Complex root : roots) {
    if (root.imag() > 0.0) {
      found.pairs.push_back(root);
    } else if (root.imag() < 0.0) {
      lower.push_back(root);
    } else {
      found.real.push_back(root.real());
    }
  }
  const auto lonely = [&](Complex root) {
    return refusal(ArgumentError::malformed, where, name)
        .got("with " + format_number(root.real()) + (root.imag() < 0.0 ? " - " : " + ") +
             format_number(std::abs(root.imag())) + "j without its conjugate")
        .expected("in pairs of conjugates, for a real filter");
  };
  for (const Complex root : found.pairs) {
    const auto conjugate = std::ranges::min_element(
        lower, {}, [&](Complex other) { return std::abs(std::conj(root) - other); });
    if (conjugate == lower.end() ||
        std::abs(std::conj(root) - *conjugate) > 1e-9 * (1e-300 + std::abs(root))) {
      return lonely(root);
    }
    lower.erase(conjugate);
  }
  if (!lower.empty()) {
    return lonely(lower.front());
  }
  return found;
}

/// Takes from a list the entry for which `key` is least.
template <class T, class Key>
T take(std::vector<T>& from, Key key) {
  const auto found = std::ranges::min_element(from, {}, key);
  const T value = *found;
  from.erase(found);
  return value;
}

/// 1 - (r₁ + r₂) z⁻¹ + r₁ r₂ z⁻², or of one root, or of none: coefficients of z⁻¹ and z⁻².
struct RootFactor {
  int degree = 0;
  double first = 0.0;
  double second = 0.0;
};

RootFactor of_pair(Complex root) {
  return {2, -2.0 * root.real(), std::norm(root)};
}
RootFactor of_real(double a, std::optional<double> b) {
  return b ? RootFactor{2, -(a + *b), a * *b} : RootFactor{1, -a, 0.0};
}

double from_circle(Complex root) {
  return std::abs(1.0 - std::abs(root));
}

/// The zeros of a section whose poles are near a point.
/// @param degree  Of the section. @param later  Sections of second order that still come: they take
/// all pairs that are left.
RootFactor take_zeros(RealRoots& zeros, Complex near, int degree, std::size_t later) {
  const auto distance = [&](Complex zero) { return std::abs(zero - near); };
  if (degree == 2 && !zeros.pairs.empty()) {
    const bool real = zeros.real.size() >= 2 && zeros.pairs.size() <= later &&
                      std::ranges::min(zeros.real | std::views::transform(distance)) <
                          std::ranges::min(zeros.pairs | std::views::transform(distance));
    if (!real) {
      return of_pair(take(zeros.pairs, distance));
    }
  }
  if (zeros.real.empty()) {
    return {};
  }
  const double nearest = take(zeros.real, distance);
  if (degree == 1 || zeros.real.empty()) {
    return of_real(nearest, std::nullopt);
  }
  return of_real(nearest, take(zeros.real, [&](double zero) { return -distance(zero); }));
}

}  // namespace

Complex root_quotient(const VectorXcd& zeros, const VectorXcd& poles, double gain, Complex at) {
  Complex product = gain;
  for (Index i = 0; i < std::max(zeros.size(), poles.size()); ++i) {
    if (i < zeros.size()) {
      product *= at - zeros(i);
    }
    if (i < poles.size()) {
      product /= at - poles(i);
    }
  }
  return product;
}

Expected<std::vector<Biquad>> paired_sections(const VectorXcd& zeros, const VectorXcd& poles,
                                              std::string_view where) {
  FLYBALL_TRY(RealRoots from_poles, sorted(poles, where, "poles"));
  FLYBALL_TRY(RealRoots from_zeros, sorted(zeros, where, "zeros"));
  // Poles, in the order in which they choose: of pairs and real ones the nearest to the circle; a
  // real one that is left over last.
  struct Place {
    RootFactor factor;
    Complex near;
  };
  std::vector<Place> places;
  while (!from_poles.pairs.empty()) {
    const Complex pole = take(from_poles.pairs, from_circle);
    places.push_back({of_pair(pole), pole});
  }
  while (!from_poles.real.empty()) {
    const double pole = take(from_poles.real, from_circle);
    std::optional<double> other;
    if (!from_poles.real.empty()) {
      other = take(from_poles.real, from_circle);
    }
    places.push_back({of_real(pole, other), pole});
  }
  std::ranges::sort(places, {}, [](const Place& place) {
    return std::tuple(place.factor.degree == 1, from_circle(place.near), place.near.real());
  });

  auto later = static_cast<std::size_t>(
      std::ranges::count(places, 2, [](const Place& place) { return place.factor.degree; }));
  std::vector<Biquad> sections;
  for (const Place& place : places) {
    later -= place.factor.degree == 2 ? 1 : 0;
    const RootFactor top = take_zeros(from_zeros, place.near, place.factor.degree, later);
    // In z: z^m over z^n, so that what is missing is a delay.
    Biquad section{.a1 = place.factor.first, .a2 = place.factor.second};
    const std::array<double, 3> b{1.0, top.first, top.second};
    std::array<double, 3> shifted{};
    const int missing = place.factor.degree - top.degree;
    for (int i = 0; i + missing <= 2; ++i) {
      shifted[static_cast<std::size_t>(i + missing)] = b[static_cast<std::size_t>(i)];
    }
    section.b0 = shifted[0];
    section.b1 = shifted[1];
    section.b2 = shifted[2];
    sections.push_back(section);
  }
  if (sections.empty()) {
    sections.emplace_back();
  }
  std::ranges::reverse(sections);
  return sections;
}

void set_gains(std::vector<Biquad>& sections, double wanted, double angle) {
  const double rest = std::abs(angle) < 1e-300 ? 1.0 : 0.0;
  const bool half = std::abs(angle - std::numbers::pi) < 1e-15;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    Biquad& c = sections[i];
    double is = 0.0;
    if (rest == 1.0) {
      is = ((c.b0 + c.b1) + c.b2) / ((1.0 + c.a1) + c.a2);
    } else if (half) {
      is = ((c.b0 - c.b1) + c.b2) / ((1.0 - c.a1) + c.a2);
    } else {
      is = std::abs(section_response({&c, 1}, angle));
    }
    const double factor = (i == 0 ? wanted : 1.0) / std::abs(is);
    c.b0 *= factor;
    c.b1 *= factor;
    c.b2 *= factor;
  }
}

}  // namespace flyball::classical::detail
