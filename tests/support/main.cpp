#include <cstdlib>

#include <gtest/gtest.h>

int main(int argc, char** argv) {
  // RapidCheck would take its seed from the clock. RC_PARAMS="seed=... max_success=..." overrides.
  setenv("RC_PARAMS", "seed=20220901", /*overwrite=*/0);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
