#include <cmath>
#include <complex>
#include <numbers>

#include "answers.hpp"

namespace flyball::solve::frequency_responses_test {
namespace {

// 2/(s + 1) + 3 as a transfer function and as matrices, at 1 rad/s: 4 - j.
TEST(SolveFrequencyResponses, ResponseOfEither) {
  const Json transfer = answer("freqresp", R"({"num":[3,5],"den":[1,1],"w":[1]})");
  const Json states = answer("freqresp", R"({"A":[[-1]],"B":[[2]],"C":[[1]],"D":[[3]],"w":[1]})");
  for (const Json& got : {transfer, states}) {
    EXPECT_NEAR(got.at("real").at(0).get<double>(), 4.0, 1e-15);
    EXPECT_NEAR(got.at("imag").at(0).get<double>(), -1.0, 1e-15);
    EXPECT_NEAR(got.at("gain_db").at(0).get<double>(), 10.0 * std::log10(17.0), 1e-13);
  }
  // diag(1/(s + 1), 4/(s + 2)) at rest.
  const Json two =
      answer("freqresp", R"({"A":[[-1,0],[0,-2]],"B":[[1,0],[0,4]],"C":[[1,0],[0,1]],"w":[0]})");
  EXPECT_NEAR(two.at("G_real").at(0).at(1).at(1).get<double>(), 2.0, 1e-15);
  EXPECT_NEAR(two.at("singular_values").at(0).at(0).get<double>(), 2.0, 1e-15);
  EXPECT_NEAR(two.at("singular_values").at(0).at(1).get<double>(), 1.0, 1e-15);
  EXPECT_EQ(refusal("freqresp", R"({"num":[1],"w":[1]})"), "malformed");
  EXPECT_EQ(refusal("freqresp", R"({"w":[1]})"), "malformed");
  EXPECT_EQ(refusal("freqresp", R"({"num":[1],"den":[1,1],"A":[[1]],"w":[1]})"), "malformed");
  EXPECT_EQ(refusal("freqresp", R"({"num":[1],"den":[1,1],"dt":0.1,"w":[40]})"), "out_of_range");
  EXPECT_EQ(refusal("freqresp", R"({"num":[1],"den":[1,0],"w":[1,0]})"), "at_a_pole");
  EXPECT_EQ(refusal("freqresp", R"({"A":[[0,1],[-1,0]],"B":[[0],[1]],"C":[[1,0]],"w":[1]})"),
            "at_a_pole");
}

TEST(SolveFrequencyResponses, BodeAndNyquist) {
  const Json bode = answer("bode", R"({"num":[1],"den":[1,-1,0],"w":[1]})");
  EXPECT_NEAR(bode.at("phase").at(0).get<double>(), -225.0, 1e-12);
  EXPECT_NEAR(bode.at("gain").at(0).get<double>(), std::sqrt(0.5), 1e-15);
  EXPECT_GT(answer("bode", R"({"num":[1],"den":[1,0.01,1]})").at("w").size(), 50U);
  // 10/(s + 1)³: two poles have crossed.
  const Json nyquist = answer("nyquist", R"({"num":[10],"den":[1,3,3,1]})");
  EXPECT_EQ(number(nyquist, "encirclements"), 2.0);
  EXPECT_EQ(number(nyquist, "closed_loop_unstable"), 2.0);
  EXPECT_TRUE(answer("nyquist", R"({"num":[8],"den":[1,3,3,1]})").at("encirclements").is_null());
}

// 10/(s (s + 1) (s + 2)): at √2 rad/s the gain is 10/6. As states, and of two such channels.
TEST(SolveFrequencyResponses, Margins) {
  const Json transfer = answer("margins", R"({"num":[10],"den":[1,3,2,0]})");
  EXPECT_NEAR(number(transfer, "gain_margin"), 0.6, 1e-12);
  EXPECT_FALSE(transfer.at("stable").get<bool>());
  EXPECT_EQ(number(transfer, "unstable_poles"), 2.0);
  const Json states = answer(
      "margins", R"({"A":[[0,1,0],[0,0,1],[0,-2,-3]],"B":[[0],[0],[1]],"C":[[1,0,0]],"delay":0})");
  EXPECT_NEAR(number(states, "gain_margin"), 6.0, 1e-9);
  EXPECT_NEAR(states.at("gain_margins").at(0).at("w").get<double>(), std::sqrt(2.0), 1e-9);
  const Json two =
      answer("margins", R"({"A":[[-1,0],[0,-1]],"B":[[1,0],[0,2]],"C":[[1,0],[0,1]]})");
  EXPECT_TRUE(two.at("stable").get<bool>());
  EXPECT_EQ(two.at("channels").size(), 2U);
  // T of the second is 2/(s + 3).
  EXPECT_NEAR(two.at("complementary_peak").at("Ms").get<double>(), 2.0 / 3.0, 1e-9);
  // The loop of sampled feedback as before.
  const Json sampled =
      answer("margins", R"({"A":[[0,1],[0,-2]],"B":[[0],[3]],"K":[[20,3]],"T":0.02})");
  EXPECT_TRUE(sampled.at("stable").get<bool>());
  EXPECT_GT(number(sampled, "gain_margin_up"), 1.0);
  EXPECT_EQ(refusal("margins", R"({"A":[[0,1],[0,-2]],"B":[[0],[3]],"K":[[20,3]]})"), "malformed");
}

TEST(SolveFrequencyResponses, NonlinearLoops) {
  const Json gain =
      answer("describing-function", R"({"nonlinearity":"relay","height":3,"amplitude":[2]})");
  EXPECT_NEAR(gain.at("real").at(0).get<double>(), 6.0 / std::numbers::pi, 1e-14);
  const Json cycles =
      answer("limit-cycles", R"({"nonlinearity":"relay","height":3,"num":[1],"den":[1,2,1,0]})");
  EXPECT_NEAR(cycles.at("cycles").at(0).at("amplitude").get<double>(), 6.0 / std::numbers::pi,
              1e-9);
  EXPECT_NEAR(cycles.at("cycles").at(0).at("w").get<double>(), 1.0, 1e-9);
  EXPECT_EQ(cycles.at("cycles").at(0).at("stable").get<double>(), 1.0);
}

TEST(SolveFrequencyResponses, NormAndDiscretizations) {
  // 2/(s - 1) has the gain 2 at rest.
  EXPECT_NEAR(
      number(answer("linf-norm", R"({"A":[[1]],"B":[[2]],"C":[[1]],"domain":"continuous"})"),
             "norm"),
      2.0, 1e-9);
  EXPECT_EQ(refusal("linf-norm", R"({"A":[[0]],"B":[[1]],"C":[[1]],"domain":"continuous"})"),
            "not_stable");
  const Json all =
      answer("discretizations", R"({"A":[[-10]],"B":[[10]],"C":[[1]],"T":0.01,"w":[1,10,50]})");
  // s = (2/T) j tan(ωT/2) at 50 rad/s.
  const std::complex<double> s(0.0, 200.0 * std::tan(0.25));
  const std::complex<double> ratio =
      10.0 / (s + 10.0) / (10.0 / (std::complex<double>(0.0, 50.0) + 10.0));
  EXPECT_NEAR(all.at("largest_error").at("tustin").get<double>(), std::abs(ratio - 1.0), 1e-9);
  EXPECT_EQ(all.at("stable").at("forward-euler").get<double>(), 1.0);
  EXPECT_EQ(all.at("gain_error").size(), 3U);
}

}  // namespace
}  // namespace flyball::solve::frequency_responses_test
