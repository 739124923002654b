#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <flyball/core/expected.hpp>

/// A file seen through a window that moves over it; private to io.
namespace flyball::io {

class ChunkedFile {
 public:
  /// @param chunk  Bytes that are read at once.
  /// @errors FileError::not_found, not_readable.
  [[nodiscard]] static Expected<ChunkedFile> open(const std::string& path,
                                                  std::size_t chunk = std::size_t{1} << 18);

  ChunkedFile(ChunkedFile&& other) noexcept;
  ChunkedFile& operator=(ChunkedFile&&) = delete;
  ~ChunkedFile();

  /// What has been read and not passed over.
  [[nodiscard]] std::string_view rest() const noexcept {
    return std::string_view(buffer_).substr(at_);
  }
  /// Reads until `rest()` has that many bytes, or the file ends. @return Whether it has.
  bool fill(std::size_t bytes);
  /// Reads one more chunk. @return Whether there was any.
  bool more();
  void pass(std::size_t bytes) noexcept {
    at_ += bytes;
    passed_ += bytes;
  }
  /// Bytes that were passed over since the beginning.
  [[nodiscard]] std::size_t position() const noexcept { return passed_; }
  [[nodiscard]] bool failed() const noexcept { return failed_; }

 private:
  ChunkedFile(int fd, std::size_t chunk) : fd_(fd), chunk_(chunk) {}

  int fd_;
  std::size_t chunk_;
  std::string buffer_;
  std::size_t at_ = 0;
  std::size_t passed_ = 0;
  bool ended_ = false;
  bool failed_ = false;
};

}  // namespace flyball::io
