#include <flyball/report/html.hpp>

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "report/page_parts.hpp"

namespace flyball::report::html_test {
namespace {

/// The page without its scripts: the two that are its own and the data of its plots, which hold no
/// markup.
std::string without_scripts(std::string page) {
  constexpr std::string_view data = "<script type=\"application/json\">";
  constexpr std::string_view end = "</script>\n";
  for (std::size_t at = page.find(data); at != std::string::npos; at = page.find(data, at)) {
    const std::size_t stop = page.find('<', at + data.size());
    EXPECT_EQ(page.compare(stop, end.size(), end), 0) << "markup in the data";
    page.erase(at, stop + end.size() - at);
  }
  for (const std::string& script : {"<script>" + std::string(dygraphs_script) + "</script>\n",
                                    "<script>\n" + std::string(page_script) + "</script>\n"}) {
    const std::size_t at = page.find(script);
    if (at != std::string::npos) {
      page.erase(at, script.size());
    }
  }
  return page;
}

/// The page of a result's answer, without its scripts.
template <class Result>
std::string page_of(const Result& result, const Provenance& provenance = {}) {
  return without_scripts(to_html(study::answer_of(result), provenance));
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++n;
  }
  return n;
}

/// Tags close in the order in which they open, and no identifier stands twice.
void expect_well_formed(const std::string& page) {
  const std::set<std::string> empty{"meta", "br", "hr", "link", "img"};
  std::vector<std::string> open;
  std::set<std::string> ids;
  std::size_t at = 0;
  while ((at = page.find('<', at)) != std::string::npos) {
    if (page.compare(at, 4, "<!--") == 0) {
      at = page.find("-->", at);
      ASSERT_NE(at, std::string::npos);
      continue;
    }
    if (page.compare(at, 7, "<style>") == 0) {
      at = page.find("</style>", at) + 8;
      continue;
    }
    const std::size_t end = page.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = page.substr(at + 1, end - at - 1);
    at = end;
    if (tag.empty() || tag[0] == '!' || tag[0] == '?') {
      continue;
    }
    if (const std::size_t id = tag.find(" id="); id != std::string::npos) {
      const std::string value = tag.substr(id + 5, tag.find(tag[id + 4], id + 5) - id - 5);
      EXPECT_TRUE(ids.insert(value).second) << "twice: " << value;
    }
    const std::string name =
        tag.substr(tag[0] == '/' ? 1 : 0, tag.find_first_of(" \n/", 1) - (tag[0] == '/' ? 1 : 0));
    if (tag[0] == '/') {
      ASSERT_FALSE(open.empty()) << tag;
      EXPECT_EQ(open.back(), name);
      open.pop_back();
    } else if (tag.back() != '/' && empty.count(name) == 0) {
      open.push_back(name);
    }
  }
  EXPECT_TRUE(open.empty()) << open.back();
}

/// Nothing is loaded: links go to the page itself or to a file beside it.
void expect_self_contained(const std::string& page) {
  for (const char* loads :
       {"src=", "@import", "<script", "<link", "<iframe", "<object", "javascript:"}) {
    EXPECT_FALSE(has(page, loads)) << loads;
  }
  for (std::size_t at = page.find("href="); at != std::string::npos;
       at = page.find("href=", at + 1)) {
    const std::size_t begin = at + 6;
    const std::string target = page.substr(begin, page.find(page[at + 5], begin) - begin);
    EXPECT_EQ(target.find("//"), std::string::npos) << target;
    EXPECT_NE(target[0], '/') << target;
  }
  for (std::size_t at = page.find("url("); at != std::string::npos;
       at = page.find("url(", at + 1)) {
    EXPECT_TRUE(page.compare(at, 5, "url(#") == 0 || page.compare(at, 6, "url('#") == 0);
  }
  // The names of XML's vocabularies are the only addresses.
  EXPECT_EQ(occurrences(page, "://"), occurrences(page, "http://www.w3.org/")) << "an address";
}

TEST(Html, ATunesPageHasEverythingAndNeedsNothing) {
  for (const MechanismKind kind :
       {MechanismKind::flywheel, MechanismKind::elevator, MechanismKind::arm}) {
    const study::TuneResult result = tune_result(kind);
    const std::string page = page_of(result, {.command = "flyball tune lift.wpilog", .files = {}});
    expect_well_formed(page);
    expect_self_contained(page);
    for (const char* id : {"data", "gains", "plant", "controller", "robustness", "motion",
                           "constants", "next", "diagnostics", "origin"}) {
      EXPECT_TRUE(has(page, std::string("<section id=\"") + id + "\"")) << id;
      EXPECT_TRUE(has(page, std::string("href=\"#") + id + "\"")) << id;
    }
    // Each with words for it.
    const std::size_t figures = study::answer_of(result).figures.size();
    EXPECT_EQ(occurrences(page, "<svg"), figures);
    EXPECT_EQ(occurrences(page, "role=\"img\" aria-label=\""), figures);
    for (const char* name : {"intervals", "fit_1_quasistatic-forward", "fit_3_dynamic-forward",
                             "poles", "small_step", "bode", "nyquist", "closed_loop", "estimate"}) {
      EXPECT_TRUE(has(page, std::string(" data-name=\"") + name + "\"")) << name;
    }
    EXPECT_EQ(occurrences(page, "<details>"), 9u);
    EXPECT_TRUE(has(page, "flyball tune lift.wpilog"));
    EXPECT_TRUE(has(page, "prefers-color-scheme:dark"));
    EXPECT_TRUE(has(page, "scope=\"col\""));
  }
}

TEST(Html, IsDeterministic) {
  const study::DesignResult design = design_result(MechanismKind::arm);
  EXPECT_EQ(page_of(design), page_of(design));
}

TEST(Html, TextOfALogCannotBecomeMarkup) {
  study::IdentifyResult result = identify_result(MechanismKind::flywheel);
  result.source.path = "logs/<script>alert(1)</script>\"&'.json";
  result.source.subject = "<img src=x onerror=alert(1)>";
  result.source.diagnostics.push_back(
      {"<b>code</b>", Severity::warning, "</li></ul><svg onload=alert(1)>"});
  const std::string page =
      page_of(result, {.command = "flyball '<script>'", .files = {"a\"><script>.csv"}});
  EXPECT_FALSE(has(page, "<script"));
  EXPECT_FALSE(has(page, "<img"));
  EXPECT_FALSE(has(page, "<svg onload"));
  EXPECT_FALSE(has(page, "<b>"));
  EXPECT_TRUE(has(page, "&lt;script&gt;alert(1)&lt;/script&gt;&quot;&amp;&#39;.json"));
  expect_well_formed(page);
}

TEST(Html, ARefusedLogIsShownWithItsReasonOnTop) {
  const study::IdentifyResult refused = refused_result();
  ASSERT_FALSE(refused.report.fit);
  for (const std::string& page :
       {page_of(refused), page_of(study::TuneResult{refused, std::nullopt})}) {
    expect_well_formed(page);
    expect_self_contained(page);
    EXPECT_EQ(occurrences(page, "<svg"), 4u);
    EXPECT_TRUE(has(page, "as recorded"));
    const std::size_t verdict = page.find("No gains can be taken from this log.");
    ASSERT_NE(verdict, std::string::npos);
    EXPECT_LT(verdict, page.find("<main>"));
  }
}

TEST(Html, ADesignThatIsRefusedKeepsTheIdentification) {
  study::TuneResult result = tune_result(MechanismKind::elevator);
  result.design =
      tl::unexpected(Errors(Error(study::DesignError::gravity_too_strong).in("design")));
  const std::string page = page_of(result);
  expect_well_formed(page);
  EXPECT_TRUE(has(page, "No controller"));
  EXPECT_TRUE(has(page, "the motor cannot hold the mechanism"));
  EXPECT_TRUE(has(page, "<li>No controller could be designed"));
  EXPECT_EQ(occurrences(page, "<svg"), study::answer_of(result.identification).figures.size());
}

// It must need no network, whatever a script or a text in it says.
TEST(Html, ThePageForbidsItselfTheNetworkAndHoldsItsScripts) {
  const Answer answer = study::answer_of(design_result(MechanismKind::arm));
  const std::string page = to_html(answer);
  EXPECT_TRUE(has(page, "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "));
  EXPECT_EQ(occurrences(page, std::string(page_script)), 1u);
  EXPECT_EQ(occurrences(page, std::string(dygraphs_script)), 1u);
  EXPECT_EQ(dygraphs_script.find("</script"), std::string_view::npos);
  EXPECT_EQ(page_script.find("</script"), std::string_view::npos);
  EXPECT_EQ(occurrences(page, "type=\"application/json\""),
            answer.figures.size() + answer.animations.size());
  Answer words = answer;
  words.figures.clear();
  EXPECT_TRUE(has(to_html(words), "<script")) << "what moves needs them, too";
  words.animations.clear();
  EXPECT_FALSE(has(to_html(words), "<script"));
}

TEST(Html, NoNaNIsPrintedAsANumber) {
  study::DesignResult design = design_result(MechanismKind::flywheel);
  design.tracking_error_rms = std::nan("");
  design.margins.delay_margin = std::numeric_limits<double>::infinity();
  const std::string page = page_of(design);
  EXPECT_FALSE(has(page, "nan "));
  EXPECT_FALSE(has(page, "NaN"));
  EXPECT_FALSE(has(page, ">inf<"));
  EXPECT_FALSE(has(page, " inf "));
}

}  // namespace
}  // namespace flyball::report::html_test
