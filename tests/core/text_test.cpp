#include <flyball/core/text.hpp>

#include <algorithm>
#include <array>
#include <string>

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

namespace flyball::text_test {
namespace {

TEST(EditDistance, OfTextbookPairs) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);  // k→s, e→i, +g
  EXPECT_EQ(edit_distance("flaw", "lawn"), 2U);       // -f, +n
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", ""), 3U);
  EXPECT_EQ(edit_distance("same", "same"), 0U);
}

// A distance is symmetric, zero only between equals, at least the difference in length, and obeys
// the triangle inequality.
RC_GTEST_PROP(EditDistance, IsAMetric, ()) {
  const auto text = rc::gen::container<std::string>(rc::gen::inRange('a', 'd'));
  const std::string a = *text;
  const std::string b = *text;
  const std::string c = *text;
  const std::size_t ab = edit_distance(a, b);
  RC_ASSERT(ab == edit_distance(b, a));
  RC_ASSERT((ab == 0) == (a == b));
  RC_ASSERT(ab >= std::max(a.size(), b.size()) - std::min(a.size(), b.size()));
  RC_ASSERT(ab <= std::max(a.size(), b.size()));
  RC_ASSERT(edit_distance(a, c) <= ab + edit_distance(b, c));
}

constexpr std::array<std::string_view, 5> names{"drum_radius", "gearing", "mass", "motor",
                                                "motor_count"};

TEST(Cut, KeepsWholeCharacters) {
  EXPECT_EQ(cut("speed", 5), "speed");
  EXPECT_EQ(cut("speeds", 5), "speed…");
  EXPECT_EQ(cut("ωωω", 2), "ωω…");  // two bytes each
  EXPECT_EQ(cut("", 0), "");
}

TEST(Shortened, CutsWhatIsQuotedLongWordsAndTheWhole) {
  const std::string word(100'000, 'a');
  const std::string plain = "p.toml:1:2: mechanism.mass is \"8 m\", a length; it must be a mass";
  EXPECT_EQ(shortened(plain), plain);
  EXPECT_EQ(shortened("mass is \"" + word + "\", a mass"),
            "mass is \"" + word.substr(0, 80) + "…\", a mass");
  std::string greek;
  for (int i = 0; i < 81; ++i) {
    greek += "ω";
  }
  EXPECT_EQ(shortened('"' + greek + '"'), '"' + greek.substr(0, 160) + "…\"");
  EXPECT_EQ(shortened("/home/" + word + "/log.json: cut"),
            "/home/" + word.substr(0, 194) + "…" + word.substr(0, 30) + "/log.json: cut");
  std::string many;
  for (int i = 0; i < 10'000; ++i) {
    many += "x\" ";
  }
  EXPECT_LT(shortened(many).size(), 4010U);
}

TEST(Printable, HasNoControlCharacters) {
  EXPECT_EQ(printable("a\x1b[31m\tb\x7f\n\xC2\x9Bω\xFF"), "a?[31m?b?\n??ω\xEF\xBF\xBD");
  EXPECT_EQ(shortened("\"\x1b[2J\" is not a motor"), "\"?[2J\" is not a motor");
}

// Marks and overrides of the direction of writing, separators of lines, byte order marks: each byte
// a question mark. What joins letters or only looks foreign stays.
TEST(Printable, HasNothingThatTurnsTheDirection) {
  for (const char* steering : {"\u200E", "\u200F", "\u2028", "\u2029", "\u202A", "\u202D", "\u202E",
                               "\u2066", "\u2069", "\u206F", "\uFEFF", "\uFFF9", "\uFFFB"}) {
    EXPECT_EQ(printable(std::string("a") + steering + "b"), "a???b");
  }
  EXPECT_EQ(printable("a\u061Cb\u0080\u009F"), "a??b????");
  for (const char* plain : {"\u00A0", "\u061B", "\u200D", "\u2010", "\u202F", "\u2065", "\u2070",
                            "\uFEFE", "\uFFFC", "日本", "שלום"}) {
    EXPECT_EQ(printable(plain), plain);
  }
}

TEST(NearestName, FindsTheNameMeant) {
  EXPECT_EQ(nearest_name("drum_raduis", names), "drum_radius");
  EXPECT_EQ(nearest_name("Gearing", names), "gearing");
  EXPECT_EQ(nearest_name("motr", names), "motor");
  EXPECT_EQ(nearest_name("motorcount", names), "motor_count");
}

TEST(NearestName, AnswersNothingIfNothingIsNear) {
  EXPECT_EQ(nearest_name("battery", names), "");
  EXPECT_EQ(nearest_name("", names), "");
  EXPECT_EQ(nearest_name("mass", {}), "");
}

TEST(Ascii, SpellsWhatItCan) {
  EXPECT_EQ(ascii("2.5 ± 0.1 m/s², 3 kg·m²"), "2.5 +- 0.1 m/s^2, 3 kg*m^2");
  EXPECT_EQ(ascii("s⁻¹, 15 mΩ, σ = 90°"), "s^-1, 15 mOhm, sigma = 90 deg");
  EXPECT_EQ(ascii("plain\n"), "plain\n");
  EXPECT_EQ(ascii("日本"), "??");
  EXPECT_EQ(ascii("\xff"), "?");
}

}  // namespace
}  // namespace flyball::text_test
