#include <cmath>
#include <complex>
#include <numbers>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

constexpr int grid = 400;

/// numpy.linspace(low, high, grid).
double node(double low, double high, int i) {
  return i == grid - 1 ? high : low + i * ((high - low) / (grid - 1));
}

/// The angle of a stable s as a colour, from 0 (π/2) through 1/2 (the negative real axis) to 1
/// (-π/2). The upper half is one of 256 colours further on, as in the book's script, since the
/// first one is left for what is not in the map.
double hue(Complex s) {
  const double angle = std::arg(s);
  return angle > 0.0 ? 1.0 / 255.0 + (angle - pi / 2.0) / pi : 0.5 + (angle + pi) / pi;
}

/// A square of a plane.
struct Plane {
  double re_low, re_high, im_low, im_high;
  bool discrete;

  /// Unstable points of the z-plane stay blank.
  [[nodiscard]] bool blank(Complex at) const { return discrete && std::abs(at) > 1.0; }
  /// z = e^(sT) with T = 1 s, so s = log z.
  [[nodiscard]] Complex s(Complex at) const { return discrete ? std::log(at) : at; }
};

/// The left half of the s-plane, up to the Nyquist frequency, and where it goes.
constexpr Plane s_plane{-2.0 * pi, 0.0, -pi, pi, false};
constexpr Plane z_plane{-1.05, 1.05, -1.05, 1.05, true};

/// A plane as the picture has it: coloured by the angle of s, from 90° (up the imaginary axis)
/// through 180° to 270°.
SurfacePlot map_of(const Plane& plane) {
  SurfacePlot map;
  for (int k = 0; k < grid; ++k) {
    map.x.push_back(node(plane.re_low, plane.re_high, k));
    map.y.push_back(node(plane.im_low, plane.im_high, k));
  }
  for (const double im : map.y) {
    for (const double re : map.x) {
      const Complex at(re, im);
      const double angle = std::arg(plane.s(at)) * 180.0 / pi;
      map.z.push_back(plane.blank(at) ? std::nan("") : angle < 0.0 ? angle + 360.0 : angle);
    }
  }
  return map;
}

/// Both planes beside each other, as the book prints them twice; the data are one plane's.
FigureResult mapping(std::string id, const Plane& plane) {
  std::vector<double> re;
  std::vector<double> im;
  std::vector<double> colors;
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      re.push_back(node(plane.re_low, plane.re_high, i));
      im.push_back(node(plane.im_low, plane.im_high, j));
      const Complex at(re.back(), im.back());
      colors.push_back(plane.blank(at) ? 0.0 : hue(plane.s(at)));
    }
  }
  FigureResult figure{
      .id = std::move(id),
      .title = "Mapping of the complex plane from continuous (left) to discrete (right)"};
  figure.columns = {
      {"re", "", std::move(re)}, {"im", "", std::move(im)}, {"color", "", std::move(colors)}};

  SurfacePlot picture = map_of(s_plane);
  picture.title = figure.title + ", T = 1 s";
  picture.x_label = "Real part of s (1/s)";
  picture.y_label = "Imaginary part of s (rad/s)";
  picture.z_label = "Angle of s (°)";
  picture.z_step = 45.0;
  picture.from_above = true;
  picture.equal_axes = true;
  picture.width = 1000;
  picture.height = 480;
  SurfacePlot& discrete = picture.beside.emplace_back(map_of(z_plane));
  discrete.x_label = "Real part of z";
  discrete.y_label = "Imaginary part of z";
  discrete.unit_circle = true;
  figure.picture = std::move(picture);
  return figure;
}

}  // namespace

/// Figure 7.1: the stable half of the s-plane, coloured by angle, and where sampling takes it
/// (section 7.1). Its data are the s-plane's.
FigureResult figure_7_1() {
  return mapping("7.1", s_plane);
}

/// Figure 7.6: the same picture in section 7.6. Its data are the z-plane's.
FigureResult figure_7_6() {
  return mapping("7.6", z_plane);
}

}  // namespace flyball::book
