#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <flyball/core/random.hpp>

#include "core/plain_format.hpp"

namespace flyball::detail::plain_format_test {
namespace {

template <class... T>
void expect_same(std::string_view pattern, T... arguments) {
  const std::array<plain::Argument, sizeof...(T) + 1> all{plain::Argument(arguments)...,
                                                          plain::Argument(0)};
  EXPECT_EQ(plain::format(pattern, all.data(), sizeof...(T)),
            fmt::vformat(pattern, fmt::make_format_args(arguments...)));
}

TEST(PlainFormat, WritesWhatFmtWrites) {
  expect_same("no braces");
  expect_same("{{{}}}", 3);
  expect_same("{} of {}: \"{}\"", 1, std::size_t{2}, "three");
  expect_same("{0}, {1}, {0}", "a", std::string("b"));
  expect_same("{}{}", 'x', std::string_view("yz"));
  expect_same("{} {}", true, std::numeric_limits<long long>::min());
  Random random(11);
  for (int i = 0; i < 2000; ++i) {
    const double x = random.normal() * std::pow(10.0, std::floor(80.0 * random.uniform() - 40.0));
    expect_same("{}", x);
    expect_same("{:.3g} {:.6g} {:.2e}", x, x, x);
    expect_same("{:.{}g}", x, static_cast<int>(1 + random.bits() % 17));
    expect_same("{:.0f} {:.2f}", 1e3 * random.normal(), x);
  }
  for (const double x : {0.0, -0.0, 1.0, 1e16, 1e300, 5e-324, std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    expect_same("{} {:.4g}", x, x);
  }
}

}  // namespace
}  // namespace flyball::detail::plain_format_test
