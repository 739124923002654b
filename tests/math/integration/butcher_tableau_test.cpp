#include <flyball/math/integration/butcher_tableau.hpp>

#include <algorithm>
#include <cmath>

namespace flyball::butcher_tableau_test {
namespace {

using Complex = std::complex<double>;

template <class Check>
void for_each_tableau(Check&& check) {
  check("forward_euler", tableaus::forward_euler);
  check("midpoint", tableaus::midpoint);
  check("heun", tableaus::heun);
  check("ralston", tableaus::ralston);
  check("bogacki_shampine", tableaus::bogacki_shampine);
  check("rk4", tableaus::rk4);
  check("three_eighths", tableaus::three_eighths);
  check("dormand_prince", tableaus::dormand_prince);
  check("backward_euler", tableaus::backward_euler);
  check("trapezoidal", tableaus::trapezoidal);
  check("gauss_legendre_2", tableaus::gauss_legendre_2);
  check("gauss_legendre_4", tableaus::gauss_legendre_4);
  check("gauss_legendre_6", tableaus::gauss_legendre_6);
  check("radau_iia_3", tableaus::radau_iia_3);
  check("radau_iia_5", tableaus::radau_iia_5);
  check("sdirk_2", tableaus::sdirk_2);
}

void expect_order(const char* name, const ButcherTableauView& tableau, int order) {
  for (int p = 1; p <= order; ++p) {
    EXPECT_LT(order_condition_residual(tableau, p), 1e-15) << name << ", order " << p;
  }
  // Not more than it says: the next order's conditions are missed by far.
  EXPECT_GT(order_condition_residual(tableau, order + 1), 1e-5) << name;
}

TEST(ButcherTableau, HasTheOrderThatItSays) {
  for_each_tableau([](const char* name, const auto& tableau) {
    expect_order(name, tableau, tableau.order);
    if (tableau.embedded_order > 0) {
      SCOPED_TRACE("embedded");
      expect_order(name, ButcherTableauView::embedded(tableau), tableau.embedded_order);
    }
  });
}

TEST(ButcherTableau, NodesAreTheRowSums) {
  for_each_tableau([](const char* name, const auto& tableau) {
    for (std::size_t i = 0; i < tableau.stages; ++i) {
      double sum = 0.0;
      for (const double a : tableau.A[i]) {
        sum += a;
      }
      EXPECT_NEAR(sum, tableau.c[i], 3e-15) << name << " " << i;
    }
  });
}

// R(z) = e^z + O(z^(p+1)).
TEST(ButcherTableau, StabilityFunctionIsTheExponentialToItsOrder) {
  for_each_tableau([](const char* name, const auto& tableau) {
    const Complex z = std::polar(0.05, 0.7);
    const double coarse = std::abs(stability_function(tableau, z) - std::exp(z));
    const double fine = std::abs(stability_function(tableau, z / 2.0) - std::exp(z / 2.0));
    if (coarse > 1e-13) {
      EXPECT_NEAR(std::log2(coarse / fine), tableau.order + 1, 0.1) << name;
    } else {
      EXPECT_EQ(tableau.order, 6) << name;
    }
  });
}

// Closed forms: the explicit ones with p stages are Taylor polynomials; the implicit ones are Padé
// approximants: (0,1), (1,1), (1,1), (2,2), (3,3), (1,2), (2,3).
TEST(ButcherTableau, StabilityFunctionsInClosedForm) {
  for (const Complex z : {Complex(-0.3, 0.4), Complex(-7.0, 2.0), Complex(1.5, -3.0)}) {
    const auto near = [&](const ButcherTableauView& tableau, Complex expected) {
      EXPECT_LT(std::abs(stability_function(tableau, z) - expected), 1e-13 * std::abs(expected))
          << z;
    };
    const Complex two = 1.0 + z + z * z / 2.0;
    const Complex four = two + z * z * z / 6.0 + z * z * z * z / 24.0;
    near(tableaus::forward_euler, 1.0 + z);
    near(tableaus::midpoint, two);
    near(tableaus::heun, two);
    near(tableaus::ralston, two);
    near(tableaus::bogacki_shampine, two + z * z * z / 6.0);
    near(tableaus::rk4, four);
    near(tableaus::three_eighths, four);
    near(tableaus::dormand_prince,
         four + std::pow(z, 5) / 120.0 + std::pow(z, 6) / 600.0);  // Hairer, Nørsett, Wanner, I
    near(tableaus::backward_euler, 1.0 / (1.0 - z));
    near(tableaus::trapezoidal, (1.0 + z / 2.0) / (1.0 - z / 2.0));
    near(tableaus::gauss_legendre_2, (1.0 + z / 2.0) / (1.0 - z / 2.0));
    near(tableaus::gauss_legendre_4,
         (1.0 + z / 2.0 + z * z / 12.0) / (1.0 - z / 2.0 + z * z / 12.0));
    near(tableaus::gauss_legendre_6, (1.0 + z / 2.0 + z * z / 10.0 + z * z * z / 120.0) /
                                         (1.0 - z / 2.0 + z * z / 10.0 - z * z * z / 120.0));
    near(tableaus::radau_iia_3, (1.0 + z / 3.0) / (1.0 - 2.0 * z / 3.0 + z * z / 6.0));
    near(tableaus::radau_iia_5, (1.0 + 2.0 * z / 5.0 + z * z / 20.0) /
                                    (1.0 - 3.0 * z / 5.0 + 3.0 * z * z / 20.0 - z * z * z / 60.0));
    const double gamma = 1.0 - std::sqrt(0.5);
    near(tableaus::sdirk_2,
         (1.0 + (1.0 - 2.0 * gamma) * z) / ((1.0 - gamma * z) * (1.0 - gamma * z)));
  }
}

TEST(ButcherTableau, ImplicitOnesAreStableInTheLeftHalfPlane) {
  for_each_tableau([](const char* name, const auto& tableau) {
    double worst = 0.0;
    for (double angle = 1.571; angle < 4.712; angle += 0.05) {
      for (const double radius : {0.01, 0.3, 1.0, 5.0, 40.0, 1e4}) {
        worst = std::max(worst, std::abs(stability_function(tableau, std::polar(radius, angle))));
      }
    }
    EXPECT_EQ(worst <= 1.0 + 1e-12, !tableau.is_explicit()) << name << " " << worst;
  });
  // L-stable: infinitely fast modes vanish.
  for (const ButcherTableauView& tableau :
       {ButcherTableauView(tableaus::backward_euler), ButcherTableauView(tableaus::radau_iia_3),
        ButcherTableauView(tableaus::radau_iia_5), ButcherTableauView(tableaus::sdirk_2)}) {
    EXPECT_LT(std::abs(stability_function(tableau, -1e9)), 1e-8);
  }
  EXPECT_TRUE(std::isinf(std::abs(stability_function(tableaus::backward_euler, 1.0))));
}

// 1, 1, 2, 4, 9, 20, 48, 115 rooted trees: a method of one stage with c = 1/2 and b = 1 has
// Φ = 2^(1-p) for each tree of p vertices; the largest 1/γ of order p is 1/p, of the bush.
TEST(ButcherTableau, ResidualOfAnAlteredTableau) {
  EXPECT_DOUBLE_EQ(order_condition_residual(tableaus::gauss_legendre_2, 3), 1.0 / 3.0 - 0.25);
  EXPECT_DOUBLE_EQ(order_condition_residual(tableaus::gauss_legendre_2, 8),
                   1.0 / 8.0 - std::pow(0.5, 7));
  auto altered = tableaus::dormand_prince;
  altered.A[4][2] += 1e-9;
  EXPECT_GT(order_condition_residual(altered, 4) + order_condition_residual(altered, 5), 1e-11);
}

}  // namespace
}  // namespace flyball::butcher_tableau_test
