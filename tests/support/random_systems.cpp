#include <cmath>

#include <Eigen/Dense>

#include "math/matrices_json.hpp"
#include "support/oracle.hpp"
#include "support/random_systems.hpp"

namespace flyball::test {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd scalar(double value) {
  return MatrixXd::Constant(1, 1, value);
}

MatrixXd random_matrix(Random& random, Index rows, Index columns) {
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

MatrixXd random_rotation(Random& random, Index n) {
  return random_matrix(random, n, n).householderQr().householderQ();
}

VectorXd random_scales(Random& random, Index n, double decades) {
  return VectorXd::NullaryExpr(n,
                               [&] { return std::pow(10.0, random.uniform(-decades, decades)); });
}

VectorXd random_units(Random& random, Index n, double decades) {
  return random_scales(random, n, decades).unaryExpr([](double x) {
    return std::exp2(std::round(std::log2(x)));
  });
}

const char* to_string(SystemClass kind) {
  constexpr const char* names[] = {"stable", "unstable", "badly scaled", "nearly uncontrollable",
                                   "reference"};
  return names[static_cast<std::size_t>(kind)];
}

RandomSystem rescaled(const RandomSystem& s, const VectorXd& states, const VectorXd& inputs,
                      const VectorXd& outputs) {
  RandomSystem r = s;
  const auto x = states.asDiagonal();
  const auto u = inputs.asDiagonal();
  const VectorXd x_inverse = states.cwiseInverse();
  const VectorXd y_inverse = outputs.cwiseInverse();
  r.A = x_inverse.asDiagonal() * s.A * x;
  r.B = x_inverse.asDiagonal() * s.B * u;
  r.C = y_inverse.asDiagonal() * s.C * x;
  r.D = y_inverse.asDiagonal() * s.D * u;
  r.Q = x * s.Q * x;
  r.R = u * s.R * u;
  r.N = x * s.N * u;
  r.states = s.states.cwiseProduct(states);
  r.inputs = s.inputs.cwiseProduct(inputs);
  r.outputs = s.outputs.cwiseProduct(outputs);
  return r;
}

RandomSystem turned(const RandomSystem& s, const MatrixXd& U) {
  RandomSystem r = s;
  r.A = U.transpose() * s.A * U;
  r.B = U.transpose() * s.B;
  r.C = s.C * U;
  const MatrixXd Q = U.transpose() * s.Q * U;
  r.Q = 0.5 * (Q + Q.transpose());
  r.N = U.transpose() * s.N;
  return r;
}

RandomSystem plain(const RandomSystem& s) {
  return rescaled(s, s.states.cwiseInverse(), s.inputs.cwiseInverse(), s.outputs.cwiseInverse());
}

RandomSystems::RandomSystems(std::uint64_t seed, Plane plane, Index most_states)
    : random_(seed), plane_(plane), most_states_(most_states) {
  for (const auto& c : cases_of(plane == Plane::s ? "riccati_care.json" : "riccati_dare.json")) {
    RandomSystem s;
    s.kind = SystemClass::reference;
    s.A = matrix_from(c.at("A"));
    if (c.at("expect") != "stabilizing" || s.A.rows() > most_states) {
      continue;
    }
    s.name = c.at("name");
    s.B = matrix_from(c.at("B"));
    s.Q = matrix_from(c.at("Q"));
    s.R = matrix_from(c.at("R"));
    s.N = c.contains("N") ? matrix_from(c.at("N")) : MatrixXd::Zero(s.B.rows(), s.B.cols());
    references_.push_back(s);
  }
}

RandomSystem RandomSystems::next() {
  return next(all_classes[count_++ % std::size(all_classes)]);
}

RandomSystem RandomSystems::next(SystemClass kind) {
  RandomSystem s;
  switch (kind) {
    case SystemClass::stable:
    case SystemClass::unstable:
      s = well_scaled(kind == SystemClass::stable);
      break;
    case SystemClass::badly_scaled:
      s = well_scaled(random_.bits() % 2 == 0);
      break;
    case SystemClass::nearly_uncontrollable:
      s = weakly_coupled();
      break;
    case SystemClass::reference:
      s = reference();
      break;
  }
  s.kind = kind;
  if (kind == SystemClass::badly_scaled || kind == SystemClass::reference) {
    const VectorXd states = random_units(random_, s.A.rows(), 8.0);
    const VectorXd inputs = random_units(random_, s.B.cols(), 8.0);
    s = rescaled(s, states, inputs, random_units(random_, s.C.rows(), 8.0));
  }
  return s;
}

RandomSystem RandomSystems::next_stable() {
  RandomSystem s = next();
  if (s.kind != SystemClass::stable) {
    RandomSystem well = plain(s);
    move_poles(well.A, true);
    s = rescaled(well, s.states, s.inputs, s.outputs);
  }
  return s;
}

/// The spectral abscissa or radius to a place drawn on the side that is asked for.
void RandomSystems::move_poles(MatrixXd& A, bool stable) {
  const Eigen::VectorXcd poles = test::eigenvalues(A);
  if (plane_ == Plane::s) {
    const double margin = std::pow(10.0, random_.uniform(-3.0, 0.0)) * A.norm();
    A.diagonal().array() -= poles.real().maxCoeff() + (stable ? margin : -margin);
  } else {
    const double radius = poles.cwiseAbs().maxCoeff();
    const double wanted =
        stable ? 1.0 - std::pow(10.0, random_.uniform(-3.0, -0.1)) : random_.uniform(1.01, 2.0);
    // Of a matrix that is nilpotent but for rounding the norm, so that it is not blown up.
    if (A.norm() > 0.0) {
      A *= wanted / (radius > 1e-3 * A.norm() ? radius : A.norm());
    }
  }
}

/// A joint weight [Q N; Nᵀ R] = CᵀC; every other one without N.
void RandomSystems::add_cost(RandomSystem& s) {
  const Index n = s.A.rows();
  const Index m = s.B.cols();
  const MatrixXd root = random_matrix(random_, n + m, n + m);
  const MatrixXd W = root.transpose() * root;
  s.Q = W.topLeftCorner(n, n);
  s.R = W.bottomRightCorner(m, m);
  s.N = random_.bits() % 2 == 0 ? MatrixXd(W.topRightCorner(n, m)) : MatrixXd::Zero(n, m);
}

RandomSystem RandomSystems::well_scaled(bool stable) {
  const auto up_to = [&](Index most) {
    return 1 + static_cast<Index>(random_.bits() % static_cast<std::uint64_t>(most));
  };
  const Index n = up_to(most_states_);
  const Index m = up_to(n);
  const Index p = up_to(n);
  RandomSystem s;
  s.A = random_matrix(random_, n, n);
  s.B = random_matrix(random_, n, m);
  s.C = random_matrix(random_, p, n);
  s.D = random_matrix(random_, p, m);
  move_poles(s.A, stable);
  s.states.setOnes(n);
  s.inputs.setOnes(m);
  s.outputs.setOnes(p);
  add_cost(s);
  return s;
}

/// [A₁ A₁₂; ε A₂₁ A₂], [B₁; ε B₂], turned.
RandomSystem RandomSystems::weakly_coupled() {
  RandomSystem s;
  do {
    s = well_scaled(random_.bits() % 2 == 0);
  } while (s.A.rows() < 2);
  const Index n = s.A.rows();
  s.weak_modes = n > 2 ? 1 + static_cast<Index>(random_.bits() % 2) : 1;
  s.coupling = std::pow(10.0, random_.uniform(-7.0, -2.0));
  s.A.bottomLeftCorner(s.weak_modes, n - s.weak_modes) *= s.coupling;
  s.B.bottomRows(s.weak_modes) *= s.coupling;
  return turned(s, random_rotation(random_, n));
}

RandomSystem RandomSystems::reference() {
  RandomSystem s = references_[random_.bits() % references_.size()];
  const Index n = s.A.rows();
  s.C = random_matrix(random_, 1, n);
  s.D = random_matrix(random_, 1, s.B.cols());
  s.states.setOnes(n);
  s.inputs.setOnes(s.B.cols());
  s.outputs.setOnes(1);
  return random_.bits() % 2 == 0 ? turned(s, random_rotation(random_, n)) : s;
}

}  // namespace flyball::test
