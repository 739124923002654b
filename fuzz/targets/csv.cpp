#include <flyball/io/csv.hpp>

#include "targets/log_promises.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace flyball;
  const auto log = parse_csv(fuzz::text_of(data, size), "fuzz.csv");
  if (log) {
    fuzz::require_promises(*log);
  }
  return 0;
}
