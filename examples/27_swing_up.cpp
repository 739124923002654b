// Two rods with a motor at the elbow alone stand up: the model from its energies (chapter 13), an
// LQR and from where it is proven to hold them (section 8.3), and a swing-up until they are there.
#include <cmath>
#include <cstdio>
#include <numbers>

#include <flyball/control/swing_up/campaign.hpp>
#include <flyball/control/swing_up/energy_shaping.hpp>
#include <flyball/mechanisms/lagrangian/planar_linkage.hpp>

int main() {
  using namespace flyball;
  using namespace flyball::literals;
  constexpr double pi = std::numbers::pi;

  //! [energies]
  // Where the masses are is all that is said; hanging at zero. M, C and G follow.
  const auto chain = mechanisms::planar_model(mechanisms::PlanarChain<2>{
      {mechanisms::uniform_rod(1.0, 1.0), mechanisms::uniform_rod(1.0, 1.0)}, -pi / 2.0});
  const Eigen::Vector2d q(0.4, -0.7);
  const Eigen::Matrix2d M = chain->mass_matrix(q);
  //! [energies]
  const auto rods = mechanisms::acrobot(
      {.first = mechanisms::uniform_rod(1_m, 1_kg), .second = mechanisms::uniform_rod(1_m, 1_kg)});
  if (!chain || !rods) {
    std::fprintf(stderr, "%s\n", to_string(chain ? rods.error() : chain.error()).c_str());
    return 1;
  }
  std::printf("M = [%.4f %.4f; %.4f %.4f] kg m2, by hand it differs by %.1e\n", M(0, 0), M(0, 1),
              M(1, 0), M(1, 1), (M - rods->links.mass_matrix(q)).norm());

  //! [design]
  // At most 10 N m. The regulator is certified: from V <= level it holds them, limits and all.
  const auto design = design_swing_up(*rods, {.limit = 10.0});
  //! [design]
  if (!design) {
    std::fprintf(stderr, "%s\n", to_string(design.error()).c_str());
    return 1;
  }
  const CertifiedRegion& region = design->region;
  std::printf(
      "proven for V <= %.4f: %.1f deg at the shoulder, %.1f deg at the elbow (%d cells); V is\n"
      "found not to fall from %.4f on\n",
      region.level, region.extent(0) * 180.0 / pi, region.extent(1) * 180.0 / pi, region.cells,
      region.refuted);

  //! [run]
  // From rest, both rods one radian off hanging; every 5 ms.
  auto controller = design->controller;
  Eigen::Vector4d x(1.0, 0.0, 0.0, 0.0);
  const double period = 0.005;
  double stood = 0.0;
  double time = 0.0;
  for (; time < 30.0 && stood < 1.0; time += period) {
    const Eigen::Vector<double, 1> u(controller.calculate(x));
    x = rk4(*rods, x, u, period);
    stood = controller.balancing() ? stood + period : 0.0;
  }
  //! [run]
  const bool stands = stood >= 1.0 && std::abs(angle_difference(x(0), pi)) < 0.1;
  std::printf("after %.2f s they %s\n", time, stands ? "stand" : "do not stand");
  return stands ? 0 : 1;
}
