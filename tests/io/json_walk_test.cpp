#include <algorithm>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <flyball/core/random.hpp>
#include <flyball/io/json_text.hpp>

#include "io/json_walk.hpp"

namespace flyball::io::json_walk_test {
namespace {

/// Writes down what it is told; numbers as doubles.
class Events : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::string told;

  bool null() override { return tell("null"); }
  bool boolean(bool value) override { return tell(value ? "true" : "false"); }
  bool number_integer(number_integer_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return number(value);
  }
  bool string(string_t& value) override { return tell("string " + value); }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*size*/) override { return tell("{"); }
  bool key(string_t& value) override { return tell("key " + value); }
  bool end_object() override { return tell("}"); }
  bool start_array(std::size_t /*size*/) override { return tell("["); }
  bool end_array() override { return tell("]"); }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return false;
  }

 private:
  bool tell(const std::string& what) {
    told += what + '\n';
    return true;
  }
  bool number(double value) { return tell(fmt::format("{:a}", value + 0.0)); }  // -0 is 0
};

/// Gives a text in pieces, and only what was not passed.
class Pieces {
 public:
  Pieces(std::string_view text, std::size_t size) : text_(text), size_(size) {}
  [[nodiscard]] std::string_view rest() const { return held_; }
  void pass(std::size_t bytes) { held_.erase(0, bytes); }
  bool more() {
    std::string next = held_ + std::string(text_.substr(0, size_));
    held_.swap(next);  // so that nothing stays where it was
    const bool any = !text_.empty();
    text_.remove_prefix(std::min(size_, text_.size()));
    return any;
  }

 private:
  std::string_view text_;
  std::size_t size_;
  std::string held_;
};

constexpr std::string_view document =
    R"({"a": [1, -2.5e-3, 0, 18446744073709551616, [ ] , {}], "b\u00e9": "x\n\"y", "c":)"
    " \t\r\n"
    R"({"a": true, "d": [false, null, -0, 1E5, 0.1]}, "é": "€"} )";

void expect_agreement(const std::string& text) {
  Events theirs;
  const bool valid = nlohmann::json::sax_parse(text, &theirs) && !repeated_key(text);
  Events whole;
  WholeText source(text);
  const JsonEnd end = JsonWalk(source, whole).walk();
  ASSERT_EQ(end == JsonEnd::complete, valid) << text;
  if (valid) {
    EXPECT_EQ(whole.told, theirs.told) << text;
  }
  for (const std::size_t size : {1, 2, 3, 7}) {
    Events events;
    Pieces pieces(text, size);
    const JsonEnd by_pieces = JsonWalk(pieces, events).walk();
    ASSERT_EQ(by_pieces, end) << text << " in pieces of " << size;
    EXPECT_EQ(events.told, whole.told) << text << " in pieces of " << size;
  }
}

TEST(JsonWalk, TellsWhatNlohmannsParserTells) {
  expect_agreement(std::string(document));
  for (const char* text : {"",
                           " ",
                           "1",
                           "-",
                           "01",
                           "1.",
                           "1.e5",
                           ".5",
                           "+1",
                           "1e",
                           "1e+",
                           "1e400",
                           "-1e400",
                           "1e-400",
                           "4.9e-324",
                           "tru",
                           "truth",
                           "nul",
                           "\"",
                           "\"\\",
                           "\"\\u12\"",
                           "\"\t\"",
                           "[1,]",
                           "[,1]",
                           "{\"a\"}",
                           "{\"a\":}",
                           "{\"a\":1,}",
                           "{a:1}",
                           "[1 2]",
                           "[}",
                           "{]",
                           "1 2",
                           "[]]",
                           "{\"a\":1,\"a\":2}",
                           "{\"a\":1,\"\\u0061\":2}",
                           "[{\"a\":1},{\"a\":2}]",
                           "\"\xff\"",
                           "NaN",
                           "123456789012345678901234567890",
                           "0.1234567890123456789012345678901234567890e-10"}) {
    expect_agreement(text);
  }
}

TEST(JsonWalk, AgreesAboutEveryCutAndAboutDamage) {
  for (std::size_t size = 0; size <= document.size(); ++size) {
    const std::string text(document.substr(0, size));
    expect_agreement(text);
    Events events;
    WholeText source(text);
    const JsonEnd end = JsonWalk(source, events).walk();
    EXPECT_EQ(end == JsonEnd::cut, size + 1 < document.size()) << text;
  }
  Random random(5);
  for (int k = 0; k < 4000; ++k) {
    std::string text(document);
    const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(text.size()));
    constexpr std::string_view palette = "{}[]:,\"\\ 0-1.e+tnf\x01\x80";
    text[at] =
        palette[static_cast<std::size_t>(random.uniform() * static_cast<double>(palette.size()))];
    expect_agreement(text);
  }
}

TEST(JsonWalk, StopsWhereTheHandlerWantsNoMore) {
  class One : public Events {
   public:
    bool end_array() override { return false; }
  };
  One one;
  WholeText source("[[1], 2]");
  EXPECT_EQ(JsonWalk(source, one).walk(), JsonEnd::stopped);
  EXPECT_EQ(source.rest(), ", 2]");
}

TEST(JsonWalk, ManyKeysAndDeepBracketsTakeNoMoreThanTheirBytes) {
  std::string many = "{";
  for (int k = 0; k < 200000; ++k) {
    many += fmt::format("{}\"{}\":0", k == 0 ? "" : ",", k);
  }
  many += "}";
  Events events;
  WholeText source(many);
  EXPECT_EQ(JsonWalk(source, events).walk(), JsonEnd::complete);
  const std::string deep(1000000, '[');
  WholeText brackets(deep);
  Events opened;
  EXPECT_EQ(JsonWalk(brackets, opened).walk(), JsonEnd::cut);
}

}  // namespace
}  // namespace flyball::io::json_walk_test
