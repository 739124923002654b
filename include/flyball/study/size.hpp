#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/diagnostic.hpp>
#include <flyball/core/errors.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/simulation/fastest_travel.hpp>
#include <flyball/study/size_section.hpp>

/// The mechanism calculator: which gear ratio, which motor, which limits, by simulated motions.
namespace flyball::study {

struct Override;

/// Find the gear ratio that is fastest.
struct SizeJob {
  std::string path{};
  TravelJob travel{};                ///< At the given gearing; at 1 where none is given.
  std::optional<double> gearing{};   ///< That was given.
  double brownout_voltage = 6.75;    ///< V
  double temperature_limit = 125.0;  ///< °C, where the windings are known.
  std::optional<double> gearing_low{},
      gearing_high{};  ///< Of the sweep; around the best if absent.
  bool compare_motors = true;
  double counterbalance = 0.0;  ///< N, of the load's gravity: does not grow with the mass.
  std::vector<Diagnostic> diagnostics{};  ///< What was noticed while the file was read.
};

/// One choice, tried.
struct SizeChoice {
  double gearing = 1.0;
  Travel travel{};
  double holding_current = 0.0;  ///< A, all motors together, at the worst position of the way.
  bool browns_out = false;       ///< The rail falls below the brownout voltage.
  bool overheats = false;        ///< The windings get warmer than their limit.

  [[nodiscard]] bool is_good() const noexcept { return !browns_out && !overheats; }
};

/// A value of what is swept, and what became of it.
struct SizePoint {
  double value = 0.0;
  std::optional<SizeChoice> at_gearing{};  ///< At the given gearing, or the best.
  std::optional<SizeChoice> at_best{};     ///< At the gearing that is best for this value.
  std::string refusal{};                   ///< Why it does not get there at that gearing: a code.
};

/// The time against one number.
struct SizeSweep {
  std::string name{};   ///< "load", "stator_limit", "supply_limit"
  std::string title{};  ///< "Mass", …
  std::string unit{};
  double here = 0.0;  ///< The job's own value; infinite where nothing limits.
  std::vector<SizePoint> points{};
};

/// A motor of the table in the place of the job's, as many of it, at its own best gearing.
struct SizeMotor {
  std::string name{};
  std::optional<SizeChoice> choice{};  ///< Nothing: no gearing gets it there.
  std::string refusal{};               ///< Then why not.
  bool is_own = false;                 ///< The job's.
};

/// What a gear ratio does, which is best and why.
struct SizeResult {
  SizeJob job{};
  std::optional<SizeChoice> given{};  ///< At the gearing of the file.
  std::string given_refusal{};        ///< Why that does not get there.
  SizeChoice best{};
  double low = 0.0, high = 0.0;       ///< Between them the time is within 2 % of the best.
  std::string reason{};               ///< Why neither a lower nor a higher one is faster.
  std::vector<SizePoint> gearings{};  ///< `at_gearing` of each.
  std::vector<SizeSweep> sweeps{};
  std::vector<SizeMotor> motors{};  ///< The fastest first.
  TimeSeries motion{};              ///< At the best gearing, as `record_travel`.
  std::optional<TimeSeries> given_motion{};
  std::vector<Diagnostic> diagnostics{};
};

/// The job of a project file. @errors As `read_project`; ProjectError for parts that are missing
/// (a gearing need not be there) and for keys without meaning for the mechanism; FileError and
/// LogError of the locked rotor's file.
[[nodiscard]] ExpectedAll<SizeJob> size_job(const std::string& project,
                                            std::span<const Override> overrides = {});

/// The gearing in which the motion takes the least time without a brownout and without windings
/// warmer than they may be (where every gearing has one of them: the fastest of all, said so), from
/// simulated motions throughout (`fastest_travel`): a grid of gearings, refined by Brent's search;
/// the range in which the time is within 2 %; sweeps of gearing, load and current limits; the same
/// for every motor of the table.
/// @errors As `fastest_travel`; TravelError of the gearing that comes closest where none gets
/// there. Cost: some thousand motions, a second at most.
[[nodiscard]] Expected<SizeResult> size(const SizeJob& job);

/// The best gearing and the given one side by side, the reason, the pictures of the sweeps, the
/// motion, the motors. Schema "flyball.size/1".
[[nodiscard]] Answer answer_of(const SizeResult& result);
[[nodiscard]] std::string to_json(const SizeResult& result);

}  // namespace flyball::study
