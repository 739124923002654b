// An elevator's position and velocity from an encoder with noise (chapter 9): differences of the
// readings, a Kalman filter that runs along, and the smoother that afterwards knows the whole
// record (9.7).
#include <cmath>
#include <cstdio>

#include <flyball/core/random.hpp>
#include <flyball/estimation/kalman_filter.hpp>
#include <flyball/estimation/smoother.hpp>
#include <flyball/mechanisms/elevator.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  using Eigen::Vector2d;
  using Scalar = Eigen::Vector<double, 1>;

  const auto elevator = mechanisms::elevator(
      {.motor = mechanisms::neo(2), .gearing = 5.0, .mass = 20_kg, .drum_radius = 2.54_cm});
  const auto plant = discretize(elevator.value(), 20_ms).value();

  //! [noise]
  const Covariance Q = standard_deviations({0.001, 0.05});  // a period adds 1 mm, 5 cm/s
  const Covariance R = standard_deviations({0.005});        // the encoder: 5 mm
  //! [noise]
  constexpr int steps = 500;
  Random random(9);
  Eigen::MatrixXd truth(2, steps);
  Eigen::MatrixXd inputs(1, steps);
  Eigen::MatrixXd outputs(1, steps);
  Vector2d x = Vector2d::Zero();
  for (int k = 0; k < steps; ++k) {
    inputs(k) = 4.0 * std::sin(0.03 * k);
    x = plant.A * x + plant.B * inputs(k) +
        Vector2d(0.001 * random.normal(), 0.05 * random.normal());
    truth.col(k) = x;
    outputs(k) = x(0) + 0.005 * random.normal();
  }

  //! [filter]
  auto filter = kalman_filter(plant, Q, R, standard_deviations({0.0, 0.0})).value();
  Eigen::MatrixXd filtered(2, steps);
  for (int k = 0; k < steps; ++k) {
    filter.predict(Scalar(inputs(k)));
    filter.update(Scalar(outputs(k)), Scalar(inputs(k)));
    filtered.col(k) = filter.x_hat();
  }
  //! [filter]
  //! [smoother]
  const DiscreteSystem<> model{plant.A, plant.B, plant.C, plant.D, plant.period};
  const auto smoothed =
      smooth(model, Q, R, Vector2d(0.0, 0.0), standard_deviations({0.0, 0.0}), inputs, outputs);
  //! [smoother]
  if (!smoothed) {
    std::fprintf(stderr, "%s\n", to_string(smoothed.error()).c_str());
    return 1;
  }

  const Eigen::MatrixXd path = smoothed->smoothed.x.rightCols(steps);

  Eigen::MatrixXd read(2, steps);
  read.row(0) = outputs;
  read(1, 0) = 0.0;
  read.row(1).tail(steps - 1) = (outputs.rightCols(steps - 1) - outputs.leftCols(steps - 1)) / 0.02;
  const auto row = [&](const char* name, const Eigen::MatrixXd& states) {
    const Vector2d rms = ((states - truth).rowwise().squaredNorm() / steps).cwiseSqrt();
    std::printf("%-10s %8.2f mm %8.1f mm/s\n", name, 1e3 * rms(0), 1e3 * rms(1));
    return rms;
  };
  std::printf("%-10s %11s %13s\n", "rms error", "position", "velocity");
  const Vector2d of_readings = row("readings", read);
  const Vector2d of_filter = row("filter", filtered);
  const Vector2d of_smoother = row("smoother", path);
  return of_filter(1) < 0.3 * of_readings(1) && of_smoother(1) < 0.9 * of_filter(1) ? 0 : 1;
}
