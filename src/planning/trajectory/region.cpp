#include <cmath>
#include <string>

#include <flyball/core/argument.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "planning/trajectory/region.hpp"

namespace flyball::detail {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// A point in the ellipse's own frame, its radii 1.
template <class X, class Y>
auto ellipse_coordinates(const EllipseRegion& of, const X& x, const Y& y) {
  const double c = std::cos(of.rotation);
  const double s = std::sin(of.rotation);
  return std::pair{X((c * x + s * y) / of.x_radius), Y((c * y - s * x) / of.y_radius)};
}

}  // namespace

Expected<void> check_region(const RegionLimit& limit, std::size_t number, std::string_view where) {
  const std::string name = limit.name.empty() ? format("region {}", number) : limit.name;
  FLYBALL_CHECK(check_positive(limit.velocity, where, name + ": velocity", "m/s"));
  if (const auto* ellipse = std::get_if<EllipseRegion>(&limit.region)) {
    return Checks(where)
        .finite(ellipse->center, name + ": center")
        .positive(ellipse->x_radius, name + ": x_radius", "m")
        .positive(ellipse->y_radius, name + ": y_radius", "m")
        .finite(ellipse->rotation, name + ": rotation");
  }
  if (const auto* rectangle = std::get_if<RectangleRegion>(&limit.region)) {
    FLYBALL_CHECK(Checks(where)
                      .finite(rectangle->low, name + ": low")
                      .finite(rectangle->high, name + ": high"));
    if (!(rectangle->high - rectangle->low).allFinite() ||
        (rectangle->high - rectangle->low).cwiseAbs().minCoeff() == 0.0) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got("a rectangle without area")
          .expected("two opposite corners");
    }
    return {};
  }
  const auto& corners = std::get<PolygonRegion>(limit.region).corners;
  if (corners.size() < 3) {
    return refusal(ArgumentError::empty, where, name)
        .got(format("{} corners", corners.size()))
        .expected("three or more");
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    FLYBALL_CHECK(check_finite(corners[i], where, format("{}: corner {}", name, i + 1)));
  }
  return {};
}

bool contains(const RegionLimit& limit, const Vector2d& point) noexcept {
  if (const auto* ellipse = std::get_if<EllipseRegion>(&limit.region)) {
    const Vector2d from = point - ellipse->center;
    const auto [x, y] = ellipse_coordinates(*ellipse, from(0), from(1));
    return x * x + y * y <= 1.0;
  }
  if (const auto* rectangle = std::get_if<RectangleRegion>(&limit.region)) {
    const Vector2d low = rectangle->low.cwiseMin(rectangle->high);
    const Vector2d high = rectangle->low.cwiseMax(rectangle->high);
    return point(0) >= low(0) && point(1) >= low(1) && point(0) <= high(0) && point(1) <= high(1);
  }
  const auto& corners = std::get<PolygonRegion>(limit.region).corners;
  bool inside = false;
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Vector2d& a = corners[i];
    const Vector2d& b = corners[j];
    if ((a(1) > point(1)) != (b(1) > point(1)) &&
        point(0) < a(0) + (b(0) - a(0)) * (point(1) - a(1)) / (b(1) - a(1))) {
      inside = !inside;
    }
  }
  return inside;
}

void polynomial_roots(const VectorXd& c, std::vector<double>& t) {
  const Index d = c.size() - 1;
  if (d < 1) {
    return;
  }
  VectorXd b = c;  // to Bézier coefficients, Σ C(j, k)/C(d, k) c_k
  double binomial = 1.0;
  for (Index k = 1; k <= d; ++k) {
    binomial *= static_cast<double>(d - k + 1) / static_cast<double>(k);
    b(k) /= binomial;
  }
  for (Index step = 1; step <= d; ++step) {
    for (Index j = d; j >= step; --j) {
      b(j) += b(j - 1);
    }
  }
  struct Part {
    VectorXd b;
    double from;
    double width;
  };
  std::vector<Part> open{{std::move(b), 0.0, 1.0}};
  // Two roots nearer than this are told apart no more.
  constexpr double least = 1e-7;
  while (!open.empty()) {
    Part part = std::move(open.back());
    open.pop_back();
    int changes = 0;
    double before = 0.0;
    for (Index j = 0; j <= d; ++j) {
      if (part.b(j) != 0.0) {
        changes += before * part.b(j) < 0.0 ? 1 : 0;
        before = part.b(j);
      }
    }
    if (changes == 0) {
      if (part.b(0) == 0.0 && part.from > 0.0) {
        t.push_back(part.from);
      }
      continue;
    }
    if (changes == 1 || part.width < least) {
      // One root: by halves of its polynomial's own values.
      double low = part.from;
      double high = part.from + part.width;
      const bool rises = part.b(d) > 0.0;
      for (int step = 0; step < 60 && high - low > 1e-16; ++step) {
        const double middle = 0.5 * (low + high);
        double value = c(d);
        for (Index k = d; k-- > 0;) {
          value = value * middle + c(k);
        }
        ((value > 0.0) == rises ? high : low) = middle;
      }
      t.push_back(0.5 * (low + high));
      continue;
    }
    VectorXd left = part.b;
    VectorXd right = std::move(part.b);
    for (Index step = 1; step <= d; ++step) {
      for (Index j = 0; j <= d - step; ++j) {
        right(j) = 0.5 * (right(j) + right(j + 1));
      }
      left(step) = right(0);
    }
    const double half = 0.5 * part.width;
    open.push_back({std::move(right), part.from + half, half});
    open.push_back({std::move(left), part.from, half});
  }
}

void border_crossings(const RegionLimit& limit, const PathPiece& piece, std::vector<double>& t) {
  const VectorXd x = piece.coefficients.row(0);
  const VectorXd y = piece.coefficients.row(1);
  if (const auto* ellipse = std::get_if<EllipseRegion>(&limit.region)) {
    VectorXd x_from = x;
    VectorXd y_from = y;
    x_from(0) -= ellipse->center(0);
    y_from(0) -= ellipse->center(1);
    const auto [u, v] = ellipse_coordinates(*ellipse, x_from, y_from);
    VectorXd square = VectorXd::Zero(2 * x.size() - 1);  // u² + v² - 1
    for (Index i = 0; i < x.size(); ++i) {
      for (Index j = 0; j < x.size(); ++j) {
        square(i + j) += u(i) * u(j) + v(i) * v(j);
      }
    }
    square(0) -= 1.0;
    polynomial_roots(square, t);
    return;
  }
  std::vector<Vector2d> corners;
  if (const auto* rectangle = std::get_if<RectangleRegion>(&limit.region)) {
    const Vector2d& a = rectangle->low;
    const Vector2d& b = rectangle->high;
    corners = {a, {b(0), a(1)}, b, {a(0), b(1)}};
  } else {
    corners = std::get<PolygonRegion>(limit.region).corners;
  }
  for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
    const Vector2d side = corners[i] - corners[j];
    VectorXd across = side(0) * y - side(1) * x;
    across(0) -= side(0) * corners[j](1) - side(1) * corners[j](0);
    polynomial_roots(across, t);
  }
}

}  // namespace flyball::detail
