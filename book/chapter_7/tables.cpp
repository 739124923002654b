#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

struct Method {
  ConversionMethod method;
  const char* name;
  const char* label;
};
constexpr Method methods[] = {
    {ConversionMethod::zoh, "zoh", "zero-order hold"},
    {ConversionMethod::tustin, "bilinear", "bilinear"},
    {ConversionMethod::forward_euler, "forward_euler", "forward Euler"},
    {ConversionMethod::backward_euler, "backward_euler", "backward Euler"}};

}  // namespace

/// Table 7.1: where points of the s-plane go, z = e^(sT) with T = 1 s (section 7.1).
FigureResult table_7_1() {
  using Complex = std::complex<double>;
  constexpr double pi = std::numbers::pi;
  const Complex points[] = {{0.0, 0.0},  {0.0, pi / 2.0},  {0.0, pi},   {-1.0, 0.0},
                            {-1.0, 1.0}, {-2.0 * pi, 0.0}, {-0.5, -2.0}};
  std::vector<double> columns[4];
  PolePlotGroup group{.label = "z"};
  for (const Complex s : points) {
    // The pole of a sampled mode: dx/dt = s x as the eigenvalues of a real system.
    const Eigen::MatrixXd A{{s.real(), -s.imag()}, {s.imag(), s.real()}};
    const auto sampled = discretize_zoh(A, Eigen::MatrixXd::Zero(2, 1), 1_s).value();
    const Complex z(sampled.A(0, 0), sampled.A(1, 0));
    columns[0].push_back(s.real());
    columns[1].push_back(s.imag());
    columns[2].push_back(z.real());
    columns[3].push_back(z.imag());
    group.poles.push_back(z);
  }
  FigureResult figure{.id = "table 7.1", .title = "Mapping from the s-plane to the z-plane"};
  figure.columns = {{"s_re", "1/s", columns[0]},
                    {"s_im", "1/s", columns[1]},
                    {"z_re", "", columns[2]},
                    {"z_im", "", columns[3]}};
  figure.picture = pole_plot(figure.title, {group}, true);
  return figure;
}

/// Table 7.2: discretisation methods, on the elevator at three sample periods (section 7.3.1):
/// forward Euler is unstable at each of the longer ones.
FigureResult table_7_2() {
  const auto elevator = mechanisms::elevator({.motor = mechanisms::cim(2),
                                              .gearing = 42.0 / 12.0 * 40.0 / 14.0,
                                              .mass = 6.803886_kg,
                                              .drum_radius = 0.02762679089_m})
                            .value();
  FigureResult figure{.id = "table 7.2", .title = "Discretisation methods"};
  figure.columns = {{"period", "s", {0.1, 0.05, 0.01}}};
  Plot plot{.title = figure.title, .x_label = "Sample period (s)"};
  plot.panels = {{.y_label = "A_22", .marks = {{.at = 1.0}, {.at = -1.0}}}};
  for (const Method& method : methods) {
    const auto sampled = [&](double period) {
      return discretize(elevator, Time(period), method.method).value();
    };
    std::vector<double> A_12;
    std::vector<double> A_22;
    std::vector<double> radius;
    for (const double period : {0.1, 0.05, 0.01}) {
      const auto plant = sampled(period);
      A_12.push_back(plant.A(0, 1));
      A_22.push_back(plant.A(1, 1));
      radius.push_back(poles(plant).value().cwiseAbs().maxCoeff());
    }
    figure.columns.push_back({std::string("A_12_") + method.name, "s", A_12});
    figure.columns.push_back({std::string("A_22_") + method.name, "", A_22});
    figure.columns.push_back({std::string("spectral_radius_") + method.name, "", radius});
    PlotLine line{.label = method.label};
    for (double period = 0.0005; period < 0.03; period += 0.0005) {
      line.x.push_back(period);
      line.y.push_back(sampled(period).A(1, 1));
    }
    plot.panels[0].lines.push_back(std::move(line));
  }
  figure.picture = std::move(plot);
  return figure;
}

/// Table 7.3: the methods as power series of A T. With the shift matrix for A, whose fourth power
/// is zero, the first row of A_d is the series' coefficients.
FigureResult table_7_3() {
  constexpr int terms = 4;
  ContinuousSystem<> shift{Eigen::MatrixXd::Zero(terms, terms), Eigen::MatrixXd::Zero(terms, 1),
                           Eigen::MatrixXd::Zero(1, terms), Eigen::MatrixXd::Zero(1, 1)};
  shift.A.diagonal<1>().setOnes();
  FigureResult figure{.id = "table 7.3", .title = "Taylor series of the discretisation methods"};
  figure.columns = {{"power", "", {0.0, 1.0, 2.0, 3.0}}};
  std::vector<PlotColumn> drawn;
  for (const Method& method : methods) {
    const auto sampled = convert_to_discrete(shift, 1_s, method.method).value();
    figure.columns.push_back({method.name, "", values(sampled.A.row(0))});
    drawn.push_back({method.name, method.label});
  }
  Plot plot = line_plot(figure, "Coefficient", drawn);
  plot.x_label = "Power of A T";
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
