#pragma once

#include <string>

#include <flyball/core/expected.hpp>
#include <flyball/identification/preparation.hpp>

/// Which tests there are, and what they determine together.
namespace flyball::identification {

struct TestCoverage {
  bool ramps = false;
  bool steps = false;
  bool forward = false;
  bool backward = false;

  [[nodiscard]] bool one_way() const { return forward != backward; }
};

/// @errors IdentificationError::no_data, no_motion; missing_tests for steps of one voltage alone.
[[nodiscard]] Expected<TestCoverage> cover_tests(const PreparedRecording& prepared);

}  // namespace flyball::identification
