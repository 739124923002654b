#include <numbers>

#include <Eigen/LU>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/control/margins.hpp>

#include "study/model_loop_response.hpp"

namespace flyball::study {

namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// The controller's linear part u = -(C_c q + D_c y), q⁺ = A_c q + B_c y.
struct Controller {
  MatrixXd A_c, B_c, C_c, D_c;
};

/// With the prediction q = x̂⁻: x̂ = q + K_e (y - C q), u = -K x̂, q⁺ = A x̂ + B u.
Controller controller_of(const ModelRegulator& regulator) {
  const Index n = regulator.plant.A.rows();
  const MatrixXd& K = regulator.K_delayed;
  if (!regulator.observer) {
    return {MatrixXd(0, 0), MatrixXd(0, n), MatrixXd(K.rows(), 0), K};
  }
  const MatrixXd& K_e = regulator.kalman_gain;
  const MatrixXd I_KC = MatrixXd::Identity(n, n) - K_e * regulator.plant.C;
  const MatrixXd A_BK = regulator.plant.A - regulator.plant.B * K;
  return {A_BK * I_KC, A_BK * K_e, K * I_KC, K * K_e};
}

/// Between a thousandth of Nyquist's frequency and it, every resonance of plant and controller met.
std::vector<double> frequencies_of(const ModelRegulator& regulator, const Controller& controller,
                                   double nyquist) {
  const auto& [A, B, C, D, period] = regulator.plant;
  // In series, from the plant's inputs to the controller's outputs.
  const Index n = A.rows();
  const Index q = controller.A_c.rows();
  const MatrixXd seen = regulator.observer ? C : MatrixXd(MatrixXd::Identity(n, n));
  DiscreteSystem<> both{MatrixXd::Zero(n + q, n + q), MatrixXd::Zero(n + q, B.cols()),
                        MatrixXd::Zero(controller.C_c.rows(), n + q),
                        MatrixXd::Zero(controller.C_c.rows(), B.cols()), period};
  both.A.topLeftCorner(n, n) = A;
  both.A.bottomLeftCorner(q, n) = controller.B_c * seen;
  both.A.bottomRightCorner(q, q) = controller.A_c;
  both.B.topRows(n) = B;
  both.C << controller.D_c * seen, controller.C_c;
  const double first = 1e-3 * nyquist;
  if (const auto response = classical::frequency_response(both)) {
    constexpr int most = 400;
    if (const auto grid = classical::frequency_grid(
            *response, {.low = first, .high = nyquist, .most_points = most})) {
      return {grid->frequency.begin(), grid->frequency.end()};
    }
  }
  constexpr int count = 300;
  return frequencies_between(first, nyquist, count);
}

/// A square matrix without a row and its column.
MatrixXcd without(const MatrixXcd& M, Index which) {
  const Index left = M.rows() - 1;
  MatrixXcd rest(left, left);
  for (Index i = 0; i < left; ++i) {
    for (Index j = 0; j < left; ++j) {
      rest(i, j) = M(i + (i >= which ? 1 : 0), j + (j >= which ? 1 : 0));
    }
  }
  return rest;
}

}  // namespace

std::vector<std::vector<FrequencyPoint>> loop_responses(const ModelRegulator& regulator,
                                                        Time delay) {
  constexpr Index most_states = 30;
  constexpr Index most_inputs = 4;
  const ContinuousSystem<>& open = regulator.linear;
  const Index m = open.B.cols();
  const bool feedthrough = regulator.observer && !regulator.plant.D.isZero(0.0);
  if (m == 0 || m > most_inputs || open.A.rows() > most_states || feedthrough) {
    return {};
  }
  const Controller controller = controller_of(regulator);
  const MatrixXd C =
      regulator.observer ? open.C : MatrixXd(MatrixXd::Identity(open.A.rows(), open.A.rows()));
  std::vector<PlantInputLoop> parts;  // from input j to what the controller's row i answers
  for (Index i = 0; i < m; ++i) {
    for (Index j = 0; j < m; ++j) {
      parts.push_back({open.A, open.B.col(j), C, regulator.plant.period, delay, controller.A_c,
                       controller.B_c, controller.C_c.row(i), controller.D_c.row(i)});
    }
  }
  const double nyquist = std::numbers::pi / regulator.plant.period.si();
  std::vector<std::vector<FrequencyPoint>> responses(static_cast<std::size_t>(m));
  for (const double frequency : frequencies_of(regulator, controller, nyquist)) {
    MatrixXcd L(m, m);
    for (Index i = 0; i < m; ++i) {
      for (Index j = 0; j < m; ++j) {
        const auto value = loop_response(parts[static_cast<std::size_t>(i * m + j)], frequency);
        if (!value) {
          return {};
        }
        L(i, j) = *value;
      }
    }
    const MatrixXcd I_L = MatrixXcd::Identity(m, m) + L;
    for (Index i = 0; i < m; ++i) {
      append(responses[static_cast<std::size_t>(i)], frequency,
             m == 1 ? L(0, 0) : I_L.determinant() / without(I_L, i).determinant() - 1.0);
    }
  }
  return responses;
}

}  // namespace flyball::study
