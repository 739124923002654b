#include <flyball/io/file.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error_rows.hpp"
#include "core/try.hpp"
#include "io/unfinished.hpp"

namespace flyball {
namespace {

namespace fs = std::filesystem;

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  [[nodiscard]] int get() const { return fd_; }
  /// Closes now; false if the system only then finds that the bytes do not fit.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

std::string reason(int error) {
  return std::generic_category().message(error);
}

Refusal cannot_write(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
      return refusal(FileError::not_found, path, "the folder of the file")
          .got("missing")
          .hint("make the folder, or give another path");
    case EISDIR:
      return refusal(FileError::is_a_folder, path, "the path")
          .got("a folder")
          .expected("a file")
          .hint("give a file name in it");
    default:
      return refusal(FileError::not_writable, path)
          .hint("give a path in a folder that you may write to")
          .with("system", reason(error));
  }
}

/// Writes all bytes; 0, or errno.
int write_all(int fd, std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t written = ::write(fd, contents.data(), contents.size());
    if (written < 0 && errno != EINTR) {
      return errno;
    }
    contents.remove_prefix(written < 0 ? 0 : static_cast<std::size_t>(written));
  }
  return 0;
}

/// A name beside `path` that nobody else uses: the process and a counter make it unique.
std::string temporary_beside(const std::string& path) {
  static std::atomic<unsigned> counter{0};
  const fs::path target(path);
  return (target.parent_path() /
          fmt::format(".{}.{}-{}.tmp", target.filename().string(), ::getpid(), ++counter))
      .string();
}

Refusal not_a_file(const std::string& path, std::string what, std::string hint) {
  return refusal(FileError::not_a_file, path, "the path")
      .got(std::move(what))
      .expected("a file, or a pipe that something writes to")
      .hint(std::move(hint));
}

/// Of what may be read; a device may wait for ever or never end.
Expected<struct stat> status_of(int fd, const std::string& path) {
  struct stat status{};
  if (::fstat(fd, &status) != 0) {
    return refusal(FileError::not_readable, path).with("system", reason(errno));
  }
  if (S_ISDIR(status.st_mode)) {
    return refusal(FileError::is_a_folder, path, "the path")
        .got("a folder")
        .expected("a file")
        .hint("give one of the files in it");
  }
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) {
    return not_a_file(path, ::isatty(fd) == 1 ? "a terminal" : "a device",
                      "give the name of the file");
  }
  return status;
}

}  // namespace

ErrorInfo error_info(FileError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_found", "there is no such file", ErrorKind::environment},
      {"is_a_folder", "the path is a folder", ErrorKind::misuse},
      {"not_a_folder", "the path is not a folder", ErrorKind::misuse},
      {"not_a_file", "the path is not a file", ErrorKind::misuse},
      {"not_readable", "the file cannot be read", ErrorKind::environment},
      {"not_writable", "the path cannot be written", ErrorKind::environment},
      {"too_large", "the file is too large", ErrorKind::misuse},
      {"folder_in_use", "the folder holds something else", ErrorKind::misuse},
  };
  return detail::info_of(code, "file", rows);
}

Expected<std::string> read_file(const std::string& path, std::size_t max_bytes) {
  // Not blocking: a named pipe that nobody writes to would be waited for, for ever.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file.get() < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR) {
      return refusal(FileError::not_found, path, "the file")
          .got("missing")
          .hint("check the spelling and the folder");
    }
    return refusal(FileError::not_readable, path)
        .hint("check its permissions")
        .with("system", reason(error));
  }
  FLYBALL_TRY(const auto status, status_of(file.get(), path));
  const bool pipe = S_ISFIFO(status.st_mode);
  std::string contents;
  // A regular file says its size, which is a hint and not a promise; pipes say 0.
  const auto announced = static_cast<std::size_t>(std::max<off_t>(status.st_size, 0));
  std::size_t used = 0;
  for (;;) {
    if (used > max_bytes || announced > max_bytes) {
      return refusal(FileError::too_large, path, "the file")
          .got(fmt::format("longer than {} bytes", max_bytes));
    }
    constexpr std::size_t chunk = std::size_t{1} << 16;
    contents.resize(used == 0 ? std::max(announced + 1, chunk)
                              : std::max(contents.size(), used + chunk));
    const ssize_t got = ::read(file.get(), contents.data() + used, contents.size() - used);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0 && errno == EAGAIN && pipe) {
      // Somebody holds the other end: what is not written yet may be waited for.
      ::fcntl(file.get(), F_SETFL, ::fcntl(file.get(), F_GETFL) & ~O_NONBLOCK);
      continue;
    }
    if (got == 0 && used == 0 && pipe) {
      return not_a_file(path, "an empty pipe that nothing writes to",
                        "start the program that writes to it first");
    }
    if (got < 0) {
      return refusal(FileError::not_readable, path).with("system", reason(errno));
    }
    if (got == 0) {
      break;
    }
    used += static_cast<std::size_t>(got);
  }
  contents.resize(used);
  contents.shrink_to_fit();
  return contents;
}

Expected<void> write_file_atomically(const std::string& path, std::string_view contents) {
  struct stat status{};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) {
    return cannot_write(path, EISDIR);
  }
  if (exists && !S_ISREG(status.st_mode)) {
    // Not blocking, or a pipe without a reader is waited for; with one, it may be full meanwhile.
    const Descriptor device(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (device.get() >= 0) {
      ::fcntl(device.get(), F_SETFL, ::fcntl(device.get(), F_GETFL) & ~O_NONBLOCK);
    }
    const int error = device.get() < 0 ? errno : write_all(device.get(), contents);
    return error == 0 ? Expected<void>{} : cannot_write(path, error);
  }
  const std::lock_guard lock(io::writing());
  std::error_code ignored;
  const std::string target =
      fs::is_symlink(path, ignored) && exists ? fs::canonical(path, ignored).string() : path;
  const std::string temporary = temporary_beside(target);
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) {
    return cannot_write(path, errno);
  }
  if (exists) {
    ::fchmod(file.get(), status.st_mode & 07777);
  }
  int error = write_all(file.get(), contents);
  if (!file.close() && error == 0) {
    error = errno;
  }
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) {
    error = errno;
  }
  if (error != 0) {
    ::unlink(temporary.c_str());
    return cannot_write(path, error);
  }
  return {};
}

}  // namespace flyball
