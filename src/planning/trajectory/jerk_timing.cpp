#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/try.hpp"
#include "planning/trajectory/four_points.hpp"
#include "planning/trajectory/jerk_program.hpp"
#include "planning/trajectory/jerk_rows.hpp"
#include "planning/trajectory/jerk_timing.hpp"
#include "planning/trajectory/timing_cells.hpp"

namespace flyball::detail {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
/// No finer mesh than of that many intervals is asked for.
constexpr std::size_t most_cells = 3'000;

/// The way s = j t³/6 from rest over a width w, or to rest: with y = j^{2/3} at its end
///
///     x = y 6^{4/3}/4 w^{4/3},   u = y 6^{1/3} w^{1/3},   t = 6^{1/3} w^{1/3} y^{-1/2}.
struct RestWay {
  TimingCell cell;
  bool backwards = false;  ///< To rest.
  double most = 0.0;       ///< Of y, under all limits.
  double neighbour = 0.0;  ///< Width of the interval beside it, whose x goes on smoothly.

  [[nodiscard]] double x() const noexcept { return 0.25 * std::pow(6.0 * cell.width, 4.0 / 3.0); }
  [[nodiscard]] double u() const noexcept { return std::cbrt(6.0 * cell.width); }
  /// m of the neighbour at y = 1.
  [[nodiscard]] double middle() const noexcept { return x() + neighbour * u(); }
};

/// From stop to stop, or to an end of the path that is passed.
struct Segment {
  std::size_t begin = 0;  ///< Of the intervals without those of rest.
  std::size_t end = 0;
  std::optional<RestWay> from;
  std::optional<RestWay> to;
  JerkProgram program;
};

class JerkTiming {
 public:
  JerkTiming(const Path& path, CellRows& limits,
             const std::vector<std::unique_ptr<MotionLimit>>& all, const JerkEnds& ends)
      : path_(path),
        limits_(limits),
        all_(all),
        jerks_(path, all),
        ends_(ends),
        work_(7e6 + 5e5 * static_cast<double>(path.pieces().size())) {
    constexpr double finest = 5e-5;  // of the time: where rounding of the jerks is felt
    ends_.tolerance = std::max(ends_.tolerance, finest);
  }

  /// Intervals and a first motion, of what is fastest without limits of jerks.
  void begin(const std::vector<TimingCell>& coarse, const std::vector<Bezier2>& motion) {
    const std::size_t n = coarse.size();
    for (std::size_t i = 0; i < n;) {
      std::size_t last = i;
      while (last + 1 < n && coarse[last].join != 0.0) {
        ++last;
      }
      add_segment(coarse, motion, i, last, i > 0 || !(ends_.first > 0.0),
                  last + 1 < n || !(ends_.last > 0.0));
      i = last + 1;
    }
  }

  /// @return Whether a motion was found that keeps to all limits.
  bool solve() {
    constexpr int most_meshes = 7;
    double best = infinite;
    std::vector<TimingCell> cells;
    std::vector<Bezier2> b;
    std::vector<Segment> segments;
    for (int mesh = 0; mesh < most_meshes && solve_mesh(); ++mesh) {
      const double time = duration();
      const bool done = best - time <= ends_.tolerance * time || cells_.size() > most_cells;
      if (time < best) {
        best = time;
        cells = cells_;
        b = b_;
        segments = segments_;
      }
      if (done || !cut(time)) {
        break;
      }
    }
    cells_ = std::move(cells);
    b_ = std::move(b);
    segments_ = std::move(segments);
    return best < infinite;
  }

  [[nodiscard]] std::vector<PathTrajectory::Span> spans() const {
    std::vector<PathTrajectory::Span> all;
    double t = 0.0;
    const auto add = [&](const TimingCell& cell, double duration, double rate, double u, double c,
                         double jerk) {
      const double span = path_.pieces()[cell.piece].span;
      all.push_back(
          {t, duration, cell.from * span, cell.width, rate, u, c, jerk, cell.piece, 1.0 / span});
      t += duration;
    };
    for (const Segment& segment : segments_) {
      const auto rest = [&](const RestWay& way, double m) {
        const double y = m / way.middle();
        const double jerk = y * std::sqrt(y);
        const double duration = way.u() / std::sqrt(y);
        const double end = way.backwards ? 1.0 : 0.0;
        add(way.cell, duration, end * 0.5 * jerk * duration * duration, -end * jerk * duration, 0.0,
            jerk);
      };
      if (segment.from) {
        rest(*segment.from, b_[segment.begin][1]);
      }
      for (std::size_t i = segment.begin; i < segment.end; ++i) {
        const Bezier2& b = b_[i];
        const double w = cells_[i].width;
        add(cells_[i], cell_duration(b, w), std::sqrt(b[0]), (b[1] - b[0]) / w,
            (b[0] - 2.0 * b[1] + b[2]) / (w * w), 0.0);
      }
      if (segment.to) {
        rest(*segment.to, b_[segment.end - 1][1]);
      }
    }
    return all;
  }

 private:
  /// |q'|, and by how much it grows, where accelerations are continuous.
  struct Pace {
    double first;
    double second;
  };
  [[nodiscard]] Pace pace(const TimingCell& cell, double t) const {
    const PathState state = path_.at(cell.piece, t);
    const Eigen::Index n =
        ends_.travels ? std::min<Eigen::Index>(2, state.first.size()) : state.first.size();
    const double first = state.first.head(n).norm();
    return {first, first > 0.0 ? state.first.head(n).dot(state.second.head(n)) / first : 0.0};
  }

  /// A part of an interval between two shares of it.
  [[nodiscard]] static TimingCell part(const TimingCell& cell, double from, double to) {
    TimingCell of = cell;
    of.from = cell.from + (cell.to - cell.from) * from;
    of.to = to < 1.0 ? cell.from + (cell.to - cell.from) * to : cell.to;
    of.width = cell.width * (to - from);
    if (to < 1.0) {
      of.join = 1.0;
      of.most = infinite;
    }
    return of;
  }

  /// The largest y of a way from rest or to it.
  [[nodiscard]] double most_from_rest(const RestWay& way) const {
    constexpr int parts = 12;
    constexpr double caution = 1.02;  // limits between the points that are looked at
    double y = jerks_.from_rest(way.cell, way.backwards);
    for (const auto& limit : all_) {
      std::vector<MotionRow> rows(limit->row_names.size());
      std::vector<double> caps(limit->cap_names.size());
      for (int k = 0; k <= parts; ++k) {
        const double share = static_cast<double>(k) / parts;
        const double tau = std::clamp(way.backwards ? 1.0 - share : share, 1e-9, 1.0 - 1e-9);
        const double t = way.cell.from + (way.cell.to - way.cell.from) * tau;
        const double s = path_.breaks()[way.cell.piece] + t * path_.pieces()[way.cell.piece].span;
        limit->evaluate(path_.at(way.cell.piece, t), s, rows.data(), caps.data());
        const double x = way.x() * caution;
        for (const double cap : caps) {
          y = std::min(y, 1.0 / (cap * x));
        }
        for (const MotionRow& row : rows) {
          const auto use = [&](double of) {
            return std::abs(row.a) * way.u() * caution * of + std::abs(row.b) * x * of +
                   std::abs(row.k) * std::sqrt(x * of) + std::abs(row.c);
          };
          if (use(y) > 1.0) {
            double low = 0.0;
            double high = y;
            for (int step = 0; step < 60; ++step) {
              const double middle = 0.5 * (low + high);
              (use(middle) > 1.0 ? high : low) = middle;
            }
            y = low;
          }
        }
      }
    }
    return y;
  }

  /// How much of an interval beside a stop is gone with a constant d³s/dt³: what the phase of
  /// growing acceleration takes, a³/(6 j²), or a part.
  [[nodiscard]] double rest_share(const TimingCell& cell, bool backwards) const {
    constexpr double least = 1e-10;
    RestWay way{.cell = backwards ? part(cell, 1.0 - 1e-6, 1.0) : part(cell, 0.0, 1e-6),
                .backwards = backwards};
    const double y = jerks_.from_rest(way.cell, backwards);
    const double t = backwards ? cell.to : cell.from;
    const PathState state = path_.at(cell.piece, t);
    const double s = path_.breaks()[cell.piece] + t * path_.pieces()[cell.piece].span;
    double slowest = 1e-300;  // of 1/a
    for (const auto& limit : all_) {
      std::vector<MotionRow> rows(limit->row_names.size());
      std::vector<double> caps(limit->cap_names.size());
      limit->evaluate(state, s, rows.data(), caps.data());
      for (const MotionRow& row : rows) {
        slowest = std::max(slowest, std::abs(row.a) / std::max(0.1, 1.0 - std::abs(row.c)));
      }
    }
    const double a = 1.0 / slowest;
    const double way_of_phase = a * a * a / (6.0 * y * y * y);
    return std::clamp(0.3 * way_of_phase / cell.width, least, 0.2);
  }

  void add_segment(const std::vector<TimingCell>& coarse, const std::vector<Bezier2>& motion,
                   std::size_t first, std::size_t last, bool from_rest, bool to_rest) {
    constexpr double growth = 1.6;
    Segment segment;
    segment.begin = cells_.size();
    // Shares of the first interval and of the last, away from the stops.
    const auto graded = [&](double share) {
      std::vector<double> at{0.0, share};
      const double steps = std::max(1.0, std::ceil(std::log(1.0 / share) / std::log(growth)));
      for (double k = 1.0; k < steps; ++k) {
        at.push_back(share * std::pow(1.0 / share, k / steps));
      }
      at.push_back(1.0);
      return at;
    };
    for (std::size_t i = first; i <= last; ++i) {
      const bool starts = i == first && from_rest;
      const bool stops = i == last && to_rest;
      std::vector<double> at{0.0, 1.0};
      if (starts && stops) {
        at = graded(rest_share(part(coarse[i], 0.0, 0.5), false));
        std::vector<double> back = graded(rest_share(part(coarse[i], 0.5, 1.0), true));
        std::reverse(back.begin(), back.end());
        for (double& share : at) {
          share *= 0.5;
        }
        for (std::size_t k = 1; k < back.size(); ++k) {
          at.push_back(1.0 - 0.5 * back[k]);
        }
      } else if (starts) {
        at = graded(rest_share(coarse[i], false));
      } else if (stops) {
        at = graded(rest_share(coarse[i], true));
        std::reverse(at.begin(), at.end());
        for (double& share : at) {
          share = 1.0 - share;
        }
      } else if (first == last || i == first || i == last) {
        at = {0.0, 0.25, 0.5, 1.0};
      }
      for (std::size_t k = 0; k + 1 < at.size(); ++k) {
        const TimingCell cell = part(coarse[i], at[k], at[k + 1]);
        if (starts && k == 0) {
          segment.from = RestWay{.cell = cell};
        } else if (stops && k + 2 == at.size()) {
          segment.to = RestWay{.cell = cell, .backwards = true};
        } else {
          cells_.push_back(cell);
          b_.push_back(part_of(motion[i], at[k], at[k + 1]));
        }
      }
    }
    segment.end = cells_.size();
    for (std::optional<RestWay>* way : {&segment.from, &segment.to}) {
      if (*way) {
        (*way)->most = most_from_rest(**way);
      }
    }
    // x of the fastest motion, but no more than what starts with the largest jerk can have.
    about_.resize(cells_.size());
    for (std::size_t i = segment.begin; i < segment.end; ++i) {
      for (std::size_t k = 0; k < JerkRows::points; ++k) {
        about_[i][k] = parabola(b_[i], static_cast<double>(k) / 6.0);
      }
    }
    const auto hold = [&](const RestWay& way) {
      double y = way.most;
      double s = way.cell.width;
      const std::size_t n = segment.end - segment.begin;
      for (std::size_t m = 0; m < n; ++m) {
        const std::size_t i = way.backwards ? segment.end - 1 - m : segment.begin + m;
        for (std::size_t k = 0; k < JerkRows::points; ++k) {
          const double share = static_cast<double>(way.backwards ? 6 - k : k) / 6.0;
          const double reached =
              0.25 * y * std::pow(6.0 * (s + share * cells_[i].width), 4.0 / 3.0);
          about_[i][k] = std::min(about_[i][k], reached);
        }
        s += cells_[i].width;
        if (m + 1 < n) {
          double join = way.backwards ? 1.0 / cells_[i - 1].join : cells_[i].join;
          s *= std::sqrt(join);
          y *= std::cbrt(join);
        }
      }
    };
    if (segment.from) {
      hold(*segment.from);
    }
    if (segment.to) {
      hold(*segment.to);
    }
    segments_.push_back(std::move(segment));
  }

  void look() {
    limits_.fill(cells_, b_, rows_);
    jerks_.look(cells_);
  }

  /// How the intervals hang together.
  void connect(Segment& segment) const {
    const std::size_t n = segment.end - segment.begin;
    std::vector<JerkProgram::Cell>& of = segment.program.cells;
    of.assign(n, {});
    segment.program.m.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const TimingCell& cell = cells_[segment.begin + k];
      of[k].width = cell.width;
      if (k + 1 == n) {
        continue;
      }
      const TimingCell& next = cells_[segment.begin + k + 1];
      double before = 1.0 / cell.width;
      double after = 1.0 / next.width;
      double sum = before + after;
      double join = 1.0;
      if (next.piece != cell.piece) {  // |q'| u + |q'|' x goes on
        const Pace left = pace(cell, 1.0);
        const Pace right = pace(next, 0.0);
        join = cell.join;
        before = left.first / cell.width;
        after = right.first / next.width;
        sum = before + left.second + join * (after - right.second);
      }
      of[k].g = before / sum;
      of[k].h = after / sum;
      of[k + 1].l = join * of[k].g;
      of[k + 1].f = join * of[k].h;
    }
    const auto rest = [&](std::optional<RestWay>& way, JerkProgram::Cell& cell, double& to) {
      way->neighbour = cell.width;
      to = way->x() / way->middle();
      cell.rest = way->u() * std::sqrt(way->middle());
    };
    if (segment.from) {
      rest(segment.from, of.front(), of.front().f);
    } else {  // the acceleration along the path is zero
      const Pace at = pace(cells_[segment.begin], cells_[segment.begin].from);
      of.front().z_0 = ends_.first;
      of.front().fixed = true;
      segment.program.m.front() = ends_.first * (1.0 - of.front().width * at.second / at.first);
    }
    if (segment.to) {
      rest(segment.to, of.back(), of.back().g);
    } else {
      const Pace at = pace(cells_[segment.end - 1], cells_[segment.end - 1].to);
      of.back().z_2 = ends_.last;
      of.back().fixed = true;
      segment.program.m.back() = ends_.last * (1.0 + of.back().width * at.second / at.first);
    }
  }

  void add_rows(Segment& segment) const {
    JerkProgram& program = segment.program;
    program.clear_rows();
    const auto add = [&](double a, double b, double c, double right) {
      if (a != 0.0 || b != 0.0 || c != 0.0) {
        program.add(a, b, c, right);
      }
    };
    for (std::size_t i = segment.begin; i < segment.end; ++i) {
      program.begin_cell();
      const IntervalProgram of = rows_.program(i);
      for (int r = 0; r < of.rows; ++r) {
        const auto k = static_cast<std::size_t>(r);
        const double shift = of.delta != nullptr ? of.delta[k] : 0.0;
        add(of.alpha[k], of.beta[k], of.gamma[k], 1.0 - shift);
        add(-of.alpha[k], -of.beta[k], -of.gamma[k], 1.0 + shift);
      }
      for (int r = 0; r < of.uppers; ++r) {
        const auto k = static_cast<std::size_t>(r);
        add(of.upper_alpha[k], of.upper_beta[k], of.upper_gamma[k], 1.0);
      }
      const double end = std::min(of.cap[2], cells_[i].most);
      program.add(1.0 / of.cap[0], 0.0, 0.0, 1.0);
      program.add(0.0, 1.0 / of.cap[1], 0.0, 1.0);
      program.add(0.0, 0.0, 1.0 / end, 1.0);
      program.add(0.0, -1.0 / about_[i][3], 0.0, 0.0);
      jerks_.add(cells_[i], i, about_[i], program);
      const auto rest = [&](const std::optional<RestWay>& way) {
        program.add(0.0, 1.0 / (way->most * way->middle()), 0.0, 1.0);
      };
      if (segment.from && i == segment.begin) {
        rest(segment.from);
      }
      if (segment.to && i + 1 == segment.end) {
        rest(segment.to);
      }
    }
  }

  bool solve_mesh() {
    constexpr int most_programs = 30;
    look();
    for (Segment& segment : segments_) {
      connect(segment);
      for (std::size_t k = 0; k < segment.program.cells.size(); ++k) {
        if (!segment.program.cells[k].fixed) {
          segment.program.m[k] = 0.95 * about_[segment.begin + k][3];
        }
      }
    }
    double before = infinite;
    std::optional<std::vector<Bezier2>> kept_to;
    for (int round = 0; round < most_programs; ++round) {
      bool solved = true;
      for (Segment& segment : segments_) {
        add_rows(segment);
        solved = solved && segment.program.solve((round < 2 ? 0.2 : 0.02) * ends_.tolerance, work_);
        for (std::size_t i = segment.begin; i < segment.end; ++i) {
          b_[i] = segment.program.points(i - segment.begin);
        }
      }
      if (!solved) {
        break;
      }
      bool kept = limits_.verify(cells_, b_, rows_, off_);
      for (std::size_t i = 0; i < cells_.size(); ++i) {
        kept = jerks_.verify(cells_[i], i, about_[i], b_[i]) && kept;
      }
      const double time = duration();
      if (kept) {
        kept_to = b_;
        if (before - time <= 0.1 * ends_.tolerance * time) {
          break;
        }
      }
      before = time;
      take_about();
    }
    if (!kept_to) {
      return false;
    }
    b_ = *std::move(kept_to);
    return true;
  }

  void take_about() {
    about_.resize(cells_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      for (std::size_t k = 0; k < JerkRows::points; ++k) {
        about_[i][k] = parabola(b_[i], static_cast<double>(k) / 6.0);
      }
    }
  }

  [[nodiscard]] double duration() const {
    double sum = total_duration(cells_, b_);
    for (const Segment& segment : segments_) {
      for (const JerkProgram::Cell& cell : segment.program.cells) {
        if (cell.rest > 0.0) {
          const auto k = static_cast<std::size_t>(&cell - segment.program.cells.data());
          sum += cell.rest / std::sqrt(b_[segment.begin + k][1]);
        }
      }
    }
    return sum;
  }

  /// Intervals that leave much of all limits for long into parts; not so fine that rounding counts.
  /// @return Whether any was cut.
  bool cut(double time) {
    constexpr double most_parts = 4.0;
    constexpr double finest = 1e5;
    const std::size_t n = cells_.size();
    std::vector<double> left(n);
    for (std::size_t i = 0; i < n; ++i) {
      double used = 0.0;
      for (std::size_t k = 0; k < JerkRows::points; ++k) {
        used += std::min(1.0, jerks_.use(cells_[i], i, k, b_[i])) / JerkRows::points;
      }
      left[i] = std::min(limits_.left(cells_, i, b_[i], rows_), 1.0 - used);
    }
    const double of_each = 2.0 * ends_.tolerance * time / static_cast<double>(n);
    std::vector<int> parts(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double loss = left[i] * cell_duration(b_[i], cells_[i].width);
      const bool fine = jerks_.rounding(cells_[i], i, b_[i]) > finest;
      parts[i] =
          fine ? 1 : 1 + static_cast<int>(std::min(most_parts - 1.0, std::sqrt(loss / of_each)));
    }
    share_out(parts, 2 * most_cells);
    const bool any = std::any_of(parts.begin(), parts.end(), [](int part) { return part > 1; });
    std::size_t at = 0;
    for (Segment& segment : segments_) {
      const std::size_t begin = at;
      for (std::size_t i = segment.begin; i < segment.end; ++i) {
        at += static_cast<std::size_t>(parts[i]);
      }
      segment.begin = begin;
      segment.end = at;
    }
    refine(cells_, b_, parts);
    take_about();
    return any;
  }

  const Path& path_;
  CellRows& limits_;
  const std::vector<std::unique_ptr<MotionLimit>>& all_;
  JerkRows jerks_;
  JerkEnds ends_;
  double work_;  ///< What is left of it, in rows of an interior point step.
  std::vector<TimingCell> cells_;
  std::vector<Bezier2> b_;
  std::vector<JerkRows::Values> about_;
  std::vector<Segment> segments_;
  TimingRows rows_;
  std::vector<double> off_;
};

}  // namespace

Expected<std::vector<PathTrajectory::Span>> jerk_limited(
    const Path& path, CellRows& limits, const std::vector<std::unique_ptr<MotionLimit>>& all,
    const std::vector<TimingCell>& coarse, const std::vector<Bezier2>& motion,
    const JerkEnds& ends) {
  JerkTiming timing(path, limits, all, ends);
  timing.begin(coarse, motion);
  if (!timing.solve()) {
    return refusal(ArgumentError::out_of_range, "time_optimal", "constraints")
        .got("limits of the jerk with which no motion was found")
        .expected("limits that a motion can keep to")
        .hint("raise the jerk limits, or lower the velocities at the ends");
  }
  return timing.spans();
}

}  // namespace flyball::detail
