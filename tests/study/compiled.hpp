#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

/// A generated header, compiled with a program and run.
namespace flyball::study::test {

/// Numbers with all their bits.
inline std::string bits(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    char one[40];
    std::snprintf(one, sizeof one, "%a ", value);
    text += one;
  }
  return text + "\n";
}

/// What a program prints: numbers, a row a line that it was given.
/// @param name  Of the header. @param body  Of the loop over rows `n` of `columns` doubles; prints
/// with std::printf("%a …\n").
inline std::vector<double> run_compiled(const std::string& name, const std::string& header,
                                        int columns, const std::string& body,
                                        const std::string& input) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(testing::TempDir()) / (name + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / name) << header;
  std::ofstream(folder / "main.cpp")
      << "#include \"" << name << "\"\n#include <cstdio>\nint main() {\n  double n[" << columns
      << "];\n  while (true) {\n    for (double& value : n) {\n"
      << "      if (std::scanf(\"%lf\", &value) != 1) {\n        return 0;\n      }\n    }\n"
      << body << "  }\n}\n";
  std::ofstream(folder / "in") << input;
  const std::string line = "cd '" + folder.string() + "' && (" + FLYBALL_CXX +
                           " -std=c++17 -O1 -ffp-contract=off -fno-exceptions -Wall -Wextra "
                           "-Wpedantic -Wconversion -Wshadow -Werror main.cpp -o main && "
                           "./main < in > out) > log 2>&1";
  if (std::system(line.c_str()) != 0) {
    std::ifstream log(folder / "log");
    ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(log), {});
  }
  std::vector<double> values;
  std::ifstream file(folder / "out");
  std::string word;
  while (file >> word) {
    values.push_back(std::strtod(word.c_str(), nullptr));
  }
  fs::remove_all(folder);
  return values;
}

}  // namespace flyball::study::test
