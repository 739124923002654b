#include <flyball/planning/path/edit_path.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// q(a + (b - a) t) of q(t): Taylor's shift by Horner, then the scale.
MatrixXd cut(MatrixXd c, double a, double b) {
  const Index d = c.cols() - 1;
  for (Index step = 0; step < d; ++step) {
    for (Index k = d - 1; k >= step; --k) {
      c.col(k) += (a * c.col(k + 1)).eval();
    }
  }
  double power = 1.0;
  for (Index k = 1; k <= d; ++k) {
    power *= b - a;
    c.col(k) *= power;
  }
  return c;
}

/// Of what is a path already, once more: it cannot fail.
Path made(std::vector<PathPiece> pieces) {
  return Path::join(std::move(pieces)).value();
}

Expected<void> check_planar(const Path& path, std::string_view where) {
  if (path.coordinates() < 2) {
    return refusal(ArgumentError::wrong_shape, where, "path")
        .got(detail::format("of {} coordinate", path.coordinates()))
        .expected("of two or more: x, y");
  }
  return {};
}

/// Linear in (x, y) about the origin, then an offset; the heading turned by `turn` after `sign`.
Path moved(const Path& path, const Eigen::Matrix2d& M, const Eigen::Vector2d& offset, double sign,
           double turn) {
  std::vector<PathPiece> pieces = path.pieces();
  for (PathPiece& piece : pieces) {
    MatrixXd& c = piece.coefficients;
    c.topRows<2>() = (M * c.topRows<2>()).eval();
    c.block<2, 1>(0, 0) += offset;
    if (c.rows() == 3) {
      c.row(2) *= sign;
      c(2, 0) += turn;
    }
  }
  return made(std::move(pieces));
}

}  // namespace

Expected<Path> joined(std::span<const Path> paths) {
  constexpr std::string_view where = "joined";
  if (paths.empty()) {
    return refusal(ArgumentError::empty, where, "paths").expected("one or more");
  }
  std::vector<PathPiece> pieces = paths.front().pieces();
  PathVector end = paths.front().at(paths.front().parameter_end()).first;
  double stretch = 1.0;
  for (std::size_t i = 1; i < paths.size(); ++i) {
    const Path& path = paths[i];
    if (path.coordinates() == paths.front().coordinates()) {
      const PathVector begin = path.at(0.0).first;
      const double before = end.norm();
      const double after = begin.norm();
      const bool goes_on =
          before > 0.0 && after > 0.0 && (begin / after - end / before).norm() < 1e-6;
      stretch = goes_on ? after / before : stretch;
      end = path.at(path.parameter_end()).first / stretch;
    }
    for (PathPiece piece : path.pieces()) {
      piece.span *= stretch;
      pieces.push_back(std::move(piece));
    }
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

Expected<Path> part_of(const Path& path, double from, double to) {
  constexpr std::string_view where = "part_of";
  FLYBALL_CHECK(Checks(where)
                    .within(from, 0.0, path.parameter_end(), "from")
                    .within(to, 0.0, path.parameter_end(), "to"));
  if (!(from < to)) {
    return refusal(ArgumentError::out_of_range, where, "to")
        .got(format_number(to))
        .expected("more than from, " + format_number(from));
  }
  std::vector<PathPiece> pieces;
  for (std::size_t i = path.piece_at(from); i < path.pieces().size(); ++i) {
    const PathPiece& piece = path.pieces()[i];
    const double a = std::clamp((from - path.breaks()[i]) / piece.span, 0.0, 1.0);
    const double b = std::clamp((to - path.breaks()[i]) / piece.span, 0.0, 1.0);
    if (!(b > a)) {
      break;
    }
    pieces.push_back({cut(piece.coefficients, a, b), piece.span * (b - a)});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

Path reversed(const Path& path) {
  std::vector<PathPiece> pieces;
  pieces.reserve(path.pieces().size());
  for (auto piece = path.pieces().rbegin(); piece != path.pieces().rend(); ++piece) {
    pieces.push_back({cut(piece->coefficients, 1.0, 0.0), piece->span});
  }
  return made(std::move(pieces));
}

Expected<Path> transformed(const Path& path, const Pose2d& by) {
  constexpr std::string_view where = "transformed";
  FLYBALL_CHECK(check_planar(path, where));
  FLYBALL_CHECK(check_finite(by.matrix(), where, "by"));
  return moved(path, by.rotation().matrix(), by.translation(), 1.0, by.angle());
}

Expected<Path> relative_to(const Path& path, const Pose2d& pose) {
  return transformed(path, pose.inverse()).map_error([](Error e) {
    return std::move(e).in("relative_to");
  });
}

Expected<Path> mirrored(const Path& path, const Eigen::Vector2d& point, double direction) {
  constexpr std::string_view where = "mirrored";
  FLYBALL_CHECK(check_planar(path, where));
  FLYBALL_CHECK(Checks(where).finite(point, "point").finite(direction, "direction"));
  const double c = std::cos(2.0 * direction);
  const double s = std::sin(2.0 * direction);
  Eigen::Matrix2d M;
  M << c, s, s, -c;
  return moved(path, M, point - M * point, -1.0, 2.0 * direction);
}

Expected<Path> with_headings(const Path& path, std::span<const PathHeading> headings) {
  constexpr std::string_view where = "with_headings";
  if (path.coordinates() != 2) {
    return refusal(ArgumentError::wrong_shape, where, "path")
        .got(detail::format("of {} coordinates", path.coordinates()))
        .expected("of two: x, y");
  }
  if (headings.empty()) {
    return refusal(ArgumentError::empty, where, "headings").expected("one or more");
  }
  const std::size_t n = headings.size();
  std::vector<double> theta(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::string name = detail::format("heading {}", i + 1);
    FLYBALL_CHECK(
        Checks(where)
            .finite(headings[i].heading, name)
            .within(headings[i].parameter, 0.0, path.parameter_end(), name + "'s parameter"));
    if (i > 0 && !(headings[i].parameter > headings[i - 1].parameter)) {
      return refusal(ArgumentError::out_of_range, where, name + "'s parameter")
          .got(format_number(headings[i].parameter))
          .expected("more than the one before it, " + format_number(headings[i - 1].parameter));
    }
    theta[i] = i == 0 ? headings[0].heading
                      : theta[i - 1] + std::remainder(headings[i].heading - theta[i - 1],
                                                      2.0 * std::numbers::pi);
  }
  const auto secant = [&](std::size_t i) {
    return (theta[i + 1] - theta[i]) / (headings[i + 1].parameter - headings[i].parameter);
  };
  std::vector<double> slope(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double a = secant(i - 1);
    const double b = secant(i);
    if (a * b > 0.0) {  // the harmonic mean, the nearer side counting more
      const double before = headings[i].parameter - headings[i - 1].parameter;
      const double after = headings[i + 1].parameter - headings[i].parameter;
      const double share = (before + 2.0 * after) / (3.0 * (before + after));
      slope[i] = a * b / (share * b + (1.0 - share) * a);
    }
  }
  std::vector<double> knots = path.breaks();
  for (const PathHeading& heading : headings) {
    knots.push_back(heading.parameter);
  }
  std::sort(knots.begin(), knots.end());
  std::vector<PathPiece> pieces;
  std::size_t h = 0;  // the last heading at or before the piece
  bool before_first = true;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const double from = knots[k];
    const double to = knots[k + 1];
    if (!(to - from > 1e-13 * path.parameter_end())) {
      continue;
    }
    const double middle = 0.5 * (from + to);
    while (h < n && headings[h].parameter <= middle) {
      ++h;
      before_first = false;
    }
    const std::size_t i = path.piece_at(middle);
    const PathPiece& piece = path.pieces()[i];
    const double a = std::clamp((from - path.breaks()[i]) / piece.span, 0.0, 1.0);
    const double b = std::clamp((to - path.breaks()[i]) / piece.span, 0.0, 1.0);
    const MatrixXd plane = cut(piece.coefficients, a, b);
    MatrixXd c = MatrixXd::Zero(3, std::max<Index>(plane.cols(), 4));
    c.topLeftCorner(2, plane.cols()) = plane;
    if (before_first) {
      c(2, 0) = theta.front();
    } else if (h == n) {
      c(2, 0) = theta.back();
    } else {
      const double t_0 = headings[h - 1].parameter;
      const double width = headings[h].parameter - t_0;
      const double d = theta[h] - theta[h - 1];
      const double m_0 = slope[h - 1] * width;
      const double m_1 = slope[h] * width;
      MatrixXd whole(1, 4);
      whole << theta[h - 1], m_0, 3.0 * d - 2.0 * m_0 - m_1, m_0 + m_1 - 2.0 * d;
      c.block(2, 0, 1, 4) =
          cut(whole, std::max(0.0, (from - t_0) / width), std::min(1.0, (to - t_0) / width));
    }
    pieces.push_back({std::move(c), to - from});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

std::vector<PathStop> path_stops(const Path& path, int along) {
  const Index n = along > 0 ? std::min<Index>(along, path.coordinates()) : path.coordinates();
  constexpr double standstill = 1e-9;  // of the largest |q'|
  std::vector<PathStop> stops;
  const auto direction = [&](const PathState& state, double side) -> PathVector {
    const PathVector v = state.first.head(n);
    const PathVector a = side * state.second.head(n);
    return v.norm() > standstill * a.norm() ? v : a;
  };
  for (std::size_t i = 0; i < path.pieces().size(); ++i) {
    // |q'| over the piece, its smallest local minimum by sections.
    constexpr int sections = 32;
    double largest = 0.0;
    std::vector<double> speed(sections + 1);
    for (int k = 0; k <= sections; ++k) {
      const PathState state = path.at(i, k / static_cast<double>(sections));
      speed[static_cast<std::size_t>(k)] = state.first.head(n).norm();
      largest = std::max(largest, speed[static_cast<std::size_t>(k)]);
    }
    const double span = path.pieces()[i].span;
    for (std::size_t k = 1; k < sections; ++k) {
      if (!(speed[k] <= speed[k - 1] && speed[k] <= speed[k + 1])) {
        continue;
      }
      double a = static_cast<double>(k - 1) / sections;
      double b = static_cast<double>(k + 1) / sections;
      for (int step = 0; step < 60; ++step) {  // of q'·q'', which changes its sign there
        const double t = 0.5 * (a + b);
        const PathState state = path.at(i, t);
        (state.first.head(n).dot(state.second.head(n)) < 0.0 ? a : b) = t;
      }
      const double t = 0.5 * (a + b);
      if (path.at(i, t).first.head(n).norm() <= standstill * largest) {
        stops.push_back({path.breaks()[i] + t * span, PathBreak::cusp});
      }
    }
    if (i + 1 < path.pieces().size()) {
      const PathState before = path.at(i, 1.0);
      const PathState after = path.at(i + 1, 0.0);
      const PathVector v = direction(before, -1.0);
      const PathVector w = direction(after, 1.0);
      const double cosine = v.dot(w) / (v.norm() * w.norm());
      const bool halts = before.first.head(n).norm() <= standstill * largest ||
                         after.first.head(n).norm() <= standstill * largest;
      if (cosine < -1.0 + 1e-9 || halts) {
        stops.push_back({path.breaks()[i + 1], PathBreak::cusp});
      } else if (!(cosine > 1.0 - 1e-9)) {
        stops.push_back({path.breaks()[i + 1], PathBreak::corner});
      }
    }
  }
  return stops;
}

}  // namespace flyball
