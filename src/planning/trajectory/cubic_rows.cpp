#include <algorithm>
#include <cmath>

#include "planning/trajectory/cell_rows.hpp"

namespace flyball::detail {

namespace {

constexpr double third = 1.0 / 3.0;

/// q' and q'' of one coordinate over an interval as Bézier coefficients.
struct Rates {
  double d[3];
  double p[2];
};

Rates rates(const double* c, std::size_t n, double inverse_span, const TimingCell& cell) {
  const double c1 = c[n];
  const double c2 = c[2 * n];
  const double c3 = c[3 * n];
  Rates of;
  of.d[0] = (c1 + cell.from * (2.0 * c2 + 3.0 * c3 * cell.from)) * inverse_span;
  of.d[2] = (c1 + cell.to * (2.0 * c2 + 3.0 * c3 * cell.to)) * inverse_span;
  of.p[0] = (2.0 * c2 + 6.0 * c3 * cell.from) * (inverse_span * inverse_span);
  of.p[1] = (2.0 * c2 + 6.0 * c3 * cell.to) * (inverse_span * inverse_span);
  of.d[1] = of.d[0] + 0.5 * cell.width * of.p[0];
  return of;
}

class CubicRows final : public CellRows {
 public:
  CubicRows(const Path& path, const CoordinateLimits& limits)
      : n_(static_cast<std::size_t>(path.coordinates())),
        inverse_velocity_(n_, 0.0),
        inverse_acceleration_(n_, 0.0) {
    for (std::size_t j = 0; j < n_; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      if (limits.velocity.size() > 0) {
        inverse_velocity_[j] = 1.0 / limits.velocity(k);
      }
      if (limits.acceleration.size() > 0) {
        inverse_acceleration_[j] = 1.0 / limits.acceleration(k);
      }
    }
    // Coefficients of all pieces, each of four columns.
    coefficients_.resize(path.pieces().size() * 4 * n_, 0.0);
    for (std::size_t i = 0; i < path.pieces().size(); ++i) {
      const PathPiece& piece = path.pieces()[i];
      std::copy_n(piece.coefficients.data(), piece.coefficients.size(),
                  coefficients_.begin() + static_cast<std::ptrdiff_t>(i * 4 * n_));
      inverse_span_.push_back(1.0 / piece.span);
    }
  }

  void fill(const std::vector<TimingCell>& cells, const std::vector<Bezier2>& /*about*/,
            TimingRows& rows) override {
    rows.resize(cells.size(), static_cast<int>(4 * n_), static_cast<int>(uppers_));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      fill_cell(cells[i], i, rows);
    }
  }

  [[nodiscard]] double left(const std::vector<TimingCell>& cells, std::size_t cell,
                            const Bezier2& b, const TimingRows& rows) const override {
    const IntervalProgram program = rows.program(cell);
    const TimingCell& at = cells[cell];
    // At τ = 0, 1/3, 2/3, 1.
    const double x[4] = {b[0], (4.0 * (b[0] + b[1]) + b[2]) / 9.0,
                         (b[0] + 4.0 * (b[1] + b[2])) / 9.0, b[2]};
    double most[4] = {0.0, 0.0, 0.0, 0.0};
    const double* c = &coefficients_[at.piece * 4 * n_];
    for (std::size_t j = 0; j < n_; ++j) {
      const auto row = [&](std::size_t k) { return program.row(static_cast<int>(k * n_ + j), b); };
      const double r[4] = {row(0), row(1), row(2), row(3)};
      const double acceleration[4] = {
          std::abs(r[0]), std::abs(8.0 * r[0] + 12.0 * r[1] + 6.0 * r[2] + r[3]) / 27.0,
          std::abs(r[0] + 6.0 * r[1] + 12.0 * r[2] + 8.0 * r[3]) / 27.0, std::abs(r[3])};
      const Rates of = rates(c + j, n_, inverse_span_[at.piece], at);
      const double e[4] = {of.d[0], (4.0 * (of.d[0] + of.d[1]) + of.d[2]) / 9.0,
                           (of.d[0] + 4.0 * (of.d[1] + of.d[2])) / 9.0, of.d[2]};
      for (std::size_t k = 0; k < 4; ++k) {
        const double v = e[k] * inverse_velocity_[j];
        most[k] = std::max({most[k], acceleration[k], v * v * x[k]});
      }
    }
    double sum = 0.0;
    for (const double used : most) {
      sum += std::min(used, 1.0);
    }
    return 1.0 - 0.25 * sum;
  }

 private:
  void fill_cell(const TimingCell& cell, std::size_t i, TimingRows& rows) const {
    double* alpha = &rows.alpha[i * 4 * n_];
    double* beta = &rows.beta[i * 4 * n_];
    double* gamma = &rows.gamma[i * 4 * n_];
    double* upper_alpha = &rows.upper_alpha[i * uppers_];
    double* upper_beta = &rows.upper_beta[i * uppers_];
    double* upper_gamma = &rows.upper_gamma[i * uppers_];
    const double* c = &coefficients_[cell.piece * 4 * n_];
    const double inverse_width = 1.0 / cell.width;
    // Of 1/cap the largest.
    double first = 0.0;
    double last = 0.0;
    double all = 0.0;
    for (std::size_t j = 0; j < n_; ++j) {
      const Rates of = rates(c + j, n_, inverse_span_[cell.piece], cell);
      const double scale = inverse_velocity_[j];
      const double e[3] = {of.d[0] * scale, of.d[1] * scale, of.d[2] * scale};
      // (q'/v)² of degree 4, times x of degree 6: its ends are caps of b_0 and b_2.
      const double w[5] = {e[0] * e[0], e[0] * e[1], (2.0 * e[1] * e[1] + e[0] * e[2]) * third,
                           e[1] * e[2], e[2] * e[2]};
      const double most = std::max({w[0], w[1], w[2], w[3], w[4]});
      first = std::max(first, w[0]);
      last = std::max(last, w[4]);
      all = std::max(all, most);
      upper_alpha[j] = w[1] * (4.0 / 6.0);
      upper_beta[j] = w[0] * (2.0 / 6.0);
      upper_gamma[j] = 0.0;
      upper_alpha[n_ + j] = w[2] * (6.0 / 15.0);
      upper_beta[n_ + j] = w[1] * (8.0 / 15.0);
      upper_gamma[n_ + j] = w[0] * (1.0 / 15.0);
      upper_alpha[2 * n_ + j] = w[3] * (4.0 / 20.0);
      upper_beta[2 * n_ + j] = w[2] * (12.0 / 20.0);
      upper_gamma[2 * n_ + j] = w[1] * (4.0 / 20.0);
      upper_alpha[3 * n_ + j] = w[4] * (1.0 / 15.0);
      upper_beta[3 * n_ + j] = w[3] * (8.0 / 15.0);
      upper_gamma[3 * n_ + j] = w[2] * (6.0 / 15.0);
      upper_alpha[4 * n_ + j] = 0.0;
      upper_beta[4 * n_ + j] = w[4] * (2.0 / 6.0);
      upper_gamma[4 * n_ + j] = w[3] * (4.0 / 6.0);
      // q' u + q'' x of degree 3, u = [(b_1 - b_0), (b_2 - b_1)]/width.
      const double to_rate = inverse_acceleration_[j] * inverse_width;
      const double d0 = of.d[0] * to_rate;
      const double d1 = of.d[1] * to_rate;
      const double d2 = of.d[2] * to_rate;
      const double p0 = of.p[0] * inverse_acceleration_[j];
      const double p1 = of.p[1] * inverse_acceleration_[j];
      alpha[j] = p0 - d0;
      beta[j] = d0;
      gamma[j] = 0.0;
      alpha[n_ + j] = (p1 - 2.0 * d1) * third;
      beta[n_ + j] = (2.0 * p0 + 2.0 * d1 - d0) * third;
      gamma[n_ + j] = d0 * third;
      alpha[2 * n_ + j] = -d2 * third;
      beta[2 * n_ + j] = (2.0 * p1 + d2 - 2.0 * d1) * third;
      gamma[2 * n_ + j] = (p0 + 2.0 * d1) * third;
      alpha[3 * n_ + j] = 0.0;
      beta[3 * n_ + j] = -d2;
      gamma[3 * n_ + j] = p1 + d2;
    }
    for (std::size_t r = 5 * n_; r < uppers_; ++r) {
      upper_alpha[r] = upper_beta[r] = upper_gamma[r] = 0.0;
    }
    const double floor = std::max(0.02 * all, 1e-300);
    rows.cap[i] = {1.0 / std::max(first, floor), 4.0 / std::max(all, floor),
                   1.0 / std::max(last, floor)};
    rows.idle[i] = all > 0.0 ? 1.0 / all : 1e300;
  }

  std::size_t n_;
  std::size_t uppers_ = 5 * n_ + n_ % 2;  ///< An even number.
  std::vector<double> inverse_velocity_;
  std::vector<double> inverse_acceleration_;
  std::vector<double> coefficients_;
  std::vector<double> inverse_span_;
};

}  // namespace

std::unique_ptr<CellRows> cubic_rows(const Path& path, const CoordinateLimits& limits) {
  return std::make_unique<CubicRows>(path, limits);
}

}  // namespace flyball::detail
