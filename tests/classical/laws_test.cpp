#include <gtest/gtest.h>

#include "classical/laws.hpp"

namespace flyball::classical::laws_test {
namespace {

// bench/classical tries them on ten thousand systems each.
TEST(Laws, HoldOnASample) {
  for (const flyball::test::Law& holds : flyball::test::all_laws) {
    const flyball::test::LawTally law = holds(2026, 40);
    EXPECT_EQ(law.violations, 0) << law.law << ": " << law.worst;
    EXPECT_LE(10 * law.refused, law.systems) << law.law;
  }
}

}  // namespace
}  // namespace flyball::classical::laws_test
