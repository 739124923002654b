#include <flyball/identification/streamed_one_step.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/identification/identification_error.hpp>

#include "recordings.hpp"

namespace streamed_one_step_test {
namespace {

using namespace flyball::identification;
using flyball::mechanisms::MechanismKind;

/// The rows that `fit_one_step` takes, one after the other.
StreamedOneStep streamed(const PreparedRecording& recording) {
  StreamedOneStep regression(*recording.mechanism, recording.has_position);
  for (const PreparedRun& prepared : recording.runs) {
    const TestRun& run = prepared.run;
    for (std::size_t i = prepared.first; prepared.moved && i + 1 < prepared.last; ++i) {
      if (run.time[i + 1] - run.time[i] <= 1.5 * recording.row_period) {
        regression.add(run.velocity[i], run.voltage[i], run.position[i], run.velocity[i + 1]);
      }
    }
  }
  return regression;
}

// Of the same rows it is the same regression, of each kind and to the last digits.
TEST(StreamedOneStep, IsTheRegressionOfAllRows) {
  for (const std::size_t mechanism :
       {recordings::flywheel, recordings::elevator, recordings::arm}) {
    const auto prepared = prepare(recordings::record(mechanism));
    ASSERT_TRUE(prepared);
    const auto whole = fit_one_step(*prepared);
    ASSERT_TRUE(whole) << to_string(whole.error());
    const auto found = streamed(*prepared).fit(prepared->row_period);
    ASSERT_TRUE(found) << to_string(found.error());
    for (const auto& [a, b] : {std::pair{found->kS, whole->kS},
                               {found->kV, whole->kV},
                               {found->kA, whole->kA},
                               {found->kG, whole->kG},
                               {found->alpha, whole->alpha},
                               {found->r_squared, whole->r_squared},
                               {found->angle_offset, whole->angle_offset}}) {
      EXPECT_NEAR(a, b, 1e-9 * (1.0 + std::abs(b))) << mechanism;
    }
    EXPECT_EQ(found->period, prepared->row_period);
  }
}

TEST(StreamedOneStep, RefusesWhatTellsNothing) {
  StreamedOneStep regression(MechanismKind::flywheel);
  EXPECT_FALSE(regression.add(0.0, 1.0, 0.0, 0.1));  // at rest
  EXPECT_FALSE(regression.add(1.0, std::nan(""), 0.0, 0.1));
  EXPECT_EQ(regression.rows(), 0U);
  EXPECT_TRUE(regression.fit(0.02).error().is(IdentificationError::too_short));
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(regression.add(1.0, 2.0, 0.0, 1.0));
  }
  EXPECT_TRUE(regression.fit(0.02).error().is(IdentificationError::singular));
}

}  // namespace
}  // namespace streamed_one_step_test
