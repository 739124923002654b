#include <flyball/io/sysid_json.hpp>

#include "targets/log_promises.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  const auto log = parse_sysid_json(fuzz::text_of(data, size), "fuzz.json");
  if (!log) {
    return 0;
  }
  fuzz::require_promises(*log);
  // Written and read again, it is the same log.
  const auto text = to_sysid_json(*log);
  fuzz::require(text.has_value(), "what was read can be written");
  const auto again = parse_sysid_json(*text, "again.json");
  fuzz::require(again && again->runs.size() == log->runs.size(), "what is written can be read");
  for (std::size_t k = 0; k < log->runs.size(); ++k) {
    const SysIdJson::Run& one = log->runs[k];
    const SysIdJson::Run& other = again->runs[k];
    fuzz::require(one.name == other.name && one.time == other.time &&
                      one.voltage == other.voltage && one.position == other.position &&
                      one.velocity == other.velocity,
                  "reading what was written gives the same log");
  }
  return 0;
}
