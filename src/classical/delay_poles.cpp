#include <flyball/classical/delay_poles.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <flyball/systems/system_error.hpp>

#include "classical/delay_characteristic.hpp"
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
using detail::jump_abscissa;
using detail::largest_radius;
using detail::radius_of;
using flyball::detail::eigenvalues_of;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double pi = std::numbers::pi;
constexpr Index most_points = 500;
constexpr std::size_t most_poles = 30;
constexpr std::string_view where = "poles";

/// How much of an equation's own size a sum may vanish to.
Refusal not_found(std::string got) {
  return refusal(SystemError::no_convergence, where, "the rightmost poles")
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
  double top = 2.0 * fastest;
  for (int i = 0; i < 200 && f.gain(top) > threshold; ++i) {
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

/// arg det M, by elimination.
double angle_of(MatrixXcd M) {
  const Index n = M.rows();
  double angle = 0.0;
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i) {
      pivot = std::abs(M(i, k)) > std::abs(M(pivot, k)) ? i : pivot;
    }
    if (pivot != k) {
      M.row(pivot).swap(M.row(k));
      angle += pi;
    }
    angle += std::arg(M(k, k));
    for (Index i = k + 1; i < n; ++i) {
      const Complex factor = M(i, k) / M(k, k);
      M.row(i).tail(n - k - 1) -= factor * M.row(k).tail(n - k - 1);
    }
  }
  return std::remainder(angle, 2.0 * pi);
}

/// How many zeros lie right of Re s = line: the determinant's turns along it, and round the half
/// circle on which it is det(sI - A) but for loop gains below one. Nothing where it cannot be told.
std::optional<int> count_right_of(const Characteristic& f, double line, double highest) {
  double top = 2.0 * highest;
  for (const Complex& pole : f.open_poles()) {
    top = std::max(top, 4.0 * std::abs(pole));
  }
  const auto loop_gain = [&](Complex s) {
    const MatrixXd size = (f.around(s) * f.late(s).asDiagonal()).cwiseAbs();
    return size.allFinite() ? radius_of(size) : infinity;
  };
  const double jumps =
      radius_of(f.jumps().cwiseAbs() * (-line * f.delays()).array().exp().matrix().asDiagonal());
  for (int i = 0; i < 60 && loop_gain({line, top}) > jumps + 0.7 * (1.0 - jumps); ++i) {
    top *= 2.0;
  }
  const auto angle = [&](double w) { return angle_of(f.at({line, w})); };
  double turned = 0.0;
  double w = 0.0;
  double before = angle(0.0);
  const double shortest = 1e-9 * top;
  const double longest = 0.5 / f.delays().maxCoeff();
  double step = 1e-3 * longest;
  int evaluations = 0;
  while (w < top) {
    const double end = std::min(top, w + step);
    const double after = angle(end);
    const double change = std::remainder(after - before, 2.0 * pi);
    // That a half of it turns by half as much shows that no turn is missed.
    if (std::abs(change) > 0.4) {
      if (end - w <= 1e-12 * top + 1e-300) {
        return std::nullopt;
      }
      step = std::max(0.4 * (end - w), 1e-13 * top);
    } else {
      turned += change;
      w = end;
      before = after;
      step = std::min(std::abs(change) < 0.15 ? 1.6 * step : step, std::max(longest, shortest));
    }
    if (++evaluations > 300'000) {
      return std::nullopt;
    }
  }
  double arc = 0.0;
  for (const Complex& pole : f.open_poles()) {
    arc += std::arg(Complex(line, top) - pole);
  }
  const Complex end(line, top);
  const MatrixXcd loop = f.around(end) * f.late(end).asDiagonal();
  for (const Complex& value : flyball::detail::eigenvalues_of_complex(loop)) {
    if (!(std::abs(value) < 1.0)) {
      return std::nullopt;
    }
    arc += std::arg(1.0 - value);
  }
  const double count = (arc - turned) / pi;
  if (std::abs(count - std::round(count)) > 0.05) {
    return std::nullopt;
  }
  return static_cast<int>(std::lround(count));
}

void sort_by_real_part(std::vector<Complex>& poles) {
  std::sort(poles.begin(), poles.end(), [](Complex a, Complex b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
  });
}

/// The rightmost zeros in the upper half-plane, refined, without repetitions.
std::vector<Complex> candidates(const Characteristic& f, const std::vector<Index>& points) {
  std::vector<Complex> rough;
  for (const Complex& value : eigenvalues_of(f.discretised(points))) {
    if (value.imag() >= 0.0 && std::isfinite(value.real())) {
      rough.push_back(value);
    }
  }
  sort_by_real_part(rough);
  rough.resize(std::min(rough.size(), most_poles));
  std::vector<Complex> found;
  std::vector<Complex> origins;
  for (const Complex& value : rough) {
    const auto pole = refined(f, value);
    const double size = std::abs(value) + 1.0 / f.delays().maxCoeff();
    if (!pole || std::abs(*pole - value) > 0.1 * size) {
      continue;
    }
    Complex s = *pole;
    if (std::abs(s.imag()) <= 1e-10 * std::abs(s) || value.imag() == 0.0) {
      s.imag(0.0);
    }
    bool known = false;
    for (std::size_t i = 0; i < found.size(); ++i) {
      known = known ||
              (std::abs(found[i] - s) <= 1e-9 * size && std::abs(origins[i] - value) > 1e-3 * size);
    }
    if (!known && s.imag() >= 0.0) {
      found.push_back(s);
      origins.push_back(value);
    }
  }
  sort_by_real_part(found);
  return found;
}

/// With the conjugates, and a count right of a line in the widest gap.
Expected<DelayPoles> judged(const Characteristic& f, double jumps) {
  const double highest = highest_frequency(f);
  std::optional<DelayPoles> answer;
  for (int attempt = 0; attempt < 3 && !answer; ++attempt) {
    std::vector<Index> points;
    double total = static_cast<double>(f.states());
    for (const double delay : f.delays()) {
      const double wanted = (16.0 + 0.7 * highest * delay) * (1.0 + 0.5 * attempt);
      total += wanted;
      points.push_back(static_cast<Index>(std::min(wanted, 1e6)));
    }
    if (total > static_cast<double>(most_points)) {
      return not_found(flyball::detail::format(
          "out of reach: the loops' gain matters up to {} rad/s, at which the delays are {} rad",
          highest, highest * f.delays().sum()));
    }
    std::vector<Complex> upper = candidates(f, points);
    if (upper.empty()) {
      continue;
    }
    // Right of the line there is what is unstable and one more at least; left of it none of the
    // neighbours that rounding would mix up with those.
    const double leftmost = 0.7 * jumps;  // Chains of poles tend to `jumps`.
    std::size_t cut = upper.size();
    double widest = 0.0;
    for (std::size_t i = 0; i + 1 < upper.size(); ++i) {
      const double gap = upper[i].real() - upper[i + 1].real();
      const double middle = 0.5 * (upper[i].real() + upper[i + 1].real());
      const double worth =
          gap * std::exp(middle * f.delays().maxCoeff()) / (1.0 + static_cast<double>(i));
      const bool beyond = upper[i + 1].real() < 0.0;
      if (beyond && worth > widest && middle > leftmost) {
        widest = worth;
        cut = i + 1;
      }
    }
    const double line =
        cut < upper.size()
            ? 0.5 * (upper[cut - 1].real() + upper[cut].real())
            : std::max(upper.back().real() - 1e-3 * (1.0 + std::abs(upper.back())), leftmost);
    DelayPoles found;
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
    const auto counted = count_right_of(f, line, highest);
    if (!counted || *counted != right) {
      continue;
    }
    found.poles = Eigen::Map<const VectorXcd>(all.data(), static_cast<Index>(all.size()));
    const double rounding = 1e-13 * (highest + found.poles.cwiseAbs().maxCoeff());
    for (const Complex& pole : all) {
      found.unstable += pole.real() > -rounding ? 1 : 0;
    }
    answer = std::move(found);
  }
  if (!answer) {
    return not_found("not found: their number does not agree with the turns of the determinant");
  }
  return *std::move(answer);
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
  if (jumps >= 0.0) {
    const double radius = largest_radius(f.jumps());
    if (radius >= 1.0 - 1e-9) {
      DelayPoles found;
      found.high_frequency_abscissa = jumps;
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
