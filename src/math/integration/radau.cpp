#include <algorithm>
#include <cmath>
#include <limits>

#include <flyball/math/integration/butcher_tableau.hpp>

#include "core/try.hpp"
#include "math/integration/ode_steppers.hpp"

namespace flyball::detail {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int max_newton = 6;

// The inverse of Radau IIA's A has one real and two complex eigenvalues; with T they are made
// diagonal, so that the stages' system of order 3 n falls into one of n and a complex one of n
// (Hairer, Wanner, IV.8).
constexpr double mu = 3.6378342527444957322;
constexpr Complex mu_complex{2.6810828736277521339, -3.0504301992474105694};
constexpr double T[3][3] = {{0.09443876248897524, -0.14125529502095421, 0.03002919410514742},
                            {0.25021312296533332, 0.20412935229379994, -0.38294211275726192},
                            {1.0, 1.0, 0.0}};
constexpr double T_inverse[3][3] = {
    {4.17871859155190428, 0.32768282076106237, 0.52337644549944951},
    {-4.17871859155190428, -0.32768282076106237, 0.47662355450055044},
    {0.50287263494578682, -2.57192694985560522, 0.59603920482822492}};

/// M Zᵀ of 3x3 and n x 3, as n x 3.
MatrixXd combine(const double (&M)[3][3], const MatrixXd& Z) {
  MatrixXd result(Z.rows(), 3);
  for (Index i = 0; i < 3; ++i) {
    result.col(i) = M[i][0] * Z.col(0) + M[i][1] * Z.col(1) + M[i][2] * Z.col(2);
  }
  return result;
}

/// The polynomial of degree 3 through x and the three stages.
OdeSolution::Segment collocation(double t, double h, const VectorXd& x, const MatrixXd& Z) {
  constexpr double s = 2.4494897427831780982;  // √6
  constexpr double P[3][3] = {
      {13.0 / 3.0 + 7.0 * s / 3.0, -23.0 / 3.0 - 22.0 * s / 3.0, 10.0 / 3.0 + 5.0 * s},
      {13.0 / 3.0 - 7.0 * s / 3.0, -23.0 / 3.0 + 22.0 * s / 3.0, 10.0 / 3.0 - 5.0 * s},
      {1.0 / 3.0, -8.0 / 3.0, 10.0 / 3.0}};
  MatrixXd q(x.size(), 3);  // x + s q₀ + s² q₁ + s³ q₂
  for (Index i = 0; i < 3; ++i) {
    q.col(i) = Z.col(0) * P[0][i] + Z.col(1) * P[1][i] + Z.col(2) * P[2][i];
  }
  MatrixXd r = MatrixXd::Zero(x.size(), 5);
  r.col(0) = x;
  r.col(1) = Z.col(2);
  r.col(2) = -q.col(2) - q.col(1);
  r.col(3) = -q.col(2);
  return {t, h, std::move(r)};
}

}  // namespace

template <class Scalar>
LuFactors<Scalar>::LuFactors(Matrix M) : LU_(std::move(M)) {
  const Index n = LU_.rows();
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index i = k + 1; i < n; ++i) {
      if (std::abs(LU_(i, k)) > std::abs(LU_(pivot, k))) {
        pivot = i;
      }
    }
    rows_.push_back(pivot);
    if (pivot != k) {
      LU_.row(k).swap(LU_.row(pivot));
    }
    const Index below = n - k - 1;
    LU_.col(k).tail(below) /= LU_(k, k);
    for (Index j = k + 1; j < n; ++j) {
      LU_.col(j).tail(below) -= LU_(k, j) * LU_.col(k).tail(below);
    }
  }
}

template <class Scalar>
typename LuFactors<Scalar>::Vector LuFactors<Scalar>::solve(Vector b) const {
  const Index n = LU_.rows();
  for (Index k = 0; k < n; ++k) {
    std::swap(b(k), b(rows_[static_cast<std::size_t>(k)]));
  }
  for (Index k = 0; k < n; ++k) {
    b.tail(n - k - 1) -= b(k) * LU_.col(k).tail(n - k - 1);
  }
  for (Index k = n - 1; k >= 0; --k) {
    b(k) /= LU_(k, k);
    b.head(k) -= b(k) * LU_.col(k).head(k);
  }
  return b;
}

template class LuFactors<double>;
template class LuFactors<Complex>;

void RadauStepper::factorize(OdeProblem& problem, double h) {
  ++problem.statistics.factorizations;
  MatrixXd real = -*J_;
  real.diagonal().array() += mu / h;
  Eigen::MatrixXcd complex = -J_->cast<Complex>();
  complex.diagonal().array() += mu_complex / h;
  real_.emplace(std::move(real));
  complex_.emplace(std::move(complex));
  factored_step_ = h;
}

RadauStepper::Newton RadauStepper::solve_stages(OdeProblem& problem, const OdeState& state,
                                                double h, const MatrixXd& guess) const {
  const auto& c = tableaus::radau_iia_5.c;
  const Index n = state.x.size();
  const double tolerance =
      std::max(10.0 * std::numeric_limits<double>::epsilon() / problem.relative_tolerance,
               std::min(0.03, std::sqrt(problem.relative_tolerance)));
  Newton newton;
  newton.Z = guess;
  MatrixXd W = combine(T_inverse, guess);
  double previous = 0.0;
  for (; newton.iterations < max_newton; ++newton.iterations) {
    MatrixXd F(n, 3);
    for (Index i = 0; i < 3; ++i) {
      F.col(i) = problem.derivative(state.t + c[static_cast<std::size_t>(i)] * h,
                                    state.x + newton.Z.col(i));
    }
    if (!F.allFinite()) {
      newton.rate = std::numeric_limits<double>::quiet_NaN();
      return newton;
    }
    const MatrixXd G = combine(T_inverse, F);
    const VectorXd real = real_->solve(G.col(0) - (mu / h) * W.col(0));
    Eigen::VectorXcd right(n);
    for (Index i = 0; i < n; ++i) {
      right(i) = Complex(G(i, 1), G(i, 2)) - mu_complex / h * Complex(W(i, 1), W(i, 2));
    }
    const Eigen::VectorXcd complex = complex_->solve(std::move(right));
    MatrixXd dW(n, 3);
    dW << real, complex.real(), complex.imag();

    double sum = 0.0;
    for (Index i = 0; i < 3; ++i) {
      const double part = problem.norm(dW.col(i), state.x, state.x);
      sum += part * part;
    }
    const double size = std::sqrt(sum / 3.0);
    if (!std::isfinite(size)) {
      newton.rate = size;
      return newton;
    }
    if (previous > 0.0) {
      newton.rate = size / previous;
      if (newton.rate >= 1.0 ||
          std::pow(newton.rate, max_newton - newton.iterations) / (1.0 - newton.rate) * size >
              tolerance) {
        return newton;
      }
    }
    W += dW;
    newton.Z = combine(T, W);
    if (size == 0.0 || (previous > 0.0 && newton.rate / (1.0 - newton.rate) * size < tolerance)) {
      newton.converged = true;
      ++newton.iterations;
      return newton;
    }
    previous = size;
  }
  return newton;
}

RadauStepper::Newton RadauStepper::converge(OdeProblem& problem, const OdeState& state, double h) {
  MatrixXd guess = MatrixXd::Zero(state.x.size(), 3);
  if (previous_step_ > 0.0) {
    // Where the last step's polynomial goes on to.
    for (Index i = 0; i < 3; ++i) {
      const double c = tableaus::radau_iia_5.c[static_cast<std::size_t>(i)];
      guess.col(i) = state.segment.at(1.0 + c * h / state.segment.h) - state.x;
    }
  }
  while (true) {
    if (factored_step_ != h) {
      factorize(problem, h);
    }
    Newton newton = solve_stages(problem, state, h, guess);
    if (newton.converged || J_is_current_) {
      return newton;
    }
    J_ = problem.jacobian_at(state.t, state.x, state.f);
    J_is_current_ = true;
    factored_step_ = 0.0;
  }
}

/// By how much the step may grow for the next error to be 1 (Gustafsson's predictive control).
double RadauStepper::growth(double step, double error) const {
  if (error == 0.0) {
    return 10.0;
  }
  double multiplier = 1.0;
  if (previous_step_ > 0.0 && previous_error_ > 0.0) {
    multiplier = step / previous_step_ * std::pow(previous_error_ / error, 0.25);
  }
  return std::min(1.0, multiplier) * std::pow(error, -0.25);
}

Expected<void> RadauStepper::step(OdeProblem& problem, OdeState& state) {
  if (!J_) {
    J_ = problem.jacobian_at(state.t, state.x, state.f);
    J_is_current_ = true;
  }
  bool rejected = false;
  bool was_not_finite = !J_->allFinite();
  while (true) {
    FLYBALL_TRY(const double t_next, next_time(problem, state, was_not_finite));
    const double h = t_next - state.t;
    const double length = std::abs(h);

    const Newton newton = converge(problem, state, h);
    if (!newton.converged) {
      ++problem.statistics.rejected;
      was_not_finite = !std::isfinite(newton.rate);
      state.step = 0.5 * length;
      continue;
    }
    const VectorXd next = state.x + newton.Z.col(2);
    constexpr double s = 2.4494897427831780982;  // √6
    const VectorXd combined =
        (newton.Z.col(0) * ((-13.0 - 7.0 * s) / 3.0) + newton.Z.col(1) * ((-13.0 + 7.0 * s) / 3.0) -
         newton.Z.col(2) / 3.0) /
        h;
    VectorXd difference = real_->solve(state.f + combined);
    double error = problem.norm(difference, state.x, next);
    if (rejected && error > 1.0) {
      // The filtered estimate, which does not overrate a stiff part (IV.8.20).
      difference = real_->solve(problem.derivative(state.t, state.x + difference) + combined);
      error = problem.norm(difference, state.x, next);
    }
    const VectorXd f_next = problem.derivative(t_next, next);
    was_not_finite = !std::isfinite(error) || !next.allFinite() || !f_next.allFinite();
    const double safety = 0.9 * (2.0 * max_newton + 1.0) / (2.0 * max_newton + newton.iterations);
    if (was_not_finite || error > 1.0) {
      ++problem.statistics.rejected;
      rejected = true;
      state.step = length * (was_not_finite ? 0.25 : std::max(0.2, safety * growth(length, error)));
      continue;
    }

    const bool slow = newton.iterations > 2 && newton.rate > 1e-3;
    double factor = std::min(10.0, safety * growth(length, error));
    if (!slow && factor < 1.2 && factor > 0.8) {
      factor = 1.0;  // and the factors of this step serve the next
    }
    state.segment = collocation(state.t, h, state.x, newton.Z);
    state.t = t_next;
    state.x = next;
    state.f = f_next;
    state.step = std::min(length * factor, problem.max_step);
    J_is_current_ = false;
    if (slow) {
      J_ = problem.jacobian_at(state.t, state.x, state.f);
      J_is_current_ = true;
      factored_step_ = 0.0;
    }
    previous_step_ = length;
    previous_error_ = error;
    ++problem.statistics.steps;
    return {};
  }
}

}  // namespace flyball::detail
