// Flyball's side of compare.py: reads problems, one JSON object a line, and answers each with the
// smallest time of a whole call in microseconds.

#include <algorithm>
#include <chrono>
#include <iostream>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <flyball/control/pole_placement.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/riccati/riccati.hpp>

namespace {

using Eigen::MatrixXd;
using Clock = std::chrono::steady_clock;

MatrixXd matrix(const nlohmann::json& rows) {
  MatrixXd M(rows.size(), rows.at(0).size());
  for (Eigen::Index i = 0; i < M.rows(); ++i) {
    for (Eigen::Index j = 0; j < M.cols(); ++j) {
      M(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j));
    }
  }
  return M;
}

template <class Work>
double smallest_time(Work&& work) {
  const auto deadline = Clock::now() + std::chrono::milliseconds(60);
  double best = 1e300;
  for (int calls = 0; calls < 5 || Clock::now() < deadline; ++calls) {
    const auto start = Clock::now();
    work();
    best = std::min(best, std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  return best;
}

double time_of(const nlohmann::json& problem) {
  const std::string kind = problem.at("kind");
  const MatrixXd A = matrix(problem.at("A"));
  bool solved = true;
  double time = 0.0;
  if (kind == "expm") {
    time = smallest_time([&] { solved = solved && flyball::expm(A).has_value(); });
  } else if (kind == "lyapunov" || kind == "discrete-lyapunov") {
    const MatrixXd Q = matrix(problem.at("Q"));
    time = smallest_time([&] {
      solved = solved &&
               (kind == "lyapunov" ? flyball::lyapunov(A, Q) : flyball::discrete_lyapunov(A, Q))
                   .has_value();
    });
  } else {
    const MatrixXd B = matrix(problem.at("B"));
    const MatrixXd Q = matrix(problem.at("Q"));
    const MatrixXd R = matrix(problem.at("R"));
    time = smallest_time([&] {
      solved = solved &&
               (kind == "care" ? flyball::care(A, B, Q, R) : flyball::dare(A, B, Q, R)).has_value();
    });
  }
  return solved ? time : -1.0;
}

}  // namespace

int main() {
  for (std::string line; std::getline(std::cin, line);) {
    std::cout << time_of(nlohmann::json::parse(line)) << '\n';
  }
  return 0;
}
