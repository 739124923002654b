#include <algorithm>
#include <cmath>
#include <numbers>

#include <flyball/control/lyapunov/region_of_attraction.hpp>
#include <flyball/core/random.hpp>

#include "control/lyapunov/saturated_loop.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

Expected<void> check_region(const SaturatedLoop& loop, const CertifiedRegion& region,
                            std::string_view where) {
  FLYBALL_CHECK(detail::check_saturated_loop(loop, where));
  const Eigen::Index n = loop.model.states;
  return Checks(where)
      .shape(region.x, n, 1, "the region's x", "states x 1")
      .shape(region.P, n, n, "the region's P", "states x states")
      .finite(region.P, "the region's P")
      .positive(region.level, "the region's level");
}

/// The starts of a grid over a plane, or at random.
Eigen::MatrixXd starts_of(const SaturatedLoop& loop, const Eigen::VectorXd& half,
                          const SampleOptions& options) {
  const Eigen::Index n = loop.model.states;
  if (options.plane.empty()) {
    Random random(options.seed);
    Eigen::MatrixXd starts(n, options.count);
    for (Eigen::Index k = 0; k < starts.cols(); ++k) {
      for (Eigen::Index i = 0; i < n; ++i) {
        starts(i, k) = loop.x(i) + random.uniform(-half(i), half(i));
      }
    }
    return starts;
  }
  const auto side =
      std::max<Eigen::Index>(2, static_cast<Eigen::Index>(std::lround(std::sqrt(options.count))));
  Eigen::MatrixXd starts = loop.x.replicate(1, side * side);
  for (Eigen::Index k = 0; k < starts.cols(); ++k) {
    const auto share = [&](Eigen::Index step) {
      return 2.0 * static_cast<double>(step) / static_cast<double>(side - 1) - 1.0;
    };
    starts(options.plane[0], k) += half(options.plane[0]) * share(k % side);
    starts(options.plane[1], k) += half(options.plane[1]) * share(k / side);
  }
  return starts;
}

}  // namespace

Expected<SampledRegion> sample_region(const SaturatedLoop& loop, const CertifiedRegion& region,
                                      const Eigen::VectorXd& half, const SampleOptions& options) {
  constexpr std::string_view where = "sample_region";
  FLYBALL_CHECK(check_region(loop, region, where));
  FLYBALL_CHECK(Checks(where)
                    .shape(half, loop.model.states, 1, "half", "states x 1")
                    .finite(half, "half")
                    .positive(options.duration, "duration", "s")
                    .positive(options.step, "step", "s")
                    .within(options.duration / options.step, 1.0, 1e7, "duration/step")
                    .within(options.count, 1.0, 1e7, "count"));
  if (!options.plane.empty() &&
      (options.plane.size() != 2 || options.plane[0] == options.plane[1] ||
       std::min(options.plane[0], options.plane[1]) < 0 ||
       std::max(options.plane[0], options.plane[1]) >= loop.model.states)) {
    return refusal(ArgumentError::out_of_range, where, "plane")
        .expected("two different states, or none");
  }
  SampledRegion result{.starts = starts_of(loop, half, options)};
  detail::SaturatedMotion motion(loop);
  const auto steps = static_cast<int>(std::ceil(options.duration / options.step));
  constexpr int between_looks = 10;
  int attracted = 0;
  int certified = 0;
  Eigen::VectorXd x;
  for (Eigen::Index k = 0; k < result.starts.cols(); ++k) {
    x = result.starts.col(k);
    const bool at_once = region.value(x) <= region.level;
    bool comes = at_once;
    for (int step = 0; step < steps && !comes && x.allFinite(); ++step) {
      motion.step(x, options.step);
      comes = step % between_looks == between_looks - 1 && region.value(x) <= region.level;
    }
    result.comes.push_back(comes);
    attracted += comes ? 1 : 0;
    certified += at_once ? 1 : 0;
  }
  const auto all = static_cast<double>(result.starts.cols());
  result.attracted = attracted / all;
  result.certified = certified / all;
  return result;
}

Expected<std::vector<Eigen::MatrixXd>> backward_rings(const SaturatedLoop& loop,
                                                      const CertifiedRegion& region,
                                                      Eigen::Index first, Eigen::Index second,
                                                      const std::vector<double>& times,
                                                      int points) {
  constexpr std::string_view where = "backward_rings";
  FLYBALL_CHECK(check_region(loop, region, where));
  const Eigen::Index n = loop.model.states;
  if (first == second || std::min(first, second) < 0 || std::max(first, second) >= n) {
    return refusal(ArgumentError::out_of_range, where, "the plane")
        .got("of states " + std::to_string(first) + " and " + std::to_string(second))
        .expected("of two different ones");
  }
  FLYBALL_CHECK(Checks(where).within(points, 3.0, 1e6, "points"));
  for (const double t : times) {
    FLYBALL_CHECK(check_within(t, 0.0, 1e3, where, "times", "s"));
  }
  // The section of the ellipsoid with the plane: V of the two states alone.
  Eigen::Matrix2d section;
  section << region.P(first, first), region.P(first, second), region.P(second, first),
      region.P(second, second);
  const auto L = detail::cholesky_of(section);
  if (!L) {
    return refusal(ArgumentError::not_positive, where, "the region's P")
        .got("not positive definite");
  }
  constexpr double step = 1e-3;
  constexpr double far = 1e6;
  detail::SaturatedMotion motion(loop);
  std::vector<Eigen::MatrixXd> rings(times.size(), Eigen::MatrixXd(2, points));
  std::vector<std::size_t> order(times.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    order[k] = k;
  }
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  const Eigen::MatrixXd upper = L->transpose();
  for (int k = 0; k < points; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / (points - 1);
    const Eigen::Vector2d circle =
        std::sqrt(region.level) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::VectorXd border = detail::solve_linear(upper, circle);
    Eigen::VectorXd x = loop.x;
    x(first) += border(0);
    x(second) += border(1);
    double t = 0.0;
    for (const std::size_t number : order) {
      while (t < times[number] && x.cwiseAbs().maxCoeff() < far) {
        const double h = std::min(step, times[number] - t);
        motion.step(x, -h);
        t = times[number] - t <= step ? times[number] : t + h;
      }
      const bool there = x.allFinite() && x.cwiseAbs().maxCoeff() < far;
      rings[number].col(k) << (there ? x(first) : std::nan("")), (there ? x(second) : std::nan(""));
    }
  }
  return rings;
}

}  // namespace flyball
