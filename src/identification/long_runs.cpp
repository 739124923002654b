#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "core/diagnose.hpp"
#include "core/format.hpp"
#include "identification/long_runs.hpp"
#include "identification/statistics.hpp"

namespace flyball::identification {
namespace {

constexpr double finest_row = 2.5e-3;  // s: a tenth of the delay of usual sensors
constexpr std::size_t stretches = 8;   // of a long run
constexpr double before = 0.5;         // s, kept before a run's window: the fit looks back
constexpr double beyond = 0.2;         // s, kept after a stretch, for values that come late
constexpr std::size_t most_runs = 48;  // each has parameters of its own
constexpr std::size_t most_of_a_kind = 8;

/// s; 0 for rows that do not go on in time.
double row_period(const TestRun& run) {
  const std::size_t rows = run.time.size();
  const bool ascends =
      rows >= 2 && std::adjacent_find(run.time.begin(), run.time.end(), [](double a, double b) {
                     return !(b > a);
                   }) == run.time.end();
  return ascends ? (run.time.back() - run.time.front()) / static_cast<double>(rows - 1) : 0.0;
}

double mean(const std::vector<double>& values, std::size_t first, std::size_t last) {
  return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(first),
                         values.begin() + static_cast<std::ptrdiff_t>(last), 0.0) /
         static_cast<double>(last - first);
}

TestRun every(const TestRun& run, std::size_t stride) {
  const std::size_t rows = run.time.size();
  TestRun coarse;
  coarse.kind = run.kind;
  coarse.from = run.from;
  coarse.to = run.to;
  coarse.left_out = run.left_out;
  for (std::size_t i = 0; i < rows; i += stride) {
    coarse.time.push_back(run.time[i]);
    coarse.voltage.push_back(mean(run.voltage, i, std::min(rows, i + stride)));
    if (!run.position.empty()) {
      coarse.position.push_back(run.position[i]);
    }
    if (!run.velocity.empty()) {
      coarse.velocity.push_back(
          mean(run.velocity, i - std::min(i, stride / 2), std::min(rows, i + stride / 2 + 1)));
    }
  }
  return coarse;
}

/// The rows that a run may have at most, so that all together have as many as a fit takes.
std::size_t fair_share(std::vector<std::size_t> lengths) {
  std::sort(lengths.begin(), lengths.end());
  std::size_t left = most_fitted_rows;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    const std::size_t share = left / (lengths.size() - k);
    if (lengths[k] > share) {
      return share;
    }
    left -= lengths[k];
  }
  return most_fitted_rows;
}

/// Rows `first` to `last` of a run as a run, of which `from` to `to` is to be used.
PreparedRun stretch(const PreparedRun& whole, std::size_t first, std::size_t last, std::size_t from,
                    std::size_t to) {
  const auto slice = [&](const std::vector<double>& values) {
    return values.empty() ? values
                          : std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(first),
                                                values.begin() + static_cast<std::ptrdiff_t>(last));
  };
  const auto among = [&](const std::vector<std::size_t>& rows) {
    std::vector<std::size_t> kept;
    for (auto row = std::lower_bound(rows.begin(), rows.end(), first);
         row != rows.end() && *row < last; ++row) {
      kept.push_back(*row - first);
    }
    return kept;
  };
  PreparedRun part;
  part.run.kind = whole.run.kind;
  part.run.time = slice(whole.run.time);
  part.run.voltage = slice(whole.run.voltage);
  part.run.position = slice(whole.run.position);
  part.run.velocity = slice(whole.run.velocity);
  part.smoothed_velocity = slice(whole.smoothed_velocity);
  part.fresh_position = among(whole.fresh_position);
  part.fresh_velocity = among(whole.fresh_velocity);
  part.source = whole.source;
  part.moved = true;
  part.direction = whole.direction;
  part.first = from - first;
  part.last = to - first;
  const bool from_its_start = from == whole.first;
  part.begins_cut = whole.begins_cut || !from_its_start;
  part.starts_at_rest = whole.starts_at_rest && from_its_start;
  return part;
}

void add_stretches(const PreparedRun& whole, std::size_t share, std::vector<PreparedRun>& runs) {
  const std::size_t rows = whole.last - whole.first;
  const std::size_t length = share / stretches;
  const std::vector<double>& time = whole.run.time;
  for (std::size_t k = 0; k < stretches; ++k) {
    const std::size_t from = whole.first + k * (rows - length) / (stretches - 1);
    const std::size_t first =
        k == 0 ? std::min(from, lower_index(time, time[from] - before)) : from;
    const std::size_t to = from + length;
    const std::size_t last = std::max(to, lower_index(time, time[to - 1] + beyond));
    runs.push_back(stretch(whole, first, last, from, to));
  }
}

/// Of more runs than a fit takes some of each kind, evenly spread over the log.
std::vector<bool> chosen_runs(const PreparedRecording& prepared) {
  std::map<TestKind, std::vector<std::size_t>> by_kind;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < prepared.runs.size(); ++i) {
    if (prepared.runs[i].moved) {
      by_kind[prepared.runs[i].run.kind].push_back(i);
      ++moved;
    }
  }
  std::vector<bool> chosen(prepared.runs.size(), moved <= most_runs);
  for (const auto& [kind, runs] : by_kind) {
    const std::size_t count = std::min(most_of_a_kind, runs.size());
    for (std::size_t k = 0; k < count; ++k) {
      chosen[runs[count == 1 ? 0 : k * (runs.size() - 1) / (count - 1)]] = true;
    }
  }
  return chosen;
}

template <class Value>
void append(std::vector<Value>& values, const std::vector<Value>& more) {
  values.insert(values.end(), more.begin(), more.end());
}

}  // namespace

std::optional<Recording> at_coarser_rows(const Recording& recording,
                                         std::vector<Diagnostic>& diagnostics) {
  std::size_t rows = 0;
  std::size_t columns_agree = 0;
  for (const TestRun& run : recording.runs) {
    rows += run.time.size();
    const auto fits = [&](const std::vector<double>& column) {
      return column.empty() || column.size() == run.time.size();
    };
    columns_agree +=
        run.voltage.size() == run.time.size() && fits(run.position) && fits(run.velocity) ? 1U : 0U;
  }
  if (rows <= most_fitted_rows || columns_agree < recording.runs.size()) {
    return std::nullopt;
  }
  Recording coarse;
  coarse.mechanism = recording.mechanism;
  coarse.unit = recording.unit;
  std::size_t kept = 0;
  for (const TestRun& run : recording.runs) {
    const double period = row_period(run);
    const auto stride = period > 0.0 ? static_cast<std::size_t>(finest_row / period) : 1;
    coarse.runs.push_back(stride >= 2 ? every(run, stride) : run);
    kept += coarse.runs.back().time.size();
  }
  if (kept == rows) {
    return std::nullopt;
  }
  note(
      diagnostics, "rows_put_together",
      "of {} rows, more than a fit takes, those that come faster than one every {:.1f} ms were put "
      "together to {} in all: the means of their voltages and velocities, and one position",
      rows, 1e3 * finest_row, kept);
  return coarse;
}

std::optional<PreparedRecording> representative_part(const PreparedRecording& prepared,
                                                     std::vector<Diagnostic>& diagnostics) {
  const std::vector<bool> chosen = chosen_runs(prepared);
  std::vector<std::size_t> lengths;
  std::size_t rows = 0;
  std::size_t chosen_rows = 0;
  std::size_t moved = 0;
  for (std::size_t i = 0; i < prepared.runs.size(); ++i) {
    const PreparedRun& run = prepared.runs[i];
    if (run.moved) {
      ++moved;
      rows += run.last - run.first;
      if (chosen[i]) {
        lengths.push_back(run.last - run.first);
        chosen_rows += lengths.back();
      }
    }
  }
  if (rows <= most_fitted_rows && moved == lengths.size()) {
    return std::nullopt;
  }
  const std::size_t tests = lengths.size();
  const std::size_t share = fair_share(std::move(lengths));
  PreparedRecording part;
  part.mechanism = prepared.mechanism;
  part.unit = prepared.unit;
  part.has_position = prepared.has_position;
  part.has_velocity = prepared.has_velocity;
  part.row_period = prepared.row_period;
  part.position_refresh_period = prepared.position_refresh_period;
  part.velocity_refresh_period = prepared.velocity_refresh_period;
  part.position_quantum = prepared.position_quantum;
  part.velocity_quantum = prepared.velocity_quantum;
  part.top_speed = prepared.top_speed;
  part.velocity_scale = prepared.velocity_scale;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < prepared.runs.size(); ++i) {
    const PreparedRun& run = prepared.runs[i];
    const std::size_t before_it = part.runs.size();
    if (run.moved && !chosen[i]) {
      part.runs.push_back(stretch(run, run.first, run.first, run.first, run.first));
      part.runs.back().moved = false;
    } else if (run.moved && run.last - run.first > share) {
      add_stretches(run, share, part.runs);
    } else {
      part.runs.push_back(run);
    }
    for (std::size_t k = before_it; k < part.runs.size(); ++k) {
      kept += part.runs[k].moved ? part.runs[k].last - part.runs[k].first : 0;
    }
  }
  const std::string of_tests =
      tests == moved ? std::string()
                     : detail::format("{} of {} tests, spread over the log", tests, moved);
  const std::string of_rows =
      chosen_rows <= most_fitted_rows
          ? std::string()
          : detail::format("of each run that is longer than {} rows, {} stretches spread over it",
                           share, stretches);
  note(diagnostics, "part_of_the_log", "{} of the {} usable rows are fitted: {}{}{}", kept, rows,
       of_tests, of_tests.empty() || of_rows.empty() ? "" : ", and ", of_rows);
  return part;
}

void join_stretches(FeedforwardFit& fit) {
  std::vector<FittedRun> joined;
  for (FittedRun& run : fit.runs) {
    if (joined.empty() || joined.back().source != run.source) {
      joined.push_back(std::move(run));
      continue;
    }
    FittedRun& whole = joined.back();
    for (const std::size_t row : run.fresh) {
      whole.fresh.push_back(whole.time.size() + row);
    }
    for (std::vector<double> FittedRun::* column :
         {&FittedRun::time, &FittedRun::voltage, &FittedRun::position, &FittedRun::velocity,
          &FittedRun::position_hat, &FittedRun::velocity_hat, &FittedRun::velocity_residual}) {
      append(whole.*column, run.*column);
    }
    whole.used = whole.used || run.used;
  }
  fit.runs = std::move(joined);
}

}  // namespace flyball::identification
