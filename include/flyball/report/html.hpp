#pragma once

#include <string>
#include <vector>

#include <flyball/core/answer.hpp>

namespace flyball::report {

/// How an answer came about, for the page's last section. Nothing of the clock: the same answer
/// gives the same bytes.
struct Provenance {
  std::string command{};             ///< The command line, if one was typed.
  std::vector<std::string> files{};  ///< Names beside the page, to link to.
};

/// An answer as one HTML page that needs nothing else: style and pictures are inside, no script, no
/// network. Light or dark as the reader's system is, pictures on a white card; readable on a phone
/// and on paper. Text that came from a log is escaped.
///
/// Where gnuplot is missing, a sentence stands in each picture's place.
/// Cost: one gnuplot run a picture.
[[nodiscard]] std::string to_html(const Answer& answer, const Provenance& provenance = {});

}  // namespace flyball::report
