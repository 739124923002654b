#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>

namespace flyball::identification {

/// The four characterisation tests: a slow voltage ramp (quasistatic) and a voltage step (dynamic),
/// each in both directions.
enum class TestKind {
  quasistatic_forward,
  quasistatic_reverse,
  dynamic_forward,
  dynamic_reverse,
};

/// "quasistatic-forward", … as SysId's test state words them.
[[nodiscard]] std::string_view to_string(TestKind kind);

/// The test of that name; '-', '_' and ' ' are the same, and SysId JSON's "slow-forward",
/// "fast-backward" are understood.
/// @errors ArgumentError::unknown_name.
[[nodiscard]] Expected<TestKind> parse_test_kind(std::string_view name);

/// Whether the test is a slow ramp.
[[nodiscard]] constexpr bool is_quasistatic(TestKind kind) {
  return kind == TestKind::quasistatic_forward || kind == TestKind::quasistatic_reverse;
}
/// Whether the test is driven forward.
[[nodiscard]] constexpr bool is_forward(TestKind kind) {
  return kind == TestKind::quasistatic_forward || kind == TestKind::dynamic_forward;
}

/// One test as it was recorded, on one clock; all columns have the same length.
///
/// `position` or `velocity` may be empty if the log has no such channel (not both).
struct TestRun {
  TestKind kind = TestKind::quasistatic_forward;
  std::vector<double> time{};      ///< s, ascending.
  std::vector<double> voltage{};   ///< V, applied to the motors.
  std::vector<double> position{};  ///< m or rad, at the output.
  std::vector<double> velocity{};  ///< m/s or rad/s, at the output.

  // What a person says of it.
  double from = 0.0;  ///< s after its first row: what is before is not used.
  double to = std::numeric_limits<double>::infinity();  ///< s after its first row.
  bool left_out = false;                                ///< It is shown, not used.
  [[nodiscard]] bool is_trimmed() const {
    return from > 0.0 || to < std::numeric_limits<double>::infinity();
  }
};

/// The characterisation tests of one mechanism, any number of each kind.
struct Recording {
  std::optional<mechanisms::MechanismKind> mechanism{};  ///< What the log says it is, if it does.
  std::string unit = "rad";                              ///< Unit of position: "m" or "rad".
  std::vector<TestRun> runs{};
};

}  // namespace flyball::identification
