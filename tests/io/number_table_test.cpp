#include <flyball/io/number_table.hpp>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <flyball/io/log_error.hpp>

namespace flyball::number_table_test {
namespace {

Expected<NumberTable> parse(std::string_view text, std::size_t columns) {
  return parse_number_table(text, "a.dat", columns);
}

TEST(NumberTable, ReadsBlanksTabsCommasAndComments) {
  const auto table = parse(
      "\xEF\xBB\xBFtime,x,y\r\n# a comment\r\n1248444189.599 \t 14 \t 3.787 \t -0.257 \r\n"
      "\r\n% another\n2;3;4\n5,6,7e-1,extra",
      3);
  ASSERT_TRUE(table) << to_string(table.error());
  ASSERT_EQ(table->rows.size(), 3U);
  EXPECT_EQ(table->rows[0], (std::vector<double>{1248444189.599, 14.0, 3.787}));
  EXPECT_EQ(table->rows[1], (std::vector<double>{2.0, 3.0, 4.0}));
  EXPECT_EQ(table->rows[2], (std::vector<double>{5.0, 6.0, 0.7}));
  EXPECT_EQ(table->lines, (std::vector<int>{3, 6, 7}));
}

TEST(NumberTable, TellsTheLineOfWhatIsWrong) {
  for (const auto& [text, line] : {std::pair("1 2 3\n4 5\n", "a.dat:2"),
                                   {"1 2 3\n4 x 6\n", "a.dat:2"},
                                   {"1 2 3\n4 nan 6\n", "a.dat:2"},
                                   {"1 2\n", "a.dat:1"},
                                   {"1 2 3\nwords\n", "a.dat:2"}}) {
    const auto table = parse(text, 3);
    ASSERT_FALSE(table) << text;
    EXPECT_TRUE(table.error().is(LogError::malformed));
    EXPECT_NE(to_string(table.error()).find(line), std::string::npos) << to_string(table.error());
  }
  for (const char* text : {"", "\n\n", "# only\n", "words alone\n"}) {
    const auto table = parse(text, 2);
    ASSERT_FALSE(table) << text;
    EXPECT_TRUE(table.error().is(LogError::no_data));
  }
}

TEST(NumberTable, WhatPrecedesACutIsRead) {
  for (const char* rest : {"4", "4 5", "4 -", "4 5 1e", "4 5 "}) {
    const auto table = parse(std::string("1 2 3\n") + rest, 3);
    ASSERT_TRUE(table) << rest << to_string(table.error());
    EXPECT_EQ(table->rows.size(), 1U);
    EXPECT_EQ(table->cut_line, 2);
    EXPECT_FALSE(parse(std::string("1 2 3\n") + rest + "\n", 3)) << rest;
  }
  EXPECT_EQ(parse("1 2 3\n4 5 6", 3)->cut_line, 0);
  EXPECT_FALSE(parse("1 2 3\n4 nan", 3));
  EXPECT_FALSE(parse("4 5", 3));  // Nothing precedes it.
}

TEST(NumberTable, AnyBytesAreAnsweredOrRefused) {
  {
    const bool holds = rc::check([](const std::string& bytes) {
      const auto table = parse(bytes, 2);
      const bool answered =
          table.has_value() ? !table->rows.empty() : !to_string(table.error()).empty();
      RC_ASSERT(answered);
    });
    EXPECT_TRUE(holds);
  }
}

}  // namespace
}  // namespace flyball::number_table_test
