#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/planning/path/edit_path.hpp>

#include "planning/trajectory/timing_cells.hpp"

namespace flyball::detail {

namespace {

/// Intervals of a piece in the first pass.
constexpr int first_cells = 3;

/// Whether a piece goes anywhere.
bool moves(const PathPiece& piece) {
  const Eigen::MatrixXd& c = piece.coefficients;
  return c.cols() > 1 && c.rightCols(c.cols() - 1).cwiseAbs().maxCoeff() > 0.0;
}

/// How x goes on from one piece to the next: (|q'-|/|q'+|)²; at a corner, and where the curvature
/// of a way that is faced jumps, 0.
double join_of(const Path& path, std::size_t piece, std::size_t next, const JointRules& rules) {
  const PathState at_end = path.at(piece, 1.0);
  const PathState at_begin = path.at(next, 0.0);
  const PathVector& before = at_end.first;
  const PathVector& after = at_begin.first;
  const double v = before.norm();
  const double w = after.norm();
  if (!(v > 0.0) || !(w > 0.0)) {
    return 0.0;
  }
  if ((before / v - after / w).norm() > corner_angle) {
    return 0.0;
  }
  constexpr double rounding = 1e-6;
  if (rules.bends) {
    const PathVector bend = by_arc_length(at_end).second;
    const PathVector next_bend = by_arc_length(at_begin).second;
    if ((bend - next_bend).norm() > rounding * (bend.norm() + next_bend.norm()) + 1e-9) {
      return 0.0;
    }
  }
  if (rules.faces) {
    const double bend = planar_curvature(at_end);
    const double next_bend = planar_curvature(at_begin);
    if (std::abs(bend - next_bend) > rounding * (std::abs(bend) + std::abs(next_bend)) + 1e-9) {
      return 0.0;
    }
  }
  const double ratio = v / w;
  return std::abs(ratio - 1.0) < 1e-9 ? 1.0 : ratio * ratio;
}

}  // namespace

std::vector<TimingCell> coarse_cells(const Path& path, const std::vector<std::vector<double>>& cuts,
                                     const JointRules& rules) {
  std::vector<TimingCell> cells;
  cells.reserve(path.pieces().size() * first_cells);
  for (std::size_t i = 0; i < path.pieces().size(); ++i) {
    const PathPiece& piece = path.pieces()[i];
    if (!moves(piece)) {
      continue;
    }
    double from = 0.0;
    const std::size_t parts = cuts.empty() ? 1 : cuts[i].size() + 1;
    for (std::size_t k = 0; k < parts; ++k) {
      const double to = k + 1 < parts ? cuts[i][k] : 1.0;
      for (int m = 0; m < first_cells; ++m) {
        const double a = from + (to - from) * m / first_cells;
        const double b = m + 1 == first_cells ? to : from + (to - from) * (m + 1) / first_cells;
        cells.push_back({i, a, b, (b - a) * piece.span, 1.0});
      }
      from = to;
    }
    std::size_t next = i + 1;
    while (next < path.pieces().size() && !moves(path.pieces()[next])) {
      ++next;
    }
    if (next < path.pieces().size()) {
      const double join = join_of(path, i, next, rules);
      cells.back().join = join > 0.0 || rules.accelerates ? join : -1.0;
    }
  }
  return cells;
}

double total_duration(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double duration = detail::cell_duration(b[i], cells[i].width);
    sum += std::isfinite(duration) ? duration : 0.0;
  }
  return sum;
}

std::vector<double> losses(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b,
                           const std::vector<double>& left) {
  const std::size_t n = cells.size();
  std::vector<double> time(n);
  std::vector<double> loss(n);
  for (std::size_t i = 0; i < n; ++i) {
    time[i] = detail::cell_duration(b[i], cells[i].width);
    loss[i] = left[i] * time[i];
  }
  for (std::size_t i = 1; i < n; ++i) {
    const double x = b[i][0];
    if (!(x < b[i - 1][0] && x <= b[i][2])) {
      continue;
    }
    double weight = 0.0;
    for (std::size_t k = i; k < n && b[k][2] >= b[k][0]; ++k) {
      weight += time[k] * x / b[k][2];
    }
    for (std::size_t k = i; k-- > 0 && b[k][0] >= b[k][2];) {
      weight += time[k] * x / b[k][0];
    }
    for (std::size_t k = i > 1 ? i - 2 : 0; k < std::min(n, i + 2); ++k) {
      const double share = k == i || k + 1 == i ? 2.0 : 1.0;
      loss[k] = std::max(loss[k], share * left[k] * weight);
    }
  }
  return loss;
}

Bezier2 part_of(const Bezier2& b, double from, double to) noexcept {
  const auto blossom = [&](double s, double t) {
    return (1.0 - s) * (1.0 - t) * b[0] + (s + t - 2.0 * s * t) * b[1] + s * t * b[2];
  };
  return {blossom(from, from), blossom(from, to), blossom(to, to)};
}

void share_out(std::vector<int>& parts, std::size_t most) {
  std::size_t more = 0;
  for (const int part : parts) {
    more += static_cast<std::size_t>(part - 1);
  }
  if (parts.size() + more <= most) {
    return;
  }
  const double allowed = most > parts.size() ? static_cast<double>(most - parts.size()) : 0.0;
  const double share = allowed / static_cast<double>(more);
  for (int& part : parts) {
    part = 1 + static_cast<int>(share * (part - 1));
  }
}

void refine(std::vector<TimingCell>& cells, std::vector<Bezier2>& motion,
            const std::vector<int>& parts) {
  std::vector<TimingCell> finer;
  std::vector<Bezier2> on_finer;
  std::size_t count = 0;
  for (const int part : parts) {
    count += static_cast<std::size_t>(part);
  }
  finer.reserve(count);
  on_finer.reserve(motion.empty() ? 0 : count);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const TimingCell& cell = cells[i];
    const double share = 1.0 / parts[i];
    for (int m = 0; m < parts[i]; ++m) {
      TimingCell part = cell;
      part.from = cell.from + (cell.to - cell.from) * share * m;
      part.to = m + 1 == parts[i] ? cell.to : cell.from + (cell.to - cell.from) * share * (m + 1);
      part.width = cell.width * share;
      if (m + 1 < parts[i]) {
        part.join = 1.0;
        part.most = std::numeric_limits<double>::infinity();
      }
      finer.push_back(part);
      if (!motion.empty()) {
        on_finer.push_back(part_of(motion[i], share * m, share * (m + 1)));
      }
    }
  }
  cells = std::move(finer);
  motion = std::move(on_finer);
}

}  // namespace flyball::detail
