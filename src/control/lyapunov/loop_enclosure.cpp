#include <algorithm>
#include <bit>
#include <cmath>

#include "control/lyapunov/loop_enclosure.hpp"
#include "core/constants.hpp"

namespace flyball::detail {

namespace {

Interval clamped(const Interval& u, double low, double high) noexcept {
  return {std::clamp(u.low, low, high), std::clamp(u.high, low, high)};
}

/// The slopes of a clamp over an interval.
Interval clamp_slope(const Interval& u, double low, double high) noexcept {
  if (u.low >= low && u.high <= high) {
    return 1.0;
  }
  return u.high < low || u.low > high ? Interval(0.0) : Interval(0.0, 1.0);
}

double low_limit(const SaturatedLoop& loop, int input) noexcept {
  return loop.u_min.size() > 0 ? loop.u_min(input) : -infinity;
}
double high_limit(const SaturatedLoop& loop, int input) noexcept {
  return loop.u_max.size() > 0 ? loop.u_max(input) : infinity;
}

std::size_t at(int i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Whether ∂f/∂u does not depend on u.
bool is_affine(const expression::Derivatives& derivatives, std::size_t states, std::size_t inputs) {
  std::vector<expression::Slot> by;
  for (std::size_t k = 0; k < inputs; ++k) {
    by.push_back(derivatives.tape.input_slot(states + k));
  }
  const expression::Derivatives second = expression::differentiate(derivatives.tape, by);
  return std::none_of(second.entries.begin(), second.entries.end(), [&](const auto& entry) {
    return entry.row >= derivatives.rows &&
           derivatives.entries[entry.row - derivatives.rows].column >= states;
  });
}

/// [-1, 1] r.
Interval within(double r) noexcept {
  return {-r, r};
}

}  // namespace

LoopEnclosure::LoopEnclosure(const SaturatedLoop& loop, const Eigen::MatrixXd& P,
                             const Eigen::MatrixXd& T)
    : loop_(loop),
      P_(P),
      T_(T),
      n_(static_cast<int>(loop.model.states)),
      m_(static_cast<int>(loop.model.inputs)),
      derivatives_(expression::differentiate(loop.model.f)),
      f_(loop.model.f, loop.model.parameters),
      forms_(loop.model.f, loop.model.parameters),
      jacobian_(derivatives_.tape, loop.model.parameters),
      KT_(at(n_ * m_)),
      in_(at(n_ + m_)),
      box_(at(n_ + m_)),
      u_raw_(at(m_)),
      form_in_(at(n_ + m_)),
      values_(loop.model.f.size()),
      point_(at(n_ + m_)),
      slope_(at(n_)) {
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < n_; ++j) {
      Interval sum;
      for (int k = 0; k < n_; ++k) {
        sum = sum + Interval(T(k, i)) * Interval(P(k, j));
      }
      W_[at(i)][at(j)] = sum;
    }
  }
  for (int i = 0; i < m_; ++i) {
    for (int j = 0; j < n_; ++j) {
      Interval sum;
      for (int k = 0; k < n_; ++k) {
        sum = sum + Interval(loop.K(i, k)) * Interval(T(k, j));
      }
      KT_[at(i * n_ + j)] = sum;
    }
  }
  for (int i = 0; i < n_; ++i) {  // ‖TᵀPT - I‖ in the largest row sum
    double row = 0.0;
    for (int j = 0; j < n_; ++j) {
      Interval sum(i == j ? -1.0 : 0.0);
      for (int k = 0; k < n_; ++k) {
        sum = sum + W_[at(i)][at(k)] * Interval(T(k, j));
      }
      row += sum.magnitude();
    }
    slack_ = std::max(slack_, 1.001 * row + 1e-12);
  }
  loop.model.f.prepare<double>(loop.model.parameters, values_);
  affine_ = is_affine(derivatives_, at(n_), at(m_));
}

double LoopEnclosure::least(const RegionCell& cell) const noexcept {
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    const double near = std::max(0.0, std::abs(cell.centre[at(i)]) - cell.half[at(i)]);
    sum += near * near;
  }
  return sum * (1.0 - slack_);
}

double LoopEnclosure::most(const RegionCell& cell) const noexcept {
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    const double far = std::abs(cell.centre[at(i)]) + cell.half[at(i)];
    sum += far * far;
  }
  return sum * (1.0 + slack_);
}

void LoopEnclosure::evaluate_centre(const Coordinates& centre) noexcept {
  for (int i = 0; i < n_; ++i) {
    Interval x(loop_.x(i));
    for (int j = 0; j < n_; ++j) {
      x = x + Interval(T_(i, j)) * Interval(centre[at(j)]);
    }
    in_[at(i)] = x;
  }
  for (int i = 0; i < m_; ++i) {
    Interval u(loop_.u(i));
    for (int j = 0; j < n_; ++j) {
      u = u - KT_[at(i * n_ + j)] * Interval(centre[at(j)]);
    }
    u_raw_[at(i)] = u;
    in_[at(n_ + i)] = clamped(u, low_limit(loop_, i), high_limit(loop_, i));
  }
}

void LoopEnclosure::evaluate_jacobian(const Coordinates& half) noexcept {
  for (int i = 0; i < n_; ++i) {
    double reach = 0.0;
    for (int j = 0; j < n_; ++j) {
      reach += std::abs(T_(i, j)) * half[at(j)];
    }
    box_[at(i)] = in_[at(i)] + within(reach * inflation);
  }
  std::array<Interval, most_region_states> slope{};
  for (int i = 0; i < m_; ++i) {
    double reach = 0.0;
    for (int j = 0; j < n_; ++j) {
      reach += KT_[at(i * n_ + j)].magnitude() * half[at(j)];
    }
    const Interval u = u_raw_[at(i)] + within(reach * inflation);
    slope[at(i)] = clamp_slope(u, low_limit(loop_, i), high_limit(loop_, i));
    box_[at(n_ + i)] = clamped(u, low_limit(loop_, i), high_limit(loop_, i));
  }
  const std::span<const Interval> all = jacobian_.evaluate(box_);
  // W [J, B]
  Square WJ{};
  Square WB{};
  for (std::size_t e = 0; e < derivatives_.entries.size(); ++e) {
    const auto [row, column] = derivatives_.entries[e];
    const Interval& entry = all[derivatives_.rows + e];
    const bool by_input = static_cast<int>(column) >= n_;
    Square& target = by_input ? WB : WJ;
    const std::size_t k = by_input ? column - at(n_) : column;
    for (int i = 0; i < n_; ++i) {
      Interval& sum = target[at(i)][k];
      const Interval term = product(W_[at(i)][row], entry);
      sum = is_bounded(term) && is_bounded(sum) ? sum + term : anything;
    }
  }
  // F = W J T - W B Σ K T
  for (int i = 0; i < n_; ++i) {
    for (int j = 0; j < n_; ++j) {
      Interval sum;
      for (int k = 0; k < n_; ++k) {
        const Interval term = product(WJ[at(i)][at(k)], T_(k, j));
        sum = is_bounded(term) && is_bounded(sum) ? sum + term : anything;
      }
      for (int k = 0; k < m_; ++k) {
        const Interval gain = product(WB[at(i)][at(k)], slope[at(k)]);
        const Interval term = product(gain, KT_[at(k * n_ + j)]);
        sum = is_bounded(term) && is_bounded(sum) ? sum - term : anything;
      }
      F_[at(i)][at(j)] = sum;
    }
  }
}

std::array<unsigned, most_region_states> LoopEnclosure::regimes_of(
    const RegionCell& cell) noexcept {
  std::array<unsigned, most_region_states> met{};
  for (int i = 0; i < m_; ++i) {
    Interval u(loop_.u(i));
    for (int j = 0; j < n_; ++j) {
      const Interval& gain = KT_[at(i * n_ + j)];
      const double c = cell.centre[at(j)];
      const double h = cell.half[at(j)];
      u = u - gain * (Interval(c) + within(h));
    }
    const double low = low_limit(loop_, i);
    const double high = high_limit(loop_, i);
    met[at(i)] = (u.high >= low && u.low <= high ? 1U : 0U) | (u.low < low ? 2U : 0U) |
                 (u.high > high ? 4U : 0U);
  }
  return met;
}

CellBound LoopEnclosure::bound(const RegionCell& cell) noexcept {
  evaluate_centre(cell.centre);
  const auto met = regimes_of(cell);
  // V̇ is affine in each input, which lies between its line and its limit: it is at most the larger
  // of what it is with the one and with the other.
  constexpr std::array all{Regime::linear, Regime::low, Regime::high};
  CellBound result;
  result.high = -infinity;
  Regimes regimes{};
  std::array<std::size_t, most_region_states> choice{};
  for (bool more = true; more;) {
    bool possible = true;
    for (int i = 0; i < m_; ++i) {
      const bool one = std::has_single_bit(met[at(i)]);
      possible = possible &&
                 (affine_ || one ? (met[at(i)] >> choice[at(i)] & 1U) != 0 : choice[at(i)] == 0);
      regimes[at(i)] = affine_ || one ? all[choice[at(i)]] : Regime::mixed;
    }
    if (possible) {
      const TaylorForm rate = rate_in(cell, regimes);
      const double high = upper_bound(rate);
      if (!(high <= result.high)) {
        result.high = high;
        for (int i = 0; i < n_; ++i) {
          double share = std::abs(rate.slope[at(i)]);
          for (int j = 0; j < n_; ++j) {
            share += std::abs(rate.square[square_index(at(std::min(i, j)), at(std::max(i, j)))]);
          }
          result.share[at(i)] = share;
        }
      }
      if (!std::isfinite(high)) {
        result.share = cell.half;
        result.high = std::numeric_limits<double>::quiet_NaN();
        return result;
      }
    }
    more = false;
    for (int i = 0; i < m_ && !more; ++i) {
      more = ++choice[at(i)] < all.size();
      choice[at(i)] = more ? choice[at(i)] : 0;
    }
  }
  return result;
}

TaylorForm LoopEnclosure::rate_in(const RegionCell& cell, const Regimes& regimes) noexcept {
  // A number times h ε_j, and what its product was rounded by.
  const auto add_slope = [&](TaylorForm& form, int j, const Interval& factor) {
    const double h = cell.half[at(j)];
    const double middle = 0.5 * factor.low + 0.5 * factor.high;
    form.slope[at(j)] = middle * h;
    form.widen((std::max(factor.high - middle, middle - factor.low) +
                4.0 * unit_roundoff * factor.magnitude()) *
                   h * inflation +
               underflow);
  };
  for (int i = 0; i < n_; ++i) {
    TaylorForm& x = form_in_[at(i)];
    x = TaylorForm::between(in_[at(i)]);
    for (int j = 0; j < n_; ++j) {
      add_slope(x, j, T_(i, j));
    }
  }
  for (int i = 0; i < m_; ++i) {
    TaylorForm& u = form_in_[at(n_ + i)];
    const double low = low_limit(loop_, i);
    const double high = high_limit(loop_, i);
    if (regimes[at(i)] == Regime::low || regimes[at(i)] == Regime::high) {
      u = regimes[at(i)] == Regime::low ? low : high;
      continue;
    }
    u = TaylorForm::between(u_raw_[at(i)]);
    for (int j = 0; j < n_; ++j) {
      add_slope(u, j, -KT_[at(i * n_ + j)]);
    }
    if (regimes[at(i)] == Regime::mixed) {
      u = TaylorForm::between(clamped(u.range(), low, high));
    }
  }
  const std::span<const TaylorForm> f = forms_.evaluate(form_in_);
  TaylorForm sum;
  for (int j = 0; j < n_; ++j) {
    Interval centre;
    for (int i = 0; i < n_; ++i) {
      centre = centre + Interval(2.0 * cell.centre[at(i)]) * W_[at(i)][at(j)];
    }
    TaylorForm weight = TaylorForm::between(centre);
    for (int i = 0; i < n_; ++i) {
      add_slope(weight, i, Interval(2.0) * W_[at(i)][at(j)]);
    }
    sum = sum + weight * f[at(j)];
  }
  return sum;
}

double LoopEnclosure::core_rate(double half) noexcept {
  Coordinates box{};
  std::fill_n(box.begin(), n_, half);
  evaluate_centre({});
  evaluate_jacobian(box);
  double worst = -infinity;
  for (int i = 0; i < n_; ++i) {  // Gershgorin
    double row = 2.0 * F_[at(i)][at(i)].high;
    double beside = 0.0;
    for (int j = 0; j < n_; ++j) {
      if (j != i) {
        if (!is_bounded(F_[at(i)][at(j)]) || !is_bounded(F_[at(j)][at(i)])) {
          return infinity;
        }
        beside += (F_[at(i)][at(j)] + F_[at(j)][at(i)]).magnitude();
      }
    }
    row = rounded_up(row + beside * inflation);
    if (!(row < infinity)) {
      return infinity;
    }
    worst = std::max(worst, row);
  }
  return worst;
}

double LoopEnclosure::rest() noexcept {
  evaluate_centre({});
  const std::span<const Interval> f = f_.evaluate(in_);
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    Interval f_z;
    for (int j = 0; j < n_; ++j) {
      if (!is_bounded(f[at(j)])) {
        return infinity;
      }
      f_z = f_z + W_[at(i)][at(j)] * f[at(j)];
    }
    sum += f_z.magnitude();
  }
  return sum * inflation;
}

double LoopEnclosure::rate(const Eigen::VectorXd& z) {
  double sum = 0.0;
  for (int i = 0; i < n_; ++i) {
    double x = loop_.x(i);
    for (int j = 0; j < n_; ++j) {
      x += T_(i, j) * z(j);
    }
    point_[at(i)] = x;
  }
  for (int i = 0; i < m_; ++i) {
    double u = loop_.u(i);
    for (int k = 0; k < n_; ++k) {
      u -= loop_.K(i, k) * (point_[at(k)] - loop_.x(k));
    }
    point_[at(n_ + i)] = std::clamp(u, low_limit(loop_, i), high_limit(loop_, i));
  }
  loop_.model.f.evaluate<double>(point_, slope_, values_);
  for (int i = 0; i < n_; ++i) {
    double weight = 0.0;
    for (int j = 0; j < n_; ++j) {
      weight += P_(i, j) * (point_[at(j)] - loop_.x(j));
    }
    sum += 2.0 * weight * slope_[at(i)];
  }
  return sum;
}

}  // namespace flyball::detail
