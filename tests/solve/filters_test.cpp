#include <cmath>
#include <numbers>

#include "solve/answers.hpp"

namespace flyball::solve::filters_test {
namespace {

// SciPy 1.10.1: iirfilter(7, 20 T/π, rp=0.5, rs=60, btype='highpass', ftype='ellip', output='zpk').
TEST(Filters, AreThoseOfTheLibrary) {
  const std::string problem =
      R"({"family": "elliptic", "band": "high-pass", "order": 7, "frequency": 20, "ripple": 0.5,
          "attenuation": 60, "T": 0.01})";
  const Json filter = answer("filter", problem);
  EXPECT_NEAR(number(filter, "gain"), 0.6389858912839732, 1e-14);
  EXPECT_EQ(filter.at("sections").size(), 4U);
  EXPECT_EQ(filter.at("poles").size(), 7U);
  const Json analog = answer("filter", R"({"order": 1, "frequency": 3})");
  EXPECT_FALSE(analog.contains("sections"));
  EXPECT_NEAR(entry(analog, "poles", 0, 0), -3.0, 1e-15);
  EXPECT_EQ(refusal("filter", R"({"order": 2, "frequency": 400, "T": 0.01})"), "out_of_range");
  EXPECT_EQ(refusal("filter", R"({"order": 2.5, "frequency": 4, "T": 0.01})"), "malformed");
}

// SciPy 1.10.1: ellipord([20, 40] T/π, [15, 52] T/π, 0.5, 50).
TEST(Filters, OrderFromASpecification) {
  const Json order = answer("filter-order",
                            R"({"family": "elliptic", "band": "band-pass", "pass": [20, 40],
                                "stop": [15, 52], "ripple": 0.5, "attenuation": 50, "T": 0.01})");
  EXPECT_EQ(number(order, "order"), 5.0);
  EXPECT_EQ(order.at("poles").size(), 10U);
  EXPECT_NEAR(number(order, "upper_frequency"), 40.0, 1e-12);
  EXPECT_EQ(refusal("filter-order", R"({"pass": [20, 30], "stop": [40]})"), "wrong_shape");
  EXPECT_EQ(refusal("filter-order", R"({"pass": [20], "stop": [10]})"), "out_of_range");
}

// y_k = 0.8 y_{k-1} + 0.2 x_k from rest: 0.2 of a step, 0.36, 0.488.
TEST(Filters, OfSignals) {
  const Json y =
      answer("filter-signal",
             R"({"sections": [[0.2, 0, 0, 1, -0.8, 0]], "x": [1, 1, 1], "start": "rest"})");
  EXPECT_NEAR(y.at("y").at(2).get<double>(), 0.488, 1e-15);
  EXPECT_EQ(refusal("filter-signal", R"({"sections": [[1, 0, 0, 2, 0, 0]], "x": [1, 1]})"),
            "malformed");
  EXPECT_EQ(refusal("filter-signal", R"({"sections": [[1, 0, 0, 1, -2, 1]], "x": [1, 1]})"),
            "out_of_range");
  const Json smooth =
      answer("savitzky-golay",
             R"({"taps": 5, "degree": 2, "derivative": 1, "T": 0.5, "x": [0, 1, 4, 9, 16, 25]})");
  for (int k = 0; k < 6; ++k) {  // of k²: 2k/T
    EXPECT_NEAR(smooth.at("y").at(static_cast<std::size_t>(k)).get<double>(), 4.0 * k, 1e-12);
  }
}

// Figure E.9; (1 - (1 + 2s) e^{-2s})/s² of t on [0, 2] at s = 1; a cosine of 1.5 and a mean.
TEST(Filters, SignalsInOtherBases) {
  const Json v = answer("coordinates", R"({"basis": [[1, 1], [1, -1]], "v": [2, 1.5]})");
  EXPECT_NEAR(v.at("along").at(0).get<double>(), 1.75 * std::numbers::sqrt2, 1e-15);
  EXPECT_TRUE(v.at("orthogonal").get<bool>());
  const Json X = answer("laplace-transform", R"({"x": [0, 1, 2], "T": 1, "s": [1, [0, 2]]})");
  EXPECT_NEAR(entry(X, "X", 0, 0), 1.0 - 3.0 * std::exp(-2.0), 1e-15);
  const Json tones = answer(
      "tones",
      R"({"x": [2.5, 1, -0.5, 1, 2.5, 1, -0.5], "T": 1, "frequency": [1.5707963267948966]})");
  EXPECT_NEAR(entry(tones, "amplitude", 0, 0), 1.5, 1e-14);
  EXPECT_NEAR(number(tones, "mean"), 1.0, 1e-14);
  const Json advice = answer("anti-aliasing", R"({"T": 0.025, "band": 62.83185307179586,
                                                  "source": 0.02})");
  EXPECT_EQ(number(advice, "order"), 0.0);
}

}  // namespace
}  // namespace flyball::solve::filters_test
