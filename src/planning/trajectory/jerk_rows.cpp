#include <algorithm>
#include <cmath>

#include "planning/trajectory/four_points.hpp"
#include "planning/trajectory/jerk_rows.hpp"

namespace flyball::detail {

namespace {

/// What a cubic is off between its points is made larger by this, as in `collocated_rows`.
constexpr double jerk_caution = 1.25;

/// ±⅔ P √x̄ + x/(3 x̄)
double held(double side, double P, double x, double about) {
  return side * (2.0 / 3.0) * P * std::sqrt(about) + x / (3.0 * about);
}

}  // namespace

JerkRows::JerkRows(const Path& path, const std::vector<std::unique_ptr<MotionLimit>>& limits)
    : path_(path), limits_(limits) {
  for (const auto& limit : limits) {
    count_ += limit->jerk_names.size();
  }
}

void JerkRows::evaluate(const TimingCell& cell, double tau, JerkRow* rows) const {
  // A hair inside: at a border the limits are those of this side.
  const double t = cell.from + (cell.to - cell.from) * std::clamp(tau, 1e-9, 1.0 - 1e-9);
  const PathState state = path_.at(cell.piece, t);
  const double s = path_.breaks()[cell.piece] + t * path_.pieces()[cell.piece].span;
  for (const auto& limit : limits_) {
    if (!limit->jerk_names.empty()) {
      limit->evaluate_jerk(state, s, rows);
      rows += limit->jerk_names.size();
    }
  }
}

void JerkRows::look(const std::vector<TimingCell>& cells) {
  at_.resize(cells.size() * points * count_);
  room_.assign(cells.size() * count_, 1.0);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (std::size_t k = 0; k < points; ++k) {
      evaluate(cells[i], static_cast<double>(k) / 6.0, &at_[(i * points + k) * count_]);
    }
  }
}

double JerkRows::slope_of(const JerkRow& row, const TimingCell& cell, double tau,
                          const Bezier2& b) const {
  const double w = cell.width;
  const double u = ((b[1] - b[0]) * (1.0 - tau) + (b[2] - b[1]) * tau) / w;
  const double c = (b[0] - 2.0 * b[1] + b[2]) / (w * w);
  return row.e * parabola(b, tau) + row.b * u + row.a * c;
}

void JerkRows::add(const TimingCell& cell, std::size_t i, const Values& about,
                   JerkProgram& program) const {
  const double w = 1.0 / cell.width;
  for (std::size_t r = 0; r < count_; ++r) {
    for (const double side : {1.0, -1.0}) {
      std::array<std::array<double, 4>, 3> entries{};
      for (std::size_t k = 0; k < 4; ++k) {
        const JerkRow& row = at_[(i * points + 2 * k) * count_ + r];
        const double t = static_cast<double>(k) / 3.0;
        const double s = 1.0 - t;
        const double x = about[2 * k];
        const double of_P = side * (2.0 / 3.0) * std::sqrt(x);
        const double of_x = of_P * row.e + 1.0 / (3.0 * x);
        const double c = of_P * row.a * w * w;
        const double u = of_P * row.b * w;
        entries[0][k] = of_x * s * s - u * s + c;
        entries[1][k] = of_x * 2.0 * s * t + u * (s - t) - 2.0 * c;
        entries[2][k] = of_x * t * t + u * t + c;
      }
      std::array<std::array<double, 4>, 3> b{};
      for (std::size_t e = 0; e < 3; ++e) {
        b[e] = cubic_through(entries[e][0], entries[e][1], entries[e][2], entries[e][3]);
      }
      for (std::size_t k = 0; k < 4; ++k) {
        program.add(b[0][k], b[1][k], b[2][k], room_[i * count_ + r]);
      }
    }
  }
}

bool JerkRows::verify(const TimingCell& cell, std::size_t i, const Values& about,
                      const Bezier2& b) {
  constexpr double allowed = 1e-10;
  constexpr double least_room = 0.5;
  bool within = true;
  for (std::size_t r = 0; r < count_; ++r) {
    double most_apart = 0.0;
    for (const double side : {1.0, -1.0}) {
      Values exact{};
      for (std::size_t k = 0; k < points; ++k) {
        const double tau = static_cast<double>(k) / 6.0;
        exact[k] = held(side, slope_of(at_[(i * points + k) * count_ + r], cell, tau, b),
                        parabola(b, tau), about[k]);
      }
      const std::array<double, 4> c = cubic_through(exact[0], exact[2], exact[4], exact[6]);
      double apart = 0.0;
      for (std::size_t k = 1; k < points; k += 2) {
        apart = std::max(apart, exact[k] - cubic_at(c, static_cast<double>(k) / 6.0));
      }
      within = within && std::max({c[0], c[1], c[2], c[3]}) + apart <= 1.0 + allowed;
      most_apart = std::max(most_apart, apart);
    }
    // Of the motion that comes next, which is near this one.
    room_[i * count_ + r] =
        most_apart > allowed ? std::max(least_room, 1.0 - jerk_caution * most_apart) : 1.0;
  }
  return within;
}

double JerkRows::use(const TimingCell& cell, std::size_t i, std::size_t k, const Bezier2& b) const {
  const double tau = static_cast<double>(k) / 6.0;
  const double root = std::sqrt(std::max(0.0, parabola(b, tau)));
  double most = 0.0;
  for (std::size_t r = 0; r < count_; ++r) {
    most =
        std::max(most, root * std::abs(slope_of(at_[(i * points + k) * count_ + r], cell, tau, b)));
  }
  return most;
}

double JerkRows::rounding(const TimingCell& cell, std::size_t i, const Bezier2& b) const {
  double most = 0.0;
  for (std::size_t r = 0; r < count_; ++r) {
    most = std::max(most, std::abs(at_[(i * points + 3) * count_ + r].a));
  }
  return most * b[1] * std::sqrt(b[1]) / (cell.width * cell.width);
}

double JerkRows::from_rest(const TimingCell& cell, bool backwards) const {
  constexpr std::size_t parts = 12;
  std::vector<JerkRow> rows(count_);
  std::vector<double> G((parts + 1) * count_);
  for (std::size_t k = 0; k <= parts; ++k) {
    const double share = static_cast<double>(k) / parts;
    evaluate(cell, backwards ? 1.0 - share : share, rows.data());
    const double s = share * cell.width * (backwards ? -1.0 : 1.0);
    for (std::size_t r = 0; r < count_; ++r) {  // b is 3 q''
      G[k * count_ + r] = 4.5 * s * s * rows[r].e + 3.0 * s * rows[r].b + rows[r].a;
    }
  }
  double most = 1e-300;
  for (std::size_t r = 0; r < count_; ++r) {
    double bend = 0.0;
    double here = 0.0;
    for (std::size_t k = 0; k <= parts; ++k) {
      here = std::max(here, std::abs(G[k * count_ + r]));
      if (k > 0 && k < parts) {
        bend = std::max(bend, std::abs(G[(k - 1) * count_ + r] - 2.0 * G[k * count_ + r] +
                                       G[(k + 1) * count_ + r]));
      }
    }
    // Between two points a function is beyond them by an eighth of its second difference.
    most = std::max(most, here + 0.25 * bend);
  }
  return std::pow(most, -2.0 / 3.0);
}

}  // namespace flyball::detail
