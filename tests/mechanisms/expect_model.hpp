#pragma once

#include <gtest/gtest.h>

#include <flyball/mechanisms/mechanism.hpp>

namespace flyball::mechanisms::test {

/// dv/dt = a v + b u, the velocity measured.
inline void expect_first_order(const Mechanism<1>& model, double a, double b) {
  EXPECT_DOUBLE_EQ(model.A(0, 0), a);
  EXPECT_DOUBLE_EQ(model.B(0, 0), b);
  EXPECT_EQ(model.C(0, 0), 1.0);
  EXPECT_EQ(model.D(0, 0), 0.0);
}

/// d²x/dt² = a dx/dt + b u, the position measured.
inline void expect_second_order(const Mechanism<2>& model, double a, double b) {
  EXPECT_EQ(model.A(0, 0), 0.0);
  EXPECT_EQ(model.A(0, 1), 1.0);
  EXPECT_EQ(model.A(1, 0), 0.0);
  EXPECT_DOUBLE_EQ(model.A(1, 1), a);
  EXPECT_EQ(model.B(0, 0), 0.0);
  EXPECT_DOUBLE_EQ(model.B(1, 0), b);
  EXPECT_EQ(model.C(0, 0), 1.0);
  EXPECT_EQ(model.C(0, 1), 0.0);
  EXPECT_EQ(model.D(0, 0), 0.0);
}

}  // namespace flyball::mechanisms::test
