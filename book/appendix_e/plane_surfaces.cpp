#include <algorithm>
#include <complex>
#include <utility>

#include <flyball/classical/transfer_function.hpp>

#include "book/appendix_e/chord.hpp"
#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

/// numpy.linspace(low, high, count).
std::vector<double> nodes(double low, double high, int count) {
  std::vector<double> x;
  for (int i = 0; i < count; ++i) {
    x.push_back(i == count - 1 ? high : low + i * ((high - low) / (count - 1)));
  }
  return x;
}

/// A function over a rectangle, one row of values after the other.
template <class Function>
SurfacePlot surface(const std::vector<double>& x, const std::vector<double>& y,
                    Function&& function) {
  SurfacePlot plot;
  plot.x = x;
  plot.y = y;
  for (const double im : y) {
    for (const double re : x) {
      plot.z.push_back(function(re, im));
    }
  }
  return plot;
}

}  // namespace

/// Figure E.1: |H(s)| of H(s) = (s - 9 + 9i)(s - 9 - 9i)/(s(s + 10)), cut at 30 (section E.2.2): at
/// its poles it stands up like a circus tent, at its zeros it is pinned to the ground.
FigureResult figure_E_1() {
  const Eigen::Vector2cd zeros(Complex(9.0, -9.0), Complex(9.0, 9.0));
  const Eigen::Vector2cd poles(0.0, -10.0);
  const auto H = classical::TransferFunction::from_zeros(zeros, poles, 1.0).value();
  const auto magnitude = [&](double re, double im) {
    return H.at(Complex(re, im)).map([](Complex value) { return std::abs(value); }).value_or(1e9);
  };
  const auto clamped = [&](double re, double im) { return std::min(magnitude(re, im), 30.0); };

  FigureResult figure{.id = "E.1", .title = "Magnitude of a transfer function"};
  const std::vector<double> axis = nodes(-20.0, 20.0, 250);
  std::vector<double> columns[3];
  for (const double re : axis) {
    for (const double im : axis) {
      columns[0].push_back(re);
      columns[1].push_back(im);
      columns[2].push_back(clamped(re, im));
    }
  }
  figure.columns = {{"re", "1/s", std::move(columns[0])},
                    {"im", "rad/s", std::move(columns[1])},
                    {"magnitude", "", std::move(columns[2])}};
  figure.numbers = {{"at -10+1j", "", magnitude(-10.0, 1.0)},
                    {"at 1", "", magnitude(1.0, 0.0)},
                    {"at -5", "", magnitude(-5.0, 0.0)},
                    {"at 5+5j", "", magnitude(5.0, 5.0)}};
  const std::vector<double> drawn = nodes(-20.0, 20.0, 81);
  SurfacePlot picture = surface(drawn, drawn, clamped);
  picture.title = figure.title;
  picture.x_label = "Re(s) (1/s)";
  picture.y_label = "Im(s) (rad/s)";
  picture.z_label = "|H(s)|";
  figure.picture = std::move(picture);
  return figure;
}

/// Figure E.14: the Laplace transform of the chord, Σ ω/(s² + ω²) at s = σ + 2πjf (section E.3.3).
/// The book's script multiplies the three tones' transforms instead of adding them, and takes their
/// hertz for rad/s: that is the column `script_product`.
FigureResult figure_E_14() {
  const auto sum = [](double sigma, double hertz) {
    const Complex s(sigma, 2.0 * pi * hertz);
    Complex total = 0.0;
    for (const Tone& tone : chord) {
      const double w = 2.0 * pi * tone.hertz;
      total += w / ((s - Complex(0.0, w)) * (s + Complex(0.0, w)));
    }
    const double magnitude = std::abs(total);
    return magnitude < 30.0 ? magnitude : 30.0;  // also at a pole
  };
  const auto product = [](double re, double im) {
    const Complex s(re, im);
    Complex total = 1.0;
    for (const Tone& tone : chord) {
      const double f = tone.hertz;
      total *= f / ((s - Complex(0.0, f)) * (s + Complex(0.0, f)));
    }
    return std::min(std::abs(total), 30.0);
  };
  FigureResult figure{.id = "E.14", .title = "Laplace transform of a chord"};
  std::vector<double> columns[4];
  const std::vector<double> sigmas = nodes(-150.0, 150.0, 500);
  const std::vector<double> frequencies = nodes(200.0, 500.0, 500);
  for (const double sigma : sigmas) {
    for (const double f : frequencies) {
      columns[0].push_back(sigma);
      columns[1].push_back(f);
      columns[2].push_back(sum(sigma, f));
      columns[3].push_back(product(sigma, f));
    }
  }
  figure.columns = {{"re", "1/s", std::move(columns[0])},
                    {"im", "Hz", std::move(columns[1])},
                    {"magnitude", "", std::move(columns[2])},
                    {"script_product", "", std::move(columns[3])}};
  // The tents are narrow: lines of the picture run through their poles.
  constexpr int lines = 41;
  std::vector<double> drawn = nodes(200.0, 500.0, lines);
  for (const Tone& tone : chord) {
    *std::ranges::min_element(drawn, {}, [&](double f) { return std::abs(f - tone.hertz); }) =
        tone.hertz;
  }
  SurfacePlot picture = surface(nodes(-150.0, 150.0, lines), drawn, [&](double sigma, double f) {
    return std::min(1000.0 * sum(sigma, f), 60.0);
  });
  picture.title = figure.title;
  picture.x_label = "σ (1/s)";
  picture.y_label = "Frequency (Hz)";
  picture.z_label = "1000 |H(s)|, cut at 60";
  figure.picture = std::move(picture);
  return figure;
}

}  // namespace flyball::book
