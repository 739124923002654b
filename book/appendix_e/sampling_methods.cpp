#include <array>
#include <string>

#include <fmt/format.h>

#include <flyball/control/feedforward.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/state_feedback.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>

#include "book/figure_functions.hpp"
#include "book/mechanism_case_study.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

struct Method {
  ConversionMethod method;
  const char* name;
  const char* label;
  LineStyle line;
};
constexpr std::array methods{
    Method{ConversionMethod::zoh, "zoh", "Zero-order hold", LineStyle::solid},
    Method{ConversionMethod::forward_euler, "forward_euler", "Forward Euler", LineStyle::dash_dot},
    Method{ConversionMethod::backward_euler, "backward_euler", "Backward Euler", LineStyle::dotted},
    Method{ConversionMethod::tustin, "bilinear", "Bilinear transform", LineStyle::dashed}};

/// The controller of these figures, designed for 0.1 s whichever the model's period is: LQR and
/// plant inversion within 12 V.
class Controller {
 public:
  Controller()
      : plant_(discretize(model_of(case_study_elevator()), 100_ms).value()),
        K_(lqr(plant_, bryson({0.02, 0.4}), bryson({12.0})).value().K),
        feedback_(Eigen::RowVector2d(K_), Voltage1(-12.0), Voltage1(12.0)),
        inversion_(linear_plant_inversion(plant_).value()) {}

  /// Positions of a model that begins at x = 0.
  std::vector<double> run(const DiscreteSystem<>& model, const Eigen::MatrixXd& r) {
    Eigen::Vector2d x = Eigen::Vector2d::Zero();
    std::vector<double> positions;
    for (Eigen::Index k = 0; k < r.cols(); ++k) {
      x = (model.A * x + model.B * u_).eval();
      const Eigen::Vector2d next = r.col(std::min(k + 1, r.cols() - 1));
      const Voltage1 u_ff(inversion_.calculate(r_, next)(0));
      r_ = next;
      u_ = feedback_.calculate(x, Eigen::Vector2d(r.col(k)), u_ff);
      positions.push_back(x(0));
    }
    return positions;
  }

  [[nodiscard]] const Eigen::MatrixXd& K() const { return K_; }

 private:
  using Voltage1 = Eigen::Matrix<double, 1, 1>;
  DiscreteSystem<> plant_;
  Eigen::MatrixXd K_;
  StateFeedback<2, 1> feedback_;
  LinearPlantInversion<> inversion_;
  // The book's script runs model after model with one controller, which keeps its last voltage and
  // reference.
  Voltage1 u_ = Voltage1::Zero();
  Eigen::Vector2d r_ = Eigen::Vector2d::Zero();
};

constexpr double periods[] = {0.1, 0.05, 0.01};

Eigen::MatrixXd reference(double period) {
  const auto samples = static_cast<Eigen::Index>(6.2 / period + 0.5);
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(2, samples);
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) * period;
    r(0, k) = t >= 0.1 && t < 5.1 ? 1.524 : 0.0;
  }
  return r;
}

/// The elevator as four methods model it, with one controller: in the columns of a method's name
/// with what the earlier runs left in the controller, as the book's script draws them; in those
/// "_at_rest" each with a new one.
FigureResult sampled_models(std::string id, double period) {
  const auto elevator = model_of(case_study_elevator());
  FigureResult figure{
      .id = std::move(id),
      .title = fmt::format("Sampling methods for system simulation, T = {} s", period)};
  const Eigen::MatrixXd r = reference(period);
  std::vector<double> time;
  for (Eigen::Index k = 0; k < r.cols(); ++k) {
    time.push_back(static_cast<double>(k) * period);
  }
  figure.columns = {{"time", "s", std::move(time)}, {"reference", "m", values(r.row(0))}};
  std::vector<TimeSeries::Column> at_rest;
  Controller of_the_script;
  for (const double earlier : periods) {
    for (const Method& method : methods) {
      const auto model = convert_to_discrete(elevator, Time(earlier), method.method).value();
      auto positions = of_the_script.run(model, reference(earlier));
      if (earlier == period) {
        figure.columns.push_back({method.name, "m", std::move(positions)});
        Controller anew;
        at_rest.push_back({std::string(method.name) + "_at_rest", "m", anew.run(model, r)});
      }
    }
    if (earlier == period) {
      break;
    }
  }
  figure.columns.insert(figure.columns.end(), at_rest.begin(), at_rest.end());
  figure.numbers = {{"K_p", "V/m", of_the_script.K()(0)}, {"K_d", "V/(m/s)", of_the_script.K()(1)}};
  std::vector<PlotColumn> drawn;
  int color = 0;
  for (const Method& method : methods) {
    drawn.push_back({std::string(method.name) + "_at_rest", method.label, method.line, color++});
  }
  Plot plot = line_plot(figure, "Position (m)", drawn);
  plot.panels[0].y_limits = PlotLimits{-0.5, 2.0};  // forward Euler leaves them for 10⁷⁰ m
  figure.picture = std::move(plot);
  return figure;
}

}  // namespace

/// Figure E.23: the elevator as zero-order hold, Euler's methods and the bilinear transform model
/// it at 100 ms (section E.5): forward Euler is unstable.
FigureResult figure_E_23() {
  return sampled_models("E.23", periods[0]);
}

/// Figure E.24: at 50 ms, with the controller of 100 ms.
FigureResult figure_E_24() {
  return sampled_models("E.24", periods[1]);
}

/// Figure E.25: at 10 ms, with the controller of 100 ms.
FigureResult figure_E_25() {
  return sampled_models("E.25", periods[2]);
}

}  // namespace flyball::book
