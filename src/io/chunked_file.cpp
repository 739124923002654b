#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <flyball/io/file.hpp>

#include "core/try.hpp"
#include "io/chunked_file.hpp"

namespace flyball::io {

Expected<ChunkedFile> ChunkedFile::open(const std::string& path, std::size_t chunk) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
  if (fd < 0) {
    const int error = errno;
    return refusal(error == ENOENT ? FileError::not_found : FileError::not_readable, path)
        .with("system", std::generic_category().message(error));
  }
  return ChunkedFile(fd, chunk);
}

ChunkedFile::ChunkedFile(ChunkedFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      chunk_(other.chunk_),
      buffer_(std::move(other.buffer_)),
      at_(other.at_),
      passed_(other.passed_),
      ended_(other.ended_),
      failed_(other.failed_) {}

ChunkedFile::~ChunkedFile() {
  if (fd_ >= 0) {
    ::close(fd_);
  }
}

bool ChunkedFile::more() {
  if (ended_) {
    return false;
  }
  buffer_.erase(0, at_);
  at_ = 0;
  const std::size_t used = buffer_.size();
  buffer_.resize(used + chunk_);
  ssize_t got = 0;
  do {
    got = ::read(fd_, buffer_.data() + used, chunk_);
  } while (got < 0 && errno == EINTR);
  failed_ = failed_ || got < 0;
  ended_ = got <= 0;
  buffer_.resize(used + static_cast<std::size_t>(got < 0 ? 0 : got));
  return !ended_;
}

bool ChunkedFile::fill(std::size_t bytes) {
  while (buffer_.size() - at_ < bytes) {
    if (!more()) {
      return false;
    }
  }
  return true;
}

}  // namespace flyball::io
