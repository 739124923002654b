#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>

/// Runge-Kutta methods as data (section 7.9.1): the step from x at t to t + h is
///
///   k_i = f(t + c_i h, x + h Σ_j a_ij k_j),   x⁺ = x + h Σ_i b_i k_i.
///
/// A method is explicit where a_ij = 0 for j >= i. A second row of weights, b_hat, of another order
/// estimates the error of the step: h Σ (b_i - b_hat_i) k_i.
namespace flyball {

/// The coefficients of a Runge-Kutta method with a number of stages known at compile time.
template <std::size_t Stages>
struct ButcherTableau {
  static constexpr std::size_t stages = Stages;

  std::array<std::array<double, Stages>, Stages> A;  ///< a_ij, row by row.
  std::array<double, Stages> b;                      ///< Weights.
  std::array<double, Stages> c;                      ///< Nodes, c_i = Σ_j a_ij.
  int order = 1;                                     ///< Of the step by `b`.
  std::array<double, Stages> b_hat{};                ///< Embedded weights; all zero if none.
  int embedded_order = 0;                            ///< Of the step by `b_hat`; 0 if none.

  /// Whether each stage needs only those before it.
  [[nodiscard]] constexpr bool is_explicit() const noexcept {
    for (std::size_t i = 0; i < Stages; ++i) {
      for (std::size_t j = i; j < Stages; ++j) {
        if (A[i][j] != 0.0) {
          return false;
        }
      }
    }
    return true;
  }
};

/// Any tableau, for functions that are compiled once. It refers to the tableau's coefficients.
struct ButcherTableauView {
  std::size_t stages = 0;
  std::span<const double> A;  ///< a_ij at i * stages + j.
  std::span<const double> b;
  std::span<const double> c;

  /// Of a tableau, which has to outlive it.
  template <std::size_t Stages>
  // NOLINTNEXTLINE(google-explicit-constructor): a view is made where a tableau is passed.
  ButcherTableauView(const ButcherTableau<Stages>& tableau) noexcept
      : stages(Stages), A(tableau.A[0].data(), Stages * Stages), b(tableau.b), c(tableau.c) {}
  /// The embedded method of a tableau.
  template <std::size_t Stages>
  [[nodiscard]] static ButcherTableauView embedded(const ButcherTableau<Stages>& tableau) noexcept {
    ButcherTableauView view(tableau);
    view.b = tableau.b_hat;
    return view;
  }
};

/// By how much a method misses the conditions of an order: max |Φ(τ) - 1/γ(τ)| over all rooted
/// trees τ of that many vertices. A method has order p if this is zero (to rounding) for 1, …, p.
/// @param order  1 to 8. Cost: the number of such trees (115 at order 8) times stages²; allocates.
/// Source: Butcher, "Coefficients for the study of Runge-Kutta integration processes" (1963);
/// Hairer, Nørsett, Wanner, "Solving Ordinary Differential Equations I", Theorem II.2.13.
[[nodiscard]] double order_condition_residual(const ButcherTableauView& tableau, int order);

/// The factor by which one step multiplies x of dx/dt = λ x, with z = λ h:
/// R(z) = 1 + z bᵀ(I - z A)⁻¹ 1. The method is stable where |R(z)| <= 1; infinite at a pole of R.
/// Cost: stages³; allocates. Source: Hairer, Wanner, "Solving Ordinary Differential Equations II",
/// Proposition IV.3.1.
[[nodiscard]] std::complex<double> stability_function(const ButcherTableauView& tableau,
                                                      std::complex<double> z);

/// The methods. Names are those of the literature; the number is the order.
namespace tableaus {

namespace detail {

inline constexpr double sqrt2 = 1.4142135623730950488;
inline constexpr double sqrt3 = 1.7320508075688772935;
inline constexpr double sqrt6 = 2.4494897427831780982;
inline constexpr double sqrt15 = 3.8729833462074168852;
/// 1 - 1/√2, the diagonal of the L-stable SDIRK method with two stages.
inline constexpr double sdirk_gamma = 1.0 - sqrt2 / 2.0;

}  // namespace detail

/// x⁺ = x + h f(x) (Theorem 7.9.1).
inline constexpr ButcherTableau<1> forward_euler{{{{0.0}}}, {1.0}, {0.0}, 1};

/// The explicit midpoint rule.
inline constexpr ButcherTableau<2> midpoint{
    {{{0.0, 0.0}, {1.0 / 2.0, 0.0}}}, {0.0, 1.0}, {0.0, 1.0 / 2.0}, 2, {1.0, 0.0}, 1};

/// Heun's method of order 2, the explicit trapezoidal rule.
inline constexpr ButcherTableau<2> heun{
    {{{0.0, 0.0}, {1.0, 0.0}}}, {1.0 / 2.0, 1.0 / 2.0}, {0.0, 1.0}, 2, {1.0, 0.0}, 1};

/// Ralston's method, which has the least bound of the error among those of order 2.
inline constexpr ButcherTableau<2> ralston{
    {{{0.0, 0.0}, {2.0 / 3.0, 0.0}}}, {1.0 / 4.0, 3.0 / 4.0}, {0.0, 2.0 / 3.0}, 2, {1.0, 0.0}, 1};

/// Bogacki and Shampine's 3(2) pair (Appl. Math. Lett. 2, 1989); the last stage is the next first.
inline constexpr ButcherTableau<4> bogacki_shampine{{{{0.0, 0.0, 0.0, 0.0},
                                                      {1.0 / 2.0, 0.0, 0.0, 0.0},
                                                      {0.0, 3.0 / 4.0, 0.0, 0.0},
                                                      {2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0}}},
                                                    {2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0},
                                                    {0.0, 1.0 / 2.0, 3.0 / 4.0, 1.0},
                                                    3,
                                                    {7.0 / 24.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 8.0},
                                                    2};

/// The classical method of order 4 (Theorem 7.9.2).
inline constexpr ButcherTableau<4> rk4{{{{0.0, 0.0, 0.0, 0.0},
                                         {1.0 / 2.0, 0.0, 0.0, 0.0},
                                         {0.0, 1.0 / 2.0, 0.0, 0.0},
                                         {0.0, 0.0, 1.0, 0.0}}},
                                       {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0},
                                       {0.0, 1.0 / 2.0, 1.0 / 2.0, 1.0},
                                       4};

/// Kutta's 3/8 rule.
inline constexpr ButcherTableau<4> three_eighths{{{{0.0, 0.0, 0.0, 0.0},
                                                   {1.0 / 3.0, 0.0, 0.0, 0.0},
                                                   {-1.0 / 3.0, 1.0, 0.0, 0.0},
                                                   {1.0, -1.0, 1.0, 0.0}}},
                                                 {1.0 / 8.0, 3.0 / 8.0, 3.0 / 8.0, 1.0 / 8.0},
                                                 {0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0},
                                                 4};

/// Dormand and Prince's 5(4) pair (Theorem 7.9.3; J. Comput. Appl. Math. 6, 1980); the last stage
/// is the next first.
inline constexpr ButcherTableau<7> dormand_prince{
    {{{0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
      {1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
      {3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0, 0.0},
      {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0, 0.0},
      {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0, 0.0},
      {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0, 0.0},
      {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0}}},
    {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0},
    {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0},
    5,
    {5179.0 / 57600.0, 0.0, 7571.0 / 16695.0, 393.0 / 640.0, -92097.0 / 339200.0, 187.0 / 2100.0,
     1.0 / 40.0},
    4};

/// x⁺ = x + h f(x⁺): L-stable.
inline constexpr ButcherTableau<1> backward_euler{{{{1.0}}}, {1.0}, {1.0}, 1};

/// The implicit trapezoidal rule (Crank-Nicolson), which on a linear system is the bilinear
/// transform of Table 7.2: A-stable.
inline constexpr ButcherTableau<2> trapezoidal{
    {{{0.0, 0.0}, {1.0 / 2.0, 1.0 / 2.0}}}, {1.0 / 2.0, 1.0 / 2.0}, {0.0, 1.0}, 2, {1.0, 0.0}, 1};

/// The implicit midpoint rule: A-stable, symplectic.
inline constexpr ButcherTableau<1> gauss_legendre_2{{{{1.0 / 2.0}}}, {1.0}, {1.0 / 2.0}, 2};

/// Gauss collocation with two stages: A-stable, symplectic.
inline constexpr ButcherTableau<2> gauss_legendre_4{
    {{{1.0 / 4.0, 1.0 / 4.0 - detail::sqrt3 / 6.0}, {1.0 / 4.0 + detail::sqrt3 / 6.0, 1.0 / 4.0}}},
    {1.0 / 2.0, 1.0 / 2.0},
    {1.0 / 2.0 - detail::sqrt3 / 6.0, 1.0 / 2.0 + detail::sqrt3 / 6.0},
    4};

/// Gauss collocation with three stages: A-stable, symplectic.
inline constexpr ButcherTableau<3> gauss_legendre_6{
    {{{5.0 / 36.0, 2.0 / 9.0 - detail::sqrt15 / 15.0, 5.0 / 36.0 - detail::sqrt15 / 30.0},
      {5.0 / 36.0 + detail::sqrt15 / 24.0, 2.0 / 9.0, 5.0 / 36.0 - detail::sqrt15 / 24.0},
      {5.0 / 36.0 + detail::sqrt15 / 30.0, 2.0 / 9.0 + detail::sqrt15 / 15.0, 5.0 / 36.0}}},
    {5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0},
    {1.0 / 2.0 - detail::sqrt15 / 10.0, 1.0 / 2.0, 1.0 / 2.0 + detail::sqrt15 / 10.0},
    6};

/// Radau IIA collocation with two stages: L-stable.
inline constexpr ButcherTableau<2> radau_iia_3{
    {{{5.0 / 12.0, -1.0 / 12.0}, {3.0 / 4.0, 1.0 / 4.0}}},
    {3.0 / 4.0, 1.0 / 4.0},
    {1.0 / 3.0, 1.0},
    3};

/// Radau IIA collocation with three stages: L-stable; what `integrate` takes for stiff systems.
inline constexpr ButcherTableau<3> radau_iia_5{
    {{{(88.0 - 7.0 * detail::sqrt6) / 360.0, (296.0 - 169.0 * detail::sqrt6) / 1800.0,
       (-2.0 + 3.0 * detail::sqrt6) / 225.0},
      {(296.0 + 169.0 * detail::sqrt6) / 1800.0, (88.0 + 7.0 * detail::sqrt6) / 360.0,
       (-2.0 - 3.0 * detail::sqrt6) / 225.0},
      {(16.0 - detail::sqrt6) / 36.0, (16.0 + detail::sqrt6) / 36.0, 1.0 / 9.0}}},
    {(16.0 - detail::sqrt6) / 36.0, (16.0 + detail::sqrt6) / 36.0, 1.0 / 9.0},
    {(4.0 - detail::sqrt6) / 10.0, (4.0 + detail::sqrt6) / 10.0, 1.0},
    5};

/// Alexander's diagonally implicit method with two stages (SIAM J. Numer. Anal. 14, 1977):
/// L-stable, one factorisation a step.
inline constexpr ButcherTableau<2> sdirk_2{
    {{{detail::sdirk_gamma, 0.0}, {1.0 - detail::sdirk_gamma, detail::sdirk_gamma}}},
    {1.0 - detail::sdirk_gamma, detail::sdirk_gamma},
    {detail::sdirk_gamma, 1.0},
    2};

}  // namespace tableaus

}  // namespace flyball
