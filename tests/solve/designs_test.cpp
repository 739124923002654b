#include <cmath>
#include <numbers>

#include "answers.hpp"

namespace flyball::solve::designs_test {
namespace {

// The public functions' own words.
TEST(SolveDesigns, Lqr) {
  const Json discrete =
      answer("lqr", R"({"A":[[2]],"B":[[1]],"Q":[[1]],"R":[[1]],"domain":"discrete","N":[[0]]})");
  EXPECT_NEAR(entry(discrete, "S"), 2.0 + std::sqrt(5.0), 1e-14);
  EXPECT_NEAR(entry(discrete, "K"), 0.5 + 0.5 * std::sqrt(5.0), 1e-14);
  const Json none = answer("lqr", R"({"A":[[1]],"B":[[0]],"Q":[[1]],"R":[[1]]})");
  EXPECT_EQ(none.at("error").at("code"), "not_stabilizable");
  EXPECT_TRUE(none.at("error").at("message").get<std::string>().starts_with("continuous_lqr: "))
      << none;
  EXPECT_EQ(refusal("lqr", R"({"A":[[1]],"B":[[1]],"Q":[[1]],"R":[[1]],"T":-1})"), "not_positive");
  EXPECT_EQ(refusal("lqr", R"({"A":[[1]],"B":[[1]],"Q":[[1]],"R":[[1]],"domain":"z"})"),
            "unknown_name");
}

TEST(SolveDesigns, PlaceIsRefused) {
  EXPECT_EQ(refusal("place", R"({"A":[[0,1],[0,0]],"B":[[0],[1]],"poles":[[-1,1],[-2,1]]})"),
            "not_conjugate");
  EXPECT_EQ(refusal("place", R"({"A":[[1]],"B":[[0]],"poles":[-1]})"), "not_controllable");
  EXPECT_EQ(refusal("place", R"({"A":[[1]],"B":[[1]],"poles":[-1,-2]})"), "wrong_shape");
}

// dx/dt = u with Q = R = 1: the poles are the stable roots of s⁴ - s² + 1, s² + √3 s + 1.
// How far a pole is from its place is part of the answer; three equal ones and one input are moved
// by the cube root of rounding.
TEST(SolveDesigns, PlaceSaysWhatWasReached) {
  const Json placed =
      answer("place", R"({"A":[[0,1,0],[0,0,1],[0,0,0]],"B":[[0],[0],[1]],"poles":[-7,-7,-7]})");
  EXPECT_GT(placed.at("pole_error").get<double>(), 0.0);
  EXPECT_LT(placed.at("pole_error").get<double>(), 1e-4);
}

TEST(SolveDesigns, KalmanIsRefusedInItsOwnWords) {
  const Json negative = answer("kalman", R"({"A":[[0.5]],"C":[[1]],"Q":[[1]],"R":[[-0.1]]})");
  EXPECT_EQ(negative.at("error").at("code"), "not_positive");
  const Json unseen =
      answer("kalman", R"({"A":[[1.5,0],[0,0.5]],"C":[[0,1]],"Q":[[1,0],[0,1]],"R":[[1]]})");
  EXPECT_EQ(unseen.at("error").at("code"), "not_detectable");
  EXPECT_EQ(unseen.at("error").at("eigenvalue").at(0), 1.5);
}

// (z + 0.5)² of A - LC with A = [1 1; 0 1]: l₁ = 3, l₂ = 2.25; and K = A⁻¹L = [0.75; 2.25].
TEST(SolveDesigns, PlaceObserver) {
  const std::string plant = R"({"A":[[1,1],[0,1]],"C":[[1,0]],"poles":[-0.5,-0.5])";
  const Json discrete = answer("place_observer", plant + R"(,"domain":"discrete"})");
  EXPECT_NEAR(discrete.at("L").at(0).at(0).get<double>(), 3.0, 1e-12);
  EXPECT_NEAR(discrete.at("K").at(0).at(0).get<double>(), 0.75, 1e-12);
  EXPECT_FALSE(answer("place_observer", plant + "}").contains("K"));
  EXPECT_EQ(refusal("place_observer", R"({"A":[[1,1],[0,1]],"C":[[0,1]],"poles":[-0.5,-0.5]})"),
            "not_observable");
}

// By hand in tests/estimation/smoother_test.cpp: x = 7/8, 7/4, 11/8.
TEST(SolveDesigns, Smooth) {
  const std::string scalar = R"({"A":1,"Q":1,"R":1,"P0":1,"y":[3,1])";
  const Json smoothed = answer("smooth", scalar + "}");
  EXPECT_NEAR(smoothed.at("x").at(0).at(0).get<double>(), 0.875, 1e-14);
  EXPECT_NEAR(smoothed.at("x").at(1).at(0).get<double>(), 1.75, 1e-14);
  EXPECT_NEAR(smoothed.at("P").at(1).at(0).at(0).get<double>(), 0.5, 1e-14);
  EXPECT_NEAR(smoothed.at("nis").at(1).get<double>(), 0.375, 1e-14);
  EXPECT_NEAR(answer("smooth", scalar + R"(,"added":[3,-1]})").at("nis").at(0).get<double>(), 0.0,
              1e-14);
  EXPECT_EQ(refusal("smooth", R"({"A":1,"Q":-1,"R":1,"P0":1,"y":[3,1]})"), "not_positive");
}

// (9.11), (9.12): 2 ± 2 and 5 ± 1 make 4.4 with the variance 0.8.
TEST(SolveDesigns, Bayes) {
  const Json fused = answer("bayes", R"({"mean":[2],"covariance":4,"R":1,"y":[5]})");
  EXPECT_NEAR(fused.at("mean").at(0).get<double>(), 4.4, 1e-14);
  EXPECT_NEAR(entry(fused, "covariance"), 0.8, 1e-14);
  EXPECT_EQ(refusal("bayes", R"({"mean":[2],"covariance":0,"y":[5]})"), "contradiction");
}

TEST(SolveDesigns, Lqi) {
  const std::string plant = R"({"A":[[0]],"B":[[1]],"C":[[1]],"Q":[[1,0],[0,1]],"R":[[1]])";
  const Json continuous = answer("lqi", plant + "}");
  EXPECT_NEAR(entry(continuous, "K"), std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(entry(continuous, "K_I"), -1.0, 1e-14);
  EXPECT_EQ(continuous.at("S").size(), 2U);
  // Sampled by the tool or by hand: the same.
  const Json sampled = answer("lqi", plant + R"(,"T":0.1})");
  const Json by_hand = answer("lqi", R"({"A":[[1]],"B":[[0.1]],"C":[[1]],"Q":[[1,0],[0,1]],)"
                                     R"("R":[[1]],"domain":"discrete","T":0.1})");
  EXPECT_NEAR(entry(sampled, "K_I"), entry(by_hand, "K_I"), 1e-13);
  EXPECT_EQ(refusal("lqi", plant + R"(,"domain":"discrete"})"), "malformed");
  EXPECT_EQ(refusal("lqi", R"({"A":[[-1]],"B":[[1]],"C":[[0]],"Q":[[1,0],[0,1]],"R":[[1]]})"),
            "not_trackable");
  const Json shape = answer("lqi", R"({"A":[[-1]],"B":[[1]],"C":[[1]],"Q":[[1]],"R":[[1]]})");
  EXPECT_EQ(shape.at("error").at("message"),
            "lqi: Q is 1x1; it must be states + outputs x states + outputs (2x2)");
}

// By hand: S₂ = 1, K₁ = 1/2, S₁ = 3/2, K₀ = 3/5, S₀ = 8/5. Continuous: S(t) = tanh(1 - t).
TEST(SolveDesigns, FiniteHorizon) {
  const std::string plant = R"({"A":[[1]],"B":[[1]],"Q":[[1]],"R":[[1]],"S_end":[[1]])";
  const Json discrete = answer("finite-horizon-lqr", plant + R"(,"steps":2,"domain":"discrete"})");
  EXPECT_EQ(discrete.at("K").size(), 2U);
  EXPECT_NEAR(discrete.at("K").at(0).at(0).at(0).get<double>(), 0.6, 1e-15);
  EXPECT_NEAR(discrete.at("S").at(0).at(0).at(0).get<double>(), 1.6, 1e-15);
  EXPECT_EQ(discrete.at("S").at(2).at(0).at(0).get<double>(), 1.0);
  const Json continuous = answer(
      "finite-horizon-lqr",
      R"({"A":[[0]],"B":[[1]],"Q":[[1]],"R":[[1]],"S_end":[[0]],"steps":4,"horizon":1,"domain":"continuous"})");
  EXPECT_EQ(continuous.at("S").size(), 5U);
  EXPECT_NEAR(continuous.at("S").at(0).at(0).at(0).get<double>(), std::tanh(1.0), 1e-14);
  EXPECT_NEAR(continuous.at("K").at(2).at(0).at(0).get<double>(), std::tanh(0.5), 1e-14);
  EXPECT_EQ(refusal("finite-horizon-lqr", plant + R"(,"steps":2,"domain":"continuous"})"),
            "malformed");
  EXPECT_EQ(refusal("finite-horizon-lqr", plant + R"(,"steps":0,"domain":"discrete"})"),
            "out_of_range");
  EXPECT_EQ(refusal("finite-horizon-lqr", plant + R"(,"steps":1e9,"domain":"discrete"})"),
            "out_of_range");
  EXPECT_EQ(
      refusal(
          "finite-horizon-lqr",
          R"({"A":[[1]],"B":[[0]],"Q":[[1]],"R":[[0]],"S_end":[[1]],"steps":1,"domain":"discrete"})"),
      "singular");
}

// 0.9 - 0.1 K = 0.7, 0.1 K_u = 0.3.
TEST(SolveDesigns, ImplicitModelFollowing) {
  const std::string models =
      R"({"A":[[0.9]],"B":[[0.1]],"A_ref":[[0.7]],"B_ref":[[0.3]],"Q":[[1]])";
  const Json followed = answer("implicit-model-following", models + R"(,"R":[[0]]})");
  EXPECT_NEAR(entry(followed, "K"), 2.0, 1e-12);
  EXPECT_NEAR(entry(followed, "K_u"), 3.0, 1e-12);
  EXPECT_NEAR(number(followed, "mismatch"), 0.0, 1e-13);
  EXPECT_NEAR(entry(followed, "Q"), 0.04, 1e-15);  // (A - A_ref)ᵀQ(A - A_ref)
  EXPECT_EQ(
      refusal("implicit-model-following",
              R"({"A":[[0.9]],"B":[[0]],"A_ref":[[0.7]],"B_ref":[[0.3]],"Q":[[1]],"R":[[0]]})"),
      "singular");
  EXPECT_EQ(refusal("implicit-model-following", models + R"(,"R":[[1]],"C":[[1],[1]]})"),
            "wrong_shape");
}

// (BᵀB + R)⁻¹Bᵀ of B = [0; 2].
TEST(SolveDesigns, PlantInversion) {
  const std::string plant = R"({"A":[[1,0.1],[0,1]],"B":[[0],[2]])";
  expect_matrix(answer("plant-inversion", plant + "}"), "K_ff", {{0.0, 0.5}});
  expect_matrix(answer("plant-inversion", plant + R"(,"R":[[1]]})"), "K_ff", {{0.0, 0.4}});
  expect_matrix(answer("plant-inversion", plant + R"(,"Q":[[1,0],[0,2]],"R":[[2]]})"), "K_ff",
                {{0.0, 0.4}});
  EXPECT_EQ(refusal("plant-inversion", R"({"A":[[1]],"B":[[0]],"Q":[[1]]})"), "singular");
  EXPECT_EQ(refusal("plant-inversion", plant + R"(,"Q":[[1]]})"), "wrong_shape");
}

// 0 = -2x + 3u; x = x/2 + u.
TEST(SolveDesigns, SteadyStateFeedforward) {
  const std::string plant = R"({"A":[[-2]],"B":[[3]],"C":[[1]])";
  const Json continuous = answer("steady-state-feedforward", plant + "}");
  EXPECT_NEAR(entry(continuous, "N_x"), 1.0, 1e-15);
  EXPECT_NEAR(entry(continuous, "N_u"), 2.0 / 3.0, 1e-15);
  EXPECT_NEAR(entry(continuous, "K_ff"), 2.0 / 3.0, 1e-15);
  EXPECT_NEAR(
      entry(answer("steady-state-feedforward", R"({"A":[[0.5]],"B":[[1]],"domain":"discrete"})"),
            "K_ff"),
      0.5, 1e-15);
  EXPECT_NEAR(entry(answer("steady-state-feedforward", plant + R"(,"pairs":[0]})"), "K_ff"),
              2.0 / 3.0, 1e-15);
  EXPECT_EQ(refusal("steady-state-feedforward", plant + R"(,"pairs":[5]})"), "out_of_range");
  EXPECT_EQ(refusal("steady-state-feedforward", plant + R"(,"pairs":[0.5]})"), "malformed");
  EXPECT_EQ(refusal("steady-state-feedforward", plant + R"(,"pairs":[0,0]})"), "wrong_shape");
  EXPECT_EQ(refusal("steady-state-feedforward", R"({"A":[[-1]],"B":[[1]],"C":[[0]]})"),
            "no_steady_state");
}

// A period late: K(A - BK) = 0.5, and KA at the first step. Continuous: 2e^{-2 delay}.
TEST(SolveDesigns, DelayCompensation) {
  const std::string sampled =
      R"({"K":[[1]],"A":[[1]],"B":[[0.5]],"T":0.1,"domain":"discrete","delay":)";
  const Json discrete = answer("delay-compensation", sampled + "0.1}");
  EXPECT_NEAR(entry(discrete, "K"), 0.5, 1e-15);
  EXPECT_EQ(discrete.at("start").size(), 2U);
  EXPECT_NEAR(discrete.at("start").at(0).at(0).at(0).get<double>(), 1.0, 1e-15);
  const Json continuous =
      answer("delay-compensation", R"({"K":[[2]],"A":[[0]],"B":[[1]],"delay":0.5})");
  EXPECT_NEAR(entry(continuous, "K"), 2.0 * std::exp(-1.0), 1e-15);
  EXPECT_FALSE(continuous.contains("start"));
  EXPECT_EQ(refusal("delay-compensation", sampled + "-1}"), "out_of_range");
  EXPECT_EQ(
      refusal("delay-compensation",
              R"({"K":[[1]],"A":[[1]],"B":[[1.5]],"T":0.1,"domain":"discrete","delay":0.05})"),
      "no_real_power");
}

// dx/dt = u under u = -5x each 0.1 s: L = 0.5/(z - 1). Stable up to 2/0.5; |L| = 1 at
// 2 sin(ωT/2) = 0.5, where the phase is 90° + ωT/2 behind.
TEST(SolveDesigns, Margins) {
  const std::string plant = R"({"A":[[0]],"B":[[1]],"K":[[5]],"T":0.1)";
  const Json margins = answer("margins", plant + "}");
  EXPECT_TRUE(margins.at("stable").get<bool>());
  EXPECT_NEAR(number(margins, "spectral_radius"), 0.5, 1e-14);
  EXPECT_NEAR(number(margins, "gain_margin_up"), 4.0, 1e-9);
  const double half = std::asin(0.25);
  EXPECT_NEAR(number(margins, "phase_margin"), 90.0 - half * 180.0 / std::numbers::pi, 1e-8);
  EXPECT_NEAR(margins.at("gain_crossovers").at(0).get<double>(), 2.0 * half / 0.1, 1e-9);
  const Json late = answer("margins", plant + R"(,"delay":0.05})");
  EXPECT_LT(number(late, "phase_margin"), number(margins, "phase_margin"));
  const Json observed = answer("margins", plant + R"(,"C":[[1]],"K_e":[[0.5]]})");
  EXPECT_TRUE(observed.at("stable").get<bool>());
  EXPECT_FALSE(answer("margins", R"({"A":[[0]],"B":[[1]],"K":[[25]],"T":0.1})").at("stable"));
  EXPECT_EQ(refusal("margins", plant + R"(,"C":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("margins", plant + R"(,"K_e":[[1]]})"), "malformed");
  EXPECT_EQ(refusal("margins", plant + R"(,"delay":-1})"), "out_of_range");
  EXPECT_EQ(refusal("margins", plant + R"(,"delay":51})"), "out_of_range");
  EXPECT_EQ(refusal("margins", R"({"A":[[0]],"B":[[1]],"K":[[5]],"T":0})"), "not_positive");
  EXPECT_EQ(refusal("margins", R"({"A":[[0]],"B":[[1,1]],"K":[[25]],"T":0.1})"), "wrong_shape");
}

// 0.6 K_u, T_u/2, T_u/8; K_u/3.2, 2.2 T_u.
TEST(SolveDesigns, PidOfAnUltimatePoint) {
  const std::string point = R"({"ultimate_gain":8,"ultimate_period":2)";
  const Json pid = answer("pid-ultimate", point + "}");
  EXPECT_NEAR(number(pid, "kp"), 4.8, 1e-14);
  EXPECT_NEAR(number(pid, "ki"), 4.8, 1e-14);
  EXPECT_NEAR(number(pid, "kd"), 1.2, 1e-14);
  const Json calm = answer("pid-ultimate", point + R"(,"rule":"tyreus-luyben","form":"pi"})");
  EXPECT_NEAR(number(calm, "kp"), 2.5, 1e-14);
  EXPECT_NEAR(number(calm, "ki"), 2.5 / 4.4, 1e-14);
  EXPECT_EQ(number(answer("pid-ultimate", point + R"(,"form":"p"})"), "kp"), 4.0);
  EXPECT_NEAR(number(answer("pid-ultimate", point + R"(,"form":"pd"})"), "kd"), 6.4 * 0.25, 1e-14);
  EXPECT_EQ(refusal("pid-ultimate", point + R"(,"rule":"ziegler-nicols"})"), "unknown_name");
  EXPECT_EQ(refusal("pid-ultimate", R"({"ultimate_gain":0,"ultimate_period":2})"), "not_positive");
  EXPECT_EQ(refusal("pid-ultimate", R"({"ultimate_gain":[8],"ultimate_period":2})"), "malformed");
}

// ρ = 0.1: (0.9 + ρ/12) τ/(Kθ), θ(30 + 3ρ)/(9 + 20ρ); 1.2 τ/(Kθ); τ/(K 2θ), min(τ, 8θ).
TEST(SolveDesigns, PidOfAReactionCurve) {
  const std::string curve = R"({"gain":2,"time_constant":10,"delay":1)";
  const Json cohen = answer("pid-reaction", curve + R"(,"rule":"cohen-coon","form":"pi"})");
  const double kp = 5.0 * (0.9 + 0.1 / 12.0);
  EXPECT_NEAR(number(cohen, "kp"), kp, 1e-14);
  EXPECT_NEAR(number(cohen, "ki"), kp * 11.0 / 30.3, 1e-14);
  EXPECT_NEAR(number(answer("pid-reaction", curve + "}"), "kp"), 6.0, 1e-14);
  const Json simc = answer("pid-reaction", curve + R"(,"rule":"simc","form":"pi"})");
  EXPECT_NEAR(number(simc, "kp"), 2.5, 1e-14);
  EXPECT_NEAR(number(simc, "ki"), 2.5 / 8.0, 1e-14);
  const Json slow =
      answer("pid-reaction", curve + R"(,"rule":"simc","form":"pi","closed_loop_time":4})");
  EXPECT_NEAR(number(slow, "kp"), 1.0, 1e-14);
  EXPECT_EQ(refusal("pid-reaction", R"({"gain":2,"time_constant":10,"delay":0})"), "not_positive");
  EXPECT_EQ(refusal("pid-reaction", curve + R"(,"rule":"simc","closed_loop_time":-1})"),
            "out_of_range");
}

// A ramp from 0 to 2 in a second: 1 - e^{-1/3} and 1 - e^{-1} of the way after as many seconds, and
// τ is 1.5 times what lies between, θ what is left of the later time.
TEST(SolveDesigns, ReactionCurve) {
  const std::string times = R"({"times":[0,1,2,3,4,5,6,7,8,9],"input_step":4,"values":)";
  const Json curve = answer("reaction-curve", times + "[0,2,2,2,2,2,2,2,2,2]}");
  EXPECT_NEAR(number(curve, "gain"), 0.5, 1e-15);
  const double tau = 1.5 * (std::exp(-1.0 / 3.0) - std::exp(-1.0));
  EXPECT_NEAR(number(curve, "time_constant"), tau, 1e-14);
  EXPECT_NEAR(number(curve, "delay"), 1.0 - std::exp(-1.0) - tau, 1e-14);
  EXPECT_EQ(refusal("reaction-curve", times + "[1,1,1,1,1,1,1,1,1,1]}"), "no_reaction");
  EXPECT_EQ(refusal("reaction-curve", times + "[0,1]}"), "wrong_shape");
  EXPECT_EQ(refusal("reaction-curve", times + "[[0,1]]}"), "malformed");
  EXPECT_EQ(refusal("reaction-curve", R"({"times":[0,1],"values":[0,1],"input_step":4})"),
            "wrong_shape");
  EXPECT_EQ(refusal("reaction-curve", R"({"times":[],"values":[],"input_step":4})"), "empty");
  EXPECT_EQ(refusal("reaction-curve", R"({"times":3,"values":[],"input_step":4})"), "malformed");
}

// s² + 2ζωs + ω² of dv/dt = -2v + 3u with ω = 6, ζ = 0.7.
TEST(SolveDesigns, PidByPoles) {
  const std::string loop = R"(,"natural_frequency":6,"damping_ratio":0.7})";
  const Json position = answer("pid-by-poles", R"({"A":[[0,1],[0,-2]],"B":[[0],[3]])" + loop);
  EXPECT_NEAR(number(position, "kp"), 12.0, 1e-14);
  EXPECT_NEAR(number(position, "kd"), 6.4 / 3.0, 1e-14);
  EXPECT_EQ(number(position, "ki"), 0.0);
  const Json velocity = answer("pid-by-poles", R"({"A":[[-2]],"B":[[3]])" + loop);
  EXPECT_NEAR(number(velocity, "kp"), 6.4 / 3.0, 1e-14);
  EXPECT_NEAR(number(velocity, "ki"), 12.0, 1e-14);
  EXPECT_EQ(refusal("pid-by-poles", R"({"A":[[0,1,0],[0,0,1],[0,0,0]],"B":[[0],[0],[1]])" + loop),
            "wrong_shape");
  EXPECT_EQ(refusal("pid-by-poles", R"({"A":[[-2]],"B":[[0]])" + loop), "not_positive");
}

// Sixteenths of the period are zero: the search for the delay margin ends all the same.
TEST(SolveDesigns, MarginsOfASubnormalPeriod) {
  const Json margins = answer(
      "margins",
      R"({"A":[[-3]],"B":[[0]],"C":[[1.8],[0]],"K":[[0.7]],"K_e":[[1e-8,-22000]],"T":5e-324})");
  EXPECT_EQ(margins.at("gain_crossovers").size(), 0u);
}

// On its reference Ramsete asks for the reference's own speeds; 0.2 m to the left of a straight
// path V = b e_y²/2 and ω = -b v 0.2.
TEST(SolveDesigns, Ramsete) {
  const Json there =
      answer("ramsete", R"({"pose":[1,2,0.5],"reference":[1,2,0.5],"v":1.5,"omega":0.3})");
  EXPECT_EQ(there.at("v"), 1.5);
  EXPECT_EQ(there.at("omega"), 0.3);
  EXPECT_EQ(there.at("V"), 0.0);
  const Json off = answer("ramsete", R"({"pose":[0,0.2,0],"reference":[0,0,0],"v":1.5,"omega":0})");
  EXPECT_NEAR(off.at("omega").get<double>(), -2.0 * 1.5 * 0.2, 1e-15);
  EXPECT_NEAR(off.at("V").get<double>(), 0.04, 1e-15);
  EXPECT_EQ(refusal("ramsete", R"({"pose":[0,0],"reference":[0,0,0],"v":1,"omega":0})"),
            "wrong_shape");
  EXPECT_EQ(refusal("ramsete", R"({"pose":[0,0,0],"reference":[0,0,0],"v":1,"omega":0,"b":-1})"),
            "not_positive");
}

// Each gain is the discrete LQR's of what it is of: an integrator's by the root of its equation,
// (k T)² / (1 - k T) = T² u²/x².
TEST(SolveDesigns, FollowersGains) {
  const Json holonomic = answer(
      "holonomic-follower", R"({"pose":[0,0.2,0],"reference":[0,0,0],"v":1,"omega":0,"T":0.02})");
  const double kT = 0.02 * holonomic.at("gains").at(1).get<double>();
  EXPECT_NEAR(kT * kT / (1.0 - kT), 0.02 * 0.02 * 10.0 * 10.0, 1e-12);
  EXPECT_NEAR(holonomic.at("vy").get<double>(), -0.2 * kT / 0.02, 1e-12);
  const Json unicycle = answer("ltv-unicycle", R"({"v":1.5})");
  EXPECT_EQ(unicycle.at("K").at(0).at(1), 0.0);
  const Json drive = answer(
      "ltv-differential-drive",
      R"({"kV":3.02,"kA":0.642,"kV_angular":1.382,"kA_angular":0.08495,"trackwidth":0.9,"v":1.5})");
  ASSERT_EQ(drive.at("K").size(), 2U);
  ASSERT_EQ(drive.at("K").at(0).size(), 5U);
  // The right side's is the left one's mirror image.
  EXPECT_NEAR(drive.at("K").at(0).at(1).get<double>(), -drive.at("K").at(1).at(1).get<double>(),
              1e-8);
  EXPECT_NEAR(drive.at("A").at(1).at(2).get<double>(), 1.5, 1e-15);
}

// κ = 2 y/d² of the point that is pursued, in the robot's frame.
TEST(SolveDesigns, PurePursuit) {
  const Json at = answer("pure-pursuit",
                         R"({"pose":[0,0.3,0],"path":[[0,0,0],[2,0,0]],"lookahead":0.4,"v":2})");
  EXPECT_NEAR(at.at("target").at(0).get<double>(), 0.4, 1e-15);
  EXPECT_NEAR(at.at("curvature").get<double>(), 2.0 * -0.3 / 0.25, 1e-12);
  EXPECT_NEAR(at.at("cross_track").get<double>(), 0.3, 1e-15);
  EXPECT_EQ(at.at("arrived"), false);
  EXPECT_EQ(refusal("pure-pursuit", R"({"pose":[0,0,0],"path":[[0,0,0]],"lookahead":0.4,"v":2})"),
            "empty");
}

}  // namespace
}  // namespace flyball::solve::designs_test
