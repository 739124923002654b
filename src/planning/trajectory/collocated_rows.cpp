#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "planning/trajectory/cell_rows.hpp"
#include "planning/trajectory/four_points.hpp"

namespace flyball::detail {

namespace {

/// Points of an interval, τ = k/6; polynomials of rows go through each second one.
constexpr std::size_t points = 7;
/// What the polynomials are off between their points, as the three points between say, is made
/// larger by this: the difference is of fourth order and largest near two of those points.
constexpr double caution = 1.25;
/// Of the cap of √x: linearised no nearer to standstill.
constexpr double least_speed = 1e-3;

/// c of the quartic Σ B_k c_k through five values at 0, 1/3, 1/2, 2/3, 1.
std::array<double, 5> quartic_through(double f0, double f1, double f2, double f3, double f4) {
  return {f0, (-7.0 * f0 + 54.0 * f1 - 64.0 * f2 + 27.0 * f3 - 2.0 * f4) / 8.0,
          (7.0 * f0 - 81.0 * f1 + 160.0 * f2 - 81.0 * f3 + 7.0 * f4) / 12.0,
          (-2.0 * f0 + 27.0 * f1 - 64.0 * f2 + 54.0 * f3 - 7.0 * f4) / 8.0, f4};
}

double quartic(const std::array<double, 5>& c, double tau) {
  const double s = 1.0 - tau;
  return s * s * s * s * c[0] + 4.0 * s * s * s * tau * c[1] + 6.0 * s * s * tau * tau * c[2] +
         4.0 * s * tau * tau * tau * c[3] + tau * tau * tau * tau * c[4];
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

  void fill(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& about,
            TimingRows& rows) override {
    const std::size_t n = cells.size();
    rows.resize(n, static_cast<int>(4 * row_count_), static_cast<int>(uppers()));
    rows.delta.assign(4 * row_count_ * n, 0.0);
    room_.assign(n * row_count_, 1.0);
    at_.resize(n * points * row_count_);
    w_.resize(n * points * cap_count_);
    for (std::size_t i = 0; i < n; ++i) {
      evaluate(cells[i], i);
      fill_caps(i, rows);
      Bezier2 motion{};
      if (about.empty()) {  // half the highest speed
        motion = {0.25 * rows.cap[i][0], 0.0, 0.25 * rows.cap[i][2]};
        motion[1] = 0.5 * (motion[0] + motion[2]);
      } else {
        motion = about[i];
      }
      fill_rows(cells[i], i, motion, rows);
    }
  }

  bool verify(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& b, TimingRows& rows,
              std::vector<double>& off) override {
    constexpr double allowed = 1e-10;
    off.assign(cells.size(), 0.0);
    bool within = true;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const IntervalProgram program = rows.program(i);
      bool refill = has_speeds_;
      for (std::size_t r = 0; r < row_count_; ++r) {
        double& room = room_[i * row_count_ + r];
        std::array<double, 4> c{};
        double hull = 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
          c[k] = room * program.row(static_cast<int>(k * row_count_ + r), b[i]);
          hull = std::max(hull, std::abs(c[k]));
        }
        double apart = 0.0;
        for (std::size_t k = 0; k < points; ++k) {
          const double exact = value(cells[i], i, r, k, b[i]);
          apart = std::max(apart, std::abs(exact - cubic_at(c, static_cast<double>(k) / 6.0)));
        }
        const double broken = hull + apart - 1.0;
        if (broken > allowed) {
          within = false;
          refill = true;
          off[i] = std::max(off[i], apart);
          room = std::max(0.3, std::min(1.0 - caution * apart, room - 0.2 * broken));
        }
      }
      if (refill) {
        fill_rows(cells[i], i, b[i], rows);
      }
    }
    return within;
  }

  [[nodiscard]] double left(const std::vector<TimingCell>& cells, std::size_t cell,
                            const Bezier2& b, const TimingRows& /*rows*/) const override {
    double sum = 0.0;
    for (std::size_t k = 0; k < points; k += 2) {
      const double x = parabola(b, static_cast<double>(k) / 6.0);
      double most = 0.0;
      for (std::size_t c = 0; c < cap_count_; ++c) {
        most = std::max(most, w_[(cell * points + k) * cap_count_ + c] * x);
      }
      for (std::size_t r = 0; r < row_count_; ++r) {
        most = std::max(most, std::abs(value(cells[cell], cell, r, k, b)));
      }
      sum += std::min(most, 1.0);
    }
    return 1.0 - 0.25 * sum;
  }

  [[nodiscard]] bool is_put_about() const override { return has_speeds_; }

 private:
  /// Rows of one side: an even number.
  [[nodiscard]] std::size_t uppers() const noexcept { return 5 * cap_count_ + cap_count_ % 2; }
  void evaluate(const TimingCell& cell, std::size_t i) {
    for (std::size_t k = 0; k < points; ++k) {
      // A hair inside: at a border the limits are those of this side.
      const double tau = std::clamp(static_cast<double>(k) / 6.0, 1e-9, 1.0 - 1e-9);
      const double t = cell.from + (cell.to - cell.from) * tau;
      const PathState state = path_.at(cell.piece, t);
      const double s = path_.breaks()[cell.piece] + t * path_.pieces()[cell.piece].span;
      MotionRow* rows = at_.data() + (i * points + k) * row_count_;
      double* caps = w_.data() + (i * points + k) * cap_count_;
      for (const auto& limit : limits_) {
        limit->evaluate(state, s, rows, caps);
        rows += limit->row_names.size();
        caps += limit->cap_names.size();
      }
    }
    for (std::size_t r = 0; r < points * row_count_ && !has_speeds_; ++r) {
      has_speeds_ = at_[i * points * row_count_ + r].k != 0.0;
    }
  }

  /// w x <= 1 with w the quartic through five points (of |q'|² of cubics exact), raised by what it
  /// is below between them: degree six.
  void fill_caps(std::size_t i, TimingRows& rows) const {
    double first = 0.0;
    double last = 0.0;
    double all = 0.0;
    const std::size_t upper_from = i * uppers();
    for (std::size_t c = 0; c < cap_count_; ++c) {
      const auto w = [&](std::size_t k) { return w_[(i * points + k) * cap_count_ + c]; };
      std::array<double, 5> f = quartic_through(w(0), w(2), w(3), w(4), w(6));
      const double below =
          std::max({0.0, w(1) - quartic(f, 1.0 / 6.0), w(5) - quartic(f, 5.0 / 6.0)});
      for (double& value : f) {
        value += caution * below;
      }
      first = std::max(first, f[0]);
      last = std::max(last, f[4]);
      all = std::max({all, f[0], f[1], f[2], f[3], f[4]});
      constexpr double fifteenth = 1.0 / 15.0;
      const double entries[5][3] = {
          {10.0 * fifteenth * f[1], 5.0 * fifteenth * f[0], 0.0},
          {6.0 * fifteenth * f[2], 8.0 * fifteenth * f[1], fifteenth * f[0]},
          {0.2 * f[3], 0.6 * f[2], 0.2 * f[1]},
          {fifteenth * f[4], 8.0 * fifteenth * f[3], 6.0 * fifteenth * f[2]},
          {0.0, 5.0 * fifteenth * f[4], 10.0 * fifteenth * f[3]}};
      for (std::size_t k = 0; k < 5; ++k) {
        rows.upper_alpha[upper_from + 5 * c + k] = entries[k][0];
        rows.upper_beta[upper_from + 5 * c + k] = entries[k][1];
        rows.upper_gamma[upper_from + 5 * c + k] = entries[k][2];
      }
    }
    for (std::size_t r = 5 * cap_count_; r < uppers(); ++r) {
      rows.upper_alpha[upper_from + r] = 0.0;
      rows.upper_beta[upper_from + r] = 0.0;
      rows.upper_gamma[upper_from + r] = 0.0;
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
      const double scale = 1.0 / room_[i * row_count_ + r];
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
            cubic_through(entries[0][e], entries[1][e], entries[2][e], entries[3][e]);
        double* const all[4] = {rows.alpha.data(), rows.beta.data(), rows.gamma.data(),
                                rows.delta.data()};
        double* into = all[e] + 4 * row_count_ * i + r;
        for (std::size_t k = 0; k < 4; ++k) {
          into[k * row_count_] = scale * c[k];
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
  std::vector<double> room_;   ///< Of interval, row: what of the limit its polynomial may use.
  bool has_speeds_ = false;
};

}  // namespace

std::unique_ptr<CellRows> collocated_rows(const Path& path,
                                          std::vector<std::unique_ptr<MotionLimit>> limits) {
  return std::make_unique<CollocatedRows>(path, std::move(limits));
}

}  // namespace flyball::detail
