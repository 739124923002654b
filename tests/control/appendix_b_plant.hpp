#pragma once

#include <flyball/systems/system.hpp>

namespace flyball::test {

/// The book's example plant of appendix B.
inline DiscreteSystem<2, 1, 1> appendix_b_plant() {
  DiscreteSystem<2, 1, 1> system;
  system.A << 1.0, 0.1, 0.0, 0.95;
  system.B << 0.005, 0.1;
  system.C << 1.0, 0.3;
  system.D << 0.2;
  system.period = Time(0.1);
  return system;
}

}  // namespace flyball::test
