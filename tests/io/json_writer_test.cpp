#include <flyball/io/json_writer.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <rapidcheck/gtest.h>

namespace flyball::json_writer_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <class T>
std::string text_of(const T& value) {
  JsonWriter json;
  json.write(value);
  return json.text();
}

TEST(JsonWriter, ValuesOfEveryKind) {
  EXPECT_EQ(text_of(0.1), "0.1");
  EXPECT_EQ(text_of(2), "2");
  EXPECT_EQ(text_of(std::size_t{18446744073709551615U}), "18446744073709551615");
  EXPECT_EQ(text_of(true), "true");
  EXPECT_EQ(text_of("text"), R"("text")");  // not a bool, which a pointer would convert to
  EXPECT_EQ(text_of(std::optional<double>()), "null");
  EXPECT_EQ(text_of(std::optional(3)), "3");
  EXPECT_EQ(text_of(std::vector<double>{1.0, 2.5}), "[1.0,2.5]");
  EXPECT_EQ(text_of(std::vector<std::string>{"a", "b"}), R"(["a","b"])");
  EXPECT_EQ(text_of(std::vector<double>()), "[]");
}

TEST(JsonWriter, ADoubleStaysADouble) {
  EXPECT_EQ(text_of(2.0), "2.0");
  EXPECT_EQ(text_of(-0.0), "-0.0");
  EXPECT_EQ(text_of(1e300), "1e+300");
  EXPECT_EQ(text_of(infinity), R"("inf")");
  EXPECT_EQ(text_of(-infinity), R"("-inf")");
  EXPECT_EQ(text_of(std::numeric_limits<double>::quiet_NaN()), "null");
}

RC_GTEST_PROP(JsonWriter, EveryFiniteDoubleReadsBack, (std::uint64_t bits)) {
  const auto value = std::bit_cast<double>(bits);
  RC_PRE(std::isfinite(value));
  const auto read = nlohmann::json::parse(text_of(value));
  RC_ASSERT(read.is_number_float());
  RC_ASSERT(std::bit_cast<std::uint64_t>(read.get<double>()) == bits);
}

TEST(JsonWriter, MatricesAreRowsVectorsListsAndComplexNumbersPairs) {
  Eigen::MatrixXd M(2, 3);
  M << 1, 2, 3, 4, 5, infinity;
  EXPECT_EQ(text_of(M), R"([[1.0,2.0,3.0],[4.0,5.0,"inf"]])");
  EXPECT_EQ(text_of(Eigen::MatrixXd(0, 2)), "[]");
  EXPECT_EQ(text_of(Eigen::MatrixXd(2, 0)), "[[],[]]");
  EXPECT_EQ(text_of(Eigen::VectorXd(Eigen::Vector2d(1, 2))), "[1.0,2.0]");
  Eigen::VectorXcd z(2);
  z << std::complex<double>(1, 2), std::complex<double>(3, -4);
  EXPECT_EQ(text_of(z), "[[1.0,2.0],[3.0,-4.0]]");
}

TEST(JsonWriter, ObjectsAndListsNest) {
  JsonWriter json;
  json.object([&] {
    json.add("id", 7);
    json.object("empty", [] {});
    json.add({{"x", 0.5}, {"y", 1.5}});
    json.add("gains", {{"kS", 0.5}, {"kV", 2.0}});
    json.list("points", std::vector<int>{1, 2},
              [&](int i) { json.object([&] { json.add("x", i); }); });
    json.add_json("raw", "[null]");
  });
  EXPECT_EQ(
      json.text(),
      R"({"id":7,"empty":{},"x":0.5,"y":1.5,"gains":{"kS":0.5,"kV":2.0},"points":[{"x":1},{"x":2}],"raw":[null]})");
}

TEST(JsonWriter, TextIsEscapedAndBytesThatAreNotUtf8AreReplaced) {
  EXPECT_EQ(text_of("a\"b\\c\n\x01"), R"("a\"b\\c\n\u0001")");
  EXPECT_EQ(text_of("V·s²"), "\"V·s²\"");
  EXPECT_EQ(text_of("bad\xff"), "\"bad\xEF\xBF\xBD\"");
  JsonWriter json;
  json.object([&] { json.add("a\"b", 1); });
  EXPECT_EQ(json.text(), R"({"a\"b":1})");
}

TEST(JsonWriter, AnErrorHasCodeMessageAndItsEvidenceOnce) {
  const Error error = Error(ArgumentError::out_of_range)
                          .in("f")
                          .with("limit", 2.0)
                          .with("pole", {0.5, -0.5})
                          .with("name", "x")
                          .with("limit", 3.0)
                          .with("code", "mine");
  const auto json = nlohmann::ordered_json::parse(text_of(error));
  EXPECT_EQ(json["code"], "out_of_range");
  EXPECT_EQ(json["message"], to_string(error));
  EXPECT_EQ(json["limit"], 2.0);
  EXPECT_EQ(json["pole"], (nlohmann::json{0.5, -0.5}));
  EXPECT_EQ(json["name"], "x");
  EXPECT_EQ(json.size(), 5U);
}

TEST(JsonWriter, APlaceIsLineAndColumn) {
  EXPECT_EQ(text_of(std::vector<Diagnostic>{{"cut", Severity::info, "c", Place{3, 7}}}),
            R"([{"code":"cut","severity":"info","message":"c","line":3,"column":7}])");
  const QuotedError error{Error(ArgumentError::empty).with("line", 1.0), {}, Place{4, 5}};
  const auto json = nlohmann::json::parse(text_of(error));
  EXPECT_EQ(json["line"], 4);
  EXPECT_EQ(json["column"], 5);
  const auto refusal = nlohmann::json::parse(
      refusal_json("s", Errors({error, error}).after({{"noticed", Severity::warning, "w"}})));
  EXPECT_EQ(refusal["error"]["line"], 4);
  EXPECT_EQ(refusal["errors"][1]["column"], 5);
  EXPECT_EQ(refusal["diagnostics"][0]["code"], "noticed");
}

// A terminal obeys C1 controls and DEL as it does ESC; JSON would let them stand.
TEST(JsonWriter, NoControlCharacterStandsAsItIs) {
  EXPECT_EQ(json_quoted("a\x1b\x7f\xC2\x9B\xC2\xA0"), "\"a\\u001b\\u007f\\u009b\xC2\xA0\"");
  EXPECT_EQ(json_quoted("a\u202Eb\uFEFF\u061Cω"), "\"a\\u202eb\\ufeff\\u061cω\"");
}

TEST(JsonWriter, ACoordinateIsNameAndUnit) {
  EXPECT_EQ(text_of(std::vector<Coordinate>{{"speed", "m/s"}, {"x"}}),
            R"([{"name":"speed","unit":"m/s"},{"name":"x","unit":""}])");
}

TEST(JsonWriter, ADiagnostic) {
  EXPECT_EQ(text_of(std::vector<Diagnostic>{{"repeated_rows", Severity::warning, "75 %"}}),
            R"([{"code":"repeated_rows","severity":"warning","message":"75 %"}])");
}

}  // namespace
}  // namespace flyball::json_writer_test
