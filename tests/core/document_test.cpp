#include <flyball/core/document.hpp>

#include <limits>

#include <gtest/gtest.h>

namespace flyball::document_test {
namespace {

TEST(Document, AQuantityIsTextAndData) {
  const Value mass = quantity(8.12345, "kg", 3);
  EXPECT_EQ(mass.text, "8.12 kg");
  EXPECT_EQ(mass.number, 8.12345);
  EXPECT_EQ(mass.unit, "kg");
  const Value of_a_table = quantity(0.5, "m", 4, /*shown=*/false);
  EXPECT_EQ(of_a_table.text, "0.5");
  EXPECT_EQ(of_a_table.unit, "m");
  EXPECT_EQ(quantity(std::numeric_limits<double>::infinity(), "s").text, "∞ s");
  EXPECT_EQ(quantity(2.0, "").text, "2");
  EXPECT_FALSE(Value("words").number);
}

TEST(Document, AVerdictIsAsBadAsItsWorstReason) {
  Verdict verdict;
  EXPECT_EQ(verdict.tone, Tone::good);
  verdict.add(Tone::good, "a");
  EXPECT_EQ(verdict.tone, Tone::good);
  verdict.add(Tone::caution, "b");
  EXPECT_EQ(verdict.tone, Tone::caution);
  verdict.add(Tone::bad, "c");
  verdict.add(Tone::caution, "d");
  EXPECT_EQ(verdict.tone, Tone::bad);
  EXPECT_EQ(verdict.reasons, (std::vector<std::string>{"a", "b", "c", "d"}));
}

TEST(Document, DiagnosticsStandBySeverityAndEqualOnesOnce) {
  const Section section = diagnostics_section({{"a", Severity::info, "1"},
                                               {"b", Severity::error, "2"},
                                               {"c", Severity::warning, "3"},
                                               {"a", Severity::info, "1"},
                                               {"a", Severity::info, "other words"},
                                               {"d", Severity::error, "4"}});
  std::string order;
  for (const Diagnostic& found : std::get<Findings>(section.blocks.at(0)).diagnostics) {
    order += found.code;
  }
  EXPECT_EQ(order, "bdcaa");
  EXPECT_EQ(std::get<Paragraph>(diagnostics_section({}).blocks.at(0)).tone, Tone::good);
}

}  // namespace
}  // namespace flyball::document_test
