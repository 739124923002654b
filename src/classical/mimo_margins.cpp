#include <flyball/classical/mimo_margins.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/math/search/minimum.hpp>
#include <flyball/systems/interconnection.hpp>

#include "classical/delay_frequency.hpp"
#include "classical/loop_peaks.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "math/dense/spectral_norm.hpp"
#include "systems/algebraic_loop.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr std::string_view no_output =
    "take a path that acts instantly out of it: no output satisfies it at infinite frequency";

/// The same system with other matrices.
template <class System>
System with(System system, MatrixXd A, MatrixXd B, MatrixXd C, MatrixXd D) {
  system.A = std::move(A);
  system.B = std::move(B);
  system.C = std::move(C);
  system.D = std::move(D);
  return system;
}

Peak peak_of(const HInfinityNorm& norm) {
  return {norm.norm, norm.frequency};
}

/// x' = A x + B e, y = C x + D e with e = r - y: from r to a e + b y.
template <class System>
Expected<System> closed(const System& loop, double of_error, double of_output,
                        std::string_view where) {
  const Index m = loop.B.cols();
  const MatrixXd one = MatrixXd::Identity(m, m);
  // e = (I + D)⁻¹(r - C x)
  MatrixXd right(m, m + loop.A.rows());
  right << one, loop.C;
  FLYBALL_TRY(const MatrixXd solved,
              flyball::detail::solve_algebraic_loop({loop.D, MatrixXd(), 1.0, "I + D", no_output},
                                                    right, where));
  const MatrixXd M = solved.leftCols(m);
  const MatrixXd MC = solved.rightCols(loop.A.rows());
  using flyball::detail::product;
  // y = r - e
  const MatrixXd C = -(of_error - of_output) * MC;
  const MatrixXd D = of_output * one + (of_error - of_output) * M;
  return with(loop, loop.A - product(loop.B, MC), product(loop.B, M), C, D);
}

template <class System>
Expected<bool> stable(const System& system) {
  if (system.A.size() == 0) {
    return true;
  }
  return is_stable(system);
}

/// All channels but one closed.
template <class System>
Expected<System> opened_at(const System& loop, Index channel, std::string_view where) {
  const Index m = loop.B.cols();
  if (m == 1) {
    return loop;
  }
  // The channel first, the others after it.
  Eigen::VectorXi order(m);
  order(0) = static_cast<int>(channel);
  for (int k = 1, from = 0; k < static_cast<int>(m); ++k, ++from) {
    from += from == static_cast<int>(channel) ? 1 : 0;
    order(k) = from;
  }
  MatrixXd B(loop.B.rows(), m);
  MatrixXd C(m, loop.C.cols());
  MatrixXd D(m, m);
  for (Index j = 0; j < m; ++j) {
    B.col(j) = loop.B.col(order(j));
    C.row(j) = loop.C.row(order(j));
    for (Index i = 0; i < m; ++i) {
      D(i, j) = loop.D(order(i), order(j));
    }
  }
  const Index rest = m - 1;
  const Index n = loop.A.rows();
  // e₂ = -(I + D₂₂)⁻¹(C₂ x + D₂₁ e₁)
  MatrixXd right(rest, n + 1);
  right << C.bottomRows(rest), D.bottomLeftCorner(rest, 1);
  auto opened = flyball::detail::solve_algebraic_loop(
      {D.bottomRightCorner(rest, rest), MatrixXd(), 1.0, "I + D without one channel", no_output},
      right, where);
  if (!opened) {
    return tl::unexpected(std::move(opened).error().with("channel", static_cast<double>(channel)));
  }
  const MatrixXd& solved = *opened;
  using flyball::detail::product;
  const MatrixXd by_x = solved.leftCols(n);
  const MatrixXd by_e = solved.rightCols(1);
  return with(loop, loop.A - product(B.rightCols(rest), by_x),
              B.leftCols(1) - product(B.rightCols(rest), by_e),
              C.topRows(1) - product(D.topRightCorner(1, rest), by_x),
              D.topLeftCorner(1, 1) - product(D.topRightCorner(1, rest), by_e));
}

/// min over diagonal D of σ(D M D⁻¹): convex in ln D, one entry after the other.
class ScaledGain {
 public:
  /// @param channels  m. Of up to four 150 000 norms may be looked at, of more as many as take as
  /// long, O(m³) each.
  explicit ScaledGain(Index channels)
      : left_(std::min(150'000L, 10'000'000L / (channels * channels * channels))) {}

  /// An upper bound, and the minimum unless the work is done before.
  /// @param log_d  Where it begins, and what it found. @param floor  An answer below is of no use:
  /// it ends there.
  double operator()(const Eigen::MatrixXcd& M, Eigen::VectorXd& log_d, double floor = 0.0) {
    const auto gain = [&] {
      --left_;
      Eigen::MatrixXcd scaled = M;
      for (Index i = 0; i < M.rows(); ++i) {
        for (Index j = 0; j < M.rows(); ++j) {
          scaled(i, j) *= std::exp(log_d(i) - log_d(j));
        }
      }
      return flyball::detail::spectral_norm_of_complex(scaled);
    };
    double best = gain();
    if (M.rows() == 1 || best <= floor) {
      return best;
    }
    double reach = 4.0;
    constexpr int most_rounds = 60;
    for (int round = 0; round < most_rounds && reach > 1e-9; ++round) {
      const double before = best;
      for (Index i = 1; i < M.rows(); ++i) {
        if (left_ <= 0) {
          return best;
        }
        const double middle = log_d(i);
        const auto lowest = find_minimum(
            [&](double x) {
              log_d(i) = x;
              return gain();
            },
            middle - reach, middle + reach, {.absolute_tolerance = std::max(1e-9, 1e-4 * reach)});
        log_d(i) = lowest && lowest->value <= best ? lowest->x : middle;
        best = lowest ? std::min(best, lowest->value) : best;
        if (best <= floor) {
          return best;
        }
      }
      // Ridges slow it down: the search narrows where a round gains nothing.
      reach = best < before * (1.0 - 1e-6) ? reach : 0.25 * reach;
    }
    return best;
  }

 private:
  long left_;
};

/// The largest of it over the frequencies.
Expected<Peak> largest_scaled_gain(const FrequencyResponse& difference, double full_frequency) {
  FLYBALL_TRY(const auto grid, frequency_grid(difference));
  Eigen::VectorXd log_d = Eigen::VectorXd::Zero(difference.outputs());
  ScaledGain scaled_gain(difference.outputs());
  // The unscaled gain bounds it: from the largest on, until no other can exceed the best.
  std::vector<Peak> places;
  const auto consider = [&](double w) {
    const Eigen::MatrixXcd M = difference.at(w);
    places.push_back({M.allFinite() ? flyball::detail::spectral_norm_of_complex(M) : 0.0, w});
  };
  for (const double w : grid.frequency) {
    consider(w);
  }
  consider(std::isfinite(full_frequency) ? full_frequency : 0.0);
  consider(0.0);
  std::stable_sort(places.begin(), places.end(),
                   [](const Peak& a, const Peak& b) { return a.value > b.value; });
  Peak best;
  constexpr double as_large = 1.0 + 1e-7;  // of a plateau one place is enough
  for (const Peak& place : places) {
    if (place.value <= best.value * as_large) {
      break;
    }
    Eigen::VectorXd own = log_d;
    const double value = scaled_gain(difference.at(place.frequency), own, best.value * as_large);
    if (value > best.value) {
      log_d = own;
      best = {value, place.frequency};
    }
  }
  if (best.frequency > 0.0) {
    const double high = std::min(1.05 * best.frequency, difference.highest_frequency());
    const auto top = find_minimum(
        [&](double w) {
          Eigen::VectorXd own = log_d;
          return -scaled_gain(difference.at(w), own);
        },
        0.95 * best.frequency, high);
    if (top && -top->value > best.value) {
      best = {-top->value, top->x};
    }
  }
  return best;
}

template <class System>
Expected<MimoMargins> margins_of(const System& loop) {
  constexpr std::string_view where = "mimo_margins";
  FLYBALL_CHECK(check_system_or_gain(loop, where));
  if (loop.B.cols() != loop.C.rows()) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.C.rows(), loop.B.cols()))
        .expected("square: as many outputs as inputs");
  }
  MimoMargins margins;
  FLYBALL_TRY(const System S, closed(loop, 1.0, 0.0, where));
  FLYBALL_TRY(const System T, closed(loop, 0.0, 1.0, where));
  FLYBALL_TRY(const System difference, closed(loop, 1.0, -1.0, where));
  FLYBALL_TRY(margins.stable, stable(S));
  FLYBALL_TRY_IN(where, const auto of_S, l_infinity_norm(S));
  FLYBALL_TRY_IN(where, const auto of_T, l_infinity_norm(T));
  FLYBALL_TRY_IN(where, const auto of_difference, l_infinity_norm(difference));
  margins.sensitivity = peak_of(of_S);
  margins.complementary = peak_of(of_T);
  margins.full_disk_margin = margins.stable ? 2.0 / of_difference.norm : 0.0;
  margins.disk_margin = margins.full_disk_margin;
  margins.disk_frequency = of_difference.frequency;
  if (loop.B.cols() > 1) {
    FLYBALL_TRY(const auto response, frequency_response(difference));
    FLYBALL_TRY_IN(where, const Peak scaled,
                   largest_scaled_gain(response, of_difference.frequency));
    margins.disk_margin = margins.stable ? 2.0 / scaled.value : 0.0;
    margins.disk_frequency = scaled.frequency;
  }
  detail::CrossingWork work(loop.A.rows());
  for (Index channel = 0; channel < loop.B.cols(); ++channel) {
    FLYBALL_TRY(const System one, opened_at(loop, channel, where));
    FLYBALL_TRY(const auto response, frequency_response(one));
    FLYBALL_TRY(auto alone, detail::whole_margins(response, work));
    margins.loop_at_a_time.push_back(std::move(alone.margins));
  }
  return margins;
}

template <class System>
Expected<GangOfFour> gang_of(const System& P, const System& C) {
  constexpr std::string_view where = "gang_of_four";
  FLYBALL_TRY_IN(where, const System loop, series(C, P));  // P C
  FLYBALL_TRY(const System S, closed(loop, 1.0, 0.0, where));
  FLYBALL_TRY(const System T, closed(loop, 0.0, 1.0, where));
  FLYBALL_TRY_IN(where, const System PS, feedback(P, C));
  FLYBALL_TRY_IN(where, const System CS, feedback(C, P));
  GangOfFour gang;
  FLYBALL_TRY(gang.stable, stable(S));
  FLYBALL_TRY_IN(where, const auto of_S, l_infinity_norm(S));
  FLYBALL_TRY_IN(where, const auto of_T, l_infinity_norm(T));
  FLYBALL_TRY_IN(where, const auto of_PS, l_infinity_norm(PS));
  FLYBALL_TRY_IN(where, const auto of_CS, l_infinity_norm(CS));
  gang.sensitivity = peak_of(of_S);
  gang.complementary = peak_of(of_T);
  gang.disturbance_sensitivity = peak_of(of_PS);
  gang.noise_sensitivity = peak_of(of_CS);
  return gang;
}

}  // namespace

Expected<MimoMargins> mimo_margins(const DelaySystem& loop) {
  constexpr std::string_view where = "mimo_margins";
  if (loop.inputs() != loop.outputs()) {
    return refusal(ArgumentError::wrong_shape, where, "the loop")
        .got(flyball::detail::format("{} x {}", loop.outputs(), loop.inputs()))
        .expected("square: as many outputs as inputs");
  }
  if (loop.period()) {
    return loop.to_discrete().and_then(
        [](const DiscreteSystem<>& states) { return mimo_margins(states); });
  }
  if (!loop.has_delay()) {
    return loop.to_continuous().and_then(
        [](const ContinuousSystem<>& states) { return mimo_margins(states); });
  }
  const Index m = loop.inputs();
  const MatrixXd one = MatrixXd::Identity(m, m);
  // u = r - y; S is u, T is y.
  FLYBALL_TRY_IN(where, const DelaySystem S, rewired(loop, {-one, one, -one, one}));
  FLYBALL_TRY_IN(where, const DelaySystem T, rewired(loop, {-one, one, one, 0.0 * one}));
  FLYBALL_TRY_IN(where, const DelaySystem difference, rewired(loop, {-one, one, -2.0 * one, one}));
  MimoMargins margins;
  FLYBALL_TRY_IN(where, const DelayPoles poles, rightmost_poles(S));
  margins.stable = poles.stable;
  FLYBALL_TRY_IN(where, margins.sensitivity, detail::peak_gain_with(S, poles.poles));
  FLYBALL_TRY_IN(where, margins.complementary, detail::peak_gain_with(T, poles.poles));
  FLYBALL_TRY_IN(where, const Peak of_difference, detail::peak_gain_with(difference, poles.poles));
  margins.full_disk_margin = margins.stable ? 2.0 / of_difference.value : 0.0;
  margins.disk_margin = margins.full_disk_margin;
  margins.disk_frequency = of_difference.frequency;
  if (m > 1) {
    const FrequencyResponse response = detail::response_with(difference, poles.poles);
    FLYBALL_TRY_IN(where, const Peak scaled,
                   largest_scaled_gain(response, of_difference.frequency));
    margins.disk_margin = margins.stable ? 2.0 / scaled.value : 0.0;
    margins.disk_frequency = scaled.frequency;
  }
  for (Index channel = 0; channel < m; ++channel) {
    MatrixXd others = -one;
    others(channel, channel) = 0.0;
    FLYBALL_TRY_IN(
        where, const DelaySystem opened,
        rewired(loop, {others, one.col(channel), one.row(channel), MatrixXd::Zero(1, 1)}));
    FLYBALL_TRY_IN(where, auto alone, loop_margins(opened));
    margins.loop_at_a_time.push_back(std::move(alone));
  }
  return margins;
}
Expected<MimoMargins> mimo_margins(const ContinuousSystem<>& loop) {
  return margins_of(loop);
}
Expected<MimoMargins> mimo_margins(const DiscreteSystem<>& loop) {
  return margins_of(loop);
}
Expected<GangOfFour> gang_of_four(const ContinuousSystem<>& plant,
                                  const ContinuousSystem<>& controller) {
  return gang_of(plant, controller);
}
Expected<GangOfFour> gang_of_four(const DiscreteSystem<>& plant,
                                  const DiscreteSystem<>& controller) {
  return gang_of(plant, controller);
}

}  // namespace flyball::classical
