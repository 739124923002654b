#pragma once

#include <flyball/mechanisms/differential_drive.hpp>

namespace flyball::test {

inline constexpr Length book_trackwidth{0.59055};

/// The drive of the book's figures 8.4 to 8.13: three CIMs a side.
inline mechanisms::DifferentialDrive book_drive(int motors = 3) {
  return mechanisms::differential_drive({.motor = mechanisms::cim(motors),
                                         .left_gearing = 60.0 / 11.0,
                                         .right_gearing = 60.0 / 11.0,
                                         .mass = Mass(52.0),
                                         .wheel_radius = Length(0.08255 / 2.0),
                                         .trackwidth = book_trackwidth,
                                         .moment_of_inertia = MomentOfInertia(6.0)})
      .value();
}

}  // namespace flyball::test
