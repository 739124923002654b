#include <flyball/planning/path/build_path.hpp>

#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int most_degree = 20;

Expected<void> check_points(const MatrixRef& points, Index least, std::string_view where,
                            std::string_view name) {
  if (points.rows() < 1 || points.rows() > max_path_coordinates) {
    return refusal(ArgumentError::wrong_shape, where, name)
        .got(detail::format("of {} coordinates", points.rows()))
        .expected(detail::format("of 1 to {}, a column a point", max_path_coordinates));
  }
  if (points.cols() < least) {
    return refusal(ArgumentError::empty, where, name)
        .got(detail::format("{} of them", points.cols()))
        .expected(detail::format("{} or more", least));
  }
  return check_finite(points, where, name);
}

Expected<void> check_degree(int degree, std::string_view where) {
  if (degree < 1 || degree > most_degree) {
    return refusal(ArgumentError::out_of_range, where, "degree")
        .got(detail::format("{}", degree))
        .expected(detail::format("1 to {}", most_degree));
  }
  return {};
}

/// Of the cubic with these ends, derivatives by t.
MatrixXd cubic(const VectorXd& p, const VectorXd& q, const VectorXd& dp, const VectorXd& dq) {
  MatrixXd c(p.size(), 4);
  const VectorXd d = q - p;
  c << p, dp, 3.0 * d - 2.0 * dp - dq, dp + dq - 2.0 * d;
  return c;
}

/// c_k = C(d, k) Δᵏ b_0.
MatrixXd power_basis(MatrixXd b) {
  const Index d = b.cols() - 1;
  for (Index step = 1; step <= d; ++step) {
    for (Index j = d; j >= step; --j) {
      b.col(j) -= b.col(j - 1).eval();
    }
  }
  double binomial = 1.0;
  for (Index k = 1; k <= d; ++k) {
    binomial *= static_cast<double>(d - k + 1) / static_cast<double>(k);
    b.col(k) *= binomial;
  }
  return b;
}

/// The waypoints without those that are where the one before is, and the knots' distances.
struct Knots {
  MatrixXd points;
  std::vector<double> spans;
};

Expected<Knots> knots_of(const MatrixRef& waypoints, KnotSpacing spacing, std::string_view where) {
  FLYBALL_CHECK(check_points(waypoints, 2, where, "waypoints"));
  Knots knots{waypoints, {}};
  const VectorXd extent = waypoints.cwiseAbs().rowwise().maxCoeff();
  Index count = 1;
  double parameter = 0.0;
  for (Index i = 1; i < waypoints.cols(); ++i) {
    const VectorXd way = waypoints.col(i) - knots.points.col(count - 1);
    // Nearer than the digits of each coordinate tell places apart is one place.
    if (!(way.array().abs() > 1e-14 * extent.array()).any()) {
      continue;
    }
    const double d = way.stableNorm();
    knots.points.col(count++) = waypoints.col(i);
    // The distance of the knots as doubles tell it: beside far larger ones it has few digits.
    const double next = parameter + (spacing == KnotSpacing::uniform ? 1.0
                                     : spacing == KnotSpacing::chord ? d
                                                                     : std::sqrt(d));
    if (!(next > parameter)) {
      return refusal(ArgumentError::out_of_range, where, detail::format("waypoint {}", i + 1))
          .got(detail::format("{:.4g} from the one before it", d))
          .expected(
              detail::format("a distance that doubles tell beside the {:.4g} before it", parameter))
          .hint("space the knots uniformly, or scale the larger coordinates");
    }
    knots.spans.push_back(next - parameter);
    parameter = next;
  }
  if (count < 2) {
    return refusal(ArgumentError::out_of_range, where, "waypoints")
        .got(detail::format("{}, all in one place", waypoints.cols()))
        .expected("two or more places")
        .hint("give the path somewhere to go");
  }
  knots.points = MatrixXd(knots.points.leftCols(count));
  return knots;
}

/// The spline of the knots: natural where no derivatives are given at its ends.
Expected<Path> spline_through(const Knots& knots, const VectorXd* start, const VectorXd* end) {
  const MatrixXd& p = knots.points;
  const std::vector<double>& d = knots.spans;
  const Index n = p.cols();
  MatrixXd m(p.rows(), n);
  std::vector<double> upper(static_cast<std::size_t>(n), 0.0);
  const auto secant = [&](Index i) -> VectorXd {
    return (p.col(i + 1) - p.col(i)) / d[static_cast<std::size_t>(i)];
  };
  // Rows times the span on their left at the ends, times both in between; Thomas's elimination.
  if (start != nullptr) {
    m.col(0) = *start;
  } else {  // 2 m_0 + m_1 = 3 (p_1 - p_0)/d_0
    upper[0] = 0.5;
    m.col(0) = 1.5 * secant(0);
  }
  for (Index i = 1; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (i + 1 < n) {
      const double left = d[k] / (d[k - 1] + d[k]);
      const double right = 1.0 - left;
      const double pivot = 2.0 - left * upper[k - 1];
      upper[k] = right / pivot;
      m.col(i) =
          (3.0 * (left * secant(i - 1) + right * secant(i)) - left * m.col(i - 1)).eval() / pivot;
    } else if (end != nullptr) {
      m.col(i) = *end;
    } else {  // m_{n-2} + 2 m_{n-1} = 3 (p_{n-1} - p_{n-2})/d_{n-2}
      m.col(i) = (3.0 * secant(i - 1) - m.col(i - 1)).eval() / (2.0 - upper[k - 1]);
    }
  }
  for (Index i = n - 2; i >= 0; --i) {
    m.col(i) -= (upper[static_cast<std::size_t>(i)] * m.col(i + 1)).eval();
  }
  std::vector<PathPiece> pieces;
  pieces.reserve(d.size());
  for (Index i = 0; i + 1 < n; ++i) {
    const double span = d[static_cast<std::size_t>(i)];
    pieces.push_back({cubic(p.col(i), p.col(i + 1), span * m.col(i), span * m.col(i + 1)), span});
  }
  return Path::join(std::move(pieces));
}

}  // namespace

Expected<Path> line_path(const MatrixRef& from, const MatrixRef& to) {
  constexpr std::string_view where = "line_path";
  FLYBALL_CHECK(check_points(from, 1, where, "from"));
  FLYBALL_CHECK(Checks(where)
                    .shape(from, from.rows(), 1, "from")
                    .shape(to, from.rows(), 1, "to", "as from")
                    .finite(to, "to"));
  MatrixXd points(from.rows(), 2);
  points << from, to;
  return bezier_path(points).map_error([](Error e) { return std::move(e).in("line_path"); });
}

Expected<Path> arc_path(const Eigen::Vector2d& center, double radius, double start, double sweep) {
  constexpr std::string_view where = "arc_path";
  constexpr double most_sweep = 2000.0 * 2.0 * std::numbers::pi;
  constexpr double widest = std::numbers::pi / 8.0;
  constexpr Index degree = 13;
  FLYBALL_CHECK(Checks(where)
                    .finite(center, "center")
                    .positive(radius, "radius", "m")
                    .finite(start, "start")
                    .within(sweep, -most_sweep, most_sweep, "sweep", "rad"));
  if (sweep == 0.0) {
    return refusal(ArgumentError::out_of_range, where, "sweep").got("0 rad").expected("not zero");
  }
  const auto count = static_cast<std::size_t>(std::ceil(std::abs(sweep) / widest * (1.0 - 1e-15)));
  const double angle = sweep / static_cast<double>(count);
  std::vector<PathPiece> pieces(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double theta = start + angle * static_cast<double>(i);
    const Eigen::Vector2d out(radius * std::cos(theta), radius * std::sin(theta));
    const Eigen::Vector2d along(-out(1), out(0));
    MatrixXd c(2, degree + 1);
    double factor = 1.0;  // (angle)ᵏ/k!, whose derivatives turn by a quarter each
    for (Index k = 0; k <= degree; ++k) {
      const double sign = k % 4 < 2 ? factor : -factor;
      c.col(k) = sign * (k % 2 == 0 ? out : along);
      factor *= angle / static_cast<double>(k + 1);
    }
    c.col(0) += center;
    pieces[i] = {std::move(c), std::abs(angle)};
  }
  return Path::join(std::move(pieces)).map_error([](Error e) {
    return std::move(e).in("arc_path");
  });
}

Expected<Path> arc_path(const Pose2d& start, const Eigen::Vector2d& end) {
  constexpr std::string_view where = "arc_path";
  FLYBALL_CHECK(Checks(where).finite(start.matrix(), "start").finite(end, "end"));
  const Eigen::Vector2d to = start.inverse() * end;
  const double square = to.squaredNorm();
  if (!(square > 0.0) || (to(1) == 0.0 && to(0) < 0.0)) {
    return refusal(ArgumentError::out_of_range, where, "end")
        .got(square > 0.0 ? "straight behind the start" : "at the start")
        .expected("a place that an arc leads to");
  }
  // κ = 2 y/(x² + y²), turned by 2 atan2(y, x).
  const double curvature = 2.0 * to(1) / square;
  if (std::abs(curvature) * std::sqrt(square) < 1e-9) {
    return line_path(start.translation(), end);
  }
  const double radius = 1.0 / std::abs(curvature);
  const double side = curvature > 0.0 ? 1.0 : -1.0;
  const Eigen::Vector2d center = start * Eigen::Vector2d(0.0, side * radius);
  const double sweep = 2.0 * std::atan2(to(1), to(0));
  return arc_path(center, radius, start.angle() - side * 0.5 * std::numbers::pi, sweep);
}

Expected<Path> natural_cubic_path(const MatrixRef& waypoints, KnotSpacing spacing) {
  FLYBALL_TRY(const Knots knots, knots_of(waypoints, spacing, "natural_cubic_path"));
  return spline_through(knots, nullptr, nullptr);
}

Expected<Path> clamped_cubic_path(const MatrixRef& waypoints, const MatrixRef& start,
                                  const MatrixRef& end, KnotSpacing spacing) {
  constexpr std::string_view where = "clamped_cubic_path";
  FLYBALL_TRY(const Knots knots, knots_of(waypoints, spacing, where));
  FLYBALL_CHECK(Checks(where)
                    .shape(start, waypoints.rows(), 1, "start", "coordinates x 1")
                    .shape(end, waypoints.rows(), 1, "end", "coordinates x 1")
                    .finite(start, "start")
                    .finite(end, "end"));
  const VectorXd first = start.col(0);
  const VectorXd last = end.col(0);
  return spline_through(knots, &first, &last);
}

Expected<Path> cubic_hermite_path(const MatrixRef& waypoints, const MatrixRef& derivatives) {
  constexpr std::string_view where = "cubic_hermite_path";
  FLYBALL_CHECK(check_points(waypoints, 2, where, "waypoints"));
  FLYBALL_CHECK(
      Checks(where)
          .shape(derivatives, waypoints.rows(), waypoints.cols(), "derivatives", "as waypoints")
          .finite(derivatives, "derivatives"));
  std::vector<PathPiece> pieces;
  for (Index i = 0; i + 1 < waypoints.cols(); ++i) {
    pieces.push_back(
        {cubic(waypoints.col(i), waypoints.col(i + 1), derivatives.col(i), derivatives.col(i + 1)),
         1.0});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

Expected<Path> quintic_hermite_path(const MatrixRef& waypoints, const MatrixRef& derivatives,
                                    const MatrixRef& second) {
  constexpr std::string_view where = "quintic_hermite_path";
  FLYBALL_CHECK(check_points(waypoints, 2, where, "waypoints"));
  FLYBALL_CHECK(
      Checks(where)
          .shape(derivatives, waypoints.rows(), waypoints.cols(), "derivatives", "as waypoints")
          .shape(second, waypoints.rows(), waypoints.cols(), "second", "as waypoints")
          .finite(derivatives, "derivatives")
          .finite(second, "second"));
  std::vector<PathPiece> pieces;
  for (Index i = 0; i + 1 < waypoints.cols(); ++i) {
    const VectorXd d = waypoints.col(i + 1) - waypoints.col(i);
    const VectorXd v0 = derivatives.col(i);
    const VectorXd v1 = derivatives.col(i + 1);
    const VectorXd a0 = second.col(i);
    const VectorXd a1 = second.col(i + 1);
    MatrixXd c(d.size(), 6);
    c << waypoints.col(i), v0, 0.5 * a0, 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * d - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1;
    pieces.push_back({std::move(c), 1.0});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

Expected<Path> bezier_path(const MatrixRef& points) {
  constexpr std::string_view where = "bezier_path";
  FLYBALL_CHECK(check_points(points, 2, where, "points"));
  if (points.cols() > most_degree + 1) {
    return refusal(ArgumentError::out_of_range, where, "points")
        .got(detail::format("{}: degree {}", points.cols(), points.cols() - 1))
        .expected(detail::format("degree {} or less", most_degree))
        .hint("join curves of a lower degree");
  }
  return bezier_path(points, static_cast<int>(points.cols()) - 1);
}

Expected<Path> bezier_path(const MatrixRef& points, int degree) {
  constexpr std::string_view where = "bezier_path";
  FLYBALL_CHECK(check_degree(degree, where));
  FLYBALL_CHECK(check_points(points, degree + 1, where, "points"));
  if ((points.cols() - 1) % degree != 0) {
    return refusal(ArgumentError::wrong_shape, where, "points")
        .got(detail::format("{} of them", points.cols()))
        .expected(detail::format("1 + {} a curve of degree {}", degree, degree));
  }
  std::vector<PathPiece> pieces;
  for (Index i = 0; i + degree < points.cols(); i += degree) {
    pieces.push_back({power_basis(points.middleCols(i, degree + 1)), 1.0});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

Expected<Path> b_spline_path(const MatrixRef& points, int degree) {
  constexpr std::string_view where = "b_spline_path";
  FLYBALL_CHECK(check_degree(degree, where));
  FLYBALL_CHECK(check_points(points, degree + 1, where, "points"));
  const Index d = degree;
  const Index spans = points.cols() - d;
  // 0 … 0, 1, 2, …, spans … spans: each end d + 1 times.
  const auto knot = [&](Index i) {
    return static_cast<double>(std::min(std::max<Index>(i - d, 0), spans));
  };
  std::vector<PathPiece> pieces;
  for (Index i = 0; i < spans; ++i) {
    MatrixXd bezier(points.rows(), d + 1);
    for (Index j = 0; j <= d; ++j) {
      // The blossom f(u_i × (d - j), u_{i+1} × j) by de Boor's scheme.
      MatrixXd f = points.middleCols(i, d + 1);
      for (Index r = 1; r <= d; ++r) {
        const double u = static_cast<double>(r <= d - j ? i : i + 1);
        for (Index k = d; k >= r; --k) {
          const double low = knot(i + k);
          const double high = knot(i + k + d + 1 - r);
          const double share = (u - low) / (high - low);
          f.col(k) = ((1.0 - share) * f.col(k - 1) + share * f.col(k)).eval();
        }
      }
      bezier.col(j) = f.col(d);
    }
    pieces.push_back({power_basis(std::move(bezier)), 1.0});
  }
  return Path::join(std::move(pieces)).map_error([&](Error e) {
    return std::move(e).in(std::string(where));
  });
}

}  // namespace flyball
