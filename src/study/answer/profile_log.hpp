#pragma once

#include <string>
#include <utility>
#include <vector>

#include <flyball/core/answer.hpp>
#include <flyball/core/time_series.hpp>
#include <flyball/io/wpilog.hpp>

namespace flyball::study {

/// A motion's table as a robot's log, to lay beside the log of the robot that follows it: channels
/// "profile/position" or, of several axes, "profile/lift/position", with their units.
inline std::vector<AnswerFile> log_of(const TimeSeries& table) {
  Log log;
  for (const TimeSeries::Column& column : table.columns()) {
    std::string name = column.name;
    if (const std::size_t blank = name.rfind(' '); blank != std::string::npos) {
      name[blank] = '/';
    }
    log.signals.push_back({"profile/" + name, column.unit, table.time(), column.values});
  }
  // Times that the format cannot hold leave the CSV file as it is.
  auto bytes = to_wpilog(log);
  return bytes ? std::vector<AnswerFile>{{"data/profile.wpilog", *std::move(bytes)}}
               : std::vector<AnswerFile>{};
}

}  // namespace flyball::study
