#include <flyball/optimization/problem/problem.hpp>

#include "book/drawing.hpp"
#include "book/figure_functions.hpp"

namespace flyball::book {

namespace {

/// Section 17.1.1: rest to rest over 2 m within 3.5 s, |v| ≤ 1 m/s and |a| ≤ 1 m/s², the sum of the
/// squared distances from the goal least. The optimum overshoots: that costs less than waiting.
struct DoubleIntegrator {
  Eigen::RowVectorXd position, velocity, acceleration;
  double cost = 0.0;
};

constexpr int N = 700;
constexpr double dt = 0.005;
constexpr double r = 2.0;

DoubleIntegrator solve_double_integrator() {
  using namespace optimization;
  Problem problem;
  const ExpressionMatrix X = problem.decision_variable(2, N + 1);
  const ExpressionMatrix U = problem.decision_variable(1, N);
  for (int k = 0; k < N; ++k) {
    problem.subject_to(X(0, k + 1) == X(0, k) + X(1, k) * dt);
    problem.subject_to(X(1, k + 1) == X(1, k) + U(0, k) * dt);
  }
  problem.subject_to(X.col(0) == Eigen::Vector2d(0.0, 0.0));
  problem.subject_to(X.col(N) == Eigen::Vector2d(r, 0.0));
  problem.subject_to(-1.0 <= X.row(1));
  problem.subject_to(X.row(1) <= 1.0);
  problem.subject_to(-1.0 <= U);
  problem.subject_to(U <= 1.0);
  Expression J = 0.0;
  for (int k = 0; k <= N; ++k) {
    J += pow(r - X(0, k), 2);
  }
  problem.minimize(J);
  const ProblemSolution solution = problem.solve({.tolerance = 1e-12}).value();
  return {X.row(0).value(), X.row(1).value(), U.value(), solution.cost};
}

FigureResult solution_figure(const std::string& id, const std::string& name,
                             const std::string& unit, const std::string& label,
                             const Eigen::RowVectorXd& values_of_name, double cost) {
  FigureResult figure{.id = id, .title = "Double integrator " + name};
  std::vector<double> time;
  for (Eigen::Index k = 0; k < values_of_name.size(); ++k) {
    time.push_back(static_cast<double>(k) * dt);
  }
  figure.columns.push_back({"time", "s", std::move(time)});
  figure.columns.push_back({name, unit, values(values_of_name)});
  figure.numbers.push_back({"cost", "m²", cost});
  figure.picture = line_plot(figure, label + " (" + unit + ")", {{name, label}});
  return figure;
}

}  // namespace

FigureResult figure_17_1() {
  const DoubleIntegrator solved = solve_double_integrator();
  return solution_figure("17.1", "position", "m", "Position", solved.position, solved.cost);
}
FigureResult figure_17_2() {
  const DoubleIntegrator solved = solve_double_integrator();
  return solution_figure("17.2", "velocity", "m/s", "Velocity", solved.velocity, solved.cost);
}
FigureResult figure_17_3() {
  const DoubleIntegrator solved = solve_double_integrator();
  return solution_figure("17.3", "acceleration", "m/s²", "Acceleration", solved.acceleration,
                         solved.cost);
}

}  // namespace flyball::book
