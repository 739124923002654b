#include <flyball/core/error.hpp>

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/errors.hpp>

namespace flyball {

// A family as a domain would write it, in a namespace of its own so that ADL has to find it.
namespace kettle {

enum class KettleError { too_hot, empty };

ErrorInfo error_info(KettleError code) {
  switch (code) {
    case KettleError::too_hot:
      return {"kettle", "too_hot", "the water boils", ErrorKind::no_answer};
    case KettleError::empty:
      return {"kettle", "empty", "there is no water", ErrorKind::environment};
  }
  return {"kettle", "unknown", "unknown error", ErrorKind::defect};
}

}  // namespace kettle

namespace {

using kettle::KettleError;

static_assert(ErrorEnum<ArgumentError> && ErrorEnum<KettleError>);
static_assert(!ErrorEnum<Severity> && !ErrorEnum<int>);

TEST(Error, SaysItsSummaryIfNothingElseIsKnown) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot)), "the water boils");
}

TEST(Error, NamesWhereItHappened) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot).in("brew")), "brew: the water boils");
}

TEST(Error, ASubjectWithoutWhatWasGotIsFollowedByTheSummary) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot).about("pot 2")), "pot 2: the water boils");
}

TEST(Error, ASubjectIsWhatWasGot) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot).about("pot 2").got("120 degrees")),
            "pot 2 is 120 degrees");
}

TEST(Error, WhatWasGotWithoutASubjectFollowsTheSummary) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot).got("120 degrees")),
            "the water boils: got 120 degrees");
}

TEST(Error, SaysWhatItMustBeAndHowToMendIt) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot).expected("below 100").hint("wait a minute")),
            "the water boils; it must be below 100; wait a minute");
}

TEST(Error, ListsItsEvidenceInTheOrderGiven) {
  EXPECT_EQ(to_string(Error(KettleError::too_hot)
                          .with("temperature", 373.15)
                          .with("eigenvalue", std::vector<double>{1.02, -0.5})
                          .with("sensor", std::string("left"))),
            "the water boils (temperature = 373.15, eigenvalue = [1.02, -0.5], sensor: left)");
}

TEST(Error, PutsAllPartsTogether) {
  const Error error = Error(KettleError::too_hot)
                          .in("tea.toml:3:7")
                          .about("pot 2")
                          .got("120 degrees")
                          .expected("below 100")
                          .hint("wait a minute")
                          .with("pressure", 2.0);
  EXPECT_EQ(to_string(error),
            "tea.toml:3:7: pot 2 is 120 degrees; it must be below 100; wait a minute (pressure = "
            "2)");
  EXPECT_EQ(error.where(), "tea.toml:3:7");
  EXPECT_EQ(error.subject(), "pot 2");
  ASSERT_EQ(error.evidence().size(), 1U);
  EXPECT_EQ(error.evidence()[0].name, "pressure");
  EXPECT_EQ(error.evidence()[0].values, std::vector<double>{2.0});
}

TEST(Error, DoesNotEchoWhatIsTooLong) {
  const std::string text(100'000, 'x');
  const Error error =
      Error(KettleError::empty).about("water").got('"' + text + '"').with("t", text);
  EXPECT_LT(to_string(error).size(), 500U);
  EXPECT_LT(error.evidence().front().text.size(), 300U);
}

TEST(Errors, TellWhatWasNoticedBeforeThem) {
  const Errors errors =
      Errors(Error(KettleError::empty)).after({{"b", Severity::info, "B"}}).after({{"a"}});
  ASSERT_EQ(errors.diagnostics().size(), 2U);
  EXPECT_EQ(errors.diagnostics().front().code, "a");
  EXPECT_TRUE(errors.is(KettleError::empty));
  const Error error = not_enough_memory("a.json");
  EXPECT_EQ(to_string(error),
            "there is not enough memory for a.json; give less at once, or free some");
  EXPECT_EQ(error.code(), "not_enough_memory");
  EXPECT_EQ(error.kind(), ErrorKind::environment);
}

TEST(Error, KnowsItsCodeAndKind) {
  const Error error(KettleError::empty);
  EXPECT_TRUE(error.is(KettleError::empty));
  EXPECT_FALSE(error.is(KettleError::too_hot));
  EXPECT_EQ(error.kind(), ErrorKind::environment);
  EXPECT_EQ(error.code(), "empty");
  EXPECT_EQ(error.info().family, "kettle");
}

TEST(Error, TheSameNameInAnotherFamilyIsAnotherError) {
  EXPECT_FALSE(Error(KettleError::empty).is(ArgumentError::empty));
  EXPECT_FALSE(Error(ArgumentError::empty).is(KettleError::empty));
}

TEST(ArgumentError, EveryCodeDescribesItselfOnce) {
  std::vector<std::string_view> names;
  for (const ArgumentError code :
       {ArgumentError::wrong_shape, ArgumentError::not_finite, ArgumentError::not_symmetric,
        ArgumentError::not_positive, ArgumentError::out_of_range, ArgumentError::empty,
        ArgumentError::wrong_unit, ArgumentError::unknown_name, ArgumentError::ambiguous_name,
        ArgumentError::malformed}) {
    const ErrorInfo info = error_info(code);
    EXPECT_EQ(info.family, "argument");
    EXPECT_EQ(info.kind, ErrorKind::misuse);
    EXPECT_FALSE(info.summary.empty());
    EXPECT_FALSE(info.summary.ends_with('.'));
    EXPECT_EQ(std::count(names.begin(), names.end(), info.name), 0) << info.name;
    names.push_back(info.name);
  }
}

TEST(Diagnostic, SeveritiesHaveTheNamesOfTheSchema) {
  EXPECT_EQ(to_string(Severity::info), "info");
  EXPECT_EQ(to_string(Severity::warning), "warning");
  EXPECT_EQ(to_string(Severity::error), "error");
}

TEST(Error, KeepsItsPartsWhenAssignedToItself) {
  Error error = Error(ArgumentError::empty).about("R").with("pivot", 0.0);
  error = std::move(error).in("lqr");
  EXPECT_EQ(error.where(), "lqr");
  EXPECT_EQ(error.subject(), "R");
  ASSERT_EQ(error.evidence().size(), 1u);
  EXPECT_EQ(error.evidence()[0].name, "pivot");
}

// A program that ends with `.value()` prints what is wrong.
TEST(Error, IsWhatValueThrows) {
  const Expected<int> none = tl::unexpected(Error(KettleError::too_hot).about("tea").got("140"));
  const ExpectedAll<int> nothing = tl::unexpected(Errors(none.error()));
  const auto text_of = [](const auto& expected) -> std::string {
    try {
      return std::to_string(expected.value());
    } catch (const std::exception& thrown) {
      return thrown.what();
    }
  };
  EXPECT_EQ(text_of(none), to_string(none.error()));
  EXPECT_EQ(text_of(nothing), to_string(none.error()));
  EXPECT_NE(text_of(none).find("tea is 140"), std::string::npos);
  EXPECT_EQ(text_of(Expected<int>(3)), "3");
}

}  // namespace
}  // namespace flyball
