#include <flyball/identification/repeatability.hpp>

#include <cmath>

#include "drive_sessions.hpp"
#include "recordings.hpp"

namespace repeatability_test {
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
  EXPECT_TRUE(joined(std::vector<Recording>()).error().is(ArgumentError::empty));
}

TEST(Repeatability, Errors) {
  EXPECT_TRUE(compare_fits(std::vector<FeedforwardFit>()).error().is(ArgumentError::wrong_shape));
  EXPECT_TRUE(compare_fits({fit_with(1.0, 0.1)}).error().is(ArgumentError::wrong_shape));
  FeedforwardFit other = fit_with(1.0, 0.1);
  other.unit = "m";
  EXPECT_TRUE(compare_fits({fit_with(1.0, 0.1), other}).error().is(ArgumentError::wrong_unit));
}

// Three sessions of one drivetrain agree; one whose kV is a tenth larger is named, and what the
// joint fit says of it holds the difference.
TEST(Repeatability, LogsOfADrivetrain) {
  std::vector<DriveFit> fits;
  std::vector<DriveRecording> recordings;
  for (const std::uint64_t seed : {1, 2, 3}) {
    recordings.push_back(drives::record({.seed = seed}));
    fits.push_back(*identify_drive(recordings.back()).fit);
  }
  const auto agreeing = compare_fits(fits);
  ASSERT_TRUE(agreeing) << to_string(agreeing.error());
  for (const char* name : {"kV_linear", "kA_linear", "kV_angular", "trackwidth", "kS_left"}) {
    EXPECT_TRUE(named(*agreeing, name).agrees()) << name;
    EXPECT_EQ(named(*agreeing, name).logs.size(), 3U);
  }
  EXPECT_EQ(named(*agreeing, "kV_angular").unit, "V·s/m");
  EXPECT_NEAR(named(*agreeing, "kV_linear").mean, drives::truth.kV_linear,
              0.01 * drives::truth.kV_linear);
  const auto joint = joined(recordings);
  ASSERT_TRUE(joint);
  EXPECT_EQ(joint->runs.size(), 3 * recordings[0].runs.size());

  fits[2].linear->kV.value *= 1.1;
  for (double& end : fits[2].linear->kV.interval) {
    end *= 1.1;
  }
  const auto odd = compare_fits(fits);
  const GainComparison& kV = named(*odd, "kV_linear");
  EXPECT_FALSE(kV.agrees());
  EXPECT_EQ(kV.outlier, std::optional<std::size_t>(2));
  DriveFit together = fits[0];
  const double before = together.linear->kV.interval[1] - together.linear->kV.interval[0];
  widen_by_scatter(together, *odd);
  EXPECT_GT(together.linear->kV.interval[1] - together.linear->kV.interval[0], 3.0 * before);

  recordings[1].unit = "rad";
  EXPECT_TRUE(joined(recordings).error().is(ArgumentError::wrong_unit));
  EXPECT_TRUE(compare_fits(std::vector<DriveFit>(1)).error().is(ArgumentError::wrong_shape));
}

}  // namespace
}  // namespace repeatability_test
