#include <algorithm>

#include "planning/trajectory/interval_program.hpp"

namespace flyball::detail {

namespace {

/// Beyond the limits by this much is rounding.
constexpr double tolerance = 1e-13;
constexpr int most_pivots = 40;

}  // namespace

double IntervalProgram::largest(const Bezier2& b, int& which) const noexcept {
  double most = -1.0;
  which = -1;
  if (delta == nullptr) {
    for (int r = 0; r < rows; ++r) {
      const double value = std::abs(alpha[r] * b[0] + beta[r] * b[1] + gamma[r] * b[2]);
      if (value > most) {
        most = value;
        which = r;
      }
    }
    return most;
  }
  for (int r = 0; r < rows; ++r) {
    const double value = std::abs(row(r, b));
    if (value > most) {
      most = value;
      which = r;
    }
  }
  return most;
}

double IntervalProgram::largest_upper(const Bezier2& b, int& which) const noexcept {
  which = -1;
  if (b[0] <= idle && b[1] <= idle && b[2] <= idle) {
    return 0.0;
  }
  double most = 0.0;
  for (int r = 0; r < uppers; ++r) {
    const double value = upper_row(r, b);
    if (value > most) {
      most = value;
      which = r;
    }
  }
  return most;
}

namespace {

/// The dual simplex method: from the corner of the caps, which is better than any point inside, to
/// the best one that meets the row that is broken most, and so on.
/// @param first  Of the variables that move: 0 for all, 1 where b_0 is given.
/// @return Whether it ended.
template <int first>
bool descend(const IntervalProgram& program, Bezier2& b, std::array<double, 3> dual) noexcept {
  // Columns of the inverse of the three active normals: directions of the edges.
  double edge[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  for (int pivot = 0; pivot < most_pivots; ++pivot) {
    int which = -1;
    double broken = program.largest(b, which) - program.margin;
    double normal[3] = {0.0, 0.0, 0.0};
    bool found = broken > tolerance;
    if (found) {
      const double sign = program.row(which, b) > 0.0 ? 1.0 : -1.0;
      normal[0] = sign * program.alpha[which];
      normal[1] = sign * program.beta[which];
      normal[2] = sign * program.gamma[which];
    } else if (broken = program.largest_upper(b, which) - 1.0; broken > tolerance) {
      found = true;
      for (int k = 0; k < 3; ++k) {
        normal[k] = program.upper[3 * which + k];
      }
    } else {
      double least = 0.0;
      for (int k = first; k < 3; ++k) {
        if (b[static_cast<std::size_t>(k)] < least) {
          least = b[static_cast<std::size_t>(k)];
          normal[0] = normal[1] = normal[2] = 0.0;
          normal[k] = -1.0;
          broken = -least;
          found = broken > tolerance * program.cap[static_cast<std::size_t>(k)];
        }
      }
    }
    if (!found) {
      return true;
    }
    double mu[3];
    int leaving = -1;
    double ratio = 0.0;
    for (int k = first; k < 3; ++k) {
      mu[k] = 0.0;
      for (int i = first; i < 3; ++i) {
        mu[k] += normal[i] * edge[k][i];
      }
      const double lambda = dual[static_cast<std::size_t>(k)];
      if (mu[k] > 0.0 && (leaving < 0 || lambda < ratio * mu[k])) {
        leaving = k;
        ratio = lambda / mu[k];
      }
    }
    if (leaving < 0) {
      return false;
    }
    const double inverse = 1.0 / mu[leaving];
    double* out = edge[leaving];
    for (int i = first; i < 3; ++i) {
      out[i] *= inverse;
      b[static_cast<std::size_t>(i)] -= broken * out[i];
    }
    for (int k = first; k < 3; ++k) {
      if (k != leaving) {
        for (int i = first; i < 3; ++i) {
          edge[k][i] -= mu[k] * out[i];
        }
        dual[static_cast<std::size_t>(k)] -= mu[k] * ratio;
      }
    }
    dual[static_cast<std::size_t>(leaving)] = ratio;
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
    if (std::abs(to) > program.margin) {
      const double room = (to > 0.0 ? program.margin - at : program.margin + at);
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
    }
  }
  return share;
}

Bezier2 between(const Bezier2& a, const Bezier2& b, double share) noexcept {
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])};
}

}  // namespace

Bezier2 largest_first(const IntervalProgram& program, double last) noexcept {
  Bezier2 b{program.cap[0], program.cap[1], std::min(program.cap[2], last)};
  if (!descend<0>(program, b, {1.0, 0.05, 1e-3})) {
    const Bezier2 zero{};
    b = between(zero, b, share_inside(program, zero, b));
  }
  return {std::max(0.0, b[0]), std::max(0.0, b[1]), std::max(0.0, b[2])};
}

Bezier2 largest_last(const IntervalProgram& program, double last, const Bezier2& inside) noexcept {
  Bezier2 b{inside[0], program.cap[1], std::min(program.cap[2], last)};
  if (!descend<1>(program, b, {0.0, 0.05, 1.0})) {
    b = between(inside, b, share_inside(program, inside, b));
  }
  return {inside[0], std::max(0.0, b[1]), std::max(0.0, b[2])};
}

}  // namespace flyball::detail
