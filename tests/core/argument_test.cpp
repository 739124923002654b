#include <flyball/core/argument.hpp>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace flyball::argument_test {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void expect_error(const Expected<void>& result, ArgumentError code, const std::string& message) {
  ASSERT_FALSE(result.has_value());
  EXPECT_TRUE(result.error().is(code)) << result.error().code();
  EXPECT_EQ(to_string(result.error()), message);
}

TEST(CheckShape, AcceptsTheShape) {
  EXPECT_TRUE(check_shape(Eigen::MatrixXd::Zero(2, 3), 2, 3, "f", "M").has_value());
  EXPECT_TRUE(check_shape(Eigen::MatrixXd::Zero(0, 3), 0, 3, "f", "M").has_value());
  // A block of a larger matrix has an outer stride and is not copied.
  const Eigen::MatrixXd large = Eigen::MatrixXd::Zero(5, 5);
  EXPECT_TRUE(check_shape(large.block(1, 1, 2, 3), 2, 3, "f", "M").has_value());
}

TEST(CheckShape, SaysWhatTheShapeMeans) {
  expect_error(check_shape(Eigen::MatrixXd::Zero(2, 2), 1, 1, "lqr", "R", "inputs x inputs"),
               ArgumentError::wrong_shape, "lqr: R is 2x2; it must be inputs x inputs (1x1)");
  expect_error(check_shape(Eigen::MatrixXd::Zero(2, 3), 3, 2, "lqr", "B"),
               ArgumentError::wrong_shape, "lqr: B is 2x3; it must be 3x2");
  EXPECT_FALSE(check_shape(Eigen::MatrixXd::Zero(2, 3), 2, 4, "f", "M").has_value());
  EXPECT_FALSE(check_shape(Eigen::MatrixXd::Zero(2, 3), 1, 3, "f", "M").has_value());
}

TEST(CheckSquare, AcceptsSquareAndRefusesTheRest) {
  EXPECT_TRUE(check_square(Eigen::MatrixXd::Zero(1, 1), "f", "A").has_value());
  expect_error(check_square(Eigen::MatrixXd::Zero(2, 3), "expm", "A"), ArgumentError::wrong_shape,
               "expm: A is 2x3; it must be square");
  expect_error(check_square(Eigen::MatrixXd(0, 0), "expm", "A"), ArgumentError::empty,
               "expm: A is empty; it must be a square matrix with at least one row");
  EXPECT_TRUE(check_square(Eigen::MatrixXd(0, 3), "f", "A").error().is(ArgumentError::empty));
}

TEST(CheckFinite, NamesTheFirstOffendingEntry) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Ones(3, 2);
  EXPECT_TRUE(check_finite(M, "lqr", "Q").has_value());
  M(2, 1) = nan;
  expect_error(check_finite(M, "lqr", "Q"), ArgumentError::not_finite,
               "lqr: Q(2, 1) is nan; it must be a finite number");
  M(0, 1) = -inf;
  expect_error(check_finite(M, "lqr", "Q"), ArgumentError::not_finite,
               "lqr: Q(0, 1) is -inf; it must be a finite number");
}

TEST(CheckFinite, OfANumber) {
  EXPECT_TRUE(check_finite(std::numeric_limits<double>::max(), "f", "x").has_value());
  for (const double bad : {nan, inf, -inf}) {
    const auto result = check_finite(bad, "f", "x");
    ASSERT_FALSE(result.has_value());
    EXPECT_TRUE(result.error().is(ArgumentError::not_finite));
  }
}

TEST(CheckSymmetric, ToleratesWhatTenPrintedDigitsLose) {
  Eigen::MatrixXd M(2, 2);
  M << 1e6, 2.0, 2.0, 3.0;
  EXPECT_TRUE(check_symmetric(M, "lqr", "Q").has_value());
  // The limit is relative to √(M_ii M_jj), whatever their units: 1e-10 √3e6 = 1.732e-7.
  M(0, 1) = 2.0 + 1.7e-7;
  EXPECT_TRUE(check_symmetric(M, "lqr", "Q").has_value());
  M(0, 1) = 2.0 + 1.8e-7;
  EXPECT_FALSE(check_symmetric(M, "lqr", "Q").has_value());
  // An entry of another unit does not hide it.
  Eigen::MatrixXd wide(3, 3);
  wide << 1e20, 0.0, 0.0, 0.0, 2.0, -1.77, 0.0, 0.0, 0.5;
  EXPECT_FALSE(check_symmetric(wide, "dare", "R").has_value());
  M(0, 1) = 2.5;
  expect_error(check_symmetric(M, "lqr", "Q"), ArgumentError::not_symmetric,
               "lqr: Q is not symmetric: entries (0, 1) and (1, 0) are 2.5 and 2; it must be "
               "symmetric");
}

TEST(CheckSymmetric, RefusesWhatIsNotSquareAndWhatIsNotANumber) {
  EXPECT_TRUE(check_symmetric(Eigen::MatrixXd::Zero(2, 3), "f", "Q")
                  .error()
                  .is(ArgumentError::wrong_shape));
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(2, 2);
  M(0, 1) = nan;
  EXPECT_TRUE(check_symmetric(M, "f", "Q").error().is(ArgumentError::not_symmetric));
}

TEST(CheckPositive, RefusesZeroNegativeAndNotFinite) {
  EXPECT_TRUE(check_positive(1e-300, "f", "m").has_value());
  expect_error(check_positive(0.0, "elevator", "mass", "kg"), ArgumentError::not_positive,
               "elevator: mass is 0 kg; it must be greater than zero");
  expect_error(check_positive(-2.5, "elevator", "gearing"), ArgumentError::not_positive,
               "elevator: gearing is -2.5; it must be greater than zero");
  EXPECT_TRUE(check_positive(nan, "f", "m").error().is(ArgumentError::not_finite));
  EXPECT_TRUE(check_positive(inf, "f", "m").error().is(ArgumentError::not_finite));
}

TEST(CheckNotNegative, AcceptsZero) {
  EXPECT_TRUE(check_not_negative(0.0, "f", "delay").has_value());
  EXPECT_TRUE(check_not_negative(-0.0, "f", "delay").has_value());
  expect_error(check_not_negative(-0.02, "loop", "delay", "s"), ArgumentError::out_of_range,
               "loop: delay is -0.02 s; it must be zero or greater");
  EXPECT_TRUE(check_not_negative(nan, "f", "delay").error().is(ArgumentError::not_finite));
}

TEST(CheckWithin, HoldsTheBounds) {
  EXPECT_TRUE(check_within(1.0, 1.0, 2.0, "f", "share").has_value());
  EXPECT_TRUE(check_within(2.0, 1.0, 2.0, "f", "share").has_value());
  expect_error(check_within(2.5, 1.0, 2.0, "f", "rate", "V/s"), ArgumentError::out_of_range,
               "f: rate is 2.5 V/s; it must be in [1, 2]");
  EXPECT_TRUE(check_within(nan, 1.0, 2.0, "f", "share").error().is(ArgumentError::not_finite));
}

TEST(Checks, AnswerTheFirstErrorAndMakeNoCheckAfterIt) {
  EXPECT_TRUE(Checks("f"));
  EXPECT_TRUE(Checks("f").finite(1.0, "a").positive(1.0, "b"));
  int made = 0;
  const auto count = [&] {
    ++made;
    return Expected<void>{};
  };
  const Expected<void> result = Checks("f")
                                    .finite(1.0, "a")
                                    .also(count)
                                    .positive(0.0, "b", "kg")
                                    .also(count)
                                    .finite(nan, "c");
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(to_string(result.error()), "f: b is 0 kg; it must be greater than zero");
  EXPECT_EQ(made, 1);
}

TEST(Checks, EachChecksWhatItsNameSays) {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Ones(2, 3);
  const Eigen::MatrixXd S{{1.0, 2.0}, {3.0, 4.0}};
  EXPECT_TRUE(Checks("f").square(A, "A").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(Checks("f").shape(A, 2, 2, "A").error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(Checks("f").finite(A * nan, "A").error().is(ArgumentError::not_finite));
  EXPECT_TRUE(Checks("f").symmetric(S, "S").error().is(ArgumentError::not_symmetric));
  EXPECT_TRUE(Checks("f").not_negative(-1.0, "x").error().is(ArgumentError::out_of_range));
  EXPECT_TRUE(Checks("f").within(3.0, 0.0, 1.0, "x").error().is(ArgumentError::out_of_range));
  EXPECT_EQ(Checks("f").square(S, "S").map([] { return 3; }).value(), 3);
  EXPECT_FALSE(Checks("f").square(A, "A").map([] { return 3; }).has_value());
}

TEST(FormatNumber, KeepsTheDigitsAskedFor) {
  EXPECT_EQ(format_number(0.1), "0.1");
  EXPECT_EQ(format_number(234.0411234), "234.041");
  EXPECT_EQ(format_number(234.0411234, 9), "234.041123");
  EXPECT_EQ(format_number(1e-12), "1e-12");
  EXPECT_EQ(format_number(-3.0), "-3");
}

RC_GTEST_PROP(FormatNumber, SeventeenDigitsReadBackTheSame, (double value)) {
  RC_PRE(std::isfinite(value));
  RC_ASSERT(std::strtod(format_number(value, 17).c_str(), nullptr) == value);
}

}  // namespace
}  // namespace flyball::argument_test
