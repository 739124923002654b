#include <cstddef>
#include <cstdint>
#include <string_view>

#include <flyball/io/log.hpp>

/// libFuzzer's entry: any bytes are a log or an error, and nothing else happens.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  (void)flyball::parse_log(bytes, "fuzz");
  return 0;
}
