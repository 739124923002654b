#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "core/wording.hpp"

namespace flyball::text::wording_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

TEST(Wording, NumbersHaveSensibleDigits) {
  EXPECT_EQ(number(234.0412), "234");
  EXPECT_EQ(number(5.603), "5.603");
  EXPECT_EQ(number(0.15), "0.15");
  EXPECT_EQ(number(12.0), "12");
  EXPECT_EQ(number(0.0), "0");
  EXPECT_EQ(number(-2.4e-311), "0");
  EXPECT_EQ(number(-0.00004), "-4e-05");
  EXPECT_EQ(number(1234567.0), "1.235e+06");
  EXPECT_EQ(number(infinity), "∞");
  EXPECT_EQ(number(-infinity), "-∞");
  EXPECT_EQ(number(not_a_number), "none");
}

TEST(Wording, ValueAndHalfWidthHaveMatchingDigits) {
  EXPECT_EQ(with_half_width(0.15034, 0.01234), "0.150 ± 0.012");
  EXPECT_EQ(with_half_width(4.0, 0.0043), "4.0000 ± 0.0043");
  EXPECT_EQ(with_half_width(1234.5, 56.7), "1234 ± 57");
  EXPECT_EQ(with_half_width(0.3, 0.0), "0.3");
  EXPECT_EQ(with_half_width(0.3, infinity), "0.3");
  EXPECT_EQ(with_half_width(0.3, not_a_number), "0.3");
}

TEST(Wording, ExactReadsBackToTheSameDouble) {
  const bool ok = rc::check("strtod(exact(x)) == x", [](double x) {
    if (std::isfinite(x)) {
      RC_ASSERT(std::strtod(exact(x).c_str(), nullptr) == x);
    }
  });
  EXPECT_TRUE(ok);
}

TEST(Wording, NumberIsWithinItsDigits) {
  const bool ok = rc::check("four digits are within half a unit of the fourth", [] {
    const double x = *rc::gen::map(rc::gen::inRange(-2000000, 2000000),
                                   [](int i) { return static_cast<double>(i) * 1.7e-3; });
    const double shown = std::strtod(number(x).c_str(), nullptr);
    RC_ASSERT(std::abs(shown - x) <= 0.5001e-3 * std::abs(x));
  });
  EXPECT_TRUE(ok);
}

TEST(Wording, TimesAndComplexNumbersAndMatrices) {
  EXPECT_EQ(seconds(0.02), "20 ms");
  EXPECT_EQ(seconds(1.25), "1.25 s");
  EXPECT_EQ(seconds(infinity), "∞ s");
  EXPECT_EQ(complex_number({0.91, 0.1}), "0.91 ± 0.1j");
  EXPECT_EQ(complex_number({0.91, -0.1}), "0.91 ± 0.1j");
  EXPECT_EQ(complex_number({0.5, 0.0}), "0.5");
  EXPECT_EQ(matrix((Eigen::MatrixXd(2, 2) << 0, 1, 0, -13.333333).finished()),
            "[0  1; 0  -13.333]");
  EXPECT_EQ(percent(0.125), "12.5 %");
  EXPECT_EQ(percent(4.1e-4, 2), "0.041 %");
  EXPECT_EQ(percent(2.8e-11, 2), "0 %");
  EXPECT_EQ(enumerate({"a", "b", "c"}), "a, b and c");
  EXPECT_EQ(count(1, "run"), "1 run");
  EXPECT_EQ(count(0, "run"), "0 runs");
  EXPECT_EQ(capitalized("elevator"), "Elevator");
  EXPECT_EQ(capitalized("äther"), "äther");
}

TEST(Wording, HostileTextIsHarmless) {
  EXPECT_EQ(printable("\x1b[31mred\a"), "?[31mred?");
  EXPECT_EQ(printable("\xC2\x9B"
                      "31m"),
            "??31m");  // the one-character form of ESC [
  EXPECT_EQ(valid_utf8("caf\xE9"), "caf\xEF\xBF\xBD");
  EXPECT_EQ(valid_utf8("café ✔"), "café ✔");
  EXPECT_EQ(valid_utf8("\xE2\x9C"), "\xEF\xBF\xBD\xEF\xBF\xBD");
}

}  // namespace
}  // namespace flyball::text::wording_test
