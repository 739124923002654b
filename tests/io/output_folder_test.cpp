#include <flyball/io/output_folder.hpp>

#include <csignal>
#include <filesystem>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <flyball/io/file.hpp>

#include "io/temporary_folder.hpp"

namespace flyball::output_folder_test {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

/// Writes a report of files that hold their names.
Expected<void> report_of(const std::string& path, const Names& names) {
  Expected<OutputFolder> report = OutputFolder::create(path);
  if (!report) {
    return tl::unexpected(report.error());
  }
  for (const std::string& name : names) {
    if (auto written = report->write(name, name); !written) {
      return written;
    }
  }
  return report->commit();
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
  Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
  ASSERT_TRUE(report);
  ASSERT_TRUE(report->write("data/run", "x"));
  const Expected<void> written = report->write("data", "a folder is there");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().where(), folder.file("report/data"));
}

TEST(OutputFolder, NamesStayInside) {
  const TemporaryFolder folder;
  Expected<OutputFolder> report = OutputFolder::create(folder.file("report"));
  ASSERT_TRUE(report);
  for (const char* name : {"../escaped", "a/../../escaped", "/tmp/flyball-escaped", ""}) {
    EXPECT_TRUE(report->write(name, "x").error().is(FileError::not_writable)) << name;
  }
}

// What a person puts into a report stays, whatever the next report holds.
TEST(OutputFolder, OnlyWhatItWroteGoes) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  ASSERT_TRUE(report_of(path, {"index.html", "data/old.csv", "old/deep/a.csv"}));
  folder.put("report/log.json", "the only copy");
  folder.put("report/data/mine.csv", "mine");
  ASSERT_TRUE(report_of(path, {"index.html", "data/new.csv"}));
  EXPECT_EQ(folder.names("report"), (Names{".flyball-report", "index.html", "data", "log.json"}));
  EXPECT_EQ(folder.names("report/data"), (Names{"new.csv", "mine.csv"}));
  EXPECT_EQ(folder.get("report/log.json"), "the only copy");
}

TEST(OutputFolder, AChangedFileIsNotOverwritten) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  ASSERT_TRUE(report_of(path, {"gains.toml", "index.html"}));
  folder.put("report/gains.toml", "gains.tomL");  // of the same size
  const Expected<OutputFolder> refused = OutputFolder::create(path);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().is(FileError::folder_in_use));
  EXPECT_EQ(refused.error().where(), path + "/gains.toml");
  EXPECT_EQ(folder.get("report/gains.toml"), "gains.tomL");
  fs::remove(folder.file("report/gains.toml"));
  EXPECT_TRUE(report_of(path, {"gains.toml"}));  // gone is not changed
  EXPECT_EQ(folder.names("report"), (Names{".flyball-report", "gains.toml"}));
}

TEST(OutputFolder, ANameThatAnotherFileHasIsRefused) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  ASSERT_TRUE(report_of(path, {"index.html"}));
  folder.put("elsewhere/fit.csv", "far away");
  fs::create_directory_symlink(folder.file("elsewhere"), folder.file("report/data"));
  folder.put("report/gains.toml", "mine");
  for (const char* name : {"gains.toml", "data/fit.csv"}) {
    const Expected<void> refused = report_of(path, {"index.html", name});
    ASSERT_FALSE(refused) << name;
    EXPECT_TRUE(refused.error().is(FileError::folder_in_use));
  }
  EXPECT_EQ(folder.get("report/gains.toml"), "mine");
  EXPECT_EQ(folder.get("elsewhere/fit.csv"), "far away");
  EXPECT_EQ(folder.names("report"), (Names{".flyball-report", "index.html", "data", "gains.toml"}));
}

TEST(OutputFolder, AMarkerThatLiesLeadsNowhere) {
  const TemporaryFolder folder;
  folder.put("thesis", "thesis");
  ASSERT_TRUE(report_of(folder.file("report"), {"thesis"}));
  std::string marker = folder.get("report/.flyball-report");
  marker.replace(marker.rfind(" thesis"), 7, " ../thesis");
  folder.put("report/.flyball-report", marker + "no line\nffffffffffffffffff 1 x\n");
  fs::remove(folder.file("report/thesis"));
  ASSERT_TRUE(report_of(folder.file("report"), {"a"}));
  EXPECT_EQ(folder.get("thesis"), "thesis");
}

struct stat status_of(const std::string& path) {
  struct stat status{};
  EXPECT_EQ(::stat(path.c_str(), &status), 0) << path;
  return status;
}

TEST(OutputFolder, TheFolderStaysAsOpenAsItWas) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  fs::create_directories(path + "/data");
  if (::geteuid() == 0) {
    ASSERT_EQ(::chown(path.c_str(), 65534, 65533), 0);
  }
  ASSERT_EQ(::chmod(path.c_str(), 02750), 0);
  const struct stat before = status_of(path);
  fs::remove(path + "/data");
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(report_of(path, {"index.html", "data/a.csv"}));
    const struct stat after = status_of(path);
    EXPECT_EQ(before.st_mode, after.st_mode);
    EXPECT_EQ(before.st_uid, after.st_uid);
    EXPECT_EQ(before.st_gid, after.st_gid);
    if (k > 0) {
      EXPECT_EQ(status_of(path + "/data").st_mode & 07777, 0710U);
      EXPECT_EQ(folder.get("report/data/mine.csv"), "mine");
    }
    ASSERT_EQ(::chmod((path + "/data").c_str(), 0710), 0);
    folder.put("report/data/mine.csv", "mine");
  }
}

// Their relative paths would lead into a folder that is gone.
TEST(OutputFolder, WhoWorksInTheFolderKeepsIt) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  ASSERT_TRUE(report_of(path, {"index.html", "old.csv"}));
  const ino_t before = status_of(path).st_ino;
  const fs::path here = fs::current_path();
  fs::current_path(path);
  EXPECT_TRUE(report_of(".", {"index.html"}));
  EXPECT_TRUE(report_of("./", {"index.html"}));
  fs::current_path(here);
  EXPECT_EQ(status_of(path).st_ino, before);

  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    (void)!::write(ready[1], ::chdir(path.c_str()) == 0 ? "y" : "n", 1);
    for (;;) {
      ::pause();
    }
  }
  char arrived = 'n';
  ASSERT_EQ(::read(ready[0], &arrived, 1), 1);
  EXPECT_EQ(arrived, 'y');
  EXPECT_TRUE(report_of(path, {"index.html"}));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
  if (fs::exists("/proc/self/cwd")) {
    EXPECT_EQ(status_of(path).st_ino, before);
  }
  EXPECT_EQ(folder.names("report"), (Names{".flyball-report", "index.html"}));
}

TEST(OutputFolder, WhatIsNotOfTheReportIsTheSameAfterIt) {
  const TemporaryFolder folder;
  const std::string path = folder.file("report");
  ASSERT_TRUE(report_of(path, {"index.html", "data/a.csv"}));
  folder.put("report/log.json", "the only copy");
  fs::create_symlink("../elsewhere", path + "/link");
  const struct stat log = status_of(path + "/log.json");
  ASSERT_TRUE(report_of(path, {"index.html", "b.csv"}));
  EXPECT_EQ(status_of(path + "/log.json").st_ino, log.st_ino);
  EXPECT_EQ(status_of(path + "/log.json").st_nlink, 1U);
  EXPECT_EQ(fs::read_symlink(path + "/link"), "../elsewhere");
  EXPECT_EQ(folder.names("report"),
            (Names{".flyball-report", "b.csv", "index.html", "link", "log.json"}));
  EXPECT_EQ(folder.names(), Names{"report"});

  // A folder of the user's is not made again: the report's files are replaced one by one.
  folder.put("report/notes/today.txt", "mine");
  const ino_t notes = status_of(path + "/notes").st_ino;
  ASSERT_TRUE(report_of(path, {"index.html", "notes.csv"}));
  EXPECT_EQ(status_of(path + "/notes").st_ino, notes);
  EXPECT_EQ(folder.get("report/notes/today.txt"), "mine");
  EXPECT_EQ(folder.names("report"),
            (Names{".flyball-report", "index.html", "link", "log.json", "notes", "notes.csv"}));
  EXPECT_EQ(folder.names(), Names{"report"});
}

TEST(OutputFolder, LinksLeadToTheirFolderOrAreRefused) {
  const TemporaryFolder folder;
  fs::create_directory_symlink(folder.file("missing"), folder.file("dangling"));
  EXPECT_TRUE(OutputFolder::create(folder.file("dangling")).error().is(FileError::not_a_folder));
  EXPECT_EQ(folder.names(), Names{"dangling"});
  fs::create_directory(folder.file("missing"));
  ASSERT_TRUE(report_of(folder.file("dangling"), {"a"}));
  EXPECT_TRUE(fs::is_symlink(folder.file("dangling")));
  EXPECT_EQ(folder.names("missing"), (Names{".flyball-report", "a"}));
}

// Whatever a killed process leaves, the next run sweeps it, and what a living one builds it leaves.
TEST(OutputFolder, SweepsWhatAKilledProcessLeft) {
  const TemporaryFolder folder;
  ASSERT_TRUE(report_of(folder.file("old"), {"a"}));
  fs::create_directory(folder.file("empty"));
  for (const char* name : {"new", "old", "empty"}) {
    const pid_t child = ::fork();
    if (child == 0) {
      auto report = OutputFolder::create(folder.file(name));
      if (report && report->write("data/b", "b")) {
        ::raise(SIGKILL);
      }
      ::_exit(1);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
  }
  EXPECT_EQ(folder.names().size(), 5U);  // old, empty and what the three left
  Expected<OutputFolder> living = OutputFolder::create(folder.file("old"));
  ASSERT_TRUE(living);
  for (const char* name : {"new", "old", "empty"}) {
    const Expected<void> written = report_of(folder.file(name), {"c"});
    ASSERT_TRUE(written) << to_string(written.error());
  }
  EXPECT_TRUE(fs::exists(living->path()));
  EXPECT_TRUE(living->write("c", "c"));
  EXPECT_TRUE(living->commit());
  EXPECT_EQ(folder.names(), (Names{"new", "old", "empty"}));
  for (const char* name : {"new", "old", "empty"}) {
    EXPECT_EQ(folder.names(name), (Names{".flyball-report", "c"})) << name;
  }
}

TEST(OutputFolder, WhoIsToldToEndLeavesNothing) {
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) {
    auto report = OutputFolder::create(folder.file("a/b/report"));
    if (report && report->write("data/b", "b")) {
      OutputFolder::abandon_all();
      ::_exit(0);
    }
    ::_exit(1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(folder.names(), Names{});
}

}  // namespace
}  // namespace flyball::output_folder_test
