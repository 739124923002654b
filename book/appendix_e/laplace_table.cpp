#include <cmath>

#include <flyball/math/integration/quadrature.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

/// F(s) = ∫₀^∞ f(t) e^(-st) dt, by the integral itself.
template <class Function>
double transform(Function&& f, double s) {
  const auto integrand = [&](double t) { return f(t) * std::exp(-s * t); };
  // What comes after 60/s is below e^(-60).
  return quadrature(integrand, 0.0, 60.0 / s).value().value;
}

}  // namespace

/// Table E.1: Laplace transforms, each by its integral at real s and by its closed form (section
/// E.3.4). The properties are those of f(t) = t² e^(-t), which begins at rest, and g(t) = e^(-t/2)
/// sin 2t.
FigureResult table_E_1() {
  const auto f = [](double t) { return t * t * std::exp(-t); };
  const auto df = [](double t) { return (2.0 * t - t * t) * std::exp(-t); };
  const auto ddf = [](double t) { return (2.0 - 4.0 * t + t * t) * std::exp(-t); };
  const auto g = [](double t) { return std::exp(-0.5 * t) * std::sin(2.0 * t); };
  const auto convolution = [&](double t) {
    return t == 0.0 ? 0.0
                    : quadrature([&](double tau) { return f(tau) * g(t - tau); }, 0.0, t,
                                 {.absolute_tolerance = 1e-14})
                          .value()
                          .value;
  };
  const auto F = [](double s) { return 2.0 / std::pow(s + 1.0, 3); };
  const auto G = [](double s) { return 2.0 / ((s + 0.5) * (s + 0.5) + 4.0); };
  constexpr double a = 3.0;
  constexpr double b = -2.0;
  constexpr double alpha = 2.0;

  FigureResult figure{.id = "table E.1", .title = "Laplace transforms and their properties"};
  std::vector<double> s_values;
  for (int k = 1; k <= 10; ++k) {
    s_values.push_back(0.5 * k);
  }
  figure.columns = {{"s", "1/s", s_values}};
  PlotPanel panel{.y_label = "F(s)"};
  const auto add = [&](const std::string& name, const std::string& words, auto&& time_domain,
                       auto&& laplace_domain) {
    std::vector<double> integrals;
    std::vector<double> closed;
    for (const double s : s_values) {
      integrals.push_back(transform(time_domain, s));
      closed.push_back(laplace_domain(s));
    }
    const int color = static_cast<int>(panel.lines.size() / 2) % 7;
    PlotLine curve{.label = words, .color = color};
    for (double s = 0.5; s <= 5.0001; s += 0.05) {
      curve.x.push_back(s);
      curve.y.push_back(laplace_domain(s));
    }
    panel.lines.push_back(std::move(curve));
    panel.lines.push_back(
        {.x = s_values, .y = integrals, .style = LineStyle::circles, .color = color});
    figure.columns.push_back({name, "", std::move(integrals)});
    figure.columns.push_back({name + "_closed", "", std::move(closed)});
  };
  add(
      "linearity", "3f − 2g: 3F(s) − 2G(s)", [&](double t) { return a * f(t) + b * g(t); },
      [&](double s) { return a * F(s) + b * G(s); });
  add("convolution", "f ∗ g: F(s) G(s)", convolution, [&](double s) { return F(s) * G(s); });
  add("derivative", "f′: s F(s)", df, [&](double s) { return s * F(s); });
  add("second_derivative", "f″: s² F(s)", ddf, [&](double s) { return s * s * F(s); });
  add("unit_step", "u(t): 1/s", [](double) { return 1.0; }, [](double s) { return 1.0 / s; });
  add("ramp", "t u(t): 1/s²", [](double t) { return t; }, [](double s) { return 1.0 / (s * s); });
  add(
      "exponential_decay", "e^(−2t) u(t): 1/(s + 2)",
      [&](double t) { return std::exp(-alpha * t); }, [&](double s) { return 1.0 / (s + alpha); });
  figure.picture = Plot{.title = figure.title + ": closed forms, and their integrals as circles",
                        .x_label = "s (1/s)",
                        .panels = {std::move(panel)}};
  return figure;
}

}  // namespace flyball::book
