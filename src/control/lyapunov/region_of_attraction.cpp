#include <flyball/control/lyapunov/region_of_attraction.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

#include <flyball/core/random.hpp>
#include <flyball/math/equations/matrix_equation.hpp>

#include "control/lyapunov/loop_enclosure.hpp"
#include "control/lyapunov/saturated_loop.hpp"
#include "core/constants.hpp"
#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

ErrorInfo error_info(RegionError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_an_equilibrium", "the loop does not rest at the point", ErrorKind::no_answer},
      {"not_stable", "small deviations from the point do not die out", ErrorKind::no_answer},
      {"not_enclosed", "the model cannot be bounded near the point", ErrorKind::no_answer},
  };
  return detail::info_of(code, "region of attraction", rows);
}

namespace {

using detail::CellBound;
using detail::LoopEnclosure;
using detail::RegionCell;

constexpr std::string_view in_certify_region = "certify_region";

/// A number with few digits, no less than x: halved often it stays exact.
double short_above(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  constexpr double digits = 1024.0;
  return std::ldexp(std::ceil(mantissa * digits) / digits, exponent);
}

/// Coordinates in which V = |z|² and the linear loop's rate is diagonal.
struct Frame {
  Eigen::MatrixXd P;
  Eigen::MatrixXd T;
};

Expected<Frame> frame_of(const SaturatedLoop& loop, const RegionOptions& options) {
  const Eigen::Index n = loop.model.states;
  const detail::LinearPart linear = detail::linear_part(loop);
  const Eigen::MatrixXd closed = linear.A - linear.B * loop.K;
  Frame frame;
  if (options.P.size() > 0) {
    FLYBALL_CHECK(Checks(in_certify_region)
                      .shape(options.P, n, n, "P", "states x states")
                      .finite(options.P, "P")
                      .symmetric(options.P, "P"));
    frame.P = detail::symmetrized(options.P);
  } else {
    const Eigen::MatrixXd Q = options.Q.size() > 0 ? options.Q : Eigen::MatrixXd::Identity(n, n);
    FLYBALL_CHECK(Checks(in_certify_region)
                      .shape(Q, n, n, "Q", "states x states")
                      .finite(Q, "Q")
                      .symmetric(Q, "Q"));
    if (!detail::cholesky_of(Q)) {
      return refusal(ArgumentError::not_positive, in_certify_region, "Q")
          .got("not positive definite")
          .expected("positive definite");
    }
    const Eigen::VectorXcd poles = detail::eigenvalues_of(closed);
    for (const std::complex<double>& pole : poles) {
      if (!(pole.real() < 0.0)) {
        return refusal(RegionError::not_stable, in_certify_region, "A - B K")
            .got("not stable")
            .hint("give a K that stabilises the linearisation")
            .with("pole", {pole.real(), pole.imag()});
      }
    }
    FLYBALL_TRY(auto solved, lyapunov(closed.transpose(), Q));
    frame.P = detail::symmetrized(solved.X);
  }
  const auto L = detail::cholesky_of(frame.P);
  if (!L) {
    if (options.P.size() > 0) {
      return refusal(ArgumentError::not_positive, in_certify_region, "P")
          .got("not positive definite")
          .expected("positive definite");
    }
    return refusal(RegionError::not_stable, in_certify_region, "A - B K")
        .got("not stable beyond rounding");
  }
  const Eigen::MatrixXd upper = L->transpose();
  const Eigen::MatrixXd T = detail::solve_linear(upper, Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd F = T.transpose() * frame.P * closed * T;
  const auto rates = detail::symmetric_eigensystem_of(Eigen::MatrixXd(F + F.transpose()));
  if (!(rates.values(n - 1) < 0.0)) {
    return refusal(RegionError::not_stable, in_certify_region, "V = (x - x*)ᵀP(x - x*)")
        .got("growing in a direction of the linearised loop")
        .expected("falling in all")
        .hint("leave P out, or take that of the regulator's Riccati equation")
        .with("rate, 1/s", {rates.values(n - 1)});
  }
  frame.T = T * rates.vectors;
  return frame;
}

/// The largest V that the reach, and half a turn of each angle, leave.
double level_within_reach(const SaturatedLoop& loop, const RegionOptions& options,
                          const Eigen::MatrixXd& T, double slack) {
  double level = infinity;
  const auto hold = [&](Eigen::Index i, double reach) {
    const double per_level = T.row(i).squaredNorm();
    if (std::isfinite(reach) && per_level > 0.0) {
      level = std::min(level, reach * reach / per_level * (1.0 - slack));
    }
  };
  for (Eigen::Index i = 0; i < options.reach.size(); ++i) {
    hold(i, options.reach(i));
  }
  for (const Eigen::Index i : loop.angles) {
    hold(i, std::numbers::pi);
  }
  return level;
}

/// The V at which an input first meets its limit.
double level_of_limits(const SaturatedLoop& loop, const Eigen::MatrixXd& T) {
  double level = infinity;
  for (Eigen::Index i = 0; i < loop.model.inputs; ++i) {
    const double slope = (loop.K.row(i) * T).norm();
    double room = infinity;
    if (loop.u_min.size() > 0) {
      room = std::min(room, loop.u(i) - loop.u_min(i));
    }
    if (loop.u_max.size() > 0) {
      room = std::min(room, loop.u_max(i) - loop.u(i));
    }
    if (slope > 0.0 && std::isfinite(room)) {
      level = std::min(level, room * room / (slope * slope));
    }
  }
  return level;
}

/// The z nearest to zero that a search finds with V̇ > 0, of |z| < radius; empty if none.
Eigen::VectorXd failing_point(LoopEnclosure& enclosure, double radius) {
  const int n = enclosure.states();
  Random random(8);
  Eigen::VectorXd worst;
  double best = radius;
  const auto look_along = [&](const Eigen::VectorXd& direction) {
    constexpr int rings = 32;
    constexpr double ratio = 0.8;
    double bad = 0.0;
    double r = best;
    for (int k = 0; k < rings; ++k, r *= ratio) {
      if (!(enclosure.rate(r * direction) < 0.0)) {
        bad = r;
      }
    }
    if (bad == 0.0) {
      return;
    }
    double good = bad * ratio;
    for (int k = 0; k < 30; ++k) {
      const double middle = 0.5 * (good + bad);
      (enclosure.rate(middle * direction) < 0.0 ? good : bad) = middle;
    }
    if (bad < best || worst.size() == 0) {
      best = std::min(best, bad);
      worst = bad * direction;
    }
  };
  const auto random_direction = [&] {
    Eigen::VectorXd d(n);
    for (double& entry : d) {
      entry = random.normal();
    }
    return Eigen::VectorXd(d.normalized());
  };
  const int directions = 400 * n;
  for (int k = 0; k < directions; ++k) {
    look_along(random_direction());
  }
  double width = 0.3;
  for (int k = 0; k < directions && worst.size() > 0; ++k, width *= 0.99) {
    const double before = best;
    look_along((worst.normalized() + width * random_direction()).normalized());
    if (best < before) {
      width *= 1.5;
    }
  }
  return worst;
}

struct OpenCell {
  double least = 0.0;
  RegionCell cell;
};
struct Later {
  bool operator()(const OpenCell& a, const OpenCell& b) const noexcept { return a.least > b.least; }
};

/// Takes cells in the order of V until those below `closeness` of the failing level are done.
void prove_level(LoopEnclosure& enclosure, double radius, double core_half,
                 const RegionOptions& options, CertifiedRegion& region, double ceiling) {
  std::priority_queue<OpenCell, std::vector<OpenCell>, Later> open;
  OpenCell all;
  const auto n = static_cast<std::size_t>(enclosure.states());
  std::fill_n(all.cell.half.begin(), n, radius);
  open.push(all);
  const auto inside_core = [&](const RegionCell& cell) {
    for (std::size_t i = 0; i < n; ++i) {
      if (!(std::abs(cell.centre[i]) + cell.half[i] <= core_half)) {
        return false;
      }
    }
    return true;
  };
  const auto meets_core = [&](const RegionCell& cell) {
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(cell.centre[i]) - cell.half[i] > core_half) {
        return false;
      }
    }
    return true;
  };
  const double goal = std::min(ceiling, region.refuted);
  region.limit = region.refuted < ceiling ? AttractionLimit::rate : AttractionLimit::reach;
  while (!open.empty()) {
    const OpenCell next = open.top();
    const double wanted = region.limit == AttractionLimit::rate ? options.closeness * goal : goal;
    if (next.least >= wanted || region.cells >= options.most_cells) {
      region.limit = next.least >= wanted ? region.limit : AttractionLimit::work;
      region.level = std::min(next.least, goal);
      return;
    }
    open.pop();
    if (inside_core(next.cell)) {
      continue;
    }
    ++region.cells;
    const CellBound bound = enclosure.bound(next.cell);
    if (bound.high < 0.0) {
      continue;
    }
    // Beside the core, where V̇ goes to zero, what sticks out of it is cut off.
    const bool beside_core = meets_core(next.cell);
    const detail::Coordinates& weight = beside_core ? next.cell.half : bound.share;
    std::size_t split = 0;
    for (std::size_t i = 1; i < n; ++i) {
      if (!(weight[i] <= weight[split])) {
        split = i;
      }
    }
    const double half = 0.5 * next.cell.half[split];
    if (next.cell.centre[split] + half == next.cell.centre[split]) {
      region.limit = AttractionLimit::work;
      region.level = next.least;
      return;
    }
    for (const double side : {-half, half}) {
      OpenCell part = next;
      part.cell.half[split] = half;
      part.cell.centre[split] += side;
      part.least = enclosure.least(part.cell);
      if (part.least < goal) {
        open.push(part);
      }
    }
  }
  region.level = goal;
}

}  // namespace

double CertifiedRegion::value(const Eigen::Ref<const Eigen::VectorXd>& state) const {
  Eigen::VectorXd e = state - x;
  for (const Eigen::Index i : angles) {
    e(i) = std::remainder(e(i), 2.0 * std::numbers::pi);
  }
  return e.dot(P * e);
}

double CertifiedRegion::extent(Eigen::Index state) const {
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(P.rows(), state);
  return std::sqrt(level * detail::solve_symmetric(P, unit)(state, 0));
}

double CertifiedRegion::volume() const {
  const auto L = detail::cholesky_of(P);
  if (!L) {
    return 0.0;
  }
  const auto n = static_cast<double>(P.rows());
  return std::pow(std::numbers::pi * level, 0.5 * n) / std::tgamma(0.5 * n + 1.0) /
         L->diagonal().prod();
}

Expected<CertifiedRegion> certify_region(const SaturatedLoop& loop, const RegionOptions& options) {
  FLYBALL_CHECK(detail::check_saturated_loop(loop, in_certify_region));
  FLYBALL_CHECK(Checks(in_certify_region)
                    .within(options.closeness, 0.0, 1.0, "closeness")
                    .within(options.most_cells, 1.0, 1e8, "most_cells"));
  if (options.reach.size() > 0) {
    FLYBALL_CHECK(Checks(in_certify_region)
                      .shape(options.reach, loop.model.states, 1, "reach", "states x 1"));
    for (const double reach : options.reach) {
      if (!(reach > 0.0)) {
        return refusal(ArgumentError::not_positive, in_certify_region, "reach")
            .got(format_number(reach))
            .expected("positive, infinite for a state without an end");
      }
    }
  }
  FLYBALL_TRY(const Frame frame, frame_of(loop, options));
  LoopEnclosure enclosure(loop, frame.P, frame.T);
  CertifiedRegion region{.x = loop.x, .P = frame.P, .angles = loop.angles};

  const double limits = level_of_limits(loop, frame.T);
  constexpr double beyond = 1e4;  // of the level at which the inputs meet their limits
  constexpr double nothing_limits = 1e6;
  const double ceiling =
      std::min(level_within_reach(loop, options, frame.T, 2.0 * enclosure.slack()),
               std::isfinite(limits) ? beyond * limits : nothing_limits);
  const Eigen::VectorXd failing = failing_point(enclosure, std::sqrt(ceiling));
  if (failing.size() > 0) {
    region.limiting_state = loop.x + frame.T * failing;
    region.refuted = failing.squaredNorm();
  }
  const double outer =
      std::sqrt(std::min(ceiling, region.refuted) * (1.0 + 4.0 * enclosure.slack()));
  const double radius = short_above(outer);

  // The core: the largest box about x* in which the loop is seen to contract.
  double core_half = 0.0;
  const double rest = enclosure.rest();
  for (int k = 0; k < 40 && core_half == 0.0; ++k) {
    const double half = std::ldexp(radius, -k);
    const double rate = enclosure.core_rate(half);
    // 2 |z| |f_z(0)| + rate |z|² < 0 on the border
    if (rate < 0.0 && 2.0 * rest < -0.5 * rate * half) {
      core_half = half;
      region.core_rate = -0.5 * rate / (1.0 + enclosure.slack());
      region.core = half * half * (1.0 - enclosure.slack());
    }
  }
  if (core_half == 0.0) {
    return refusal(RegionError::not_enclosed, in_certify_region, "the loop near its equilibrium")
        .got("not seen to contract, however near")
        .hint("a limit or a kink at the point itself leaves no linear loop there")
        .with("what is left of the equilibrium", {rest});
  }
  prove_level(enclosure, radius, core_half, options, region, std::min(ceiling, outer * outer));
  region.core = std::min(region.core, region.level);
  return region;
}

}  // namespace flyball
