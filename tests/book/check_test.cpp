#include <limits>
#include <string>

#include <nlohmann/json.hpp>

#include "book/reference.hpp"

namespace flyball::book::check_test {
namespace {

using Json = nlohmann::json;

std::string describe(const FigureCheck& check) {
  return "figure " + check.figure + ", " + check.name + ": error " +
         std::to_string(check.worst_error) + " of " + std::to_string(check.values) + " values; " +
         check.problem;
}

Json reference_of(std::string_view figure) {
  for (const std::string_view text : embedded_references()) {
    if (Json document = Json::parse(text); document.at("figure") == figure) {
      return document;
    }
  }
  return {};
}

FigureResult figure_of(const Json& reference) {
  return find_figure(reference.at("figure").get<std::string>()).value()->compute().value();
}

/// Every check of a figure against an altered reference that did not pass.
std::vector<FigureCheck> failures_against(const FigureResult& figure, const Json& altered) {
  const auto reference = parse_reference(altered.dump());
  if (!reference) {
    ADD_FAILURE() << to_string(reference.error());
    return {};
  }
  auto checks = compare(figure, *reference);
  std::erase_if(checks, [](const FigureCheck& check) { return check.passed; });
  return checks;
}
std::vector<FigureCheck> failures_against(const Json& altered) {
  return failures_against(figure_of(altered), altered);
}

TEST(FigureChecks, EveryFigureAgreesWithItsReference) {
  const auto checks = check_figures();
  std::size_t values = 0;
  for (const FigureCheck& check : checks) {
    EXPECT_TRUE(check.passed) << describe(check);
    EXPECT_LE(check.worst_error, check.tolerance) << describe(check);
    EXPECT_GT(check.values, 0u) << describe(check);
    EXPECT_FALSE(check.source.empty()) << describe(check);
    values += check.values;
  }
  EXPECT_GT(values, 1000u);
}

// Gains and series within 1e-9, as the references say; more loosely only what the book prints, to
// three decimals, and the drives that its scripts integrate and differentiate to 1e-6.
TEST(FigureChecks, ToleranceIsNineDigits) {
  for (const FigureCheck& check : check_figures()) {
    const bool integrated = check.figure.starts_with("8.") &&
                            check.source.find("the book's own script") != std::string::npos;
    if (check.source.find("printed") == std::string::npos) {
      EXPECT_LE(check.tolerance, integrated ? 1e-6 : 1e-9) << describe(check);
    }
  }
}

TEST(FigureChecks, ThePrintedGainsAreAmongThem) {
  std::size_t printed = 0;
  for (const FigureCheck& check : check_figure("7.7")) {
    if (check.source == "printed in section 7.7.2") {
      // Half a unit of the third decimal: 0.0005/234.041 and 0.0005/5.603.
      EXPECT_NEAR(check.tolerance, check.name == "K_p" ? 2.1363778e-6 : 8.9237908e-5, 1e-11);
      EXPECT_TRUE(check.passed);
      ++printed;
    }
  }
  EXPECT_EQ(printed, 2u);
}

TEST(FigureChecks, EveryFigureHasAReference) {
  for (const FigureEntry& entry : figures()) {
    EXPECT_FALSE(check_figure(entry.id).empty()) << entry.id;
  }
  EXPECT_TRUE(check_figure("99.99").empty());
  EXPECT_EQ(embedded_references().size(), figures().size());
}

TEST(FigureChecks, AFigureWithoutAReferenceFails) {
  const auto checks = check_references(embedded_references().subspan(1));
  const auto failed = std::count_if(checks.begin(), checks.end(),
                                    [](const FigureCheck& check) { return !check.passed; });
  EXPECT_EQ(failed, 1);
}

TEST(FigureChecks, EveryAlteredNumberIsFound) {
  for (const std::string_view text : embedded_references()) {
    const Json original = Json::parse(text);
    const FigureResult figure = figure_of(original);
    for (std::size_t i = 0; i < original.at("numbers").size(); ++i) {
      Json altered = original;
      Json& entry = altered["numbers"][i];
      // 3e-9 relative, or one unit of the last printed digit.
      const double value = entry["value"];
      entry["value"] = entry.contains("decimals") ? value + 1e-3 : value * (1.0 + 3e-9);
      const auto failures = failures_against(figure, altered);
      ASSERT_EQ(failures.size(), 1u) << original["figure"] << " " << entry["name"];
      EXPECT_EQ(failures[0].name, entry["name"].get<std::string>());
      EXPECT_TRUE(failures[0].problem.empty());
    }
  }
}

TEST(FigureChecks, EveryAlteredSeriesIsFound) {
  for (const std::string_view text : embedded_references()) {
    const Json original = Json::parse(text);
    const FigureResult figure = figure_of(original);
    for (std::size_t i = 0; i < original.at("series").size(); ++i) {
      const auto scale_of = [](const Json& series) {
        double scale = 0.0;
        for (const double value : series.at("values")) {
          scale = std::max(scale, std::abs(value));
        }
        for (const char* extreme : {"min", "max"}) {
          if (series.contains(extreme)) {
            scale = std::max(scale, std::abs(series.at(extreme).get<double>()));
          }
        }
        return scale == 0.0 ? 1.0 : scale;
      };
      for (const char* part : {"values", "min", "max", "mean"}) {
        Json altered = original;
        Json& series = altered["series"][i];
        if (!series.contains(part)) {
          continue;
        }
        Json& entry = part == std::string("values") ? series["values"].back() : series[part];
        entry = entry.get<double>() +
                3.0 * original.value("tolerance", 1e-9) * scale_of(original["series"][i]);
        const auto failures = failures_against(figure, altered);
        ASSERT_EQ(failures.size(), 1u)
            << original["figure"] << " " << series["name"] << " " << part;
        EXPECT_EQ(failures[0].name, series["name"].get<std::string>());
      }
    }
  }
}

TEST(FigureChecks, OtherLengthsAndNamesAreFailuresWithAReason) {
  const Json original = reference_of("6.3");

  Json altered = original;
  altered["series"][0]["length"] = 2041;
  auto failures = failures_against(altered);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_EQ(failures[0].problem, "2040 rows; the reference has 2041");
  EXPECT_EQ(failures[0].values, 0u);

  altered = original;
  altered["series"][0]["name"] = "height";
  altered["numbers"][0]["name"] = "K_q";
  failures = failures_against(altered);
  ASSERT_EQ(failures.size(), 2u);
  EXPECT_EQ(failures[0].problem, "the figure has no such number");
  EXPECT_EQ(failures[1].problem, "the figure has no such column");
}

TEST(FigureChecks, NaNNeverPasses) {
  auto figure = find_figure("2.3").value()->compute().value();
  const auto reference = parse_reference(reference_of("2.3").dump()).value();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  figure.numbers[0].value = nan;
  figure.columns[2].values[700] = nan;  // not a row of the reference: the mean tells
  figure.columns[5].values[0] = nan;    // the first row of it
  std::vector<std::string> failed;
  for (const FigureCheck& check : compare(figure, reference)) {
    if (!check.passed) {
      failed.push_back(check.name);
    }
  }
  EXPECT_EQ(failed, (std::vector<std::string>{"K_p", "position", "voltage"}));
}

TEST(FigureChecks, AReferenceOfAnUnknownFigureOrThatIsNoneFails) {
  for (const std::string_view text :
       {std::string_view("{"), std::string_view("[]"),
        std::string_view(R"({"figure": "1.1", "source": "x", "tolerance": 1, "numbers": [],
                             "series": []})")}) {
    const auto checks = check_references(std::span(&text, 1));
    ASSERT_FALSE(checks.empty());
    EXPECT_FALSE(checks[0].passed);
    EXPECT_FALSE(checks[0].problem.empty());
  }
}

TEST(ParseReference, RefusesWhatIsMalformed) {
  const std::string head = R"({"figure": "6.3", "source": "x", "tolerance": 1e-9, "numbers": [], )";
  for (const std::string& text :
       {std::string(), std::string("nonsense"), std::string("3"), std::string("{}"), head + "}",
        head + R"("series": [{"name": "a", "length": 2, "rows": [0, 1], "values": [0.0]}]})",
        head + R"("series": [{"name": "a", "length": 2, "rows": [], "values": []}]})",
        head + R"("series": [{"name": "a", "length": 2, "rows": [2], "values": [0.0]}]})"}) {
    const auto reference = parse_reference(text);
    ASSERT_FALSE(reference) << text;
    EXPECT_TRUE(reference.error().is(ArgumentError::malformed)) << text;
  }
  EXPECT_TRUE(parse_reference(
      head + R"("series": [{"name": "a", "length": 2, "rows": [1], "values": [0.0]}]})"));
}

}  // namespace
}  // namespace flyball::book::check_test
