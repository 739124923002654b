#include <cmath>
#include <sstream>

#include <flyball/core/random.hpp>

#include "answers.hpp"

// Regressions, spectra and models from records.
namespace flyball::solve::identification_test {
namespace {

// The line of `tests/math/regression/least_squares_test.cpp`.
TEST(SolveRegression, Line) {
  const std::string line = R"({"X":[[1,0],[1,1],[1,2],[1,3]],"y":[1,3,4,4])";
  const Json fit = answer("least-squares", line + "}");
  EXPECT_NEAR(fit.at("coefficients")[0].get<double>(), 1.5, 1e-15);
  EXPECT_NEAR(fit.at("standard_errors")[1].get<double>(), std::sqrt(0.1), 1e-15);
  EXPECT_EQ(fit.at("rank"), 2);
  EXPECT_EQ(answer("least-squares", line + R"(,"C":[[0,1]],"d":[2]})").at("coefficients")[1], 2.0);
  EXPECT_EQ(refusal("least-squares", line + R"(,"C":[[0,1]]})"), "malformed");
  EXPECT_EQ(refusal("least-squares", line + R"(,"confidence":2})"), "out_of_range");
  // A column twice: infinite errors, and the direction.
  const Json twice = answer("least-squares", R"({"X":[[1,1],[2,2],[3,3]],"y":[1,2,4]})");
  EXPECT_EQ(twice.at("standard_errors")[0], "inf");
  EXPECT_NEAR(entry(twice, "undetermined") + entry(twice, "undetermined", 1), 0.0, 1e-15);
  const Json bounded =
      answer("bounded-least-squares", R"({"X":[[1,0],[0,1]],"y":[-1,2],"upper":[5,1]})");
  EXPECT_EQ(bounded.at("coefficients"), Json({0.0, 1.0}));
  EXPECT_EQ(bounded.at("bound"), Json({-1.0, 1.0}));
}

// 1, 2, 3, 4: 10, -2 + 2i, -2, -2 - 2i.
TEST(SolveSpectra, Fft) {
  const Json transform = answer("fft", R"({"x":[1,2,3,4]})").at("X");
  EXPECT_NEAR(transform[0][0].get<double>(), 10.0, 1e-15);
  EXPECT_NEAR(transform[1][1].get<double>(), 2.0, 1e-15);
  EXPECT_NEAR(transform[3][1].get<double>(), -2.0, 1e-15);
  const Json back = answer("fft", R"({"x":[10,[-2,2],-2,[-2,-2]],"direction":"inverse"})").at("X");
  EXPECT_NEAR(back[2][0].get<double>(), 3.0, 1e-15);
}

TEST(SolveSpectra, FitOfALag) {
  // 1/(s + 1) at three frequencies.
  const Json fit = answer("fit-frequency-response",
                          R"({"frequency":[0,1,3],"G":[1,[0.5,-0.5],[0.1,-0.3]],"poles":1})");
  EXPECT_NEAR(entry(fit, "A"), -1.0, 1e-9);
  EXPECT_LT(number(fit, "fit_error"), 1e-9);
  EXPECT_EQ(refusal("fit-frequency-response", R"({"frequency":[0,1],"G":[1],"poles":1})"),
            "wrong_shape");
}

TEST(SolveSpectra, Signals) {
  const Json sequence = answer("prbs", R"({"bits":4,"amplitude":2})").at("u");
  ASSERT_EQ(sequence.size(), 15u);
  double sum = 0.0;
  for (const Json& value : sequence) {
    sum += value.get<double>();
  }
  EXPECT_EQ(std::abs(sum), 2.0);
  EXPECT_LT(number(answer("multisine", R"({"samples":64,"last":10})"), "crest_factor"), 1.75);
  EXPECT_EQ(refusal("chirp", R"({"samples":10,"T":1,"first":1,"last":4})"), "out_of_range");
}

/// A record of y⁺ = 0.8 y + u, with noise in y, as JSON.
std::string record(double noise) {
  Random random(3);
  std::ostringstream u;
  std::ostringstream y;
  double state = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double in = random.normal();
    u << (k > 0 ? "," : "") << in;
    y << (k > 0 ? "," : "") << state + random.normal(0.0, noise);
    state = 0.8 * state + in;
  }
  return R"({"u":[)" + u.str() + R"(],"y":[)" + y.str() + R"(],"T":0.1)";
}

TEST(SolveIdentification, OfALag) {
  const Json arx = answer("arx", record(0.0) + R"(,"a":1,"b":2,"delay":2,"select":"bic"})");
  EXPECT_NEAR(arx.at("a")[1].get<double>(), -0.8, 1e-3);
  const Json error = answer("prediction-error", record(0.3) + R"(,"f":1})");
  EXPECT_NEAR(entry(error, "f", 0, 1), -0.8, 0.03);
  EXPECT_NEAR(entry(error, "A"), 0.8, 0.03);
  EXPECT_NEAR(entry(error, "noise"), 0.09, 0.02);
  EXPECT_LT(number(error, "whiteness"), 1.2);
  const Json subspace = answer("subspace", record(0.3) + "}");
  EXPECT_EQ(subspace.at("order"), 1);
  EXPECT_NEAR(entry(subspace, "A"), 0.8, 0.04);
  EXPECT_NEAR(subspace.at("simulation_fit")[0].get<double>(), number(error, "simulation_fit"),
              0.01);
  EXPECT_EQ(refusal("subspace", record(0.3) + R"(,"order":100})"), "too_short");
  EXPECT_EQ(refusal("arx", record(0.3) + R"(,"a":-1})"), "out_of_range");
}

TEST(SolveIdentification, FrequencyResponse) {
  const Json estimate = answer("frequency-response", record(0.1) + R"(,"length":60})");
  // 1/(1 - 0.8) at rest, less what the stretches' ends cost.
  EXPECT_NEAR(estimate.at("real")[1][0][0].get<double>(), 4.0, 1.0);
  EXPECT_GT(estimate.at("coherence")[1][0].get<double>(), 0.9);
  const Json power = answer("power-spectrum", R"({"x":[1,-1,1,-1,1,-1,1,-1],"T":1,"length":4})");
  EXPECT_EQ(power.at("density").size(), 3u);
}

}  // namespace
}  // namespace flyball::solve::identification_test
