#pragma once

#include <flyball/core/argument.hpp>
#include <flyball/mechanisms/lagrangian/two_link.hpp>

namespace flyball::mechanisms::detail {

/// The links of a two-link mechanism: lengths, masses and inertias that can move.
inline Expected<TwoLink> checked_links(const TwoLinkPart& first, const TwoLinkPart& second,
                                       double gravity, std::string_view where) {
  const auto about_joint = [](const TwoLinkPart& part) {
    return part.moment_of_inertia + part.mass * part.center_of_mass * part.center_of_mass;
  };
  return Checks(where)
      .positive(first.length, "first.length", "m")
      .positive(first.mass, "first.mass", "kg")
      .positive(second.mass, "second.mass", "kg")
      .not_negative(second.length, "second.length", "m")
      .not_negative(first.center_of_mass, "first.center_of_mass", "m")
      .not_negative(second.center_of_mass, "second.center_of_mass", "m")
      .not_negative(first.moment_of_inertia, "first.moment_of_inertia", "kg m²")
      .not_negative(second.moment_of_inertia, "second.moment_of_inertia", "kg m²")
      .not_negative(gravity, "gravity", "m/s²")
      .positive(about_joint(second), "the second link's moment of inertia about its joint", "kg m²")
      .also([&]() -> Expected<void> {
        // Straight, what the first joint moves beside the second link's centre: det M = a b - d².
        const TwoLink links(first, second, gravity);
        constexpr double rounding = 1e-12;
        const double left = links.a * links.b - links.d * links.d;
        return check_positive(left > rounding * links.a * links.b ? left : 0.0, where,
                              "the first link's moment of inertia beside the second link's",
                              "kg² m⁴");
      })
      .map([&] { return TwoLink(first, second, gravity); });
}

}  // namespace flyball::mechanisms::detail
