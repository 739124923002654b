#pragma once

#include <flyball/io/log.hpp>

#include "targets/require.hpp"

namespace flyball::fuzz {

/// What <flyball/io/log.hpp> promises of every log that is read.
inline void require_promises(const SysIdJson& log) {
  for (const SysIdJson::Run& run : log.runs) {
    require(!run.time.empty(), "a test has a row");
    require_time(run.time);
    for (const std::vector<double>* column : {&run.voltage, &run.position, &run.velocity}) {
      require(column->size() == run.time.size(), "columns are of one length");
      require_finite(*column);
    }
  }
}

inline void require_promises(const Log& log) {
  for (const Signal& signal : log.signals) {
    require(signal.time.size() == signal.value.size(), "a value at each time");
    require_time(signal.time);
    require_finite(signal.value);
  }
  for (const TextSignal& text : log.texts) {
    require(text.time.size() == text.value.size(), "a text at each time");
    require_time(text.time);
  }
  if (log.sysid) {
    require_promises(*log.sysid);
  }
}

}  // namespace flyball::fuzz
