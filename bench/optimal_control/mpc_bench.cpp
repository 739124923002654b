// Predictive controllers in their loops: microseconds of the process a period, state to first
// input, the smallest of many runs of each of the 60 periods; mean and worst over these.
// `--campaign N` puts N random programs through the method and the modelling layer's.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <vector>

#include <flyball/control/mpc/nonlinear_mpc.hpp>

#include "control/mpc/mpc_problems.hpp"

namespace {

using namespace flyball;
using Eigen::VectorXd;

constexpr int periods = 60;
constexpr int runs = 200;

double process_microseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

/// @param step  The plant's period. @param cold  Whether each solve starts from nothing.
template <class Controller, class Step>
void loop(const char* name, Controller& mpc, const VectorXd& x_0, bool cold, Step&& step) {
  std::vector<double> best(periods, 1e300);
  int most = 0;
  for (int run = 0; run < runs; ++run) {
    VectorXd x = x_0;
    mpc.reset();
    for (int k = 0; k < periods; ++k) {
      if (cold) {
        mpc.reset();
      }
      const double begin = process_microseconds();
      const VectorXd& u = mpc.calculate(x);
      const double took = process_microseconds() - begin;
      auto& least = best[static_cast<std::size_t>(k)];
      least = std::min(least, took);
      most = std::max(most, mpc.iterations());
      x = step(x, u);
    }
  }
  if (!cold) {
    best.erase(best.begin());  // it has nothing to start from
  }
  double sum = 0.0;
  for (const double time : best) {
    sum += time;
  }
  std::printf("| %s | %s | %.1f | %.1f | %d |\n", name, cold ? "cold" : "warm",
              sum / static_cast<double>(best.size()), *std::max_element(best.begin(), best.end()),
              most);
}

/// The pose and the sides' velocities of the drive whose errors are linear above.
struct Drive {
  static constexpr int states() { return 5; }
  static constexpr int inputs() { return 2; }
  template <class X, class U>
  auto derivative(const X& x, const U& u) const {
    using std::cos;
    using std::sin;
    using S = ScalarOf<X, U>;
    const S v = 0.5 * (x(3) + x(4));
    return Eigen::Vector<S, 5>{v * cos(x(2)), v * sin(x(2)), (x(4) - x(3)) / 0.6,
                               -4.0 * x(3) - 0.5 * x(4) + 2.5 * u(0) + 0.4 * u(1),
                               -0.5 * x(3) - 4.0 * x(4) + 0.4 * u(0) + 2.5 * u(1)};
  }
};

void campaign(int count) {
  Random random(1);
  int wrong = 0;
  int capped = 0;
  int interior = 0;
  int most = 0;
  for (int i = 0; i < count; ++i) {
    const auto p = mpc_problems::random_program(random, i % 2 == 1, i % 4 > 1);
    auto mpc = mpc_problems::controller(p).value();
    (void)mpc.calculate(p.x_0);
    const auto answer = mpc_problems::solve_as_problem(p);
    most = std::max(most, mpc.iterations());
    interior += mpc.iterations() > 20 ? 1 : 0;
    capped += mpc.status() == MpcStatus::capped ? 1 : 0;
    const double off = std::abs(mpc.cost() - answer.cost) / (1.0 + std::abs(answer.cost));
    if (!answer.solved || !(off < 1e-6)) {
      std::printf("program %d: cost %.12g, modelling layer %.12g%s\n", i, mpc.cost(), answer.cost,
                  answer.solved ? "" : " (not solved)");
      ++wrong;
    }
  }
  std::printf(
      "%d random programs: %d differ, %d capped, %d of more than 20 iterations, %d at most\n",
      count, wrong, capped, interior, most);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "--campaign") == 0) {
    campaign(std::atoi(argv[2]));
    return 0;
  }
  std::printf(
      "| loop | start | mean, us | worst, us | iterations at most |\n|---|---|---:|---:|---:|\n");
  const auto linear = [](const char* name, const mpc_problems::Program& p) {
    for (const bool cold : {true, false}) {
      auto mpc = mpc_problems::controller(p).value();
      loop(name, mpc, p.x_0, cold,
           [&p](const VectorXd& x, const VectorXd& u) { return VectorXd(p.A * x + p.B * u); });
    }
  };
  linear("drive, 5 states, N = 20", mpc_problems::drive());
  linear("quadrotor, 12 states, N = 30", mpc_problems::quadrotor());
  auto rates = mpc_problems::drive();
  rates.settings.du_min = VectorXd::Constant(2, -3.0);
  rates.settings.du_max = VectorXd::Constant(2, 3.0);
  linear("drive with rates", rates);
  auto states = mpc_problems::drive();
  states.settings.x_min = VectorXd{{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -1.5, -1.5}};
  states.settings.x_max = -states.settings.x_min;
  linear("drive with limits of velocities", states);

  MpcSettings settings{.horizon = 20};
  settings.u_min = VectorXd::Constant(2, -6.0);
  settings.u_max = VectorXd::Constant(2, 6.0);
  const Eigen::MatrixXd Q = VectorXd{{100.0, 100.0, 10.0, 1.0, 1.0}}.asDiagonal();
  settings.Q_end = 10.0 * Q;
  const Eigen::MatrixXd R = 0.1 * Eigen::MatrixXd::Identity(2, 2);
  auto made = NonlinearMpc<>::create(model_tape(Drive{}), Time(0.05), Q, R, settings).value();
  const VectorXd x_0 = VectorXd{{-0.3, 0.25, 0.4, 0.0, 0.0}};
  const auto step = [](const VectorXd& x, const VectorXd& u) {
    VectorXd next = x;
    for (int i = 0; i < 10; ++i) {
      next += 0.005 * Drive{}.derivative(next, u);
    }
    return next;
  };
  loop("nonlinear drive, N = 20, first period of ten iterations", made, x_0, true, step);
  loop("nonlinear drive, N = 20, one iteration", made, x_0, false, step);
  return 0;
}
