#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>

/// Runs the built command as a shell would.
namespace flyball::test {

struct Answer {
  int status = -1;
  std::string out;
  std::string err;
};

inline std::string contents(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A folder of the test's own, empty, and gone after it.
class Command : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "flyball-apps-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    ::setenv("LC_ALL", "C.UTF-8", 1);
    ::unsetenv("COLUMNS");
    folder_ = pattern;
    std::filesystem::create_directory(work());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Where the command runs.
  [[nodiscard]] std::filesystem::path work() const { return folder_ / "work"; }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(work() / name, std::ios::binary) << text;
  }

  /// @param arguments  As typed in a shell, in the test's folder.
  /// @param input  The file that is the standard input.
  [[nodiscard]] Answer run(const std::string& arguments,
                           const std::string& input = "/dev/null") const {
    const std::string line = "cd '" + work().string() + "' && '" FLYBALL_COMMAND "' " + arguments +
                             " >../out 2>../err <'" + input + "'";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            contents(folder_ / "out"), contents(folder_ / "err")};
  }

  /// Names in the folder that the command runs in.
  [[nodiscard]] std::size_t files() const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(work())) {
      ++count;
    }
    return count;
  }

 private:
  std::filesystem::path folder_;
};

inline bool holds(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

inline std::string example(const std::string& name) {
  return std::string("'") + FLYBALL_EXAMPLES + "/" + name + "'";
}

}  // namespace flyball::test
