#include <cmath>

#include "core/try.hpp"
#include "solve/sensitivity.hpp"

namespace flyball::solve {

Eigen::MatrixXd in_its_last_digits(const Eigen::MatrixXd& M, int draw) {
  Eigen::MatrixXd moved = M;
  for (Eigen::Index k = 0; k < M.size(); ++k) {
    if (M(k) != 0.0) {
      const bool up = (k * (draw == 0 ? 1 : 3) + k / 5 + draw) % 2 == 0;
      const double next = std::nextafter(M(k), up ? HUGE_VAL : -HUGE_VAL);
      moved(k) = std::isfinite(next) ? next : M(k);
    }
  }
  return moved;
}

double relative_difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const double largest = a.size() == 0 ? 0.0 : a.cwiseAbs().maxCoeff();
  const double change = a.size() == 0 ? 0.0 : (a - b).cwiseAbs().maxCoeff();
  return largest > 0.0 ? change / largest : change;
}

bool loses_by_squares(const Eigen::MatrixXd& exponent) {
  constexpr Eigen::Index most_states_in_twice = 20;
  constexpr double reach = 64.0;
  return exponent.rows() > most_states_in_twice &&
         exponent.cwiseAbs().colwise().sum().maxCoeff() > reach;
}

Expected<double> check_determined(double error) {
  constexpr double largest = 1e-4;
  if (!(error <= largest)) {
    return refusal(SolveError::not_determined, "solve")
        .hint("its entries cancel, or it turns or decays too often in the time that is asked for")
        .with("relative change by the last digits of the data", error);
  }
  return error;
}

}  // namespace flyball::solve
