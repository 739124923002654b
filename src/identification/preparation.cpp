#include <flyball/identification/preparation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>

#include <flyball/core/argument.hpp>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "identification/channels.hpp"
#include "identification/statistics.hpp"
#include "identification/trimming.hpp"

namespace flyball::identification {
namespace {

constexpr std::string_view in_prepare = "prepare";

Expected<void> check_columns(const TestRun& run, std::size_t index) {
  const std::size_t rows = run.time.size();
  const auto fits = [rows](const std::vector<double>& column) {
    return column.empty() || column.size() == rows;
  };
  const bool sized = run.voltage.size() == rows && fits(run.position) && fits(run.velocity);
  const bool moves = rows == 0 || !run.position.empty() || !run.velocity.empty();
  if (sized && moves) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, in_prepare,
                 detail::format("run {} ({})", index, to_string(run.kind)))
      .got(detail::format("{} times, {} voltages, {} positions, {} velocities", rows,
                          run.voltage.size(), run.position.size(), run.velocity.size()))
      .expected("columns of one length, position or velocity among them");
}

/// Keeps the rows listed, in their order.
void keep_rows(TestRun& run, const std::vector<std::size_t>& rows) {
  for (std::vector<double> TestRun::* column :
       {&TestRun::time, &TestRun::voltage, &TestRun::position, &TestRun::velocity}) {
    std::vector<double>& values = run.*column;
    if (values.empty()) {
      continue;
    }
    std::vector<double> kept(rows.size());
    std::transform(rows.begin(), rows.end(), kept.begin(),
                   [&](std::size_t row) { return values[row]; });
    values = std::move(kept);
  }
}

struct RowDefects {
  std::size_t not_finite = 0;
  std::size_t unsorted = 0;
  std::size_t same_time = 0;
  std::size_t outliers = 0;
  std::size_t stale = 0;
  std::size_t jumps = 0;
  std::size_t total = 0;
};

void drop_not_finite(TestRun& run, RowDefects& defects) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    const bool finite = std::isfinite(run.time[i]) && std::isfinite(run.voltage[i]) &&
                        (run.position.empty() || std::isfinite(run.position[i])) &&
                        (run.velocity.empty() || std::isfinite(run.velocity[i]));
    if (finite) {
      rows.push_back(i);
    }
  }
  if (rows.size() < run.time.size()) {
    defects.not_finite += run.time.size() - rows.size();
    keep_rows(run, rows);
  }
}

/// What a person trimmed away goes before anything is looked at.
void trim_by_hand(PreparedRun& prepared) {
  TestRun& run = prepared.run;
  if (!run.is_trimmed() || run.time.empty()) {
    return;
  }
  const double start = *std::min_element(run.time.begin(), run.time.end());
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < run.time.size(); ++i) {
    const double at = run.time[i] - start;
    if (at >= run.from && at <= run.to) {
      rows.push_back(i);
    }
    prepared.begins_cut = prepared.begins_cut || at < run.from;
  }
  keep_rows(run, rows);
}

void sort_rows(TestRun& run, RowDefects& defects) {
  std::size_t inversions = 0;
  for (std::size_t i = 1; i < run.time.size(); ++i) {
    inversions += run.time[i] < run.time[i - 1] ? 1U : 0U;
  }
  std::vector<std::size_t> rows(run.time.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  if (inversions > 0) {
    defects.unsorted += inversions;
    std::stable_sort(rows.begin(), rows.end(),
                     [&](std::size_t a, std::size_t b) { return run.time[a] < run.time[b]; });
  }
  // Two rows of one instant cannot both be true: the later one stands.
  std::vector<std::size_t> distinct;
  for (const std::size_t row : rows) {
    if (!distinct.empty() && run.time[row] == run.time[distinct.back()]) {
      distinct.back() = row;
      ++defects.same_time;
    } else {
      distinct.push_back(row);
    }
  }
  if (inversions > 0 || distinct.size() < rows.size()) {
    keep_rows(run, distinct);
  }
}

/// Marks values that stand alone: far from the median of three on each side, beside what is usual
/// and a share of the range. What steps and stays is none.
void mark_spikes(const std::vector<double>& values, double share, std::vector<bool>& bad) {
  constexpr std::size_t reach = 3;
  constexpr double clear = 10.0;
  if (values.size() < 20) {
    return;
  }
  std::vector<double> off(values.size(), 0.0);
  std::array<double, 2 * reach + 1> near{};
  for (std::size_t i = reach; i + reach < values.size(); ++i) {
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i - reach), near.size(), near.begin());
    std::nth_element(near.begin(), near.begin() + reach, near.end());
    off[i] = values[i] - near[reach];
  }
  const double range = quantile(values, 0.9) - quantile(values, 0.1);
  const double limit = std::max(clear * mad_scale(off), share * range);
  for (std::size_t i = 2 * reach; limit > 0.0 && i + reach < values.size(); ++i) {
    bad[i] = bad[i] || std::abs(off[i]) > limit;
  }
}

/// Rows whose value is far outside the run's range and not shared by the neighbours.
void drop_outliers(TestRun& run, RowDefects& defects) {
  std::vector<bool> bad(run.time.size(), false);
  for (const std::vector<double> TestRun::* column :
       {&TestRun::voltage, &TestRun::position, &TestRun::velocity}) {
    const std::vector<double>& values = run.*column;
    if (values.size() < 20) {
      continue;
    }
    const double low = quantile(values, 0.01);
    const double high = quantile(values, 0.99);
    const double spread = std::max(high - low, 1e-3 * std::max(std::abs(low), std::abs(high)));
    for (std::size_t i = 0; spread > 0.0 && i < values.size(); ++i) {
      const double beyond = std::max(low - values[i], values[i] - high);
      bad[i] = bad[i] || beyond > 2.0 * spread;
    }
    // A speed may leap where slack is taken up, a voltage at a step.
    mark_spikes(values, column == &TestRun::position ? 0.5 : 1.0, bad);
  }
  // A hundredth of a very long test may be its start: what lasts is no outlier.
  constexpr std::ptrdiff_t longest = 20;
  for (auto first = std::find(bad.begin(), bad.end(), true); first != bad.end();) {
    const auto last = std::find(first, bad.end(), false);
    if (last - first > longest) {
      std::fill(first, last, false);
    }
    first = std::find(last, bad.end(), true);
  }
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    if (!bad[i]) {
      rows.push_back(i);
    }
  }
  if (rows.size() < bad.size()) {
    defects.outliers += bad.size() - rows.size();
    keep_rows(run, rows);
  }
}

struct Segment {
  std::size_t begin;
  std::size_t end;
};

/// Stretches of the position without a jump that no mechanism makes: six times the usual fast step
/// and a tenth of the range at once. Stale first values, wrapping encoders and glitches make them.
std::vector<Segment> smooth_segments(const std::vector<double>& position, double& largest_step) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < position.size(); ++i) {
    if (position[i] != position[i - 1]) {
      steps.push_back(std::abs(position[i] - position[i - 1]));
    }
  }
  const auto [low, high] = std::minmax_element(position.begin(), position.end());
  largest_step = std::max(6.0 * quantile(steps, 0.95), 0.1 * (*high - *low));
  std::vector<Segment> segments{{0, position.size()}};
  for (std::size_t i = 1; i < position.size(); ++i) {
    if (std::abs(position[i] - position[i - 1]) > largest_step) {
      segments.back().end = i;
      segments.push_back({i, position.size()});
    }
  }
  return segments;
}

/// A first value that is the last one of another test, or zero: the step away from it is more than
/// four times both steps after it (a start from rest speeds up, and a ramp has just been at
/// rest), more than the coarsest usual step and a 200th of the test's travel.
std::size_t stale_rows(const TestRun& run) {
  constexpr std::size_t most = 6;  // rows that may repeat it
  std::vector<std::size_t> changes;
  for (std::size_t i = 1; i < run.position.size() && changes.size() < 3; ++i) {
    if (run.position[i] != run.position[i - 1]) {
      changes.push_back(i);
    }
  }
  if (changes.size() < 3 || changes.front() > most) {
    return 0;
  }
  const auto step = [&](std::size_t k) {
    return std::abs(run.position[changes[k]] - run.position[changes[k] - 1]);
  };
  const auto [low, high] = std::minmax_element(
      run.position.begin() + static_cast<std::ptrdiff_t>(changes.front()), run.position.end());
  const bool stale = step(0) > 4.0 * std::max(step(1), step(2)) && step(0) > 0.005 * (*high - *low);
  return stale ? changes.front() : 0;
}

/// Puts the value after them in their place: the rows themselves have the voltage's edge.
void mend_stale_start(TestRun& run, RowDefects& defects) {
  const std::size_t stale = stale_rows(run);
  std::fill_n(run.position.begin(), stale, stale > 0 ? run.position[stale] : 0.0);
  defects.stale += stale;
}

/// Keeps the longest stretch without jumps and what continues it on both sides.
void drop_jumps(TestRun& run, RowDefects& defects) {
  if (run.position.size() < 20) {
    return;
  }
  double largest_step = 0.0;
  const std::vector<Segment> segments = smooth_segments(run.position, largest_step);
  if (segments.size() == 1) {
    return;
  }
  const auto longest = std::max_element(
      segments.begin(), segments.end(),
      [](const Segment& a, const Segment& b) { return a.end - a.begin < b.end - b.begin; });
  std::vector<Segment> kept{*longest};
  for (auto segment = longest + 1; segment != segments.end(); ++segment) {
    const double step = run.position[segment->begin] - run.position[kept.back().end - 1];
    if (std::abs(step) <= largest_step) {
      kept.push_back(*segment);
    }
  }
  for (auto segment = longest; segment != segments.begin();) {
    --segment;
    const double step = run.position[kept.front().begin] - run.position[segment->end - 1];
    if (std::abs(step) <= largest_step) {
      kept.insert(kept.begin(), *segment);
    }
  }
  std::vector<std::size_t> rows;
  for (const Segment& segment : kept) {
    for (std::size_t i = segment.begin; i < segment.end; ++i) {
      rows.push_back(i);
    }
  }
  defects.jumps += run.time.size() - rows.size();
  keep_rows(run, rows);
}

void report_rows(const RowDefects& defects, std::vector<Diagnostic>& diagnostics) {
  const auto tell = [&](std::size_t count, std::string code, std::string_view what,
                        std::string_view done) {
    if (count > 0) {
      warn(diagnostics, std::move(code), "{} of {} rows {}; {}", count, defects.total, what, done);
    }
  };
  tell(defects.not_finite, "non_finite_rows", "hold NaN or infinity", "they were dropped");
  tell(defects.unsorted, "unsorted_time", "go back in time", "the rows were sorted");
  tell(defects.same_time, "duplicate_times", "repeat the time of the row before",
       "the later one was kept");
  tell(defects.outliers, "outliers", "hold a value far outside the test's range or its neighbours'",
       "they were dropped");
  tell(defects.stale, "stale_first_value",
       "at the start of a test hold a position of before it (another test's last, or zero)",
       "the value after them was taken in its place");
  tell(defects.jumps, "position_jumps",
       "lie beyond a jump of the position that no mechanism makes (a stale first value, a wrapping "
       "encoder or a glitch)",
       "they were dropped");
}

bool any_changes(const std::vector<PreparedRun>& runs, std::vector<double> TestRun::* column) {
  return std::any_of(runs.begin(), runs.end(), [column](const PreparedRun& run) {
    const std::vector<double>& values = run.run.*column;
    return std::adjacent_find(values.begin(), values.end(), std::not_equal_to<>{}) != values.end();
  });
}

bool all_have(const std::vector<PreparedRun>& runs, std::vector<double> TestRun::* column) {
  return !runs.empty() && std::none_of(runs.begin(), runs.end(), [column](const PreparedRun& run) {
    return (run.run.*column).empty();
  });
}

void choose_channels(PreparedRecording& prepared) {
  prepared.has_position =
      all_have(prepared.runs, &TestRun::position) && any_changes(prepared.runs, &TestRun::position);
  prepared.has_velocity =
      all_have(prepared.runs, &TestRun::velocity) && any_changes(prepared.runs, &TestRun::velocity);
  std::vector<double> steps;
  for (const PreparedRun& run : prepared.runs) {
    for (std::size_t i = 1; i < run.run.time.size(); ++i) {
      steps.push_back(run.run.time[i] - run.run.time[i - 1]);
    }
  }
  prepared.row_period = median(std::move(steps));
  prepared.position_quantum = column_quantum(prepared.runs, &TestRun::position);
  prepared.velocity_quantum = column_quantum(prepared.runs, &TestRun::velocity);
  prepared.position_refresh_period = refresh_period(prepared.runs, &TestRun::position);
  prepared.velocity_refresh_period = refresh_period(prepared.runs, &TestRun::velocity);
}

/// A mechanism's test lasts seconds: rows that are farther apart have their time in another unit.
Expected<void> check_row_period(double period) {
  constexpr double longest = 1.0;
  if (period <= longest) {
    return {};
  }
  return refusal(ArgumentError::out_of_range, "identify", "the distance of two rows in time")
      .got(format_number(period) + " s")
      .expected("at most " + format_number(longest) + " s")
      .hint("give time in seconds, or name its unit in the header, such as \"time (us)\"");
}

void report_repeats(PreparedRecording& prepared) {
  const double share = repeated_share(prepared.runs);
  if (share > 0.2) {
    note(prepared.diagnostics, "repeated_rows",
         "{:.0f} % of the rows repeat the encoder value before (rows every {:.1f} ms, new values "
         "every {:.1f} ms); only rows with new values are compared with the simulation",
         100.0 * share, 1e3 * prepared.row_period,
         1e3 * std::max(prepared.position_refresh_period, prepared.velocity_refresh_period));
  }
}

void report_missing_tests(PreparedRecording& prepared) {
  for (const TestKind kind : {TestKind::quasistatic_forward, TestKind::quasistatic_reverse,
                              TestKind::dynamic_forward, TestKind::dynamic_reverse}) {
    const bool present = std::any_of(
        prepared.runs.begin(), prepared.runs.end(),
        [kind](const PreparedRun& run) { return run.run.kind == kind && !run.run.left_out; });
    if (!present) {
      warn(prepared.diagnostics, "missing_test", "the {} test is missing from the log",
           to_string(kind));
    }
  }
}

/// An arm does not turn round and round: then the position is that of something else.
void report_travel(PreparedRecording& prepared) {
  if (prepared.mechanism != mechanisms::MechanismKind::arm || !prepared.has_position) {
    return;
  }
  double travel = 0.0;
  for (const PreparedRun& run : prepared.runs) {
    const auto [low, high] = std::minmax_element(run.run.position.begin(), run.run.position.end());
    travel = std::max(travel, run.run.left_out ? 0.0 : *high - *low);
  }
  constexpr double turn = 2.0 * std::numbers::pi;
  if (travel > turn) {
    warn(prepared.diagnostics, "travel_exceeds_turn",
         "the arm's position spans {:.1f} rad ({:.1f} turns) in one test: it looks like the "
         "motor's angle, not the arm's; gravity cannot be found and all gains are per radian of "
         "that angle. Give the gearing to the encoder",
         travel, travel / turn);
  }
}

}  // namespace

Expected<PreparedRecording> prepare(const Recording& recording, const PreparationOptions& options) {
  PreparedRecording prepared;
  prepared.mechanism = options.mechanism ? options.mechanism : recording.mechanism;
  prepared.unit = recording.unit;

  RowDefects defects;
  for (std::size_t i = 0; i < recording.runs.size(); ++i) {
    FLYBALL_CHECK(check_columns(recording.runs[i], i));
    PreparedRun run;
    run.run = recording.runs[i];
    run.source = i;
    drop_not_finite(run.run, defects);
    trim_by_hand(run);
    if (run.run.left_out) {
      RowDefects untold;
      sort_rows(run.run, untold);
    } else {
      defects.total += run.run.time.size();
      sort_rows(run.run, defects);
      drop_outliers(run.run, defects);
      mend_stale_start(run.run, defects);
      drop_jumps(run.run, defects);
    }
    if (run.run.time.size() >= 2) {
      prepared.runs.push_back(std::move(run));
    }
  }
  report_rows(defects, prepared.diagnostics);
  report_missing_tests(prepared);

  choose_channels(prepared);
  FLYBALL_CHECK(check_row_period(prepared.row_period));
  refresh_derived_columns(prepared);
  detect_motion(prepared);
  mend_slips(prepared);
  mend_signs(prepared);
  drop_coarse_velocity(prepared);
  mend_saturation(prepared);
  trim_runs(prepared, options);
  report_travel(prepared);
  check_velocity_scale(prepared);
  report_repeats(prepared);
  return prepared;
}

}  // namespace flyball::identification
