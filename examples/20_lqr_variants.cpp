// Other things that a regulator can want (appendix B): little error of the outputs instead of the
// states (B.2), with the cross weight that comes of it (B.1); and to move like another plant,
// implicit model following (B.3).
#include <cmath>
#include <cstdio>

#include <flyball/control/implicit_model_following.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/control/quadratic_cost.hpp>
#include <flyball/mechanisms/flywheel.hpp>
#include <flyball/systems/discretize.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;

  // A flywheel whose current is its output, y = C x + D u.
  //! [output_cost]
  const auto model = mechanisms::flywheel_without_encoder(
      {.motor = mechanisms::neo(), .gearing = 2.0, .moment_of_inertia = 0.02_kg_m2});
  const auto plant = discretize(model.value(), 20_ms).value();
  const auto cost = output_cost(plant.C, plant.D, bryson({40.0}), bryson({12.0})).value();
  const auto by_output = output_lqr(plant, bryson({40.0}), bryson({12.0})).value();
  const auto by_hand = lqr(plant, cost.Q, cost.R, cost.N).value();  // the cross weight N of (B.1)
  //! [output_cost]
  std::printf("Q = %.2e, R = %.2e, N = %.2e\n", cost.Q(0), cost.R(0), cost.N(0));
  std::printf("K = %.6f, and with the weights by hand %.6f V/(rad/s)\n", by_output.K(0),
              by_hand.K(0));

  //! [model_following]
  const auto light = mechanisms::flywheel(
      {.motor = mechanisms::neo(), .gearing = 2.0, .moment_of_inertia = 0.01_kg_m2});
  const auto reference = discretize(light.value(), 20_ms).value();
  const auto following =
      implicit_model_following(plant, reference, bryson({1.0}), bryson({1e6})).value();
  //! [model_following]
  std::printf("half the inertia: poles %.6f as is, %.6f wanted, %.6f with feedback\n", plant.A(0),
              reference.A(0), following.poles(0).real());
  std::printf("and a volt of the reference is %.3f V here\n", following.K_u(0));
  return by_output.K(0) == by_hand.K(0) &&
                 std::abs(following.poles(0).real() - reference.A(0)) < 1e-6
             ? 0
             : 1;
}
