#include <flyball/optimization/robust_loss.hpp>

#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace flyball::optimization::robust_loss_test {
namespace {

constexpr std::array all{Loss::squared, Loss::soft_l1, Loss::huber, Loss::cauchy, Loss::tukey};

// ρ(0) = 0, ρ'(0) = 1, and the derivatives are those of the values.
TEST(RobustLoss, DerivativesAreThoseOfTheValue) {
  for (const Loss kind : all) {
    const RobustLoss loss{kind, 2.0};
    EXPECT_EQ(loss(0.0).value, 0.0);
    EXPECT_EQ(loss(0.0).slope, 1.0);
    for (const double s : {0.01, 1.0, 3.5, 4.5, 100.0}) {
      const double h = 1e-5 * s;
      const LossValue at = loss(s);
      EXPECT_NEAR(at.slope, (loss(s + h).value - loss(s - h).value) / (2.0 * h), 1e-9)
          << to_string(kind) << " at " << s;
      EXPECT_NEAR(at.bend, (loss(s + h).slope - loss(s - h).slope) / (2.0 * h), 1e-8)
          << to_string(kind) << " at " << s;
    }
  }
}

// With k = 2: soft-L1 of r² = 12 is 4·2(√(1 + 3) - 1) = 8, Huber 4(2√3 - 1), Cauchy 4 log 4, and
// Tukey 4/3 wherever |r| ≥ 2.
TEST(RobustLoss, ValuesAreTheFormulas) {
  EXPECT_DOUBLE_EQ((RobustLoss{Loss::squared, 2.0}(12.0).value), 12.0);
  EXPECT_DOUBLE_EQ((RobustLoss{Loss::soft_l1, 2.0}(12.0).value), 8.0);
  EXPECT_DOUBLE_EQ((RobustLoss{Loss::huber, 2.0}(12.0).value), 4.0 * (2.0 * std::sqrt(3.0) - 1.0));
  EXPECT_DOUBLE_EQ((RobustLoss{Loss::cauchy, 2.0}(12.0).value), 4.0 * std::log(4.0));
  EXPECT_DOUBLE_EQ((RobustLoss{Loss::tukey, 2.0}(12.0).value), 4.0 / 3.0);
  EXPECT_EQ((RobustLoss{Loss::tukey, 2.0}(12.0).slope), 0.0);
}

}  // namespace
}  // namespace flyball::optimization::robust_loss_test
