#include <flyball/classical/root_locus.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/math/search/roots.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/locus_loop.hpp"
#include "classical/locus_trace.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

namespace {

using detail::LocusLoop;
using detail::Meeting;
using detail::MultipleRoot;
using detail::Polynomial;
using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double degrees_per_radian = 180.0 / pi;

double wrapped_angle(double angle) {
  const double turned = std::remainder(angle, 360.0);
  return turned <= -180.0 ? turned + 360.0 : turned;
}

/// The angles of the m-th roots of a number, deg.
std::vector<double> root_angles(Complex power, int m) {
  std::vector<double> angles;
  const double first = power.imag() == 0.0 ? (power.real() < 0.0 ? 180.0 : 0.0)
                                           : std::arg(power) * degrees_per_radian;
  for (int l = 0; l < m; ++l) {
    angles.push_back(wrapped_angle((first + 360.0 * l) / m));
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

/// At which branches meet for positive gains, by gain.
std::vector<Meeting> meetings_of(const LocusLoop& loop) {
  std::vector<Meeting> meetings;
  for (const MultipleRoot& point : detail::stationary_points(loop)) {
    const Complex L = loop.at(point.at);
    const Complex gain = -1.0 / L;
    // ln L is flat there: the point's own rounding does not show in the gain.
    if (point.at.imag() < 0.0 || !(gain.real() > 0.0) || !std::isfinite(gain.real()) ||
        std::abs(gain.imag()) > 1e-9 * gain.real()) {
      continue;
    }
    const int m = point.times + 1;
    double factorial = 1.0;
    for (int i = 2; i <= m; ++i) {
      factorial *= i;
    }
    Complex coefficient = loop.log_derivative(point.at, m) / factorial;
    coefficient = point.at.imag() == 0.0 ? Complex(coefficient.real()) : coefficient;
    meetings.push_back(
        {.gain = gain.real(), .point = point.at, .branches = m, .coefficient = coefficient});
  }
  if (loop.zero_count() == loop.pole_count() && loop.gain < 0.0) {
    const auto [order, coefficient] = loop.at_infinity();
    if (order > 0) {
      meetings.push_back({.gain = -1.0 / loop.gain,
                          .point = 0.0,
                          .infinite = true,
                          .branches = order,
                          .coefficient = coefficient});
    }
  }
  std::sort(meetings.begin(), meetings.end(),
            [](const Meeting& a, const Meeting& b) { return a.gain < b.gain; });
  return meetings;
}

/// L on the border of stability: at jω, or at e^{jωT}. @param w  rad/s' or rad a sample.
Complex border_point(const LocusLoop& loop, double w) {
  return loop.period ? std::polar(1.0, w) : Complex(0.0, w);
}

/// w of each crossing for a gain of either sign.
Expected<std::vector<double>> border_places(const LocusLoop& loop) {
  Polynomial num = loop.num;
  Polynomial den = loop.den;
  if (loop.period) {
    const Index degree = std::max(num.rows(), den.rows()) - 1;
    num = detail::bilinear(num, degree);
    den = detail::bilinear(den, degree);
  }
  const auto n = detail::on_the_axis(num);
  const auto d = detail::on_the_axis(den);
  using detail::times;
  const auto squares =
      detail::positive_roots(detail::plus(times(n.odd, d.even), -1.0, times(n.even, d.odd)));
  if (!squares) {
    return refusal(SystemError::no_convergence, "root_locus", "the crossings of the border")
        .got("not found");
  }
  std::vector<double> places{0.0};
  for (const double x : *squares) {
    double w = loop.period ? 2.0 * std::atan(std::sqrt(x)) : std::sqrt(x);
    // Polished on the factors: Im ln(-L) = 0 along the border.
    for (int i = 0; i < 4; ++i) {
      const Complex s = border_point(loop, w);
      const Complex turn =
          loop.log_derivative(s, 1) * (loop.period ? Complex(0.0, 1.0) * s : Complex(0.0, 1.0));
      const Complex L = loop.at(s);
      const double off = std::atan(L.imag() / L.real());
      const double step = off / turn.imag();
      if (!std::isfinite(step) || std::abs(step) > 1e-3 * w) {
        break;
      }
      w -= step;
    }
    places.push_back(w);
  }
  if (loop.period) {
    places.push_back(pi);
  }
  return places;
}

std::vector<BorderCrossing> crossings_of(const LocusLoop& loop, const std::vector<double>& places,
                                         double sign) {
  std::vector<BorderCrossing> crossings;
  for (const double w : places) {
    Complex s = border_point(loop, w);
    if (w == pi && loop.period) {
      s = -1.0;
    }
    const Complex gain = -1.0 / loop.at(s);
    // On a zero or a pole no branch crosses.
    if (!(gain.real() > 0.0) || !std::isfinite(gain.real()) ||
        std::abs(gain.imag()) > 1e-6 * gain.real()) {
      continue;
    }
    const double frequency = loop.period ? w / loop.period->si() : std::ldexp(w, loop.unit);
    crossings.push_back({frequency, loop.out(s), sign * gain.real()});
  }
  std::sort(crossings.begin(), crossings.end(),
            [](const auto& a, const auto& b) { return std::abs(a.gain) < std::abs(b.gain); });
  crossings.erase(std::unique(crossings.begin(), crossings.end(),
                              [](const auto& a, const auto& b) {
                                return std::abs(a.gain - b.gain) <= 1e-9 * std::abs(b.gain) &&
                                       std::abs(a.point - b.point) <= 1e-7 * std::abs(b.point);
                              }),
                  crossings.end());
  return crossings;
}

bool is_stable(const LocusLoop& loop, const VectorXcd& roots) {
  return std::all_of(roots.begin(), roots.end(), [&](const Complex& s) {
    return loop.period ? std::abs(s) < 1.0 : s.real() < 0.0;
  });
}

/// Between neighbouring crossings the closed loop is stable throughout, or nowhere.
std::vector<GainRange> stable_gains(const LocusLoop& loop, const RootLocus& locus,
                                    const detail::Trace& trace,
                                    const std::vector<Meeting>& meetings, double sign) {
  for (const Complex& s : loop.fixed) {
    if (loop.period ? std::abs(s) >= 1.0 : s.real() >= 0.0) {
      return {};
    }
  }
  std::vector<double> borders{0.0};
  for (const BorderCrossing& crossing : locus.crossings) {
    borders.push_back(std::abs(crossing.gain));
  }
  for (const Meeting& meeting : meetings) {
    if (meeting.infinite) {
      borders.push_back(meeting.gain);
    }
  }
  std::sort(borders.begin(), borders.end());
  std::vector<GainRange> ranges;
  for (std::size_t i = 0; i < borders.size(); ++i) {
    const double low = borders[i];
    const double high = i + 1 < borders.size() ? borders[i + 1] : infinity;
    if (high <= low * (1.0 + 1e-12)) {
      continue;
    }
    const double middle = low == 0.0         ? (high == infinity ? 1.0 : 0.5 * high)
                          : high == infinity ? 2.0 * low
                                             : std::sqrt(low * high);
    // From the row that is nearest, by its ratio.
    std::size_t nearest = 1;
    for (std::size_t row = 1; row < trace.gains.size(); ++row) {
      const auto off = [&](std::size_t r) { return std::abs(std::log(trace.gains[r] / middle)); };
      nearest = trace.rows[row].allFinite() && off(row) < off(nearest) ? row : nearest;
    }
    auto roots = detail::roots_at(loop, middle, trace.rows[nearest]);
    if (!roots) {
      roots = detail::roots(
          detail::plus(loop.den, 1.0,
                       detail::times(loop.num, detail::polynomial(VectorXd::Constant(1, middle)))));
    }
    if (roots && is_stable(loop, *roots)) {
      if (!ranges.empty() && ranges.back().high == sign * low) {
        ranges.back().high = sign * high;  // a branch that only touches the border
      } else {
        ranges.push_back({sign * low + 0.0, sign * high});
      }
    }
  }
  return ranges;
}

Expected<RootLocus> locus_of(LocusLoop loop, const RootLocusOptions& options) {
  if (options.largest_gain) {
    FLYBALL_CHECK(Checks("root_locus").positive(*options.largest_gain, "largest_gain"));
  }
  const double sign = options.negative ? -1.0 : 1.0;
  loop.gain *= sign;
  loop.num = flyball::detail::scaled(loop.num, sign);
  RootLocus locus;
  const auto listed = [&](const std::vector<MultipleRoot>& roots) {
    std::vector<Complex> all(loop.fixed);
    for (const MultipleRoot& root : roots) {
      all.insert(all.end(), static_cast<std::size_t>(root.times), loop.out(root.at));
    }
    return VectorXcd(Eigen::Map<const VectorXcd>(all.data(), static_cast<Index>(all.size())));
  };
  locus.zeros = listed(loop.zeros);
  locus.poles = listed(loop.poles);

  const std::vector<Meeting> meetings = meetings_of(loop);
  double size = loop.size();
  for (const Meeting& meeting : meetings) {
    if (meeting.infinite) {
      continue;
    }
    size = std::max(size, std::abs(meeting.point));
    locus.branch_points.push_back({loop.out(meeting.point), sign * meeting.gain, meeting.branches});
    if (meeting.point.imag() > 0.0) {
      locus.branch_points.push_back(
          {std::conj(loop.out(meeting.point)), sign * meeting.gain, meeting.branches});
    }
  }
  FLYBALL_TRY(const auto places, border_places(loop));
  locus.crossings = crossings_of(loop, places, sign);
  for (const BorderCrossing& crossing : locus.crossings) {
    size = std::max(size, std::ldexp(std::abs(crossing.point), -loop.unit));
  }

  const int excess = loop.pole_count() - loop.zero_count();
  Complex center = 0.0;
  for (const MultipleRoot& pole : loop.poles) {
    center += static_cast<double>(pole.times) * pole.at;
  }
  for (const MultipleRoot& zero : loop.zeros) {
    center -= static_cast<double>(zero.times) * zero.at;
  }
  locus.asymptotes.center = excess > 0 ? std::ldexp(center.real() / excess, loop.unit) : nan;
  if (excess > 0) {
    locus.asymptotes.angles = root_angles(-loop.gain, excess);
  }
  for (const MultipleRoot& pole : loop.poles) {
    locus.departures.push_back(
        {loop.out(pole.at), root_angles(-loop.rest(pole, true), pole.times)});
  }
  for (const MultipleRoot& zero : loop.zeros) {
    locus.arrivals.push_back(
        {loop.out(zero.at), root_angles(-1.0 / loop.rest(zero, false), zero.times)});
  }

  FLYBALL_TRY(const auto trace,
              detail::trace_locus(loop, meetings, options.largest_gain.value_or(infinity), size));
  const auto rows = static_cast<Index>(trace.gains.size());
  const auto fixed = static_cast<Index>(loop.fixed.size());
  locus.gains.resize(rows);
  locus.branches.resize(rows, fixed + loop.pole_count());
  for (Index row = 0; row < rows; ++row) {
    locus.gains(row) = sign * trace.gains[static_cast<std::size_t>(row)] + 0.0;  // no -0
    for (Index i = 0; i < fixed; ++i) {
      locus.branches(row, i) = loop.fixed[static_cast<std::size_t>(i)];
    }
    for (Index i = 0; i < loop.pole_count(); ++i) {
      locus.branches(row, fixed + i) = loop.out(trace.rows[static_cast<std::size_t>(row)](i));
    }
  }
  locus.stable_gains = stable_gains(loop, locus, trace, meetings, sign);
  return locus;
}

/// Zeros, poles and gain of C(sI - A)⁻¹B + D.
Expected<LocusLoop> loop_of(const ContinuousSystem<>& system, std::optional<Time> period) {
  constexpr std::string_view where = "root_locus";
  const Index n = system.A.rows();
  FLYBALL_CHECK(Checks(where)
                    .square(system.A, "A")
                    .shape(system.B, n, 1, "B", "states x 1")
                    .shape(system.C, 1, n, "C", "1 x states")
                    .shape(system.D, 1, 1, "D")
                    .finite(system.A, "A")
                    .finite(system.B, "B")
                    .finite(system.C, "C")
                    .finite(system.D, "D"));
  const VectorXcd poles = flyball::detail::eigenvalues_of(system.A);
  if (!poles.allFinite()) {
    return refusal(SystemError::no_convergence, where, "the eigenvalues of A").got("not found");
  }
  // Markov's first parameter that is not zero is the gain, and says how many zeros there are; they
  // are the invariant zeros of the system that is left after as many differentiations.
  Eigen::RowVectorXd row = system.C;
  double gain = system.D(0, 0);
  Index excess = 0;
  while (excess < n) {
    const double rounding = 1e-13 * row.norm() * system.B.norm();
    if (excess == 0 ? gain != 0.0 : std::abs(gain) > rounding) {
      break;
    }
    gain = row.dot(system.B.col(0));
    ++excess;
    if (std::abs(gain) > 1e-13 * row.norm() * system.B.norm()) {
      break;
    }
    if (excess < n) {
      row = (row * system.A).eval();
    }
  }
  if (gain == 0.0 || (excess == n && std::abs(gain) <= 1e-13 * row.norm() * system.B.norm())) {
    return detail::locus_loop(VectorXcd(0), poles, 0.0, period);
  }
  // Zero dynamics: y^(excess) = row A x + gain u = 0 (excess 0: C x + D u) closes u.
  const Eigen::RowVectorXd feed = excess == 0 ? row : Eigen::RowVectorXd(row * system.A);
  const Eigen::MatrixXd closed = system.A - system.B * feed / gain;
  const VectorXcd all = flyball::detail::eigenvalues_of(closed);
  if (!all.allFinite()) {
    return refusal(SystemError::no_convergence, where, "a zero").got("not found");
  }
  // `excess` of them are the integrators y … y^(excess - 1), at 0 with rounding: the ones whose
  // left vectors are C, CA, …: taken out by deflation on their complement.
  if (excess == 0) {
    return detail::locus_loop(all, poles, gain, period);
  }
  Eigen::MatrixXd rows(n, excess);
  Eigen::RowVectorXd power = system.C;
  for (Index i = 0; i < excess; ++i) {
    rows.col(i) = power.transpose() / std::max(power.norm(), 1e-300);
    power = (power * system.A).eval();
  }
  const auto [Q, R] = flyball::detail::full_qr(rows);
  const Eigen::MatrixXd rest = Q.rightCols(n - excess);
  const Eigen::MatrixXd inner = rest.transpose() * closed * rest;
  const VectorXcd zeros =
      n > excess ? flyball::detail::eigenvalues_of(inner) : VectorXcd(VectorXcd::Zero(0));
  if (!zeros.allFinite()) {
    return refusal(SystemError::no_convergence, where, "a zero").got("not found");
  }
  return detail::locus_loop(zeros, poles, gain, period);
}

}  // namespace

Expected<RootLocus> root_locus(const TransferFunction& loop, const RootLocusOptions& options) {
  FLYBALL_TRY(auto factors, detail::locus_loop(loop));
  return locus_of(std::move(factors), options);
}

Expected<RootLocus> root_locus(const ContinuousSystem<>& loop, const RootLocusOptions& options) {
  FLYBALL_TRY(auto factors, loop_of(loop, std::nullopt));
  return locus_of(std::move(factors), options);
}

Expected<RootLocus> root_locus(const DiscreteSystem<>& loop, const RootLocusOptions& options) {
  FLYBALL_CHECK(Checks("root_locus").positive(loop.period.si(), "period", "s"));
  FLYBALL_TRY(auto factors, loop_of({loop.A, loop.B, loop.C, loop.D}, loop.period));
  return locus_of(std::move(factors), options);
}

Expected<std::vector<LocusPoint>> locus_at_damping(const TransferFunction& given, double ratio) {
  constexpr std::string_view where = "root_locus";
  if (!(ratio >= 0.0 && ratio < 1.0)) {
    return refusal(ArgumentError::out_of_range, where, "the damping ratio")
        .got(format_number(ratio))
        .expected("from 0 to below 1");
  }
  FLYBALL_TRY(const auto loop, detail::locus_loop(given));
  const Complex ray(-ratio, std::sqrt(1.0 - ratio * ratio));
  const double damped = ray.imag();
  const auto at = [&](double w) { return loop.period ? std::exp(ray * w) : ray * w; };
  // On the locus the phase of -L is a whole number of turns: brackets of its sine with a positive
  // cosine. Steps shorter than the way to the nearest pole or zero see every turn.
  const auto phase = [&](double w) {
    const Complex L = -loop.at(at(w));
    return L.imag() / std::abs(L);
  };
  std::vector<LocusPoint> found;
  const double size = loop.size();
  const double end = loop.period ? pi / damped : 1e4 * size;
  double w = loop.period ? 1e-7 : 1e-7 * size;
  double before = phase(w);
  while (w < end) {
    double nearest = loop.period ? infinity : w;
    for (const auto* roots : {&loop.zeros, &loop.poles}) {
      for (const MultipleRoot& root : *roots) {
        nearest = std::min(nearest, std::abs(at(w) - root.at));
      }
    }
    const double length = loop.period ? std::abs(at(w)) : 1.0;
    const double step = std::clamp(
        0.3 * nearest / (length * static_cast<double>(loop.zeros.size() + loop.poles.size() + 1)),
        1e-4 * w, 0.1 * w);
    const double next = std::min(w + step, end);
    const double after = phase(next);
    if (std::isfinite(before) && std::isfinite(after) && before * after <= 0.0 && before != 0.0) {
      const auto root = find_root(phase, w, next, before, after);
      if (root) {
        const Complex s = at(root->x);
        const double gain = -(1.0 / loop.at(s)).real();
        if (gain > 0.0 && std::isfinite(gain)) {
          found.push_back({loop.out(s), gain});
        }
      }
    }
    w = next;
    before = after;
  }
  std::sort(found.begin(), found.end(),
            [](const LocusPoint& a, const LocusPoint& b) { return a.gain < b.gain; });
  return found;
}

Expected<GainAtPoint> gain_at_point(const TransferFunction& loop, Complex point) {
  FLYBALL_TRY(const Complex L, loop.at(point));
  if (L == 0.0) {
    return refusal(ArgumentError::out_of_range, "root_locus", "the point")
        .got("a zero of L")
        .expected("elsewhere: only an infinite gain puts a pole there");
  }
  const double negative = std::arg(-L);
  const bool of_positive = std::abs(negative) <= 0.5 * pi;
  return GainAtPoint{(of_positive ? 1.0 : -1.0) / std::abs(L),
                     (of_positive ? negative : std::arg(L)) * degrees_per_radian};
}

}  // namespace flyball::classical
