// Problems along stages beside IPOPT with the same exact derivatives, in one process. Ours are
// stated through the public modelling layer, statement and compilation in the time; IPOPT's
// derivatives are compiled beforehand.

#include <cstdio>
#include <limits>
#include <numbers>

#include "ipopt_peer.hpp"
#include "problems.hpp"

namespace {

using namespace problems;
using namespace flyball::optimization;
using Eigen::MatrixXd;
using flyball::expression::Lagrangian;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Records a function of z = (x, u).
template <class F>
Lagrangian record(int variables, F&& f) {
  detail::ExpressionGraph graph;
  ExpressionVector z(variables);
  for (Eigen::Index i = 0; i < variables; ++i) {
    z(i) = Expression(&graph, graph.input());
  }
  std::vector<std::uint32_t> nodes;
  for (const Expression& y : f(z)) {
    nodes.push_back(y.is_constant() ? graph.constant(y.constant()) : y.node());
  }
  return flyball::expression::lagrangian(graph.tape(nodes), static_cast<std::size_t>(variables));
}

peer::StageProblem sized(int n, int m, int N) {
  peer::StageProblem p;
  p.states = n;
  p.inputs = m;
  p.intervals = N;
  p.lower = MatrixXd::Constant(n + m, N + 1, -infinity);
  p.upper = -p.lower;
  p.start = MatrixXd::Zero(n + m, N + 1);
  p.lower.bottomRightCorner(m, 1).setZero();
  p.upper.bottomRightCorner(m, 1).setZero();
  p.lower.topLeftCorner(n, 1).setZero();
  p.upper.topLeftCorner(n, 1).setZero();
  return p;
}

peer::StageProblem swing_up_of_peer(int N) {
  peer::StageProblem p = sized(4, 1, N);
  const Lagrangian derivative = record(5, [](const ExpressionVector& z) {
    const Eigen::Matrix<Expression, 4, 1> x = z.head(4);
    const Eigen::Matrix<Expression, 1, 1> u = z.tail(1);
    const auto f = cart_pole::Model{}(x, u);
    return std::vector<Expression>{f(0), f(1), f(2), f(3)};
  });
  const Lagrangian parts[] = {
      flyball::expression::runge_kutta_step(derivative, OptimalControlProblem::default_method(),
                                            5.0 / N),
      record(5, [](const ExpressionVector& z) { return std::vector<Expression>{z(4) * z(4)}; })};
  p.stage = flyball::expression::stack(parts);
  p.last = record(5, [](const ExpressionVector&) { return std::vector<Expression>{0.0}; });
  for (int k = 1; k < N; ++k) {
    p.lower(0, k) = 0.0;
    p.upper(0, k) = 2.0;
  }
  p.lower.bottomLeftCorner(1, N).setConstant(-20.0);
  p.upper.bottomLeftCorner(1, N).setConstant(20.0);
  p.lower.topRightCorner(4, 1) = Eigen::Vector4d(1.0, std::numbers::pi, 0.0, 0.0);
  p.upper.topRightCorner(4, 1) = p.lower.topRightCorner(4, 1);
  p.start.topRows(4) = cart_pole::start(N);
  return p;
}

peer::StageProblem flywheel_of_peer(int N) {
  peer::StageProblem p = sized(1, 1, N);
  const double a = std::exp(-5.0 / N);
  p.stage = record(2, [a](const ExpressionVector& z) {
    return std::vector<Expression>{a * z(0) + (1.0 - a) * z(1), pow(10.0 - z(0), 2)};
  });
  p.last = record(
      2, [](const ExpressionVector& z) { return std::vector<Expression>{pow(10.0 - z(0), 2)}; });
  p.lower.bottomLeftCorner(1, N).setConstant(-12.0);
  p.upper.bottomLeftCorner(1, N).setConstant(12.0);
  return p;
}

peer::StageProblem double_integrator_of_peer(int N) {
  peer::StageProblem p = sized(2, 1, N);
  const double h = 3.5 / N;
  p.stage = record(3, [h](const ExpressionVector& z) {
    return std::vector<Expression>{z(0) + h * z(1) + 0.5 * h * h * z(2), z(1) + h * z(2),
                                   pow(2.0 - z(0), 2)};
  });
  p.last = record(
      3, [](const ExpressionVector& z) { return std::vector<Expression>{pow(2.0 - z(0), 2)}; });
  p.lower.block(1, 1, 2, N - 1).setConstant(-1.0);
  p.upper.block(1, 1, 2, N - 1).setConstant(1.0);
  p.lower(2, 0) = -1.0;
  p.upper(2, 0) = 1.0;
  p.lower.topRightCorner(2, 1) = Eigen::Vector2d(2.0, 0.0);
  p.upper.topRightCorner(2, 1) = p.lower.topRightCorner(2, 1);
  return p;
}

void compare(const char* name, int N, const Row& ours, const peer::StageProblem& problem,
             int repetitions) {
  peer::Result best;
  best.milliseconds = infinity;
  for (int k = 0; k < repetitions; ++k) {
    const peer::Result result = peer::solve_with_ipopt(problem);
    best = result.milliseconds < best.milliseconds ? result : best;
  }
  std::printf("| %s | %d | %.2f | %d | %.10g%s | %.1f | %d | %.10g%s | %.0f |\n", name, N,
              ours.milliseconds, ours.iterations, ours.cost, ours.solved ? "" : " not solved",
              best.milliseconds, best.iterations, best.cost, best.solved ? "" : " not solved",
              best.milliseconds / ours.milliseconds);
  std::fflush(stdout);
}

}  // namespace

int main() {
  std::printf(
      "| problem | N | Flyball, ms | iterations | cost | IPOPT, ms | iterations | cost | ratio |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  compare("double integrator", 700, double_integrator(700), double_integrator_of_peer(700), 3);
  for (const int N : {100, 300, 1000, 3000}) {
    compare("flywheel", N, flywheel(N), flywheel_of_peer(N), N > 300 ? 1 : 3);
  }
  for (const int N : {100, 300, 1000, 3000}) {
    compare("cart-pole", N, swing_up(N), swing_up_of_peer(N), N > 100 ? 1 : 3);
  }
  return 0;
}
