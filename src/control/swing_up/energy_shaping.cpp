#include <flyball/control/swing_up/energy_shaping.hpp>

#include <vector>

#include <flyball/control/continuous_lqr.hpp>
#include <flyball/systems/any_model.hpp>
#include <flyball/systems/linearize.hpp>

#include "core/try.hpp"

namespace flyball {

namespace {

constexpr std::string_view in_design_swing_up = "design_swing_up";
constexpr double upright = std::numbers::pi;

/// The balance about a state, and the region in which it works.
struct Balanced {
  SaturatedLoop loop;
  CertifiedRegion region;
};

/// @param tolerances  n, Bryson's. @param share  Of the limit that is the input's tolerance.
template <class M>
Expected<Balanced> balanced(const M& model, const Eigen::VectorXd& x,
                            const std::vector<double>& tolerances, double share,
                            std::vector<Eigen::Index> angles, const Eigen::VectorXd& reach,
                            const SwingUpOptions& options) {
  FLYBALL_CHECK(Checks(in_design_swing_up).positive(options.limit, "limit"));
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(1);
  FLYBALL_TRY(const auto linear, linearize(AnyModel(model), x, rest));
  FLYBALL_TRY(const auto design,
              continuous_lqr(linear, bryson(tolerances), bryson({share * options.limit})));
  SaturatedLoop loop{.model = model_tape(model),
                     .x = x,
                     .u = rest,
                     .K = design.K,
                     .u_min = Eigen::VectorXd::Constant(1, -options.limit),
                     .u_max = Eigen::VectorXd::Constant(1, options.limit),
                     .angles = std::move(angles)};
  FLYBALL_TRY(auto region, certify_region(loop, {.P = design.S,
                                                 .reach = reach,
                                                 .closeness = 0.95,
                                                 .most_cells = options.most_cells}));
  return Balanced{std::move(loop), std::move(region)};
}

template <class Shaper, int N>
Expected<SwingUpDesign<Shaper, N>> together(const Shaper& shaper, Balanced balance,
                                            const SwingUpOptions& options) {
  FLYBALL_TRY(const auto design,
              balance_design<N>(balance.loop, balance.region, options.hysteresis));
  return SwingUpDesign<Shaper, N>{SwingUp<Shaper, N>(shaper, design), std::move(balance.loop),
                                  std::move(balance.region)};
}

}  // namespace

Expected<SwingUpDesign<PendulumShaper, 2>> design_swing_up(const mechanisms::Pendulum& model,
                                                           const SwingUpOptions& options) {
  FLYBALL_CHECK(Checks(in_design_swing_up)
                    .positive(model.mass, "mass", "kg")
                    .positive(model.length, "length", "m")
                    .positive(model.gravity, "gravity", "m/s²")
                    .not_negative(model.damping, "damping", "N m s/rad"));
  const double rate = std::sqrt(model.gravity / model.length);
  FLYBALL_TRY(auto balance, balanced(model, Eigen::Vector2d(upright, 0.0), {0.3, 0.4 * rate}, 0.25,
                                     {0}, {}, options));
  return together<PendulumShaper, 2>({.model = model, .limit = options.limit}, std::move(balance),
                                     options);
}

Expected<SwingUpDesign<CartPoleShaper, 4>> design_swing_up(const mechanisms::CartPole& model,
                                                           const SwingUpOptions& options) {
  FLYBALL_CHECK(Checks(in_design_swing_up)
                    .positive(model.cart_mass, "cart_mass", "kg")
                    .positive(model.pole_mass, "pole_mass", "kg")
                    .positive(model.pole_length, "pole_length", "m")
                    .positive(model.gravity, "gravity", "m/s²"));
  if (!(options.track > 0.0)) {
    return refusal(ArgumentError::not_positive, in_design_swing_up, "track")
        .got(format_number(options.track) + " m")
        .expected("positive, infinite for none");
  }
  const double rate = std::sqrt(model.gravity / model.pole_length);
  // Without a track, as far as the pole swings.
  const double room = std::isfinite(options.track) ? 0.5 * options.track : 2.0 * model.pole_length;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const Eigen::Vector4d reach(options.track, infinite, infinite, infinite);
  FLYBALL_TRY(auto balance,
              balanced(model, Eigen::Vector4d(0.0, upright, 0.0, 0.0),
                       {room, 0.3, 0.225 * rate * room, 0.2 * rate}, 0.25, {1}, reach, options));
  const double all = options.limit / (model.cart_mass + model.pole_mass);
  constexpr double margin = 0.95;
  return together<CartPoleShaper, 4>({.model = model,
                                      .limit = options.limit,
                                      .track = margin * options.track,
                                      .acceleration = 0.7 * all,
                                      .brake = 0.22 * all},
                                     std::move(balance), options);
}

Expected<SwingUpDesign<AcrobotShaper, 4>> design_swing_up(const mechanisms::Acrobot& model,
                                                          const SwingUpOptions& options) {
  FLYBALL_CHECK(Checks(in_design_swing_up)
                    .positive(model.links.b, "the second link's inertia", "kg m²")
                    .positive(model.energy_upright(), "the energy upright", "J"));
  const mechanisms::TwoLink& links = model.links;
  const double rate = std::sqrt(model.energy_upright() / (links.a + links.b + 2.0 * links.d));
  FLYBALL_TRY(auto balance,
              balanced(model, Eigen::Vector4d(upright, 0.0, 0.0, 0.0),
                       {0.3, 0.3, 0.37 * rate, 0.37 * rate}, 0.1, {0, 1}, {}, options));
  return together<AcrobotShaper, 4>({.model = model}, std::move(balance), options);
}

}  // namespace flyball
