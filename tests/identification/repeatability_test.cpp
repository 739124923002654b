#include <flyball/identification/repeatability.hpp>

#include <cmath>

#include "recordings.hpp"

namespace {

using namespace flyball::identification;
using flyball::ArgumentError;
using flyball::mechanisms::MechanismKind;

GainEstimate estimate(double value, double sigma) {
  return {.value = value,
          .standard_error = sigma,
          .interval = {value - 1.959963984540054 * sigma, value + 1.959963984540054 * sigma}};
}

FeedforwardFit fit_with(double kV, double sigma) {
  FeedforwardFit fit;
  fit.mechanism = MechanismKind::flywheel;
  fit.unit = "rad";
  fit.kS = estimate(0.1, 0.01);
  fit.kV = estimate(kV, sigma);
  fit.kA = {.value = 0.02, .determined = false};
  return fit;
}

const GainComparison& named(const std::vector<GainComparison>& all, std::string_view name) {
  return *std::find_if(all.begin(), all.end(), [&](const auto& c) { return c.name == name; });
}

// 1.0 and 1.2, each ± 0.1: Q = 2, of one degree of freedom; between² = (2 - 1)/(200 - 100).
TEST(Repeatability, ComparesTwoLogs) {
  const auto compared = compare_fits({fit_with(1.0, 0.1), fit_with(1.2, 0.1)}).value();
  ASSERT_EQ(compared.size(), 2u);  // kA is determined by neither
  const GainComparison& kV = named(compared, "kV");
  EXPECT_EQ(kV.unit, "V·s/rad");
  EXPECT_NEAR(kV.largest_z, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(kV.p_value, std::erfc(1.0), 1e-12);
  EXPECT_NEAR(kV.between, 0.1, 1e-12);
  EXPECT_NEAR(kV.ratio, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(kV.mean, 1.1, 1e-12);
  EXPECT_NEAR(kV.standard_error, 0.1, 1e-12);
  EXPECT_TRUE(kV.agrees());
  EXPECT_EQ(named(compared, "kS").between, 0.0);
}

TEST(Repeatability, NamesTheLogThatIsNotAsTheOthers) {
  const auto compared =
      compare_fits({fit_with(1.0, 0.01), fit_with(1.3, 0.01), fit_with(1.01, 0.01)}).value();
  const GainComparison& kV = named(compared, "kV");
  EXPECT_FALSE(kV.agrees());
  EXPECT_EQ(kV.outlier, 1u);
  EXPECT_EQ(kV.pair, (std::array<std::size_t, 2>{0, 1}));
  // Of two that differ none can be told to be the odd one; nor of two pairs.
  const auto two = compare_fits({fit_with(1.0, 0.01), fit_with(1.3, 0.01)}).value();
  EXPECT_FALSE(named(two, "kV").outlier);
  const auto pairs = compare_fits({fit_with(1.0, 0.01), fit_with(1.3, 0.01), fit_with(1.0, 0.01),
                                   fit_with(1.3, 0.01)})
                         .value();
  EXPECT_FALSE(named(pairs, "kV").outlier);
}

TEST(Repeatability, WidensAJointFitByTheScatter) {
  const auto compared = compare_fits({fit_with(1.0, 0.01), fit_with(1.2, 0.01)}).value();
  FeedforwardFit joint = fit_with(1.1, 0.007);
  widen_by_scatter(joint, compared);
  // between² = (200 - 1)/(20000 - 10000), over two logs.
  const double scatter = 0.0199 / 2.0;
  EXPECT_NEAR(joint.kV.standard_error, std::sqrt(0.007 * 0.007 + scatter), 1e-12);
  EXPECT_LT(joint.kV.interval[0], 1.1 - 12.0 * std::sqrt(scatter));  // Student's t of 1 is 12.7
  EXPECT_EQ(joint.kS.standard_error, 0.01);
  // Logs that agree, but scatter by 1.41 of what was expected.
  const auto agreeing = compare_fits({fit_with(1.0, 0.1), fit_with(1.2, 0.1)}).value();
  joint = fit_with(1.1, 0.07);
  widen_by_scatter(joint, agreeing);
  EXPECT_NEAR(joint.kV.standard_error, 0.07 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(joint.kV.interval[1], 1.1 + 1.959963984540054 * 0.07 * std::sqrt(2.0), 1e-12);
}

// Sessions of one mechanism: they agree, and together tell more than each.
TEST(Repeatability, JoinsTheLogsOfOneMechanism) {
  std::vector<Recording> recordings;
  std::vector<FeedforwardFit> fits;
  for (const std::uint64_t seed : {11u, 12u, 13u}) {
    recordings.push_back(recordings::record(recordings::elevator, seed));
    fits.push_back(fit_feedforward(recordings.back()).value());
  }
  const auto compared = compare_fits(fits).value();
  for (const GainComparison& comparison : compared) {
    EXPECT_TRUE(comparison.agrees()) << comparison.name;
    EXPECT_LT(comparison.largest_z, 3.0) << comparison.name;
  }
  const auto all = joined(recordings).value();
  EXPECT_EQ(all.runs.size(), 12u);
  const auto joint = fit_feedforward(all).value();
  EXPECT_NEAR(joint.kA.value, 0.3, 0.01);
  EXPECT_LT(joint.kA.standard_error, fits[0].kA.standard_error);
}

TEST(Repeatability, LeavesOutAChannelThatOneLogHasNot) {
  Recording both = recordings::record(recordings::flywheel);
  Recording one = both;
  for (TestRun& run : one.runs) {
    run.position.clear();
  }
  const auto all = joined({both, one}).value();
  EXPECT_TRUE(all.runs.front().position.empty());
  EXPECT_FALSE(all.runs.front().velocity.empty());
  for (TestRun& run : both.runs) {
    run.velocity.clear();
  }
  EXPECT_TRUE(joined({both, one}).error().is(ArgumentError::wrong_shape));
  one.unit = "m";
  EXPECT_TRUE(joined({both, one}).error().is(ArgumentError::wrong_unit));
  EXPECT_TRUE(joined({}).error().is(ArgumentError::empty));
}

TEST(Repeatability, Errors) {
  EXPECT_TRUE(compare_fits({}).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(compare_fits({fit_with(1.0, 0.1)}).error().is(ArgumentError::wrong_shape));
  FeedforwardFit other = fit_with(1.0, 0.1);
  other.unit = "m";
  EXPECT_TRUE(compare_fits({fit_with(1.0, 0.1), other}).error().is(ArgumentError::wrong_unit));
}

}  // namespace
