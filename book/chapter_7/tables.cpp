#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>

#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

struct TabulatedMethod {
  ConversionMethod method;
  const char* name;
  const char* label;
  LineStyle line;
  LineStyle point;
};
constexpr TabulatedMethod tabulated_methods[] = {
    {ConversionMethod::zoh, "zoh", "Zero-order hold", LineStyle::solid, LineStyle::points},
    {ConversionMethod::tustin, "bilinear", "Bilinear", LineStyle::dashed, LineStyle::circles},
    {ConversionMethod::forward_euler, "forward_euler", "Forward Euler", LineStyle::dash_dot,
     LineStyle::crosses},
    {ConversionMethod::backward_euler, "backward_euler", "Backward Euler", LineStyle::dotted,
     LineStyle::squares}};

}  // namespace

/// Table 7.1: where points of the s-plane go, z = e^(sT) with T = 1 s (section 7.1).
FigureResult table_7_1() {
  using Complex = std::complex<double>;
  constexpr double pi = std::numbers::pi;
  const std::pair<Complex, const char*> points[] = {
      {{0.0, 0.0}, "s = 0"},          {{0.0, pi / 2.0}, "s = jπ/2"}, {{0.0, pi}, "s = jπ"},
      {{-1.0, 0.0}, "s = −1"},        {{-1.0, 1.0}, "s = −1 + j"},   {{-2.0 * pi, 0.0}, "s = −2π"},
      {{-0.5, -2.0}, "s = −0.5 − 2j"}};
  std::vector<double> columns[4];
  PolePlotGroup group;
  std::vector<PlotNote> notes;
  for (const auto& [s, words] : points) {
    // The pole of a sampled mode: dx/dt = s x as the eigenvalues of a real system.
    const Eigen::MatrixXd A{{s.real(), -s.imag()}, {s.imag(), s.real()}};
    const auto sampled = discretize_zoh(A, Eigen::MatrixXd::Zero(2, 1), 1_s).value();
    const Complex z(sampled.A(0, 0), sampled.A(1, 0));
    columns[0].push_back(s.real());
    columns[1].push_back(s.imag());
    columns[2].push_back(z.real());
    columns[3].push_back(z.imag());
    group.poles.push_back(z);
    notes.push_back({z.real(), z.imag(), words});
  }
  FigureResult figure{.id = "table 7.1", .title = "Mapping from the s-plane to the z-plane"};
  figure.columns = {{"s_re", "1/s", columns[0]},
                    {"s_im", "1/s", columns[1]},
                    {"z_re", "", columns[2]},
                    {"z_im", "", columns[3]}};
  Plot plot = pole_plot(figure.title, {group}, true);
  plot.x_label = "Real part of z";
  plot.panels[0].y_label = "Imaginary part of z";
  plot.panels[0].lines.back().label = "z = exp(s T) for s in rad/s and T = 1 s";
  plot.panels[0].notes = std::move(notes);
  figure.picture = std::move(plot);
  return figure;
}

/// Table 7.2: discretisation methods, on the elevator at three sample periods (section 7.3.1):
/// forward Euler is unstable at each of the longer ones.
FigureResult table_7_2() {
  const auto elevator = case_study_elevator();
  FigureResult figure{.id = "table 7.2", .title = "Discretisation methods"};
  figure.columns = {{"period", "s", {0.1, 0.05, 0.01}}};
  Plot plot{.title = figure.title, .x_label = "Sample period (s)"};
  plot.title += ": the elevator\u2019s mode of velocity";
  plot.panels = {{.y_label = "Its pole, A₂₂",
                  .marks = {{.at = 1.0}, {.at = -1.0, .label = "unstable below −1"}}}};
  for (const TabulatedMethod& method : tabulated_methods) {
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
    PlotLine line{.label = method.label, .style = method.line};
    for (double period = 0.0005; period < 0.03025; period += 0.0005) {
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
  Plot plot{.title = figure.title, .x_label = "Power of A T", .panels = {PlotPanel{}}};
  plot.panels[0].y_label = "Coefficient";
  plot.x_step = 1.0;
  double beside = -0.12;  // equal coefficients beside each other
  for (const TabulatedMethod& method : tabulated_methods) {
    const auto sampled = convert_to_discrete(shift, 1_s, method.method).value();
    figure.columns.push_back({method.name, "", values(sampled.A.row(0))});
    PlotLine line{.label = method.label, .style = method.point};
    for (int power = 0; power < terms; ++power) {
      line.x.push_back(power + beside);
      line.y.push_back(sampled.A(0, power));
    }
    beside += 0.08;
    plot.panels[0].lines.push_back(std::move(line));
  }
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace flyball::book
