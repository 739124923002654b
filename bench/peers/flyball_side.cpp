// Flyball's side of compare.py and compare_large.py: reads problems, one JSON object a line, and
// answers each with the smallest processor time of a whole call in microseconds; -1 where it is
// refused.

#include <algorithm>
#include <complex>
#include <ctime>
#include <iostream>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <flyball/control/pole_placement.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/exponential/matrix_exponential.hpp>
#include <flyball/math/exponential/matrix_function.hpp>
#include <flyball/math/riccati/riccati.hpp>
#include <flyball/systems/analysis.hpp>

namespace {

using Eigen::MatrixXd;
using Complex = std::complex<double>;

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
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
  };
  constexpr double enough = 6e4;
  constexpr double too_long = 1e6;
  double best = 1e300;
  double spent = 0.0;
  int in_turn = 1;  // Calls that are timed as one, beside which reading the clock is nothing.
  for (int calls = 0; spent < too_long && (calls < 5 || spent < enough); ++calls) {
    const double start = now();
    for (int k = 0; k < in_turn; ++k) {
      work();
    }
    const double elapsed = now() - start;
    best = std::min(best, elapsed / in_turn);
    spent += elapsed;
    in_turn = elapsed < 50.0 ? 4 * in_turn : in_turn;
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
  } else if (kind == "logm") {
    time = smallest_time([&] { solved = solved && flyball::logm(A).has_value(); });
  } else if (kind == "eigenvalues") {
    time = smallest_time([&] {
      solved = solved && flyball::analyze_modes(A, flyball::TimeDomain::continuous).has_value();
    });
  } else if (kind == "place") {
    const MatrixXd B = matrix(problem.at("B"));
    const Eigen::VectorXcd poles = matrix(problem.at("poles")).row(0).transpose().cast<Complex>();
    time = smallest_time([&] { solved = solved && flyball::place(A, B, poles).has_value(); });
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
    std::cout << time_of(nlohmann::json::parse(line)) << std::endl;
  }
  return 0;
}
