// The readers that hold no file, fed in chunks of a few bytes, beside those that hold it whole.
#include <cmath>
#include <cstdio>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include <flyball/io/csv.hpp>
#include <flyball/io/log_stream.hpp>
#include <flyball/io/sysid_json.hpp>
#include <flyball/io/wpilog.hpp>

#include "io/log_streams.hpp"
#include "targets/log_promises.hpp"

namespace {

using namespace flyball;

class Watcher : public LogSink {
 public:
  void channel(std::size_t id, const std::string&, const std::string&) override {
    fuzz::require(id <= channels_, "channels count from 0");
    channels_ += id == channels_ ? 1 : 0;
  }
  void number(std::size_t id, double time, double value) override {
    fuzz::require(id < channels_, "a sample is of a channel that was told");
    fuzz::require(std::isfinite(time) && std::isfinite(value), "numbers are finite");
    ++numbers;
  }
  void text(std::size_t id, double time, std::string_view) override {
    fuzz::require(id < channels_, "a text is of a channel that was told");
    fuzz::require(std::isfinite(time), "times are finite");
  }
  void test(std::string_view) override {}
  std::size_t numbers = 0;

 private:
  std::size_t channels_ = 0;
};

/// Whether the reader of the whole file takes it, too.
bool is_read_whole(std::string_view text, const StreamedLog& streamed) {
  if (streamed.format == "WPILOG") {
    return parse_wpilog(text, "fuzz").has_value();
  }
  return streamed.sysid ? parse_sysid_json(text, "fuzz").has_value()
                        : parse_csv(text, "fuzz").has_value();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  const int memory = memfd_create("fuzz", MFD_CLOEXEC);
  if (memory < 0 || ::write(memory, data, size) != static_cast<ssize_t>(size)) {
    return 0;
  }
  const std::string path = "/proc/self/fd/" + std::to_string(memory);
  std::size_t numbers[2] = {0, 0};
  bool read[2] = {false, false};
  bool told[2] = {false, false};
  for (int k = 0; k < 2; ++k) {
    auto file = io::ChunkedFile::open(path, k == 0 ? 13 : std::size_t{1} << 18);
    if (!file) {
      break;
    }
    Watcher sink;
    const auto streamed = io::stream_log(*file, "fuzz", sink);
    numbers[k] = sink.numbers;
    told[k] = streamed.has_value();
    read[k] = streamed && streamed->has_value();
    // Of damaged files the two may use other parts.
    if (read[k] && k == 1 && sink.numbers > 0 && (*streamed)->diagnostics.empty()) {
      fuzz::require(is_read_whole(text, **streamed), "what is streamed can be read whole");
    }
  }
  ::close(memory);
  fuzz::require(told[0] == told[1] && read[0] == read[1] && numbers[0] == numbers[1],
                "chunks of any size tell the same");
  return 0;
}
