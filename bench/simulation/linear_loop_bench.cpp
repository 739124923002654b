// A step of simulate_linear beside a plain transcription of the loop in Eigen's fixed sizes, in one
// process: two states, one input, an observer, limits, plant inversion, every signal kept.

#include <algorithm>
#include <cstdio>

#include <flyball/simulation/linear_loop.hpp>

#include "timing.hpp"

namespace {

constexpr int samples = 1000000;

flyball::LinearLoop loop() {
  flyball::LinearLoop loop;
  loop.plant.A = Eigen::Matrix2d{{1.0, 0.0198}, {0.0, 0.97}};
  loop.plant.B = Eigen::Vector2d(0.0002, 0.019);
  loop.plant.C = Eigen::RowVector2d(1.0, 0.0);
  loop.plant.D = Eigen::MatrixXd::Zero(1, 1);
  loop.plant.period = flyball::Time(0.02);
  loop.K = Eigen::RowVector2d(50.0, 5.0);
  loop.K_e = Eigen::Vector2d(0.5, 2.0);
  loop.u_min = Eigen::VectorXd::Constant(1, -12.0);
  loop.u_max = Eigen::VectorXd::Constant(1, 12.0);
  return loop;
}

double plain(const flyball::LinearLoop& loop, const Eigen::MatrixXd& r) {
  const Eigen::Matrix2d A = loop.plant.A;
  const Eigen::Vector2d B = loop.plant.B;
  const Eigen::RowVector2d C = loop.plant.C;
  const Eigen::RowVector2d K = loop.K;
  const Eigen::Vector2d K_e = *loop.K_e;
  const Eigen::RowVector2d B_pinv = B.transpose() / B.squaredNorm();
  Eigen::MatrixXd xs(2, samples);
  Eigen::MatrixXd x_hats(2, samples);
  Eigen::VectorXd us(samples);
  Eigen::VectorXd ys(samples);
  Eigen::VectorXd times(samples);
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Vector2d x_hat = x;
  double u = 0.0;
  for (int k = 0; k < samples; ++k) {
    x = (A * x + B * u).eval();
    const double y = C * x;
    x_hat = (A * x_hat + B * u).eval();
    x_hat += K_e * (y - C * x_hat);
    const Eigen::Vector2d now = r.col(k);
    const Eigen::Vector2d next = r.col(std::min(k + 1, samples - 1));
    u = std::clamp(K.dot(now - x_hat) + B_pinv.dot(next - A * now), -12.0, 12.0);
    times(k) = 0.02 * k;
    for (int i = 0; i < 2; ++i) {  // GCC 12 warns of whole columns, wrongly
      xs(i, k) = x(i);
      x_hats(i, k) = x_hat(i);
    }
    ys(k) = y;
    us(k) = u;
  }
  return xs(0, samples - 1) + x_hats(0, samples - 1) + us.sum() + ys.sum() + times.sum();
}

}  // namespace

int main() {
  const flyball::LinearLoop given = loop();
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(2, samples);
  for (int k = 0; k < samples; ++k) {
    r(0, k) = 0.001 * (k % 1000);
  }
  double ours = 1e300;
  double theirs = 1e300;
  double sum = 0.0;
  for (int turn = 0; turn < 9; ++turn) {
    ours = std::min(
        ours, bench::microseconds(1, [&] { sum += flyball::simulate_linear(given, r)->u.sum(); }));
    theirs = std::min(theirs, bench::microseconds(1, [&] { sum += plain(given, r); }));
  }
  std::printf("simulate_linear %.1f ns a step, plain %.1f ns, %.2f times\n", 1e3 * ours / samples,
              1e3 * theirs / samples, ours / theirs);
  return sum == sum ? 0 : 1;
}
