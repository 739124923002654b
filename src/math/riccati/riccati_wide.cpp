#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "math/dense/dense.hpp"
#include "math/extended/extended_eigenvalues.hpp"
#include "math/extended/wide_matrix.hpp"
#include "math/riccati/riccati_iteration.hpp"

namespace flyball::detail {

namespace {

/// The problem in other units: no entry is lost.
Equation<WideMatrix> equation_in(const RiccatiProblem& p, const RiccatiUnits& units) {
  const Eigen::VectorXi& x = units.states;
  const Eigen::VectorXi& u = units.inputs;
  return {WideMatrix(p.A).times_powers(-x, x, -units.rate),
          WideMatrix(p.B).times_powers(-x, u, 0),
          WideMatrix(p.Q).times_powers(x, x, -units.weight - units.rate),
          WideMatrix(p.R).times_powers(u, u, -units.weight + units.rate),
          WideMatrix(p.N).times_powers(x, u, -units.weight),
          p.continuous};
}

WideMatrix value_in(const RiccatiUnits& units, const WideMatrix& X) {
  return X.times_powers(units.states, units.states, -units.weight);
}

WideMatrix gain_in(const RiccatiUnits& units, const WideMatrix& K) {
  return K.times_powers(-units.inputs, units.states, -units.rate);
}

}  // namespace

double wide_riccati_residual(const RiccatiProblem& given, const RiccatiUnits& units,
                             const RiccatiSolution& solution) {
  const Equation<WideMatrix> e = equation_in(given, units);
  const WideMatrix X = value_in(units, WideMatrix(solution.X));
  const WideMatrix K = gain_in(units, WideMatrix(solution.K));
  const WideMatrix X_size = X.magnitudes();
  const WideMatrix K_size = K.magnitudes();
  const WideMatrix Bt = e.B.transpose();
  const WideMatrix Kt = K.transpose();
  const WideMatrix S = add_product(e.A, -1.0, e.B, K);
  const WideMatrix S_size = S.magnitudes();
  const WideMatrix XS = product(X, S);
  const WideMatrix XS_size = product(X_size, S_size);
  const WideMatrix RK = product(e.R, K);
  const WideMatrix RK_size = product(e.R.magnitudes(), K_size);
  const WideMatrix NK = product(e.N, K);
  const WideMatrix NK_size = product(e.N.magnitudes(), K_size);
  // With Z = [I; -K]: SᵀXS - X or SᵀX + XS, and ZᵀWZ; RK - Nᵀ - BᵀXS, or RK - Nᵀ - BᵀX.
  WideMatrix left = sum(sum(add_product(e.Q, 1.0, Kt, RK), -1.0, NK), -1.0, NK.transpose());
  WideMatrix terms = add_product(e.Q.magnitudes(), 1.0, K_size.transpose(), RK_size);
  terms = sum(sum(std::move(terms), 1.0, NK_size), 1.0, NK_size.transpose());
  WideMatrix gain = sum(RK, -1.0, e.N.transpose());
  WideMatrix gain_terms = sum(RK_size, 1.0, e.N.magnitudes().transpose());
  if (e.continuous) {
    left = sum(sum(std::move(left), 1.0, XS), 1.0, XS.transpose());
    terms = sum(sum(std::move(terms), 1.0, XS_size), 1.0, XS_size.transpose());
    gain = add_product(std::move(gain), -1.0, Bt, X);
    gain_terms = add_product(std::move(gain_terms), 1.0, Bt.magnitudes(), X_size);
  } else {
    left = sum(add_product(std::move(left), 1.0, S.transpose(), XS), -1.0, X);
    terms = sum(add_product(std::move(terms), 1.0, S_size.transpose(), XS_size), 1.0, X_size);
    gain = add_product(std::move(gain), -1.0, Bt, XS);
    const WideMatrix S_terms = add_product(e.A.magnitudes(), 1.0, e.B.magnitudes(), K_size);
    gain_terms = add_product(std::move(gain_terms), 1.0, Bt.magnitudes(), product(X_size, S_terms));
  }
  // A K whose entries have no double is rounded to them, and be it to nothing.
  constexpr double least = std::numeric_limits<double>::denorm_min() / small_residual;
  WideMatrix weight = e.R.magnitudes();
  if (!e.continuous) {
    weight =
        add_product(std::move(weight), 1.0, product(Bt.magnitudes(), X_size), e.B.magnitudes());
  }
  gain_terms =
      add_product(std::move(gain_terms), 1.0, weight,
                  gain_in(units, WideMatrix(MatrixXd::Constant(K.rows(), K.cols(), least))));
  double worst = share_of(left, terms);
  // Input by input: each has a unit of its own.
  const WideMatrix inputs = gain.transpose();
  const WideMatrix input_terms = gain_terms.transpose();
  for (Index i = 0; i < inputs.cols() && !std::isnan(worst); ++i) {
    const double share = share_of(inputs.columns_from(i, 1), input_terms.columns_from(i, 1));
    worst = share <= worst ? worst : share;
  }
  return worst;
}

Eigen::VectorXcd wide_riccati_poles(const RiccatiProblem& given, const RiccatiUnits& units,
                                    const MatrixXd& K) {
  const Equation<WideMatrix> e = equation_in(given, units);
  return wide_eigenvalues_of(add_product(e.A, -1.0, e.B, gain_in(units, WideMatrix(K))),
                             units.rate);
}

std::optional<RiccatiSolution> solve_riccati_wide(const RiccatiProblem& given,
                                                  const RiccatiUnits& units) {
  constexpr Index most_states = 20;
  if (given.A.rows() > most_states) {
    return std::nullopt;
  }
  Progress progress{.work = given.work};
  const auto found = solve_with(equation_in(given, units), std::span(shifts).first(2),
                                std::span(cayley_parameters).first(1), progress);
  if (!found) {
    return std::nullopt;
  }
  const Eigen::VectorXi& x = units.states;
  RiccatiSolution solution;
  solution.X = found->X.times_powers(-x, -x, units.weight).rounded();
  solution.K = found->K.times_powers(units.inputs, -x, units.rate).rounded();
  const double size = found->X.norm();
  solution.condition =
      size > 0.0 ? found->rounded.gain * found->rounded.scale / size : found->rounded.gain;
  solution.iterations = found->rounded.iterations;
  return solution;
}

}  // namespace flyball::detail
