#include <flyball/identification/recording.hpp>

#include <flyball/identification/identification_error.hpp>

namespace recording_test {
namespace {

using namespace flyball::identification;
using flyball::ArgumentError;
using flyball::ErrorKind;

TEST(TestKind, NamesRoundTrip) {
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    EXPECT_EQ(parse_test_kind(to_string(kind)).value(), kind);
  }
}

TEST(TestKind, UnderstandsSysIdJsonAndSeparators) {
  EXPECT_EQ(parse_test_kind("slow-forward").value(), TestKind::quasistatic_forward);
  EXPECT_EQ(parse_test_kind("fast-backward").value(), TestKind::dynamic_reverse);
  EXPECT_EQ(parse_test_kind("Quasistatic_Reverse").value(), TestKind::quasistatic_reverse);
  EXPECT_EQ(parse_test_kind("dynamic forward").value(), TestKind::dynamic_forward);
}

TEST(TestKind, RefusesOtherNames) {
  const auto kind = parse_test_kind("none");
  ASSERT_FALSE(kind);
  EXPECT_TRUE(kind.error().is(ArgumentError::unknown_name));
}

TEST(TestKind, KnowsRampsAndDirections) {
  EXPECT_TRUE(is_quasistatic(TestKind::quasistatic_reverse));
  EXPECT_FALSE(is_quasistatic(TestKind::dynamic_forward));
  EXPECT_TRUE(is_forward(TestKind::dynamic_forward));
  EXPECT_FALSE(is_forward(TestKind::quasistatic_reverse));
}

TEST(IdentificationError, AreAnswersNotMisuse) {
  for (const IdentificationError code :
       {IdentificationError::no_data, IdentificationError::no_motion,
        IdentificationError::missing_tests, IdentificationError::too_short,
        IdentificationError::singular, IdentificationError::unphysical_gains}) {
    EXPECT_EQ(error_info(code).kind, ErrorKind::no_answer);
    EXPECT_EQ(error_info(code).family, "identification");
  }
  // The person can say it.
  EXPECT_EQ(error_info(IdentificationError::unknown_mechanism).kind, ErrorKind::misuse);
}

}  // namespace
}  // namespace recording_test
