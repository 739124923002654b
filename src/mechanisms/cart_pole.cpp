#include <flyball/mechanisms/cart_pole.hpp>

namespace flyball::mechanisms {

ModelDescription CartPole::description() const {
  return {.name = "cart-pole",
          .states = {{"position", "m"},
                     {"angle", "rad", true},
                     {"velocity", "m/s"},
                     {"angular velocity", "rad/s"}},
          .inputs = {{"force", "N"}},
          .outputs = {{"position", "m"}, {"angle", "rad", true}},
          .parameters = {{"cart_mass", "kg", cart_mass},
                         {"pole_mass", "kg", pole_mass},
                         {"pole_length", "m", pole_length},
                         {"gravity", "m/s²", gravity}}};
}

Expected<CartPole> cart_pole(const CartPoleParameters& parameters) {
  const auto& [cart_mass, pole_mass, pole_length, gravity] = parameters;
  return Checks("cart_pole")
      .positive(cart_mass.si(), "cart_mass", "kg")
      .positive(pole_mass.si(), "pole_mass", "kg")
      .positive(pole_length.si(), "pole_length", "m")
      .not_negative(gravity, "gravity", "m/s²")
      .map([&] { return CartPole{cart_mass.si(), pole_mass.si(), pole_length.si(), gravity}; });
}

}  // namespace flyball::mechanisms
