#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "planning/trajectory/cell_rows.hpp"

namespace flyball::detail {

namespace {

/// Points of an interval, τ = k/6; polynomials go through each second one.
constexpr std::size_t points = 7;
/// What the polynomials are off between their points, as the three points between say, is made
/// larger by this: the difference is of fourth order and largest near two of those points.
constexpr double caution = 1.25;
/// Of the cap of √x: linearised no nearer to standstill.
constexpr double least_speed = 1e-3;

/// c of the cubic Σ B_k c_k through four values at 0, 1/3, 2/3, 1.
template <class Value>
std::array<Value, 4> through(const Value& f0, const Value& f1, const Value& f2, const Value& f3) {
  return {f0, (-5.0 * f0 + 18.0 * f1 - 9.0 * f2 + 2.0 * f3) / 6.0,
          (2.0 * f0 - 9.0 * f1 + 18.0 * f2 - 5.0 * f3) / 6.0, f3};
}

double cubic(const std::array<double, 4>& c, double tau) {
  const double s = 1.0 - tau;
  return s * s * s * c[0] + 3.0 * s * s * tau * c[1] + 3.0 * s * tau * tau * c[2] +
         tau * tau * tau * c[3];
}

double parabola(const Bezier2& b, double tau) {
  const double s = 1.0 - tau;
  return s * s * b[0] + 2.0 * s * tau * b[1] + tau * tau * b[2];
}

class CollocatedRows final : public CellRows {
 public:
  CollocatedRows(const Path& path, std::vector<std::unique_ptr<MotionLimit>> limits)
      : path_(path), limits_(std::move(limits)) {
    for (const auto& limit : limits_) {
      row_count_ += limit->row_names.size();
      cap_count_ += limit->cap_names.size();
    }
  }

  void fill(const std::vector<TimingCell>& cells, TimingRows& rows) override {
    const std::size_t n = cells.size();
    rows.resize(n, static_cast<int>(4 * row_count_), static_cast<int>(4 * cap_count_));
    rows.delta.assign(4 * row_count_ * n, 0.0);
    rows.margin.assign(n, 1.0);
    at_.resize(n * points * row_count_);
    w_.resize(n * points * cap_count_);
    for (std::size_t i = 0; i < n; ++i) {
      evaluate(cells[i], i);
      fill_caps(i, rows);
    }
    // First about half the highest speed; then about what came of it.
    for (std::size_t i = 0; i < n; ++i) {
      const Bezier2& cap = rows.cap[i];
      Bezier2 about{0.25 * cap[0], 0.0, 0.25 * cap[2]};
      about[1] = 0.5 * (about[0] + about[2]);
      fill_rows(cells[i], i, about, rows);
    }
  }

  bool verify(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b,
              TimingRows& rows) override {
    bool within = true;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const IntervalProgram program = rows.program(i);
      double off = 0.0;
      double broken = 0.0;
      for (std::size_t r = 0; r < row_count_; ++r) {
        std::array<double, 4> c{};
        double hull = 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
          c[k] = program.row(static_cast<int>(k * row_count_ + r), b[i]);
          hull = std::max(hull, std::abs(c[k]));
        }
        double apart = 0.0;
        double largest = 0.0;
        for (std::size_t k = 0; k < points; ++k) {
          const double tau = static_cast<double>(k) / 6.0;
          const double exact = value(cells[i], i, r, k, b[i]);
          apart = std::max(apart, std::abs(exact - cubic(c, tau)));
          largest = std::max(largest, std::abs(exact));
        }
        off = std::max(off, apart);
        broken = std::max({broken, largest - 1.0, std::min(1.0, hull) + apart - 1.0});
      }
      const double margin = 1.0 - caution * off;
      if (broken > 1e-10) {
        within = false;
        rows.margin[i] = std::clamp(std::min(margin, rows.margin[i] - 0.25 * broken), 0.05, 1.0);
      } else if (margin > rows.margin[i]) {
        rows.margin[i] = std::max(rows.margin[i], 0.5);
      }
    }
    if (!within && has_speeds_) {
      for (std::size_t i = 0; i < cells.size(); ++i) {
        fill_rows(cells[i], i, b[i], rows);
      }
    }
    return within;
  }

  [[nodiscard]] Use use(const std::vector<TimingCell>& cells, std::size_t cell, const Bezier2& b,
                        const TimingRows& rows) const override {
    static_cast<void>(rows);
    Use most;
    double best = -1.0;
    for (std::size_t c = 0; c < cap_count_; ++c) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 4; ++k) {
        const double x = parabola(b, static_cast<double>(k) / 3.0);
        const double used = w_[(cell * points + 2 * k) * cap_count_ + c] * x;
        most.at[k] = std::max(most.at[k], used);
        sum += used;
      }
      if (sum > best) {
        best = sum;
        most.limit = static_cast<int>(c);
      }
    }
    for (std::size_t r = 0; r < row_count_; ++r) {
      double sum = 0.0;
      for (std::size_t k = 0; k < 4; ++k) {
        const double used = std::abs(value(cells[cell], cell, r, 2 * k, b));
        most.at[k] = std::max(most.at[k], used);
        sum += used;
      }
      if (sum > best) {
        best = sum;
        most.limit = static_cast<int>(cap_count_ + r);
      }
    }
    most.mean = 0.25 * best;
    return most;
  }

  [[nodiscard]] std::string name(int limit) const override {
    auto left = static_cast<std::size_t>(limit);
    for (const auto& of : limits_) {
      if (left < of->cap_names.size()) {
        return of->cap_names[left];
      }
      left -= of->cap_names.size();
    }
    for (const auto& of : limits_) {
      if (left < of->row_names.size()) {
        return of->row_names[left];
      }
      left -= of->row_names.size();
    }
    return {};
  }

 private:
  void evaluate(const TimingCell& cell, std::size_t i) {
    for (std::size_t k = 0; k < points; ++k) {
      // A hair inside: at a border the limits are those of this side.
      const double tau = std::clamp(static_cast<double>(k) / 6.0, 1e-9, 1.0 - 1e-9);
      const PathState state = path_.at(cell.piece, cell.from + (cell.to - cell.from) * tau);
      MotionRow* rows = at_.data() + (i * points + k) * row_count_;
      double* caps = w_.data() + (i * points + k) * cap_count_;
      for (const auto& limit : limits_) {
        limit->evaluate(state, rows, caps);
        rows += limit->row_names.size();
        caps += limit->cap_names.size();
      }
    }
    for (std::size_t r = 0; r < points * row_count_ && !has_speeds_; ++r) {
      has_speeds_ = at_[i * points * row_count_ + r].k != 0.0;
    }
  }

  /// w x <= 1 with w the cubic through four points, raised by what it is below between them: degree
  /// five.
  void fill_caps(std::size_t i, TimingRows& rows) const {
    double first = 0.0;
    double last = 0.0;
    double all = 0.0;
    double* row = rows.upper.data() + 12 * i * cap_count_;
    for (std::size_t c = 0; c < cap_count_; ++c) {
      const auto w = [&](std::size_t k) { return w_[(i * points + k) * cap_count_ + c]; };
      std::array<double, 4> f = through(w(0), w(2), w(4), w(6));
      double below = 0.0;
      for (const std::size_t k : {1U, 3U, 5U}) {
        below = std::max(below, w(k) - cubic(f, static_cast<double>(k) / 6.0));
      }
      for (double& value : f) {
        value += caution * below;
      }
      first = std::max(first, f[0]);
      last = std::max(last, f[3]);
      all = std::max({all, f[0], f[1], f[2], f[3]});
      const double entries[12] = {0.6 * f[1], 0.4 * f[0], 0.0,        0.3 * f[2],
                                  0.6 * f[1], 0.1 * f[0], 0.1 * f[3], 0.6 * f[2],
                                  0.3 * f[1], 0.0,        0.4 * f[3], 0.6 * f[2]};
      row = std::copy(entries, entries + 12, row);
    }
    const double floor = std::max(0.02 * all, 1e-300);
    rows.cap[i] = {1.0 / std::max(first, floor), 4.0 / std::max(all, floor),
                   1.0 / std::max(last, floor)};
    rows.idle[i] = all > 0.0 ? 1.0 / all : 1e300;
  }

  /// a u + (b + k/(2 v)) x + k v/2 + c, v = √x of a motion, through four points: degree three.
  void fill_rows(const TimingCell& cell, std::size_t i, const Bezier2& about, TimingRows& rows) {
    const double inverse = 1.0 / cell.width;
    for (std::size_t r = 0; r < row_count_; ++r) {
      std::array<std::array<double, 4>, 4> entries{};
      for (std::size_t k = 0; k < 4; ++k) {
        const MotionRow& row = at_[(i * points + 2 * k) * row_count_ + r];
        const double tau = static_cast<double>(k) / 3.0;
        const double s = 1.0 - tau;
        double b = row.b;
        double constant = row.c;
        if (row.k != 0.0) {
          const double top = std::max(rows.cap[i][0], rows.cap[i][2]);
          const double v = std::max(std::sqrt(std::max(0.0, parabola(about, tau))),
                                    least_speed * std::sqrt(top));
          b += 0.5 * row.k / v;
          constant += 0.5 * row.k * v;
        }
        entries[k] = {b * s * s - row.a * s * inverse,
                      2.0 * b * s * tau + row.a * (s - tau) * inverse,
                      b * tau * tau + row.a * tau * inverse, constant};
      }
      for (std::size_t e = 0; e < 4; ++e) {
        const std::array<double, 4> c =
            through(entries[0][e], entries[1][e], entries[2][e], entries[3][e]);
        double* into = (e == 0   ? rows.alpha
                        : e == 1 ? rows.beta
                        : e == 2 ? rows.gamma
                                 : rows.delta)
                           .data() +
                       4 * row_count_ * i + r;
        for (std::size_t k = 0; k < 4; ++k) {
          into[k * row_count_] = c[k];
        }
      }
    }
  }

  /// The limit itself, at a point of an interval.
  [[nodiscard]] double value(const TimingCell& cell, std::size_t i, std::size_t r, std::size_t k,
                             const Bezier2& b) const {
    const MotionRow& row = at_[(i * points + k) * row_count_ + r];
    const double tau = static_cast<double>(k) / 6.0;
    const double u = ((b[1] - b[0]) * (1.0 - tau) + (b[2] - b[1]) * tau) / cell.width;
    const double x = std::max(0.0, parabola(b, tau));
    return row.a * u + row.b * x + row.k * std::sqrt(x) + row.c;
  }

  Path path_;
  std::vector<std::unique_ptr<MotionLimit>> limits_;
  std::size_t row_count_ = 0;
  std::size_t cap_count_ = 0;
  std::vector<MotionRow> at_;  ///< Of interval, point, row.
  std::vector<double> w_;      ///< Of interval, point, cap.
  bool has_speeds_ = false;
};

}  // namespace

std::unique_ptr<CellRows> collocated_rows(const Path& path,
                                          std::vector<std::unique_ptr<MotionLimit>> limits) {
  return std::make_unique<CollocatedRows>(path, std::move(limits));
}

}  // namespace flyball::detail
