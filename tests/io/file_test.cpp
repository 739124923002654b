#include <flyball/io/file.hpp>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/examples.hpp"
#include "io/temporary_folder.hpp"

namespace flyball::file_test {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

TEST(ReadFile, GivesTheBytes) {
  const TemporaryFolder folder;
  std::string bytes("a\0b\n", 4);
  bytes.resize(200'000, 'x');
  EXPECT_EQ(read_file(folder.put("a", bytes)).value(), bytes);
  EXPECT_EQ(read_file(folder.put("empty", "")).value(), "");
}

TEST(ReadFile, RefusesWhatIsTooLarge) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "12345");
  EXPECT_TRUE(read_file(path, 5));
  EXPECT_TRUE(read_file(path, 4).error().is(FileError::too_large));
}

TEST(ReadFile, Errors) {
  const TemporaryFolder folder;
  EXPECT_TRUE(read_file(folder.file("no")).error().is(FileError::not_found));
  EXPECT_TRUE(read_file("").error().is(FileError::not_found));
  EXPECT_TRUE(read_file(folder.put("a", "") + "/b").error().is(FileError::not_found));
  EXPECT_TRUE(read_file(folder.file(".")).error().is(FileError::is_a_folder));
  if (::geteuid() != 0) {  // root may read everything
    const std::string secret = folder.put("secret", "x");
    ::chmod(secret.c_str(), 0);
    EXPECT_TRUE(read_file(secret).error().is(FileError::not_readable));
  }
}

// Nothing that could be waited for, or that has no end, is opened as a file.
TEST(ReadFile, RefusesDevicesAndForgottenPipes) {
  EXPECT_TRUE(read_file("/dev/zero").error().is(FileError::not_a_file));
  EXPECT_TRUE(read_file("/dev/null").error().is(FileError::not_a_file));
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(to_string(read_file(pipe).error()),
            pipe +
                ": the path is an empty pipe that nothing writes to; it must be a file, or a pipe "
                "that something writes to; start the program that writes to it first");
  EXPECT_TRUE(write_file_atomically(pipe, "x").error().is(FileError::not_writable));
}

// A writer that takes its time is waited for, whether it is late or writes more than a pipe holds.
TEST(ReadFile, ReadsPipesToTheirEnd) {
  const TemporaryFolder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string bytes(200'000, 'x');
  const int ours = ::open(pipe.c_str(), O_RDWR | O_CLOEXEC);  // neither end waits for the other
  ASSERT_GE(ours, 0);
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(write_file_atomically(pipe, bytes));
    ::close(ours);
  });
  const auto read = read_file(pipe);
  writer.join();
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(*read, bytes);
}

TEST(WriteFileAtomically, ReplacesAndKeepsTheMode) {
  const TemporaryFolder folder;
  const std::string path = folder.put("a", "old");
  ::chmod(path.c_str(), 0600);
  ASSERT_TRUE(write_file_atomically(path, "new"));
  EXPECT_EQ(folder.get("a"), "new");
  struct stat status{};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  EXPECT_EQ(folder.names(), Names{"a"});
}

TEST(WriteFileAtomically, FollowsALink) {
  const TemporaryFolder folder;
  folder.put("target", "old");
  fs::create_symlink("target", folder.file("link"));
  ASSERT_TRUE(write_file_atomically(folder.file("link"), "new"));
  EXPECT_TRUE(fs::is_symlink(folder.file("link")));
  EXPECT_EQ(folder.get("target"), "new");
}

TEST(WriteFileAtomically, LeavesNothingBehindOnAnError) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("folder"));
  EXPECT_TRUE(write_file_atomically(folder.file("folder"), "x").error().is(FileError::is_a_folder));
  EXPECT_TRUE(write_file_atomically(folder.file("no/a"), "x").error().is(FileError::not_found));
  EXPECT_TRUE(write_file_atomically("", "x").error().is(FileError::not_found) ||
              write_file_atomically("", "x").error().is(FileError::not_writable));
  EXPECT_TRUE(
      write_file_atomically(folder.put("f", "") + "/a", "x").error().is(FileError::not_writable));
  EXPECT_EQ(folder.names(), (Names{"folder", "f"}));
  // /dev/full takes no byte.
  EXPECT_TRUE(write_file_atomically("/dev/full", "x").error().is(FileError::not_writable));
  EXPECT_TRUE(write_file_atomically("/dev/null", "x"));
}

}  // namespace
}  // namespace flyball::file_test
