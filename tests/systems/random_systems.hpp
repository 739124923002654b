#pragma once

#include <cmath>

#include <Eigen/Dense>

#include <flyball/core/random.hpp>
#include <flyball/systems/system.hpp>

namespace flyball::test {

inline Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

inline Eigen::MatrixXd random_rotation(Random& random, Eigen::Index n) {
  return random_matrix(random, n, n).householderQr().householderQ();
}

/// Powers of ten between 10^-decades and 10^decades.
inline Eigen::VectorXd random_scales(Random& random, Eigen::Index n, double decades) {
  return Eigen::VectorXd::NullaryExpr(
      n, [&] { return std::pow(10.0, random.uniform(-decades, decades)); });
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
  const double abscissa = system.A.eigenvalues().real().maxCoeff();
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
  Eigen::MatrixXcd shifted = -system.A.template cast<std::complex<double>>();
  shifted.diagonal().array() += s;
  return system.C.template cast<std::complex<double>>() *
             shifted.partialPivLu().solve(system.B.template cast<std::complex<double>>()) +
         system.D.template cast<std::complex<double>>();
}

}  // namespace flyball::test
