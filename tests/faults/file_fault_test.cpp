#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <flyball/io/file.hpp>
#include <flyball/io/output_folder.hpp>

#include "faults/file_fault.hpp"

/// Every operation on files fails once, and the process is killed at each: what a reader finds is
/// the old or the new, and of failures nothing is left behind.
namespace flyball::test {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;

class FileFaults : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "flyball-faults-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Every file below the folder, and what it holds.
  [[nodiscard]] Files files() const {
    Files found;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.is_regular_file()) {
        std::ifstream stream(entry.path(), std::ios::binary);
        found[fs::relative(entry.path(), folder_).string()] =
            std::string(std::istreambuf_iterator<char>(stream), {});
      }
    }
    return found;
  }

  fs::path folder_;
};

const std::string big_text(200'000, 'x');

/// @param more  A file that other reports do not have.
Expected<void> write_report(const std::string& path, const std::string& text,
                            const std::string& more = "") {
  auto report = OutputFolder::create(path);
  if (!report) {
    return tl::unexpected(report.error());
  }
  for (const std::string& name : {std::string("index.html"), std::string("data/fit.csv"), more}) {
    if (name.empty()) {
      continue;
    }
    if (auto written = report->write(name, text); !written) {
      return written;
    }
  }
  return report->commit();
}

/// A report whose files hold `text`, and nothing that is not whole.
void expect_whole(const Files& files, const std::string& text, std::size_t k) {
  EXPECT_EQ(files.count("report/index.html"), 1U) << k;
  EXPECT_EQ(files.count("report/data/fit.csv"), 1U) << k;
  EXPECT_EQ(files.count("report/" + std::string(OutputFolder::marker)), 1U) << k;
  EXPECT_TRUE(files.at("report/index.html") == text) << k;
  EXPECT_TRUE(files.at("report/data/fit.csv") == text) << k;
}

TEST_F(FileFaults, AFileIsTheOldOrTheNew) {
  const std::string path = folder_ / "a.toml";
  ASSERT_TRUE(write_file_atomically(path, "old"));
  std::size_t k = 0;
  for (bool struck = true; struck;) {
    ++k;
    Expected<void> written;
    {
      FileFault fault(k, FileFault::What::fails);
      written = write_file_atomically(path, big_text);
      struck = fault.struck();
    }
    if (struck) {
      ASSERT_FALSE(written) << k;
      EXPECT_TRUE(written.error().is(FileError::not_writable)) << to_string(written.error());
      EXPECT_EQ(files(), (Files{{"a.toml", "old"}})) << k;
    }
  }
  EXPECT_GE(k, 4U);  // open, write, rename
  EXPECT_EQ(files(), (Files{{"a.toml", big_text}}));
}

TEST_F(FileFaults, AFileThatAKillLeavesIsTheOldOrTheNew) {
  const std::string path = folder_ / "a.toml";
  int status = 99;
  std::size_t k = 0;
  while (status == 99) {
    ++k;
    ASSERT_TRUE(write_file_atomically(path, "old"));
    const pid_t child = ::fork();
    if (child == 0) {
      FileFault fault(k, FileFault::What::kills);
      ::_exit(write_file_atomically(path, big_text) ? 0 : 1);
    }
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << k;
    status = WEXITSTATUS(status);
    EXPECT_TRUE(files().at("a.toml") == (status == 99 ? "old" : big_text)) << k;
  }
  EXPECT_EQ(status, 0);
  EXPECT_GE(k, 4U);
}

TEST_F(FileFaults, AReportIsTheOldOrTheNew) {
  const std::string path = folder_ / "report";
  for (const int error : {ENOSPC, EIO}) {
    ASSERT_TRUE(write_report(path, "old"));
    const Files before = files();
    std::size_t k = 0;
    for (bool struck = true; struck;) {
      ++k;
      Expected<void> written;
      {
        FileFault fault(k, FileFault::What::fails, error);
        written = write_report(path, big_text);
        struck = fault.struck();
      }
      if (struck && !written) {
        EXPECT_TRUE(files() == before) << k;
      } else if (struck) {
        // What failed was not needed: a link to what would be put back.
        expect_whole(files(), big_text, k);
        ASSERT_TRUE(write_report(path, "old")) << k;
      }
    }
    EXPECT_GE(k, 10U);
    expect_whole(files(), big_text, k);
  }
}

class KilledReport : public FileFaults, public testing::WithParamInterface<bool> {};

// At each operation, into a folder that holds files of the user's, and with the parameter a folder
// of the user's too: that is not made again, so that the report's files are replaced one by one.
TEST_P(KilledReport, IsTheOldOrTheNewAndKnownToTheNextRun) {
  const std::string path = folder_ / "report";
  Files mine{{"report/note.txt", "mine"}, {"report/data/mine.csv", "mine too"}};
  if (GetParam()) {
    mine["report/notes/today.txt"] = "mine";
  }
  int status = 99;
  std::size_t k = 0;
  std::size_t mixed = 0;
  while (status == 99) {
    ++k;
    ASSERT_TRUE(write_report(path, "old", "old/plot.svg")) << k;
    for (const auto& [name, text] : mine) {
      fs::create_directories((folder_ / name).parent_path());
      ASSERT_TRUE(write_file_atomically(folder_ / name, text));
    }
    const pid_t child = ::fork();
    if (child == 0) {
      FileFault fault(k, FileFault::What::kills);
      ::_exit(write_report(path, big_text, "new/plot.svg") ? 0 : 1);
    }
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status)) << k;
    status = WEXITSTATUS(status);
    const Files left = files();
    const auto holds = [&](const std::string& name, const std::string& text) {
      const auto file = left.find("report/" + name);
      return file != left.end() && file->second == text;
    };
    const auto whole = [&](const std::string& text, const char* more, const char* other) {
      return holds("index.html", text) && holds("data/fit.csv", text) && holds(more, text) &&
             !left.contains(std::string("report/") + other);
    };
    mixed += !whole("old", "old/plot.svg", "new/plot.svg") &&
             !whole(big_text, "new/plot.svg", "old/plot.svg");
    for (const char* name : {"index.html", "data/fit.csv"}) {
      EXPECT_TRUE(holds(name, "old") || holds(name, big_text)) << name << k;
    }
    // What only one of them has is there as long as that one is not replaced.
    EXPECT_TRUE(holds("old/plot.svg", "old") || holds("new/plot.svg", big_text)) << k;
    for (const auto& [name, text] : mine) {
      EXPECT_TRUE(left.contains(name) && left.at(name) == text) << name << k;
    }

    ASSERT_TRUE(write_report(path, "next")) << k;
    Files next = files();
    next.erase("report/" + std::string(OutputFolder::marker));
    Files expected = mine;
    expected["report/index.html"] = expected["report/data/fit.csv"] = "next";
    EXPECT_EQ(next, expected) << k;
  }
  EXPECT_EQ(status, 0);
  EXPECT_GE(k, 30U);
  EXPECT_TRUE(GetParam() || mixed == 0) << mixed;
}

INSTANTIATE_TEST_SUITE_P(FileFaults, KilledReport, testing::Bool());

TEST_F(FileFaults, ANewReportThatAKillLeavesIsWholeOrAbsent) {
  const std::string path = folder_ / "report";
  int status = 99;
  for (std::size_t k = 1; status == 99; ++k) {
    const pid_t child = ::fork();
    if (child == 0) {
      FileFault fault(k, FileFault::What::kills);
      ::_exit(write_report(path, big_text) ? 0 : 1);
    }
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    if (fs::exists(path)) {
      expect_whole(files(), big_text, k);
    }
    ASSERT_TRUE(write_report(path, "next")) << k;
    EXPECT_EQ(files().size(), 3U) << k;
    fs::remove_all(path);
  }
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace flyball::test
