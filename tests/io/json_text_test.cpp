#include <flyball/io/json_text.hpp>

#include <gtest/gtest.h>

namespace flyball::json_text_test {
namespace {

TEST(PlaceOf, CountsLinesAndCharacters) {
  const auto expect = [](std::string_view text, std::size_t offset, std::size_t line,
                         std::size_t column) {
    const Place place = place_of(text, offset);
    EXPECT_EQ(place.line, line) << text << offset;
    EXPECT_EQ(place.column, column) << text << offset;
  };
  expect("", 0, 1, 1);
  expect("ab\ncd", 4, 2, 2);
  expect("ab\ncd", 99, 2, 3);
  expect("ωω=", 4, 1, 3);
}

TEST(RepeatedKey, IsFoundInEachObjectAlone) {
  const auto at = [](std::string_view json) {
    const auto found = repeated_key(json);
    return found ? static_cast<int>(found->at) : -1;
  };
  EXPECT_EQ(at(R"({"A":1,"B":1})"), -1);
  EXPECT_EQ(at(R"({"A":1,"A":1})"), 7);
  EXPECT_EQ(at(R"({"A":{"A":1},"B":{"A":1}})"), -1);
  EXPECT_EQ(at(R"({"A":{"B":1,"B":2}})"), 12);
  EXPECT_EQ(at(R"([{"A":1},{"A":1}])"), -1);
  EXPECT_EQ(at(R"({"A":["A","A"],"C":"A"})"), -1);  // values
  EXPECT_EQ(at(R"({"A":",\"A\":","B":1})"), -1);    // in a text
  EXPECT_EQ(at(R"({"A":1,"\u0041":1})"), 7);        // the same letter
  EXPECT_EQ(at(R"({"A":1,"A":)"), 7);               // cut off
  EXPECT_EQ(at(R"({"unit":1,"units)"), -1);         // in the key
  EXPECT_EQ(at(R"({"unit":1,"unit)"), -1);
  EXPECT_EQ(at(R"(}]"A":1,"A":1)"), -1);
  const std::string deep(1'000'000, '[');
  EXPECT_EQ(at(deep + R"({"A":1,"A":1})"), -1);
  EXPECT_EQ(repeated_key(R"({"x":1,"x":2})")->key, "x");
}

TEST(ScalarMember, IsAsItStands) {
  const auto of = [](std::string_view json) {
    return std::string(scalar_member(json, "id").value_or("nothing"));
  };
  EXPECT_EQ(of(R"({"id":18446744073709551616,"A":1})"), "18446744073709551616");
  EXPECT_EQ(of("{ \"A\" : [1, {\"id\": 2}] ,\n\"id\" :\t-1.50e+1 }"), "-1.50e+1");
  EXPECT_EQ(of(R"({"id":"a\"\u00e9, }"})"), R"("a\"\u00e9, }")");
  EXPECT_EQ(of(R"({"i\u0064":true})"), "true");
  EXPECT_EQ(of(R"({"A":"id","B":"id"})"), "nothing");
  EXPECT_EQ(of(R"({"A":["id",3]})"), "nothing");
  EXPECT_EQ(of(R"({"id":[1,2]})"), "nothing");
  EXPECT_EQ(of("{}"), "nothing");
}

TEST(WrittenMember, IsWholeOrAsFarAsTheTextGoes) {
  const auto of = [](std::string_view json) {
    return std::string(written_member(json, "id").value_or("nothing"));
  };
  EXPECT_EQ(of(R"({"id": {"a": ["}", 1]} ,"A":1})"), R"({"a": ["}", 1]})");
  EXPECT_EQ(of(R"({"A":[{"id":1}],"id":[[],2]})"), "[[],2]");
  EXPECT_EQ(of(R"({"id":7,"A":[[1,2)"), "7");
  EXPECT_EQ(of(R"({"id":[1,)"), "[1,");
  EXPECT_EQ(of(R"({"id":"a)"), "\"a");
  EXPECT_EQ(of(R"({"id)"), "nothing");
  EXPECT_EQ(of(""), "nothing");
}

TEST(JsonEscaped, ReadsAsTheSame) {
  EXPECT_EQ(json_escaped("{\"a\":\t\"\x7f\u009b\u202e é\"}\n"),
            "{\"a\":\t\"\\u007f\\u009b\\u202e é\"}\n");
}

}  // namespace
}  // namespace flyball::json_text_test
