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

/// An answer as one HTML page that needs nothing else: style, pictures, data and scripts are
/// inside, and the page forbids itself the network. Plots are zoomed, moved and read under the
/// cursor, along x together where they share a clock; without scripts and in print they are still
/// pictures. Light or dark as the reader's system is; readable on a phone and on paper. Text that
/// came from a log is escaped.
///
/// Where gnuplot is missing a sentence says so, and the plots are interactive alone.
/// Cost: one gnuplot run; 130 kB of dygraphs, the still pictures, and 5 bytes a value.
[[nodiscard]] std::string to_html(const Answer& answer, const Provenance& provenance = {});

}  // namespace flyball::report
