#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <flyball/control/swing_up/balance.hpp>
#include <flyball/mechanisms/acrobot.hpp>
#include <flyball/mechanisms/cart_pole.hpp>
#include <flyball/mechanisms/pendulum.hpp>

/// The laws that swing up the pendulum, the cart-pole and the acrobot. Each makes the mechanism's
/// energy that of standing upright; with it the mechanism comes to the upright position by itself.
/// Run-time objects: noexcept, allocation-free; the limits are those of `SwingUp`.
namespace flyball {

/// u = u_max sat(κ (E* - E)/E*) sgn ω: dE/dt = u ω grows or falls as fast as the limit lets it.
///
/// κ = 10 is full torque until a tenth of the energy is missing. At rest it pushes: no stand still.
/// Source: Åström and Furuta, "Swinging up a pendulum by energy control", Automatica 36 (2000).
struct PendulumShaper {
  mechanisms::Pendulum model{};
  double limit = 0.0;  ///< u_max, N m.
  double sharpness = 10.0;

  /// The torque, N m, within the limit. @param x  (θ, θ̇).
  [[nodiscard]] double calculate(const Eigen::Vector2d& x) const noexcept {
    const auto& [m, l, c, g] = model;
    const double top = m * g * l;
    const double energy = 0.5 * m * l * l * x(1) * x(1) - top * std::cos(x(0));
    const double missing = std::clamp(sharpness * (top - energy) / top, -1.0, 1.0);
    return limit * missing * (x(1) < 0.0 ? -1.0 : 1.0) + c * x(1);
  }
};

/// The force that moves the cart with
///   a = -a_max sat(κ (E* - E)/E* θ̇/ω₀ cos θ) - ω₀² k p - ω₀ d ṗ,  ω₀² = g/l,
/// for the pole's energy E = ½ m_p l² θ̇² - m_p g l cos θ changes by -m_p l θ̇ cos θ a, and the cart
/// is to stay about the middle; but brakes with all force where what is left of the track is what
/// stopping at `brake` takes.
/// Source: Åström and Furuta (2000); Chung and Hauser, "Nonlinear control of a swinging pendulum",
/// Automatica 31 (1995); Spong, Corke and Lozano, "Nonlinear control of the reaction wheel
/// pendulum", Automatica 37 (2001), for the partial feedback linearisation.
struct CartPoleShaper {
  mechanisms::CartPole model{};
  double limit = 0.0;         ///< N
  double track = 0.0;         ///< m, either way, less a margin; infinite: none.
  double acceleration = 0.0;  ///< a_max, m/s².
  double brake = 0.0;         ///< m/s², that the force always has over the pole's pull.
  double sharpness = 17.0;    ///< κ
  double stiffness = 0.1;     ///< k
  double damping = 0.23;      ///< d

  /// The force, N, within the limit. @param x  The cart-pole's state.
  [[nodiscard]] double calculate(const Eigen::Vector4d& x) const noexcept {
    const auto& [m_c, m_p, l, g] = model;
    const double room = x(2) >= 0.0 ? track - x(0) : track + x(0);
    if (x(2) * x(2) > 2.0 * brake * std::max(room, 0.0)) {
      return std::copysign(limit, -x(2));
    }
    const double s = std::sin(x(1));
    const double c = std::cos(x(1));
    const double top = m_p * g * l;
    const double energy = 0.5 * m_p * l * l * x(3) * x(3) - top * c;
    const double rate = std::sqrt(g / l);
    const double swing = x(3) / rate * c;
    double a = -acceleration * std::clamp(sharpness * (top - energy) / top * swing, -1.0, 1.0);
    if (std::abs(swing) < hanging && energy < -(1.0 - hanging) * top) {
      a = acceleration;  // it hangs still
    }
    a -= rate * (rate * stiffness * x(0) + damping * x(2));
    // The force for that acceleration: the equations of motion solved for F.
    return (m_c + m_p * s * s) * a - m_p * s * (l * x(3) * x(3) + g * c);
  }

 private:
  static constexpr double hanging = 1e-3;
};

/// The torque that makes the elbow follow
///   q̈₂ = -ω₀² k q₂ - ω₀ d q̇₂ + ω₀² sat(κ (E* - E)/E* q̇₁/ω₀, s),  ω₀² = (G's slope)/(M's sum)
///   upright,
/// by collocated partial feedback linearisation: straightened where the energy is right, kicked
/// along with the first link where it is too small. What it adds is in proportion to what moves:
/// from hanging nearly still, below a tenth of a radian, two rods of 1 m take more than half a
/// minute, and from rest more than a minute.
///
/// Source: Spong, "The swing up control problem for the Acrobot", IEEE Control Systems 15 (1995).
struct AcrobotShaper {
  mechanisms::Acrobot model{};
  double stiffness = 10.5;  ///< k
  double damping = 4.6;     ///< d
  double sharpness = 75.0;  ///< κ
  double kick = 16.7;       ///< s

  /// The torque of the elbow, N m, within the limit. @param x  The acrobot's state.
  [[nodiscard]] double calculate(const Eigen::Vector4d& x) const noexcept {
    const mechanisms::TwoLink& links = model.links;
    const double top = model.energy_upright();
    const double square = top / (links.a + links.b + 2.0 * links.d);
    const double rate = std::sqrt(square);
    const double c = links.d * std::cos(x(1));
    const double s = links.d * std::sin(x(1));
    const double bend = std::remainder(x(1), 2.0 * std::numbers::pi);
    const double missing = (top - model.energy(x)) / top;
    double push = std::clamp(sharpness * missing * x(2) / rate, -kick, kick);
    if (std::abs(x(2)) < hanging * rate && missing > 2.0 - hanging) {
      push = kick;  // it hangs still
    }
    const double wanted = square * (push - stiffness * bend) - rate * damping * x(3);
    // M₁₁ q̈₁ + M₁₂ q̈₂ + h₁ = 0 taken into M₂₁ q̈₁ + M₂₂ q̈₂ + h₂ = τ.
    const Eigen::Vector2d G = model.gravity_vector(x.head<2>());
    const double h1 = G(0) - s * x(3) * (2.0 * x(2) + x(3));
    const double h2 = G(1) + s * x(2) * x(2);
    const double share = (links.b + c) / (links.a + links.b + 2.0 * c);
    return (links.b - share * (links.b + c)) * wanted + h2 - share * h1;
  }

 private:
  static constexpr double hanging = 1e-3;
};

/// What is wanted of a swing-up.
struct SwingUpOptions {
  double limit = 0.0;  ///< Largest torque or force either way, N m or N.
  double track = std::numeric_limits<double>::infinity();  ///< m, either way, of a cart.
  double hysteresis = 1.5;                                 ///< As in `balance_design`.
  int most_cells = 400'000;                                ///< As in `RegionOptions`.
};

/// A swing-up, and what is known of its balance.
template <class Shaper, int N>
struct SwingUpDesign {
  SwingUp<Shaper, N> controller;
  SaturatedLoop loop;      ///< The balance.
  CertifiedRegion region;  ///< From where it is proven.
};

/// Energy shaping and a certified LQR about the upright position.
///
/// The regulator's tolerances are taken for a large region: angles 0.3 rad, rates 0.2 to 0.4 times
/// the natural frequency of the hanging mechanism, a cart's place half of its track, and a fraction
/// of the limit as the input's.
/// @param model  Of positive mass, length, gravity. @param options  With a limit.
/// @errors ArgumentError::not_positive for the limit and the track, for a model without gravity;
///         RiccatiError; those of `certify_region`. Cost: some milliseconds; for the acrobot a
///         second.
///@{
[[nodiscard]] Expected<SwingUpDesign<PendulumShaper, 2>> design_swing_up(
    const mechanisms::Pendulum& model, const SwingUpOptions& options);
[[nodiscard]] Expected<SwingUpDesign<CartPoleShaper, 4>> design_swing_up(
    const mechanisms::CartPole& model, const SwingUpOptions& options);
[[nodiscard]] Expected<SwingUpDesign<AcrobotShaper, 4>> design_swing_up(
    const mechanisms::Acrobot& model, const SwingUpOptions& options);
///@}

}  // namespace flyball
