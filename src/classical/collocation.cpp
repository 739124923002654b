#include <cmath>

#include "classical/collocation.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd legendre(int count, double x) {
  VectorXd P(count);
  P(0) = 1.0;
  if (count > 1) {
    P(1) = x;
  }
  for (Index k = 1; k + 1 < count; ++k) {
    const auto n = static_cast<double>(k);
    P(k + 1) = ((2.0 * n + 1.0) * x * P(k) - n * P(k - 1)) / (n + 1.0);
  }
  return P;
}

double legendre_sum(const Eigen::Ref<const VectorXd>& modes, double x) {
  // b_k = c_k + (2k + 1)/(k + 1) x b_{k+1} - (k + 1)/(k + 2) b_{k+2}
  double next = 0.0;
  double after = 0.0;
  for (Index k = modes.size() - 1; k >= 0; --k) {
    const auto n = static_cast<double>(k);
    const double now =
        modes(k) + (2.0 * n + 1.0) / (n + 1.0) * x * next - (n + 1.0) / (n + 2.0) * after;
    after = next;
    next = now;
  }
  return next;
}

VectorXd legendre_derivative(const VectorXd& modes) {
  // P'_{k+1} = P'_{k-1} + (2k + 1) P_k
  VectorXd slopes = VectorXd::Zero(modes.size());
  for (Index k = modes.size() - 1; k > 0; --k) {
    const double above =
        k + 1 < modes.size() ? slopes(k + 1) / static_cast<double>(2 * k + 3) : 0.0;
    slopes(k - 1) = static_cast<double>(2 * k - 1) * (modes(k) + above);
  }
  return slopes;
}

Collocation radau_collocation(int points) {
  const Index p = points;
  // The zeros of P_p - P_{p-1}, of which 1 is one, between the signs of a fine grid.
  const auto f = [&](double x) {
    const VectorXd P = legendre(points + 1, x);
    return P(p) - P(p - 1);
  };
  Collocation c;
  c.nodes.resize(p);
  Index found = 0;
  const int cells = 64 * points;
  const auto place = [&](int i) {
    return -std::cos(3.14159265358979323846 * static_cast<double>(i) / cells);
  };
  for (int i = 0; i < cells && found + 1 < p; ++i) {
    double a = place(i);
    double b = place(i + 1);
    const double at_a = f(a);
    if ((at_a < 0.0) == (f(b) < 0.0)) {
      continue;
    }
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = 0.5 * (a + b);
      ((f(middle) < 0.0) == (at_a < 0.0) ? a : b) = middle;
    }
    c.nodes(found++) = 0.5 * (a + b);
  }
  c.nodes(p - 1) = 1.0;
  // ℓ_j = Σ (k + 1/2) w_j P_k(x_j) P_k, by the quadrature that is exact up to degree 2p - 2.
  c.modes.resize(p, p);
  MatrixXd integrals(p, p);  // of P_k up to node i
  for (Index j = 0; j < p; ++j) {
    const double x = c.nodes(j);
    const VectorXd P = legendre(points + 1, x);
    const double last = P(p - 1);
    const double weight = (1.0 + x) / (static_cast<double>(p * p) * last * last);
    for (Index k = 0; k < p; ++k) {
      c.modes(k, j) = (static_cast<double>(k) + 0.5) * weight * P(k);
      integrals(j, k) =
          k == 0 ? 1.0 + x : (P(k + 1) - P(k - 1)) / (2.0 * static_cast<double>(k) + 1.0);
    }
  }
  c.integrals = flyball::detail::product(integrals, c.modes);
  return c;
}

}  // namespace flyball::classical::detail
