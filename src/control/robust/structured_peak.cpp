#include <algorithm>
#include <cmath>
#include <utility>

#include <flyball/control/robust/structured_singular_value.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/norms.hpp>

#include "control/robust/scaled_point.hpp"
#include "control/robust/stretch.hpp"
#include "core/constants.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"
#include "systems/balance.hpp"
#include "systems/gramian_factor.hpp"

namespace flyball {

namespace {

using detail::MemberClimb;
using detail::ScaledPoint;
using detail::SingularMember;
using detail::UnitMember;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// How far above the largest bound at a frequency the proven level is.
constexpr double above_all = 1.0002;
/// A bound this far below the level holds over a good stretch, and need not be the least.
constexpr double well_below = 0.97;
constexpr double accuracy = 2e-5;  ///< Of β² elsewhere.

/// A frequency that was looked at.
struct Visit {
  double frequency = 0.0;
  MatrixXcd M;
  ScaledPoint point;
  detail::Stretch covers;  ///< At the level at which it was laid, or any higher one.
};

class PeakSearch {
 public:
  PeakSearch(const ContinuousSystem<>& system, const detail::UncertaintyStructure& structure)
      : system_(system), structure_(structure) {
    const Eigen::VectorXcd poles = detail::eigenvalues_of(system.A);
    slowest_ = poles.cwiseAbs().minCoeff();
    fastest_ = poles.cwiseAbs().maxCoeff();
    for (const auto& pole : poles) {
      if (pole.imag() >= 0.0) {
        first_.push_back(std::abs(pole));
        if (pole.imag() > 0.0) {
          first_.push_back(pole.imag());
        }
      }
    }
  }

  StructuredPeak run() {
    first_.push_back(0.0);
    first_.push_back(infinity);
    constexpr int grid = 12;
    for (int k = 0; k <= grid; ++k) {
      first_.push_back(0.03 * slowest_ *
                       std::pow(1e3 * fastest_ / slowest_, static_cast<double>(k) / grid));
    }
    std::sort(first_.begin(), first_.end());
    first_.erase(std::unique(first_.begin(), first_.end(),
                             [](double a, double b) { return b <= a * (1.0 + 1e-6); }),
                 first_.end());
    // Where the gain is largest first: elsewhere a bound below the level is all that is needed.
    std::vector<std::pair<double, double>> gains;
    for (const double frequency : first_) {
      const MatrixXcd M = detail::response_at(system_, frequency);
      gains.emplace_back(-detail::balanced_size(M, structure_), frequency);
    }
    std::sort(gains.begin(), gains.end());
    for (const auto& [gain, frequency] : gains) {
      visit(frequency);
    }
    climb_the_bound();
    cover();
    search();
    return result();
  }

 private:
  void visit(double frequency) {
    Visit made{frequency, detail::response_at(system_, frequency), {}, {frequency, frequency}};
    made.point = detail::scaled_point(made.M, structure_, well_below * level_, accuracy);
    work_ += made.point.work;
    level_ = std::max(level_, above_all * made.point.beta);
    visits_.push_back(std::move(made));
  }

  /// Whether scalings took about a second: large repeated blocks have thousands of unknowns. A
  /// level above the least is then as good.
  [[nodiscard]] bool is_spent() const noexcept {
    constexpr double most = 5e9;
    return work_ > most;
  }

  [[nodiscard]] std::size_t highest() const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < visits_.size(); ++k) {
      best = visits_[k].point.beta > visits_[best].point.beta ? k : best;
    }
    return best;
  }

  /// Between the neighbours of the highest: thirds, to a fraction of a percent in the bound.
  void climb_the_bound() {
    for (int round = 0; round < 8; ++round) {
      const Visit& top = visits_[highest()];
      const double at = top.frequency;
      const double before = top.point.beta;
      double low = 0.0;
      double high = infinity;
      for (const Visit& other : visits_) {
        low = other.frequency < at ? std::max(low, other.frequency) : low;
        high = other.frequency > at ? std::min(high, other.frequency) : high;
      }
      if (!std::isfinite(at)) {
        return;
      }
      if (low < at) {
        visit(between(low, at));
      }
      if (high > at) {
        visit(between(at, high));
      }
      const double now = visits_[highest()].point.beta;
      if ((round >= 3 && now <= before * (1.0 + 1e-4)) || is_spent()) {
        return;
      }
    }
  }

  [[nodiscard]] double between(double low, double high) const {
    if (std::isinf(high)) {
      return low > 0.0 ? 4.0 * low : fastest_;
    }
    if (low == 0.0) {
      return 0.5 * high;
    }
    return high > 2.0 * low ? std::sqrt(low) * std::sqrt(high) : 0.5 * low + 0.5 * high;
  }

  void lay(Visit& visit) {
    visit.covers = detail::stretch_around(system_, visit.frequency, visit.point.scaling, level_);
  }

  /// The first frequencies that no stretch covers; empty where there are none.
  [[nodiscard]] std::optional<detail::Stretch> gap() {
    std::sort(visits_.begin(), visits_.end(),
              [](const Visit& a, const Visit& b) { return a.covers.low < b.covers.low; });
    double reached = 0.0;
    bool begun = false;
    for (const Visit& visit : visits_) {
      // At a level of their own bound's, stretches have a width; a single point covers nothing.
      if (!(visit.covers.high > visit.covers.low)) {
        continue;
      }
      if (begun ? visit.covers.low > reached : visit.covers.low > 0.0) {
        return detail::Stretch{reached, visit.covers.low};
      }
      begun = true;
      reached = std::max(reached, visit.covers.high);
    }
    return begun && std::isinf(reached) ? std::nullopt
                                        : std::optional(detail::Stretch{reached, infinity});
  }

  void cover() {
    for (Visit& made : visits_) {
      lay(made);
    }
    constexpr int most_visits = 150;
    int since = 0;
    double raise = 1.1;
    const auto gain = h_infinity_norm(system_);
    const double norm = gain ? gain->upper_bound : 1e6 * level_;
    while (auto open = gap()) {
      if (++since > most_visits || is_spent()) {
        // Whatever resists is given a higher level, at which all that holds still does.
        level_ *= raise;
        raise *= raise;
        if (!(level_ < norm)) {
          give_up();
          return;
        }
        since = most_visits - 8;
        for (Visit& made : visits_) {
          lay(made);
        }
        continue;
      }
      visit(between(open->low, open->high));
      lay(visits_.back());
    }
  }

  /// The H∞ norm is a bound too, with no scaling.
  void give_up() {
    const auto norm = h_infinity_norm(system_);
    level_ =
        norm ? std::max(above_all * visits_[highest()].point.beta, norm->upper_bound) : infinity;
    for (Visit& made : visits_) {
      made.covers = {made.frequency, made.frequency};
    }
    const Index m = structure_.inputs;
    const Index p = structure_.outputs;
    visits_.front().covers = {0.0, infinity};
    visits_.front().point.scaling = {MatrixXcd::Identity(p, p), MatrixXcd::Identity(m, m),
                                     MatrixXcd::Zero(m, p)};
  }

  /// Members, from where the bound is largest, and at corners of numbers.
  void search() {
    std::vector<std::size_t> order(visits_.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = k;
    }
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return visits_[a].point.beta > visits_[b].point.beta;
    });
    Random random(1);
    constexpr std::size_t most = 4;
    for (std::size_t k = 0; k < std::min(most, order.size()); ++k) {
      const Visit& from = visits_[order[k]];
      climb_from(from, std::nullopt, random);
      if (best_ && best_->value >= level_ * (1.0 - 4e-4)) {
        return;
      }
    }
    search_corners();
    if (corner_) {
      const Visit& from = nearest(corner_->frequency);
      climb_from(from, corner_, random);
    }
    if (!best_ || best_->value < 0.99 * level_) {
      for (int k = 0; k < (structure_.has_real() ? 12 : 4); ++k) {
        const Visit& from =
            visits_[order[static_cast<std::size_t>(k) % std::min(most, order.size())]];
        climb_from(from, UnitMember{}, random);
      }
    }
  }

  const Visit& nearest(double frequency) const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < visits_.size(); ++k) {
      best =
          std::abs(visits_[k].frequency - frequency) < std::abs(visits_[best].frequency - frequency)
              ? k
              : best;
    }
    return visits_[best];
  }

  /// @param start  The aligned one if none, a random one if empty.
  void climb_from(const Visit& from, const std::optional<UnitMember>& start, Random& random) {
    const ScaledPoint& point = from.point;
    const bool moves = std::isfinite(from.frequency) && system_.A.size() > 0;
    detail::SearchedMatrix M;
    M.at = [&](double frequency) {
      return point.coordinates_of(detail::response_at(system_, moves ? frequency : infinity));
    };
    if (moves) {
      M.slope = [&](double frequency) {
        return point.coordinates_of(detail::response_slope(system_, frequency));
      };
    }
    M.step = from.frequency > 0.0 && moves ? from.frequency : slowest_;
    const MemberClimb climb(structure_, M);
    const double frequency = moves ? from.frequency : 0.0;
    UnitMember member = !start ? point.first_member(point.coordinates_of(from.M), climb, frequency)
                        : start->blocks.empty() ? climb.random(random, frequency)
                                                : *start;
    const auto found = climb.climb(member);
    if (!found) {
      return;
    }
    const double value = (found->value - found->rounding) * point.scale;
    if (!(value > 0.0) || value > level_ * (1.0 + 1e-9) || (best_ && value <= best_->value)) {
      return;
    }
    best_ = SingularMember{found->member, value, 0.0, found->z};
    if (!moves) {
      best_->member.frequency = infinity;
    }
    delta_ = climb.matrix_of(found->member) / found->value / point.scale;
    const double at = best_->member.frequency;
    residual_ = detail::residual_of(point.coordinates_of(detail::response_at(system_, at)),
                                    climb.matrix_of(found->member), *found);
  }

  /// The real Δ at corners: how far each can be enlarged until a pole meets the axis.
  void search_corners() {
    const std::size_t count = structure_.blocks.size();
    if (system_.A.size() == 0 || count > 10 ||
        std::any_of(structure_.blocks.begin(), structure_.blocks.end(),
                    [](const auto& block) { return block.is_full(); })) {
      return;
    }
    double size = best_ ? 1.0 / best_->value : 1e3 / level_;
    for (unsigned signs = 0; signs < (1u << count); ++signs) {
      MatrixXd V = MatrixXd::Zero(structure_.inputs, structure_.outputs);
      UnitMember member;
      for (std::size_t b = 0; b < count; ++b) {
        const auto& block = structure_.blocks[b];
        const double sign = ((signs >> b) & 1u) != 0u ? -1.0 : 1.0;
        V.block(block.in, block.out, block.rows, block.rows).diagonal().setConstant(sign);
        member.blocks.push_back({sign, {}, {}});
      }
      // Not beyond where the loop of D alone is singular.
      const auto worst = [&](double t) {
        const MatrixXd tV = t * V;
        const MatrixXd loop =
            MatrixXd::Identity(structure_.inputs, structure_.inputs) - tV.lazyProduct(system_.D);
        const MatrixXd BV =
            system_.B.lazyProduct(detail::solve_linear(loop, MatrixXd(tV.lazyProduct(system_.C))));
        const Eigen::VectorXcd poles = detail::eigenvalues_of(system_.A + BV);
        Index at = 0;
        poles.real().maxCoeff(&at);
        return poles(at);
      };
      if (!(worst(size * (1.0 - 1e-9)).real() > 0.0)) {
        continue;
      }
      double low = 0.0;
      double high = size;
      for (int k = 0; k < 45; ++k) {
        const double middle = 0.5 * (low + high);
        (worst(middle).real() > 0.0 ? high : low) = middle;
      }
      size = high;
      member.frequency = std::abs(worst(high).imag());
      corner_ = std::move(member);
    }
  }

  StructuredPeak result() {
    StructuredPeak peak;
    peak.upper = level_;
    peak.delta = MatrixXcd::Zero(structure_.inputs, structure_.outputs);
    const Visit& top = visits_[highest()];
    peak.scaling = top.point.scaling;
    peak.scaling_frequency = top.frequency;
    if (best_) {
      peak.lower = std::min(best_->value, level_);
      peak.frequency = best_->member.frequency;
      peak.delta = delta_;
      peak.residual = residual_;
    } else {
      peak.frequency = top.frequency;
    }
    double reached = -1.0;
    for (const Visit& visit : visits_) {
      if (visit.covers.high > visit.covers.low && visit.covers.high > reached) {
        peak.stretches.push_back({visit.covers.low, visit.covers.high, visit.point.scaling});
        reached = visit.covers.high;
      }
    }
    return peak;
  }

  const ContinuousSystem<>& system_;
  const detail::UncertaintyStructure& structure_;
  double slowest_ = 0.0;
  double fastest_ = 0.0;
  double level_ = 0.0;
  double work_ = 0.0;  // of the scalings, in multiplications
  std::vector<double> first_;
  std::vector<Visit> visits_;
  std::optional<SingularMember> best_;
  std::optional<UnitMember> corner_;
  MatrixXcd delta_;
  double residual_ = 0.0;
};

Expected<StructuredPeak> peak_of_static(const MatrixXd& D,
                                        const std::vector<UncertaintyBlock>& blocks) {
  FLYBALL_TRY(auto mu, structured_singular_value(D.cast<std::complex<double>>(), blocks));
  return StructuredPeak{mu.lower,    mu.upper,   0.0, mu.delta,
                        mu.residual, mu.scaling, 0.0, {{0.0, infinity, mu.scaling}}};
}

/// @param mapped  A continuous system without a pole on the axis.
StructuredPeak peak_of(const ContinuousSystem<>& mapped,
                       const detail::UncertaintyStructure& structure) {
  const ContinuousSystem<> scaled =
      detail::scaled_system(mapped, detail::scaling_of(mapped.A, mapped.B, mapped.C));
  return PeakSearch(scaled, structure).run();
}

template <class System>
Expected<detail::UncertaintyStructure> check(const System& system, TimeDomain domain,
                                             const std::vector<UncertaintyBlock>& blocks) {
  constexpr std::string_view where = "structured_peak";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  FLYBALL_TRY(auto structure,
              detail::structure_of(blocks, system.D.rows(), system.D.cols(), where));
  if (system.A.size() > 0) {
    FLYBALL_CHECK(detail::check_stable(system.A, domain, where));
  }
  return structure;
}

}  // namespace

Expected<StructuredPeak> structured_peak(const ContinuousSystem<>& system,
                                         const std::vector<UncertaintyBlock>& blocks) {
  FLYBALL_TRY(const auto structure, check(system, TimeDomain::continuous, blocks));
  if (system.A.size() == 0) {
    return peak_of_static(system.D, blocks);
  }
  return peak_of(system, structure);
}

Expected<StructuredPeak> structured_peak(const DiscreteSystem<>& system,
                                         const std::vector<UncertaintyBlock>& blocks) {
  FLYBALL_TRY(const auto structure, check(system, TimeDomain::discrete, blocks));
  if (system.A.size() == 0) {
    return peak_of_static(system.D, blocks);
  }
  // With T = 2, s = (z - 1)/(z + 1) = j tan(ωT/2).
  FLYBALL_TRY(const auto mapped,
              convert_to_continuous({system.A, system.B, system.C, system.D, Time(2.0)},
                                    ConversionMethod::tustin));
  StructuredPeak peak = peak_of(mapped, structure);
  const auto sampled = [&](double w) { return 2.0 * std::atan(w) / system.period.si(); };
  peak.frequency = sampled(peak.frequency);
  peak.scaling_frequency = sampled(peak.scaling_frequency);
  for (ScaledStretch& stretch : peak.stretches) {
    stretch.low = sampled(stretch.low);
    stretch.high = sampled(stretch.high);
  }
  return peak;
}

}  // namespace flyball
