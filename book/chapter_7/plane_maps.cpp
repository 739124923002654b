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

/// A square of a plane, coloured: rows run along the real axis first. The picture takes every
/// fourth point.
template <class Color>
FigureResult plane(std::string id, std::string title, double re_low, double re_high, double im_low,
                   double im_high, Color color) {
  std::vector<double> re;
  std::vector<double> im;
  std::vector<double> colors;
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      re.push_back(node(re_low, re_high, i));
      im.push_back(node(im_low, im_high, j));
      colors.push_back(color(Complex(re.back(), im.back())));
    }
  }
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  SurfacePlot picture{.title = figure.title,
                      .x_label = "Re",
                      .y_label = "Im",
                      .z_label = "angle of s",
                      .from_above = true};
  constexpr int coarse = 4;
  for (int k = 0; k < grid; k += coarse) {
    picture.x.push_back(node(re_low, re_high, k));
    picture.y.push_back(node(im_low, im_high, k));
    for (int i = 0; i < grid; i += coarse) {
      const double value = colors[static_cast<std::size_t>(i * grid + k)];
      picture.z.push_back(value == 0.0 ? std::nan("") : value);  // a gap
    }
  }
  figure.columns = {
      {"re", "", std::move(re)}, {"im", "", std::move(im)}, {"color", "", std::move(colors)}};
  figure.picture = std::move(picture);
  return figure;
}

}  // namespace

/// Figure 7.1: the left half of the s-plane, up to the Nyquist frequency of T = 1 s, coloured by
/// angle (section 7.1). Figure 7.6 shows where it goes.
FigureResult figure_7_1() {
  return plane("7.1", "The s-plane, coloured by the angle of s", -2.0 * pi, 0.0, -pi, pi, hue);
}

/// Figure 7.6: the same points in the z-plane, z = e^(sT): inside the unit circle the colour of
/// s = log z / T; what is unstable stays blank (0).
FigureResult figure_7_6() {
  return plane("7.6", "The z-plane, coloured by the angle of s", -1.05, 1.05, -1.05, 1.05,
               [](Complex z) { return std::abs(z) > 1.0 ? 0.0 : hue(std::log(z)); });
}

}  // namespace flyball::book
