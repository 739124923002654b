#include <flyball/systems/discretize.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

using namespace flyball::literals;

namespace {

// A CIM's constants of section 6.10.7.
constexpr double J = 3.2284e-6;
constexpr double b = 3.5077e-6;
constexpr double K_t = 0.0181;
constexpr double K_e = 0.0181;
constexpr double R = 0.0902;

/// The step response of a position loop with K_p = 1 V/rad. The scripts' first sample is there
/// twice, so their curve is one period late; here the time is right.
FigureResult position_step(std::string id, std::string title, const Eigen::MatrixXd& A,
                           const Eigen::MatrixXd& B) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(1, n);
  K(0, 0) = 1.0;
  // dx/dt = (A - BK)x + BK r
  const ContinuousSystem<> closed_loop{A - B * K, B * K(0), K, Eigen::MatrixXd::Zero(1, 1)};
  const Time period = 0.1_ms;
  constexpr int samples = 2502;
  const auto discrete = discretize(closed_loop, period).value();

  std::vector<double> time;
  for (int k = 0; k < samples; ++k) {
    time.push_back(k * period.si());
  }
  FigureResult figure{.id = std::move(id), .title = std::move(title)};
  figure.columns = {{"time", "s", time},
                    {"reference", "rad", std::vector<double>(samples, 1.0)},
                    {"position", "rad", values(unit_step(discrete, samples))}};
  const Eigen::VectorXcd open = poles(A).value();
  figure.numbers = {{"slowest_electrical_pole", "1/s", open.real().minCoeff()}};
  figure.picture = line_plot(figure, "Position (rad)",
                             {{"position", "Step response", LineStyle::solid, state_color},
                              {"reference", "Reference", LineStyle::dashed, reference_color}});
  return figure;
}

}  // namespace

/// Figure 6.6: a position loop whose motor has an inductance of 230 µH: it oscillates.
FigureResult figure_6_6() {
  constexpr double L = 230e-6;
  return position_step(
      "6.6", "Position step of a motor with inductance",
      Eigen::MatrixXd{{0.0, 1.0, 0.0}, {0.0, -b / J, K_t / J}, {0.0, -K_e / L, -R / L}},
      Eigen::MatrixXd{{0.0}, {0.0}, {1.0 / L}});
}

/// Figure 6.7: the same without inductance.
FigureResult figure_6_7() {
  return position_step("6.7", "Position step of a motor without inductance",
                       Eigen::MatrixXd{{0.0, 1.0}, {0.0, -(K_t * K_e / (R * J) + b / J)}},
                       Eigen::MatrixXd{{0.0}, {K_t / (R * J)}});
}

}  // namespace flyball::book
