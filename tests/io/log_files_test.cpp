#include <flyball/io/log_files.hpp>

#include <filesystem>

#include <gtest/gtest.h>

#include <flyball/io/checksum.hpp>
#include <flyball/io/file.hpp>

#include "temporary_folder.hpp"

namespace flyball::log_files_test {
namespace {

namespace fs = std::filesystem;

TEST(LogFiles, AreFoundByTheirNamesInAnyDepth) {
  const TemporaryFolder folder;
  folder.put("logs/2026/b.wpilog", "");
  folder.put("logs/a.JSON", "");
  folder.put("logs/c.Csv", "");
  folder.put("logs/notes.md", "");
  folder.put("logs/.hidden.csv", "");
  folder.put("logs/.git/x.json", "");
  folder.put("logs/report/.flyball-report", "");
  folder.put("logs/report/data/run.csv", "");
  folder.put("logs/out/logs.csv", "");
  folder.put("elsewhere/linked.csv", "");
  fs::create_symlink(folder.file("elsewhere/linked.csv"), folder.file("logs/link.csv"));
  fs::create_directory_symlink(folder.file("logs"), folder.file("logs/round"));
  fs::create_symlink(folder.file("nowhere"), folder.file("logs/dangling.csv"));

  const auto found = find_log_files(folder.file("logs"), folder.file("logs/out"));
  ASSERT_TRUE(found) << to_string(found.error());
  EXPECT_EQ(found->paths,
            (std::vector<std::string>{folder.file("logs/2026/b.wpilog"), folder.file("logs/a.JSON"),
                                      folder.file("logs/c.Csv"), folder.file("logs/link.csv")}));
  EXPECT_EQ(found->passed_over, 1U);
  EXPECT_EQ(find_log_files(folder.file("logs/") + "/./")->paths, [&] {
    auto more = found->paths;
    more.push_back(folder.file("logs/out/logs.csv"));
    return more;
  }());
}

TEST(LogFiles, RefuseWhatIsNoFolder) {
  const TemporaryFolder folder;
  folder.put("a.csv", "");
  EXPECT_TRUE(find_log_files(folder.file("missing")).error().is(FileError::not_found));
  EXPECT_TRUE(find_log_files(folder.file("a.csv")).error().is(FileError::not_a_folder));
}

// Values of RFC 9923's reference implementation.
TEST(Checksum, IsFnv1a) {
  static_assert(checksum("") == 0xcbf29ce484222325U);
  static_assert(checksum("a") == 0xaf63dc4c8601ec8cU);
  static_assert(checksum("foobar") == 0x85944171f73967e8U);
  static_assert(checksum("bar", checksum("foo")) == 0x85944171f73967e8U);
}

}  // namespace
}  // namespace flyball::log_files_test
