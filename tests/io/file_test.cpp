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

namespace flyball {
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

TEST(OutputFolder, AppearsWholeOnCommit) {
  const TemporaryFolder folder;
  Expected<OutputFolder> report = OutputFolder::create(folder.file("deep/er/report/"));
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->write("index.html", "page"));
  ASSERT_TRUE(report->write("data/fit.csv", "table"));
  EXPECT_FALSE(fs::exists(folder.file("deep/er/report")));
  EXPECT_EQ(report->destination(), fs::canonical(folder.file("deep/er")).string() + "/report");
  const Expected<void> committed = report->commit();
  ASSERT_TRUE(committed) << to_string(committed.error());
  EXPECT_EQ(folder.names("deep/er"), Names{"report"});
  EXPECT_EQ(folder.names("deep/er/report"), (Names{".flyball-report", "data", "index.html"}));
  EXPECT_EQ(folder.get("deep/er/report/data/fit.csv"), "table");
  EXPECT_FALSE(report->commit());
  EXPECT_FALSE(report->write("late", ""));
}

TEST(OutputFolder, WithoutACommitNothingRemains) {
  const TemporaryFolder folder;
  {
    Expected<OutputFolder> report = OutputFolder::create(folder.file("a/b/report"));
    ASSERT_TRUE(report);
    ASSERT_TRUE(report->write("index.html", "page"));
    OutputFolder moved = std::move(*report);
    EXPECT_TRUE(fs::exists(moved.path()));
  }
  EXPECT_EQ(folder.names(), Names{});
}

TEST(OutputFolder, ReplacesAnEarlierReportAndAnEmptyFolder) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("report"));
  for (const std::string name : {"first", "second"}) {
    Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
    ASSERT_TRUE(report) << to_string(report.error());
    ASSERT_TRUE(report->write(name, name));
    ASSERT_TRUE(report->commit());
    EXPECT_EQ(folder.names("report"), (Names{".flyball-report", name}));
  }
  EXPECT_EQ(folder.names(), Names{"report"});
}

TEST(OutputFolder, RefusesWhatIsNotItsOwn) {
  const TemporaryFolder folder;
  folder.put("mine/thesis.tex", "years of work");
  const Expected<OutputFolder> used = OutputFolder::create(folder.file("mine"));
  ASSERT_FALSE(used);
  EXPECT_TRUE(used.error().is(FileError::folder_in_use));
  EXPECT_EQ(used.error().kind(), ErrorKind::misuse);
  folder.put("file", "x");
  EXPECT_TRUE(OutputFolder::create(folder.file("file")).error().is(FileError::not_a_folder));
  EXPECT_TRUE(OutputFolder::create(folder.file("file/x")).error().is(FileError::not_writable));
  EXPECT_TRUE(OutputFolder::create("").error().is(FileError::not_writable));
  EXPECT_TRUE(OutputFolder::create("/").error().is(FileError::not_writable));
  EXPECT_TRUE(OutputFolder::create("/proc/report").error().is(FileError::not_writable));
  EXPECT_EQ(folder.names(), (Names{"mine", "file"}));
  EXPECT_EQ(folder.get("mine/thesis.tex"), "years of work");
}

TEST(OutputFolder, ADestinationThatFillsUpMeanwhileIsLeftAlone) {
  const TemporaryFolder folder;
  Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
  ASSERT_TRUE(report);
  folder.put("report/thesis.tex", "years of work");
  EXPECT_TRUE(report->commit().error().is(FileError::folder_in_use));
  EXPECT_EQ(folder.get("report/thesis.tex"), "years of work");
}

// The folder that is being built has a passing name, which a message must not tell.
TEST(OutputFolder, ErrorsNameTheFolderThatWasAskedFor) {
  const TemporaryFolder folder;
  const Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
  ASSERT_TRUE(report);
  ASSERT_TRUE(report->write("data/run", "x"));
  const Expected<void> written = report->write("data", "a folder is there");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().where(), folder.file("report/data"));
}

TEST(OutputFolder, NamesStayInside) {
  const TemporaryFolder folder;
  const Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
  ASSERT_TRUE(report);
  for (const char* name : {"../escaped", "a/../../escaped", "/tmp/flyball-escaped", ""}) {
    EXPECT_TRUE(report->write(name, "x").error().is(FileError::not_writable)) << name;
  }
}

}  // namespace
}  // namespace flyball
