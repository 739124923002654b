#include <flyball/recording/stream_recording.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <flyball/core/progress.hpp>
#include <flyball/identification/streamed_one_step.hpp>
#include <flyball/io/log_stream.hpp>

#include "core/try.hpp"
#include "recording/channels.hpp"
#include "recording/thinned_tests.hpp"

namespace flyball::recording {

namespace {

using identification::PreparedRecording;
using identification::PreparedRun;
using identification::TestKind;
using identification::TestRun;

constexpr std::size_t most_named = 8;     // tests of a kind
constexpr std::size_t most_unnamed = 16;  // tests of a sign, ramps and steps among them
constexpr double shortest_unnamed = 0.3;  // s, as of `split_by_voltage`
constexpr double split_gap = 1.0;         // s, between stretches of one test

/// The tests of a log as it passes by.
class Bounding : public LogSink {
 public:
  explicit Bounding(const LogSelection& selection) : selection_(selection) {}

  void channel(std::size_t id, const std::string& name, const std::string& unit) override {
    if (id < channels_.size()) {
      channels_[id].unit = unit;
      return;
    }
    channels_.push_back({name, unit, {}});
    Channel& added = channels_.back();
    const auto keep = [&](const std::string& said, Quantity what, ThinnedTests::Role role) {
      const bool named = !said.empty() && said == name;
      if (!added.kept && (named || fits({name, unit, {}, {}}, what))) {
        added.kept = kept_.size();
        kept_.push_back(id);
        named_.add_channel(role);
        unnamed_.add_channel(role);
        if (what == Quantity::voltage && (named || (!voltage_ && said.empty()))) {
          voltage_ = id;
        }
      }
    };
    keep(selection_.voltage_channel, Quantity::voltage, ThinnedTests::Role::held);
    keep(selection_.velocity_channel, Quantity::velocity, ThinnedTests::Role::mean);
    keep(selection_.position_channel, Quantity::position, ThinnedTests::Role::point);
  }

  void test(std::string_view name) override {
    tables_ = true;
    if (const auto kind = identification::parse_test_kind(name)) {
      named_.begin(static_cast<int>(*kind), 0.0);
    }
  }

  void text(std::size_t id, double time, std::string_view value) override {
    if (!selection_.state_channel.empty() && channels_[id].name != selection_.state_channel) {
      return;
    }
    const auto kind = identification::parse_test_kind(value);
    if (kind && !state_) {
      state_ = id;
      unnamed_.clear();  // The tests have names.
    }
    if (!state_ || *state_ != id) {
      if (kind) {
        other_states_.emplace(id, Said{time, std::string(value)});
      }
      return;
    }
    const int now = kind ? static_cast<int>(*kind) : -1;
    if (now == state_now_) {
      return;
    }
    state_now_ = now;
    if (kind) {
      named_.begin(now, time);
    } else {
      named_.end(time);
    }
  }

  void number(std::size_t id, double time, double value) override {
    const auto& kept = channels_[id].kept;
    if (!kept) {
      return;
    }
    if (tables_ || state_) {
      named_.take(*kept, time, value);
      return;
    }
    if (voltage_ && id == *voltage_) {
      follow_voltage(time, value);
    }
    unnamed_.take(*kept, time, value);
  }

  /// @param facts  What is known beside the samples.
  BoundedLog finish(StreamedLog facts, const std::string& source) {
    ThinnedTests& tests = tables_ || state_ ? named_ : unnamed_;
    BoundedLog bounded;
    bounded.samples = facts.samples;
    const std::vector<ThinnedTests::Test> kept = tests.finish();
    bounded.tests = tests.seen();
    bounded.kept = kept.size();
    bounded.in_stretches = static_cast<std::size_t>(
        std::count_if(kept.begin(), kept.end(), [](const auto& test) { return !test.whole; }));
    bounded.log.source = source;
    bounded.log.format = facts.format;
    bounded.log.diagnostics = std::move(facts.diagnostics);
    if (facts.sysid) {
      bounded.log.sysid = std::move(facts.sysid);
      fill_tables(kept, *bounded.log.sysid);
      return bounded;
    }
    fill_channels(kept, bounded);
    return bounded;
  }

 private:
  using Quantity = recording::Channel;
  struct Channel {
    std::string name;
    std::string unit;
    std::optional<std::size_t> kept{};  ///< Its number among those that are kept.
  };
  struct Said {
    double time;
    std::string value;
  };

  /// Without names a test is where the voltage has one sign; a tenth of a second after it is kept,
  /// which parts it from the next.
  void follow_voltage(double time, double value) {
    constexpr double idle = 0.05;  // V
    constexpr double after = 0.1;  // s
    const int sign = std::abs(value) <= idle ? 0 : value > 0.0 ? 1 : -1;
    if (sign != sign_) {
      if (sign != 0) {
        unnamed_.begin(sign, time);
      } else {
        ends_ = time + after;
      }
      sign_ = sign;
    }
    if (sign == 0 && unnamed_.running() && time > ends_) {
      unnamed_.end(time);
    }
  }

  void fill_tables(const std::vector<ThinnedTests::Test>& kept, SysIdJson& sysid) const {
    constexpr std::array<std::string_view, 4> names{"slow-forward", "slow-backward", "fast-forward",
                                                    "fast-backward"};
    for (const ThinnedTests::Test& test : kept) {
      SysIdJson::Run run;
      for (const std::string_view name : names) {
        const auto kind = identification::parse_test_kind(name);
        if (kind && static_cast<int>(*kind) == test.kind) {
          run.name = std::string(name);
        }
      }
      for (const auto& stretch : test.stretches) {
        for (const auto& sample : stretch.samples) {
          if (kept_[sample.channel] == 0) {
            run.time.push_back(sample.time);
            run.voltage.push_back(sample.value);
          } else {
            (kept_[sample.channel] == 1 ? run.position : run.velocity).push_back(sample.value);
          }
        }
      }
      const std::size_t rows =
          std::min({run.time.size(), run.position.size(), run.velocity.size()});
      run.time.resize(rows);
      run.voltage.resize(rows);
      run.position.resize(rows);
      run.velocity.resize(rows);
      sysid.runs.push_back(std::move(run));
    }
  }

  void fill_channels(const std::vector<ThinnedTests::Test>& kept, BoundedLog& bounded) const {
    Log& log = bounded.log;
    for (const std::size_t id : kept_) {
      log.signals.push_back({channels_[id].name, channels_[id].unit, {}, {}});
    }
    for (const ThinnedTests::Test& test : kept) {
      bounded.begins.push_back(test.begin);
      for (const auto& stretch : test.stretches) {
        for (const auto& sample : stretch.samples) {
          Signal& signal = log.signals[sample.channel];
          signal.time.push_back(sample.time);
          signal.value.push_back(sample.value);
        }
      }
    }
    std::erase_if(log.signals, [](const Signal& signal) { return signal.time.empty(); });
    if (state_) {
      TextSignal state{channels_[*state_].name, {}, {}};
      for (const ThinnedTests::Test& test : kept) {
        state.time.insert(state.time.end(), {test.begin, test.end});
        state.value.emplace_back(to_string(static_cast<TestKind>(test.kind)));
        state.value.emplace_back("none");
      }
      log.texts.push_back(std::move(state));
    }
    for (const auto& [id, said] : other_states_) {
      log.texts.push_back({channels_[id].name, {said.time}, {said.value}});
    }
  }

  const LogSelection& selection_;
  std::vector<Channel> channels_{};
  std::vector<std::size_t> kept_{};
  ThinnedTests named_{most_named, 0.0};
  ThinnedTests unnamed_{most_unnamed, shortest_unnamed};
  bool tables_ = false;
  std::optional<std::size_t> voltage_{};
  std::optional<std::size_t> state_{};
  std::map<std::size_t, Said> other_states_{};
  int state_now_ = -1;
  int sign_ = 0;
  double ends_ = 0.0;
};

TestRun part_of(const TestRun& run, std::size_t first, std::size_t last) {
  const auto slice = [&](const std::vector<double>& values) {
    return values.empty() ? values
                          : std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(first),
                                                values.begin() + static_cast<std::ptrdiff_t>(last));
  };
  TestRun part{.kind = run.kind};
  part.time = slice(run.time);
  part.voltage = slice(run.voltage);
  part.position = slice(run.position);
  part.velocity = slice(run.velocity);
  return part;
}

/// A run's stretches as runs of their own.
/// @param goes_on  Whether a run that begins at a time begins in the middle of its test.
template <class GoesOn>
void split(const TestRun& run, const GoesOn& goes_on, std::vector<TestRun>& runs) {
  for (std::size_t first = 0; first < run.time.size();) {
    std::size_t last = first + 1;
    while (last < run.time.size() && run.time[last] - run.time[last - 1] <= split_gap) {
      ++last;
    }
    TestRun part = part_of(run, first, last);
    if (last - first >= 3 && goes_on(first, part.time.front())) {
      part.from = 0.5 * (part.time[1] - part.time[0]);
    }
    if (last - first >= 3) {
      runs.push_back(std::move(part));
    }
    first = last;
  }
}

/// How much an SI value is of a recorded one, and which channel it is.
struct Scaled {
  std::string name{};
  double factor = 1.0;
};

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The factor between two columns, the same in all runs, or nothing. @param steps  Whether of their
/// steps: one may be off by a constant.
std::optional<double> factor_between(const std::vector<std::vector<double>>& recorded,
                                     const std::vector<const std::vector<double>*>& prepared,
                                     bool steps) {
  std::optional<double> factor;
  for (std::size_t run = 0; run < recorded.size(); ++run) {
    const std::vector<double>& from = recorded[run];
    const std::vector<double>& to = *prepared[run];
    if (from.size() != to.size()) {
      return std::nullopt;
    }
    std::vector<double> ratios;
    for (std::size_t i = steps ? 1 : 0; i < from.size(); ++i) {
      const double a = steps ? from[i] - from[i - 1] : from[i];
      const double b = steps ? to[i] - to[i - 1] : to[i];
      if (std::abs(a) > 1e-9) {
        ratios.push_back(b / a);
      }
    }
    if (ratios.empty()) {
      continue;
    }
    const double found = median_of(ratios);
    if (factor && std::abs(found - *factor) > 0.01 * std::abs(*factor)) {
      return std::nullopt;
    }
    factor = factor ? *factor : found;
  }
  return factor && *factor != 0.0 ? factor : std::nullopt;
}

/// What was applied or measured at the last sample up to a time.
class Held {
 public:
  void take(double time, double value) {
    constexpr std::size_t most = 4096;
    values_.push_back({time, value});
    if (values_.size() > most) {
      values_.pop_front();
    }
  }
  /// Forgets what is older than that.
  std::optional<double> at(double time) {
    while (values_.size() > 1 && values_[1][0] <= time) {
      values_.pop_front();
    }
    return values_.empty() || values_.front()[0] > time ? std::nullopt
                                                        : std::optional(values_.front()[1]);
  }
  void clear() { values_.clear(); }

 private:
  std::deque<std::array<double, 2>> values_{};
};

/// The regression as a log passes by.
class Regressing : public LogSink {
 public:
  struct Settings {
    Scaled voltage, velocity, position;  ///< The last without a name where no angle is needed.
    std::string state{};
    mechanisms::MechanismKind kind{};
    double slowest = 0.0;  ///< What counts as motion.
  };
  explicit Regressing(const Settings& settings)
      : settings_(settings), regression_(settings.kind, !settings.position.name.empty()) {}

  void channel(std::size_t id, const std::string& name, const std::string& /*unit*/) override {
    if (id < roles_.size()) {
      return;
    }
    const auto first = [&](const Scaled& wanted, bool& found) {
      const bool is = !found && !wanted.name.empty() && wanted.name == name;
      found = found || is;
      return is;
    };
    roles_.push_back(first(settings_.voltage, has_voltage_)                ? Role::voltage
                     : first(settings_.velocity, has_velocity_)            ? Role::velocity
                     : first(settings_.position, has_position_)            ? Role::position
                     : !settings_.state.empty() && name == settings_.state ? Role::state
                                                                           : Role::none);
  }

  void test(std::string_view name) override {
    forget();
    in_test_ = identification::parse_test_kind(name).has_value();
  }

  void text(std::size_t id, double /*time*/, std::string_view value) override {
    if (roles_[id] == Role::state) {
      in_test_ = identification::parse_test_kind(value).has_value();
    }
  }

  void number(std::size_t id, double time, double value) override {
    switch (roles_[id]) {
      case Role::voltage:
        voltage_.take(time, settings_.voltage.factor * value);
        break;
      case Role::position:
        position_.take(time, settings_.position.factor * value);
        break;
      case Role::velocity:
        step(time, settings_.velocity.factor * value);
        break;
      case Role::state:
      case Role::none:
        break;
    }
  }

  Expected<StreamedRegression> finish() {
    settle_period();
    FLYBALL_TRY(auto fit, regression_.fit(period_));
    return StreamedRegression{fit, regression_.rows()};
  }

 private:
  enum class Role { none, voltage, velocity, position, state };
  struct Row {
    double x, u, angle, next, period;
  };

  void forget() {
    voltage_.clear();
    position_.clear();
    has_last_ = false;
  }

  void step(double time, double velocity) {
    if (has_last_ && time > last_time_) {
      const double period = time - last_time_;
      const double soon = last_time_ + std::min(1e-3, 0.25 * period);  // stamps of one loop differ
      const auto u = voltage_.at(soon);
      const auto angle = has_position_ ? position_.at(soon) : std::optional(0.0);
      if (last_in_test_ && in_test_ && u && angle && std::abs(last_) > settings_.slowest) {
        take({last_, *u, *angle, velocity, period});
      }
    }
    has_last_ = true;
    last_ = velocity;
    last_time_ = time;
    last_in_test_ = in_test_ || settings_.state.empty();
    in_test_ = in_test_ || settings_.state.empty();
  }

  void take(const Row& row) {
    constexpr std::size_t looked_at = 1000;
    if (period_ == 0.0) {
      first_.push_back(row);
      if (first_.size() >= looked_at) {
        settle_period();
      }
      return;
    }
    if (std::abs(row.period - period_) <= 0.5 * period_) {
      regression_.add(row.x, row.u, row.angle, row.next);
    }
  }

  void settle_period() {
    if (period_ > 0.0 || first_.empty()) {
      return;
    }
    std::vector<double> periods;
    for (const Row& row : first_) {
      periods.push_back(row.period);
    }
    period_ = median_of(periods);
    for (const Row& row : first_) {
      take(row);
    }
    first_.clear();
  }

  Settings settings_;
  identification::StreamedOneStep regression_;
  std::vector<Role> roles_{};
  bool has_voltage_ = false;
  bool has_velocity_ = false;
  bool has_position_ = false;
  Held voltage_{};
  Held position_{};
  bool in_test_ = false;
  bool has_last_ = false;
  bool last_in_test_ = false;
  double last_ = 0.0;
  double last_time_ = 0.0;
  double period_ = 0.0;
  std::vector<Row> first_{};
};

/// The columns of a bounded SysId JSON at the rows of the prepared runs.
const SysIdJson::Run* table_of(const SysIdJson& sysid, TestKind kind) {
  for (const SysIdJson::Run& run : sysid.runs) {
    const auto of = identification::parse_test_kind(run.name);
    if (of && *of == kind) {
      return &run;
    }
  }
  return nullptr;
}

/// A recorded column at the times of a prepared run.
std::vector<double> at_times(const Signal& signal, const std::vector<double>& time, bool held) {
  if (!held) {
    return sampled(signal, time);
  }
  std::vector<double> values;
  std::size_t at = 0;
  for (const double t : time) {
    while (at + 1 < signal.time.size() && signal.time[at + 1] <= t) {
      ++at;
    }
    values.push_back(signal.value[at]);
  }
  return values;
}

std::optional<double> factor_of(const std::vector<PreparedRun>& runs,
                                std::vector<double> TestRun::* column, bool steps,
                                const auto& recorded_of) {
  std::vector<std::vector<double>> recorded;
  std::vector<const std::vector<double>*> prepared;
  for (const PreparedRun& run : runs) {
    if (run.moved) {
      recorded.push_back(recorded_of(run.run));
      prepared.push_back(&(run.run.*column));
    }
  }
  return factor_between(recorded, prepared, steps);
}

}  // namespace

ExpectedAll<std::optional<BoundedLog>> read_bounded_log(const std::string& path,
                                                        const LogSelection& selection) {
  if (!selection.runs.empty() || !selection.without_runs.empty() || !selection.also.empty() ||
      selection.drivetrain) {
    return std::optional<BoundedLog>();
  }
  tell_progress("reads the log");
  Bounding sink(selection);
  FLYBALL_TRY(auto facts, stream_log(path, sink));
  return facts ? std::optional(sink.finish(*std::move(facts), path)) : std::optional<BoundedLog>();
}

ExpectedAll<LoadedRecording> recording_from_bounded_log(const BoundedLog& bounded,
                                                        const LogSelection& selection) {
  FLYBALL_TRY(auto loaded, recording_from_log(bounded.log, selection));
  std::vector<TestRun> runs;
  for (const TestRun& run : loaded.recording.runs) {
    split(
        run,
        [&](std::size_t row, double time) {
          return bounded.log.sysid
                     ? row > 0
                     : std::none_of(bounded.begins.begin(), bounded.begins.end(),
                                    [&](double begin) {
                                      return time >= begin && time - begin < stretch_length;
                                    });
        },
        runs);
  }
  loaded.recording.runs = std::move(runs);
  return loaded;
}

ExpectedAll<std::optional<StreamedRegression>> regress_whole_log(
    const std::string& path, const BoundedLog& bounded, const LogSelection& selection,
    const PreparedRecording& prepared) {
  constexpr double motion = 0.04;  // of the top speed
  if (!prepared.has_velocity || !prepared.mechanism) {
    return std::optional<StreamedRegression>();
  }
  Regressing::Settings settings;
  settings.kind = *prepared.mechanism;
  settings.slowest = motion * prepared.top_speed;
  const bool arm = settings.kind == mechanisms::MechanismKind::arm && prepared.has_position;
  std::optional<double> voltage;
  std::optional<double> velocity;
  std::optional<double> position;
  if (const auto& sysid = bounded.log.sysid) {
    settings.voltage.name = "voltage";
    settings.velocity.name = "velocity";
    settings.position.name = arm ? "position" : "";
    const auto column = [&](std::vector<double> SysIdJson::Run::* of, bool held) {
      return [&sysid, of, held](const TestRun& run) {
        const SysIdJson::Run* table = table_of(*sysid, run.kind);
        return table == nullptr ? std::vector<double>()
                                : at_times({"", "", table->time, table->*of}, run.time, held);
      };
    };
    voltage =
        factor_of(prepared.runs, &TestRun::voltage, false, column(&SysIdJson::Run::voltage, true));
    velocity = factor_of(prepared.runs, &TestRun::velocity, false,
                         column(&SysIdJson::Run::velocity, false));
    position = arm ? factor_of(prepared.runs, &TestRun::position, true,
                               column(&SysIdJson::Run::position, false))
                   : std::optional(1.0);
  } else {
    FLYBALL_TRY(const auto tests, find_tests(bounded.log, selection.state_channel));
    std::vector<Diagnostic> told;
    FLYBALL_TRY(const auto channels, find_channels(bounded.log, tests, selection, told));
    if (channels.velocity == nullptr || (arm && channels.position == nullptr)) {
      return std::optional<StreamedRegression>();
    }
    settings.state = tests.state_name;
    settings.voltage.name = channels.voltage->name;
    settings.velocity.name = channels.velocity->name;
    settings.position.name = arm ? channels.position->name : "";
    const auto column = [](const Signal& signal, bool held) {
      return [&signal, held](const TestRun& run) { return at_times(signal, run.time, held); };
    };
    voltage = factor_of(prepared.runs, &TestRun::voltage, false, column(*channels.voltage, true));
    velocity =
        factor_of(prepared.runs, &TestRun::velocity, false, column(*channels.velocity, false));
    position =
        arm ? factor_of(prepared.runs, &TestRun::position, true, column(*channels.position, false))
            : std::optional(1.0);
  }
  if (!voltage || !velocity || !position) {
    return std::optional<StreamedRegression>();
  }
  settings.voltage.factor = *voltage;
  settings.velocity.factor = *velocity;
  settings.position.factor = *position;
  tell_progress("regresses all rows");
  Regressing sink(settings);
  FLYBALL_TRY(const auto facts, stream_log(path, sink));
  if (!facts) {
    return std::optional<StreamedRegression>();
  }
  FLYBALL_TRY(auto found, sink.finish());
  return std::optional(found);
}

}  // namespace flyball::recording
