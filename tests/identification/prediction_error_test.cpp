#include <flyball/identification/prediction_error.hpp>

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/identification/identification_error.hpp>
#include <flyball/systems/formula_model.hpp>

#include "identification/model_simulation.hpp"

namespace flyball::identification::prediction_error_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

AnyModel model_of(const ModelFormulas& formulas) {
  auto model = formula_model(formulas);
  EXPECT_TRUE(model) << (model ? "" : to_string(model.error().front()));
  return *model;
}

/// dx/dt = (gain u - x)/lag.
AnyModel lag() {
  return model_of({.states = {{"x", "1"}},
                   .inputs = {{"u", "1"}},
                   .parameters = {{"gain", "1", 1.0}, {"lag", "s", 1.0}},
                   .derivatives = {{"x", "(gain*u - x)/lag"}}});
}

/// A swing with drag, both its angle and its rate measured.
AnyModel swing() {
  return model_of({.states = {{"theta", "rad", true}, {"omega"}},
                   .inputs = {{"u"}},
                   .parameters = {{"stiffness", "", 20.0}, {"drag", "", 0.5}, {"gain", "", 5.0}},
                   .derivatives = {{"theta", "omega"},
                                   {"omega", "-stiffness*sin(theta) - drag*omega + gain*u"}}});
}

/// Inputs that change often, simulated by the model itself, with noise.
ExperimentRun recorded(const AnyModel& model, const VectorXd& initial, std::size_t samples,
                       double period, const VectorXd& noise, unsigned long long seed,
                       double memory = 0.0) {
  Random random(seed);
  const auto count = static_cast<Index>(samples);
  ExperimentRun run{.name = std::to_string(seed), .inputs = MatrixXd(model.inputs(), count)};
  double level = 1.0;
  for (Index k = 0; k < count; ++k) {
    run.time.push_back(period * static_cast<double>(k));
    level = k % 15 == 14 ? 2.0 * random.uniform() - 1.0 : level;
    run.inputs.col(k).setConstant(level);
  }
  run.outputs.setZero(model.outputs(), count);
  const auto simulated =
      simulate_run(model, run, initial, InputHold::held, {.step = period / 16.0});
  run.outputs = simulated->y;
  VectorXd last = VectorXd::Zero(model.outputs());
  for (Index k = 0; k < count; ++k) {
    for (Index p = 0; p < model.outputs(); ++p) {
      last(p) = memory * last(p) + std::sqrt(1.0 - memory * memory) * noise(p) * random.normal();
    }
    run.outputs.col(k) += last;
  }
  for (const double value : initial) {
    run.initial.push_back({.value = value});
  }
  return run;
}

VectorXd vector(std::initializer_list<double> values) {
  VectorXd v(static_cast<Index>(values.size()));
  std::copy(values.begin(), values.end(), v.begin());
  return v;
}

// After a step y = 3(1 - e^(-t/0.7)), without noise.
TEST(PredictionError, AStepResponseGivesItsConstants) {
  ExperimentRun run{.inputs = MatrixXd::Ones(1, 60), .outputs = MatrixXd(1, 60)};
  for (Index k = 0; k < 60; ++k) {
    run.time.push_back(0.05 * static_cast<double>(k));
    run.outputs(0, k) = 3.0 * (1.0 - std::exp(-run.time.back() / 0.7));
  }
  const auto fit = fit_model(lag(), {run}, {{"gain"}, {"lag"}});
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_TRUE(fit->minimum.converged);
  EXPECT_NEAR(fit->parameters[0].value, 3.0, 1e-8);
  EXPECT_NEAR(fit->parameters[1].value, 0.7, 1e-8);
  EXPECT_EQ(fit->parameters[1].unit, "s");
  EXPECT_GT(fit->runs[0].outputs[0].fit, 1.0 - 1e-8);
  EXPECT_EQ(fit->model.parameters()(0), fit->parameters[0].value);
}

TEST(PredictionError, SensitivitiesAreTheDifferencesOfSimulations) {
  const AnyModel model = swing();
  ExperimentRun run = recorded(model, vector({0.3, -1.0}), 40, 0.05, vector({0.0, 0.0}), 2);
  const SensitivityBy by{{0, 2}, {0, 1}};
  for (const bool implicit : {false, true}) {
    for (const InputHold hold : {InputHold::held, InputHold::linear}) {
      const IntegrationPlan plan{implicit, 0.02};
      const VectorXd q = vector({20.0, 5.0, 0.3, -1.0});
      const auto simulated = [&](const VectorXd& at, const SensitivityBy* of) {
        const AnyModel changed =
            model.with_parameters(vector({at(0), model.parameters()(1), at(1)})).value();
        return simulate_run(changed, run, at.tail(2), hold, plan, of).value();
      };
      const SimulatedRun exact = simulated(q, &by);
      for (Index j = 0; j < 4; ++j) {
        VectorXd step = VectorXd::Zero(4);
        step(j) = 1e-5 * std::abs(q(j));
        const MatrixXd difference =
            (simulated(q + step, nullptr).y - simulated(q - step, nullptr).y) / (2.0 * step(j));
        const VectorXd flat = Eigen::Map<const VectorXd>(difference.data(), difference.size());
        EXPECT_LT((exact.sensitivity.col(j) - flat).cwiseAbs().maxCoeff(),
                  1e-7 * std::max(1.0, flat.cwiseAbs().maxCoeff()))
            << "by " << j << (implicit ? ", implicit" : ", explicit");
      }
    }
  }
}

// dx/dt = -x from 1: halving the step divides the error by 16 and, of the implicit steps, by 4.
TEST(PredictionError, StepsHaveTheirOrder) {
  const AnyModel model = lag();
  const ExperimentRun run{
      .time = {0.0, 1.0}, .inputs = MatrixXd::Zero(1, 2), .outputs = MatrixXd::Zero(1, 2)};
  const auto error = [&](bool implicit, double step) {
    return std::abs(
        simulate_run(model, run, vector({1.0}), InputHold::held, {implicit, step})->y(0, 1) -
        std::exp(-1.0));
  };
  EXPECT_NEAR(error(false, 0.1) / error(false, 0.05), 16.0, 1.0);
  EXPECT_NEAR(error(true, 0.1) / error(true, 0.05), 4.0, 0.4);
}

// A ramp u = t into dx/dt = u: x = t²/2 where the input is a line between its samples.
TEST(PredictionError, InputsAreHeldOrGoStraight) {
  const AnyModel model =
      model_of({.states = {{"x"}}, .inputs = {{"u"}}, .derivatives = {{"x", "u"}}});
  ExperimentRun run{.time = {0.0, 0.5, 2.0}, .inputs = MatrixXd(1, 3), .outputs = MatrixXd(1, 3)};
  run.inputs << 0.0, 0.5, 2.0;
  const auto end = [&](InputHold hold, bool implicit) {
    return simulate_run(model, run, vector({0.0}), hold, {implicit, 0.1})->y(0, 2);
  };
  EXPECT_NEAR(end(InputHold::linear, false), 2.0, 1e-12);
  EXPECT_NEAR(end(InputHold::linear, true), 2.0, 1e-12);
  EXPECT_NEAR(end(InputHold::held, false), 0.75, 1e-12);
  // u = t², whose integral to 3 is 9: the ends, where a neighbour is missing, are straight there.
  run = {.time = {0.0, 1.0, 2.0, 3.0}, .inputs = MatrixXd(1, 4), .outputs = MatrixXd(1, 4)};
  run.inputs << 0.0, 1.0, 4.0, 9.0;
  const MatrixXd x = simulate_run(model, run, vector({0.0}), InputHold::cubic, {false, 0.1})->y;
  EXPECT_NEAR(x(0, 2) - x(0, 1), 7.0 / 3.0, 1e-12);
}

TEST(PredictionError, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const AnyModel truth = lag().with_parameters(vector({2.0, 0.5})).value();
  for (const double memory : {0.0, 0.9}) {
    int held = 0;
    int claimed_white = 0;
    constexpr int trials = 200;
    for (int seed = 1; seed <= trials; ++seed) {
      const auto run = recorded(truth, vector({0.0}), 400, 0.05, vector({0.1}),
                                static_cast<unsigned long long>(seed), memory);
      const auto fit = fit_model(lag(), {run}, {{"gain"}, {"lag"}});
      ASSERT_TRUE(fit) << to_string(fit.error());
      const FittedParameter& found = fit->parameters[1];
      held += found.low <= 0.5 && 0.5 <= found.high ? 1 : 0;
      claimed_white += fit->correlated_samples == 1 ? 1 : 0;
    }
    // 95 % ± three standard deviations of 200 trials; correlated errors are harder to judge.
    EXPECT_GE(held, memory == 0.0 ? 180 : 168) << "memory " << memory;
    EXPECT_LE(held, 199);
    EXPECT_GE(memory == 0.0 ? claimed_white : trials - claimed_white, 190);
  }
}

TEST(PredictionError, RunsWithStartsOfTheirOwnAndMissingReadings) {
  const AnyModel truth = swing().with_parameters(vector({25.0, 0.8, 4.0})).value();
  std::vector<ExperimentRun> runs;
  for (unsigned long long seed = 1; seed <= 3; ++seed) {
    runs.push_back(recorded(truth, vector({0.2 * static_cast<double>(seed), -0.5}), 300, 0.02,
                            vector({0.01, 0.2}), seed));
    for (InitialState& state : runs.back().initial) {
      state.is_free = true;
      state.value = 0.0;
    }
    for (Index k = 0; k < 300; k += 3) {
      runs.back().outputs(1, k) = nan;
    }
  }
  const std::vector<FreeParameter> free{{"stiffness"}, {"drag"}, {"gain"}};
  const auto fit = fit_model(swing(), runs, free);
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_TRUE(fit->minimum.converged);
  const VectorXd expected = truth.parameters();
  for (std::size_t j = 0; j < 3; ++j) {
    const FittedParameter& found = fit->parameters[j];
    EXPECT_LT(std::abs(found.value - expected(static_cast<Index>(j))), 4.0 * found.standard_error)
        << found.name;
    EXPECT_LT(found.standard_error, 0.05 * found.value);
  }
  EXPECT_NEAR(fit->output_std[0], 0.01, 0.001);
  EXPECT_NEAR(fit->output_std[1], 0.2, 0.02);
  EXPECT_NEAR(fit->runs[2].initial(0), 0.6, 0.02);
  EXPECT_EQ(fit->measurements, 3 * (300 + 200));
  EXPECT_TRUE(std::isnan(fit->runs[0].residuals(1, 0)));
  const auto left_out = cross_validate(*fit, runs, free);
  ASSERT_TRUE(left_out) << to_string(left_out.error());
  ASSERT_EQ(left_out->size(), 3U);
  for (const RunFit& run : *left_out) {
    EXPECT_NEAR(run.outputs[0].rmse, 0.01, 0.0015);
    std::vector<double> y;
    double squares = 0.0;
    for (Index k = 0; k < run.residuals.cols(); ++k) {
      if (const double error = run.residuals(0, k); !std::isnan(error)) {
        y.push_back(run.simulated(0, k) + error);
        squares += error * error;
      }
    }
    const Eigen::Map<const VectorXd> measured(y.data(), std::ssize(y));
    EXPECT_NEAR(run.outputs[0].nrmse,
                std::sqrt(squares) / (measured.array() - measured.mean()).matrix().norm(), 1e-12);
  }
}

TEST(PredictionError, AProductIsNotItsFactors) {
  const AnyModel model =
      model_of({.states = {{"x"}},
                .inputs = {{"u"}},
                .parameters = {{"k", "", 1.0}, {"m", "", 1.0}, {"c", "", 1.0}, {"idle", "", 3.0}},
                .derivatives = {{"x", "k/m*u - c*x + 0*idle"}}});
  const AnyModel truth = model.with_parameters(vector({2.0, 1.0, 1.5, 3.0})).value();
  const auto run = recorded(truth, vector({0.0}), 200, 0.05, vector({0.02}), 5);
  const auto fit = fit_model(model, {run}, {{"k"}, {"m"}, {"c"}, {"idle"}});
  ASSERT_TRUE(fit) << to_string(fit.error());
  ASSERT_EQ(fit->undetermined.size(), 2U);
  EXPECT_EQ(fit->undetermined[0] + fit->undetermined[1],
            "changing k by +1 % and m by +1 % changes nothing that was measured"
            "idle does not change anything that was measured");
  EXPECT_EQ(fit->parameters[0].standard_error, infinity);
  EXPECT_TRUE(fit->parameters[1].low_is_open);
  EXPECT_NEAR(fit->parameters[0].value / fit->parameters[1].value, 2.0, 0.05);
  EXPECT_NEAR(fit->parameters[2].value, 1.5, 0.05);
}

// A tank that runs over at 1, its level measured.
TEST(PredictionError, ALimitWrittenWithMinAndMaxIsFitted) {
  const AnyModel model =
      model_of({.states = {{"h"}},
                .inputs = {{"u"}},
                .parameters = {{"in", "", 1.0}, {"out", "", 1.0}},
                .derivatives = {{"h", "in*max(u, 0) - out*sqrt(max(h, 0)) - 20*max(h - 1, 0)"}},
                .outputs = {{"level", "min(h, 1)"}}});
  const AnyModel truth = model.with_parameters(vector({1.3, 0.6})).value();
  auto run = recorded(truth, vector({0.1}), 400, 0.1, vector({0.005}), 8);
  const auto fit = fit_model(model, {run}, {{"in", 0.0, 10.0}, {"out", 0.0, 10.0}});
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_NEAR(fit->parameters[0].value, 1.3, 0.02);
  EXPECT_NEAR(fit->parameters[1].value, 0.6, 0.02);
}

TEST(PredictionError, AStiffModelGetsImplicitSteps) {
  const AnyModel model = model_of({.states = {{"i"}, {"x"}},
                                   .inputs = {{"u"}},
                                   .parameters = {{"slow", "", 1.0}},
                                   .derivatives = {{"i", "1e6*(u - i)"}, {"x", "slow*(i - x)"}},
                                   .outputs = {{"x", "x"}}});
  ExperimentRun run{.inputs = MatrixXd::Ones(1, 50), .outputs = MatrixXd(1, 50)};
  for (Index k = 0; k < 50; ++k) {
    run.time.push_back(0.1 * static_cast<double>(k));
    run.outputs(0, k) = 1.0 - std::exp(-2.0 * run.time.back()) + (k % 2 == 0 ? 1e-3 : -1e-3);
  }
  const auto fit = fit_model(model, {run}, {{"slow"}});
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_TRUE(fit->integration.implicit);
  EXPECT_NEAR(fit->parameters[0].value, 2.0, 0.01);
}

// Tustin's drag is in the one, and its coefficient zero in the other's truth.
TEST(PredictionError, ALargerModelMustEarnItsParameter) {
  const AnyModel model = model_of({.states = {{"x"}},
                                   .inputs = {{"u"}},
                                   .parameters = {{"a", "", 1.0}, {"b", "", 0.0}},
                                   .derivatives = {{"x", "2*u - a*x - b*x^3"}}});
  for (const double cubic : {0.0, 0.5}) {
    const AnyModel truth = model.with_parameters(vector({1.0, cubic})).value();
    const auto run = recorded(truth, vector({0.0}), 400, 0.1, vector({0.05}), 12);
    const auto small = fit_model(model, {run}, {{"a"}});
    const auto large = fit_model(model, {run}, {{"a"}, {"b"}});
    ASSERT_TRUE(small && large);
    const ModelComparison found = compare(*small, *large);
    if (cubic == 0.0) {
      EXPECT_GT(found.p_value, 0.01);
      EXPECT_LT(found.bic_gain, 0.0);
    } else {
      EXPECT_LT(found.p_value, 1e-9);
      EXPECT_GT(found.bic_gain, 10.0);
    }
  }
}

TEST(PredictionError, ABoundIsNotAnEstimate) {
  const AnyModel truth = lag().with_parameters(vector({2.0, 0.5})).value();
  const auto run = recorded(truth, vector({0.0}), 100, 0.05, vector({0.05}), 3);
  const auto fit = fit_model(lag(), {run}, {{"gain"}, {"lag", 0.8, 10.0}});
  ASSERT_TRUE(fit) << to_string(fit.error());
  EXPECT_EQ(fit->parameters[1].bound, optimization::Bound::lower);
  EXPECT_EQ(fit->parameters[1].value, 0.8);
  EXPECT_TRUE(fit->parameters[1].low_is_open);
  EXPECT_EQ(fit->parameters[1].high, infinity);
  const auto profiled = fit_model(lag(), {run}, {{"gain"}, {"lag"}}, {.profile = true});
  ASSERT_TRUE(profiled) << to_string(profiled.error());
  EXPECT_LT(profiled->parameters[1].low, 0.5);
  EXPECT_GT(profiled->parameters[1].high, 0.5);
  EXPECT_LT(profiled->parameters[1].high, 0.6);
}

TEST(PredictionError, OutliersDoNotMoveARobustFit) {
  const AnyModel truth = lag().with_parameters(vector({2.0, 0.5})).value();
  auto run = recorded(truth, vector({0.0}), 300, 0.05, vector({0.02}), 6);
  for (Index k = 7; k < 300; k += 20) {
    run.outputs(0, k) += 5.0;
  }
  PredictionErrorOptions robust;
  robust.loss = {optimization::Loss::soft_l1, 1.5};
  const auto fit = fit_model(lag(), {run}, {{"gain"}, {"lag"}}, robust);
  const auto plain = fit_model(lag(), {run}, {{"gain"}, {"lag"}});
  ASSERT_TRUE(fit && plain);
  EXPECT_NEAR(fit->parameters[0].value, 2.0, 0.03);
  EXPECT_NEAR(fit->parameters[1].value, 0.5, 0.02);
  EXPECT_GT(std::abs(plain->parameters[0].value - 2.0), 0.1);
  EXPECT_NEAR(fit->output_std[0], 0.02, 0.006);
}

TEST(PredictionError, WhatDoesNotFitTogetherIsRefused) {
  const AnyModel model = lag();
  const auto run = recorded(model, vector({0.0}), 20, 0.05, vector({0.1}), 1);
  const auto refusal = [&](ExperimentRun changed, std::vector<FreeParameter> free,
                           PredictionErrorOptions options = {}) {
    const auto fit = fit_model(model, {std::move(changed)}, free, options);
    return fit ? std::string("accepted") : to_string(fit.error());
  };
  EXPECT_EQ(refusal(run, {{"gian"}}),
            "fit_model: \"gian\" is not a parameter of the model; it must be gain and lag");
  EXPECT_NE(refusal(run, {}).find("the list of free parameters is empty"), std::string::npos);
  ExperimentRun changed = run;
  changed.time[3] = changed.time[2];
  EXPECT_NE(refusal(changed, {{"lag"}}).find("ascending"), std::string::npos);
  changed = run;
  changed.inputs(0, 4) = nan;
  EXPECT_NE(refusal(changed, {{"lag"}}).find("inputs"), std::string::npos);
  changed = run;
  changed.outputs.setConstant(nan);
  const auto nothing = fit_model(model, {changed}, {{"lag"}});
  ASSERT_FALSE(nothing);
  EXPECT_TRUE(nothing.error().is(IdentificationError::no_data));
  changed = run;
  changed.outputs.resize(2, 20);
  EXPECT_NE(refusal(changed, {{"lag"}}).find("2x20"), std::string::npos);
  EXPECT_NE(refusal(run, {{"lag"}}, {.output_std = {1.0, 2.0}}).find("one an output"),
            std::string::npos);
  const AnyModel endless = model_of({.states = {{"x"}},
                                     .inputs = {{"u"}},
                                     .parameters = {{"a", "", 900.0}},
                                     .derivatives = {{"x", "a/x + u"}}});
  const auto left = fit_model(endless, {run}, {{"a"}});
  ASSERT_FALSE(left);
  EXPECT_TRUE(left.error().is(optimization::LeastSquaresError::no_start));
}

}  // namespace
}  // namespace flyball::identification::prediction_error_test
