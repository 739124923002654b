#include <algorithm>
#include <cstring>

#include "planning/trajectory/interval_program.hpp"

namespace flyball::detail {

namespace {

/// Beyond the limits by this much is rounding.
constexpr double tolerance = 1e-11;
constexpr int most_pivots = 40;

/// Two lanes, of which every machine has the instructions.
using Lanes = double __attribute__((vector_size(16)));

Lanes load(const double* from) noexcept {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

/// The largest of |α b_0 + β b_1 + γ b_2 + δ|, or without the bars, and, if it is more than 1,
/// which it is. @param rows  An even number.
template <bool two_sided, bool shifted>
double largest_of(const double* alpha, const double* beta, const double* gamma, const double* delta,
                  int rows, const Bezier2& b, int& which) noexcept {
  const Lanes b0{b[0], b[0]};
  const Lanes b1{b[1], b[1]};
  const Lanes b2{b[2], b[2]};
  const auto value = [&](int r) {
    Lanes sum = load(alpha + r) * b0 + load(beta + r) * b1 + load(gamma + r) * b2;
    if constexpr (shifted) {
      sum += load(delta + r);
    }
    if constexpr (two_sided) {
      sum = sum > -sum ? sum : -sum;
    }
    return sum;
  };
  Lanes most{-1.0, -1.0};
  for (int r = 0; r < rows; r += 2) {
    const Lanes at = value(r);
    most = at > most ? at : most;
  }
  const double largest = std::max(most[0], most[1]);
  which = -1;
  if (largest > 1.0) {
    for (int r = 0; r < rows && which < 0; r += 2) {
      const Lanes at = value(r);
      which = at[0] == largest ? r : at[1] == largest ? r + 1 : -1;
    }
  }
  return largest;
}

}  // namespace

double IntervalProgram::largest(const Bezier2& b, int& which) const noexcept {
  return delta == nullptr ? largest_of<true, false>(alpha, beta, gamma, delta, rows, b, which)
                          : largest_of<true, true>(alpha, beta, gamma, delta, rows, b, which);
}

double IntervalProgram::largest_upper(const Bezier2& b, int& which) const noexcept {
  which = -1;
  if (b[0] <= idle && b[1] <= idle && b[2] <= idle) {
    return 0.0;
  }
  return largest_of<false, false>(upper_alpha, upper_beta, upper_gamma, nullptr, uppers, b, which);
}

namespace {

/// One inequality, normal · b <= right.
struct Inequality {
  double normal[3];
  double right;
};

/// Inequalities by number: rows from above and from below, rows of one side, caps, 0 <= b.
class Inequalities {
 public:
  explicit Inequalities(const IntervalProgram& program) : program_(program) {}

  [[nodiscard]] int cap(int k) const noexcept { return 2 * program_.rows + program_.uppers + k; }
  [[nodiscard]] Inequality get(int number) const noexcept {
    const IntervalProgram& p = program_;
    if (number < 2 * p.rows) {
      const int r = number / 2;
      const double sign = number % 2 == 0 ? 1.0 : -1.0;
      return {{sign * p.alpha[r], sign * p.beta[r], sign * p.gamma[r]},
              p.delta != nullptr ? 1.0 - sign * p.delta[r] : 1.0};
    }
    number -= 2 * p.rows;
    if (number < p.uppers) {
      return {{p.upper_alpha[number], p.upper_beta[number], p.upper_gamma[number]}, 1.0};
    }
    number -= p.uppers;
    Inequality bound{{0.0, 0.0, 0.0}, 0.0};
    bound.normal[number % 3] = number < 3 ? 1.0 : -1.0;
    bound.right = number < 3 ? p.cap[static_cast<std::size_t>(number)] : 0.0;
    return bound;
  }
  /// The one that is broken most, of the first kind of which any is; -1 for none.
  /// @param first  Of the variables that move.
  [[nodiscard]] int broken(const Bezier2& b, int first, double& by) const noexcept {
    int which = -1;
    by = program_.largest(b, which) - 1.0;
    if (by > tolerance) {
      return 2 * which + (program_.row(which, b) > 0.0 ? 0 : 1);
    }
    by = program_.largest_upper(b, which) - 1.0;
    if (by > tolerance) {
      return 2 * program_.rows + which;
    }
    int found = -1;
    by = 0.0;
    for (int k = first; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double over = std::max(b[i] - program_.cap[i], -b[i]);
      if (over > by && over > tolerance * program_.cap[i]) {
        by = over;
        found = cap(b[i] > 0.0 ? k : k + 3);
      }
    }
    return found;
  }

 private:
  const IntervalProgram& program_;
};

/// A corner: three inequalities, the edges that leave it (columns of the inverse of their normals)
/// and the multipliers of the objective.
struct Corner {
  std::array<int, 3> active;
  double edge[3][3];
  double dual[3];
};

/// The corner of the caps: better than any point inside.
template <int first>
void start_at_caps(const IntervalProgram& program, const Inequalities& all,
                   const std::array<double, 3>& objective, Corner& corner, Bezier2& b) noexcept {
  for (int k = first; k < 3; ++k) {
    corner.active[static_cast<std::size_t>(k)] = all.cap(k);
    for (int i = 0; i < 3; ++i) {
      corner.edge[k][i] = i == k ? 1.0 : 0.0;
    }
    corner.dual[k] = objective[static_cast<std::size_t>(k)];
    b[static_cast<std::size_t>(k)] = program.cap[static_cast<std::size_t>(k)];
  }
}

/// The corner of the neighbour's inequalities, if it is better than any point inside, too.
template <int first>
bool start_at(const Inequalities& all, const std::array<double, 3>& objective, Corner& corner,
              Bezier2& b) noexcept {
  constexpr double least = 1e-9;
  Inequality of[3];
  double size = 1.0;
  for (int k = first; k < 3; ++k) {
    of[k] = all.get(corner.active[static_cast<std::size_t>(k)]);
    double square = 0.0;
    for (int i = first; i < 3; ++i) {
      square += of[k].normal[i] * of[k].normal[i];
    }
    size *= square;
  }
  double(&edge)[3][3] = corner.edge;
  double determinant = 0.0;
  if constexpr (first == 0) {
    const auto cross = [](const double* u, const double* v, double* w) {
      w[0] = u[1] * v[2] - u[2] * v[1];
      w[1] = u[2] * v[0] - u[0] * v[2];
      w[2] = u[0] * v[1] - u[1] * v[0];
    };
    cross(of[1].normal, of[2].normal, edge[0]);
    cross(of[2].normal, of[0].normal, edge[1]);
    cross(of[0].normal, of[1].normal, edge[2]);
    for (int i = 0; i < 3; ++i) {
      determinant += of[0].normal[i] * edge[0][i];
    }
  } else {
    edge[1][1] = of[2].normal[2];
    edge[1][2] = -of[2].normal[1];
    edge[2][1] = -of[1].normal[2];
    edge[2][2] = of[1].normal[1];
    determinant = of[1].normal[1] * of[2].normal[2] - of[1].normal[2] * of[2].normal[1];
    of[1].right -= of[1].normal[0] * b[0];
    of[2].right -= of[2].normal[0] * b[0];
  }
  if (!(determinant * determinant > least * least * size)) {
    return false;
  }
  const double inverse = 1.0 / determinant;
  for (int k = first; k < 3; ++k) {
    corner.dual[k] = 0.0;
    for (int i = first; i < 3; ++i) {
      edge[k][i] *= inverse;
      corner.dual[k] += objective[static_cast<std::size_t>(i)] * edge[k][i];
    }
    if (!(corner.dual[k] >= 0.0)) {
      return false;
    }
  }
  for (int i = first; i < 3; ++i) {
    double value = 0.0;
    for (int k = first; k < 3; ++k) {
      value += of[k].right * edge[k][i];
    }
    b[static_cast<std::size_t>(i)] = value;
  }
  return true;
}

/// The dual simplex method: from a corner that is better than any point inside to the best one that
/// meets the inequality that is broken most, and so on.
/// @param first  Of the variables that move: 0 for all, 1 where b_0 is given.
/// @return Whether it ended.
template <int first>
bool descend(const IntervalProgram& program, const std::array<double, 3>& objective, Bezier2& b,
             IntervalBasis& basis) noexcept {
  const Inequalities all(program);
  Corner corner;
  corner.active = basis.active;
  if (!basis.known || !start_at<first>(all, objective, corner, b)) {
    start_at_caps<first>(program, all, objective, corner, b);
  }
  basis.known = false;
  double(&edge)[3][3] = corner.edge;
  for (int pivot = 0; pivot < most_pivots; ++pivot) {
    double by = 0.0;
    const int entering = all.broken(b, first, by);
    if (entering < 0) {
      basis = {corner.active, true};
      return true;
    }
    const Inequality inequality = all.get(entering);
    double mu[3];
    int leaving = -1;
    double ratio = 0.0;
    for (int k = first; k < 3; ++k) {
      mu[k] = 0.0;
      for (int i = first; i < 3; ++i) {
        mu[k] += inequality.normal[i] * edge[k][i];
      }
      if (mu[k] > 0.0 && (leaving < 0 || corner.dual[k] < ratio * mu[k])) {
        leaving = k;
        ratio = corner.dual[k] / mu[k];
      }
    }
    if (leaving < 0) {
      return false;
    }
    const double inverse = 1.0 / mu[leaving];
    double* out = edge[leaving];
    for (int i = first; i < 3; ++i) {
      out[i] *= inverse;
      b[static_cast<std::size_t>(i)] -= by * out[i];
    }
    for (int k = first; k < 3; ++k) {
      if (k != leaving) {
        for (int i = first; i < 3; ++i) {
          edge[k][i] -= mu[k] * out[i];
        }
        corner.dual[k] = std::max(0.0, corner.dual[k] - mu[k] * ratio);
      }
    }
    corner.dual[leaving] = ratio;
    corner.active[static_cast<std::size_t>(leaving)] = entering;
  }
  return false;
}

/// How far a point may be moved from one inside towards another: the largest share, at most 1.
double share_inside(const IntervalProgram& program, const Bezier2& inside,
                    const Bezier2& b) noexcept {
  double share = 1.0;
  for (int r = 0; r < program.rows; ++r) {
    const double at = program.row(r, inside);
    const double to = program.row(r, b);
    if (std::abs(to) > 1.0) {
      const double room = (to > 0.0 ? 1.0 - at : 1.0 + at);
      share = std::min(share, std::max(0.0, room) / std::abs(to - at));
    }
  }
  for (int r = 0; r < program.uppers; ++r) {
    const double at = program.upper_row(r, inside);
    const double to = program.upper_row(r, b);
    if (to > 1.0) {
      share = std::min(share, std::max(0.0, 1.0 - at) / (to - at));
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    if (b[k] < 0.0) {
      share = std::min(share, inside[k] / (inside[k] - b[k]));
    } else if (b[k] > program.cap[k]) {
      share = std::min(share, std::max(0.0, program.cap[k] - inside[k]) / (b[k] - inside[k]));
    }
  }
  return share;
}

Bezier2 between(const Bezier2& a, const Bezier2& b, double share) noexcept {
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])};
}

}  // namespace

Bezier2 largest_first(const IntervalProgram& program, IntervalBasis& basis) noexcept {
  // b_2 counts, too: the way on from a standstill is long.
  Bezier2 b = program.cap;
  if (!descend<0>(program, {1.0, 0.05, 0.5}, b, basis)) {
    const Bezier2 zero{};
    b = between(zero, b, share_inside(program, zero, b));
  }
  return {std::max(0.0, b[0]), std::max(0.0, b[1]), std::clamp(b[2], 0.0, program.cap[2])};
}

Bezier2 largest_last(const IntervalProgram& program, const Bezier2& inside,
                     IntervalBasis& basis) noexcept {
  Bezier2 b{inside[0], program.cap[1], program.cap[2]};
  if (!descend<1>(program, {0.0, 0.05, 1.0}, b, basis)) {
    b = between(inside, b, share_inside(program, inside, b));
  }
  return {inside[0], std::max(0.0, b[1]), std::clamp(b[2], 0.0, program.cap[2])};
}

}  // namespace flyball::detail
