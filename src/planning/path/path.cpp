#include <flyball/planning/path/path.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_path_join = "Path::join";
constexpr Eigen::Index most_columns = 21;
/// Of the extent, between the end of a piece and the beginning of the next.
constexpr double gap_tolerance = 1e-9;
/// Of a piece, where such a gap is none.
constexpr double rounding = 1e-12;

int counted(const PathState& state, int along) noexcept {
  const int all = static_cast<int>(state.position.size());
  return along > 0 ? std::min(along, all) : all;
}

}  // namespace

Path::Path(std::vector<PathPiece> pieces, int coordinates)
    : pieces_(std::move(pieces)), coordinates_(coordinates) {
  breaks_.reserve(pieces_.size() + 1);
  breaks_.push_back(0.0);
  for (const PathPiece& piece : pieces_) {
    breaks_.push_back(breaks_.back() + piece.span);
  }
}

Expected<Path> Path::join(std::vector<PathPiece> pieces) {
  if (pieces.empty()) {
    return refusal(ArgumentError::empty, in_path_join, "pieces").expected("one or more");
  }
  const Eigen::Index n = pieces.front().coefficients.rows();
  double extent = 0.0;
  double travel = 0.0;
  double total = 0.0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const PathPiece& piece = pieces[i];
    const std::string name = detail::format("piece {}", i + 1);
    const Eigen::MatrixXd& c = piece.coefficients;
    if (c.rows() != n || n < 1 || n > max_path_coordinates || c.cols() < 1) {
      return refusal(ArgumentError::wrong_shape, in_path_join, name)
          .got(detail::format("of {} coordinates and {} coefficients", c.rows(), c.cols()))
          .expected(n < 1 || n > max_path_coordinates
                        ? detail::format("of 1 to {} coordinates", max_path_coordinates)
                        : detail::format("of {} coordinates as the first", n));
    }
    if (c.cols() > most_columns) {
      return refusal(ArgumentError::out_of_range, in_path_join, name)
          .got(detail::format("of degree {}", c.cols() - 1))
          .expected(detail::format("of degree {} or less", most_columns - 1))
          .hint("split it into pieces");
    }
    FLYBALL_CHECK(Checks(in_path_join)
                      .finite(c, name)
                      .positive(piece.span, detail::format("span {}", i + 1)));
    extent = std::max(extent, c.cwiseAbs().maxCoeff());
    travel = std::max(travel, c.cols() > 1 ? c.rightCols(c.cols() - 1).cwiseAbs().maxCoeff() : 0.0);
    const double before = total;
    total += piece.span;
    if (!(total > before)) {
      return refusal(ArgumentError::out_of_range, in_path_join, detail::format("span {}", i + 1))
          .got(format_number(piece.span))
          .expected(detail::format("one that can be told beside {:.4g}, all before it", before))
          .hint("space the knots uniformly, or scale what is larger");
    }
  }
  if (!(travel > 0.0)) {
    return refusal(ArgumentError::out_of_range, in_path_join, "the path")
        .got("all in one place")
        .expected("one that moves");
  }
  if (!std::isfinite(total)) {
    return refusal(ArgumentError::not_finite, in_path_join, "the sum of the spans");
  }
  for (std::size_t i = 1; i < pieces.size(); ++i) {
    const Eigen::VectorXd end = pieces[i - 1].coefficients.rowwise().sum();
    auto begin = pieces[i].coefficients.col(0);
    const double gap = (begin - end).cwiseAbs().maxCoeff();
    if (!(gap <= gap_tolerance * extent)) {
      return refusal(ArgumentError::out_of_range, in_path_join, detail::format("piece {}", i + 1))
          .got(detail::format("{:.4g} away from the end of the one before it", gap))
          .expected("one that begins there")
          .hint("move its first point, or join them by a line");
    }
    // Where a gap is rounding of this piece, too, there is none; rounding of a far longer one
    // before it would move all that follows.
    for (Eigen::Index j = 0; j < n; ++j) {
      if (std::abs(end(j) - begin(j)) <=
          rounding * pieces[i].coefficients.row(j).cwiseAbs().maxCoeff()) {
        begin(j) = end(j);
      }
    }
  }
  return Path(std::move(pieces), static_cast<int>(n));
}

Expected<Path> Path::from(const Spline& spline) {
  std::vector<PathPiece> pieces;
  pieces.reserve(spline.size());
  for (const SplineSegment& segment : spline) {
    Eigen::Index columns = 6;
    while (columns > 2 && segment.coefficients().col(columns - 1).isZero(0.0)) {
      --columns;
    }
    pieces.push_back({segment.coefficients().leftCols(columns), 1.0});
  }
  return join(std::move(pieces));
}

std::size_t Path::piece_at(double s) const noexcept {
  const auto next = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, s);
  return s > 0.0 ? static_cast<std::size_t>(next - breaks_.begin()) - 1 : 0;
}

PathState Path::at(double s) const noexcept {
  const std::size_t i = piece_at(s);
  const double t = (s - breaks_[i]) / pieces_[i].span;
  return at(i, t > 0.0 ? std::min(t, 1.0) : 0.0);
}

PathState Path::at(std::size_t piece, double t) const noexcept {
  const Eigen::MatrixXd& c = pieces_[piece].coefficients;
  PathState state;
  state.position = c.col(c.cols() - 1);
  state.first = PathVector::Zero(coordinates_);
  state.second = state.first;
  state.third = state.first;
  for (Eigen::Index k = c.cols() - 2; k >= 0; --k) {
    state.third = state.third * t + 3.0 * state.second;
    state.second = state.second * t + 2.0 * state.first;
    state.first = state.first * t + state.position;
    state.position = state.position * t + c.col(k);
  }
  const double rate = 1.0 / pieces_[piece].span;
  state.first *= rate;
  state.second *= rate * rate;
  state.third *= rate * rate * rate;
  return state;
}

PathVector Path::position(double s) const noexcept {
  const std::size_t i = piece_at(s);
  const double t = std::clamp((s - breaks_[i]) / pieces_[i].span, 0.0, 1.0);
  const Eigen::MatrixXd& c = pieces_[i].coefficients;
  PathVector q = c.col(c.cols() - 1);
  for (Eigen::Index k = c.cols() - 2; k >= 0; --k) {
    q = q * t + c.col(k);
  }
  return q;
}

PathState by_arc_length(const PathState& state, int along) noexcept {
  const int n = counted(state, along);
  const auto v = state.first.head(n);
  const auto a = state.second.head(n);
  const double square = v.squaredNorm();
  const double sigma = std::sqrt(square);
  const double m = v.dot(a);
  const double rate_of_m = a.squaredNorm() + v.dot(state.third.head(n));
  PathState by;
  by.position = state.position;
  by.first = state.first / sigma;
  const PathVector N = square * state.second - m * state.first;
  by.second = N / (square * square);
  by.third = (square * state.third + m * state.second - rate_of_m * state.first) /
                 (square * square * sigma) -
             4.0 * m * N / (square * square * square * sigma);
  return by;
}

double planar_curvature(const PathState& state) noexcept {
  const double square = state.first.head<2>().squaredNorm();
  return (state.first(0) * state.second(1) - state.first(1) * state.second(0)) /
         (square * std::sqrt(square));
}

double curvature(const PathState& state, int along) noexcept {
  const int n = counted(state, along);
  const auto v = state.first.head(n);
  const auto a = state.second.head(n);
  const double square = v.squaredNorm();
  return (a - (v.dot(a) / square) * v).norm() / square;
}

double travel_heading(const PathState& state) noexcept {
  for (const PathVector* v : {&state.first, &state.second, &state.third}) {
    if ((*v)(0) != 0.0 || (*v)(1) != 0.0) {
      return std::atan2((*v)(1), (*v)(0));
    }
  }
  return 0.0;
}

namespace {

/// ∫ |dq/dt| dt over [a, b] of one piece by 8 points.
double gauss_legendre(const PathPiece& piece, double a, double b, int along) noexcept {
  // Roots and weights of P_8; Abramowitz and Stegun, table 25.4.
  static constexpr std::array<double, 4> x{0.183434642495649805, 0.525532409916328986,
                                           0.796666477413626740, 0.960289856497536232};
  static constexpr std::array<double, 4> w{0.362683783378361983, 0.313706645877887287,
                                           0.222381034453374471, 0.101228536290376259};
  const Eigen::MatrixXd& c = piece.coefficients;
  const Eigen::Index n = along > 0 ? std::min<Eigen::Index>(along, c.rows()) : c.rows();
  const double middle = 0.5 * (a + b);
  const double half = 0.5 * (b - a);
  double sum = 0.0;
  for (std::size_t i = 0; i < 8; ++i) {
    const double t = middle + (i < 4 ? half : -half) * x[i % 4];
    double square = 0.0;
    for (Eigen::Index row = 0; row < n; ++row) {
      double rate = 0.0;
      for (Eigen::Index k = c.cols() - 1; k >= 1; --k) {
        rate = rate * t + static_cast<double>(k) * c(row, k);
      }
      square += rate * rate;
    }
    sum += w[i % 4] * std::sqrt(square);
  }
  return half * sum;
}

double halved(const PathPiece& piece, double a, double b, int along, double whole, double tolerance,
              int depth) noexcept {
  const double middle = 0.5 * (a + b);
  const double left = gauss_legendre(piece, a, middle, along);
  const double right = gauss_legendre(piece, middle, b, along);
  if (depth == 0 || !(std::abs(left + right - whole) > tolerance)) {
    return left + right;
  }
  return halved(piece, a, middle, along, left, tolerance, depth - 1) +
         halved(piece, middle, b, along, right, tolerance, depth - 1);
}

double piece_length(const PathPiece& piece, double a, double b, int along) noexcept {
  const double whole = gauss_legendre(piece, a, b, along);
  return halved(piece, a, b, along, whole, 1e-13 * whole, 40);
}

}  // namespace

double path_length(const Path& path, double from, double to, int along) noexcept {
  if (to < from) {
    return -path_length(path, to, from, along);
  }
  double sum = 0.0;
  const std::size_t last = path.piece_at(to);
  for (std::size_t i = path.piece_at(from); i <= last; ++i) {
    const PathPiece& piece = path.pieces()[i];
    const double begin = path.breaks()[i];
    const double a = std::clamp((from - begin) / piece.span, 0.0, 1.0);
    const double b = std::clamp((to - begin) / piece.span, 0.0, 1.0);
    sum += b > a ? piece_length(piece, a, b, along) : 0.0;
  }
  return sum;
}

double path_length(const Path& path, int along) noexcept {
  return path_length(path, 0.0, path.parameter_end(), along);
}

ArcLength::ArcLength(const Path& path, int along) : path_(&path), along_(along) {
  lengths_.reserve(path.pieces().size() + 1);
  lengths_.push_back(0.0);
  for (const PathPiece& piece : path.pieces()) {
    lengths_.push_back(lengths_.back() + piece_length(piece, 0.0, 1.0, along));
  }
}

double ArcLength::length(double s) const noexcept {
  const std::size_t i = path_->piece_at(s);
  const PathPiece& piece = path_->pieces()[i];
  const double t = std::clamp((s - path_->breaks()[i]) / piece.span, 0.0, 1.0);
  return lengths_[i] + (t > 0.0 ? piece_length(piece, 0.0, t, along_) : 0.0);
}

double ArcLength::parameter(double length) const noexcept {
  if (!(length > 0.0)) {
    return 0.0;
  }
  if (length >= total()) {
    return path_->parameter_end();
  }
  const auto next = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
  const auto i = static_cast<std::size_t>(next - lengths_.begin()) - 1;
  const PathPiece& piece = path_->pieces()[i];
  const double wanted = length - lengths_[i];
  const double all = lengths_[i + 1] - lengths_[i];
  double low = 0.0;
  double high = 1.0;
  double t = wanted / all;
  for (int step = 0; step < 60; ++step) {
    const double error = piece_length(piece, 0.0, t, along_) - wanted;
    if (std::abs(error) <= 1e-14 * all || high - low <= 1e-15) {
      break;
    }
    (error > 0.0 ? high : low) = t;
    const PathState state = path_->at(i, t);
    const double rate = state.first.head(counted(state, along_)).norm() * piece.span;
    const double newton = t - error / rate;
    t = newton > low && newton < high ? newton : 0.5 * (low + high);
  }
  return path_->breaks()[i] + t * piece.span;
}

namespace {

/// The Bézier points of a piece: b_j = Σ_k C(j, k)/C(d, k) c_k.
Eigen::MatrixXd bezier_points(const Eigen::MatrixXd& c) {
  const Eigen::Index d = c.cols() - 1;
  Eigen::MatrixXd b = c;
  for (Eigen::Index k = 1; k <= d; ++k) {  // c_k / C(d, k)
    double binomial = 1.0;
    for (Eigen::Index i = 0; i < k; ++i) {
      binomial *= static_cast<double>(d - i) / static_cast<double>(i + 1);
    }
    b.col(k) /= binomial;
  }
  for (Eigen::Index step = 1; step <= d; ++step) {  // sums of sums give C(j, k)
    for (Eigen::Index j = d; j >= step; --j) {
      b.col(j) += b.col(j - 1);
    }
  }
  return b;
}

/// How far the farthest Bézier point is from the segment between the first and the last.
double distance_from_chord(const Eigen::MatrixXd& b) {
  const Eigen::VectorXd chord = b.col(b.cols() - 1) - b.col(0);
  const double square = chord.squaredNorm();
  double farthest = 0.0;
  for (Eigen::Index j = 1; j + 1 < b.cols(); ++j) {
    const Eigen::VectorXd to = b.col(j) - b.col(0);
    const double along = square > 0.0 ? std::clamp(to.dot(chord) / square, 0.0, 1.0) : 0.0;
    farthest = std::max(farthest, (to - along * chord).norm());
  }
  return farthest;
}

/// De Casteljau's halves.
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> halves(Eigen::MatrixXd b) {
  const Eigen::Index d = b.cols() - 1;
  Eigen::MatrixXd left = b;
  for (Eigen::Index step = 1; step <= d; ++step) {
    for (Eigen::Index j = 0; j <= d - step; ++j) {
      b.col(j) = (0.5 * (b.col(j) + b.col(j + 1))).eval();
    }
    left.col(step) = b.col(0);
  }
  return {std::move(left), std::move(b)};
}

}  // namespace

Expected<std::vector<double>> chord_parameters(const Path& path, double tolerance, int along) {
  constexpr std::string_view name = "chord_parameters";
  constexpr std::size_t most = 1'000'000;
  constexpr int most_halvings = 48;
  FLYBALL_CHECK(check_positive(tolerance, name, "tolerance"));
  struct Part {
    Eigen::MatrixXd points;
    double from;
    double to;
    int depth;
  };
  const Eigen::Index n =
      along > 0 ? std::min<Eigen::Index>(along, path.coordinates()) : path.coordinates();
  std::vector<double> parameters{0.0};
  std::vector<Part> open;
  for (std::size_t i = 0; i < path.pieces().size(); ++i) {
    const PathPiece& piece = path.pieces()[i];
    open.clear();
    open.push_back({bezier_points(piece.coefficients.topRows(n)), 0.0, 1.0, 0});
    while (!open.empty()) {
      Part part = std::move(open.back());
      open.pop_back();
      if (part.depth == most_halvings || distance_from_chord(part.points) <= tolerance) {
        if (parameters.size() >= most) {
          return refusal(ArgumentError::out_of_range, name, "tolerance")
              .got(format_number(tolerance))
              .expected("one that a million points meet");
        }
        parameters.push_back(part.to == 1.0 ? path.breaks()[i + 1]
                                            : path.breaks()[i] + part.to * piece.span);
        continue;
      }
      const double middle = 0.5 * (part.from + part.to);
      auto [left, right] = halves(std::move(part.points));
      open.push_back({std::move(right), middle, part.to, part.depth + 1});
      open.push_back({std::move(left), part.from, middle, part.depth + 1});
    }
  }
  return parameters;
}

}  // namespace flyball
