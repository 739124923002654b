#include <flyball/study/analyze.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/study/answer.hpp>

namespace flyball::study::analyze_test {
namespace {

// dx/dt = -2x + 3u: y = 1.5 (1 - e^{-2t}), gain 1.5 at every frequency's start, H2 norm 3/√4.
TEST(Analyze, FirstOrderLag) {
  const auto analysis = analyze(parse_model(R"({"A":[[-2]],"B":[[3]]})", "m").value()).value();
  EXPECT_EQ(analysis.modes.stability, Stability::stable);
  EXPECT_TRUE(analysis.controllability.controllable);
  EXPECT_TRUE(analysis.observability.observable);
  EXPECT_NEAR((*analysis.dc_gain)(0, 0), 1.5, 1e-15);
  EXPECT_NEAR(*analysis.h2_norm, 1.5, 1e-14);
  EXPECT_NEAR(analysis.h_infinity_norm->norm, 1.5, 1e-9);
  const StepResponse& step = analysis.steps.at(0);
  EXPECT_GT(step.time(step.time.size() - 1), 2.5);
  for (Eigen::Index k = 0; k < step.time.size(); ++k) {
    EXPECT_NEAR(step.y(k, 0), 1.5 * (1.0 - std::exp(-2.0 * step.time(k))), 1e-12);
  }
}

// x₊ = 0.5x + u: y_k = 2 (1 - 0.5ᵏ).
TEST(Analyze, DiscreteLag) {
  const auto analysis =
      analyze(parse_model(R"({"A":[[0.5]],"B":[[1]],"domain":"discrete","T":0.02})", "m").value())
          .value();
  EXPECT_NEAR((*analysis.dc_gain)(0, 0), 2.0, 1e-15);
  const StepResponse& step = analysis.steps.at(0);
  EXPECT_NEAR(step.time(3), 0.06, 1e-15);
  EXPECT_NEAR(step.y(3, 0), 1.75, 1e-15);
}

TEST(Analyze, UnstableAndIntegratingModels) {
  const auto unstable =
      analyze(parse_model(R"({"A":[[1,0],[0,-1]],"B":[[0],[1]],"states":["a","b"]})", "m").value())
          .value();
  EXPECT_EQ(unstable.modes.stability, Stability::unstable);
  EXPECT_FALSE(unstable.controllability.stabilizable);
  EXPECT_FALSE(unstable.h2_norm.has_value());
  EXPECT_NE(describe(unstable.controllability, labels(unstable.model.states)).find("a"),
            std::string::npos);
  const auto integrator = analyze(parse_model(R"({"A":[[0]],"B":[[1]]})", "m").value()).value();
  EXPECT_FALSE(integrator.dc_gain.has_value());
  EXPECT_NEAR(integrator.steps.at(0).y(10, 0), integrator.steps.at(0).time(10), 1e-14);
}

// A growing mode beside one a hundred times slower: y = e^t - 1 is shown for five of its time
// constants, not until the slow one has settled at e^600.
TEST(Analyze, AGrowingModeEndsTheStepResponse) {
  const auto analysis = analyze(parse_model(R"({"A":[[1,0],[0,-0.01]],"B":[[1],[0.01]],
                                               "C":[[1,0]]})",
                                            "m")
                                    .value())
                            .value();
  const StepResponse& step = analysis.steps.at(0);
  const Eigen::Index last = step.time.size() - 1;
  EXPECT_NEAR(step.time(last), 5.0, 0.02);
  EXPECT_NEAR(step.y(last, 0), std::exp(step.time(last)) - 1.0, 1e-10);
}

// dv/dt = -(kV/kA) v + u/kA: pole -4, which 50 ms sample as e^-0.2.
TEST(Analyze, ProjectsAreSampledWithTheirPeriod) {
  const std::string text =
      "[mechanism]\ntype = \"flywheel\"\n[gains]\nkS = 0.2\nkV = 0.02\nkA = 0.005\n"
      "[controller]\nperiod = \"50 ms\"\n";
  const auto analysis = analyze(parse_model(text, "wheel.toml").value()).value();
  EXPECT_EQ(analysis.model.plant->kind, mechanisms::MechanismKind::flywheel);
  EXPECT_EQ(labels(analysis.model.states), std::vector<std::string>{"velocity (rad/s)"});
  EXPECT_EQ(labels(analysis.model.outputs), labels(analysis.model.states));
  EXPECT_EQ(analysis.model.notes.at(0).code, "left_out");
  EXPECT_DOUBLE_EQ(analysis.modes.modes.at(0).pole.real(), -4.0);
  ASSERT_TRUE(analysis.sampled);
  EXPECT_NEAR(analysis.sampled->modes.modes.at(0).pole.real(), std::exp(-0.2), 1e-15);
  EXPECT_NEAR(analysis.sampled->system.B(0, 0), 50.0 * (1.0 - std::exp(-0.2)), 1e-13);
  EXPECT_NEAR((*analysis.dc_gain)(0, 0), 50.0, 1e-12);
}

// A period that a growing mode outgrows (e^1000) leaves the continuous analysis standing.
TEST(Analyze, WhatCannotBeSampledIsNoted) {
  const auto analysis =
      analyze(parse_model(R"({"A":[[1000]],"B":[[1]],"T":1})", "m").value()).value();
  EXPECT_FALSE(analysis.sampled);
  EXPECT_EQ(analysis.model.notes.at(0).code, "not_sampled");
}

// Entries whose responses have no doubles: what the system is like is told without them.
TEST(Analyze, ResponsesBeyondDoublesAreNoted) {
  for (const char* text :
       {R"({"A":[[0,1e160],[0,0]],"B":[[0],[1]]})", R"({"A":[[0,0],[1.7e308,0]],"B":[[1],[1]]})"}) {
    const auto analysis = analyze(parse_model(text, "m").value());
    ASSERT_TRUE(analysis.has_value()) << text;
    EXPECT_TRUE(analysis->controllability.controllable) << text;
    const Answer answer = answer_of(*analysis);
    EXPECT_FALSE(answer.json.empty());
  }
}

TEST(Analyze, NamesOutputsByTheirStates) {
  const auto analysis = analyze(parse_model(R"({"A":[[0,1],[0,0]],"B":[[0],[1]],"C":[[0,1],[2,0]],
 "states":["x","v"]})",
                                            "m")
                                    .value())
                            .value();
  EXPECT_EQ(labels(analysis.model.outputs), (std::vector<std::string>{"v", "y2"}));
  EXPECT_EQ(labels(analysis.model.inputs), std::vector<std::string>{"u1"});
}

TEST(Analyze, RefusesBadModels) {
  const auto refused = [](const std::string& text) {
    return parse_model(text, "m.json").error().code();
  };
  EXPECT_EQ(refused("{"), "malformed");
  EXPECT_EQ(refused("[1]"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]]})"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"E":[[1]]})"), "unknown_name");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"domain":"z"})"), "unknown_name");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"domain":"discrete"})"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"domain":"discrete","T":0})"), "not_positive");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"states":["a","b"]})"), "wrong_shape");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"states":[""]})"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"states":["a\nb"]})"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1]],"states":[")" + std::string(81, 'x') + R"("]})"),
            "malformed");
  EXPECT_EQ(refused(R"({"A":[[1,2],[3]],"B":[[1]]})"), "malformed");
  EXPECT_EQ(refused(R"({"A":[[1]],"B":[[1],[2]]})"), "wrong_shape");
  EXPECT_EQ(refused(R"({"A":[["nan"]],"B":[[1]]})"), "not_finite");
}

}  // namespace
}  // namespace flyball::study::analyze_test
