// The signals of a log and its fit as a WPILOG, which log viewers open beside the robot's own.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>

#include <flyball/io/wpilog.hpp>

#include "study/answer/parts.hpp"

namespace flyball::study {

namespace {

using identification::FittedRun;
using identification::TestRun;

struct Channel {
  const char* name;
  std::string unit;
  const std::vector<double>* values;
};

/// The signals under "flyball/", filled run by run.
class SignalLog {
 public:
  SignalLog() { log_.texts.push_back({.name = "flyball/test", .time = {}, .value = {}}); }

  /// @param shift  s, added to the run's times.
  void add(const std::vector<double>& time, double shift, std::string_view test,
           std::initializer_list<Channel> channels) {
    if (time.empty()) {
      return;
    }
    say(time.front() + shift, std::string(test));
    for (const Channel& channel : channels) {
      if (channel.values->size() != time.size()) {
        continue;  // a run without that channel
      }
      Signal& signal = named(channel);
      for (std::size_t row = 0; row < time.size(); ++row) {
        signal.time.push_back(time[row] + shift);
        signal.value.push_back((*channel.values)[row]);
      }
    }
    say(std::nextafter(time.back() + shift + 1e-6, INFINITY), "none");
  }

  [[nodiscard]] const Log& log() const { return log_; }

 private:
  void say(double time, std::string text) {
    log_.texts.front().time.push_back(time);
    log_.texts.front().value.push_back(std::move(text));
  }

  Signal& named(const Channel& channel) {
    const std::string name = std::string("flyball/") + channel.name;
    for (Signal& signal : log_.signals) {
      if (signal.name == name) {
        return signal;
      }
    }
    Signal& signal = log_.signals.emplace_back();
    signal.name = name;
    signal.unit = channel.unit;
    return signal;
  }

  Log log_{};
};

}  // namespace

std::vector<AnswerFile> signal_log(const IdentifyResult& result) {
  SignalLog signals;
  const std::string rate = result.unit + "/s";
  // A run whose clock begins before the end of the one before it (tests recorded each from zero, or
  // several logs) stands a second after that one.
  double last = -1.0;
  for (const identification::PreparedRun& prepared : shown_runs(result)) {
    const TestRun& run = prepared.run;
    if (run.time.empty()) {
      continue;
    }
    const bool follows = run.time.front() >= 0.0 && run.time.front() > last;
    const double shift = follows ? 0.0 : last + 1.0 - run.time.front();
    last = run.time.back() + shift;
    const FittedRun* fitted = fitted_run(result, prepared.source);
    if (fitted != nullptr && fitted->used) {
      signals.add(fitted->time, shift, to_string(run.kind),
                  {{"voltage", "V", &fitted->voltage},
                   {"velocity", rate, &fitted->velocity},
                   {"velocity_simulated", rate, &fitted->velocity_hat},
                   {"velocity_residual", rate, &fitted->velocity_residual},
                   {"position", result.unit, &fitted->position},
                   {"position_simulated", result.unit, &fitted->position_hat}});
    } else {
      signals.add(run.time, shift, to_string(run.kind),
                  {{"voltage", "V", &run.voltage},
                   {"velocity", rate, &run.velocity},
                   {"position", result.unit, &run.position}});
    }
  }
  // Times that the format cannot hold leave the CSV files as they are.
  auto bytes = to_wpilog(signals.log());
  return bytes ? std::vector<AnswerFile>{{"data/signals.wpilog", *std::move(bytes)}}
               : std::vector<AnswerFile>{};
}

}  // namespace flyball::study
