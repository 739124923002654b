#pragma once

#include <string>
#include <vector>

#include <flyball/study/analyze.hpp>
#include <flyball/study/design.hpp>
#include <flyball/study/identify.hpp>
#include <flyball/study/tune.hpp>

namespace flyball::report {

/// How a result came about, for the page's last section. Nothing of the clock: the same result
/// gives the same bytes.
struct Provenance {
  std::string command;             ///< The command line, if one was typed.
  std::vector<std::string> files;  ///< Names beside the page, to link to.
};

/// A result as one HTML page that needs nothing else: style and pictures are inside, no script, no
/// network. Light or dark as the reader's system is, pictures on a white card; readable on a phone
/// and on paper. Text that came from a log is escaped.
///
/// A refused log gives a page as well: the reason on top, the recorded data below. Where gnuplot is
/// missing, a sentence stands in each picture's place.
/// Cost: one gnuplot run a picture.
[[nodiscard]] std::string to_html(const study::IdentifyResult& result,
                                  const Provenance& provenance = {});
[[nodiscard]] std::string to_html(const study::DesignResult& result,
                                  const Provenance& provenance = {});
[[nodiscard]] std::string to_html(const study::TuneResult& result,
                                  const Provenance& provenance = {});
[[nodiscard]] std::string to_html(const study::ModelAnalysis& result,
                                  const Provenance& provenance = {});

}  // namespace flyball::report
