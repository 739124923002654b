#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <flyball/planning/path/path.hpp>

/// The peer: reachability analysis on a uniform grid as the literature has it, limits at the grid's
/// points alone, u constant between them; two variables a point, by Seidel's incremental programs
/// in the order given.
namespace flyball::test {

/// Of Pham and Pham (2018), algorithm 1. Its storage is kept between calls.
class PlainReachability {
 public:
  /// @return s, the time of the path, rest to rest.
  double operator()(const Path& path, const Eigen::VectorXd& velocity,
                    const Eigen::VectorXd& acceleration, int intervals) {
    const auto n = static_cast<std::size_t>(path.coordinates());
    const double step = path.parameter_end() / intervals;
    first_.resize(n);
    a_.resize((static_cast<std::size_t>(intervals) + 1) * n);
    b_.resize(a_.size());
    cap_.resize(static_cast<std::size_t>(intervals) + 1);
    for (int i = 0; i <= intervals; ++i) {
      const PathState state = path.at(i * step);
      double cap = 1e12;
      for (std::size_t j = 0; j < n; ++j) {
        const auto k = static_cast<Eigen::Index>(j);
        const double e = state.first(k) / velocity(k);
        cap = std::min(cap, 1.0 / std::max(e * e, 1e-12));
        a_[static_cast<std::size_t>(i) * n + j] = state.first(k) / acceleration(k);
        b_[static_cast<std::size_t>(i) * n + j] = state.second(k) / acceleration(k);
      }
      cap_[static_cast<std::size_t>(i)] = cap;
    }
    // Back: the largest x from which x + 2 Δ u <= highest of the next point.
    highest_.assign(cap_.size(), 0.0);
    for (int i = intervals - 1; i >= 0; --i) {
      const auto k = static_cast<std::size_t>(i);
      highest_[k] = largest_x(&a_[k * n], &b_[k * n], n, cap_[k], highest_[k + 1], 2.0 * step);
    }
    // Forward: the largest u.
    double x = 0.0;
    double time = 0.0;
    for (std::size_t i = 0; i + 1 < cap_.size(); ++i) {
      double low = -x / (2.0 * step);
      double high = (highest_[i + 1] - x) / (2.0 * step);
      for (std::size_t j = 0; j < n; ++j) {
        const double a = a_[i * n + j];
        const double rest = b_[i * n + j] * x;
        if (std::abs(a) > 1e-14) {
          const double p = (-1.0 - rest) / a;
          const double q = (1.0 - rest) / a;
          low = std::max(low, std::min(p, q));
          high = std::min(high, std::max(p, q));
        }
      }
      const double next = std::max(0.0, x + 2.0 * step * std::max(high, low));
      time += 2.0 * step / std::max(std::sqrt(x) + std::sqrt(next), 1e-12);
      x = next;
    }
    return time;
  }

 private:
  /// max x: |a_j u + b_j x| <= 1, 0 <= x <= cap, 0 <= x + s u <= next, by Seidel's method: where a
  /// row is broken the optimum is on its line, a program of one variable over the rows before it.
  static double largest_x(const double* a, const double* b, std::size_t n, double cap, double next,
                          double s) {
    struct Row {
      double u, x, right;  // u U + x X <= right
    };
    Row rows[64];
    std::size_t count = 0;
    rows[count++] = {s, 1.0, next};
    rows[count++] = {-s, -1.0, 0.0};
    for (std::size_t j = 0; j < n; ++j) {
      rows[count++] = {a[j], b[j], 1.0};
      rows[count++] = {-a[j], -b[j], 1.0};
    }
    double x = cap;
    double u = 0.0;
    for (std::size_t r = 0; r < count; ++r) {
      const Row& row = rows[r];
      if (row.u * u + row.x * x <= row.right * (1.0 + 1e-12) + 1e-14) {
        continue;
      }
      // (u, x) = p + t d along the row's line
      const double square = row.u * row.u + row.x * row.x;
      const double pu = row.u * row.right / square;
      const double px = row.x * row.right / square;
      double du = -row.x;
      double dx = row.u;
      if (dx < 0.0) {
        du = -du;
        dx = -dx;
      }
      double low = -1e300;
      double high = 1e300;
      const auto bound = [&](double slope, double right) {
        if (slope > 1e-15) {
          high = std::min(high, right / slope);
        } else if (slope < -1e-15) {
          low = std::max(low, right / slope);
        }
      };
      bound(dx, cap - px);
      bound(-dx, px);
      for (std::size_t k = 0; k < r; ++k) {
        bound(rows[k].u * du + rows[k].x * dx, rows[k].right - rows[k].u * pu - rows[k].x * px);
      }
      if (low > high) {
        return 0.0;
      }
      const double t = dx > 0.0 ? high : (std::abs(low) < std::abs(high) ? low : high);
      u = pu + t * du;
      x = px + t * dx;
    }
    return std::max(0.0, x);
  }

  std::vector<double> first_;
  std::vector<double> a_;
  std::vector<double> b_;
  std::vector<double> cap_;
  std::vector<double> highest_;
};

}  // namespace flyball::test
