#include <flyball/classical/root_locus.hpp>

#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/try.hpp"
#include "solve/transfer_problem.hpp"

// Root loci (appendix E).
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A record an angle: a root of multiplicity m has m of them.
void write_angles(JsonWriter& answer, std::string_view name,
                  const std::vector<classical::LocusAngles>& all) {
  answer.key(name);
  answer.open('[');
  for (const classical::LocusAngles& root : all) {
    for (const double angle : root.angles) {
      answer.object([&] {
        answer.add({{"real", root.root.real()}, {"imag", root.root.imag()}, {"angle_deg", angle}});
      });
    }
  }
  answer.close(']');
}

Outcome solve_root_locus(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto loop, transfer_of(problem, "rlocus"));
  classical::RootLocusOptions options{.negative = problem.choice("feedback") == "positive",
                                      .largest_gain = {}};
  if (problem.has("largest_gain")) {
    options.largest_gain = problem.number("largest_gain");
  }
  FLYBALL_TRY(const auto locus, classical::root_locus(loop, options));
  answer.add("zeros", locus.zeros);
  answer.add("poles", locus.poles);
  answer.list("branch_points", locus.branch_points, [&](const classical::BranchPoint& at) {
    answer.object([&] {
      answer.add({{"real", at.point.real()}, {"imag", at.point.imag()}, {"gain", at.gain}});
    });
  });
  answer.list("crossings", locus.crossings, [&](const classical::BorderCrossing& at) {
    answer.object([&] { answer.add({{"w", at.frequency}, {"gain", at.gain}}); });
  });
  answer.list("stable_gains", locus.stable_gains, [&](const classical::GainRange& range) {
    answer.object([&] { answer.add({{"low", range.low}, {"high", range.high}}); });
  });
  answer.add("asymptote_center", locus.asymptotes.center);
  answer.add("asymptote_angles", locus.asymptotes.angles);
  write_angles(answer, "departures", locus.departures);
  write_angles(answer, "arrivals", locus.arrivals);
  if (problem.has("damping")) {
    FLYBALL_TRY(const auto points, classical::locus_at_damping(loop, problem.number("damping")));
    answer.list("at_damping", points, [&](const classical::LocusPoint& at) {
      answer.object([&] {
        answer.add({{"real", at.point.real()}, {"imag", at.point.imag()}, {"gain", at.gain}});
      });
    });
  }
  answer.add("gains", locus.gains);
  answer.add("real", MatrixXd(locus.branches.real()));
  answer.add("imag", MatrixXd(locus.branches.imag()));
  return {};
}

}  // namespace

std::vector<Kind> root_locus_kinds() {
  return {
      {"rlocus",
       "the closed loop's poles, 1 + kL = 0, as k goes from 0 to infinity",
       transfer_fields("whole periods of dead time of a discrete one") +
           std::vector{
               or_first(choice("feedback", "negative positive", "positive: k from 0 to -infinity")),
               optional(number("largest_gain", "", "|k| up to which the branches are followed")),
               optional(number("damping", "", "a damping ratio below 1 whose gains are told"))},
       {complex_list("zeros", "z", "of L"), complex_list("poles", "n", "of L"),
        records("branch_points", "real imag gain", "where branches meet"),
        records("crossings", "w gain", "of the border of stability: rad/s"),
        records("stable_gains", "low high", "between which the closed loop is stable"),
        unbounded(number("asymptote_center", "", "where the asymptotes meet, null without any")),
        list("asymptote_angles", "a", "deg", "their directions"),
        records("departures", "real imag angle_deg", "in which branches leave each pole"),
        records("arrivals", "real imag angle_deg", "in which they come to each zero"),
        optional(records("at_damping", "real imag gain", "poles of the damping ratio")),
        list("gains", "g", "", "k of each row below"),
        unbounded(matrix("real", "g", "n", "a branch a column; null at infinity")),
        unbounded(matrix("imag", "g", "n", "the same"))},
       R"({"num": [1], "den": [1, 3, 2, 0], "damping": 0.5})",
       &solve_root_locus},
  };
}

}  // namespace flyball::solve
