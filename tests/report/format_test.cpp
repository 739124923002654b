#include <gtest/gtest.h>

#include "report/format.hpp"

namespace flyball::report::format_test {
namespace {

TEST(Format, WrapKeepsTheWidthAndEveryWord) {
  const std::string text = "the quick brown fox jumps over the lazy dög ± 1 V·s²/m";
  std::string joined;
  for (const std::string& line : wrap(text, 12)) {
    EXPECT_LE(display_width(line), 12u) << line;
    joined += (joined.empty() ? "" : " ") + line;
  }
  EXPECT_EQ(joined, text);
  EXPECT_EQ(display_width("V·s²/m"), 6u);
  EXPECT_EQ(wrap("incomprehensibilities", 5).size(), 1u);
}

TEST(Format, TextCannotBecomeMarkup) {
  EXPECT_EQ(escape_html("<a href=\"x\">&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&amp;&#39;&lt;/a&gt;");
  EXPECT_EQ(escape_html("\x1b[31m"), "\xEF\xBF\xBD[31m");
}

}  // namespace
}  // namespace flyball::report::format_test
