#include <flyball/estimation/observer.hpp>

#include <flyball/estimation/observer.tpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

template <class System>
Expected<System> observer_of(System plant, const MatrixRef& L) {
  constexpr std::string_view where = "observer_system";
  FLYBALL_CHECK(check_system(plant, where));
  const Eigen::Index n = plant.A.rows();
  const Eigen::Index m = plant.B.cols();
  const Eigen::Index p = plant.C.rows();
  FLYBALL_CHECK(Checks(where).shape(L, n, p, "L", "states x outputs").finite(L, "L"));
  System observer = plant;
  observer.A = plant.A - detail::product(L, plant.C);
  observer.B.resize(n, m + p);
  observer.B << plant.B - detail::product(L, plant.D), L;
  observer.C.setIdentity(n, n);
  observer.D.setZero(n, m + p);
  return observer;
}

}  // namespace

Expected<ContinuousSystem<>> observer_system(const ContinuousSystem<>& plant, const MatrixRef& L) {
  return observer_of(plant, L);
}

Expected<DiscreteSystem<>> observer_system(const DiscreteSystem<>& plant, const MatrixRef& L) {
  return observer_of(plant, L);
}

Expected<Eigen::MatrixXd> filter_gain(const MatrixRef& A, const MatrixRef& L) {
  constexpr std::string_view where = "filter_gain";
  constexpr double no_inverse = 1e-12;
  FLYBALL_CHECK(Checks(where)
                    .square(A, "A")
                    .finite(A, "A")
                    .shape(L, A.rows(), L.cols(), "L", "states x outputs")
                    .finite(L, "L"));
  // Balanced, so that units do not count: diag(d)⁻¹ A diag(d).
  const Eigen::VectorXd d = detail::balance_of(A);
  const Eigen::MatrixXd balanced = d.cwiseInverse().asDiagonal() * A * d.asDiagonal();
  double rcond = 0.0;
  Eigen::MatrixXd K =
      d.asDiagonal() * detail::solve_linear(balanced, d.cwiseInverse().asDiagonal() * L, &rcond);
  if (!(rcond > no_inverse) || !K.allFinite()) {
    return refusal(ArgumentError::out_of_range, where, "A")
        .got("without an inverse")
        .expected("invertible, as of a sampled plant without dead time")
        .hint("use the observer in one step, which takes L")
        .with("reciprocal condition", rcond);
  }
  return K;
}

#define FLYBALL_STATES_INPUTS_OUTPUTS(States, Inputs, Outputs) \
  template class Observer<States, Inputs, Outputs>;            \
  template class LuenbergerObserver<States, Inputs, Outputs>;
#include <flyball/core/instantiated_sizes.inc>

}  // namespace flyball
