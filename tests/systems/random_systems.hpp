#pragma once

#include <complex>

#include <Eigen/Dense>

#include <flyball/systems/system.hpp>

#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::test {

inline ContinuousSystem<> continuous(const RandomSystem& s) {
  return {s.A, s.B, s.C, s.D};
}
inline DiscreteSystem<> discrete(const RandomSystem& s, double period = 0.02) {
  return {s.A, s.B, s.C, s.D, Time(period)};
}

inline ContinuousSystem<> random_system(Random& random, Eigen::Index n, Eigen::Index m,
                                        Eigen::Index p) {
  return {random_matrix(random, n, n), random_matrix(random, n, m), random_matrix(random, p, n),
          random_matrix(random, p, m)};
}

/// The same, with the spectral abscissa at -margin.
inline ContinuousSystem<> random_stable_system(Random& random, Eigen::Index n, Eigen::Index m,
                                               Eigen::Index p, double margin = 0.1) {
  ContinuousSystem<> system = random_system(random, n, m, p);
  const double abscissa = test::eigenvalues(system.A).real().maxCoeff();
  system.A.diagonal().array() -= abscissa + margin;
  return system;
}

/// diag(d)⁻¹ A diag(d), diag(d)⁻¹ B, C diag(d).
inline ContinuousSystem<> rescaled(const ContinuousSystem<>& s, const Eigen::VectorXd& d) {
  return {d.cwiseInverse().asDiagonal() * s.A * d.asDiagonal(), d.cwiseInverse().asDiagonal() * s.B,
          s.C * d.asDiagonal(), s.D};
}

/// C (s I - A)⁻¹ B + D.
template <class System>
Eigen::MatrixXcd response(const System& system, std::complex<double> s) {
  return response(system.A, system.B, system.C, system.D, s);
}

}  // namespace flyball::test
