// Flyball's side of compare.py: reads {"A", "B", "C", "D", "w", "Ad", "Bd", "Cd", "Dd", "u"} from
// standard input, writes the smallest time of each task in milliseconds and its answer.
#include <algorithm>
#include <iostream>
#include <vector>

#include <nlohmann/json.hpp>

#include <flyball/classical/frequency_response.hpp>
#include <flyball/systems/response.hpp>

#include "timing.hpp"

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using namespace flyball;

MatrixXd matrix(const nlohmann::json& rows) {
  MatrixXd M(static_cast<Index>(rows.size()), static_cast<Index>(rows[0].size()));
  for (Index i = 0; i < M.rows(); ++i) {
    for (Index j = 0; j < M.cols(); ++j) {
      M(i, j) = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)].get<double>();
    }
  }
  return M;
}

Eigen::VectorXd vector(const nlohmann::json& list) {
  const auto values = list.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

template <class Work>
double best_of(int times, Work&& work) {
  double best = 1e300;
  for (int i = 0; i < times; ++i) {
    best = std::min(best, 1e-3 * bench::microseconds(1, work));
  }
  return best;
}

}  // namespace

int main() {
  const auto problem = nlohmann::json::parse(std::cin);
  const ContinuousSystem<> plant{matrix(problem["A"]), matrix(problem["B"]), matrix(problem["C"]),
                                 matrix(problem["D"])};
  const Eigen::VectorXd w = vector(problem["w"]);
  Eigen::MatrixXcd G;
  const double response =
      best_of(15, [&] { G = classical::frequency_response(plant).value().sample(w).value(); });
  const DiscreteSystem<> small{matrix(problem["Ad"]), matrix(problem["Bd"]), matrix(problem["Cd"]),
                               matrix(problem["Dd"]), Time(0.01)};
  const Eigen::VectorXd u = vector(problem["u"]);
  MatrixXd y;
  const double simulation = best_of(
      15, [&] { y = forced_response(small, u, Eigen::VectorXd::Zero(small.A.rows())).value().y; });
  nlohmann::json answer{{"response_ms", response}, {"simulation_ms", simulation}};
  std::vector<double> real;
  std::vector<double> imaginary;
  for (Index k = 0; k < G.cols(); k += 997) {
    for (const std::complex<double> entry : G.col(k)) {
      real.push_back(entry.real());
      imaginary.push_back(entry.imag());
    }
  }
  answer["real"] = real;
  answer["imag"] = imaginary;
  answer["y_end"] = y(y.rows() - 1, 0);
  std::cout << answer << "\n";
}
