#include <cmath>
#include <vector>

#include <flyball/core/random.hpp>

#include "answers.hpp"
#include "math/exponential/extended_function.hpp"

namespace flyball::solve::systems_test {
namespace {

// 1/(s + 1): ∫e^{-2t} dt = 1/2. 4/(s² + 2s + 4): ω/(4ζ) = 1. x⁺ = x/2 + u: Σ 4^{-k} = 4/3.
TEST(SolveSystems, H2Norm) {
  EXPECT_NEAR(number(answer("h2-norm", R"({"A":[[-1]],"B":[[1]]})"), "norm"), std::sqrt(0.5),
              1e-15);
  EXPECT_NEAR(
      number(answer("h2-norm", R"({"A":[[0,1],[-4,-2]],"B":[[0],[4]],"C":[[1,0]]})"), "norm"), 1.0,
      1e-14);
  EXPECT_NEAR(number(answer("h2-norm", R"({"A":[[0.5]],"B":[[1]],"domain":"discrete"})"), "norm"),
              std::sqrt(4.0 / 3.0), 1e-14);
  EXPECT_EQ(refusal("h2-norm", R"({"A":[[1]],"B":[[1]]})"), "not_stable");
  EXPECT_EQ(refusal("h2-norm", R"({"A":[[-1]],"B":[[1]],"D":[[1]]})"), "infinite_norm");
  EXPECT_EQ(refusal("h2-norm", R"({"A":[[0.5]],"B":[[1]],"domain":"discrete","T":0})"),
            "not_positive");
}

// An answer that overflows is no answer; where infinity says something it stays.
TEST(SolveSystems, WhatOverflowsIsRefused) {
  EXPECT_EQ(refusal("steady-state-feedforward", R"({"A":[[1]],"B":[[1e-310]],"C":[[1]]})"),
            "overflow");
  const Json inverse = answer("steady-state-feedforward", R"({"A":[[1]],"B":[[1e200]],"C":[[1]]})");
  EXPECT_NEAR(1e200 * entry(inverse, "N_u"), -1.0, 1e-15);
  const Json analysis =
      answer("analyze", R"({"A":[[-1]],"B":[[0]],"C":[[1]],"domain":"continuous"})");
  EXPECT_EQ(analysis.at("controllability_condition"), "inf");
}

// A CIM motor's speed: 80-digit Lyapunov solutions (tests/data has the same motor).
TEST(SolveSystems, H2NormAndGramiansOfAMotor) {
  const std::string motor =
      R"({"A":[[-1.0865134431916739,5606.492380126379],[-78.69565217391305,-392.17391304347825]],)"
      R"("B":[[0],[4347.826086956522]],"C":[[1,0]],"domain":"continuous"})";
  EXPECT_NEAR(number(answer("h2-norm", motor), "norm"), 1307.9094561502739, 1e-9);
  const Json gramians = answer("gramians", motor);
  EXPECT_NEAR(entry(gramians, "Wc"), 1710627.1454873052, 1e-6);
  EXPECT_NEAR(gramians.at("hankel_singular_values").at(1).get<double>(), 34.835900389443196, 1e-11);
}

// 4/(s² + 0.4 s + 4), ζ = 0.1: the peak 1/(2ζ√(1 - ζ²)) at ω√(1 - 2ζ²).
TEST(SolveSystems, HInfinityNorm) {
  const Json peak = answer("hinf-norm", R"({"A":[[0,1],[-4,-0.4]],"B":[[0],[4]],"C":[[1,0]]})");
  EXPECT_NEAR(number(peak, "norm"), 1.0 / (0.2 * std::sqrt(0.99)), 1e-9);
  EXPECT_NEAR(number(peak, "frequency"), 2.0 * std::sqrt(0.98), 1e-5);
  EXPECT_GE(number(peak, "upper_bound"), number(peak, "norm"));
  // A discrete one's frequency is in rad/s: 1/(z + 0.5) is largest at z = -1, π/T.
  const Json alternating =
      answer("hinf-norm", R"({"A":[[-0.5]],"B":[[1]],"domain":"discrete","T":0.1})");
  EXPECT_NEAR(number(alternating, "norm"), 2.0, 1e-9);
  EXPECT_NEAR(number(alternating, "frequency"), std::acos(-1.0) / 0.1, 1e-6);
  EXPECT_EQ(refusal("hinf-norm", R"({"A":[[0]],"B":[[1]]})"), "not_stable");
}

// x yᵀ with Σ |x_i y_i| = 1 + 6 + 12; [0 1; -1 0] bears every real number; 1/(s + 1) and its
// performance as a sum of two, 0.5 + 0.25 at s = 0.
TEST(SolveSystems, StructuredSingularValue) {
  const Json sum =
      answer("mu", R"({"M":[[1,2,4],[3,6,12],[3,6,12]],"blocks":["complex","real","full 1x1"]})");
  EXPECT_NEAR(number(sum, "lower"), 19.0, 1e-5);
  EXPECT_NEAR(number(sum, "upper"), 19.0, 1e-5);
  EXPECT_FALSE(sum.contains("frequency"));
  const Json none = answer("mu", R"({"M":[[0,1],[-1,0]],"blocks":["real 2"]})");
  EXPECT_EQ(number(none, "upper"), 0.0);
  const Json turned = answer("mu", R"({"M":[[0]],"M_imag":[[3]],"blocks":["complex"]})");
  EXPECT_NEAR(turned.at("delta_imag").at(0).at(0).get<double>(), -1.0 / 3.0, 1e-9);
  const Json both = answer("mu", R"({"A":[[-1]],"B":[[1,1]],"C":[[0.5],[0.25]],)"
                                 R"("blocks":["real","full 1x1"],"question":"performance"})");
  EXPECT_NEAR(number(both, "lower"), 0.75, 1e-6);
  EXPECT_NEAR(number(both, "upper"), 0.75, 1e-3);
  EXPECT_NEAR(number(both, "stability_upper"), 0.5, 1e-3);
  EXPECT_EQ(number(both, "frequency"), 0.0);
  EXPECT_EQ(refusal("mu", R"({"M":[[1]],"blocks":["reel"]})"), "malformed");
  EXPECT_EQ(refusal("mu", R"({"M":[[1]],"blocks":["real","real"]})"), "wrong_shape");
  EXPECT_EQ(refusal("mu", R"({"M":[[1]],"blocks":["real"],"question":"performance"})"),
            "wrong_shape");
  EXPECT_EQ(refusal("mu", R"({"A":[[1]],"B":[[1]],"C":[[1]],"blocks":["real"]})"), "not_stable");
}

// dx/dt = g u, u = -8 x each half second: stable for 0 < g < 1/2. α = 2 (2 - 4 g)/(2 + 4 g). A
// plant p x + u with p in [-1, 1] and the gain 8: |e^{pT} - 8 (e^{pT} - 1)/p| < 1 fails at p = 1.
TEST(SolveSystems, Certify) {
  const std::string loop = R"({"A":[[0]],"B":[[1]],"T":0.5,"K":[[8]],"low":[0.1,0],"high":[)";
  const Json proven = answer("certify", loop + "0.3,0]}");
  EXPECT_EQ(proven.at("verdict"), "stable");
  EXPECT_NEAR(number(proven, "worst_disk_margin"), 2.0 * 0.8 / 3.2, 1e-9);
  EXPECT_LE(number(proven, "disk_margin"), 0.5);
  EXPECT_GE(number(proven, "disk_margin"), 0.47);
  const Json broken = answer("certify", loop + "0.6,0]}");
  EXPECT_EQ(broken.at("verdict"), "unstable");
  EXPECT_GT(broken.at("worst").at(0).get<double>(), 0.5);
  EXPECT_EQ(
      refusal("certify", R"({"A":[[0]],"B":[[1]],"T":0.5,"K":[[8]],"low":[0.4,0],"high":[0.3,0]})"),
      "out_of_range");
  EXPECT_EQ(refusal("certify", R"({"A":[[0]],"B":[[1]],"T":0.5,"K":[[3]],"low":[-1,1,0],)"
                               R"("high":[1,1,0],"A_p":[[1],[1]]})"),
            "wrong_shape");
  const Json plant = answer("certify", R"({"A":[[0]],"B":[[1]],"T":0.5,"K":[[3]],"low":[-1,1,0],)"
                                       R"("high":[1,1,0],"A_p":[[1]],"K_e":[[0.5]]})");
  EXPECT_NE(plant.at("verdict"), "undecided");
  // The worst is of the set, to the last bit.
  const Json corner = answer("certify", R"({"A":[[0]],"B":[[1]],"T":0.1,"K":[[19.9]],)"
                                        R"("low":[0.9,0],"high":[1.01,0]})");
  EXPECT_EQ(corner.at("worst").at(0).get<double>(), 1.01);
}

// dx/dt = u, x(t) = x + tu: ∫x² + r u² = T x² + T² x u + (T³/3 + rT) u².
TEST(SolveSystems, SampledCost) {
  const Json cost = answer("sampled-cost", R"({"A":[[0]],"B":[[1]],"Q":[[1]],"R":[[2]],"T":0.1})");
  EXPECT_NEAR(entry(cost, "B"), 0.1, 1e-16);
  EXPECT_NEAR(entry(cost, "Q"), 0.1, 1e-16);
  EXPECT_NEAR(entry(cost, "N"), 0.005, 1e-16);
  EXPECT_NEAR(entry(cost, "R"), 0.2 + 1e-3 / 3.0, 1e-15);
  EXPECT_EQ(refusal("sampled-cost", R"({"A":[[0]],"B":[[1]],"Q":[[1]],"R":[[2]],"T":0})"),
            "not_positive");
  EXPECT_EQ(refusal("sampled-cost",
                    R"({"A":[[0,1],[0,0]],"B":[[0],[1]],"Q":[[1,1],[0,1]],"R":[[2]],"T":1})"),
            "not_symmetric");
}

// dx/dt = u, half a period late: x⁺ = x + T/2 (u_k + u_{k-1}).
TEST(SolveSystems, InputDelay) {
  const std::string integrator = R"({"A":[[0]],"B":[[1]],"T":0.1,"delay":)";
  const Json delayed = answer("input-delay", integrator + "0.05}");
  expect_matrix(delayed, "A", {{1.0, 0.05}, {0.0, 0.0}});
  expect_matrix(delayed, "B", {{0.05}, {1.0}});
  expect_matrix(delayed, "C", {{1.0, 0.0}});
  EXPECT_EQ(refusal("input-delay", integrator + "-0.05}"), "out_of_range");
  EXPECT_EQ(refusal("input-delay", integrator + "\"inf\"}"), "not_finite");
  EXPECT_EQ(refusal("input-delay", integrator + "500}"), "out_of_range");
}

// 1/(s + 1): 1 - e^{-t} and e^{-t}. x⁺ = x/2 + u: 2 - 2^{1-k} and 2^{1-k}, k >= 1.
TEST(SolveSystems, Responses) {
  const std::string lag = R"({"A":[[-1]],"B":[[1]],"T":0.5,"samples":3)";
  const Json step = answer("step-response", lag + "}");
  EXPECT_EQ(step.at("time"), Json({0.0, 0.5, 1.0}));
  expect_matrix(step, "y", {{0.0}, {1.0 - std::exp(-0.5)}, {1.0 - std::exp(-1.0)}});
  expect_matrix(answer("impulse-response", lag + "}"), "y",
                {{1.0}, {std::exp(-0.5)}, {std::exp(-1.0)}});
  expect_matrix(answer("initial-response", lag + R"(,"x0":[2]})"), "y",
                {{2.0}, {2.0 * std::exp(-0.5)}, {2.0 * std::exp(-1.0)}});
  const std::string discrete = R"({"A":[[0.5]],"B":[[1]],"domain":"discrete","samples":3)";
  expect_matrix(answer("step-response", discrete + "}"), "y", {{0.0}, {1.0}, {1.5}});
  expect_matrix(answer("impulse-response", discrete + "}"), "y", {{0.0}, {1.0}, {0.5}});
  // No few bytes fill the memory.
  const Json large =
      answer("step-response", R"({"A":[[-1]],"B":[[1]],"T":0.5,"samples":20000000})");
  EXPECT_EQ(large.at("error").at("message"),
            "step-response: samples is so large that 4e+07 numbers are answered; it must be such "
            "that at most 5000000 are");
  // Six time constants where nothing is said.
  const Json chosen = answer("step-response", R"({"A":[[-2]],"B":[[1]]})");
  EXPECT_NEAR(chosen.at("time").back().get<double>(), 3.0, 1e-12);
  EXPECT_EQ(refusal("step-response", R"({"A":[[-2]],"B":[[1]],"T":1})"), "malformed");
  EXPECT_EQ(refusal("step-response", R"({"A":[[-2]],"B":[[1]],"samples":3})"), "malformed");
  EXPECT_EQ(refusal("step-response", lag + R"(,"input":1})"), "out_of_range");
  EXPECT_EQ(refusal("impulse-response", lag + R"(,"input":-1})"), "out_of_range");
  EXPECT_EQ(refusal("initial-response", lag + R"(,"x0":[1,2]})"), "wrong_shape");
  // Whole, and too large: the limit is said.
  const Json many = answer("step-response", R"({"A":[[-1]],"B":[[1]],"T":1,"samples":2000000000})");
  EXPECT_EQ(many.at("error").at("code"), "out_of_range");
  EXPECT_EQ(
      many.at("error").at("message"),
      "step-response: samples is 2000000000; it must be a whole number of at most 1000000000");
  EXPECT_EQ(refusal("step-response", R"({"A":[[-1]],"B":[[1]],"T":1,"samples":2.5})"), "malformed");
  EXPECT_EQ(refusal("step-response", R"({"A":[[-2]],"B":[[1]],"T":1,"samples":0})"),
            "out_of_range");
  EXPECT_EQ(refusal("step-response", R"({"A":[[-2]],"B":[[1]],"T":0,"samples":2})"),
            "not_positive");
}

// Two poles, one of which no input moves: 1/(s + 1).
TEST(SolveSystems, MinimalRealization) {
  const Json minimal =
      answer("minimal-realization", R"({"A":[[-1,0],[0,-2]],"B":[[1],[0]],"C":[[1,1]]})");
  expect_matrix(minimal, "A", {{-1.0}});
  EXPECT_NEAR(entry(minimal, "B") * entry(minimal, "C"), 1.0, 1e-14);
  EXPECT_EQ(number(minimal, "unreached"), 1.0);
  EXPECT_EQ(number(minimal, "unseen"), 0.0);
  EXPECT_EQ(refusal("minimal-realization", R"({"A":[[-1]],"B":[[1]],"tolerance":1})"),
            "out_of_range");
}

// A symmetric system, W_c = W_o = [1/2 1/11; 1/11 1/20], whose eigenvalues are the Hankel values.
TEST(SolveSystems, BalancedRealization) {
  const std::string system = R"({"A":[[-1,0],[0,-10]],"B":[[1],[1]],"C":[[1,1]])";
  const double root = std::sqrt(0.55 * 0.55 / 4.0 - (0.025 - 1.0 / 121.0));
  const Json balanced = answer("balanced-realization", system + "}");
  const Json& hankel = balanced.at("hankel_singular_values");
  EXPECT_NEAR(hankel.at(0).get<double>(), 0.275 + root, 1e-15);
  EXPECT_NEAR(hankel.at(1).get<double>(), 0.275 - root, 1e-15);
  EXPECT_EQ(number(balanced, "error_bound"), 0.0);
  // Its Gramians are diag(σ).
  const Json gramians = answer("gramians", Json{{"A", balanced.at("A")},
                                                {"B", balanced.at("B")},
                                                {"C", balanced.at("C")},
                                                {"domain", "continuous"}}
                                               .dump());
  for (const char* name : {"Wc", "Wo"}) {
    expect_matrix(gramians, name,
                  {{hankel.at(0).get<double>(), 0.0}, {0.0, hankel.at(1).get<double>()}});
  }
  const Json reduced = answer("balanced-realization", system + R"(,"order":1})");
  EXPECT_EQ(reduced.at("A").size(), 1U);
  EXPECT_NEAR(number(reduced, "error_bound"), 2.0 * (0.275 - root), 1e-15);
  EXPECT_EQ(refusal("balanced-realization", system + R"(,"order":3})"), "out_of_range");
  EXPECT_EQ(refusal("balanced-realization", system + R"(,"order":1.5})"), "malformed");
  EXPECT_EQ(refusal("balanced-realization", system + R"(,"order":1e10})"), "out_of_range");
  EXPECT_EQ(refusal("balanced-realization", R"({"A":[[1]],"B":[[1]]})"), "not_stable");
  EXPECT_EQ(refusal("balanced-realization", R"({"A":[[-1]],"B":[[0]]})"), "not_controllable");
}

// 1/((s + 1)(s + 2)) = 1/(s² + 3s + 2).
TEST(SolveSystems, CanonicalForms) {
  const std::string system = R"({"A":[[-1,1],[0,-2]],"B":[[0],[1]],"C":[[1,0]])";
  const Json controllable = answer("canonical-form", system + "}");
  expect_matrix(controllable, "A", {{0.0, 1.0}, {-2.0, -3.0}});
  expect_matrix(controllable, "C", {{1.0, 0.0}});
  const Json observable = answer("canonical-form", system + R"(,"form":"observable"})");
  expect_matrix(observable, "A", {{0.0, -2.0}, {1.0, -3.0}});
  expect_matrix(observable, "C", {{0.0, 1.0}});
  EXPECT_EQ(refusal("canonical-form", system + R"(,"form":"modal"})"), "unknown_name");
  EXPECT_EQ(refusal("canonical-form", R"({"A":[[-1]],"B":[[0]]})"), "not_controllable");
  EXPECT_EQ(refusal("canonical-form", R"({"A":[[-1]],"B":[[1]],"C":[[0]],"form":"observable"})"),
            "not_observable");
  EXPECT_EQ(refusal("canonical-form", R"({"A":[[-1]],"B":[[1,1]]})"), "wrong_shape");
}

// Companion matrix to modes: T⁻¹ = [2 1; -1 -1].
TEST(SolveSystems, SimilarityTransform) {
  const std::string system = R"({"A":[[0,1],[-2,-3]],"B":[[0],[1]],"transform":)";
  const Json modal = answer("similarity-transform", system + "[[1,1],[-1,-2]]}");
  expect_matrix(modal, "A", {{-1.0, 0.0}, {0.0, -2.0}});
  expect_matrix(modal, "B", {{1.0}, {-1.0}});
  EXPECT_EQ(refusal("similarity-transform", system + "[[1,1],[1,1]]}"), "singular_transform");
  EXPECT_EQ(refusal("similarity-transform", system + "[[1]]}"), "wrong_shape");
}

// 1/(s + 1) and 2/(s + 2), by the block matrices of the book's appendix A in state space.
TEST(SolveSystems, Interconnections) {
  const std::string both = R"({"first":{"A":[[-1]],"B":[[1]]},"second":{"A":[[-2]],"B":[[2]]}})";
  const Json series = answer("series", both);
  expect_matrix(series, "A", {{-1.0, 0.0}, {2.0, -2.0}});
  expect_matrix(series, "B", {{1.0}, {0.0}});
  expect_matrix(series, "C", {{0.0, 1.0}});
  const Json parallel = answer("parallel", both);
  expect_matrix(parallel, "A", {{-1.0, 0.0}, {0.0, -2.0}});
  expect_matrix(parallel, "B", {{1.0}, {2.0}});
  expect_matrix(parallel, "C", {{1.0, 1.0}});
  const Json append = answer("append", both);
  expect_matrix(append, "B", {{1.0, 0.0}, {0.0, 2.0}});
  expect_matrix(append, "D", {{0.0, 0.0}, {0.0, 0.0}});
  const std::string loop = R"({"forward":{"A":[[-1]],"B":[[1]]},"back":{"A":[[-2]],"B":[[2]]})";
  expect_matrix(answer("feedback", loop + "}"), "A", {{-1.0, -1.0}, {2.0, -2.0}});
  expect_matrix(answer("feedback", loop + R"(,"sign":"positive"})"), "A",
                {{-1.0, 1.0}, {2.0, -2.0}});
  const std::string unity = R"({"forward":{"A":[[0.5]],"B":[[0.2]]},"domain":"discrete","T":0.1})";
  expect_matrix(answer("feedback", unity), "A", {{0.3}});
}

TEST(SolveSystems, InterconnectionsAreRefused) {
  // Two outputs into one input.
  const Json shapes = answer("series", R"({"first":{"A":[[-1,0],[0,-1]],"B":[[1],[1]]},)"
                                       R"("second":{"A":[[-2]],"B":[[2]]}})");
  EXPECT_EQ(shapes.at("error").at("code"), "wrong_shape");
  EXPECT_EQ(shapes.at("error").at("message"),
            "series: second.B is 1x1; it must be states of the second system (back) x signals "
            "from the first system to the second (1x2)");
  EXPECT_EQ(refusal("parallel", R"({"first":{"A":[[-1]],"B":[[1,1]]},)"
                                R"("second":{"A":[[-2]],"B":[[2]]}})"),
            "wrong_shape");
  EXPECT_EQ(refusal("series", R"({"first":{"A":[[-1]],"b":[[1]]},"second":1})"), "unknown_name");
  EXPECT_EQ(refusal("series", R"({"first":{"A":[[-1]]},"second":1})"), "malformed");
  EXPECT_EQ(refusal("series", R"({"first":{"A":[[-1]],"B":[[1]]},"second":1})"), "malformed");
  EXPECT_EQ(
      refusal("append", R"({"first":{"A":[[-1]],"B":[[1]]},"second":{"A":[["nan"]],"B":[[1]]}})"),
      "not_finite");
  // y = u + y.
  EXPECT_EQ(refusal("feedback", R"({"forward":{"A":[[-1]],"B":[[1]],"D":[[1]]},)"
                                R"("back":{"A":[[-1]],"B":[[1]],"D":[[-1]]}})"),
            "algebraic_loop");
  EXPECT_EQ(
      refusal("feedback", R"({"forward":{"A":[[0.5]],"B":[[1]]},"domain":"discrete","T":-1})"),
      "not_positive");
}

// What the last digits of the data do to an answer is told, and where they decide there is none:
// the angle of 1e20 rad has no digit behind the point.
TEST(SolveSystems, AnswersTellTheirError) {
  const auto rotation = [](const char* angle) {
    return std::string(R"({"A":[[0,)") + angle + R"(],[-)" + angle + R"(,0]]})";
  };
  EXPECT_LT(number(answer("expm", rotation("1")), "relative_error"), 1e-15);
  const double error = number(answer("expm", rotation("1e9")), "relative_error");
  EXPECT_GT(error, 1e-8);
  EXPECT_LT(error, 1e-6);
  EXPECT_EQ(refusal("expm", rotation("1e20")), "not_determined");
  EXPECT_EQ(refusal("c2d", R"({"A":[[0,1],[-1,0]],"B":[[0],[1]],"T":1e20})"), "not_determined");
  // A stiff motor for eleven days, in 60 digits.
  const Json motor = answer("c2d", R"({"A":[[0,1,0],[0,-0.01,5000],[0,-20,-50000]],)"
                                   R"("B":[[0],[0],[100000]],"T":1000000})");
  EXPECT_LT(number(motor, "relative_error"), 1e-14);
  EXPECT_NEAR(entry(motor, "B") / 4975121902.9227, 1.0, 1e-13);
  EXPECT_EQ(entry(motor, "A"), 1.0);
}

// 24 states with rates from 1 to 1e9: squares in doubles lose digits of the slow ones that the last
// digits of the data do not. The truth by 31 digits.
TEST(SolveSystems, SquaresOfALargeStiffMatrixTellWhatTheyLose) {
  constexpr Eigen::Index n = 24;
  Random random(4);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    A(i, i) = -std::pow(10.0, random.uniform(0.0, 9.0));
    if (i + 1 < n) {
      A(i, i + 1) = random.uniform(-1.0, 1.0);
      A(i + 1, i) = 1e-3 * random.uniform(-1.0, 1.0);
    }
  }
  Json problem{{"A", Json::array()}};
  Json plant{{"B", Json::array()}, {"T", 1.0}};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::VectorXd row = A.row(i);
    problem["A"].push_back(std::vector<double>(row.begin(), row.end()));
    plant["B"].push_back(std::vector<double>{1.0});
  }
  plant["A"] = problem["A"];
  const Eigen::MatrixXd truth =
      detail::extended_exponential(detail::DoubleDoubleMatrix(A)).rounded();
  for (const char* kind : {"expm", "c2d"}) {
    const bool bare = kind == std::string("expm");
    const Json found = answer(kind, (bare ? problem : plant).dump());
    ASSERT_FALSE(found.contains("error")) << found;
    double off = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const double x = entry(found, bare ? "X" : "A", static_cast<std::size_t>(i),
                               static_cast<std::size_t>(j));
        off = std::max(off, std::abs(x - truth(i, j)) / truth.cwiseAbs().maxCoeff());
      }
    }
    EXPECT_GT(off, 1e-12) << kind;
    EXPECT_LE(off, number(found, "relative_error")) << kind;
  }
}

// A guess of a delay margin that is 1e290 periods away is not walked to.
TEST(SolveSystems, MarginsOfALoopInTinyPeriods) {
  const Json margins = answer(
      "margins",
      R"({"A":[[-10.5]],"B":[[1e155]],"C":[[-0.2],[1e-08],[-1]],"K":[[1.9]],"K_e":[[0,1e8,0]],"T":1e-300})");
  EXPECT_GT(number(margins, "delay_margin"), 0.0);
}

}  // namespace
}  // namespace flyball::solve::systems_test
