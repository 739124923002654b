#include <flyball/classical/delay_poles.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_characteristic.hpp"
#include "classical/delay_pole_count.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_blocks.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
using detail::Characteristic;
using detail::count_right_of;
using detail::endless_from;
using detail::jump_abscissa;
using detail::largest_radius;
using detail::PoleCountWork;
using detail::radius_of;
using flyball::detail::eigenvalues_of;

namespace {

constexpr Index most_points = 400;
constexpr std::size_t most_poles = 30;
/// Of which the rightmost are kept: seeds are near the zeros that they lead to.
constexpr std::size_t most_candidates = 4 * most_poles;
constexpr std::string_view in_poles = "poles";

Refusal not_found(std::string got) {
  return refusal(SystemError::no_convergence, in_poles, "the set of rightmost poles")
      .got(std::move(got))
      .hint("a rational approximation has as many poles as its order (`pade`)");
}

/// The frequency beyond which no loop has a gain that matters.
double highest_frequency(const Characteristic& f) {
  double fastest = 1.0 / f.delays().maxCoeff();
  for (const Complex& pole : f.open_poles()) {
    fastest = std::max(fastest, std::abs(pole));
  }
  const double jumps = radius_of(f.jumps().cwiseAbs());
  const double threshold = jumps + 0.45 * (1.0 - jumps);
  constexpr double most = 1e300;
  double top = std::min(2.0 * fastest, most);
  for (int i = 0; i < 200 && top < most && f.gain(top) > threshold; ++i) {
    top *= 2.0;
  }
  double highest = 1.0 / f.delays().maxCoeff();
  for (double w = top; w > highest; w *= 0.97) {
    if (f.gain(w) > threshold) {
      highest = w / 0.97;
      break;
    }
  }
  for (const Complex& pole : f.open_poles()) {
    const double w = std::abs(pole.imag());
    if (w > highest && f.gain(w) > threshold) {
      highest = w;
    }
  }
  return highest;
}

/// Newton's method on the determinant: s ← s - 1/tr(M⁻¹M').
std::optional<Complex> refined(const Characteristic& f, Complex s) {
  const Complex start = s;
  double last = infinity;
  for (int i = 0; i < 60; ++i) {
    const MatrixXcd X = flyball::detail::solve_complex(f.at(s), f.slope(s));
    const Complex trace = X.trace();
    if (!std::isfinite(trace.real()) || !std::isfinite(trace.imag())) {
      return s;  // singular: there
    }
    const Complex step = 1.0 / trace;
    if (!std::isfinite(step.real()) || !std::isfinite(step.imag())) {
      return std::nullopt;
    }
    s -= step;
    const double size = std::abs(step);
    if (size <= 4e-16 * std::abs(s) || (size <= 1e-9 * std::abs(s) && size >= 0.5 * last)) {
      return s;
    }
    if (size < 1e-300) {
      return s;
    }
    last = size;
    if (std::abs(s - start) > 0.5 * (1.0 + std::abs(start))) {
      return std::nullopt;
    }
  }
  return last <= 1e-7 * (1.0 + std::abs(s)) ? std::optional(s) : std::nullopt;
}

void sort_by_real_part(std::vector<Complex>& poles) {
  std::sort(poles.begin(), poles.end(), [](Complex a, Complex b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
  });
}

/// What Newton's method begins with, in the upper half-plane: the eigenvalues of the discretised
/// delay lines.
std::vector<Complex> seeds(const Characteristic& f, const std::vector<Index>& points) {
  std::vector<Complex> rough;
  for (const Complex& value : eigenvalues_of(f.discretised(points))) {
    if (value.imag() >= 0.0 && std::isfinite(value.real())) {
      rough.push_back(value);
    }
  }
  sort_by_real_part(rough);
  rough.resize(std::min(rough.size(), most_poles));
  return rough;
}

/// The same of long delays: near jω an eigenvalue λ of the loop is 1 at jω + ln λ/τ.
std::vector<Complex> seeds_along_the_axis(const Characteristic& f, double highest) {
  const double longest = f.delays().maxCoeff();
  const double step = 0.4 * std::numbers::pi / longest;
  std::vector<Complex> rough;
  for (const Complex& pole : f.open_poles()) {
    rough.emplace_back(pole.real(), std::abs(pole.imag()));
  }
  for (double w = 0.0; w <= highest + 2.0 * step; w += step) {
    const Complex s(0.0, w);
    const MatrixXcd loop = f.around(s) * f.late(s).asDiagonal();
    if (!loop.allFinite()) {
      continue;
    }
    for (const Complex& value : flyball::detail::eigenvalues_of_complex(loop)) {
      if (std::abs(value) > 1e-6) {
        rough.push_back(s + std::log(value) / longest);
      }
    }
  }
  std::erase_if(rough, [](const Complex& s) { return s.imag() < 0.0; });
  sort_by_real_part(rough);
  return rough;
}

/// The rightmost zeros in the upper half-plane, refined, without repetitions.
/// @param multiple  Seeds that lie closer than a thousandth to each other are taken for a zero that
/// is there several times.
std::vector<Complex> candidates(const Characteristic& f, const std::vector<Complex>& rough,
                                bool multiple) {
  std::vector<Complex> found;
  std::vector<Complex> origins;
  for (const Complex& value : rough) {
    if (found.size() == most_candidates) {
      break;
    }
    const auto pole = refined(f, value);
    const double size = std::abs(value) + 1.0 / f.delays().maxCoeff();
    if (!pole || (multiple && std::abs(*pole - value) > 0.1 * size)) {
      continue;
    }
    Complex s = *pole;
    if (std::abs(s.imag()) <= 1e-10 * std::abs(s) || value.imag() == 0.0) {
      s.imag(0.0);
    }
    bool known = false;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const bool same = std::abs(found[i] - s) <= 1e-9 * size;
      known = known || (same && (!multiple || std::abs(origins[i] - value) > 1e-3 * size));
    }
    if (!known && s.imag() >= 0.0) {
      found.push_back(s);
      origins.push_back(value);
    }
  }
  sort_by_real_part(found);
  found.resize(std::min(found.size(), most_poles));
  return found;
}

/// Right of the line there is what is unstable and one more at least; left of it none of the
/// neighbours that rounding would mix up with those.
double dividing_line(const Characteristic& f, const std::vector<Complex>& upper, double jumps) {
  const double leftmost = 0.7 * jumps;  // Chains of poles tend to `jumps`.
  const double longest = f.delays().maxCoeff();
  const auto middle = [&](std::size_t i) { return 0.5 * (upper[i].real() + upper[i + 1].real()); };
  // Where all that were looked for are unstable the widest gap among the later ones serves.
  const bool all_unstable = upper.size() == most_poles && upper.back().real() >= 0.0;
  double line = std::max(upper.back().real() - 1e-3 * (1.0 + std::abs(upper.back())), leftmost);
  double widest = 0.0;
  for (std::size_t i = all_unstable ? upper.size() / 2 : 0; i + 1 < upper.size(); ++i) {
    const double gap = upper[i].real() - upper[i + 1].real();
    const double worth = gap * std::exp(middle(i) * longest) / (1.0 + static_cast<double>(i));
    if ((all_unstable || upper[i + 1].real() < 0.0) && worth > widest && middle(i) > leftmost) {
      widest = worth;
      line = middle(i);
    }
  }
  return line;
}

/// Those right of the line and the first, with the conjugates; nothing where the count of those
/// that are there is another.
std::optional<DelayPoles> counted(const Characteristic& f, const std::vector<Complex>& upper,
                                  double jumps, double highest, PoleCountWork& work) {
  if (upper.empty()) {
    return std::nullopt;
  }
  const double line = dividing_line(f, upper, jumps);
  std::vector<Complex> all;
  int right = 0;
  for (std::size_t i = 0; i < upper.size(); ++i) {
    const int times = upper[i].imag() > 0.0 ? 2 : 1;
    right += upper[i].real() > line ? times : 0;
    if (upper[i].real() > line || i == 0) {
      all.push_back(upper[i]);
      if (times == 2) {
        all.push_back(std::conj(upper[i]));
      }
    }
  }
  if (count_right_of(f, line, highest, work) != right) {
    return std::nullopt;
  }
  DelayPoles found;
  found.poles = Eigen::Map<const VectorXcd>(all.data(), static_cast<Index>(all.size()));
  const double rounding = 1e-13 * (highest + found.poles.cwiseAbs().maxCoeff());
  if (line <= -rounding) {
    for (const Complex& pole : all) {
      found.unstable += pole.real() > -rounding ? 1 : 0;
    }
    return found;
  }
  // More are unstable than are listed.
  for (const double border : {-rounding, -1e4 * rounding, 1e4 * rounding}) {
    if (const auto unstable = count_right_of(f, border, highest, work)) {
      found.unstable = *unstable;
      return found;
    }
  }
  return std::nullopt;
}

/// The rightmost, and the count of those right of a line in the widest gap.
Expected<DelayPoles> judged(const Characteristic& f, double jumps) {
  const double highest = highest_frequency(f);
  PoleCountWork work(f);
  for (int attempt = 0; attempt < 3; ++attempt) {
    std::vector<Index> points;
    double total = static_cast<double>(f.states());
    for (const double delay : f.delays()) {
      const double wanted = (16.0 + 0.7 * highest * delay) * (1.0 + 0.5 * attempt);
      total += wanted;
      points.push_back(static_cast<Index>(std::min(wanted, 1e6)));
    }
    if (total > static_cast<double>(most_points)) {
      break;
    }
    if (auto answer = counted(f, candidates(f, seeds(f, points), true), jumps, highest, work)) {
      return *std::move(answer);
    }
  }
  constexpr double most_turned = 3e4;  // rad
  if (highest * f.delays().maxCoeff() > most_turned) {
    return not_found(flyball::detail::format(
        "out of reach: the loops' gain matters up to {} rad/s, at which the delays are {} rad",
        highest, highest * f.delays().sum()));
  }
  if (auto answer = counted(f, candidates(f, seeds_along_the_axis(f, highest), false), jumps,
                            highest, work)) {
    return *std::move(answer);
  }
  return not_found("not found: their number does not agree with the turns of the determinant");
}

DelayPoles of_matrix(const MatrixXd& A, bool discrete) {
  DelayPoles found;
  found.high_frequency_abscissa = -infinity;
  const VectorXcd values = flyball::detail::eigenvalues_by_parts_of(A);
  std::vector<Complex> all(values.begin(), values.end());
  sort_by_real_part(all);
  if (discrete) {
    std::stable_sort(all.begin(), all.end(),
                     [](Complex a, Complex b) { return std::abs(a) > std::abs(b); });
  }
  found.poles = Eigen::Map<const VectorXcd>(all.data(), static_cast<Index>(all.size()));
  for (const Complex& pole : all) {
    found.unstable += (discrete ? std::abs(pole) >= 1.0 : pole.real() >= 0.0) ? 1 : 0;
  }
  found.stable = found.unstable == 0;
  return found;
}

}  // namespace

Expected<DelayPoles> rightmost_poles(const DelaySystem& system) {
  if (system.period()) {
    return system.to_discrete().map(
        [](const DiscreteSystem<>& states) { return of_matrix(states.A, true); });
  }
  if (!system.has_delay_in_loop()) {
    return of_matrix(system.form().A, false);
  }
  const Characteristic f(system.form());
  const double jumps = jump_abscissa(f.jumps(), f.delays());
  if (radius_of(f.jumps().cwiseAbs()) >= endless_from) {
    const double radius = largest_radius(f.jumps());
    if (radius >= endless_from) {
      DelayPoles found;
      found.high_frequency_abscissa = std::max(jumps, 0.0);
      found.unstable = std::numeric_limits<int>::max();
      return found;
    }
    return not_found(flyball::detail::format(
        "not decided: jumps go round loops without a state with a gain between {} and {}", radius,
        radius_of(f.jumps().cwiseAbs())));
  }
  return judged(f, jumps).map([&](DelayPoles&& found) {
    found.high_frequency_abscissa = jumps;
    found.stable = found.unstable == 0;
    return std::move(found);
  });
}

Expected<bool> is_stable(const DelaySystem& system) {
  return rightmost_poles(system).map([](const DelayPoles& found) { return found.stable; });
}

}  // namespace flyball::classical
