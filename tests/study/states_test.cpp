#include <flyball/study/states.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/planning/configuration/configuration_space.hpp>
#include <flyball/study/project.hpp>

namespace flyball::study::states_test {
namespace {

/// An elevator with an arm that must not be low while the elevator is.
const std::string machine = R"(
start = "stowed"
depth = 5

[[coordinate]]
name = "height"
low = "0 m"
high = "1 m"

[[coordinate]]
name = "arm"
kind = "angle"
low = "-90 deg"
high = "90 deg"

[[forbid]]
name = "arm in the bumper"
box = { height = ["0 m", "0.3 m"], arm = ["-90 deg", "-20 deg"] }

[[set]]
name = "above"
box = { height = ["0.2 m", "1 m"] }

[[state]]
name = "stowed"
at = { height = "0 m", arm = "80 deg" }

[[state]]
name = "floor"
at = { height = "0.4 m", arm = "-60 deg" }
within = ["above"]

[[state]]
name = "high"
at = { height = "1 m", arm = "60 deg" }

[[transition]]
from = "stowed"
event = "collect"
to = "floor"
order = ["height", "arm"]

[[transition]]
from = "*"
event = "raise"
to = "high"

[[transition]]
from = "floor"
event = "stow"
to = "stowed"
order = ["arm", "height"]

[[transition]]
from = "high"
event = "stow"
to = "stowed"

[[sequence]]
name = "one piece"
events = ["collect", "raise", "stow"]
states = ["floor", "high", "stowed"]
)";

std::string with(std::string text, const std::string& what, const std::string& instead) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), instead);
}

StatesResult validate(const std::string& text) {
  const auto job = parse_states(text, "m.toml");
  EXPECT_TRUE(job) << to_string(static_cast<const Error&>(job.error()));
  auto result = validate_state_machine(*job);
  EXPECT_TRUE(result) << to_string(result.error());
  return std::move(result).value();
}

std::string refusal_of(const std::string& text) {
  const auto job = parse_states(text, "m.toml");
  if (!job) {
    return to_string(static_cast<const Error&>(job.error()));
  }
  const auto result = validate_state_machine(*job);
  return result ? "validated" : to_string(result.error());
}

TEST(States, ASafeMachineIsFoundSafe) {
  const StatesResult result = validate(machine);
  EXPECT_FALSE(result.violation);
  ASSERT_EQ(result.sequences.size(), 1U);
  EXPECT_FALSE(result.sequences[0].violation);
  EXPECT_EQ(result.sequences[0].states,
            (std::vector<std::string>{"stowed", "floor", "high", "stowed"}));
  EXPECT_TRUE(result.complete);
  // Three events in each of three states, of which collect is known in one, stow in two.
  EXPECT_EQ(result.moves, 6U);
  EXPECT_EQ(result.sequences_explored, 3 + 9 + 27 + 81 + 243);
  EXPECT_EQ(result.unknown_events.size(), 3U);
  EXPECT_TRUE(result.unreached.empty());
}

TEST(States, ExplainsTheFirstViolation) {
  // Arm and elevator move together: the arm is at -20° after 100/140 of the way, at 0.4·5/7 =
  // 0.2857 m, below the 0.3 m.
  const StatesResult result =
      validate(with(machine, "to = \"floor\"\norder = [\"height\", \"arm\"]", "to = \"floor\""));
  ASSERT_TRUE(result.violation);
  const MachineViolation& violation = *result.violation;
  EXPECT_EQ(violation.events, (std::vector<std::string>{"collect"}));
  EXPECT_EQ(violation.broken, "arm in the bumper");
  EXPECT_NEAR(violation.share, 100.0 / 140.0, 1e-9);
  EXPECT_NEAR(violation.at[0], 0.4 * 100.0 / 140.0, 1e-9);
  EXPECT_EQ(violation.explanation,
            "After the start, \"collect\" moves from stowed to floor: 71.4 % of the way on, at "
            "height = 0.2857 m, arm = -0.3491 rad, arm in the bumper is broken.");
  // The replayed sequence finds it, too.
  ASSERT_TRUE(result.sequences[0].violation);
  EXPECT_EQ(result.sequences[0].violation->sequence, "one piece");
}

TEST(States, AnEventDuringAMoveStartsWhereTheRobotIs) {
  // One coordinate pair; from a at (0, 0) to b at (1, 0) and on to c at (1, 1) all is free. The
  // square between is forbidden: who is called to c on the way to b cuts through it.
  const std::string corner = R"(
depth = 3
[[coordinate]]
name = "x"
kind = "number"
low = 0.0
high = 1.0
[[coordinate]]
name = "y"
kind = "number"
low = 0.0
high = 1.0
[[forbid]]
name = "square"
box = { x = [0.0, 0.9], y = [0.1, 1.0] }
[[state]]
name = "a"
at = { x = 0.0, y = 0.0 }
[[state]]
name = "b"
at = { x = 1.0, y = 0.0 }
[[state]]
name = "c"
at = { x = 1.0, y = 1.0 }
[[transition]]
from = "a"
event = "go"
to = "b"
[[transition]]
from = "b"
event = "up"
to = "c"
)";
  EXPECT_FALSE(validate(corner).violation);
  const StatesResult early = validate("interrupts = 1\n" + corner);
  ASSERT_TRUE(early.violation);
  EXPECT_EQ(early.violation->events, (std::vector<std::string>{"go", "up"}));
  EXPECT_EQ(early.violation->arrived, (std::vector<double>{0.5}));
  EXPECT_EQ(early.violation->broken, "square");
  // From (0.5, 0) to (1, 1): y = 0.1 after a tenth.
  EXPECT_NEAR(early.violation->share, 0.1, 1e-9);
  EXPECT_NE(early.violation->explanation.find("while the move before is at 50 %"),
            std::string::npos)
      << early.violation->explanation;
}

TEST(States, SetsAndExpectationsAreHeld) {
  EXPECT_EQ(validate(with(machine, "box = { height = [\"0.2 m\", \"1 m\"] }",
                          "box = { height = [\"0.5 m\", \"1 m\"] }"))
                .violation->broken,
            "above");
  const StatesResult expected = validate(with(machine, "states = [\"floor\", \"high\", \"stowed\"]",
                                              "states = [\"floor\", \"floor\", \"stowed\"]"));
  ASSERT_TRUE(expected.sequences[0].violation);
  EXPECT_EQ(expected.sequences[0].violation->explanation,
            "After \"raise\" in floor the machine is in high, not in floor.");
  EXPECT_FALSE(expected.violation);
  const StatesResult strict = validate("strict = true\n" + machine);
  ASSERT_TRUE(strict.violation);
  EXPECT_EQ(strict.violation->explanation,
            "\"stow\" comes in stowed, which has no transition for it.");
  const StatesResult way =
      validate(with(machine, "states = [\"floor\", \"high\", \"stowed\"]", "within = [\"above\"]"));
  ASSERT_TRUE(way.sequences[0].violation);
  EXPECT_EQ(way.sequences[0].violation->broken, "above");
}

// A search that ends at its bound decides nothing.
TEST(States, ASearchThatGaveUpIsUndecided) {
  StatesResult result = validate(machine);
  EXPECT_FALSE(answer_of(result).refusal);
  result.complete = false;
  result.depth_reached = 4;
  const Answer answer = answer_of(result);
  ASSERT_TRUE(answer.refusal);
  EXPECT_TRUE(answer.refusal->is(ConfigurationError::undecided));
  EXPECT_NE(to_string(*answer.refusal).find("no sequence of up to 3 events"), std::string::npos)
      << to_string(*answer.refusal);
  EXPECT_EQ(answer.document.verdict.line.rfind("Undecided", 0), 0U);
}

TEST(States, TellsWhatIsWrongAndWhere) {
  EXPECT_EQ(refusal_of(with(machine, "name = \"height\"\nlow = \"0 m\"",
                            "name = \"height\"\nlow = \"0 deg\""))
                .substr(0, 13),
            "m.toml:7:7: l");
  EXPECT_EQ(refusal_of(with(machine, "arm = \"80 deg\"", "arms = \"80 deg\"")),
            "m.toml:26:31: \"arms\" is no coordinate; it must be one of height, arm");
  EXPECT_NE(
      refusal_of(with(machine, "to = \"high\"", "to = \"hihg\"")).find("did you mean \"high\"?"),
      std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "event = \"raise\"", "evnt = \"raise\""))
                .find("did you mean event?"),
            std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "event = \"raise\"", "event = ")).find("expected value"),
            std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "at = { height = \"0 m\", arm = \"80 deg\" }",
                            "at = { height = \"0 m\", arm = \"-60 deg\" }"))
                .find("arm in the bumper"),
            std::string::npos);
  EXPECT_NE(refusal_of("depth = 3").find("[[coordinate]] is missing"), std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "depth = 5", "depth = 0")).find("depth is 0"),
            std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "events = [\"collect\"", "events = [\"colect\""))
                .find("did you mean \"collect\"?"),
            std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "[\"0.2 m\", \"1 m\"]", "[\"1 m\", \"0.2 m\"]"))
                .find("the lowest value first"),
            std::string::npos);
  EXPECT_NE(refusal_of(with(machine, "high = \"1 m\"", "high = \"inf m\"")).find("m.toml:8"),
            std::string::npos);
}

}  // namespace
}  // namespace flyball::study::states_test
