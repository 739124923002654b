#include <algorithm>
#include <array>
#include <cmath>

#include "classical/filters/elliptic_functions.hpp"
#include "core/constants.hpp"

namespace flyball::classical::detail {

namespace {

/// The arithmetic-geometric mean of 1 and x.
double mean_with_one(double x) {
  double a = 1.0;
  double b = x;
  // Each step doubles the digits, once a and b are near each other; 1e-300 takes ten to be.
  for (int step = 0; step < 24 && std::abs(a - b) > 1e-15 * a; ++step) {
    const double next = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = next;
  }
  return 0.5 * (a + b);
}

/// R_F(x, y, z) = ½∫₀^∞ dt/√((t + x)(t + y)(t + z)) by duplication.
double carlson(double x, double y, double z) {
  // Differences of 4e-3 leave 1e-17: Carlson, Numerische Mathematik 33 (1979).
  constexpr double near = 1e-3;
  double mean = 0.0;
  double dx = 0.0;
  double dy = 0.0;
  for (int step = 0; step < 600; ++step) {
    mean = (x + y + z) / 3.0;
    dx = (mean - x) / mean;
    dy = (mean - y) / mean;
    const double dz = (mean - z) / mean;
    if (std::max({std::abs(dx), std::abs(dy), std::abs(dz)}) < near) {
      break;
    }
    const double root_x = std::sqrt(x);
    const double root_y = std::sqrt(y);
    const double root_z = std::sqrt(z);
    const double lambda = root_x * (root_y + root_z) + root_y * root_z;
    x = 0.25 * (x + lambda);
    y = 0.25 * (y + lambda);
    z = 0.25 * (z + lambda);
  }
  const double dz = -(dx + dy);
  const double second = dx * dy - dz * dz;
  const double third = dx * dy * dz;
  return (1.0 + (second / 24.0 - 0.1 - 3.0 * third / 44.0) * second + third / 14.0) /
         std::sqrt(mean);
}

}  // namespace

double complete_integral(const Modulus& m) {
  return pi / (2.0 * mean_with_one(m.complement));
}

double log_nome(const Modulus& m) {
  return -pi * mean_with_one(m.complement) / mean_with_one(m.k);
}

Modulus modulus_of(double log_nome) {
  if (log_nome > -pi) {  // ln q ln q' = π²
    return modulus_of(pi * pi / log_nome).complementary();
  }
  const double q = std::exp(log_nome);
  double theta_2 = 1.0;  // over 2 q^(1/4)
  double theta_3 = 1.0;
  double theta_4 = 1.0;
  double sign = -1.0;
  for (int n = 1; n <= 6; ++n) {
    theta_2 += std::pow(q, n * (n + 1));
    theta_3 += 2.0 * std::pow(q, n * n);
    theta_4 += sign * 2.0 * std::pow(q, n * n);
    sign = -sign;
  }
  const double k = theta_2 / theta_3;
  const double complement = theta_4 / theta_3;
  return {4.0 * std::exp(0.5 * log_nome) * k * k, complement * complement};
}

double incomplete_integral(double sine, double cosine, const Modulus& m) {
  // 1 - k² s² = c² + k'² s²
  const double c = cosine * cosine;
  const double far = m.complement * sine;
  return sine * carlson(c, c + far * far, 1.0);
}

JacobiFunctions jacobi(double fraction, double rest, const Modulus& m) {
  // k₁ = (1 - k')/(1 + k') = (k/(1 + k'))², whose complement is 2√k'/(1 + k').
  constexpr int most = 16;
  std::array<Modulus, most> moduli{};
  int levels = 0;
  moduli[0] = m;
  while (levels + 1 < most && moduli[static_cast<std::size_t>(levels)].k > 1e-9) {
    const Modulus& at = moduli[static_cast<std::size_t>(levels)];
    const double k = at.k / (1.0 + at.complement);
    ++levels;
    moduli[static_cast<std::size_t>(levels)] = {
        k * k, 2.0 * std::sqrt(at.complement) / (1.0 + at.complement)};
  }
  JacobiFunctions f{
      .sn = fraction <= rest ? std::sin(0.5 * pi * fraction) : std::cos(0.5 * pi * rest),
      .cn = fraction <= rest ? std::cos(0.5 * pi * fraction) : std::sin(0.5 * pi * rest)};
  for (int level = levels; level > 0; --level) {
    const double k = moduli[static_cast<std::size_t>(level)].k;
    const double complement = moduli[static_cast<std::size_t>(level - 1)].complement;
    const double below = 1.0 + k * f.sn * f.sn;
    // 1 - k₁ sn² = (1 - k₁) + k₁ cn², all of it positive.
    const double above = 2.0 * complement / (1.0 + complement) + k * f.cn * f.cn;
    f = {.sn = (1.0 + k) * f.sn / below, .cn = f.cn * f.dn / below, .dn = above / below};
  }
  return f;
}

}  // namespace flyball::classical::detail
