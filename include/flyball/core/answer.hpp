#pragma once

#include <optional>
#include <string>
#include <vector>

#include <flyball/core/animation.hpp>
#include <flyball/core/document.hpp>
#include <flyball/core/error.hpp>
#include <flyball/core/figure.hpp>

namespace flyball {

/// A file that belongs to an answer.
struct AnswerFile {
  std::string name{};  ///< Relative to the report's folder: "data/closed_loop.csv".
  std::string contents{};
};

/// What a job answers, in the form in which it can be shown, written and sent: whoever renders it
/// (flyball/report) need not know the job.
struct Answer {
  std::string schema{};           ///< Of `json`, such as "flyball.design/2" (docs/schemas.md).
  std::string json{};             ///< One object on one line; numbers round-trip.
  Document document{};            ///< The same for people.
  std::vector<Figure> figures{};  ///< Each names the section of the document it stands in.
  std::vector<Animation> animations{};  ///< The same, above the section's figures.
  std::vector<AnswerFile> files{};      ///< What is written beside the page.
  std::optional<Error> refusal{};       ///< Why the answer is no, if it is.
};

}  // namespace flyball
